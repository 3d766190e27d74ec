//! Microfacets: the GGX distribution with Smith's shadowing, in local space, z along the shading normal.
//!
//! B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007;
//! E. Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 3(2), 2014.

use crate::math::{Vec2, Vec3};
use std::f32::consts::PI;

/// Perceptual roughness below which mirror and glass are perfect: α = 9·10⁻⁴, a blur of 0.05°.
pub const SMOOTH_ROUGHNESS: f32 = 0.03;

/// GGX of widths `x` and `y` in (0, 1] along the tangent and the bitangent.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    /// Along the tangent.
    pub x: f32,
    /// Along the bitangent.
    pub y: f32,
}

impl Ggx {
    /// The same width, roughness², all round.
    pub fn round(alpha: f32) -> Ggx {
        Ggx { x: alpha, y: alpha }
    }

    /// Density of microfacet normals D(h), 1/sr; ∫ D cos = 1. `h` above the horizon.
    pub fn d(self, h: Vec3) -> f32 {
        // sin² from x and y, not 1 − z²: that would cancel for narrow lobes.
        let (x, y) = (h.x / self.x, h.y / self.y);
        let s = h.z * h.z + (x * x + y * y);
        1.0 / (PI * self.x * self.y * s * s)
    }

    /// Smith's Λ: the area of hidden microfacets over that of visible ones.
    fn lambda(self, w: Vec3) -> f32 {
        let (x, y) = (w.x * self.x, w.y * self.y);
        let x = (x * x + y * y) / (w.z * w.z).max(f32::MIN_POSITIVE);
        // (√(1+x) − 1)/2 without cancellation at small x.
        if x.is_finite() { 0.5 * x / (1.0 + (1.0 + x).sqrt()) } else { 1e18 }
    }

    /// Share of microfacets visible from `w`, [0, 1].
    pub fn g1(self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// Share visible from two directions on one side, correlated by height (Heitz 2014, eq. 99).
    pub fn g2_reflection(self, a: Vec3, b: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(a) + self.lambda(b))
    }

    /// Share visible from two directions on opposite sides, taken as independent (Walter 2007, eq. 23).
    pub fn g2_transmission(self, a: Vec3, b: Vec3) -> f32 {
        self.g1(a) * self.g1(b)
    }

    /// Density of [`Ggx::sample_visible`]: D(h) G1(wo) (wo·h) / cos θo, 1/sr over h.
    pub fn pdf_visible(self, wo: Vec3, h: Vec3) -> f32 {
        self.g1(wo) * wo.dot(h).max(0.0) * self.d(h) / wo.z.max(f32::MIN_POSITIVE)
    }

    /// A microfacet normal, as often as it is seen from `wo` (z > 0).
    ///
    /// J. Dupuy and A. Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023.
    pub fn sample_visible(self, wo: Vec3, u: Vec2) -> Vec3 {
        let stretched = Vec3::new(wo.x * self.x, wo.y * self.y, wo.z).normalize();
        let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
        let sin = (1.0 - z * z).max(0.0).sqrt();
        let h = (Vec2::from_angle(2.0 * PI * u.x) * sin).extend(z) + stretched;
        Vec3::new(h.x * self.x, h.y * self.y, h.z.max(1e-7)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Lattice2, cone, cone_pdf_solid_angle};

    #[test]
    fn the_distribution_is_normalised() {
        let lattice = Lattice2::new(4000);
        for alpha in [0.2, 0.5, 1.0] {
            let ggx = Ggx::round(alpha);
            let sum: f64 = (0..4000)
                .map(|i| {
                    let h = cone(lattice.point(i, Vec2::splat(1e-4)), 0.0);
                    f64::from(ggx.d(h) * h.z / cone_pdf_solid_angle(0.0))
                })
                .sum();
            assert!((sum / 4000.0 - 1.0).abs() < 5e-3, "{alpha}: {}", sum / 4000.0);
        }
    }

    #[test]
    fn visible_normals_integrate_to_one_and_their_projections_to_the_view() {
        let lattice = Lattice2::new(4000);
        for (alpha, cos) in [(0.3, 0.9f32), (0.6, 0.3), (1.0, 0.1)] {
            let (ggx, wo) = (Ggx { x: alpha, y: 0.5 * alpha }, Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos));
            let sum: f64 = (0..4000)
                .map(|i| {
                    let h = cone(lattice.point(i, Vec2::splat(1e-4)), 0.0);
                    f64::from(ggx.pdf_visible(wo, h) / cone_pdf_solid_angle(0.0))
                })
                .sum();
            assert!((sum / 4000.0 - 1.0).abs() < 1e-2, "{alpha} {cos}: {}", sum / 4000.0);
        }
    }

    #[test]
    fn narrow_lobes_at_grazing_angles_stay_finite() {
        for alpha in [9e-4, 0.01, 1.0] {
            let ggx = Ggx::round(alpha);
            for cos in [1e-7f32, 1e-3, 1.0] {
                let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                for u in [Vec2::ZERO, Vec2::new(0.3, 0.999_999_9), Vec2::splat(0.5)] {
                    let h = ggx.sample_visible(wo, u);
                    assert!((h.length() - 1.0).abs() < 1e-5 && h.z > 0.0, "{h}");
                    assert!(ggx.pdf_visible(wo, h).is_finite());
                }
            }
        }
    }
}
