//! Triangles to elements and vertices: a forest over the scene's triangles.
//!
//! Every scene triangle is the root of a tree; a node is split at the midpoint of one of its edges, or in three at its
//! middle. An edge is split for all triangles that share it, so the leaves meet without cracks or hanging vertices.

pub mod cluster;
mod forest;
mod weld;

pub(crate) use forest::MIDDLE;
pub use forest::{EdgeMarks, Elements, Node};

use geometry::Vec3;

/// Index of a vertex of the element mesh.
pub type VertexId = u32;

/// Which side of a surface: light arrives at each side on its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From where the triangle's corners run counter-clockwise.
    Front,
    /// The other one.
    Back,
}

impl Side {
    /// Both.
    pub const BOTH: [Side; 2] = [Side::Front, Side::Back];

    /// The side that a ray meets.
    pub fn met(front: bool) -> Side {
        if front { Side::Front } else { Side::Back }
    }

    /// 0 or 1.
    pub fn index(self) -> usize {
        self as usize
    }

    /// +1 or −1: what the front's normal is multiplied with.
    pub fn sign(self) -> f32 {
        match self {
            Side::Front => 1.0,
            Side::Back => -1.0,
        }
    }
}

/// Index of a value at one side of one vertex: 2 · vertex + side.
pub fn slot(vertex: VertexId, side: Side) -> usize {
    2 * vertex as usize + side.index()
}

/// A vertex of the element mesh: scene vertices that share a place and (nearly) a normal, or the midpoint of an edge.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// World space, m.
    pub position: Vec3,
    /// Unit, on the front.
    pub normal: Vec3,
    /// Which connected piece of surface it belongs to; pieces touch where vertices share a place.
    pub piece: u32,
    /// Which face of the piece: what hangs together without a crease. The six sides of a box are one piece, and light
    /// may come to one of them only.
    pub face: u32,
}
