//! Whether a picture shows what the reference shows: a wrong unit, exposure or camera is not an error of a method.
//!
//! Judged by the least noisy picture of a curve. *Scale*: the median over blocks of the ratio of mean luminances.
//! *Shift*: which of the nine moves by up to a pixel brings the reference nearest, in squared difference; a parabola
//! through the neighbours along each axis gives the fraction of a pixel.

use super::results::Curve;
use super::scene::is_black;
use anyhow::Result;
use raytrace::exr::Image;
use raytrace::metrics::{self, Reference};
use std::path::Path;

/// Side of a block, pixels.
const BLOCK: usize = 16;
/// Largest deviation of the scale from 1 that may be a method's own error. A missing π is 3.1, a gamma 2.2, another
/// white 1.1.
pub const SCALE_TOLERANCE: f64 = 0.05;
/// Largest shift that may be noise, pixels: a film whose pixels are centred on their corners is off by 0.5.
pub const SHIFT_TOLERANCE: f64 = 0.25;
/// A shift less certain than this, pixels, is not judged: a picture without edges has none.
const CERTAIN: f64 = 0.05;
/// A reference whose neighbouring pixels differ by less, as a share of its brightness, has no edges: a furnace, of which
/// the least shift is that of noise.
const FLAT: f64 = 0.01;

/// What a picture is, compared with the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Brightness over the reference's.
    pub scale: f64,
    /// Pixels to the right and downward, where edges tell.
    pub shift: Option<[f64; 2]>,
}

impl Finding {
    /// Whether the picture's error measures its method.
    pub fn is_sane(&self) -> bool {
        let still = |shift: [f64; 2]| shift.iter().all(|s| s.abs() <= SHIFT_TOLERANCE);
        (self.scale - 1.0).abs() <= SCALE_TOLERANCE && self.shift.is_none_or(still)
    }
}

/// Judges a curve by its best picture, in the folder `out`, and notes what is wrong with it. A method of ours stays
/// comparable whatever is found: there is nothing it could be but an error.
pub fn judge(curve: &mut Curve, truth: &Reference, out: &Path) -> Result<()> {
    if curve.points.is_empty() {
        curve.comparable = false;
        return Ok(());
    }
    let Some(picture) = curve.best().and_then(|point| point.picture.clone()) else { return Ok(()) };
    let Some(finding) = find(&raytrace::exr::read_rgb(&out.join(picture))?, truth) else { return Ok(()) };
    if !finding.is_sane() {
        curve.comparable = curve.ours;
        let mut note = format!("its picture is {:.3} times as bright as the reference", finding.scale);
        if let Some([x, y]) = finding.shift {
            note += &format!(", and shifted by ({x:.2}, {y:.2}) pixels");
        }
        curve.notes.push(note);
    }
    Ok(())
}

/// Compares the two; `None` where the sizes differ or the reference is black.
pub fn find(picture: &Image, truth: &Reference) -> Option<Finding> {
    let mean = &truth.mean;
    if (picture.width, picture.height) != (mean.width, mean.height) || is_black(truth) {
        return None;
    }
    let (w, h) = (mean.width as usize, mean.height as usize);
    let level = metrics::brightness(&mean.pixels);
    let luminance =
        |image: &Image| image.pixels.iter().map(|p| f64::from(p.luminance())).collect::<Vec<f64>>();
    let (picture, mean) = (luminance(picture), luminance(mean));
    let scale = scale(&picture, &mean, w, h, level)?;
    // Lamps, a hundred times as bright as all else, would be the only edges that count.
    let cut = |v: &[f64], factor: f64| v.iter().map(|y| (y * factor).min(2.0 * level)).collect::<Vec<f64>>();
    let (a, b) = truth.halves.as_ref().map_or((&truth.mean, &truth.mean), |(a, b)| (a, b));
    let (a, b) = (cut(&luminance(a), 1.0), cut(&luminance(b), 1.0));
    let shift = (slope(&a, &b, w, h) > FLAT * level)
        .then(|| shift(&cut(&picture, 1.0 / scale), &cut(&mean, 1.0), w, h))
        .flatten();
    Some(Finding { scale, shift })
}

/// Root mean square step from a pixel to the one right of it and to the one below; the noise of two independent halves
/// `a` and `b` of a picture does not count.
fn slope(a: &[f64], b: &[f64], w: usize, h: usize) -> f64 {
    let step = |v: &[f64], i: usize, to: usize| v[to] - v[i];
    let inner = (0..h.saturating_sub(1)).flat_map(|y| (0..w.saturating_sub(1)).map(move |x| y * w + x));
    let products =
        inner.map(|i| [i + 1, i + w].map(|to| step(a, i, to) * step(b, i, to)).iter().sum::<f64>());
    (products.sum::<f64>() / (2 * w * h).max(1) as f64).max(0.0).sqrt()
}

/// The median over blocks, of those not darker than a hundredth of the brightness `level`, of the ratio of means.
fn scale(picture: &[f64], mean: &[f64], w: usize, h: usize, level: f64) -> Option<f64> {
    let mut ratios = Vec::new();
    for (top, left) in (0..h).step_by(BLOCK).flat_map(|y| (0..w).step_by(BLOCK).map(move |x| (y, x))) {
        let sum = |v: &[f64]| -> f64 {
            let rows = top..(top + BLOCK).min(h);
            rows.map(|y| v[y * w + left..y * w + (left + BLOCK).min(w)].iter().sum::<f64>()).sum()
        };
        let n = ((top + BLOCK).min(h) - top) * ((left + BLOCK).min(w) - left);
        let reference = sum(mean);
        if reference > 0.01 * level * n as f64 {
            ratios.push(sum(picture) / reference);
        }
    }
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().filter(|scale| scale.is_finite() && *scale > 0.0)
}

/// How far right and down the picture lies, up to 1.5 pixels each; `None` where noise drowns the edges.
fn shift(picture: &[f64], mean: &[f64], w: usize, h: usize) -> Option<[f64; 2]> {
    const RIM: usize = 2;
    if w <= 2 * RIM || h <= 2 * RIM {
        return None;
    }
    // Sum over the inner pixels of the squared difference to the reference moved by (dx, dy).
    let difference = |dx: isize, dy: isize| -> f64 {
        let row = |y: usize| {
            let from = (y as isize - dy) as usize * w;
            let d = move |x: usize| picture[y * w + x] - mean[from + (x as isize - dx) as usize];
            (RIM..w - RIM).map(move |x| d(x) * d(x)).sum::<f64>()
        };
        (RIM..h - RIM).map(row).sum()
    };
    let steps = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y)));
    let (least, (x, y)) =
        steps.map(|(x, y)| (difference(x, y), (x, y))).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let variance = least / ((w - 2 * RIM) * (h - 2 * RIM)) as f64;
    let fraction = |before: f64, after: f64| {
        let curvature = before - 2.0 * least + after;
        // D = Σ(mean(x + 1) − mean(x))² is half of the curvature; noise enters by its product with such differences,
        // σ/√D at most.
        let uncertain = (2.0 * variance / curvature).sqrt();
        (curvature > 0.0 && uncertain < CERTAIN)
            .then(|| (0.5 * (before - after) / curvature).clamp(-0.5, 0.5))
    };
    let right = fraction(difference(x - 1, y), difference(x + 1, y))?;
    let down = fraction(difference(x, y - 1), difference(x, y + 1))?;
    Some([x as f64 + right, y as f64 + down])
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Rgb;

    const SIZE: u32 = 96;

    /// A white picture whose noise happens to be that of the reference, a pixel to the right, is not shifted.
    #[test]
    fn noise_that_both_share_is_no_shift() {
        let noise = |x: u32, y: u32, k: u32| {
            let hash = (x * 73_856_093) ^ (y * 19_349_663) ^ (k * 83_492_791);
            ((hash.wrapping_mul(2_654_435_761) >> 16) & 0xff) as f32 / 255.0 - 0.5
        };
        let flat = |moved: u32, k: u32| {
            let pixel = |i: u32| Rgb::splat(1.0 + 0.04 * noise(i % SIZE + moved, i / SIZE, k));
            Image { width: SIZE, height: SIZE, pixels: (0..SIZE * SIZE).map(pixel).collect() }
        };
        let (a, b) = (flat(0, 1), flat(0, 2));
        let mean = a.pixels.iter().zip(&b.pixels).map(|(&a, &b)| (a + b) * 0.5).collect();
        let truth = Reference { mean: Image { pixels: mean, ..a.clone() }, halves: Some((a, b)) };
        let found = find(&flat(1, 1), &truth).unwrap();
        assert!(found.is_sane() && found.shift.is_none(), "{found:?}");
    }

    /// A room of tilted edges and a lamp, drawn at `offset` pixels, box-filtered, with noise of the share `noise`.
    fn room(offset: [f64; 2], factor: f64, noise: f64) -> Image {
        let light = |x: f64, y: f64| match (x, y) {
            _ if (40.0..50.0).contains(&x) && (8.0..12.0).contains(&y) => 900.0,
            _ if x + 0.3 * y < 35.0 => 8.0,
            _ if y - 0.2 * x > 60.0 => 2.0,
            _ => 4.0 + 0.02 * x,
        };
        let pixel = |i: u32| {
            let (x, y) = (f64::from(i % SIZE) - offset[0], f64::from(i / SIZE) - offset[1]);
            let sample = |k: u32| light(x + f64::from(k % 8) / 8.0 + 0.06, y + f64::from(k / 8) / 8.0 + 0.06);
            let grain = f64::from(i.wrapping_mul(2654435761) >> 16) / 65536.0 - 0.5;
            Rgb::splat((factor * (1.0 + noise * grain) * (0..64).map(sample).sum::<f64>() / 64.0) as f32)
        };
        Image { width: SIZE, height: SIZE, pixels: (0..SIZE * SIZE).map(pixel).collect() }
    }

    fn found(picture: &Image) -> Finding {
        find(picture, &Reference { mean: room([0.0; 2], 1.0, 0.0), halves: None }).unwrap()
    }

    #[test]
    fn noise_alone_is_sane() {
        let finding = found(&room([0.0; 2], 1.0, 0.3));
        assert!(finding.is_sane() && (finding.scale - 1.0).abs() < 0.01, "{finding:?}");
        assert!(finding.shift.unwrap().iter().all(|s| s.abs() < 0.05), "{finding:?}");
    }

    #[test]
    fn another_unit_is_found() {
        let finding = found(&room([0.0; 2], 1.0 / std::f64::consts::PI, 0.3));
        assert!(
            !finding.is_sane() && (finding.scale * std::f64::consts::PI - 1.0).abs() < 0.01,
            "{finding:?}"
        );
        assert!(finding.shift.unwrap().iter().all(|s| s.abs() < 0.05), "brightness is no shift: {finding:?}");
    }

    #[test]
    fn half_a_pixel_is_found() {
        for offset in [[0.5, 0.0], [0.0, -0.5], [1.0, 1.0]] {
            let finding = found(&room(offset, 1.0, 0.1));
            let shift = finding.shift.unwrap();
            assert!(!finding.is_sane() && (finding.scale - 1.0).abs() < 0.05, "{offset:?}: {finding:?}");
            assert!((0..2).all(|i| (shift[i] - offset[i]).abs() < 0.25), "{offset:?}: {finding:?}");
        }
    }

    #[test]
    fn a_picture_without_edges_has_no_shift() {
        let plain = |v: f32| Image { width: 64, height: 64, pixels: vec![Rgb::splat(v); 4096] };
        let truth = Reference { mean: plain(1.0), halves: None };
        assert_eq!(find(&plain(1.0), &truth).unwrap(), Finding { scale: 1.0, shift: None });
        assert!(find(&plain(1.0), &Reference { mean: plain(0.0), halves: None }).is_none());
    }

    #[test]
    fn a_peer_that_shows_something_else_is_not_comparable() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, image: &Image| {
            raytrace::exr::write_rgb(image, &Default::default(), &folder.path().join(name)).unwrap();
            super::super::results::Point { picture: Some(name.into()), error: 0.1, ..Default::default() }
        };
        let truth = Reference { mean: room([0.0; 2], 1.0, 0.0), halves: None };
        let bright = write("bright.exr", &room([0.0; 2], 1.2, 0.1));
        for ours in [false, true] {
            let mut curve =
                Curve { comparable: true, ours, points: vec![bright.clone()], ..Curve::default() };
            judge(&mut curve, &truth, folder.path()).unwrap();
            assert_eq!((curve.comparable, curve.notes.len()), (ours, 1));
            assert!(curve.notes[0].contains("1.2"), "{}", curve.notes[0]);
        }
    }
}
