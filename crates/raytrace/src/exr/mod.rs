//! Film to OpenEXR and back: layers, units, and how the picture was made, as text.

mod read;
mod write;

pub use read::{is_finished, read_layer, read_reference, read_rgb};
pub use write::{write, write_rgb};

use geometry::Rgb;
use geometry::math::Mat4;

/// A plain picture: linear light, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row.
    pub pixels: Vec<Rgb>,
}

/// What goes into the file beside the pixels.
///
/// Leave out what differs from run to run (dates, seconds): the same seed shall give the same bytes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Name and value, such as ("seed", "1"); stored as the text attribute `twolight:seed`.
    pub texts: Vec<(String, String)>,
    /// World to camera space (the camera looks along −z), stored as the standard attribute `worldToCamera`.
    pub world_to_camera: Option<Mat4>,
}

impl Metadata {
    /// Adds one text.
    pub fn push(&mut self, name: impl Into<String>, value: impl ToString) {
        self.texts.push((name.into(), value.to_string()));
    }
}
