//! From a constant on each patch to values at vertices, which can be interpolated.

use crate::element::slot;
use crate::patches::{Patch, Patches};
use geometry::{Rgb, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// How the values at vertices are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// [`corner_rule`], cut back to the range of the patches around each vertex.
    Corner,
    /// [`Fit::Conservative`]'s own: slopes, which keep every patch's light and stay within the range of its neighbours.
    Conservative,
}

/// Values at all slots of the patches' mesh, and which of them have one.
pub fn fit(patches: &Patches, values: &[Rgb], how: Fit) -> (Vec<Rgb>, Vec<bool>) {
    let cells: Vec<[u32; 3]> = patches
        .all
        .iter()
        .map(|p| patches.elements.nodes[p.leaf as usize].vertices.map(|v| slot(v, p.side) as u32))
        .collect();
    let slots = 2 * patches.elements.vertices.len();
    let mut usable = vec![false; slots];
    for (p, cell) in patches.all.iter().zip(&cells) {
        for &s in cell {
            usable[s as usize] |= p.area > 0.0;
        }
    }
    let fitted = match how {
        Fit::Corner => {
            let bounds = Bounds::around(&cells, slots, values);
            let rule = corner_rule(&cells, slots, values);
            rule.iter().enumerate().map(|(s, &v)| bounds.of(s, v)).collect()
        }
        Fit::Conservative => conservative(patches, &cells, slots, values),
    };
    (fitted, usable)
}

/// The lecture's rule: a vertex inside takes the mean of the patches around it; one on the border twice the mean of its
/// patches less the mean of the inner vertices of these, so that the middle between both keeps the patch's value.
///
/// On a square of 2 × 2 patches these are `B(e) = (B₁ + B₂ + B₃ + B₄) / 4`, `B(a) = 2 B₁ − B(e)` and
/// `B(b) = (B(a) + B(c)) / 2` (Cohen and Greenberg, 1985). It extrapolates: patches of 1, 0.1, 0.1, 0.1 give −0.125.
///
/// - `cells`: vertices of each patch, in order around it.
/// - `vertices`: their number; one that no cell has is 0.
pub fn corner_rule<const N: usize>(cells: &[[u32; N]], vertices: usize, values: &[Rgb]) -> Vec<Rgb> {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for cell in cells {
        for k in 0..N {
            let (a, b) = (cell[k], cell[(k + 1) % N]);
            *edges.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let mut border = vec![false; vertices];
    for ((a, b), n) in edges {
        if n == 1 {
            (border[a as usize], border[b as usize]) = (true, true);
        }
    }
    let mut sums = vec![(Rgb::BLACK, 0f32); vertices];
    for (cell, &value) in cells.iter().zip(values) {
        for &v in cell {
            sums[v as usize] = (sums[v as usize].0 + value, sums[v as usize].1 + 1.0);
        }
    }
    let mean: Vec<Rgb> = sums.iter().map(|&(sum, n)| if n > 0.0 { sum / n } else { Rgb::BLACK }).collect();
    let mut inner = vec![(Rgb::BLACK, 0f32); vertices];
    for cell in cells {
        for &v in cell.iter().filter(|&&v| border[v as usize]) {
            for &w in cell.iter().filter(|&&w| !border[w as usize]) {
                inner[v as usize] = (inner[v as usize].0 + mean[w as usize], inner[v as usize].1 + 1.0);
            }
        }
    }
    mean.iter().zip(inner).map(|(&m, (sum, n))| if n > 0.0 { m * 2.0 - sum / n } else { m }).collect()
}

/// Least and greatest value of the patches around each vertex.
struct Bounds(Vec<Option<[Rgb; 2]>>);

impl Bounds {
    fn around(cells: &[[u32; 3]], vertices: usize, values: &[Rgb]) -> Bounds {
        let mut bounds: Vec<Option<[Rgb; 2]>> = vec![None; vertices];
        for (cell, &value) in cells.iter().zip(values) {
            for &v in cell {
                let [lo, hi] = bounds[v as usize].unwrap_or([value; 2]);
                bounds[v as usize] = Some([lo.min(value), hi.max(value)]);
            }
        }
        Bounds(bounds)
    }

    fn of(&self, vertex: usize, value: Rgb) -> Rgb {
        self.0[vertex].map_or(Rgb::BLACK, |[lo, hi]| value.max(lo).min(hi))
    }
}

/// Every patch gets a slope, by least squares from the patches that share a corner with it, as steep as keeps its corners
/// within the range of these (Barth and Jespersen, AIAA 89-0366, 1989); a vertex takes the mean of what the patches
/// around it say, by area.
///
/// Exact where light changes linearly, the border included. Never negative where the patches are not. And conservative:
/// with a third of a patch's area at each corner Σ A E is the same before and after, since the corners of a patch lie
/// evenly around its middle, whatever the slope.
fn conservative(patches: &Patches, cells: &[[u32; 3]], vertices: usize, values: &[Rgb]) -> Vec<Rgb> {
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); vertices];
    for (i, cell) in cells.iter().enumerate() {
        for &v in cell {
            around[v as usize].push(i as u32);
        }
    }
    let centre = |i: u32| {
        let [a, b, c] = patches.corners(i);
        (a + b + c) / 3.0
    };
    let corners_of: Vec<[Rgb; 3]> = (0..cells.len() as u32)
        .into_par_iter()
        .map(|i| {
            let mut near: Vec<u32> =
                cells[i as usize].iter().flat_map(|&v| around[v as usize].iter().copied()).collect();
            near.sort_unstable();
            near.dedup();
            let leaf = patches.elements.corners(patches.all[i as usize].leaf);
            let offsets = leaf.map(|p| p - centre(i));
            let others =
                near.iter().filter(|&&j| j != i).map(|&j| (centre(j) - centre(i), values[j as usize]));
            sloped(patches.normal(i), values[i as usize], offsets, others)
        })
        .collect();
    let mut sums = vec![(Rgb::BLACK, 0f32); vertices];
    for (i, cell) in cells.iter().enumerate() {
        let area = patches.all[i].area;
        for (k, &v) in cell.iter().enumerate() {
            sums[v as usize] = (sums[v as usize].0 + corners_of[i][k] * area, sums[v as usize].1 + area);
        }
    }
    sums.into_iter().map(|(sum, area)| if area > 0.0 { sum / area } else { Rgb::BLACK }).collect()
}

/// Values at the corners of a patch of `value`, `offsets` from its middle, by the slope through `others`: how far they
/// lie from the middle, and their values.
fn sloped(
    normal: Vec3,
    value: Rgb,
    offsets: [Vec3; 3],
    others: impl Iterator<Item = (Vec3, Rgb)>,
) -> [Rgb; 3] {
    let (s, t) = geometry::math::frame(normal);
    let (mut ss, mut st, mut tt) = (0f32, 0f32, 0f32);
    let (mut sv, mut tv) = (Rgb::BLACK, Rgb::BLACK);
    let (mut lo, mut hi) = (value, value);
    for (way, other) in others {
        let (x, y) = (way.dot(s), way.dot(t));
        // Nearer ones count more; what lies in line with the normal says nothing of the slope.
        let w = 1.0 / way.length_squared().max(f32::MIN_POSITIVE);
        (ss, st, tt) = (ss + w * x * x, st + w * x * y, tt + w * y * y);
        let d = other - value;
        (sv, tv) = (sv + d * (w * x), tv + d * (w * y));
        (lo, hi) = (lo.min(other), hi.max(other));
    }
    let det = ss * tt - st * st;
    // Neighbours all in one line, or none: no slope.
    if det <= 1e-4 * ss.max(tt) * ss.max(tt) || !det.is_finite() {
        return [value; 3];
    }
    let (gs, gt) = ((sv * tt - tv * st) / det, (tv * ss - sv * st) / det);
    let steps = offsets.map(|o| gs * o.dot(s) + gt * o.dot(t));
    let channel = |c: usize| {
        let allowed = |step: f32| match step {
            d if d > 0.0 => ((hi[c] - value[c]) / d).min(1.0),
            d if d < 0.0 => ((lo[c] - value[c]) / d).min(1.0),
            _ => 1.0,
        };
        steps.iter().map(|step| allowed(step[c])).fold(1.0, f32::min)
    };
    let limit = Rgb::from([channel(0), channel(1), channel(2)]);
    steps.map(|step| value + step * limit)
}

/// Σ A E over vertices, a third of each patch's area at each of its corners, lm.
pub fn vertex_flux(patches: &Patches, slots: &[Rgb]) -> Rgb {
    let of = |p: &Patch| {
        let corners = patches.elements.nodes[p.leaf as usize].vertices;
        corners.iter().map(|&v| slots[slot(v, p.side)]).sum::<Rgb>() * (p.area / 3.0)
    };
    patches.all.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertices a b c / d e f / g h i and the four squares between them.
    const SQUARES: [[u32; 4]; 4] = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]];

    fn lecture(b: [f32; 4]) -> Vec<f32> {
        corner_rule(&SQUARES, 9, &b.map(Rgb::splat)).iter().map(|v| v.g).collect()
    }

    #[test]
    fn the_lectures_rule_is_the_lectures() {
        let b = [1.0, 2.0, 4.0, 8.0];
        let e = 15.0 / 4.0;
        let (a, c, g, i) = (2.0 - e, 4.0 - e, 8.0 - e, 16.0 - e);
        let want = [a, (a + c) / 2.0, c, (a + g) / 2.0, e, (c + i) / 2.0, g, (g + i) / 2.0, i];
        for (got, want) in lecture(b).iter().zip(want) {
            assert!((got - want).abs() < 1e-6, "{got} {want}");
        }
    }

    /// Light that is less than none, in three of four corners; and the light of the first patch is not kept.
    #[test]
    fn the_lectures_rule_goes_below_zero() {
        let v = lecture([1.0, 0.1, 0.1, 0.1]);
        let corners = [v[0], v[2], v[6], v[8]];
        for (got, want) in corners.iter().zip([1.675, -0.125, -0.125, -0.125]) {
            assert!((got - want).abs() < 1e-6, "{corners:?}");
        }
        // Half way from corner to middle of the square the first patch keeps its value, and that is all it keeps.
        let (diagonal, mean) = (0.5 * (v[0] + v[4]), (v[0] + v[1] + v[3] + v[4]) / 4.0);
        assert!((diagonal - 1.0).abs() < 1e-6 && (mean - 0.8875).abs() < 1e-6, "{v:?}");
    }

    #[test]
    fn a_slope_is_found_and_held_back() {
        let offsets = [Vec3::new(-0.5, -0.3, 0.0), Vec3::new(0.5, -0.3, 0.0), Vec3::new(0.0, 0.6, 0.0)];
        let at = |p: Vec3| Rgb::splat(3.0 + p.x - 2.0 * p.y);
        let around = [[1.0, 0.0], [-1.0, 0.5], [0.0, 1.0], [0.3, -1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let found = sloped(Vec3::Z, at(Vec3::ZERO), offsets, around.iter().map(|&p| (p, at(p))));
        for (o, v) in offsets.iter().zip(found) {
            assert!((v.g - at(*o).g).abs() < 1e-5, "{o}: {v:?}");
        }
        // Beside one bright patch among dark ones nothing is darker than they.
        let dark = around.iter().map(|&p| (p, Rgb::splat(if p.x > 0.5 { 1.0 } else { 0.1 })));
        let found = sloped(Vec3::Z, Rgb::splat(0.1), offsets, dark);
        assert!(found.iter().all(|v| (0.1..=1.0).contains(&v.g)), "{found:?}");
        let sum: f32 = found.iter().map(|v| v.g).sum();
        assert!((sum - 0.3).abs() < 1e-6, "a patch's mean is kept: {found:?}");
    }
}
