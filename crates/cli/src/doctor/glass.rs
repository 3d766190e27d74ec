//! Solids that refract: their surface must be closed, and its front outside.

use super::{Finding, Severity, node_of};
use geometry::{Mesh, Scene, Vec3};
use std::collections::HashMap;

/// Looks at each connected piece of each material that bounds a volume.
pub fn examine(scene: &Scene, found: &mut Vec<Finding>) {
    for (m, material) in scene.materials.iter().enumerate().filter(|(_, m)| m.enclosed().is_some()) {
        let triangles: Vec<u32> = (0..scene.mesh.triangles.len() as u32)
            .filter(|&t| scene.mesh.materials[t as usize].0 as usize == m)
            .collect();
        for piece in pieces(&scene.mesh, &triangles) {
            judge(&scene.mesh, &material.name, &piece, found);
        }
    }
}

fn judge(mesh: &Mesh, material: &str, piece: &Piece, found: &mut Vec<Finding>) {
    let place = format!("{}, material \"{material}\"", node_of(mesh, piece.triangles[0]));
    if piece.open > 0 {
        found.push(Finding {
            severity: Severity::Wrong,
            kind: "glass",
            place,
            problem: format!("the solid is open: {} of its edges have no neighbour that fits", piece.open),
            remedy: "close it, or take KHR_materials_volume off (Blender: thickness 0): then it is a thin pane",
        });
    } else if piece.volume < 0.0 {
        found.push(Finding {
            severity: Severity::Wrong,
            kind: "glass",
            place,
            problem: format!("the solid of {:.3e} m3 is inside out", -piece.volume),
            remedy: "turn its faces round (Blender: Mesh, Normals, Recalculate Outside)",
        });
    }
}

/// Triangles that share edges.
struct Piece {
    triangles: Vec<u32>,
    /// Edges that are not shared by two triangles which run along them in opposite ways.
    open: usize,
    /// Enclosed, m³; negative when inside out.
    volume: f64,
}

type Corner = [u32; 3];

/// The bits of a place; −0 is 0.
fn corner(p: Vec3) -> Corner {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

fn pieces(mesh: &Mesh, triangles: &[u32]) -> Vec<Piece> {
    let mut number: HashMap<Corner, u32> = HashMap::new();
    let mut corners: Vec<[u32; 3]> = Vec::with_capacity(triangles.len());
    for &t in triangles {
        corners.push(mesh.corners(t).map(|p| {
            let next = number.len() as u32;
            *number.entry(corner(p)).or_insert(next)
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
    // Of each edge, how often it is run along upward less downward, and how often at all.
    let mut edges: HashMap<(u32, u32), (i32, u32)> = HashMap::new();
    for [a, b, c] in &corners {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            let edge = edges.entry((from.min(to), from.max(to))).or_default();
            *edge = (edge.0 + if from < to { 1 } else { -1 }, edge.1 + 1);
        }
    }
    let mut of_root: HashMap<u32, Piece> = HashMap::new();
    for (t, c) in triangles.iter().zip(&corners) {
        let [p, q, r] = mesh.corners(*t).map(|p| p.as_dvec3());
        let piece = of_root.entry(root(&mut parent, c[0]));
        let piece = piece.or_insert_with(|| Piece { triangles: Vec::new(), open: 0, volume: 0.0 });
        piece.triangles.push(*t);
        piece.volume += p.dot(q.cross(r)) / 6.0;
    }
    for ((a, _), (balance, _)) in edges {
        if balance != 0
            && let Some(piece) = of_root.get_mut(&root(&mut parent, a))
        {
            piece.open += 1;
        }
    }
    let mut all: Vec<Piece> = of_root.into_values().collect();
    all.sort_by_key(|piece| piece.triangles[0]);
    all
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}
