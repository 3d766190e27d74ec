//! The two passes, until the picture is what was asked for: pixels over threads, and again where probes find fault.
//!
//! Every pixel is a function of (seed, place, effort) alone, so the picture does not depend on threads. A first pass
//! gives every pixel one ray; then those where it brings most are done again with more ([`crate::effort`]). Probes that never
//! see the solution say how exact the picture is ([`crate::verify`]); if it surely is not what was asked, samples or
//! mesh become finer, by as much as was missing.

use crate::adaptive::Adaptive;
use crate::effort::Budget;
use crate::film::{Film, Pixel};
use crate::importance::importance;
use crate::integrator::final_gather::FinalGather;
use crate::integrator::hybrid::Hybrid;
use crate::integrator::path;
use crate::pixel::{View, over_pixels};
use crate::plan::Plan;
use crate::verify::{Judgement, Probes, Verdict};
use geometry::{Camera, Outlook, Rgb, World};
use radiosity::importance::Point;
use radiosity::{Config, Journal, Solution, classical};
use std::sync::Mutex;
use std::time::Instant;

pub use radiosity::Progress;

/// How the light is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// The two passes: radiosity at vertices, then rays.
    Hybrid,
    /// Plain path tracing, the reference, which never sees the radiosity solution.
    Path {
        /// Paths through each pixel, ≥ 1.
        spp: u32,
    },
}

/// How the hybrid integrator shades a diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiffuseMode {
    /// All light from the vertices.
    Vertex,
    /// Indirect light from the vertices, direct light per pixel.
    Split,
    /// One bounce of rays per pixel, which read the vertices where they end.
    Gather,
}

/// What is asked of a picture.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Columns, ≥ 1.
    pub width: u32,
    /// Rows, ≥ 1.
    pub height: u32,
    /// Same seed, same picture.
    pub seed: u64,
    /// Error to aim at, as a fraction: 0.02 is 2 % by the metric of [`crate::metrics`].
    pub error: f32,
    /// How the light is found.
    pub integrator: Integrator,
    /// How diffuse surfaces are shaded.
    pub diffuse: DiffuseMode,
    /// A classical radiosity method in place of the default one.
    pub classical: Option<classical::Config>,
    /// When to stop with what there is.
    pub deadline: Option<Instant>,
    /// Rays from each vertex, in place of the number that `error` asks for.
    pub gather_rays: Option<u32>,
    /// Rays through each pixel at most, in place of the number that `error` asks for.
    pub samples: Option<u32>,
    /// Whether to measure the picture's error by probes, and to go on where it is missed.
    pub verify: bool,
    /// Whether the solution stays as it is, whatever the probes find: it serves other pictures too.
    pub keep_solution: bool,
    /// Whether the prepass keeps the light of each group of lamps apart.
    pub by_light: bool,
}

impl Default for Settings {
    /// 512 × 512 pixels at 2 % by the two passes, verified.
    fn default() -> Settings {
        Settings {
            width: 512,
            height: 512,
            seed: 1,
            error: 0.02,
            integrator: Integrator::Hybrid,
            diffuse: DiffuseMode::Split,
            classical: None,
            deadline: None,
            gather_rays: None,
            samples: None,
            verify: true,
            keep_solution: false,
            by_light: false,
        }
    }
}

/// Pixels for which one site is enough, where the first pass may have so many sites.
const PIXELS_OF_A_SITE: usize = 2;
/// Sites it may have at least: what is not seen lights what is.
const LEAST_SITES: usize = 16_000;
/// Of the square of the error asked, the share that samples may leave as noise; the rest is for the first pass.
/// With 0.5 a furnished room at 5 % takes 0.91 of the rays and is off by 5.46 instead of 5.14 %.
const NOISE_SHARE: f32 = 0.4;
/// What the first pass is asked for, in units of the error asked.
const MESH_SHARE: f32 = 0.85;
/// Rays through one pixel, and shadow rays for one surface, at most: the edge of a lamp before a dark wall wants many.
pub(crate) const MOST_SAMPLES: u32 = 16_384;
/// Times at most that a picture which missed the error asked is made better.
const MOST_REPAIRS: u32 = 2;
/// No repair asks for less of the error than this share.
const SMALLEST_STEP: f32 = 0.5;
/// A repair that left more than this share of the error it was to mend is the last: the same again would not help.
const HELPED: f64 = 0.85;
/// An error is missed by so much more than it seems, for the next step is not known exactly.
const MARGIN: f32 = 0.8;

/// How a render went.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Seconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
    /// Facts that depend on the scene and settings alone, never on time: they go into the file.
    pub texts: Vec<(String, String)>,
    /// How the prepass went; `None` for the path tracer.
    pub radiosity: Option<radiosity::Report>,
    /// How exact the picture is; `None` where that was not asked, or not done for want of time.
    pub verdict: Option<Verdict>,
}

/// A picture and how it came about.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The picture; a pixel with 0 samples was not reached, and a film of nothing else is not worth a file.
    pub film: Film,
    /// What each group of lamps adds to the picture, cd/m², where that was asked; they sum to it.
    pub by_light: Vec<(String, Vec<Rgb>)>,
    /// Whether it is what was asked; false when the time was up or someone stopped it.
    pub finished: bool,
    /// How it went.
    pub report: Report,
}

/// Stops at the deadline as well as when the user says so.
struct Watch<'a> {
    progress: &'a dyn Progress,
    deadline: Option<Instant>,
}

impl Progress for Watch<'_> {
    fn stage(&self, name: &'static str, total: u64) {
        self.progress.stage(name, total);
    }
    fn advance(&self, n: u64) {
        self.progress.advance(n);
    }
    fn stopped(&self) -> bool {
        self.progress.stopped() || self.deadline.is_some_and(|end| Instant::now() >= end)
    }
    fn picture(&self, width: u32, height: u32, pixels: &dyn Fn() -> Vec<Rgb>) {
        self.progress.picture(width, height, pixels);
    }
}

impl Watch<'_> {
    /// Whether twice as many `seconds` are left.
    fn has_time_for(&self, seconds: f64) -> bool {
        let left = |end: Instant| end.saturating_duration_since(Instant::now()).as_secs_f64();
        !self.stopped() && self.deadline.is_none_or(|end| left(end) > 2.0 * seconds)
    }
}

/// The prepass that `settings` ask for. It does not depend on the camera: solve once, render any number of views.
pub fn prepass(
    world: &World,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Solution, radiosity::Error> {
    prepass_for(world, &[], settings, progress)
}

/// The prepass for views by `cameras`: it takes care of what they see and of what lights that, and less of the rest. One
/// serves them all; for other views it is rougher. Without cameras everything matters alike.
pub fn prepass_for(
    world: &World,
    cameras: &[Camera],
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Solution, radiosity::Error> {
    prepass_resumable(world, cameras, settings, None, progress)
}

/// The same with a journal: one that was cut off goes on from there.
pub fn prepass_resumable(
    world: &World,
    cameras: &[Camera],
    settings: &Settings,
    journal: Option<&Mutex<Journal>>,
    progress: &dyn Progress,
) -> Result<Solution, radiosity::Error> {
    let mut config = Config {
        seed: settings.seed,
        by_light: settings.by_light,
        ..Config::for_error(MESH_SHARE * settings.error)
    };
    if let Some(rays) = settings.gather_rays {
        config.rays = rays;
    }
    if settings.diffuse != DiffuseMode::Vertex {
        // Direct light at the vertices is for the energy balance only then: an eighth of a furnished room's rays otherwise.
        config.light_samples = 8;
    }
    // At most half of the time goes to the prepass; a rougher solution still makes a whole picture.
    let now = Instant::now();
    let deadline = settings.deadline.map(|end| now + end.saturating_duration_since(now) / 2);
    let watch = Watch { progress, deadline };
    if let Some(config) = &settings.classical {
        return classical::solve(world, config, &watch);
    }
    if !cameras.is_empty() {
        // Light finer than the pixels is not seen.
        let pixels = settings.width as usize * settings.height as usize * cameras.len();
        config.most_sites = config.most_sites.min((pixels / PIXELS_OF_A_SITE).max(LEAST_SITES));
    }
    let aspect = settings.width as f32 / settings.height.max(1) as f32;
    let matters = (!cameras.is_empty()).then(|| importance(world, cameras, aspect));
    radiosity::solve_resumable(world, &config, matters.as_ref(), journal, &watch)
}

/// Renders `world` as `camera` sees it. The hybrid integrator needs the `solution` of [`prepass`]; without one it is made here.
pub fn render(
    world: &World,
    camera: &Camera,
    solution: Option<&Solution>,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Outcome, radiosity::Error> {
    let watch = Watch { progress, deadline: settings.deadline };
    let view = View { camera, width: settings.width, height: settings.height };
    match settings.integrator {
        Integrator::Path { spp } => {
            let start = Instant::now();
            let (film, finished) = trace_paths(world, &view, spp, settings.seed, &watch);
            let report =
                Report { stages: vec![("image", start.elapsed().as_secs_f64())], ..Report::default() };
            Ok(Outcome { film, by_light: Vec::new(), finished, report })
        }
        Integrator::Hybrid => two_passes(world, &view, solution, settings, &watch),
    }
}

/// The hybrid picture, made better until the probes do not find the error missed.
fn two_passes(
    world: &World,
    view: &View,
    solution: Option<&Solution>,
    settings: &Settings,
    watch: &Watch,
) -> Result<Outcome, radiosity::Error> {
    let cameras = std::slice::from_ref(view.camera);
    let mut clock = Clock { last: Instant::now(), stages: Vec::new() };
    // What each pass is asked for: less than the user asks, once that was missed.
    let (mut mesh_error, mut noise_error) = (settings.error, noise_goal(settings.error));
    let mut made = None;
    if solution.is_none() {
        made = Some(prepass_for(world, cameras, settings, watch.progress)?);
        clock.lap("prepass");
    }
    let plan = Plan::new(world, view, settings.error, settings.seed);
    let windows = windows(world, view);
    clock.lap("plan");
    // Classical meshes know no error, and who sets the number of rays gets that number.
    let fixed = settings.classical.is_some() || settings.samples.is_some() || settings.gather_rays.is_some();
    let most_repairs = if fixed { 0 } else { MOST_REPAIRS };
    let (mut probes, mut repairs, mut missed_by) = (None, 0, f64::INFINITY);
    // The best whole picture so far: a repair that is cut off is no better.
    let mut whole: Option<Outcome> = None;
    loop {
        let solution = made.as_ref().or(solution).expect("given or made");
        let gathers = FinalGather::for_error(mesh_error, solution.report.mean.mean());
        let outlook = windows.as_ref().or(world.emitters.outlook());
        let hybrid = Hybrid { world, solution, outlook, mode: settings.diffuse, gathers };
        let before = world.bvh.rays_cast();
        let mut picture = Adaptive::new(&hybrid, view, settings.seed);
        let mut finished = picture.start(watch);
        let finer_mesh = loop {
            finished = finished && picture.refine(&budget(settings, noise_error), watch);
            let (film, noise) = picture.film();
            clock.lap("image");
            let mut verdict = None;
            if finished && settings.verify {
                // Beside each gather ray that lands goes a shadow ray.
                let took = world.bvh.rays_cast() - before + 2 * solution.report.landings as u64;
                let trace = || Probes::trace(world, view, &film, settings.error, settings.seed, took, watch);
                probes = probes.or_else(trace);
                verdict = probes.as_ref().map(|probes| probes.judge(&film, settings.error));
                clock.lap("verify");
            }
            let mut report = Report {
                stages: Vec::new(),
                texts: facts(&solution.report),
                radiosity: Some(solution.report.clone()),
                verdict,
            };
            report.texts.push(("plan".into(), plan.to_string()));
            if let Some(verdict) = verdict {
                report.texts.push(("error measured".into(), verdict.to_string()));
            }
            report.texts.push(("noise".into(), format!("{:.2} % estimated", 100.0 * noise)));
            // Whether samples make up the larger part of the error.
            let noisy = |verdict: Verdict| f64::from(noise).powi(2) > 0.5 * verdict.error.powi(2);
            let outcome = Outcome { film, by_light: Vec::new(), finished, report };
            if let Some(verdict) = verdict.filter(|v| v.judgement() == Judgement::Missed)
                && repairs < most_repairs
                && verdict.error < HELPED * missed_by
                && watch.has_time_for(clock.total())
                && (!settings.keep_solution || noisy(verdict))
            {
                repairs += 1;
                missed_by = verdict.error;
                whole = Some(outcome);
                // Half of the error costs about five times as much: no more than that at once.
                let step = (MARGIN * (verdict.asked / verdict.error) as f32).max(SMALLEST_STEP);
                // Whichever is the larger part of the error becomes smaller by what is missing.
                if noisy(verdict) {
                    noise_error *= step;
                    continue;
                }
                mesh_error *= step;
                break mesh_error;
            }
            let mut outcome = if finished { outcome } else { whole.unwrap_or(outcome) };
            outcome.report.stages = clock.stages;
            return Ok(outcome);
        };
        let finer = Settings { error: finer_mesh, ..settings.clone() };
        made = Some(prepass_for(world, cameras, &finer, watch.progress)?);
        clock.lap("prepass");
    }
}

/// Through which windows what `view` shows sees the sky; `None` where none is known. By what the world knows of itself pictures
/// of rooms by day take a tenth more rays.
fn windows(world: &World, view: &View) -> Option<Outlook> {
    let sky = world.scene.sky.as_ref().filter(|sky| !sky.mean().is_black());
    let outlook = sky.and(world.emitters.outlook())?;
    let aspect = view.width as f32 / view.height.max(1) as f32;
    let points = importance(world, std::slice::from_ref(view.camera), aspect).points;
    let mesh = &world.scene.mesh;
    let place = |point: &Point| {
        let [u, v] = point.uv;
        let p = mesh.interpolate(point.triangle, u, v, &mesh.positions);
        (p, mesh.geometric_normal(point.triangle) * point.side.sign())
    };
    let seen: Vec<_> = points.iter().filter(|point| point.seen).map(place).collect();
    outlook.with(world, &seen)
}

/// Time by stage.
struct Clock {
    last: Instant,
    stages: Vec<(&'static str, f64)>,
}

impl Clock {
    /// Adds the time since the last call to `stage`.
    fn lap(&mut self, stage: &'static str) {
        let seconds = std::mem::replace(&mut self.last, Instant::now()).elapsed().as_secs_f64();
        match self.stages.iter_mut().find(|s| s.0 == stage) {
            Some(known) => known.1 += seconds,
            None => self.stages.push((stage, seconds)),
        }
    }

    fn total(&self) -> f64 {
        self.stages.iter().map(|s| s.1).sum()
    }
}

/// Relative error that samples may leave in a picture of relative error `error`.
pub(crate) fn noise_goal(error: f32) -> f32 {
    error * NOISE_SHARE.sqrt()
}

/// What samples may leave as noise.
fn budget(settings: &Settings, goal: f32) -> Budget {
    // Rays through a pixel fill a square grid: of 10 that are allowed it takes 4.
    let most_camera = settings.samples.map_or(MOST_SAMPLES, |n| 4u32.pow(n.max(1).ilog(4)));
    Budget { goal, most_camera, most_shadow: MOST_SAMPLES }
}

/// What the prepass found, for the file and the user.
pub(crate) fn facts(r: &radiosity::Report) -> Vec<(String, String)> {
    let c = &r.convergence;
    let state = if c.converged { "converged" } else { "not converged" };
    let (what, shape) =
        if r.solver.is_empty() { ("gather", "sites gathered") } else { (&*r.solver, "patches") };
    let mut facts = vec![
        ("radiosity solver", format!("{what}, {:.1} MB", r.row_bytes as f64 / 1e6)),
        ("radiosity mesh", format!("{} elements, {} vertices, {} {shape}", r.elements, r.vertices, r.sites)),
        (
            "radiosity solve",
            format!(
                "{state} in {} iterations, on average within {:.2e} lx of the fixed point, largest row sum {:.3}",
                c.iterations, c.bound, r.norm
            ),
        ),
        ("radiosity balance", format!("{:.4} of the light that leaves arrives", r.balance)),
    ];
    if r.photons > 0 {
        facts.push(("caustics", format!("{} photons, {:.4} lm", r.photons, r.caustic_flux.luminance())));
    }
    facts.into_iter().map(|(name, value)| (name.to_string(), value)).collect()
}

/// The path-traced picture, in passes, so that one that is stopped is whole and only noisier.
fn trace_paths(world: &World, view: &View, spp: u32, seed: u64, watch: &Watch) -> (Film, bool) {
    const PASS: u32 = 16;
    let size = (view.width, view.height);
    watch.stage("image", u64::from(size.0) * u64::from(size.1) * u64::from(spp.div_ceil(PASS)));
    let everywhere: Vec<u32> = (0..size.0 * size.1).collect();
    let mut pixels = vec![Pixel::default(); everywhere.len()];
    let (mut done, mut finished) = (0, true);
    while done < spp && finished {
        let n = PASS.min(spp - done);
        let pass_seed = seed.wrapping_add(u64::from(done / PASS).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let pass = over_pixels(&everywhere, watch, |i| {
            path::render_pixel(world, view.camera, size, (i % size.0, i / size.0), n, pass_seed)
        });
        finished = pass.iter().all(Option::is_some);
        for (pixel, part) in pixels.iter_mut().zip(pass) {
            if let Some(part) = part {
                *pixel = pixel.merged(&part);
            }
        }
        done += n;
        watch.picture(size.0, size.1, &|| pixels.iter().map(Pixel::beauty).collect());
    }
    (Film::from_pixels(size.0, size.1, pixels), finished)
}
