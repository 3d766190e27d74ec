//! Vertex values by least squares (Kavan, Bargteil and Sloan, "Least Squares Vertex Baking", EGSR 2011).
//!
//! ```text
//! minimise  Σ_s w_s (Σ_i b_i(s) c_i − f_s)²  +  λ Σ_e A_e (r_e · c)²
//! ```
//!
//! over the vertex values c: samples s of the light f with their areas w, hat functions b, and for each inner edge e the
//! jump r_e of the gradient across it (section 3.2 there), which is zero for all that is linear. The sum of w (b c − f) is
//! then zero: whatever light falls on the mesh is on the fitted one.

use geometry::{Rgb, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// λ: what the jumps count. Enough to hold a vertex that few samples saw, and to take the noise of samples from what is
/// smooth.
const SMOOTHNESS: f64 = 0.02;
/// Conjugate gradients end when the residual has fallen by this factor, or after so many steps.
const TOLERANCE: f64 = 1e-7;
const MOST_STEPS: usize = 500;

/// A triangle whose corners are unknowns.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Index of the value at each corner.
    pub unknowns: [u32; 3],
    /// Where the corners are, m.
    pub corners: [Vec3; 3],
}

impl Facet {
    /// m².
    pub fn area(&self) -> f32 {
        let [a, b, c] = self.corners;
        geometry::triangle::area(a, b, c)
    }
}

/// Light seen at a point of a facet.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Which facet.
    pub facet: u32,
    /// Barycentrics there.
    pub at: [f32; 3],
    /// The light.
    pub value: Rgb,
    /// Area it stands for, m².
    pub weight: f32,
}

/// One row of a quadratic form: `weight` (Σ factor · c)².
struct Row {
    unknowns: [u32; 4],
    factors: [f64; 4],
    weight: f64,
}

/// The values of `unknowns` vertices that fit `observations` best; zero where nothing is known.
pub fn fit(unknowns: usize, facets: &[Facet], observations: &[Observation]) -> Vec<Rgb> {
    let rows = jumps(facets);
    let (mut right, mut around) = (vec![[0.0; 3]; unknowns], vec![0.0; unknowns]);
    let mut seen = vec![[[0.0; 3]; 3]; facets.len()];
    for o in observations {
        let (b, w) = (o.at.map(f64::from), f64::from(o.weight));
        for (j, i) in facets[o.facet as usize].unknowns.into_iter().enumerate() {
            around[i as usize] += w * b[j];
            (0..3).for_each(|k| seen[o.facet as usize][j][k] += w * b[j] * b[k]);
            for (k, v) in o.value.to_array().into_iter().enumerate() {
                right[i as usize][k] += w * b[j] * f64::from(v);
            }
        }
    }
    let matrix = Matrix::new(unknowns, facets, &seen, &rows);
    // From the mean of what was seen around each vertex.
    let start =
        right.iter().zip(&around).map(|(r, &a)| r.map(|r| if a > 0.0 { r / a } else { 0.0 })).collect();
    let values = conjugate_gradients(&matrix, &right, start);
    values.into_iter().map(|v| Rgb::from(v.map(|v| v as f32))).collect()
}

/// The jumps of the gradient across the edges that two facets share.
fn jumps(facets: &[Facet]) -> Vec<Row> {
    let mut open: HashMap<(u32, u32), (u32, usize)> = HashMap::new();
    let mut rows = Vec::new();
    for (f, facet) in facets.iter().enumerate() {
        for e in 0..3 {
            let (i, j) = (facet.unknowns[e], facet.unknowns[(e + 1) % 3]);
            let key = (i.min(j), i.max(j));
            match open.remove(&key) {
                None => {
                    open.insert(key, (f as u32, e));
                }
                Some((g, d)) => rows.extend(jump(&facets[g as usize], d, facet, e)),
            }
        }
    }
    rows
}

/// What the plane through `a`'s values, turned about the common edge into `b`'s plane, says at `b`'s far corner, less the
/// value there. In units of that value's own scale, so that slivers do not outweigh all others.
fn jump(a: &Facet, edge_a: usize, b: &Facet, edge_b: usize) -> Option<Row> {
    let (p, q) = (a.corners[edge_a], a.corners[(edge_a + 1) % 3]);
    let (k, l) = (a.corners[(edge_a + 2) % 3], b.corners[(edge_b + 2) % 3]);
    let along = (q - p).as_dvec3();
    let length2 = along.length_squared();
    let split = |x: Vec3| {
        let d = (x - p).as_dvec3();
        let t = d.dot(along) / length2;
        (t, (d - along * t).length())
    };
    let ((t_k, h_k), (t_l, h_l)) = (split(k), split(l));
    // At the far corner, on the other side of the edge: −h_l/h_k of what corner k has beyond the edge.
    let s = h_l / h_k;
    let factors = [1.0 - t_l + s * (1.0 - t_k), t_l + s * t_k, -s, -1.0];
    let norm2: f64 = factors.iter().map(|f| f * f).sum();
    if !norm2.is_finite() || norm2 <= 0.0 {
        return None;
    }
    let (i, j) = (a.unknowns[edge_a], a.unknowns[(edge_a + 1) % 3]);
    let unknowns = [i, j, a.unknowns[(edge_a + 2) % 3], b.unknowns[(edge_b + 2) % 3]];
    let area = f64::from(a.area() + b.area());
    Some(Row { unknowns, factors, weight: SMOOTHNESS * area / norm2 })
}

/// The normal equations' matrix, row by row.
struct Matrix {
    /// Where each unknown's entries begin, and the end of the last.
    begin: Vec<usize>,
    columns: Vec<u32>,
    entries: Vec<f64>,
    diagonal: Vec<f64>,
}

impl Matrix {
    /// The sum of each facet's `seen` and of the squares of all `rows`.
    fn new(unknowns: usize, facets: &[Facet], seen: &[[[f64; 3]; 3]], rows: &[Row]) -> Matrix {
        // Which of a facet's or row's corners an unknown is.
        let mut meets = vec![Vec::new(); unknowns];
        for (f, facet) in facets.iter().enumerate() {
            facet.unknowns.iter().zip(0u8..).for_each(|(&i, k)| meets[i as usize].push((f as u32, k, true)));
        }
        for (r, row) in rows.iter().enumerate() {
            row.unknowns.iter().zip(0u8..).for_each(|(&i, k)| meets[i as usize].push((r as u32, k, false)));
        }
        let lines: Vec<Vec<(u32, f64)>> = meets
            .into_par_iter()
            .map(|meets| {
                let mut line = Vec::new();
                for (of, k, is_facet) in meets {
                    let (of, k) = (of as usize, k as usize);
                    if is_facet {
                        line.extend(facets[of].unknowns.into_iter().zip(seen[of][k]));
                    } else {
                        let row = &rows[of];
                        let scale = row.weight * row.factors[k];
                        line.extend(row.unknowns.into_iter().zip(row.factors.map(|f| scale * f)));
                    }
                }
                line.sort_by_key(|e| e.0);
                line.dedup_by(|b, a| {
                    let same = a.0 == b.0;
                    a.1 += if same { b.1 } else { 0.0 };
                    same
                });
                line
            })
            .collect();
        let mut matrix =
            Matrix { begin: vec![0], columns: Vec::new(), entries: Vec::new(), diagonal: Vec::new() };
        for (line, i) in lines.into_iter().zip(0u32..) {
            matrix.diagonal.push(line.iter().find(|e| e.0 == i).map_or(0.0, |e| e.1));
            matrix.columns.extend(line.iter().map(|e| e.0));
            matrix.entries.extend(line.iter().map(|e| e.1));
            matrix.begin.push(matrix.columns.len());
        }
        matrix
    }

    /// Its product with `x`.
    fn times(&self, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let line = |i: usize| {
            let at = self.begin[i]..self.begin[i + 1];
            let mut sum = [0.0; 3];
            for (&j, a) in self.columns[at.clone()].iter().zip(&self.entries[at]) {
                (0..3).for_each(|k| sum[k] += a * x[j as usize][k]);
            }
            sum
        };
        (0..x.len()).into_par_iter().with_min_len(CHUNK).map(line).collect()
    }

    /// `r` by the diagonal.
    fn scaled(&self, r: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let by = |(r, &d): (&[f64; 3], &f64)| if d > 0.0 { r.map(|r| r / d) } else { [0.0; 3] };
        r.par_iter().with_min_len(CHUNK).zip(&self.diagonal).map(by).collect()
    }
}

/// Numbers that one thread sums at least.
const CHUNK: usize = 4096;

/// Scalar products of the three channels, by sums of whole chunks in their order: the same for any number of threads.
fn dot(a: &[[f64; 3]], b: &[[f64; 3]]) -> [f64; 3] {
    let add = |sum: [f64; 3], x: [f64; 3]| std::array::from_fn(|k| sum[k] + x[k]);
    let of_chunk = |(a, b): (&[[f64; 3]], &[[f64; 3]])| {
        a.iter().zip(b).fold([0.0; 3], |sum, (a, b)| add(sum, std::array::from_fn(|k| a[k] * b[k])))
    };
    let sums: Vec<[f64; 3]> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(of_chunk).collect();
    sums.into_iter().fold([0.0; 3], add)
}

/// Solves `matrix` · x = `right` for three channels at once, preconditioned by the diagonal.
fn conjugate_gradients(matrix: &Matrix, right: &[[f64; 3]], mut x: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let ratio = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| if b[k] > 0.0 { a[k] / b[k] } else { 0.0 })
    };
    // a + s · b, into a.
    let add = |a: &mut [[f64; 3]], s: [f64; 3], b: &[[f64; 3]]| {
        let one = |(a, b): (&mut [f64; 3], &[f64; 3])| (0..3).for_each(|k| a[k] += s[k] * b[k]);
        a.par_iter_mut().with_min_len(CHUNK).zip(b).for_each(one);
    };
    let mut r = right.to_vec();
    add(&mut r, [-1.0; 3], &matrix.times(&x));
    let mut p = matrix.scaled(&r);
    let mut rz = dot(&r, &p);
    let enough = dot(right, &matrix.scaled(right)).map(|b| b * TOLERANCE * TOLERANCE);
    for _ in 0..MOST_STEPS {
        if (0..3).all(|k| rz[k] <= enough[k]) {
            break;
        }
        let q = matrix.times(&p);
        let alpha = ratio(rz, dot(&p, &q));
        add(&mut x, alpha, &p);
        add(&mut r, alpha.map(|a| -a), &q);
        let mut z = matrix.scaled(&r);
        let next = dot(&r, &z);
        add(&mut z, ratio(next, rz), &p);
        (p, rz) = (z, next);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::sampling::Rng;

    /// A grid of n × n squares over the unit square, bent by `height`.
    fn grid(n: u32, height: impl Fn(f32) -> f32) -> (usize, Vec<Facet>) {
        let at = |i: u32| {
            let (x, y) = ((i % (n + 1)) as f32 / n as f32, (i / (n + 1)) as f32 / n as f32);
            Vec3::new(x, y, height(x))
        };
        let facet = |unknowns: [u32; 3]| Facet { unknowns, corners: unknowns.map(at) };
        let square = |i: u32| {
            let a = i / n * (n + 1) + i % n;
            [facet([a, a + 1, a + n + 2]), facet([a, a + n + 2, a + n + 1])]
        };
        ((n as usize + 1).pow(2), (0..n * n).flat_map(square).collect())
    }

    fn observe(facets: &[Facet], each: u32, f: impl Fn(Vec3) -> f32) -> Vec<Observation> {
        let mut rng = Rng::new(7, 0);
        let mut all = Vec::new();
        for (i, facet) in facets.iter().enumerate() {
            for _ in 0..each {
                let (u, v) = geometry::sampling::triangle(rng.vec2());
                let at = [1.0 - u - v, u, v];
                let p = (0..3).map(|k| facet.corners[k] * at[k]).sum::<Vec3>();
                let weight = facet.area() / each as f32;
                all.push(Observation { facet: i as u32, at, value: Rgb::splat(f(p)), weight });
            }
        }
        all
    }

    fn error(facets: &[Facet], values: &[Rgb], observations: &[Observation]) -> f64 {
        let square = |o: &Observation| {
            let u = facets[o.facet as usize].unknowns;
            let fitted: f32 = (0..3).map(|k| values[u[k] as usize].g * o.at[k]).sum();
            f64::from(o.weight) * f64::from(fitted - o.value.g).powi(2)
        };
        observations.iter().map(square).sum::<f64>().sqrt()
    }

    #[test]
    fn what_is_linear_is_found_exactly() {
        let (n, facets) = grid(5, |_| 0.0);
        let f = |p: Vec3| 3.0 + 2.0 * p.x - p.y;
        let values = fit(n, &facets, &observe(&facets, 2, f));
        for facet in &facets {
            for (u, p) in facet.unknowns.into_iter().zip(facet.corners) {
                assert!((values[u as usize].g - f(p)).abs() < 1e-4, "{p}: {}", values[u as usize].g);
            }
        }
    }

    #[test]
    fn a_jump_is_blind_to_what_is_linear_along_a_bent_surface() {
        // A roof: the way along it is straight where the roof is unfolded.
        let (_, facets) = grid(4, |x| 2.0 * (x - 0.5).abs());
        let value = |p: Vec3| f64::from(p.x) * 5f64.sqrt() + 0.3 * f64::from(p.y);
        let mut at = HashMap::new();
        facets.iter().for_each(|f| (0..3).for_each(|k| _ = at.insert(f.unknowns[k], value(f.corners[k]))));
        let rows = jumps(&facets);
        assert_eq!(rows.len(), 40, "3 n² − 2 n inner edges of n² squares in two");
        for row in &rows {
            let jump: f64 = row.unknowns.iter().zip(row.factors).map(|(i, f)| f * at[i]).sum();
            assert!(jump.abs() < 1e-5, "{jump}");
        }
    }

    #[test]
    fn light_is_kept_and_the_error_falls_as_the_square_of_the_mesh() {
        let f = |p: Vec3| 1.0 + (4.0 * p.x).sin() * (3.0 * p.y).cos();
        let mut last = f64::INFINITY;
        for n in [4, 8, 16] {
            let (unknowns, facets) = grid(n, |_| 0.0);
            let observations = observe(&facets, 12, f);
            let values = fit(unknowns, &facets, &observations);
            let got = error(&facets, &values, &observations);
            assert!(got < last / 3.0, "{n}: {last} → {got}");
            last = got;
            let flux: f64 = observations.iter().map(|o| f64::from(o.weight * o.value.g)).sum();
            let mut kept = 0.0;
            for o in &observations {
                let u = facets[o.facet as usize].unknowns;
                let fitted: f32 = (0..3).map(|k| values[u[k] as usize].g * o.at[k]).sum();
                kept += f64::from(o.weight * fitted);
            }
            assert!((kept / flux - 1.0).abs() < 1e-4, "{kept} of {flux}");
        }
    }

    #[test]
    fn a_vertex_between_its_neighbours_beats_their_own_values() {
        // A step that no edge follows: values read at the vertices are further from it than fitted ones.
        let (n, facets) = grid(6, |_| 0.0);
        let f = |p: Vec3| if p.x < 0.42 { 0.0 } else { 1.0 };
        let observations = observe(&facets, 30, f);
        let fitted = fit(n, &facets, &observations);
        let mut read = vec![Rgb::BLACK; n];
        facets
            .iter()
            .for_each(|t| (0..3).for_each(|k| read[t.unknowns[k] as usize] = Rgb::splat(f(t.corners[k]))));
        let (a, b) = (error(&facets, &fitted, &observations), error(&facets, &read, &observations));
        assert!(a < 0.97 * b, "{a} against {b}");
    }

    #[test]
    fn nothing_seen_is_black() {
        let (n, facets) = grid(2, |_| 0.0);
        assert!(fit(n, &facets, &[]).iter().all(|c| c.is_black()));
    }
}
