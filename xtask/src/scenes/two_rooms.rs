//! The smallest scene in which light leaks: two closed rooms, a lamp in the one, the camera in the other.
//!
//! Floor and ceiling are one slab each that runs on beneath and above the dividing wall, so that an element of a
//! coarse mesh can have corners in both rooms. Nothing connects the rooms: the picture is exactly black.

use super::document::Document;
use super::material::Material;
use super::shapes::Shape;
use glam::DVec3;

/// Two rooms of 3 m × 3 m × 2.5 m with a wall of 10 cm between them.
pub fn two_rooms() -> Document {
    let mut doc = Document::default();
    let white = doc.material(&Material::lambert("white", [0.75; 3]));
    let lamp = doc.material(&Material::lamp("lamp", [4000.0; 3], [0.75; 3]));
    let slabs = [
        ("floor", [-0.1, -0.1, -0.1], [6.2, 0.0, 3.1]),
        ("ceiling", [-0.1, 2.5, -0.1], [6.2, 2.6, 3.1]),
        ("left wall", [-0.1, 0.0, -0.1], [0.0, 2.5, 3.1]),
        ("right wall", [6.1, 0.0, -0.1], [6.2, 2.5, 3.1]),
        ("back wall", [0.0, 0.0, -0.1], [6.1, 2.5, 0.0]),
        ("front wall", [0.0, 0.0, 3.0], [6.1, 2.5, 3.1]),
        ("dividing wall", [3.0, 0.0, 0.0], [3.1, 2.5, 3.0]),
    ];
    for (name, lo, hi) in slabs {
        doc.add(name, &Shape::cuboid(lo.into(), hi.into()), white);
    }
    let [left, right, down, up, back, front] =
        Shape::faces(DVec3::new(1.2, 2.45, 1.2), DVec3::new(1.8, 2.5, 1.8));
    doc.add("lamp housing", &left.with(&right).with(&up).with(&back).with(&front), white);
    doc.add("lamp", &down, lamp);
    doc.camera("camera", DVec3::new(5.8, 1.5, 2.7), DVec3::new(3.1, 1.0, 1.2), 60.0, 1.0);
    doc
}
