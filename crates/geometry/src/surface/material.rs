//! What a material may do anywhere on its surface: asked once for a scene, so that nobody pays for what is not there.

use crate::bsdf::{SMOOTH_ROUGHNESS, is_wide};
use crate::optics::f0_from_ior;
use crate::{AlphaMode, Material, Volume};

impl Material {
    /// Whether any point of it may reflect diffusely, or let light through diffusely.
    pub fn may_be_diffuse(&self) -> bool {
        // What bounces between wide facets leaves a metal diffusely.
        let metal = self.metallic >= 1.0 && self.metallic_roughness_texture.is_none();
        let narrow = metal && !is_wide(self.roughness * self.roughness);
        let glass = self.transmission >= 1.0 && self.transmission_texture.is_none();
        let black = self.base_color.is_black() && self.specular == 0.0 && self.diffuse_transmission.is_none();
        !(narrow || glass || self.unlit || black)
    }

    /// Whether it has any of the lobes that only few materials have.
    pub fn has_lobes(&self) -> bool {
        self.clearcoat.is_some()
            || self.sheen.is_some()
            || self.anisotropy.is_some()
            || self.iridescence.is_some()
            || self.diffuse_transmission.is_some()
    }

    /// The least roughness of its lobes, textures left out of account: what decides whether it can focus light.
    pub fn sharpest_roughness(&self) -> f32 {
        let base = self.glossiness.map_or(self.roughness, |g| 1.0 - g);
        self.clearcoat.map_or(base, |c| c.roughness.min(base))
    }

    /// Whether some light may go straight on through it, so that a shadow ray must ask how much.
    pub fn may_pass_straight(&self) -> bool {
        self.alpha_mode != AlphaMode::Opaque || (self.may_transmit() && self.may_be_straight())
    }

    /// Whether it emits light into the scene.
    pub fn is_emissive(&self) -> bool {
        !self.unlit && !self.emissive.is_black()
    }

    /// Whether anywhere some lobe other than diffuse may carry more than `threshold` of the light, [0, 1], at normal
    /// incidence. The coat of glTF's default dielectric carries 0.04.
    pub fn has_specular(&self, threshold: f32) -> bool {
        if self.unlit {
            return false;
        }
        let coat = self.specular * (self.specular_color * f0_from_ior(self.ior)).max_channel().min(1.0);
        let metal = self.metallic * self.base_color.max_channel();
        let clearcoat = self.clearcoat.map_or(0.0, |c| 0.04 * c.strength);
        let film = self.iridescence.map_or(0.0, |f| f.share);
        coat.max(metal).max(self.transmission * (1.0 - self.metallic)).max(clearcoat).max(film) > threshold
    }

    /// Whether somewhere it may transmit light.
    pub fn may_transmit(&self) -> bool {
        // A texture can only lower metallic below its factor.
        let dielectric = self.metallic < 1.0 || self.metallic_roughness_texture.is_some();
        !self.unlit && self.transmission > 0.0 && dielectric
    }

    /// Whether somewhere its mirror or glass may be perfect.
    pub fn may_be_smooth(&self) -> bool {
        self.roughness < SMOOTH_ROUGHNESS
            || self.metallic_roughness_texture.is_some()
            || self.glossiness.is_some()
    }

    /// What it encloses: its volume, if light can get in.
    pub fn enclosed(&self) -> Option<Volume> {
        if self.may_transmit() { self.volume } else { None }
    }

    fn may_be_straight(&self) -> bool {
        match self.volume {
            None => self.may_be_smooth(),
            Some(_) => crate::bsdf::is_index_matched(self.ior),
        }
    }
}
