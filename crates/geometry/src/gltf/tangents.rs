//! Tangents by MikkTSpace, as glTF asks where a normal map is in use and the file has none.

use bevy_mikktspace::{Geometry, TangentSpace};

use super::primitive::Primitive;
use crate::math::{Vec3, Vec4};
use crate::triangle;

/// Fills `primitive.tangents` from its uv set; splits the vertices whose triangles disagree.
///
/// Without uv there is no direction to be had: the tangents are then any that are at right angles.
pub(super) fn generate(primitive: &mut Primitive, set: usize) {
    let finite = |v: u32| {
        let v = v as usize;
        primitive.positions[v].is_finite()
            && primitive.uvs[set][v].is_finite()
            && primitive.normals.get(v).is_none_or(|n| n.is_finite())
    };
    let faces: Vec<u32> = if primitive.uvs[set].is_empty() {
        Vec::new()
    } else {
        (0..primitive.triangles.len() as u32)
            .filter(|&t| primitive.triangles[t as usize].into_iter().all(finite))
            .collect()
    };
    let corners = vec![None; 3 * primitive.triangles.len()];
    let mut job = Job { primitive, set, faces, corners };
    // The error type has no values: this cannot fail.
    let _ = bevy_mikktspace::generate_tangents(&mut job);
    let corners = job.corners;
    assign(primitive, &corners);
}

struct Job<'a> {
    primitive: &'a Primitive,
    set: usize,
    /// Triangles with finite corners only.
    faces: Vec<u32>,
    /// Tangent of each corner of each triangle.
    corners: Vec<Option<Vec4>>,
}

impl Job<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.primitive.triangles[self.faces[face] as usize][corner] as usize
    }
}

impl Geometry for Job<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.primitive.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        match self.primitive.normals.get(self.vertex(face, corner)) {
            Some(n) => n.to_array(),
            None => {
                let [a, b, c] = [0, 1, 2].map(|k| self.primitive.positions[self.vertex(face, k)]);
                triangle::normal(a, b, c).to_array()
            }
        }
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // MikkTSpace has v upwards; in glTF it points down.
        let uv = self.primitive.uvs[self.set][self.vertex(face, corner)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let slot = 3 * self.faces[face] as usize + corner;
        self.corners[slot] = space.map(|s| Vec4::from_array(s.tangent_encoded()));
    }
}

/// Gives each vertex the tangent of its corners; corners that differ get a copy of the vertex.
fn assign(primitive: &mut Primitive, corners: &[Option<Vec4>]) {
    const NONE: u32 = u32::MAX;
    let mut given: Vec<Option<Vec4>> = vec![None; primitive.len()];
    // Copies of one vertex form a chain.
    let mut next = vec![NONE; primitive.len()];
    for t in 0..primitive.triangles.len() {
        for k in 0..3 {
            let Some(tangent) = corners[3 * t + k].filter(|t| t.is_finite()) else { continue };
            let mut v = primitive.triangles[t][k] as usize;
            loop {
                match given[v] {
                    None => {
                        given[v] = Some(tangent);
                        break;
                    }
                    // Corners of one smoothing group get the same bits.
                    Some(held) if held == tangent => break,
                    Some(_) if next[v] != NONE => v = next[v] as usize,
                    Some(_) => {
                        let copy = primitive.duplicate(v);
                        next[v] = copy;
                        given.push(Some(tangent));
                        next.push(NONE);
                        v = copy as usize;
                        break;
                    }
                }
            }
            primitive.triangles[t][k] = v as u32;
        }
    }
    let anything = |v: usize| {
        let normal = primitive.normals.get(v).map_or(Vec3::Z, |n| n.normalize_or(Vec3::Z));
        normal.any_orthonormal_vector().extend(1.0)
    };
    primitive.tangents = given.iter().enumerate().map(|(v, t)| t.unwrap_or_else(|| anything(v))).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;

    /// A unit square in the xy plane, u along x and v down, or mirrored.
    fn square(mirrored: bool) -> Primitive {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let uv = |p: &Vec3| Vec2::new(if mirrored { 1.0 - p.x } else { p.x }, 1.0 - p.y);
        Primitive {
            uvs: [positions.iter().map(uv).collect(), Vec::new()],
            normals: vec![Vec3::Z; 4],
            positions,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Primitive::default()
        }
    }

    #[test]
    fn tangents_follow_u_and_the_sign_makes_the_bitangent_point_against_v() {
        let mut p = square(false);
        generate(&mut p, 0);
        assert_eq!(p.len(), 4);
        for t in &p.tangents {
            assert!((t.truncate() - Vec3::X).length() < 1e-6, "{t}");
            // glTF: green points up in the image, that is towards smaller v, which is +y here.
            assert!((Vec3::Z.cross(t.truncate()) * t.w - Vec3::Y).length() < 1e-6);
        }
        let mut p = square(true);
        generate(&mut p, 0);
        assert!(p.tangents.iter().all(|t| (t.truncate() + Vec3::X).length() < 1e-6 && t.w == -1.0));
    }

    #[test]
    fn a_mirror_seam_splits_its_vertices() {
        let mut p = square(false);
        // The second triangle runs through u the other way.
        p.triangles[1] = [0, 4, 3];
        p.duplicate(2);
        p.uvs[0][4].x = -1.0;
        generate(&mut p, 0);
        assert!(p.len() > 5 && p.tangents.len() == p.len() && p.uvs[0].len() == p.len());
        let side = |t: usize| p.triangles[t].map(|v| p.tangents[v as usize].w);
        assert_eq!((side(0), side(1)), ([1.0; 3], [-1.0; 3]));
    }

    #[test]
    fn nan_and_missing_uv_give_some_unit_tangent() {
        let mut p = square(false);
        p.uvs[0][3].x = f32::NAN;
        p.positions[1].x = f32::INFINITY;
        generate(&mut p, 0);
        assert!(p.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-5));
        generate(&mut p, 1);
        assert!(p.tangents.iter().all(|t| t.truncate().dot(Vec3::Z).abs() < 1e-5));
    }
}
