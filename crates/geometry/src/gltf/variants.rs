//! KHR_materials_variants: one of several sets of materials, by name.

use gltf::json;
use serde_json::Value;

use super::document::Document;
use super::error::Error;

/// The number of the variant `name`; an error that lists the file's variants where there is none of that name.
pub(super) fn find(document: &Document, name: &str) -> Result<u64, Error> {
    let names = names(&document.root);
    names.iter().position(|n| n == name).map(|i| i as u64).ok_or_else(|| Error::NoSuch {
        file: document.file.clone(),
        what: "variant",
        asked: name.into(),
        known: names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", "),
    })
}

/// The names of the variants that a file offers.
pub(super) fn names(root: &json::Root) -> Vec<String> {
    let extension = root.extensions.as_ref().and_then(|e| e.others.get("KHR_materials_variants"));
    let variants = extension.and_then(|e| e.get("variants")).and_then(Value::as_array);
    let name = |v: &Value| v.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
    variants.into_iter().flatten().map(name).collect()
}

/// The material that `primitive` has in variant `number`; `None` where it keeps its own.
pub(super) fn material(primitive: &json::mesh::Primitive, number: u64) -> Option<usize> {
    let extension = primitive.extensions.as_ref()?.others.get("KHR_materials_variants")?;
    let listed = |m: &&Value| {
        let variants = m.get("variants").and_then(Value::as_array);
        variants.is_some_and(|v| v.iter().any(|v| v.as_u64() == Some(number)))
    };
    let mapping = extension.get("mappings")?.as_array()?.iter().find(listed)?;
    usize::try_from(mapping.get("material")?.as_u64()?).ok()
}
