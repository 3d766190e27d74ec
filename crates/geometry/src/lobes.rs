//! What only few materials have: clearcoat, sheen, anisotropy, iridescence, diffuse transmission; as in the file.

use crate::{Rgb, TextureRef};

/// A clear layer over everything else (KHR_materials_clearcoat).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearcoat {
    /// [0, 1].
    pub strength: f32,
    /// In red, linear, multiplied in.
    pub strength_texture: Option<TextureRef>,
    /// Perceptual, [0, 1].
    pub roughness: f32,
    /// In green, linear, multiplied in.
    pub roughness_texture: Option<TextureRef>,
    /// Tangent-space normals of the coat alone; without them it is as smooth as the mesh.
    pub normal_texture: Option<TextureRef>,
    /// Scale of their x and y.
    pub normal_scale: f32,
}

/// The fuzz of cloth (KHR_materials_sheen).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Linear, [0, 1].
    pub color: Rgb,
    /// sRGB, multiplied in.
    pub color_texture: Option<TextureRef>,
    /// Perceptual, [0, 1].
    pub roughness: f32,
    /// In alpha, linear, multiplied in.
    pub roughness_texture: Option<TextureRef>,
}

/// Roughness that differs with the direction, as on brushed metal (KHR_materials_anisotropy).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    /// [0, 1].
    pub strength: f32,
    /// From the tangent, counter-clockwise, radians.
    pub rotation: f32,
    /// Direction in red and green, strength in blue, linear.
    pub texture: Option<TextureRef>,
}

/// A film thin enough to interfere (KHR_materials_iridescence).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    /// Share of the surface that has it, [0, 1].
    pub share: f32,
    /// In red, linear, multiplied in.
    pub share_texture: Option<TextureRef>,
    /// Index of refraction, ≥ 1.
    pub ior: f32,
    /// Thickness in nm where the texture is 0, and where it is 1 or absent.
    pub thickness: [f32; 2],
    /// In green, linear.
    pub thickness_texture: Option<TextureRef>,
}

/// Diffuse light that leaves on the other side (KHR_materials_diffuse_transmission).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Share of the diffuse light, [0, 1].
    pub share: f32,
    /// In alpha, linear, multiplied in.
    pub share_texture: Option<TextureRef>,
    /// Linear, [0, 1].
    pub color: Rgb,
    /// sRGB, multiplied in.
    pub color_texture: Option<TextureRef>,
}
