//! The tree that rays see: nodes of eight boxes, blocks of four triangles, both lane by lane.

use super::binary::{self, Binary, LEAF};
use super::plan::Plan;
use crate::Mesh;

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Triangles of a block.
pub(super) const LANES: usize = LEAF as usize;
/// Set in a reference to a block; the other bits count blocks, or nodes.
pub(super) const BLOCK: u32 = 1 << 31;
/// Levels below which obvhs's tree is followed no further but halved, so that the depth is bounded.
const DEEP: u32 = 24;
/// References a traversal may have to hold: at each level all children but the one it goes on with. Halving
/// 2³² triangles down to blocks takes 30 binary levels; each level of wide nodes undoes at least one.
pub(super) const STACK: usize = (DEEP as usize + 30) * (WIDTH - 1) + 1;

/// By how much a box, and the origin of a ray, are widened, relative to each coordinate: 8 units of rounding. Two
/// take the slab test's own roundings (of the reciprocal and the result), four those of the triangle test's shear,
/// so that no box is missed whose triangle is met.
pub(super) const WIDEN: f32 = 4.0 * f32::EPSILON;

/// Eight boxes: `bounds[0]` the least corners, `bounds[1]` the greatest, each by axis, then by child.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Corners of the boxes. A child that is not there has an inside-out box, which no ray meets.
    pub bounds: [[[f32; WIDTH]; 3]; 2],
    /// Where the children are.
    pub child: [u32; WIDTH],
}

/// Four triangles.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
pub(super) struct Block {
    /// Corners: by corner, by axis, by triangle. All zero where there is no triangle: no area, no hit.
    pub corners: [[[f32; LANES]; 3]; 3],
    /// Their indices in the mesh.
    pub triangle: [u32; LANES],
}

/// The tree. Node 0 is the root; an empty mesh has a root without children.
#[derive(Debug)]
pub(super) struct Tree {
    /// All nodes.
    pub nodes: Vec<Node>,
    /// All blocks.
    pub blocks: Vec<Block>,
}

impl Tree {
    /// Memory taken, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..])
    }
}

/// Folds a binary tree into a wide one, by the plan of least cost.
pub(super) fn fold(mesh: &Mesh, binary: Binary) -> Tree {
    fold_to(mesh, binary, DEEP)
}

/// As [`fold`], with the level `deep` below which the tree is halved.
pub(super) fn fold_to(mesh: &Mesh, mut binary: Binary, deep: u32) -> Tree {
    let mut tree = Tree { nodes: vec![Node::empty()], blocks: Vec::with_capacity(binary.order.len() / 3) };
    // Depth first, so that a subtree is together in memory.
    let mut stack = Vec::new();
    if !binary.nodes.is_empty() {
        stack.push((0, 0, 0));
    }
    let mut plan = Plan::new(&binary);
    let mut children = Vec::with_capacity(WIDTH);
    while let Some((from, to, depth)) = stack.pop() {
        if depth == deep {
            let node = binary.nodes[from as usize];
            binary.halve(mesh, from, node.first, node.count);
            plan.replace(&binary, from);
        }
        children.clear();
        plan.children(&binary, from, &mut children);
        // Where any hit will do, the last child met is visited first: the one with the most area for each of its
        // triangles, likely to be hit and cheap to ask. Of rays that all meet something, 57 % more a second than in
        // the order of the binary tree; by area alone 3 %, blocks first 46 %.
        let promise = |&child: &u32| {
            let node = binary.nodes[child as usize];
            node.bounds.half_area() / f64::from(node.count.max(1))
        };
        children.sort_by(|a, b| promise(a).total_cmp(&promise(b)));
        for (lane, &child) in children.iter().enumerate().rev() {
            let source = binary.nodes[child as usize];
            let reference = if plan.is_leaf(child) {
                let range = source.first as usize..(source.first + source.count) as usize;
                tree.blocks.push(Block::new(mesh, &binary.order[range]));
                BLOCK | (tree.blocks.len() as u32 - 1)
            } else {
                tree.nodes.push(Node::empty());
                let at = tree.nodes.len() as u32 - 1;
                stack.push((child, at, depth + 1));
                at
            };
            tree.nodes[to as usize].set(lane, &source.bounds, reference);
        }
    }
    if tree.blocks.is_empty() {
        tree.blocks.push(Block::new(mesh, &[])); // what the lanes without a child refer to
    }
    tree
}

impl Node {
    fn empty() -> Node {
        Node { bounds: [[[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]], child: [BLOCK; WIDTH] }
    }

    fn set(&mut self, lane: usize, bounds: &binary::Bounds, child: u32) {
        for axis in 0..3 {
            self.bounds[0][axis][lane] = bounds.lo[axis] - WIDEN * bounds.lo[axis].abs();
            self.bounds[1][axis][lane] = bounds.hi[axis] + WIDEN * bounds.hi[axis].abs();
        }
        self.child[lane] = child;
    }
}

impl Block {
    fn new(mesh: &Mesh, triangles: &[u32]) -> Block {
        let mut triangles = triangles.to_vec();
        triangles.sort_unstable();
        let mut block = Block { corners: [[[0.0; LANES]; 3]; 3], triangle: [u32::MAX; LANES] };
        for (lane, t) in triangles.into_iter().enumerate() {
            block.triangle[lane] = t;
            for (corner, p) in mesh.corners(t).into_iter().enumerate() {
                for axis in 0..3 {
                    block.corners[corner][axis][lane] = p[axis];
                }
            }
        }
        block
    }
}
