//! What one looks at: pictures, a mirror, a sculpture, pots.

use super::building::{boxes, picture};
use super::palette::Palette;
use crate::scenes::document::Document;
use crate::scenes::round::{curve, lathe, torus_knot};
use crate::scenes::shapes::Shape;
use glam::{DVec2, DVec3};

/// Adds them to `doc`.
pub fn place(doc: &mut Document, palette: &Palette) {
    let size = DVec2::new(0.66, 0.88);
    let triptych = [
        ("landscape", 5.22, palette.landscape),
        ("fields", 6.0, palette.fields),
        ("circles", 6.78, palette.circles),
    ];
    for (name, x, image) in triptych {
        picture(doc, name, DVec3::new(x - 0.33, 1.22, 0.0), DVec3::X, size, image, palette.linen);
    }
    // On the dividing wall, seen from room A: right is +z.
    let large = DVec2::splat(0.9);
    picture(doc, "relief", DVec3::new(8.0, 1.2, 3.35), DVec3::Z, large, palette.relief, palette.linen);
    // In the second room, on the front wall: right is −x.
    picture(
        doc,
        "second landscape",
        DVec3::new(11.0, 1.2, 5.0),
        DVec3::NEG_X,
        size * 1.1,
        palette.landscape,
        palette.linen,
    );

    mirror(doc, palette);
    sculpture(doc, palette);
    pots(doc, palette);
}

/// A wall mirror in an oak frame, on the dividing wall.
fn mirror(doc: &mut Document, palette: &Palette) {
    let (y0, y1, z0, z1, t) = (0.75, 1.95, 0.35, 1.25, 0.05);
    let frame = boxes(&[
        ([7.96, y0, z0], [8.0, y1, z0 + t]),
        ([7.96, y0, z1 - t], [8.0, y1, z1]),
        ([7.96, y0, z0 + t], [8.0, y0 + t, z1 - t]),
        ([7.96, y1 - t, z0 + t], [8.0, y1, z1 - t]),
    ]);
    doc.add("mirror frame", &frame, palette.oak);
    // A plate behind the frame's front edge; it ends within the frame.
    let [left, ..] =
        Shape::faces(DVec3::new(7.98, y0 + 0.04, z0 + 0.04), DVec3::new(8.0, y1 - 0.04, z1 - 0.04));
    doc.add("mirror", &left, palette.mirror);
}

/// A trefoil knot of 24 000 triangles that stands upright on its pedestal.
fn sculpture(doc: &mut Document, palette: &Palette) {
    let knot = torus_knot([2.0, 3.0], [0.19, 0.075, 0.052], 400, 30)
        .turned(DVec3::X, 90.0)
        .turned(DVec3::Z, 90.0)
        .turned(DVec3::Y, 35.0);
    let lowest = knot.positions.iter().fold(f64::INFINITY, |low, p| low.min(p.y));
    doc.add("knot", &knot.moved(DVec3::new(6.3, 0.95 - lowest, 4.4)), palette.marble);
}

/// A copper vase and a bowl on the glass table, glazed pots in both rooms.
fn pots(doc: &mut Document, palette: &Palette) {
    // Outside up, over a lip, and down the inside.
    let vase = [
        curve(&[(0.0, 0.0), (0.045, 0.0)], 1),
        curve(&[(0.045, 0.0), (0.085, 0.09), (0.07, 0.18), (0.03, 0.26), (0.045, 0.31)], 10),
        curve(&[(0.045, 0.31), (0.042, 0.312), (0.039, 0.31)], 3),
        curve(&[(0.039, 0.31), (0.025, 0.26), (0.064, 0.18), (0.078, 0.09), (0.04, 0.01), (0.0, 0.008)], 8),
    ];
    let vase = lathe(&vase, 56);
    doc.add("vase", &vase.moved(DVec3::new(6.18, 0.438, 2.3)), palette.copper);

    let bowl = [
        curve(&[(0.0, 0.0), (0.05, 0.0)], 1),
        curve(&[(0.05, 0.0), (0.11, 0.03), (0.145, 0.08)], 8),
        curve(&[(0.145, 0.08), (0.142, 0.083), (0.138, 0.08)], 3),
        curve(&[(0.138, 0.08), (0.105, 0.036), (0.05, 0.008), (0.0, 0.006)], 8),
    ];
    doc.add("bowl", &lathe(&bowl, 56).moved(DVec3::new(5.6, 0.438, 2.5)), palette.glaze);

    let pot = [
        curve(&[(0.0, 0.0), (0.11, 0.0)], 1),
        curve(&[(0.11, 0.0), (0.19, 0.16), (0.2, 0.3), (0.13, 0.42), (0.14, 0.46)], 6),
        curve(&[(0.14, 0.46), (0.13, 0.465), (0.12, 0.46)], 3),
        curve(&[(0.12, 0.46), (0.11, 0.42), (0.18, 0.3), (0.17, 0.16), (0.09, 0.02), (0.0, 0.015)], 4),
    ];
    let pot = lathe(&pot, 40);
    doc.add("tall pot", &pot.clone().moved(DVec3::new(8.65, 0.0, 3.6)), palette.glaze);
    let small = |scale: f64| {
        let mut small = pot.clone();
        small.positions.iter_mut().for_each(|p| *p *= scale);
        small
    };
    doc.add("shelf pot", &small(0.55).moved(DVec3::new(2.95, 0.702, 0.17)), palette.glaze);
    doc.add("console pot", &small(0.7).moved(DVec3::new(12.98, 0.82, 2.1)), palette.copper);
}
