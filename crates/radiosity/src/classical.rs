//! The classical methods, from constant patches to the same [`Solution`] that the default makes: the full matrix by
//! Gauss and Seidel (1984), and progressive refinement (1988).
//!
//! ```text
//! World ─ patches ─▶ form factors ─ solver ─▶ E on patches ─ patch_to_vertex ─▶ Solution
//! ```
//!
//! Light of lamps that are no surfaces (punctual ones, the sky) is sampled at each patch, and so are photons of caustics;
//! what a patch reflects of them is light like any other from there on. A rough coat's share of it is taken as diffuse.

use crate::caustic::Caustics;
use crate::form_factor::FormFactors;
use crate::form_factor::emitted::Emitted;
use crate::form_factor::hemicube::Hemicube;
use crate::form_factor::matrix::Matrix;
use crate::patch_to_vertex::{Fit, fit};
use crate::patches::Patches;
use crate::solution::{Report, Solution};
use crate::solve::{Error, Progress};
use crate::solver::Convergence;
use crate::solver::gauss_seidel;
use crate::solver::progressive::Shooting;
use crate::transport::LARGEST_ROW_SUM;
use geometry::{Rgb, World};

/// Which of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// All form factors at once, solved by Gauss and Seidel's iteration.
    Matrix,
    /// The brightest patch shoots, again and again.
    Progressive,
}

/// How to solve.
#[derive(Clone, Debug)]
pub struct Config {
    /// Which method.
    pub solver: Solver,
    /// How form factors are found.
    pub form_factors: FormFactors,
    /// Patches at most; a scene with more triangles keeps its own.
    pub patches: usize,
    /// From patches to vertices.
    pub fit: Fit,
    /// Matrix: values are on average no further from the solution than this share of their mean. Progressive: no more than
    /// this share of the light that arrives is missing.
    pub tolerance: f32,
    /// Matrix: make form factors reciprocal, and rows keep their sums.
    pub enforce: bool,
    /// Progressive: shots at most.
    pub shots: u64,
    /// Progressive: add the light that is yet to be shot, spread evenly.
    pub ambient: bool,
    /// Progressive: shoot what is going to arrive beforehand.
    pub overshoot: bool,
    /// Bytes that a matrix may take.
    pub most_bytes: u64,
    /// Particles sent for caustics.
    pub photons: usize,
    /// Same seed, same solution.
    pub seed: u64,
}

impl Config {
    /// For a picture whose error is to be about `error` (0.02 for 2 %), by rays.
    pub fn for_error(solver: Solver, error: f32) -> Config {
        let default = crate::Config::for_error(error);
        Config {
            solver,
            form_factors: FormFactors::RayCast(2 * default.rays),
            patches: ((60.0 / error.clamp(1e-3, 0.5)) as usize).max(300),
            fit: Fit::Conservative,
            tolerance: 0.5 * error,
            enforce: false,
            shots: u64::MAX,
            ambient: true,
            overshoot: false,
            most_bytes: 4 << 30,
            photons: default.photons,
            seed: 0,
        }
    }

    /// The same with a hemicube of `resolution` pixels along an edge.
    pub fn with_hemicube(self, resolution: u32) -> Config {
        Config { form_factors: FormFactors::Hemicube(Hemicube::new(resolution)), ..self }
    }
}

/// Solves the diffuse interreflection of `world`.
///
/// Fails when a matrix would not fit, and when there is no finite answer.
pub fn solve(world: &World, config: &Config, progress: &dyn Progress) -> Result<Solution, Error> {
    let room = Room::new(world, config, progress);
    match config.solver {
        Solver::Matrix => solve_matrix(&room, config, progress),
        Solver::Progressive => {
            let mut shooting = room.shooting(config);
            progress.stage("shooting", 0);
            shooting.shoot_until(config.shots, |s| progress.stopped() || s.finished(config.tolerance));
            Ok(room.shown(&shooting, config))
        }
    }
}

/// The patches of a world with the light that falls on them from what is no patch.
#[derive(Debug)]
pub struct Room<'a> {
    world: &'a World,
    /// The patches.
    pub patches: Patches,
    /// Irradiance from punctual lamps and sky, lx.
    lamps: Vec<Rgb>,
    /// Irradiance by photons, lx.
    photons: Vec<Rgb>,
    caustics: Caustics,
}

impl<'a> Room<'a> {
    /// Splits the scene into patches and lights them.
    pub fn new(world: &'a World, config: &Config, progress: &dyn Progress) -> Room<'a> {
        progress.stage("patches", 0);
        let mut patches = Patches::new(world, config.patches, config.seed);
        // What reflects all it receives would never come to an end.
        for p in &mut patches.all {
            p.reflectance = p.reflectance.map(|rho| rho.min(LARGEST_ROW_SUM));
        }
        let lamps = patches.lamps(world, config.seed);
        progress.stage("caustics", 1);
        let caustics = Caustics::trace(world, config.photons, config.seed);
        let flux = caustics.at_elements(&patches.elements);
        let photons = match flux.is_empty() {
            true => Vec::new(),
            false => {
                let of = |p: &crate::patches::Patch| match p.area {
                    area if area > 0.0 => flux[2 * p.leaf as usize + p.side.index()] / area,
                    _ => Rgb::BLACK,
                };
                patches.all.iter().map(of).collect()
            }
        };
        Room { world, patches, lamps, photons, caustics }
    }

    /// Progressive refinement of this room, nothing shot yet.
    pub fn shooting<'b>(&'b self, config: &'b Config) -> Shooting<'b> {
        let Config { form_factors, overshoot, seed, .. } = config;
        Shooting::new(self.world, &self.patches, form_factors, self.reflected(), *overshoot, *seed)
    }

    /// What each patch reflects of lamps and photons, lm/m².
    fn reflected(&self) -> Vec<Rgb> {
        let of = |(i, p): (usize, &crate::patches::Patch)| {
            let photons = self.photons.get(i).copied().unwrap_or(Rgb::BLACK);
            p.reflectance * (self.lamps[i] + photons) + p.gloss * self.lamps[i]
        };
        self.patches.all.iter().enumerate().map(of).collect()
    }

    /// The solution as it stands after the shots so far.
    pub fn shown(&self, shooting: &Shooting, config: &Config) -> Solution {
        let (direct, indirect) = if config.ambient { shooting.ambient() } else { Default::default() };
        let bound = shooting.bound();
        let e: Vec<Rgb> = shooting.indirect.iter().map(|&e| (e + indirect).max(Rgb::BLACK)).collect();
        let d: Vec<Rgb> = shooting.direct.iter().map(|&d| d + direct).collect();
        let mean = self.mean(&e);
        let convergence = Convergence {
            iterations: shooting.shots.min(u64::from(u32::MAX)) as u32,
            residual: shooting.unshot_flux().mean(),
            bound: bound * mean.mean(),
            converged: shooting.finished(config.tolerance),
        };
        let report = Report {
            convergence,
            norm: self.patches.all.iter().map(|p| p.reflectance.max_channel()).fold(0.0, f32::max),
            mean,
            balance: self.balance(shooting),
            landings: shooting.arrivals as usize,
            row_bytes: shooting.bytes(),
            ..Report::default()
        };
        self.solution(&e, &d, report, config)
    }

    /// What was absorbed, what escaped and what is yet unshot over what came in: 1, for each shot is a division of it.
    fn balance(&self, shooting: &Shooting) -> f32 {
        let (mut came, mut went) = (0f64, 0f64);
        let reflected = self.reflected();
        for (i, p) in self.patches.all.iter().enumerate() {
            let outside = self.lamps[i] + self.photons.get(i).copied().unwrap_or(Rgb::BLACK);
            // A coat sends on what did not enter the base.
            let coat = reflected[i] - p.reflectance * outside;
            came += f64::from(((p.exitance + outside + coat) * p.area).mean());
            let arrived = outside + shooting.direct[i] + shooting.indirect[i];
            went += f64::from((arrived * (Rgb::WHITE - p.reflectance) * p.area).mean());
        }
        went += f64::from(shooting.escaped.mean()) + f64::from(shooting.left().mean());
        if came > 0.0 { (went / came) as f32 } else { 1.0 }
    }

    /// Area mean over patches.
    fn mean(&self, values: &[Rgb]) -> Rgb {
        let area: f32 = self.patches.all.iter().map(|p| p.area).sum();
        let sum: Rgb = self.patches.all.iter().zip(values).map(|(p, &v)| v * p.area).sum();
        sum / area.max(f32::MIN_POSITIVE)
    }

    /// From irradiance on patches, indirect and straight from patches that shine, to the solution.
    fn solution(&self, indirect: &[Rgb], direct: &[Rgb], report: Report, config: &Config) -> Solution {
        let direct: Vec<Rgb> = direct.iter().zip(&self.lamps).map(|(&d, &l)| d + l).collect();
        let (values, usable) = fit(&self.patches, indirect, config.fit);
        let (direct, _) = fit(&self.patches, &direct, config.fit);
        let caustic = if self.photons.is_empty() {
            Vec::new()
        } else {
            fit(&self.patches, &self.photons, config.fit).0
        };
        let elements = self.patches.elements.clone();
        let method = match config.solver {
            Solver::Matrix => "matrix",
            Solver::Progressive => "progressive",
        };
        let report = Report {
            solver: format!("{method}, {}", config.form_factors.name()),
            vertices: elements.vertices.len(),
            elements: elements.leaves().count(),
            sites: self.patches.len(),
            photons: self.caustics.len(),
            caustic_flux: self.caustics.flux(),
            ..report
        };
        Solution::of_slots(elements, values, usable, direct, caustic, self.caustics.clone(), report)
    }
}

fn solve_matrix(room: &Room, config: &Config, progress: &dyn Progress) -> Result<Solution, Error> {
    let patches = &room.patches;
    let bytes = Matrix::bytes(patches.len(), Matrix::channels(room.world));
    if bytes > config.most_bytes {
        return Err(Error::TooLarge { patches: patches.len(), bytes, most: config.most_bytes });
    }
    progress.stage("form factors", patches.len() as u64);
    let mut matrix =
        Matrix::fill(room.world, patches, &config.form_factors, config.seed, || progress.advance(1));
    let Emitted { direct, by_gloss } = Emitted::shoot(room.world, patches, &config.form_factors, config.seed);
    if config.enforce {
        matrix.enforce();
    }
    progress.stage("solving", 0);
    let reflectance: Vec<Rgb> = patches.all.iter().map(|p| p.reflectance).collect();
    // The unknown is what patches reflect; their emission has been told apart by the way it took.
    let source: Vec<Rgb> = room
        .reflected()
        .into_iter()
        .enumerate()
        .map(|(i, r)| r + reflectance[i] * (direct[i] + by_gloss[i]))
        .collect();
    let tolerance = config.tolerance * 0.2 * room.mean(&source).mean();
    let (b, convergence) = gauss_seidel::solve(&matrix, &reflectance, &source, tolerance, 1000);
    let norm = norm(&matrix, &reflectance);
    if !b.iter().all(|b| b.is_finite()) {
        return Err(Error::Diverged { iterations: convergence.iterations, norm });
    }
    let arrived = matrix.apply(&b);
    let e: Vec<Rgb> = arrived.iter().zip(&by_gloss).map(|(&e, &g)| e + g).collect();
    // What arrives, by rows, over what leaves, by columns: 1 as far as A_i F_ij = A_j F_ji holds.
    let left: f32 = (0..patches.len())
        .map(|j| patches.all[j].area * b[j].mean() * matrix.row(j, 1).iter().sum::<f32>())
        .sum();
    let came: f32 = patches.all.iter().zip(&arrived).map(|(p, e)| p.area * e.mean()).sum();
    let report = Report {
        convergence,
        norm,
        mean: room.mean(&e),
        balance: if left > 0.0 { came / left } else { 1.0 },
        landings: patches.len(),
        row_bytes: bytes as usize,
        ..Report::default()
    };
    Ok(room.solution(&e, &direct, report, config))
}

/// Largest ρ_i Σ_j F_ij, any channel.
fn norm(matrix: &Matrix, reflectance: &[Rgb]) -> f32 {
    let sum = |i: usize, c: usize| reflectance[i][c] * matrix.row(i, c).iter().sum::<f32>();
    (0..matrix.len()).flat_map(|i| [0, 1, 2].map(|c| sum(i, c))).fold(0.0, f32::max)
}
