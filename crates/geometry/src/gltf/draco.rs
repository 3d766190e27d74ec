//! KHR_draco_mesh_compression: primitives decoded into plain accessors before anything else looks at them.

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::json;
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::{Checked, USize64};
use serde_json::Value;

use super::document::Document;
use super::error::Error;

const NAME: &str = "KHR_draco_mesh_compression";

/// Replaces every compressed primitive's indices and attributes by accessors of decoded data.
pub(super) fn decompress(document: &mut Document) -> Result<(), Error> {
    for m in 0..document.root.meshes.len() {
        for p in 0..document.root.meshes[m].primitives.len() {
            let extensions = &document.root.meshes[m].primitives[p].extensions;
            let Some(value) = extensions.as_ref().and_then(|e| e.others.get(NAME)) else { continue };
            let (value, at) = (value.clone(), format!("meshes[{m}].primitives[{p}].extensions.{NAME}"));
            one(document, m, p, &value, &at)?;
        }
    }
    Ok(())
}

fn one(document: &mut Document, m: usize, p: usize, value: &Value, at: &str) -> Result<(), Error> {
    let number = |key: &str| value.get(key).and_then(Value::as_u64).and_then(|v| u32::try_from(v).ok());
    let Some(view) = number("bufferView") else {
        return Err(document.fault(format!("{at}.bufferView"), value, "not the number of a buffer view"));
    };
    let mesh = decode(document, view, at)?;
    let (points, faces) = (mesh.num_points(), mesh.num_faces());
    document.within(at, "triangles", faces as u64, document.limits.triangles)?;

    let indices: Vec<u8> = mesh.faces().iter().flatten().flat_map(|i| i.0.to_le_bytes()).collect();
    let indices = add(document, at, indices, 3 * faces, ComponentType::U32, Type::Scalar)?;
    let names = value.get("attributes").and_then(Value::as_object).cloned().unwrap_or_default();
    let attributes = document.root.meshes[m].primitives[p].attributes.clone();
    for (semantic, index) in attributes {
        let Checked::Valid(semantic) = semantic else { continue };
        let name = semantic.to_string();
        let Some(id) = names.get(&name) else { continue };
        let user = format!("{at}.attributes.{name}");
        let attribute = id.as_u64().and_then(|id| mesh.attribute_by_unique_id(u32::try_from(id).ok()?));
        let Some(attribute) = attribute else {
            return Err(document.fault(user, id, "the compressed mesh has no attribute of this number"));
        };
        let Some(accessor) = document.root.accessors.get(index.value()) else {
            return Err(document.fault(user, index.value(), "there is no accessor of this number"));
        };
        let Checked::Valid(kind) = accessor.type_ else {
            return Err(document.fault(user, "?", "its accessor has no type of glTF's"));
        };
        let most = match accessor.component_type {
            Checked::Valid(GenericComponentType(c)) if accessor.normalized => match c {
                ComponentType::I8 => 127.0,
                ComponentType::U8 => 255.0,
                ComponentType::I16 => 32767.0,
                ComponentType::U16 => 65535.0,
                ComponentType::U32 | ComponentType::F32 => 1.0,
            },
            _ => 1.0,
        };
        let values = attribute.read_f32s(points, kind.multiplicity());
        // Joints are counted, everything else is measured.
        let (bytes, component): (Vec<u8>, _) = match semantic {
            Semantic::Joints(_) => {
                (values.iter().flat_map(|v| (*v as u16).to_le_bytes()).collect(), ComponentType::U16)
            }
            _ => (values.iter().flat_map(|v| (v / most).to_le_bytes()).collect(), ComponentType::F32),
        };
        let new = add(document, &user, bytes, points, component, kind)?;
        document.root.meshes[m].primitives[p].attributes.insert(Checked::Valid(semantic), new);
    }
    let primitive = &mut document.root.meshes[m].primitives[p];
    primitive.indices = Some(indices);
    primitive.mode = Checked::Valid(Mode::Triangles);
    Ok(())
}

fn decode(document: &Document, view: u32, at: &str) -> Result<Mesh, Error> {
    let (bytes, _) = document.view(json::Index::new(view), &at)?;
    let limits = &document.limits;
    let limits = DecodeLimits::default()
        .with_max_faces(limits.triangles)
        .with_max_points(3 * limits.triangles)
        .with_max_decoded_bytes(limits.bytes.min(1 << 30));
    let mut mesh = Mesh::new();
    let result = MeshDecoder::new().decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh);
    match result {
        Ok(()) => Ok(mesh),
        Err(e) => {
            let value = format!("{} bytes", bytes.len());
            Err(document.fault(
                format!("{at}.bufferView"),
                value,
                format!("not a mesh that Draco can read: {e}"),
            ))
        }
    }
}

/// A new accessor of `count` elements over `bytes`.
fn add(
    document: &mut Document,
    at: &str,
    bytes: Vec<u8>,
    count: usize,
    component: ComponentType,
    kind: Type,
) -> Result<json::Index<json::Accessor>, Error> {
    let view = document.add_view(at, bytes, None)?;
    let accessors = &mut document.root.accessors;
    accessors.push(json::Accessor {
        buffer_view: Some(view),
        byte_offset: None,
        count: USize64(count as u64),
        component_type: Checked::Valid(GenericComponentType(component)),
        extensions: None,
        extras: None,
        type_: Checked::Valid(kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    });
    Ok(json::Index::new(accessors.len() as u32 - 1))
}
