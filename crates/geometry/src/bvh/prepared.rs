//! A ray with everything worked out that is the same for all boxes and triangles.

use super::Ray;

/// Relative widening of the slab distances: each carries three roundings of half an ulp (subtract,
/// reciprocal, multiply), and the triangle test's shear as many again.
const WIDEN: f32 = 3.0 * f32::EPSILON;

/// Components of a direction no larger than this count as zero where a reciprocal is needed, and a direction without
/// a larger one is none: in a million metres the ray goes less than a millionth of an atom's width that way.
pub(super) const LEAST: f32 = 1e-24;

/// A ray, ready to be traced.
pub(super) struct Prepared {
    /// Origin.
    pub origin: [f32; 3],
    /// 1 / direction, brought a little nearer to zero; infinite where the direction has a zero.
    pub inverse_near: [f32; 3],
    /// 1 / direction, a little farther from zero.
    pub inverse_far: [f32; 3],
    /// By axis: which of a node's two rows of bounds the ray enters through; it leaves through the other.
    pub enters: [usize; 3],
    /// Axes, the last the one along which the ray runs fastest; the triangle test permutes the corners by
    /// them.
    pub axes: [usize; 3],
    /// The direction, in the order of `axes`.
    pub direction: [f32; 3],
    /// Shear that carries the direction to the last axis, in the order of `axes`.
    pub shear: [f32; 2],
    /// Open interval of t.
    pub t_min: f32,
    /// Its other end.
    pub t_max: f32,
}

impl Prepared {
    /// `None` for a ray that is not finite or has no direction or no length: it meets nothing.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Option<Prepared> {
        let d = ray.direction;
        let z = d.abs().max_position();
        let scale = 1.0 / d[z];
        let sane = ray.origin.is_finite() && d.is_finite() && d[z].abs() > LEAST && ray.t_min < ray.t_max;
        if !sane {
            return None;
        }
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let inverse = d.to_array().map(|x| 1.0 / x);
        Some(Prepared {
            origin: ray.origin.to_array(),
            inverse_near: inverse.map(|i| i * (1.0 - WIDEN)),
            inverse_far: inverse.map(|i| i * (1.0 + WIDEN)),
            // The sign of the reciprocal, so that −0.0 goes with its infinity.
            enters: inverse.map(|i| usize::from(i.is_sign_negative())),
            axes,
            direction: axes.map(|k| d[k]),
            shear: [d[axes[0]] * scale, d[axes[1]] * scale],
            // Never −0.0: the vector kernels sort t by its bits.
            t_min: ray.t_min + 0.0,
            t_max: ray.t_max,
        })
    }
}
