//! How many rays were cast: what a speed is measured by when time is not comparable.

use std::sync::atomic::{AtomicU64, Ordering};

/// A counter for all threads. Each adds to a place of its own, a cache line apart from the others, so that counting
/// costs a ray about a nanosecond and threads do not wait for one another.
#[derive(Debug)]
pub struct Count {
    places: [Place; PLACES],
}

const PLACES: usize = 32;

#[derive(Debug, Default)]
#[repr(align(64))]
struct Place(AtomicU64);

impl Default for Count {
    fn default() -> Count {
        Count { places: std::array::from_fn(|_| Place::default()) }
    }
}

impl Count {
    /// One more.
    #[inline]
    pub fn add_one(&self) {
        // Threads outside the pool, or beyond the number of places, share; that is slower and no less exact.
        let place = rayon::current_thread_index().unwrap_or(0) % PLACES;
        self.places[place].0.fetch_add(1, Ordering::Relaxed);
    }

    /// All that were counted; exact once the threads that count have been joined.
    pub fn total(&self) -> u64 {
        self.places.iter().map(|place| place.0.load(Ordering::Relaxed)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn every_thread_is_counted() {
        let count = Count::default();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(PLACES + 3).build().unwrap();
        pool.install(|| (0..10_000).into_par_iter().for_each(|_| count.add_one()));
        count.add_one();
        assert_eq!(count.total(), 10_001);
    }
}
