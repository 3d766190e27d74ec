//! A picture as it is written: its files, and what is said of it.

use anyhow::Result;
use geometry::Camera;
use raytrace::exr::Metadata;
use raytrace::verify::{Judgement, Verdict};
use raytrace::{Integrator, Outcome, Settings, exr, tonemap};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// One picture that was written. What all pictures share, up to the prepass, is counted with the first.
#[derive(Serialize)]
pub struct Picture {
    /// EXR.
    pub output: PathBuf,
    preview: Option<PathBuf>,
    camera: String,
    width: u32,
    height: u32,
    finished: bool,
    seconds: f64,
    rays: u64,
    stages: BTreeMap<&'static str, f64>,
    /// EV of the preview.
    pub exposure: Option<f32>,
    /// Pixels that were not finite.
    pub repaired: u64,
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
    /// Whether it is surely not as exact as asked.
    pub fn missed(&self) -> bool {
        self.accuracy.as_ref().is_some_and(|a| a.judgement == "missed")
    }

    /// Its error as measured, in percent.
    pub fn measured(&self) -> Option<f64> {
        self.accuracy.as_ref().map(|a| a.measured)
    }

    /// One of many, in a line.
    pub fn short_line(&self) -> String {
        let unfinished = if self.finished { "" } else { ", unfinished" };
        let error = self.measured().map_or(String::new(), |e| format!(", error {e:.1} %"));
        format!("{}: {:.1} s{error}{unfinished}", self.output.display(), self.seconds)
    }

    /// All that is to be said of it.
    pub fn line(&self) -> String {
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
///
/// - `exposure`: EV of the preview; automatic if absent.
pub fn save(
    exposure: Option<f32>,
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
    let mut exposed = None;
    if let Some(path) = &preview {
        let beauty = film.beauty();
        let ev = exposure.unwrap_or_else(|| tonemap::automatic_exposure(&beauty));
        tonemap::write_png(film.width, film.height, &tonemap::to_srgb(&beauty, ev), path)?;
        exposed = Some(ev);
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
        exposure: exposed,
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
