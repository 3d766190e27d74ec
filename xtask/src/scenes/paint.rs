//! Textures painted by functions, as PNG.

use glam::DVec2;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// A PNG of `width` × `height` whose pixel at (x, y), counted from the top left, is `color`, each channel in
/// [0, 1] as encoded in the file (sRGB for colours, linear for normal maps).
pub fn png(width: u32, height: u32, color: impl Fn(u32, u32) -> [f64; 3]) -> Vec<u8> {
    let pixel = |i: u32| color(i % width, i / width).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    let bytes: Vec<u8> = (0..width * height).flat_map(pixel).collect();
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
        .write_image(&bytes, width, height, ExtendedColorType::Rgb8)
        .expect("a buffer of the stated size can always be written to memory");
    png
}

/// Oak planks, 16 rows of them: 512 × 512, tiling.
pub fn planks() -> Vec<u8> {
    const ROW: u32 = 32;
    png(512, 512, |x, y| {
        let row = y / ROW;
        // Each row is two planks, shifted against its neighbours.
        let along = (x + 512 - hash(row, 1) % 512) % 512;
        let plank = 2 * row + u32::from(along >= 200 + hash(row, 2) % 112);
        let seam = y % ROW == 0 || along == 0 || along == 200 + hash(row, 2) % 112;
        let tone = unit(hash(plank, 3));
        // Fibres are long and thin: noise stretched along the plank, a different piece of it for each.
        let (u, v) = (f64::from(along), f64::from(y) + 64.0 * f64::from(plank));
        let fibre = 0.6 * noise(u / 48.0, v / 2.0) + 0.4 * noise(u / 12.0, v);
        let light = (0.86 + 0.2 * tone + 0.14 * (fibre - 0.5)) * if seam { 0.72 } else { 1.0 };
        // Eight bits hold more than the eye sees of this; fewer levels compress to half the size.
        let light = (light * 64.0).round() / 64.0;
        [0.66, 0.50 - 0.02 * tone, 0.345 - 0.03 * tone].map(|c| c * light)
    })
}

/// A woven rug, 384 × 240: lozenges within two borders.
pub fn rug() -> Vec<u8> {
    let (cream, rust, navy, gold) =
        ([0.86, 0.80, 0.70], [0.62, 0.27, 0.20], [0.20, 0.25, 0.36], [0.78, 0.58, 0.32]);
    png(384, 240, |x, y| {
        let margin = x.min(y).min(383 - x).min(239 - y);
        let lozenge = |size: f64| {
            let fold = |a: u32| ((f64::from(a) / size).fract() - 0.5).abs();
            fold(x) + fold(y)
        };
        let color = match margin {
            0..6 => navy,
            6..9 => gold,
            9..21 if lozenge(12.0) < 0.35 => cream,
            9..21 => rust,
            21..24 => gold,
            _ => match lozenge(48.0) {
                d if d < 0.14 => rust,
                d if d < 0.24 => gold,
                d if d < 0.40 => navy,
                d if d < 0.47 => cream,
                _ if lozenge(24.0) < 0.2 => navy,
                _ => rust,
            },
        };
        // Warp and weft.
        let weave = if (x + y) % 2 == 0 { 1.0 } else { 0.93 };
        color.map(|c| c * weave)
    })
}

/// Hills in four distances under a low sun.
pub fn landscape() -> Vec<u8> {
    png(192, 256, |x, y| {
        let (u, v) = (f64::from(x) / 192.0, f64::from(y) / 256.0);
        if DVec2::new(u - 0.63, (v - 0.33) * 4.0 / 3.0).length() < 0.11 {
            return [0.93, 0.62, 0.36];
        }
        let hills = [[0.72, 0.58, 0.50], [0.55, 0.45, 0.46], [0.33, 0.34, 0.41], [0.17, 0.22, 0.29]];
        let ridge = |i: usize| {
            let phase = i as f64 * 1.9;
            0.45 + 0.14 * i as f64 + 0.06 * (5.0 * u + phase).sin() + 0.02 * (13.0 * u + 2.0 * phase).sin()
        };
        let nearest = (0..4).rev().find(|&i| v > ridge(i));
        nearest.map_or_else(|| mix([0.60, 0.66, 0.70], [0.93, 0.80, 0.65], v / 0.5), |i| hills[i])
    })
}

/// Three soft fields of colour on a ground.
pub fn fields() -> Vec<u8> {
    png(192, 256, |x, y| {
        let (u, v) = (f64::from(x) / 192.0, f64::from(y) / 256.0);
        let fields = [
            (0.08, 0.40, [0.80, 0.42, 0.22]),
            (0.45, 0.66, [0.88, 0.70, 0.42]),
            (0.71, 0.92, [0.32, 0.16, 0.18]),
        ];
        let ground = [0.52, 0.20, 0.17];
        fields.iter().fold(ground, |color, &(top, foot, field)| {
            let inside = (u - 0.09).min(0.91 - u).min(v - top).min(foot - v);
            mix(color, field, smooth(inside / 0.03 + 0.5 * noise(u * 24.0, v * 24.0) - 0.25))
        })
    })
}

/// Rings and arcs that overlap.
pub fn circles() -> Vec<u8> {
    let circles = [
        (0.35, 0.40, 0.30, [0.16, 0.36, 0.42]),
        (0.66, 0.62, 0.24, [0.85, 0.60, 0.25]),
        (0.60, 0.27, 0.15, [0.70, 0.28, 0.22]),
        (0.30, 0.86, 0.14, [0.35, 0.50, 0.40]),
    ];
    png(192, 256, |x, y| {
        let p = DVec2::new(f64::from(x), f64::from(y)) / 192.0;
        circles.iter().fold([0.90, 0.86, 0.78], |color, &(cx, cy, r, paint)| {
            let d = p.distance(DVec2::new(cx, cy * 4.0 / 3.0)) / r;
            let ring = if d < 0.55 || (0.7..1.0).contains(&d) { 0.8 } else { 0.0 };
            mix(color, paint, ring)
        })
    })
}

/// Dusk over hills, to be multiplied with a luminance: an emissive texture, 256 × 128.
pub fn dusk() -> Vec<u8> {
    png(256, 128, |x, y| {
        let (u, v) = (f64::from(x) / 256.0, f64::from(y) / 128.0);
        let ridge = 0.66 + 0.05 * (7.0 * u).sin() + 0.025 * (19.0 * u + 1.0).sin();
        if v > ridge {
            return mix([0.20, 0.24, 0.30], [0.10, 0.13, 0.14], (v - ridge) * 4.0);
        }
        let low = mix([0.62, 0.70, 0.88], [1.00, 0.80, 0.60], smooth((v - 0.35) / 0.3));
        mix([0.36, 0.50, 0.80], low, v / 0.5)
    })
}

/// A relief of crossing waves as a tangent-space normal map, 256 × 256: x right, y up, tiling.
pub fn relief() -> Vec<u8> {
    let height = |x: f64, y: f64| {
        let (u, v) = (x / 256.0 * std::f64::consts::TAU, y / 256.0 * std::f64::consts::TAU);
        14.0 * (2.0 * u + 1.2 * v.sin()).sin() + 6.0 * (3.0 * v + 1.5 * u.sin()).cos()
    };
    png(256, 256, |x, y| {
        let (x, y) = (f64::from(x), f64::from(y));
        let slope_x = 0.5 * (height(x + 1.0, y) - height(x - 1.0, y));
        let slope_down = 0.5 * (height(x, y + 1.0) - height(x, y - 1.0));
        let n = glam::DVec3::new(-slope_x, slope_down, 1.0).normalize();
        (0.5 * n + 0.5).to_array()
    })
}

/// `a` at `t` ≤ 0, `b` at `t` ≥ 1.
fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// 0 below 0, 1 above 1, with a level start and end.
fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Smooth noise in [0, 1]: hashed values on the integers, blended between.
fn noise(x: f64, y: f64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let at = |di: i32, dj: i32| unit(hash((i as i32 + di) as u32, (j as i32 + dj) as u32));
    let (s, t) = (smooth(x - i), smooth(y - j));
    let row = |dj| at(0, dj) + (at(1, dj) - at(0, dj)) * s;
    row(0) + (row(1) - row(0)) * t
}

/// Two numbers scrambled into one: the output function of PCG, as Jarzynski and Olano recommend for this
/// ("Hash Functions for GPU Rendering", JCGT 9(3), 2020), nested.
pub fn hash(a: u32, b: u32) -> u32 {
    let pcg = |v: u32| {
        let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    pcg(a.wrapping_add(pcg(b)))
}

/// To [0, 1).
pub fn unit(h: u32) -> f64 {
    f64::from(h) / 4_294_967_296.0
}
