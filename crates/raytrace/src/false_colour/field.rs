//! One value for each pixel of a picture.

use crate::exr::Image;
use rayon::prelude::*;

/// Values, rows from the top; NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row.
    pub values: Vec<f32>,
}

impl Field {
    /// The luminance of each pixel.
    pub fn of_picture(image: &Image) -> Field {
        let values = image.pixels.iter().map(|p| p.luminance()).collect();
        Field { width: image.width as usize, height: image.height as usize, values }
    }

    /// A grid of `columns` × `rows` values (rows from the bottom, `None` where there is none), each shown `width` ×
    /// `height` pixels large; between their middles values run over linearly.
    pub fn of_grid(
        columns: usize,
        rows: usize,
        values: &[Option<f32>],
        width: usize,
        height: usize,
    ) -> Field {
        let at = |i: usize, j: usize| values[j * columns + i];
        let value = |x: usize, y: usize| -> Option<f32> {
            // In cells, from the middle of the lower left one.
            let s = (x as f32 + 0.5) / width as f32 - 0.5;
            let t = rows as f32 - (y as f32 + 0.5) / height as f32 - 0.5;
            let near = |s: f32, n: usize| (s.round().max(0.0) as usize).min(n - 1);
            at(near(s, columns), near(t, rows))?;
            let split = |s: f32, n: usize| {
                let s = s.clamp(0.0, (n - 1) as f32);
                let i = (s as usize).min(n.saturating_sub(2));
                (i, (i + 1).min(n - 1), s - i as f32)
            };
            let ((i0, i1, s), (j0, j1, t)) = (split(s, columns), split(t, rows));
            let corners = [
                (at(i0, j0), (1.0 - s) * (1.0 - t)),
                (at(i1, j0), s * (1.0 - t)),
                (at(i0, j1), (1.0 - s) * t),
                (at(i1, j1), s * t),
            ];
            let known = || corners.iter().filter_map(|(v, w)| Some(((*v)?, *w)));
            let weight: f32 = known().map(|(_, w)| w).sum();
            (weight > 0.0).then(|| known().map(|(v, w)| v * w).sum::<f32>() / weight)
        };
        let (w, h) = (columns * width, rows * height);
        let values = (0..w * h).map(|i| value(i % w, i / w).unwrap_or(f32::NAN)).collect();
        Field { width: w, height: h, values }
    }

    /// Medians over the square of `radius` pixels around each: without noise, yet with edges where they were.
    pub fn median(&self, radius: usize) -> Field {
        let one = |i: usize| {
            let (x, y) = (i % self.width, i / self.width);
            let (x1, y1) = ((x + radius).min(self.width - 1), (y + radius).min(self.height - 1));
            let rows = y.saturating_sub(radius)..=y1;
            let mut near: Vec<f32> = rows
                .flat_map(|y| (x.saturating_sub(radius)..=x1).map(move |x| self.at(x, y)))
                .filter(|v| !v.is_nan())
                .collect();
            let middle = near.len() / 2;
            if near.is_empty() || self.at(x, y).is_nan() {
                return f32::NAN;
            }
            *near.select_nth_unstable_by(middle, f32::total_cmp).1
        };
        let values = (0..self.values.len()).into_par_iter().map(one).collect();
        Field { values, ..*self }
    }

    /// The value at a pixel; NaN where there is none.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// The value that `share` of the finite ones do not exceed; 0 without any.
    pub fn quantile(&self, share: f64) -> f64 {
        let mut finite: Vec<f32> = self.values.iter().copied().filter(|v| v.is_finite()).collect();
        if finite.is_empty() {
            return 0.0;
        }
        let k = ((finite.len() - 1) as f64 * share.clamp(0.0, 1.0)).round() as usize;
        f64::from(*finite.select_nth_unstable_by(k, f32::total_cmp).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_take_noise_away_and_leave_edges() {
        let edge = |x: usize| if x < 8 { 1.0 } else { 9.0 };
        let mut values: Vec<f32> = (0..16 * 16).map(|i| edge(i % 16)).collect();
        for (i, v) in values.iter_mut().enumerate().filter(|(i, _)| i % 7 == 3) {
            *v = if i % 2 == 0 { 100.0 } else { f32::NAN };
        }
        let field = Field { width: 16, height: 16, values };
        let median = field.median(2);
        for (i, v) in median.values.iter().enumerate().filter(|(i, _)| !field.values[*i].is_nan()) {
            assert!(*v == edge(i % 16), "{i}: {v}");
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_and_holes_stay_holes() {
        let values: Vec<Option<f32>> = (0..12).map(|i| (i != 5).then_some((i % 4) as f32)).collect();
        let field = Field::of_grid(4, 3, &values, 10, 10);
        assert_eq!((field.width, field.height), (40, 30));
        // x = 12 is 0.75 cells from the middle of the first.
        assert!((field.at(12, 2) - 0.75).abs() < 1e-5);
        assert!(
            field.at(15, 15).is_nan() && !field.at(15, 4).is_nan(),
            "cell 5 is the second of the middle row"
        );
        assert_eq!((field.at(0, 0), field.at(39, 29)), (0.0, 3.0));
        assert_eq!((field.quantile(0.0), field.quantile(1.0)), (0.0, 3.0));
        assert_eq!(Field::of_grid(1, 1, &[Some(2.0)], 3, 3).values, [2.0; 9]);
    }
}
