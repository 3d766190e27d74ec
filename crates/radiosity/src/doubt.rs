//! How far the mesh may be off, and how noisy a gather would be there: whether pass 2 had better gather for itself.
//!
//! What a site's neighbours say of it, beyond their rays' noise, tells how the light bends between them. The weights were
//! fitted where it is known: pixels of two furnished rooms (400 000 and 250 000 triangles at 5 %), as the mesh shows them
//! and as gathered for each. Both rooms gave the same within a fifth. Of the mean squared error of the mesh, the tenth of
//! the pixels that are doubted most hold a half, three tenths hold 70 to 77 %.

use crate::gather::lattice_share;
use crate::neighbours::Graph;
use crate::refine::Refiner;
use crate::smooth::Smoothing;
use geometry::Rgb;
use rayon::prelude::*;
use std::iter::Sum;
use std::ops::{Add, Mul};

/// Share of the mean squared difference of neighbouring sites that interpolation between them is off by, squared.
const SLOPE: f32 = 0.026;
/// The same of the squared difference of a site from the mean of its neighbours.
const BEND: f32 = 0.12;
/// The same where the light is known to bend evenly: x (1 - x)/2 beside 1/2, squared, on average.
const CURVE: f32 = 0.033;

/// What is to be expected at a place, lx² (mean of the channels).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Doubt {
    /// Mean square of the error of what the mesh says.
    pub mesh: f32,
    /// Variance of what a single ray brings.
    pub ray: f32,
}

impl Doubt {
    /// Variance to be expected of a gather of `rays` rays, lx².
    pub fn of_gather(&self, rays: u32) -> f32 {
        lattice_share(rays) * self.ray / rays.max(1) as f32
    }
}

impl Add for Doubt {
    type Output = Doubt;
    fn add(self, other: Doubt) -> Doubt {
        Doubt { mesh: self.mesh + other.mesh, ray: self.ray + other.ray }
    }
}

impl Mul<f32> for Doubt {
    type Output = Doubt;
    fn mul(self, by: f32) -> Doubt {
        Doubt { mesh: self.mesh * by, ray: self.ray * by }
    }
}

impl Sum for Doubt {
    fn sum<I: Iterator<Item = Doubt>>(all: I) -> Doubt {
        all.fold(Doubt::default(), Add::add)
    }
}

/// The doubt at every site.
///
/// - `variance`: of each site's value (mean of the channels) before smoothing, lx².
pub(crate) fn of_sites(refiner: &Refiner, variance: &[f32], smoothing: &Smoothing) -> Vec<Doubt> {
    let graph = Graph::new(refiner, |_, _| true);
    let smooth = smoothing.apply(&refiner.e);
    let of = |site: u32| {
        let near = graph.of(site);
        let v = variance[site as usize];
        let rays = refiner.field.sites[site as usize].row.rays.max(1);
        let ray = v * rays as f32 / lattice_share(rays);
        let noise = smoothing.variance(site, variance);
        if near.is_empty() {
            return Doubt { mesh: noise, ray };
        }
        // Squared difference of the site from the mean of its neighbours.
        let bend = |e: &[Rgb]| {
            let mean = near.iter().map(|&other| e[other as usize].mean()).sum::<f32>() / near.len() as f32;
            (e[site as usize].mean() - mean).powi(2)
        };
        if smoothing.fits(site) {
            return Doubt { mesh: CURVE * bend(&smooth) + noise, ray };
        }
        let beyond = |&other: &u32| {
            let step = refiner.e[site as usize].mean() - refiner.e[other as usize].mean();
            (step * step - v - variance[other as usize]).max(0.0)
        };
        let slope = near.iter().map(beyond).sum::<f32>() / near.len() as f32;
        let bend = (bend(&refiner.e) - v).max(0.0);
        Doubt { mesh: SLOPE * slope + BEND * bend + noise, ray }
    };
    (0..refiner.e.len() as u32).into_par_iter().map(of).collect()
}
