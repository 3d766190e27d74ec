//! Is the error what was promised? Some hundred pixels are path traced, which never sees the radiosity solution.
//! Light by way of mirrors and glass, which paths find too seldom, comes from photons of the probes' own.
//!
//! A probe is one pixel, drawn at random from its own cell of a grid over the picture, so that a bad region of one
//! pixel in a hundred holds five of them. With x̄ the mean of its n sets of paths and s² their variance,
//!
//! ```text
//! E[(out − x̄)² − s²/n] = (out − truth)²
//! ```
//!
//! so that the paths' own noise drops out of the mean over probes, and only widens its confidence interval. How many
//! paths a probe gets is decided by a pilot whose paths are then thrown away: a number that depended on the paths
//! that count would favour those that missed the light.

use crate::film::Film;
use crate::integrator::path::{self, Aid, Even};
use crate::metrics;
use crate::pixel::View;
use geometry::World;
use geometry::sampling::Rng;
use radiosity::caustic::Caustics;
use radiosity::{Config, Progress};
use rayon::prelude::*;

/// Pixels probed, about.
const PROBES: f32 = 512.0;
/// Paths of a probe go in so many sets, each even in itself ([`Even`]) and independent of the others: the fewer, the more
/// is won by their evenness, and the less is known of their noise.
const SETS: u32 = 4;
/// Paths of a set of the pilot at each probe.
const PILOT: u32 = 16;
/// Standard deviation that the paths' noise may leave in the mean squared error, in units of the square of the error
/// asked. A picture is judged by 2.6 of them: one of 1.4 times the error asked is seen to be missed. It came out as 1 to 2 times
/// this in three small rooms, over 24 seeds, for few paths carry much of the light.
const SHARP: f64 = 0.35;
/// So small a one is worth the rays only where they are few beside those of the picture.
const SHARPEST: f64 = 0.1;
/// Rays for the probes at most: so many, and this share of what the picture took.
const LEAST_BUDGET: u64 = 300_000;
const MOST_SHARE: u64 = 4;
/// This share of them is theirs in any case, while they get sharper by it: a thirtieth of the time in a furnished room.
const FREE_SHARE: u64 = 8;
/// Paths of a set of one probe at most.
const MOST: f64 = 16384.0;
/// Pictures that the interval is taken from, drawn from the probes with replacement (Efron, "Bootstrap Methods", Ann.
/// Statist. 7(1), 1979).
const RESAMPLED: u64 = 1000;

/// Pixels whose light is known, up to a noise that is known too.
#[derive(Clone, Debug)]
pub struct Probes {
    probes: Vec<Probe>,
    /// Paths traced in all.
    paths: u64,
}

/// One pixel, path traced.
#[derive(Clone, Copy, Debug)]
struct Probe {
    pixel: usize,
    /// Share of the picture that it stands for.
    share: f64,
    /// Mean radiance of its paths, cd/m².
    mean: [f64; 3],
    /// Variance of that mean.
    noise: [f64; 3],
}

/// What the probes say of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The error asked, as a fraction.
    pub asked: f64,
    /// The error measured, by the metric of [`crate::metrics`]; 0 where the probes cannot tell it from none.
    pub error: f64,
    /// With 95 % confidence the error is no less,
    pub low: f64,
    /// and no more than this.
    pub high: f64,
    /// With 99.5 % confidence it is no less than this: a picture is judged several times, and to call a good one bad
    /// costs as much again.
    pub least: f64,
    /// Pixels probed.
    pub probes: usize,
    /// Paths traced for it.
    pub paths: u64,
}

/// What a verdict comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// The measured error is no larger than the one asked.
    Met,
    /// It is larger, but not beyond doubt.
    Open,
    /// With 99.5 % confidence the error is larger than the one asked.
    Missed,
}

impl Verdict {
    /// Whether the picture is what was asked.
    pub fn judgement(&self) -> Judgement {
        match self {
            v if v.error <= v.asked => Judgement::Met,
            v if v.least > v.asked => Judgement::Missed,
            _ => Judgement::Open,
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [error, low, high] = [self.error, self.low, self.high].map(|e| 100.0 * e);
        // As it was typed: 2, not 1.9999999552965164.
        let asked = (100.0 * self.asked) as f32;
        let word = match self.judgement() {
            Judgement::Met => "met",
            Judgement::Open => "not surely met",
            Judgement::Missed => "missed",
        };
        write!(f, "{error:.2} % (95 %: {low:.2} to {high:.2} %), {asked} % asked: {word}; ")?;
        write!(f, "{} pixels, {} paths", self.probes, self.paths)
    }
}

impl Probes {
    /// Traces probes to hold `film` and its like against, a picture that `took` so many rays: enough paths to tell
    /// whether the error is the one `asked`, unless that takes too large a share of them; more where they take a small
    /// one. `None` when stopped.
    pub fn trace(
        world: &World,
        view: &View,
        film: &Film,
        asked: f32,
        seed: u64,
        took: u64,
        progress: &dyn Progress,
    ) -> Option<Probes> {
        let seed = seed ^ 0x0070_726f_6265;
        let cells = cells(view.width, view.height, seed);
        let weights = Weights::new(film);
        // The probes are few, and other noise is larger.
        let particles = Config::for_error(asked).photons / 4;
        let caustics = Caustics::trace(world, particles, seed);
        let caustics = Some(&caustics).filter(|c| !c.is_empty());
        progress.stage("verifying", 2 * cells.len() as u64);
        let before = world.bvh.rays_cast();
        let trace = |&(pixel, share): &(usize, f64), paths: u32, stream: u64| {
            if progress.stopped() {
                return None;
            }
            let probe = probe(world, view, caustics, pixel, share, paths, seed ^ stream);
            progress.advance(1);
            Some(probe)
        };
        let pilot: Option<Vec<Probe>> = cells.par_iter().map(|cell| trace(cell, PILOT, 1)).collect();
        let pilot = pilot?;
        let count = cells.len().max(1) as f64;
        let rays_a_set_path = (world.bvh.rays_cast() - before) as f64 / (count * f64::from(PILOT));

        // Variance of sets of one path, were they no more than random, relative to the pixel's weight in the metric; few
        // sets know it poorly, so that of all pixels together counts for half.
        let own: Vec<f64> =
            pilot.iter().map(|p| f64::from(PILOT) * average(p.noise) / weights.of(film, p)).collect();
        let all = own.iter().sum::<f64>() / count;
        // The variance of the mean squared error, Σ c v² / n² / P² (c: of the paths' mean, and of the estimate of its own
        // noise), is least at n ∝ v^⅔ for a number of paths.
        let shares: Vec<f64> = own.iter().map(|v| (0.5 * (v + all)).powf(2.0 / 3.0)).collect();
        let sum: f64 = shares.iter().sum();
        let c = 2.0 + 2.0 / f64::from(SETS - 1);
        let wanted = |sharp: f64| (c * sum).sqrt() / (sharp * f64::from(asked).powi(2) * count);
        let affordable = |rays: u64| rays as f64 / (rays_a_set_path * sum).max(1e-30);
        let needed = wanted(SHARP).min(affordable(LEAST_BUDGET + took / MOST_SHARE));
        let scale = wanted(SHARPEST).min(affordable(took / FREE_SHARE)).max(needed);
        // Sets are most even where they hold a power of two.
        let paths = |share: f64| (scale * share).clamp(f64::from(PILOT), MOST).log2().round().exp2() as u32;
        let traced: u64 = shares.iter().map(|&s| u64::from(paths(s) * SETS)).sum();
        let jobs: Vec<_> = cells.iter().zip(&shares).collect();
        let probes: Option<Vec<Probe>> =
            jobs.par_iter().map(|(cell, share)| trace(cell, paths(**share), 2)).collect();
        Some(Probes { probes: probes?, paths: traced })
    }

    /// How far `film` is from the truth.
    pub fn judge(&self, film: &Film, asked: f32) -> Verdict {
        let weights = Weights::new(film);
        let squares: Vec<f64> = self
            .probes
            .iter()
            .map(|p| {
                let out = film.pixels[p.pixel].beauty().to_array();
                let off: f64 = (0..3).map(|c| (f64::from(out[c]) - p.mean[c]).powi(2) - p.noise[c]).sum();
                off / 3.0 / weights.of(film, p)
            })
            .collect();
        let root = |mean: f64| mean.max(0.0).sqrt();
        let whole: f64 = self.probes.iter().map(|p| p.share).sum();
        let mean = self.probes.iter().zip(&squares).map(|(p, e)| p.share * e).sum::<f64>() / whole.max(1e-30);
        let mut resampled: Vec<f64> = (0..RESAMPLED)
            .map(|i| {
                let mut rng = Rng::new(0x626f_6f74, i);
                let (mut sum, mut shares) = (0.0, 0.0);
                for _ in 0..squares.len() {
                    let k = rng.below(squares.len() as u32) as usize;
                    sum += self.probes[k].share * squares[k];
                    shares += self.probes[k].share;
                }
                sum / f64::max(shares, 1e-30)
            })
            .collect();
        resampled.sort_by(f64::total_cmp);
        let quantile = |q: f64| root(resampled[(q * (RESAMPLED - 1) as f64) as usize]);
        Verdict {
            asked: f64::from(asked),
            error: root(mean),
            low: quantile(0.025),
            high: quantile(0.975),
            least: quantile(0.005),
            probes: self.probes.len(),
            paths: self.paths,
        }
    }
}

/// A pixel drawn from each cell of a grid over the picture, and the cell's share of the picture.
fn cells(width: u32, height: u32, seed: u64) -> Vec<(usize, f64)> {
    let (w, h) = (width as f32, height as f32);
    let columns = ((PROBES * w / h).sqrt().round() as u32).clamp(1, width);
    let rows = ((PROBES / columns as f32).round() as u32).clamp(1, height);
    let bound = |i: u32, n: u32, size: u32| (u64::from(i) * u64::from(size) / u64::from(n)) as u32;
    let mut cells = Vec::with_capacity((columns * rows) as usize);
    for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        let mut rng = Rng::new(seed, u64::from(row * columns + column));
        let [(x0, x1), (y0, y1)] = [
            (bound(column, columns, width), bound(column + 1, columns, width)),
            (bound(row, rows, height), bound(row + 1, rows, height)),
        ];
        let (x, y) = (x0 + rng.below(x1 - x0), y0 + rng.below(y1 - y0));
        let share = f64::from((x1 - x0) * (y1 - y0)) / (f64::from(width) * f64::from(height));
        cells.push(((y * width + x) as usize, share));
    }
    cells
}

/// Traces [`SETS`] independent sets of `paths` each through one pixel.
fn probe(
    world: &World,
    view: &View,
    caustics: Option<&Caustics>,
    pixel: usize,
    share: f64,
    paths: u32,
    seed: u64,
) -> Probe {
    let (x, y) = (pixel as u32 % view.width, pixel as u32 / view.width);
    let (mut mean, mut spread) = ([0f64; 3], [0f64; 3]);
    let mut rng = Rng::new(seed, pixel as u64);
    for i in 0..SETS {
        let set = rng.u32();
        let mut light = [0f64; 3];
        for k in 0..paths {
            let even = Even::new(k, set);
            let [fx, fy] = even.place();
            let ray = view.ray(x as f32 + fx, y as f32 + fy);
            let found = path::aided_radiance(world, ray, Aid { caustics, even }, &mut rng).to_array();
            (0..3).for_each(|c| light[c] += f64::from(found[c]) / f64::from(paths));
        }
        for c in 0..3 {
            let step = light[c] - mean[c];
            mean[c] += step / f64::from(i + 1);
            spread[c] += step * (light[c] - mean[c]);
        }
    }
    let n = f64::from(SETS);
    Probe { pixel, share, mean, noise: spread.map(|s| s / (n * (n - 1.0))) }
}

/// The weights of pixels in the metric.
struct Weights {
    /// 0.01 M².
    floor: f64,
}

impl Weights {
    fn new(film: &Film) -> Weights {
        Weights { floor: (0.01 * metrics::brightness(&film.beauty()).powi(2)).max(f64::MIN_POSITIVE) }
    }

    /// mean_c truth² + 0.01 M², the truth taken as what the film says, or where the paths say otherwise beyond five
    /// standard errors, as the nearest that they allow: a firefly must not excuse itself. Of four sets two standard
    /// errors would be too few: those that missed the light know nothing of it, and made errors look a third larger.
    fn of(&self, film: &Film, p: &Probe) -> f64 {
        let out = film.pixels[p.pixel].beauty().to_array();
        let square = |c: usize| {
            let doubt = 5.0 * p.noise[c].sqrt();
            f64::from(out[c]).clamp(p.mean[c] - doubt, p.mean[c] + doubt).powi(2)
        };
        (0..3).map(square).sum::<f64>() / 3.0 + self.floor
    }
}

fn average(v: [f64; 3]) -> f64 {
    v.iter().sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Pixel;
    use geometry::Rgb;

    #[test]
    fn every_pixel_is_in_one_cell() {
        for (w, h) in [(1, 1), (3, 700), (512, 512), (640, 360), (31, 17)] {
            let cells = cells(w, h, 7);
            let whole: f64 = cells.iter().map(|c| c.1).sum();
            assert!((whole - 1.0).abs() < 1e-9, "{w}x{h}: {whole}");
            assert!(cells.iter().all(|c| c.0 < (w * h) as usize));
        }
        assert!((480..545).contains(&cells(512, 512, 7).len()));
    }

    /// Probes of a picture whose truth is 1 everywhere, known with a noise of variance `noise`.
    fn known(film: &Film, noise: f64) -> Probes {
        let n = film.pixels.len();
        let mut rng = Rng::new(3, 3);
        let mut normal = || {
            let (a, b) = (f64::from(1.0 - rng.f32()), f64::from(rng.f32()));
            (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
        };
        let mut one = |pixel| Probe {
            pixel,
            share: 1.0 / n as f64,
            mean: [0; 3].map(|_| 1.0 + noise.sqrt() * normal()),
            noise: [noise; 3],
        };
        Probes { probes: (0..n).map(&mut one).collect(), paths: 0 }
    }

    fn film(value: impl Fn(usize) -> f32) -> Film {
        let pixel = |i| Pixel { direct: Rgb::splat(value(i)), samples: 1, ..Pixel::default() };
        Film::from_pixels(32, 32, (0..1024).map(pixel).collect())
    }

    #[test]
    fn the_probes_own_noise_is_no_error() {
        // Off by 3 % everywhere, probed with a noise of 10 %: of 3072 numbers the mean square has a standard
        // deviation of √(2/3072) · 0.01 = 2.6e-4, and 9e-4 is the truth.
        let film = film(|_| 1.03);
        let verdict = known(&film, 0.01).judge(&film, 0.03);
        assert!((verdict.error.powi(2) - 9e-4).abs() < 4.9 * 2.8e-4, "{verdict:?}");
        assert!(verdict.low < 0.03 && verdict.high > 0.03, "{verdict:?}");
    }

    #[test]
    fn a_bad_region_of_one_pixel_in_a_hundred_is_not_missed() {
        let film = film(|i| if i % 100 == 50 { 1.5 } else { 1.0 });
        let verdict = known(&film, 1e-6).judge(&film, 0.02);
        assert!((verdict.error - 0.05).abs() < 0.005, "{verdict:?}");
        assert_eq!(verdict.judgement(), Judgement::Missed);
        assert_eq!(known(&film, 1e-6).judge(&film, 0.06).judgement(), Judgement::Met);
    }

    #[test]
    fn a_firefly_does_not_excuse_itself() {
        let film = film(|i| if i == 7 { 1000.0 } else { 1.0 });
        let verdict = known(&film, 1e-6).judge(&film, 0.02);
        // 999² / 1024 over a weight of 1 + 0.01.
        assert!((verdict.error - 999.0 / 32.0 / 1.005).abs() < 0.3, "{verdict:?}");
    }
}
