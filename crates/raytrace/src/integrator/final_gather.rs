//! Where a surface that the eye sees gathers for itself instead of believing the mesh, with how many rays, and how far these
//! are then believed.
//!
//! With τ² the mean squared error expected of the mesh and v = κ σ²/n the variance of n rays, the best mixture of both is
//! off by τ² v/(τ² + v). Summed over the pixels that is least for its cost at n ∝ σ (1 − t²/τ²) (Lagrange): nothing where
//! τ is below some t, the full number where the mesh knows nothing. For a picture, t is the error asked.

use geometry::Rgb;
use geometry::sampling::Lattice2;
use radiosity::doubt::Doubt;

/// Fewer rays than this are not worth beginning.
const FEWEST: f32 = 16.0;
/// Nor a smaller share of the full number.
const LEAST: f32 = 0.125;
/// Standard deviations of a ray by the light there is that are believed: a site's own rays are poor witnesses.
const SPREAD: [f32; 2] = [0.5, 2.0];
/// Rungs of the ladder: half as many rays on each as on the one before.
const RUNGS: usize = 12;
/// Of the mean light, what is seen beside all.
const FLOOR: f32 = 0.1;
/// Full number of rays times the square of the error asked: half of it is left of a lattice of independent rays whose
/// standard deviation is as large as the light. Half as many are as good for their time in rooms, four times as many are not.
const RAYS: f32 = 0.5;

/// What surfaces may spend on gathers of their own.
#[derive(Clone, Debug)]
pub struct FinalGather {
    ladder: [Lattice2; RUNGS],
    /// Rays for a surface that the mesh knows nothing of, whose rays are as far apart as there is light.
    full: f32,
    /// Relative error of the mesh up to which it is believed.
    believed: f32,
    /// What is seen beside all light, lx.
    floor: f32,
}

/// What a surface gathered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gathered {
    /// Indirect irradiance, lx.
    pub e: Rgb,
    /// With how many rays.
    pub rays: u32,
    /// Variance of its luminance by their own spread, lx².
    pub variance: f32,
}

impl FinalGather {
    /// For a picture whose relative error is to be about `error`.
    pub fn for_error(error: f32, level: f32) -> FinalGather {
        let rays = (RAYS / (error * error).max(1e-6)).clamp(64.0, 1024.0);
        FinalGather::new(rays as u32, error, level)
    }

    /// - `rays`: of a surface of which the mesh knows nothing.
    /// - `believed`: relative error of the mesh that is let be.
    /// - `level`: mean indirect irradiance in the scene, lx.
    pub fn new(rays: u32, believed: f32, level: f32) -> FinalGather {
        let ladder = std::array::from_fn(|k| Lattice2::new(((2 * rays) >> k).max(1)));
        FinalGather { ladder, full: rays as f32, believed, floor: FLOOR * level }
    }

    /// The rays that a gather takes where the mesh is in `doubt`; none where it is not worth it.
    ///
    /// - `light`: irradiance that the error is seen beside, lx.
    /// - `part`: share of the pixel that the surface fills, (0, 1].
    pub fn rays(&self, doubt: Doubt, light: f32, part: f32) -> Option<&Lattice2> {
        self.wanted(doubt, light, part).map(|wanted| self.rung(wanted))
    }

    /// The same for one of `times` samples that a pixel takes of such surfaces, each seen by itself: its share, one ray at
    /// least, and how many all of them send together.
    pub fn some_rays(&self, doubt: Doubt, light: f32, part: f32, times: u32) -> Option<(&Lattice2, u32)> {
        let rays = self.rung(self.wanted(doubt, light, part)? / times.max(1) as f32);
        Some((rays, rays.len() * times.max(1)))
    }

    fn wanted(&self, doubt: Doubt, light: f32, part: f32) -> Option<f32> {
        let light = (light + self.floor).max(1e-30);
        let spread = (doubt.ray.sqrt() / light).clamp(SPREAD[0], SPREAD[1]);
        let unsure = (doubt.mesh / (light * light)).max(1e-12);
        let wanted = part * spread * self.full * (1.0 - self.believed * self.believed / unsure);
        (wanted >= FEWEST.min(LEAST * self.full)).then_some(wanted)
    }

    /// The full number for `part` of a pixel.
    pub fn all_rays(&self, part: f32) -> &Lattice2 {
        self.rung((part * self.full).max(FEWEST))
    }

    fn rung(&self, rays: f32) -> &Lattice2 {
        let step = (2.0 * self.full / rays).log2().round().max(0.0) as usize;
        &self.ladder[step.min(RUNGS - 1)]
    }
}

/// How far `rays` of a gather are believed where the mesh is in `doubt`, [0, 1].
///
/// By the spread to be expected, not by their own: lucky rays are spread more than others, and to believe them less makes
/// the picture darker, by 0.2 and 0.5 % of its light in two furnished rooms.
pub fn trust(doubt: Doubt, rays: u32) -> f32 {
    1.0 / (1.0 + doubt.of_gather(rays) / doubt.mesh.max(1e-30))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_go_where_the_mesh_is_off_by_more_than_is_asked() {
        let gather = FinalGather::new(128, 0.05, 0.0);
        let rays = |mesh: f32, ray: f32, light, part| {
            gather.rays(Doubt { mesh: mesh * mesh, ray }, light, part).map(Lattice2::len)
        };
        assert_eq!(rays(f32::INFINITY, 1.0, 1.0, 1.0), Some(128), "nothing known");
        assert_eq!(rays(0.05, 1.0, 1.0, 1.0), None, "as exact as asked");
        assert_eq!(rays(0.07, 1.0, 1.0, 1.0), Some(64));
        assert_eq!(rays(0.3, 1.0, 10.0, 1.0), None, "not seen beside so much light");
        assert_eq!(rays(0.3, 1.0, 1.0, 0.25), Some(32), "a quarter of the pixel");
        assert_eq!(rays(f32::INFINITY, 100.0, 1.0, 1.0), Some(256), "twice at most");
        assert_eq!(rays(0.0, 0.0, 0.0, 1.0), None, "no light, no doubt");
        assert_eq!(gather.all_rays(1.0).len(), 128);
    }

    #[test]
    fn many_samples_share_one_gather() {
        let gather = FinalGather::new(128, 0.05, 0.0);
        let doubt = Doubt { mesh: f32::INFINITY, ray: 1.0 };
        let rays = |times| gather.some_rays(doubt, 1.0, 1.0, times).map(|(rays, all)| (rays.len(), all));
        assert_eq!([1, 4, 64].map(rays), [Some((128, 128)), Some((32, 128)), Some((2, 128))]);
        assert_eq!(rays(1024), Some((1, 1024)), "no less than a ray");
        assert!(gather.some_rays(Doubt { mesh: 0.05 * 0.05, ray: 1.0 }, 1.0, 1.0, 4).is_none());
    }

    #[test]
    fn the_mixture_is_the_best_there_is() {
        let doubt = Doubt { mesh: 0.02, ray: 1.0 };
        let v = doubt.of_gather(64);
        let off = |t: f32| (1.0 - t).powi(2) * doubt.mesh + t * t * v;
        let t = trust(doubt, 64);
        assert!(off(t) < off(t + 0.05) && off(t) < off(t - 0.05), "{t}");
        assert_eq!(trust(Doubt { mesh: f32::INFINITY, ray: 1.0 }, 7), 1.0);
        assert!(trust(Doubt { mesh: 0.0, ray: 1.0 }, 7) < 1e-6);
        assert!(trust(Doubt::default(), 7).is_finite());
    }
}
