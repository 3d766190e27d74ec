//! The scene doctor: what in a scene will make its picture slow, dark, leaky or wrong, where, and what to do.
//!
//! It judges the scene as loaded, in world space; a finding names the node or the material, as the file does.

mod camera;
mod faces;
mod glass;
mod light;
mod rooms;

use geometry::gltf::Loaded;
use geometry::{Mesh, World};
use serde::Serialize;

/// Something that is wrong, or probably so.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// Which kind: "glass", "albedo", "light", "faces", "normals", "room" or "camera".
    pub kind: &'static str,
    /// Where in the file.
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
    let mut out: Vec<Finding> = Vec::new();
    for finding in found {
        let of_kind = |f: &&Finding| f.kind == finding.kind && f.remedy == finding.remedy;
        match out.iter().filter(of_kind).count() {
            n if n < SHOWN => out.push(finding),
            n if n == SHOWN => {
                out.push(Finding { place: "…".into(), problem: "and 1 more".into(), ..finding })
            }
            _ => {
                let last =
                    out.iter_mut().rev().find(|f| f.kind == finding.kind && f.remedy == finding.remedy);
                let Some(last) = last else { continue };
                let more = last.problem.split(' ').nth(1).and_then(|n| n.parse::<usize>().ok()).unwrap_or(1);
                last.problem = format!("and {} more", more + 1);
            }
        }
    }
    out
}

/// The node that a triangle belongs to, as messages name it.
fn node_of(mesh: &Mesh, triangle: u32) -> String {
    let after = mesh.parts.partition_point(|p| p.first <= triangle);
    let part = after.checked_sub(1).and_then(|i| mesh.parts.get(i));
    part.map_or_else(|| "the mesh".into(), |p| format!("node \"{}\"", p.name))
}

#[cfg(test)]
mod tests;
