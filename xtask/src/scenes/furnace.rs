//! Rooms whose every point sends out 1 cd/m² in every direction: any renderer must paint them plain white.
//!
//! Where each surface of a closed room emits L_e and reflects ρ diffusely, and L_e = 1 − ρ, the field L = 1 solves
//! L = L_e + ρ L whatever the shapes are. What a picture shows besides white is the renderer's own error.

use super::document::Document;
use super::material::Material;
use super::shapes::Shape;
use glam::DVec3;

/// One reflectance, one emission: L = L_e / (1 − ρ) = 0.5 / (1 − 0.5).
pub fn furnace() -> Document {
    furnace_of(0.5)
}

/// The same for any reflectance below 1, in steps of 0.01.
pub fn furnace_of(rho: f64) -> Document {
    let names = ["floor", "ceiling", "left", "right", "back", "front", "ball", "block"];
    build(names.map(|name| (name, [rho; 3])))
}

/// Each surface with a colour of its own, and the emission that makes up for what it absorbs.
pub fn furnace_mixed() -> Document {
    build([
        ("floor", [0.3, 0.2, 0.1]),
        ("ceiling", [0.9, 0.9, 0.9]),
        ("left", [0.8, 0.1, 0.1]),
        ("right", [0.1, 0.8, 0.2]),
        ("back", [0.5, 0.6, 0.7]),
        ("front", [0.0, 0.0, 0.0]),
        ("ball", [0.2, 0.4, 0.9]),
        ("block", [0.95, 0.7, 0.05]),
    ])
}

/// A room of 2 m × 2 m × 2 m, a ball and a block in mid-air, the camera inside. Nothing touches, for where two
/// surfaces coincide it is undefined which of them is seen.
fn build(surfaces: [(&'static str, [f64; 3]); 8]) -> Document {
    let ball = Shape::sphere(DVec3::new(0.35, -0.3, -0.3), 0.35, 3);
    let half = DVec3::new(0.2, 0.4, 0.25);
    let block = Shape::cuboid(-half, half).turned(DVec3::Y, 25.0).moved(DVec3::new(-0.4, 0.0, -0.4));
    let [left, right, floor, ceiling, back, front] =
        Shape::faces(-DVec3::ONE, DVec3::ONE).map(Shape::flipped);
    let shapes = [floor, ceiling, left, right, back, front, ball, block];
    let mut doc = Document::default();
    for ((name, rho), shape) in surfaces.into_iter().zip(shapes) {
        let material = doc.material(&Material::lamp(name, rho.map(|rho| round(1.0 - rho)), rho));
        doc.add(name, &shape, material);
    }
    doc.camera("camera", DVec3::new(0.1, 0.1, 0.95), DVec3::new(0.0, -0.1, -0.3), 70.0, 1.0);
    doc
}

/// 1 − 0.9 is not 0.1 in binary; write what is meant.
fn round(x: f64) -> f64 {
    (x * 100.0).round() / 100.0
}
