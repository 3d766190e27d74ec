//! Traversal with AVX2: the eight boxes of a node at once, the four triangles of a block at once.
//!
//! The one place in this crate with `unsafe`. What it rests on:
//!
//! 1. *The instructions exist.* An [`Avx2`] is made only where the processor was asked and has them.
//! 2. *References are in range.* Those of a [`Tree`] are written by `wide::fold` alone and never change: each
//!    is the index of a node in the tree, or `BLOCK` plus the index of a block in it.
//! 3. *The stack suffices.* `wide::fold` bounds the depth of the tree, and [`STACK`] is made from that bound.
//! 4. *Only what was pushed is popped*, so no entry is read before it is written.
//! 5. *Rows are aligned*: nodes to 64 bytes with rows of 32, blocks to 16 with rows of 16.
//!
//! Operation by operation this is `portable`, in the same order and without fused multiply-add, hence bit for
//! bit the same answer. `max(a, b)` and `min(a, b)` return b when either is NaN: b is the interval so far.

#![allow(unsafe_code)]

use super::prepared::Prepared;
use super::wide::{BLOCK, Block, Node, STACK, Tree};
use super::{Hit, Ray};
use std::arch::x86_64::*;
use std::mem::MaybeUninit;

/// A ray, each number in all lanes.
struct Lanes {
    origin: [__m256; 3],
    inverse_near: [__m256; 3],
    inverse_far: [__m256; 3],
    /// Offsets, in bytes from the node, of the rows the ray enters and leaves through.
    entry: [usize; 3],
    exit: [usize; 3],
    t_min: __m256,
    /// Of the triangle test, in the order of the ray's axes.
    corner_origin: [__m128; 3],
    direction: [__m128; 3],
    shear: [__m128; 2],
}

/// References still to be looked at, and where the ray enters them: `t` in the upper half, whose bits sort as
/// the number does since t ≥ 0, the reference in the lower.
struct Stack {
    entries: [MaybeUninit<u64>; STACK],
    top: usize,
}

impl Stack {
    #[inline(always)]
    fn new() -> Stack {
        Stack { entries: [const { MaybeUninit::uninit() }; STACK], top: 0 }
    }

    #[inline(always)]
    fn push(&mut self, entry: u64) {
        debug_assert!(self.top < STACK);
        // SAFETY: 3.
        unsafe { self.entries.get_unchecked_mut(self.top) }.write(entry);
        self.top += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        self.top = self.top.checked_sub(1)?;
        // SAFETY: 4.
        Some(unsafe { self.entries.get_unchecked(self.top).assume_init() })
    }

    /// Puts an entry among those from `first` on, which are sorted, the nearest on top.
    #[inline(always)]
    fn insert(&mut self, first: usize, entry: u64) {
        debug_assert!(self.top < STACK);
        let mut i = self.top;
        // SAFETY: 3 and 4; first < i ≤ top.
        unsafe {
            while i > first {
                let before = self.entries.get_unchecked(i - 1).assume_init();
                if before >= entry {
                    break;
                }
                self.entries.get_unchecked_mut(i).write(before);
                i -= 1;
            }
            self.entries.get_unchecked_mut(i).write(entry);
        }
        self.top += 1;
    }
}

/// Proof that the processor has AVX2 and BMI1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

impl Avx2 {
    /// Asks the processor.
    pub fn detect() -> Option<Avx2> {
        (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1")).then_some(Avx2(()))
    }

    /// The nearest hit.
    pub fn closest_hit(self, tree: &Tree, ray: &Ray) -> Option<Hit> {
        // SAFETY: 1.
        unsafe { closest_hit(tree, ray) }
    }

    /// Whether there is any hit.
    pub fn occluded(self, tree: &Tree, ray: &Ray) -> bool {
        // SAFETY: 1.
        unsafe { occluded(tree, ray) }
    }
}

#[target_feature(enable = "avx2,bmi1")]
fn closest_hit(tree: &Tree, ray: &Ray) -> Option<Hit> {
    let ray = &Prepared::new(ray)?;
    let lanes = Lanes::new(ray);
    let mut best = Hit { t: ray.t_max, triangle: 0, u: 0.0, v: 0.0 };
    let mut found = false;
    let mut far = _mm256_set1_ps(ray.t_max);
    let mut stack = Stack::new();
    let mut reference = 0u32;
    loop {
        // Down to a block, always into the nearest child.
        while reference & BLOCK == 0 {
            // SAFETY: 2.
            let node = unsafe { tree.nodes.get_unchecked(reference as usize) };
            let (near, mut mask) = lanes.enter(node, far);
            if mask == 0 {
                break;
            }
            // Branches on the number of children met beat a sorting network in registers by up to a fifth:
            // the processor guesses them and goes on with a child before its distance is known.
            let near = to_array(near);
            let mut next = || {
                let lane = mask.trailing_zeros() as usize & 7;
                mask &= mask.wrapping_sub(1);
                (mask, (near[lane].to_bits() as u64) << 32 | node.child[lane] as u64)
            };
            let (rest, a) = next();
            if rest == 0 {
                reference = a as u32;
                continue;
            }
            let (rest, b) = next();
            if rest == 0 {
                stack.push(a.max(b));
                reference = a.min(b) as u32;
                continue;
            }
            let first = stack.top;
            stack.push(a.max(b));
            stack.push(a.min(b));
            loop {
                let (rest, c) = next();
                stack.insert(first, c);
                if rest == 0 {
                    break;
                }
            }
            reference = stack.pop().unwrap_or(0) as u32;
        }
        if reference & BLOCK != 0 {
            // SAFETY: 2.
            let block = unsafe { tree.blocks.get_unchecked((reference & !BLOCK) as usize) };
            if lanes.meet(block, ray, &mut best, &mut found) {
                far = _mm256_set1_ps(best.t);
            }
        }
        // Up to the nearest that is not beyond the hit so far.
        loop {
            let Some(entry) = stack.pop() else { return found.then_some(best) };
            if f32::from_bits((entry >> 32) as u32) <= best.t {
                reference = entry as u32;
                break;
            }
        }
    }
}

#[target_feature(enable = "avx2,bmi1")]
fn occluded(tree: &Tree, ray: &Ray) -> bool {
    let Some(ray) = &Prepared::new(ray) else { return false };
    let lanes = Lanes::new(ray);
    let far = _mm256_set1_ps(ray.t_max);
    let mut stack = Stack::new();
    let mut reference = 0u32;
    loop {
        // Into the last child met, in no order: sorting costs more than it saves where any hit will do.
        while reference & BLOCK == 0 {
            // SAFETY: 2.
            let node = unsafe { tree.nodes.get_unchecked(reference as usize) };
            let (_, mut mask) = lanes.enter(node, far);
            if mask == 0 {
                break;
            }
            loop {
                reference = node.child[mask.trailing_zeros() as usize & 7];
                mask &= mask.wrapping_sub(1);
                if mask == 0 {
                    break;
                }
                stack.push(reference as u64);
            }
        }
        if reference & BLOCK != 0 {
            // SAFETY: 2.
            let block = unsafe { tree.blocks.get_unchecked((reference & !BLOCK) as usize) };
            let (mut best, mut found) = (Hit { t: ray.t_max, triangle: 0, u: 0.0, v: 0.0 }, false);
            if lanes.meet(block, ray, &mut best, &mut found) {
                return true;
            }
        }
        let Some(entry) = stack.pop() else { return false };
        reference = entry as u32;
    }
}

impl Lanes {
    #[target_feature(enable = "avx2")]
    #[inline]
    fn new(ray: &Prepared) -> Lanes {
        let row = |side: usize, axis: usize| 96 * side + 32 * axis;
        let all = |x: [f32; 3]| [_mm256_set1_ps(x[0]), _mm256_set1_ps(x[1]), _mm256_set1_ps(x[2])];
        let four = |x: [f32; 3]| [_mm_set1_ps(x[0]), _mm_set1_ps(x[1]), _mm_set1_ps(x[2])];
        Lanes {
            origin: all(ray.origin),
            inverse_near: all(ray.inverse_near),
            inverse_far: all(ray.inverse_far),
            entry: [0, 1, 2].map(|axis| row(ray.enters[axis], axis)),
            exit: [0, 1, 2].map(|axis| row(1 - ray.enters[axis], axis)),
            t_min: _mm256_set1_ps(ray.t_min),
            corner_origin: four(ray.axes.map(|k| ray.origin[k])),
            direction: four(ray.direction),
            shear: [_mm_set1_ps(ray.shear[0]), _mm_set1_ps(ray.shear[1])],
        }
    }

    /// Where the ray enters each child's box, and a bit for each child that it meets before `far`.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn enter(&self, node: &Node, far: __m256) -> (__m256, u32) {
        let base = (node as *const Node).cast::<u8>();
        // SAFETY: 5; the offsets are those of the six rows, all within the node.
        let row = |offset: usize| unsafe { _mm256_load_ps(base.add(offset).cast()) };
        let slab = |offset: usize, axis: usize, inverse: __m256| {
            _mm256_mul_ps(_mm256_sub_ps(row(offset), self.origin[axis]), inverse)
        };
        let (mut near, mut far) = (self.t_min, far);
        for axis in 0..3 {
            near = _mm256_max_ps(slab(self.entry[axis], axis, self.inverse_near[axis]), near);
            far = _mm256_min_ps(slab(self.exit[axis], axis, self.inverse_far[axis]), far);
        }
        (near, _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32)
    }

    /// Meets the ray with the block's triangles: `best` becomes the nearest, and of equals the first by
    /// index. Returns whether it changed.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn meet(&self, block: &Block, ray: &Prepared, best: &mut Hit, found: &mut bool) -> bool {
        // SAFETY: 5; the index of a row is an axis.
        let row = |corner: usize, i: usize| unsafe {
            _mm_load_ps(block.corners[corner].get_unchecked(ray.axes[i]).as_ptr())
        };
        let corner = |corner: usize| {
            let z = _mm_sub_ps(row(corner, 2), self.corner_origin[2]);
            let across = |i: usize| {
                _mm_sub_ps(_mm_sub_ps(row(corner, i), self.corner_origin[i]), _mm_mul_ps(self.shear[i], z))
            };
            (across(0), across(1))
        };
        let ((ax, ay), (bx, by), (cx, cy)) = (corner(0), corner(1), corner(2));
        let area = |px, py, qx, qy| _mm_sub_ps(_mm_mul_ps(px, qy), _mm_mul_ps(py, qx));
        let (u, v, w) = (area(cx, cy, bx, by), area(ax, ay, cx, cy), area(bx, by, ax, ay));

        let zero = _mm_setzero_ps();
        let least = _mm_min_ps(_mm_min_ps(u, v), w);
        let most = _mm_max_ps(_mm_max_ps(u, v), w);
        let inside = _mm_or_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
        if _mm_movemask_ps(inside) == 0 {
            return false;
        }
        let det = _mm_add_ps(_mm_add_ps(u, v), w);
        // As `portable::plane`.
        let edge = |to: usize| {
            let along = |i: usize| _mm_sub_ps(row(to, i), row(0, i));
            [along(0), along(1), along(2)]
        };
        let (e, f) = (edge(1), edge(2));
        let n = [area(e[1], e[2], f[1], f[2]), area(e[2], e[0], f[2], f[0]), area(e[0], e[1], f[0], f[1])];
        let dot = |p: [__m128; 3]| {
            let xy = _mm_add_ps(_mm_mul_ps(n[0], p[0]), _mm_mul_ps(n[1], p[1]));
            _mm_add_ps(xy, _mm_mul_ps(n[2], p[2]))
        };
        let to = |i: usize| _mm_sub_ps(row(0, i), self.corner_origin[i]);
        let t = _mm_div_ps(dot([to(0), to(1), to(2)]), dot(self.direction));
        let within =
            _mm_and_ps(_mm_cmpgt_ps(t, _mm_set1_ps(ray.t_min)), _mm_cmple_ps(t, _mm_set1_ps(best.t)));
        let real = _mm_cmpneq_ps(det, zero);
        let mut mask = _mm_movemask_ps(_mm_and_ps(_mm_and_ps(inside, within), real)) as u32;
        if mask == 0 {
            return false;
        }
        let inverse = _mm_div_ps(_mm_set1_ps(1.0), det);
        let (t, u, v) = (four(t), four(_mm_mul_ps(v, inverse)), four(_mm_mul_ps(w, inverse)));
        let mut changed = false;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 3;
            mask &= mask.wrapping_sub(1);
            let triangle = block.triangle[lane];
            if t[lane] < best.t || (t[lane] == best.t && *found && triangle < best.triangle) {
                *best = Hit { t: t[lane], triangle, u: u[lane], v: v[lane] };
                *found = true;
                changed = true;
            }
        }
        changed
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn to_array(x: __m256) -> [f32; 8] {
    let mut array = [0.0; 8];
    // SAFETY: the array has eight places.
    unsafe { _mm256_storeu_ps(array.as_mut_ptr(), x) };
    array
}

#[target_feature(enable = "avx2")]
#[inline]
fn four(x: __m128) -> [f32; 4] {
    let mut array = [0.0; 4];
    // SAFETY: the array has four places.
    unsafe { _mm_storeu_ps(array.as_mut_ptr(), x) };
    array
}
