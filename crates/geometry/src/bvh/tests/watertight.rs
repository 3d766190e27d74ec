//! From inside a closed mesh no ray escapes: at random, along edges, through corners, along axes.

use super::shapes::{cube, moved, sphere};
use super::*;
use crate::Mesh;

/// Rays that leave the mesh from points near `centre`, aimed at corners, at edges and inside triangles.
fn escapes(mesh: &Mesh, centre: Vec3, spread: f32, rays: usize) -> [usize; 3] {
    let kernels = Kernel::ALL.map(|k| Bvh::build_for(mesh, k));
    let random = &mut Random(42);
    let mut escapes = [0; 3];
    for i in 0..rays {
        let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()) as u32);
        let s = random.unit();
        let targets = [a, a + s * (b - a), (a + b + c) / 3.0];
        // Every other from the exact centre, where directions have zeros and the symmetry makes ties.
        let origin = if i % 2 == 0 { centre } else { centre + spread * random.cube() };
        for (target, escaped) in targets.into_iter().zip(&mut escapes) {
            let ray = Ray::new(origin, (target - origin).normalize());
            for bvh in &kernels {
                *escaped += usize::from(bvh.closest_hit(&ray).is_none());
                *escaped += usize::from(!bvh.occluded(&ray));
            }
        }
    }
    escapes
}

#[test]
fn a_sphere_holds_all_rays() {
    assert_eq!(escapes(&sphere(Vec3::ZERO, 1.0, 40), Vec3::ZERO, 0.5, 30_000), [0; 3]);
}

#[test]
fn a_sphere_far_away_holds_all_rays() {
    let centre = Vec3::new(1e3, -2e3, 5e2);
    assert_eq!(escapes(&sphere(centre, 1.0, 40), centre, 0.5, 30_000), [0; 3]);
}

#[test]
fn a_tiny_sphere_holds_all_rays() {
    assert_eq!(escapes(&sphere(Vec3::ZERO, 1e-3, 30), Vec3::ZERO, 5e-4, 20_000), [0; 3]);
}

#[test]
fn a_cube_holds_all_rays() {
    assert_eq!(escapes(&cube(8), Vec3::ZERO, 1.0, 30_000), [0; 3]);
    let scaled = moved(cube(3), |p| p * Vec3::new(1.0, 30.0, 0.01));
    assert_eq!(escapes(&scaled, Vec3::ZERO, 0.01, 30_000), [0; 3]);
}

#[test]
fn rays_along_the_axes_hit_edges_and_corners() {
    // The grid's lines are at multiples of 1/4: exact in f32, so every ray meets an edge or a corner exactly.
    let bvh = Bvh::build(&cube(8));
    for axis in 0..3 {
        for (i, j) in (-4..=4).flat_map(|i| (-4..=4).map(move |j| (i, j))) {
            for (sign, zero) in [(1.0, 0.0), (-1.0, -0.0)] {
                let mut origin = Vec3::ZERO;
                origin[(axis + 1) % 3] = 0.25 * i as f32;
                origin[(axis + 2) % 3] = 0.25 * j as f32;
                let mut direction = Vec3::splat(zero);
                direction[axis] = sign;
                let ray = Ray::new(origin, direction);
                let hit = bvh.closest_hit(&ray).unwrap_or_else(|| panic!("escaped: {ray:?}"));
                assert_eq!(hit.t, 1.0);
            }
        }
    }
}
