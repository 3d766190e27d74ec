//! E to K E: rows of form factors, as one applies them.
//!
//! A row belongs to a *site*, one side of one vertex where rays were gathered. Each of its entries is one ray's
//! landing on a diffuse surface: Σ over the entries of weight · E(landing) is the light that comes back from there.
//! The weights hold the reflectance met, so a row's sum is at most the largest reflectance in the scene.

use crate::element::{Elements, Side, slot};
use crate::field::Field;
use crate::gather::lattice_share;
use geometry::Rgb;
use half::f16;
use rayon::prelude::*;
use std::cell::Cell;

/// Where one gather ray ended, 16 bytes.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    /// Scene triangle; the top bit is set for its back.
    pub(crate) triangle: u32,
    /// Barycentrics in units of 1/65535.
    pub(crate) uv: [u16; 2],
    /// Reflectance met, times what mirrors and glass on the way left, over the number of rays.
    pub(crate) weight: [f16; 3],
}

const BACK: u32 = 1 << 31;

impl Landing {
    /// Packs a landing.
    pub fn new(triangle: u32, side: Side, u: f32, v: f32, weight: Rgb) -> Landing {
        let fix = |x: f32| (x.clamp(0.0, 1.0) * 65535.0) as u16;
        Landing {
            triangle: triangle | if side == Side::Back { BACK } else { 0 },
            uv: [fix(u), fix(v)],
            weight: weight.to_array().map(f16::from_f32),
        }
    }

    /// Scene triangle and side.
    pub fn place(&self) -> (u32, Side) {
        (self.triangle & !BACK, if self.triangle & BACK == 0 { Side::Front } else { Side::Back })
    }

    /// Barycentrics on the scene triangle.
    pub fn uv(&self) -> (f32, f32) {
        (f32::from(self.uv[0]) / 65535.0, f32::from(self.uv[1]) / 65535.0)
    }

    /// The weight.
    pub fn weight(&self) -> Rgb {
        Rgb::from(self.weight.map(f32::from))
    }
}

/// What one site gathered.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// Irradiance that comes back from the surfaces met, of the light that emitters throw on them directly, lx.
    pub direct: Rgb,
    /// Its parts by groups of lights, where these are kept apart.
    pub by_group: Box<[Rgb]>,
    /// The rest of what comes back, as multiples of E where the rays landed.
    pub landings: Box<[Landing]>,
    /// Share of the rays that first met a side that light cannot reach.
    pub dead: f32,
    /// What arrived at diffuse surfaces of 1 that set out; by reciprocity, what the light that leaves here brings there.
    pub kept: f32,
    /// Estimated variance of `direct` (mean of the channels), lx².
    pub variance: f32,
    /// Rays that were sent.
    pub rays: u32,
}

/// A landing found in the present element mesh: up to three slots with their weights.
#[derive(Clone, Copy)]
struct Located {
    node: u32,
    side: Side,
    bary: [u16; 2],
    weight: [f16; 3],
}

/// Largest row sum that is let stand.
///
/// No surface reflects more than it receives, so no true row sums to more than the largest reflectance; an estimate
/// from few rays may, and a file may claim a reflectance of 1 all around. Above this bound the iteration would not
/// contract: the row is scaled down to it, a loss of light of at most the excess.
pub const LARGEST_ROW_SUM: f32 = 0.998;

fn keep_contracting(row: &mut [Located]) {
    let sum: Rgb = row.iter().map(|l| Rgb::from(l.weight.map(f32::from))).sum();
    let excess = sum.map(|s| (LARGEST_ROW_SUM / s.max(1e-30)).min(1.0));
    if excess != Rgb::WHITE {
        for landing in row {
            landing.weight =
                (Rgb::from(landing.weight.map(f32::from)) * excess).to_array().map(f16::from_f32);
        }
    }
}

/// Adds weight that landed where nothing is known to the rest of the row. Left out, it was as if black: 8 % of all in a room
/// of 400 000 triangles (folds, gaps, things that stand in others), where indirect light was 0.87 of the paths' with it and
/// is 0.90 without.
fn share_out(unknown: Rgb, row: &mut [Located]) {
    if unknown.is_black() {
        return;
    }
    let known: Rgb = row.iter().map(|l| Rgb::from(l.weight.map(f32::from))).sum();
    let ratio = |u: f32, k: f32| if k > 0.0 { 1.0 + (u / k).min(MOST_UNKNOWN) } else { 1.0 };
    let scale = Rgb::new(ratio(unknown.r, known.r), ratio(unknown.g, known.g), ratio(unknown.b, known.b));
    for landing in row {
        landing.weight = (Rgb::from(landing.weight.map(f32::from)) * scale).to_array().map(f16::from_f32);
    }
}

/// What is known of a row does not speak for more than this many times as much.
const MOST_UNKNOWN: f32 = 1.0;

/// The rows of all sites over the present element mesh.
pub struct Transport<'a> {
    elements: &'a Elements,
    field: &'a Field,
    rows: Vec<Vec<Located>>,
}

impl<'a> Transport<'a> {
    /// Finds every landing's leaf. `weights` may shift a landing's barycentrics among the corners of its leaf:
    /// (node, side, weights) in, weights that sum to 1 out, or `None` (or all 0) where no corner can speak for the place.
    /// What lands there counts as if it had landed like the rest of its row.
    pub fn locate(
        elements: &'a Elements,
        field: &'a Field,
        weights: impl Fn(u32, Side, [f32; 3]) -> Option<[f32; 3]> + Sync,
    ) -> Transport<'a> {
        let rows = field
            .sites
            .par_iter()
            .map(|site| {
                let unknown = Cell::new(Rgb::BLACK);
                let locate = |landing: &Landing| {
                    let (triangle, side) = landing.place();
                    let (u, v) = landing.uv();
                    let (node, w) = elements.locate(triangle, u, v);
                    let Some(w) = weights(node, side, w).filter(|w| w.iter().any(|&w| w > 0.0)) else {
                        unknown.set(unknown.get() + landing.weight());
                        return None;
                    };
                    let fix = |x: f32| (x * 65535.0 + 0.5) as u16;
                    Some(Located { node, side, bary: [fix(w[0]), fix(w[1])], weight: landing.weight })
                };
                let mut row: Vec<Located> = site.row.landings.iter().filter_map(locate).collect();
                share_out(unknown.get(), &mut row);
                keep_contracting(&mut row);
                row
            })
            .collect();
        Transport { elements, field, rows }
    }

    /// One more bounce: E at every site from `e` at every site, both lx: D + K (e + c), with `extra` the irradiance
    /// c at each slot that e does not hold (caustics).
    pub fn apply(&self, e: &[Rgb], extra: &[Rgb]) -> Vec<Rgb> {
        let mut sum = self.reflect(e, extra);
        sum.par_iter_mut().zip(&self.field.sites).for_each(|(sum, site)| *sum += site.row.direct);
        sum
    }

    /// K (e + extra) alone.
    pub fn reflect(&self, e: &[Rgb], extra: &[Rgb]) -> Vec<Rgb> {
        let mut values = self.field.spread(e);
        if !extra.is_empty() {
            values.par_iter_mut().zip(extra).for_each(|(v, &c)| *v += c);
        }
        self.rows
            .par_iter()
            .map(|row| {
                let mut sum = Rgb::BLACK;
                for landing in row {
                    sum += Rgb::from(landing.weight.map(f32::from)) * self.value(&values, landing);
                }
                sum
            })
            .collect()
    }

    /// Estimated variance (mean of the channels) of every site's value under `e`, lx²: what another shift of its rays
    /// would change.
    pub fn variance(&self, e: &[Rgb]) -> Vec<f32> {
        let values = self.field.spread(e);
        self.rows
            .par_iter()
            .zip(&self.field.sites)
            .map(|(row, site)| {
                let (mut sum, mut square) = (0.0, 0.0);
                for landing in row {
                    let brought =
                        (Rgb::from(landing.weight.map(f32::from)) * self.value(&values, landing)).mean();
                    sum += brought;
                    square += brought * brought;
                }
                let rays = site.row.rays.max(1);
                let spread = (square - sum * sum / rays as f32).max(0.0);
                site.row.variance + lattice_share(rays) * spread
            })
            .collect()
    }

    /// What a landing finds there.
    fn value(&self, values: &[Rgb], landing: &Located) -> Rgb {
        let [a, b, c] = self.elements.nodes[landing.node as usize].vertices;
        let (wa, wb) = (f32::from(landing.bary[0]) / 65535.0, f32::from(landing.bary[1]) / 65535.0);
        values[slot(a, landing.side)] * wa
            + values[slot(b, landing.side)] * wb
            + values[slot(c, landing.side)] * (1.0 - wa - wb)
    }

    /// The largest row sum, any channel: how much of an error one bounce keeps, at most.
    pub fn norm(&self) -> f32 {
        let sum = |row: &Vec<Located>| {
            row.iter().map(|l| Rgb::from(l.weight.map(f32::from))).sum::<Rgb>().max_channel()
        };
        self.rows.par_iter().map(sum).reduce(|| 0.0, f32::max)
    }

    /// Landings in all rows.
    pub fn landings(&self) -> usize {
        self.rows.iter().map(Vec::len).sum()
    }
}
