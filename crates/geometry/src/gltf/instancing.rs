//! EXT_mesh_gpu_instancing: one node, many copies of its mesh.

use std::borrow::Cow;

use glam::DAffine3;
use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use serde_json::Value;

use super::accessor::Accessor;
use super::document::Document;
use super::error::Error;
use super::nodes::{Placed, trs};

/// The transforms under which the mesh of a node stands in the world: the node's own, or many.
pub(super) fn transforms<'a>(document: &Document, placed: &'a Placed) -> Result<Cow<'a, [DAffine3]>, Error> {
    let node = &document.root.nodes[placed.node];
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("EXT_mesh_gpu_instancing"));
    let Some(Value::Object(attributes)) = extension.and_then(|e| e.get("attributes")) else {
        return Ok(Cow::Borrowed(std::slice::from_ref(&placed.world)));
    };
    let at = format!("nodes[{}].extensions.EXT_mesh_gpu_instancing.attributes", placed.node);
    let open = |name: &str, kind: Type| -> Result<Option<Accessor<'_>>, Error> {
        let Some(value) = attributes.get(name) else { return Ok(None) };
        let user = format!("{at}.{name}");
        let index = value.as_u64().and_then(|i| u32::try_from(i).ok());
        let index = index.ok_or_else(|| document.fault(&user, value, "not the number of an accessor"))?;
        let numbers = [ComponentType::F32, ComponentType::I8, ComponentType::I16];
        Accessor::open(document, json::Index::new(index), &user, &[kind], &numbers).map(Some)
    };
    let translation = open("TRANSLATION", Type::Vec3)?;
    let rotation = open("ROTATION", Type::Vec4)?;
    let scale = open("SCALE", Type::Vec3)?;
    let lengths: Vec<usize> =
        [&translation, &rotation, &scale].into_iter().flatten().map(Accessor::len).collect();
    let Some(&count) = lengths.first() else {
        return Ok(Cow::Borrowed(std::slice::from_ref(&placed.world)));
    };
    if lengths.iter().any(|&n| n != count) {
        return Err(document.fault(at, format_args!("{lengths:?}"), "the attributes differ in length"));
    }
    document.within(&at, "instances", count as u64, document.limits.instances)?;
    let all = (0..count).map(|i| {
        placed.world
            * trs(
                translation.as_ref().map_or([0.0; 3], |a| a.get(i)),
                rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |a| a.get(i)),
                scale.as_ref().map_or([1.0; 3], |a| a.get(i)),
            )
    });
    Ok(Cow::Owned(all.collect()))
}
