//! The errors that a state of the renderer had, so that a later one can be told to be worse.
//!
//! A picture's error and bias depend on its seed: the same picture was rendered with [`SEEDS`] seeds, and what one
//! more seed may give is known by their spread. Rendering is reproducible for a seed, so a change of the code that
//! leaves the random numbers alone moves nothing, and one that deals them anew moves numbers as another seed does.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How many seeds a baseline is made of.
pub const SEEDS: u64 = 12;
/// Student's t for [`SEEDS`] − 1 degrees of freedom: a normal number lies above it once in 10 000 draws. A check
/// draws some thirty numbers, so that one change in 300 that only deals random numbers anew raises an alarm.
const T: f64 = 5.453;
/// What another processor's rounding may change of an error: this share of it.
const ROUNDING: f64 = 0.005;
/// The same of a bias, and of an error that is almost 0; as a fraction, or in cd/m² of a black picture.
const LEAST: f64 = 2e-4;

/// `assets/reference/baseline.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// The commit that was measured, `+` behind it if the tree had changes.
    pub commit: String,
    /// A scene and setting each.
    pub entries: Vec<Entry>,
}

/// What one setting gave on one scene. Errors and biases are fractions, or cd/m² where the reference is black.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The scene's name.
    pub scene: String,
    /// The setting, as it is typed.
    pub setting: String,
    /// Over all seeds.
    pub error: Spread,
    /// Over all seeds.
    pub bias: Spread,
}

/// A number that depends on the seed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Over the seeds.
    pub mean: f64,
    /// Standard deviation from seed to seed.
    pub deviation: f64,
}

impl Baseline {
    /// Reads the file.
    pub fn read(path: &Path) -> Result<Baseline> {
        let text = std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} is not a baseline", path.display()))
    }

    /// Writes the file.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        Ok(raytrace::output::write_atomically(path, text.as_bytes())?)
    }

    /// What `setting` gave on `scene`.
    pub fn entry(&self, scene: &str, setting: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.scene == scene && entry.setting == setting)
    }
}

impl Spread {
    /// Of at least two numbers.
    pub fn of(numbers: &[f64]) -> Spread {
        let n = numbers.len() as f64;
        let mean = numbers.iter().sum::<f64>() / n;
        let squares: f64 = numbers.iter().map(|x| (x - mean) * (x - mean)).sum();
        // Seven digits: the rest would only make differences between two files unreadable.
        let short = |x: f64| format!("{x:.6e}").parse().unwrap_or(x);
        Spread { mean: short(mean), deviation: short((squares / (n - 1.0)).sqrt()) }
    }

    /// How far from the mean one more seed may fall.
    fn noise(self) -> f64 {
        T * self.deviation * (1.0 + 1.0 / SEEDS as f64).sqrt()
    }
}

impl Entry {
    /// How far above its mean an error may lie.
    pub fn error_noise(&self) -> f64 {
        self.error.noise() + (ROUNDING * self.error.mean).max(LEAST)
    }

    /// How far from its mean, to either side, a bias may lie.
    pub fn bias_noise(&self) -> f64 {
        self.bias.noise() + LEAST
    }

    /// What is worse than noise explains in a picture of this error and bias: a sentence each. An error that fell is
    /// no complaint; a bias that moved is one in either direction, for a picture that turned darker or brighter was
    /// changed, even if it is nearer the truth, and a new baseline says so.
    pub fn complaints(&self, error: f64, bias: f64) -> Vec<String> {
        let mut complaints = Vec::new();
        let mut complain = |what: &str, now: f64, was: f64, noise: f64| {
            complaints.push(format!(
                "{}, {}: {what} {:.3} % where the baseline has {:.3} %, noise up to {:.3} %",
                self.scene,
                self.setting,
                100.0 * now,
                100.0 * was,
                100.0 * noise
            ));
        };
        // A number that is none compares as neither, and is a complaint.
        let within = |number: f64, limit: f64| number.partial_cmp(&limit).is_some_and(|order| order.is_le());
        if !within(error, self.error.mean + self.error_noise()) {
            complain("error", error, self.error.mean, self.error_noise());
        }
        if !within((bias - self.bias.mean).abs(), self.bias_noise()) {
            complain("bias", bias, self.bias.mean, self.bias_noise());
        }
        complaints
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was measured when this check was written: the Cornell box at 256 × 256, and what the same build gave
    /// after one line of the loader was broken, so that every reflectance came out 1.02 times as high.
    fn cornell_box() -> [(Entry, [f64; 2], [f64; 2]); 2] {
        let entry = |setting: &str, error: [f64; 2], bias: [f64; 2]| {
            let spread = |[mean, deviation]: [f64; 2]| Spread { mean, deviation };
            Entry {
                scene: "cornell-box".into(),
                setting: setting.into(),
                error: spread(error),
                bias: spread(bias),
            }
        };
        [
            (
                entry("--error 5%", [0.04649, 0.00127], [-0.00288, 0.00067]),
                [0.04803, -0.00346],
                [0.06011, 0.01430],
            ),
            (
                entry("--integrator path --spp 16", [0.31098, 0.00244], [0.00016, 0.00198]),
                [0.31362, 0.00027],
                [0.33702, 0.01837],
            ),
        ]
    }

    #[test]
    fn another_seed_is_no_worse() {
        for (entry, sound, _) in cornell_box() {
            assert!(entry.complaints(sound[0], sound[1]).is_empty());
        }
    }

    #[test]
    fn reflectances_two_per_cent_too_high_are_caught() {
        for (entry, _, broken) in cornell_box() {
            let complaints = entry.complaints(broken[0], broken[1]);
            assert_eq!(complaints.len(), 2, "error and bias: {complaints:?}");
            assert!(complaints[1].contains("cornell-box") && complaints[1].contains(&entry.setting));
            // The smallest that would be: a third of it by radiosity, two thirds by paths.
            let found = entry.bias_noise() / (broken[1] - entry.bias.mean);
            assert!(found < 0.7, "{}: {found}", entry.setting);
        }
    }

    #[test]
    fn less_error_is_welcome_and_no_number_is_not() {
        for (entry, sound, _) in cornell_box() {
            assert!(entry.complaints(0.5 * sound[0], sound[1]).is_empty());
            assert_eq!(entry.complaints(sound[0], -0.05).len(), 1, "darker is a change, too");
            assert_eq!(entry.complaints(f64::NAN, f64::NAN).len(), 2);
        }
    }

    #[test]
    fn a_black_room_stays_black() {
        let entry = Entry { scene: "two-rooms".into(), ..Entry::default() };
        assert!(entry.complaints(0.0, 0.0).is_empty());
        assert_eq!(entry.complaints(0.01, 0.001).len(), 2, "a hundredth of a cd/m² leaked");
    }

    #[test]
    fn the_spread_of_numbers_is_their_sample_deviation() {
        let spread = Spread::of(&[1.0, 2.0, 3.0, 4.0]);
        assert!((spread.mean - 2.5).abs() < 1e-9 && (spread.deviation - 1.290994).abs() < 1e-6, "{spread:?}");
    }
}
