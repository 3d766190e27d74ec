//! Materials and textures of a baked file, as glTF has them.

use super::look::Look;
use crate::tonemap::srgb_encode;
use geometry::gltf::write::Writer;
use geometry::texture::{Wrap, srgb_decode};
use geometry::{AlphaMode, Material, Rgb, Scene, Texture, TextureRef};
use serde_json::{Map, Value, json};
use std::collections::HashMap;
use std::io::Cursor;

/// glTF's names for filters and wraps.
const NEAREST: u32 = 9728;
const LINEAR: u32 = 9729;
const NEAREST_MIPMAP_NEAREST: u32 = 9984;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

/// Writes materials, and the textures that they use, once each.
pub struct Materials<'a> {
    scene: &'a Scene,
    /// cd/m² to what a file of unlit materials holds.
    scale: f32,
    /// Texture that holds the light, and the uv set that its places are in.
    map: Option<Value>,
    /// Emissive strength of the map, for lit materials.
    strength: f32,
    /// By texture, whether its alpha counts, and what it is brightened by.
    textures: HashMap<(u32, bool, u32), usize>,
}

/// A material as it was written, and which of the scene's uv sets it needs.
pub struct Written {
    /// glTF's JSON.
    pub json: Value,
    /// The scene's uv sets in use, in the order of TEXCOORD_0, TEXCOORD_1, ...
    pub uv_sets: Vec<u8>,
    /// What COLOR_0 is for light of 1 cd/m².
    pub gain: Rgb,
}

impl<'a> Materials<'a> {
    pub fn new(scene: &'a Scene, scale: f32, map: Option<usize>, strength: f32) -> Materials<'a> {
        let map = map.map(|index| json!({ "index": index }));
        Materials { scene, scale, map, strength, textures: HashMap::new() }
    }

    /// The material `m` as `look` wants it, for light at vertices of at most `brightest` cd/m².
    pub fn write(&mut self, m: &Material, look: Look, brightest: Rgb, writer: &mut Writer) -> Written {
        let gain = Rgb::splat(self.scale);
        let mut w =
            Write { sets: sets(m, look, self.map.is_some()), brightest, gain, writer, materials: self };
        let mut json = match look {
            Look::Reflecting | Look::Glowing | Look::Screen => w.unlit(m, look),
            Look::Kept if m.unlit => w.unlit(m, look),
            Look::Lit | Look::Kept => w.lit(m, look),
        };
        let (uv_sets, gain) = (w.sets, w.gain);
        json.insert("name".into(), json!(m.name));
        match m.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask(cutoff) => {
                json.insert("alphaMode".into(), json!("MASK"));
                json.insert("alphaCutoff".into(), json!(cutoff));
            }
            AlphaMode::Blend => _ = json.insert("alphaMode".into(), json!("BLEND")),
        }
        // Where light is baked each side has triangles and light of its own.
        if m.double_sided && !look.takes_light() {
            json.insert("doubleSided".into(), json!(true));
        }
        Written { json: Value::Object(json), uv_sets, gain }
    }
}

/// The uv sets of the scene that the textures written need.
fn sets(m: &Material, look: Look, mapped: bool) -> Vec<u8> {
    let refs: Vec<Option<TextureRef>> = match look {
        Look::Reflecting | Look::Glowing if mapped => vec![],
        Look::Glowing => vec![],
        Look::Reflecting => vec![m.base_color_texture],
        Look::Screen => vec![m.emissive_texture],
        Look::Kept if m.unlit => vec![m.base_color_texture],
        Look::Lit | Look::Kept => vec![
            m.base_color_texture,
            m.metallic_roughness_texture,
            m.normal_texture,
            m.specular_texture,
            m.specular_color_texture,
            m.transmission_texture,
            m.emissive_texture.filter(|_| look == Look::Kept),
        ],
    };
    let mut sets: Vec<u8> = refs.into_iter().flatten().map(|t| t.uv_set.min(1)).collect();
    sets.sort_unstable();
    sets.dedup();
    sets
}

/// One material in the making.
struct Write<'b, 'a> {
    sets: Vec<u8>,
    brightest: Rgb,
    gain: Rgb,
    writer: &'b mut Writer,
    materials: &'b mut Materials<'a>,
}

impl Write<'_, '_> {
    fn unlit(&mut self, m: &Material, look: Look) -> Map<String, Value> {
        self.writer.uses("KHR_materials_unlit");
        let (mut color, mut alpha, mut texture) = (m.base_color, m.alpha, None);
        match look {
            Look::Reflecting | Look::Glowing if self.materials.map.is_some() => {
                (color, alpha, texture) = (Rgb::WHITE, 1.0, self.materials.map.clone());
            }
            // Nothing is brighter than white.
            Look::Screen => {
                color = (m.emissive * self.materials.scale).min(Rgb::WHITE);
                texture = self.texture(&m.emissive_texture, false);
            }
            Look::Glowing => color = Rgb::WHITE,
            Look::Reflecting => (color, texture) = self.base(m),
            _ => texture = self.texture(&m.base_color_texture, m.alpha_mode != AlphaMode::Opaque),
        }
        // Where unlit is not known, a rough dielectric is the nearest thing (KHR_materials_unlit asks for that).
        let mut pbr =
            json!({ "baseColorFactor": rgba(color, alpha), "metallicFactor": 0.0, "roughnessFactor": 0.9 });
        if let Some(texture) = texture {
            pbr["baseColorTexture"] = texture;
        }
        let mut json = Map::new();
        json.insert("pbrMetallicRoughness".into(), pbr);
        json.insert("extensions".into(), json!({ "KHR_materials_unlit": {} }));
        if matches!(look, Look::Reflecting | Look::Glowing) && self.materials.map.is_none() {
            json.insert("extras".into(), json!({ "twolight": { "gain": self.gain.to_array() } }));
        }
        json
    }

    /// Factor and texture of the base colour; sets `gain`.
    ///
    /// glTF keeps COLOR_0 and factor in [0, 1], and light is brighter than white wherever a grey wall is shown bright. So
    /// what is dark about the base colour is moved to COLOR_0, as far as that needs it: a texture is brightened until its
    /// brightest texel is white, and the factor until the brightest vertex is 1. Beyond that light is cut.
    fn base(&mut self, m: &Material) -> (Rgb, Option<Value>) {
        let scene = self.materials.scene;
        let texture = m.base_color_texture.and_then(|r| scene.textures.get(r.texture as usize));
        let peak = texture.map_or(1.0, peak);
        let alpha = m.alpha_mode != AlphaMode::Opaque;
        let json = self.texture_brightened(&m.base_color_texture, alpha, 1.0 / peak);
        let base = m.base_color * peak;
        let most = self.brightest * self.materials.scale * base;
        let factor = most.min(Rgb::WHITE);
        let per = |b: f32, f: f32| if f > 0.0 { self.materials.scale * b / f } else { 0.0 };
        self.gain = Rgb::new(per(base.r, factor.r), per(base.g, factor.g), per(base.b, factor.b));
        (factor, json)
    }

    fn lit(&mut self, m: &Material, look: Look) -> Map<String, Value> {
        let roughness = m.glossiness.map_or(m.roughness, |g| 1.0 - g);
        let mut pbr = json!({
            "baseColorFactor": rgba(m.base_color, m.alpha),
            "metallicFactor": m.metallic,
            "roughnessFactor": roughness,
        });
        let mut json = Map::new();
        let mut extensions = Map::new();
        let alpha = m.alpha_mode != AlphaMode::Opaque;
        let put = |object: &mut Value, key: &str, texture: Option<Value>| {
            if let Some(texture) = texture {
                object[key] = texture;
            }
        };
        put(&mut pbr, "baseColorTexture", self.texture(&m.base_color_texture, alpha));
        put(&mut pbr, "metallicRoughnessTexture", self.texture(&m.metallic_roughness_texture, false));
        json.insert("pbrMetallicRoughness".into(), pbr);
        if let Some(mut texture) = self.texture(&m.normal_texture, false) {
            texture["scale"] = json!(m.normal_scale);
            json.insert("normalTexture".into(), texture);
        }
        let (emissive, texture) = match (look, self.materials.map.clone()) {
            (Look::Lit, None) => (Rgb::BLACK, None),
            (Look::Lit, Some(mut map)) => {
                map["texCoord"] = json!(self.sets.len());
                (Rgb::splat(self.materials.strength), Some(map))
            }
            _ => (m.emissive, self.texture(&m.emissive_texture, false)),
        };
        if !emissive.is_black() {
            let strength = emissive.max_channel().max(1.0);
            json.insert("emissiveFactor".into(), json!((emissive / strength).to_array()));
            if strength > 1.0 {
                extensions.insert(
                    "KHR_materials_emissive_strength".into(),
                    json!({ "emissiveStrength": strength }),
                );
            }
            texture.into_iter().for_each(|t| _ = json.insert("emissiveTexture".into(), t));
        }
        if m.ior != 1.5 {
            extensions.insert("KHR_materials_ior".into(), json!({ "ior": m.ior }));
        }
        let plain = m.specular == 1.0 && m.specular_color == Rgb::WHITE;
        if !plain || m.specular_texture.is_some() || m.specular_color_texture.is_some() {
            let mut specular = json!({
                "specularFactor": m.specular,
                "specularColorFactor": m.specular_color.to_array(),
            });
            put(&mut specular, "specularTexture", self.texture(&m.specular_texture, true));
            put(&mut specular, "specularColorTexture", self.texture(&m.specular_color_texture, false));
            extensions.insert("KHR_materials_specular".into(), specular);
        }
        if m.transmission > 0.0 {
            let mut transmission = json!({ "transmissionFactor": m.transmission });
            put(&mut transmission, "transmissionTexture", self.texture(&m.transmission_texture, false));
            extensions.insert("KHR_materials_transmission".into(), transmission);
            if let Some(volume) = m.volume {
                let mut json = json!({
                    "thicknessFactor": 0.01,
                    "attenuationColor": volume.attenuation_color.to_array(),
                });
                if volume.attenuation_distance.is_finite() {
                    json["attenuationDistance"] = json!(volume.attenuation_distance);
                }
                extensions.insert("KHR_materials_volume".into(), json);
            }
        }
        for name in [
            "KHR_materials_emissive_strength",
            "KHR_materials_ior",
            "KHR_materials_specular",
            "KHR_materials_transmission",
            "KHR_materials_volume",
        ] {
            if extensions.contains_key(name) {
                self.writer.uses(name);
            }
        }
        if !extensions.is_empty() {
            json.insert("extensions".into(), Value::Object(extensions));
        }
        json
    }

    /// How a material names a texture, which is written when it is first named.
    fn texture(&mut self, reference: &Option<TextureRef>, alpha: bool) -> Option<Value> {
        self.texture_brightened(reference, alpha, 1.0)
    }

    /// The same, its linear colours times `gain`.
    fn texture_brightened(
        &mut self,
        reference: &Option<TextureRef>,
        alpha: bool,
        gain: f32,
    ) -> Option<Value> {
        let r = reference.as_ref()?;
        let texture = self.materials.scene.textures.get(r.texture as usize)?;
        let key = (r.texture, alpha, gain.to_bits());
        let index = match self.materials.textures.get(&key) {
            Some(&index) => index,
            None => {
                let png = png(texture, alpha, gain)?;
                let image = self.writer.image(&texture.name, "image/png", &png);
                let sampler = sampler(self.writer, texture);
                let index = self.writer.push("textures", json!({ "source": image, "sampler": sampler }));
                self.materials.textures.insert(key, index);
                index
            }
        };
        let set = self.sets.iter().position(|&s| s == r.uv_set.min(1)).unwrap_or(0);
        let mut json = json!({ "index": index });
        if set > 0 {
            json["texCoord"] = json!(set);
        }
        if r.transform != geometry::math::Affine2::IDENTITY {
            self.writer.uses("KHR_texture_transform");
            let (scale, angle, offset) = r.transform.to_scale_angle_translation();
            json["extensions"] = json!({ "KHR_texture_transform": {
                "offset": offset.to_array(), "rotation": -angle, "scale": scale.to_array(),
            }});
        }
        Some(json)
    }
}

fn rgba(c: Rgb, alpha: f32) -> [f32; 4] {
    [c.r, c.g, c.b, alpha].map(|v| v.clamp(0.0, 1.0))
}

/// The sampler of `texture`: an old one if there is one alike.
fn sampler(writer: &mut Writer, texture: &Texture) -> usize {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    };
    let (mag, min) =
        if texture.linear { (LINEAR, LINEAR_MIPMAP_LINEAR) } else { (NEAREST, NEAREST_MIPMAP_NEAREST) };
    let json = json!({
        "magFilter": mag, "minFilter": min, "wrapS": wrap(texture.wrap_s), "wrapT": wrap(texture.wrap_t),
    });
    match writer.list("samplers").iter().position(|s| *s == json) {
        Some(old) => old,
        None => writer.push("samplers", json),
    }
}

/// A texture of light: its edges end it. Without mip levels, in which neighbouring charts would run into one another: a side
/// seen at a slant showed the light of the next one along its edge. Returns its index.
pub fn light_texture(
    writer: &mut Writer,
    width: u32,
    height: u32,
    rgba: &[[u8; 4]],
    alpha: bool,
) -> Option<usize> {
    let bytes = encode(width, height, rgba, alpha)?;
    let image = writer.image("light", "image/png", &bytes);
    let sampler = writer.push(
        "samplers",
        json!({ "magFilter": LINEAR, "minFilter": LINEAR, "wrapS": 33071, "wrapT": 33071 }),
    );
    Some(writer.push("textures", json!({ "name": "light", "source": image, "sampler": sampler })))
}

/// A texture's brightest channel, linear, above 0; 1 for one that is nearly white somewhere.
fn peak(texture: &Texture) -> f32 {
    let byte = texture.texels.iter().flat_map(|t| [t[0], t[1], t[2]]).max().unwrap_or(255);
    if byte > 240 { 1.0 } else { srgb_decode(byte.max(1)) }
}

fn png(texture: &Texture, alpha: bool, gain: f32) -> Option<Vec<u8>> {
    if gain == 1.0 {
        return encode(texture.width, texture.height, &texture.texels, alpha);
    }
    let bright: [u8; 256] =
        std::array::from_fn(|i| (255.0 * srgb_encode((srgb_decode(i as u8) * gain).min(1.0)) + 0.5) as u8);
    let texel = |&[r, g, b, a]: &[u8; 4]| [bright[r as usize], bright[g as usize], bright[b as usize], a];
    let texels: Vec<[u8; 4]> = texture.texels.iter().map(texel).collect();
    encode(texture.width, texture.height, &texels, alpha)
}

/// PNG, with alpha only where it is asked for and not 1 all over.
fn encode(width: u32, height: u32, texels: &[[u8; 4]], alpha: bool) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut out = Cursor::new(&mut bytes);
    let format = image::ImageFormat::Png;
    if alpha && texels.iter().any(|t| t[3] < 255) {
        let image = image::RgbaImage::from_raw(width, height, texels.as_flattened().to_vec())?;
        image.write_to(&mut out, format).ok()?;
    } else {
        let rgb: Vec<u8> = texels.iter().flat_map(|t| [t[0], t[1], t[2]]).collect();
        image::RgbImage::from_raw(width, height, rgb)?.write_to(&mut out, format).ok()?;
    }
    Some(bytes)
}
