//! Shapes without corners: what turns about an axis, what winds along a curve, boxes with soft edges.

use super::shapes::Shape;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, TAU};

/// The surface that a profile sweeps about the y axis. The profile is given in pieces, each a chain of
/// (distance from the axis, height) in metres; normals are smooth within a piece, creased between pieces.
/// Going along the profile the outside lies to the right: from the foot outward, up, and back in.
pub fn lathe(pieces: &[Vec<DVec2>], segments: u32) -> Shape {
    pieces.iter().fold(Shape::default(), |all, piece| all.with(&sweep(piece, segments)))
}

/// One smooth piece of a [`lathe`].
fn sweep(profile: &[DVec2], segments: u32) -> Shape {
    let mut shape = Shape::default();
    let last = profile.len() - 1;
    // A row is one corner on the axis or a ring of them.
    let mut rows: Vec<(u32, u32)> = Vec::new();
    for (i, p) in profile.iter().enumerate() {
        let along = (profile[(i + 1).min(last)] - profile[i.saturating_sub(1)]).normalize();
        let outward = DVec2::new(along.y, -along.x);
        let count = if p.x == 0.0 { 1 } else { segments };
        rows.push((shape.positions.len() as u32, count));
        for j in 0..count {
            let (sin, cos) = (TAU * f64::from(j) / f64::from(segments)).sin_cos();
            shape.positions.push(DVec3::new(p.x * cos, p.y, -p.x * sin));
            // On the axis the sides cancel out and only the height is left.
            let n = if count == 1 { DVec2::new(0.0, outward.y.signum()) } else { outward };
            shape.normals.push(DVec3::new(n.x * cos, n.y, -n.x * sin));
        }
    }
    for pair in rows.windows(2) {
        let corner = |(first, count): (u32, u32), j: u32| first + j % count;
        for j in 0..segments {
            let (a, b) = (corner(pair[0], j), corner(pair[0], j + 1));
            let (d, c) = (corner(pair[1], j), corner(pair[1], j + 1));
            shape.triangles.extend([[a, b, c], [a, c, d]].iter().filter(|t| t[0] != t[1] && t[1] != t[2]));
        }
    }
    shape
}

/// A closed upright cylinder about the point (x, z) = `axis`, from height `y0` to `y1`.
pub fn cylinder(axis: DVec2, radius: f64, y0: f64, y1: f64, segments: u32) -> Shape {
    let [a, b, c, d] = [(0.0, y0), (radius, y0), (radius, y1), (0.0, y1)].map(DVec2::from);
    lathe(&[vec![a, b], vec![b, c], vec![c, d]], segments).moved(DVec3::new(axis.x, 0.0, axis.y))
}

/// A smooth curve through `points` (Catmull and Rom, 1974), `steps` pieces between any two.
pub fn curve(points: &[(f64, f64)], steps: u32) -> Vec<DVec2> {
    let p = |i: isize| DVec2::from(points[i.clamp(0, points.len() as isize - 1) as usize]);
    let mut chain = vec![p(0)];
    for i in 0..points.len() as isize - 1 {
        let [p0, p1, p2, p3] = [i - 1, i, i + 1, i + 2].map(p);
        for k in 1..=steps {
            let t = f64::from(k) / f64::from(steps);
            let cubic = (3.0 * (p1 - p2) + p3 - p0) * t + 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3;
            let q = p1 + 0.5 * t * (p2 - p0 + t * cubic);
            chain.push(if k == steps { p2 } else { q.max(DVec2::new(0.0, q.y)) });
        }
    }
    chain
}

/// A tube of radius `tube` along the torus knot that winds `p` times about the y axis at distance `major` and `q`
/// times about that circle at distance `minor`; `along` × `around` quadrilaterals.
pub fn torus_knot([p, q]: [f64; 2], [major, minor, tube]: [f64; 3], along: u32, around: u32) -> Shape {
    let centre = |t: f64| {
        let r = major + minor * (q * t).cos();
        DVec3::new(r * (p * t).cos(), minor * (q * t).sin(), -r * (p * t).sin())
    };
    let mut shape = Shape::default();
    for i in 0..along {
        let t = TAU * f64::from(i) / f64::from(along);
        let c = centre(t);
        let tangent = (centre(t + 1e-4) - centre(t - 1e-4)).normalize();
        // Any vector that varies smoothly and is nowhere parallel to the tangent spans the cross-section.
        let binormal = tangent.cross(c).normalize();
        let normal = binormal.cross(tangent);
        for j in 0..around {
            let (sin, cos) = (TAU * f64::from(j) / f64::from(around)).sin_cos();
            let n = normal * cos + binormal * sin;
            shape.positions.push(c + tube * n);
            shape.normals.push(n);
            let at = |i: u32, j: u32| i % along * around + j % around;
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            shape.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    shape
}

/// A box from `lo` to `hi` whose edges are rounded with `radius`; each edge is cut `2 · steps` times.
pub fn rounded_box(lo: DVec3, hi: DVec3, radius: f64, steps: u32) -> Shape {
    let (centre, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
    let inner = half - radius;
    debug_assert!(inner.min_element() > 0.0, "the radius leaves some of each side flat");
    let n = 2 * steps + 2;
    // Across a face: an eighth of a turn up to the flat middle, the middle, an eighth of a turn down.
    let slope = |i: u32| {
        if i <= steps {
            (-1.0, -(FRAC_PI_4 * f64::from(steps - i) / f64::from(steps)).tan())
        } else {
            (1.0, (FRAC_PI_4 * f64::from(i - steps - 1) / f64::from(steps)).tan())
        }
    };
    let mut shape = Shape::default();
    for (axis, u, v) in
        [(DVec3::X, DVec3::Y, DVec3::Z), (DVec3::Y, DVec3::Z, DVec3::X), (DVec3::Z, DVec3::X, DVec3::Y)]
    {
        for side in [-1.0, 1.0] {
            // Exchanging the sides of u keeps the frame right-handed.
            let (w, u) = (side * axis, side * u);
            let first = shape.positions.len() as u32;
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let ((su, tu), (sv, tv)) = (slope(i), slope(j));
                let normal = (w + tu * u + tv * v).normalize();
                shape.positions.push(centre + inner * (w + su * u + sv * v) + radius * normal);
                shape.normals.push(normal);
                if i + 1 < n && j + 1 < n {
                    let a = first + i * n + j;
                    shape.triangles.extend([[a, a + n, a + n + 1], [a, a + n + 1, a + 1]]);
                }
            }
        }
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Every corner's normal lies on the front of the triangles around it.
    fn fronts_agree(shape: &Shape) -> bool {
        shape.triangles.iter().all(|t| {
            let [p, q, r] = t.map(|i| shape.positions[i as usize]);
            t.iter().all(|&i| (q - p).cross(r - p).dot(shape.normals[i as usize]) > 0.0)
        })
    }

    #[test]
    fn a_cylinder_holds_what_its_polygon_holds() {
        let shape = cylinder(DVec2::new(0.3, -0.2), 0.5, 1.0, 3.0, 24);
        let polygon = 0.5 * 24.0 * 0.25 * (TAU / 24.0).sin();
        assert!((shape.volume() - 2.0 * polygon).abs() < 1e-12);
        assert!(fronts_agree(&shape));
    }

    #[test]
    fn a_rounded_box_loses_its_edges_only() {
        let shape = rounded_box(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), 0.1, 8);
        // Steiner's formula: inner box, slabs over its faces, quarter cylinders along its edges, a ball.
        let (a, b, c, r) = (0.8, 1.8, 2.8, 0.1);
        let edges = PI * r * r * (a + b + c);
        let exact = a * b * c + 2.0 * r * (a * b + b * c + c * a) + edges + 4.0 / 3.0 * PI * r * r * r;
        // The chords of sixteen pieces a quarter turn miss 0.2 % of what is round.
        assert!((shape.volume() - exact).abs() < 0.002 * edges, "{} {exact}", shape.volume());
        assert!(fronts_agree(&shape));
    }

    #[test]
    fn a_knot_and_a_vase_face_outward() {
        let knot = torus_knot([2.0, 3.0], [0.19, 0.075, 0.05], 200, 20);
        assert!(fronts_agree(&knot) && knot.volume() > 0.0);
        let vase = lathe(&[curve(&[(0.0, 0.0), (0.1, 0.0), (0.15, 0.2), (0.05, 0.4), (0.0, 0.4)], 8)], 32);
        assert!(vase.volume() > 0.0);
    }
}
