//! E to K E: rows of form factors, as one applies them.
//!
//! A row belongs to a *site*, one side of one vertex where rays were gathered. Each of its entries is one ray's
//! landing on a diffuse surface: Σ over the entries of weight · E(landing) is the light that comes back from there.
//! The weights hold the reflectance met, so a row's sum is at most the largest reflectance in the scene.

use crate::element::{Elements, Side, slot};
use crate::field::{Field, Site};
use crate::gather::lattice_share;
use geometry::Rgb;
use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Where one gather ray ended, 16 bytes.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    /// Scene triangle or smaller node of the element mesh; the top bit is set for its back.
    pub(crate) node: u32,
    /// Barycentrics there in units of 1/65535.
    pub(crate) uv: [u16; 2],
    /// Reflectance met, times what mirrors and glass on the way left, over the number of rays.
    pub(crate) weight: [f16; 3],
}

const BACK: u32 = 1 << 31;

impl Landing {
    /// Packs a landing on `node`: a scene triangle, or what refinement made of one.
    pub fn new(node: u32, side: Side, u: f32, v: f32, weight: Rgb) -> Landing {
        Landing {
            node: node | if side == Side::Back { BACK } else { 0 },
            uv: [u, v].map(fixed),
            weight: weight.to_array().map(f16::from_f32),
        }
    }

    /// The side that was met.
    fn side(&self) -> Side {
        if self.node & BACK == 0 { Side::Front } else { Side::Back }
    }

    /// The leaf that it lies in, the side, and the weights of the leaf's corners.
    pub fn locate(&self, elements: &Elements) -> (u32, Side, [f32; 3]) {
        let [u, v] = self.uv.map(|x| f32::from(x) / 65535.0);
        let (leaf, weights) = elements.locate(self.node & !BACK, u, v);
        (leaf, self.side(), weights)
    }

    /// Says where it is by the leaf that it lies in: found at once, until that is split.
    pub fn go_to_leaf(&mut self, elements: &Elements) {
        if !elements.nodes[(self.node & !BACK) as usize].is_leaf() {
            let (leaf, _, [_, u, v]) = self.locate(elements);
            (self.node, self.uv) = (leaf | (self.node & BACK), [u, v].map(fixed));
        }
    }

    /// The weight.
    pub fn weight(&self) -> Rgb {
        Rgb::from(self.weight.map(f32::from))
    }
}

/// Of [0, 1] in units of 1/65535, rounded down so that barycentrics still sum to 1 at most.
fn fixed(x: f32) -> u16 {
    (x.clamp(0.0, 1.0) * 65535.0) as u16
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

/// Where a landing lies in the present element mesh, 8 bytes.
#[derive(Clone, Copy)]
struct Place {
    /// Its leaf side, by its number in [`Transport::leaves`].
    leaf: u32,
    /// Weights of the first two corners in units of 1/65535; the third has the rest.
    corners: [u16; 2],
}

impl Place {
    fn corners(self) -> [f32; 3] {
        let [a, b] = self.corners.map(|w| f32::from(w) / 65535.0);
        [a, b, 1.0 - a - b]
    }
}

/// A site's landings, those that something is known of.
struct Located {
    places: Box<[Place]>,
    /// For each place three, the channels.
    weights: Box<[f16]>,
}

/// Largest row sum that is let stand.
///
/// No surface reflects more than it receives, so no true row sums to more than the largest reflectance; an estimate
/// from few rays may, and a file may claim a reflectance of 1 all around. Above this bound the iteration would not
/// contract: the row is scaled down to it, a loss of light of at most the excess.
pub const LARGEST_ROW_SUM: f32 = 0.998;

/// What is known of a row does not speak for more than this many times as much.
const MOST_UNKNOWN: f32 = 1.0;

/// What the weights of a row's known places are multiplied with.
///
/// What landed where nothing is known counts as if it had landed like the rest, for left out it was as if black. In a
/// room of 400 000 triangles, where 8 % of all landed so before such leaves got middles (folds, gaps, things that stand in
/// others), indirect light came to 0.90 of the paths' instead of 0.87.
fn share_out(unknown: Rgb, known: Rgb) -> Rgb {
    let ratio = |u: f32, k: f32| {
        let scale = if k > 0.0 { 1.0 + (u / k).min(MOST_UNKNOWN) } else { 1.0 };
        scale.min(LARGEST_ROW_SUM / k.max(1e-30))
    };
    Rgb::new(ratio(unknown.r, known.r), ratio(unknown.g, known.g), ratio(unknown.b, known.b))
}

/// The rows of all sites over the present element mesh.
pub struct Transport<'a> {
    field: &'a Field,
    rows: Vec<Located>,
    /// The slots of the corners of every leaf side that something landed on.
    leaves: Vec<[u32; 3]>,
}

impl<'a> Transport<'a> {
    /// Finds every landing's leaf. `weights` may shift a landing's barycentrics among the corners of its leaf:
    /// (node, side, weights) in, weights that sum to 1 out, or `None` (or all 0) where no corner can speak for the place.
    /// What lands there counts as if it had landed like the rest of its row.
    pub fn locate(
        elements: &Elements,
        field: &'a Field,
        weights: impl Fn(u32, Side, [f32; 3]) -> Option<[f32; 3]> + Sync,
    ) -> Transport<'a> {
        let locate = |site: &Site| {
            let (mut unknown, mut known) = (Rgb::BLACK, Rgb::BLACK);
            let mut places = Vec::with_capacity(site.row.landings.len());
            let mut brought = Vec::with_capacity(site.row.landings.len());
            for landing in &site.row.landings {
                let (node, side, w) = landing.locate(elements);
                let weight = landing.weight();
                let Some(w) = weights(node, side, w).filter(|w| w.iter().any(|&w| w > 0.0)) else {
                    unknown += weight;
                    continue;
                };
                let fix = |x: f32| (x * 65535.0 + 0.5) as u16;
                places.push(Place { leaf: 2 * node + side.index() as u32, corners: [fix(w[0]), fix(w[1])] });
                brought.push(weight);
                known += weight;
            }
            let scale = share_out(unknown, known);
            let weights = brought.into_iter().flat_map(|w| (w * scale).to_array().map(f16::from_f32));
            Located { places: places.into(), weights: weights.collect() }
        };
        let mut rows: Vec<Located> = field.sites.par_iter().map(locate).collect();
        let used: Vec<AtomicBool> = (0..2 * elements.nodes.len()).map(|_| AtomicBool::new(false)).collect();
        rows.par_iter().flat_map_iter(|row| row.places.iter()).for_each(|place| {
            used[place.leaf as usize].store(true, Ordering::Relaxed);
        });
        let mut leaves = Vec::new();
        let mut number = vec![u32::MAX; used.len()];
        for (i, used) in used.into_iter().enumerate() {
            if used.into_inner() {
                number[i] = leaves.len() as u32;
                leaves.push(elements.nodes[i / 2].vertices.map(|v| slot(v, Side::BOTH[i % 2]) as u32));
            }
        }
        rows.par_iter_mut().for_each(|row| {
            row.places.iter_mut().for_each(|place| place.leaf = number[place.leaf as usize]);
        });
        Transport { field, rows, leaves }
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
        self.sums(e, extra, |sum, brought| sum + brought)
    }

    /// For every site, what its landings bring under irradiance `e` at the sites and `extra` at the slots (lx), folded
    /// into one.
    fn sums<T: Copy + Default + Send>(
        &self,
        e: &[Rgb],
        extra: &[Rgb],
        fold: impl Fn(T, Rgb) -> T + Sync,
    ) -> Vec<T> {
        let mut values = self.field.spread(e);
        if !extra.is_empty() {
            values.par_iter_mut().zip(extra).for_each(|(v, &c)| *v += c);
        }
        // The corners of a leaf beside one another: half of the time went into waiting for them where they lay apart.
        let of_leaves: Vec<[Rgb; 3]> =
            self.leaves.par_iter().map(|slots| slots.map(|s| values[s as usize])).collect();
        let sum = |weights: &mut Vec<f32>, row: &Located| {
            weights.resize(row.weights.len(), 0.0);
            row.weights.convert_to_f32_slice(weights);
            let landings = row.places.iter().zip(weights.as_chunks::<3>().0);
            landings.fold(T::default(), |sum, (place, &weight)| {
                let ([a, b, c], [wa, wb, wc]) = (of_leaves[place.leaf as usize], place.corners());
                fold(sum, Rgb::from(weight) * (a * wa + b * wb + c * wc))
            })
        };
        self.rows.par_iter().map_init(Vec::new, sum).collect()
    }

    /// Estimated variance (mean of the channels) of every site's value under `e`, lx²: what another shift of its rays
    /// would change.
    pub fn variance(&self, e: &[Rgb]) -> Vec<f32> {
        let sums = self.sums(e, &[], |(sum, square): (f32, f32), brought| {
            let brought = brought.mean();
            (sum + brought, square + brought * brought)
        });
        let of = |((sum, square), site): ((f32, f32), &Site)| {
            let rays = site.row.rays.max(1);
            site.row.variance + lattice_share(rays) * (square - sum * sum / rays as f32).max(0.0)
        };
        sums.into_par_iter().zip(&self.field.sites).map(of).collect()
    }

    /// Kᵀ: what each site's E brings to sites that matter as `matters` says, each a share of their sum.
    ///
    /// Sums are of whole numbers, which come out the same in any order.
    pub fn influence(&self, matters: &[f64]) -> Vec<f64> {
        const UNIT: f64 = (1u64 << 52) as f64;
        let whole: f64 = matters.iter().sum();
        let slots: Vec<AtomicU64> = (0..self.field.sources.0.len()).map(|_| AtomicU64::new(0)).collect();
        self.rows.par_iter().zip(matters).for_each(|(row, &matters)| {
            let scale = UNIT * matters / whole.max(f64::MIN_POSITIVE);
            for (place, weight) in row.places.iter().zip(row.weights.as_chunks::<3>().0) {
                let weight = f64::from(Rgb::from(weight.map(f32::from)).mean()) * scale;
                for (slot, w) in self.leaves[place.leaf as usize].into_iter().zip(place.corners()) {
                    let share = (weight * f64::from(w.max(0.0))) as u64;
                    slots[slot as usize].fetch_add(share, Ordering::Relaxed);
                }
            }
        });
        let slots = slots.into_iter().map(|sum| sum.into_inner() as f64 / UNIT * whole).collect();
        self.field.sources.collect(slots, matters.len())
    }

    /// The largest row sum, any channel: how much of an error one bounce keeps, at most.
    pub fn norm(&self) -> f32 {
        let sum = |row: &Located| {
            let weights = row.weights.as_chunks::<3>().0;
            weights.iter().map(|w| Rgb::from(w.map(f32::from))).sum::<Rgb>().max_channel()
        };
        self.rows.par_iter().map(sum).reduce(|| 0.0, f32::max)
    }
}
