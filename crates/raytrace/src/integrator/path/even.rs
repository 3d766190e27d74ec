//! Numbers that fill the space of the paths of one pixel evenly.
//!
//! Points of Owen-scrambled Sobol' sequences, four dimensions at a time, each four shuffled by themselves (B. Burley,
//! "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020): every path alone is as random as one of independent numbers,
//! so the mean is unbiased, and sets of other seeds are independent, so their spread says how far off it is.

use sobol_burley::sample_4d;

/// The numbers of one path of a set.
#[derive(Clone, Copy, Debug)]
pub struct Even {
    index: u32,
    seed: u32,
}

/// What numbers are for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Choice {
    /// Of the direction that a path goes on in.
    Direction,
    /// Of a point of a lamp.
    Light,
}

impl Even {
    /// Path `index` < 2¹⁶ of set `seed`; the sequence has no more. A set is most even where it holds a power of two of paths.
    pub fn new(index: u32, seed: u32) -> Even {
        Even { index, seed }
    }

    /// Where in its pixel the path starts, in the unit square.
    pub fn place(self) -> [f32; 2] {
        let [x, y, ..] = self.four(0);
        [x, y]
    }

    /// For a choice at the `met`th surface, from 1.
    pub(super) fn numbers(self, met: u32, choice: Choice) -> [f32; 3] {
        let [a, b, c, _] = self.four(2 * met + choice as u32);
        [a, b, c]
    }

    fn four(self, group: u32) -> [f32; 4] {
        sample_4d(self.index, 0, self.seed ^ group.wrapping_mul(0x9e37_79b9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest over all cells of a 4 × 4 grid: points of a set of 64 that lie in it.
    fn fullest(numbers: impl Fn(u32) -> [f32; 2]) -> usize {
        let mut cells = [0; 16];
        for i in 0..64 {
            let [x, y] = numbers(i);
            cells[(4.0 * x) as usize * 4 + (4.0 * y) as usize] += 1;
        }
        cells.into_iter().max().unwrap()
    }

    #[test]
    fn every_choice_of_a_set_fills_the_square_evenly() {
        for seed in 0..100 {
            assert_eq!(fullest(|i| Even::new(i, seed).place()), 4);
            for met in 1..6 {
                for choice in [Choice::Direction, Choice::Light] {
                    let first = |i| {
                        let [a, b, _] = Even::new(i, seed).numbers(met, choice);
                        [a, b]
                    };
                    assert_eq!(fullest(first), 4, "{seed} {met} {choice:?}");
                }
            }
        }
    }

    #[test]
    fn choices_and_sets_have_nothing_to_do_with_one_another() {
        // The mean product of two that are independent and of mean ½ is ¼, with σ = √(7/144/64) = 0.028 in a set of 64, and 6e-4
        // over 2000 sets; one false alarm in a million at 4.9 σ.
        let product = |one: &dyn Fn(u32, u32) -> f32, other: &dyn Fn(u32, u32) -> f32| {
            let sum = |seed| (0..64).map(|i| f64::from(one(i, seed) * other(i, seed))).sum::<f64>();
            (0..2000).map(sum).sum::<f64>() / (64.0 * 2000.0)
        };
        let place = |i, seed| Even::new(i, seed).place()[0];
        let direction = |i, seed| Even::new(i, seed).numbers(1, Choice::Direction)[0];
        let light = |i, seed| Even::new(i, seed).numbers(1, Choice::Light)[0];
        let next = |i, seed| Even::new(i, seed).numbers(2, Choice::Direction)[0];
        let another = |i, seed| Even::new(i, seed + 7919).numbers(1, Choice::Direction)[0];
        let others: [&dyn Fn(u32, u32) -> f32; 4] = [&place, &light, &next, &another];
        for other in others {
            let p = product(&direction, other);
            assert!((p - 0.25).abs() < 4.9 * 6e-4, "{p}");
        }
    }
}
