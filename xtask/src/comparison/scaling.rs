//! `--scaling`: how time, memory and error grow as one thing grows and all else stays.

mod plan;
mod rooms;

use super::measure::{self, Outcome, Told};
use super::method::{Rung, Shot};
use super::results::{Sweep, SweepLine, SweepPoint};
use super::scene::Subject;
use anyhow::Result;
use geometry::Rgb;
use plan::{Case, Plan, Planner, SWEEPS, Truth};
use raytrace::exr::{Image, read_rgb};
use raytrace::metrics::{self, Reference};
use std::path::Path;
use std::time::Duration;

/// In place of every name.
pub const ALL: &str = "all";

/// What `--scaling` takes.
pub fn names() -> impl Iterator<Item = &'static str> {
    std::iter::once(ALL).chain(SWEEPS.map(|(name, _)| name))
}

/// What a sweep is run with.
pub struct Settings<'a> {
    /// Some of [`names`].
    pub sweeps: &'a [String],
    /// Threads, unless they are what is swept.
    pub threads: u32,
    /// Seconds; a line whose run took longer is not followed further.
    pub longest: f64,
    /// Folder of `results.json`; generated scenes go to its folder `scenes`.
    pub out: &'a Path,
    /// Scenes with references.
    pub known: &'a [Subject],
}

/// Runs every sweep; `save` is told of a sweep after each of its runs.
pub fn run(settings: &Settings, mut save: impl FnMut(&Sweep) -> Result<()>) -> Result<()> {
    let folder = settings.out.join("scenes");
    let planner = Planner { folder: &folder, threads: settings.threads, known: settings.known };
    let wanted = |sweep: &str| settings.sweeps.iter().any(|name| name == ALL || name == sweep);
    for Plan { mut sweep, lines } in planner.plans(wanted)? {
        println!("\n{}", sweep.title);
        let empty = |(label, _): &(String, Vec<Case>)| SweepLine { label: label.clone(), points: Vec::new() };
        sweep.lines = lines.iter().map(empty).collect();
        let mut followed = vec![true; lines.len()];
        // In turn, so that a slow minute of the machine hits all lines.
        for step in 0..lines.iter().map(|(_, cases)| cases.len()).max().unwrap_or_default() {
            for (i, (label, cases)) in lines.iter().enumerate() {
                let Some(case) = cases.get(step).filter(|_| followed[i]) else { continue };
                match point(case, settings)? {
                    Ok(point) => {
                        let error =
                            point.error.map(|e| format!("   error {:7.3} %", 100.0 * e)).unwrap_or_default();
                        println!(
                            "{label:28} {:12} {:8.2} s (prepass {:7.2} s) {:6.0} MB{error}",
                            point.x, point.seconds, point.prepass_seconds, point.peak_mb
                        );
                        followed[i] = point.seconds <= settings.longest;
                        sweep.lines[i].points.push(point);
                    }
                    Err(why) => {
                        println!("{label:28} {:12} {why}", case.x);
                        followed[i] = false;
                    }
                }
                save(&sweep)?;
            }
        }
        for line in &mut sweep.lines {
            line.points.sort_by(|a, b| a.x.total_cmp(&b.x));
        }
        save(&sweep)?;
    }
    Ok(())
}

/// One run and what it showed, or why there is no picture.
fn point(case: &Case, settings: &Settings) -> Result<Result<SweepPoint, String>> {
    let folder = settings.out.join("scenes");
    let out = folder.join(plan::PICTURE);
    let rung = Rung { setting: case.args.join(" "), args: case.args.iter().map(|s| s.to_string()).collect() };
    let shot = Shot { subject: &case.subject, threads: case.threads, seed: 1, out: &out };
    let limit = Duration::from_secs_f64(8.0 * settings.longest + 60.0);
    let mut runs: Vec<Told> = Vec::new();
    let apart = case.apart.iter().map(|camera| Subject { camera: camera.clone(), ..case.subject.clone() });
    let subjects: Vec<Subject> =
        if case.apart.is_empty() { vec![case.subject.clone()] } else { apart.collect() };
    while runs.is_empty() || (runs[0].seconds < measure::SHORT && runs.len() < measure::TIMES) {
        let mut all = Told::default();
        // The first last, so that its picture is there to be measured.
        for subject in subjects.iter().rev() {
            match measure::render(case.program, &rung, Shot { subject, ..shot }, limit)? {
                Outcome::Done(told) => all.add(&told),
                Outcome::Absent(why) | Outcome::Failed(why) => return Ok(Err(why)),
            }
        }
        runs.push(all);
    }
    let told = measure::median(runs);
    let shown = || read_rgb(&folder.join(&case.first));
    let error = match case.truth {
        Truth::Unknown => None,
        Truth::Reference => Some(metrics::compare(&shown()?, &case.subject.truth()?, false)?.error),
        Truth::White => Some(metrics::compare(&shown()?, &white(&case.subject), false)?.error),
    };
    Ok(Ok(SweepPoint {
        x: case.x,
        seconds: told.seconds,
        prepass_seconds: told.stages.get("prepass").copied().unwrap_or_default(),
        peak_mb: told.peak_mb,
        error,
    }))
}

/// 1 cd/m² everywhere.
fn white(subject: &Subject) -> Reference {
    let (width, height) = (subject.width, subject.height);
    let pixels = vec![Rgb::WHITE; (width * height) as usize];
    Reference { mean: Image { width, height, pixels }, halves: None }
}
