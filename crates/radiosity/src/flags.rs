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

/// What the corners of a leaf say of a point in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Voices {
    /// Weights of the corners.
    pub weights: [f32; 3],
    /// Share of what usable corners would have said that is left out, for the point does not see them.
    pub silenced: f32,
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
) -> Option<Voices> {
    let corners = elements.nodes[node as usize].vertices;
    let normalise = |w: [f32; 3]| {
        let sum: f32 = w.iter().sum();
        (sum > 1e-6).then(|| w.map(|x| x / sum))
    };
    let spoken = std::array::from_fn(|i| if usable(slot(corners[i], side)) { w[i] } else { 0.0 });
    let all: f32 = spoken.iter().sum();
    let said = |weights: [f32; 3], heard: f32| Voices { weights, silenced: 1.0 - heard / all.max(1e-6) };
    if !flags.pierced(node, side) {
        return normalise(spoken).map(|weights| said(weights, all));
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
    let seen: [f32; 3] = std::array::from_fn(|i| if sees[i] { spoken[i] } else { 0.0 });
    if let Some(weights) = normalise(seen) {
        return Some(said(weights, seen.iter().sum()));
    }
    // What sees only corners of which nothing is known, for no light comes to them, lies in the dark with them: the lit
    // ones beyond the wall must not speak for it.
    let in_the_dark = (0..3).any(|i| sees[i] && w[i] > 1e-6 && spoken[i] == 0.0);
    if in_the_dark {
        return Some(Voices { weights: [0.0; 3], silenced: 0.0 });
    }
    normalise(spoken).map(|weights| said(weights, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Material, MaterialId, Mesh, Scene};

    #[test]
    fn a_corner_beyond_a_wall_is_silenced() {
        // A floor, and a wall across it.
        let floor = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let wall = [Vec3::new(0.5, -1.0, -0.5), Vec3::new(0.5, 3.0, -0.5), Vec3::new(0.5, 0.0, 2.0)];
        let mesh = Mesh {
            positions: floor.into_iter().chain(wall).collect(),
            normals: [[Vec3::Z; 3], [Vec3::X; 3]].concat(),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            materials: vec![MaterialId(0); 2],
            ..Mesh::default()
        };
        let world = World::new(Scene { mesh, materials: vec![Material::default()], ..Scene::default() });
        let elements = Elements::new(&world.scene.mesh);
        let said = |pierced: bool, w: [f32; 3]| {
            let flags = Flags::collect(&elements, |_, _| (pierced, false));
            visible_weights(&world, &elements, &flags, |_| true, 0, Side::Front, w)
                .expect("it hears something")
        };
        let close = |a: f32, b: f32| (a - b).abs() < 1e-6;
        let all = said(false, [0.6, 0.1, 0.3]);
        assert!(close(all.silenced, 0.0) && close(all.weights[1], 0.1), "{all:?}");
        let some = said(true, [0.6, 0.1, 0.3]);
        assert!(close(some.silenced, 0.1) && some.weights[1] == 0.0, "{some:?}");
        assert!(close(some.weights[0], 2.0 / 3.0), "{some:?}");
        let beyond = said(true, [0.2, 0.7, 0.1]);
        assert!(close(beyond.silenced, 0.3) && close(beyond.weights[1], 1.0), "{beyond:?}");
    }
}
