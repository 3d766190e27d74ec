//! Where to spend samples: the pixels whose noise is cheapest to remove get more, until that of the whole picture is
//! what it may be.
//!
//! The metric is a mean of squares, so it is the sum Σ V/n over pixels that has to come down, not each term below a
//! bound: with v the relative variance of one sample and c its cost, cost is least for n ∝ √(v/c) (Lagrange; Neyman's
//! allocation of 1934). A bound for each pixel would ask n ∝ v, and spend most of the time on a few that are hopeless.

use crate::pixel::{Effort, Shot, View};
use geometry::sampling::Rng;
use rayon::prelude::*;

/// Rays that one more ray through the pixel takes where it goes on through mirrors, glass or gloss: itself, what it
/// meets, and the shadow rays there.
const SPECULAR_COST: f32 = 8.0;
/// A round for fewer pixels than one in so many is not worth its while.
const FEW: usize = 5000;
/// An edge through a jittered grid of n leaves a variance ∝ n^-1.5.
const EDGE_POWER: f32 = 1.5;
/// A redone pixel gets so many times the samples at most: an estimate from few samples may be far off.
const LEAP: u32 = 16;

/// Pixels whose noise is summed in order: the same sum whatever the number of threads.
const CHUNK: usize = 4096;

/// So near the goal another round is not worth its while.
const NEAR: f32 = 1.05;

/// Estimated variance of a pixel's luminance, (cd/m²)².
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    /// From rays through the pixel: edges, textures, gloss.
    pub camera: f32,
    /// From shadow rays.
    pub light: f32,
}

/// How much noise a picture may have, and how far one pixel may go.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Root of the mean squared relative error that samples may leave in the picture.
    pub goal: f32,
    /// Rays through a pixel at most.
    pub most_camera: u32,
    /// Shadow rays for a surface at most.
    pub most_shadow: u32,
}

/// One kind of samples in one pixel.
struct Stock {
    /// Relative variance of one sample; that of n of them is v n^-power.
    v: f32,
    power: f32,
    /// Samples so far.
    n: u32,
    most: u32,
    /// Logarithm to base four of the samples at which one more removes as much of the picture's variance as it costs,
    /// and a number in [0, 1) by which it is rounded.
    rung: f32,
}

impl Stock {
    /// - `luck`: in [0, 1): which of the powers of four above and below the optimum it is to be.
    fn new(v: f32, power: f32, n: u32, most: u32, cost: f32, luck: f32) -> Stock {
        let optimum = (power * v / cost).log(4.0) / (1.0 + power);
        Stock { v, power, n, most: most.max(n), rung: optimum + luck }
    }

    /// The rung of the ladder (powers of four) at which one more sample removes about `4^worth` of the picture's variance
    /// for each unit of cost; no less than there is.
    fn at(&self, worth: f32) -> u32 {
        if self.v <= 0.0 {
            return self.n; // nothing over nothing
        }
        let k = (self.rung - worth / (1.0 + self.power)).clamp(0.0, 15.0) as u32;
        4u32.pow(k).clamp(self.n, self.most)
    }

    /// Variance left there.
    fn left(&self, worth: f32) -> f64 {
        let n = self.at(worth) as f32;
        f64::from(self.v / if self.power == 1.0 { n } else { n.powf(self.power) })
    }

    /// The samples to take next: those, but within a leap of what there is.
    fn next(&self, worth: f32) -> u32 {
        self.at(worth).min(self.n * LEAP)
    }
}

/// Estimated noise of all pixels.
pub fn noise(shots: &[Option<Shot>], view: &View) -> Vec<Noise> {
    let grid = Grid { shots, w: view.width as i64, h: view.height as i64 };
    let own: Vec<Noise> = (0..shots.len()).into_par_iter().map(|i| grid.own(i)).collect();
    (0..shots.len()).into_par_iter().map(|i| grid.pooled(i, &own)).collect()
}

/// The picture's relative error by `noise`, and the weight of each pixel in it: one over the metric's denominator.
///
/// The denominator holds the square of what the pixel truly is, on average what it seems plus its variance: an edge of
/// a lamp in a dark pixel is an error of one, not of a thousand.
pub fn relative(shots: &[Option<Shot>], noise: &[Noise]) -> (f32, Vec<f32>) {
    let m = level(shots);
    let weight = |(shot, noise): (&Option<Shot>, &Noise)| {
        let beauty = shot.as_ref().map(|s| s.pixel.beauty()).unwrap_or_default();
        let square = (beauty.r * beauty.r + beauty.g * beauty.g + beauty.b * beauty.b) / 3.0;
        // Noise is of the luminance, the metric of all channels alike: on a red wall seven times the luminance's.
        let y = beauty.luminance();
        let colour = if y > 0.0 { (square / (y * y)).clamp(1.0 / 3.0, 10.0) } else { 1.0 };
        colour / (square + colour * (noise.camera + noise.light) + 0.01 * m * m).max(1e-30)
    };
    let weights: Vec<f32> = shots.par_iter().zip(noise).map(weight).collect();
    let sum: f64 = noise.iter().zip(&weights).map(|(n, w)| f64::from((n.camera + n.light) * w)).sum();
    ((sum / shots.len().max(1) as f64).sqrt() as f32, weights)
}

/// The pixels that get more, with their next effort; none when the noise is within the budget or nothing more may be
/// spent on it.
pub fn next(shots: &[Option<Shot>], noise: &[Noise], budget: &Budget) -> Vec<(u32, Effort)> {
    let (error, weights) = relative(shots, noise);
    if error <= NEAR * budget.goal {
        return Vec::new();
    }
    let stock = |i: usize| {
        shots[i].as_ref().map(|shot| {
            let Effort { camera, shadow } = shot.effort;
            // The same for a pixel in every round, lest a few more get their turn each time.
            let luck = Rng::new(0x6c75_636b, i as u64).f32();
            let stock = |variance: f32, n: u32, most: u32, power: f32, cost: f32| {
                let v = (variance * weights[i] * (n as f32).powf(power)).min(1e30);
                Stock::new(v, power, n, most, cost, luck)
            };
            let (power, cost) = if shot.specular { (1.0, SPECULAR_COST) } else { (EDGE_POWER, 1.0) };
            [
                stock(noise[i].camera, camera, budget.most_camera, power, cost),
                stock(noise[i].light, shadow, budget.most_shadow, 1.0, 1.0),
            ]
        })
    };
    let stocks: Vec<Option<[Stock; 2]>> = (0..shots.len()).into_par_iter().map(stock).collect();
    // The worth of a sample at which the picture just meets the goal, by bisection of its logarithm. What pixels leave
    // that can have no more is not made up for by the others.
    let left = |worth: f32| -> f64 {
        let of = |s: &Option<[Stock; 2]>| s.as_ref().map_or(0.0, |[a, b]| a.left(worth) + b.left(worth));
        stocks
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().map(of).sum::<f64>())
            .collect::<Vec<_>>()
            .iter()
            .sum()
    };
    let (mut low, mut high) = (-50f32, 50f32);
    let goal = (f64::from(budget.goal).powi(2) * shots.len() as f64).max(2.0 * left(low));
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if left(middle) > goal { high = middle } else { low = middle }
    }
    let more = |(i, stock): (usize, &Option<[Stock; 2]>)| {
        let [camera, light] = stock.as_ref()?;
        let mut effort = Effort { camera: camera.next(low), shadow: light.next(low) };
        if !shots[i].as_ref()?.specular {
            // The edge of a shadow runs through the pixel as an edge of a surface does: shadow rays start from
            // several points of it.
            effort.camera = effort.camera.max(effort.shadow / 4).min(camera.most);
        }
        (effort.camera > camera.n || effort.shadow > light.n).then_some((i as u32, effort))
    };
    let wanted: Vec<(u32, Effort)> = stocks.par_iter().enumerate().filter_map(more).collect();
    if wanted.len() * FEW > shots.len() { wanted } else { Vec::new() }
}

/// The pixels among their neighbours.
struct Grid<'a> {
    shots: &'a [Option<Shot>],
    w: i64,
    h: i64,
}

impl Grid<'_> {
    fn at(&self, x: i64, y: i64) -> Option<&Shot> {
        (x >= 0 && y >= 0 && x < self.w && y < self.h)
            .then(|| self.shots[(y * self.w + x) as usize].as_ref())
            .flatten()
    }

    /// What a pixel tells of its noise, by itself and by how it differs from its neighbours.
    fn own(&self, i: usize) -> Noise {
        let Some(shot) = &self.shots[i] else { return Noise::default() };
        let (x, y) = (i as i64 % self.w, i as i64 / self.w);
        let mut noise = Noise { camera: shot.camera_variance, light: shot.light_variance };
        let beauty = shot.pixel.beauty();
        let n = shot.effort.camera as f32;
        let (mut gloss, mut texture, mut axes) = (0.0, 0.0, 0.0);
        for (dx, dy) in [(1, 0), (0, 1)] {
            let beside = [self.at(x - dx, y - dy), self.at(x + dx, y + dy)];
            for other in beside.into_iter().flatten() {
                if shot.continues(other) {
                    if n == 1.0 {
                        // The hard edge of a shadow, as one of a surface: see below.
                        let step = (other.hard - shot.hard) * shot.sent;
                        noise.camera += step * step / 24.0;
                    }
                } else {
                    let step = (other.pixel.beauty() - beauty).luminance();
                    noise.camera += if n == 1.0 {
                        // An edge lies as likely on either side of the border, and anywhere there: 1/2 · 1/12.
                        step * step / 24.0
                    } else {
                        // Rays that all met one surface may have missed a sliver of the other.
                        0.25 * (0.5 * step / n).powi(2)
                    };
                }
            }
            if let [Some(a), Some(b)] = beside
                && n == 1.0
                && shot.continues(a)
                && shot.continues(b)
            {
                // Uneven steps: noise has 3/2 of its variance in them, an edge within the pixel six times its error.
                let bend = |f: &dyn Fn(&Shot) -> f32| (f(shot) - 0.5 * (f(a) + f(b))).powi(2) / 3.0;
                gloss += bend(&|s| (s.pixel.specular + s.pixel.emission).luminance());
                texture += bend(&|s| s.pixel.albedo.luminance());
                axes += 1.0;
            }
        }
        if axes > 0.0 {
            let sent = shot.pixel.irradiance.luminance() / std::f32::consts::PI;
            noise.camera += (gloss + texture * sent * sent) / axes;
        }
        if let Some(spread) = self.light_noise(shot, x, y) {
            noise.light = noise.light.max(spread * shot.sent * shot.sent);
        }
        noise
    }

    /// Variance of the direct irradiance of a pixel among eight others of the same surface and effort, lx²: what
    /// neither a slope nor a bend along rows or columns explains (Immerkær, "Fast Noise Variance Estimation", CVIU
    /// 64(2), 1996). A single sample knows nothing of its own spread.
    fn light_noise(&self, shot: &Shot, x: i64, y: i64) -> Option<f32> {
        const KERNEL: [f32; 9] = [1.0, -2.0, 1.0, -2.0, 4.0, -2.0, 1.0, -2.0, 1.0];
        let mut sum = 0.0;
        for (k, weight) in KERNEL.iter().enumerate() {
            let other = self.at(x + k as i64 % 3 - 1, y + k as i64 / 3 - 1)?;
            if !shot.continues(other) || other.effort.shadow != shot.effort.shadow {
                return None;
            }
            sum += weight * other.lit;
        }
        Some(sum * sum / 36.0)
    }

    /// The mean of what a pixel and its neighbours on the same surface estimate, each as if it had the pixel's effort.
    ///
    /// A pixel's own estimate comes from the same few samples as its light: where they all missed, both are zero, and
    /// pixels that stop there would darken the picture (by 0.6 % on a white ball under an even sky, and by 22 % on
    /// rough metal beside a highlight, measured).
    fn pooled(&self, i: usize, own: &[Noise]) -> Noise {
        let Some(shot) = &self.shots[i] else { return Noise::default() };
        let (x, y) = (i as i64 % self.w, i as i64 / self.w);
        let (mut sum, mut count) = (Noise::default(), 0.0);
        for (nx, ny) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy))) {
            let Some(other) = self.at(nx, ny) else { continue };
            if (nx, ny) != (x, y) && !shot.like(other) {
                continue;
            }
            let theirs = &own[(ny * self.w + nx) as usize];
            let scale = |theirs: u32, ours: u32| theirs as f32 / ours.max(1) as f32;
            sum.camera += theirs.camera * scale(other.effort.camera, shot.effort.camera);
            sum.light += theirs.light * scale(other.effort.shadow, shot.effort.shadow);
            count += 1.0;
        }
        Noise { camera: sum.camera / count, light: sum.light / count }
    }
}

/// Brightness of the picture that visible lamps cannot inflate: M of the error metric.
fn level(shots: &[Option<Shot>]) -> f32 {
    let mut y: Vec<f32> = shots.iter().flatten().map(|s| s.pixel.beauty().luminance()).collect();
    if y.is_empty() {
        return 0.0;
    }
    let k = (y.len() - 1) * 9 / 10;
    let p90 = *y.select_nth_unstable_by(k, f32::total_cmp).1;
    (y.iter().map(|&v| f64::from(v.min(p90))).sum::<f64>() / y.len() as f64) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Pixel;
    use geometry::{Camera, Rgb, Vec3};

    const LUCKS: u32 = 1000;

    /// Mean logarithm of the samples taken at `worth`, over all lucks.
    fn mean_log(v: f32, power: f32, cost: f32, worth: f32) -> f32 {
        let at = |k: u32| Stock::new(v, power, 1, 1 << 14, cost, k as f32 / LUCKS as f32).at(worth);
        (0..LUCKS).map(|k| (at(k) as f32).ln()).sum::<f32>() / LUCKS as f32
    }

    #[test]
    fn the_optimum_gives_every_pixel_samples_of_equal_worth() {
        // Of one more sample: power · v · n^-(power + 1) / cost.
        for (v, power, cost) in [(4.0, 1.0, 1.0), (1.0, 1.0, 1.0), (9.0, 1.5, 1.0), (2.0, 1.0, 8.0f32)] {
            let n = mean_log(v, power, cost, -5.0).exp();
            let worth = power * v / cost * n.powf(-1.0 - power);
            assert!((worth * 4f32.powi(5) - 1.0).abs() < 0.01, "{n} samples: {worth}");
        }
        // Four times the variance, twice the samples.
        let ratio = (mean_log(4.0, 1.0, 1.0, -5.0) - mean_log(1.0, 1.0, 1.0, -5.0)).exp();
        assert!((ratio - 2.0).abs() < 0.01, "{ratio}");
    }

    #[test]
    fn rungs_are_powers_of_four_within_a_leap() {
        let s = |n: u32, luck: f32| Stock::new(1e9, 1.0, n, 256, 1.0, luck);
        assert_eq!((s(4, 0.0).next(-10.0), s(4, 0.99).next(-10.0)), (64, 64), "16 times 4");
        assert_eq!(s(64, 0.0).next(-10.0), 256, "no more than allowed");
        let none = |v: f32| Stock::new(v, 1.0, 1, 256, 1.0, 0.99).next(0.0);
        assert_eq!((none(1e-9), none(0.0)), (1, 1), "no less than there is");
        // An optimum of 8 is as likely 4 as 16.
        let eight = |luck: f32| Stock::new(64.0, 1.0, 1, 256, 1.0, luck).next(0.0);
        assert_eq!((eight(0.49), eight(0.51)), (4, 16));
    }

    /// A picture of one surface whose direct light is `lit(x, y)`, 64 × 64.
    fn shots(lit: impl Fn(u32, u32) -> f32) -> Vec<Option<Shot>> {
        let shot = |i: u32| {
            let lit = lit(i % 64, i / 64);
            let pixel = Pixel { direct: Rgb::splat(0.25 * lit), samples: 1, ..Pixel::default() };
            let effort = Effort { camera: 1, shadow: 4 };
            Some(Shot {
                pixel,
                effort,
                key: None,
                lit,
                hard: 0.0,
                sent: 0.25,
                camera_variance: 0.0,
                light_variance: 0.0,
                specular: false,
                gathered: [None; 2],
            })
        };
        (0..64 * 64).map(shot).collect()
    }

    fn mean_light_noise(shots: &[Option<Shot>]) -> f64 {
        let camera = Camera::framing(Vec3::ZERO, Vec3::ONE);
        let noise = noise(shots, &View { camera: &camera, width: 64, height: 64 });
        // The rim has no eight neighbours.
        let inner = (0..noise.len()).filter(|i| (2..62).contains(&(i % 64)) && (2..62).contains(&(i / 64)));
        inner.map(|i| f64::from(noise[i].light)).sum::<f64>() / 3600.0
    }

    #[test]
    fn noise_is_read_off_the_neighbours_whatever_the_light_does_along_rows_and_columns() {
        let curve = |x: u32, y: u32| {
            let (x, y) = (x as f32 / 64.0, y as f32 / 64.0);
            3.0 + 2.0 * x + x * x + (4.0 * y).sin()
        };
        // Even of rounding there is little: (3 · 4 · 2^-23)² over 36, and sent² with it.
        assert!(mean_light_noise(&shots(curve)) < 1e-12);
        let mut rng = Rng::new(1, 2);
        let grain: Vec<f32> = (0..64 * 64).map(|_| rng.f32() - 0.5).collect();
        let noisy = shots(|x, y| curve(x, y) + 0.2 * grain[(64 * y + x) as usize]);
        // A uniform number of width 0.2 has a variance of 0.04/12; the kernel's overlap leaves of 3600 squares the worth
        // of some 500: one standard deviation is √(2/500) = 6 %.
        let expected = 0.04 / 12.0 * 0.25 * 0.25;
        let found = mean_light_noise(&noisy);
        assert!((found / expected - 1.0).abs() < 4.9 * 0.06, "{found}, not {expected}");
    }

    #[test]
    fn what_is_hopeless_is_not_made_up_for_elsewhere() {
        let mut shots = shots(|_, _| 3.0);
        // A lamp's edge in each tenth pixel that may have no more rays, and a little noise of shadows everywhere.
        for (i, shot) in shots.iter_mut().enumerate() {
            let shot = shot.as_mut().expect("all are there");
            shot.light_variance = if i % 2 == 0 { 1e-6 } else { 0.0 };
            shot.camera_variance = if i % 10 == 0 { 1.0 } else { 0.0 };
        }
        let camera = Camera::framing(Vec3::ZERO, Vec3::ONE);
        let noise = noise(&shots, &View { camera: &camera, width: 64, height: 64 });
        let budget = Budget { goal: 0.01, most_camera: 1, most_shadow: 1 << 14 };
        assert!(relative(&shots, &noise).0 > 0.1);
        assert!(next(&shots, &noise, &budget).is_empty());
    }

    #[test]
    fn a_picture_within_its_budget_is_left_alone() {
        let mut rng = Rng::new(1, 2);
        let grain: Vec<f32> = (0..64 * 64).map(|_| rng.f32() - 0.5).collect();
        let shots = shots(|x, y| 3.0 + 0.2 * grain[(64 * y + x) as usize]);
        let camera = Camera::framing(Vec3::ZERO, Vec3::ONE);
        let noise = noise(&shots, &View { camera: &camera, width: 64, height: 64 });
        let (error, _) = relative(&shots, &noise);
        let budget = |goal| Budget { goal, most_camera: 1, most_shadow: 1 << 14 };
        assert!(next(&shots, &noise, &budget(error)).is_empty());
        let more = next(&shots, &noise, &budget(0.25 * error));
        // A sixteenth of the variance takes sixteen times as many shadow rays: nearly all pixels want more.
        assert!(more.len() > 3000 && more.iter().all(|(_, e)| e.shadow > 4), "{}", more.len());
    }
}
