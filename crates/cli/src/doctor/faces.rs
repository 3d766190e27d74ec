//! Faces that stand in one another's place, slivers, and curves without smooth normals.

use super::{Finding, Severity, node_of};
use geometry::{Mesh, Part, Scene, Vec3};
use std::collections::HashMap;

/// A sliver's height over its length.
const SLIVER: f32 = 1e-4;

/// Looks at all triangles.
pub fn examine(scene: &Scene, found: &mut Vec<Finding>) {
    twins(scene, found);
    for part in &scene.mesh.parts {
        slivers(&scene.mesh, part, found);
        facets(&scene.mesh, part, found);
    }
}

/// Triangles of different materials with the same corners; the loader has dropped those of one material.
fn twins(scene: &Scene, found: &mut Vec<Finding>) {
    let mesh = &scene.mesh;
    let key = |t: u32| {
        let mut corners = mesh.corners(t).map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
        corners.sort_unstable();
        corners
    };
    let mut first: HashMap<[[u32; 3]; 3], u32> = HashMap::with_capacity(mesh.triangles.len());
    let mut pairs: Vec<((String, String), usize)> = Vec::new();
    for t in 0..mesh.triangles.len() as u32 {
        let other = *first.entry(key(t)).or_insert(t);
        if other != t {
            let names = (node_of(mesh, other), node_of(mesh, t));
            match pairs.iter_mut().find(|(n, _)| *n == names) {
                Some((_, count)) => *count += 1,
                None => pairs.push((names, 1)),
            }
        }
    }
    for ((a, b), count) in pairs {
        found.push(Finding {
            severity: Severity::Wrong,
            kind: "faces",
            place: format!("{a} and {b}"),
            problem: format!(
                "{count} triangles of two materials stand in the same place: which one shows is chance"
            ),
            remedy: "delete one of the two, or move it by a millimetre",
        });
    }
}

fn triangles(part: &Part) -> std::ops::Range<u32> {
    part.first..part.first + part.count
}

fn slivers(mesh: &Mesh, part: &Part, found: &mut Vec<Finding>) {
    let thin = |&t: &u32| {
        let [a, b, c] = mesh.corners(t);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        2.0 * mesh.area(t) < SLIVER * longest * longest
    };
    let count = triangles(part).filter(thin).count();
    // Boolean modelling leaves a few of them everywhere.
    if count > 10 && count * 50 > part.count as usize {
        found.push(Finding {
            severity: Severity::Doubtful,
            kind: "faces",
            place: part.place(),
            problem: format!("{count} of {} triangles are needles, 10000 times longer than high", part.count),
            remedy: "merge vertices by distance and triangulate anew",
        });
    }
}

/// Parts whose triangles meet at small angles, yet each with a normal of its own: curves that will show facets.
fn facets(mesh: &Mesh, part: &Part, found: &mut Vec<Finding>) {
    let flat = |t: u32| {
        let n = mesh.geometric_normal(t);
        mesh.triangles[t as usize].iter().all(|&v| mesh.normals[v as usize].dot(n) > 0.999_99)
    };
    if part.count < 100 || !triangles(part).all(flat) {
        return;
    }
    let mut normal_at: HashMap<[[u32; 3]; 2], Vec3> = HashMap::new();
    let (mut bent, mut edges) = (0, 0);
    for t in triangles(part) {
        let [a, b, c] = mesh.corners(t);
        let n = mesh.geometric_normal(t);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let mut edge = [p, q].map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
            edge.sort_unstable();
            if let Some(other) = normal_at.insert(edge, n) {
                edges += 1;
                // 1.5° to 30°.
                bent += usize::from((0.866..0.999_66).contains(&other.dot(n)));
            }
        }
    }
    if bent * 3 > edges {
        found.push(Finding {
            severity: Severity::Doubtful,
            kind: "normals",
            place: part.place(),
            problem: format!("it looks curved, but its {} triangles have no smooth normals", part.count),
            remedy: "export smooth normals (Blender: Shade Auto Smooth, and Normals in the glTF export)",
        });
    }
}
