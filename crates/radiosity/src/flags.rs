//! Where the mesh cannot be trusted: leaves that something pierces, and leaves that light bends in too sharply.

use crate::element::{Elements, Side, slot};
use geometry::math::offset_origin;
use geometry::{Ray, Vec3, World, triangle};

/// Something stands across the leaf: its corners may not see each other.
const PIERCED: u8 = 1;
/// The light on it bends more sharply than the mesh can follow, or a corner of it is buried.
const UNRESOLVED: u8 = 2;

/// For each node and side, what is wrong with it.
#[derive(Clone, Debug, Default)]
pub struct Flags {
    bits: Vec<u8>,
}

impl Flags {
    /// Asks for every leaf side: whether it is pierced, whether it is unresolved.
    pub(crate) fn collect(elements: &Elements, ask: impl Fn(u32, Side) -> (bool, bool) + Sync) -> Flags {
        use rayon::prelude::*;
        let mut bits = vec![0; 2 * elements.nodes.len()];
        bits.par_chunks_mut(2).enumerate().for_each(|(n, bits)| {
            let node = &elements.nodes[n];
            if !node.is_leaf() || node.vertices[0] == u32::MAX {
                return;
            }
            for side in Side::BOTH {
                let (pierced, unresolved) = ask(n as u32, side);
                bits[side.index()] = u8::from(pierced) * PIERCED + u8::from(unresolved) * UNRESOLVED;
            }
        });
        Flags { bits }
    }

    /// All of it, for a file.
    pub(crate) fn bits(&self) -> &[u8] {
        &self.bits
    }

    /// From what [`Flags::bits`] gave.
    pub(crate) fn of_bits(bits: Vec<u8>) -> Flags {
        Flags { bits }
    }

    fn get(&self, node: u32, side: Side) -> u8 {
        self.bits.get(2 * node as usize + side.index()).copied().unwrap_or(0)
    }

    /// Whether nothing was asked yet.
    pub fn is_empty(&self) -> bool {
        self.bits.is_empty()
    }

    /// Whether the mesh does not tell the light on it: it bends too sharply, or a corner is buried.
    pub fn unresolved(&self, node: u32, side: Side) -> bool {
        self.get(node, side) & UNRESOLVED != 0
    }

    /// Whether something stands across the leaf.
    pub fn pierced(&self, node: u32, side: Side) -> bool {
        self.get(node, side) & PIERCED != 0
    }

    /// Flagged leaf sides over all node sides.
    pub fn share(&self) -> f32 {
        self.bits.iter().filter(|b| **b != 0).count() as f32 / self.bits.len().max(1) as f32
    }
}

/// Corner weights of a point in a leaf, with the corners that must not speak for it left out and the rest scaled to
/// sum to 1: those whose slot is not usable, and in a pierced leaf those that the point cannot see.
///
/// `None` when no corner is usable. When none is visible, the usable ones speak after all; when only unusable ones are,
/// the weights are 0.
pub(crate) fn visible_weights(
    world: &World,
    elements: &Elements,
    flags: &Flags,
    usable: impl Fn(usize) -> bool,
    node: u32,
    side: Side,
    w: [f32; 3],
) -> Option<[f32; 3]> {
    let corners = elements.nodes[node as usize].vertices;
    let normalise = |w: [f32; 3]| {
        let sum: f32 = w.iter().sum();
        (sum > 1e-6).then(|| w.map(|x| x / sum))
    };
    let spoken = std::array::from_fn(|i| if usable(slot(corners[i], side)) { w[i] } else { 0.0 });
    if !flags.pierced(node, side) {
        return normalise(spoken);
    }
    let places = elements.corners(node);
    let normal = triangle::normal(places[0], places[1], places[2]) * side.sign();
    let lift = |p: Vec3| offset_origin(p, normal) + normal * (1e-4 * world.scale);
    let at = lift(places[0] * w[0] + places[1] * w[1] + places[2] * w[2]);
    let middle = (places[0] + places[1] + places[2]) / 3.0;
    let sees: [bool; 3] = std::array::from_fn(|i| {
        // Just inside the corner: the corner itself often lies in a wall's plane.
        let to = lift(places[i].lerp(middle, 0.02)) - at;
        let length = to.length();
        length <= 0.0 || !world.bvh.occluded(&Ray { t_max: length, ..Ray::new(at, to / length) })
    });
    let seen = std::array::from_fn(|i| if sees[i] { spoken[i] } else { 0.0 });
    // What sees only corners of which nothing is known, for no light comes to them, lies in the dark with them: the lit
    // ones beyond the wall must not speak for it.
    let in_the_dark = (0..3).any(|i| sees[i] && w[i] > 1e-6 && spoken[i] == 0.0);
    if in_the_dark && normalise(seen).is_none() {
        return Some([0.0; 3]);
    }
    normalise(seen).or_else(|| normalise(spoken))
}
