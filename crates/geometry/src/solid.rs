//! The solids that light passes: connected pieces of the surface of materials that bound a volume.

use crate::{MaterialId, Mesh, Scene, Vec3};
use std::collections::HashMap;

/// One connected piece.
#[derive(Clone, Debug)]
pub struct Solid {
    /// What it is made of.
    pub material: MaterialId,
    /// Its triangles, rising.
    pub triangles: Vec<u32>,
    /// Edges that are not shared by two triangles which run along them in opposite ways: 0 for a closed surface.
    pub open: usize,
    /// Enclosed, m³; negative when inside out.
    pub volume: f64,
    /// Lowest and highest corner, m.
    pub bounds: (Vec3, Vec3),
}

/// All solids of `scene`, by material and then by their first triangle. Corners in one place, bit for bit, are joined.
pub fn solids(scene: &Scene) -> Vec<Solid> {
    let solid: Vec<bool> = scene.materials.iter().map(|m| m.enclosed().is_some()).collect();
    let mut of_material: Vec<Vec<u32>> = vec![Vec::new(); scene.materials.len()];
    for (t, m) in scene.mesh.materials.iter().enumerate() {
        if solid[m.0 as usize] {
            of_material[m.0 as usize].push(t as u32);
        }
    }
    let of = |(m, triangles): (usize, Vec<u32>)| pieces(&scene.mesh, MaterialId(m as u32), &triangles);
    of_material.into_iter().enumerate().flat_map(of).collect()
}

/// The bits of a place; −0 is 0.
fn place(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

fn pieces(mesh: &Mesh, material: MaterialId, triangles: &[u32]) -> Vec<Solid> {
    let mut number: HashMap<[u32; 3], u32> = HashMap::new();
    let mut corners: Vec<[u32; 3]> = Vec::with_capacity(triangles.len());
    for &t in triangles {
        corners.push(mesh.corners(t).map(|p| {
            let next = number.len() as u32;
            *number.entry(place(p)).or_insert(next)
        }));
    }
    let mut parent: Vec<u32> = (0..number.len() as u32).collect();
    for [a, b, c] in &corners {
        let a = root(&mut parent, *a);
        for v in [*b, *c] {
            let v = root(&mut parent, v);
            parent[v as usize] = a;
        }
    }
    // Of each edge, how often it is run along upward less downward.
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for [a, b, c] in &corners {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            *edges.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let far = Vec3::splat(f32::INFINITY);
    let mut of_root: HashMap<u32, Solid> = HashMap::new();
    for (t, c) in triangles.iter().zip(&corners) {
        let solid = of_root.entry(root(&mut parent, c[0])).or_insert_with(|| Solid {
            material,
            triangles: Vec::new(),
            open: 0,
            volume: 0.0,
            bounds: (far, -far),
        });
        solid.triangles.push(*t);
        let [p, q, r] = mesh.corners(*t);
        solid.bounds = (solid.bounds.0.min(p.min(q).min(r)), solid.bounds.1.max(p.max(q).max(r)));
        let [p, q, r] = [p, q, r].map(|p| p.as_dvec3());
        solid.volume += p.dot(q.cross(r)) / 6.0;
    }
    for ((a, _), balance) in edges {
        if balance != 0
            && let Some(solid) = of_root.get_mut(&root(&mut parent, a))
        {
            solid.open += 1;
        }
    }
    let mut all: Vec<Solid> = of_root.into_values().collect();
    all.sort_by_key(|solid| solid.triangles[0]);
    all
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}
