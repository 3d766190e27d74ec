//! The first mesh: fine enough for the rooms, while the ground around the house stays coarse.

use crate::element::{Elements, VertexId};
use geometry::World;
use geometry::flights::{Flight, flights};

/// Elements (of the longest edge squared each) that it may have, about.
const ELEMENTS: f32 = 10_000.0;
/// Rays that tell what is looked at from near by.
const LOOKS: usize = 65_536;
/// A leaf longer than so many times the upper quartile of the looks may be ground outside.
const LARGE: f32 = 4.0;
/// What is looked at from no nearer than so many times its length is fine enough for those who look.
const NEAR: f32 = 1.5;

/// Elements no longer than `h0` (m), where there are not too many of them; and how long they are in the rooms, m.
///
/// One face may be the floor of a room and the ground for a hundred metres around. Leaves that are large are split
/// only where something near looks at them.
pub(crate) fn first_mesh(world: &World, h0: f32, most: usize) -> (Elements, f32) {
    let mesh = &world.scene.mesh;
    let mut elements = Elements::new(mesh);
    let triangles = elements.leaves().count();
    let area: f32 = (0..mesh.triangles.len() as u32).map(|t| mesh.area(t)).sum();
    let mut longest = h0.max((area / ELEMENTS).sqrt());
    // By the root: the ground outside has all the area, the furniture all the triangles.
    let looks = if longest > h0 { flights(mesh, &world.bvh, LOOKS, 0.5) } else { Vec::new() };
    let large = LARGE * quartile(&looks);
    if !elements.leaves().any(|leaf| elements.longest_edge(leaf) > large.max(longest)) {
        elements.split_longer_than(longest, most);
        return (elements, longest);
    }
    loop {
        loop {
            let near = near(&elements, &looks, large);
            if !elements.halve_longer_than(longest, most, |leaf| near[leaf as usize]) {
                break;
            }
        }
        let made = elements.leaves().count() - triangles;
        if longest <= h0 || made as f32 > 2.0 * ELEMENTS || elements.vertices.len() > most / 2 {
            return (elements, longest);
        }
        longest = h0.max(longest * std::f32::consts::FRAC_1_SQRT_2);
    }
}

/// For each node whether something near looks at it; what is no longer than `large` (m) goes by the part of the surface of
/// that size that it lies in.
fn near(elements: &Elements, looks: &[Flight], large: f32) -> Vec<bool> {
    let mut nearest = vec![f32::INFINITY; elements.nodes.len()];
    for look in looks {
        let ends = [(look.from, look.at), (look.hit.triangle, [look.hit.u, look.hit.v])];
        for (triangle, at) in ends.into_iter().filter(|&(t, _)| elements.piece(t).is_some()) {
            elements.visit_path(triangle, at, |node| {
                nearest[node as usize] = nearest[node as usize].min(look.hit.t);
            });
        }
    }
    let mut near = vec![true; elements.nodes.len()];
    // Children come after their parents.
    for (node, of) in elements.nodes.iter().enumerate() {
        if of.vertices[0] == VertexId::MAX {
            continue;
        }
        let length = elements.longest_edge(node as u32);
        if length > large {
            near[node] = nearest[node] < NEAR * length;
        }
        for child in of.children() {
            near[child as usize] = near[node];
        }
    }
    near
}

/// Upper quartile of the lengths of `looks`, m; infinite without any.
fn quartile(looks: &[Flight]) -> f32 {
    let mut lengths: Vec<f32> = looks.iter().map(|look| look.hit.t).collect();
    let at = lengths.len() * 3 / 4;
    if lengths.is_empty() { f32::INFINITY } else { *lengths.select_nth_unstable_by(at, f32::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Material, MaterialId, Mesh, Scene, Vec3};

    /// A hut of 4 x 3 x 4 m whose floor is the ground for 100 m around.
    fn hut() -> World {
        let mut mesh = Mesh::default();
        let mut quad = |corners: [[f32; 3]; 4]| {
            let first = mesh.positions.len() as u32;
            let p = corners.map(Vec3::from_array);
            mesh.positions.extend(p);
            mesh.normals.extend([(p[1] - p[0]).cross(p[2] - p[0]).normalize(); 4]);
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            mesh.materials.extend([MaterialId(0); 2]);
        };
        let g = 100.0;
        quad([[-g, 0.0, g], [g, 0.0, g], [g, 0.0, -g], [-g, 0.0, -g]]);
        quad([[-2.0, 3.0, -2.0], [2.0, 3.0, -2.0], [2.0, 3.0, 2.0], [-2.0, 3.0, 2.0]]);
        for (a, b) in [([-2.0, -2.0], [2.0, -2.0]), ([2.0, -2.0], [2.0, 2.0]), ([2.0, 2.0], [-2.0, 2.0])] {
            quad([[a[0], 0.0, a[1]], [b[0], 0.0, b[1]], [b[0], 3.0, b[1]], [a[0], 3.0, a[1]]]);
        }
        World::new(Scene { mesh, materials: vec![Material::default()], ..Scene::default() })
    }

    #[test]
    fn the_floor_of_a_room_is_fine_and_the_ground_around_it_coarse() {
        let world = hut();
        let (elements, longest) = first_mesh(&world, 0.1, 1_000_000);
        // As many elements spread evenly over the ground are 2 m long.
        assert!(longest <= 1.0, "{longest}");
        let (mut inside, mut outside) = (0f32, f32::INFINITY);
        for leaf in elements.leaves() {
            let [a, b, c] = elements.corners(leaf);
            let middle = (a + b + c) / 3.0;
            if middle.abs().max_element() < 2.0 {
                inside = inside.max(elements.longest_edge(leaf));
            } else if middle.length() > 80.0 {
                outside = outside.min(elements.longest_edge(leaf));
            }
        }
        assert!(inside <= longest, "{inside} in the room, {longest} asked");
        assert!(outside > 5.0, "{outside} far outside");
        assert!(elements.leaves().count() < 100_000, "{}", elements.leaves().count());
    }
}
