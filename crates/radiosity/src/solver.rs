//! Solve E = D + K E to a stated bound.

pub mod gauss_seidel;
pub mod progressive;

use geometry::Rgb;
use rayon::prelude::*;

/// Differences kept for the extrapolation: at albedo 0.99 five bring 341 iterations down to 28.
const HISTORY: usize = 5;

/// How a solve ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Convergence {
    /// Applications of K.
    pub iterations: u32,
    /// Largest |D + K E − E| over sites and channels, lx.
    pub residual: f32,
    /// Values are on average no further than this from the fixed point, lx: residual · mean gain.
    pub bound: f32,
    /// Row sums of (I − K)⁻¹, or a little more: how much light a place gets per light given everywhere.
    pub gain: Gain,
    /// Whether the bound asked for was met.
    pub converged: bool,
}

/// Iterates E ← D + K E from `start` until values are on average no further than `tolerance` (lx) from the fixed point.
///
/// - `apply`: E to D + K E.
/// - `gain`: an upper bound on the row sums of (I − K)⁻¹, see [`gain`]; |E − E*| ≤ row sum · |residual| at each site.
///
/// Anderson acceleration (Walker and Ni, "Anderson Acceleration for Fixed-Point Iterations", SIAM J. Numer. Anal.
/// 49(4), 2011, alg. 2.2), least squares by normal equations in f64. A step that makes the residual grow is taken
/// back to the plain one.
pub fn solve(
    start: Vec<Rgb>,
    gain: Gain,
    tolerance: f32,
    most: u32,
    apply: impl Fn(&[Rgb]) -> Vec<Rgb>,
) -> (Vec<Rgb>, Convergence) {
    let mut x = start;
    let mut report = Convergence { gain, ..Convergence::default() };
    let (mut dg, mut df): (Vec<Vec<Rgb>>, Vec<Vec<Rgb>>) = (Vec::new(), Vec::new());
    let mut previous: Option<(Vec<Rgb>, Vec<Rgb>)> = None; // g(x) and f = g(x) − x of the last step
    loop {
        let g = apply(&x);
        let f: Vec<Rgb> = g.par_iter().zip(&x).map(|(&g, &x)| g - x).collect();
        report.iterations += 1;
        report.residual = f.par_iter().map(|f| f.map(f32::abs).max_channel()).reduce(|| 0.0, f32::max);
        report.bound = gain.mean * report.residual;
        report.converged = report.bound <= tolerance;
        if report.converged || report.iterations >= most || !report.residual.is_finite() {
            return (g, report);
        }
        if let Some((g0, f0)) = previous.take() {
            dg.push(difference(&g, &g0));
            df.push(difference(&f, &f0));
            if dg.len() > HISTORY {
                dg.remove(0);
                df.remove(0);
            }
        }
        let gamma = least_squares(&df, &f);
        let next: Vec<Rgb> = (0..g.len())
            .into_par_iter()
            .map(|i| {
                let step: Rgb = gamma.iter().zip(&dg).map(|(&c, d)| d[i] * c as f32).sum();
                // Irradiance is never negative; an extrapolation may be.
                (g[i] - step).max(Rgb::BLACK)
            })
            .collect();
        previous = Some((g, f));
        x = next;
    }
}

/// Upper bounds on the row sums of (I − K)⁻¹; infinite when none is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gain {
    /// Over sites.
    pub mean: f32,
    /// ‖(I − K)⁻¹‖∞: no single value is further than this times the residual from the fixed point.
    pub largest: f32,
}

impl Gain {
    /// From the norm of K alone: 1 / (1 − ‖K‖∞).
    pub fn of_norm(norm: f32) -> Gain {
        let gain = if norm < 1.0 { 1.0 / (1.0 - norm) } else { f32::INFINITY };
        Gain { mean: gain, largest: gain }
    }
}

/// The gain of a K without negative entries.
///
/// (I − K)⁻¹ 1 holds the row sums. Any s with 1 + K s ≤ s is at least that (K is monotone); an approximate solution
/// of s = 1 + K s becomes one when divided by 1 minus its largest residual. Far tighter than 1 / (1 − ‖K‖∞), which
/// a single white corner sets for the whole room.
///
/// - `apply`: s to K s.
pub fn gain(sites: usize, apply: impl Fn(&[Rgb]) -> Vec<Rgb>) -> Gain {
    let one_more = |s: &[Rgb]| apply(s).into_iter().map(|k| k + Rgb::WHITE).collect::<Vec<_>>();
    // A residual of a quarter makes the bound at most 4/3 of the truth, after a handful of steps at albedo 0.5.
    let unit = Gain { mean: 1.0, largest: 1.0 };
    let (s, _) = solve(vec![Rgb::splat(2.0); sites], unit, 0.25, 100, one_more);
    let next = one_more(&s);
    let excess = next.iter().zip(&s).map(|(n, s)| (*n - *s).max_channel()).fold(0.0, f32::max);
    let largest = s.iter().map(|s| s.max_channel()).fold(1.0, f32::max);
    if excess >= 1.0 || !largest.is_finite() {
        return Gain::of_norm(1.0);
    }
    let mean = s.iter().map(|s| f64::from(s.max_channel())).sum::<f64>() / s.len().max(1) as f64;
    Gain { mean: (mean as f32).max(1.0) / (1.0 - excess), largest: largest / (1.0 - excess) }
}

fn difference(a: &[Rgb], b: &[Rgb]) -> Vec<Rgb> {
    a.par_iter().zip(b).map(|(&a, &b)| a - b).collect()
}

/// Coefficients that bring Σ γ_k df_k closest to f; none when df is empty or singular.
fn least_squares(df: &[Vec<Rgb>], f: &[Rgb]) -> Vec<f64> {
    let n = df.len();
    // Summed in order, on one thread for each product: the same bits whatever the number of threads.
    let dot = |a: &[Rgb], b: &[Rgb]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| f64::from(a.r * b.r) + f64::from(a.g * b.g) + f64::from(a.b * b.b))
            .sum::<f64>()
    };
    let mut a = vec![vec![0.0; n + 1]; n];
    let pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i..=n).map(move |j| (i, j))).collect();
    let products: Vec<f64> =
        pairs.par_iter().map(|&(i, j)| dot(&df[i], if j < n { &df[j] } else { f })).collect();
    for (&(i, j), &p) in pairs.iter().zip(&products) {
        a[i][j] = p;
        if j < n {
            a[j][i] = p;
        }
    }
    let scale = (0..n).map(|i| a[i][i]).fold(0.0, f64::max);
    for (i, row) in a.iter_mut().enumerate() {
        row[i] += 1e-12 * scale; // differences become parallel near the fixed point
    }
    for i in 0..n {
        let pivot = (i..n).max_by(|&p, &q| a[p][i].abs().total_cmp(&a[q][i].abs())).unwrap_or(i);
        a.swap(i, pivot);
        if a[i][i].abs() < 1e-300 {
            return vec![0.0; n];
        }
        let top = a[i].clone();
        for row in a.iter_mut().skip(i + 1) {
            let m = row[i] / top[i];
            for (x, t) in row.iter_mut().zip(&top).skip(i) {
                *x -= m * t;
            }
        }
    }
    let mut gamma = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| a[i][j] * gamma[j]).sum();
        gamma[i] = (a[i][n] - known) / a[i][i];
    }
    if gamma.iter().all(|g| g.is_finite()) { gamma } else { vec![0.0; n] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of cells that each see two others, with reflectance `rho`, a lamp at the first.
    fn ring(rho: f32, lamp: f32) -> impl Fn(&[Rgb]) -> Vec<Rgb> {
        move |e| {
            let n = e.len();
            (0..n)
                .map(|i| {
                    let d = Rgb::splat(if i == 0 { lamp } else { 0.0 });
                    d + (e[(i + 1) % n] * 0.6 + e[(i + 7) % n] * 0.4) * rho
                })
                .collect()
        }
    }

    #[test]
    fn the_bound_holds_at_every_reflectance() {
        for rho in [0.2, 0.5, 0.8, 0.95, 0.99] {
            let exact = solve(vec![Rgb::BLACK; 50], Gain::of_norm(rho), 1e-7, 20_000, ring(rho, 1.0)).0;
            let gain = gain(50, ring(rho, 0.0));
            // All rows sum to rho here, so the gain is 1 / (1 − rho) and the bound at most 4/3 of it.
            assert!((0.99..1.4).contains(&(gain.largest * (1.0 - rho))), "{rho}: {gain:?}");
            let (e, report) = solve(vec![Rgb::BLACK; 50], gain, 1e-3, 2000, ring(rho, 1.0));
            assert!(report.converged, "{rho}: {report:?}");
            let error =
                e.iter().zip(&exact).map(|(a, b)| (*a - *b).map(f32::abs).max_channel()).fold(0.0, f32::max);
            // The exact one is within 1e-4 here: f32 sums of 100 with 1e-7 relative rounding.
            assert!(
                error <= report.gain.largest * report.residual + 1e-4,
                "{rho}: error {error}, bound {}",
                report.bound
            );
        }
    }

    #[test]
    fn acceleration_beats_plain_iteration_at_high_reflectance() {
        // A room of 60 cells that all see one another unevenly, reflectance 0.99, a lamp at the first.
        let n = 60;
        let weight = |i: usize, j: usize| if i == j { 0.0 } else { 1.0 + ((7 * i * j + i + j) % 13) as f32 };
        let room = |e: &[Rgb]| -> Vec<Rgb> {
            let row = |i: usize| {
                let sum: f32 = (0..n).map(|j| weight(i, j)).sum();
                let lamp = Rgb::splat(if i == 0 { 1.0 } else { 0.0 });
                lamp + (0..n).map(|j| e[j] * (0.99 * weight(i, j) / sum)).sum::<Rgb>()
            };
            (0..n).map(row).collect()
        };
        let (_, report) = solve(vec![Rgb::BLACK; n], Gain::of_norm(0.99), 1e-2, 1000, room);
        // Plain iteration gains a factor of 0.99 a step: ln(1e-4) / ln(0.99) ≈ 900 of them.
        assert!(report.converged && report.iterations < 40, "{report:?}");
    }

    #[test]
    fn a_room_that_absorbs_nothing_never_claims_a_bound() {
        let white = gain(50, ring(1.0, 0.0));
        assert!(white.largest.is_infinite(), "{white:?}");
        let (_, report) = solve(vec![Rgb::BLACK; 50], white, 1e-3, 10, ring(1.0, 1.0));
        assert!(!report.converged && report.bound.is_infinite());
    }
}
