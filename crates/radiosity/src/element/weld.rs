//! Scene vertices to element vertices: welded where place and normal agree, apart at creases.

use super::{Vertex, VertexId};
use geometry::{Mesh, Vec3};
use std::collections::HashMap;

/// Normals less than this apart share a vertex: 20°. glTF already separates the corners of a crease; this joins
/// what flat shading separated on a wall, and keeps a box's sides apart.
const COS_CREASE: f32 = 0.94;

/// Scene vertex to element vertex, and the element vertices.
pub(super) struct Welded {
    pub vertices: Vec<Vertex>,
    pub of: Vec<VertexId>,
}

/// Welds the vertices of `mesh` that triangles use.
pub(super) fn weld(mesh: &Mesh) -> Welded {
    // A shading normal may lie across its triangle's back (bad exports): sides are told by the triangle's winding,
    // so the vertex normal must agree with it.
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let face = mesh.geometric_normal(t as u32);
        for &i in corners {
            let n = mesh.normals[i as usize];
            normals[i as usize] += if n.dot(face) < 0.0 { -n } else { n };
        }
    }
    let mut place: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.positions.len());
    let mut at_place: Vec<Vec<VertexId>> = Vec::new();
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut of = vec![VertexId::MAX; mesh.positions.len()];
    let mut place_of_vertex: Vec<u32> = Vec::new();
    for (i, &position) in mesh.positions.iter().enumerate() {
        let normal = normals[i].normalize_or_zero();
        if normal == Vec3::ZERO {
            continue; // no triangle uses it
        }
        let key = position.to_array().map(|x| (x + 0.0).to_bits()); // +0.0: −0 and 0 are one place
        let next = at_place.len() as u32;
        let p = *place.entry(key).or_insert(next);
        if p == next {
            at_place.push(Vec::new());
        }
        let here = &mut at_place[p as usize];
        let found = here.iter().copied().find(|&v| vertices[v as usize].normal.dot(normal) > COS_CREASE);
        of[i] = found.unwrap_or_else(|| {
            let v = vertices.len() as VertexId;
            vertices.push(Vertex { position, normal, piece: p, face: v });
            place_of_vertex.push(p);
            here.push(v);
            v
        });
    }
    let pieces = numbered(mesh, &of, &place_of_vertex, at_place.len());
    let each: Vec<u32> = (0..vertices.len() as u32).collect();
    let faces = numbered(mesh, &of, &each, vertices.len());
    for (vertex, (piece, face)) in vertices.iter_mut().zip(pieces.into_iter().zip(faces)) {
        (vertex.piece, vertex.face) = (piece, face);
    }
    Welded { vertices, of }
}

/// For every vertex the number of the connected set that it belongs to: triangles join the groups (`group_of`, fewer
/// than `groups`) of their corners. Union-find.
fn numbered(mesh: &Mesh, of: &[VertexId], group_of: &[u32], groups: usize) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..groups as u32).collect();
    fn root(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|i| of[i as usize]);
        if a == VertexId::MAX || b == VertexId::MAX || c == VertexId::MAX {
            continue;
        }
        let [a, b, c] = [a, b, c].map(|v| root(&mut parent, group_of[v as usize]));
        let low = a.min(b).min(c);
        for i in [a, b, c] {
            parent[i as usize] = low;
        }
    }
    let mut number = vec![u32::MAX; groups];
    let mut count = 0;
    let number_of = |&group: &u32| {
        let r = root(&mut parent, group) as usize;
        if number[r] == u32::MAX {
            number[r] = count;
            count += 1;
        }
        number[r]
    };
    group_of.iter().map(number_of).collect()
}
