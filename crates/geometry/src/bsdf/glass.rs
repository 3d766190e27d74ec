//! How much of the light rough glass scatters once, and where what it loses goes.
//!
//! Kulla and Conty (2017) for an interface: what bounces between facets leaves diffusely on both sides, so that each
//! side sends on all that it received and n² keeps both directions alike.

use super::albedo;
use crate::Rgb;
use crate::optics::fresnel_dielectric;
use std::f32::consts::FRAC_1_PI;
use std::sync::OnceLock;

/// What one side of rough glass does with light that comes along one direction, scattered once.
#[derive(Clone, Copy, Debug, Default)]
pub struct Once {
    /// Reflected, [0, 1].
    pub reflected: f32,
    /// Passed, an energy, [0, 1].
    pub passed: f32,
}

impl Once {
    /// Share that single scattering keeps.
    pub fn kept(self) -> f32 {
        (self.reflected + self.passed).min(1.0)
    }

    fn lerp(self, o: Once, t: f32) -> Once {
        Once {
            reflected: self.reflected + (o.reflected - self.reflected) * t,
            passed: self.passed + (o.passed - self.passed) * t,
        }
    }
}

/// By index from 1 to 3, evenly in √((n − 1)/(n + 1)): near 1 the angle of total reflection moves fastest.
const INDICES: usize = 9;
const ROWS: usize = 13;
const COLUMNS: usize = 17;

/// By index, side (out of the dense medium second), √α; the last column is the mean over the hemisphere.
type Table = Vec<[Once; COLUMNS + 1]>;

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut table = Table::new();
        for index in 0..INDICES {
            let x = index as f32 / (INDICES - 1) as f32;
            let r = 0.5 * x * x;
            let n = (1.0 + r) / (1.0 - r);
            for eta in [1.0 / n, n] {
                for row in 0..ROWS {
                    let alpha = (row as f32 / (ROWS - 1) as f32).powi(2).max(1e-4);
                    table.push(entries(alpha, eta));
                }
            }
        }
        table
    })
}

fn entries(alpha: f32, eta: f32) -> [Once; COLUMNS + 1] {
    let mut row = [Once::default(); COLUMNS + 1];
    for (c, entry) in row[..COLUMNS].iter_mut().enumerate() {
        let x = c as f32 / (COLUMNS - 1) as f32;
        let f = |cos| fresnel_dielectric(cos, eta);
        let sum = albedo::rough_glass(
            alpha,
            eta,
            (x * x).max(1e-4),
            |cos| Rgb::new(f(cos), 0.0, 0.0),
            |cos| Rgb::new(0.0, 1.0 - f(cos), 0.0),
        );
        *entry = Once { reflected: sum.r, passed: sum.g };
    }
    // Of the interpolated row, with μ = x², by the midpoint rule: no energy may go missing between the columns.
    let steps = (COLUMNS - 1) * 16;
    let mut mean = Once::default();
    for i in 0..steps {
        let x = (i as f32 + 0.5) / steps as f32;
        let weight = 4.0 * x * x * x / steps as f32;
        let e = at(&row, x * x);
        mean.reflected += weight * e.reflected;
        mean.passed += weight * e.passed;
    }
    row[COLUMNS] = mean;
    row
}

fn at(row: &[Once; COLUMNS + 1], cos: f32) -> Once {
    let x = cos.clamp(0.0, 1.0).sqrt() * (COLUMNS - 1) as f32;
    let c = (x as usize).min(COLUMNS - 2);
    row[c].lerp(row[c + 1], x - c as f32)
}

/// Interpolates what `of` says of a row over index and width.
fn look(alpha: f32, eta: f32, of: impl Fn(&[Once; COLUMNS + 1]) -> Once) -> Once {
    let (n, side) = if eta > 1.0 { (eta, 1) } else { (1.0 / eta, 0) };
    let x = (2.0 * (n - 1.0) / (n + 1.0)).clamp(0.0, 1.0).sqrt() * (INDICES - 1) as f32;
    let y = alpha.clamp(0.0, 1.0).sqrt() * (ROWS - 1) as f32;
    let (i, j) = ((x as usize).min(INDICES - 2), (y as usize).min(ROWS - 2));
    let row = |i: usize, j: usize| of(&table()[(2 * i + side) * ROWS + j]);
    let (s, t) = (x - i as f32, y - j as f32);
    row(i, j).lerp(row(i, j + 1), t).lerp(row(i + 1, j).lerp(row(i + 1, j + 1), t), s)
}

/// For light along a direction of cosine `cos`; `eta`: n on its side over n beyond.
pub fn once(alpha: f32, eta: f32, cos: f32) -> Once {
    look(alpha, eta, |row| at(row, cos))
}

/// The mean over the cosine-weighted hemisphere.
fn mean(alpha: f32, eta: f32) -> Once {
    look(alpha, eta, |row| row[COLUMNS])
}

/// Light that bounced more than once between the facets of glass, of either kind.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    alpha: f32,
    /// n on wo's side over n beyond; 1 for a thin wall.
    eta: f32,
    thin: bool,
    /// Mean share lost on wo's side and beyond.
    lost: [f32; 2],
    /// Of what is lost on wo's side, the share that leaves there again.
    pub back: f32,
}

impl Spread {
    /// For glass of width `alpha` > 0.
    pub fn new(alpha: f32, eta: f32, thin: bool) -> Spread {
        let lost = if thin {
            [1.0 - albedo::hemispherical(alpha).all; 2]
        } else {
            [eta, 1.0 / eta].map(|eta| 1.0 - mean(alpha, eta).kept())
        }
        .map(|lost| lost.max(1e-5));
        // c L̅ leaves beyond, L̅ being the mean loss there; reciprocity wants c n² alike for both sides, and neither may
        // send more than it lost. Half of the most that is allowed: the split is not known better.
        let c = 0.5 * (eta * eta / lost[1]).min(1.0 / lost[0]) / (eta * eta);
        Spread { alpha, eta, thin, lost, back: 1.0 - c * lost[1] }
    }

    /// Mean share lost, the larger of both sides.
    pub fn mean_lost(&self) -> f32 {
        self.lost[0].max(self.lost[1])
    }

    /// Share of the light along a direction on wo's side, or beyond, that single scattering loses.
    pub fn lost(&self, cos: f32, beyond: bool) -> f32 {
        if self.thin {
            return 1.0 - albedo::directional(self.alpha, cos).all;
        }
        1.0 - once(self.alpha, if beyond { 1.0 / self.eta } else { self.eta }, cos).kept()
    }

    /// f of what comes back, 1/sr.
    pub fn eval_back(&self, cos_o: f32, cos_i: f32) -> f32 {
        self.back * FRAC_1_PI * self.lost(cos_o, false) * self.lost(cos_i, false) / self.lost[0]
    }

    /// f of what goes through, 1/sr, without the η² of radiance.
    pub fn eval_through(&self, cos_o: f32, cos_i: f32) -> f32 {
        (1.0 - self.back) * FRAC_1_PI * self.lost(cos_o, false) * self.lost(cos_i, true) / self.lost[1]
    }
}
