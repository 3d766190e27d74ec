//! Even sampling of the solid angle that a triangle fills.

use glam::DVec3;

/// A triangle projected on the unit sphere about a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphericalTriangle {
    a: DVec3,
    b: DVec3,
    c: DVec3,
    /// What it fills, sr, in [0, 2π).
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// From the ways to the three corners, of any length.
    pub fn new(a: DVec3, b: DVec3, c: DVec3) -> SphericalTriangle {
        let (a, b, c) = (a.normalize_or_zero(), b.normalize_or_zero(), c.normalize_or_zero());
        // Van Oosterom and Strackee (1983), eq. 8, for unit vectors.
        let solid_angle = 2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        SphericalTriangle { a, b, c, solid_angle }
    }

    /// A unit direction in the triangle, even in solid angle, so of density 1 / `solid_angle`; `u` in [0, 1)².
    ///
    /// Arvo, "Stratified Sampling of Spherical Triangles", SIGGRAPH 1995.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        let SphericalTriangle { a, b, c, solid_angle } = *self;
        // (A × B) × (A × C) = A (A · (B × C)): tangent of the angle at A without normalising the two planes.
        let alpha = a.dot(b.cross(c)).abs().atan2(a.cross(b).dot(a.cross(c)));
        let (sin_alpha, cos_alpha) = alpha.sin_cos();
        let (s, t) = (u[0] * solid_angle - alpha).sin_cos();
        let x = t - cos_alpha;
        let y = s + sin_alpha * a.dot(b);
        let below = (y * s + x * t) * sin_alpha;
        let q = if below == 0.0 { 1.0 } else { ((y * t - x * s) * cos_alpha - y) / below };
        let q = q.clamp(-1.0, 1.0);
        let c_hat = a * q + beside(c, a) * (1.0 - q * q).max(0.0).sqrt();
        let z = 1.0 - u[1] * (1.0 - c_hat.dot(b));
        (b * z + beside(c_hat, b) * (1.0 - z * z).max(0.0).sqrt()).normalize_or_zero()
    }
}

/// The unit part of `x` at right angles to the unit vector `y`.
fn beside(x: DVec3, y: DVec3) -> DVec3 {
    (x - y * x.dot(y)).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octant_is_half_pi_and_sampled_evenly() {
        let octant = SphericalTriangle::new(DVec3::X, DVec3::Y * 3.0, DVec3::Z);
        assert!((octant.solid_angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        // The mean direction of an octant is (½, ½, ½): ∫ x dω = π/4.
        let n = 200;
        let mut mean = DVec3::ZERO;
        for i in 0..n * n {
            let u = [(i % n) as f64 + 0.5, (i / n) as f64 + 0.5].map(|x| x / n as f64);
            let d = octant.sample(u);
            assert!((d.length() - 1.0).abs() < 1e-9 && d.min_element() > -1e-9);
            mean += d / (n * n) as f64;
        }
        assert!((mean - DVec3::splat(0.5)).abs().max_element() < 1e-4, "{mean}");
    }

    #[test]
    fn slivers_and_points_stay_finite() {
        let sliver =
            SphericalTriangle::new(DVec3::X, DVec3::new(1.0, 1e-9, 0.0), DVec3::new(1.0, 0.5, 1e-12));
        assert!(sliver.sample([0.3, 0.7]).is_finite());
        let point = SphericalTriangle::new(DVec3::X, DVec3::X, DVec3::X);
        assert!(point.sample([0.3, 0.7]).is_finite() && point.solid_angle == 0.0);
    }
}
