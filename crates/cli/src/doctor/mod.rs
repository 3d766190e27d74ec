//! The scene doctor: what in a scene will make its picture slow, dark, leaky or wrong, where, and what to do.
//!
//! It judges the scene as loaded, in world space; a finding names the node or the material, as the file does.

mod camera;
mod faces;
mod glass;
mod light;
mod rooms;

use geometry::gltf::Loaded;
use geometry::{Mesh, Part, World};
use serde::Serialize;
use std::collections::HashMap;

/// Something that is wrong, or probably so.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// Which kind: "glass", "albedo", "light", "faces", "normals", "room" or "camera".
    pub kind: &'static str,
    /// Where in the file: a JSON path and the name there.
    pub place: String,
    /// What is wrong, with its numbers.
    pub problem: String,
    /// What to do.
    pub remedy: &'static str,
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The picture will be wrong.
    Wrong,
    /// It may be, or take long.
    Doubtful,
}

/// How many findings of one kind are listed.
const SHOWN: usize = 8;

/// Examines what was loaded. The scene is taken, for a world is built of it.
pub fn examine(loaded: &Loaded) -> Vec<Finding> {
    let scene = loaded.scene.clone();
    let mut found = Vec::new();
    light::materials(&scene, &mut found);
    faces::examine(&scene, &mut found);
    glass::examine(&scene, &mut found);
    let world = World::new(scene);
    light::levels(&world, &mut found);
    rooms::examine(&world, &mut found);
    camera::examine(&world, &loaded.cameras, &mut found);
    shorten(found)
}

/// Of each kind the first few, and how many more there are.
fn shorten(found: Vec<Finding>) -> Vec<Finding> {
    let kind = |f: &Finding| (f.kind, f.remedy);
    let mut all: HashMap<_, usize> = HashMap::new();
    for finding in &found {
        *all.entry(kind(finding)).or_default() += 1;
    }
    let mut seen: HashMap<_, usize> = HashMap::new();
    let mut out = Vec::new();
    for finding in found {
        let before = seen.entry(kind(&finding)).or_default();
        match *before {
            n if n < SHOWN => out.push(finding),
            n if n == SHOWN => {
                let problem = format!("and {} more", all[&kind(&finding)] - SHOWN);
                out.push(Finding { place: "…".into(), problem, ..finding });
            }
            _ => {}
        }
        *before += 1;
    }
    out
}

/// The node that a triangle belongs to, as messages name it.
fn node_of(mesh: &Mesh, triangle: u32) -> String {
    let after = mesh.parts.partition_point(|p| p.first <= triangle);
    let part = after.checked_sub(1).and_then(|i| mesh.parts.get(i));
    part.map_or_else(|| "the mesh".into(), Part::place)
}

#[cfg(test)]
mod tests;
