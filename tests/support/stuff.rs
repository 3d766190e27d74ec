//! Materials by what they do.

use geometry::{Material, Rgb, Volume};

/// A volume that absorbs nothing.
pub const CLEAR: Volume = Volume { attenuation_color: Rgb::WHITE, attenuation_distance: f32::INFINITY };

/// Lambertian of reflectance `rho`, no coat.
pub fn matt(rho: f32) -> Material {
    tinted(Rgb::splat(rho))
}

/// Lambertian, reflectance by channel.
pub fn tinted(rho: Rgb) -> Material {
    Material { base_color: rho, metallic: 0.0, specular: 0.0, ..Material::default() }
}

/// Shines `radiance` (cd/m²) from its front and reflects nothing.
pub fn lamp(radiance: f32) -> Material {
    glowing(radiance, 0.0)
}

/// Shines `radiance` (cd/m²) from its front and reflects `rho`.
pub fn glowing(radiance: f32, rho: f32) -> Material {
    Material { emissive: Rgb::splat(radiance), ..matt(rho) }
}

/// A metal of reflectance `f0` at normal incidence; `roughness` 0 is a perfect mirror. At grazing angles Schlick's
/// term brings it to 1.
pub fn metal(f0: f32, roughness: f32) -> Material {
    Material { base_color: Rgb::splat(f0), metallic: 1.0, roughness, ..Material::default() }
}

/// Smooth glass of index `ior`: a thin pane without `volume`, refracting with one.
pub fn glass(ior: f32, volume: Option<Volume>) -> Material {
    Material { metallic: 0.0, roughness: 0.0, transmission: 1.0, ior, volume, ..Material::default() }
}
