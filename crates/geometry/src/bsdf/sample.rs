//! Where a path goes on: choose a lobe, then a direction, and the density of both choices.
//!
//! First diffuse or not, by the directional albedos at `wo`; if diffuse, on which side. For the rest, clearcoat, fuzz
//! or what lies below, where the material has them. Then a visible microfacet, and by the Fresnel term *at that facet*
//! whether to reflect or to pass: glass then carries a weight near 1 on every path.

use super::{Bsdf, reflection, transmission};
use crate::Rgb;
use crate::math::{Vec2, Vec3};
use crate::optics::{reflect, refract};
use crate::sampling;

/// Which part of the material a path went through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// Lambertian base, on either side.
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
            let local = sampling::cosine_hemisphere(Vec2::new(u[0], u[1]));
            let behind = u[2] < chance * self.chance_of_behind(wo);
            let wi = self.to_world(if behind { Vec3::new(local.x, local.y, -local.z) } else { local });
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
        let (cos_i, geometric) = (wi.dot(self.normal), wi.dot(self.geometric));
        let mut pdf = 0.0;
        if chance > 0.0 && cos_i * geometric > 0.0 {
            let behind = self.chance_of_behind(wo);
            let side = if geometric > 0.0 { 1.0 - behind } else { behind };
            pdf += chance * side * sampling::cosine_hemisphere_pdf_solid_angle(cos_i.abs());
        }
        if chance < 1.0 {
            pdf += (1.0 - chance) * self.pdf_specular(wo, wi);
        }
        pdf
    }

    /// Density of [`Bsdf::sample_specular`] over solid angle, 1/sr, delta lobes left out.
    pub fn pdf_specular(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.is_delta() || !self.has_specular() {
            return 0.0;
        }
        let Some((o, i, same)) = self.sides(wo, wi) else { return 0.0 };
        if self.layers.over.is_none() {
            return self.pdf_below(o, i, same);
        }
        let [coat, fuzz] = self.chances_over(wo);
        let mut pdf = (1.0 - coat - fuzz) * self.pdf_below(o, i, same);
        if same {
            pdf += fuzz * sampling::cosine_hemisphere_pdf_solid_angle(i.z);
            let lobe = self.layers.over.as_ref().and_then(|over| over.coat).filter(|c| c.alpha > 0.0);
            pdf += coat * lobe.map_or(0.0, |c| c.eval(wo, wi).1);
        }
        pdf
    }

    /// The density of what lies below clearcoat and fuzz; directions local.
    fn pdf_below(&self, o: Vec3, i: Vec3, same: bool) -> f32 {
        let l = &self.layers;
        if l.is_delta() || !l.has_specular() {
            return 0.0;
        }
        let facet = match same {
            true => reflection::pdf(l.ggx, o, i).map(|(pdf, h)| pdf * self.chance_of_reflection(o.dot(h))),
            false => {
                let facet = transmission::pdf(l, o, i);
                facet.map(|(pdf, h)| pdf * (1.0 - self.chance_of_reflection(o.dot(h))))
            }
        };
        let facet = facet.unwrap_or(0.0);
        let Some(spread) = &l.spread else { return facet };
        let chance = spread.lost(o.z, false);
        let side = if same { spread.back } else { 1.0 - spread.back };
        (1.0 - chance) * facet + chance * side * sampling::cosine_hemisphere_pdf_solid_angle(i.z.abs())
    }

    /// The perfect mirror and the perfect passage from `wo`, and the mirror of a clearcoat, each with its whole share as
    /// weight and pdf 1; for a tree that follows all. Empty where a lobe is rough.
    pub fn delta_lobes(&self, wo: Vec3) -> [Option<BsdfSample>; 3] {
        let cos = wo.dot(self.normal);
        if !self.is_delta() || cos <= 0.0 {
            return [None; 3];
        }
        let keep = |s: BsdfSample| (!s.weight.is_black()).then_some(s);
        let coat = self.coat_mirror(wo).and_then(keep);
        if !self.layers.has_specular() {
            return [None, None, coat];
        }
        [keep(self.mirror(wo, cos)), self.pass(wo, cos).and_then(keep), coat]
    }

    /// Chance that `sample` goes on diffusely; `None` when there is no lobe.
    fn chance_of_diffuse(&self, wo: Vec3) -> Option<f32> {
        if wo.dot(self.normal) <= 0.0 {
            return None;
        }
        if !self.has_diffuse() && !self.is_translucent() {
            return self.has_specular().then_some(0.0);
        }
        let diffuse = self.diffuse_albedo(wo).max_channel() + self.translucent_albedo(wo).max_channel();
        let specular = self.specular_albedo(wo).max_channel();
        let sum = diffuse + specular;
        (sum > 0.0).then(|| diffuse / sum)
    }

    /// Chance that a diffuse path goes on behind the surface.
    fn chance_of_behind(&self, wo: Vec3) -> f32 {
        if !self.is_translucent() {
            return 0.0;
        }
        let behind = self.translucent_albedo(wo).max_channel();
        behind / (behind + self.diffuse_albedo(wo).max_channel()).max(f32::MIN_POSITIVE)
    }

    /// Chances of clearcoat and fuzz among the lobes that are not diffuse, by their albedos.
    fn chances_over(&self, wo: Vec3) -> [f32; 2] {
        let Some(over) = &self.layers.over else { return [0.0; 2] };
        let cos = wo.dot(self.normal);
        let coat = over.coat.map_or(0.0, |c| c.albedo(wo.dot(c.normal)));
        let fuzz = over.fuzz_albedo(cos).max_channel();
        let below = self.layers.specular_albedo(cos).max_channel() * over.passed(cos);
        let sum = coat + fuzz + below;
        if sum > 0.0 { [coat / sum, fuzz / sum] } else { [0.0; 2] }
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
        if wo.dot(self.normal) <= 0.0 || !self.has_specular() {
            return None;
        }
        let Some(over) = &self.layers.over else { return self.choose_below(wo, u) };
        let [coat, fuzz] = self.chances_over(wo);
        let scattered = |wi: Vec3| BsdfSample {
            wi,
            weight: Rgb::BLACK,
            pdf: 0.0,
            delta: false,
            straight: false,
            lobe: Lobe::Reflection,
        };
        if u[2] < coat {
            let lobe = over.coat?;
            if lobe.alpha > 0.0 {
                return lobe.sample(wo, [u[0], u[1]]).map(scattered);
            }
            let s = self.coat_mirror(wo)?;
            return Some(BsdfSample { weight: s.weight / coat, pdf: coat, ..s });
        }
        if u[2] < coat + fuzz {
            let local = sampling::cosine_hemisphere(Vec2::new(u[0], u[1]));
            return Some(scattered(self.to_world(local)));
        }
        let chance = 1.0 - coat - fuzz;
        let rest = ((u[2] - coat - fuzz) / chance).clamp(0.0, 1.0 - f32::EPSILON);
        let s = self.choose_below(wo, [u[0], u[1], rest])?;
        // The weights of perfect lobes are complete already but for the choice.
        if s.delta {
            Some(BsdfSample { weight: s.weight / chance, pdf: s.pdf * chance, ..s })
        } else {
            Some(s)
        }
    }

    /// The same of what lies below clearcoat and fuzz.
    fn choose_below(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
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
        let mut u = u;
        if let Some(spread) = &self.layers.spread {
            let chance = spread.lost(local.z, false);
            if u[2] < chance {
                let up = sampling::cosine_hemisphere(Vec2::new(u[0], u[1]));
                let back = u[2] < chance * spread.back;
                let (local, lobe) = match back {
                    true => (up, Lobe::Reflection),
                    false => (Vec3::new(up.x, up.y, -up.z), Lobe::Transmission),
                };
                let wi = self.to_world(local);
                return Some(BsdfSample {
                    wi,
                    weight: Rgb::BLACK,
                    pdf: 0.0,
                    delta: false,
                    straight: false,
                    lobe,
                });
            }
            u[2] = ((u[2] - chance) / (1.0 - chance)).min(1.0 - f32::EPSILON);
        }
        let h = self.layers.ggx.sample_visible(local, Vec2::new(u[0], u[1]));
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
        let weight = self.layers.reflection(cos) * self.passed_over(cos);
        BsdfSample { wi, weight, pdf: 1.0, delta: true, straight: false, lobe: Lobe::Reflection }
    }

    fn pass(&self, wo: Vec3, cos: f32) -> Option<BsdfSample> {
        let straight = self.layers.eta() == 1.0;
        let wi = if straight { -wo } else { self.fold(refract(wo, self.normal, self.layers.eta())?, -1.0) };
        let gain = transmission::eta_squared(&self.layers, self.transport);
        let weight = self.layers.transmission(cos) * (gain * self.passed_over(cos));
        Some(BsdfSample { wi, weight, pdf: 1.0, delta: true, straight, lobe: Lobe::Transmission })
    }

    /// The clearcoat as a perfect mirror.
    fn coat_mirror(&self, wo: Vec3) -> Option<BsdfSample> {
        let coat = self.layers.over.as_ref()?.coat.filter(|c| c.alpha == 0.0)?;
        let cos = wo.dot(coat.normal);
        if cos <= 0.0 {
            return None;
        }
        let wi = self.fold(reflect(wo, coat.normal), 1.0);
        let weight = Rgb::splat(coat.reflection(cos));
        Some(BsdfSample { wi, weight, pdf: 1.0, delta: true, straight: false, lobe: Lobe::Reflection })
    }

    /// What clearcoat and fuzz let through to a perfect lobe and out again.
    fn passed_over(&self, cos: f32) -> f32 {
        self.layers.over.as_ref().map_or(1.0, |over| over.passed(cos))
    }

    /// Where the shading normal sends a perfect ray to the wrong side of the triangle, the ray mirrored in the
    /// triangle's plane: continuous, and no black rim on a coarse mesh.
    fn fold(&self, wi: Vec3, side: f32) -> Vec3 {
        let below = wi.dot(self.geometric);
        if below * side > 0.0 { wi } else { wi - self.geometric * (2.0 * below) }
    }
}
