//! How far a picture is from a reference: one headline number, and beside it what kind of error it is.
//!
//! For each pixel, with d = picture − reference and averages over the three channels:
//!
//! ```text
//! M      = mean of min(Y_ref, P90(Y_ref))           brightness that visible lamps cannot inflate
//! den    = mean_c ref² + 0.01 M²                    one weight for all channels
//! error  = sqrt(mean over pixels of mean_c d² / den)
//! ```
//!
//! One weight, so that a channel that is nearly black (blue on a red wall) does not dominate; its second term
//! keeps black pixels from dividing by zero, and counts errors below about a tenth of the mean brightness as
//! absolute ones. Where the reference exists as two independent halves A and B, d² is (out − A)(out − B), whose
//! expectation is (out − truth)²: the reference's own noise drops out exactly.

use crate::error::Error;
use crate::exr::Image;
use crate::flip;
use geometry::Rgb;

/// Side of the blocks whose means tell slow errors from noise, pixels.
const BLOCK: usize = 16;

/// What a picture is compared with.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The best picture there is.
    pub mean: Image,
    /// Two independent pictures of half the samples each, if they were kept.
    pub halves: Option<(Image, Image)>,
}

/// The numbers of one comparison; all are fractions of 1 (0.02 is 2 %) unless said.
#[derive(Clone, Debug, PartialEq)]
pub struct Metrics {
    /// Root of the mean squared relative error: the headline. A negative estimate (possible with halves) reads 0.
    pub error: f64,
    /// Standard error of `error` from its spread over pixels, taken as independent; `None` where `error` is 0.
    pub error_se: Option<f64>,
    /// `error` without the worst 0.1 % of pixels: what is left without fireflies.
    pub trimmed: f64,
    /// `error` with the reference's noise left in.
    pub raw_error: f64,
    /// Root of the mean squared error over the mean of the reference, no weights.
    pub rmse: f64,
    /// Signed error of the mean luminance.
    pub bias: f64,
    /// `bias` over pixels up to the reference's 99.5th percentile, so that lamps do not count.
    pub bias_clipped: f64,
    /// 95th percentile over pixels of the weighted error; the reference's noise stays in.
    pub p95: f64,
    /// 99th percentile of the same.
    pub p99: f64,
    /// 99.9th percentile of the same.
    pub p999: f64,
    /// `error` of the means of 16 × 16 blocks; `None` for pictures smaller than one block. Noise that differs from
    /// pixel to pixel contributes a sixteenth of itself here; what is far above that is slow bias.
    pub block16: Option<f64>,
    /// What `block16` holds beyond noise: sqrt(block16² − (error/16)²), not below 0.
    pub bias_floor: Option<f64>,
    /// Mean HDR-FLIP, [0, 1]; `None` when it was not asked for.
    pub flip: Option<f64>,
    /// Pixels of the picture that were not finite; they count as black.
    pub nonfinite: u64,
    /// Whether the reference's noise was removed with its halves.
    pub reference_noise_removed: bool,
}

/// Compares `picture` with `reference`; FLIP, by far the slowest of the numbers, only if `with_flip`.
pub fn compare(picture: &Image, reference: &Reference, with_flip: bool) -> Result<Metrics, Error> {
    let mean = &reference.mean;
    same_size(picture, mean)?;
    let (a, b) = reference.halves.as_ref().map_or((mean, mean), |(a, b)| (a, b));
    same_size(picture, a)?;
    same_size(picture, b)?;
    let n = mean.pixels.len();
    if n == 0 {
        return Err(Error::NothingToCompare("the pictures have no pixels"));
    }

    let nonfinite = picture.pixels.iter().filter(|p| !p.is_finite()).count() as u64;
    let x: Vec<[f64; 3]> =
        picture.pixels.iter().map(|p| wide(p.map(|v| if v.is_finite() { v } else { 0.0 }))).collect();
    let [r, a, b] = [mean, a, b].map(|i| i.pixels.iter().map(|&p| wide(p)).collect::<Vec<_>>());
    let den = weights(&r);
    if den.iter().any(|d| d.is_nan() || *d <= 0.0) {
        return Err(Error::NothingToCompare("the reference is black or not finite"));
    }

    let raw: Vec<f64> = (0..n).map(|i| product(&x[i], &r[i], &r[i]) / den[i]).collect();
    let e: Vec<f64> = (0..n).map(|i| product(&x[i], &a[i], &b[i]) / den[i]).collect();
    let error = root(average(&e));
    let spread =
        (average(&e.iter().map(|v| v * v).collect::<Vec<_>>()) - average(&e).powi(2)).max(0.0).sqrt();
    let error_se = (error > 0.0).then(|| spread / (n as f64).sqrt() / (2.0 * error).max(1e-6));
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| raw[i].total_cmp(&raw[j]));
    let kept: Vec<f64> = order[..((0.999 * n as f64) as usize).max(1)].iter().map(|&i| e[i]).collect();
    let sorted_raw: Vec<f64> = order.iter().map(|&i| raw[i]).collect();

    let y_r: Vec<f64> = r.iter().map(luminance).collect();
    let y_d: Vec<f64> = x.iter().zip(&y_r).map(|(x, y)| luminance(x) - y).collect();
    let bright = percentile(&sorted(&y_r), 99.5);
    let dim: Vec<usize> = (0..n).filter(|&i| y_r[i] <= bright).collect();
    let over_dim = |v: &[f64]| dim.iter().map(|&i| v[i]).sum::<f64>();
    let d2: Vec<f64> = (0..n).map(|i| product(&x[i], &r[i], &r[i])).collect();

    let (w, h) = (mean.width as usize, mean.height as usize);
    let block16 = block_error(&x, &a, &b, &den, w, h);
    Ok(Metrics {
        error,
        error_se,
        trimmed: root(average(&kept)),
        raw_error: root(average(&raw)),
        rmse: average(&d2).sqrt()
            / average(&r.iter().map(|p| p.iter().sum::<f64>() / 3.0).collect::<Vec<_>>()),
        bias: y_d.iter().sum::<f64>() / y_r.iter().sum::<f64>(),
        bias_clipped: over_dim(&y_d) / over_dim(&y_r),
        p95: root(percentile(&sorted_raw, 95.0)),
        p99: root(percentile(&sorted_raw, 99.0)),
        p999: root(percentile(&sorted_raw, 99.9)),
        block16,
        bias_floor: block16.map(|v| (v * v - (error / BLOCK as f64).powi(2)).max(0.0).sqrt()),
        flip: with_flip.then(|| flip::mean_hdr_flip(mean, picture)),
        nonfinite,
        reference_noise_removed: reference.halves.is_some(),
    })
}

/// The error of each pixel, sqrt(mean_c d² / den), as a fraction: what a difference picture shows.
pub fn error_map(picture: &Image, reference: &Image) -> Result<Vec<f32>, Error> {
    same_size(picture, reference)?;
    let r: Vec<[f64; 3]> = reference.pixels.iter().map(|&p| wide(p)).collect();
    let den = weights(&r);
    let error = |((p, r), den): ((&Rgb, &[f64; 3]), f64)| {
        let x = wide(p.map(|v| if v.is_finite() { v } else { 0.0 }));
        (product(&x, r, r) / den.max(f64::MIN_POSITIVE)).sqrt() as f32
    };
    Ok(picture.pixels.iter().zip(&r).zip(den).map(error).collect())
}

/// M of the module's text: the mean of luminance, what lies above its 90th percentile cut to that. In the unit of
/// the pixels; 0 for a picture without any.
pub fn brightness(pixels: &[Rgb]) -> f64 {
    clipped_mean(&pixels.iter().map(|&p| luminance(&wide(p))).collect::<Vec<_>>())
}

fn same_size(a: &Image, b: &Image) -> Result<(), Error> {
    match (a.width, a.height) == (b.width, b.height) {
        true => Ok(()),
        false => Err(Error::SizeMismatch(a.width, a.height, b.width, b.height)),
    }
}

/// The same three numbers in double precision: differences of nearly equal pixels are summed over a million.
fn wide(c: Rgb) -> [f64; 3] {
    c.to_array().map(f64::from)
}

/// Rec. 709, as [`Rgb::luminance`], in double precision.
fn luminance(c: &[f64; 3]) -> f64 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

/// mean_c (x − a)(x − b).
fn product(x: &[f64; 3], a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|c| (x[c] - a[c]) * (x[c] - b[c])).sum::<f64>() / 3.0
}

/// den of the module's text, for each pixel.
fn weights(r: &[[f64; 3]]) -> Vec<f64> {
    let m = clipped_mean(&r.iter().map(luminance).collect::<Vec<_>>());
    r.iter().map(|p| p.iter().map(|v| v * v).sum::<f64>() / 3.0 + 1e-2 * m * m).collect()
}

fn clipped_mean(y: &[f64]) -> f64 {
    if y.is_empty() {
        return 0.0;
    }
    let p90 = percentile(&sorted(y), 90.0);
    y.iter().map(|v| v.min(p90)).sum::<f64>() / y.len() as f64
}

fn sorted(v: &[f64]) -> Vec<f64> {
    let mut v = v.to_vec();
    v.sort_by(f64::total_cmp);
    v
}

/// Percentile of ascending numbers, linear between neighbours (numpy's default, Hyndman and Fan's type 7).
fn percentile(ascending: &[f64], percent: f64) -> f64 {
    let at = (ascending.len() - 1) as f64 * percent / 100.0;
    let below = ascending[at as usize];
    let above = ascending[(at as usize + 1).min(ascending.len() - 1)];
    below + (above - below) * at.fract()
}

fn average(v: &[f64]) -> f64 {
    v.iter().sum::<f64>() / v.len() as f64
}

fn root(v: f64) -> f64 {
    v.max(0.0).sqrt()
}

/// `error` of block means; rows and columns that fill no block are left out.
fn block_error(
    x: &[[f64; 3]],
    a: &[[f64; 3]],
    b: &[[f64; 3]],
    den: &[f64],
    w: usize,
    h: usize,
) -> Option<f64> {
    let mut errors = Vec::with_capacity((w / BLOCK) * (h / BLOCK));
    for by in 0..h / BLOCK {
        for bx in 0..w / BLOCK {
            let (mut sum, mut weight) = ([[0.0; 3]; 3], 0.0);
            for y in by * BLOCK..(by + 1) * BLOCK {
                for i in y * w + bx * BLOCK..y * w + (bx + 1) * BLOCK {
                    for (s, v) in sum.iter_mut().zip([x[i], a[i], b[i]]) {
                        for c in 0..3 {
                            s[c] += v[c];
                        }
                    }
                    weight += den[i];
                }
            }
            let n = (BLOCK * BLOCK) as f64;
            let [x, a, b] = sum.map(|s| s.map(|v| v / n));
            errors.push(product(&x, &a, &b) / (weight / n));
        }
    }
    (!errors.is_empty()).then(|| root(average(&errors)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Four small pictures made of multiples of powers of two, so that any language makes the same ones: a
    /// reference, a noisy and slightly too bright picture of it with one firefly, and two noisy halves.
    pub(crate) fn pictures() -> [Image; 4] {
        let noise = |x: u32, y: u32, k: u32| {
            ((x * 73 + y * 151 + k * 199).wrapping_mul(2654435761) >> 24) as f32 / 256.0 - 0.5
        };
        let make = |mean: f32, amount: f32, k: u32| {
            let pixel = |i: u32| {
                let (x, y) = (i % 64, i / 64);
                let checks = (x / 8 + y / 12) % 2 == 1;
                let (fx, fy) = (x as f32, y as f32);
                let base = match (20..24).contains(&x) && (4..6).contains(&y) {
                    true => Rgb::new(300.0, 250.0, 200.0),
                    false if checks => Rgb::new(1.0 + fx / 32.0, 0.5 + fy / 64.0, 0.125),
                    false => Rgb::new(0.25, 0.5, 0.25 + fx / 64.0),
                };
                base * (mean + amount * noise(x, y, k))
            };
            Image { width: 64, height: 48, pixels: (0..64 * 48).map(pixel).collect() }
        };
        let mut picture = make(1.0625, 0.25, 1);
        picture.pixels[30 * 64 + 40] = Rgb::splat(64.0);
        [make(1.0, 0.0, 0), picture, make(1.0, 0.125, 2), make(1.0, 0.125, 3)]
    }

    fn near(name: &str, got: f64, percent: f64) {
        assert!(
            (100.0 * got - percent).abs() <= 1e-4 * percent.abs(),
            "{name}: {} against {percent}",
            100.0 * got
        );
    }

    /// The expected numbers were computed by another program from the same definitions (numpy, double precision).
    #[test]
    fn agrees_with_an_independent_implementation() {
        let [mean, picture, a, b] = pictures();
        let one = Reference { mean: mean.clone(), halves: None };
        let m = compare(&picture, &one, false).unwrap();
        near("error", m.error, 80.56858761);
        near("error_se", m.error_se.unwrap(), 39.72320193);
        near("trimmed", m.trimmed, 9.440281458);
        near("raw_error", m.raw_error, 80.56858761);
        near("rmse", m.rmse, 135.0842700);
        near("bias", m.bias, 8.485854623);
        near("bias_clipped", m.bias_clipped, 8.938168297);
        near("p95", m.p95, 17.31874016);
        near("p99", m.p99, 18.33394122);
        near("p999", m.p999, 18.62476512);
        near("block16", m.block16.unwrap(), 9.288025152);
        near("bias_floor", m.bias_floor.unwrap(), 7.804535931);

        let m = compare(&picture, &Reference { mean, halves: Some((a, b)) }, false).unwrap();
        near("error", m.error, 80.38905659);
        near("error_se", m.error_se.unwrap(), 39.84299852);
        near("trimmed", m.trimmed, 7.441309704);
        near("raw_error", m.raw_error, 80.56858761);
        near("block16", m.block16.unwrap(), 9.296055444);
        near("bias_floor", m.bias_floor.unwrap(), 7.821310324);
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let [mean, ..] = pictures();
        let m = compare(&mean.clone(), &Reference { mean, halves: None }, true).unwrap();
        assert_eq!((m.error, m.error_se, m.bias, m.flip), (0.0, None, 0.0, Some(0.0)));
    }

    #[test]
    fn brightness_of_both_does_not_matter() {
        let [mean, picture, ..] = pictures();
        let scaled = |i: &Image| Image { pixels: i.pixels.iter().map(|&p| p * 512.0).collect(), ..i.clone() };
        let error = |x: &Image, r: &Image| {
            compare(x, &Reference { mean: r.clone(), halves: None }, false).unwrap().error
        };
        assert!((error(&picture, &mean) - error(&scaled(&picture), &scaled(&mean))).abs() < 1e-12);
    }

    #[test]
    fn bad_pixels_are_counted_and_black_references_refused() {
        let [mean, mut picture, ..] = pictures();
        picture.pixels[7].g = f32::NAN;
        picture.pixels[9].r = f32::INFINITY;
        let m = compare(&picture, &Reference { mean: mean.clone(), halves: None }, true).unwrap();
        assert_eq!(m.nonfinite, 2);
        assert!(m.error.is_finite() && m.flip.unwrap().is_finite());
        let black = Image { pixels: vec![Rgb::BLACK; 64 * 48], ..mean.clone() };
        let refused = compare(&picture, &Reference { mean: black, halves: None }, false);
        assert!(matches!(refused, Err(Error::NothingToCompare(_))));
        let small = Image { width: 1, height: 1, pixels: vec![Rgb::WHITE] };
        assert!(matches!(
            compare(&small, &Reference { mean, halves: None }, false),
            Err(Error::SizeMismatch(..))
        ));
        let tiny = compare(&small, &Reference { mean: small.clone(), halves: None }, true).unwrap();
        assert_eq!((tiny.error, tiny.block16), (0.0, None));
    }
}
