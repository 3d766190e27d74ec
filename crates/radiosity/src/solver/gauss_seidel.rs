//! B = M + ρ F B by Gauss and Seidel's iteration, as the first radiosity renderers solved it (Goral et al., 1984).

use super::{Bound, Convergence, Stakes};
use crate::form_factor::matrix::Matrix;
use geometry::Rgb;
use rayon::prelude::*;

/// Solves B = `source` + ρ F B until no value is further than `tolerance` from the solution, on average, or `most` sweeps.
///
/// - `reflectance`: ρ of each patch, [0, 1]; times its row sum it must be below 1 for a bound to exist.
/// - `source`: what leaves each patch besides what F brings, lm/m².
///
/// The bound is that of [`Convergence`]. f64 inside.
pub fn solve(
    matrix: &Matrix,
    reflectance: &[Rgb],
    source: &[Rgb],
    tolerance: f32,
    most: u32,
) -> (Vec<Rgb>, Convergence) {
    let reflect = |x: &[Rgb]| -> Vec<Rgb> {
        matrix.apply(x).into_iter().zip(reflectance).map(|(h, &rho)| rho * h).collect()
    };
    let alike = Stakes::default();
    let (mut report, mut bound) = (Convergence::default(), Bound::new(&alike));
    let mut x: Vec<Vec<f64>> = (0..3).map(|c| source.iter().map(|s| f64::from(s[c])).collect()).collect();
    loop {
        let values = rounded(&x);
        let residual = residual(matrix, reflectance, source, &x);
        report.residual = residual.iter().map(|f| f.max_channel()).fold(0.0, f32::max);
        let last = report.iterations >= most || !report.residual.is_finite();
        report.bound = bound.of(&residual, &values, if last { f32::INFINITY } else { tolerance }, reflect);
        report.converged = report.bound <= tolerance;
        if last || report.converged {
            return (values, report);
        }
        x.par_iter_mut().enumerate().for_each(|(c, x)| sweep(matrix, reflectance, source, x, c));
        report.iterations += 1;
    }
}

/// From values of each channel to colours.
fn rounded(x: &[Vec<f64>]) -> Vec<Rgb> {
    (0..x[0].len()).map(|i| Rgb::from([0, 1, 2].map(|c| x[c][i] as f32))).collect()
}

/// x_i ← (M_i + ρ_i Σ_{j≠i} F_ij x_j) / (1 − ρ_i F_ii), each with the newest of the others.
fn sweep(matrix: &Matrix, reflectance: &[Rgb], source: &[Rgb], x: &mut [f64], c: usize) {
    for i in 0..x.len() {
        let (row, rho) = (matrix.row(i, c), f64::from(reflectance[i][c]));
        let own = f64::from(row[i]);
        let others = dot(row, x) - own * x[i];
        x[i] = (f64::from(source[i][c]) + rho * others) / (1.0 - rho * own).max(1e-6);
    }
}

/// |M + ρ F x − x| of every patch.
fn residual(matrix: &Matrix, reflectance: &[Rgb], source: &[Rgb], x: &[Vec<f64>]) -> Vec<Rgb> {
    let of = |i: usize, c: usize| {
        let next = f64::from(source[i][c]) + f64::from(reflectance[i][c]) * dot(matrix.row(i, c), &x[c]);
        (next - x[c][i]).abs() as f32
    };
    (0..matrix.len()).into_par_iter().map(|i| Rgb::from([0, 1, 2].map(|c| of(i, c)))).collect()
}

/// In eight sums, which the processor can keep apart; the same order on every machine.
fn dot(row: &[f32], x: &[f64]) -> f64 {
    let mut sums = [0f64; 8];
    let (rows, xs) = (row.chunks_exact(8), x.chunks_exact(8));
    let rest: f64 = rows.remainder().iter().zip(xs.remainder()).map(|(&f, x)| f64::from(f) * x).sum();
    for (f, x) in rows.zip(xs) {
        for k in 0..8 {
            sums[k] += f64::from(f[k]) * x[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factor::analytic::polygon_to_polygon;
    use glam::DVec3;

    /// Faces of the unit cube, opposite ones in pairs, each counter-clockwise seen from within.
    pub fn cube() -> Vec<[DVec3; 4]> {
        let mut faces = Vec::new();
        for axis in 0..3 {
            for end in [0.0, 1.0] {
                let corner = |s: f64, t: f64| {
                    let mut p = DVec3::ZERO;
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (end, s, t);
                    p
                };
                let mut face = [corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
                if end == 1.0 {
                    face.reverse();
                }
                faces.push(face);
            }
        }
        faces
    }

    fn six() -> Matrix {
        let faces = cube();
        Matrix::from_fn(&[1.0; 6], |i, j| if i == j { 0.0 } else { polygon_to_polygon(&faces[i], &faces[j]) })
    }

    fn solved(emission: [f32; 6], rho: [f32; 6]) -> (Vec<f32>, Convergence) {
        let (b, report) = solve(&six(), &rho.map(Rgb::splat), &emission.map(Rgb::splat), 1e-9, 5000);
        (b.iter().map(|b| b.g).collect(), report)
    }

    /// What one constant to each face of a cube gives, with F of 0.199825 and 0.200044: by symmetry three unknowns, here
    /// written out as they were computed in double precision.
    #[test]
    fn six_patches_of_a_cube() {
        for (emission, rho, exact) in [
            (
                [1., 0., 0., 0., 0., 0.],
                [0.5; 6],
                [1.09090910, 0.18174583, 0.18183627, 0.18183627, 0.18183627, 0.18183627],
            ),
            (
                [1., 0., 0., 0., 0., 0.],
                [0.9; 6],
                [2.37288137, 1.52531055, 1.52545202, 1.52545202, 1.52545202, 1.52545202],
            ),
            (
                [0., 0., 0., 0., 0., 1.],
                [0.8, 0.8, 0.5, 0.1, 0.8, 0.],
                [0.28996053, 0.28996053, 0.19113707, 0.04122307, 0.28985336, 1.],
            ),
            (
                [1., 0., 0., 0., 0., 0.],
                [0., 0.8, 0.8, 0.8, 0.8, 0.8],
                [1., 0.44437735, 0.44446121, 0.44446121, 0.44446121, 0.44446121],
            ),
        ] {
            let (b, report) = solved(emission, rho);
            for (got, want) in b.iter().zip(exact) {
                assert!((f64::from(*got) - want).abs() < 1e-6 * want, "{b:?} {report:?}");
            }
        }
    }

    /// B = M / (1 − ρ) where everything shines and reflects alike, at any ρ, and the error within the bound.
    #[test]
    fn a_furnace_has_its_closed_form_and_the_bound_holds() {
        for rho in [0.0, 0.1, 0.5, 0.9, 0.99f32] {
            let (b, _) = solved([1.0; 6], [rho; 6]);
            let exact = 1.0 / (1.0 - rho);
            // The rows sum to 1 within 1e-7 of f32, which 1 / (1 − ρ) magnifies.
            assert!(b.iter().all(|b| (b / exact - 1.0).abs() < 2e-7 / (1.0 - rho)), "{rho}: {b:?}");
            let (rough, report) = solve(&six(), &[Rgb::splat(rho); 6], &[Rgb::WHITE; 6], 0.05 * exact, 500);
            let error = rough.iter().map(|b| (b.g - exact).abs()).sum::<f32>() / 6.0;
            assert!(report.converged && error <= report.bound + 1e-4, "{rho}: {error} {report:?}");
        }
    }

    /// Half the sweeps of Jacobi's iteration, which at ρ = 0.99 needs 1400 for 1e-6: each brings a factor of ρ only.
    #[test]
    fn jacobi_crawls_where_it_walks() {
        let (matrix, rho) = (six(), Rgb::splat(0.99));
        let mut source = [Rgb::BLACK; 6];
        source[0] = Rgb::WHITE;
        let exact = solve(&matrix, &[rho; 6], &source, 1e-9, 5000).0;
        let far = |b: &[Rgb]| b.iter().zip(&exact).map(|(b, e)| (b.g / e.g - 1.0).abs()).fold(0.0, f32::max);
        let mut jacobi = source.to_vec();
        let mut steps = 0;
        while far(&jacobi) > 1e-3 {
            jacobi = matrix.apply(&jacobi).iter().zip(&source).map(|(&h, &m)| m + rho * h).collect();
            steps += 1;
        }
        let mut x: Vec<f64> = source.iter().map(|s| f64::from(s.g)).collect();
        let mut sweeps = 0;
        while far(&x.iter().map(|&x| Rgb::splat(x as f32)).collect::<Vec<_>>()) > 1e-3 {
            sweep(&matrix, &[rho; 6], &source, &mut x, 1);
            sweeps += 1;
        }
        println!("to 0.1 % at reflectance 0.99: Jacobi {steps} steps, Gauss-Seidel {sweeps}");
        // ln(1e-3) / ln(0.99) = 687.
        assert!((600..800).contains(&steps) && sweeps < steps * 6 / 10, "{steps} {sweeps}");
    }
}
