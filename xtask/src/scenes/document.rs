//! Our scenes as glTF 2.0: what they need of the format, no more.

use super::material::{Material, TextureId};
use super::shapes::Shape;
use geometry::gltf::write::Writer;
use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};

/// Index of a material in its [`Document`].
#[derive(Clone, Copy)]
pub struct MaterialId(usize);

/// A scene: materials first, then the shapes, lights and cameras that stand in it.
#[derive(Default)]
pub struct Document {
    writer: Writer,
    lights: Vec<Value>,
    triangles: usize,
    splits: u32,
}

impl Document {
    /// A document that splits each triangle of the shapes added to it into four, `splits` times.
    pub fn split(splits: u32) -> Document {
        Document { splits, ..Document::default() }
    }

    /// Adds a material.
    pub fn material(&mut self, material: &Material) -> MaterialId {
        let json = material.json(|name| self.writer.uses(name));
        MaterialId(self.writer.push("materials", json))
    }

    /// Adds a PNG that repeats in both directions.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> TextureId {
        let source = self.writer.image(name, "image/png", png);
        if self.writer.list("samplers").is_empty() {
            // Linear between texels, trilinear between mip levels, repeating.
            self.writer.push("samplers", json!({ "magFilter": 9729, "minFilter": 9987 }));
        }
        TextureId(self.writer.push("textures", json!({ "source": source, "sampler": 0 })))
    }

    /// Adds `shape`, whose coordinates are world space, as one node with one mesh.
    pub fn add(&mut self, name: &str, shape: &Shape, material: MaterialId) {
        let shape = (0..self.splits).fold(shape.clone(), |shape, _| shape.split());
        let vec3 = |v: &[DVec3]| v.iter().map(|v| v.as_vec3().to_array()).collect::<Vec<_>>();
        let mut attributes = json!({
            "POSITION": self.writer.floats(&vec3(&shape.positions), true),
            "NORMAL": self.writer.floats(&vec3(&shape.normals), false),
        });
        if !shape.uvs.is_empty() {
            let uvs: Vec<_> = shape.uvs.iter().map(|v| v.as_vec2().to_array()).collect();
            attributes["TEXCOORD_0"] = json!(self.writer.floats(&uvs, false));
        }
        if self.writer.list("materials")[material.0].get("normalTexture").is_some() {
            let tangents: Vec<_> = shape.tangents().iter().map(|v| v.as_vec4().to_array()).collect();
            attributes["TANGENT"] = json!(self.writer.floats(&tangents, false));
        }
        let indices = self.writer.indices(&shape.triangles, shape.positions.len());
        self.triangles += shape.triangles.len();
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": material.0 });
        let mesh = self.writer.push("meshes", json!({ "name": name, "primitives": [primitive] }));
        self.writer.push("nodes", json!({ "name": name, "mesh": mesh }));
    }

    /// Adds a camera at `from` that looks at `at`; `yfov` is the full vertical angle of view, degrees, and
    /// `aspect` the width over the height that the picture was composed for.
    pub fn camera(&mut self, name: &str, from: DVec3, at: DVec3, yfov: f64, aspect: f64) {
        let lens = json!({
            "name": name,
            "type": "perspective",
            "perspective": { "yfov": round(yfov.to_radians()), "aspectRatio": aspect, "znear": 0.01 },
        });
        let camera = self.writer.push("cameras", lens);
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
        self.writer.uses("KHR_lights_punctual");
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
        self.writer.push("nodes", what);
    }

    /// How many triangles were added.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// The writer with all in it, and what the file says of itself.
    fn finish(mut self) -> (Writer, Value) {
        if !self.lights.is_empty() {
            let lights = json!({ "lights": self.lights });
            self.writer.extensions.insert("KHR_lights_punctual".into(), lights);
        }
        let asset = json!({
            "version": "2.0",
            "generator": "twolight: cargo xtask scenes",
            "copyright": "MIT OR Apache-2.0",
        });
        (self.writer, asset)
    }

    /// A `.gltf` file: JSON that one can read, its buffer within it as base64.
    pub fn into_gltf(self) -> Vec<u8> {
        let (writer, asset) = self.finish();
        writer.into_gltf(asset, |bytes| {
            format!("data:application/octet-stream;base64,{}", crate::base64::base64(bytes))
        })
    }

    /// A `.glb` file.
    pub fn into_glb(self) -> Vec<u8> {
        let (writer, asset) = self.finish();
        writer.into_glb(asset).expect("our scenes are far below 4 GB")
    }
}

/// Seven decimals, as many as an f32 in [0, 1] tells apart: what lies beyond may differ between machines.
fn round(x: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (x * 1e7).round() / 1e7 + 0.0
}
