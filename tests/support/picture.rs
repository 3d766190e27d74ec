//! Pictures of a world, small ones, and numbers of them.

use geometry::{Camera, Rgb, World};
use radiosity::Solution;
use raytrace::{Film, Integrator, Settings, prepass, render};

/// The two passes at `error` (0.02 is 2 %), `width` × `height`, indirect light from the vertices.
pub fn hybrid(width: u32, height: u32, error: f32) -> Settings {
    Settings { width, height, seed: 0, error, verify: false, ..Settings::default() }
}

/// The reference, `spp` paths through each pixel.
pub fn path(width: u32, height: u32, spp: u32) -> Settings {
    Settings { integrator: Integrator::Path { spp }, ..hybrid(width, height, 0.02) }
}

/// What `camera` sees of `world`.
pub fn shoot(world: &World, camera: &Camera, settings: &Settings) -> Film {
    shoot_with(world, camera, None, settings)
}

/// As [`shoot`], with a solution made before.
pub fn shoot_with(world: &World, camera: &Camera, solution: Option<&Solution>, settings: &Settings) -> Film {
    let outcome = render(world, camera, solution, settings, &()).expect("the scene has a solution");
    assert!(outcome.finished, "nobody stopped it");
    assert_eq!(outcome.film.repaired, 0, "no pixel was NaN, infinite or negative");
    outcome.film
}

/// The prepass that `settings` ask for.
pub fn solve(world: &World, settings: &Settings) -> Solution {
    prepass(world, settings, &()).expect("the scene has a solution")
}

/// Luminance of every pixel, cd/m².
pub fn luminance(film: &Film) -> Vec<f64> {
    film.pixels.iter().map(|p| f64::from(p.beauty().luminance())).collect()
}

/// Mean luminance, cd/m².
pub fn mean(film: &Film) -> f64 {
    mean_of(film, |p| p.beauty())
}

/// Mean luminance of a layer.
pub fn mean_of(film: &Film, layer: impl Fn(&raytrace::Pixel) -> Rgb) -> f64 {
    film.pixels.iter().map(|p| f64::from(layer(p).luminance())).sum::<f64>() / film.pixels.len() as f64
}

/// Standard error of the mean luminance, by the pixels' own variances.
pub fn standard_error(film: &Film) -> f64 {
    film.pixels.iter().map(|p| f64::from(p.variance)).sum::<f64>().sqrt() / film.pixels.len() as f64
}

/// Least and greatest luminance.
pub fn range(film: &Film) -> (f64, f64) {
    let y = luminance(film);
    (y.iter().copied().fold(f64::INFINITY, f64::min), y.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}
