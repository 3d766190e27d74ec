//! Solids that refract: their surface must be closed, and its front outside.

use super::{Finding, Severity, node_of};
use geometry::solid::{Solid, solids};
use geometry::{Mesh, Scene};

/// Looks at each connected piece of each material that bounds a volume.
pub fn examine(scene: &Scene, found: &mut Vec<Finding>) {
    for solid in solids(scene) {
        judge(&scene.mesh, &scene.materials[solid.material.0 as usize].name, &solid, found);
    }
}

fn judge(mesh: &Mesh, material: &str, solid: &Solid, found: &mut Vec<Finding>) {
    let place = format!("{}, material \"{material}\"", node_of(mesh, solid.triangles[0]));
    if solid.open > 0 {
        found.push(Finding {
            severity: Severity::Wrong,
            kind: "glass",
            place,
            problem: format!("the solid is open: {} of its edges have no neighbour that fits", solid.open),
            remedy: "close it, or take KHR_materials_volume off (Blender: thickness 0): then it is a thin pane",
        });
    } else if solid.volume < 0.0 {
        found.push(Finding {
            severity: Severity::Wrong,
            kind: "glass",
            place,
            problem: format!("the solid of {:.3e} m3 is inside out", -solid.volume),
            remedy: "turn its faces round (Blender: Mesh, Normals, Recalculate Outside)",
        });
    }
}
