//! Pixels that letters and lines are drawn on.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Size and weight of letters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Letters {
    /// 16 pixels high.
    Small,
    /// 20 pixels high, bold.
    Large,
}

impl Letters {
    fn font(self) -> (FontWeight, RasterHeight) {
        match self {
            Letters::Small => (FontWeight::Regular, RasterHeight::Size16),
            Letters::Large => (FontWeight::Bold, RasterHeight::Size20),
        }
    }

    /// Height of a line, pixels.
    pub fn height(self) -> usize {
        self.font().1.val()
    }

    /// Width of `text`, pixels.
    pub fn width(self, text: &str) -> usize {
        let (weight, height) = self.font();
        get_raster_width(weight, height) * text.chars().count()
    }
}

/// An 8-bit sRGB picture, rows from the top.
#[derive(Clone, Debug)]
pub struct Canvas {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row.
    pub pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// All of one colour.
    pub fn new(width: usize, height: usize, colour: [u8; 3]) -> Canvas {
        Canvas { width, height, pixels: vec![colour; width * height] }
    }

    /// Mixes `share` of `colour` into a pixel; outside the picture nothing happens.
    pub fn blend(&mut self, x: usize, y: usize, colour: [u8; 3], share: f32) {
        if x < self.width && y < self.height {
            let p = &mut self.pixels[y * self.width + x];
            *p = [0, 1, 2]
                .map(|c| (f32::from(p[c]) * (1.0 - share) + f32::from(colour[c]) * share + 0.5) as u8);
        }
    }

    /// A filled rectangle.
    pub fn fill(&mut self, (x, y): (usize, usize), (w, h): (usize, usize), colour: [u8; 3]) {
        for j in y..y + h {
            for i in x..x + w {
                self.blend(i, j, colour, 1.0);
            }
        }
    }

    /// The border around a rectangle, one pixel wide, outside of it.
    pub fn frame(&mut self, (x, y): (usize, usize), (w, h): (usize, usize), colour: [u8; 3]) {
        let (left, top) = (x.saturating_sub(1), y.saturating_sub(1));
        self.fill((left, top), (w + 2, 1), colour);
        self.fill((left, y + h), (w + 2, 1), colour);
        self.fill((left, y), (1, h), colour);
        self.fill((x + w, y), (1, h), colour);
    }

    /// Text with its upper left corner at (x, y). A character without a picture is shown as `?`.
    pub fn text(&mut self, (x, y): (usize, usize), text: &str, letters: Letters, colour: [u8; 3]) {
        let (weight, height) = letters.font();
        let step = get_raster_width(weight, height);
        for (k, c) in text.chars().enumerate() {
            let raster = get_raster(c, weight, height).or_else(|| get_raster('?', weight, height));
            let rows = raster.iter().flat_map(|r| r.rows()).enumerate();
            for (j, row) in rows {
                for (i, &ink) in row.iter().enumerate() {
                    self.blend(x + k * step + i, y + j, colour, f32::from(ink) / 255.0);
                }
            }
        }
    }
}
