//! Lamps without extent, as KHR_lights_punctual defines them.

use crate::Rgb;
use crate::math::Vec3;
use crate::scene::{Light, LightKind};
use std::f32::consts::{PI, TAU};

/// Share of a spot's intensity at an angle of cosine `cos` from its axis, [0, 1].
///
/// The reference formula of KHR_lights_punctual, "Inner and Outer Cone Angles"; its 0.001 keeps equal angles from a
/// division by zero.
pub fn spot_falloff(cos: f32, cos_inner: f32, cos_outer: f32) -> f32 {
    let x = ((cos - cos_outer) / (cos_inner - cos_outer).max(0.001)).clamp(0.0, 1.0);
    x * x
}

/// Share of the light left at distance `d` from a lamp that reaches as far as `range`, both m.
///
/// KHR_lights_punctual, "Range": max(min(1 − (d/range)⁴, 1), 0).
pub fn range_window(d: f32, range: f32) -> f32 {
    (1.0 - (d / range).powi(4)).clamp(0.0, 1.0)
}

impl Light {
    /// What arrives at `p`: the unit direction toward the lamp, the distance (m, infinite for a directional light)
    /// and the irradiance on a surface that faces it, lx. `None` where no light arrives.
    pub fn reaching(&self, p: Vec3) -> Option<(Vec3, f32, Rgb)> {
        let (position, range) = match self.kind {
            LightKind::Directional { direction } => return Some((-direction, f32::INFINITY, self.intensity)),
            LightKind::Point { position, range }
            | LightKind::Spot { position, range, .. }
            | LightKind::Photometric { position, range, .. } => (position, range),
        };
        let way = position - p;
        let d = way.length();
        let wi = way / d;
        let share = self.relative(-wi) * range_window(d, range) / (d * d);
        (share > 0.0 && share.is_finite()).then(|| (wi, d, self.intensity * share))
    }

    /// Intensity along the unit direction `d`, away from the lamp, over [`Light::intensity`], [0, 1]; 1 for a point.
    pub fn relative(&self, d: Vec3) -> f32 {
        match &self.kind {
            LightKind::Point { .. } | LightKind::Directional { .. } => 1.0,
            LightKind::Spot { direction, cos_inner, cos_outer, .. } => {
                spot_falloff(d.dot(*direction), *cos_inner, *cos_outer)
            }
            LightKind::Photometric { turn, web, .. } => web.relative(*turn * d),
        }
    }

    /// Light that leaves a lamp with a place, lm, by the integral of its intensity over all directions, without its
    /// range; for a directional light what passes through a disc of `radius`, m.
    pub fn flux(&self, radius: f32) -> Rgb {
        self.intensity
            * match self.kind {
                LightKind::Point { .. } => 4.0 * PI,
                LightKind::Directional { .. } => PI * radius * radius,
                LightKind::Photometric { ref web, .. } => web.solid_angle(),
                LightKind::Spot { cos_inner, cos_outer, .. } => {
                    // ∫ x² dc over the rim of width w, and 1 over the rest of the cone.
                    let rim = (cos_inner - cos_outer).max(0.001);
                    let w = rim.min(1.0 - cos_outer);
                    TAU * ((1.0 - cos_outer - w) + w * w * w / (3.0 * rim * rim))
                }
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(cos_inner: f32, cos_outer: f32) -> Light {
        let (position, direction) = (Vec3::Y * 2.0, Vec3::NEG_Y);
        let kind = LightKind::Spot { position, direction, cos_inner, cos_outer, range: f32::INFINITY };
        Light { name: String::new(), intensity: Rgb::splat(100.0), kind }
    }

    #[test]
    fn a_point_obeys_the_inverse_square() {
        let kind = LightKind::Point { position: Vec3::Y * 3.0, range: f32::INFINITY };
        let lamp = Light { name: String::new(), intensity: Rgb::splat(10_000.0 / (4.0 * PI)), kind };
        assert!((lamp.flux(1.0).r - 10_000.0).abs() < 1e-2);
        // CIE 171:2006, of the kind of case 5.2: 10 000 lm, 3 m up, r to the side.
        for (r, e) in [(0.0, 88.419_413), (1.0, 75.493_818), (3.0, 31.260_983), (5.0, 12.041_845f32)] {
            let (wi, d, facing) = lamp.reaching(Vec3::X * r).expect("reached");
            assert!((d - (9.0 + r * r).sqrt()).abs() < 1e-5);
            assert!((facing.r * wi.y / e - 1.0).abs() < 1e-5);
        }
        assert!(lamp.reaching(Vec3::Y * 3.0).is_none(), "at the lamp itself nothing is defined");
    }

    #[test]
    fn a_spot_of_equal_angles_divides_by_nothing() {
        let c = 0.9;
        for (p, lit) in [(Vec3::ZERO, true), (Vec3::X * 3.0, false), (Vec3::Y * 4.0, false)] {
            assert_eq!(spot(c, c).reaching(p).is_some(), lit);
        }
        assert!(spot(c, c).flux(1.0).r.is_finite() && spot(1.0, 1.0).flux(1.0).r >= 0.0);
    }

    #[test]
    fn the_flux_of_a_spot_is_its_integral() {
        for (inner, outer) in [(0.95, 0.7), (1.0, 0.0), (0.9, 0.9)] {
            let n = 100_000;
            let sum: f64 = (0..n)
                .map(|i| spot_falloff(1.0 - 2.0 * (i as f32 + 0.5) / n as f32, inner, outer) as f64)
                .sum();
            let integral = (100.0 * TAU as f64 * sum * 2.0 / n as f64) as f32;
            assert!((spot(inner, outer).flux(1.0).r / integral - 1.0).abs() < 1e-3, "{inner} {outer}");
        }
    }

    #[test]
    fn a_range_ends_the_light() {
        assert_eq!(range_window(1.0, f32::INFINITY), 1.0);
        assert!((range_window(1.0, 2.0) - 15.0 / 16.0).abs() < 1e-6);
        assert_eq!(range_window(3.0, 2.0), 0.0);
    }
}
