//! Closed form: the light that a polygon of even radiance throws on a point.

use crate::math::Vec3;
use glam::DVec3;
use std::f64::consts::TAU;

/// Form factor from a patch of vanishing area at `p` to a flat polygon, by Lambert's contour integral:
///
/// ```text
/// F = 1/(2π) Σ_i θ_i · n · (r_i × r_{i+1}) / |r_i × r_{i+1}|
/// ```
///
/// after Lambert, *Photometria* (1760), in the vector form of Baum, Rushmeier and Winget (SIGGRAPH 1989, eq. 9);
/// `r_i` is the way from `p` to corner i and `θ_i` the angle between two of them. What lies below the horizon of
/// `n` is cut off first.
///
/// - `n`: unit normal at `p`.
/// - `vertices`: corners of a plane polygon in order, either way round; metres.
///
/// Returns F in [0, 1]: a polygon of radiance L (cd/m²) that is wholly visible throws E = π L F (lx).
/// Which side of the polygon shines is the caller's concern. f64 inside: exact to about 1e-7 in f32.
pub fn polygon_irradiance(p: Vec3, n: Vec3, vertices: &[Vec3]) -> f32 {
    let (p, n) = (p.as_dvec3(), n.as_dvec3());
    let Some(&last) = vertices.last() else { return 0.0 };
    let mut contour = Contour::default();
    let mut from = last.as_dvec3() - p;
    let mut from_height = from.dot(n);
    for v in vertices {
        let to = v.as_dvec3() - p;
        let to_height = to.dot(n);
        // Sutherland and Hodgman (1974) against the one plane, corner by corner, so nothing needs to be stored.
        if (from_height > 0.0) != (to_height > 0.0) {
            contour.corner(from + (to - from) * (from_height / (from_height - to_height)));
        }
        if to_height > 0.0 {
            contour.corner(to);
        }
        (from, from_height) = (to, to_height);
    }
    (contour.close().dot(n).abs() / TAU).min(1.0) as f32
}

/// The running sum Σ θ_i (r_i × r_{i+1}) / |…| of a polygon whose corners come one at a time.
#[derive(Default)]
struct Contour {
    sum: DVec3,
    first: Option<DVec3>,
    last: DVec3,
}

impl Contour {
    fn corner(&mut self, r: DVec3) {
        match self.first {
            None => self.first = Some(r),
            Some(_) => self.edge(r),
        }
        self.last = r;
    }

    fn edge(&mut self, to: DVec3) {
        let cross = self.last.cross(to);
        let length = cross.length();
        // An edge in line with the point subtends no angle.
        if length > 0.0 {
            self.sum += cross * (length.atan2(self.last.dot(to)) / length);
        }
    }

    fn close(mut self) -> DVec3 {
        if let Some(first) = self.first {
            self.edge(first);
        }
        self.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    fn rectangle(x0: f32, x1: f32, y0: f32, y1: f32, z: f32) -> [Vec3; 4] {
        [Vec3::new(x0, y0, z), Vec3::new(x1, y0, z), Vec3::new(x1, y1, z), Vec3::new(x0, y1, z)]
    }

    /// Howell's catalogue, B-4: a rectangle a × b, the normal through one corner, at distance c.
    #[test]
    fn a_corner_rectangle_is_b_4() {
        let b4 = |a: f64, b: f64, c: f64| {
            let (x, y) = (a / c, b / c);
            let (sx, sy) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
            (x / sx * (y / sx).atan() + y / sy * (x / sy).atan()) / TAU
        };
        assert!((b4(1.0, 1.0, 1.0) - 0.138_531_606_0).abs() < 1e-9);
        for (a, b, c) in [(1.0, 1.0, 1.0), (1.0, 2.0, 0.5), (0.01, 0.02, 3.0), (50.0, 80.0, 0.1)] {
            let f = polygon_irradiance(Vec3::ZERO, Vec3::Z, &rectangle(0.0, a, 0.0, b, c));
            let exact = b4(a as f64, b as f64, c as f64) as f32;
            assert!((f - exact).abs() < 1e-6 * exact.max(0.1), "{a} {b} {c}: {f} {exact}");
        }
    }

    /// A lamp of 2 m × 1 m and 1000 cd/m², 3 m above the floor: values of the kind of CIE 171:2006, case 5.3.
    #[test]
    fn a_lamp_of_two_by_one_metres() {
        let lamp = rectangle(-1.0, 1.0, -0.5, 0.5, 3.0);
        for (x, y, e) in [
            (0.0, 0.0, 203.625_962),
            (1.0, 0.0, 172.065_918),
            (2.0, 0.0, 109.130_340),
            (0.0, 1.5, 134.701_512),
            (2.0, 2.0, 63.423_532),
            (4.0, 4.0, 11.002_399f32),
        ] {
            let got = 1000.0 * PI * polygon_irradiance(Vec3::new(x, y, 0.0), Vec3::Z, &lamp);
            assert!((got / e - 1.0).abs() < 1e-6, "({x}, {y}): {got} for {e}");
        }
    }

    #[test]
    fn what_lies_below_the_horizon_is_cut_off() {
        // A wall from −5 to 5 beside a floor patch gives what its upper half gives.
        let wall = |z0, z1| {
            [
                Vec3::new(1.0, -1.0, z0),
                Vec3::new(1.0, 1.0, z0),
                Vec3::new(1.0, 1.0, z1),
                Vec3::new(1.0, -1.0, z1),
            ]
        };
        let whole = polygon_irradiance(Vec3::ZERO, Vec3::Z, &wall(-5.0, 5.0));
        let upper = polygon_irradiance(Vec3::ZERO, Vec3::Z, &wall(0.0, 5.0));
        assert!((whole - upper).abs() < 1e-6 && upper > 0.1);
        assert_eq!(polygon_irradiance(Vec3::ZERO, Vec3::NEG_Z, &rectangle(-1.0, 1.0, -1.0, 1.0, 1.0)), 0.0);
    }

    #[test]
    fn either_way_round_and_without_corners() {
        let mut lamp = rectangle(-1.0, 1.0, -0.5, 0.5, 3.0);
        let one = polygon_irradiance(Vec3::ZERO, Vec3::Z, &lamp);
        lamp.reverse();
        assert!((one - polygon_irradiance(Vec3::ZERO, Vec3::Z, &lamp)).abs() < 1e-7);
        assert_eq!(polygon_irradiance(Vec3::ZERO, Vec3::Z, &[]), 0.0);
    }
}
