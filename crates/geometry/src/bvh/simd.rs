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
//! AddressSanitizer finds nothing in the tests of this crate, in which rays of every kind go through this file. It needs
//! no nightly toolchain: `RUSTC_BOOTSTRAP=1 RUSTFLAGS=-Zsanitizer=address cargo test -p geometry --target
//! x86_64-unknown-linux-gnu --lib`.
//!
//! Triangles are met as in `portable`, operation by operation and without fused multiply-add, hence with the same
//! bits. Boxes need not be: they are wide enough by either arithmetic to hold what is met in them, and here fused
//! multiply-add makes a camera ray 5 % faster, a shadow ray 9 %. `max(a, b)` and `min(a, b)` return b when either is
//! NaN, which can only widen the interval.
//!
//! What was measured on Zen 3, in rays a second against this file before: preparing the ray in vectors, and of the
//! triangle test's constants only scalars kept, takes 14 ns instead of 30 (with fused multiply-add and what
//! follows: shadow rays +21 to 37 %, others +7 to 19 %);
//! fetching what is pushed, +3 to 6 %; one lane chosen from a block by shuffles, divisions last, nothing lost. What
//! did not help: children in the order of the ray's octant, packed on the stack by a table instead of branches
//! (−5 to −15 %, though +5 % on shadow rays among many small things); blocks of eight triangles (camera −5 %, shadow
//! −8 %, diffuse ±0); more of obvhs's reinsertion (3 % fewer steps for three times the building).

#![allow(unsafe_code)]

use super::prepared::LEAST;
use super::wide::{BLOCK, Block, Node, STACK, Tree, WIDEN};
use super::{Hit, Ray};
use std::arch::x86_64::*;
use std::mem::MaybeUninit;

/// Of a ray, what the boxes are held against; each number in all lanes.
struct Slabs {
    inverse: [__m256; 3],
    /// Origin × inverse, a little more and a little less.
    shift_near: [__m256; 3],
    shift_far: [__m256; 3],
    /// Offsets, in bytes from the node, of the rows the ray enters and leaves through.
    entry: [usize; 3],
    exit: [usize; 3],
    t_min: __m256,
}

/// Of a ray, what triangles are held against, in the order of its axes.
#[repr(C)]
struct Shear {
    origin: [f32; 4],
    direction: [f32; 4],
    /// Last: 0.
    shear: [f32; 4],
    /// Offsets of rows from a corner's first, bytes.
    row: [usize; 3],
    t_min: f32,
}

/// The nearest triangle so far.
struct Best {
    t: f32,
    triangle: u32,
    /// Areas opposite to the second and third corner, and the whole.
    v: f32,
    w: f32,
    det: f32,
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

/// Proof that the processor has AVX2, FMA and BMI1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

impl Avx2 {
    /// Asks the processor.
    pub fn detect() -> Option<Avx2> {
        let all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1");
        all.then_some(Avx2(()))
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

#[target_feature(enable = "avx2,fma,bmi1")]
fn closest_hit(tree: &Tree, ray: &Ray) -> Option<Hit> {
    let (slabs, shear) = prepare::<false>(ray)?;
    let mut best =
        Best { t: f32::from_bits(ray.t_max.to_bits() - 1), triangle: u32::MAX, v: 0.0, w: 0.0, det: 1.0 };
    let mut far = _mm256_set1_ps(best.t);
    let mut stack = Stack::new();
    let mut reference = 0u32;
    loop {
        // Down to a block, always into the nearest child.
        while reference & BLOCK == 0 {
            // SAFETY: 2.
            let node = unsafe { tree.nodes.get_unchecked(reference as usize) };
            let (near, mut mask) = slabs.enter::<false>(node, far);
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
                prefetch(tree, a.max(b) as u32);
                stack.push(a.max(b));
                reference = a.min(b) as u32;
                continue;
            }
            let first = stack.top;
            stack.push(a.max(b));
            stack.push(a.min(b));
            loop {
                let (rest, c) = next();
                prefetch(tree, c as u32);
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
            shear.meet(block, &mut best);
            far = _mm256_set1_ps(best.t);
        }
        // Up to the nearest that is not beyond the hit so far.
        loop {
            let Some(entry) = stack.pop() else {
                if best.triangle == u32::MAX {
                    return None;
                }
                let inverse = 1.0 / best.det;
                return Some(Hit {
                    t: best.t,
                    triangle: best.triangle,
                    u: best.v * inverse,
                    v: best.w * inverse,
                });
            };
            if f32::from_bits((entry >> 32) as u32) <= best.t {
                reference = entry as u32;
                break;
            }
        }
    }
}

#[target_feature(enable = "avx2,fma,bmi1")]
fn occluded(tree: &Tree, ray: &Ray) -> bool {
    let Some((slabs, shear)) = prepare::<true>(ray) else { return false };
    let t_max = f32::from_bits(ray.t_max.to_bits() - 1);
    let far = _mm256_set1_ps(t_max);
    let mut stack = Stack::new();
    let mut reference = 0u32;
    loop {
        // Into the last child met, in no order: sorting costs more than it saves where any hit will do.
        while reference & BLOCK == 0 {
            // SAFETY: 2.
            let node = unsafe { tree.nodes.get_unchecked(reference as usize) };
            let (_, mut mask) = slabs.enter::<true>(node, far);
            if mask == 0 {
                break;
            }
            loop {
                reference = node.child[mask.trailing_zeros() as usize & 7];
                mask &= mask.wrapping_sub(1);
                if mask == 0 {
                    break;
                }
                prefetch(tree, reference);
                stack.push(reference as u64);
            }
        }
        if reference & BLOCK != 0 {
            // SAFETY: 2.
            let block = unsafe { tree.blocks.get_unchecked((reference & !BLOCK) as usize) };
            if shear.is_met(block, t_max) {
                return true;
            }
        }
        let Some(entry) = stack.pop() else { return false };
        reference = entry as u32;
    }
}

/// `None` for a ray that is not finite or has no direction or no length: it meets nothing. As `Prepared::new`.
///
/// `ANY` here and in `enter` makes one instance for each of the two traversals, so that each is inlined; called, they
/// pass the ray through memory, which takes a quarter longer.
#[target_feature(enable = "avx2,fma,bmi1")]
#[inline]
fn prepare<const ANY: bool>(ray: &Ray) -> Option<(Slabs, Shear)> {
    let o = _mm_setr_ps(ray.origin.x, ray.origin.y, ray.origin.z, 0.0);
    let d = _mm_setr_ps(ray.direction.x, ray.direction.y, ray.direction.z, 0.0);
    let zero = _mm_setzero_ps();
    let sign = _mm_set1_ps(-0.0);
    let size = _mm_andnot_ps(sign, d);
    let most = _mm_max_ps(size, _mm_shuffle_ps::<0b11_00_10_01>(size, size));
    let most = _mm_max_ps(most, _mm_shuffle_ps::<0b11_01_00_10>(size, size));
    let finite = _mm_cmpeq_ps(_mm_fmadd_ps(o, zero, _mm_mul_ps(d, zero)), zero);
    let most = _mm_cvtss_f32(most);
    // False for an end that is not a number, too.
    let runs = ray.t_min < ray.t_max;
    if _mm_movemask_ps(finite) != 15 || most <= LEAST || !runs {
        return None;
    }
    let z = (_mm_movemask_ps(_mm_cmpeq_ps(size, _mm_set1_ps(most))) as u32).trailing_zeros() as usize;
    let one = _mm_set1_ps(1.0);
    let inverse = _mm_div_ps(one, _mm_or_ps(_mm_max_ps(size, _mm_set1_ps(LEAST)), _mm_and_ps(sign, d)));
    let shift = _mm_mul_ps(o, inverse);
    let margin = _mm_mul_ps(_mm_andnot_ps(sign, shift), _mm_set1_ps(WIDEN));
    let (i, n, f) = (four(inverse), four(_mm_add_ps(shift, margin)), four(_mm_sub_ps(shift, margin)));
    let all = |x: [f32; 4]| [_mm256_set1_ps(x[0]), _mm256_set1_ps(x[1]), _mm256_set1_ps(x[2])];
    let negative = _mm_movemask_ps(d) as usize;
    let entry = [96 * (negative & 1), 32 + 96 * (negative >> 1 & 1), 64 + 96 * (negative >> 2 & 1)];
    let slabs = Slabs {
        inverse: all(i),
        shift_near: all(n),
        shift_far: all(f),
        entry,
        exit: [96 - entry[0], 160 - entry[1], 224 - entry[2]],
        // Never −0.0: t is sorted by its bits.
        t_min: _mm256_set1_ps(ray.t_min + 0.0),
    };
    let turn = _mm_setr_epi32(TURN[z][0], TURN[z][1], TURN[z][2], 3);
    let along = _mm_permutevar_ps(d, turn);
    let scale = _mm_set1_ps(i[z & 3]);
    let shear = Shear {
        origin: four(_mm_permutevar_ps(o, turn)),
        direction: four(along),
        shear: four(_mm_mul_ps(along, scale)),
        row: TURN[z & 3].map(|k| 16 * k as usize),
        t_min: ray.t_min,
    };
    Some((slabs, shear))
}

/// The axes, the last the one along which the ray runs fastest, by that one.
const TURN: [[i32; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

impl Slabs {
    /// Where the ray enters each child's box, and a bit for each child that it meets before `far`.
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn enter<const ANY: bool>(&self, node: &Node, far: __m256) -> (__m256, u32) {
        let base = (node as *const Node).cast::<u8>();
        // SAFETY: 5; the offsets are those of the six rows, all within the node.
        let row = |offset: usize| unsafe { _mm256_load_ps(base.add(offset).cast()) };
        let near = |k: usize| _mm256_fmsub_ps(row(self.entry[k]), self.inverse[k], self.shift_near[k]);
        let leave = |k: usize| _mm256_fmsub_ps(row(self.exit[k]), self.inverse[k], self.shift_far[k]);
        let near = _mm256_max_ps(_mm256_max_ps(near(0), near(1)), _mm256_max_ps(near(2), self.t_min));
        let far = _mm256_min_ps(_mm256_min_ps(leave(0), leave(1)), _mm256_min_ps(leave(2), far));
        (near, _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32)
    }
}

/// The block's triangles as a ray meets them: t; the areas V, W; their sum with U; which are met in (t_min, far].
struct Met {
    t: __m128,
    v: __m128,
    w: __m128,
    det: __m128,
    met: __m128,
}

impl Shear {
    /// Meets the ray with the block's triangles: `best` becomes the nearest, and of equals the first by index.
    #[target_feature(enable = "avx2,fma,bmi1")]
    #[inline]
    fn meet(&self, block: &Block, best: &mut Best) {
        let Some(m) = self.areas::<false>(block, best.t) else { return };
        if _mm_movemask_ps(m.met) == 0 {
            return;
        }
        let t = _mm_blendv_ps(_mm_set1_ps(f32::INFINITY), m.t, m.met);
        let least = _mm_min_ps(t, _mm_shuffle_ps::<0b10_11_00_01>(t, t));
        let least = _mm_min_ps(least, _mm_shuffle_ps::<0b01_00_11_10>(least, least));
        // The first of several: lanes are in the order of the triangles' indices.
        let lane = (_mm_movemask_ps(_mm_cmpeq_ps(t, least)) as u32).trailing_zeros() as usize & 3;
        let triangle = block.triangle[lane];
        let t = _mm_cvtss_f32(least);
        if t < best.t || triangle < best.triangle {
            let to = _mm_set1_epi32(lane as i32);
            let at = |x: __m128| _mm_cvtss_f32(_mm_permutevar_ps(x, to));
            *best = Best { t, triangle, v: at(m.v), w: at(m.w), det: at(m.det) };
        }
    }

    /// Whether the ray meets any of the block's triangles.
    #[target_feature(enable = "avx2,fma,bmi1")]
    #[inline(never)] // its constants then stay out of the way of rays that meet few blocks: +5 %
    fn is_met(&self, block: &Block, far: f32) -> bool {
        self.areas::<true>(block, far).is_some_and(|m| _mm_movemask_ps(m.met) != 0)
    }

    #[target_feature(enable = "avx2,fma,bmi1")]
    #[inline]
    fn areas<const ANY: bool>(&self, block: &Block, far: f32) -> Option<Met> {
        let base = block.corners.as_ptr().cast::<u8>();
        // SAFETY: 5; a row of a corner.
        let row =
            |corner: usize, i: usize| unsafe { _mm_load_ps(base.add(48 * corner + self.row[i]).cast()) };
        let origin = |i: usize| _mm_set1_ps(self.origin[i]);
        let corner = |corner: usize| {
            let z = _mm_sub_ps(row(corner, 2), origin(2));
            let across = |i: usize| {
                let p = _mm_sub_ps(row(corner, i), origin(i));
                _mm_sub_ps(p, _mm_mul_ps(_mm_set1_ps(self.shear[i]), z))
            };
            (across(0), across(1))
        };
        let ((ax, ay), (bx, by), (cx, cy)) = (corner(0), corner(1), corner(2));
        let area = |px, py, qx, qy| _mm_sub_ps(_mm_mul_ps(px, qy), _mm_mul_ps(py, qx));
        let (u, v, w) = (area(cx, cy, bx, by), area(ax, ay, cx, cy), area(bx, by, ax, ay));
        let zero = _mm_setzero_ps();
        let least = _mm_min_ps(_mm_min_ps(u, v), w);
        let most = _mm_max_ps(_mm_max_ps(u, v), w);
        // Not where all three are zero: there is no area.
        let inside = _mm_xor_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
        if _mm_movemask_ps(inside) == 0 {
            return None;
        }
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
        let to = |i: usize| _mm_sub_ps(row(0, i), origin(i));
        let along = |i: usize| _mm_set1_ps(self.direction[i]);
        let t = _mm_div_ps(dot([to(0), to(1), to(2)]), dot([along(0), along(1), along(2)]));
        let within = _mm_and_ps(_mm_cmpgt_ps(t, _mm_set1_ps(self.t_min)), _mm_cmple_ps(t, _mm_set1_ps(far)));
        let det = _mm_add_ps(_mm_add_ps(u, v), w);
        Some(Met { t, v, w, det, met: _mm_and_ps(inside, within) })
    }
}

/// Fetches what a reference on the stack refers to: half of the time it will be wanted.
#[target_feature(enable = "avx2")]
#[inline]
fn prefetch(tree: &Tree, reference: u32) {
    let at = (reference & !BLOCK) as usize;
    let to = if reference & BLOCK != 0 {
        tree.blocks.as_ptr().wrapping_add(at).cast::<i8>()
    } else {
        tree.nodes.as_ptr().wrapping_add(at).cast::<i8>()
    };
    _mm_prefetch::<_MM_HINT_T0>(to);
    _mm_prefetch::<_MM_HINT_T0>(to.wrapping_add(64));
    _mm_prefetch::<_MM_HINT_T0>(to.wrapping_add(128));
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
