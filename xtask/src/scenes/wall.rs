//! Walls with a window or a door in them.

use super::shapes::Shape;
use glam::DVec3;

/// A closed wall from `lo` to `hi`, pierced through its thinner horizontal axis.
///
/// The hole is a rectangle: [lowest, highest] along the other horizontal axis, and in y. It may reach down to the
/// wall's foot, not to its other edges. The corners of all faces meet, without T-junctions.
pub fn pierced(lo: DVec3, hi: DVec3, hole: [[f64; 2]; 2]) -> Shape {
    let along_x = hi.x - lo.x > hi.z - lo.z;
    // u along the wall, y upward, w through it. Exchanging x and z is a reflection, hence the flip at the end.
    let swap = |p: DVec3| if along_x { p } else { DVec3::new(p.z, p.y, p.x) };
    let (lo, hi) = (swap(lo), swap(hi));
    let us = [lo.x, hole[0][0], hole[0][1], hi.x];
    let mut ys = vec![lo.y, hole[1][0], hole[1][1], hi.y];
    ys.dedup();
    let top = ys.len() - 2; // the row of cells that ends at the wall's top
    let open = |i: usize, j: usize| i == 1 && j + 1 == top;
    let solid = |i: isize, j: isize| {
        (0..3).contains(&i) && (0..=top as isize).contains(&j) && !open(i as usize, j as usize)
    };

    let mut shape = Shape::default();
    for w in [lo.z, hi.z] {
        shape = shape.with(&plate(&us, &ys, w, w == hi.z, open));
    }
    // Where a cell's neighbour is missing, the wall ends: outside, or at the hole.
    for i in 0..3usize {
        for j in (0..=top).filter(|&j| !open(i, j)) {
            let (a, b) = (DVec3::new(us[i], ys[j], lo.z), DVec3::new(us[i + 1], ys[j + 1], hi.z));
            let around = [(-1, 0), (1, 0), (0, -1), (0, 1)];
            for (face, (di, dj)) in Shape::faces(a, b).iter().zip(around) {
                if !solid(i as isize + di, j as isize + dj) {
                    shape = shape.with(face);
                }
            }
        }
    }
    if along_x {
        return shape;
    }
    shape.positions.iter_mut().chain(&mut shape.normals).for_each(|v| *v = swap(*v));
    shape.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    shape
}

/// One face of a pierced wall: cells of the grid `us` × `ys` at `w`, except the open ones, corners shared.
fn plate(us: &[f64], ys: &[f64], w: f64, toward_z: bool, open: impl Fn(usize, usize) -> bool) -> Shape {
    let columns = us.len();
    let mut triangles = Vec::new();
    for j in 0..ys.len() - 1 {
        for i in (0..columns - 1).filter(|&i| !open(i, j)) {
            let a = (j * columns + i) as u32;
            let (b, d) = (a + 1, a + columns as u32);
            triangles.extend([[a, b, d + 1], [a, d + 1, d]]);
        }
    }
    let positions: Vec<DVec3> =
        ys.iter().flat_map(|&y| us.iter().map(move |&u| DVec3::new(u, y, w))).collect();
    let normals = vec![DVec3::Z; positions.len()];
    let plate = Shape { positions, normals, triangles, ..Shape::default() };
    if toward_z { plate } else { plate.flipped() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pierced_wall_encloses_what_the_hole_leaves() {
        let hi = DVec3::new(4.0, 3.0, 0.2);
        let window = pierced(DVec3::ZERO, hi, [[1.0, 2.0], [1.0, 2.0]]);
        assert!((window.volume() - 0.2 * (12.0 - 1.0)).abs() < 1e-12);
        let door = pierced(DVec3::ZERO, DVec3::new(0.2, 3.0, 4.0), [[1.0, 2.0], [0.0, 2.0]]);
        assert!((door.volume() - 0.2 * (12.0 - 2.0)).abs() < 1e-12);
    }
}
