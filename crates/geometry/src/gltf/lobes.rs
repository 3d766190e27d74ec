//! The material extensions that the gltf crate does not know: clearcoat, sheen and the like, from plain JSON.

use gltf::json;
use serde_json::{Map, Value};

use super::error::Error;
use super::materials::Reader;
use crate::Rgb;
use crate::lobes::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Sheen};
use crate::scene::{Material, TextureRef};

impl Reader<'_> {
    /// Fills in what `extensions` of the material say.
    pub(super) fn lobes(&mut self, m: &mut Material, extensions: &Map<String, Value>) -> Result<(), Error> {
        for (name, value) in extensions {
            let e = Extension { at: format!("extensions.{name}"), value };
            match name.as_str() {
                "KHR_materials_clearcoat" => m.clearcoat = self.clearcoat(&e)?,
                "KHR_materials_sheen" => m.sheen = self.sheen(&e)?,
                "KHR_materials_anisotropy" => m.anisotropy = self.anisotropy(&e)?,
                "KHR_materials_iridescence" => m.iridescence = self.iridescence(&e)?,
                "KHR_materials_diffuse_transmission" => m.diffuse_transmission = self.translucency(&e)?,
                "KHR_materials_dispersion" => m.dispersion = self.dispersion(&e)?,
                "KHR_materials_pbrSpecularGlossiness" => self.specular_glossiness(m, &e)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn clearcoat(&mut self, e: &Extension) -> Result<Option<Clearcoat>, Error> {
        let coat = Clearcoat {
            strength: self.share(e, "clearcoatFactor", 0.0)?,
            strength_texture: self.map(e, "clearcoatTexture")?,
            roughness: self.share(e, "clearcoatRoughnessFactor", 0.0)?,
            roughness_texture: self.map(e, "clearcoatRoughnessTexture")?,
            normal_texture: self.map(e, "clearcoatNormalTexture")?,
            normal_scale: match e.value.get("clearcoatNormalTexture").and_then(|t| t.get("scale")) {
                Some(scale) => self.number(&format!("{}.clearcoatNormalTexture.scale", e.at), scale)?,
                None => 1.0,
            },
        };
        Ok((coat.strength > 0.0).then_some(coat))
    }

    fn sheen(&mut self, e: &Extension) -> Result<Option<Sheen>, Error> {
        let sheen = Sheen {
            color: self.tint(e, "sheenColorFactor", Rgb::BLACK)?,
            color_texture: self.map(e, "sheenColorTexture")?,
            roughness: self.share(e, "sheenRoughnessFactor", 0.0)?,
            roughness_texture: self.map(e, "sheenRoughnessTexture")?,
        };
        Ok((!sheen.color.is_black()).then_some(sheen))
    }

    fn anisotropy(&mut self, e: &Extension) -> Result<Option<Anisotropy>, Error> {
        let rotation = match e.value.get("anisotropyRotation") {
            Some(v) => self.number(&format!("{}.anisotropyRotation", e.at), v)?,
            None => 0.0,
        };
        let strength = self.share(e, "anisotropyStrength", 0.0)?;
        let texture = self.map(e, "anisotropyTexture")?;
        Ok((strength > 0.0).then_some(Anisotropy { strength, rotation, texture }))
    }

    fn iridescence(&mut self, e: &Extension) -> Result<Option<Iridescence>, Error> {
        let mut positive = |key: &str, default: f32, least: f32| match e.value.get(key) {
            None => Ok(default),
            Some(v) => {
                let at = format!("{}.{key}", e.at);
                let v = self.number(&at, v)?;
                self.at_least(&at, v, least)
            }
        };
        let ior = positive("iridescenceIor", 1.3, 1.0)?;
        let thickness = [
            positive("iridescenceThicknessMinimum", 100.0, 0.0)?,
            positive("iridescenceThicknessMaximum", 400.0, 0.0)?,
        ];
        let film = Iridescence {
            share: self.share(e, "iridescenceFactor", 0.0)?,
            share_texture: self.map(e, "iridescenceTexture")?,
            ior,
            thickness,
            thickness_texture: self.map(e, "iridescenceThicknessTexture")?,
        };
        Ok((film.share > 0.0).then_some(film))
    }

    /// 20 over the Abbe number, ≥ 0.
    fn dispersion(&mut self, e: &Extension) -> Result<f32, Error> {
        let Some(v) = e.value.get("dispersion") else { return Ok(0.0) };
        let at = format!("{}.dispersion", e.at);
        let v = self.number(&at, v)?;
        self.at_least(&at, v, 0.0)
    }

    fn translucency(&mut self, e: &Extension) -> Result<Option<DiffuseTransmission>, Error> {
        let through = DiffuseTransmission {
            share: self.share(e, "diffuseTransmissionFactor", 0.0)?,
            share_texture: self.map(e, "diffuseTransmissionTexture")?,
            color: self.tint(e, "diffuseTransmissionColorFactor", Rgb::WHITE)?,
            color_texture: self.map(e, "diffuseTransmissionColorTexture")?,
        };
        Ok((through.share > 0.0).then_some(through))
    }

    /// KHR_materials_pbrSpecularGlossiness, which replaces metallic-roughness where a file has both: a dielectric whose
    /// F0 is the specular colour. An index of 0 makes that colour all of F0.
    fn specular_glossiness(&mut self, m: &mut Material, e: &Extension) -> Result<(), Error> {
        let diffuse = e.numbers("diffuseFactor");
        let at = format!("{}.diffuseFactor", e.at);
        let mut channel = |k: usize| match diffuse.and_then(|d| d.get(k)) {
            None => Ok(1.0),
            Some(v) => {
                let v = self.number(&at, v)?;
                self.unit(&at, v)
            }
        };
        (m.base_color, m.alpha) = (Rgb::new(channel(0)?, channel(1)?, channel(2)?), channel(3)?);
        m.base_color_texture = self.map(e, "diffuseTexture")?;
        (m.metallic, m.metallic_roughness_texture) = (0.0, None);
        (m.ior, m.specular, m.specular_texture) = (0.0, 1.0, None);
        m.specular_color = self.tint(e, "specularFactor", Rgb::WHITE)?;
        m.specular_color_texture = self.map(e, "specularGlossinessTexture")?;
        let glossiness = self.share(e, "glossinessFactor", 1.0)?;
        m.roughness = 1.0 - glossiness;
        m.glossiness = m.specular_color_texture.is_some().then_some(glossiness);
        Ok(())
    }

    /// A number in [0, 1].
    fn share(&mut self, e: &Extension, key: &str, default: f32) -> Result<f32, Error> {
        let Some(v) = e.value.get(key) else { return Ok(default) };
        let at = format!("{}.{key}", e.at);
        let v = self.number(&at, v)?;
        self.unit(&at, v)
    }

    /// A colour in [0, 1].
    fn tint(&mut self, e: &Extension, key: &str, default: Rgb) -> Result<Rgb, Error> {
        let Some(value) = e.value.get(key) else { return Ok(default) };
        let at = format!("{}.{key}", e.at);
        let Some([r, g, b]) = e.numbers(key).filter(|n| n.len() == 3).map(|n| [&n[0], &n[1], &n[2]]) else {
            return Err(self.fault(&at, value, "not a colour of three numbers"));
        };
        let mut channel = |v: &Value| {
            let v = self.number(&at, v)?;
            self.unit(&at, v)
        };
        Ok(Rgb::new(channel(r)?, channel(g)?, channel(b)?))
    }

    fn number(&self, at: &str, value: &Value) -> Result<f32, Error> {
        let v = value.as_f64().ok_or_else(|| self.fault(at, value, "not a number"))?;
        self.finite(at, v as f32)
    }

    /// A reference to a texture.
    fn map(&mut self, e: &Extension, key: &str) -> Result<Option<TextureRef>, Error> {
        let Some(value) = e.value.get(key) else { return Ok(None) };
        let at = format!("{}.{key}", e.at);
        let info: Result<json::texture::Info, _> = json::deserialize::from_value(value.clone());
        let info = info.map_err(|problem| self.fault(&at, value, problem))?;
        self.texture(&at, &Some(info))
    }
}

/// One extension of a material.
struct Extension<'a> {
    /// Its path below the material.
    at: String,
    value: &'a Value,
}

impl Extension<'_> {
    fn numbers(&self, key: &str) -> Option<&Vec<Value>> {
        self.value.get(key)?.as_array()
    }
}
