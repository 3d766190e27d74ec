//! One mesh primitive in its own space: attributes decoded, only the vertices in use.

use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

use super::accessor::Accessor;
use super::deform::{Attributes, Deform};
use super::document::Document;
use super::error::Error;
use super::tangents;
use super::topology;
use crate::math::{Vec2, Vec3, Vec4};

/// Which optional attributes the scene can make use of.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Needs {
    /// Each uv set that a texture of this primitive's material refers to.
    pub uvs: [bool; 2],
    /// Vertex colours.
    pub colors: bool,
    /// The uv set along which tangents run, where the material needs any.
    pub tangents: Option<u8>,
}

/// Triangles with their vertices, before any transform. Optional arrays are empty or as long as `positions`.
#[derive(Default)]
pub(super) struct Primitive {
    pub positions: Vec<Vec3>,
    /// Empty for flat shading; then no two triangles share a vertex.
    pub normals: Vec<Vec3>,
    pub uvs: [Vec<Vec2>; 2],
    /// Clamped to [0, 1].
    pub colors: Vec<Vec4>,
    pub tangents: Vec<Vec4>,
    pub triangles: Vec<[u32; 3]>,
}

const FLOAT: [ComponentType; 1] = [ComponentType::F32];
/// Floats, and the integers that KHR_mesh_quantization adds.
const QUANTIZED: [ComponentType; 5] =
    [ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];

impl Primitive {
    /// Decodes `primitive`, whose path is `at`, bent by `deform`; none for points and lines.
    pub fn read(
        document: &Document,
        primitive: &json::mesh::Primitive,
        at: &str,
        needs: Needs,
        deform: Option<&Deform>,
    ) -> Result<Option<Primitive>, Error> {
        let Some(positions) = attribute(document, primitive, at, Semantic::Positions, None)? else {
            return Err(document.fault(
                format_args!("{at}.attributes.POSITION"),
                "nothing",
                "a mesh needs positions",
            ));
        };
        let vertices = positions.len();
        let Some(mut triangles) = topology::triangles(document, primitive, vertices, at)? else {
            return Ok(None);
        };
        let optional = |semantic| attribute(document, primitive, at, semantic, Some(vertices));
        let normals = optional(Semantic::Normals)?;
        let source = if normals.is_some() {
            topology::compact(&mut triangles, vertices)
        } else {
            let corners = triangles.as_flattened().to_vec();
            for (t, triangle) in triangles.iter_mut().enumerate() {
                *triangle = [0, 1, 2].map(|k| (3 * t + k) as u32);
            }
            corners
        };
        let mut uvs = [Vec::new(), Vec::new()];
        for (set, values) in uvs.iter_mut().enumerate().filter(|(set, _)| needs.uvs[*set]) {
            if let Some(accessor) = optional(Semantic::TexCoords(set as u32))? {
                *values = gather(&accessor, &source, Vec2::from_array);
            }
        }
        let mut out = Primitive {
            positions: gather(&positions, &source, Vec3::from_array),
            uvs,
            triangles,
            ..Default::default()
        };
        if let Some(accessor) = normals {
            out.normals = gather(&accessor, &source, Vec3::from_array);
        }
        if let Some(deform) = deform {
            let file = Attributes { document, json: primitive, at, source: &source, vertices };
            deform.apply(&file, &mut out)?;
        }
        if needs.colors
            && let Some(accessor) = optional(Semantic::Colors(0))?
        {
            let channel = |c: f32| if c.is_nan() { 1.0 } else { c.clamp(0.0, 1.0) };
            out.colors = gather(&accessor, &source, |c: [f32; 4]| Vec4::from_array(c.map(channel)));
        }
        if let Some(set) = needs.tangents {
            // Without normals, tangents of the file must be ignored (glTF 2.0, 3.7.2.1).
            match optional(Semantic::Tangents)? {
                Some(accessor) if !out.normals.is_empty() && deform.is_none() => {
                    out.tangents = gather(&accessor, &source, Vec4::from_array);
                }
                _ => tangents::generate(&mut out, usize::from(set.min(1))),
            }
        }
        Ok(Some(out))
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Appends a copy of vertex `v` and returns its number. Tangents are the caller's affair.
    pub fn duplicate(&mut self, v: usize) -> u32 {
        fn push<T: Copy>(values: &mut Vec<T>, v: usize) {
            if let Some(&value) = values.get(v) {
                values.push(value);
            }
        }
        push(&mut self.positions, v);
        push(&mut self.normals, v);
        push(&mut self.colors, v);
        self.uvs.iter_mut().for_each(|set| push(set, v));
        (self.positions.len() - 1) as u32
    }
}

fn gather<const N: usize, T>(accessor: &Accessor, source: &[u32], make: impl Fn([f32; N]) -> T) -> Vec<T> {
    source.iter().map(|&i| make(accessor.get(i as usize))).collect()
}

/// Opens an attribute, if the primitive has it; its count must be `vertices`, where that is known.
fn attribute<'a>(
    document: &'a Document,
    primitive: &json::mesh::Primitive,
    at: &str,
    semantic: Semantic,
    vertices: Option<usize>,
) -> Result<Option<Accessor<'a>>, Error> {
    let (types, components): (&[Type], &[ComponentType]) = match semantic {
        Semantic::Tangents => (&[Type::Vec4], &QUANTIZED),
        Semantic::TexCoords(_) => (&[Type::Vec2], &QUANTIZED),
        Semantic::Colors(_) => {
            (&[Type::Vec3, Type::Vec4], &[ComponentType::F32, ComponentType::U8, ComponentType::U16])
        }
        Semantic::Positions | Semantic::Normals => (&[Type::Vec3], &QUANTIZED),
        _ => (&[Type::Vec4], &FLOAT),
    };
    let user = format!("{at}.attributes.{}", semantic.to_string());
    let Some(&index) = primitive.attributes.get(&Checked::Valid(semantic)) else { return Ok(None) };
    let accessor = Accessor::open(document, index, &user, types, components)?;
    match vertices {
        Some(n) if n != accessor.len() => Err(document.fault(
            format_args!("{user}.count"),
            accessor.len(),
            format_args!("POSITION has {n}"),
        )),
        _ => Ok(Some(accessor)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quad of two triangles: POSITION as signed bytes, COLOR_0 as normalized bytes.
    fn quad(extra: &str, needs: Needs) -> Result<Option<Primitive>, Error> {
        let mut bytes = vec![0u8, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0xFF, 0, 9, 9, 9];
        bytes.extend([0, 1, 2, 2, 1, 3]);
        bytes.extend([255, 0, 51].repeat(5));
        let json = format!(
            r#""bufferViews":[{{"buffer":0,"byteLength":36}}],"accessors":[
            {{"bufferView":0,"componentType":5120,"count":5,"type":"VEC3"}},
            {{"bufferView":0,"byteOffset":15,"componentType":5121,"count":6,"type":"SCALAR"}},
            {{"bufferView":0,"byteOffset":21,"componentType":5121,"normalized":true,"count":5,"type":"VEC3"}},
            {{"componentType":5126,"count":5,"type":"VEC3"}},
            {{"componentType":5126,"count":4,"type":"VEC3"}}],
            "meshes":[{{"primitives":[{{"indices":1,"attributes":{{"POSITION":0{extra}}}}}]}}]"#
        );
        let document = Document::for_test(&json, bytes);
        Primitive::read(&document, &document.root.meshes[0].primitives[0], "p", needs, None)
    }

    #[test]
    fn without_normals_no_vertex_is_shared() {
        let p = quad("", Needs::default()).expect("valid").expect("triangles");
        assert_eq!((p.len(), p.triangles.len()), (6, 2));
        assert_eq!(p.triangles[1], [3, 4, 5]);
        assert_eq!(p.positions[5], Vec3::new(0.0, -1.0, 0.0), "signed bytes");
    }

    #[test]
    fn with_normals_only_used_vertices_come_along() {
        let p = quad(r#","NORMAL":3,"COLOR_0":2"#, Needs { colors: true, ..Needs::default() });
        let p = p.expect("valid").expect("triangles");
        assert_eq!((p.len(), p.normals.len(), p.colors.len()), (4, 4, 4));
        assert_eq!(p.colors[0], Vec4::new(1.0, 0.0, 0.2, 1.0), "no alpha means opaque");
    }

    #[test]
    fn attributes_of_another_length_or_type_are_refused() {
        let message =
            |extra| quad(extra, Needs { uvs: [true; 2], ..Needs::default() }).err().expect(extra).to_string();
        assert!(message(r#","NORMAL":4"#).contains("p.attributes.NORMAL.count = 4"));
        assert!(message(r#","TEXCOORD_0":3"#).contains("accessors[3].type = VEC3"));
        assert!(message(r#","NORMAL":77"#).contains("no accessor"));
    }
}
