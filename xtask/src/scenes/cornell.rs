//! The Cornell box as measured, and the same room with a mirror ball and a glass ball.
//!
//! Geometry and spectra: Cornell University Program of Computer Graphics, "Cornell Box Data". Millimetres there,
//! metres here. Every surface is Lambertian.

use super::document::{Document, MaterialId};
use super::material::{Material, Volume};
use super::shapes::Shape;
use glam::DVec3;

/// The measured reflectance spectra (400 to 700 nm in steps of 4) as linear Rec. 709: each spectrum times daylight
/// D65, weighted with the CIE 1931 2° observer, divided by what a perfect white gives, through the matrix of
/// ITU-R BT.709. Linear light in three channels only resembles spectra, so a picture of this room cannot equal a
/// spectral one; two RGB renderers can equal one another.
const WHITE: [f64; 3] = [0.7384, 0.7358, 0.7399];
const GREEN: [f64; 3] = [0.0686, 0.3979, 0.0867];
const RED: [f64; 3] = [0.4936, 0.0492, 0.0512];
const LAMP: [f64; 3] = [0.78, 0.78, 0.78];

/// The measured lamp (400 nm: 0, 500: 8.0, 600: 15.6, 700: 18.4; linear between) by the same observer and matrix,
/// scaled to a luminance of 10 000 cd/m². The original is in arbitrary units; this gives the 1.3 dm² lamp 430 lm,
/// an old 40 W bulb's worth, and the picture a mean of some 100 cd/m².
const LIGHT: [f64; 3] = [16750.0, 8777.0, 2241.0];

/// The room with its two blocks.
pub fn cornell_box() -> Document {
    cornell_box_in(Document::default())
}

/// The same, added to a document that may subdivide it.
pub fn cornell_box_in(mut doc: Document) -> Document {
    let white = room(&mut doc);
    let short = [[130.0, 165.0, 65.0], [82.0, 165.0, 225.0], [240.0, 165.0, 272.0], [290.0, 165.0, 114.0]];
    let tall = [[423.0, 330.0, 247.0], [265.0, 330.0, 296.0], [314.0, 330.0, 456.0], [472.0, 330.0, 406.0]];
    doc.add("short block", &Shape::prism(short.map(metres), 0.0), white);
    doc.add("tall block", &Shape::prism(tall.map(metres), 0.0), white);
    doc
}

/// The room with a perfect mirror and solid glass: what radiosity alone cannot show.
pub fn cornell_specular() -> Document {
    cornell_specular_in(Document::default())
}

/// The same, added to a document that may subdivide it.
pub fn cornell_specular_in(mut doc: Document) -> Document {
    room(&mut doc);
    let mirror = doc.material(&Material::metal("mirror", [0.95; 3], 0.0));
    let clear = Volume { thickness: 0.2, attenuation_color: [1.0; 3], attenuation_distance: None };
    let glass = doc.material(&Material::glass("glass", clear));
    doc.add("mirror ball", &Shape::sphere(DVec3::new(0.4, 0.1, 0.38), 0.1, 4), mirror);
    doc.add("glass ball", &Shape::sphere(DVec3::new(0.17, 0.1, 0.2), 0.1, 4), glass);
    doc
}

/// Floor, walls, ceiling, lamp and camera; returns the white paint.
fn room(doc: &mut Document) -> MaterialId {
    let white = doc.material(&Material::lambert("white", WHITE));
    let green = doc.material(&Material::lambert("green", GREEN));
    let red = doc.material(&Material::lambert("red", RED));
    let lamp = doc.material(&Material::lamp("lamp", LIGHT, LAMP));

    let quad = |corners: [[f64; 3]; 4]| {
        let [a, b, c, d] = corners.map(metres);
        Shape::quad(a, b, c, d)
    };
    let outer = [[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]];
    let inner = [[343.0, 548.8, 227.0], [343.0, 548.8, 332.0], [213.0, 548.8, 332.0], [213.0, 548.8, 227.0]];
    // The lamp fills a hole of the ceiling, so nothing lies behind it and no light is caught in a gap.
    let ceiling = Shape {
        positions: outer.iter().chain(&inner).copied().map(metres).collect(),
        normals: vec![DVec3::NEG_Y; 8],
        triangles: (0..4u32)
            .flat_map(|i| [[i, (i + 1) % 4, 4 + (i + 1) % 4], [i, 4 + (i + 1) % 4, 4 + i]])
            .collect(),
        ..Shape::default()
    };
    doc.add(
        "floor",
        &quad([[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]]),
        white,
    );
    doc.add("ceiling", &ceiling, white);
    doc.add(
        "back wall",
        &quad([[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]]),
        white,
    );
    doc.add(
        "right wall",
        &quad([[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]]),
        green,
    );
    doc.add(
        "left wall",
        &quad([[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]]),
        red,
    );
    doc.add("lamp", &quad(inner), lamp);

    // Focal length 35 mm, film 25 mm square.
    let yfov = 2.0 * (12.5f64 / 35.0).atan().to_degrees();
    doc.camera("camera", metres([278.0, 273.0, -800.0]), metres([278.0, 273.0, 0.0]), yfov, 1.0);
    white
}

/// Millimetres to metres.
fn metres(p: [f64; 3]) -> DVec3 {
    DVec3::from_array(p) / 1000.0
}
