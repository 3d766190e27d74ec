//! The shading model: eval, sample and pdf of each lobe.
//!
//! glTF 2.0, Appendix B, with KHR_materials_{ior, specular, transmission, volume, clearcoat, sheen, anisotropy,
//! iridescence, diffuse_transmission}:
//!
//! ```text
//! material   = clearcoat over sheen over mix(dielectric, metal, metallic)
//! metal      = GGX reflection, Schlick with F0 = base colour
//! dielectric = GGX coat over mix(diffuse base, transmission, transmission factor)
//! base       = mix(diffuse reflection, diffuse transmission)
//! ```
//! - A file for each part: `layers` says how strong each lobe is, `diffuse`, `reflection`, `transmission` and `over`
//!   where it goes, `ggx` holds the microfacets, `film` their interference colours, `albedo` and `glass` their
//!   tabulated directional averages, `multiple` what bounces between them. What a material has not, it does not pay for.
//! - α = roughness². Below a roughness of [`SMOOTH_ROUGHNESS`] mirror and glass are perfect (delta lobes).
//! - The diffuse base carries (1 − E(wo))(1 − E(wi))/(1 − E̅) instead of the appendix's 1 − F(V·H), E being the
//!   directional albedo of all above it (Kelemen and Szirmay-Kalos, 2001). The appendix leaves the choice free; its own
//!   factor sends back up to 1.6 times the light received at grazing angles, this one exactly what the coat leaves.
//!   It is reciprocal, and a white dielectric vanishes in a white furnace at every roughness.
//! - Glass with a volume uses the exact Fresnel equations at its interface; everything else uses Schlick's.
//! - Light that bounces between microfacets is given back: white metal and white glass of any roughness vanish in a
//!   white furnace but for 1 %, or 3 % within 12° of grazing. Where clearcoat or sheen lies over gloss, the gloss is
//!   weakened by the stronger of both directions' losses, so that up to 7 % is lost; under both, 10 %. Brushed metal
//!   has the tables of round lobes as wide on the average: ±5 % at strength 0.6, ±10 % at 1.

mod albedo;
mod diffuse;
mod film;
mod ggx;
mod glass;
mod layers;
mod multiple;
mod over;
mod reflection;
mod sample;
mod shading;
mod sheen;
#[cfg(test)]
mod tests;
mod transmission;

pub use ggx::SMOOTH_ROUGHNESS;
pub use layers::Layers;
pub use multiple::is_wide;
pub use sample::{BsdfSample, Lobe};
pub use shading::{Clearcoat, Film, Shading, Sheen, Translucency, is_index_matched};

use crate::Rgb;
use crate::math::{self, Vec3};

/// Which quantity the path carries from `wi` to `wo`.
///
/// They differ at a refracting interface only. A beam that enters glass narrows, so its radiance grows by n²:
/// a path that starts at the eye multiplies by (n of wo's side / n of wi's side)², one from a lamp does not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transport {
    /// Paths from the eye: `wo` toward the eye, `wi` toward the light. The η² factor is included.
    #[default]
    Radiance,
    /// Paths from a lamp (photons, light tracing): `wo` back toward the lamp. No η² factor: flux is kept.
    Importance,
}

/// The shading model at one point of one surface. All directions are unit, in world space, and point away
/// from the surface; `wo` is on the side of both normals, reflection stays there, transmission leaves it.
#[derive(Clone, Debug)]
pub struct Bsdf {
    /// How strong each lobe is.
    pub layers: Layers,
    /// What is carried; radiance unless changed.
    pub transport: Transport,
    tangent: Vec3,
    bitangent: Vec3,
    normal: Vec3,
    geometric: Vec3,
}

impl Bsdf {
    /// - `shading`: the material's parameters at this point, textures applied.
    /// - `normal`: shading normal, unit, on the side of `wo`.
    /// - `geometric`: normal of the triangle, unit, on the side of `wo`.
    /// - `front`: whether `wo` is on the front, which is the outside of a volume.
    pub fn new(shading: &Shading, normal: Vec3, geometric: Vec3, front: bool) -> Bsdf {
        let along = shading.anisotropy.and_then(|(_, d)| (d - normal * normal.dot(d)).try_normalize());
        let (tangent, bitangent) = match along {
            Some(tangent) => (tangent, normal.cross(tangent)),
            None => math::frame(normal),
        };
        let layers = Layers::new(shading, front);
        Bsdf { layers, transport: Transport::default(), tangent, bitangent, normal, geometric }
    }

    /// The same surface for paths that carry something else.
    pub fn with_transport(self, transport: Transport) -> Bsdf {
        Bsdf { transport, ..self }
    }

    /// All lobes that are not delta: f in 1/sr, without the cosine.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        self.eval_diffuse(wo, wi) + self.eval_glossy(wo, wi)
    }

    /// The diffuse part with its share under the coat, from both sides where light comes through: f in 1/sr.
    pub fn eval_diffuse(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let (cos_o, cos_i, geometric) = (wo.dot(self.normal), wi.dot(self.normal), wi.dot(self.geometric));
        if cos_o <= 0.0 {
            Rgb::BLACK
        } else if cos_i > 0.0 && geometric > 0.0 {
            self.layers.diffuse.eval(cos_o, cos_i)
        } else if cos_i < 0.0 && geometric < 0.0 {
            self.layers.diffuse.eval_behind(cos_o, -cos_i)
        } else {
            Rgb::BLACK
        }
    }

    /// Rough reflection and rough transmission: f in 1/sr. Black where the lobes are delta.
    pub fn eval_glossy(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let l = &self.layers;
        if self.is_delta() || !self.has_specular() {
            return Rgb::BLACK;
        }
        let Some((o, i, same)) = self.sides(wo, wi) else { return Rgb::BLACK };
        let mut f = Rgb::BLACK;
        if !l.is_delta() && l.has_specular() {
            f = match same {
                true => reflection::eval(l, o, i),
                false => transmission::eval(l, o, i, self.transport),
            };
            if let Some(spread) = &l.spread {
                let [back, through] = l.spread_colors();
                f += match same {
                    true => back * spread.eval_back(o.z, i.z),
                    false => {
                        let gain = transmission::eta_squared(l, self.transport);
                        through * (spread.eval_through(o.z, -i.z) * gain)
                    }
                };
            }
        }
        let Some(over) = &l.over else { return f };
        f *= self.passed_both(over, o.z, i.z);
        if same {
            f += over.eval_fuzz(o, i);
            if let Some(coat) = over.coat.filter(|c| c.alpha > 0.0) {
                // Its own cosine over that which the caller multiplies by.
                f += Rgb::splat(coat.eval(wo, wi).0 / i.z.max(1e-6));
            }
        }
        f
    }

    /// Share of a uniform light from all directions that the diffuse lobe sends to `wo` on its own side, [0, 1]:
    /// base colour · (1 − E(wo)). Under irradiance E it shines with `diffuse_albedo · E / π`.
    pub fn diffuse_albedo(&self, wo: Vec3) -> Rgb {
        self.layers.diffuse.albedo(wo.dot(self.normal))
    }

    /// The same of light that comes through diffusely from the other side.
    pub fn translucent_albedo(&self, wo: Vec3) -> Rgb {
        self.layers.diffuse.albedo_behind(wo.dot(self.normal))
    }

    /// The diffuse reflection averaged over the cosine-weighted hemisphere of `wo`, [0, 1]: the ρ of radiosity.
    pub fn diffuse_reflectance(&self) -> Rgb {
        self.layers.diffuse.reflectance()
    }

    /// Share of a uniform light from all directions that all other lobes together, delta ones included, send to
    /// `wo`, [0, 1]; an energy, without the η² of radiance. From tables (±0.005, ±0.012 within 2° of grazing; ±0.02 for
    /// rough glass, ±0.05 for gloss under clearcoat or sheen).
    pub fn specular_albedo(&self, wo: Vec3) -> Rgb {
        let cos = wo.dot(self.normal);
        let below = self.layers.specular_albedo(cos);
        let Some(over) = &self.layers.over else { return below };
        if cos <= 0.0 {
            return Rgb::BLACK;
        }
        let coat = over.coat.map_or(0.0, |c| c.albedo(wo.dot(c.normal)));
        below * over.passed(cos) + over.fuzz_albedo(cos) + Rgb::splat(coat)
    }

    /// Width α of the narrowest lobe that is not diffuse; 0 when one is delta.
    pub fn glossy_roughness(&self) -> f32 {
        let Some(over) = &self.layers.over else { return self.layers.alpha() };
        let below = if self.layers.has_specular() { self.layers.alpha() } else { 1.0 };
        over.coat.map_or(below, |c| c.alpha.min(below))
    }

    /// Whether any light is reflected diffusely.
    pub fn has_diffuse(&self) -> bool {
        self.layers.diffuse.is_present()
    }

    /// Whether any light comes through diffusely.
    pub fn is_translucent(&self) -> bool {
        self.layers.diffuse.is_translucent()
    }

    /// Whether there is any lobe other than diffuse.
    pub fn has_specular(&self) -> bool {
        self.layers.has_specular() || self.layers.over.is_some()
    }

    /// Whether the lobes other than diffuse are perfect mirror and glass.
    pub fn is_delta(&self) -> bool {
        let below = self.layers.is_delta();
        match &self.layers.over {
            None => below,
            Some(over) => {
                let bare = !self.layers.has_specular();
                (below || bare) && over.fuzz.is_none() && over.coat.is_none_or(|c| c.alpha == 0.0)
            }
        }
    }

    /// The other side of a translucent surface, as a diffuse reflector of the light there that comes through to here:
    /// its `wo` is the opposite of this one's.
    pub fn turned(&self) -> Bsdf {
        let dark = Shading { base_color: Rgb::BLACK, ..Shading::LAMBERT };
        let mut turned = Bsdf::new(&dark, -self.normal, -self.geometric, true);
        turned.layers.diffuse = self.layers.diffuse.turned();
        turned
    }

    /// Shading normal.
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Share of a lobe that the layers over it let through. Those of a solid lie on its outside only.
    fn passed_both(&self, over: &over::Over, cos_o: f32, cos_i: f32) -> f32 {
        if cos_i < 0.0 && self.layers.refracts() {
            over.passed(cos_o)
        } else {
            over.passed_both(cos_o, cos_i.abs())
        }
    }

    /// World to local, z along the shading normal.
    fn to_local(&self, w: Vec3) -> Vec3 {
        Vec3::new(w.dot(self.tangent), w.dot(self.bitangent), w.dot(self.normal))
    }

    /// Local to world.
    fn to_world(&self, w: Vec3) -> Vec3 {
        self.tangent * w.x + self.bitangent * w.y + self.normal * w.z
    }

    /// Both directions in local space and whether `wi` is on the side of `wo`; `None` where the shading and the
    /// geometric normal disagree about that, or `wo` is below the horizon: no light passes there.
    fn sides(&self, wo: Vec3, wi: Vec3) -> Option<(Vec3, Vec3, bool)> {
        let (o, i, geometric) = (self.to_local(wo), self.to_local(wi), wi.dot(self.geometric));
        let same = i.z > 0.0 && geometric > 0.0;
        let other = i.z < 0.0 && geometric < 0.0;
        (o.z > 0.0 && (same || other)).then_some((o, i, same))
    }
}
