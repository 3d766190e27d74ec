//! A material's parameters at one point, as the shading model takes them.

use super::ggx::SMOOTH_ROUGHNESS;
use crate::Rgb;
use crate::math::Vec3;

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
    /// Strength in [0, 1] and direction in world space, along the brush, of roughness that differs around the normal
    /// (KHR_materials_anisotropy).
    pub anisotropy: Option<(f32, Vec3)>,
    /// A film that interferes (KHR_materials_iridescence).
    pub film: Option<Film>,
    /// Diffuse light that comes through (KHR_materials_diffuse_transmission).
    pub translucency: Option<Translucency>,
    /// A clear layer over everything (KHR_materials_clearcoat).
    pub clearcoat: Option<Clearcoat>,
    /// The fuzz of cloth (KHR_materials_sheen).
    pub sheen: Option<Sheen>,
}

/// A thin film on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Share of the surface that has it, [0, 1].
    pub share: f32,
    /// Its index of refraction, ≥ 1.
    pub ior: f32,
    /// Its thickness, nm.
    pub thickness: f32,
}

/// Paper, leaves, lampshades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Translucency {
    /// Share of the diffuse light that leaves on the other side, [0, 1].
    pub share: f32,
    /// Its colour, linear, [0, 1].
    pub color: Rgb,
}

/// A layer of varnish, of index 1.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearcoat {
    /// [0, 1].
    pub strength: f32,
    /// Perceptual, [0, 1].
    pub roughness: f32,
    /// Its own shading normal, unit, in world space, on the viewer's side.
    pub normal: Vec3,
}

/// Fibres that stand out of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Linear, [0, 1].
    pub color: Rgb,
    /// Perceptual, [0, 1].
    pub roughness: f32,
}

impl Shading {
    /// A white Lambertian surface: no coat, no metal, no transmission.
    pub const LAMBERT: Shading = Shading {
        base_color: Rgb::WHITE,
        metallic: 0.0,
        roughness: 1.0,
        ior: 1.5,
        specular: 0.0,
        specular_color: Rgb::WHITE,
        transmission: 0.0,
        solid: false,
        anisotropy: None,
        film: None,
        translucency: None,
        clearcoat: None,
        sheen: None,
    };

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
    fn default() -> Self {
        Shading::LAMBERT
    }
}
