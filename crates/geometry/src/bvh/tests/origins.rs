//! `math::offset_origin` is enough: a ray that leaves a surface does not meet it again, and does meet what
//! touches it.

use super::shapes::{both, moved, soup, sphere};
use super::*;
use crate::math::offset_origin;

/// Rays that start on a mesh, move off, and meet a triangle at less than `reach` though the side they leave
/// to is empty (outside of convex meshes).
fn self_hits(mesh: &Mesh, rays: usize) -> usize {
    let bvh = Bvh::build(mesh);
    let random = &mut Random(77);
    let mut hits = 0;
    for _ in 0..rays {
        let t = random.below(mesh.triangles.len()) as u32;
        let (mut u, mut v) = (random.unit(), random.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let n = mesh.geometric_normal(t);
        let p = mesh.interpolate(t, u, v, &mesh.positions);
        let mut d = random.cube().normalize();
        if random.below(4) == 0 {
            d = (d - d.dot(n) * n).normalize() + 1e-3 * n; // grazing
        }
        let d = (d * d.dot(n).signum()).normalize();
        hits += usize::from(bvh.occluded(&Ray::new(offset_origin(p, n), d)));
    }
    hits
}

#[test]
fn spheres_have_no_acne() {
    for (centre, radius) in [(0.0, 1.0), (0.0, 1e-2), (10.0, 1.0), (1e3, 1.0), (1e5, 100.0), (1e5, 1e4)] {
        let mesh = sphere(Vec3::splat(centre), radius, 24);
        assert_eq!(self_hits(&mesh, 20_000), 0, "sphere of {radius} at {centre}");
    }
}

#[test]
fn planes_have_no_acne() {
    let quad = |h: f32| {
        let [a, b, c, d] = [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[x, z]| Vec3::new(x, 0.0, z));
        soup(&[[a, c, b], [a, d, c]])
    };
    for (half, offset) in [(1.0, 0.0), (100.0, 0.0), (1e3, 0.0), (10.0, 1e3), (1e3, 1e5)] {
        let tilt = glam::Quat::from_rotation_x(0.4) * glam::Quat::from_rotation_z(0.3);
        for (name, turn) in [("level", glam::Quat::IDENTITY), ("tilted", tilt)] {
            let mesh = moved(quad(half), |p| turn * p + Vec3::splat(offset));
            assert_eq!(self_hits(&mesh, 20_000), 0, "{name} plane of {half} at {offset}");
        }
    }
}

#[test]
fn a_sphere_on_a_plane_far_away_has_no_acne_and_no_gap() {
    // C27. One metre at 1e5 m, where an ulp is 8 mm: the sphere touches the plane in its lowest corner.
    let at = Vec3::new(1e5, 1e5, -1e5);
    let plane = soup(
        &[[[-50.0, -50.0], [50.0, 50.0], [50.0, -50.0]], [[-50.0, -50.0], [-50.0, 50.0], [50.0, 50.0]]]
            .map(|t| t.map(|[x, z]| at + Vec3::new(x, 0.0, z))),
    );
    let first = plane.triangles.len() as u32;
    let radius = 16.0;
    let mesh = both(plane, sphere(at + radius * Vec3::Y, radius, 32));
    let bvh = Bvh::build(&mesh);
    // From under the sphere, every ray up must be stopped by it, right up to the contact.
    for i in 0..400 {
        let (distance, angle) = (10.0 * (i as f32 / 400.0), 2.4 * i as f32);
        let p = at + distance * Vec3::new(angle.cos(), 0.0, angle.sin());
        let p = Vec3::new(p.x, at.y, p.z);
        let ray = Ray::new(offset_origin(p, Vec3::Y), Vec3::Y);
        let gap = radius - (radius * radius - distance * distance).sqrt();
        // Nearer to the contact than the offset there is no room for a ray to begin in.
        if gap > 4.0 {
            let hit = bvh.closest_hit(&ray);
            assert!(hit.is_some_and(|h| h.triangle >= first), "{distance}: {hit:?}");
        }
    }
    // Away from it, none is stopped by the plane it leaves.
    let random = &mut Random(5);
    for _ in 0..20_000 {
        let p = at + Vec3::new(50.0 * random.unit(), 0.0, 50.0 * random.unit());
        let d = random.cube().normalize();
        let ray = Ray::new(offset_origin(p, Vec3::Y), Vec3::new(d.x, d.y.abs().max(1e-3), d.z).normalize());
        let hit = bvh.closest_hit(&ray);
        assert!(hit.is_none_or(|h| h.triangle >= first), "{ray:?} {hit:?}");
    }
}

#[test]
fn a_wide_level_floor_is_met_from_just_above() {
    // Whatever the floor's size, its height is exact, and so is where a ray meets it.
    for half in [1.0, 110.81132, 1e4] {
        let [a, b, c, d] =
            [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, z]| Vec3::new(x, 0.0, z));
        let bvh = Bvh::build(&soup(&[[a, c, b], [a, d, c]]));
        let random = &mut Random(9);
        for _ in 0..5000 {
            let height = 1e-7 * (1.0 + 100.0 * random.unit());
            let origin = Vec3::new(0.5 * half * random.unit(), height, -0.3 * half * random.unit());
            let d = random.cube().normalize();
            let direction = Vec3::new(d.x, -d.y.abs().max(1e-3), d.z).normalize();
            let t = height / -direction.y;
            let hit = bvh.closest_hit(&Ray::new(origin, direction));
            assert!(hit.is_some_and(|h| (h.t - t).abs() < 1e-6 * t), "{t} {hit:?}");
            assert!(!bvh.occluded(&Ray::new(origin, -direction)));
        }
    }
}
