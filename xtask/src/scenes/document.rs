//! A glTF 2.0 file in the making: what our scenes need of the format, no more.

use super::material::{Material, TextureId};
use super::shapes::Shape;
use glam::{DMat3, DQuat, DVec3};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// Index of a material in its [`Document`].
#[derive(Clone, Copy)]
pub struct MaterialId(usize);

/// A scene: materials first, then the shapes, lights and cameras that stand in it.
#[derive(Default)]
pub struct Document {
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    images: Vec<Value>,
    textures: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    buffer: Vec<u8>,
    extensions: BTreeSet<&'static str>,
    triangles: usize,
    splits: u32,
}

/// glTF's names for numbers.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

impl Document {
    /// A document that splits each triangle of the shapes added to it into four, `splits` times.
    pub fn split(splits: u32) -> Document {
        Document { splits, ..Document::default() }
    }

    /// Adds a material.
    pub fn material(&mut self, material: &Material) -> MaterialId {
        let json = material.json(|name| {
            self.extensions.insert(name);
        });
        self.materials.push(json);
        MaterialId(self.materials.len() - 1)
    }

    /// Adds a PNG that repeats in both directions.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> TextureId {
        let view = self.view(png, None);
        self.images.push(json!({ "name": name, "mimeType": "image/png", "bufferView": view }));
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": 0 }));
        TextureId(self.textures.len() - 1)
    }

    /// Adds `shape`, whose coordinates are world space, as one node with one mesh.
    pub fn add(&mut self, name: &str, shape: &Shape, material: MaterialId) {
        let shape = (0..self.splits).fold(shape.clone(), |shape, _| shape.split());
        let vec3 = |v: &[DVec3]| v.iter().map(|v| v.as_vec3().to_array().to_vec()).collect::<Vec<_>>();
        let mut attributes = json!({
            "POSITION": self.floats("VEC3", &vec3(&shape.positions), true),
            "NORMAL": self.floats("VEC3", &vec3(&shape.normals), false),
        });
        if !shape.uvs.is_empty() {
            let uvs: Vec<_> = shape.uvs.iter().map(|v| v.as_vec2().to_array().to_vec()).collect();
            attributes["TEXCOORD_0"] = json!(self.floats("VEC2", &uvs, false));
        }
        if self.materials[material.0].get("normalTexture").is_some() {
            let tangents: Vec<_> = shape.tangents().iter().map(|v| v.as_vec4().to_array().to_vec()).collect();
            attributes["TANGENT"] = json!(self.floats("VEC4", &tangents, false));
        }
        let indices = self.indices(&shape.triangles, shape.positions.len());
        self.triangles += shape.triangles.len();
        self.meshes.push(json!({
            "name": name,
            "primitives": [{ "attributes": attributes, "indices": indices, "material": material.0 }],
        }));
        self.nodes.push(json!({ "name": name, "mesh": self.meshes.len() - 1 }));
    }

    /// Adds a camera at `from` that looks at `at`; `yfov` is the full vertical angle of view, degrees, and
    /// `aspect` the width over the height that the picture was composed for.
    pub fn camera(&mut self, name: &str, from: DVec3, at: DVec3, yfov: f64, aspect: f64) {
        self.cameras.push(json!({
            "name": name,
            "type": "perspective",
            "perspective": { "yfov": round(yfov.to_radians()), "aspectRatio": aspect, "znear": 0.01 },
        }));
        let camera = self.cameras.len() - 1;
        self.place(name, from, at, json!({ "camera": camera }));
    }

    /// Adds a spot light at `from` that shines at `at`: `intensity` in cd, angles from the axis in degrees.
    pub fn spot(
        &mut self,
        name: &str,
        from: DVec3,
        at: DVec3,
        color: [f64; 3],
        intensity: f64,
        angles: [f64; 2],
    ) {
        self.extensions.insert("KHR_lights_punctual");
        let [inner, outer] = angles.map(|a| round(a.to_radians()));
        self.lights.push(json!({
            "name": name,
            "type": "spot",
            "color": color,
            "intensity": intensity,
            "spot": { "innerConeAngle": inner, "outerConeAngle": outer },
        }));
        let light = self.lights.len() - 1;
        self.place(name, from, at, json!({ "extensions": { "KHR_lights_punctual": { "light": light } } }));
    }

    /// A node that holds `what`, at `from`, with its −z axis toward `at` and its y axis upward.
    fn place(&mut self, name: &str, from: DVec3, at: DVec3, mut what: Value) {
        let z = (from - at).normalize();
        // Straight down has no "upward": any x axis will do.
        let x = DVec3::Y.cross(z).try_normalize().unwrap_or(DVec3::X);
        let rotation = DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z));
        what["name"] = json!(name);
        what["translation"] = json!(from.to_array());
        what["rotation"] = json!(rotation.to_array().map(round));
        self.nodes.push(what);
    }

    /// How many triangles were added.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// An accessor of little-endian floats, one row an element.
    fn floats(&mut self, kind: &str, rows: &[Vec<f32>], with_bounds: bool) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|f| f.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let mut accessor =
            json!({ "bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": kind });
        if with_bounds {
            let bound = |pick: fn(f32, f32) -> f32| {
                let start = rows[0].clone();
                let fold = |a: Vec<f32>, b: &Vec<f32>| a.iter().zip(b).map(|(a, b)| pick(*a, *b)).collect();
                rows.iter().fold(start, fold)
            };
            accessor["min"] = json!(bound(f32::min));
            accessor["max"] = json!(bound(f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// An accessor of indices, as narrow as `vertices` allows (the largest 16-bit number is reserved by glTF).
    fn indices(&mut self, triangles: &[[u32; 3]], vertices: usize) -> usize {
        let narrow = vertices < 65535;
        let flat = triangles.iter().flatten();
        let bytes: Vec<u8> = if narrow {
            flat.flat_map(|&i| (i as u16).to_le_bytes()).collect()
        } else {
            flat.flat_map(|i| i.to_le_bytes()).collect()
        };
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": if narrow { UNSIGNED_SHORT } else { UNSIGNED_INT },
            "count": 3 * triangles.len(),
            "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    /// A piece of the buffer that starts at a multiple of four.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let start = self.buffer.len();
        self.buffer.extend_from_slice(bytes);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    /// The JSON, its one buffer described by `buffer`.
    fn json(&mut self, buffer: Value) -> Value {
        let all: Vec<usize> = (0..self.nodes.len()).collect();
        let mut root = Map::new();
        root.insert(
            "asset".into(),
            json!({
                "version": "2.0",
                "generator": "twolight: cargo xtask scenes",
                "copyright": "MIT OR Apache-2.0",
            }),
        );
        root.insert("scene".into(), json!(0));
        root.insert("scenes".into(), json!([{ "nodes": all }]));
        root.insert("buffers".into(), json!([buffer]));
        if !self.textures.is_empty() {
            // Linear between texels, trilinear between mip levels, repeating.
            root.insert("samplers".into(), json!([{ "magFilter": 9729, "minFilter": 9987 }]));
        }
        if !self.extensions.is_empty() {
            root.insert("extensionsUsed".into(), json!(self.extensions));
        }
        if !self.lights.is_empty() {
            root.insert("extensions".into(), json!({ "KHR_lights_punctual": { "lights": self.lights } }));
        }
        let lists = [
            ("accessors", &mut self.accessors),
            ("bufferViews", &mut self.views),
            ("cameras", &mut self.cameras),
            ("images", &mut self.images),
            ("materials", &mut self.materials),
            ("meshes", &mut self.meshes),
            ("nodes", &mut self.nodes),
            ("textures", &mut self.textures),
        ];
        for (name, list) in lists {
            // glTF allows no empty arrays.
            if !list.is_empty() {
                root.insert(name.into(), Value::Array(std::mem::take(list)));
            }
        }
        Value::Object(root)
    }

    /// A `.gltf` file: JSON that one can read, its buffer within it as base64.
    pub fn into_gltf(mut self) -> Vec<u8> {
        let uri = format!("data:application/octet-stream;base64,{}", crate::base64::base64(&self.buffer));
        let json = self.json(json!({ "byteLength": self.buffer.len(), "uri": uri }));
        let mut bytes = serde_json::to_vec_pretty(&json).expect("a JSON value can always be written");
        bytes.push(b'\n');
        bytes
    }

    /// A `.glb` file (glTF 2.0, chapter 4): a header, the JSON padded with spaces, the buffer padded with zeros.
    pub fn into_glb(mut self) -> Vec<u8> {
        let json = self.json(json!({ "byteLength": self.buffer.len() }));
        let mut json = serde_json::to_vec(&json).expect("a JSON value can always be written");
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + self.buffer.len();
        let mut glb = Vec::with_capacity(total);
        let word = |glb: &mut Vec<u8>, w: usize| glb.extend_from_slice(&(w as u32).to_le_bytes());
        glb.extend_from_slice(b"glTF");
        word(&mut glb, 2);
        word(&mut glb, total);
        word(&mut glb, json.len());
        glb.extend_from_slice(b"JSON");
        glb.extend_from_slice(&json);
        word(&mut glb, self.buffer.len());
        glb.extend_from_slice(b"BIN\0");
        glb.extend_from_slice(&self.buffer);
        glb
    }
}

/// Seven decimals, as many as an f32 in [0, 1] tells apart: what lies beyond may differ between machines.
fn round(x: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (x * 1e7).round() / 1e7 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glb_states_its_own_length() {
        let glb = Document::default().into_glb();
        assert_eq!(u32::from_le_bytes(glb[8..12].try_into().unwrap()) as usize, glb.len());
        assert_eq!(glb.len() % 4, 0);
    }
}
