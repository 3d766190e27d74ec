//! Names at the ends of curves, where they have room; the legend has them all.

use super::style::Style;
use super::svg::{Area, Drawn, FINE, px, text};
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of the letters, and about how wide one is, pixels.
const SIZE: f64 = 12.0;
const LETTER: f64 = 6.6;

/// A curve as it was drawn.
pub struct Named {
    /// What to write.
    pub name: String,
    /// Its looks.
    pub style: Style,
    /// Where its points lie.
    pub points: Vec<(i32, i32)>,
}

/// Left, top, right, bottom.
type Box4 = [i32; 4];

/// Writes each name beside the last point of its curve, else beside its first, in the first of a few places where it
/// lies within `frame` and covers no curve, not `front`, and no other name. All in units of the layer.
pub fn draw(area: &Area, curves: &[Named], front: &[(i32, i32)], frame: Box4) -> Drawn<()> {
    let curves_ink = curves.iter().flat_map(|c| ink(&c.points));
    let mut taken: Vec<Box4> = curves_ink.chain(ink(front)).collect();
    for Named { name, style, points } in curves {
        let (Some(&first), Some(&last)) = (points.first(), points.last()) else { continue };
        let width = px(LETTER * name.chars().count() as f64);
        let places = [last, first].into_iter().flat_map(|at| around(at, width));
        let free = |b: &Box4| within(b, &frame) && taken.iter().all(|t| apart(b, t));
        if let Some(place) = places.into_iter().find(free) {
            let style = text(SIZE, style.colour).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw_text(name, &style, (place[0], (place[1] + place[3]) / 2))?;
            taken.push(place);
        }
    }
    Ok(())
}

/// Boxes for a name of that width around a point: right, above and below to the right, above, below, left.
fn around((x, y): (i32, i32), width: i32) -> Vec<Box4> {
    let (half, gap, rise) = (px(SIZE * 0.55), px(9.0), px(SIZE * 1.1));
    let at = |left: i32, middle: i32| [left, middle - half, left + width, middle + half];
    vec![
        at(x + gap, y),
        at(x + gap / 2, y - rise),
        at(x + gap / 2, y + rise),
        at(x - width / 2, y + px(16.0)),
        at(x - width / 2, y - px(16.0)),
        at(x - gap - width, y),
        at(x - gap / 2 - width, y + rise),
        at(x - gap / 2 - width, y - rise),
    ]
}

/// What a curve covers: small boxes along its segments.
fn ink(points: &[(i32, i32)]) -> Vec<Box4> {
    let r = px(5.0);
    let dot = |x: i32, y: i32| [x - r, y - r, x + r, y + r];
    let mut boxes: Vec<Box4> = points.iter().map(|&(x, y)| dot(x, y)).collect();
    for pair in points.windows(2) {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
        let steps = ((x1 - x0).hypot(y1 - y0) / (6.0 * f64::from(FINE))).ceil().clamp(1.0, 500.0) as usize;
        for i in 1..steps {
            let t = i as f64 / steps as f64;
            boxes.push(dot((x0 + t * (x1 - x0)) as i32, (y0 + t * (y1 - y0)) as i32));
        }
    }
    boxes
}

fn within(b: &Box4, frame: &Box4) -> bool {
    b[0] >= frame[0] && b[1] >= frame[1] && b[2] <= frame[2] && b[3] <= frame[3]
}

fn apart(a: &Box4, b: &Box4) -> bool {
    a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_that_touch_do_not_overlap() {
        let a = [0, 0, 10, 10];
        assert!(apart(&a, &[10, 0, 20, 10]) && !apart(&a, &[9, 9, 20, 20]));
        assert!(within(&a, &a) && !within(&a, &[1, 0, 10, 10]));
    }

    #[test]
    fn a_curve_covers_all_its_way() {
        let boxes = ink(&[(0, 0), (400, 0)]);
        let covered = |x: i32| boxes.iter().any(|b| b[0] <= x && x <= b[2]);
        assert!((0..=400).all(covered));
        assert!(ink(&[]).is_empty());
    }
}
