//! A scene and a camera to a film.

use crate::film::{Film, Pixel};
use geometry::{Camera, Rgb, World};
use std::time::Instant;

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
    /// Rays through each pixel, in place of the number that `error` asks for.
    pub samples: Option<u32>,
}

/// Whoever watches a render and may end it.
pub trait Progress: Sync {
    /// A stage of `total` units begins, and the one before ends.
    fn stage(&self, name: &'static str, total: u64);
    /// `n` more units of the stage are done.
    fn advance(&self, n: u64);
    /// Whether the render should end with what it has.
    fn stopped(&self) -> bool;
}

/// How a render went.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Seconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
    /// Rays cast in all.
    pub rays: u64,
    /// Facts that depend on the scene and settings alone, never on time: they go into the file.
    pub texts: Vec<(String, String)>,
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

/// Renders `world` as `camera` sees it.
///
/// Stand-in until the integrators land: every pixel shows the direction of its ray as a colour.
pub fn render(_world: &World, camera: &Camera, settings: &Settings, progress: &dyn Progress) -> Outcome {
    let started = Instant::now();
    progress.stage("image", u64::from(settings.height));
    let (width, height) = (settings.width, settings.height);
    let mut film = Film::new(width, height);
    let mut finished = true;
    for y in 0..height {
        finished = !progress.stopped() && settings.deadline.is_none_or(|end| Instant::now() < end);
        if !finished {
            break;
        }
        for x in 0..width {
            let (u, v) = ((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            let d = camera.ray(u, v, width as f32 / height as f32).direction;
            let direct = Rgb::new(0.5 + 0.5 * d.x, 0.5 + 0.5 * d.y, 0.5 + 0.5 * d.z);
            film.set(x, y, Pixel { direct, samples: 1, ..Pixel::default() });
        }
        progress.advance(1);
    }
    let stages = vec![("image", started.elapsed().as_secs_f64())];
    Outcome { film, finished, report: Report { stages, rays: 0, texts: Vec::new() } }
}
