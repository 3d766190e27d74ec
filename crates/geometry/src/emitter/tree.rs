//! A tree over lights of finite place, so that choosing one of thousands costs a walk from root to leaf.
//!
//! Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018: each node
//! bounds its lights' places (box), directions (cone) and strength; a walk takes the child that promises more light.

use super::bounds::LightBounds;
use crate::math::Vec3;
use glam::Vec4;

/// Widens every angle, so that rounding puts out no light at grazing angles: sine of 1e-3 rad.
const SLACK: f32 = 1e-3;
/// Marks a child that is a light, by its number, and no node.
const LEAF: u32 = 1 << 31;
/// Keeps the sum of four importances finite.
const MOST: f32 = f32::MAX / 8.0;

/// Up to four children side by side, so that one pass in vectors finds the importance of all: angles by their cosine
/// and sine. (A binary tree took 1.3 µs a draw from 10 000 lights, and 3.1 µs with inverse functions.)
#[derive(Clone, Copy, Debug)]
struct Node {
    /// x, y and z of the middles, and the radii around them, m.
    centre: [Vec4; 3],
    radius: Vec4,
    axis: [Vec4; 3],
    cos_spread: Vec4,
    sin_spread: Vec4,
    cos_reach: Vec4,
    /// −1 where lights shine behind themselves too, else 1.
    back: Vec4,
    /// 0 where there is no child.
    intensity: Vec4,
    /// A node, or a light marked [`LEAF`].
    child: [u32; 4],
    /// Four times its parent, plus its place there.
    slot: u32,
}

/// What a point thinks of four children.
struct Promise {
    /// About the irradiance (lx) that the lights throw at most on it. Zero only where none of them can throw any.
    importance: [f32; 4],
    /// Sine of half the angle they are seen under; 1 from among them.
    seen: [f32; 4],
}

impl Node {
    const EMPTY: Node = Node {
        centre: [Vec4::ZERO; 3],
        radius: Vec4::ZERO,
        axis: [Vec4::ZERO; 3],
        cos_spread: Vec4::ONE,
        sin_spread: Vec4::ZERO,
        cos_reach: Vec4::ZERO,
        back: Vec4::ONE,
        intensity: Vec4::ZERO,
        child: [LEAF; 4],
        slot: 0,
    };

    fn set(&mut self, k: usize, bounds: &LightBounds, child: u32) {
        let centre = 0.5 * (bounds.lo + bounds.hi);
        for axis in 0..3 {
            self.centre[axis][k] = centre[axis];
            self.axis[axis][k] = bounds.axis[axis];
        }
        self.radius[k] = 0.5 * (bounds.hi - bounds.lo).length();
        (self.sin_spread[k], self.cos_spread[k]) = bounds.spread.sin_cos();
        self.cos_reach[k] = bounds.reach.cos();
        self.back[k] = if bounds.two_sided { -1.0 } else { 1.0 };
        self.intensity[k] = bounds.intensity;
        self.child[k] = child;
    }

    /// For `p` with unit normal `n`; no normal when zero.
    #[inline]
    fn promise(&self, p: Vec3, n: Vec3) -> Promise {
        let way: [Vec4; 3] = std::array::from_fn(|axis| self.centre[axis] - p[axis]);
        let d2 = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
        let radius2 = self.radius * self.radius;
        // NaN and ∞ at distance 0, which lies among the lights.
        let inverse = Vec4::ONE / root(d2);
        let seen = (self.radius * inverse + SLACK).min(Vec4::ONE);
        let cos_seen = root(Vec4::ONE - seen * seen);
        let facing = -(way[0] * self.axis[0] + way[1] * self.axis[1] + way[2] * self.axis[2]) * inverse;
        let facing = facing.max(facing * self.back);
        let (cos, sin) = nearer(facing, sine(facing), cos_seen, seen);
        let (emitted, _) = nearer(cos, sin, self.cos_spread, self.sin_spread);
        let above = (way[0] * n.x + way[1] * n.y + way[2] * n.z) * inverse;
        let received = if n == Vec3::ZERO { Vec4::ONE } else { nearer(above, sine(above), cos_seen, seen).0 };
        let reaches = emitted.cmpgt(self.cos_reach) & received.cmpgt(Vec4::ZERO);
        let far = self.intensity * emitted.max(Vec4::splat(1e-3)) * received * inverse * inverse;
        // Among the lights every direction is possible; the radius stands in for the distance.
        let near = self.intensity / radius2.max(Vec4::splat(f32::MIN_POSITIVE));
        let among = d2.cmple(radius2 * (1.0 + 2e-4));
        let importance = Vec4::select(among, near, Vec4::select(reaches, far, Vec4::ZERO));
        Promise {
            importance: importance.min(Vec4::splat(MOST)).to_array(),
            seen: Vec4::select(among, Vec4::ONE, seen).to_array(),
        }
    }
}

/// Square roots; the compiler makes one instruction of them.
#[inline]
fn root(x: Vec4) -> Vec4 {
    Vec4::from_array(x.to_array().map(f32::sqrt))
}

/// Sine of an angle in [0, π] by its cosine.
#[inline]
fn sine(cos: Vec4) -> Vec4 {
    root((Vec4::ONE - cos * cos).max(Vec4::ZERO))
}

/// Cosine and sine of max(a − b, 0).
#[inline]
fn nearer(cos_a: Vec4, sin_a: Vec4, cos_b: Vec4, sin_b: Vec4) -> (Vec4, Vec4) {
    let within = cos_a.cmpge(cos_b);
    let (cos, sin) = (cos_a * cos_b + sin_a * sin_b, (sin_a * cos_b - cos_a * sin_b).max(Vec4::ZERO));
    (Vec4::select(within, Vec4::ONE, cos), Vec4::select(within, Vec4::ZERO, sin))
}

/// One of four by their weights, with its probability and what is left of `u`; `None` when all are zero.
#[inline]
fn pick(weights: [f32; 4], u: f32) -> Option<(usize, f32, f32)> {
    let total: f32 = weights.iter().sum();
    let mut x = u * total;
    let mut chosen = None;
    for (k, &w) in weights.iter().enumerate() {
        if w > 0.0 {
            chosen = Some((k, w / total, (x / w).clamp(0.0, 1.0 - f32::EPSILON)));
            if x < w {
                break;
            }
        }
        x -= w;
    }
    chosen
}

/// A light or a node of the tree, as a point sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    child: u32,
    /// About the irradiance it throws at most, lx.
    pub importance: f32,
    /// How little the importance says of its lights: those are divided first that are strong and seen large.
    doubt: f32,
}

impl Part {
    /// The light, or else the node.
    pub fn light(&self) -> Result<u32, u32> {
        if self.child & LEAF != 0 { Ok(self.child & !LEAF) } else { Err(self.child) }
    }
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// Of each light: four times the node it hangs on, plus its place there.
    slots: Vec<u32>,
}

impl LightTree {
    /// A tree over lights numbered from 0 in the order of `bounds`.
    pub fn build(bounds: &[LightBounds]) -> LightTree {
        let mut tree = LightTree { nodes: Vec::new(), slots: vec![0; bounds.len()] };
        if bounds.is_empty() {
            return tree;
        }
        let mut lights: Vec<u32> = (0..bounds.len() as u32).collect();
        tree.nodes.push(Node::EMPTY);
        let mut todo = vec![(0u32, 0..lights.len())];
        while let Some((node, range)) = todo.pop() {
            // Halved until there are four, the largest first.
            let mut children = vec![range];
            while children.len() < 4 {
                let Some(k) = (0..children.len()).max_by_key(|&k| children[k].len()) else { break };
                let whole = children[k].clone();
                if whole.len() == 1 {
                    break;
                }
                let middle = whole.start + split(bounds, &mut lights[whole.clone()]);
                children[k] = whole.start..middle;
                children.push(middle..whole.end);
            }
            for (k, range) in children.into_iter().enumerate() {
                let all = union_of(bounds, &lights[range.clone()]);
                let slot = 4 * node + k as u32;
                let child = if range.len() == 1 {
                    tree.slots[lights[range.start] as usize] = slot;
                    lights[range.start] | LEAF
                } else {
                    let child = tree.nodes.len() as u32;
                    tree.nodes.push(Node { slot, ..Node::EMPTY });
                    todo.push((child, range));
                    child
                };
                tree.nodes[node as usize].set(k, &all, child);
            }
        }
        tree
    }

    /// A light for the point `p` with unit normal `n` (zero for none), and the probability of that choice.
    /// `None` when no light can reach the point. `u` in [0, 1).
    pub fn choose(&self, p: Vec3, n: Vec3, u: f32) -> Option<(u32, f32)> {
        self.choose_below(0, p, n, u).map(|(light, probability, _)| (light, probability))
    }

    /// As [`LightTree::choose`] among the lights below the node `top`; also what is left of `u`, as even in [0, 1) as
    /// `u` was.
    pub fn choose_below(&self, top: u32, p: Vec3, n: Vec3, mut u: f32) -> Option<(u32, f32, f32)> {
        let mut child = top;
        let mut probability = 1.0;
        while child & LEAF == 0 {
            let node = self.nodes.get(child as usize)?;
            let (k, share, rest) = pick(node.promise(p, n).importance, u)?;
            probability *= share;
            u = rest;
            child = node.child[k];
        }
        (probability > 0.0).then_some((child & !LEAF, probability, u))
    }

    /// The probability with which [`LightTree::choose`] takes `light`.
    pub fn probability(&self, light: u32, p: Vec3, n: Vec3) -> f32 {
        self.probability_below(0, light, p, n)
    }

    /// The probability with which [`LightTree::choose_below`] takes `light`; 0 for one that is not below `top`.
    pub fn probability_below(&self, top: u32, light: u32, p: Vec3, n: Vec3) -> f32 {
        if !self.is_below(top, light) {
            return 0.0;
        }
        let mut slot = self.slots[light as usize];
        let mut probability = 1.0;
        loop {
            let node = slot / 4;
            let weights = self.nodes[node as usize].promise(p, n).importance;
            let total: f32 = weights.iter().sum();
            if total <= 0.0 {
                return 0.0;
            }
            probability *= weights[slot as usize % 4] / total;
            if node == top {
                return probability;
            }
            slot = self.nodes[node as usize].slot;
        }
    }

    /// Whether `light` is among those below the node `top`.
    pub fn is_below(&self, top: u32, light: u32) -> bool {
        let Some(&slot) = self.slots.get(light as usize) else { return false };
        let mut node = slot / 4;
        while node != top && node != 0 {
            node = self.nodes[node as usize].slot / 4;
        }
        node == top
    }

    /// At most `most` lights and nodes, but four at least, that together hold every light that can reach `p`.
    pub fn cut(&self, p: Vec3, n: Vec3, most: usize) -> Vec<Part> {
        // Below this share of the whole, weighed by the angle it is seen under, a node stays together.
        const SMALL: f32 = 0.02;
        let mut cut: Vec<Part> = Vec::with_capacity(most);
        let mut next = (!self.nodes.is_empty()).then_some(0);
        while let Some(node) = next {
            let node = &self.nodes[node as usize];
            let promise = node.promise(p, n);
            for k in (0..4).filter(|&k| promise.importance[k] > 0.0) {
                let (child, importance) = (node.child[k], promise.importance[k]);
                let doubt = if child & LEAF != 0 { 0.0 } else { importance * promise.seen[k] };
                cut.push(Part { child, importance, doubt });
            }
            let total: f32 = cut.iter().map(|part| part.importance).sum();
            let worst = (0..cut.len()).max_by(|&a, &b| cut[a].doubt.total_cmp(&cut[b].doubt));
            next = worst
                .filter(|&k| cut[k].doubt > SMALL * total && cut.len() + 3 <= most)
                .map(|k| cut.swap_remove(k).child);
        }
        cut
    }
}

fn union_of(bounds: &[LightBounds], lights: &[u32]) -> LightBounds {
    let first = bounds[lights[0] as usize];
    lights[1..].iter().fold(first, |all, &l| all.union(&bounds[l as usize]))
}

/// Orders `lights` so that the first k and the rest make good children; returns k in 1..len.
fn split(bounds: &[LightBounds], lights: &mut [u32]) -> usize {
    const BUCKETS: usize = 12;
    let centre = |l: u32| 0.5 * (bounds[l as usize].lo + bounds[l as usize].hi);
    let (lo, hi) = lights
        .iter()
        .map(|&l| centre(l))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), c| (lo.min(c), hi.max(c)));
    let extent = hi - lo;
    let bucket = |l: u32, axis: usize| {
        let x = (centre(l)[axis] - lo[axis]) / extent[axis];
        ((x * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&a| extent[a] > 0.0) {
        let mut of_bucket: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        for &l in lights.iter() {
            let b = &mut of_bucket[bucket(l, axis)];
            *b = Some(b.map_or(bounds[l as usize], |b| b.union(&bounds[l as usize])));
        }
        let join = |part: &[Option<LightBounds>]| part.iter().flatten().copied().reduce(|a, b| a.union(&b));
        for cut in 1..BUCKETS {
            if let (Some(a), Some(b)) = (join(&of_bucket[..cut]), join(&of_bucket[cut..])) {
                // Thin boxes cost more: the paper's K_r keeps splits off the short axes.
                let cost = (a.cost() + b.cost()) * extent.max_element() / extent[axis];
                if best.is_none_or(|(c, ..)| cost < c) {
                    best = Some((cost, axis, cut));
                }
            }
        }
    }
    let Some((_, axis, cut)) = best else { return lights.len() / 2 };
    lights.sort_by_key(|&l| bucket(l, axis) >= cut);
    lights.partition_point(|&l| bucket(l, axis) < cut)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn lights(n: u32) -> Vec<LightBounds> {
        (0..n)
            .map(|i| {
                let x = |k: u32| ((i * 7919 + k * 104_729) % 1000) as f32 / 1000.0;
                let lo = Vec3::new(x(1), x(2), x(3)) * 10.0;
                LightBounds {
                    lo,
                    hi: lo + Vec3::new(x(4), x(5), x(6)) * 0.3,
                    axis: Vec3::new(x(7) - 0.5, x(8) - 0.5, x(9) - 0.51).normalize(),
                    spread: 0.0,
                    reach: FRAC_PI_2,
                    two_sided: i % 3 == 0,
                    intensity: 0.1 + x(10),
                }
            })
            .collect()
    }

    #[test]
    fn probabilities_sum_to_one_and_match_the_choice() {
        let bounds = lights(300);
        let tree = LightTree::build(&bounds);
        for (p, n) in [(Vec3::ZERO, Vec3::ZERO), (Vec3::splat(5.0), Vec3::Y), (Vec3::X * 30.0, Vec3::NEG_X)] {
            let sum: f32 = (0..300).map(|l| tree.probability(l, p, n)).sum();
            assert!((sum - 1.0).abs() < 1e-4 || n != Vec3::ZERO && sum < 1.0, "{p}: {sum}");
            for i in 0..200 {
                if let Some((light, probability)) = tree.choose(p, n, (i as f32 + 0.5) / 200.0) {
                    assert!((tree.probability(light, p, n) / probability - 1.0).abs() < 1e-4);
                }
            }
        }
    }

    /// Whatever part of a light faces the point, and lies above its horizon, has a chance.
    #[test]
    fn no_light_that_contributes_is_put_out() {
        let bounds = lights(200);
        let tree = LightTree::build(&bounds);
        for i in 0..500u32 {
            let x = |k: u32| ((i * 6271 + k * 15_485_863) % 997) as f32 / 997.0;
            let p = Vec3::new(x(1), x(2), x(3)) * 14.0 - 2.0;
            let n = (Vec3::new(x(4), x(5), x(6)) - 0.5).normalize_or(Vec3::Y);
            for (l, b) in bounds.iter().enumerate() {
                let point = b.lo + (b.hi - b.lo) * Vec3::new(x(7), x(8), x(9));
                let way = (point - p).normalize();
                let cos = -way.dot(b.axis);
                if way.dot(n) > 1e-3 && (cos > 1e-3 || b.two_sided && cos < -1e-3) {
                    assert!(tree.probability(l as u32, p, n) > 0.0, "light {l} at {p}");
                }
            }
        }
    }

    #[test]
    fn many_lights_at_one_place_build() {
        let same = vec![lights(1)[0]; 5000];
        let tree = LightTree::build(&same);
        let sum: f32 = (0..5000).map(|l| tree.probability(l, Vec3::splat(20.0), Vec3::ZERO)).sum();
        assert!((sum - 1.0).abs() < 1e-3);
    }
}
