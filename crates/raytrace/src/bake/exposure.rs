//! How bright a baked room is to be shown: as the preview of a picture of it would be.

use super::light::{Place, roughly};
use crate::tonemap;
use geometry::sampling::{self, Rng};
use geometry::{Camera, Rgb, World};
use radiosity::Solution;
use radiosity::element::Side;

/// Columns and rows of the rough picture.
const COLUMNS: u32 = 80;
const ROWS: u32 = 60;

/// The exposure value (ISO 100) for the first of `cameras`; without cameras, for all surfaces by their area.
pub fn automatic_exposure(world: &World, solution: &Solution, cameras: &[Camera]) -> f32 {
    let mut pixels = Vec::new();
    if let Some(camera) = cameras.first() {
        let aspect = camera.aspect.unwrap_or(COLUMNS as f32 / ROWS as f32);
        for i in 0..COLUMNS * ROWS {
            let x = ((i % COLUMNS) as f32 + 0.5) / COLUMNS as f32;
            let y = ((i / COLUMNS) as f32 + 0.5) / ROWS as f32;
            let ray = camera.ray(x, y, aspect);
            pixels.push(match world.closest(&ray) {
                Some(hit) => {
                    let front = world.scene.mesh.geometric_normal(hit.triangle).dot(ray.direction) <= 0.0;
                    let side = Side::met(front);
                    let place = Place { triangle: hit.triangle, uv: [hit.u, hit.v], side };
                    roughly(world, solution, place).radiance()
                }
                None => world.scene.sky.as_ref().map_or(Rgb::BLACK, |sky| sky.radiance(ray.direction)),
            });
        }
    } else {
        let mesh = &world.scene.mesh;
        let mut sums = Vec::with_capacity(mesh.triangles.len());
        let mut sum = 0.0;
        for t in 0..mesh.triangles.len() as u32 {
            sum += f64::from(mesh.area(t));
            sums.push(sum);
        }
        let mut rng = Rng::new(0, 0x6578_706f);
        for _ in 0..if sum > 0.0 { COLUMNS * ROWS } else { 0 } {
            let at = f64::from(rng.f32()) * sum;
            let triangle = sums.partition_point(|&s| s <= at).min(sums.len() - 1) as u32;
            let (u, v) = sampling::triangle(rng.vec2());
            pixels
                .push(roughly(world, solution, Place { triangle, uv: [u, v], side: Side::Front }).radiance());
        }
    }
    pixels.retain(|p| p.is_finite());
    tonemap::automatic_exposure(&pixels)
}
