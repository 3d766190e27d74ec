//! Form factors by rays from all over a patch, by the cosine: each ray carries the same share, so a form factor is the
//! share of the rays that arrive.
//!
//! Both where a ray starts and where it goes are stratified, one ray to each cell of either, paired at random.

use super::arrival::{Arrival, follow};
use crate::patches::Patches;
use geometry::World;
use geometry::math::{Vec2, to_world};
use geometry::sampling::{Rng, cosine_hemisphere, triangle};
use rayon::prelude::*;

/// Rays that one task follows.
const CHUNK: usize = 1024;

/// Form factors from `patch` by about `rays` rays, rounded to a square number.
pub fn row(world: &World, patches: &Patches, patch: u32, rays: u32, seed: u64, stream: u64) -> Vec<Arrival> {
    let side = f64::from(rays).sqrt().round().max(1.0) as u32;
    let n = side * side;
    let normal = patches.normal(patch);
    let stream = stream.wrapping_mul(1 << 20);
    let mut rng = Rng::new(seed ^ 0x7261_7973, stream);
    let mut starts: Vec<u32> = (0..n).collect();
    for i in (1..n).rev() {
        starts.swap(i as usize, rng.below(i + 1) as usize);
    }
    let cast = |(chunk, starts): (usize, &[u32])| {
        let mut rng = Rng::new(seed ^ 0x7261_7973, stream + 1 + chunk as u64);
        let mut arrived = Vec::with_capacity(starts.len());
        for (k, &start) in starts.iter().enumerate() {
            let mut within = |cell: u32| {
                (Vec2::new((cell % side) as f32, (cell / side) as f32) + rng.vec2()) / side as f32
            };
            let (s, t) = triangle(within(start));
            let wi = to_world(cosine_hemisphere(within((chunk * CHUNK + k) as u32)), normal);
            let (ray, leaving) = patches.leave(world, patch, [s, t], wi);
            if leaving > 0.0 && wi.dot(normal) > 0.0 {
                follow(world, patches, ray, &mut rng, |patch, way, left| {
                    arrived.push(Arrival { patch, way, share: left * (leaving / n as f32) });
                });
            }
        }
        arrived
    };
    starts.par_chunks(CHUNK).enumerate().flat_map_iter(cast).collect()
}

/// A form factor and what is known of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Mean of the channels.
    pub form_factor: f64,
    /// Variance of it.
    pub variance: f64,
}

/// Form factors from `patch` to every patch, by `batches` rows of `rays` rays each, which are independent: their spread
/// is the variance.
pub fn estimate(
    world: &World,
    patches: &Patches,
    patch: u32,
    rays: u32,
    batches: u32,
    seed: u64,
) -> Vec<Estimate> {
    let mut sums = vec![(0.0, 0.0); patches.len()];
    for batch in 0..batches {
        let mut of = vec![0.0; patches.len()];
        for arrival in row(world, patches, patch, rays, seed, u64::from(batch)) {
            of[arrival.patch as usize] += f64::from(arrival.share.mean());
        }
        for (sum, f) in sums.iter_mut().zip(of) {
            *sum = (sum.0 + f, sum.1 + f * f);
        }
    }
    let n = f64::from(batches);
    let of = |&(sum, square): &(f64, f64)| {
        let mean = sum / n;
        Estimate { form_factor: mean, variance: (square / n - mean * mean).max(0.0) / (n - 1.0).max(1.0) }
    };
    sums.iter().map(of).collect()
}
