//! Many readings in the terms of EN 12464-1: mean, extremes and uniformity.

use super::Reading;

/// What a set of illuminances (or luminances) is like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Readings.
    pub points: usize,
    /// Least of them, lx.
    pub min: f64,
    /// Mean, lx: each stands for the same area.
    pub mean: f64,
    /// Greatest, lx.
    pub max: f64,
    /// Standard error of the mean from the readings' own, lx. Their noise is independent.
    pub mean_error: f64,
    /// Root mean square of the readings' standard errors over their mean; 0 in the dark.
    pub noise: f64,
}

impl Statistics {
    /// Of values and their standard errors; all zero without any.
    pub fn of(readings: impl IntoIterator<Item = (f64, f64)>) -> Statistics {
        let mut s = Statistics { min: f64::INFINITY, ..Statistics::default() };
        let mut square = 0.0;
        for (value, error) in readings {
            s.points += 1;
            s.min = s.min.min(value);
            s.max = s.max.max(value);
            s.mean += value;
            square += error * error;
        }
        if s.points == 0 {
            return Statistics::default();
        }
        let n = s.points as f64;
        s.mean /= n;
        s.mean_error = square.sqrt() / n;
        s.noise = if s.mean > 0.0 { (square / n).sqrt() / s.mean } else { 0.0 };
        s
    }

    /// Of illuminances.
    pub fn of_readings(readings: &[Reading]) -> Statistics {
        Statistics::of(readings.iter().map(|r| (f64::from(r.illuminance()), f64::from(r.standard_error))))
    }

    /// Uniformity U₀, least over mean; 0 in the dark.
    pub fn uniformity(&self) -> f64 {
        if self.mean > 0.0 { self.min / self.mean } else { 0.0 }
    }

    /// Diversity U_d, least over greatest; 0 in the dark.
    pub fn diversity(&self) -> f64 {
        if self.max > 0.0 { self.min / self.max } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_readings() {
        let s = Statistics::of([(100.0, 3.0), (200.0, 4.0), (300.0, 0.0), (400.0, 0.0)]);
        assert_eq!((s.points, s.min, s.mean, s.max), (4, 100.0, 250.0, 400.0));
        assert_eq!((s.uniformity(), s.diversity()), (0.4, 0.25));
        // √(9 + 16)/4, and √(25/4)/250.
        assert_eq!((s.mean_error, s.noise), (1.25, 0.01));
    }

    #[test]
    fn darkness_and_nothing_have_no_uniformity() {
        for s in [Statistics::of([]), Statistics::of([(0.0, 0.0)])] {
            assert_eq!((s.min, s.max, s.uniformity(), s.diversity(), s.noise), (0.0, 0.0, 0.0, 0.0, 0.0));
        }
    }
}
