//! The whole prepass: mesh, gather, refine, photons, solve.

use crate::caustic::Caustics;
use crate::importance::Importance;
use crate::refine::{Refiner, Solved, mean};
use crate::smooth;
use crate::solution::{Report, Solution};
use geometry::World;
use thiserror::Error;

/// What the prepass may cost and how exact it is to be. Lengths are in units of the size of its rooms, [`World::scale`].
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Rays gathered at each site. Error of E measured in a Cornell box: 64 → 5.7 %, 256 → 1.9 %, 1024 → 0.67 %.
    pub rays: u32,
    /// Relative noise of a site's own value above which it gets four times as many rays, twice at most.
    pub noise: f32,
    /// Relative midpoint error × (edge / h0) above which an edge is refined further.
    pub tolerance: f32,
    /// Longest edge of the first mesh.
    pub h0: f32,
    /// Shortest edge that refinement makes.
    pub h_min: f32,
    /// Reach of one site in finely tessellated surface.
    pub cluster_radius: f32,
    /// Rounds of refinement at most.
    pub rounds: u32,
    /// Sites gathered at most; the first mesh takes what it needs.
    pub most_sites: usize,
    /// Vertices of the element mesh at most; input with more keeps its own.
    pub most_vertices: usize,
    /// Landings of gather rays kept at most, 16 bytes each; sites gathered when they run out get fewer rays.
    pub most_landings: usize,
    /// Values are on average to be no further from the solved system's than this share of their mean.
    pub solve_tolerance: f32,
    /// Light samples for the direct irradiance at each site.
    pub light_samples: u32,
    /// Particles sent for caustics.
    pub photons: usize,
    /// Same seed, same solution.
    pub seed: u64,
}

impl Config {
    /// For a picture whose error is to be about `error` (0.02 for 2 %).
    ///
    /// Rays from the measured ladder (error of E ∝ rays^-0.8); tolerances as measured beside it.
    pub fn for_error(error: f32) -> Config {
        let rays = (128.0 * (0.033 / error.clamp(1e-4, 0.5)).powf(1.25)).clamp(32.0, 8192.0);
        Config {
            rays: (rays as u32).next_multiple_of(16),
            noise: 3.0 * error,
            tolerance: (1.2 * error).clamp(0.004, 0.12),
            h0: 0.15,
            h_min: 0.004,
            cluster_radius: 0.02,
            rounds: 5,
            most_sites: (1200.0 / error.max(1e-4)) as usize,
            most_vertices: 2_000_000,
            most_landings: 96_000_000,
            solve_tolerance: 0.1 * error,
            light_samples: 64,
            photons: ((4000.0 / (error * error).max(1e-6)) as usize).clamp(100_000, 4_000_000),
            seed: 0,
        }
    }
}

/// Why there is no solution at all.
#[derive(Debug, Error)]
pub enum Error {
    /// The iteration left the finite numbers.
    #[error(
        "the radiosity solution is not finite after {iterations} iterations (largest row sum {norm}): a surface reflects more light than it receives"
    )]
    Diverged {
        /// Applications of K.
        iterations: u32,
        /// Largest row sum.
        norm: f32,
    },
}

/// Hears how far the work is, and may end it early.
pub trait Progress: Sync {
    /// A stage of `total` steps begins.
    fn stage(&self, name: &'static str, total: u64);
    /// `n` more steps are done.
    fn advance(&self, n: u64);
    /// Whether to stop refining and finish with what there is.
    fn stopped(&self) -> bool;
}

/// Nobody listens.
impl Progress for () {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn stopped(&self) -> bool {
        false
    }
}

/// Solves the diffuse interreflection of `world`.
///
/// Fails only when there is no finite answer; an unfinished one is a rougher picture, and the report says so.
pub fn solve(world: &World, config: &Config, progress: &dyn Progress) -> Result<Solution, Error> {
    solve_for(world, config, None, progress)
}

/// The same, with less care where `importance` says that it matters less.
pub fn solve_for(
    world: &World,
    config: &Config,
    importance: Option<&Importance>,
    progress: &dyn Progress,
) -> Result<Solution, Error> {
    let mut refiner = Refiner::start(world, config, importance, progress);
    refiner.refine();
    progress.stage("caustics", 1);
    let caustics = Caustics::trace(world, &refiner.elements, config.photons, config.seed);
    let extra = caustics.at_vertices(&refiner.elements, &refiner.field);
    progress.stage("solving", 1);
    let flags = refiner.flags();
    let tolerance = config.solve_tolerance * mean(&refiner.e).mean();
    let Solved { e, variance, convergence, norm } = refiner.solved(tolerance, 500, &extra, &flags);
    if !e.iter().all(|e| e.is_finite()) {
        return Err(Error::Diverged { iterations: convergence.iterations, norm });
    }
    refiner.e = e;
    refiner.e = smooth::smoothed(&refiner, &flags, &variance);
    let direct = refiner.direct(config.light_samples);
    let report = Report::new(world, &refiner, &flags, &extra, &direct, convergence, norm, &caustics);
    Ok(Solution::new(refiner, flags, extra, direct, caustics, report))
}
