//! From the unit square to disc, hemisphere, sphere, cone and triangle; beside each its density.
//!
//! Directions are local: z is the axis. `u` lies in [0, 1)².

use crate::math::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};

/// Uniform in the unit disc, by concentric squares, which keep neighbours neighbours.
///
/// Shirley and Chiu, "A Low Distortion Map Between Disk and Square", J. Graphics Tools 2(3), 1997.
pub fn disc(u: Vec2) -> Vec2 {
    let p = u * 2.0 - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    Vec2::from_angle(phi) * r
}

/// Density of [`disc`] over area: 1/π.
pub fn disc_pdf_area() -> f32 {
    FRAC_1_PI
}

/// Unit direction of the upper hemisphere, with density cos θ / π: Malley's method, the disc lifted.
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = disc(u);
    // The rim must stay above the horizon, or the weight cos/pdf is 0/0.
    d.extend((1.0 - d.length_squared()).max(1e-8).sqrt())
}

/// Density of [`cosine_hemisphere`], 1/sr; `cos` is the z of the direction, 0 below the horizon.
pub fn cosine_hemisphere_pdf_solid_angle(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Unit direction, uniform over the whole sphere (Archimedes: z is uniform).
pub fn sphere(u: Vec2) -> Vec3 {
    around(1.0 - 2.0 * u.y, u.x)
}

/// Density of [`sphere`], 1/sr: 1/4π.
pub fn sphere_pdf_solid_angle() -> f32 {
    0.25 * FRAC_1_PI
}

/// Unit direction, uniform within the cone around +z whose half-angle has the cosine `cos_max`, in [−1, 1].
pub fn cone(u: Vec2, cos_max: f32) -> Vec3 {
    // sin² from 1 − z without cancellation, so that a cone as narrow as the sun keeps its shape.
    let one_minus_z = u.y * (1.0 - cos_max);
    let sin = (one_minus_z * (2.0 - one_minus_z)).max(0.0).sqrt();
    (Vec2::from_angle(2.0 * PI * u.x) * sin).extend(1.0 - one_minus_z)
}

/// Density of [`cone`], 1/sr: 1 / (2π (1 − cos_max)).
pub fn cone_pdf_solid_angle(cos_max: f32) -> f32 {
    1.0 / (2.0 * PI * (1.0 - cos_max))
}

/// Barycentric (u, v), the weights of the second and third corner, uniform over a triangle's area.
///
/// E. Heitz, "A Low-Distortion Map Between Triangle and Square", 2019.
pub fn triangle(u: Vec2) -> (f32, f32) {
    if u.y > u.x {
        let a = 0.5 * u.x;
        (a, u.y - a)
    } else {
        let b = 0.5 * u.y;
        (u.x - b, b)
    }
}

/// Density of [`triangle`] over area, 1/m²: 1/area.
pub fn triangle_pdf_area(area: f32) -> f32 {
    1.0 / area
}

/// The unit vector at height `z`, `turns` of a full turn around the axis.
fn around(z: f32, turns: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    (Vec2::from_angle(2.0 * PI * turns) * r).extend(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Lattice2, Rng};

    /// χ² of `n` samples over `k` equally likely bins, as a standard normal (Wilson and Hilferty, 1931).
    fn z_of_uniform(k: usize, n: usize, mut bin: impl FnMut() -> usize) -> f64 {
        let mut counts = vec![0u32; k];
        for _ in 0..n {
            counts[bin()] += 1;
        }
        let expected = n as f64 / k as f64;
        let chi2: f64 = counts.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
        let (df, spread) = (k as f64 - 1.0, 2.0 / (9.0 * (k as f64 - 1.0)));
        ((chi2 / df).cbrt() - (1.0 - spread)) / spread.sqrt()
    }

    /// Bin of 16 × 8 for coordinates in [0, 1].
    fn cell(x: f32, y: f32) -> usize {
        ((x * 16.0) as usize).min(15) * 8 + ((y * 8.0) as usize).min(7)
    }

    fn turn(x: f32, y: f32) -> f32 {
        y.atan2(x) / (2.0 * PI) + 0.5
    }

    #[test]
    fn every_map_follows_its_density() {
        // 2·10⁵ samples in 128 bins of equal probability; z < 4.9: one false alarm in a million.
        // A density wrong by 3 % in half of the bins gives z = 8.
        let n = 200_000;
        let mut rng = Rng::new(2, 0);
        let z = [
            z_of_uniform(128, n, || {
                let d = disc(rng.vec2());
                cell(turn(d.x, d.y), d.length_squared())
            }),
            z_of_uniform(128, n, || {
                let w = cosine_hemisphere(rng.vec2());
                cell(turn(w.x, w.y), w.z * w.z) // P(cos < c) = c²
            }),
            z_of_uniform(128, n, || {
                let w = sphere(rng.vec2());
                cell(turn(w.x, w.y), 0.5 + 0.5 * w.z)
            }),
            z_of_uniform(128, n, || {
                let w = cone(rng.vec2(), 0.8);
                cell(turn(w.x, w.y), (w.z - 0.8) / 0.2)
            }),
            z_of_uniform(128, n, || {
                // The corner (0, 0) cut off at u + v = s holds s² of the area, evenly along u/s.
                let (u, v) = triangle(rng.vec2());
                cell(u / (u + v).max(1e-9), (u + v) * (u + v))
            }),
        ];
        assert!(z.iter().all(|z| *z < 4.9), "{z:?}");
    }

    #[test]
    fn densities_integrate_to_one() {
        let lattice = Lattice2::new(4096);
        let mean = |f: &dyn Fn(Vec3) -> f32| {
            (0..4096).map(|i| f64::from(f(sphere(lattice.point(i, Vec2::splat(1e-4)))))).sum::<f64>() / 4096.0
        };
        let sphere_area = 4.0 * std::f64::consts::PI;
        assert!((sphere_area * mean(&|_| sphere_pdf_solid_angle()) - 1.0).abs() < 1e-6);
        assert!((sphere_area * mean(&|w| cosine_hemisphere_pdf_solid_angle(w.z)) - 1.0).abs() < 1e-3);
        let cap = |w: Vec3| if w.z > 0.8 { cone_pdf_solid_angle(0.8) } else { 0.0 };
        assert!((sphere_area * mean(&cap) - 1.0).abs() < 5e-3);
    }

    #[test]
    fn directions_are_unit_even_at_the_rim() {
        let mut rng = Rng::new(4, 0);
        for i in 0..2000 {
            let u = if i % 2 == 0 { Vec2::new(rng.f32(), 0.0) } else { rng.vec2() };
            for w in [cosine_hemisphere(u), sphere(u), cone(u, 0.99999)] {
                assert!((w.length() - 1.0).abs() < 1e-6, "{w}");
            }
            assert!(cosine_hemisphere(u).z > 0.0);
        }
    }
}
