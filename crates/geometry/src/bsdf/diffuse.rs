//! The Lambertian base, seen through the coat above it.

use super::albedo;
use crate::Rgb;
use std::f32::consts::FRAC_1_PI;

/// f = ρ/π · (1 − E(θo)) (1 − E(θi)) / (1 − E̅), with E the coat's directional albedo and E̅ its mean.
///
/// C. Kelemen and L. Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling",
/// Eurographics 2001. Reciprocal; under uniform light it sends ρ (1 − E(θo)), just what the coat has left.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    base: Rgb,
    alpha: f32,
    specular: f32,
    f0: f32,
    /// 1 − E̅.
    mean_passed: f32,
}

impl Diffuse {
    /// - `base`: reflectance under the coat, [0, 1], metal and transmission taken off.
    /// - `alpha`, `specular`, `f0`: width, strength and largest F0 of the coat.
    pub fn new(base: Rgb, alpha: f32, specular: f32, f0: f32) -> Diffuse {
        let mean_passed =
            if specular > 0.0 { 1.0 - specular * albedo::hemispherical(alpha).with_f0(f0) } else { 1.0 };
        // A coat that lets nothing in hides its base, and would divide by zero.
        let base = if mean_passed > 1e-4 { base } else { Rgb::BLACK };
        Diffuse { base, alpha, specular, f0, mean_passed }
    }

    /// Whether there is any diffuse light.
    pub fn is_present(&self) -> bool {
        !self.base.is_black()
    }

    /// f, 1/sr, for two positive cosines.
    pub fn eval(&self, cos_o: f32, cos_i: f32) -> Rgb {
        if !self.is_present() {
            return Rgb::BLACK;
        }
        self.base * (FRAC_1_PI * self.passed(cos_o) * self.passed(cos_i) / self.mean_passed)
    }

    /// Share of uniform light sent to `cos_o`.
    pub fn albedo(&self, cos_o: f32) -> Rgb {
        if cos_o > 0.0 && self.is_present() { self.base * self.passed(cos_o) } else { Rgb::BLACK }
    }

    /// Share of uniform light sent anywhere.
    pub fn reflectance(&self) -> Rgb {
        self.base * self.mean_passed
    }

    /// 1 − E: share of light along a direction that gets past the coat.
    fn passed(&self, cos: f32) -> f32 {
        if self.specular == 0.0 {
            return 1.0;
        }
        (1.0 - self.specular * albedo::directional(self.alpha, cos).with_f0(self.f0)).max(0.0)
    }
}
