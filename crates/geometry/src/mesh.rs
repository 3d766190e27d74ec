//! All triangles of a scene, indexed, in world space.

use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::MaterialId;

/// Every triangle of the scene. Vertex arrays have one length; `triangles` and `materials` another.
///
/// A triangle's front is the side from which its corners appear counter-clockwise.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals; a file without normals gets its faces' own, on vertices of their own.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, two sets; a set is empty when no texture of the scene uses it.
    pub uvs: [Vec<Vec2>; 2],
    /// Vertex colours, linear, with alpha; empty when no part has any, white where a part has none.
    pub colors: Vec<Vec4>,
    /// Tangents (xyz unit, w = ±1 the bitangent's sign); empty when no normal map is in use.
    pub tangents: Vec<Vec4>,
    /// Indices of the three corners.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub materials: Vec<MaterialId>,
    /// Runs of triangles that came from one glTF node and primitive, in order, covering `triangles`.
    pub parts: Vec<Part>,
}

/// The triangles of one primitive of one node.
#[derive(Clone, Debug)]
pub struct Part {
    /// Name of the node, for messages.
    pub name: String,
    /// First triangle.
    pub first: u32,
    /// Number of triangles.
    pub count: u32,
    /// Which node of the file, and which primitive of its mesh; `None` for a part that no file holds.
    pub source: Option<[u32; 2]>,
}

impl Part {
    /// Where it stands in the file, as messages say it.
    pub fn place(&self) -> String {
        match self.source {
            Some([node, primitive]) => {
                format!("nodes[{node}].mesh.primitives[{primitive}] \"{}\"", self.name)
            }
            None => format!("part \"{}\"", self.name),
        }
    }
}

impl Mesh {
    /// The corners of triangle `t`.
    pub fn corners(&self, t: u32) -> [Vec3; 3] {
        self.triangles[t as usize].map(|i| self.positions[i as usize])
    }

    /// Geometric unit normal of triangle `t`, on its front; zero for a triangle without area.
    pub fn geometric_normal(&self, t: u32) -> Vec3 {
        let [a, b, c] = self.corners(t);
        crate::triangle::normal(a, b, c)
    }

    /// Area of triangle `t`, m².
    pub fn area(&self, t: u32) -> f32 {
        let [a, b, c] = self.corners(t);
        crate::triangle::area(a, b, c)
    }

    /// Lowest and highest corner of the bounding box; `None` without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p))))
    }

    /// Length of the bounding box's diagonal, m; 0 without vertices.
    pub fn diagonal(&self) -> f32 {
        self.bounds().map_or(0.0, |(lo, hi)| (hi - lo).length())
    }

    /// An attribute at barycentric (u, v) of triangle `t`: w·a + u·b + v·c with w = 1 − u − v.
    pub fn interpolate<T>(&self, t: u32, u: f32, v: f32, attribute: &[T]) -> T
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let [a, b, c] = self.triangles[t as usize].map(|i| attribute[i as usize]);
        a * (1.0 - u - v) + b * u + c * v
    }
}
