//! How much light a scene has in all, without a first pass: for exposing a sequence that paths alone render.

use crate::integrator::path;
use geometry::math::{offset_origin, to_world};
use geometry::sampling::{Rng, cosine_hemisphere, triangle};
use geometry::{Ray, World};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Places where it is measured, a path from each.
const PLACES: u32 = 4096;

/// About the mean irradiance, lx, over the sides of surfaces that light reaches, as
/// [`Solution::level`](radiosity::Solution::level) tells of a room that was solved: by a path from each of some thousand
/// places. It depends on the scene alone; 0 for one without surfaces or light.
pub fn level(world: &World) -> f32 {
    let mesh = &world.scene.mesh;
    let mut sums = Vec::with_capacity(mesh.triangles.len());
    let mut sum = 0f64;
    for t in 0..mesh.triangles.len() as u32 {
        sum += f64::from(mesh.area(t));
        sums.push(sum);
    }
    if sum <= 0.0 || sum.is_nan() {
        return 0.0;
    }
    let at = |i: u32| -> f32 {
        let mut rng = Rng::new(0x006c_6576_656c, u64::from(i));
        let chosen = (f64::from(i / 2) + f64::from(rng.f32())) / f64::from(PLACES / 2) * sum;
        let t = sums.partition_point(|&s| s <= chosen).min(sums.len() - 1) as u32;
        let (u, v) = triangle(rng.vec2());
        let n = mesh.geometric_normal(t) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let p = mesh.interpolate(t, u, v, &mesh.positions);
        let ray = Ray::new(offset_origin(p, n), to_world(cosine_hemisphere(rng.vec2()), n));
        let by_path = path::radiance(world, ray, &mut rng).0.total().luminance() * PI;
        // A ray meets no lamp without extent.
        let lamp = world.emitters.sample(&world.scene, p, n, rng.array()).filter(|l| l.delta);
        let by_lamp = lamp.map_or(0.0, |l| {
            let left = world.transmittance(&l.shadow_ray(p, n));
            (l.radiance * left).luminance() * l.wi.dot(n).max(0.0) / l.pdf
        });
        by_path + by_lamp
    };
    let found: Vec<f32> = (0..PLACES).into_par_iter().map(at).filter(|e| e.is_finite() && *e > 0.0).collect();
    found.iter().sum::<f32>() / found.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Light, LightKind, Material, MaterialId, Mesh, Rgb, Scene, Sky, Vec3};

    /// A black square of 2 m, under whatever shines.
    fn square() -> Scene {
        let black = Material { base_color: Rgb::BLACK, metallic: 0.0, specular: 0.0, ..Material::default() };
        let positions = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
        let mesh = Mesh {
            positions: positions.map(|[x, z]| Vec3::new(x, 0.0, z)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![MaterialId(0); 2],
            ..Mesh::default()
        };
        Scene { mesh, materials: vec![black], ..Scene::default() }
    }

    #[test]
    fn sky_and_sun_give_their_irradiance() {
        let mut scene = square();
        scene.sky = Some(Sky::Constant(Rgb::splat(2.0)));
        assert!((level(&World::new(scene)) / (2.0 * PI) - 1.0).abs() < 1e-3);
        let mut scene = square();
        let kind = LightKind::Directional { direction: Vec3::new(0.6, -0.8, 0.0) };
        scene.lights = vec![Light { name: String::new(), intensity: Rgb::splat(50.0), kind }];
        assert!((level(&World::new(scene)) / 40.0 - 1.0).abs() < 1e-3, "the side in its own shade has none");
        assert_eq!(level(&World::new(square())), 0.0);
        assert_eq!(level(&World::new(Scene::default())), 0.0);
    }
}
