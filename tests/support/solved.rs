//! Numbers of a radiosity solution, means over area; and illuminance without one.

use geometry::math::{offset_origin, to_world};
use geometry::sampling::{Rng, cosine_hemisphere};
use geometry::{Ray, Rgb, World};
use radiosity::Solution;
use radiosity::element::Side;
use rayon::prelude::*;
use raytrace::integrator::path;
use raytrace::measure::Sensor;

/// Points on each side of a triangle's parametrisation: the error of a mean is that of a midpoint rule with 64 cells.
const CELLS: usize = 8;

/// Mean over the area of the triangles that `of` names, by their number, of `value` (triangle, u, v).
pub fn area_mean(world: &World, of: impl Fn(u32) -> bool, value: impl Fn(u32, f32, f32) -> Rgb) -> f64 {
    let (mut sum, mut whole) = (0.0, 0.0);
    for t in (0..world.scene.mesh.triangles.len() as u32).filter(|&t| of(t)) {
        let area = f64::from(world.scene.mesh.area(t));
        whole += area;
        for (u, v) in cells() {
            sum += area * f64::from(value(t, u, v).luminance()) / (CELLS * CELLS) as f64;
        }
    }
    sum / whole
}

/// Area mean of the indirect irradiance on all fronts, lx.
pub fn indirect_mean(world: &World, solution: &Solution) -> f64 {
    area_mean(world, |_| true, |t, u, v| solution.irradiance(world, t, u, v, Side::Front))
}

/// Illuminance (lx) at a sensor by `paths` paths of the path tracer, which sees no solution, and its standard error.
pub fn by_paths(world: &World, sensor: &Sensor, paths: u32, seed: u64) -> (f64, f64) {
    let one = |i: u32| {
        let mut rng = Rng::new(seed, u64::from(i));
        let wi = to_world(cosine_hemisphere(rng.vec2()), sensor.normal);
        let ray = Ray::new(offset_origin(sensor.position, sensor.normal), wi);
        std::f64::consts::PI * f64::from(path::radiance(world, ray, &mut rng).0.total().luminance())
    };
    let found: Vec<f64> = (0..paths).into_par_iter().map(one).collect();
    let n = f64::from(paths);
    let mean = found.iter().sum::<f64>() / n;
    let square = found.iter().map(|e| (e - mean).powi(2)).sum::<f64>();
    (mean, square.sqrt() / n)
}

/// Centres of equal parts of a triangle: the upper half of a grid of squares is folded onto the lower.
pub fn cells() -> impl Iterator<Item = (f32, f32)> {
    (0..CELLS * CELLS).map(|k| {
        // Off the diagonal by a little, so that a cell cut in half falls on one side.
        let (i, j) = (k % CELLS, k / CELLS);
        let (u, v) = ((i as f32 + 0.45) / CELLS as f32, (j as f32 + 0.5) / CELLS as f32);
        if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) }
    })
}
