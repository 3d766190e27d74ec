//! Pixels over threads, and where to spend samples.
//!
//! Every pixel is a function of (seed, place, effort) alone, so the picture does not depend on threads. A first pass
//! gives every pixel one ray; then those that need more are done again with four times as many rays of the kind they
//! lack, until their estimated error is below the one asked for.

use crate::film::{Film, Pixel};
use crate::importance::importance;
use crate::integrator::hybrid::Hybrid;
use crate::integrator::path;
use crate::pixel::{Effort, Key, Shot, View, shade};
use geometry::sampling::Lattice2;
use geometry::{Camera, World};
use radiosity::{Config, Solution};
use rayon::prelude::*;
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
    /// When to stop with what there is.
    pub deadline: Option<Instant>,
    /// Rays from each vertex, in place of the number that `error` asks for.
    pub gather_rays: Option<u32>,
    /// Rays through each pixel at most, in place of the number that `error` asks for.
    pub samples: Option<u32>,
}

/// How a render went.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Seconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
    /// Facts that depend on the scene and settings alone, never on time: they go into the file.
    pub texts: Vec<(String, String)>,
    /// How the prepass went; `None` for the path tracer.
    pub radiosity: Option<radiosity::Report>,
}

/// A picture and how it came about.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The picture; a pixel with 0 samples was not reached, and a film of nothing else is not worth a file.
    pub film: Film,
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
    let mut config = Config { seed: settings.seed, ..Config::for_error(settings.error) };
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
    let aspect = settings.width as f32 / settings.height.max(1) as f32;
    let matters = (!cameras.is_empty()).then(|| importance(world, cameras, aspect));
    radiosity::solve_for(world, &config, matters.as_ref(), &Watch { progress, deadline })
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
    let mut report = Report::default();
    let start = Instant::now();
    let (film, finished) = match settings.integrator {
        Integrator::Path { spp } => trace_paths(world, &view, spp, settings.seed, &watch),
        Integrator::Hybrid => {
            let made;
            let solution = match solution {
                Some(solution) => solution,
                None => {
                    made = prepass_for(world, std::slice::from_ref(camera), settings, progress)?;
                    report.stages.push(("prepass", start.elapsed().as_secs_f64()));
                    &made
                }
            };
            report.texts = facts(&solution.report);
            report.radiosity = Some(solution.report.clone());
            let rays = ((256.0 * (0.02 / settings.error)) as u32).clamp(64, 1024);
            let hybrid = Hybrid { world, solution, mode: settings.diffuse, pattern: Lattice2::new(rays) };
            hybrid_film(&hybrid, &view, settings, &watch)
        }
    };
    let before: f64 = report.stages.iter().map(|s| s.1).sum();
    report.stages.push(("image", start.elapsed().as_secs_f64() - before));
    Ok(Outcome { film, finished, report })
}

/// What the prepass found, for the file and the user.
fn facts(r: &radiosity::Report) -> Vec<(String, String)> {
    let c = &r.convergence;
    let state = if c.converged { "converged" } else { "not converged" };
    let mut facts = vec![
        (
            "radiosity mesh",
            format!("{} elements, {} vertices, {} sites gathered", r.elements, r.vertices, r.sites),
        ),
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

/// Calls `pixel` for every index of `which`, in parallel, until stopped; pixels not reached are `None`.
fn over_pixels<T: Send>(which: &[u32], watch: &Watch, pixel: impl Fn(u32) -> T + Sync) -> Vec<Option<T>> {
    let run = |chunk: &[u32]| -> Vec<Option<T>> {
        if watch.stopped() {
            return chunk.iter().map(|_| None).collect();
        }
        let done = chunk.iter().map(|&i| Some(pixel(i))).collect();
        watch.advance(chunk.len() as u64);
        done
    };
    which.par_chunks(256).flat_map_iter(run).collect()
}

/// The adaptive picture.
fn hybrid_film(hybrid: &Hybrid, view: &View, settings: &Settings, watch: &Watch) -> (Film, bool) {
    let pixels = view.width * view.height;
    let ladder = Ladder::new(settings);
    let seed = settings.seed;
    let at = |i: u32, effort| shade(hybrid, view, i % view.width, i / view.width, effort, seed);
    watch.stage("image", u64::from(pixels));
    let everywhere: Vec<u32> = (0..pixels).collect();
    let first = Effort { camera: 1, shadow: 4 };
    let mut shots: Vec<Option<Shot>> = over_pixels(&everywhere, watch, |i| at(i, first));
    let mut finished = shots.iter().all(Option::is_some);
    let mut rung = 0;
    while finished {
        let wanted = ladder.climb(&shots, view, rung);
        if wanted.is_empty() {
            break;
        }
        watch.stage("refining", wanted.len() as u64);
        let which: Vec<u32> = (0..wanted.len() as u32).collect();
        let again = over_pixels(&which, watch, |k| {
            let (i, effort) = wanted[k as usize];
            at(i, effort)
        });
        finished = again.iter().all(Option::is_some);
        for (&(i, _), shot) in wanted.iter().zip(again) {
            if shot.is_some() {
                shots[i as usize] = shot;
            }
        }
        rung += 1;
    }
    let done = shots.into_iter().map(|s| s.map_or_else(Pixel::default, |s| s.pixel)).collect();
    (Film::from_pixels(view.width, view.height, done), finished)
}

/// Which pixels get more, and how much at most.
struct Ladder {
    /// Estimated relative error of a pixel above which it gets more.
    target: f32,
    most_camera: u32,
    most_shadow: u32,
}

impl Ladder {
    fn new(settings: &Settings) -> Ladder {
        let error = settings.error;
        let steps = |base: f32| 4u32.pow((base / error).log(4.0).ceil().clamp(1.0, 6.0) as u32);
        // Half of the error asked: the first pass has errors too, and in simple rooms takes most of the time.
        Ladder {
            target: error / 2.0,
            most_camera: settings.samples.map_or(steps(2.4), |n| n.max(1)),
            most_shadow: steps(2.4),
        }
    }

    /// The pixels that need more than they had, with their next effort.
    fn climb(&self, shots: &[Option<Shot>], view: &View, rung: u32) -> Vec<(u32, Effort)> {
        let m = level(shots);
        let (w, h) = (view.width as i64, view.height as i64);
        (0..shots.len() as u32)
            .into_par_iter()
            .filter_map(|i| {
                let shot = shots[i as usize].as_ref()?;
                let beauty = shot.pixel.beauty();
                let den =
                    (beauty.r * beauty.r + beauty.g * beauty.g + beauty.b * beauty.b) / 3.0 + 0.01 * m * m;
                let relative = |variance: f32| (variance / den.max(1e-30)).sqrt();
                let (x, y) = (i64::from(i) % w, i64::from(i) / w);
                let (camera_variance, light_variance) = pooled_variance(shots, shot, (x, y), (w, h));
                let mut camera = relative(camera_variance) > self.target;
                let mut shadow = relative(light_variance) > self.target;
                camera |= rung == 0 && shot.fine;
                for k in 0..9 {
                    let (nx, ny) = (x + k % 3 - 1, y + k / 3 - 1);
                    if k == 4 || nx < 0 || ny < 0 || nx >= w || ny >= h {
                        continue;
                    }
                    let Some(other) = &shots[(ny * w + nx) as usize] else { continue };
                    if !same_surface(&shot.key, &other.key) {
                        // Rays that all met one surface may have missed a sliver of the other, half of what one of
                        // them stands for on average.
                        let missed =
                            (other.pixel.beauty() - beauty).luminance() * (0.5 / shot.effort.camera as f32);
                        camera |= rung == 0 || missed * missed > self.target * self.target * den;
                    } else if rung == 0 {
                        shadow |= (shot.visible - other.visible).abs() > 0.03;
                        let step = (shot.pixel.specular - other.pixel.specular).luminance();
                        camera |= step * step > self.target * den;
                        // A caustic's edge may run through the pixel.
                        let step = (shot.pixel.indirect - other.pixel.indirect).luminance();
                        camera |= step * step > 16.0 * self.target * self.target * den;
                    }
                }
                let next = Effort {
                    camera: if camera {
                        more(shot.effort.camera, 16, self.most_camera)
                    } else {
                        shot.effort.camera
                    },
                    shadow: if shadow {
                        more(shot.effort.shadow, 16, self.most_shadow)
                    } else {
                        shot.effort.shadow
                    },
                };
                (next != shot.effort).then_some((i, next))
            })
            .collect()
    }
}

/// Variance by camera rays and by shadow rays of the pixel (x, y), the mean of what it and its neighbours on the same
/// surface estimate.
///
/// A pixel's own estimate comes from the same few samples as its light: where they all missed, both are zero, and
/// pixels that stop there would darken the picture (by 0.6 % on a white ball under an even sky, and by 22 % on rough
/// metal beside a highlight, measured).
fn pooled_variance(
    shots: &[Option<Shot>],
    shot: &Shot,
    (x, y): (i64, i64),
    (w, h): (i64, i64),
) -> (f32, f32) {
    let (mut camera, mut light, mut count) = (0.0, 0.0, 0.0);
    for k in 0..9 {
        let (nx, ny) = (x + k % 3 - 1, y + k / 3 - 1);
        if nx < 0 || ny < 0 || nx >= w || ny >= h {
            continue;
        }
        let Some(other) = &shots[(ny * w + nx) as usize] else { continue };
        if k != 4 && !same_surface(&shot.key, &other.key) {
            continue;
        }
        // As if the neighbour had been given the same effort.
        let scale = |theirs: u32, ours: u32| theirs as f32 / ours.max(1) as f32;
        camera += other.camera_variance * scale(other.effort.camera, shot.effort.camera);
        light += other.light_variance * scale(other.effort.shadow, shot.effort.shadow);
        count += 1.0;
    }
    (camera / count, light / count)
}

/// The next rung: at least `least`, four times the last, at most `most`.
fn more(now: u32, least: u32, most: u32) -> u32 {
    (4 * now).max(least).min(most).max(now)
}

fn same_surface(a: &Option<Key>, b: &Option<Key>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.continues(b),
        (None, None) => true,
        _ => false,
    }
}

/// Brightness of the picture that visible lamps cannot inflate: M of the error metric.
fn level(shots: &[Option<Shot>]) -> f32 {
    let mut y: Vec<f32> = shots.iter().flatten().map(|s| s.pixel.beauty().luminance()).collect();
    if y.is_empty() {
        return 0.0;
    }
    let k = (y.len() - 1) * 9 / 10;
    let p90 = *y.select_nth_unstable_by(k, f32::total_cmp).1;
    (y.iter().map(|&v| f64::from(v.min(p90))).sum::<f64>() / y.len() as f64) as f32
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
    }
    (Film::from_pixels(size.0, size.1, pixels), finished)
}
