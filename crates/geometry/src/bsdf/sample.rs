//! Where a path goes on: choose a lobe, then a direction, and the density of both choices.
//!
//! First diffuse or not, by the directional albedos at `wo`. Then, for the rest, a visible microfacet, and by the
//! Fresnel term *at that facet* whether to reflect or to pass: glass then carries a weight near 1 on every path.

use super::ggx::Ggx;
use super::{Bsdf, reflection, transmission};
use crate::Rgb;
use crate::math::{Vec2, Vec3};
use crate::optics::{reflect, refract};
use crate::sampling;

/// Which part of the material a path went through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// Lambertian base.
    Diffuse,
    /// Mirror or glossy reflection.
    Reflection,
    /// Through the surface.
    Transmission,
}

/// One continuation of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Where the path goes on: unit, away from the surface.
    pub wi: Vec3,
    /// f · |cos| / pdf; for a delta lobe its share over the chance of choosing it.
    pub weight: Rgb,
    /// Density over solid angle, 1/sr, of all non-delta lobes; for a delta lobe the chance of choosing it.
    pub pdf: f32,
    /// Whether the direction was the only one possible.
    pub delta: bool,
    /// Whether it passed straight on: smooth thin wall, or a volume with the index of its surroundings.
    pub straight: bool,
    /// Which lobe was chosen.
    pub lobe: Lobe,
}

impl Bsdf {
    /// A continuation from `wo`, chosen by three uniform numbers in [0, 1); `None` when the path is absorbed.
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let chance = self.chance_of_diffuse(wo)?;
        if u[2] < chance {
            let wi = self.to_world(sampling::cosine_hemisphere(Vec2::new(u[0], u[1])));
            return self.finish(wi, Lobe::Diffuse, self.pdf(wo, wi), self.eval(wo, wi));
        }
        let rest = ((u[2] - chance) / (1.0 - chance)).min(1.0 - f32::EPSILON);
        let s = self.choose_specular(wo, [u[0], u[1], rest])?;
        if s.delta {
            return Some(BsdfSample { weight: s.weight / (1.0 - chance), pdf: s.pdf * (1.0 - chance), ..s });
        }
        self.finish(s.wi, s.lobe, self.pdf(wo, s.wi), self.eval(wo, s.wi))
    }

    /// As [`Bsdf::sample`], from the lobes other than diffuse alone: weight and pdf are theirs.
    pub fn sample_specular(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let s = self.choose_specular(wo, u)?;
        if s.delta {
            return Some(s);
        }
        self.finish(s.wi, s.lobe, self.pdf_specular(wo, s.wi), self.eval_glossy(wo, s.wi))
    }

    /// Density of [`Bsdf::sample`] over solid angle, 1/sr, delta lobes left out; its integral is their complement.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some(chance) = self.chance_of_diffuse(wo) else { return 0.0 };
        let cos_i = wi.dot(self.normal);
        let mut pdf = 0.0;
        if chance > 0.0 && wi.dot(self.geometric) > 0.0 {
            pdf += chance * sampling::cosine_hemisphere_pdf_solid_angle(cos_i);
        }
        if chance < 1.0 {
            pdf += (1.0 - chance) * self.pdf_specular(wo, wi);
        }
        pdf
    }

    /// Density of [`Bsdf::sample_specular`] over solid angle, 1/sr, delta lobes left out.
    pub fn pdf_specular(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.layers.is_delta() || !self.layers.has_specular() {
            return 0.0;
        }
        let Some((o, i, same)) = self.sides(wo, wi) else { return 0.0 };
        if same {
            let Some((pdf, h)) = reflection::pdf(self.layers.alpha(), o, i) else { return 0.0 };
            pdf * self.chance_of_reflection(o.dot(h))
        } else {
            let Some((pdf, h)) = transmission::pdf(&self.layers, o, i) else { return 0.0 };
            pdf * (1.0 - self.chance_of_reflection(o.dot(h)))
        }
    }

    /// The perfect mirror and the perfect passage from `wo`, each with its whole share as weight and pdf 1; for
    /// a tree that follows both. Empty where the lobes are rough.
    pub fn delta_lobes(&self, wo: Vec3) -> [Option<BsdfSample>; 2] {
        let cos = wo.dot(self.normal);
        if !self.layers.is_delta() || cos <= 0.0 {
            return [None, None];
        }
        let keep = |s: BsdfSample| (!s.weight.is_black()).then_some(s);
        [keep(self.mirror(wo, cos)), self.pass(wo, cos).and_then(keep)]
    }

    /// Chance that `sample` goes on diffusely; `None` when there is no lobe.
    fn chance_of_diffuse(&self, wo: Vec3) -> Option<f32> {
        if wo.dot(self.normal) <= 0.0 {
            return None;
        }
        if !self.has_diffuse() {
            return self.has_specular().then_some(0.0);
        }
        let diffuse = self.diffuse_albedo(wo).max_channel();
        let specular = self.specular_albedo(wo).max_channel();
        let sum = diffuse + specular;
        (sum > 0.0).then(|| diffuse / sum)
    }

    /// Chance of reflecting rather than passing at a microfacet whose normal makes `cos` with `wo`.
    fn chance_of_reflection(&self, cos: f32) -> f32 {
        let passed = self.layers.transmission(cos).max_channel();
        if passed == 0.0 {
            return 1.0;
        }
        let reflected = self.layers.reflection(cos).max_channel();
        reflected / (reflected + passed)
    }

    /// Direction and lobe; weight and pdf are filled in for delta lobes only.
    fn choose_specular(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let local = self.to_local(wo);
        if local.z <= 0.0 || !self.layers.has_specular() {
            return None;
        }
        if self.layers.is_delta() {
            let chance = self.chance_of_reflection(local.z);
            let (s, chance) = if u[2] < chance {
                (self.mirror(wo, local.z), chance)
            } else {
                (self.pass(wo, local.z)?, 1.0 - chance)
            };
            let s = BsdfSample { weight: s.weight / chance, pdf: chance, ..s };
            return (!s.weight.is_black()).then_some(s);
        }
        let h = Ggx { alpha: self.layers.alpha() }.sample_visible(local, Vec2::new(u[0], u[1]));
        let mirrored = reflect(local, h);
        let (wi, lobe) = if u[2] < self.chance_of_reflection(local.dot(h)) {
            (mirrored, Lobe::Reflection)
        } else if self.layers.refracts() {
            (refract(local, h, self.layers.eta())?, Lobe::Transmission)
        } else {
            (Vec3::new(mirrored.x, mirrored.y, -mirrored.z), Lobe::Transmission)
        };
        // A facet may send light to where the surface itself is in the way; single scattering loses it.
        if (wi.z > 0.0) != (lobe == Lobe::Reflection) {
            return None;
        }
        let wi = self.to_world(wi);
        Some(BsdfSample { wi, weight: Rgb::BLACK, pdf: 0.0, delta: false, straight: false, lobe })
    }

    /// A non-delta sample from its f and pdf; `None` where nothing arrives.
    fn finish(&self, wi: Vec3, lobe: Lobe, pdf: f32, f: Rgb) -> Option<BsdfSample> {
        let weight = f * (wi.dot(self.normal).abs() / pdf);
        let useful = pdf > 0.0 && weight.is_finite() && !weight.is_black();
        useful.then_some(BsdfSample { wi, weight, pdf, delta: false, straight: false, lobe })
    }

    fn mirror(&self, wo: Vec3, cos: f32) -> BsdfSample {
        let wi = self.fold(reflect(wo, self.normal), 1.0);
        let weight = self.layers.reflection(cos);
        BsdfSample { wi, weight, pdf: 1.0, delta: true, straight: false, lobe: Lobe::Reflection }
    }

    fn pass(&self, wo: Vec3, cos: f32) -> Option<BsdfSample> {
        let straight = self.layers.eta() == 1.0;
        let wi = if straight { -wo } else { self.fold(refract(wo, self.normal, self.layers.eta())?, -1.0) };
        let weight = self.layers.transmission(cos) * transmission::eta_squared(&self.layers, self.transport);
        Some(BsdfSample { wi, weight, pdf: 1.0, delta: true, straight, lobe: Lobe::Transmission })
    }

    /// Where the shading normal sends a perfect ray to the wrong side of the triangle, the ray mirrored in the
    /// triangle's plane: continuous, and no black rim on a coarse mesh.
    fn fold(&self, wi: Vec3, side: f32) -> Vec3 {
        let below = wi.dot(self.geometric);
        if below * side > 0.0 { wi } else { wi - self.geometric * (2.0 * below) }
    }
}
