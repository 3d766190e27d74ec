//! Inputs that trees choke on.

use super::shapes::{both, mesh, random_soup, soup};
use super::*;
use std::time::Instant;

#[test]
fn nothing_is_met_in_an_empty_mesh() {
    let bvh = Bvh::build(&Mesh::default());
    assert_eq!(bvh.closest_hit(&Ray::new(Vec3::ZERO, Vec3::Z)), None);
    assert!(!bvh.occluded(&Ray::new(Vec3::ZERO, Vec3::Z)));
}

#[test]
fn one_triangle() {
    let bvh = Bvh::build(&mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]));
    let above = Ray::new(Vec3::new(0.25, 0.5, 1.0), Vec3::NEG_Z);
    assert_eq!(bvh.closest_hit(&above), Some(Hit { t: 1.0, triangle: 0, u: 0.25, v: 0.5 }));
    assert!(!bvh.occluded(&Ray { direction: Vec3::Z, ..above }));
    // In its own plane it is not there.
    assert!(!bvh.occluded(&Ray::new(Vec3::new(-1.0, 0.2, 0.0), Vec3::X)));
}

#[test]
fn rays_that_are_not_rays_meet_nothing() {
    let bvh = Bvh::build(&random_soup(100, 1.0, &mut Random(1)));
    for bad in [f32::NAN, f32::INFINITY] {
        assert_eq!(bvh.closest_hit(&Ray::new(Vec3::splat(bad), Vec3::Z)), None);
        assert_eq!(bvh.closest_hit(&Ray::new(Vec3::ZERO, Vec3::new(0.0, bad, 1.0))), None);
        assert_eq!(bvh.closest_hit(&Ray { t_min: bad, ..Ray::new(Vec3::ZERO, Vec3::Z) }), None);
    }
    assert_eq!(bvh.closest_hit(&Ray { t_max: f32::NAN, ..Ray::new(Vec3::ZERO, Vec3::Z) }), None);
    assert_eq!(bvh.closest_hit(&Ray::new(Vec3::ZERO, Vec3::ZERO)), None);
}

#[test]
fn bad_triangles_are_left_out() {
    let good = random_soup(200, 0.3, &mut Random(2));
    let mut bad = Vec::new();
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        bad.push([Vec3::splat(x), Vec3::X, Vec3::Y]);
        bad.push([Vec3::ZERO, Vec3::new(0.0, x, 0.0), Vec3::Y]);
    }
    bad.extend([[Vec3::X; 3], [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X], [Vec3::ZERO, Vec3::ZERO, Vec3::X]]);
    let without = Bvh::build(&good);
    let with = Bvh::build(&both(good, soup(&bad)));
    let random = &mut Random(3);
    for _ in 0..2000 {
        let ray = Ray::new(2.0 * random.cube(), random.direction());
        assert_eq!(with.closest_hit(&ray), without.closest_hit(&ray));
    }
}

#[test]
fn huge_coordinates_build() {
    let far = f32::MAX;
    let huge =
        soup(&[[Vec3::ZERO, far * Vec3::X, far * Vec3::Y], [-far * Vec3::ONE, far * Vec3::X, Vec3::Z]]);
    let bvh = Bvh::build(&both(random_soup(100, 0.3, &mut Random(4)), huge));
    bvh.closest_hit(&Ray::new(Vec3::splat(0.5), Vec3::NEG_Z)); // what it meets overflows; it must only return
}

/// What halves nothing takes as many steps as there are triangles: thousands of times as long as usual, not some.
const SLOW: f32 = 8.0;

/// The tree over `mesh`, and in what multiple of the time that as many triangles take of any kind it was built, by the
/// best of three, for other tests run beside it.
fn beside_any(mesh: &Mesh) -> (Bvh, f32) {
    let any = random_soup(mesh.triangles.len(), 0.3, &mut Random(8));
    let best = |mesh: &Mesh| {
        let timed = |_| {
            let begin = Instant::now();
            Bvh::build(mesh);
            begin.elapsed().as_secs_f32()
        };
        (0..3).map(timed).fold(f32::INFINITY, f32::min)
    };
    let times = best(mesh) / best(&any);
    println!("{times} times as long");
    (Bvh::build(mesh), times)
}

#[test]
fn coincident_triangles_build_fast_and_give_the_first() {
    for triangle in [[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::ONE, Vec3::new(3.0, 0.1, 0.2), Vec3::Z]] {
        let (bvh, times) = beside_any(&soup(&vec![triangle; 100_000]));
        assert!(times < SLOW, "{times} times as long");
        let centre = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        let ray = Ray::new(centre + Vec3::Z, Vec3::NEG_Z);
        assert_eq!(bvh.closest_hit(&ray).map(|h| h.triangle), Some(0));
        assert!(!bvh.occluded(&Ray { direction: Vec3::Z, ..ray }));
    }
}

#[test]
fn concentric_triangles_build_fast() {
    // One centroid, 50 000 sizes.
    let triangles: Vec<[Vec3; 3]> =
        (1..=50_000).map(|i| [Vec3::X, Vec3::Y, -Vec3::X - Vec3::Y].map(|p| p * i as f32)).collect();
    let (bvh, times) = beside_any(&soup(&triangles));
    assert!(times < SLOW, "{times} times as long");
    assert!(bvh.occluded(&Ray::new(Vec3::new(0.1, 0.1, 1.0), Vec3::NEG_Z)));
}

#[test]
fn an_even_row_builds_fast() {
    // Every pair of neighbours has a union of the same size: a tie for whoever clusters by size.
    let begin = Instant::now();
    let triangles: Vec<[Vec3; 3]> =
        (0..=65_536).map(|i| [Vec3::ZERO, Vec3::Y, Vec3::Z].map(|p| p + i as f32 * Vec3::X)).collect();
    let bvh = Bvh::build(&soup(&triangles));
    assert!(begin.elapsed().as_secs_f32() < 2.0, "{:?}", begin.elapsed());
    let ray = Ray { t_min: 0.5, ..Ray::new(Vec3::new(1000.0, 0.2, 0.2), Vec3::X) };
    assert_eq!(bvh.closest_hit(&ray).map(|h| (h.triangle, h.t)), Some((1001, 1.0)));
}

#[test]
fn a_tree_too_deep_is_halved_and_gives_the_same_hits() {
    let mesh = random_soup(3000, 0.2, &mut Random(6));
    let deep = Bvh::build(&mesh);
    let (items, order) = items::items(&mesh);
    for level in 0..4 {
        let binary = binary::build(&mesh, &items, order.clone());
        let halved =
            Bvh { tree: wide::fold_to(&mesh, binary, level), tracer: deep.tracer, count: Count::default() };
        let random = &mut Random(7);
        for _ in 0..3000 {
            let ray = Ray::new(1.5 * random.cube(), random.direction());
            assert_eq!(halved.closest_hit(&ray), deep.closest_hit(&ray));
        }
    }
}

#[test]
fn triangles_in_a_geometric_series_are_met() {
    // Each an eighth as large as the one before: what makes a tree as deep as it has triangles.
    let triangles: Vec<[Vec3; 3]> =
        (0..20).map(|i| [Vec3::ONE, Vec3::X, Vec3::Y].map(|p| p * 0.125f32.powi(i - 10))).collect();
    let bvh = Bvh::build(&soup(&triangles));
    for (i, [a, b, c]) in triangles.iter().enumerate() {
        let inside = (*a + *b + *c) / 3.0;
        let n = (*b - *a).normalize().cross((*c - *a).normalize()).normalize();
        let ray = Ray::new(inside + 0.01 * a.length() * n, -n);
        assert_eq!(bvh.closest_hit(&ray).map(|h| h.triangle), Some(i as u32));
    }
}
