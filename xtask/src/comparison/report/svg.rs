//! A drawing in layers, each a group of its own in the SVG, so that a page can style them and count them.

use super::words::escape;
use anyhow::{Context, Result};
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::style::{Color, FontStyle, RGBColor, ShapeStyle, TextStyle};

/// Steps per pixel: plotters places everything on whole numbers, which would show as kinks in the curves.
pub const FINE: i32 = 4;

/// What a layer is drawn on; its unit is 1/[`FINE`] pixel.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// What drawing may fail with.
pub type Drawn<T> = Result<T, DrawingAreaErrorKind<std::io::Error>>;

/// An SVG in the making.
pub struct Drawing {
    width: u32,
    height: u32,
    body: String,
}

impl Drawing {
    /// An empty one of that many pixels.
    pub fn new(width: u32, height: u32) -> Drawing {
        Drawing { width, height, body: String::new() }
    }

    /// Adds a group. `attributes` stand in its tag as they are; `tip` is shown where the mouse rests on it.
    pub fn layer<T>(
        &mut self,
        attributes: &str,
        tip: Option<&str>,
        draw: impl FnOnce(&Area) -> Drawn<T>,
    ) -> Result<T> {
        let mut text = String::new();
        let result = {
            let size = (self.width * FINE as u32, self.height * FINE as u32);
            let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
            let result = draw(&area).map_err(|e| anyhow::anyhow!("drawing a chart: {e}"))?;
            area.present().map_err(|e| anyhow::anyhow!("drawing a chart: {e}"))?;
            result
        };
        let start = text.find('\n').context("an SVG has a first line")?;
        let end = text.rfind("</svg>").context("an SVG has an end")?;
        let tip = tip.map(|t| format!("<title>{}</title>", escape(t))).unwrap_or_default();
        self.body.push_str(&format!("<g {attributes}>{tip}{}</g>\n", &text[start..end]));
        Ok(result)
    }

    /// Starts a group around the layers that follow, until [`Drawing::close`].
    pub fn open(&mut self, attributes: &str) {
        self.body.push_str(&format!("<g {attributes}>\n"));
    }

    /// Ends the group.
    pub fn close(&mut self) {
        self.body.push_str("</g>\n");
    }

    /// The whole file. `class` is for the page's style; `title` is read aloud to who cannot see it.
    pub fn finish(self, class: &str, title: &str) -> String {
        let (w, h) = (self.width, self.height);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"{class}\" role=\"img\" aria-label=\"{}\" \
             width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {} {}\" stroke-linejoin=\"round\">\n{}</svg>\n",
            escape(title),
            w as i32 * FINE,
            h as i32 * FINE,
            self.body
        )
    }
}

/// Words of that many pixels.
pub fn text(pixels: f64, colour: RGBColor) -> TextStyle<'static> {
    words(pixels, colour, FontStyle::Normal)
}

/// The same, bold.
pub fn bold(pixels: f64, colour: RGBColor) -> TextStyle<'static> {
    words(pixels, colour, FontStyle::Bold)
}

fn words(pixels: f64, colour: RGBColor, weight: FontStyle) -> TextStyle<'static> {
    // plotters-svg divides by 1.24.
    let mut style = TextStyle::from(("sans-serif", pixels * 1.24 * f64::from(FINE), weight));
    style.color = colour.to_backend_color();
    style
}

/// A line that many pixels wide.
pub fn stroke(pixels: f64, colour: RGBColor) -> ShapeStyle {
    colour.stroke_width((pixels * f64::from(FINE)).round() as u32)
}

/// Pixels to the unit of a layer.
pub fn px(pixels: f64) -> i32 {
    (pixels * f64::from(FINE)).round() as i32
}
