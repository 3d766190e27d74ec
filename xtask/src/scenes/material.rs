//! Materials as our scenes use them, and their glTF JSON.

use serde_json::{Map, Value, json};

/// Index of a texture in its [`super::document::Document`].
#[derive(Clone, Copy)]
pub struct TextureId(pub usize);

/// What lies behind a refracting surface (KHR_materials_volume).
#[derive(Clone, Copy)]
pub struct Volume {
    /// Only a hint for rasterisers, m; rays find the true thickness.
    pub thickness: f64,
    /// Share of light left after `attenuation_distance`, linear.
    pub attenuation_color: [f64; 3],
    /// Metres; `None` is a clear volume.
    pub attenuation_distance: Option<f64>,
}

/// glTF metallic-roughness with the extensions we use. Build one from a function below, then change fields.
#[derive(Clone)]
pub struct Material {
    /// Unique in the document.
    pub name: &'static str,
    /// Linear, [0, 1].
    pub base_color: [f64; 3],
    /// sRGB, multiplied in.
    pub base_color_texture: Option<TextureId>,
    /// [0, 1].
    pub metallic: f64,
    /// Perceptual roughness, [0, 1].
    pub roughness: f64,
    /// 0 leaves a Lambertian surface, 1 is glTF's default dielectric.
    pub specular: f64,
    /// Emitted radiance, cd/m².
    pub emission: [f64; 3],
    /// sRGB, multiplied in.
    pub emissive_texture: Option<TextureId>,
    /// Tangent-space normals.
    pub normal_texture: Option<TextureId>,
    /// Share of light entering that is transmitted, [0, 1].
    pub transmission: f64,
    /// Present when the surface bounds a solid that refracts; its ior is glTF's default, 1.5.
    pub volume: Option<Volume>,
    /// Seen from both sides (for rasterisers; for us only emission cares).
    pub double_sided: bool,
}

impl Material {
    /// Purely diffuse: reflects the share `reflectance` of what arrives.
    pub fn lambert(name: &'static str, reflectance: [f64; 3]) -> Material {
        Material {
            name,
            base_color: reflectance,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            specular: 0.0,
            emission: [0.0; 3],
            emissive_texture: None,
            normal_texture: None,
            transmission: 0.0,
            volume: None,
            double_sided: false,
        }
    }

    /// A lamp: shines `radiance` (cd/m²) from its front and reflects the share `reflectance`.
    pub fn lamp(name: &'static str, radiance: [f64; 3], reflectance: [f64; 3]) -> Material {
        Material { emission: radiance, ..Material::lambert(name, reflectance) }
    }

    /// Metal; a perfect mirror at roughness 0.
    pub fn metal(name: &'static str, reflectance: [f64; 3], roughness: f64) -> Material {
        Material { metallic: 1.0, roughness, specular: 1.0, ..Material::lambert(name, reflectance) }
    }

    /// Solid glass: refracts, ior 1.5.
    pub fn glass(name: &'static str, volume: Volume) -> Material {
        Material {
            transmission: 1.0,
            roughness: 0.0,
            specular: 1.0,
            volume: Some(volume),
            ..Material::lambert(name, [1.0; 3])
        }
    }

    /// The material's JSON; names the extensions used through `uses`.
    pub fn json(&self, mut uses: impl FnMut(&'static str)) -> Value {
        let [r, g, b] = self.base_color;
        let mut pbr = json!({
            "baseColorFactor": [r, g, b, 1.0],
            "metallicFactor": self.metallic,
            "roughnessFactor": self.roughness,
        });
        if let Some(TextureId(index)) = self.base_color_texture {
            pbr["baseColorTexture"] = json!({ "index": index });
        }
        let mut material = json!({ "name": self.name, "pbrMetallicRoughness": pbr });
        if self.double_sided {
            material["doubleSided"] = json!(true);
        }
        if let Some(TextureId(index)) = self.normal_texture {
            material["normalTexture"] = json!({ "index": index });
        }

        let mut extensions = Map::new();
        let mut extend = |name: &'static str, value: Value| {
            uses(name);
            extensions.insert(name.into(), value);
        };
        // The factor holds the colour, at most 1; the strength holds the brightest channel, cd/m².
        let strength = self.emission.into_iter().fold(0.0, f64::max);
        if strength > 0.0 {
            material["emissiveFactor"] = json!(self.emission.map(|c| c / strength));
            extend("KHR_materials_emissive_strength", json!({ "emissiveStrength": strength }));
        }
        if let Some(TextureId(index)) = self.emissive_texture {
            material["emissiveTexture"] = json!({ "index": index });
        }
        if self.specular != 1.0 {
            extend("KHR_materials_specular", json!({ "specularFactor": self.specular }));
        }
        if self.transmission > 0.0 {
            extend("KHR_materials_transmission", json!({ "transmissionFactor": self.transmission }));
        }
        if let Some(volume) = self.volume {
            let mut v = json!({ "thicknessFactor": volume.thickness });
            if let Some(distance) = volume.attenuation_distance {
                v["attenuationColor"] = json!(volume.attenuation_color);
                v["attenuationDistance"] = json!(distance);
            }
            extend("KHR_materials_volume", v);
            extend("KHR_materials_ior", json!({ "ior": 1.5 }));
        }
        if !extensions.is_empty() {
            material["extensions"] = Value::Object(extensions);
        }
        material
    }
}
