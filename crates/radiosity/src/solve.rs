//! The whole prepass: mesh, gather, refine, photons, solve.

use crate::caustic::Caustics;
use crate::doubt;
use crate::importance::Importance;
use crate::journal::Journal;
use crate::lights::Lights;
use crate::refine::Refiner;
use crate::settle::{Solved, mean};
use crate::smooth;
use crate::solution::{Report, Solution};
use geometry::{LightGroups, Rgb, World};
use std::sync::{Mutex, MutexGuard, PoisonError};
use thiserror::Error;

/// What the prepass may cost and how exact it is to be. Lengths are in units of the size of its rooms, [`World::scale`].
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Rays gathered at each site. Error of E measured in a Cornell box: 64 → 5.7 %, 256 → 1.9 %, 1024 → 0.67 %.
    pub rays: u32,
    /// Relative noise of a site's value, by its neighbours', above which it gets more rays, up to 16 times as many.
    pub noise: f32,
    /// Relative midpoint error × (edge / h0) above which an edge is refined further.
    pub tolerance: f32,
    /// Longest edge of the first mesh; where that made too many elements it is longer.
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
    /// Whether to keep the light of each group of lamps apart, so that they can be dimmed afterwards.
    pub by_light: bool,
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
            by_light: false,
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
    /// A form-factor matrix of so many patches does not fit.
    #[error(
        "the form factors of {patches} patches take {:.1} GB, and {:.1} GB are free: take fewer patches, or the progressive solver, which keeps none",
        *bytes as f64 / 1e9, *most as f64 / 1e9
    )]
    TooLarge {
        /// Patches.
        patches: usize,
        /// What their matrix would take.
        bytes: u64,
        /// What it may take.
        most: u64,
    },
}

/// A journal that a thread left behind when it panicked holds whole records all the same.
pub(crate) fn lock(journal: &Mutex<Journal>) -> MutexGuard<'_, Journal> {
    journal.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Hears how far the work is, and may end it early.
pub trait Progress: Sync {
    /// A stage of `total` steps begins.
    fn stage(&self, name: &'static str, total: u64);
    /// `n` more steps are done.
    fn advance(&self, n: u64);
    /// Whether to stop refining and finish with what there is.
    fn stopped(&self) -> bool;
    /// The picture so far, to look at: its size, and its pixels (cd/m²) for those who want them.
    fn picture(&self, _width: u32, _height: u32, _pixels: &dyn Fn() -> Vec<Rgb>) {}
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
    solve_resumable(world, config, importance, None, progress)
}

/// The same, with the rows kept in a journal: a solve that was cut off goes on from there, to the same solution.
pub fn solve_resumable(
    world: &World,
    config: &Config,
    importance: Option<&Importance>,
    journal: Option<&Mutex<Journal>>,
    progress: &dyn Progress,
) -> Result<Solution, Error> {
    if let Some(journal) = journal {
        let told =
            format!("{} {config:?} {:?} {importance:?}", env!("CARGO_PKG_VERSION"), world.scene.emissions());
        let mut key = blake3::Hasher::new();
        key.update(&world.scene.fingerprint()).update(told.as_bytes());
        lock(journal).begin(key.finalize().as_bytes());
    }
    let mut refiner = Refiner::start(world, config, importance, journal, progress);
    refiner.refine();
    progress.stage("caustics", 1);
    let groups = refiner.groups.as_ref();
    // Beside each ray that lands goes a shadow ray.
    let gathered = 2 * refiner.landings();
    let caustics = Caustics::trace_groups(world, config.photons, gathered, config.seed, groups);
    let usable = |slot| refiner.field.usable(slot);
    let extra = caustics.at_vertices(&refiner.elements, usable);
    let extra_parts: Vec<Vec<Rgb>> = (0..groups.map_or(0, LightGroups::len))
        .map(|g| caustics.part_at_vertices(&refiner.elements, usable, g))
        .collect();
    progress.stage("solving", 1);
    let flags = refiner.flags();
    let tolerance = config.solve_tolerance * mean(&refiner.e).mean();
    let transport = refiner.transport(&flags);
    let norm = transport.norm();
    let Solved { e, parts, variance, convergence, .. } =
        refiner.solved(&transport, tolerance, 500, None, &extra, &extra_parts, &flags);
    if !e.iter().all(|e| e.is_finite()) {
        return Err(Error::Diverged { iterations: convergence.iterations, norm });
    }
    refiner.e = e;
    let smoothing = smooth::smoothing(&refiner, &flags, &variance);
    let doubts = doubt::of_sites(&refiner, &variance, &smoothing);
    refiner.e = smoothing.apply(&refiner.e);
    let parts = parts.iter().map(|part| smoothing.apply(part)).collect();
    let (direct, direct_parts) = refiner.direct(config.light_samples);
    let report = Report::new(
        world,
        &refiner,
        &flags,
        &extra,
        &refiner.field.spread(&direct),
        convergence,
        norm,
        &caustics,
    );
    let lights = refiner.groups.take().map(|groups| Lights {
        groups,
        emissions: world.scene.emissions(),
        indirect: parts,
        direct: direct_parts,
    });
    Ok(Solution::new(refiner, flags, direct, doubts, lights, caustics, report))
}
