//! Two pictures compared in blocks of 8 × 8 pixels, whose means are near normal, and as a whole.

use crate::picture::luminance;
use raytrace::Film;

/// Chance of a false alarm: one in a million for a single normal variable.
pub const ALARM: f64 = 4.9;
/// Side of a block, pixels. Rows and columns that fill none form smaller ones.
const SIDE: u32 = 8;

/// How far a picture is from a reference.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// (picture − reference) / reference of the mean luminance.
    pub bias: f64,
    /// Standard error of `bias` by the variance layers of both.
    pub bias_error: f64,
    /// The worst block: |difference| less [`ALARM`] standard errors, over the block's luminance plus a tenth of the
    /// picture's mean.
    pub worst: f64,
    /// Where it is: column and row of its first pixel.
    pub at: (u32, u32),
    /// Root mean square over blocks of difference / (luminance + a tenth of the mean), noise included.
    pub rms: f64,
}

/// Compares the luminance of two pictures of one size.
pub fn compare(picture: &Film, reference: &Film) -> Comparison {
    assert_eq!((picture.width, picture.height), (reference.width, reference.height));
    let (a, b) = (luminance(picture), luminance(reference));
    let n = a.len() as f64;
    let mean = b.iter().sum::<f64>() / n;
    let variance = |i: usize| f64::from(picture.pixels[i].variance) + f64::from(reference.pixels[i].variance);
    let whole: f64 = (0..a.len()).map(variance).sum();
    let (mut worst, mut at, mut square, mut blocks) = (0.0, (0, 0), 0.0, 0.0);
    for top in (0..picture.height).step_by(SIDE as usize) {
        for left in (0..picture.width).step_by(SIDE as usize) {
            let (mut d, mut level, mut var, mut count) = (0.0, 0.0, 0.0, 0.0);
            for y in top..(top + SIDE).min(picture.height) {
                for x in left..(left + SIDE).min(picture.width) {
                    let i = (y * picture.width + x) as usize;
                    (d, level, var, count) = (d + a[i] - b[i], level + b[i], var + variance(i), count + 1.0);
                }
            }
            let scale = level / count + 0.1 * mean;
            let beyond = (d.abs() - ALARM * var.sqrt()).max(0.0) / count / scale;
            square += (d / count / scale).powi(2);
            blocks += 1.0;
            if beyond > worst {
                (worst, at) = (beyond, (left, top));
            }
        }
    }
    Comparison {
        bias: a.iter().sum::<f64>() / n / mean - 1.0,
        bias_error: whole.sqrt() / n / mean,
        worst,
        at,
        rms: (square / f64::max(blocks, 1.0)).sqrt(),
    }
}

impl Comparison {
    /// Whether the mean is within `bias` and every block within `block` (both relative), noise allowed for.
    pub fn agrees(&self, bias: f64, block: f64) -> bool {
        self.bias.abs() < bias + ALARM * self.bias_error && self.worst < block
    }
}
