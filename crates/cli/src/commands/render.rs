//! `twolight render`: a scene to an EXR, and a picture to look at; and whether it is as exact as it was asked to be.

use super::{print, snapshots};
use crate::args::RenderArgs;
use crate::job::{RenderJob, with_name};
use crate::progress::Bars;
use crate::room::{Room, lap, start_threads};
use crate::{cameras, solutions};
use anyhow::{Context, Result};
use geometry::Camera;
use raytrace::exr::Metadata;
use raytrace::verify::{Judgement, Verdict};
use raytrace::{Integrator, Outcome, Settings, exr, prepass_for, render, render_by_light, tonemap};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Exit status of a render whose pictures are written, but surely not as exact as asked.
const MISSED: u8 = 3;

/// Runs the command; failure if the user stopped it, though what there was is saved.
pub fn run(args: RenderArgs) -> Result<ExitCode> {
    let job = RenderJob::new(args)?;
    let bars = Bars::new(job.quiet);
    start_threads(job.threads)?;
    bars.listen_for_interrupts();

    let Room { mut world, cameras, warnings, stages } =
        Room::open(&job.scene, &job.which, &job.light, &bars)?;
    // What all pictures share is told with the first.
    let mut shared = stages;
    let choice = cameras::choose(job.camera.as_deref(), &cameras, &world.scene)?;
    if let Some(note) = &choice.note {
        bars.note(&format!("note: {note}"));
    }
    let mut clock = Instant::now();
    let several = job.camera.as_deref() == Some("all");
    let mut pictures = Vec::new();
    let (mut rays_before, mut missed) = (0, false);
    let (mut solution, about) = match &job.solution {
        Some(path) => solutions::read(path, &world).map(|(solution, about)| (Some(solution), Some(about)))?,
        None => (None, None),
    };
    let error = job.error(about.as_ref());
    if let Some(about) = about {
        shared.push(("solution", lap(&mut clock)));
        if error < about.error {
            let [asked, made] = [error, about.error].map(|e| (100.0 * e).to_string());
            bars.note(&format!("note: {asked} % is asked, and the solution was made for {made} %"));
        }
    }
    for camera in &choice.cameras {
        let path = |base: &Path| if several { with_name(base, &camera.name) } else { base.to_path_buf() };
        let (output, preview) = (path(&job.output), job.preview.as_deref().map(path));
        let settings = job.settings(camera, error)?;
        if settings.integrator == Integrator::Hybrid && solution.is_none() {
            // Light does not know where we stand: one solution serves all views.
            solution = Some(match &job.classical {
                Some(config) if job.snapshots => {
                    let (solution, on_the_way) = snapshots::take(&job, &world, camera, config, error, &bars)?;
                    pictures.extend(on_the_way);
                    solution
                }
                _ => prepass_for(&world, &choice.cameras, &settings, &bars)
                    .with_context(|| format!("cannot solve {}", job.scene.display()))?,
            });
            shared.push(("prepass", lap(&mut clock)));
        }
        let mut outcome = match job.light_layers {
            true => render_by_light(&mut world, camera, solution.as_ref(), &settings, &bars)?,
            false => render(&world, camera, solution.as_ref(), &settings, &bars)?,
        };
        outcome.report.stages.append(&mut shared);
        let rays = world.bvh.rays_cast();
        let rays = rays - std::mem::replace(&mut rays_before, rays);
        bars.done();
        if !outcome.finished && outcome.film.is_blank() {
            // An old picture is worth more than a black one.
            let why = if bars.interrupted() { "stopped" } else { "the time was up" };
            anyhow::bail!("{why} before a pixel was rendered: {} is not written", output.display());
        }
        let pair = preview.as_ref().filter(|_| job.snapshots).map(|p| with_name(p, "without-and-with"));
        let film = pair.is_some().then(|| outcome.film.clone());
        let picture = save(&job, camera, &settings, outcome, output, preview, rays)?;
        if let (Some(pair), Some(film), Some(ev)) = (pair, film, picture.exposure) {
            snapshots::side_by_side(&film, ev, &pair)?;
        }
        if picture.repaired > 0 {
            let message = "pixels were not finite or negative and are black instead; please report it";
            bars.note(&format!("warning: {} {message}", picture.repaired));
        }
        if let Some(Accuracy { judgement: "missed", .. }) = picture.accuracy {
            missed = true;
            bars.note(&format!("warning: {} is not as exact as asked", picture.output.display()));
        }
        if !job.json {
            print(&picture.line())?;
        }
        pictures.push(picture);
        if bars.interrupted() {
            break;
        }
    }
    if job.json {
        let report = Report { scene: job.scene, warnings, pictures };
        print(&serde_json::to_string_pretty(&report)?)?;
    }
    Ok(match () {
        () if bars.interrupted() => ExitCode::FAILURE,
        () if missed => ExitCode::from(MISSED),
        () => ExitCode::SUCCESS,
    })
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    scene: PathBuf,
    warnings: Vec<String>,
    pictures: Vec<Picture>,
}

/// One picture that was written. What all pictures share, up to the prepass, is counted with the first.
#[derive(Serialize)]
pub(super) struct Picture {
    output: PathBuf,
    preview: Option<PathBuf>,
    camera: String,
    width: u32,
    height: u32,
    finished: bool,
    seconds: f64,
    rays: u64,
    stages: BTreeMap<&'static str, f64>,
    exposure: Option<f32>,
    repaired: u64,
    accuracy: Option<Accuracy>,
    report: BTreeMap<String, String>,
}

/// How exact a picture is, in percent; `None` where it was not measured.
#[derive(Serialize)]
struct Accuracy {
    asked: f32,
    measured: f64,
    /// Ends of the interval that holds the error with 95 % confidence.
    low: f64,
    high: f64,
    judgement: &'static str,
    probes: usize,
    paths: u64,
}

impl From<Verdict> for Accuracy {
    fn from(v: Verdict) -> Accuracy {
        let judgement = match v.judgement() {
            Judgement::Met => "met",
            Judgement::Open => "open",
            Judgement::Missed => "missed",
        };
        let [measured, low, high] = [v.error, v.low, v.high].map(|e| 100.0 * e);
        Accuracy {
            asked: (100.0 * v.asked) as f32,
            measured,
            low,
            high,
            judgement,
            probes: v.probes,
            paths: v.paths,
        }
    }
}

impl Picture {
    pub(super) fn line(&self) -> String {
        let mut line = format!(
            "{}: {}x{}, camera {:?}, {:.1} s",
            self.output.display(),
            self.width,
            self.height,
            self.camera,
            self.seconds
        );
        if let (Some(preview), Some(ev)) = (&self.preview, self.exposure) {
            line += &format!("; {} at EV {ev:.1}", preview.display());
        }
        if !self.finished {
            line += "; unfinished";
        }
        for (name, value) in &self.report {
            // Of several lines each is one of its own, indented alike.
            let value = if value.contains('\n') { format!("\n{value}") } else { format!(" {value}") };
            line += &format!("\n  {name}:{}", value.replace('\n', "\n    "));
        }
        line
    }
}

/// Writes what was rendered.
pub(super) fn save(
    job: &RenderJob,
    camera: &Camera,
    settings: &Settings,
    outcome: Outcome,
    output: PathBuf,
    preview: Option<PathBuf>,
    rays: u64,
) -> Result<Picture> {
    let started = Instant::now();
    let Outcome { film, by_light, finished, report } = outcome;
    exr::write(&film, &by_light, &metadata(camera, settings, finished, &report.texts), &output)?;
    let mut exposure = None;
    if let Some(path) = &preview {
        let beauty = film.beauty();
        let ev = job.exposure.unwrap_or_else(|| tonemap::automatic_exposure(&beauty));
        tonemap::write_png(film.width, film.height, &tonemap::to_srgb(&beauty, ev), path)?;
        exposure = Some(ev);
    }
    let mut stages: BTreeMap<_, f64> = BTreeMap::new();
    for (name, seconds) in report.stages {
        *stages.entry(name).or_default() += seconds;
    }
    stages.insert("write", started.elapsed().as_secs_f64());
    Ok(Picture {
        output,
        preview,
        camera: camera.name.clone(),
        width: film.width,
        height: film.height,
        finished,
        seconds: stages.values().sum(),
        rays,
        stages,
        exposure,
        repaired: film.repaired,
        accuracy: report.verdict.map(Accuracy::from),
        report: report.texts.into_iter().collect(),
    })
}

/// What the EXR says of itself. Nothing that differs between two runs of the same job.
fn metadata(camera: &Camera, settings: &Settings, finished: bool, texts: &[(String, String)]) -> Metadata {
    let mut metadata = Metadata { world_to_camera: Some(camera.to_world.inverse()), texts: texts.to_vec() };
    metadata.push("units", "cd/m2; irradiance lx; depth and position m");
    metadata.push("camera", &camera.name);
    metadata.push("seed", settings.seed);
    match settings.integrator {
        Integrator::Hybrid => {
            metadata.push("integrator", "hybrid");
            metadata.push("diffuse", format!("{:?}", settings.diffuse).to_lowercase());
            metadata.push("error asked", format!("{} %", 100.0 * settings.error));
        }
        Integrator::Path { spp } => {
            metadata.push("integrator", "path");
            metadata.push("samples", spp);
        }
    }
    for (name, value) in [("gather rays", settings.gather_rays), ("samples", settings.samples)] {
        if let Some(value) = value {
            metadata.push(name, value);
        }
    }
    if !finished {
        metadata.push("unfinished", "stopped before the error asked was reached");
    }
    metadata
}
