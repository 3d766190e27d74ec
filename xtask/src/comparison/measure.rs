//! One picture: rendered by a whole process, timed, and held against the reference.

use super::method::{Program, Rung, Shot};
use super::process::{self, Ran};
use super::results::Point;
use super::scene::is_black;
use anyhow::{Context, Result};
use raytrace::exr::Image;
use raytrace::metrics::{self, Reference};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// How a run ended.
#[derive(Debug)]
pub enum Outcome {
    /// There is a picture.
    Done(Told),
    /// The renderer is not installed; how to install it.
    Absent(String),
    /// No picture, and why.
    Failed(String),
}

/// What a renderer's process and its report tell.
#[derive(Clone, Debug, Default)]
pub struct Told {
    /// Wall-clock seconds of the whole process.
    pub seconds: f64,
    /// Peak resident memory, 10⁶ bytes.
    pub peak_mb: f64,
    /// Seconds by stage; those of several pictures together.
    pub stages: BTreeMap<String, f64>,
    /// Rays cast, if the renderer counts them.
    pub rays: Option<u64>,
    /// Renderer and version, from peers.
    pub version: Option<String>,
    /// The setting in the renderer's own words, from peers.
    pub setting: Option<String>,
    /// What it models differently, from peers.
    pub notes: Vec<String>,
}

impl Told {
    /// Adds the time of another process, and keeps the greater memory.
    pub fn add(&mut self, other: &Told) {
        self.seconds += other.seconds;
        self.peak_mb = self.peak_mb.max(other.peak_mb);
        self.add_stages(&other.stages);
    }

    fn add_stages(&mut self, stages: &BTreeMap<String, f64>) {
        for (stage, seconds) in stages {
            *self.stages.entry(stage.clone()).or_default() += seconds;
        }
    }
}

/// `twolight render --json`, as much of it as we use.
#[derive(Deserialize)]
struct Ours {
    pictures: Vec<OurPicture>,
}

#[derive(Deserialize)]
struct OurPicture {
    stages: BTreeMap<String, f64>,
    rays: Option<u64>,
}

/// The last line of a peer's script.
#[derive(Deserialize)]
struct Theirs {
    version: String,
    setting: Option<String>,
    #[serde(default)]
    stages: BTreeMap<String, f64>,
    #[serde(default)]
    notes: Vec<String>,
}

/// Exit status of a peer's script whose renderer is not installed.
const NOT_INSTALLED: i32 = 3;
/// Exit status of a peer's script that cannot render this scene.
const BEYOND_IT: i32 = 4;

/// A run shorter than this is done [`TIMES`] times, and the median taken: what the system does beside it weighs more.
pub const SHORT: f64 = 2.0;
/// How often a short run is done in all.
pub const TIMES: usize = 3;

/// Renders one picture; ends the renderer after `limit`.
pub fn render(program: Program, rung: &Rung, shot: Shot, limit: Duration) -> Result<Outcome> {
    if let Program::Peer(name) = program
        && !crate::root().join(format!("xtask/peers/render_{name}.py")).is_file()
    {
        return Ok(Outcome::Absent("xtask/peers has no script for it".into()));
    }
    if shot.out.exists() {
        // Or a renderer that writes nothing would be measured by an older picture.
        std::fs::remove_file(shot.out).with_context(|| format!("removing {}", shot.out.display()))?;
    }
    let ran = match process::run(&program.command(&rung.args, shot), limit) {
        Ok(ran) => ran,
        // No Python where the peers' should be: as good as not installed.
        Err(error) if program != Program::Twolight => return Ok(Outcome::Absent(format!("{error:#}"))),
        Err(error) => return Err(error),
    };
    let why = ran.last_words().to_string();
    Ok(match ran.code {
        _ if ran.late => Outcome::Failed(format!("stopped after {:.0} s", ran.seconds)),
        Some(NOT_INSTALLED) if program != Program::Twolight => Outcome::Absent(why),
        Some(BEYOND_IT) if program != Program::Twolight => Outcome::Failed(why),
        Some(0) => match told(program, &ran) {
            Ok(told) => Outcome::Done(told),
            Err(error) => Outcome::Failed(format!("its report cannot be read: {error:#}")),
        },
        Some(code) => Outcome::Failed(format!("failed with status {code}: {why}")),
        None => match (program, told(program, &ran)) {
            // Some renderers crash while they take leave, their picture and report safely written.
            (Program::Peer(_), Ok(mut told)) if shot.out.is_file() => {
                told.notes.push("It crashed after its picture was written.".into());
                Outcome::Done(told)
            }
            _ => Outcome::Failed(format!("ended by a signal: {why}")),
        },
    })
}

/// Time and memory of a run that went well, and what it printed.
fn told(program: Program, ran: &Ran) -> Result<Told> {
    let mut told = Told { seconds: ran.seconds, peak_mb: ran.peak_mb, ..Told::default() };
    match program {
        Program::Twolight => {
            let report: Ours = serde_json::from_str(&ran.stdout)?;
            for picture in &report.pictures {
                told.add_stages(&picture.stages);
            }
            told.rays = report.pictures.iter().map(|picture| picture.rays).sum();
        }
        Program::Peer(_) => {
            let line = ran
                .stdout
                .lines()
                .rev()
                .find(|line| !line.trim().is_empty())
                .context("it printed nothing")?;
            let report: Theirs = serde_json::from_str(line)?;
            told.version = Some(report.version);
            told.setting = report.setting;
            told.stages = report.stages;
            told.notes = report.notes;
        }
    }
    Ok(told)
}

/// The run whose time is the median, with the largest memory of all.
pub fn median(mut runs: Vec<Told>) -> Told {
    let peak_mb = runs.iter().map(|told| told.peak_mb).fold(0.0, f64::max);
    runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    Told { peak_mb, ..runs.swap_remove(runs.len() / 2) }
}

/// The point of a picture on its curve, without setting and path; an error where the picture is of another size or
/// holds numbers that are not finite.
///
/// Of a black reference no error can be relative: `error` is then the root mean square of the picture and `bias` its
/// mean, both in cd/m².
pub fn point(told: &Told, picture: &Image, truth: &Reference) -> Result<Point> {
    let mut point = Point {
        seconds: told.seconds,
        stages: told.stages.clone(),
        peak_mb: told.peak_mb,
        rays: told.rays,
        ..Point::default()
    };
    if is_black(truth) {
        let luminances = || picture.pixels.iter().map(|p| f64::from(p.luminance()));
        let n = picture.pixels.len() as f64;
        point.error = (luminances().map(|y| y * y).sum::<f64>() / n).sqrt();
        point.bias = luminances().sum::<f64>() / n;
        point.p99 = point.error;
    } else {
        let found = metrics::compare(picture, truth, true)?;
        anyhow::ensure!(found.nonfinite == 0, "{} pixels are not finite", found.nonfinite);
        point.error = found.error;
        point.error_se = found.error_se;
        point.bias = found.bias;
        point.p99 = found.p99;
        point.flip = found.flip.unwrap_or_default();
    }
    anyhow::ensure!(point.error.is_finite() && point.bias.is_finite(), "the picture is not finite");
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Rgb;

    fn ran(stdout: &str) -> Ran {
        Ran {
            code: Some(0),
            seconds: 2.0,
            peak_mb: 30.0,
            stdout: stdout.into(),
            stderr: String::new(),
            late: false,
        }
    }

    #[test]
    fn stages_and_rays_of_all_views_are_summed() {
        let views = r#"{"pictures": [{"stages": {"prepass": 1.0, "image": 0.5}, "rays": 7}, {"stages": {"image": 0.25}, "rays": 3}]}"#;
        let told = told(Program::Twolight, &ran(views)).unwrap();
        assert_eq!((told.stages["prepass"], told.stages["image"], told.rays), (1.0, 0.75, Some(10)));
    }

    #[test]
    fn a_peer_reports_on_its_last_line() {
        let said = "Blender 4.4\n{\"version\": \"Cycles 4.4\", \"setting\": \"64 spp\", \"notes\": [\"no spots\"]}\n\n";
        let told = told(Program::Peer("cycles"), &ran(said)).unwrap();
        assert_eq!((told.version.unwrap().as_str(), told.notes.len()), ("Cycles 4.4", 1));
        assert!(super::told(Program::Peer("cycles"), &ran("done\n")).is_err());
    }

    #[test]
    fn light_in_a_black_room_is_an_error_in_its_own_unit() {
        let image = |v: f32| Image { width: 2, height: 1, pixels: vec![Rgb::splat(v), Rgb::BLACK] };
        let truth = Reference { mean: image(0.0), halves: None };
        let found = point(&Told::default(), &image(2.0), &truth).unwrap();
        assert!((found.bias - 1.0).abs() < 1e-6 && (found.error - 2f64.sqrt()).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn the_run_in_the_middle_counts() {
        let run = |seconds, peak_mb| Told { seconds, peak_mb, ..Told::default() };
        let told = median(vec![run(3.0, 10.0), run(1.0, 12.0), run(2.0, 11.0)]);
        assert_eq!((told.seconds, told.peak_mb), (2.0, 12.0));
    }
}
