//! Hits of the tree are those of brute force: bit for bit with our own triangle test, within rounding in f64.

use super::shapes::{cube, moved, random_soup, sphere};
use super::*;
use crate::Mesh;
use crate::bvh::prepared::Prepared;
use glam::DVec3;

/// The nearest hit by asking every block.
fn brute_force(bvh: &Bvh, ray: &Ray) -> Option<Hit> {
    portable::closest_in_all_blocks(&bvh.tree, &Prepared::new(ray)?)
}

/// t, and the least of the three barycentric weights, of a ray with a triangle's plane, in f64.
fn exact(mesh: &Mesh, t: u32, ray: &Ray) -> Option<(f64, f64)> {
    let [a, b, c] = mesh.corners(t).map(|p| p.as_dvec3() - ray.origin.as_dvec3());
    let d = ray.direction.as_dvec3();
    let [u, v, w] = [(b, c), (c, a), (a, b)].map(|(p, q): (DVec3, DVec3)| d.dot(q.cross(p)));
    let det = u + v + w;
    let n = (b - a).cross(c - a);
    // Grazing rays have no well-conditioned answer.
    if n.dot(d).abs() < 1e-3 * n.length() {
        return None;
    }
    Some((n.dot(a) / n.dot(d), (u / det).min(v / det).min(w / det)))
}

/// Traces rays from and toward the mesh's surroundings, and compares.
fn check(mesh: &Mesh, rays: usize, seed: u64) {
    let bvh = Bvh::build(mesh);
    let others: Vec<Bvh> = Kernel::ALL.into_iter().map(|k| Bvh::build_for(mesh, k)).collect();
    let (lo, hi) = mesh.bounds().unwrap();
    let (centre, size) = (0.5 * (lo + hi), 0.5 * (hi - lo).max_element());
    // t is worked out from corners relative to the origin, of magnitude up to a few sizes; so is what is left
    // of the weights near an edge, in proportion to the triangle's own size, hence the larger margin below.
    let tolerance = 1e-5 * size as f64;
    let random = &mut Random(seed);
    let mut hits = 0;
    for _ in 0..rays {
        let origin = centre + 1.5 * size * random.cube();
        let ray = Ray {
            t_min: 0.2 * size * random.unit(),
            t_max: 3.0 * size,
            ..Ray::new(origin, random.direction())
        };
        let hit = bvh.closest_hit(&ray);
        assert_eq!(hit, brute_force(&bvh, &ray), "{ray:?}");
        assert_eq!(bvh.occluded(&ray), hit.is_some(), "{ray:?}");
        for other in &others {
            assert_eq!(other.closest_hit(&ray), hit, "{ray:?} by {:?}", other.tracer);
            assert_eq!(other.occluded(&ray), hit.is_some(), "{ray:?} by {:?}", other.tracer);
        }
        if let Some(h) = hit {
            hits += 1;
            assert!(h.t > ray.t_min && h.t < ray.t_max);
            assert!(h.u >= 0.0 && h.v >= 0.0 && h.u + h.v <= 1.0 + f32::EPSILON);
            let at = mesh.interpolate(h.triangle, h.u, h.v, &mesh.positions).as_dvec3();
            let along = ray.origin.as_dvec3() + ray.direction.as_dvec3() * h.t as f64;
            let far = tolerance + 1e-6 * centre.length() as f64;
            assert!((at - along).length() < 10.0 * far, "{ray:?} {h:?} {at} {along}");
        }
        let limit = hit.map_or(ray.t_max, |h| h.t) as f64 - tolerance;
        for t in 0..mesh.triangles.len() as u32 {
            if let Some((d, inside)) = exact(mesh, t, &ray) {
                let missed = inside > 1e-2 && d > ray.t_min as f64 + tolerance && d < limit;
                assert!(!missed, "{ray:?} {hit:?} should have met {t} at {d}");
            }
        }
    }
    assert!(hits > rays / 50, "{hits} hits are no test");
}

#[test]
fn random_triangles() {
    check(&random_soup(1000, 0.3, &mut Random(1)), 3000, 2);
    check(&random_soup(40, 2.0, &mut Random(3)), 10_000, 4);
}

#[test]
fn far_from_the_origin() {
    check(&moved(sphere(Vec3::ZERO, 10.0, 20), |p| p + Vec3::splat(1e5)), 3000, 5);
}

#[test]
fn tiny_and_large() {
    for scale in [1e-9, 1e-6, 1e-3, 1e5, 1e10] {
        check(&moved(random_soup(500, 0.4, &mut Random(6)), |p| p * scale), 2000, 7);
    }
}

#[test]
fn boxes_with_flat_sides() {
    check(&cube(4), 5000, 8);
}

#[test]
fn every_build_gives_the_same_hits() {
    // With ties: each triangle twice.
    let once = random_soup(3000, 0.2, &mut Random(9));
    let mesh = shapes::both(once.clone(), once);
    let pools = [1, 3].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
    let [a, b] = pools.map(|pool| pool.install(|| Bvh::build(&mesh)));
    let random = &mut Random(10);
    for _ in 0..20_000 {
        let ray = Ray::new(2.0 * random.cube(), random.direction());
        let hit = a.closest_hit(&ray);
        assert_eq!(hit, b.closest_hit(&ray));
        assert!(hit.is_none_or(|h| h.triangle < 3000), "the first of two equals");
    }
}

#[test]
fn the_interval_is_open() {
    let kernels = Kernel::ALL.map(|k| Bvh::build_for(&cube(1), k));
    let ray = Ray::new(Vec3::new(0.3, 0.2, 0.0), Vec3::Z);
    let up = |x: f32| f32::from_bits(x.to_bits() + 1);
    for (t_min, t_max, met) in [
        (0.0, 1.0, false),
        (0.0, up(1.0), true),
        (1.0, 2.0, false),
        (1.0 - f32::EPSILON, 2.0, true),
        (1.0, 1.0, false),
    ] {
        let ray = Ray { t_min, t_max, ..ray };
        for bvh in &kernels {
            assert_eq!(bvh.closest_hit(&ray).is_some(), met, "{t_min} {t_max} by {:?}", bvh.tracer);
            assert_eq!(bvh.occluded(&ray), met);
        }
    }
}
