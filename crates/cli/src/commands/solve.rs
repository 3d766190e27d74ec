//! `twolight solve`: the light of a room, once, for any view of it.

use super::print;
use crate::args::SolveArgs;
use crate::job::AskedWrongly;
use crate::progress::Bars;
use crate::room::{Room, lap, start_threads};
use crate::{cameras, solutions};
use anyhow::{Context, Result};
use radiosity::Journal;
use radiosity::solution_file::About;
use raytrace::output::check_writable;
use raytrace::{DiffuseMode, Settings, prepass_resumable};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Runs the command.
pub fn run(args: &SolveArgs) -> Result<ExitCode> {
    if !solutions::is_one(&args.output) {
        let message = format!("{} is a solution: name it .twl", args.output.display());
        return Err(AskedWrongly(message).into());
    }
    check_writable(&args.output)?;
    let bars = Bars::new(args.run.quiet);
    start_threads(args.run.threads)?;
    let kept = partial(&args.output);
    bars.end_at_interrupts(move || match kept.is_file() {
        true => "stopped: the same command goes on from here",
        false => "stopped: nothing is kept, the same command begins anew",
    });

    let Room { world, cameras, warnings, mut stages } =
        Room::open(&args.scene, &args.which, &args.light, &bars)?;
    let seen_by = match &args.camera {
        Some(asked) => cameras::choose(Some(asked), &cameras, &world.scene)?.cameras,
        None => Vec::new(),
    };
    let settings = Settings {
        seed: args.run.seed,
        error: args.error,
        // The mode that asks most of the vertices: who renders chooses his own.
        diffuse: DiffuseMode::Vertex,
        by_light: true,
        ..Settings::default()
    };
    let mut clock = Instant::now();
    let partial = partial(&args.output);
    let journal = Mutex::new(Journal::at(&partial));
    let solution = prepass_resumable(&world, &seen_by, &settings, Some(&journal), &bars)
        .with_context(|| format!("cannot solve {}", args.scene.display()))?;
    bars.done();
    let journal = journal.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(failure) = journal.failure() {
        bars.note(&format!("warning: cannot keep {}: {failure}", partial.display()));
    }
    stages.push(("solve", lap(&mut clock)));
    let about = About {
        program: concat!("twolight ", env!("CARGO_PKG_VERSION")).into(),
        error: args.error,
        seed: args.run.seed,
        cameras: seen_by.iter().map(|c| c.name.clone()).collect(),
    };
    let bytes = solutions::write(&args.output, &solution, &world, &about)?;
    stages.push(("write", lap(&mut clock)));
    let (recalled, sites) = (journal.recalled(), solution.report.sites);
    journal.remove();

    let report = Report {
        scene: args.scene.clone(),
        output: args.output.clone(),
        bytes,
        error: args.error,
        elements: solution.report.elements,
        vertices: solution.report.vertices,
        sites,
        photons: solution.report.photons,
        lights: solution.light_names().to_vec(),
        recalled,
        seconds: stages.iter().map(|s| s.1).sum(),
        stages: stages.into_iter().collect(),
        warnings,
    };
    print(&match args.run.json {
        true => serde_json::to_string_pretty(&report)?,
        false => report.to_string(),
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Where the rows are kept while it works.
fn partial(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".partial");
    name.into()
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    scene: PathBuf,
    output: PathBuf,
    bytes: usize,
    error: f32,
    elements: usize,
    vertices: usize,
    sites: usize,
    photons: usize,
    /// Groups of lamps that can be dimmed.
    lights: Vec<String>,
    /// Rows that an earlier, stopped run had gathered.
    recalled: usize,
    seconds: f64,
    stages: BTreeMap<&'static str, f64>,
    warnings: Vec<String>,
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Report { output, seconds, elements, vertices, sites, photons, .. } = self;
        writeln!(f, "{}: {:.1} MB, {seconds:.1} s", output.display(), self.bytes as f64 / 1e6)?;
        write!(f, "  mesh: {elements} elements, {vertices} vertices, {sites} sites gathered")?;
        if self.recalled > 0 {
            write!(f, ", {} rows of an earlier run", self.recalled)?;
        }
        if *photons > 0 {
            write!(f, "\n  caustics: {photons} photons")?;
        }
        write!(f, "\n  lights that may be dimmed: {}", self.lights.join(", "))
    }
}
