//! Leaks: floors and ceilings that go on under a wall, so that one triangle lies in two rooms.

use super::{Finding, Severity, node_of};
use geometry::math::offset_origin;
use geometry::sampling::{Rng, triangle};
use geometry::{Ray, Vec3, World};
use std::collections::BTreeMap;

/// Triangles longer than this share of a room are looked at.
const LONG: f32 = 0.25;
/// Pairs of points on each.
const PAIRS: usize = 48;
/// Pairs that one wall must part.
const ENOUGH: usize = 3;
/// Heights over the triangle, as shares of the way to what lies opposite: what stands in the way at all of them is a
/// wall, not a cupboard.
const HEIGHTS: [f32; 5] = [0.01, 0.25, 0.5, 0.75, 0.97];
/// Rooms are at least so high, as a share of the size of rooms.
const HIGH: f32 = 0.2;
/// Triangles at most, the largest: in a terrain of millions there is no room.
const MOST: usize = 400;

/// Looks for walls that stand on the inside of a triangle.
pub fn examine(world: &World, found: &mut Vec<Finding>) {
    let mesh = &world.scene.mesh;
    let length = |t: u32| {
        let [a, b, c] = mesh.corners(t);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    };
    let mut large: Vec<u32> =
        (0..mesh.triangles.len() as u32).filter(|&t| length(t) > LONG * world.scale).collect();
    large.sort_by(|&a, &b| mesh.area(b).total_cmp(&mesh.area(a)));
    large.truncate(MOST);
    let mut walls: BTreeMap<(String, String), usize> = BTreeMap::new();
    for t in large {
        let mut rng = Rng::new(0x6c65_616b, u64::from(t));
        for side in [1.0, -1.0] {
            let n = mesh.geometric_normal(t) * side;
            let mut seen: BTreeMap<u32, usize> = BTreeMap::new();
            for _ in 0..PAIRS {
                let mut point = || {
                    let (u, v) = triangle(rng.vec2());
                    offset_origin(mesh.interpolate(t, u, v, &mesh.positions), n)
                };
                let (a, b) = (point(), point());
                if let Some(part) = parted(world, a, b, n) {
                    *seen.entry(part).or_default() += 1;
                }
            }
            for (part, _) in seen.into_iter().filter(|(_, n)| *n >= ENOUGH) {
                let wall = mesh.parts[part as usize].place();
                *walls.entry((node_of(mesh, t), wall)).or_default() += 1;
            }
        }
    }
    for ((floor, wall), count) in walls.into_iter().filter(|((a, b), _)| a != b) {
        found.push(Finding {
            severity: Severity::Doubtful,
            kind: "room",
            place: format!("{floor} and {wall}"),
            problem: format!("{count} large triangles of the one go on under the other: one face lies in two rooms"),
            remedy: "cut the face along the wall: light of one room can then not leak into the other, and fewer vertices do",
        });
    }
}

/// The part that stands between two points of a face from there to the opposite side, if one does.
fn parted(world: &World, a: Vec3, b: Vec3, n: Vec3) -> Option<u32> {
    // Where nothing lies opposite there is no room.
    let height = |p: Vec3| world.closest(&Ray::new(p, n)).map(|hit| hit.t);
    let height = height(a)?.min(height(b)?);
    if height < HIGH * world.scale {
        return None;
    }
    let way = b - a;
    let direction = way.try_normalize()?;
    let mut wall = None;
    for share in HEIGHTS {
        let ray = Ray { t_max: way.length(), ..Ray::new(a + n * (share * height), direction) };
        let part = part_of(world, world.closest(&ray)?.triangle)?;
        if *wall.get_or_insert(part) != part {
            return None;
        }
    }
    wall
}

fn part_of(world: &World, triangle: u32) -> Option<u32> {
    let after = world.scene.mesh.parts.partition_point(|p| p.first <= triangle);
    after.checked_sub(1).map(|i| i as u32)
}
