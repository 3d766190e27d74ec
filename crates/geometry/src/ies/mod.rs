//! Photometric webs: how a real lamp's luminous intensity depends on the direction, as its maker measured it.
//!
//! Read from IES LM-63 files ([`parse`]), all three types of photometry. A web is kept over polar coordinates about the
//! axis of its type, symmetries unfolded, so that look-up, flux and sampling know one layout only.

mod read;
mod write;

pub use read::{Fault, LARGEST, parse};

use crate::math::{Mat3, Vec3};
use std::f32::consts::PI;
use std::f64::consts::TAU;

/// The three ways of turning a lamp before a photometer (IES LM-75).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Photometry {
    /// Of most lamps for rooms and streets: angles from nadir, in planes about the vertical axis.
    C,
    /// Of floodlights.
    B,
    /// Of headlights.
    A,
}

impl Photometry {
    /// From directions in the space of the lamp's node, which aims along −z with its 0° plane along +x, to those of the
    /// table, whose polar axis is z (EXT_lights_ies, "Coordinate System Mapping").
    fn frame(self) -> Mat3 {
        let rows = match self {
            Photometry::C => [Vec3::X, Vec3::Y, Vec3::NEG_Z],
            Photometry::B => [Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y],
            Photometry::A => [Vec3::NEG_Z, Vec3::NEG_Y, Vec3::X],
        };
        Mat3::from_cols(rows[0], rows[1], rows[2]).transpose()
    }
}

/// Intensity over direction, relative to its peak; bilinear in the two angles, nothing outside of those measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Web {
    photometry: Photometry,
    /// Angles from the polar axis, rad, rising, at least two.
    polar: Vec<f32>,
    /// Angles around it, rad, rising, at least two.
    around: Vec<f32>,
    /// Row by row of the polar angle, [0, 1].
    relative: Vec<f32>,
    /// cd.
    peak: f32,
    /// ∫ of the relative intensity over all directions, sr.
    solid_angle: f32,
    /// Running sums of the cells' shares of the flux, one more than cells.
    sums: Vec<f32>,
}

impl Web {
    /// A web of `candela`, row by row of `polar`; `None` unless the angles rise, all is finite and ≥ 0, and it shines.
    fn new(photometry: Photometry, polar: Vec<f32>, around: Vec<f32>, candela: Vec<f32>) -> Option<Web> {
        let rises = |angles: &[f32]| angles.len() > 1 && angles.windows(2).all(|w| w[0] < w[1]);
        let peak = candela.iter().fold(0f32, |peak, &c| peak.max(c));
        let sound = candela.iter().all(|c| c.is_finite() && *c >= 0.0) && peak > 0.0;
        if !(rises(&polar) && rises(&around) && sound && candela.len() == polar.len() * around.len()) {
            return None;
        }
        let relative = candela.iter().map(|c| c / peak).collect();
        let (solid_angle, sums) = (0.0, Vec::new());
        let mut web = Web { photometry, polar, around, relative, peak, solid_angle, sums };
        let mut sum = 0f64;
        let mut sums = vec![0f64];
        for cell in 0..web.cells() {
            sum += web.cell_integral(cell);
            sums.push(sum);
        }
        web.sums = sums.iter().map(|s| (s / sum) as f32).collect();
        web.solid_angle = sum as f32;
        (sum > 0.0).then_some(web)
    }

    /// The greatest intensity, cd.
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// Flux over greatest intensity, sr: the integral of the relative intensity over all directions, exact for the
    /// bilinear table.
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// From the space of a lamp's node to directions of the table.
    pub fn frame(&self) -> Mat3 {
        self.photometry.frame()
    }

    /// Where both angles of the file are 0, as a direction of the table.
    pub fn aim(&self) -> Vec3 {
        self.frame() * Vec3::NEG_Z
    }

    /// Intensity toward the unit direction `d` of the table over the greatest one, [0, 1].
    pub fn relative(&self, d: Vec3) -> f32 {
        let Some(Place { row, column, s, t }) = self.locate(d) else { return 0.0 };
        let width = self.around.len();
        let at = |r: usize, c: usize| self.relative[(row + r) * width + column + c];
        let (near, far) = (at(0, 0) + (at(0, 1) - at(0, 0)) * t, at(1, 0) + (at(1, 1) - at(1, 0)) * t);
        near + (far - near) * s
    }

    /// The greatest angle from [`Web::aim`] at which it shines, rad, rounded up to the table's cells.
    pub fn reach(&self) -> f32 {
        let aim = self.aim();
        let bright = (0..self.cells()).filter(|&cell| self.cell_integral(cell) > 0.0);
        let furthest = bright.map(|cell| {
            let (polar, around) = self.sides(cell);
            if self.photometry == Photometry::C {
                return polar[1]; // the aim is the axis
            }
            let middle = direction(0.5 * (polar[0] + polar[1]), 0.5 * (around[0] + around[1]));
            middle.dot(aim).clamp(-1.0, 1.0).acos() + 0.5 * (polar[1] - polar[0] + around[1] - around[0])
        });
        furthest.fold(0f32, f32::max).min(PI)
    }

    /// A direction of the table, about in proportion to the intensity; `u` in [0, 1)².
    pub fn sample(&self, [u, v]: [f32; 2]) -> Vec3 {
        let cell = self.sums.partition_point(|&s| s <= u).clamp(1, self.cells()) - 1;
        let (low, high) = (self.sums[cell], self.sums[cell + 1]);
        let within = if high > low { ((u - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
        let (polar, around) = self.sides(cell);
        let [top, bottom] = polar.map(f32::cos);
        let cos = top + (bottom - top) * within;
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (y, x) = (around[0] + (around[1] - around[0]) * v).sin_cos();
        Vec3::new(sin * x, sin * y, cos)
    }

    /// The density with which [`Web::sample`] gives the unit direction `d`, 1/sr.
    pub fn pdf(&self, d: Vec3) -> f32 {
        let Some(Place { row, column, .. }) = self.locate(d) else { return 0.0 };
        let cell = row * (self.around.len() - 1) + column;
        let (polar, around) = self.sides(cell);
        let extent = (polar[0].cos() - polar[1].cos()) * (around[1] - around[0]);
        let share = self.sums[cell + 1] - self.sums[cell];
        if extent > 0.0 { share / extent } else { 0.0 }
    }

    fn cells(&self) -> usize {
        (self.polar.len() - 1) * (self.around.len() - 1)
    }

    /// The angles between which a cell lies.
    fn sides(&self, cell: usize) -> ([f32; 2], [f32; 2]) {
        let (row, column) = (cell / (self.around.len() - 1), cell % (self.around.len() - 1));
        ([self.polar[row], self.polar[row + 1]], [self.around[column], self.around[column + 1]])
    }

    /// ∫ over a cell, sr: ∫ (a + (b − a)(θ − θ₀)/Δ) sin θ dθ, a and b being the means of its two rows.
    fn cell_integral(&self, cell: usize) -> f64 {
        let ([p, q], [from, to]) = self.sides(cell);
        let (p, q) = (f64::from(p), f64::from(q));
        let (width, column) = (self.around.len(), cell % (self.around.len() - 1));
        let row = cell / (width - 1);
        let mean = |row: usize| {
            let at = row * width + column;
            0.5 * (f64::from(self.relative[at]) + f64::from(self.relative[at + 1]))
        };
        let (a, b) = (mean(row), mean(row + 1));
        let rise = q.sin() - p.sin() - (q - p) * q.cos();
        f64::from(to - from) * (a * (p.cos() - q.cos()) + (b - a) / (q - p) * rise)
    }

    fn locate(&self, d: Vec3) -> Option<Place> {
        // By both components, so that angles near the poles keep their digits.
        let polar = d.truncate().length().atan2(d.z);
        let around = d.y.atan2(d.x);
        let first = self.around[0];
        let around = if around < first - 1e-6 { around + TAU as f32 } else { around };
        let (row, s) = interval(&self.polar, polar)?;
        let (column, t) = interval(&self.around, around)?;
        Some(Place { row, column, s, t })
    }
}

/// Where in the table, and how far into the cell, [0, 1].
struct Place {
    row: usize,
    column: usize,
    s: f32,
    t: f32,
}

/// The interval of `angles` in which `x` lies and how far into it; a hair outside counts as within.
fn interval(angles: &[f32], x: f32) -> Option<(usize, f32)> {
    const HAIR: f32 = 2e-6;
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    if !(first - HAIR..=last + HAIR).contains(&x) {
        return None;
    }
    let i = angles.partition_point(|&a| a <= x).clamp(1, angles.len() - 1) - 1;
    Some((i, ((x - angles[i]) / (angles[i + 1] - angles[i])).clamp(0.0, 1.0)))
}

/// The unit direction of polar coordinates.
fn direction(polar: f32, around: f32) -> Vec3 {
    let ((sin, cos), (y, x)) = (polar.sin_cos(), around.sin_cos());
    Vec3::new(sin * x, sin * y, cos)
}

#[cfg(test)]
mod tests;
