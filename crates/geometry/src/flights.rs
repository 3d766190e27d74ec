//! How far light flies from surface to surface, and so how large the rooms are.

use crate::math::{offset_origin, to_world};
use crate::sampling::{self, Rng};
use crate::{Bvh, Hit, Mesh, Ray};

/// Flights that tell the size of the rooms.
const RAYS: usize = 4096;

/// A diffuse ray from one surface to the next.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Triangle that it set out from.
    pub from: u32,
    /// Where on it: the weights of the second and the third corner.
    pub at: [f32; 2],
    /// What it met, how far away (m).
    pub hit: Hit,
}

/// Those of `count` diffuse rays from random places that meet something.
///
/// They start on triangles drawn by the square root of their area, a compromise between the ground outside, which has all
/// the area, and the furniture, which has all the triangles.
pub fn flights(mesh: &Mesh, bvh: &Bvh, count: usize) -> Vec<Flight> {
    let mut sums: Vec<f64> = Vec::with_capacity(mesh.triangles.len());
    let mut sum = 0.0;
    for t in 0..mesh.triangles.len() as u32 {
        sum += f64::from(mesh.area(t)).sqrt();
        sums.push(sum);
    }
    if sum <= 0.0 {
        return Vec::new();
    }
    let mut rng = Rng::new(0x73_6361_6c65, 0);
    let fly = |i: usize| {
        let at = f64::from(rng.f32()) * sum;
        let from = sums.partition_point(|&s| s <= at).min(sums.len() - 1) as u32;
        let (u, v) = sampling::triangle(rng.vec2());
        let n = mesh.geometric_normal(from) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let wi = to_world(sampling::cosine_hemisphere(rng.vec2()), n);
        let origin = offset_origin(mesh.interpolate(from, u, v, &mesh.positions), n);
        bvh.closest_hit(&Ray::new(origin, wi)).map(|hit| Flight { from, at: [u, v], hit })
    };
    (0..count).filter_map(fly).collect()
}

/// Typical size of an enclosed space, m: five times the median flight, at most `diagonal`.
///
/// Furniture halves the flights of the empty room, whose diagonal is two to three times them.
pub(crate) fn room_size(mesh: &Mesh, bvh: &Bvh, diagonal: f32) -> f32 {
    let mut distances: Vec<f32> = flights(mesh, bvh, RAYS).iter().map(|f| f.hit.t).collect();
    if distances.len() < RAYS / 64 {
        return diagonal; // an open scene: hardly anything sees anything else
    }
    let middle = distances.len() / 2;
    let median = *distances.select_nth_unstable_by(middle, f32::total_cmp).1;
    (5.0 * median).min(diagonal)
}
