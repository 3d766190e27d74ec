//! What a comparison finds, as `results.json` holds it: the runner writes it, the report and the baseline read it.
//!
//! Errors, bias and noise are fractions (0.02 is 2 %), times are wall-clock seconds, memory is in 10⁶ bytes.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Everything one call measured.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Results {
    /// Commit that was measured, `+` behind it if the tree had changes.
    pub commit: String,
    /// Day of the measurement, as 2026-01-31.
    pub date: String,
    /// Where it was measured.
    pub machine: Machine,
    /// Threads that every renderer was given.
    pub threads: u32,
    /// Version of each renderer that took part, by name.
    pub versions: BTreeMap<String, String>,
    /// A scene each, seen by one camera.
    pub scenes: Vec<Scene>,
    /// How cost grows with one thing at a time; empty unless asked for.
    pub scaling: Vec<Sweep>,
    /// Rays per second of one thread in `bench rays`, by scene and kind of ray, where they were measured.
    pub rays: Vec<RaySpeed>,
}

/// The machine, in words that identify nobody.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Machine {
    /// The processor's name for itself.
    pub processor: String,
    /// Processors that threads may run on.
    pub cores: u32,
    /// Main memory, 10⁹ bytes.
    pub memory_gb: f64,
    /// Operating system and its architecture.
    pub system: String,
}

/// All methods on one scene.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Scene {
    /// Short, unique among the scenes of one comparison: a file's stem.
    pub name: String,
    /// The glTF file, from the repository's root where it lies within.
    pub file: PathBuf,
    /// Camera of the file.
    pub camera: String,
    /// Columns of every picture.
    pub width: u32,
    /// Rows of every picture.
    pub height: u32,
    /// Triangles of the scene.
    pub triangles: u64,
    /// What the pictures are held against.
    pub reference: Reference,
    /// A method each.
    pub curves: Vec<Curve>,
}

/// A picture that is taken for the truth.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Reference {
    /// Its path without `.a.exr` and `.b.exr`, from the repository's root where it lies within.
    pub path: PathBuf,
    /// What made it: renderer, version, samples a pixel.
    pub made_by: String,
    /// Its own noise, by the metric of `compare`; its halves remove it from the errors below.
    pub noise: f64,
}

/// One method over a ladder of settings.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Curve {
    /// Unique key: `split`, `path`, `mitsuba`, `cycles-oidn`.
    pub method: String,
    /// What a reader calls it: `twolight split`, `Mitsuba path + OIDN`.
    pub label: String,
    /// Whether it is a method of twolight.
    pub ours: bool,
    /// False when it was found to render another picture (brightness, shift): its error is then no measure of it.
    pub comparable: bool,
    /// What it models differently, and anything else that a reader of its errors must know.
    pub notes: Vec<String>,
    /// Cheapest first.
    pub points: Vec<Point>,
}

/// One picture.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Point {
    /// What was asked: `--error 2%`, `64 spp`.
    pub setting: String,
    /// Whole process, from its start to its end.
    pub seconds: f64,
    /// Seconds by stage, where the renderer tells: `load`, `build`, `prepass`, `image`, `denoise`.
    pub stages: BTreeMap<String, f64>,
    /// Peak resident memory of the process.
    pub peak_mb: f64,
    /// Rays cast, where the renderer counts them.
    pub rays: Option<u64>,
    /// Error by the metric of `compare`.
    pub error: f64,
    /// Standard error of that, over pixels.
    pub error_se: Option<f64>,
    /// Too bright (+) or too dark (−) on the whole.
    pub bias: f64,
    /// 99 % of pixels have a smaller error.
    pub p99: f64,
    /// Mean HDR-FLIP, 0 to 1.
    pub flip: f64,
    /// The EXR, from the folder of `results.json`.
    pub picture: Option<PathBuf>,
}

/// Cost as one thing grows.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Sweep {
    /// Short, unique: `triangles`, `albedo`.
    pub name: String,
    /// The title a reader sees: `Cost against triangles, at --error 2%`.
    pub title: String,
    /// What grows, with its unit.
    pub axis: String,
    /// Whether that spans orders of magnitude.
    pub logarithmic: bool,
    /// A line each.
    pub lines: Vec<SweepLine>,
}

/// One line of a sweep.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SweepLine {
    /// What it is of: a scene or a method.
    pub label: String,
    /// In ascending order of `x`.
    pub points: Vec<SweepPoint>,
}

/// One run of a sweep.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SweepPoint {
    /// What the axis counts.
    pub x: f64,
    /// Whole process.
    pub seconds: f64,
    /// Of them, the radiosity prepass.
    pub prepass_seconds: f64,
    /// Peak resident memory.
    pub peak_mb: f64,
    /// Error where a reference was at hand.
    pub error: Option<f64>,
}

/// Speed of one kind of ray.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RaySpeed {
    /// The scene.
    pub scene: String,
    /// `camera`, `diffuse`, `shadow`.
    pub kind: String,
    /// Ours, 10⁶ rays per second on one thread.
    pub ours: f64,
    /// Embree's, where it is installed.
    pub embree: Option<f64>,
}

impl Results {
    /// Reads `results.json`.
    pub fn read(path: &Path) -> Result<Results> {
        let text = std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} is not a comparison", path.display()))
    }

    /// Writes `results.json`, under a temporary name until it is whole.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        raytrace::output::write_atomically(path, text.as_bytes())?;
        Ok(())
    }
}

impl Curve {
    /// Seconds this method needs for `error`, read off between its points on the log-log chart; `None` where it never
    /// got there. Only points on its own lower-left hull count: a slower point with a larger error says nothing.
    pub fn seconds_to(&self, error: f64) -> Option<f64> {
        let mut points: Vec<&Point> = self.points.iter().filter(|p| p.error > 0.0).collect();
        points.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let mut best: Option<&Point> = None;
        for point in points {
            if point.error <= error {
                let Some(before) = best else { return Some(point.seconds) };
                let share = (before.error / error).ln() / (before.error / point.error).ln();
                let log = before.seconds.ln() + share * (point.seconds / before.seconds).ln();
                return Some(log.exp());
            }
            if best.is_none_or(|b| point.error < b.error) {
                best = Some(point);
            }
        }
        None
    }

    /// The smallest error it reached, with the seconds it took.
    pub fn best(&self) -> Option<&Point> {
        self.points.iter().min_by(|a, b| a.error.total_cmp(&b.error))
    }
}
