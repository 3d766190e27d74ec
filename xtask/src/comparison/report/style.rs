//! How each method looks in every chart: a colour and a marker that stay with a renderer throughout.

use plotters::style::RGBColor;

/// Behind a chart. The page's dark style finds these four by their value (`page.css`).
pub const PANEL: RGBColor = RGBColor(255, 255, 255);
/// Words.
pub const INK: RGBColor = RGBColor(0x1c, 0x24, 0x30);
/// Axes and second words.
pub const GREY: RGBColor = RGBColor(0x66, 0x70, 0x7d);
/// The grid.
pub const FAINT: RGBColor = RGBColor(0xe2, 0xe6, 0xea);
/// What the Pareto front leaves behind.
pub const DOMINATED: RGBColor = RGBColor(0xf4, 0xf5, 0xf7);

/// Shape of a point, so that colour is never the only difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// ●
    Circle,
    /// ■
    Square,
    /// ▲
    Up,
    /// ▼
    Down,
    /// ◆
    Diamond,
    /// ×
    Cross,
    /// +
    Plus,
    /// ★
    Star,
}

/// Look of one curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Of line and marker.
    pub colour: RGBColor,
    /// At each point.
    pub marker: Marker,
    /// Whether the marker is an outline: pictures that were denoised.
    pub hollow: bool,
    /// Of the line, pixels.
    pub width: u32,
    /// Whether the line is broken: what it shows is not the same thing.
    pub dashed: bool,
}

/// Colours after Okabe and Ito (2008), told apart with any colour vision, some a little darker than theirs: all keep
/// a contrast of 2.5 against white and against the dark page.
const KNOWN: [(&str, RGBColor, Marker); 9] = [
    ("split", RGBColor(0x00, 0x72, 0xb2), Marker::Circle),
    ("gather", RGBColor(0x00, 0x9e, 0x73), Marker::Square),
    ("vertex", RGBColor(0x3f, 0xa4, 0xdd), Marker::Up),
    ("path", RGBColor(0x7d, 0x85, 0x90), Marker::Diamond),
    ("mitsuba", RGBColor(0xd5, 0x5e, 0x00), Marker::Down),
    ("cycles", RGBColor(0xd9, 0x8e, 0x00), Marker::Square),
    ("luxcore", RGBColor(0xc4, 0x5f, 0x99), Marker::Cross),
    ("povray", RGBColor(0x8a, 0x6a, 0x3b), Marker::Plus),
    ("radiance", RGBColor(0x7b, 0x61, 0xc4), Marker::Star),
];

/// The look of a method by its key; `index` tells unknown ones apart.
pub fn of_method(method: &str, ours: bool, comparable: bool, index: usize) -> Style {
    let words: Vec<&str> = method.split(['-', '_', '+', ' ']).collect();
    let known = KNOWN.iter().find(|(name, ..)| words.first() == Some(name));
    let &(_, colour, marker) = known.unwrap_or(&KNOWN[index % KNOWN.len()]);
    let denoised = words[1..].iter().any(|w| ["oidn", "denoised", "denoise", "optix"].contains(w));
    Style { colour, marker, hollow: denoised, width: if ours { 3 } else { 2 }, dashed: !comparable }
}

/// The look of the `index`th line where lines are no methods.
pub fn of_index(index: usize) -> Style {
    let (_, colour, marker) = KNOWN[index % KNOWN.len()];
    Style { colour, marker, hollow: false, width: 2, dashed: false }
}

/// A colour as CSS has it.
pub fn css(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn renderers_keep_their_colours_and_denoising_shows() {
        let (plain, clean) =
            (of_method("mitsuba", false, true, 0), of_method("mitsuba-oidn", false, true, 7));
        assert_eq!((plain.colour, plain.marker), (clean.colour, clean.marker));
        assert!(clean.hollow && !plain.hollow);
        assert!(of_method("", true, false, 1000).dashed);
    }

    #[test]
    fn colours_stand_out_on_paper_and_on_the_dark_page() {
        let linear = |v: u8| (f64::from(v) / 255.0).powf(2.2);
        let luminance = |c: RGBColor| 0.2126 * linear(c.0) + 0.7152 * linear(c.1) + 0.0722 * linear(c.2);
        let contrast = |a: f64, b: f64| (a.max(b) + 0.05) / (a.min(b) + 0.05);
        for (name, colour, _) in KNOWN {
            for panel in [PANEL, RGBColor(0x17, 0x1a, 0x20)] {
                let contrast = contrast(luminance(colour), luminance(panel));
                assert!(contrast > 2.5, "{name}: {contrast}");
            }
        }
    }
}
