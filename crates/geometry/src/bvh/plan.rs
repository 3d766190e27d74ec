//! Which nodes of the binary tree become wide nodes, and which become leaves.
//!
//! By dynamic programming (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", HPG 2017, section 3.1): of all ways to fold the tree, the one of least surface area
//! cost.

use super::binary::{Binary, LEAF};
use super::wide::WIDTH;

/// What visiting a node costs, in visits of a block; 0.7 and 1.5 measured no better.
const NODE_COST: f32 = 1.0;

/// The best way to make a forest of at most 1, 2, … 8 roots from each subtree.
pub(super) struct Plan {
    /// Area by which areas are divided, lest their sums overflow.
    whole: f64,
    /// Least cost of a forest of at most 1 … 7 roots, in visits of a block by a ray that meets the whole.
    costs: Vec<[f32; WIDTH - 1]>,
    /// How to get it, with 1 … 8 roots.
    choices: Vec<[Choice; WIDTH]>,
}

/// How a subtree becomes a forest of at most so many roots.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Choice {
    /// One root: a leaf.
    Leaf,
    /// One root: a wide node, whose children are the best forest of eight.
    Node,
    /// Both children's forests, of so many roots each.
    Split(u8, u8),
}

impl Plan {
    /// Works out all choices.
    pub fn new(binary: &Binary) -> Plan {
        let whole = binary.nodes.first().map_or(1.0, |n| n.bounds.half_area()).max(f64::MIN_POSITIVE);
        let mut plan = Plan { whole, costs: Vec::new(), choices: Vec::new() };
        plan.extend(binary);
        plan
    }

    /// Works out the choices below `root`, whose subtree was replaced by nodes new to the plan.
    pub fn replace(&mut self, binary: &Binary, root: u32) {
        self.extend(binary);
        self.choose(binary, root as usize);
    }

    /// Works out the choices of nodes new to the plan.
    fn extend(&mut self, binary: &Binary) {
        let known = self.choices.len();
        self.costs.resize(binary.nodes.len(), [0.0; WIDTH - 1]);
        self.choices.resize(binary.nodes.len(), [Choice::Leaf; WIDTH]);
        // Children come after their parents.
        for node in (known..binary.nodes.len()).rev() {
            self.choose(binary, node);
        }
    }

    /// Works out the choices of a node from its children's.
    fn choose(&mut self, binary: &Binary, at: usize) {
        let node = &binary.nodes[at];
        let area = (node.bounds.half_area() / self.whole) as f32;
        let mut best = [(f32::INFINITY, Choice::Leaf); WIDTH];
        if let Some([left, right]) = node.children {
            let (left, right) = (&self.costs[left as usize], &self.costs[right as usize]);
            best[1] = (left[0] + right[0], Choice::Split(1, 1));
            for (l, &a) in left.iter().enumerate() {
                for (r, &b) in right[..WIDTH - 1 - l].iter().enumerate() {
                    let roots = &mut best[l + r + 1];
                    if a + b < roots.0 {
                        *roots = (a + b, Choice::Split(l as u8 + 1, r as u8 + 1));
                    }
                }
            }
        }
        // The last entry is for the node's own children, of which there are at least two: never the node
        // itself.
        let cheapest = best[1..].iter().copied().min_by(|a, b| a.0.total_cmp(&b.0));
        best[WIDTH - 1] = cheapest.unwrap_or(best[0]);
        best[0] = (best[WIDTH - 1].0 + NODE_COST * area, Choice::Node);
        // A block costs the same however many triangles are in it.
        if node.count <= LEAF && area <= best[0].0 {
            best[0] = (area, Choice::Leaf);
        }
        for roots in 1..WIDTH - 1 {
            if best[roots - 1].0 <= best[roots].0 {
                best[roots] = best[roots - 1];
            }
        }
        self.choices[at] = best.map(|b| b.1);
        self.costs[at].copy_from_slice(&best.map(|b| b.0)[..WIDTH - 1]);
    }

    /// Whether this root of a forest becomes a leaf.
    pub fn is_leaf(&self, node: u32) -> bool {
        self.choices[node as usize][0] == Choice::Leaf
    }

    /// The children of a wide node made from `node`: at most eight descendants that together hold what it
    /// holds.
    pub fn children(&self, binary: &Binary, node: u32, children: &mut Vec<u32>) {
        if self.is_leaf(node) {
            children.push(node); // the root of a small tree
        } else {
            self.forest(binary, node, WIDTH, children);
        }
    }

    /// The roots of the best forest of at most `roots`, made from `node`.
    fn forest(&self, binary: &Binary, node: u32, roots: usize, out: &mut Vec<u32>) {
        match (self.choices[node as usize][roots - 1], binary.nodes[node as usize].children) {
            (Choice::Split(l, r), Some([left, right])) => {
                self.forest(binary, left, l as usize, out);
                self.forest(binary, right, r as usize, out);
            }
            _ => out.push(node),
        }
    }
}
