//! Contour lines of a field, and where their numbers stand.

use super::Field;

/// Share of each pixel that the contour line at `level` covers, [0, 1]: a line 1.3 pixels wide, its distance estimated
/// by |value − level| / |gradient|.
pub fn line(field: &Field, level: f32) -> Vec<f32> {
    let Field { width, height, .. } = *field;
    let mut out = vec![0.0; width * height];
    for y in 0..height {
        for x in 0..width {
            let v = field.at(x, y);
            let slope = |a: f32, b: f32, steps: usize| {
                let d = (b - a) / steps.max(1) as f32;
                if d.is_finite() { d } else { 0.0 }
            };
            let (x0, x1) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let (y0, y1) = (y.saturating_sub(1), (y + 1).min(height - 1));
            let dx = slope(field.at(x0, y), field.at(x1, y), x1 - x0);
            let dy = slope(field.at(x, y0), field.at(x, y1), y1 - y0);
            let gradient = dx.hypot(dy);
            let distance = (v - level).abs() / gradient;
            if distance.is_finite() && gradient <= 0.2 * level {
                out[y * width + x] = (1.15 - distance).clamp(0.0, 1.0);
            }
        }
    }
    out
}

/// Middle and size of a number, pixels.
pub type Label = ((usize, usize), (usize, usize));

/// A pixel on the line `covered` where a number of `size` pixels has room: on the longest free stretch, away from the
/// border and from what is `taken`.
pub fn label(
    field: &Field,
    covered: &[f32],
    size: (usize, usize),
    taken: &[Label],
) -> Option<(usize, usize)> {
    let (w, h) = size;
    let Field { width, height, .. } = *field;
    let gap = |p: (usize, usize), q: (usize, usize), s: (usize, usize)| {
        let dx = p.0.abs_diff(q.0) as f32 - 0.5 * (w + s.0) as f32;
        let dy = p.1.abs_diff(q.1) as f32 - 0.5 * (h + s.1) as f32;
        dx.max(dy)
    };
    let mut best: Option<(f32, (usize, usize))> = None;
    for y in h..height.saturating_sub(h) {
        for x in w..width.saturating_sub(w) {
            if covered[y * width + x] < 0.5 {
                continue;
            }
            let p = (x, y);
            let border = x.min(width - x).saturating_sub(w / 2).min(y.min(height - y)) as f32;
            let room = taken.iter().map(|&(q, s)| gap(p, q, s)).fold(3.0 * border, f32::min);
            if room > 4.0 && best.is_none_or(|(most, _)| room > most) {
                best = Some((room, p));
            }
        }
    }
    best.map(|(_, p)| p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_lies_at_its_level() {
        let values = (0..200 * 100).map(|i| (i % 200) as f32).collect();
        let field = Field { width: 200, height: 100, values };
        let line = line(&field, 120.3);
        for y in 0..100 {
            let row = &line[y * 200..(y + 1) * 200];
            assert!(row[120] > 0.8 && row[117] == 0.0 && row[124] == 0.0, "{:?}", &row[116..126]);
        }
        let at = label(&field, &line, (24, 16), &[]).unwrap();
        assert!(at.0.abs_diff(120) <= 1 && (16..84).contains(&at.1));
        let next = label(&field, &line, (24, 16), &[(at, (24, 16))]).unwrap();
        assert!(next.1.abs_diff(at.1) >= 16);
    }
}
