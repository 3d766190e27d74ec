//! How strong each lobe of a material is: metal, coat, diffuse base, transmission.

use super::albedo;
use super::diffuse::Diffuse;
use crate::Rgb;
use crate::optics::{f0_from_ior, fresnel_dielectric, schlick};

/// Perceptual roughness below which mirror and glass are perfect: α = 9·10⁻⁴, a blur of 0.05°.
pub const SMOOTH_ROUGHNESS: f32 = 0.03;

/// An index this close to 1 bends nothing that one could see, yet makes rough refraction ill-conditioned.
const INDEX_MATCHED: f32 = 1e-3;

/// A material's parameters at one point, textures and vertex colours applied; factors as in glTF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading {
    /// Linear, [0, 1].
    pub base_color: Rgb,
    /// [0, 1].
    pub metallic: f32,
    /// Perceptual, [0, 1].
    pub roughness: f32,
    /// Index of refraction, > 0, relative to the outside; 0 means a Fresnel term of 1.
    pub ior: f32,
    /// Strength of the dielectric coat, [0, 1].
    pub specular: f32,
    /// Tint of the dielectric F0, ≥ 0.
    pub specular_color: Rgb,
    /// Share of the light below the coat that passes through instead of meeting the diffuse base, [0, 1].
    pub transmission: f32,
    /// Whether the surface bounds a volume and refracts; a thin wall otherwise.
    pub solid: bool,
}

impl Shading {
    /// Whether a ray passes straight on: smooth thin glass, or a volume with the index of its surroundings.
    pub fn is_straight(&self) -> bool {
        self.transmission > 0.0
            && self.metallic < 1.0
            && if self.solid { is_index_matched(self.ior) } else { self.roughness < SMOOTH_ROUGHNESS }
    }
}

/// Whether a volume of index `ior` bends nothing that one could see; it is then treated as smooth and straight.
pub fn is_index_matched(ior: f32) -> bool {
    (ior - 1.0).abs() < INDEX_MATCHED
}

impl Default for Shading {
    /// A white Lambertian surface: no coat, no metal, no transmission.
    fn default() -> Self {
        Shading {
            base_color: Rgb::WHITE,
            metallic: 0.0,
            roughness: 1.0,
            ior: 1.5,
            specular: 0.0,
            specular_color: Rgb::WHITE,
            transmission: 0.0,
            solid: false,
        }
    }
}

/// The lobes of one side of a surface: how much each carries, by the cosine to the microfacet's normal.
#[derive(Clone, Debug)]
pub struct Layers {
    /// The Lambertian base under the coat.
    pub(super) diffuse: Diffuse,
    /// GGX width; 0 for perfect lobes.
    alpha: f32,
    base_color: Rgb,
    metal: f32,
    /// Share of dielectric with Schlick's coat: all of it but solid glass.
    coat: f32,
    /// F0 of that coat.
    f0: Rgb,
    /// Strength of the coat and of the glass's reflection.
    specular: f32,
    specular_color: Rgb,
    thin: f32,
    solid: f32,
    /// n on wo's side over n on the other; 1 for a thin wall.
    eta: f32,
}

impl Layers {
    /// `front`: whether the path came from the outside.
    pub fn new(shading: &Shading, front: bool) -> Layers {
        let s = shading;
        let matched = is_index_matched(s.ior);
        let dielectric = 1.0 - s.metallic;
        // No index at all (KHR_materials_ior's 0) means that everything is reflected, so nothing gets in.
        let transmission = if s.ior > 0.0 { s.transmission } else { 0.0 };
        let solid = if s.solid { dielectric * transmission } else { 0.0 };
        let thin = if s.solid { 0.0 } else { dielectric * transmission };
        let smooth = s.roughness < SMOOTH_ROUGHNESS || (solid > 0.0 && matched);
        let alpha = if smooth { 0.0 } else { s.roughness * s.roughness };
        let eta = if solid == 0.0 || matched {
            1.0
        } else if front {
            1.0 / s.ior
        } else {
            s.ior
        };
        // Without a step of the index there is no interface to reflect; Schlick's formula would, at grazing angles.
        let specular = if s.ior == 1.0 { 0.0 } else { s.specular };
        let f0 = (s.specular_color * f0_from_ior(s.ior)).min(Rgb::WHITE);
        let base = s.base_color * (dielectric * (1.0 - transmission));
        Layers {
            diffuse: Diffuse::new(base, alpha, specular, f0.max_channel()),
            alpha,
            base_color: s.base_color,
            metal: s.metallic,
            coat: dielectric - solid,
            f0,
            specular,
            specular_color: s.specular_color,
            thin,
            solid,
            eta,
        }
    }

    /// GGX width; 0 for perfect lobes.
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// n on wo's side over n on the other; 1 when light does not bend.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// Whether transmitted light is refracted (a volume) rather than passed by a thin wall.
    pub fn refracts(&self) -> bool {
        self.solid > 0.0
    }

    /// Whether reflection and transmission are perfect.
    pub fn is_delta(&self) -> bool {
        self.alpha == 0.0
    }

    /// Whether there is any lobe other than diffuse.
    pub fn has_specular(&self) -> bool {
        // Schlick's term reaches 1 at grazing angles whatever F0, so only the strength decides.
        self.metal > 0.0 || self.specular * self.coat > 0.0 || self.thin + self.solid > 0.0
    }

    /// Share of the light on a microfacet that it reflects, [0, 1]; `cos`: from its normal to either direction.
    pub fn reflection(&self, cos: f32) -> Rgb {
        let mut sum = schlick(self.base_color, cos) * self.metal;
        sum += schlick(self.f0, cos) * (self.coat * self.specular);
        if self.solid > 0.0 {
            sum += self.glass(cos) * self.solid;
        }
        sum
    }

    /// Share of the light on a microfacet that it lets through, tinted, [0, 1]; without the η² of radiance.
    pub fn transmission(&self, cos: f32) -> Rgb {
        if self.solid > 0.0 {
            self.base_color * (self.solid * (1.0 - self.glass(cos).max_channel()))
        } else if self.thin > 0.0 {
            self.base_color * (self.thin * (1.0 - self.specular * schlick(self.f0, cos).max_channel()))
        } else {
            Rgb::BLACK
        }
    }

    /// Share of light from everywhere that reflection and transmission together send to `cos_o`.
    pub fn specular_albedo(&self, cos_o: f32) -> Rgb {
        if cos_o <= 0.0 || !self.has_specular() {
            return Rgb::BLACK;
        }
        let scattered = albedo::directional(self.alpha, cos_o);
        let mut sum = scattered.under_schlick(self.base_color) * self.metal;
        sum += scattered.under_schlick(self.f0) * (self.coat * self.specular);
        if self.thin > 0.0 {
            let reflected = self.specular * scattered.under_schlick(self.f0).max_channel();
            sum += self.base_color * (self.thin * (scattered.all - reflected));
        }
        if self.solid > 0.0 {
            let reflected = |cos| self.glass(cos) * self.solid;
            let passed = |cos| self.transmission(cos);
            sum += if self.is_delta() {
                reflected(cos_o) + passed(cos_o)
            } else {
                albedo::rough_glass(self.alpha, self.eta, cos_o, reflected, passed)
            };
        }
        sum
    }

    /// Fresnel reflectance of solid glass; the specular factors dim and tint it except where all is reflected.
    fn glass(&self, cos: f32) -> Rgb {
        let f = fresnel_dielectric(cos, self.eta);
        if f >= 1.0 { Rgb::WHITE } else { (self.specular_color * f).min(Rgb::WHITE) * self.specular }
    }
}

impl albedo::Directional {
    /// With Schlick's Fresnel term of the given F0.
    fn under_schlick(self, f0: Rgb) -> Rgb {
        f0.map(|f0| self.with_f0(f0))
    }
}
