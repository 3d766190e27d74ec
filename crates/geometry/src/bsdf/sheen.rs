//! Sheen: fibres that stand out of cloth and send light back at grazing angles.
//!
//! KHR_materials_sheen: the "Charlie" distribution of normals with its fitted shadowing (A. Estevez and C. Kulla,
//! "Production Friendly Microfacet Sheen BRDF", SIGGRAPH 2017 course).

use super::shading::Sheen;
use crate::Rgb;
use crate::math::Vec3;
use crate::sampling::{Lattice2, cosine_hemisphere};
use std::f32::consts::{PI, TAU};
use std::sync::OnceLock;

/// Smoother fibres than that have no albedo worth speaking of, and powers that overflow.
const SMOOTHEST: f32 = 0.07;

/// One fuzz. Directions are local, z along the shading normal.
#[derive(Clone, Copy, Debug)]
pub struct Fuzz {
    color: Rgb,
    /// Roughness².
    alpha: f32,
}

impl Fuzz {
    pub fn new(sheen: &Sheen) -> Fuzz {
        let roughness = sheen.roughness.clamp(SMOOTHEST, 1.0);
        Fuzz { color: sheen.color.min(Rgb::WHITE), alpha: roughness * roughness }
    }

    /// f, 1/sr, for two directions above the horizon.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let Some(h) = (wo + wi).try_normalize() else { return Rgb::BLACK };
        self.color * (shape(self.alpha, wo.z, wi.z, h) * gain(self.alpha))
    }

    /// Share of uniform light sent to `cos`, by channel.
    pub fn albedo(&self, cos: f32) -> Rgb {
        self.color * albedo(self.alpha, cos)
    }
}

/// D V of the extension, 1/sr.
fn shape(alpha: f32, cos_o: f32, cos_i: f32, h: Vec3) -> f32 {
    let sin = (h.x * h.x + h.y * h.y).sqrt().min(1.0);
    let d = (2.0 + 1.0 / alpha) * sin.powf(1.0 / alpha) / TAU;
    let v = 1.0 / ((1.0 + lambda(alpha, cos_o) + lambda(alpha, cos_i)) * 4.0 * (cos_o * cos_i).max(1e-6));
    d * v
}

/// The fitted Λ of Estevez and Kulla, their section 3 and table 1.
fn lambda(alpha: f32, cos: f32) -> f32 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    let of = |rough: f32, smooth: f32| rough + (smooth - rough) * t;
    let (a, b) = (of(21.5473, 25.3245), of(3.82987, 3.32435));
    let (c, d, e) = (of(0.19823, 0.16801), of(-1.97760, -1.27393), of(-4.32054, -4.85967));
    let l = |x: f32| a / (1.0 + b * x.powf(c)) + d * x + e;
    let cos = cos.clamp(0.0, 1.0);
    if cos < 0.5 { l(cos).exp() } else { (2.0 * l(0.5) - l(1.0 - cos)).exp() }
}

const ROWS: usize = 24;
const COLUMNS: usize = 48;

struct Table {
    /// By roughness and √cos.
    albedo: Vec<[f32; COLUMNS]>,
    /// Largest factor, at most 1, that keeps each row from sending back more than it gets.
    gain: [f32; ROWS],
}

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        let lattice = Lattice2::new(1024);
        let mut gain = [1.0; ROWS];
        let rows = (0..ROWS).map(|r| {
            let alpha = (r as f32 / (ROWS - 1) as f32).max(SMOOTHEST).powi(2);
            let row: [f32; COLUMNS] = std::array::from_fn(|c| {
                let x = c as f32 / (COLUMNS - 1) as f32;
                integrate(alpha, (x * x).max(1e-4), &lattice)
            });
            let most = row.into_iter().fold(0.0, f32::max);
            gain[r] = 1.0 / f32::max(most, 1.0);
            row.map(|e| e * gain[r])
        });
        let albedo = rows.collect();
        Table { albedo, gain }
    })
}

/// ∫ f cos over the hemisphere for white fibres, without the gain.
fn integrate(alpha: f32, cos: f32, lattice: &Lattice2) -> f32 {
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let n = lattice.len();
    let sum: f32 = (0..n)
        .map(|i| {
            let wi = cosine_hemisphere(lattice.point(i, crate::math::Vec2::splat(0.5 / n as f32)));
            if wi.z <= 0.0 { 0.0 } else { PI * shape(alpha, wo.z, wi.z, (wo + wi).normalize()) }
        })
        .sum();
    sum / n as f32
}

fn row(alpha: f32) -> (usize, f32) {
    let x = alpha.clamp(0.0, 1.0).sqrt() * (ROWS - 1) as f32;
    let r = (x as usize).min(ROWS - 2);
    (r, x - r as f32)
}

/// Share of uniform light that white fibres send to `cos`, [0, 1].
fn albedo(alpha: f32, cos: f32) -> f32 {
    let (r, t) = row(alpha);
    let x = cos.clamp(0.0, 1.0).sqrt() * (COLUMNS - 1) as f32;
    let c = (x as usize).min(COLUMNS - 2);
    let at = |r: usize| {
        let row = &table().albedo[r];
        row[c] + (row[c + 1] - row[c]) * (x - c as f32)
    };
    at(r) + (at(r + 1) - at(r)) * t
}

/// Factor on f that keeps the albedo within 1.
fn gain(alpha: f32) -> f32 {
    let (r, t) = row(alpha);
    let g = &table().gain;
    g[r] + (g[r + 1] - g[r]) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_integral() {
        let fine = Lattice2::new(8192);
        for roughness in [0.1f32, 0.3, 0.52, 0.8, 1.0] {
            let alpha = roughness * roughness;
            for cos in [0.05, 0.2, 0.43, 0.8, 1.0] {
                let (a, b) = (albedo(alpha, cos), gain(alpha) * integrate(alpha, cos, &fine));
                // The smoothest fibres shine at the very rim only.
                let tolerance = if cos < 0.1 { 0.03 } else { 0.015 };
                assert!((a - b).abs() < tolerance && a <= 1.0, "{roughness} at {cos}: {a}, {b}");
            }
        }
    }
}
