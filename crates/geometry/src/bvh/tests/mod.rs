//! The tree against brute force, and against what is hard for trees.

mod agreement;
mod degenerate;
mod origins;
mod shapes;
mod watertight;

use super::*;

/// A source of numbers for tests (Steele, Lea and Flood, "SplitMix", OOPSLA 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In the cube [−1, 1)³.
    fn cube(&mut self) -> Vec3 {
        2.0 * Vec3::new(self.unit(), self.unit(), self.unit()) - 1.0
    }

    /// A unit vector; every fourth has one zero component, every sixteenth two.
    fn direction(&mut self) -> Vec3 {
        let mut d = self.cube();
        let kind = self.bits();
        if kind & 3 == 0 {
            d[(kind >> 8) as usize % 3] = 0.0;
        }
        if kind & 15 == 0 {
            d[((kind >> 8) + 1) as usize % 3] = -0.0;
        }
        if d == Vec3::ZERO { Vec3::Z } else { d.normalize() }
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}
