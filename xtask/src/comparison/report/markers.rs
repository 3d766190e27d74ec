//! The points of a curve, as shapes of equal weight.

use super::style::{Marker, PANEL, Style};
use super::svg::{Area, Drawn, px, stroke};
use plotters::element::{Circle, PathElement, Polygon};
use plotters::style::Color;
use std::f64::consts::PI;

/// Draws the marker of `style` around `at` (in units of the layer), about `size` pixels across.
pub fn draw(area: &Area, style: &Style, at: (i32, i32), size: f64) -> Drawn<()> {
    let fill = if style.hollow { PANEL } else { style.colour };
    let line = stroke(2.0, style.colour);
    let r = size / 2.0;
    let outline = |corners: Vec<(f64, f64)>| -> Vec<(i32, i32)> {
        corners.into_iter().map(|(x, y)| (at.0 + px(r * x), at.1 + px(r * y))).collect()
    };
    let star = |points: usize, inner: f64, turn: f64| -> Vec<(i32, i32)> {
        let corner = |i: usize| {
            let (angle, r) =
                (PI * i as f64 / points as f64 + turn, if i.is_multiple_of(2) { 1.2 } else { inner });
            (r * angle.sin(), -r * angle.cos())
        };
        outline((0..2 * points).map(corner).collect())
    };
    let corners = match style.marker {
        Marker::Circle => {
            area.draw(&Circle::new(at, px(r), fill.filled()))?;
            return area.draw(&Circle::new(at, px(r), line));
        }
        Marker::Square => outline(vec![(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
        Marker::Up => outline(vec![(0.0, -1.15), (1.1, 0.8), (-1.1, 0.8)]),
        Marker::Down => outline(vec![(0.0, 1.15), (1.1, -0.8), (-1.1, -0.8)]),
        Marker::Diamond => outline(vec![(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)]),
        Marker::Cross => star(4, 0.35, PI / 4.0),
        Marker::Plus => star(4, 0.35, 0.0),
        Marker::Star => star(5, 0.5, 0.0),
    };
    area.draw(&Polygon::new(corners.clone(), fill.filled()))?;
    let closed: Vec<(i32, i32)> = corners.iter().chain(corners.first()).copied().collect();
    area.draw(&PathElement::new(closed, line))
}
