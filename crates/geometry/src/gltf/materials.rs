//! Materials: factors checked and clamped, textures by their number in the file.

use gltf::json;
use gltf::json::material::AlphaMode as Mode;
use gltf::json::validation::Checked;
use serde_json::{Map, Value};

use super::document::Document;
use super::error::Error;
use super::extensions;
use super::warnings::Warnings;
use crate::Rgb;
use crate::math::{Affine2, Vec2};
use crate::scene::{AlphaMode, Material, TextureRef, Volume};

/// All materials of the file. Each [`TextureRef::texture`] is still an index into the *file's* textures.
pub(super) fn read_all(document: &Document, warnings: &mut Warnings) -> Result<Vec<Material>, Error> {
    let materials = document.root.materials.iter().enumerate();
    materials
        .map(|(i, material)| Reader { document, warnings, at: format!("materials[{i}]") }.read(i, material))
        .collect()
}

/// Every place where a material may refer to a texture.
pub(super) fn texture_refs(m: &mut Material) -> Vec<&mut Option<TextureRef>> {
    let mut all = vec![
        &mut m.base_color_texture,
        &mut m.metallic_roughness_texture,
        &mut m.emissive_texture,
        &mut m.normal_texture,
        &mut m.specular_texture,
        &mut m.specular_color_texture,
        &mut m.transmission_texture,
    ];
    if let Some(c) = &mut m.clearcoat {
        all.extend([&mut c.strength_texture, &mut c.roughness_texture, &mut c.normal_texture]);
    }
    if let Some(s) = &mut m.sheen {
        all.extend([&mut s.color_texture, &mut s.roughness_texture]);
    }
    if let Some(a) = &mut m.anisotropy {
        all.push(&mut a.texture);
    }
    if let Some(i) = &mut m.iridescence {
        all.extend([&mut i.share_texture, &mut i.thickness_texture]);
    }
    if let Some(t) = &mut m.diffuse_transmission {
        all.extend([&mut t.share_texture, &mut t.color_texture]);
    }
    all
}

/// The uv set along which the tangents of a material's meshes run; `None` where it needs none.
pub(super) fn tangent_set(m: &Material) -> Option<u8> {
    let coat = m.clearcoat.and_then(|c| c.normal_texture);
    let brushed = m.anisotropy.map(|a| a.texture.map_or(0, |t| t.uv_set));
    m.normal_texture.or(coat).map(|t| t.uv_set).or(brushed)
}

/// Reads one material.
pub(super) struct Reader<'a> {
    pub document: &'a Document,
    pub warnings: &'a mut Warnings,
    /// Path of the material.
    pub at: String,
}

impl Reader<'_> {
    fn read(&mut self, i: usize, json: &json::Material) -> Result<Material, Error> {
        let pbr = &json.pbr_metallic_roughness;
        let [r, g, b, a] = pbr.base_color_factor.0;
        let color = "pbrMetallicRoughness.baseColorFactor";
        let mut m = Material {
            name: json.name.clone().unwrap_or_else(|| format!("material {i}")),
            base_color: Rgb::new(self.unit(color, r)?, self.unit(color, g)?, self.unit(color, b)?),
            alpha: self.unit(color, a)?,
            base_color_texture: self
                .texture("pbrMetallicRoughness.baseColorTexture", &pbr.base_color_texture)?,
            metallic: self.unit("pbrMetallicRoughness.metallicFactor", pbr.metallic_factor.0)?,
            roughness: self.unit("pbrMetallicRoughness.roughnessFactor", pbr.roughness_factor.0)?,
            metallic_roughness_texture: self
                .texture("pbrMetallicRoughness.metallicRoughnessTexture", &pbr.metallic_roughness_texture)?,
            emissive_texture: self.texture("emissiveTexture", &json.emissive_texture)?,
            double_sided: json.double_sided,
            ..Material::default()
        };
        m.emissive = self.color("emissiveFactor", json.emissive_factor.0)?;
        if m.emissive.max_channel() > 1.0 {
            // Old exporters wrote light levels here, and every viewer shows them: to clamp would put out lamps.
            let text = "materials with an emissiveFactor above glTF's 1, kept as it is";
            self.warnings.count(text, format!("\"{}\"", m.name), 1);
        }
        if let Some(normal) = &json.normal_texture {
            let transform = normal.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
            let transform =
                transform.map(|value| self.parse_transform("normalTexture", value)).transpose()?;
            m.normal_texture =
                self.reference("normalTexture", normal.index, normal.tex_coord, transform.as_ref())?;
            m.normal_scale = self.finite("normalTexture.scale", normal.scale)?;
        }
        m.alpha_mode = match json.alpha_mode {
            Checked::Valid(Mode::Opaque) => AlphaMode::Opaque,
            Checked::Valid(Mode::Blend) => AlphaMode::Blend,
            Checked::Valid(Mode::Mask) => {
                AlphaMode::Mask(self.at_least("alphaCutoff", json.alpha_cutoff.map_or(0.5, |c| c.0), 0.0)?)
            }
            Checked::Invalid => return Err(self.fault("alphaMode", "?", "must be OPAQUE, MASK or BLEND")),
        };
        m.priority = self.priority(json)?;
        if let Some(extensions) = &json.extensions {
            self.extend(&mut m, extensions)?;
        }
        Ok(m)
    }

    fn extend(&mut self, m: &mut Material, e: &json::extensions::material::Material) -> Result<(), Error> {
        m.unlit = e.unlit.is_some();
        if let Some(e) = &e.emissive_strength {
            let at = "extensions.KHR_materials_emissive_strength.emissiveStrength";
            m.emissive *= self.at_least(at, e.emissive_strength.0, 0.0)?;
        }
        if let Some(e) = &e.ior {
            // 0 is legal: a Fresnel term of 1.
            let at = "extensions.KHR_materials_ior.ior";
            m.ior = if e.ior.0 == 0.0 { 0.0 } else { self.at_least(at, e.ior.0, 1.0)? };
        }
        if let Some(e) = &e.specular {
            let at = "extensions.KHR_materials_specular";
            m.specular = self.unit(&format!("{at}.specularFactor"), e.specular_factor.0)?;
            m.specular_texture = self.texture(&format!("{at}.specularTexture"), &e.specular_texture)?;
            m.specular_color = self.color(&format!("{at}.specularColorFactor"), e.specular_color_factor.0)?;
            m.specular_color_texture =
                self.texture(&format!("{at}.specularColorTexture"), &e.specular_color_texture)?;
        }
        if let Some(e) = &e.transmission {
            let at = "extensions.KHR_materials_transmission";
            m.transmission = self.unit(&format!("{at}.transmissionFactor"), e.transmission_factor.0)?;
            m.transmission_texture =
                self.texture(&format!("{at}.transmissionTexture"), &e.transmission_texture)?;
        }
        if let Some(e) = &e.volume {
            m.volume = self.volume(e)?;
        }
        self.lobes(m, &e.others)?;
        if m.diffuse_transmission.is_some() && e.volume.is_some() && m.transmission == 0.0 {
            let text = "materials shown as thin sheets: light scattered within their volume is not modelled";
            self.warnings.count(text, format!("\"{}\"", m.name), 1);
        }
        self.warn_of_others(&m.name, &e.others);
        Ok(())
    }

    /// `extras.priority`, which says what is there where volumes overlap: glTF has no word of its own for it. Extras are
    /// anybody's, so that what is no object says nothing.
    fn priority(&self, json: &json::Material) -> Result<i32, Error> {
        let extras = json.extras.as_ref().and_then(|e| json::deserialize::from_str::<Value>(e.get()).ok());
        let Some(priority) = extras.as_ref().and_then(|e| e.get("priority")) else { return Ok(0) };
        let number = priority.as_i64().and_then(|n| i32::try_from(n).ok());
        number.ok_or_else(|| self.fault("extras.priority", priority, "not an integer"))
    }

    /// None for a thickness of 0, which means a thin wall. Otherwise the mesh itself says how thick it is.
    fn volume(&mut self, e: &json::extensions::material::Volume) -> Result<Option<Volume>, Error> {
        let at = "extensions.KHR_materials_volume";
        if self.at_least(&format!("{at}.thicknessFactor"), e.thickness_factor.0, 0.0)? == 0.0 {
            return Ok(None);
        }
        let color = self.color(&format!("{at}.attenuationColor"), e.attenuation_color.0)?;
        let distance = e.attenuation_distance.0;
        if distance.is_nan() {
            return Err(self.fault(&format!("{at}.attenuationDistance"), distance, "not a number"));
        }
        let attenuation_distance = if distance > 0.0 {
            distance
        } else {
            self.clamped(&format!("{at}.attenuationDistance"), distance, f32::INFINITY);
            f32::INFINITY
        };
        // The logarithm of the colour is the absorption: 0 would absorb all within no distance.
        Ok(Some(Volume { attenuation_color: color.map(|c| c.clamp(1e-6, 1.0)), attenuation_distance }))
    }

    fn warn_of_others(&mut self, name: &str, others: &Map<String, Value>) {
        for extension in others.keys().filter(|key| !extensions::is_modelled(key)) {
            let text = format!("materials shown without {extension}, which is not modelled");
            self.warnings.count(text, format!("\"{name}\""), 1);
        }
    }

    pub(super) fn texture(
        &mut self,
        at: &str,
        info: &Option<json::texture::Info>,
    ) -> Result<Option<TextureRef>, Error> {
        let Some(info) = info else { return Ok(None) };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        self.reference(at, info.index, info.tex_coord, transform)
    }

    pub(super) fn reference(
        &mut self,
        at: &str,
        index: json::Index<json::Texture>,
        tex_coord: u32,
        transform: Option<&json::extensions::texture::TextureTransform>,
    ) -> Result<Option<TextureRef>, Error> {
        let i = index.value();
        if i >= self.document.root.textures.len() {
            return Err(self.fault(&format!("{at}.index"), i, "there is no texture of this number"));
        }
        let set = transform.and_then(|t| t.tex_coord).unwrap_or(tex_coord);
        if set > 1 {
            let text = "textures left out: they use a uv set beyond TEXCOORD_1";
            self.warnings.count(text, format!("{}.{at}", self.at), 1);
            return Ok(None);
        }
        let transform = match transform {
            None => Affine2::IDENTITY,
            Some(t) => {
                let [offset, scale] = [t.offset.0, t.scale.0].map(Vec2::from_array);
                // KHR_texture_transform turns u, v the way that is counter-clockwise with v pointing down.
                let m = Affine2::from_scale_angle_translation(scale, -t.rotation.0, offset);
                if !m.is_finite() {
                    return Err(self.fault(
                        &format!("{at}.extensions.KHR_texture_transform"),
                        m,
                        "not finite",
                    ));
                }
                m
            }
        };
        Ok(Some(TextureRef { texture: i as u32, uv_set: set as u8, transform }))
    }

    /// Only normal textures need this: there the gltf crate leaves the extension as plain JSON.
    pub(super) fn parse_transform(
        &self,
        at: &str,
        value: &Value,
    ) -> Result<json::extensions::texture::TextureTransform, Error> {
        let parsed = json::deserialize::from_value(value.clone());
        parsed.map_err(|e| self.fault(&format!("{at}.extensions.KHR_texture_transform"), value, e))
    }

    /// `v`, clamped to [0, 1] with a warning.
    pub(super) fn unit(&mut self, at: &str, v: f32) -> Result<f32, Error> {
        let clamped = self.finite(at, v)?.clamp(0.0, 1.0);
        if clamped != v {
            self.clamped(at, v, clamped);
        }
        Ok(clamped)
    }

    /// `v`, raised to `low` with a warning.
    pub(super) fn at_least(&mut self, at: &str, v: f32, low: f32) -> Result<f32, Error> {
        let raised = self.finite(at, v)?.max(low);
        if raised != v {
            self.clamped(at, v, raised);
        }
        Ok(raised)
    }

    pub(super) fn color(&mut self, at: &str, [r, g, b]: [f32; 3]) -> Result<Rgb, Error> {
        Ok(Rgb::new(self.at_least(at, r, 0.0)?, self.at_least(at, g, 0.0)?, self.at_least(at, b, 0.0)?))
    }

    pub(super) fn finite(&self, at: &str, v: f32) -> Result<f32, Error> {
        if v.is_finite() { Ok(v) } else { Err(self.fault(at, v, "not a finite number")) }
    }

    fn clamped(&mut self, at: &str, v: f32, to: f32) {
        self.warnings.say(format!("{}.{at}: {v} is out of range and taken as {to}", self.at));
    }

    pub(super) fn fault(
        &self,
        at: &str,
        value: impl std::fmt::Display,
        problem: impl std::fmt::Display,
    ) -> Error {
        self.document.fault(format_args!("{}.{at}", self.at), value, problem)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(json: &str) -> Result<(Material, Vec<String>), String> {
        let document = Document::for_test(&format!(r#""textures":[{{}}],"materials":[{json}]"#), Vec::new());
        let mut warnings = Warnings::default();
        let mut all = read_all(&document, &mut warnings).map_err(|e| e.to_string())?;
        Ok((all.remove(0), warnings.into_lines()))
    }

    #[test]
    fn extensions_reach_the_material() {
        let json = r#"{"emissiveFactor":[1,0.5,0],"alphaMode":"MASK","extensions":{
            "KHR_materials_emissive_strength":{"emissiveStrength":20},"KHR_materials_ior":{"ior":1.33},
            "KHR_materials_specular":{"specularFactor":0.25,"specularColorFactor":[2,1,1]},
            "KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_unlit":{},
            "KHR_materials_volume":{"thicknessFactor":0.1,"attenuationDistance":2,"attenuationColor":[1,0,0.5]}}}"#;
        let (m, warnings) = material(json).expect("valid");
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!((m.emissive, m.ior, m.specular, m.unlit), (Rgb::new(20.0, 10.0, 0.0), 1.33, 0.25, true));
        assert_eq!((m.specular_color.r, m.transmission, m.alpha_mode), (2.0, 1.0, AlphaMode::Mask(0.5)));
        let volume = m.volume.expect("thick");
        assert_eq!((volume.attenuation_distance, volume.attenuation_color.g), (2.0, 1e-6));
        let thin = r#"{"extensions":{"KHR_materials_volume":{}}}"#;
        assert!(material(thin).expect("valid").0.volume.is_none());
    }

    #[test]
    fn lobes_of_plain_json_reach_the_material() {
        let json = r#"{"extensions":{
            "KHR_materials_clearcoat":{"clearcoatFactor":1,"clearcoatRoughnessFactor":0.2,"clearcoatNormalTexture":{"index":0,"scale":0.5}},
            "KHR_materials_sheen":{"sheenColorFactor":[1,0.5,0],"sheenRoughnessFactor":0.3},
            "KHR_materials_anisotropy":{"anisotropyStrength":0.6,"anisotropyRotation":1.5},
            "KHR_materials_iridescence":{"iridescenceFactor":1,"iridescenceThicknessMaximum":250},
            "KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.4,"diffuseTransmissionTexture":{"index":0,"texCoord":1}}}}"#;
        let (mut m, warnings) = material(json).expect("valid");
        assert!(warnings.is_empty(), "{warnings:?}");
        let coat = m.clearcoat.expect("varnished");
        assert_eq!((coat.strength, coat.roughness, coat.normal_scale), (1.0, 0.2, 0.5));
        assert_eq!(m.sheen.expect("fuzzy").color, Rgb::new(1.0, 0.5, 0.0));
        assert_eq!(m.anisotropy.map(|a| (a.strength, a.rotation)), Some((0.6, 1.5)));
        assert_eq!(m.iridescence.map(|f| (f.ior, f.thickness)), Some((1.3, [100.0, 250.0])));
        assert_eq!(m.diffuse_transmission.map(|t| (t.share, t.color)), Some((0.4, Rgb::WHITE)));
        assert_eq!((texture_refs(&mut m).into_iter().flatten().count(), tangent_set(&m)), (2, Some(0)));
        // Without strength a lobe is not there, and nobody looks it up.
        let none = r#"{"extensions":{"KHR_materials_clearcoat":{},"KHR_materials_sheen":{},"KHR_materials_iridescence":{}}}"#;
        assert!(!material(none).expect("valid").0.has_lobes());
        let wrong = r#"{"extensions":{"KHR_materials_sheen":{"sheenColorFactor":[1,"x",0]}}}"#;
        assert!(material(wrong).is_err_and(|e| e.contains("KHR_materials_sheen.sheenColorFactor")));
    }

    #[test]
    fn specular_glossiness_is_a_dielectric_of_any_f0() {
        let json = r#"{"pbrMetallicRoughness":{"metallicFactor":1},"extensions":{"KHR_materials_pbrSpecularGlossiness":{
            "diffuseFactor":[0.5,0.4,0.3,0.9],"specularFactor":[0.9,0.6,0.2],"glossinessFactor":0.7}}}"#;
        let (m, _) = material(json).expect("valid");
        assert_eq!((m.metallic, m.ior, m.alpha, m.glossiness), (0.0, 0.0, 0.9, None));
        assert_eq!((m.base_color, m.specular_color), (Rgb::new(0.5, 0.4, 0.3), Rgb::new(0.9, 0.6, 0.2)));
        assert!((m.roughness - 0.3).abs() < 1e-6);
    }

    #[test]
    fn factors_out_of_range_are_clamped_and_said() {
        let (m, warnings) =
            material(r#"{"pbrMetallicRoughness":{"roughnessFactor":-5,"baseColorFactor":[2,1,1,1]}}"#)
                .expect("valid");
        assert_eq!((m.roughness, m.base_color), (0.0, Rgb::WHITE));
        assert!(warnings[0].contains("materials[0].pbrMetallicRoughness.baseColorFactor: 2"), "{warnings:?}");
        let message = material(r#"{"pbrMetallicRoughness":{"metallicFactor":1e39}}"#).expect_err("infinite");
        assert!(message.contains("materials[0].pbrMetallicRoughness.metallicFactor = inf"), "{message}");
        assert!(material(r#"{"alphaMode":"SOME"}"#).is_err());
    }

    #[test]
    fn what_is_not_modelled_is_named() {
        let (_, warnings) =
            material(r#"{"name":"Car","extensions":{"ACME_materials_rust":{}}}"#).expect("valid");
        assert!(warnings[0].contains("\"Car\"") && warnings[0].contains("ACME_materials_rust"));
    }

    #[test]
    fn texture_transforms_apply_in_the_order_scale_rotate_shift() {
        let transform = r#""extensions":{"KHR_texture_transform":{"offset":[1,0],"rotation":1.5707964,"scale":[2,3],"texCoord":1}}"#;
        let json = format!(
            r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,{transform}}}}},"normalTexture":{{"index":0,{transform}}}}}"#
        );
        let (m, _) = material(&json).expect("valid");
        for texture in [m.base_color_texture, m.normal_texture] {
            let texture = texture.expect("kept");
            assert_eq!(texture.uv_set, 1);
            // (1, 1) scaled is (2, 3); turned (u cos + v sin, −u sin + v cos) = (3, −2); shifted (4, −2).
            assert!((texture.transform.transform_point2(Vec2::ONE) - Vec2::new(4.0, -2.0)).length() < 1e-5);
        }
        assert!(
            material(r#"{"emissiveTexture":{"index":1}}"#)
                .is_err_and(|e| e.contains("emissiveTexture.index = 1"))
        );
        assert!(
            material(r#"{"emissiveTexture":{"index":0,"texCoord":2}}"#)
                .expect("valid")
                .0
                .emissive_texture
                .is_none()
        );
    }
}
