//! A furnished room at dusk, and a second one lit only through the door between them.
//!
//! It holds what the renderer is for: diffuse walls and textures, area lamps, a spot, a sky in a window of thin
//! glass, a mirror, a table of solid glass, rough metal, glazed ceramics, a sculpture of many triangles. And it holds
//! what breaks radiosity: one floor slab under all walls, furniture that pierces every coarse mesh, books that touch,
//! millimetres of air below a vase, a room whose only light comes through a door.
//!
//! Room A: x from 0 to 8, z from 0 to 5. Room B: x from 8.2 to 13.2, same z. Both 3 m high.

mod building;
mod furniture;
mod palette;
mod things;

use super::document::Document;
use glam::DVec3;
use palette::Palette;

/// Names of its cameras.
pub const CAMERAS: [&str; 3] = ["main", "second-room", "detail"];

/// The scene and its three cameras.
pub fn gallery() -> Document {
    let mut doc = Document::default();
    let palette = Palette::new(&mut doc);
    building::build(&mut doc, &palette);
    furniture::furnish(&mut doc, &palette);
    things::place(&mut doc, &palette);

    let warm = [1.0, 0.84, 0.64];
    doc.spot(
        "picture light",
        DVec3::new(6.0, 2.88, 1.3),
        DVec3::new(6.0, 1.65, 0.03),
        warm,
        700.0,
        [14.0, 26.0],
    );

    let [main, second_room, detail] = CAMERAS;
    // Composed for 3:2. From the corner by the left wall, along the room's diagonal.
    doc.camera(main, DVec3::new(0.9, 1.5, 4.5), DVec3::new(5.2, 1.2, 1.95), 52.0, 1.5);
    doc.camera(second_room, DVec3::new(12.6, 1.5, 0.7), DVec3::new(8.9, 1.1, 2.9), 50.0, 1.5);
    doc.camera(detail, DVec3::new(4.75, 1.05, 3.45), DVec3::new(5.9, 0.5, 2.4), 34.0, 1.5);
    doc
}
