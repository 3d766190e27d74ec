//! What one sits on, puts things on, or walks on.

use super::building::{boxes, cuboid};
use super::palette::Palette;
use crate::scenes::document::Document;
use crate::scenes::paint::{hash, unit};
use crate::scenes::round::{cylinder, rounded_box};
use crate::scenes::shapes::Shape;
use glam::{DVec2, DVec3};

/// Adds the furniture to `doc`.
pub fn furnish(doc: &mut Document, palette: &Palette) {
    let [_, _, down, top, _, _] = Shape::faces([4.3, 0.0, 1.3].into(), [7.5, 0.012, 3.3].into());
    doc.add("rug", &top.pictured(), palette.rug);
    let [left, right, _, _, back, front] = Shape::faces([4.3, 0.0, 1.3].into(), [7.5, 0.012, 3.3].into());
    doc.add("rug edge", &left.with(&right).with(&back).with(&front).with(&down), palette.rug_edge);

    sofa(doc, palette, DVec3::new(6.0, 0.0, 0.14));
    armchair(doc, palette, "left armchair", DVec3::new(4.05, 0.0, 1.75), 75.0);
    armchair(doc, palette, "right armchair", DVec3::new(7.35, 0.0, 3.55), -115.0);
    armchair(doc, palette, "other armchair", DVec3::new(9.1, 0.0, 0.85), 35.0);
    table(doc, palette, DVec3::new(5.9, 0.0, 2.4));

    shelf(
        doc,
        palette,
        "low shelf",
        Shelf { width: 1.9, tiers: 2, seed: 11 },
        DVec3::new(3.5, 0.0, 0.02),
        0.0,
    );
    shelf(
        doc,
        palette,
        "tall shelf",
        Shelf { width: 1.6, tiers: 6, seed: 23 },
        DVec3::new(0.02, 0.0, 3.0),
        90.0,
    );

    let bench = boxes(&[
        ([9.6, 0.40, 4.45], [11.4, 0.45, 4.9]),
        ([9.7, 0.0, 4.5], [9.76, 0.40, 4.85]),
        ([11.24, 0.0, 4.5], [11.3, 0.40, 4.85]),
    ]);
    doc.add("bench", &bench, palette.oak);
    let console = boxes(&[
        ([12.8, 0.78, 1.8], [13.18, 0.82, 3.2]),
        ([12.84, 0.0, 1.85], [12.88, 0.78, 1.89]),
        ([13.1, 0.0, 1.85], [13.14, 0.78, 1.89]),
        ([12.84, 0.0, 3.11], [12.88, 0.78, 3.15]),
        ([13.1, 0.0, 3.11], [13.14, 0.78, 3.15]),
    ]);
    doc.add("console", &console, palette.walnut);
    doc.add("pedestal", &cuboid([6.12, 0.0, 4.22], [6.48, 0.95, 4.58]), palette.white);
}

/// A rounded box from its corners.
fn soft(lo: [f64; 3], hi: [f64; 3], radius: f64) -> Shape {
    rounded_box(lo.into(), hi.into(), radius, 4)
}

/// Adds `shape`, made about the origin and facing +z, turned about y and moved to `at`.
fn stand(
    doc: &mut Document,
    name: String,
    shape: Shape,
    material: crate::scenes::document::MaterialId,
    at: DVec3,
    degrees: f64,
) {
    doc.add(&name, &shape.turned(DVec3::Y, degrees).moved(at), material);
}

/// A sofa two metres wide, its back toward −z, the middle of its back edge at `at`.
fn sofa(doc: &mut Document, palette: &Palette, at: DVec3) {
    let body = soft([-1.0, 0.12, 0.0], [1.0, 0.42, 0.88], 0.03)
        .with(&soft([-0.82, 0.42, 0.0], [0.82, 0.84, 0.22], 0.06))
        .with(&soft([-1.0, 0.42, 0.0], [-0.82, 0.62, 0.88], 0.05))
        .with(&soft([0.82, 0.42, 0.0], [1.0, 0.62, 0.88], 0.05))
        .with(&soft([-0.81, 0.42, 0.225], [-0.005, 0.55, 0.9], 0.05))
        .with(&soft([0.005, 0.42, 0.225], [0.81, 0.55, 0.9], 0.05));
    stand(doc, "sofa".into(), body, palette.teal, at, 0.0);
    let legs = [[-0.95, 0.03], [0.89, 0.03], [-0.95, 0.8], [0.89, 0.8]]
        .map(|[x, z]| ([x, 0.0, z], [x + 0.06, 0.12, z + 0.06]));
    stand(doc, "sofa legs".into(), boxes(&legs), palette.walnut, at, 0.0);
    // Leaning against the back, the lower edge on the seat.
    let pillow = |x: f64, turn: f64| {
        rounded_box(DVec3::new(-0.21, 0.0, -0.055), DVec3::new(0.21, 0.4, 0.055), 0.05, 6)
            .turned(DVec3::X, -18.0)
            .turned(DVec3::Y, turn)
            .moved(DVec3::new(x, 0.57, 0.43))
    };
    stand(doc, "ochre pillow".into(), pillow(-0.55, 14.0), palette.ochre, at, 0.0);
    stand(doc, "terracotta pillow".into(), pillow(0.52, -10.0), palette.terracotta, at, 0.0);
}

/// An armchair whose seat's middle is above `at`, facing +z before it is turned.
fn armchair(doc: &mut Document, palette: &Palette, name: &str, at: DVec3, degrees: f64) {
    let cloth = soft([-0.3, 0.3, -0.3], [0.3, 0.44, 0.34], 0.05).with(
        &soft([-0.3, 0.44, -0.06], [0.3, 0.92, 0.06], 0.05)
            .turned(DVec3::X, -10.0)
            .moved(DVec3::new(0.0, 0.0, -0.16)),
    );
    stand(doc, name.into(), cloth, palette.linen, at, degrees);
    let mut wood = Shape::default();
    for x in [-0.33, 0.29] {
        wood = wood.with(&boxes(&[
            ([x, 0.0, -0.3], [x + 0.04, 0.58, -0.25]),
            ([x, 0.0, 0.27], [x + 0.04, 0.58, 0.32]),
            ([x, 0.58, -0.32], [x + 0.04, 0.61, 0.34]),
        ]));
    }
    wood = wood.with(&cuboid([-0.29, 0.26, -0.27], [0.29, 0.3, 0.3]));
    stand(doc, format!("{name} frame"), wood, palette.oak, at, degrees);
}

/// A coffee table: a plate of solid glass on steel legs, a board below. Things that belong together leave 2 mm of
/// air (felt pads), for coincident faces have no order in which a ray meets them.
fn table(doc: &mut Document, palette: &Palette, at: DVec3) {
    let plate = cuboid([-0.6, 0.42, -0.35], [0.6, 0.436, 0.35]);
    stand(doc, "table plate".into(), plate, palette.table_glass, at, 0.0);
    let legs = [[-0.52, -0.27], [0.52, -0.27], [-0.52, 0.27], [0.52, 0.27]]
        .iter()
        .fold(Shape::default(), |all, &xz| all.with(&cylinder(DVec2::from(xz), 0.016, 0.014, 0.418, 24)));
    stand(doc, "table legs".into(), legs, palette.steel, at, 0.0);
    let board = cuboid([-0.5, 0.14, -0.25], [0.5, 0.16, 0.25]);
    stand(doc, "table board".into(), board, palette.oak, at, 0.0);
    let lying = [(0.25, 0.18, 0.03, 8.0, 0), (0.22, 0.16, 0.022, -12.0, 3), (0.2, 0.15, 0.03, 20.0, 1)];
    let mut y = 0.16;
    for (i, &(w, d, h, turn, color)) in lying.iter().enumerate() {
        let book = cuboid([-0.5 * w, 0.0, -0.5 * d], [0.5 * w, h, 0.5 * d]).turned(DVec3::Y, turn);
        let place = at + DVec3::new(-0.22, y, 0.02);
        stand(doc, format!("lying book {i}"), book, palette.books[color], place, 0.0);
        y += h;
    }
}

/// Measures of a bookshelf, and the number that decides which books stand in it.
struct Shelf {
    width: f64,
    tiers: u32,
    seed: u32,
}

/// A bookshelf full of books, its back toward −z, the middle of its back edge at `at`.
fn shelf(doc: &mut Document, palette: &Palette, name: &str, shelf: Shelf, at: DVec3, degrees: f64) {
    const TIER: f64 = 0.34;
    const DEPTH: f64 = 0.3;
    const BOARD: f64 = 0.022;
    let half = 0.5 * shelf.width;
    let height = f64::from(shelf.tiers) * TIER + BOARD;
    let mut case = boxes(&[
        ([-half, 0.0, 0.0], [-half + BOARD, height, DEPTH]),
        ([half - BOARD, 0.0, 0.0], [half, height, DEPTH]),
        ([-half + BOARD, 0.0, 0.0], [half - BOARD, height, 0.01]),
    ]);
    let mut books: [Shape; 5] = Default::default();
    for tier in 0..=shelf.tiers {
        let y = f64::from(tier) * TIER;
        case = case.with(&cuboid([-half + BOARD, y, 0.01], [half - BOARD, y + BOARD, DEPTH]));
        if tier == shelf.tiers {
            break;
        }
        let random = |i: u32| unit(hash(shelf.seed + tier, i));
        let mut x = -half + BOARD + 0.005;
        // The last part of a tier stays free.
        let end = half - BOARD - 0.05 - 0.5 * random(0) * half;
        for i in 1.. {
            let thick = 0.018 + 0.03 * random(8 * i);
            if x + thick > end {
                break;
            }
            let (tall, deep) = (0.2 + 0.09 * random(8 * i + 1), 0.15 + 0.07 * random(8 * i + 2));
            let foot = y + BOARD;
            let book = cuboid([x, foot, 0.02], [x + thick, foot + tall, 0.02 + deep]);
            let color = hash(shelf.seed + tier, 8 * i + 3) as usize % books.len();
            books[color] = std::mem::take(&mut books[color]).with(&book);
            // Now and then a gap.
            x += thick + if random(8 * i + 4) < 0.12 { 0.06 } else { 0.002 };
        }
    }
    stand(doc, name.into(), case, palette.oak, at, degrees);
    for (i, (shape, &material)) in books.into_iter().zip(&palette.books).enumerate() {
        stand(doc, format!("{name} books {i}"), shape, material, at, degrees);
    }
}
