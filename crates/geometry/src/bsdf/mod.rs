//! The shading model: eval, sample and pdf of each lobe.
//!
//! glTF 2.0, Appendix B, with KHR_materials_{ior, specular, transmission, volume}:
//!
//! ```text
//! material   = mix(dielectric, metal, metallic)
//! metal      = GGX reflection, Schlick with F0 = base colour
//! dielectric = GGX coat over mix(diffuse base, transmission, transmission factor)
//! ```
//! - A file for each part: `layers` says how strong each lobe is, `diffuse`, `reflection` and `transmission`
//!   where it goes, `ggx` holds the microfacets, `albedo` their tabulated directional averages.
//! - α = roughness². Below a roughness of [`SMOOTH_ROUGHNESS`] mirror and glass are perfect (delta lobes).
//! - The diffuse base carries (1 − E(wo))(1 − E(wi))/(1 − E̅) instead of the appendix's 1 − F(V·H), E being the
//!   coat's directional albedo (Kelemen and Szirmay-Kalos, 2001). The appendix leaves the choice free; its own
//!   factor sends back up to 1.6 times the light received at grazing angles, this one exactly what the coat leaves.
//!   It is reciprocal, and a white dielectric vanishes in a white furnace at every roughness.
//! - Glass with a volume uses the exact Fresnel equations at its interface; everything else uses Schlick's.
//! - Single scattering: what bounces twice between microfacets is lost, of a white metal's light
//!   1.3 % at roughness 0.25, 12 % at 0.5, 34 % at 0.75, 59 % at 1; of white glass at most 1, 20 and 57 % at
//!   0.1, 0.5 and 1. Dielectrics over a diffuse base lose nothing: what the coat drops, the base takes up.

mod albedo;
mod diffuse;
mod ggx;
mod layers;
mod reflection;
mod sample;
#[cfg(test)]
mod tests;
mod transmission;

pub use layers::{Layers, SMOOTH_ROUGHNESS, Shading, is_index_matched};
pub use sample::{BsdfSample, Lobe};

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
        let (tangent, bitangent) = math::frame(normal);
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

    /// The Lambert part with its share under the coat: f in 1/sr.
    pub fn eval_diffuse(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let (cos_o, cos_i) = (wo.dot(self.normal), wi.dot(self.normal));
        if cos_o <= 0.0 || cos_i <= 0.0 || wi.dot(self.geometric) <= 0.0 {
            return Rgb::BLACK;
        }
        self.layers.diffuse.eval(cos_o, cos_i)
    }

    /// Rough reflection and rough transmission: f in 1/sr. Black where the lobes are delta.
    pub fn eval_glossy(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if self.layers.is_delta() || !self.layers.has_specular() {
            return Rgb::BLACK;
        }
        match self.sides(wo, wi) {
            Some((o, i, true)) => reflection::eval(&self.layers, o, i),
            Some((o, i, false)) => transmission::eval(&self.layers, o, i, self.transport),
            None => Rgb::BLACK,
        }
    }

    /// Share of a uniform light from all directions that the diffuse lobe sends to `wo`, [0, 1]:
    /// base colour · (1 − E(wo)). Under irradiance E it shines with `diffuse_albedo · E / π`.
    pub fn diffuse_albedo(&self, wo: Vec3) -> Rgb {
        self.layers.diffuse.albedo(wo.dot(self.normal))
    }

    /// The same averaged over the cosine-weighted hemisphere of `wo`, [0, 1]: the ρ of radiosity.
    pub fn diffuse_reflectance(&self) -> Rgb {
        self.layers.diffuse.reflectance()
    }

    /// Share of a uniform light from all directions that all other lobes together, delta ones included, send to
    /// `wo`, [0, 1]; an energy, without the η² of radiance. From a table (±0.005, ±0.012 within 2° of grazing); for
    /// rough glass with a volume a small quadrature (±0.04).
    pub fn specular_albedo(&self, wo: Vec3) -> Rgb {
        self.layers.specular_albedo(wo.dot(self.normal))
    }

    /// Width α of the GGX lobes, roughness²; 0 when they are delta.
    pub fn glossy_roughness(&self) -> f32 {
        self.layers.alpha()
    }

    /// Whether any light is reflected diffusely.
    pub fn has_diffuse(&self) -> bool {
        self.layers.diffuse.is_present()
    }

    /// Whether there is any lobe other than diffuse.
    pub fn has_specular(&self) -> bool {
        self.layers.has_specular()
    }

    /// Whether the lobes other than diffuse are perfect mirror and glass.
    pub fn is_delta(&self) -> bool {
        self.layers.is_delta()
    }

    /// Shading normal.
    pub fn normal(&self) -> Vec3 {
        self.normal
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
