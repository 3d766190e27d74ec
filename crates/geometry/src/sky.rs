//! Light from beyond all triangles: one colour, or an image.

use crate::Rgb;
use crate::math::Vec3;

/// Radiance by direction, cd/m².
#[derive(Clone, Debug)]
pub enum Sky {
    /// The same from everywhere.
    Constant(Rgb),
}

impl Sky {
    /// Radiance that arrives from the unit direction `d`, cd/m².
    pub fn radiance(&self, _d: Vec3) -> Rgb {
        match self {
            Sky::Constant(l) => *l,
        }
    }
}
