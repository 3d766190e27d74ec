//! Images on surfaces: texels, sampler, look-up.

use crate::Rgb;
use crate::math::Vec2;

/// A decoded image and how it is looked up.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Name, for messages.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows; the first row is the image's top, at v = 0 (glTF).
    pub height: u32,
    /// RGBA, 8 bits, encoded as in the file (whether sRGB or linear depends on the use).
    pub texels: Vec<[u8; 4]>,
    /// Beyond u in [0, 1].
    pub wrap_s: Wrap,
    /// Beyond v in [0, 1].
    pub wrap_t: Wrap,
    /// Between texels: true for linear, false for nearest.
    pub linear: bool,
}

/// glTF sampler wrap modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Tile.
    Repeat,
    /// Tile, every other one mirrored.
    MirroredRepeat,
    /// The border goes on for ever.
    ClampToEdge,
}

impl Texture {
    /// Colour decoded from sRGB to linear, and linear alpha, at `uv`.
    pub fn sample_srgb(&self, _uv: Vec2) -> (Rgb, f32) {
        todo!("loader")
    }

    /// The four channels as linear values in [0, 1], at `uv`.
    pub fn sample_linear(&self, _uv: Vec2) -> [f32; 4] {
        todo!("loader")
    }
}
