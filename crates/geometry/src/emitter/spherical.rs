//! Even sampling of the solid angle that a triangle fills.

use glam::DVec3;

/// A triangle projected on the unit sphere about a point, and what all samples of it share.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SphericalTriangle {
    a: DVec3,
    b: DVec3,
    /// Unit, at right angles to a, in the plane of a and c.
    beside_a: DVec3,
    cos_ab: f64,
    /// Of the angle at a.
    sin_alpha: f64,
    cos_alpha: f64,
    /// What it fills, sr, in [0, 2π).
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// From the unit ways to the three corners.
    pub fn new(a: DVec3, b: DVec3, c: DVec3) -> SphericalTriangle {
        let (ab, ac) = (a.cross(b), a.cross(c));
        let (cos_ab, cos_ac, volume) = (a.dot(b), a.dot(c), ab.dot(c).abs());
        // Van Oosterom and Strackee (1983), eq. 8, for unit vectors.
        let solid_angle = 2.0 * volume.atan2(1.0 + cos_ab + b.dot(c) + cos_ac);
        // (A × B) × (A × C) = A (A · (B × C)): tangent of the angle at A without normalising the two planes.
        let x = ab.dot(ac);
        let scale = (volume * volume + x * x).sqrt().recip();
        let beside_a = (c - a * cos_ac).normalize_or_zero();
        let usable = scale.is_finite();
        SphericalTriangle {
            a,
            b,
            beside_a,
            cos_ab,
            sin_alpha: if usable { volume * scale } else { 0.0 },
            cos_alpha: if usable { x * scale } else { 1.0 },
            solid_angle: if usable { solid_angle } else { 0.0 },
        }
    }

    /// A unit direction in the triangle, even in solid angle, so of density 1 / `solid_angle`; `u` in [0, 1)².
    ///
    /// Arvo, "Stratified Sampling of Spherical Triangles", SIGGRAPH 1995; the angle at A by its sine and cosine alone.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        let SphericalTriangle { a, b, beside_a, cos_ab, sin_alpha, cos_alpha, solid_angle } = *self;
        let (sin, cos) = (u[0] * solid_angle).sin_cos();
        // Sine and cosine of u₀ times the solid angle, less the angle at A.
        let s = sin * cos_alpha - cos * sin_alpha;
        let t = cos * cos_alpha + sin * sin_alpha;
        let x = t - cos_alpha;
        let y = s + sin_alpha * cos_ab;
        let below = (y * s + x * t) * sin_alpha;
        let q = if below == 0.0 { 1.0 } else { ((y * t - x * s) * cos_alpha - y) / below };
        let q = q.clamp(-1.0, 1.0);
        let c_hat = a * q + beside_a * (1.0 - q * q).max(0.0).sqrt();
        let cos_b = c_hat.dot(b);
        let z = 1.0 - u[1] * (1.0 - cos_b);
        b * z + (c_hat - b * cos_b).normalize_or_zero() * (1.0 - z * z).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octant_is_half_pi_and_sampled_evenly() {
        let octant = SphericalTriangle::new(DVec3::X, DVec3::Y, DVec3::Z);
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
        let [b, c] = [DVec3::new(1.0, 1e-9, 0.0), DVec3::new(1.0, 0.5, 1e-12)].map(DVec3::normalize);
        let sliver = SphericalTriangle::new(DVec3::X, b, c);
        assert!(sliver.sample([0.3, 0.7]).is_finite());
        let point = SphericalTriangle::new(DVec3::X, DVec3::X, DVec3::X);
        assert!(point.sample([0.3, 0.7]).is_finite() && point.solid_angle == 0.0);
    }
}
