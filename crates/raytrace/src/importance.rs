//! What the cameras see, and what lights it: where the prepass should take care.

use geometry::math::{offset_origin, to_world};
use geometry::sampling::{Rng, cosine_hemisphere};
use geometry::{Camera, Ray, World};
use radiosity::element::Side;
use radiosity::importance::{Importance, Point};
use rayon::prelude::*;

/// Camera rays across a picture, and down it.
const ACROSS: u32 = 160;
const DOWN: u32 = 100;
/// Surfaces that a ray is followed over by mirrors and glass.
const LONGEST: usize = 12;

/// Points that `cameras` see, directly or by way of mirrors and glass, and the points whose light comes to these after one
/// diffuse reflection. The order of the cameras does not matter to what is made of them.
///
/// - `aspect`: width over height of the pictures.
pub fn importance(world: &World, cameras: &[Camera], aspect: f32) -> Importance {
    let of = |camera: &Camera| -> Vec<Point> {
        (0..ACROSS * DOWN)
            .into_par_iter()
            .flat_map_iter(|i| {
                let mut rng = Rng::new(0x696d_706f_7274, u64::from(i));
                let x = ((i % ACROSS) as f32 + rng.f32()) / ACROSS as f32;
                let y = ((i / ACROSS) as f32 + rng.f32()) / DOWN as f32;
                let mut points = Vec::new();
                follow(world, camera.ray(x, y, aspect), true, &mut rng, &mut points);
                points
            })
            .collect()
    };
    Importance { points: cameras.iter().flat_map(of).collect() }
}

/// Follows a ray over what is not diffuse and notes the diffuse surfaces that it meets; from what is seen one more ray
/// looks for what lights it.
fn follow(world: &World, mut ray: Ray, seen: bool, rng: &mut Rng, points: &mut Vec<Point>) {
    for _ in 0..LONGEST {
        let Some(hit) = world.closest(&ray) else { return };
        let surface = world.surface(&ray, &hit);
        if surface.coverage < 1.0 && rng.f32() >= surface.coverage {
            ray.t_min = hit.t;
            continue;
        }
        if surface.unlit.is_some() {
            return;
        }
        if surface.bsdf.has_diffuse() {
            let side = Side::met(surface.front);
            points.push(Point { triangle: hit.triangle, uv: [hit.u, hit.v], side, seen });
            if seen {
                let wi = to_world(cosine_hemisphere(rng.vec2()), surface.ns);
                if wi.dot(surface.ng) > 0.0 {
                    let onward = Ray::new(offset_origin(surface.position, surface.ng), wi);
                    follow(world, onward, false, rng, points);
                }
            }
        }
        // A coat over a diffuse base reflects as well: what it shows is seen, if by fewer rays.
        let wo = -ray.direction;
        let share = surface.bsdf.specular_albedo(wo).luminance();
        if share <= 0.0 || (surface.bsdf.has_diffuse() && rng.f32() >= share) {
            return;
        }
        let Some(next) = surface.bsdf.sample_specular(wo, rng.array()) else { return };
        let away = if next.wi.dot(surface.ng) > 0.0 { surface.ng } else { -surface.ng };
        ray = Ray::new(offset_origin(surface.position, away), next.wi);
    }
}
