//! What the emission of patches brings to the others, shot from where it shines.
//!
//! A small lamp is met by few of the rays that leave a wall: of 1024 three, and the light on the wall would be known to
//! 60 %. By reciprocity the lamp's own rays tell the same, and there each counts.

use super::FormFactors;
use super::arrival::Way;
use crate::patches::Patches;
use geometry::{Rgb, World};
use rayon::prelude::*;

/// Rays from one patch at most.
const MOST: f64 = 262_144.0;

/// Irradiance that the emission of patches brings to each patch, lx.
#[derive(Clone, Debug, Default)]
pub struct Emitted {
    /// Straight.
    pub direct: Vec<Rgb>,
    /// By way of one rough surface.
    pub by_gloss: Vec<Rgb>,
}

impl Emitted {
    /// Shoots every shining patch's own light. By rays, all of them share as many as the rows of the matrix have, by their
    /// flux.
    pub fn shoot(world: &World, patches: &Patches, how: &FormFactors, seed: u64) -> Emitted {
        let n = patches.len();
        let flux = |i: usize| f64::from(patches.all[i].exitance.mean() * patches.all[i].area);
        let whole: f64 = (0..n).map(flux).sum();
        let shining: Vec<u32> = (0..n as u32).filter(|&i| flux(i as usize) > 0.0).collect();
        let row = |&i: &u32| {
            // Streams beyond those of the matrix' own rows.
            let stream = (n + i as usize) as u64;
            match how {
                FormFactors::RayCast(rays) => {
                    let rays = f64::from(*rays) * n as f64 * flux(i as usize) / whole;
                    FormFactors::RayCast(rays.clamp(16.0, MOST) as u32).row(world, patches, i, seed, stream)
                }
                how => how.row(world, patches, i, seed, stream),
            }
        };
        let mut out = Emitted { direct: vec![Rgb::BLACK; n], by_gloss: vec![Rgb::BLACK; n] };
        // In runs, so that not all rows are held at once.
        for run in shining.chunks(256) {
            let rows: Vec<_> = run.par_iter().map(row).collect();
            for (&i, row) in run.iter().zip(rows) {
                let source = &patches.all[i as usize];
                for a in row {
                    let (j, area) = (a.patch as usize, patches.all[a.patch as usize].area);
                    if area > 0.0 {
                        let brought = a.share * source.exitance * (source.area / area);
                        match a.way {
                            Way::Straight => out.direct[j] += brought,
                            Way::Rough => out.by_gloss[j] += brought,
                            Way::Specular => {}
                        }
                    }
                }
            }
        }
        out
    }
}
