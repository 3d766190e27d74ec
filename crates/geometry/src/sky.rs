//! Light from beyond all triangles: one colour, or an image around the scene.

use crate::math::{Vec2, Vec3};
use crate::{Rgb, sampling};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// Radiance by direction, cd/m². +y is up.
#[derive(Clone, Debug)]
pub enum Sky {
    /// The same from everywhere.
    Constant(Rgb),
    /// A panorama.
    Image(Box<SkyImage>),
}

/// A direction drawn from a sky.
#[derive(Clone, Copy, Debug)]
pub struct SkySample {
    /// Unit, toward the sky.
    pub direction: Vec3,
    /// What arrives from there, cd/m².
    pub radiance: Rgb,
    /// Density over solid angle, 1/sr.
    pub pdf: f32,
}

impl Sky {
    /// A panorama of `width` × `height` pixels (cd/m²), rows from the top, equirectangular.
    ///
    /// The column at `u` and row at `v`, both in [0, 1], look toward
    /// (−cos φ sin θ, cos θ, −sin φ sin θ) with φ = 2π u, θ = π v: the middle of the image lies along +x, and +z a
    /// quarter turn to its right, as in three.js and the Khronos viewer. Negative and non-finite pixels count as black.
    ///
    /// `None` when the number of pixels is not `width · height`, or zero.
    pub fn image(width: u32, height: u32, pixels: Vec<Rgb>) -> Option<Sky> {
        SkyImage::new(width, height, pixels).map(|image| Sky::Image(Box::new(image)))
    }

    /// The same sky, `factor` ≥ 0 times as bright, channel by channel.
    pub fn scaled(self, factor: Rgb) -> Sky {
        match self {
            Sky::Constant(l) => Sky::Constant(l * factor),
            Sky::Image(mut image) => {
                image.strength *= factor;
                image.mean *= factor;
                Sky::Image(image)
            }
        }
    }

    /// Radiance that arrives from the unit direction `d`, cd/m².
    pub fn radiance(&self, d: Vec3) -> Rgb {
        match self {
            Sky::Constant(l) => *l,
            Sky::Image(image) => image.radiance(d),
        }
    }

    /// Mean radiance over all directions, cd/m².
    pub fn mean(&self) -> Rgb {
        match self {
            Sky::Constant(l) => *l,
            Sky::Image(image) => image.mean,
        }
    }

    /// A direction in proportion to the radiance, about; `u` in [0, 1)².
    pub fn sample(&self, u: [f32; 2]) -> SkySample {
        match self {
            Sky::Constant(l) => {
                let direction = sampling::sphere(Vec2::from(u));
                SkySample { direction, radiance: *l, pdf: sampling::sphere_pdf_solid_angle() }
            }
            Sky::Image(image) => image.sample(u),
        }
    }

    /// The density with which [`Sky::sample`] gives the unit direction `d`, 1/sr.
    pub fn pdf(&self, d: Vec3) -> f32 {
        match self {
            Sky::Constant(_) => sampling::sphere_pdf_solid_angle(),
            Sky::Image(image) => image.pdf(d),
        }
    }
}

/// An equirectangular panorama with its table of importance. Made by [`Sky::image`].
///
/// Looked up bilinearly, sampled in pieces of one pixel (Pharr, Jakob and Humphreys, *Physically Based Rendering*,
/// sec. 12.5): a piece's weight is the largest radiance that the interpolation can reach in it, so that no direction
/// which shines has density zero.
#[derive(Clone, Debug)]
pub struct SkyImage {
    width: u32,
    height: u32,
    pixels: Vec<Rgb>,
    /// Factor on them, so that a dimmed panorama is known as the same one.
    strength: Rgb,
    /// Running sums of the rows' weights, `height` + 1 of them, ending at 1.
    rows: Vec<f32>,
    /// For each row the running sums of its pixels, `width` + 1 of them, ending at 1.
    columns: Vec<f32>,
    mean: Rgb,
}

impl SkyImage {
    fn new(width: u32, height: u32, mut pixels: Vec<Rgb>) -> Option<SkyImage> {
        let (w, h) = (width as usize, height as usize);
        if w == 0 || h == 0 || w.checked_mul(h) != Some(pixels.len()) {
            return None;
        }
        for l in &mut pixels {
            *l = l.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 });
        }
        // The solid angle of a pixel is in proportion to the step of cos θ over its row.
        let cos_step = |y: usize| {
            let edge = |y: usize| (std::f64::consts::PI * y as f64 / h as f64).cos();
            edge(y) - edge(y + 1)
        };
        let mut mean = [0f64; 3];
        let mut rows = vec![0f64; h];
        let mut columns = Vec::with_capacity(h * (w + 1));
        for (y, row) in rows.iter_mut().enumerate() {
            let mut weights = vec![0f64; w];
            for (x, weight) in weights.iter_mut().enumerate() {
                let l = pixels[y * w + x].to_array();
                (0..3).for_each(|c| mean[c] += l[c] as f64 * cos_step(y) / (2.0 * w as f64));
                for dy in y.saturating_sub(1)..=(y + 1).min(h - 1) {
                    for dx in [x + w - 1, x, x + 1] {
                        *weight = weight.max(pixels[dy * w + dx % w].mean() as f64);
                    }
                }
            }
            *row = weights.iter().sum::<f64>() * cos_step(y);
            columns.extend(running_sums(&weights));
        }
        let rows = running_sums(&rows);
        let mean = Rgb::new(mean[0] as f32, mean[1] as f32, mean[2] as f32);
        Some(SkyImage { width, height, pixels, strength: Rgb::WHITE, rows, columns, mean })
    }

    fn radiance(&self, d: Vec3) -> Rgb {
        let [u, v] = to_uv(d);
        let (w, h) = (self.width as i64, self.height as i64);
        let (x, y) = (u * w as f32 - 0.5, v * h as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let pixel = |dx: i64, dy: i64| {
            let (x, y) = ((x0 as i64 + dx).rem_euclid(w), (y0 as i64 + dy).clamp(0, h - 1));
            self.pixels[(y * w + x) as usize]
        };
        let (fx, fy) = (x - x0, y - y0);
        pixel(0, 0).lerp(pixel(1, 0), fx).lerp(pixel(0, 1).lerp(pixel(1, 1), fx), fy) * self.strength
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Factor on the pixels.
    pub fn strength(&self) -> Rgb {
        self.strength
    }

    /// The image's own radiance, cd/m², before the factor; rows from the top.
    pub fn pixels(&self) -> &[Rgb] {
        &self.pixels
    }

    fn row(&self, y: usize) -> &[f32] {
        let n = self.width as usize + 1;
        &self.columns[y * n..(y + 1) * n]
    }

    fn sample(&self, u: [f32; 2]) -> SkySample {
        let (y, fy) = pick(&self.rows, u[1]);
        let (x, fx) = pick(self.row(y), u[0]);
        // Even in cos θ within the row, so that the density over solid angle is constant in the pixel.
        let edge = |y: usize| (PI * y as f32 / self.height as f32).cos();
        let cos = edge(y) + (edge(y + 1) - edge(y)) * fy;
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let phi = TAU * (x as f32 + fx) / self.width as f32;
        let direction = Vec3::new(-phi.cos() * sin, cos, -phi.sin() * sin);
        SkySample { direction, radiance: self.radiance(direction), pdf: self.pixel_pdf(x, y) }
    }

    fn pdf(&self, d: Vec3) -> f32 {
        let [u, v] = to_uv(d);
        let x = ((u * self.width as f32) as usize).min(self.width as usize - 1);
        let y = ((v * self.height as f32) as usize).min(self.height as usize - 1);
        self.pixel_pdf(x, y)
    }

    fn pixel_pdf(&self, x: usize, y: usize) -> f32 {
        let row = self.row(y);
        let share = (self.rows[y + 1] - self.rows[y]) * (row[x + 1] - row[x]);
        let edge = |y: usize| (PI * y as f32 / self.height as f32).cos();
        share * self.width as f32 / (TAU * (edge(y) - edge(y + 1)))
    }
}

/// Where the unit direction `d` lies in the panorama, both in [0, 1]; v from the top.
fn to_uv(d: Vec3) -> [f32; 2] {
    let u = 0.5 + d.z.atan2(d.x) / TAU;
    [u.clamp(0.0, 1.0), d.y.clamp(-1.0, 1.0).acos() * FRAC_1_PI]
}

/// 0, then the sums of the first one, two, … weights over the sum of all; even steps when all are zero.
fn running_sums(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    let mut sums = vec![0f32];
    for (i, weight) in weights.iter().enumerate() {
        sum += weight;
        let even = (i + 1) as f64 / weights.len() as f64;
        sums.push(if total > 0.0 { (sum / total).min(1.0) } else { even } as f32);
    }
    sums
}

/// The step of `sums` that `u` in [0, 1) falls into, and how far into it in [0, 1].
fn pick(sums: &[f32], u: f32) -> (usize, f32) {
    let last = sums.len() - 2;
    let mut i = sums.partition_point(|&s| s <= u).saturating_sub(1).min(last);
    // At the very end rounding may leave steps of no width.
    while i > 0 && sums[i + 1] <= sums[i] {
        i -= 1;
    }
    let width = sums[i + 1] - sums[i];
    (i, if width > 0.0 { ((u - sums[i]) / width).clamp(0.0, 1.0) } else { 0.5 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panorama() -> Sky {
        let pixels =
            (0..16 * 8).map(|i| Rgb::splat(if i == 37 { 500.0 } else { (i % 5) as f32 * 0.3 })).collect();
        Sky::image(16, 8, pixels).expect("16 × 8 pixels")
    }

    /// Mean of `f` over a grid of the sphere, even in solid angle.
    fn sphere_mean(f: impl Fn(Vec3) -> f32) -> f32 {
        let n = 512;
        let mut sum = 0f64;
        for i in 0..n {
            for j in 0..2 * n {
                let y = 1.0 - 2.0 * (i as f32 + 0.5) / n as f32;
                let phi = TAU * (j as f32 + 0.5) / (2 * n) as f32;
                let r = (1.0 - y * y).sqrt();
                sum += f(Vec3::new(r * phi.cos(), y, r * phi.sin())) as f64;
            }
        }
        (sum / (2 * n * n) as f64) as f32
    }

    #[test]
    fn the_density_integrates_to_one() {
        for sky in
            [panorama(), Sky::Constant(Rgb::WHITE), Sky::image(3, 2, vec![Rgb::BLACK; 6]).expect("six")]
        {
            let integral = 4.0 * PI * sphere_mean(|d| sky.pdf(d));
            // A pixel's edge falls between two of the grid's 512 rows: 1/512 of a bright pixel.
            assert!((integral - 1.0).abs() < 4e-3, "{integral}");
        }
    }

    #[test]
    fn samples_carry_their_density_and_radiance() {
        for sky in [panorama(), Sky::Constant(Rgb::WHITE)] {
            let (mut sum, n) = (0f64, 128);
            for i in 0..n * n {
                let u = [(i % n) as f32 + 0.5, (i / n) as f32 + 0.5].map(|x| x / n as f32);
                let s = sky.sample(u);
                assert!((s.direction.length() - 1.0).abs() < 1e-4);
                assert!((sky.pdf(s.direction) / s.pdf - 1.0).abs() < 1e-3 || u[0] < 1e-2, "{u:?}");
                assert_eq!(sky.radiance(s.direction), s.radiance);
                sum += (s.radiance.mean() / s.pdf) as f64 / (n * n) as f64;
            }
            // ∫ L dω by importance against the plain grid.
            let plain = 4.0 * PI * sphere_mean(|d| sky.radiance(d).mean());
            assert!((sum as f32 / plain - 1.0).abs() < 5e-3, "{sum} {plain}");
        }
    }

    #[test]
    fn the_middle_of_the_image_lies_along_x() {
        let mut pixels = vec![Rgb::BLACK; 64 * 32];
        pixels[16 * 64 + 32] = Rgb::WHITE;
        pixels[48] = Rgb::new(0.0, 9.0, 0.0);
        let sky = Sky::image(64, 32, pixels).expect("64 × 32 pixels");
        assert!(sky.radiance(Vec3::new(1.0, -0.04, 0.04).normalize()).r > 0.8);
        // The top row at u = 3/4 is nearly straight up, leaning toward +z.
        assert!(sky.radiance(Vec3::new(0.0, 1.0, 0.045).normalize()).g > 3.0);
        assert!(Sky::image(3, 3, vec![Rgb::WHITE; 8]).is_none());
        assert!((sky.scaled(Rgb::splat(2.0)).radiance(Vec3::new(1.0, -0.04, 0.04).normalize()).r) > 1.6);
    }

    #[test]
    fn an_even_panorama_has_its_value_as_mean() {
        let sky = Sky::image(5, 3, vec![Rgb::new(1.0, 2.0, 3.0); 15]).expect("15 pixels");
        assert!((sky.mean() - Rgb::new(1.0, 2.0, 3.0)).max_channel().abs() < 1e-6);
    }
}
