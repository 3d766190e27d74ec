//! The binary tree: obvhs's, with the bounds recomputed from the triangles and every leaf small.

use super::items::Item;
use crate::Mesh;
use crate::math::{Vec3, Vec3A};
use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Most triangles in a leaf: what one block of the wide tree holds.
pub(super) const LEAF: u32 = 4;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Least corner.
    pub lo: Vec3,
    /// Greatest corner.
    pub hi: Vec3,
}

impl Bounds {
    /// Around nothing.
    pub fn empty() -> Bounds {
        Bounds { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY }
    }

    /// Around some points.
    pub fn of(points: &[Vec3]) -> Bounds {
        points.iter().fold(Bounds::empty(), |b, &p| Bounds { lo: b.lo.min(p), hi: b.hi.max(p) })
    }

    /// Around both.
    pub fn union(&self, o: &Bounds) -> Bounds {
        Bounds { lo: self.lo.min(o.lo), hi: self.hi.max(o.hi) }
    }

    /// Its middle; in f64, where no sum of two f32 overflows.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.lo.as_dvec3() + self.hi.as_dvec3())
    }

    /// Longest side; 0 for no box.
    pub fn longest_side(&self) -> f64 {
        (self.hi.as_dvec3() - self.lo.as_dvec3()).max_element().max(0.0)
    }

    /// Half its surface, up to a factor common to all boxes of a scene; f64, lest it overflow or vanish.
    pub fn half_area(&self) -> f64 {
        let d = self.hi.as_dvec3() - self.lo.as_dvec3();
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// A node of the binary tree; its triangles are a range of the tree's order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Around its triangles.
    pub bounds: Bounds,
    /// First of its triangles.
    pub first: u32,
    /// How many they are.
    pub count: u32,
    /// Its two children; `None` for a leaf, which has at most [`LEAF`] triangles.
    pub children: Option<[u32; 2]>,
}

/// A binary tree over triangles. Node 0 is the root; there is none over an empty mesh.
pub(super) struct Binary {
    /// All nodes.
    pub nodes: Vec<Node>,
    /// The mesh's triangles as the leaves have them.
    pub order: Vec<u32>,
}

/// Builds the tree over `items`, whose triangles are ranges of `order`.
pub(super) fn build(mesh: &Mesh, items: &[Item], order: Vec<u32>) -> Binary {
    let mut tree = Binary { nodes: Vec::with_capacity(items.len()), order: Vec::with_capacity(order.len()) };
    if items.is_empty() {
        return tree;
    }
    let source = cluster(items);

    // Down: parents before children, leaves from left to right, so that every node covers a range of the
    // order. A stack of our own, since a tree may be as deep as it has leaves.
    tree.nodes.push(Node { bounds: Bounds::empty(), first: 0, count: 0, children: None });
    let mut stack = vec![(0u32, 0u32)]; // node of obvhs's, node of ours
    let mut inner = Vec::new();
    while let Some((from, to)) = stack.pop() {
        let node = &source.nodes[from as usize];
        if node.is_leaf() {
            let first = tree.order.len() as u32;
            let leaves = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            for &i in &source.primitive_indices[leaves] {
                let item = &items[i as usize];
                let triangles = item.first as usize..(item.first + item.count) as usize;
                tree.order.extend_from_slice(&order[triangles]);
            }
            let count = tree.order.len() as u32 - first;
            tree.halve(mesh, to, first, count);
        } else {
            let [left, right] = tree.push_children(to);
            inner.push(to);
            stack.push((node.first_index + 1, right));
            stack.push((node.first_index, left));
        }
    }
    // Up: the bounds and ranges of the inner nodes.
    for &i in inner.iter().rev() {
        tree.join(i);
    }
    tree
}

impl Binary {
    /// Makes node `at` the root of a balanced tree over `count` triangles of the order from `first` on.
    ///
    /// Splits at the median of the centroids along the axis of their widest spread; equal centroids by index.
    /// So it needs no more than log₂ n levels, whatever the triangles.
    pub fn halve(&mut self, mesh: &Mesh, at: u32, first: u32, count: u32) {
        let triangles = &mut self.order[first as usize..(first + count) as usize];
        if count <= LEAF {
            let bounds =
                triangles.iter().fold(Bounds::empty(), |b, &t| b.union(&Bounds::of(&mesh.corners(t))));
            self.nodes[at as usize] = Node { bounds, first, count, children: None };
            return;
        }
        let centre = |t: u32| Bounds::of(&mesh.corners(t)).centre();
        let (lo, hi) = triangles.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &t| {
            let c = centre(t);
            (lo.min(c), hi.max(c))
        });
        let axis = (hi - lo).max_position();
        // A multiple of the block's size on the left, so that blocks are full.
        let middle = (count / 2).next_multiple_of(LEAF);
        triangles.select_nth_unstable_by(middle as usize, |&a, &b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b))
        });
        let [left, right] = self.push_children(at);
        self.halve(mesh, left, first, middle);
        self.halve(mesh, right, first + middle, count - middle);
        self.join(at);
    }

    /// Gives node `at` two children, yet empty.
    fn push_children(&mut self, at: u32) -> [u32; 2] {
        let next = self.nodes.len() as u32;
        let empty = Node { bounds: Bounds::empty(), first: 0, count: 0, children: None };
        self.nodes.extend([empty, empty]);
        self.nodes[at as usize].children = Some([next, next + 1]);
        [next, next + 1]
    }

    /// Sets bounds and range of an inner node from its children.
    fn join(&mut self, at: u32) {
        let Some(children) = self.nodes[at as usize].children else { return };
        let [left, right] = children.map(|c| self.nodes[c as usize]);
        let node = &mut self.nodes[at as usize];
        node.bounds = left.bounds.union(&right.bounds);
        node.first = left.first;
        node.count = left.count + right.count;
    }
}

/// How much a box may grow, relative to its longest side, before obvhs sees it.
///
/// Where every pair of neighbours has a union of the same size, PLOC joins one pair in each pass: a row of 65
/// 537 equal triangles one apart took 33 s, and takes 0.06 s with boxes that differ by as little as this.
const JITTER: f32 = 1.0 / 64.0;

/// Three numbers in [0, 1] that look unlike those of any other `n`.
fn noise(n: u32) -> Vec3A {
    let mix = |x: u32| {
        let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
        let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
        (x ^ (x >> 16)) as f32 / u32::MAX as f32
    };
    let n = n.wrapping_mul(3);
    Vec3A::new(mix(n), mix(n.wrapping_add(1)), mix(n.wrapping_add(2)))
}

/// obvhs's tree over the items' boxes: PLOC, reinsertion, leaves joined, reinsertion again (its medium
/// preset).
fn cluster(items: &[Item]) -> Bvh2 {
    // Into the unit cube, so that areas neither overflow nor vanish; only the shape of the tree is used.
    let scene = items.iter().fold(Bounds::empty(), |b, i| b.union(&i.bounds));
    let (origin, scale) = (scene.lo.as_dvec3(), 1.0 / scene.longest_side().max(f64::MIN_POSITIVE));
    let unit = |p: Vec3| Vec3A::from(((p.as_dvec3() - origin) * scale).as_vec3());
    let boxes: Vec<Aabb> = items
        .iter()
        .enumerate()
        .map(|(n, i)| {
            let (lo, hi) = (unit(i.bounds.lo), unit(i.bounds.hi));
            Aabb::new(lo, hi + JITTER * (hi - lo).max_element() * noise(n as u32))
        })
        .collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        &boxes,
        (0..boxes.len() as u32).collect(),
        SortPrecision::U64,
        3,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut tree, 0.05, None);
    leaf_collapser::collapse(&mut tree, LEAF, 1.0);
    optimizer.run(&mut tree, 0.1, None);
    tree
}
