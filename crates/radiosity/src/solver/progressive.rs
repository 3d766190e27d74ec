//! Progressive refinement (Cohen, Chen, Wallace and Greenberg, SIGGRAPH 1988): the patch with most light that it has
//! not yet sent out shoots it into the room; there is a picture after every shot.

use crate::form_factor::FormFactors;
use crate::form_factor::arrival::{Arrival, Way};
use crate::patches::{Patch, Patches};
use geometry::{Rgb, World};
use rayon::prelude::*;

/// Rays of one shot, least and most.
const RAYS: [f64; 2] = [4.0, 65_536.0];
/// Patches that shoot at once, at most: their rows are found in parallel and applied one after the other, so that the
/// last of them shoots a little out of turn.
const TOGETHER: usize = 64;

/// What every patch has received, and what it has yet to send out.
#[derive(Debug)]
pub struct Shooting<'a> {
    world: &'a World,
    patches: &'a Patches,
    how: &'a FormFactors,
    seed: u64,
    overshoot: bool,
    /// Straight from emitters that are patches, lx.
    pub direct: Vec<Rgb>,
    /// By way of other surfaces, lx.
    pub indirect: Vec<Rgb>,
    /// Own light yet to be sent out, lm/m².
    unshot_emission: Vec<Rgb>,
    /// Reflected light yet to be sent out, lm/m²; below 0 where more was sent than was there.
    unshot: Vec<Rgb>,
    /// Shots so far.
    pub shots: u64,
    /// Arrivals so far.
    pub arrivals: u64,
    /// Light that was sent out and arrived at no patch, lm.
    pub escaped: Rgb,
    /// Largest reflectance.
    largest: f32,
    /// Area mean of the reflectance.
    mean: Rgb,
    area: f32,
    /// Light that one ray carries, lm, so that all shots together have as many rays as the rows of a matrix.
    quantum: f64,
}

impl<'a> Shooting<'a> {
    /// Nothing was shot yet.
    ///
    /// - `reflected`: what leaves each patch of light that comes from no patch, lm/m²: it is to be shot too.
    /// - `overshoot`: whether a patch shoots what it is going to receive as well (Feda and Purgathofer, Eurographics
    ///   Rendering Workshop 1992).
    pub fn new(
        world: &'a World,
        patches: &'a Patches,
        how: &'a FormFactors,
        reflected: Vec<Rgb>,
        overshoot: bool,
        seed: u64,
    ) -> Shooting<'a> {
        let n = patches.len();
        let area: f32 = patches.all.iter().map(|p| p.area).sum();
        let mean =
            patches.all.iter().map(|p| p.reflectance * p.area).sum::<Rgb>() / area.max(f32::MIN_POSITIVE);
        let emission: Vec<Rgb> = patches.all.iter().map(|p| p.exitance).collect();
        let flux: f64 =
            (0..n).map(|i| f64::from(patches.all[i].area * (emission[i] + reflected[i]).mean())).sum();
        let rays = if let FormFactors::RayCast(rays) = how { f64::from(*rays) * n as f64 } else { 1.0 };
        // Over all bounces Φ / (1 − ρ) is shot.
        let quantum = flux / f64::from(1.0 - mean.mean().min(0.95)) / rays;
        Shooting {
            world,
            patches,
            how,
            seed,
            overshoot,
            direct: vec![Rgb::BLACK; n],
            indirect: vec![Rgb::BLACK; n],
            unshot_emission: emission,
            unshot: reflected,
            shots: 0,
            arrivals: 0,
            escaped: Rgb::BLACK,
            largest: patches.all.iter().map(|p| p.reflectance.max_channel()).fold(0.0, f32::max),
            mean,
            area,
            quantum,
        }
    }

    /// Shoots until `shots` shots were made, or nothing is left; fewer if `stop` says so, which is asked in between.
    pub fn shoot_until(&mut self, shots: u64, mut stop: impl FnMut(&Shooting) -> bool) {
        while self.shots < shots && !stop(self) {
            // The first ones count most, and are the pictures people look at: strictly in turn.
            let together = (1 + self.shots as usize / 16).min(TOGETHER).min((shots - self.shots) as usize);
            let chosen = self.brightest(together);
            if chosen.is_empty() {
                return;
            }
            let extra = self.expected();
            let rows: Vec<Vec<Arrival>> =
                chosen.par_iter().enumerate().map(|(k, &i)| self.row(i, self.shots + k as u64)).collect();
            for (&i, row) in chosen.iter().zip(&rows) {
                self.shoot(i, row, extra);
            }
        }
    }

    /// The patches with most unshot light, brightest first; ties in their order.
    fn brightest(&self, most: usize) -> Vec<u32> {
        let extra = self.expected();
        let mut all: Vec<(f32, u32)> = (0..self.patches.len() as u32)
            .into_par_iter()
            .map(|i| (self.to_shoot(i, extra), i))
            .filter(|&(flux, _)| flux > 0.0)
            .collect();
        let order = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if all.len() > most {
            all.select_nth_unstable_by(most, order);
            all.truncate(most);
        }
        all.sort_unstable_by(order);
        all.into_iter().map(|(_, i)| i).collect()
    }

    /// |ΔB| A of a patch, lm, mean of the channels, what it is going to receive included.
    fn to_shoot(&self, i: u32, extra: Rgb) -> f32 {
        let (i, p) = (i as usize, &self.patches.all[i as usize]);
        let b = self.unshot_emission[i] + self.unshot[i] + p.reflectance * extra;
        b.map(f32::abs).mean() * p.area
    }

    /// Irradiance that patches are expected to receive yet and may shoot beforehand; none without overshooting.
    fn expected(&self) -> Rgb {
        if self.overshoot { self.ambient().1.max(Rgb::BLACK) } else { Rgb::BLACK }
    }

    fn row(&self, patch: u32, shot: u64) -> Vec<Arrival> {
        match self.how {
            FormFactors::RayCast(_) => {
                let rays = f64::from(self.to_shoot(patch, self.expected())) / self.quantum.max(1e-300);
                let rays = rays.clamp(RAYS[0], RAYS[1]) as u32;
                FormFactors::RayCast(rays).row(self.world, self.patches, patch, self.seed, shot)
            }
            how => how.row(self.world, self.patches, patch, self.seed, shot),
        }
    }

    fn shoot(&mut self, from: u32, row: &[Arrival], extra: Rgb) {
        let i = from as usize;
        let source = &self.patches.all[i];
        let ahead = source.reflectance * extra;
        let emission = std::mem::take(&mut self.unshot_emission[i]);
        let reflected = std::mem::replace(&mut self.unshot[i], ahead * -1.0) + ahead;
        let mut arrived = Rgb::BLACK;
        for a in row {
            let (j, p) = (a.patch as usize, &self.patches.all[a.patch as usize]);
            if p.area <= 0.0 {
                continue;
            }
            // A_i F_ij = A_j F_ji.
            let f = a.share * (source.area / p.area);
            let direct = if a.way == Way::Straight { f * emission } else { Rgb::BLACK };
            let by_gloss = if a.way == Way::Rough { f * emission } else { Rgb::BLACK };
            let indirect = f * reflected + by_gloss;
            self.direct[j] += direct;
            self.indirect[j] += indirect;
            self.unshot[j] += p.reflectance * (direct + indirect);
            arrived += (direct + indirect) * p.area;
        }
        self.escaped += (emission + reflected) * source.area - arrived;
        self.shots += 1;
        self.arrivals += row.len() as u64;
    }

    /// Σ A |ΔB|, lm.
    pub fn unshot_flux(&self) -> Rgb {
        let flux = |(i, p): (usize, &Patch)| {
            (self.unshot_emission[i].map(f32::abs) + self.unshot[i].map(f32::abs)) * p.area
        };
        self.patches.all.iter().enumerate().map(flux).sum()
    }

    /// Σ A ΔB with its sign, lm.
    pub fn left(&self) -> Rgb {
        let flux = |(i, p): (usize, &Patch)| (self.unshot_emission[i] + self.unshot[i]) * p.area;
        self.patches.all.iter().enumerate().map(flux).sum()
    }

    /// Whether no more than `tolerance` of the light that arrives is missing.
    pub fn finished(&self, tolerance: f32) -> bool {
        self.bound() <= tolerance
    }

    /// Bytes held for the patches' light.
    pub fn bytes(&self) -> usize {
        4 * self.patches.len() * size_of::<Rgb>()
    }

    /// No more than this is missing from Σ A E, as a share of it: the unshot light over 1 − ρ_max, since what is still to
    /// be reflected is less each time.
    pub fn bound(&self) -> f32 {
        let arrived: f32 = self
            .patches
            .all
            .iter()
            .enumerate()
            .map(|(i, p)| (self.direct[i] + self.indirect[i]).mean() * p.area)
            .sum();
        let missing = self.unshot_flux().mean() / (1.0 - self.largest).max(1e-6);
        if missing <= 0.0 { 0.0 } else { missing / arrived.max(f32::MIN_POSITIVE) }
    }

    /// Irradiance that the unshot light will bring if it spreads evenly, direct and indirect, lx: Cohen's ambient term,
    /// `Σ A ΔB / Σ A / (1 − ρ_mean)`, of which unshot emission brings its first part directly.
    pub fn ambient(&self) -> (Rgb, Rgb) {
        let (mut emission, mut reflected) = (Rgb::BLACK, Rgb::BLACK);
        for (i, p) in self.patches.all.iter().enumerate() {
            emission += self.unshot_emission[i] * p.area;
            reflected += self.unshot[i] * p.area;
        }
        let share = 1.0 / self.area.max(f32::MIN_POSITIVE);
        let direct = emission * share;
        let gain = self.mean.map(|rho| 1.0 / (1.0 - rho.min(0.95)));
        (direct, (reflected * share + self.mean * direct) * gain)
    }
}
