//! Cameras that stand in something.

use super::{Finding, Severity, node_of};
use geometry::sampling::{Rng, sphere};
use geometry::{Camera, Ray, Surface, Vec3, World};

const RAYS: usize = 256;

/// Looks around from each camera.
pub fn examine(world: &World, cameras: &[Camera], found: &mut Vec<Finding>) {
    for (i, camera) in cameras.iter().enumerate() {
        let eye = camera.to_world.transform_point3(Vec3::ZERO);
        let mut rng = Rng::new(0x646f_6374, i as u64);
        let (mut backs, mut hits, mut near) = (0, 0, (f32::INFINITY, 0));
        let mut of_back: Vec<String> = Vec::new();
        for _ in 0..RAYS {
            let ray = Ray::new(eye, sphere(rng.vec2()));
            let Some(hit) = world.closest(&ray) else { continue };
            hits += 1;
            if hit.t < near.0 {
                near = (hit.t, hit.triangle);
            }
            if !Surface::new(&world.scene, &ray, &hit).front {
                backs += 1;
                of_back.push(node_of(&world.scene.mesh, hit.triangle));
            }
        }
        let place = format!("camera {i} \"{}\"", camera.name);
        of_back.sort_unstable();
        let one = of_back.chunk_by(|a, b| a == b).max_by_key(|run| run.len());
        // Behind the faces of one closed thing, in whatever direction.
        if let Some(run) = one
            && run.len() * 10 > RAYS * 9
            && near.0 < 0.1 * world.scale
        {
            found.push(Finding {
                severity: Severity::Wrong,
                kind: "camera",
                place,
                problem: format!("it is inside {}, {:.3} m from its surface", run[0], near.0),
                remedy: "move the camera out; or turn the faces round, if that is the room itself",
            });
        } else if near.0 < 2e-3 * world.scale {
            found.push(Finding {
                severity: Severity::Doubtful,
                kind: "camera",
                place,
                problem: format!("it is {:.4} m from {}", near.0, node_of(&world.scene.mesh, near.1)),
                remedy: "move the camera away from what it touches",
            });
        } else if hits == 0 && !sees_anything(world, camera) {
            found.push(Finding {
                severity: Severity::Doubtful,
                kind: "camera",
                place,
                problem: "it sees nothing at all".into(),
                remedy: "check the camera's place and the unit of lengths",
            });
        } else if backs * 10 > hits * 9 && hits * 2 > RAYS {
            found.push(Finding {
                severity: Severity::Doubtful,
                kind: "camera",
                place,
                problem: format!("{} % of what surrounds it turns its back to it", 100 * backs / hits),
                remedy: "turn the room's faces inward: one-sided lamps shine from their fronts only",
            });
        }
    }
}

/// Whether any of a grid of rays through the picture meets something.
fn sees_anything(world: &World, camera: &Camera) -> bool {
    const SIDE: u32 = 32;
    let at = |i: u32| (i as f32 + 0.5) / SIDE as f32;
    let aspect = camera.aspect.unwrap_or(1.0);
    (0..SIDE * SIDE).any(|i| world.closest(&camera.ray(at(i % SIDE), at(i / SIDE), aspect)).is_some())
}
