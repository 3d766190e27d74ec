//! Meshes, materials, textures and lights: plain data, metres, world space.

use crate::ies::Web;
use crate::lobes::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Sheen};
use crate::math::{Affine2, Mat3, Vec3};
use crate::{Mesh, Rgb, Sky, Texture};
use std::sync::Arc;

/// Index into [`Scene::materials`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// The world that light travels through. It holds no camera.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// All triangles.
    pub mesh: Mesh,
    /// Materials; every triangle names one.
    pub materials: Vec<Material>,
    /// Decoded images with their samplers.
    pub textures: Vec<Texture>,
    /// Punctual lights. Area lights are triangles whose material is emissive.
    pub lights: Vec<Light>,
    /// Light from beyond all triangles.
    pub sky: Option<Sky>,
}

/// glTF 2.0 metallic-roughness with the extensions we model; factors as in the file, emission in cd/m².
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file, or "material 3" when it has none.
    pub name: String,
    /// Base colour, linear, [0, 1].
    pub base_color: Rgb,
    /// Opacity of the base colour, [0, 1]; means something only when `alpha_mode` is not opaque.
    pub alpha: f32,
    /// sRGB colour and linear alpha, multiplied in.
    pub base_color_texture: Option<TextureRef>,
    /// [0, 1].
    pub metallic: f32,
    /// Perceptual roughness, [0, 1]; the GGX width is its square.
    pub roughness: f32,
    /// Roughness in green, metallic in blue, linear, multiplied in.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Emitted radiance, cd/m², emissive strength included.
    pub emissive: Rgb,
    /// sRGB, multiplied in.
    pub emissive_texture: Option<TextureRef>,
    /// Tangent-space normals, linear.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// Whether emission leaves both sides. Both sides always block and reflect.
    pub double_sided: bool,
    /// Shown at its base colour (in cd/m²), neither lit nor lighting anything (KHR_materials_unlit).
    pub unlit: bool,
    /// Index of refraction, ≥ 1 (KHR_materials_ior); 0 means a Fresnel term of 1, as that extension says.
    pub ior: f32,
    /// Strength of the dielectric specular lobe, [0, 1] (KHR_materials_specular).
    pub specular: f32,
    /// Linear strength in alpha, multiplied in.
    pub specular_texture: Option<TextureRef>,
    /// Tint of the dielectric F0, linear, ≥ 0 (KHR_materials_specular).
    pub specular_color: Rgb,
    /// sRGB, multiplied in.
    pub specular_color_texture: Option<TextureRef>,
    /// Share of the light entering the surface that is transmitted, [0, 1] (KHR_materials_transmission).
    pub transmission: f32,
    /// In red, linear, multiplied in.
    pub transmission_texture: Option<TextureRef>,
    /// Present when the surface bounds a volume and refracts; absent for a thin wall.
    pub volume: Option<Volume>,
    /// 20 over the Abbe number of the volume, ≥ 0; 0 for one that bends all colours alike (KHR_materials_dispersion).
    pub dispersion: f32,
    /// Where volumes overlap, that of the highest priority is there; of several the one of the highest index.
    pub priority: i32,
    /// Replaces the roughness by 1 − this · alpha of `specular_color_texture` (KHR_materials_pbrSpecularGlossiness).
    pub glossiness: Option<f32>,
    /// Diffuse light that comes through.
    pub diffuse_transmission: Option<DiffuseTransmission>,
    /// Brushed roughness.
    pub anisotropy: Option<Anisotropy>,
    /// A film that interferes.
    pub iridescence: Option<Iridescence>,
    /// Varnish.
    pub clearcoat: Option<Clearcoat>,
    /// Fuzz.
    pub sheen: Option<Sheen>,
}

impl Default for Material {
    /// glTF's default material: white, fully rough, fully metallic, opaque, one-sided.
    fn default() -> Self {
        Material {
            name: "default".into(),
            base_color: Rgb::WHITE,
            alpha: 1.0,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            emissive: Rgb::BLACK,
            emissive_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Rgb::WHITE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            volume: None,
            dispersion: 0.0,
            priority: 0,
            glossiness: None,
            diffuse_transmission: None,
            anisotropy: None,
            iridescence: None,
            clearcoat: None,
            sheen: None,
        }
    }
}

/// What alpha means (glTF 2.0, 3.9.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// Wholly there where alpha ≥ the cutoff, wholly absent elsewhere.
    Mask(f32),
    /// Alpha is the share of light that meets the surface; the rest goes straight on.
    Blend,
}

/// KHR_materials_volume: what lies behind a refracting surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Share of light left after `attenuation_distance`, (0, 1] in each channel.
    pub attenuation_color: Rgb,
    /// Metres; infinite for a clear volume.
    pub attenuation_distance: f32,
}

/// A texture as one material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Which of [`Mesh::uvs`].
    pub uv_set: u8,
    /// KHR_texture_transform, from the mesh's uv to the image's.
    pub transform: Affine2,
}

/// A lamp without extent (KHR_lights_punctual).
#[derive(Clone, Debug)]
pub struct Light {
    /// Name in the file.
    pub name: String,
    /// Colour times intensity: cd for lamps with a place, lx for directional.
    pub intensity: Rgb,
    /// Which kind, and where.
    pub kind: LightKind,
}

/// The three kinds of KHR_lights_punctual, and measured lamps. Directions are unit and point the way the light travels.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// Shines alike in all directions.
    Point {
        /// Where it is.
        position: Vec3,
        /// Beyond this it does not reach, m; infinite when the file has none.
        range: f32,
    },
    /// A cone of light with a soft rim.
    Spot {
        /// Where it is.
        position: Vec3,
        /// Axis of the cone.
        direction: Vec3,
        /// Cosine of the angle from the axis where the fall-off begins.
        cos_inner: f32,
        /// Cosine of the angle where it ends.
        cos_outer: f32,
        /// Beyond this it does not reach, m.
        range: f32,
    },
    /// A lamp as its maker measured it (EXT_lights_ies); the light's intensity is the greatest of its directions.
    Photometric {
        /// Where it is.
        position: Vec3,
        /// From directions in the world to those of the table: a rotation.
        turn: Mat3,
        /// Beyond this it does not reach, m.
        range: f32,
        /// Its intensity by direction.
        web: Arc<Web>,
    },
    /// Parallel light from infinitely far.
    Directional {
        /// The way it travels.
        direction: Vec3,
    },
}
