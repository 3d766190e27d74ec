//! What lies over the rest of a material: fuzz, and above it a clearcoat. Each keeps some light off what is below.

use super::albedo;
use super::ggx::{Ggx, SMOOTH_ROUGHNESS};
use super::shading::Shading;
use super::sheen::Fuzz;
use crate::Rgb;
use crate::math::{self, Vec3};
use crate::optics::schlick_weight;

/// F0 of a clearcoat, whose index is 1.5 (KHR_materials_clearcoat).
const COAT_F0: f32 = 0.04;

/// The layers over a material; a material without has none.
#[derive(Clone, Copy, Debug)]
pub struct Over {
    pub coat: Option<Coat>,
    pub fuzz: Option<Fuzz>,
}

impl Over {
    /// `None` when nothing lies over the material.
    pub fn new(shading: &Shading) -> Option<Over> {
        let coat = shading.clearcoat.filter(|c| c.strength > 0.0).map(|c| {
            let smooth = c.roughness < SMOOTH_ROUGHNESS;
            let alpha = if smooth { 0.0 } else { c.roughness * c.roughness };
            let (tangent, bitangent) = math::frame(c.normal);
            Coat { strength: c.strength.min(1.0), alpha, normal: c.normal, tangent, bitangent }
        });
        let fuzz = shading.sheen.filter(|s| !s.color.is_black()).map(|s| Fuzz::new(&s));
        (coat.is_some() || fuzz.is_some()).then_some(Over { coat, fuzz })
    }

    /// Share of light along a direction of cosine `cos` that comes through to what is below, [0, 1].
    pub fn passed(&self, cos: f32) -> f32 {
        let coat = self.coat.map_or(0.0, |c| c.albedo(cos));
        let fuzz = self.fuzz.map_or(0.0, |f| f.albedo(cos).max_channel());
        ((1.0 - coat) * (1.0 - fuzz)).max(0.0)
    }

    /// The same for light that comes along one direction and leaves by the other: the lesser of both. Reciprocal and
    /// never too much; exact for a lobe narrow enough that both are alike, as is KHR_materials_sheen's own factor.
    pub fn passed_both(&self, cos_o: f32, cos_i: f32) -> f32 {
        self.passed(cos_o).min(self.passed(cos_i))
    }

    /// The fuzz, seen through the coat: f in 1/sr, both directions local and above the horizon.
    pub fn eval_fuzz(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let Some(fuzz) = self.fuzz else { return Rgb::BLACK };
        let coat = self.coat.map_or(1.0, |c| 1.0 - c.albedo(wo.z).max(c.albedo(wi.z)));
        fuzz.eval(wo, wi) * coat
    }

    /// Share of uniform light that the fuzz sends to `cos`, about.
    pub fn fuzz_albedo(&self, cos: f32) -> Rgb {
        let coat = self.coat.map_or(1.0, |c| 1.0 - c.albedo(cos));
        self.fuzz.map_or(Rgb::BLACK, |f| f.albedo(cos) * coat)
    }
}

/// A clearcoat: GGX about a normal of its own, with Schlick's Fresnel term.
#[derive(Clone, Copy, Debug)]
pub struct Coat {
    strength: f32,
    /// GGX width; 0 for a perfect mirror.
    pub alpha: f32,
    /// In world space, on the viewer's side.
    pub normal: Vec3,
    tangent: Vec3,
    bitangent: Vec3,
}

impl Coat {
    /// Share of light on a facet that it reflects.
    pub fn reflection(&self, cos: f32) -> f32 {
        self.strength * (COAT_F0 + (1.0 - COAT_F0) * schlick_weight(cos))
    }

    /// Share of uniform light sent to a direction that makes `cos` with its normal.
    pub fn albedo(&self, cos: f32) -> f32 {
        if cos <= 0.0 { 0.0 } else { self.strength * albedo::directional(self.alpha, cos).with_f0(COAT_F0) }
    }

    /// f · cos of the coat's normal, 1/sr, and the density of [`Coat::sample`]; directions in world space. A coat of
    /// some width only.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let (o, i) = (self.to_local(wo), self.to_local(wi));
        let Some(h) = (o + i).try_normalize().filter(|_| o.z > 0.0 && i.z > 0.0) else { return (0.0, 0.0) };
        let ggx = Ggx::round(self.alpha);
        let shape = ggx.d(h) / (4.0 * o.z);
        (self.reflection(o.dot(h)) * shape * ggx.g2_reflection(o, i), shape * ggx.g1(o))
    }

    /// A direction mirrored at a visible facet; `None` where the coat does not face the viewer.
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let o = self.to_local(wo);
        if o.z <= 0.0 {
            return None;
        }
        let h = Ggx::round(self.alpha).sample_visible(o, math::Vec2::from(u));
        let i = crate::optics::reflect(o, h);
        (i.z > 0.0).then(|| self.tangent * i.x + self.bitangent * i.y + self.normal * i.z)
    }

    fn to_local(self, w: Vec3) -> Vec3 {
        Vec3::new(w.dot(self.tangent), w.dot(self.bitangent), w.dot(self.normal))
    }
}

/// 2 ∫ g(μ) μ dμ over [0, 1]: the mean over the cosine-weighted hemisphere. For layers that no table holds.
pub fn mean(g: impl Fn(f32) -> f32) -> f32 {
    // With μ = x² it is 4 ∫ g x³ dx: Gauss and Legendre's eight points.
    const X: [f32; 4] = [0.183_434_64, 0.525_532_4, 0.796_666_48, 0.960_289_86];
    const W: [f32; 4] = [0.362_683_78, 0.313_706_65, 0.222_381_03, 0.101_228_54];
    let at = |x: f32| 2.0 * x * x * x * g(x * x);
    (0..4).map(|i| W[i] * (at(0.5 + 0.5 * X[i]) + at(0.5 - 0.5 * X[i]))).sum()
}
