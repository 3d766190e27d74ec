//! A field drawn: title, picture with contour lines, bar with numbers, what there is to say below.

use super::canvas::{Canvas, Letters};
use super::scale::{end_above, number};
use super::{Field, Scale, isolines};
use crate::error::Error;
use crate::tonemap::write_png;
use std::path::Path;

const PAPER: [u8; 3] = [255; 3];
const INK: [u8; 3] = [32; 3];
/// Where nothing was measured.
const NOTHING: [u8; 3] = [214; 3];
/// Around everything, pixels.
const MARGIN: usize = 20;
/// Width of the bar, pixels.
const BAR: usize = 24;
/// Length of the bar at least, pixels.
const SHORTEST_BAR: usize = 200;

/// A false-colour picture in the making.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What is shown.
    pub field: Field,
    /// What its colours mean.
    pub scale: Scale,
    /// Above the picture.
    pub title: String,
    /// Of the values, for the bar.
    pub unit: String,
    /// Values along which lines are drawn.
    pub isolines: Vec<f64>,
    /// Lines are drawn of medians over so many pixels around each: 0 for a field without noise.
    pub smoothing: usize,
    /// Lines below the picture.
    pub caption: Vec<String>,
    /// Pixels of a metre, for a ruler; `None` where the picture has no scale.
    pub pixels_per_metre: Option<f32>,
}

impl Chart {
    /// With a linear or `logarithmic` scale up to `most`, or to a round value over almost all of the field.
    ///
    /// - `clip`: share of the values, [0, 1], that the scale may leave above its end where `most` is not given.
    pub fn new(field: Field, logarithmic: bool, most: Option<f64>, clip: f64) -> Chart {
        let high = most.unwrap_or_else(|| end_above(field.quantile(1.0 - clip)));
        let scale = if logarithmic { Scale::logarithmic(high) } else { Scale::linear(high) };
        Chart {
            field,
            scale,
            title: String::new(),
            unit: String::new(),
            isolines: Vec::new(),
            smoothing: 0,
            caption: Vec::new(),
            pixels_per_metre: None,
        }
    }

    /// Writes it as PNG.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let canvas = self.draw();
        write_png(canvas.width as u32, canvas.height as u32, &canvas.pixels, path)
    }

    /// Where the field's upper left pixel comes to lie in the picture.
    pub fn origin(&self) -> (usize, usize) {
        (MARGIN, MARGIN + Letters::Large.height() + 8)
    }

    fn draw(&self) -> Canvas {
        let Field { width, height, .. } = self.field;
        let (left, top) = self.origin();
        let bar_height = height.max(SHORTEST_BAR);
        let ticks = self.scale.ticks();
        let beside = ticks.iter().map(|&t| Letters::Small.width(&number(t))).max().unwrap_or(0);
        let right = BAR + 12 + beside.max(Letters::Small.width(&self.unit));
        let line = Letters::Small.height() + 2;
        let foot = self.foot(width);
        let texts = self.caption.iter().chain([&foot.1]).map(|t| Letters::Small.width(t));
        let text_width = texts.chain([Letters::Large.width(&self.title)]).max().unwrap_or(0);
        let ruler = if self.pixels_per_metre.is_some() { line + 8 } else { 0 };
        let mut canvas = Canvas::new(
            (left + width + MARGIN + right).max(left + text_width) + MARGIN,
            top + bar_height + 10 + ruler + line * self.caption.len() + MARGIN,
            PAPER,
        );
        canvas.text((left, MARGIN), &self.title, Letters::Large, INK);
        self.picture(&mut canvas, (left, top));
        self.lines(&mut canvas, (left, top));
        canvas.frame((left, top), (width, height), INK);
        self.bar(&mut canvas, (left + width + MARGIN, top), bar_height, &ticks);
        let mut y = top + bar_height + 10;
        if let (pixels, text) = foot
            && ruler > 0
        {
            canvas.fill((left, y + 6), (pixels, 3), INK);
            canvas.fill((left, y + 2), (1, 11), INK);
            canvas.fill((left + pixels - 1, y + 2), (1, 11), INK);
            canvas.text((left + pixels + 8, y), &text, Letters::Small, INK);
            y += ruler;
        }
        for (i, text) in self.caption.iter().enumerate() {
            canvas.text((left, y + i * line), text, Letters::Small, INK);
        }
        canvas
    }

    /// Length of the ruler in pixels, and what it says.
    fn foot(&self, width: usize) -> (usize, String) {
        let Some(per_metre) = self.pixels_per_metre.map(f64::from).filter(|p| *p > 0.0) else {
            return (0, String::new());
        };
        let most = 0.4 * width as f64 / per_metre;
        let power = 10f64.powf(most.log10().floor());
        let metres = [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|m| *m <= most).unwrap_or(power);
        ((metres * per_metre).round().max(1.0) as usize, format!("{} m", number(metres)))
    }

    fn picture(&self, canvas: &mut Canvas, (left, top): (usize, usize)) {
        for y in 0..self.field.height {
            for x in 0..self.field.width {
                let v = self.field.at(x, y);
                let colour = if v.is_nan() { NOTHING } else { self.scale.colour(f64::from(v)) };
                canvas.blend(left + x, top + y, colour, 1.0);
            }
        }
    }

    fn lines(&self, canvas: &mut Canvas, (left, top): (usize, usize)) {
        let mut taken = Vec::new();
        let mut labels = Vec::new();
        let smooth =
            (self.smoothing > 0 && !self.isolines.is_empty()).then(|| self.field.median(self.smoothing));
        let field = smooth.as_ref().unwrap_or(&self.field);
        for &level in &self.isolines {
            let covered = isolines::line(field, level as f32);
            // White on dark colours, black on bright ones.
            let ink = self.ink(level);
            for (i, &share) in covered.iter().enumerate().filter(|(_, s)| **s > 0.0) {
                canvas.blend(left + i % self.field.width, top + i / self.field.width, ink, 0.9 * share);
            }
            let text = number(level);
            let size = (Letters::Small.width(&text) + 6, Letters::Small.height());
            if let Some(at) = isolines::label(field, &covered, size, &taken) {
                taken.push((at, size));
                labels.push((at, size, text, level));
            }
        }
        for ((x, y), (w, h), text, level) in labels {
            let corner = (left + x - w / 2, top + y - h / 2);
            canvas.fill(corner, (w, h), self.scale.colour(level));
            canvas.text((corner.0 + 3, corner.1), &text, Letters::Small, self.ink(level));
        }
    }

    fn ink(&self, level: f64) -> [u8; 3] {
        if self.scale.at(level) < 0.6 { [255; 3] } else { [0; 3] }
    }

    fn bar(&self, canvas: &mut Canvas, (x, top): (usize, usize), height: usize, ticks: &[f64]) {
        let room = Letters::Small.height();
        // The unit stands over the bar.
        canvas.text((x, top - 4), &self.unit, Letters::Small, INK);
        let (top, height) = (top + room + 4, height - room - 4);
        for j in 0..height {
            let at = 1.0 - (j as f32 + 0.5) / height as f32;
            let colour = super::palette::colour(&super::palette::VIRIDIS, at);
            canvas.fill((x, top + j), (BAR, 1), colour);
        }
        canvas.frame((x, top), (BAR, height), INK);
        let mut last = usize::MAX;
        for &tick in ticks {
            let y = top + ((1.0 - self.scale.at(tick)) * (height - 1) as f64).round() as usize;
            canvas.fill((x + BAR, y), (5, 1), INK);
            // From the bottom up; a number that would touch the one below is left out.
            if last.saturating_sub(y) >= room {
                last = y;
                canvas.text((x + BAR + 10, y.saturating_sub(room / 2)), &number(tick), Letters::Small, INK);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_has_the_colours_of_the_scale() {
        let values: Vec<Option<f32>> = (0..6).map(|i| (i != 3).then_some(100.0 * i as f32)).collect();
        let field = Field::of_grid(3, 2, &values, 60, 60);
        let mut chart = Chart::new(field, false, None, 0.0);
        chart.title = "Illuminance".into();
        chart.pixels_per_metre = Some(100.0);
        assert_eq!(chart.scale.high(), 500.0);
        let canvas = chart.draw();
        let (left, top) = chart.origin();
        let pixel = |x: usize, y: usize| canvas.pixels[(top + y) * canvas.width + left + x];
        // Rows of values run from the bottom.
        for (x, y, value) in [(30, 90, 0.0), (90, 90, 100.0), (150, 90, 200.0), (150, 30, 500.0)] {
            let wanted = chart.scale.colour(f64::from(chart.field.at(x, y)));
            assert_eq!(pixel(x, y), wanted);
            assert!((f64::from(chart.field.at(x, y)) - value).abs() < 3.0);
        }
        assert_eq!(pixel(20, 20), NOTHING);
        // Something is written below, and all of it fits.
        assert!(canvas.pixels[(top + 120) * canvas.width..].contains(&INK));
    }

    #[test]
    fn pictures_of_any_size_can_be_drawn() {
        for (w, h) in [(1, 1), (1, 700), (700, 1)] {
            let field = Field { width: w, height: h, values: vec![f32::NAN; w * h] };
            let mut chart = Chart::new(field, true, None, 0.01);
            chart.isolines = vec![1.0, 2.0];
            chart.caption = vec!["µ °".into(), "漢".into()];
            chart.pixels_per_metre = Some(1e-9);
            assert!(chart.draw().width > w);
        }
    }
}
