//! Directional albedo of GGX reflection, tabulated once: how much of a uniform light it sends to one direction.

use super::ggx::Ggx;
use crate::Rgb;
use crate::math::{Vec2, Vec3};
use crate::optics::{reflect, refract, schlick_weight};
use crate::sampling::Lattice2;
use std::sync::OnceLock;

/// Directional albedo split by Fresnel term: Schlick's F is linear in F0, so two numbers serve every F0
/// (B. Karis, "Real Shading in Unreal Engine 4", SIGGRAPH 2013 course).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directional {
    /// ⟨G2/G1⟩: the albedo when every microfacet reflects everything, [0, 1].
    pub all: f32,
    /// ⟨G2/G1 (1 − V·H)⁵⟩: the part that Schlick adds for F0 = 0, [0, `all`].
    pub grazing: f32,
}

impl Directional {
    /// Albedo with the Fresnel term F0 + (1 − F0)(1 − V·H)⁵.
    pub fn with_f0(self, f0: f32) -> f32 {
        f0 * (self.all - self.grazing) + self.grazing
    }

    fn lerp(self, o: Directional, t: f32) -> Directional {
        Directional {
            all: self.all + t * (o.all - self.all),
            grazing: self.grazing + t * (o.grazing - self.grazing),
        }
    }
}

/// Albedo toward a direction of cosine `cos` in (0, 1] for width `alpha` in [0, 1]; 0 is a perfect mirror.
pub fn directional(alpha: f32, cos: f32) -> Directional {
    if alpha == 0.0 {
        return Directional { all: 1.0, grazing: schlick_weight(cos) };
    }
    let (row, t) = Table::row(alpha);
    let table = table();
    table.rows[row].at(cos).lerp(table.rows[row + 1].at(cos), t)
}

/// The same averaged over the cosine-weighted hemisphere: 2 ∫ E(μ) μ dμ.
pub fn hemispherical(alpha: f32) -> Directional {
    if alpha == 0.0 {
        return Directional { all: 1.0, grazing: 1.0 / 21.0 }; // 2 ∫ (1 − μ)⁵ μ dμ = 2 (1/6 − 1/7)
    }
    let (row, t) = Table::row(alpha);
    let table = table();
    table.rows[row].mean.lerp(table.rows[row + 1].mean, t)
}

/// Albedo of rough refracting glass toward `cos`: what its facets reflect and what they let pass, by Fresnel terms
/// that `reflected` and `passed` give for the cosine to the facet; over a Fibonacci lattice of visible normals.
pub fn rough_glass(
    alpha: f32,
    eta: f32,
    cos: f32,
    reflected: impl Fn(f32) -> Rgb,
    passed: impl Fn(f32) -> Rgb,
) -> Rgb {
    const POINTS: u32 = 233;
    let ggx = Ggx::round(alpha);
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let mut sum = Rgb::BLACK;
    for i in 0..POINTS {
        let u = Vec2::new(i as f32 + 0.5, (i * 144 % POINTS) as f32 + 0.5) / POINTS as f32;
        let h = ggx.sample_visible(wo, u);
        let facet = wo.dot(h);
        let mirrored = reflect(wo, h);
        if mirrored.z > 0.0 {
            sum += reflected(facet) * (ggx.g2_reflection(wo, mirrored) / ggx.g1(wo));
        }
        if let Some(wi) = refract(wo, h, eta).filter(|wi| wi.z < 0.0) {
            sum += passed(facet) * (ggx.g2_transmission(wo, wi) / ggx.g1(wo));
        }
    }
    sum / POINTS as f32
}

/// Rows by roughness √α, so that narrow lobes get their share.
const ROWS: usize = 25;
/// Columns by √cos: near grazing incidence the albedo turns fastest.
const COLUMNS: usize = 32;
/// Lattice points for each entry.
const POINTS: u32 = 384;

struct Row {
    entries: [Directional; COLUMNS],
    mean: Directional,
}

struct Table {
    rows: Vec<Row>,
}

impl Table {
    /// The row at or below `alpha`, and how far it is to the next one.
    fn row(alpha: f32) -> (usize, f32) {
        let x = alpha.clamp(0.0, 1.0).sqrt() * (ROWS - 1) as f32;
        let row = (x as usize).min(ROWS - 2);
        (row, x - row as f32)
    }
}

impl Row {
    fn at(&self, cos: f32) -> Directional {
        let x = cos.clamp(0.0, 1.0).sqrt() * (COLUMNS - 1) as f32;
        let i = (x as usize).min(COLUMNS - 2);
        self.entries[i].lerp(self.entries[i + 1], x - i as f32)
    }

    fn new(alpha: f32, lattice: &Lattice2) -> Row {
        let entries = std::array::from_fn(|i| {
            let x = i as f32 / (COLUMNS - 1) as f32;
            integrate(alpha, (x * x).max(1e-5), lattice)
        });
        let mut row = Row { entries, mean: Directional { all: 0.0, grazing: 0.0 } };
        // The mean must be that of the interpolated table, or the diffuse base would gain or lose energy:
        // with μ = x², 2 ∫ E μ dμ = 4 ∫ E x³ dx, by the midpoint rule well within each column.
        let steps = (COLUMNS - 1) * 16;
        for i in 0..steps {
            let x = (i as f32 + 0.5) / steps as f32;
            let weight = 4.0 * x * x * x / steps as f32;
            let e = row.at(x * x);
            row.mean.all += weight * e.all;
            row.mean.grazing += weight * e.grazing;
        }
        row
    }
}

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        let lattice = Lattice2::new(POINTS);
        let roughness = |i: usize| i as f32 / (ROWS - 1) as f32;
        // The first row stands for a perfect mirror; a width of 1e-4 is one to every digit kept here.
        Table {
            rows: (0..ROWS).map(|i| Row::new((roughness(i) * roughness(i)).max(1e-4), &lattice)).collect(),
        }
    })
}

/// The two averages at one cosine, over the lattice of visible normals.
fn integrate(alpha: f32, cos: f32, lattice: &Lattice2) -> Directional {
    let ggx = Ggx::round(alpha);
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let n = lattice.len();
    let mut sum = Directional { all: 0.0, grazing: 0.0 };
    for i in 0..n {
        let h = ggx.sample_visible(wo, lattice.point(i, Vec2::splat(0.5 / n as f32)));
        let wi = reflect(wo, h);
        if wi.z > 0.0 {
            let weight = ggx.g2_reflection(wo, wi) / ggx.g1(wo);
            sum.all += weight;
            sum.grazing += weight * schlick_weight(wo.dot(h));
        }
    }
    let scale = 1.0 / n as f32;
    Directional { all: sum.all * scale, grazing: sum.grazing * scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_agrees_with_the_integral_between_its_entries() {
        let fine = Lattice2::new(4096);
        for alpha in [0.001, 0.01, 0.07, 0.2, 0.43, 0.81, 1.0] {
            for cos in [0.003, 0.02, 0.07, 0.15, 0.33, 0.52, 0.77, 0.99] {
                let (a, b) = (directional(alpha, cos), integrate(alpha, cos, &fine));
                // At the very rim of narrow lobes the table is coarser than what it holds.
                let tolerance = if cos < 0.05 { 1.2e-2 } else { 5e-3 };
                let error = (a.all - b.all).abs().max((a.grazing - b.grazing).abs());
                assert!(error < tolerance, "{alpha} at {cos}: {a:?}, exact {b:?}");
            }
        }
    }

    #[test]
    fn a_smooth_surface_meets_its_closed_form() {
        for cos in [0.05f32, 0.3, 0.9] {
            let rough = directional(0.001, cos);
            assert!((rough.all - 1.0).abs() < 5e-3, "{cos}: {rough:?}");
            assert!((rough.grazing - schlick_weight(cos)).abs() < 5e-3, "{cos}: {rough:?}");
        }
        assert!((hemispherical(0.001).grazing - 1.0 / 21.0).abs() < 1e-3);
    }

    #[test]
    fn the_loss_of_single_scattering_is_as_stated() {
        // 1 − 2 ∫ E μ dμ for a white metal, at roughness 0.25, 0.5, 0.75, 1.
        for (roughness, loss) in [(0.25f32, 0.013), (0.5, 0.118), (0.75, 0.344), (1.0, 0.591)] {
            let e = 1.0 - hemispherical(roughness * roughness).all;
            assert!((e - loss).abs() < 2e-3, "{roughness}: {e}");
        }
    }
}
