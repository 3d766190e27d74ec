//! The forest of split triangles: split edges and middles, find the leaf under a point.

use super::weld::weld;
use super::{Vertex, VertexId};
use geometry::{Mesh, Vec3};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::Range;

/// A triangle of the element mesh; a leaf until it is split.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Its corners.
    pub vertices: [VertexId; 3],
    /// First of its children; 0 for a leaf (node 0 is a root, never a child).
    pub(crate) child: u32,
    /// The edge from corner `edge` to the next one is the one that was split; or [`MIDDLE`].
    pub(crate) edge: u8,
}

/// In place of an edge: the node was split in three, at its middle.
pub(crate) const MIDDLE: u8 = 3;

impl Node {
    /// Whether it was not split.
    pub fn is_leaf(&self) -> bool {
        self.child == 0
    }

    /// Its children: two or three, none for a leaf.
    pub fn children(&self) -> Range<u32> {
        let count = match (self.is_leaf(), self.edge) {
            (true, _) => 0,
            (false, MIDDLE) => 3,
            (false, _) => 2,
        };
        self.child..self.child.saturating_add(count)
    }
}

/// The element mesh.
#[derive(Clone, Debug)]
pub struct Elements {
    /// Vertices; the scene's own come first, midpoints after them.
    pub vertices: Vec<Vertex>,
    /// Nodes; node t is the root of scene triangle t. A root without area keeps corners of `VertexId::MAX`.
    pub nodes: Vec<Node>,
    /// Number of pieces of connected surface.
    pub pieces: u32,
    /// Number of faces.
    pub faces: u32,
    /// Number of scene triangles.
    pub roots: u32,
}

/// Edges to split, with the midpoint each has got (or `VertexId::MAX` before it has).
#[derive(Default)]
pub struct EdgeMarks {
    midpoints: HashMap<u64, VertexId, BuildHasherDefault<MixHasher>>,
}

impl EdgeMarks {
    /// Marks the edge between `a` and `b`.
    pub fn mark(&mut self, a: VertexId, b: VertexId) {
        self.midpoints.entry(key(a, b)).or_insert(VertexId::MAX);
    }

    /// How many edges are marked.
    pub fn len(&self) -> usize {
        self.midpoints.len()
    }

    /// Whether no edge is marked.
    pub fn is_empty(&self) -> bool {
        self.midpoints.is_empty()
    }

    /// Every marked edge with its midpoint, in the order of the midpoints.
    pub fn split_edges(&self) -> Vec<(VertexId, VertexId, VertexId)> {
        let mut all: Vec<_> = self
            .midpoints
            .iter()
            .filter(|(_, m)| **m != VertexId::MAX)
            .map(|(&k, &m)| ((k >> 32) as VertexId, k as VertexId, m))
            .collect();
        all.sort_unstable_by_key(|&(_, _, m)| m);
        all
    }
}

fn key(a: VertexId, b: VertexId) -> u64 {
    (u64::from(a.min(b)) << 32) | u64::from(a.max(b))
}

/// Edge keys are looked up by the million; the standard hasher's flood protection is not needed for our own ids.
#[derive(Default)]
pub struct MixHasher(u64);

impl Hasher for MixHasher {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, _: &[u8]) {
        unreachable!("edge keys are u64");
    }
    fn write_u64(&mut self, x: u64) {
        let x = (x ^ (x >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = x ^ (x >> 29);
    }
}

impl Elements {
    /// One leaf for each triangle of `mesh` that has an area.
    pub fn new(mesh: &Mesh) -> Elements {
        let welded = weld(mesh);
        let nodes = mesh
            .triangles
            .iter()
            .map(|corners| {
                let vertices = corners.map(|i| welded.of[i as usize]);
                let whole = vertices.iter().all(|&v| v != VertexId::MAX);
                Node { vertices: if whole { vertices } else { [VertexId::MAX; 3] }, child: 0, edge: 0 }
            })
            .collect();
        let pieces = welded.vertices.iter().map(|v| v.piece + 1).max().unwrap_or(0);
        let faces = welded.vertices.iter().map(|v| v.face + 1).max().unwrap_or(0);
        Elements { vertices: welded.vertices, nodes, pieces, faces, roots: mesh.triangles.len() as u32 }
    }

    /// Indices of the leaves, in order.
    pub fn leaves(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.nodes.len() as u32).filter(|&i| {
            let node = &self.nodes[i as usize];
            node.is_leaf() && node.vertices[0] != VertexId::MAX
        })
    }

    /// The corners' positions of a node.
    pub fn corners(&self, node: u32) -> [Vec3; 3] {
        self.nodes[node as usize].vertices.map(|v| self.vertices[v as usize].position)
    }

    /// The edges of a node, each with its lower vertex first.
    pub fn edges(&self, node: u32) -> [(VertexId, VertexId); 3] {
        let v = self.nodes[node as usize].vertices;
        [0, 1, 2].map(|e| (v[e].min(v[(e + 1) % 3]), v[e].max(v[(e + 1) % 3])))
    }

    /// A third of the area of the leaves around each vertex, m².
    pub fn vertex_areas(&self) -> Vec<f32> {
        let mut areas = vec![0.0; self.vertices.len()];
        for leaf in self.leaves() {
            let [a, b, c] = self.corners(leaf);
            for v in self.nodes[leaf as usize].vertices {
                areas[v as usize] += geometry::triangle::area(a, b, c) / 3.0;
            }
        }
        areas
    }

    /// Calls `visit` for every leaf with its scene triangle and the barycentrics (u, v) of its middle there.
    pub fn visit_leaves(&self, roots: u32, mut visit: impl FnMut(u32, u32, [f32; 2])) {
        self.visit_leaf_corners(roots, |leaf, root, uv| {
            visit(leaf, root, [0, 1].map(|k| (uv[0][k] + uv[1][k] + uv[2][k]) / 3.0));
        });
    }

    /// Calls `visit` for every leaf with its scene triangle and the barycentrics (u, v) of its corners there.
    pub fn visit_leaf_corners(&self, roots: u32, mut visit: impl FnMut(u32, u32, [[f32; 2]; 3])) {
        for root in 0..roots {
            if self.nodes[root as usize].vertices[0] == VertexId::MAX {
                continue;
            }
            let mut open = vec![(root, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0f32]])];
            while let Some((at, uv)) = open.pop() {
                let node = &self.nodes[at as usize];
                if node.is_leaf() {
                    visit(at, root, uv);
                    continue;
                }
                if node.edge == MIDDLE {
                    let m = [0, 1].map(|k| (uv[0][k] + uv[1][k] + uv[2][k]) / 3.0);
                    open.extend((0..3).map(|k| {
                        let mut corners = uv;
                        corners[k] = m;
                        (node.child + k as u32, corners)
                    }));
                    continue;
                }
                let e = node.edge as usize;
                let (p, q, r) = (uv[e], uv[(e + 1) % 3], uv[(e + 2) % 3]);
                let m = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
                open.extend([(node.child, [p, m, r]), (node.child + 1, [m, q, r])]);
            }
        }
    }

    /// The piece of surface that scene triangle `t` belongs to; `None` for one without area.
    pub fn piece(&self, t: u32) -> Option<u32> {
        let v = self.nodes[t as usize].vertices[0];
        (v != VertexId::MAX).then(|| self.vertices[v as usize].piece)
    }

    /// The face that scene triangle `t` belongs to; `None` for one without area.
    pub fn face(&self, t: u32) -> Option<u32> {
        let v = self.nodes[t as usize].vertices[0];
        (v != VertexId::MAX).then(|| self.vertices[v as usize].face)
    }

    /// The face that a leaf belongs to.
    pub fn face_of(&self, leaf: u32) -> u32 {
        self.vertices[self.nodes[leaf as usize].vertices[0] as usize].face
    }

    /// The piece of surface that a leaf belongs to.
    pub fn piece_of(&self, leaf: u32) -> usize {
        self.vertices[self.nodes[leaf as usize].vertices[0] as usize].piece as usize
    }

    /// The leaf that holds the point (u, v) of scene triangle `t`, with the weights of the leaf's three corners.
    pub fn locate(&self, t: u32, u: f32, v: f32) -> (u32, [f32; 3]) {
        self.descend(t, u, v, |_| ())
    }

    /// Calls `visit` for every node that holds the point (u, v) of scene triangle `t`, from the root to the leaf.
    pub fn visit_path(&self, t: u32, [u, v]: [f32; 2], visit: impl FnMut(u32)) {
        self.descend(t, u, v, visit);
    }

    fn descend(&self, t: u32, u: f32, v: f32, mut visit: impl FnMut(u32)) -> (u32, [f32; 3]) {
        let mut at = t;
        let mut w = [(1.0 - u - v).max(0.0), u, v];
        loop {
            visit(at);
            let node = &self.nodes[at as usize];
            if node.is_leaf() {
                return (at, w);
            }
            if node.edge == MIDDLE {
                // Child k has the middle in place of corner k, of which its points have least.
                let k = if w[0] <= w[1] && w[0] <= w[2] { 0 } else { 2 - usize::from(w[1] <= w[2]) };
                let least = w[k];
                w = w.map(|w| w - least);
                w[k] = 3.0 * least;
                at = node.child + k as u32;
                continue;
            }
            // Corners p → q of the split edge, r opposite. Children: (p, m, r) and (m, q, r); with m = (p + q)/2 a
            // point's weights on p and q become |w_p − w_q| on the nearer one and 2 min on m.
            let e = node.edge as usize;
            let (wp, wq, wr) = (w[e], w[(e + 1) % 3], w[(e + 2) % 3]);
            if wp >= wq {
                at = node.child;
                w = [wp - wq, 2.0 * wq, wr];
            } else {
                at = node.child + 1;
                w = [2.0 * wp, wq - wp, wr];
            }
        }
    }

    /// Splits every leaf that has a marked edge, until none has; gives the marked edges their midpoints.
    ///
    /// A leaf is split at its longest marked edge first, which keeps angles as good as the marks allow.
    pub fn split(&mut self, marks: &mut EdgeMarks) {
        let mut open: Vec<u32> = self.leaves().collect();
        while let Some(at) = open.pop() {
            let corners = self.nodes[at as usize].vertices;
            let length2 = |e: usize| {
                let (a, b) = (corners[e], corners[(e + 1) % 3]);
                self.vertices[a as usize].position.distance_squared(self.vertices[b as usize].position)
            };
            let marked = (0..3)
                .filter(|&e| marks.midpoints.contains_key(&key(corners[e], corners[(e + 1) % 3])))
                .max_by(|&a, &b| length2(a).total_cmp(&length2(b)).then(b.cmp(&a)));
            let Some(e) = marked else { continue };
            let (p, q, r) = (corners[e], corners[(e + 1) % 3], corners[(e + 2) % 3]);
            let m = self.midpoint(p, q, marks);
            let child = self.nodes.len() as u32;
            self.nodes.push(Node { vertices: [p, m, r], child: 0, edge: 0 });
            self.nodes.push(Node { vertices: [m, q, r], child: 0, edge: 0 });
            let node = &mut self.nodes[at as usize];
            (node.child, node.edge) = (child, e as u8);
            open.extend([child, child + 1]);
        }
    }

    /// Splits a leaf in three at its middle, which becomes a vertex; no other leaf takes notice.
    pub fn split_at_middle(&mut self, leaf: u32) -> VertexId {
        let corners = self.nodes[leaf as usize].vertices;
        let [a, b, c] = corners.map(|v| self.vertices[v as usize]);
        let middle = self.vertices.len() as VertexId;
        let normal = (a.normal + b.normal + c.normal).normalize_or(a.normal);
        let position = (a.position + b.position + c.position) / 3.0;
        self.vertices.push(Vertex { position, normal, ..a });
        let child = self.nodes.len() as u32;
        for k in 0..3 {
            let mut vertices = corners;
            vertices[k] = middle;
            self.nodes.push(Node { vertices, child: 0, edge: 0 });
        }
        let node = &mut self.nodes[leaf as usize];
        (node.child, node.edge) = (child, MIDDLE);
        middle
    }

    fn midpoint(&mut self, p: VertexId, q: VertexId, marks: &mut EdgeMarks) -> VertexId {
        let entry = marks.midpoints.get_mut(&key(p, q)).expect("only marked edges are split");
        if *entry == VertexId::MAX {
            let (a, b) = (self.vertices[p as usize], self.vertices[q as usize]);
            *entry = self.vertices.len() as VertexId;
            let normal = (a.normal + b.normal).normalize_or(a.normal);
            let position = 0.5 * (a.position + b.position);
            self.vertices.push(Vertex { position, normal, ..a });
        }
        *entry
    }

    /// Splits until no edge is longer than `longest`, but stops short of `most` vertices.
    pub fn split_longer_than(&mut self, longest: f32, most: usize) {
        loop {
            let mut marks = EdgeMarks::default();
            for at in self.leaves() {
                let corners = self.nodes[at as usize].vertices;
                for e in 0..3 {
                    let (a, b) = (corners[e], corners[(e + 1) % 3]);
                    let length =
                        self.vertices[a as usize].position.distance(self.vertices[b as usize].position);
                    if length > longest {
                        marks.mark(a, b);
                    }
                }
            }
            if marks.is_empty() || self.vertices.len() + marks.len() > most {
                return;
            }
            self.split(&mut marks);
        }
    }

    /// Halves the longest edge, where it is longer than `longest`, of all leaves that are `wanted`, and those of the leaves
    /// beside them that are longer still: so no slivers come of it (Rivara, "Algorithms for refining triangular grids
    /// suitable for adaptive and multigrid techniques", Int. J. Numer. Methods Eng. 20, 1984). Whether there were any; none
    /// where that made more than `most` vertices.
    pub fn halve_longer_than(&mut self, longest: f32, most: usize, wanted: impl Fn(u32) -> bool) -> bool {
        let large: Vec<(u32, (VertexId, VertexId))> =
            self.leaves().filter(|&l| self.longest_edge(l) > longest).map(|l| (l, self.ends(l))).collect();
        let mut marks = EdgeMarks::default();
        for &(leaf, (a, b)) in &large {
            if wanted(leaf) {
                marks.mark(a, b);
            }
        }
        let mut known = 0;
        while marks.len() > known {
            known = marks.len();
            for &(leaf, (a, b)) in &large {
                let v = self.nodes[leaf as usize].vertices;
                if (0..3).any(|e| marks.midpoints.contains_key(&key(v[e], v[(e + 1) % 3]))) {
                    marks.mark(a, b);
                }
            }
        }
        if marks.is_empty() || self.vertices.len() + marks.len() > most {
            return false;
        }
        self.split(&mut marks);
        true
    }

    /// The ends of the longest edge of a leaf.
    fn ends(&self, leaf: u32) -> (VertexId, VertexId) {
        let (corners, v) = (self.corners(leaf), self.nodes[leaf as usize].vertices);
        let length = |e: &usize| corners[*e].distance(corners[(*e + 1) % 3]);
        let longest = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)).then(b.cmp(a))).unwrap_or(0);
        (v[longest], v[(longest + 1) % 3])
    }

    /// Length of the longest edge of a leaf, m.
    pub fn longest_edge(&self, leaf: u32) -> f32 {
        let [a, b, c] = self.corners(leaf);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::MaterialId;

    fn square() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            normals: vec![Vec3::Z; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![MaterialId(0); 2],
            ..Mesh::default()
        }
    }

    #[test]
    fn location_and_position_agree_after_splitting() {
        let mesh = square();
        let mut elements = Elements::new(&mesh);
        elements.split_longer_than(0.4, 100_000);
        elements.leaves().step_by(2).collect::<Vec<_>>().into_iter().for_each(|leaf| {
            elements.split_at_middle(leaf);
        });
        elements.split_longer_than(0.2, 100_000);
        for (t, u, v) in [(0, 0.3, 0.4), (1, 0.01, 0.98), (0, 0.0, 0.0), (1, 0.33, 0.33)] {
            let (leaf, w) = elements.locate(t, u, v);
            let [a, b, c] = elements.corners(leaf);
            let p = a * w[0] + b * w[1] + c * w[2];
            let want = mesh.interpolate(t, u, v, &mesh.positions);
            assert!(p.distance(want) < 1e-6, "{p} {want}");
            assert!(w.iter().all(|&x| x >= 0.0) && (w.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        }
        // The other way about: the leaves' corners are where the scene's triangles have them.
        let mut area = 0.0;
        elements.visit_leaf_corners(2, |leaf, t, uv| {
            let corners = elements.corners(leaf);
            area += geometry::triangle::area(corners[0], corners[1], corners[2]);
            for (corner, [u, v]) in corners.into_iter().zip(uv) {
                let want = mesh.interpolate(t, u, v, &mesh.positions);
                assert!(corner.distance(want) < 1e-6, "{corner} {want}");
            }
        });
        assert!((area - 1.0).abs() < 1e-5, "{area}");
    }

    #[test]
    fn no_edge_is_left_with_a_vertex_hanging_on_it() {
        let mut elements = Elements::new(&square());
        elements.split_longer_than(0.3, 100_000);
        let mut marks = EdgeMarks::default();
        marks.mark(0, elements.nodes[elements.leaves().next().unwrap() as usize].vertices[1]);
        elements.split(&mut marks);
        let leaves: Vec<u32> = elements.leaves().collect();
        for &leaf in &leaves {
            let [a, b, c] = elements.corners(leaf);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let m = 0.5 * (p + q);
                assert!(elements.vertices.iter().all(|v| v.position.distance(m) > 1e-5), "vertex on an edge");
            }
        }
        let area: f32 = leaves
            .iter()
            .map(|&l| elements.corners(l))
            .map(|[a, b, c]| geometry::triangle::area(a, b, c))
            .sum();
        assert!((area - 1.0).abs() < 1e-5);
    }

    #[test]
    fn one_flat_square_is_one_piece_with_four_vertices() {
        let elements = Elements::new(&square());
        assert_eq!((elements.vertices.len(), elements.pieces), (4, 1));
    }
}
