//! Form factors: what share of the light that leaves a patch arrives straight at each other one. One question, three
//! answers with errors of their own.
//!
//! | | what it computes | its error |
//! |---|---|---|
//! | [`analytic`] | polygons that see each other whole, in closed form | 1e-9; knows nothing of what stands between |
//! | [`hemicube`] | what a point, the patch's middle, sees in the pixels of half a cube | aliasing, ∝ 1/resolution; one point speaks for the patch |
//! | [`ray_cast`] | rays from points all over the patch | noise, of which it knows the variance |
//!
//! The last two go through mirrors and glass to the diffuse surfaces behind them ([`arrival`]).

pub mod analytic;
pub mod arrival;
pub mod emitted;
pub mod hemicube;
pub mod matrix;
pub mod ray_cast;

use crate::patches::Patches;
use arrival::{Arrival, Way};
use geometry::{Rgb, World};
use hemicube::Hemicube;

/// How form factors are found.
#[derive(Clone, Debug)]
pub enum FormFactors {
    /// In closed form, as if nothing stood between: for convex rooms without mirrors.
    Analytic,
    /// By the pixels of half a cube over the patch's middle.
    Hemicube(Hemicube),
    /// By so many rays from each patch, about.
    RayCast(u32),
}

impl FormFactors {
    /// Form factors from `patch` to all others, in no particular order; those to one patch are to be summed.
    ///
    /// `stream` numbers the question: another number draws other random numbers.
    pub fn row(&self, world: &World, patches: &Patches, patch: u32, seed: u64, stream: u64) -> Vec<Arrival> {
        match self {
            FormFactors::Analytic => {
                let from = analytic::corners(patches.corners(patch));
                let to = |other: u32| {
                    let f = analytic::polygon_to_polygon(&from, &analytic::corners(patches.corners(other)));
                    let arrival = Arrival { patch: other, way: Way::Straight, share: Rgb::splat(f as f32) };
                    (f > 0.0).then_some(arrival)
                };
                (0..patches.len() as u32).filter(|&other| other != patch).filter_map(to).collect()
            }
            FormFactors::Hemicube(cube) => cube.row(world, patches, patch, seed, stream),
            FormFactors::RayCast(rays) => ray_cast::row(world, patches, patch, *rays, seed, stream),
        }
    }

    /// What a reader calls it.
    pub fn name(&self) -> String {
        match self {
            FormFactors::Analytic => "closed form, nothing between".into(),
            FormFactors::Hemicube(cube) => format!("hemicube of {0} x {0} pixels", cube.resolution()),
            FormFactors::RayCast(rays) => format!("{rays} rays"),
        }
    }
}
