//! A glTF 2.0 file in the making: lists of JSON, and one buffer.
//!
//! Knows how numbers lie in the buffer and how the parts are put together, not what they mean: materials, nodes and the
//! rest are JSON as the specification has it, pushed to the list of its name.

use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// glTF's names for numbers.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A file in the making.
#[derive(Clone, Debug, Default)]
pub struct Writer {
    lists: BTreeMap<&'static str, Vec<Value>>,
    used: BTreeSet<&'static str>,
    /// The file's `extensions` object.
    pub extensions: Map<String, Value>,
    buffer: Vec<u8>,
}

impl Writer {
    /// Appends `value` to the top-level array `list` ("meshes", "nodes", ...) and returns its index.
    pub fn push(&mut self, list: &'static str, value: Value) -> usize {
        let list = self.lists.entry(list).or_default();
        list.push(value);
        list.len() - 1
    }

    /// What was pushed to `list`.
    pub fn list(&self, list: &str) -> &[Value] {
        self.lists.get(list).map_or(&[], Vec::as_slice)
    }

    /// Names an extension in `extensionsUsed`.
    pub fn uses(&mut self, extension: &'static str) {
        self.used.insert(extension);
    }

    /// Bytes in the buffer.
    pub fn len(&self) -> usize {
        self.buffer.len()
    }

    /// Whether the buffer is empty.
    pub fn is_empty(&self) -> bool {
        self.buffer.is_empty()
    }

    /// Accessor of vectors of `N` floats for each vertex; not empty.
    pub fn floats<const N: usize>(&mut self, rows: &[[f32; N]], with_bounds: bool) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|f| f.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor =
            json!({ "bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": kind });
        if with_bounds {
            let bound = |pick: fn(f32, f32) -> f32| {
                let all = rows.iter().copied().reduce(|a, b| std::array::from_fn(|k| pick(a[k], b[k])));
                all.unwrap_or([0.0; N]).to_vec()
            };
            accessor["min"] = json!(bound(f32::min));
            accessor["max"] = json!(bound(f32::max));
        }
        self.push("accessors", accessor)
    }

    /// Accessor of colours with alpha in [0, 1], as 16-bit numbers; not empty.
    pub fn colors(&mut self, rows: &[[f32; 4]]) -> usize {
        let short = |v: f32| (v.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|&v| short(v).to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let accessor = json!({
            "bufferView": view,
            "componentType": UNSIGNED_SHORT,
            "normalized": true,
            "count": rows.len(),
            "type": "VEC4",
        });
        self.push("accessors", accessor)
    }

    /// Accessor of the corners of triangles, as narrow as `vertices` allows (the largest 16-bit number is reserved).
    pub fn indices(&mut self, triangles: &[[u32; 3]], vertices: usize) -> usize {
        let narrow = vertices < 65535;
        let flat = triangles.iter().flatten();
        let bytes: Vec<u8> = if narrow {
            flat.flat_map(|&i| (i as u16).to_le_bytes()).collect()
        } else {
            flat.flat_map(|i| i.to_le_bytes()).collect()
        };
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let accessor = json!({
            "bufferView": view,
            "componentType": if narrow { UNSIGNED_SHORT } else { UNSIGNED_INT },
            "count": 3 * triangles.len(),
            "type": "SCALAR",
        });
        self.push("accessors", accessor)
    }

    /// An image within the buffer.
    pub fn image(&mut self, name: &str, mime: &str, bytes: &[u8]) -> usize {
        let view = self.view(bytes, None);
        self.push("images", json!({ "name": name, "mimeType": mime, "bufferView": view }))
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
        self.push("bufferViews", view)
    }

    /// The JSON, with all nodes in one scene, its one buffer described by `buffer`.
    fn json(&mut self, asset: Value, buffer: Value) -> Value {
        let nodes: Vec<usize> = (0..self.list("nodes").len()).collect();
        let mut root = Map::new();
        root.insert("asset".into(), asset);
        root.insert("scene".into(), json!(0));
        // glTF allows no empty arrays.
        root.insert(
            "scenes".into(),
            if nodes.is_empty() { json!([{}]) } else { json!([{ "nodes": nodes }]) },
        );
        if !self.buffer.is_empty() {
            root.insert("buffers".into(), json!([buffer]));
        }
        if !self.used.is_empty() {
            root.insert("extensionsUsed".into(), json!(self.used));
        }
        if !self.extensions.is_empty() {
            root.insert("extensions".into(), Value::Object(std::mem::take(&mut self.extensions)));
        }
        for (name, list) in std::mem::take(&mut self.lists).into_iter().filter(|(_, list)| !list.is_empty()) {
            root.insert(name.into(), Value::Array(list));
        }
        Value::Object(root)
    }

    /// A `.gltf` file: JSON that one can read, its buffer within it as `uri` makes it of the bytes.
    pub fn into_gltf(mut self, asset: Value, uri: impl Fn(&[u8]) -> String) -> Vec<u8> {
        let buffer = json!({ "byteLength": self.buffer.len(), "uri": uri(&self.buffer) });
        let json = self.json(asset, buffer);
        let mut bytes = serde_json::to_vec_pretty(&json).expect("a JSON value can always be written");
        bytes.push(b'\n');
        bytes
    }

    /// A `.glb` file (glTF 2.0, chapter 4): a header, the JSON padded with spaces, the buffer padded with zeros.
    /// `None` where it would be longer than its 32-bit header can say.
    pub fn into_glb(mut self, asset: Value) -> Option<Vec<u8>> {
        let json = self.json(asset, json!({ "byteLength": self.buffer.len() }));
        let mut json = serde_json::to_vec(&json).expect("a JSON value can always be written");
        json.resize(json.len().next_multiple_of(4), b' ');
        let chunk = if self.buffer.is_empty() { 0 } else { 8 + self.buffer.len() };
        let total = 12 + 8 + json.len() + chunk;
        u32::try_from(total).ok()?;
        let mut glb = Vec::with_capacity(total);
        let word = |glb: &mut Vec<u8>, w: usize| glb.extend_from_slice(&(w as u32).to_le_bytes());
        glb.extend_from_slice(b"glTF");
        word(&mut glb, 2);
        word(&mut glb, total);
        word(&mut glb, json.len());
        glb.extend_from_slice(b"JSON");
        glb.extend_from_slice(&json);
        if !self.buffer.is_empty() {
            word(&mut glb, self.buffer.len());
            glb.extend_from_slice(b"BIN\0");
            glb.extend_from_slice(&self.buffer);
        }
        Some(glb)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glb_states_its_own_length() {
        for rows in [&[][..], &[[1.0f32, 2.0, 3.0]]] {
            let mut writer = Writer::default();
            if !rows.is_empty() {
                writer.floats(rows, true);
            }
            let glb = writer.into_glb(json!({ "version": "2.0" })).unwrap();
            assert_eq!(u32::from_le_bytes(glb[8..12].try_into().unwrap()) as usize, glb.len());
            assert_eq!(glb.len() % 4, 0);
        }
    }

    #[test]
    fn bounds_and_narrow_indices() {
        let mut writer = Writer::default();
        writer.floats(&[[1.0, -2.0], [-1.0, 4.0]], true);
        writer.indices(&[[0, 1, 2]], 65534);
        writer.indices(&[[0, 1, 2]], 65535);
        let of = |i: usize, key: &str| writer.list("accessors")[i][key].clone();
        assert_eq!((of(0, "min"), of(0, "max")), (json!([-1.0, -2.0]), json!([1.0, 4.0])));
        assert_eq!((of(1, "componentType"), of(2, "componentType")), (json!(5123), json!(5125)));
        assert_eq!(writer.list("bufferViews")[2]["byteOffset"], json!(16 + 8), "aligned to four");
    }
}
