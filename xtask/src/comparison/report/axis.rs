//! An axis whose ticks are 1, 2 or 5 times a power of ten, and whose ends are ticks.

use super::words::short;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// Ticks per decade, densest first; then only every second, third … decade.
const MANTISSAS: [&[f64]; 4] = [&[1.0, 1.5, 2.0, 3.0, 5.0, 7.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
/// Decades beyond which a number in the data is damage, not measurement.
const DECADES: Range<i32> = -12..13;

/// One axis: from where to where, and where it is labelled.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What it counts, with its unit: `seconds, whole process`.
    pub title: String,
    /// Whether equal steps are equal factors.
    pub logarithmic: bool,
    /// What stands behind each tick's number, such as ` %`.
    pub unit: &'static str,
    ticks: Vec<f64>,
    from: f64,
    to: f64,
}

impl Axis {
    /// An axis that holds all of `values` that it can show, with at most about `most` ticks. Linear ones start at 0.
    pub fn around(
        title: impl Into<String>,
        unit: &'static str,
        logarithmic: bool,
        values: impl Iterator<Item = f64>,
        most: usize,
    ) -> Option<Axis> {
        let shown: Vec<f64> = values.filter(|&v| can_show(logarithmic, v)).collect();
        let low = shown.iter().copied().reduce(f64::min)?;
        let high = shown.iter().copied().reduce(f64::max)?;
        let ticks = match logarithmic {
            true => log_ticks(low, high, most),
            false => linear_ticks(high, most),
        };
        let (from, to) = (ticks[0].min(low), ticks[ticks.len() - 1].max(high));
        Some(Axis { title: title.into(), logarithmic, unit, ticks, from, to })
    }

    /// Whether `value` has a place on it.
    pub fn shows(&self, value: f64) -> bool {
        can_show(self.logarithmic, value)
    }

    /// What is written at a tick.
    pub fn label(&self, tick: f64) -> String {
        // Long numbers would run into one another.
        let (size, unit) = match self.unit {
            " MB" if tick >= 1e3 => (1e3, " GB"),
            "" if tick >= 1e6 => (1e6, " M"),
            "" if tick >= 1e4 => (1e3, " k"),
            unit => (1.0, unit),
        };
        format!("{}{unit}", short(tick / size))
    }
}

/// Zero and below have no logarithm; what is absurdly large or small would squeeze everything else into a line.
fn can_show(logarithmic: bool, value: f64) -> bool {
    let sane = value.is_finite() && value.abs() < 10f64.powi(DECADES.end);
    sane && if logarithmic { value > 10f64.powi(DECADES.start) } else { value >= 0.0 }
}

/// From the last tick at or below `low` to the first at or above `high`, as dense as `most` allows.
fn log_ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let decades = (low.log10().floor() as i32 - 1)..=(high.log10().ceil() as i32 + 1);
    let all = |mantissas: &[f64], every: i32| -> Vec<f64> {
        let chosen = decades.clone().filter(|d| d.rem_euclid(every) == 0);
        let ticks: Vec<f64> = chosen.flat_map(|d| mantissas.iter().map(move |m| m * 10f64.powi(d))).collect();
        // A hair of slack: 10^-2 times 5 is not 0.05 to the last bit.
        let first = ticks.iter().rposition(|t| *t <= low * (1.0 + 1e-9)).unwrap_or(0);
        let last = ticks.iter().position(|t| *t >= high * (1.0 - 1e-9)).unwrap_or(ticks.len() - 1);
        // One value alone gets a tick on either side.
        let (first, last) = if first < last { (first, last) } else { (first.saturating_sub(1), last + 1) };
        ticks[first..=last.min(ticks.len() - 1)].to_vec()
    };
    // 1, 1.5, 2, 3 … is for short ranges only, where 1-2-5 would leave an axis with hardly a tick.
    let sets = &MANTISSAS[usize::from(high / low > 3.0)..];
    let dense = sets.iter().map(|m| all(m, 1)).find(|t| t.len() <= most);
    dense.unwrap_or_else(|| {
        let sparse = (2..=DECADES.end - DECADES.start).map(|every| all(&[1.0], every));
        sparse.into_iter().find(|t| t.len() <= most.max(2)).unwrap_or_else(|| vec![low, high])
    })
}

/// 0, and steps of 1, 2 or 5 times a power of ten up to the first at or above `high`.
fn linear_ticks(high: f64, most: usize) -> Vec<f64> {
    let high = if high > 0.0 { high } else { 1.0 };
    let least = high / most.max(2) as f64;
    let decade = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|s| *s >= least);
    let step = step.unwrap_or(10.0 * decade);
    (0..=(high / step - 1e-9).ceil() as usize).map(|i| i as f64 * step).collect()
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (start, end): (i32, i32)) -> i32 {
        let share = match self.logarithmic {
            true => (value / self.from).ln() / (self.to / self.from).ln(),
            false => (value - self.from) / (self.to - self.from),
        };
        // Float to integer saturates: a value off the axis lands off the picture, not elsewhere in it.
        (f64::from(start) + share * f64::from(end - start)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.from..self.to
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        self.label(*value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(logarithmic: bool, values: &[f64], most: usize) -> Vec<String> {
        let axis = Axis::around("", "", logarithmic, values.iter().copied(), most).unwrap();
        axis.ticks.iter().map(|t| axis.label(*t)).collect()
    }

    #[test]
    fn logarithmic_ticks_are_1_2_5() {
        assert_eq!(labels(true, &[0.6, 9.0], 9), ["0.5", "1", "2", "5", "10"]);
        assert_eq!(labels(true, &[0.04, 900.0], 9), ["0.01", "0.1", "1", "10", "100", "1000"]);
        assert_eq!(labels(true, &[1.0, 1.1], 9), ["1", "1.5"]);
    }

    #[test]
    fn long_numbers_are_told_in_thousands() {
        assert_eq!(labels(true, &[2e3, 9e5], 7), ["1000", "3000", "10 k", "30 k", "100 k", "300 k", "1 M"]);
        let memory = Axis::around("", " MB", true, [500.0, 2000.0].into_iter(), 9).unwrap();
        assert_eq!((memory.label(500.0), memory.label(2000.0)), ("500 MB".into(), "2 GB".into()));
    }

    #[test]
    fn linear_ticks_start_at_zero() {
        assert_eq!(labels(false, &[3.0, 9.0], 6), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels(false, &[0.0], 6), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
    }

    #[test]
    fn any_range_has_a_few_ticks_around_it() {
        let values = [1e-300, 1e-11, 2e-5, 0.999, 1.0, 123.0, 9e11, 1e300];
        for low in values {
            for high in values {
                let Some(axis) = Axis::around("", "", true, [low, high].into_iter(), 7) else { continue };
                assert!((2..=7).contains(&axis.ticks.len()), "{low} {high}: {:?}", axis.ticks);
                assert!(axis.ticks.windows(2).all(|w| w[0] < w[1]));
                let at = |v: f64| axis.map(&v, (0, 1000));
                for v in [low, high].into_iter().filter(|v| axis.shows(*v)) {
                    assert!((0..=1000).contains(&at(v)), "{v} in {low} {high}: {}", at(v));
                }
            }
        }
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Axis::around("", "", true, [bad].into_iter(), 7), None, "{bad}");
        }
    }
}
