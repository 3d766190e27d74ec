//! The gallery without its furniture: slabs, walls, door, window, lamps.

use super::palette::Palette;
use crate::scenes::document::{Document, MaterialId};
use crate::scenes::round::{cylinder, lathe};
use crate::scenes::shapes::Shape;
use crate::scenes::wall::pierced;
use glam::{DVec2, DVec3};

/// Walls are this thick, m.
const WALL: f64 = 0.2;
/// Height of the rooms, m.
const HEIGHT: f64 = 3.0;
/// The doorway: z and y, m.
const DOOR: [[f64; 2]; 2] = [[1.9, 2.9], [0.0, 2.1]];
/// The window: x and y, m.
const WINDOW: [[f64; 2]; 2] = [[2.6, 4.4], [0.95, 2.35]];

/// A box from `lo` to `hi`.
pub fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> Shape {
    Shape::cuboid(lo.into(), hi.into())
}

/// Several boxes as one shape.
pub fn boxes(boxes: &[([f64; 3], [f64; 3])]) -> Shape {
    boxes.iter().fold(Shape::default(), |all, &(lo, hi)| all.with(&cuboid(lo, hi)))
}

/// Adds the building to `doc`.
pub fn build(doc: &mut Document, palette: &Palette) {
    // One slab below and one above everything, the walls between them.
    doc.add("floor", &cuboid([-WALL, -0.2, -WALL], [13.4, 0.0, 5.2]).tiled(2.4), palette.planks);
    doc.add("ceiling", &cuboid([-WALL, HEIGHT, -WALL], [13.4, 3.2, 5.2]), palette.white);
    doc.add("left wall", &cuboid([-WALL, 0.0, -WALL], [0.0, HEIGHT, 5.2]), palette.plaster);
    doc.add("right wall", &cuboid([13.2, 0.0, -WALL], [13.4, HEIGHT, 5.2]), palette.plaster);
    doc.add("front wall", &cuboid([0.0, 0.0, 5.0], [13.2, HEIGHT, 5.2]), palette.plaster);
    let back = pierced(DVec3::new(0.0, 0.0, -WALL), DVec3::new(13.2, HEIGHT, 0.0), WINDOW);
    doc.add("back wall", &back, palette.plaster);
    let dividing = pierced(DVec3::new(8.0, 0.0, 0.0), DVec3::new(8.2, HEIGHT, 5.0), DOOR);
    doc.add("dividing wall", &dividing, palette.sage);

    doc.add("door frame", &door_frame(), palette.white);
    doc.add("skirting", &skirting(), palette.white);
    window(doc, palette);
    lamps(doc, palette);
}

/// The lining of the doorway: 4 cm of wood, 2 cm proud of the wall on both sides.
fn door_frame() -> Shape {
    let [[z0, z1], [_, top]] = DOOR;
    let (x0, x1, t) = (7.98, 8.22, 0.04);
    boxes(&[
        ([x0, 0.0, z0], [x1, top, z0 + t]),
        ([x0, 0.0, z1 - t], [x1, top, z1]),
        ([x0, top - t, z0 + t], [x1, top, z1 - t]),
    ])
}

/// Boards along the foot of the walls, 8 cm high and 15 mm thick.
fn skirting() -> Shape {
    let (h, t) = (0.08, 0.015);
    let [[z0, z1], _] = DOOR;
    let room = |x0: f64, x1: f64| [([x0, 0.0, 0.0], [x1, h, t]), ([x0, 0.0, 5.0 - t], [x1, h, 5.0])];
    let beside_door = |x0: f64, x1: f64| [([x0, 0.0, t], [x1, h, z0]), ([x0, 0.0, z1], [x1, h, 5.0 - t])];
    let ends = [([0.0, 0.0, t], [t, h, 5.0 - t]), ([13.2 - t, 0.0, t], [13.2, h, 5.0 - t])];
    let all = [room(0.0, 8.0), room(8.2, 13.2), beside_door(8.0 - t, 8.0), beside_door(8.2, 8.2 + t), ends];
    boxes(&all.concat())
}

/// Frame, two panes of thin glass, a sill, and the sky outside as a panel that shines inward.
fn window(doc: &mut Document, palette: &Palette) {
    let [[x0, x1], [y0, y1]] = WINDOW;
    let (z0, z1, t) = (-0.13, -0.07, 0.05);
    let middle = 0.5 * (x0 + x1);
    let frame = boxes(&[
        ([x0, y0, z0], [x0 + t, y1, z1]),
        ([x1 - t, y0, z0], [x1, y1, z1]),
        ([middle - 0.5 * t, y0 + t, z0], [middle + 0.5 * t, y1 - t, z1]),
        ([x0 + t, y0, z0], [x1 - t, y0 + t, z1]),
        ([x0 + t, y1 - t, z0], [x1 - t, y1, z1]),
    ]);
    doc.add("window frame", &frame, palette.white);
    doc.add("window sill", &cuboid([x0 - 0.05, y0 - 0.03, 0.0], [x1 + 0.05, y0, 0.16]), palette.white);
    let upright = |x0: f64, x1: f64, y0: f64, y1: f64, z: f64| {
        Shape::quad(
            DVec3::new(x0, y0, z),
            DVec3::new(x1, y0, z),
            DVec3::new(x1, y1, z),
            DVec3::new(x0, y1, z),
        )
    };
    // The panes end within the frame, so that no air is left around them.
    let (y0, y1) = (y0 + t - 0.005, y1 - t + 0.005);
    let left = upright(x0 + t - 0.005, middle - 0.5 * t + 0.005, y0, y1, -0.1);
    let right = upright(middle + 0.5 * t - 0.005, x1 - t + 0.005, y0, y1, -0.1);
    doc.add("window panes", &left.with(&right), palette.pane);
    // The painted hills end at eye height, where a horizon is.
    doc.add("sky", &upright(-2.5, 9.5, -0.4, 5.6, -1.6).pictured(), palette.sky);
}

/// Two panels under the ceiling, a ball that hangs over the table, the housing of the picture light.
fn lamps(doc: &mut Document, palette: &Palette) {
    let mut housing = Shape::default();
    let mut panels = Shape::default();
    for x in [2.2, 6.0] {
        let [left, right, down, up, back, front] =
            Shape::faces(DVec3::new(x - 0.6, 2.95, 3.05), DVec3::new(x + 0.6, HEIGHT, 3.35));
        panels = panels.with(&down);
        housing = [left, right, up, back, front].iter().fold(housing, |all, side| all.with(side));
    }
    doc.add("ceiling lamps", &panels, palette.ceiling_lamp);
    doc.add("lamp housings", &housing, palette.white);

    let (x, z) = (5.9, 2.4);
    doc.add("pendant", &Shape::sphere(DVec3::new(x, 1.95, z), 0.14, 3), palette.pendant);
    doc.add("pendant cord", &cylinder(DVec2::new(x, z), 0.006, 2.11, HEIGHT, 12), palette.walnut);
    doc.add("pendant cap", &cylinder(DVec2::new(x, z), 0.03, 2.085, 2.11, 24), palette.steel);
    // Open toward the floor: the spot shines from just below its mouth.
    let can = [(0.0, 3.0), (0.035, 3.0), (0.035, 2.9), (0.04, 2.9), (0.04, 3.0)].map(DVec2::from);
    let pieces: Vec<Vec<DVec2>> = can.windows(2).map(|edge| edge.to_vec()).collect();
    let can = lathe(&pieces[1..], 24).moved(DVec3::new(6.0, 0.0, 1.3));
    doc.add("picture light", &can, palette.walnut);
}

/// A picture on a wall: its front carries the image, the other sides are canvas. `lower_left` and `right` (unit)
/// as the viewer sees them, size in m, 3 cm deep.
pub fn picture(
    doc: &mut Document,
    name: &str,
    lower_left: DVec3,
    right: DVec3,
    size: DVec2,
    image: MaterialId,
    canvas: MaterialId,
) {
    let out = right.cross(DVec3::Y) * 0.03;
    let (r, u) = (right * size.x, DVec3::Y * size.y);
    let back = [lower_left, lower_left + r, lower_left + r + u, lower_left + u];
    let [a, b, c, d] = back.map(|p| p + out);
    doc.add(name, &Shape::quad(a, b, c, d).pictured(), image);
    let sides = (0..4).fold(Shape::quad(back[1], back[0], back[3], back[2]), |all, i| {
        let (p, q) = (back[i], back[(i + 1) % 4]);
        all.with(&Shape::quad(p, q, q + out, p + out))
    });
    doc.add(&format!("{name} canvas"), &sides, canvas);
}
