//! All form factors of a scene at once.

use super::FormFactors;
use crate::patches::Patches;
use geometry::{Rgb, World};
use rayon::prelude::*;

/// F for all pairs of patches, dense.
#[derive(Clone, Debug)]
pub struct Matrix {
    n: usize,
    /// 1 where nothing tints the light on its way, else 3: rows of `n` shares of one channel after the other.
    channels: usize,
    /// Row i, channel c, column j at ((i · channels) + c) · n + j.
    shares: Vec<f32>,
    areas: Vec<f32>,
}

/// How far form factors are from what they must be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Closure {
    /// Largest and least row sum, over patches that have one: 1 and 1 in a closed room without mirrors.
    pub sums: [f32; 2],
    /// Σ |A_i F_ij − A_j F_ji| over Σ (A_i F_ij + A_j F_ji): 0 when reciprocal, 1 when nothing is.
    pub reciprocity: f64,
}

impl Matrix {
    /// Bytes that the matrix of `n` patches takes.
    pub fn bytes(n: usize, channels: usize) -> u64 {
        4 * (n as u64) * (n as u64) * channels as u64
    }

    /// Whether mirrors or glass may tint the light between patches: 3 channels, or 1.
    pub fn channels(world: &World) -> usize {
        let tints = |id: &geometry::MaterialId| world.scene.materials[id.0 as usize].has_specular(0.0);
        if world.scene.mesh.materials.iter().any(tints) { 3 } else { 1 }
    }

    /// Every row by `how`. `advance` is told of each.
    pub fn fill(
        world: &World,
        patches: &Patches,
        how: &FormFactors,
        seed: u64,
        advance: impl Fn() + Sync,
    ) -> Matrix {
        let (n, channels) = (patches.len(), Matrix::channels(world));
        let mut shares = vec![0f32; n * n * channels];
        shares.par_chunks_mut((n * channels).max(1)).enumerate().for_each(|(i, row)| {
            for a in how.row(world, patches, i as u32, seed, i as u64) {
                let j = a.patch as usize;
                if channels == 1 {
                    row[j] += a.share.g;
                } else {
                    for c in 0..3 {
                        row[c * n + j] += a.share[c];
                    }
                }
            }
            advance();
        });
        let areas = patches.all.iter().map(|p| p.area).collect();
        Matrix { n, channels, shares, areas }
    }

    /// From form factors known beforehand, one channel: `f(i, j)`.
    pub fn from_fn(areas: &[f32], f: impl Fn(usize, usize) -> f64) -> Matrix {
        let n = areas.len();
        let shares = (0..n * n).map(|k| f(k / n, k % n) as f32).collect();
        Matrix { n, channels: 1, shares, areas: areas.to_vec() }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Form factors from `i` to all, of one channel.
    pub fn row(&self, i: usize, channel: usize) -> &[f32] {
        let start = (i * self.channels + channel.min(self.channels - 1)) * self.n;
        &self.shares[start..start + self.n]
    }

    /// F x: what arrives, from what leaves; lx from lm/m².
    pub fn apply(&self, x: &[Rgb]) -> Vec<Rgb> {
        (0..self.n)
            .into_par_iter()
            .map(|i| {
                let mut sum = [0f64; 3];
                for (c, sum) in sum.iter_mut().enumerate() {
                    *sum = self.row(i, c).iter().zip(x).map(|(&f, x)| f64::from(f) * f64::from(x[c])).sum();
                }
                Rgb::from(sum.map(|s| s as f32))
            })
            .collect()
    }

    /// How far it is from closed and from reciprocal, by the channel that holds most.
    pub fn closure(&self) -> Closure {
        let sums = (0..self.n).map(|i| self.row(i, 1).iter().map(|&f| f64::from(f)).sum::<f64>());
        let sums = sums
            .filter(|&s| s > 0.0)
            .fold([0f32, f32::INFINITY], |[most, least], s| [most.max(s as f32), least.min(s as f32)]);
        let (mut apart, mut all) = (0.0, 0.0);
        for i in 0..self.n {
            for j in 0..i {
                let there = f64::from(self.areas[i]) * f64::from(self.row(i, 1)[j]);
                let back = f64::from(self.areas[j]) * f64::from(self.row(j, 1)[i]);
                apart += (there - back).abs();
                all += there + back;
            }
        }
        Closure { sums, reciprocity: if all > 0.0 { apart / all } else { 0.0 } }
    }

    /// Makes it reciprocal, and keeps every row's sum (1 in a closed room): A_i F_ij becomes the mean of both
    /// estimates, then d_i d_j A_i F_ij with the d_i ≈ 1 that restore the sums (Sinkhorn's iteration).
    pub fn enforce(&mut self) {
        let n = self.n;
        for c in 0..self.channels {
            let at = |i: usize, j: usize| (i * self.channels + c) * n + j;
            let wanted: Vec<f64> = (0..n)
                .map(|i| f64::from(self.areas[i]) * self.row(i, c).iter().map(|&f| f64::from(f)).sum::<f64>())
                .collect();
            for i in 0..n {
                for j in 0..i {
                    let (ai, aj) = (f64::from(self.areas[i]), f64::from(self.areas[j]));
                    let mean =
                        0.5 * (ai * f64::from(self.shares[at(i, j)]) + aj * f64::from(self.shares[at(j, i)]));
                    (self.shares[at(i, j)], self.shares[at(j, i)]) = ((mean / ai) as f32, (mean / aj) as f32);
                }
            }
            let mut d = vec![1f64; n];
            for _ in 0..50 {
                let sums: Vec<f64> = (0..n)
                    .into_par_iter()
                    .map(|i| {
                        f64::from(self.areas[i])
                            * self.row(i, c).iter().zip(&d).map(|(&f, d)| f64::from(f) * d).sum::<f64>()
                    })
                    .collect();
                let mut off = 0f64;
                for i in 0..n {
                    if sums[i] > 0.0 && wanted[i] > 0.0 {
                        let next = (d[i] * wanted[i] / sums[i]).sqrt();
                        off = off.max((next / d[i] - 1.0).abs());
                        d[i] = next;
                    }
                }
                if off < 1e-7 {
                    break;
                }
            }
            for i in 0..n {
                for j in 0..n {
                    self.shares[at(i, j)] *= (d[i] * d[j]) as f32;
                }
            }
        }
    }
}
