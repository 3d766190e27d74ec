//! Where few rays find the light (a sunny patch, a lamp behind a shade) it takes more of them.
//!
//! A site's own rays are poor witnesses of their noise: those that missed the bright patch know nothing of it. Were only
//! those cast again that met it, all would come out too dark: by a tenth of the light in a room that is lit through the
//! gap of a door. So each site is judged by its neighbours alone.

use crate::gather::lattice_share;
use geometry::{Rgb, Vec3};

/// Sites in a neighbourhood at most, at least half as many.
const NEIGHBOURS: usize = 16;
/// Normals a right angle apart count as much as places this far apart, in units of the rooms' size.
const TURN: f32 = 0.25;

/// What the rays of one site saw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Witness {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    /// Direct light on what it sees, lx.
    pub(crate) direct: Rgb,
    /// Estimated variance of that (mean of the channels), lx².
    pub(crate) variance: f32,
    /// Rays that told so.
    pub(crate) rays: u32,
}

/// What the neighbours of a site say.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hearsay {
    /// Mean of their direct light (mean of the channels), lx.
    pub(crate) direct: f32,
    /// Mean variance of single rays, lx².
    pub(crate) single: f32,
}

impl Hearsay {
    /// Variance to be expected of `rays` rays, lx².
    pub(crate) fn variance(&self, rays: u32) -> f32 {
        lattice_share(rays) * self.single / rays as f32
    }
}

/// What the neighbours of each of `witnesses` say, itself left out.
///
/// - `scale`: size of the rooms, m.
pub(crate) fn hearsay(witnesses: &[Witness], scale: f32) -> Vec<Hearsay> {
    let points: Vec<[f32; 6]> = witnesses
        .iter()
        .map(|w| {
            let (p, n) = (w.position / scale.max(1e-30), w.normal * (TURN / std::f32::consts::SQRT_2));
            [p.x, p.y, p.z, n.x, n.y, n.z]
        })
        .collect();
    let mut heard = vec![Hearsay::default(); witnesses.len()];
    let mut all: Vec<u32> = (0..witnesses.len() as u32).collect();
    neighbourhoods(&points, &mut all, &mut |group| {
        let told = |i: u32| {
            let w = &witnesses[i as usize];
            let single = w.variance * w.rays as f32 / lattice_share(w.rays);
            (f64::from(w.direct.mean()), f64::from(single))
        };
        let (direct, single) =
            group.iter().map(|&i| told(i)).fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
        for &i in group {
            let own = if group.len() > 1 { told(i) } else { (0.0, 0.0) };
            let others = (group.len() - 1).max(1) as f64;
            heard[i as usize] = Hearsay {
                direct: ((direct - own.0) / others) as f32,
                single: ((single - own.1).max(0.0) / others) as f32,
            };
        }
    });
    heard
}

/// Calls `visit` for groups of near `points`, `all` of them.
fn neighbourhoods(points: &[[f32; 6]], all: &mut [u32], visit: &mut impl FnMut(&[u32])) {
    if all.len() <= NEIGHBOURS {
        if !all.is_empty() {
            visit(all);
        }
        return;
    }
    let (mut low, mut high) = ([f32::INFINITY; 6], [f32::NEG_INFINITY; 6]);
    for &i in all.iter() {
        for k in 0..6 {
            low[k] = low[k].min(points[i as usize][k]);
            high[k] = high[k].max(points[i as usize][k]);
        }
    }
    let widest = (0..6).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
    let middle = all.len() / 2;
    all.select_nth_unstable_by(middle, |&a, &b| {
        points[a as usize][widest].total_cmp(&points[b as usize][widest]).then(a.cmp(&b))
    });
    let (near, far) = all.split_at_mut(middle);
    neighbourhoods(points, near, visit);
    neighbourhoods(points, far, visit);
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::sampling::Rng;

    /// Sites in a dark row and in a bright one; a hundredth of the rays in the bright one see all of its light.
    #[test]
    fn what_a_site_is_told_does_not_depend_on_its_own_luck() {
        let (rays, chance, light) = (80, 0.01f32, 100.0f32);
        let mut rng = Rng::new(7, 0);
        let witnesses: Vec<Witness> = (0..20_000u32)
            .map(|i| {
                let lit = i % 2 == 1;
                let met = (0..rays).filter(|_| lit && rng.f32() < chance).count() as f32 / rays as f32;
                Witness {
                    position: Vec3::new(i as f32 * 1e-3, if lit { 5.0 } else { 0.0 }, 0.0),
                    normal: Vec3::Y,
                    direct: Rgb::splat(met * light),
                    variance: lattice_share(rays) * met * (1.0 - met) * light * light / rays as f32,
                    rays,
                }
            })
            .collect();
        let heard = hearsay(&witnesses, 1.0);
        let mean = |lucky: bool| {
            let of = witnesses.iter().zip(&heard).skip(1).step_by(2);
            let told: Vec<f32> =
                of.filter(|(w, _)| (w.direct.mean() > 0.0) == lucky).map(|(_, h)| h.single).collect();
            assert!(told.len() > 1000);
            told.iter().sum::<f32>() / told.len() as f32
        };
        let exact = chance * (1.0 - chance) * light * light;
        let (lucky, unlucky) = (mean(true), mean(false));
        assert!((lucky / unlucky - 1.0).abs() < 0.05, "{lucky} {unlucky}");
        assert!((lucky / exact - 1.0).abs() < 0.05, "{lucky} {exact}");
        assert!(
            heard.iter().step_by(2).all(|h| h.single == 0.0 && h.direct == 0.0),
            "the dark row hears of the bright one"
        );
    }
}
