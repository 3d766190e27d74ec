//! Rooms that exist to grow: written beside the results, never into `assets/`.

use crate::scenes::document::Document;
use crate::scenes::gallery::{CAMERAS, gallery};
use crate::scenes::material::Material;
use crate::scenes::shapes::Shape;
use glam::DVec3;
use std::f64::consts::TAU;

/// Size of the room, m.
const SIZE: DVec3 = DVec3::new(6.0, 3.0, 6.0);
/// Area of all its lamps together, m², and what they shine, cd/m².
const LAMPS: f64 = 0.36;
const RADIANCE: f64 = 10_000.0;
/// How far below the ceiling they hang, m.
const GAP: f64 = 0.1;

/// A room with three blocks, `lamps` square lamps in rows below its ceiling, which shine the same light in all however
/// many they are, walls that reflect `rho` (0.6 is usual), and `views` cameras in a circle, called `view 1` and so on.
pub fn room(lamps: u32, rho: f64, views: u32) -> Document {
    let mut doc = Document::default();
    let paint = doc.material(&Material::lambert("paint", [rho; 3]));
    let red = doc.material(&Material::lambert("red", [rho, 0.2 * rho, 0.2 * rho]));
    let lamp = doc.material(&Material::lamp("lamp", [RADIANCE; 3], [0.0; 3]));
    let [left, right, floor, ceiling, back, front] = Shape::faces(DVec3::ZERO, SIZE).map(Shape::flipped);
    doc.add("left", &left, red);
    for (name, wall) in
        [("right", right), ("floor", floor), ("ceiling", ceiling), ("back", back), ("front", front)]
    {
        doc.add(name, &wall, paint);
    }
    for (i, height) in [0.5, 1.0, 1.5].into_iter().enumerate() {
        let half = DVec3::new(0.3, 0.5 * height, 0.3);
        let at = on_circle(i as f64 / 3.0, 1.0, half.y + 0.01);
        doc.add("block", &Shape::cuboid(-half, half).turned(DVec3::Y, 20.0 * i as f64).moved(at), paint);
    }
    doc.add("lamps", &grid(lamps), lamp);
    for i in 0..views {
        let turn = f64::from(i) / f64::from(views);
        doc.camera(&view(i), on_circle(turn + 0.05, 2.7, 1.6), on_circle(turn + 0.55, 1.0, 1.0), 60.0, 1.0);
    }
    doc
}

/// The gallery and the names of `views` of its cameras: of its own three, the first of which took the reference, and where that
/// is not enough of more around the middle of the first room.
pub fn tour(views: u32) -> (Document, Vec<String>) {
    let mut doc = gallery();
    let mut names: Vec<String> = CAMERAS.iter().take(views as usize).map(|s| s.to_string()).collect();
    for i in 3..views {
        let (sin, cos) = (TAU * f64::from(i - 3) / f64::from(views - 3)).sin_cos();
        let from = DVec3::new(4.0 + 3.2 * cos, 1.6, 2.5 + 1.9 * sin);
        doc.camera(&view(i), from, DVec3::new(4.0 - cos, 1.2, 2.5 - sin), 52.0, 1.5);
        names.push(view(i));
    }
    (doc, names)
}

/// Name of the camera `i`, from 0.
pub fn view(i: u32) -> String {
    format!("view {}", i + 1)
}

/// `count` squares that face down, in rows as even as the number allows.
fn grid(count: u32) -> Shape {
    let columns = f64::from(count).sqrt().ceil();
    let rows = (f64::from(count) / columns).ceil();
    let half = 0.5 * (LAMPS / f64::from(count)).sqrt();
    let lamp = |i: u32| {
        let (column, row) = (f64::from(i) % columns, (f64::from(i) / columns).floor());
        let (x, z) = (SIZE.x * (column + 0.5) / columns, SIZE.z * (row + 0.5) / rows);
        let corner = |dx: f64, dz: f64| DVec3::new(x + dx * half, SIZE.y - GAP, z + dz * half);
        Shape::quad(corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0))
    };
    (0..count).fold(Shape::default(), |all, i| all.with(&lamp(i)))
}

/// A point around the middle of the room; `turn` is 1 for once around.
fn on_circle(turn: f64, radius: f64, height: f64) -> DVec3 {
    let (sin, cos) = (TAU * turn).sin_cos();
    DVec3::new(0.5 * SIZE.x + radius * cos, height, 0.5 * SIZE.z + radius * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_face_down_and_share_one_area() {
        for count in [1, 2, 16, 17] {
            let lamps = grid(count);
            assert_eq!(lamps.triangles.len(), 2 * count as usize);
            assert!(lamps.normals.iter().all(|n| n.distance(DVec3::NEG_Y) < 1e-12));
            let corner = |i: u32| lamps.positions[i as usize];
            let area =
                |&[a, b, c]: &[u32; 3]| 0.5 * (corner(b) - corner(a)).cross(corner(c) - corner(a)).length();
            assert!((lamps.triangles.iter().map(area).sum::<f64>() - LAMPS).abs() < 1e-12);
            assert!(lamps.positions.iter().all(|p| p.cmpge(DVec3::ZERO).all() && p.cmple(SIZE).all()));
        }
    }
}
