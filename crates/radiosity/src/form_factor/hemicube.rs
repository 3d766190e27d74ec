//! The hemicube (Cohen and Greenberg, SIGGRAPH 1985): half a cube of pixels over the middle of a patch.
//!
//! What is seen in a pixel is found by one ray through its middle, not by a rasteriser with a z-buffer: the same
//! answer, since both look at one point of each pixel, at a cost that grows with the logarithm of the scene, from the
//! one tree that everything else asks too. And such a ray goes on through mirrors and glass, which a z-buffer cannot.
//! The method's own failures stay: what falls between pixel middles is not seen, and one point speaks for a patch.

use super::arrival::{Arrival, follow};
use crate::patches::Patches;
use geometry::sampling::Rng;
use geometry::{Vec3, World};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Pixels that one task looks through.
const CHUNK: usize = 1024;

/// Directions and weights of the pixels.
#[derive(Clone, Debug)]
pub struct Hemicube {
    resolution: u32,
    pixels: Vec<Pixel>,
}

/// One pixel.
#[derive(Clone, Copy, Debug)]
pub struct Pixel {
    /// Unit, toward its middle; z along the normal.
    pub direction: Vec3,
    /// Its delta form factor: the share of what leaves the middle of the patch that goes through it.
    pub share: f64,
}

impl Hemicube {
    /// - `resolution`: pixels along an edge of the top face, even and at least 2; the four sides are half as high.
    pub fn new(resolution: u32) -> Hemicube {
        let n = resolution.next_multiple_of(2).max(2);
        let step = 2.0 / f64::from(n);
        let mut pixels = Vec::with_capacity(3 * (n * n) as usize);
        let edge = |i: u32| -1.0 + step * f64::from(i);
        for j in 0..n {
            for i in 0..n {
                let (x, y) = (edge(i), edge(j));
                let share = over(&top, [x, y], step);
                let direction = Vec3::new((x + 0.5 * step) as f32, (y + 0.5 * step) as f32, 1.0).normalize();
                pixels.push(Pixel { direction, share });
            }
        }
        for turn in 0..4 {
            for j in 0..n / 2 {
                for i in 0..n {
                    let (y, z) = (edge(i), step * f64::from(j));
                    let share = over(&side, [y, z], step);
                    let (y, z) = ((y + 0.5 * step) as f32, (z + 0.5 * step) as f32);
                    let d = [
                        Vec3::new(1.0, y, z),
                        Vec3::new(-y, 1.0, z),
                        Vec3::new(-1.0, -y, z),
                        Vec3::new(y, -1.0, z),
                    ];
                    pixels.push(Pixel { direction: d[turn].normalize(), share });
                }
            }
        }
        Hemicube { resolution: n, pixels }
    }

    /// Pixels along an edge of the top face.
    pub fn resolution(&self) -> u32 {
        self.resolution
    }

    /// All pixels: the top face row by row, then the sides.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// Form factors from the middle of `patch`.
    pub fn row(&self, world: &World, patches: &Patches, patch: u32, seed: u64, stream: u64) -> Vec<Arrival> {
        let normal = patches.normal(patch);
        let (tangent, bitangent) = geometry::math::frame(normal);
        let look = |(chunk, pixels): (usize, &[Pixel])| {
            // For the choices at mirrors and glass; the pixels themselves are no matter of chance.
            let mut rng = Rng::new(seed ^ 0x6375_6265, stream.wrapping_mul(1 << 20) + chunk as u64);
            let mut seen = Vec::with_capacity(pixels.len());
            for pixel in pixels {
                let d = pixel.direction;
                let wi = tangent * d.x + bitangent * d.y + normal * d.z;
                let (ray, _) = patches.leave(world, patch, [1.0 / 3.0; 2], wi);
                follow(world, patches, ray, &mut rng, |patch, way, left| {
                    seen.push(Arrival { patch, way, share: left * pixel.share as f32 });
                });
            }
            seen
        };
        self.pixels.par_chunks(CHUNK).enumerate().flat_map_iter(look).collect()
    }
}

/// Midpoint weights, as they were published: cos φ_i cos φ_j / (π r²) at the middle of the pixel times its area. On the
/// top face 1 / (π (x² + y² + 1)²) ΔA, on a side z / (π (y² + z² + 1)²) ΔA.
///
/// Good to 2/resolution² each, but in coarse cubes they do not sum to 1. [`Hemicube`] integrates over the pixel.
pub fn published_share(direction: Vec3, resolution: u32) -> f64 {
    let d = direction.as_dvec3() / f64::from(direction.abs().max_element());
    let area = (2.0 / f64::from(resolution)).powi(2);
    d.z / (std::f64::consts::PI * d.length_squared().powi(2)) * area
}

/// Integral over a square pixel from its lower corner, by the primitive at its four corners.
fn over(primitive: &impl Fn(f64, f64) -> f64, [x, y]: [f64; 2], step: f64) -> f64 {
    primitive(x + step, y + step) - primitive(x, y + step) - primitive(x + step, y) + primitive(x, y)
}

/// ∂²/∂x∂y of this is 1 / (π (1 + x² + y²)²): the form factor of the rectangle from the centre (Howell's B-4).
fn top(x: f64, y: f64) -> f64 {
    let (sx, sy) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / sx * (y / sx).atan() + y / sy * (x / sy).atan()) / TAU
}

/// ∂²/∂y∂z of this is z / (π (1 + y² + z²)²).
fn side(y: f64, z: f64) -> f64 {
    let s = (1.0 + z * z).sqrt();
    -(y / s).atan() / (TAU * s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::polygon::polygon_irradiance;

    /// Every pixel against Lambert's sum for its square, and all of them together.
    #[test]
    fn delta_form_factors_are_those_of_the_pixels() {
        let n = 16;
        let cube = Hemicube::new(n);
        let half = 1.0 / n as f32;
        for pixel in cube.pixels() {
            let d = pixel.direction / pixel.direction.abs().max_element();
            let axis = if d.z == 1.0 {
                2
            } else if d.x.abs() == 1.0 {
                0
            } else {
                1
            };
            let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[s, t]| {
                let mut p = d;
                p[(axis + 1) % 3] += s * half;
                p[(axis + 2) % 3] += t * half;
                p
            });
            let exact = f64::from(polygon_irradiance(Vec3::ZERO, Vec3::Z, &square));
            assert!((pixel.share - exact).abs() < 1e-7, "{d}: {} {exact}", pixel.share);
        }
        for n in [2, 16, 64, 128] {
            let sum: f64 = Hemicube::new(n).pixels().iter().map(|p| p.share).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{n}: {sum}");
        }
    }

    /// The published weights approach these with 1/n², and sum to more than 1 in a coarse cube.
    #[test]
    fn published_weights_are_those_of_fine_pixels() {
        let errors = [4, 16, 64].map(|n| {
            let cube = Hemicube::new(n);
            let sum: f64 = cube.pixels().iter().map(|p| published_share(p.direction, n)).sum();
            let worst = cube.pixels().iter().map(|p| (published_share(p.direction, n) / p.share - 1.0).abs());
            (worst.fold(0.0, f64::max), sum)
        });
        println!("published weights, worst pixel and sum at 4, 16, 64: {errors:?}");
        assert!(errors[0].1 > 1.001 && (errors[2].1 - 1.0).abs() < 2e-4, "{errors:?}");
        assert!(errors[1].0 < errors[0].0 / 8.0 && errors[2].0 < errors[1].0 / 8.0, "{errors:?}");
        // Straight up 1/π, that is 4/π of an even share of the face; a renderer that divides by r² for r⁴ has 35 % less.
        let up = Hemicube::new(64).pixels()[64 * 32 + 32].share * 32.0 * 32.0;
        assert!((up - 1.0 / std::f64::consts::PI).abs() < 1e-3, "{up}");
    }
}
