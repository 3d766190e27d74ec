//! Where lights are, which way they face and how strong they are: what the light tree knows of each.

use crate::math::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// What one light, or a node full of lights, is bounded by.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightBounds {
    pub lo: Vec3,
    pub hi: Vec3,
    /// Middle of the directions in which the lights face.
    pub axis: Vec3,
    /// How far their facing strays from the axis, radians, [0, π].
    pub spread: f32,
    /// How far from its facing a light still shines, radians, (0, π/2].
    pub reach: f32,
    /// Whether a light shines behind itself too.
    pub two_sided: bool,
    /// Greatest intensity, cd.
    pub intensity: f32,
}

impl LightBounds {
    /// Bounds of both.
    pub fn union(&self, o: &LightBounds) -> LightBounds {
        let (axis, spread) = cone_union((self.axis, self.spread), (o.axis, o.spread));
        LightBounds {
            lo: self.lo.min(o.lo),
            hi: self.hi.max(o.hi),
            axis,
            spread,
            reach: self.reach.max(o.reach),
            two_sided: self.two_sided || o.two_sided,
            intensity: self.intensity + o.intensity,
        }
    }

    /// Surface area times orientation measure times strength: what a node costs (eq. 1 and 2 of the paper).
    pub fn cost(&self) -> f32 {
        let d = self.hi - self.lo;
        let area = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x) + 1e-3 * d.length_squared();
        let (o, w) = (self.spread, (self.spread + self.reach).min(PI));
        let measure = 2.0 * PI * (1.0 - o.cos())
            + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos());
        self.intensity * area * measure
    }
}

/// The smallest cone around two, by the great circle through both axes.
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (a, b) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = a.0.dot(b.0).clamp(-1.0, 1.0).acos();
    if (between + b.1).min(PI) <= a.1 {
        return a;
    }
    let spread = 0.5 * (a.1 + b.1 + between);
    let turn = spread - a.1;
    let sin = between.sin();
    if spread >= PI || sin < 1e-4 {
        // Nearly one axis, or opposite ones: a little or wholly too wide, never too narrow.
        return if a.0.dot(b.0) > 0.0 { (a.0, (a.1.max(b.1) + between).min(PI)) } else { (a.0, PI) };
    }
    let axis = (a.0 * (between - turn).sin() + b.0 * turn.sin()) / sin;
    (axis.normalize_or(a.0), spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_union_of_cones_holds_both() {
        let axes =
            [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::new(1.0, 1e-5, 0.0).normalize(), Vec3::ONE.normalize()];
        for a in axes.map(|x| (x, 0.3)) {
            for b in axes.map(|x| (x, 0.7)) {
                let (axis, spread) = cone_union(a, b);
                for (x, s) in [a, b] {
                    let between = axis.dot(x).clamp(-1.0, 1.0).acos();
                    assert!((between + s).min(PI) <= spread + 1e-3, "{a:?} {b:?}");
                }
            }
        }
    }
}
