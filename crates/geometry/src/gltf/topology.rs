//! Indices and drawing mode to triangles.

use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Mode;
use gltf::json::validation::Checked;

use super::accessor::Accessor;
use super::document::Document;
use super::error::Error;

/// The triangles of `primitive`, whose attributes have `vertices` elements; `at` is its path.
///
/// None for points and lines. Steps of a strip that repeat a corner are left out: they only join its pieces.
pub(super) fn triangles(
    document: &Document,
    primitive: &json::mesh::Primitive,
    vertices: usize,
    at: &str,
) -> Result<Option<Vec<[u32; 3]>>, Error> {
    let Checked::Valid(mode) = primitive.mode else {
        return Err(document.fault(format_args!("{at}.mode"), "?", "glTF has modes 0 to 6"));
    };
    let indices = match primitive.indices {
        None => None,
        Some(index) => {
            let unsigned = [ComponentType::U8, ComponentType::U16, ComponentType::U32];
            let user = format_args!("{at}.indices").to_string();
            Some(Accessor::open(document, index, &user, &[Type::Scalar], &unsigned)?)
        }
    };
    let count = indices.as_ref().map_or(vertices, Accessor::len);
    let (number, strip) = match mode {
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(None),
        Mode::Triangles => (count / 3, false),
        Mode::TriangleStrip | Mode::TriangleFan => (count.saturating_sub(2), true),
    };
    document.within(at, "triangles", number as u64, document.limits.triangles)?;
    if vertices > u32::MAX as usize {
        return Err(document.fault(at, vertices, "more vertices than 32 bits can count"));
    }
    let vertex = |i: usize| -> Result<u32, Error> {
        let Some(accessor) = &indices else { return Ok(i as u32) };
        let v = accessor.index(i);
        if (v as usize) < vertices {
            return Ok(v);
        }
        let problem = format!("there are only {vertices} vertices");
        Err(document.fault(format_args!("{at}.indices, element {i}"), v, problem))
    };
    let mut triangles = Vec::with_capacity(number);
    for t in 0..number {
        // glTF 2.0, 3.7.2.1; every other step of a strip runs the other way round.
        let [a, b, c] = match mode {
            Mode::TriangleStrip => [t, t + 1 + t % 2, t + 2 - t % 2],
            Mode::TriangleFan => [t + 1, t + 2, 0],
            _ => [3 * t, 3 * t + 1, 3 * t + 2],
        };
        let [a, b, c] = [vertex(a)?, vertex(b)?, vertex(c)?];
        if !(strip && (a == b || b == c || c == a)) {
            triangles.push([a, b, c]);
        }
    }
    Ok(Some(triangles))
}

/// Renumbers the vertices in use from 0 and returns the old number of each, rising.
///
/// Primitives often share one large vertex array; each takes only what it needs.
pub(super) fn compact(triangles: &mut [[u32; 3]], vertices: usize) -> Vec<u32> {
    let corners = triangles.as_flattened_mut();
    if vertices / 8 <= corners.len() {
        let mut new = vec![u32::MAX; vertices];
        for &v in corners.iter() {
            new[v as usize] = 0;
        }
        let mut used = Vec::with_capacity(vertices.min(corners.len()));
        for (old, slot) in new.iter_mut().enumerate().filter(|(_, slot)| **slot == 0) {
            *slot = used.len() as u32;
            used.push(old as u32);
        }
        corners.iter_mut().for_each(|v| *v = new[*v as usize]);
        return used;
    }
    // A table of all vertices would cost more than the primitive: a thousand of them on one array of a million.
    let mut used = corners.to_vec();
    used.sort_unstable();
    used.dedup();
    corners.iter_mut().for_each(|v| *v = used.partition_point(|u| u < v) as u32);
    used
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(mode: u32, indices: Option<&[u8]>, vertices: usize) -> Result<Option<Vec<[u32; 3]>>, Error> {
        let bytes = indices.unwrap_or_default();
        let n = bytes.len();
        let link = if indices.is_some() { r#","indices":0"# } else { "" };
        let document = Document::for_test(
            &format!(
                r#""bufferViews":[{{"buffer":0,"byteLength":{n}}}],
                "accessors":[{{"bufferView":0,"componentType":5121,"count":{n},"type":"SCALAR"}}],
                "meshes":[{{"primitives":[{{"attributes":{{}},"mode":{mode}{link}}}]}}]"#
            ),
            bytes.to_vec(),
        );
        triangles(&document, &document.root.meshes[0].primitives[0], vertices, "meshes[0].primitives[0]")
    }

    #[test]
    fn lists_strips_and_fans_keep_their_winding() {
        let of = |mode| build(mode, None, 5).expect("valid").expect("triangles");
        assert_eq!(of(4), [[0, 1, 2]]);
        assert_eq!(of(5), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(of(6), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert!(build(1, None, 5).expect("valid").is_none());
        assert!(build(9, None, 5).is_err());
    }

    #[test]
    fn indices_are_checked_and_the_bad_one_named() {
        assert_eq!(build(4, Some(&[2, 1, 0, 9]), 3).expect("valid"), Some(vec![[2, 1, 0]]));
        let message = build(4, Some(&[0, 1, 7]), 3).expect_err("7 of 3").to_string();
        assert!(message.contains("meshes[0].primitives[0].indices, element 2 = 7"), "{message}");
        assert_eq!(
            build(5, Some(&[0, 1, 2, 2, 1]), 3).expect("valid"),
            Some(vec![[0, 1, 2]]),
            "joints left out"
        );
    }

    #[test]
    fn both_ways_of_compacting_agree() {
        for vertices in [10, 10_000] {
            let mut list = [[9, 3, 5], [3, 9, 8]];
            assert_eq!(compact(&mut list, vertices), [3, 5, 8, 9]);
            assert_eq!(list, [[3, 0, 1], [0, 3, 2]]);
        }
    }
}
