//! `twolight bake`: a scene to a `.glb` that holds its light.

use super::print;
use crate::args::BakeArgs;
use crate::job::AskedWrongly;
use crate::progress::Bars;
use crate::room::{Room, lap, start_threads};
use crate::solutions;
use anyhow::{Context, Result};
use radiosity::{Config, solve};
use raytrace::bake::{self, Light, Settings, Target};
use raytrace::output::{check_writable, write_atomically};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Direct light at the solution's vertices is used for the exposure and for what a material looks like, no more.
const LIGHT_SAMPLES: u32 = 8;

/// Error aimed at where none is asked for.
const USUAL_ERROR: f32 = 0.05;

/// Runs the command; failure if the user stopped it before a file was written.
pub fn run(args: BakeArgs) -> Result<ExitCode> {
    check(&args)?;
    let bars = Bars::new(args.run.quiet);
    start_threads(args.run.threads)?;
    bars.listen_for_interrupts();
    let Room { world, cameras, mut warnings, stages } =
        Room::open(&args.scene, &args.which, &args.light, &bars)?;
    anyhow::ensure!(
        !world.scene.mesh.triangles.is_empty(),
        "{}: there is nothing to bake",
        args.scene.display()
    );
    let mut stages: BTreeMap<&'static str, f64> = stages.into_iter().collect();

    let mut clock = Instant::now();
    let (solution, error) = match &args.solution {
        Some(path) => {
            let (solution, about) = solutions::read(path, &world)?;
            (solution, args.error.unwrap_or(about.error))
        }
        None => {
            let error = args.error.unwrap_or(USUAL_ERROR);
            let config =
                Config { seed: args.run.seed, light_samples: LIGHT_SAMPLES, ..Config::for_error(error) };
            let solution = solve(&world, &config, &bars)
                .with_context(|| format!("cannot solve {}", args.scene.display()))?;
            (solution, error)
        }
    };
    stages.insert("prepass", lap(&mut clock));
    let settings = Settings {
        light: if args.indirect { Light::Indirect } else { Light::All },
        to: match args.lightmap {
            Some(side) => Target::Lightmap { side },
            None => Target::Vertices { most: args.vertices },
        },
        error,
        seed: args.run.seed,
    };
    let baked = bake::bake(&world, &solution, &settings, &bars);
    stages.insert("bake", lap(&mut clock));
    anyhow::ensure!(
        !baked.parts.is_empty(),
        "{}: {}",
        args.scene.display(),
        baked.report.warnings.join("; ")
    );
    let exposure = args.exposure.unwrap_or_else(|| bake::automatic_exposure(&world, &solution, &cameras));
    let name = args.scene.file_name().unwrap_or_default().to_string_lossy();
    let file = bake::write(&world, &cameras, &baked, &settings, exposure, &name)?;
    bars.done();
    if bars.interrupted() {
        bars.note(&format!("stopped: {} is not written", args.output.display()));
        return Ok(ExitCode::FAILURE);
    }
    write_atomically(&args.output, &file)?;
    stages.insert("write", lap(&mut clock));

    for warning in &baked.report.warnings {
        bars.note(&format!("warning: {warning}"));
    }
    warnings.extend(baked.report.warnings.iter().cloned());
    let report = Report {
        scene: args.scene,
        output: args.output,
        bytes: file.len(),
        vertices: baked.report.vertices,
        triangles: baked.report.triangles,
        exposure: (settings.light == Light::All).then_some(exposure),
        error: baked.report.error.map(|e| 100.0 * e),
        first_error: baked.report.first_error.map(|e| 100.0 * e),
        error_asked: 100.0 * settings.error,
        out_of_vertices: baked.report.out_of_vertices,
        flux_kept: baked.report.flux_kept,
        lightmap: baked.map.map(|m| Lightmap {
            width: m.width,
            height: m.height,
            charts: m.charts,
            texels_per_metre: m.density,
            covered: m.covered,
        }),
        seconds: stages.values().sum(),
        stages,
        warnings,
    };
    print(&if args.run.json { serde_json::to_string_pretty(&report)? } else { report.text() })?;
    Ok(ExitCode::SUCCESS)
}

/// What can be checked before the scene is read.
fn check(args: &BakeArgs) -> Result<()> {
    let (scene, output) = (&args.scene, &args.output);
    if !scene.is_file() {
        let why = if scene.is_dir() { "it is a folder" } else { "there is no such file" };
        anyhow::bail!("cannot read {}: {why}", scene.display());
    }
    if !output.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
        let message = format!("{} is written as binary glTF: name it .glb", output.display());
        return Err(AskedWrongly(message).into());
    }
    if same_file(scene, output) {
        let message = format!("{} would replace the scene itself: name another file", output.display());
        return Err(AskedWrongly(message).into());
    }
    Ok(check_writable(output)?)
}

/// Whether both names lead to one file.
fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

/// What `--json` prints; errors in percent.
#[derive(Serialize)]
struct Report {
    scene: PathBuf,
    output: PathBuf,
    bytes: usize,
    vertices: usize,
    triangles: usize,
    exposure: Option<f32>,
    error: Option<f32>,
    first_error: Option<f32>,
    error_asked: f32,
    out_of_vertices: bool,
    flux_kept: f32,
    lightmap: Option<Lightmap>,
    seconds: f64,
    stages: BTreeMap<&'static str, f64>,
    warnings: Vec<String>,
}

/// A light map's numbers.
#[derive(Serialize)]
struct Lightmap {
    width: u32,
    height: u32,
    charts: u32,
    texels_per_metre: f32,
    covered: f32,
}

impl Report {
    fn text(&self) -> String {
        let mut text = format!(
            "{}: {:.1} MB, {} vertices, {} triangles, {:.1} s",
            self.output.display(),
            self.bytes as f64 / 1e6,
            self.vertices,
            self.triangles,
            self.seconds
        );
        if let Some(ev) = self.exposure {
            text += &format!("\n  exposure: EV {ev:.1}");
        }
        if let Some(map) = &self.lightmap {
            text += &format!(
                "\n  light map: {} x {}, {} charts, {:.1} texels for a metre, {:.0} % covered",
                map.width,
                map.height,
                map.charts,
                map.texels_per_metre,
                100.0 * map.covered
            );
        }
        if let Some(error) = self.error {
            let from = match self.first_error {
                Some(first) if first != error => format!(", {first:.1} % before the mesh was refined"),
                _ => String::new(),
            };
            let why = if self.out_of_vertices { "; it would take more --vertices" } else { "" };
            text += &format!("\n  light: {error:.1} % rms off{from}; {:.0} % asked{why}", self.error_asked);
        }
        text
    }
}
