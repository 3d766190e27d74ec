//! Less noise in E: where the light changes evenly, neighbouring sites lend one another their rays.
//!
//! Each site's value becomes the local quadratic fit to the sites around it (Fan and Gijbels, "Local Polynomial Modelling
//! and Its Applications", 1996, section 3.2), as far around as the fits agree within their noise: Lepski's rule (Theory
//! Probab. Appl. 35, 1991). What the rays cannot tell from even light is treated as even; what they can stays. A fit of
//! the first order smoothed corners away: as much bias won as noise lost, in a Cornell box.

use crate::field::Field;
use crate::flags::Flags;
use crate::neighbours::Graph;
use crate::refine::Refiner;
use geometry::math::frame;
use geometry::{Rgb, Vec3};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Sites that the fits reach over, one after the other.
const REACHES: [usize; 3] = [14, 22, 36];
/// Terms of a fit: up to the second order in two directions.
const TERMS: usize = 6;
/// A fit is believed when it is no further than so many standard deviations from every smaller one. At 3 the noise of E
/// falls by a further fifth in the gallery at 5 %, and the bias in a Cornell box at 2 % rises from 0.7 % to 1.1 %.
const AGREE: f32 = 2.0;
/// Normals further apart than this (cosine) look at other things.
const ALIKE: f32 = 0.95;

/// For each site those whose values make up its own with less noise, and their weights: see the head of this file. None
/// where its own value stands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoothing(Vec<Vec<(u32, f32)>>);

impl Smoothing {
    /// Values at the sites with less noise: all of them, or a part of the light that they are made up of.
    pub(crate) fn apply(&self, e: &[Rgb]) -> Vec<Rgb> {
        let value = |(own, fit): (&Rgb, &Vec<(u32, f32)>)| match fit.as_slice() {
            [] => *own,
            fit => fit.iter().map(|&(s, w)| e[s as usize] * w).sum::<Rgb>().max(Rgb::BLACK),
        };
        e.par_iter().zip(&self.0).map(value).collect()
    }

    /// Whether what is around a site made its value.
    pub(crate) fn fits(&self, site: u32) -> bool {
        !self.0[site as usize].is_empty()
    }

    /// Variance that smoothing leaves of `variance` of the sites' values, at one of them.
    pub(crate) fn variance(&self, site: u32, variance: &[f32]) -> f32 {
        match self.0[site as usize].as_slice() {
            [] => variance[site as usize],
            fit => fit.iter().map(|&(s, w)| w * w * variance[s as usize]).sum(),
        }
    }
}

/// How the present values at the sites are to be smoothed.
///
/// - `variance`: of each site's value (mean of the channels), lx².
pub(crate) fn smoothing(refiner: &Refiner, flags: &Flags, variance: &[f32]) -> Smoothing {
    let resolved = |leaf, side| !flags.pierced(leaf, side) && !flags.unresolved(leaf, side);
    let graph = Graph::new(refiner, resolved);
    // A site's own rays are poor witnesses of their noise: those that missed the bright patch know nothing of it. What
    // its neighbours saw counts as well.
    let pooled: Vec<f32> = (0..refiner.e.len() as u32)
        .map(|site| {
            let near = || std::iter::once(site).chain(graph.of(site).iter().copied());
            near().map(|s| variance[s as usize]).sum::<f32>() / near().count() as f32
        })
        .collect();
    let level = crate::settle::mean(&refiner.e).mean();
    let fit = |site| fit(refiner, &refiner.field, &graph, &pooled, level, site);
    Smoothing((0..refiner.e.len() as u32).into_par_iter().map(fit).collect())
}

/// The weights of the widest fit that agrees with the narrower ones.
fn fit(
    refiner: &Refiner,
    field: &Field,
    graph: &Graph,
    variance: &[f32],
    level: f32,
    site: u32,
) -> Vec<(u32, f32)> {
    let own = refiner.e[site as usize];
    // What gathered next to nothing lies in the dark, behind a wall perhaps: no light may come to it from beyond.
    if own.mean() <= 0.05 * level {
        return Vec::new();
    }
    let around = around(refiner, field, graph, site);
    let at = |s: u32| &refiner.elements.vertices[field.sites[s as usize].vertex as usize];
    let here = at(site);
    let (tangent, bitangent) = frame(here.normal);
    let mut believed = Vec::new();
    // Every fit so far: its value (mean of the channels) and variance.
    let mut fits: Vec<(f32, f32)> = vec![(own.mean(), variance[site as usize])];
    for reach in REACHES {
        let Some(&(edge, _)) = around.get(reach) else { break };
        let near = &around[..reach];
        let r = edge.max(1e-12);
        // Normal equations of E ≈ a + b x + c y + d x² + e x y + f y².
        let mut m = [[0f64; TERMS]; TERMS];
        let mut rows: Vec<(u32, f64, [f64; TERMS])> = Vec::with_capacity(reach);
        for &(d, s) in near {
            let way = (at(s).position - here.position) / r;
            let (x, y) = (f64::from(way.dot(tangent)), f64::from(way.dot(bitangent)));
            let terms = [1.0, x, y, x * x, x * y, y * y];
            let kernel = 1.0 - f64::from(d / r).powi(2);
            let noise = f64::from(variance[s as usize] + 0.25 * variance[site as usize]).max(1e-30);
            let w = kernel / noise;
            for i in 0..TERMS {
                for j in 0..TERMS {
                    m[i][j] += w * terms[i] * terms[j];
                }
            }
            rows.push((s, w, terms));
        }
        let Some(first) = first_row_of_inverse(m) else { continue };
        let weight = |w: f64, terms: &[f64; TERMS]| w * (0..TERMS).map(|i| first[i] * terms[i]).sum::<f64>();
        let value: Rgb = rows.iter().map(|(s, w, x)| refiner.e[*s as usize] * weight(*w, x) as f32).sum();
        let noise: f64 =
            rows.iter().map(|(s, w, x)| weight(*w, x).powi(2) * f64::from(variance[*s as usize])).sum();
        let noise = noise as f32;
        let agrees = |&(mean, v): &(f32, f32)| {
            (value.mean() - mean).powi(2) <= AGREE * AGREE * (v - noise).max(0.1 * v)
        };
        if !fits.iter().all(agrees) || !value.is_finite() {
            break;
        }
        fits.push((value.mean(), noise));
        believed = rows.iter().map(|(s, w, x)| (*s, weight(*w, x) as f32)).collect();
    }
    believed
}

/// The site and those around it that face alike, by distance (m), as far as they hang together; enough for the widest fit.
fn around(refiner: &Refiner, field: &Field, graph: &Graph, site: u32) -> Vec<(f32, u32)> {
    let at = |s: u32| &refiner.elements.vertices[field.sites[s as usize].vertex as usize];
    let most = REACHES[REACHES.len() - 1] + 1;
    let here = at(site);
    let mut found: Vec<(f32, u32)> = Vec::with_capacity(most);
    let mut seen = vec![site];
    let mut open = BinaryHeap::new();
    // Distances are positive, so that their bits are in their order.
    open.push(Reverse((0u32, site)));
    while let Some(Reverse((bits, s))) = open.pop() {
        found.push((f32::from_bits(bits), s));
        if found.len() >= most {
            break;
        }
        for &next in graph.of(s) {
            if seen.contains(&next) {
                continue;
            }
            seen.push(next);
            if at(next).normal.dot(here.normal) >= ALIKE {
                let d: Vec3 = at(next).position - here.position;
                open.push(Reverse((d.length().to_bits(), next)));
            }
        }
    }
    found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    found
}

/// First row of the inverse of a symmetric positive matrix, by Cholesky's factors; none when it is (nearly) singular, as
/// for sites in one line.
fn first_row_of_inverse(m: [[f64; TERMS]; TERMS]) -> Option<[f64; TERMS]> {
    let mut l = [[0f64; TERMS]; TERMS];
    for i in 0..TERMS {
        for j in 0..=i {
            let sum = m[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i != j {
                l[i][j] = sum / l[j][j];
            } else if sum > 1e-9 * m[0][0] {
                l[i][i] = sum.sqrt();
            } else {
                return None;
            }
        }
    }
    let mut y = [0f64; TERMS];
    for i in 0..TERMS {
        let right = if i == 0 { 1.0 } else { 0.0 };
        y[i] = (right - (0..i).map(|k| l[i][k] * y[k]).sum::<f64>()) / l[i][i];
    }
    let mut x = [0f64; TERMS];
    for i in (0..TERMS).rev() {
        x[i] = (y[i] - (i + 1..TERMS).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_of_an_inverse_times_the_matrix_is_the_first_unit_row() {
        let mut m = [[0f64; TERMS]; TERMS];
        for k in 0..20 {
            let (x, y) = ((f64::from(k) * 0.7).sin(), (f64::from(k) * 1.3).cos());
            let terms = [1.0, x, y, x * x, x * y, y * y];
            for i in 0..TERMS {
                for j in 0..TERMS {
                    m[i][j] += terms[i] * terms[j];
                }
            }
        }
        let first = first_row_of_inverse(m).expect("twenty scattered points fix a quadric");
        for (j, want) in [1.0, 0.0, 0.0, 0.0, 0.0, 0.0].into_iter().enumerate() {
            let product: f64 = first.iter().zip(&m).map(|(f, row)| f * row[j]).sum();
            assert!((product - want).abs() < 1e-9, "{j}: {product}");
        }
        // All in one line: nothing tells the terms across it.
        assert!(first_row_of_inverse([[1.0; TERMS]; TERMS]).is_none());
    }
}
