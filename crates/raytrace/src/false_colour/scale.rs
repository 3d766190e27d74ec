//! Which value has which colour, and which numbers stand beside the bar.

use super::palette::{VIRIDIS, colour};

/// Steps of the scale about.
const STEPS: f64 = 7.0;
/// Decades of a logarithmic scale unless something else is asked.
const DECADES: i32 = 3;

/// A scale from its lowest colour to its highest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Scale {
    /// From 0 to `high` > 0.
    pub fn linear(high: f64) -> Scale {
        Scale { low: 0.0, high: sound(high), logarithmic: false }
    }

    /// Three decades up to `high` > 0.
    pub fn logarithmic(high: f64) -> Scale {
        Scale { low: sound(high) * 10f64.powi(-DECADES), high: sound(high), logarithmic: true }
    }

    /// The value of the highest colour.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Where `value` stands between the ends, [0, 1]; beyond them the nearer one.
    pub fn at(&self, value: f64) -> f64 {
        let at = match self.logarithmic {
            false => value / self.high,
            true => (value.max(self.low) / self.low).ln() / (self.high / self.low).ln(),
        };
        at.clamp(0.0, 1.0)
    }

    /// The colour of `value`, sRGB.
    pub fn colour(&self, value: f64) -> [u8; 3] {
        colour(&VIRIDIS, self.at(value) as f32)
    }

    /// Round values along the scale, ends included where they are round.
    pub fn ticks(&self) -> Vec<f64> {
        if !self.logarithmic {
            let step = round_up(self.high / STEPS);
            let last = (self.high / step + 1e-9).floor() as u32;
            return (0..=last).map(|i| f64::from(i) * step).collect();
        }
        let first = self.low.log10().floor() as i32;
        let decades = (first..=first + DECADES + 1).flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
        decades.filter(|v| *v >= self.low * (1.0 - 1e-9) && *v <= self.high * (1.0 + 1e-9)).collect()
    }
}

/// A finite value above 0, whatever was found.
fn sound(high: f64) -> f64 {
    if high.is_finite() && high > 1e-12 { high } else { 1.0 }
}

/// The next round number: 1, 2, 2.5 or 5 times a power of ten, ≥ `v` > 0.
pub(super) fn round_up(v: f64) -> f64 {
    let power = 10f64.powf(v.log10().floor());
    let mantissa = v / power * (1.0 - 1e-9);
    [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|m| *m >= mantissa).unwrap_or(10.0) * power
}

/// The end of a scale that has `most` on it: the next multiple of a step of its own.
pub(super) fn end_above(most: f64) -> f64 {
    let step = round_up(sound(most) / STEPS);
    (sound(most) / step * (1.0 - 1e-9)).ceil() * step
}

/// Four digits at most, without a tail of zeros.
pub fn number(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let digits = (3 - v.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{v:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_on_the_scale() {
        assert_eq!(Scale::linear(600.0).ticks(), [0.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0]);
        assert_eq!(Scale::logarithmic(1000.0).ticks().len(), 10);
        for high in [0.037, 1.0, 3.3, 742.0, 5e4] {
            let (end, n) = (end_above(high), Scale::linear(end_above(high)).ticks().len());
            assert!(end >= high && end < 1.5 * high && (4..=9).contains(&n), "{high}: {end}, {n} ticks");
        }
        for odd in [0.0, f64::NAN, f64::INFINITY, -3.0] {
            assert!(Scale::linear(odd).ticks().len() < 20 && Scale::logarithmic(odd).at(0.5).is_finite());
        }
    }

    #[test]
    fn colours_go_from_end_to_end() {
        let scale = Scale::logarithmic(1000.0);
        assert!((scale.at(1.0), scale.at(0.0), scale.at(2000.0)) == (0.0, 0.0, 1.0));
        assert!((scale.at(10.0) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(Scale::linear(500.0).at(250.0), 0.5);
    }

    #[test]
    fn numbers_are_short() {
        let cases = [(0.0, "0"), (500.0, "500"), (2.5, "2.5"), (0.05, "0.05"), (12345.6, "12346")];
        assert!(cases.iter().all(|(v, text)| number(*v) == *text));
    }
}
