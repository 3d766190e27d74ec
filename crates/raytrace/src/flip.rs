//! HDR-FLIP: how different two pictures look, flickered on a screen, under every sensible exposure.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "ꟻLIP: A Difference Evaluator for
//! Alternating Images", PACM CGIT 3(2), 2020; Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors
//! in Rendered High Dynamic Range Images", Eurographics short papers, 2021. Equation numbers are the first's.
//! Written from the papers; it agrees with the authors' `flip-evaluator` 1.7 to the digits that the tests state.

use crate::exr::Image;
use geometry::Rgb;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Pixels per degree of visual angle, "67": a 0.7 m wide screen of 3840 pixels, seen from 0.7 m.
const PIXELS_PER_DEGREE: f32 = 3840.0 * PI / 180.0;
/// Exponent and the two knees of the colour difference (section 4.1.3).
const Q_C: f32 = 0.7;
const P_C: f32 = 0.4;
const P_T: f32 = 0.95;
/// Exponent of the feature difference, and the width of the features in degrees (section 4.2).
const Q_F: f32 = 0.5;
const FEATURE_WIDTH: f32 = 0.082;

/// Mean of HDR-FLIP over all pixels, [0, 1]: 0 for equal pictures. Negative and non-finite light counts as none.
///
/// Both pictures have the same size, with at least one pixel.
pub fn mean_hdr_flip(reference: &Image, test: &Image) -> f64 {
    assert_eq!((reference.width, reference.height), (test.width, test.height), "FLIP compares equal sizes");
    let light = |v: f32| if v.is_finite() { v.max(0.0) } else { 0.0 };
    let [reference_light, test_light] =
        [reference, test].map(|i| i.pixels.iter().map(|p| p.map(light)).collect::<Vec<_>>());
    let size = (reference.width as usize, reference.height as usize);
    let (start, stop) = exposures(&reference_light);
    let count = ((stop - start).ceil() as i32).max(2);
    let mut worst = vec![0f32; reference_light.len()];
    for i in 0..count {
        let stops = start + (stop - start) * i as f32 / (count - 1) as f32;
        let shown = |light: &[Rgb]| light.iter().map(|&c| aces(c * stops.exp2())).collect::<Vec<_>>();
        for (w, f) in worst.iter_mut().zip(ldr_flip(&shown(&reference_light), &shown(&test_light), size)) {
            *w = w.max(f);
        }
    }
    worst.iter().map(|&v| f64::from(v)).sum::<f64>() / worst.len() as f64
}

/// First and last exposure in stops (2021, section 3): where the brightest pixel of the reference, and where its
/// median, is shown at 0.85 of white.
fn exposures(light: &[Rgb]) -> (f32, f32) {
    let mut y: Vec<f32> = light.iter().map(|c| c.luminance()).collect();
    y.sort_by(f32::total_cmp);
    let (max, median) = (y[y.len() - 1], y[y.len() / 2]);
    // aces(x) = 0.85 is a x² + b x + c = 0.
    let (a, b, c) = (0.9036 - 0.85 * 0.8748, 0.018 - 0.85 * 0.354, -0.85 * 0.14);
    let x = (-b + (b * b - 4.0 * a * c as f32).sqrt()) / (2.0 * a);
    ((x / max.max(1e-5)).log2(), (x / median.max(1e-5)).log2())
}

/// The tone curve of the 2021 paper: Narkowicz's fit of ACES, at 0.6 of its own exposure.
fn aces(c: Rgb) -> Rgb {
    c.map(|x| ((0.9036 * x * x + 0.018 * x) / (0.8748 * x * x + 0.354 * x + 0.14)).clamp(0.0, 1.0))
}

/// FLIP of each pixel, for linear colours in [0, 1].
fn ldr_flip(reference: &[Rgb], test: &[Rgb], size: (usize, usize)) -> Vec<f32> {
    let [(r, fr), (t, ft)] = [reference, test].map(|picture| {
        let opponent: Vec<[f32; 3]> = picture.iter().map(|&c| ycxcz(c)).collect();
        let seen = blurred_lab(&opponent, size);
        // Luminance brought back to [0, 1] carries the features.
        let achromatic: Vec<f32> = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        (seen, features(&achromatic, size))
    });
    let most = hyab(hunt(lab(Rgb::new(0.0, 1.0, 0.0))), hunt(lab(Rgb::new(0.0, 0.0, 1.0)))).powf(Q_C);
    (0..r.len())
        .map(|i| {
            let colour = redistribute(hyab(r[i], t[i]).powf(Q_C), most);
            let feature = (fr[i][0] - ft[i][0]).abs().max((fr[i][1] - ft[i][1]).abs());
            let feature = (feature / 2f32.sqrt()).powf(Q_F);
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// Spreads colour differences over [0, 1]: up to `P_C` of the largest take `P_T` of the room.
fn redistribute(difference: f32, most: f32) -> f32 {
    let knee = P_C * most;
    match difference < knee {
        true => difference * P_T / knee,
        false => P_T + (difference - knee) / (most - knee) * (1.0 - P_T),
    }
}

/// Linear Rec. 709 to XYZ over that of white, so that white is (1, 1, 1).
fn xyz_over_white(c: Rgb) -> [f32; 3] {
    // Rec. 709 primaries with D65 at (0.3127, 0.3290); rows X, Y, Z.
    const M: [[f32; 3]; 3] = [
        [10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0],
        [2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0],
        [1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0],
    ];
    M.map(|m| (m[0] * c.r + m[1] * c.g + m[2] * c.b) / (m[0] + m[1] + m[2]))
}

/// The inverse of [`xyz_over_white`].
fn rgb_from_xyz_over_white(v: [f32; 3]) -> Rgb {
    const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];
    const M: [[f32; 3]; 3] = [
        [3.241_003_3, -1.537_399, -0.498_615_88],
        [-0.969_224_25, 1.875_93, 0.041_554_22],
        [0.055_639_42, -0.204_011_2, 1.057_148_9],
    ];
    let v = [v[0] * WHITE[0], v[1] * WHITE[1], v[2] * WHITE[2]];
    let [r, g, b] = M.map(|m| m[0] * v[0] + m[1] * v[1] + m[2] * v[2]);
    Rgb::new(r, g, b)
}

/// Opponent colours, linear in light, in which the eye's blur is stated (section 4.1.1).
fn ycxcz(c: Rgb) -> [f32; 3] {
    let [x, y, z] = xyz_over_white(c);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_from_ycxcz([y, cx, cz]: [f32; 3]) -> Rgb {
    let y = (y + 16.0) / 116.0;
    rgb_from_xyz_over_white([y + cx / 500.0, y, y - cz / 200.0])
}

/// CIE 1976 L*a*b*.
fn lab(c: Rgb) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = xyz_over_white(c).map(|t| match t > DELTA.powi(3) {
        true => t.cbrt(),
        false => t / (3.0 * DELTA * DELTA) + 4.0 / 29.0,
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Colours look less colourful when dark (Hunt's effect).
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// Abasi, Amani Tehran and Fairchild's distance for large colour differences.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// What the eye sees of each pixel among its neighbours: blurred by the contrast sensitivity of each opponent
/// channel, cut to colours a screen can show, as Hunt-adjusted L*a*b*.
fn blurred_lab(opponent: &[[f32; 3]], size: (usize, usize)) -> Vec<[f32; 3]> {
    // Sums of a √(π/b) exp(−π² r²/b), r in degrees: (a, b) of table 1.
    const SENSITIVITY: [&[(f32, f32)]; 3] =
        [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
    // Three standard deviations of the widest, b = 0.04.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let channels = [0, 1, 2].map(|c| {
        let plane: Vec<f32> = opponent.iter().map(|p| p[c]).collect();
        let gaussian = |b: f32| kernel(radius, move |x| (-(PI * x / PIXELS_PER_DEGREE).powi(2) / b).exp());
        let volume = |&(a, b): &(f32, f32)| a * (PI / b).sqrt() * gaussian(b).iter().sum::<f32>().powi(2);
        let total: f32 = SENSITIVITY[c].iter().map(volume).sum();
        let mut sum = vec![0f32; plane.len()];
        for term in SENSITIVITY[c] {
            let g = normalised(gaussian(term.1));
            let share = volume(term) / total;
            for (s, v) in sum.iter_mut().zip(convolve(&plane, size, &g, &g)) {
                *s += share * v;
            }
        }
        sum
    });
    (0..opponent.len())
        .map(|i| {
            let shown = rgb_from_ycxcz([channels[0][i], channels[1][i], channels[2][i]]);
            hunt(lab(shown.map(|v| v.clamp(0.0, 1.0))))
        })
        .collect()
}

/// Strength of edges and of points at each pixel (section 4.2): first and second derivatives of a Gaussian.
fn features(plane: &[f32], size: (usize, usize)) -> Vec<[f32; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let gaussian = |x: f32| (-x * x / (2.0 * deviation * deviation)).exp();
    let smooth = normalised(kernel(radius, gaussian));
    let edge = normalised(kernel(radius, |x| -x * gaussian(x)));
    let point = normalised(kernel(radius, |x| (x * x / (deviation * deviation) - 1.0) * gaussian(x)));
    let strength = |k: &[f32]| {
        let (dx, dy) = (convolve(plane, size, k, &smooth), convolve(plane, size, &smooth, k));
        dx.into_iter().zip(dy).map(|(dx, dy)| dx.hypot(dy)).collect::<Vec<_>>()
    };
    strength(&edge).into_iter().zip(strength(&point)).map(|(e, p)| [e, p]).collect()
}

fn kernel(radius: i32, f: impl Fn(f32) -> f32) -> Vec<f32> {
    (-radius..=radius).map(|x| f(x as f32)).collect()
}

/// Positive weights brought to a sum of 1, negative ones, if any, to −1.
fn normalised(mut kernel: Vec<f32>) -> Vec<f32> {
    let positive: f32 = kernel.iter().filter(|v| **v > 0.0).sum();
    let negative: f32 = -kernel.iter().filter(|v| **v < 0.0).sum::<f32>();
    for v in &mut kernel {
        *v /= if *v > 0.0 { positive } else { negative.max(f32::MIN_POSITIVE) };
    }
    kernel
}

/// Correlates rows with `kx`, then columns with `ky`, of one odd length; the border's pixels go on for ever.
fn convolve(plane: &[f32], (w, h): (usize, usize), kx: &[f32], ky: &[f32]) -> Vec<f32> {
    let radius = (kx.len() / 2) as isize;
    let clamp = |i: isize, n: usize| i.clamp(0, n as isize - 1) as usize;
    let mut rows = vec![0f32; plane.len()];
    rows.par_chunks_mut(w).zip(plane.par_chunks(w)).for_each(|(out, row)| {
        for (x, o) in out.iter_mut().enumerate() {
            let tap = |(i, k): (usize, &f32)| k * row[clamp(x as isize + i as isize - radius, w)];
            *o = kx.iter().enumerate().map(tap).sum();
        }
    });
    let mut out = vec![0f32; plane.len()];
    out.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
        for (i, k) in ky.iter().enumerate() {
            let row = clamp(y as isize + i as isize - radius, h) * w;
            for (o, v) in out.iter_mut().zip(&rows[row..row + w]) {
                *o += k * v;
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::tests::pictures;

    /// 0.1126581 is what the authors' `flip-evaluator` 1.7 says of the same pictures, with all its defaults.
    #[test]
    fn agrees_with_the_authors_program() {
        let [reference, picture, ..] = pictures();
        let flip = mean_hdr_flip(&reference, &picture);
        assert!((flip - 0.1126581).abs() < 2e-5, "{flip}");
        let (start, stop) = exposures(&reference.pixels);
        assert!((start + 6.922_439_6).abs() < 1e-4 && (stop - 1.685_056_4).abs() < 1e-4, "{start} {stop}");
    }

    #[test]
    fn exposure_is_automatic() {
        let [reference, picture, ..] = pictures();
        let brighter =
            |i: &Image| Image { pixels: i.pixels.iter().map(|&p| p * 64.0).collect(), ..i.clone() };
        let (a, b) =
            (mean_hdr_flip(&reference, &picture), mean_hdr_flip(&brighter(&reference), &brighter(&picture)));
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }

    #[test]
    fn colours_survive_the_way_there_and_back() {
        for c in [Rgb::WHITE, Rgb::new(0.2, 0.9, 0.05), Rgb::BLACK] {
            let back = rgb_from_ycxcz(ycxcz(c));
            assert!((back - c).map(f32::abs).max_channel() < 1e-5, "{c:?} {back:?}");
        }
    }
}
