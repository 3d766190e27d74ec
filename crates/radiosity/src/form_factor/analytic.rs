//! Closed form: flat polygons that see each other whole.
//!
//! From a point the form factor is Lambert's sum, [`geometry::polygon::polygon_irradiance`]. Between two polygons Stokes'
//! theorem, used twice, makes one integral along both outlines of the four over both areas:
//!
//! ```text
//! A₁ F₁₂ = 1/(2π) ∮ ∮ ln r dx₁·dx₂
//! ```
//!
//! (Sparrow, "A New and Simpler Formulation for Radiative Angle Factors", J. Heat Transfer 85, 1963; brought to
//! radiosity by Goral et al., SIGGRAPH 1984.) Schröder and Hanrahan (SIGGRAPH 1993) solved both in closed form, by
//! dilogarithms; here the inner one is in closed form and the outer one adaptive quadrature, which is as exact as f64
//! allows also where edges are shared, and needs no cases.

use geometry::Vec3;
use glam::DVec3;
use std::f64::consts::TAU;

/// Absolute error that the outer integral of one pair of edges is allowed, as a share of the smaller polygon's area.
const TOLERANCE: f64 = 1e-10;
/// An edge is halved so often at most: an end that touches the other edge is approached to 2⁻⁴⁰ of it.
const DEEPEST: u32 = 40;

/// Form factor from one flat polygon to another with nothing between them.
///
/// - `from`, `to`: corners of plane polygons, counter-clockwise seen from the side that is meant; metres. What lies
///   behind the other's plane is cut off first.
///
/// Returns F₁₂ in [0, 1], the share of what leaves `from` evenly that arrives at `to`; `A₁ F₁₂ = A₂ F₂₁`. Exact to
/// about 1e-9, whether the polygons touch or not.
pub fn polygon_to_polygon(from: &[DVec3], to: &[DVec3]) -> f64 {
    let whole = area_vector(from).length();
    if whole <= 0.0 {
        return 0.0;
    }
    let (a, b) = (above(from, to), above(to, from));
    let size = area_vector(&a).length().min(area_vector(&b).length());
    if a.len() < 3 || b.len() < 3 || size <= 0.0 {
        return 0.0;
    }
    // A closed outline does not feel a factor on r, since ∮ dx = 0; with one that brings r near 1, far polygons do not
    // cancel from large numbers.
    let unit = (centre(&a) - centre(&b)).length().max(size.sqrt());
    let sum: f64 =
        edges(&a).map(|e| edges(&b).map(|f| along(e, f, unit, TOLERANCE * size)).sum::<f64>()).sum();
    // Both run counter-clockwise seen from their fronts, which face each other: against each other, and the sum is positive.
    (sum / (TAU * whole)).clamp(0.0, 1.0)
}

/// The corners as this module takes them.
pub fn corners<const N: usize>(corners: [Vec3; N]) -> [DVec3; N] {
    corners.map(|c| c.as_dvec3())
}

/// Area times unit normal.
fn area_vector(polygon: &[DVec3]) -> DVec3 {
    let Some(&o) = polygon.first() else { return DVec3::ZERO };
    edges(polygon).map(|[p, q]| (p - o).cross(q - o)).sum::<DVec3>() * 0.5
}

fn centre(polygon: &[DVec3]) -> DVec3 {
    polygon.iter().sum::<DVec3>() / polygon.len() as f64
}

fn edges(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 2]> + '_ {
    (0..polygon.len()).map(move |i| [polygon[i], polygon[(i + 1) % polygon.len()]])
}

/// The part of `polygon` in front of the plane of `other` (Sutherland and Hodgman, 1974).
fn above(polygon: &[DVec3], other: &[DVec3]) -> Vec<DVec3> {
    let (n, o) = (area_vector(other).normalize_or_zero(), other[0]);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for [p, q] in edges(polygon) {
        let (hp, hq) = ((p - o).dot(n), (q - o).dot(n));
        if hp >= 0.0 {
            kept.push(p);
        }
        if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
            kept.push(p + (q - p) * (hp / (hp - hq)));
        }
    }
    kept
}

/// ∫∫ ln(r/unit) dx₁·dx₂ along two edges, the first by Gauss and Kronrod, halved where they disagree.
fn along(e: [DVec3; 2], f: [DVec3; 2], unit: f64, tolerance: f64) -> f64 {
    let (way, other) = (e[1] - e[0], f[1] - f[0]);
    let length = other.length();
    if length <= 0.0 || way.length_squared() <= 0.0 {
        return 0.0;
    }
    let d = other / length;
    let cos = way.dot(d);
    if cos.abs() <= 1e-15 * way.length() {
        return 0.0;
    }
    let inner = |t: f64| ln_along(f[0] - (e[0] + way * t), d, length, unit);
    cos * adaptive(&inner, 0.0, 1.0, tolerance / cos.abs(), DEEPEST)
}

/// ∫₀ᴸ ln(|q + s d| / unit) ds for a unit vector d: with s₀ = q·d and h the distance of the line,
/// `[½ s ln(s² + h²) − s + h atan(s/h)]` from s₀ to s₀ + L.
fn ln_along(q: DVec3, d: DVec3, length: f64, unit: f64) -> f64 {
    let s0 = q.dot(d);
    let h = (q - d * s0).length();
    let primitive = |s: f64| {
        let r2 = (s * s + h * h) / (unit * unit);
        let log = if r2 > 0.0 { 0.5 * s * r2.ln() } else { 0.0 };
        log - s + if h > 0.0 { h * (s / h).atan() } else { 0.0 }
    };
    primitive(s0 + length) - primitive(s0)
}

/// ∫ f over [a, b] to about `tolerance`.
fn adaptive(f: &impl Fn(f64) -> f64, a: f64, b: f64, tolerance: f64, depth: u32) -> f64 {
    let (fine, coarse) = gauss_kronrod(f, a, b);
    // The difference is the error of the coarser rule; the finer one's is far below it.
    if depth == 0 || (fine - coarse).abs() <= tolerance.max(1e-15 * fine.abs()) {
        return fine;
    }
    let m = 0.5 * (a + b);
    adaptive(f, a, m, 0.5 * tolerance, depth - 1) + adaptive(f, m, b, 0.5 * tolerance, depth - 1)
}

/// The rules of 15 (Kronrod, 1965) and 7 points (Gauss) on one interval.
fn gauss_kronrod(f: &impl Fn(f64) -> f64, a: f64, b: f64) -> (f64, f64) {
    const NODES: [f64; 8] = [
        0.991_455_371_120_812_6,
        0.949_107_912_342_758_5,
        0.864_864_423_359_769_1,
        0.741_531_185_599_394_4,
        0.586_087_235_467_691_1,
        0.405_845_151_377_397_2,
        0.207_784_955_007_898_5,
        0.0,
    ];
    const KRONROD: [f64; 8] = [
        0.022_935_322_010_529_2,
        0.063_092_092_629_978_6,
        0.104_790_010_322_250_2,
        0.140_653_259_715_525_9,
        0.169_004_726_639_267_9,
        0.190_350_578_064_785_4,
        0.204_432_940_075_298_9,
        0.209_482_141_084_727_8,
    ];
    const GAUSS: [f64; 4] =
        [0.129_484_966_168_869_7, 0.279_705_391_489_276_7, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let (mut fine, mut coarse) = (0.0, 0.0);
    for (i, (&x, &w)) in NODES.iter().zip(&KRONROD).enumerate() {
        let value = if x == 0.0 { f(middle) } else { f(middle - half * x) + f(middle + half * x) };
        fine += w * value;
        if i % 2 == 1 {
            coarse += GAUSS[i / 2] * value;
        }
    }
    (fine * half, coarse * half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::polygon::polygon_irradiance;

    /// The rectangle [x0, x1] × [y0, y1] at height z, its front upward or downward.
    fn level(x0: f64, x1: f64, y0: f64, y1: f64, z: f64, up: bool) -> Vec<DVec3> {
        let mut c: Vec<DVec3> =
            [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| DVec3::new(x, y, z)).into();
        if !up {
            c.reverse();
        }
        c
    }

    /// Howell's catalogue, C-11: equal rectangles a × b, one above the other at distance c.
    fn c_11(a: f64, b: f64, c: f64) -> f64 {
        let (x, y) = (a / c, b / c);
        let (sx, sy) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        let log = (sx * sx * sy * sy / (1.0 + x * x + y * y)).sqrt().ln();
        (log + x * sy * (x / sy).atan() + y * sx * (y / sx).atan() - x * x.atan() - y * y.atan()) * 4.0
            / (TAU * x * y)
    }

    /// C-14: from a rectangle w × l to one of h × l at right angles along the edge l.
    fn c_14(h: f64, w: f64, l: f64) -> f64 {
        let (h, w) = (h / l, w / l);
        let (h2, w2) = (h * h, w * w);
        let root = (h2 + w2).sqrt();
        let log = ((1.0 + w2) * (1.0 + h2) / (1.0 + w2 + h2)
            * (w2 * (1.0 + w2 + h2) / ((1.0 + w2) * (w2 + h2))).powf(w2)
            * (h2 * (1.0 + h2 + w2) / ((1.0 + h2) * (h2 + w2))).powf(h2))
        .ln();
        (w * (1.0 / w).atan() + h * (1.0 / h).atan() - root * (1.0 / root).atan() + 0.25 * log) * 2.0
            / (TAU * w)
    }

    /// Both squares of the same corner: a × b on the floor and h × b on the wall along their edge of length b.
    fn corner(w: f64, h: f64, l: f64) -> (Vec<DVec3>, Vec<DVec3>) {
        let wall = [[0., 0., 0.], [0., l, 0.], [0., l, h], [0., 0., h]].map(DVec3::from);
        (level(0.0, w, 0.0, l, 0.0, true), wall.into())
    }

    #[test]
    fn parallel_rectangles_are_c_11() {
        assert!((c_11(1.0, 1.0, 1.0) - 0.199_824_895_7).abs() < 1e-10);
        for (a, b, c) in [
            (1., 1., 1.),
            (1., 2., 1.),
            (1., 1.5, 0.5),
            (10., 10., 1.),
            (1., 1., 10.),
            (1., 1., 0.1),
            (1., 1., 1e3),
        ] {
            let f = polygon_to_polygon(&level(0.0, a, 0.0, b, 0.0, true), &level(0.0, a, 0.0, b, c, false));
            assert!((f - c_11(a, b, c)).abs() < 1e-9, "{a} {b} {c}: {f} {}", c_11(a, b, c));
        }
    }

    #[test]
    fn rectangles_that_share_an_edge_are_c_14() {
        assert!((c_14(1.0, 1.0, 1.0) - 0.200_043_776_1).abs() < 1e-10);
        for (h, w, l) in [
            (1., 1., 1.),
            (1., 2., 1.),
            (2., 1., 1.),
            (0.5, 1., 2.),
            (0.1, 0.1, 1.),
            (10., 10., 1.),
            (1e-3, 1e-3, 1.),
        ] {
            let (floor, wall) = corner(w, h, l);
            let f = polygon_to_polygon(&floor, &wall);
            assert!((f - c_14(h, w, l)).abs() < 1e-9, "{h} {w} {l}: {f} {}", c_14(h, w, l));
            // Reciprocity comes with the formula.
            let back = polygon_to_polygon(&wall, &floor);
            assert!((w * f - h * back).abs() < 1e-9 * w.min(h), "{h} {w} {l}");
        }
    }

    /// C-41: discs, as polygons of 32, 64 and 128 corners; their error goes as 1/n², which Richardson's rule removes.
    #[test]
    fn polygons_of_many_corners_become_c_41() {
        let disc = |r: f64, z: f64, n: usize, up: bool| -> Vec<DVec3> {
            let turn = |i: usize| TAU * i as f64 / n as f64 * if up { 1.0 } else { -1.0 };
            (0..n).map(|i| DVec3::new(r * turn(i).cos(), r * turn(i).sin(), z)).collect()
        };
        for (r1, r2, a) in [(1.0, 1.0, 1.0), (0.1, 0.2, 0.5), (0.5, 1.0, 1.0), (1.0, 0.01, 1.0f64)] {
            let (p, q) = (r1 / a, r2 / a);
            let x = 1.0 + (1.0 + q * q) / (p * p);
            let exact = 0.5 * (x - (x * x - 4.0 * (q / p).powi(2)).sqrt());
            let [f1, f2, f3] =
                [32, 64, 128].map(|n| polygon_to_polygon(&disc(r1, 0.0, n, true), &disc(r2, a, n, false)));
            let (g1, g2) = ((4.0 * f2 - f1) / 3.0, (4.0 * f3 - f2) / 3.0);
            let f = (16.0 * g2 - g1) / 15.0;
            assert!((f - exact).abs() < 1e-6, "{r1} {r2} {a}: {f} {exact}");
        }
    }

    /// One and four make 1: the sides of a box as one of them sees them, and nothing of what lies behind it.
    #[test]
    fn a_box_is_closed() {
        let floor = level(0.0, 2.0, 0.0, 1.0, 0.0, true);
        let side = |p: [f64; 3], u: [f64; 3], v: [f64; 3]| {
            let [p, u, v] = [p, u, v].map(DVec3::from);
            [p, p + u, p + u + v, p + v]
        };
        let sides = [
            side([0., 0., 0.], [0., 1., 0.], [0., 0., 3.]),
            side([2., 0., 0.], [0., 0., 3.], [0., 1., 0.]),
            side([0., 0., 0.], [0., 0., 3.], [2., 0., 0.]),
            side([0., 1., 0.], [2., 0., 0.], [0., 0., 3.]),
            side([0., 0., 3.], [0., 1., 0.], [2., 0., 0.]),
        ];
        let sum: f64 = sides.iter().map(|s| polygon_to_polygon(&floor, s)).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        assert_eq!(polygon_to_polygon(&floor, &level(0.0, 1.0, 0.0, 1.0, -1.0, true)), 0.0);
        assert_eq!(polygon_to_polygon(&floor, &level(0.0, 1.0, 0.0, 1.0, 1.0, true)), 0.0, "its back");
        // A wall that reaches below the floor counts with its upper half only.
        let deep = side([0., 0., -3.], [0., 1., 0.], [0., 0., 6.]);
        assert!((polygon_to_polygon(&floor, &deep) - polygon_to_polygon(&floor, &sides[0])).abs() < 1e-9);
    }

    /// A polygon shrunk to a point is the point of Lambert's formula.
    #[test]
    fn a_small_polygon_is_a_point() {
        let lamp = level(-0.5, 1.0, -0.25, 0.75, 1.0, false);
        let small = level(-5e-4, 5e-4, -5e-4, 5e-4, 0.0, true);
        let lamp_f32: Vec<Vec3> = lamp.iter().map(|c| c.as_vec3()).collect();
        let point = f64::from(polygon_irradiance(Vec3::ZERO, Vec3::Z, &lamp_f32));
        let f = polygon_to_polygon(&small, &lamp);
        assert!((f / point - 1.0).abs() < 1e-6, "{f} {point}");
    }
}
