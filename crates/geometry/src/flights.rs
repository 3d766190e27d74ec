//! How far light flies from surface to surface, and so how large the rooms are.

use crate::math::{offset_origin, to_world};
use crate::sampling::{self, Rng};
use crate::{Bvh, Hit, Mesh, Ray, Vec3};

/// Flights that tell the size of the rooms.
const RAYS: usize = 4096;

/// A diffuse ray from one surface to the next.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Triangle that it set out from.
    pub from: u32,
    /// Whether it left from the front.
    pub front: bool,
    /// Where on it: the weights of the second and the third corner.
    pub at: [f32; 2],
    /// Unit vector that it flew along.
    pub direction: Vec3,
    /// What it met, how far away (m).
    pub hit: Hit,
}

impl Flight {
    /// Where it ended, with the unit normal there toward where it came from.
    pub(crate) fn end(&self, mesh: &Mesh) -> (Vec3, Vec3) {
        let Hit { triangle, u, v, .. } = self.hit;
        let n = mesh.geometric_normal(triangle);
        let n = if n.dot(self.direction) > 0.0 { -n } else { n };
        (mesh.interpolate(triangle, u, v, &mesh.positions), n)
    }

    /// Whether it is not from the back of one face to the back of another, which is inside of things.
    pub(crate) fn is_outside(&self, mesh: &Mesh) -> bool {
        self.front || mesh.geometric_normal(self.hit.triangle).dot(self.direction) <= 0.0
    }
}

/// Those of `count` diffuse rays from random places that meet something.
///
/// They start on triangles drawn by their area to the power of `by`: 1 favours the ground outside, which has all the area,
/// and 0 the furniture, which has all the triangles.
pub fn flights(mesh: &Mesh, bvh: &Bvh, count: usize, by: f64) -> Vec<Flight> {
    let mut sums: Vec<f64> = Vec::with_capacity(mesh.triangles.len());
    let mut sum = 0.0;
    for t in 0..mesh.triangles.len() as u32 {
        sum += f64::from(mesh.area(t)).powf(by);
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
        let front = i.is_multiple_of(2);
        let n = mesh.geometric_normal(from) * if front { 1.0 } else { -1.0 };
        let wi = to_world(sampling::cosine_hemisphere(rng.vec2()), n);
        let origin = offset_origin(mesh.interpolate(from, u, v, &mesh.positions), n);
        bvh.closest_hit(&Ray::new(origin, wi)).map(|hit| Flight {
            from,
            front,
            at: [u, v],
            direction: wi,
            hit,
        })
    };
    (0..count).filter_map(fly).collect()
}

/// Typical size of an enclosed space, m: five times the median flight, at most `diagonal`.
///
/// Furniture halves the flights of the empty room, whose diagonal is two to three times them. Flights from the back of one
/// face to the back of another are inside of things, and finely modelled things have most of the triangles: with those, and
/// starts drawn by the square root of the area, a café of 12 m came to 0.25 m.
pub(crate) fn room_size(mesh: &Mesh, bvh: &Bvh, diagonal: f32) -> f32 {
    let flights = flights(mesh, bvh, RAYS, 0.75);
    let enough = RAYS / 64;
    if flights.len() < enough {
        return diagonal; // an open scene: hardly anything sees anything else
    }
    let outside = flights.iter().filter(|f| f.is_outside(mesh));
    let mut distances: Vec<f32> = outside.map(|f| f.hit.t).collect();
    if distances.len() < enough {
        distances = flights.iter().map(|f| f.hit.t).collect(); // walls that show their backs
    }
    let middle = distances.len() / 2;
    let median = *distances.select_nth_unstable_by(middle, f32::total_cmp).1;
    (5.0 * median).min(diagonal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    /// A room of 4 m with `things` of 10 cm in it, each of 12 `fine`² triangles; `outward`: the room's faces look out.
    fn room(things: usize, fine: usize, outward: bool) -> Mesh {
        let mut mesh = Mesh::default();
        let mut cube = |corner: Vec3, size: f32, fine: usize, inward: bool| {
            for axis in 0..3 {
                for end in [0.0, 1.0] {
                    let at = |i: usize, j: usize| {
                        let mut p = [end; 3];
                        (p[(axis + 1) % 3], p[(axis + 2) % 3]) =
                            (i as f32 / fine as f32, j as f32 / fine as f32);
                        corner + Vec3::from(p) * size
                    };
                    for (i, j) in (0..fine).flat_map(|i| (0..fine).map(move |j| (i, j))) {
                        let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                        let first = mesh.positions.len() as u32;
                        mesh.positions.extend(quad);
                        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                            let turned = (end == 0.0) != inward;
                            let corners = if turned { [a, c, b] } else { [a, b, c] };
                            mesh.triangles.push(corners.map(|k| first + k));
                        }
                    }
                }
            }
        };
        cube(Vec3::ZERO, 4.0, 1, !outward);
        for k in 0..things {
            let corner = Vec3::new(0.3 + 0.35 * (k % 10) as f32, 0.2, 0.3 + 0.35 * (k / 10) as f32);
            cube(corner, 0.1, fine, false);
        }
        mesh
    }

    #[test]
    fn a_room_full_of_fine_things_is_as_large_as_it_is() {
        for outward in [false, true] {
            let size = |things| {
                let mesh = room(things, 20, outward);
                room_size(&mesh, &Bvh::build(&mesh), 7.0)
            };
            // The diagonal of the room; half of its edge at least.
            assert_eq!(size(0), 7.0);
            assert!(size(60) > 2.0, "{}", size(60));
        }
    }
}
