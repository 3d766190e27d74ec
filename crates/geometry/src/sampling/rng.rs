//! Streams of random numbers: the same on every machine, one for each (seed, index).

use crate::math::Vec2;

/// A stream of independent uniform numbers.
///
/// PCG-XSH-RR 64/32 (M. O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms",
/// HMC-CS-2014-0905), its state and stream number hashed from (seed, index), so that neighbouring pixels or
/// vertices share nothing that one could see.
#[derive(Clone, Debug)]
pub struct Rng {
    state: u64,
    increment: u64,
}

/// The finaliser of splitmix64 (G. Steele et al., OOPSLA 2014): every input bit reaches every output bit.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Rng {
    /// The stream of `index` (a pixel, a vertex, a photon) under `seed`.
    pub fn new(seed: u64, index: u64) -> Rng {
        let state = mix(mix(seed) ^ index);
        Rng { state, increment: mix(state ^ seed) | 1 }
    }

    /// 32 random bits.
    pub fn u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴.
    pub fn f32(&mut self) -> f32 {
        (self.u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in the unit square.
    pub fn vec2(&mut self) -> Vec2 {
        Vec2::new(self.f32(), self.f32())
    }

    /// `N` numbers, uniform in [0, 1).
    pub fn array<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| self.f32())
    }

    /// Uniform in 0..n, for n > 0 (Lemire's multiplication; its bias of n/2³² is left in).
    pub fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.u32()) * u64::from(n)) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_never_changes() {
        // Written down once: another value means that no image can be reproduced any more.
        let mut rng = Rng::new(7, 11);
        assert_eq!([rng.u32(), rng.u32(), rng.u32()], STREAM_7_11);
    }
    const STREAM_7_11: [u32; 3] = [651_002_549, 4_211_512_709, 2_954_859_377];

    #[test]
    fn moments_within_a_stream_and_across_streams() {
        // n = 10⁵ each. Mean: σ = 1/√(12 n) = 9.1e-4; one false alarm in a million at 4.9 σ = 4.5e-3.
        let n = 100_000;
        let mut rng = Rng::new(0, 0);
        let along: f64 = (0..n).map(|_| f64::from(rng.f32())).sum::<f64>() / f64::from(n);
        let across: f64 = (0..n).map(|i| f64::from(Rng::new(0, i as u64).f32())).sum::<f64>() / f64::from(n);
        assert!((along - 0.5).abs() < 4.5e-3 && (across - 0.5).abs() < 4.5e-3, "{along} {across}");
        // Neighbouring streams: the correlation of first values has σ = 1/√n = 3.2e-3.
        let first: Vec<f64> = (0..n).map(|i| f64::from(Rng::new(3, i as u64).f32()) - 0.5).collect();
        let r = first.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / f64::from(n) * 12.0;
        assert!(r.abs() < 1.6e-2, "{r}");
    }
}
