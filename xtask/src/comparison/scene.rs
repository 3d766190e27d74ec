//! What is rendered: scenes with the references they are held against.

use super::method;
use super::process;
use super::results;
use anyhow::{Context, Result, ensure};
use raytrace::metrics::{self, Reference};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A scene seen by one camera, and the picture that is taken for the truth.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The file's stem.
    pub name: String,
    /// The glTF file.
    pub file: PathBuf,
    /// Camera of the file.
    pub camera: String,
    /// Columns of the reference.
    pub width: u32,
    /// Rows of the reference.
    pub height: u32,
    /// Triangles of the scene.
    pub triangles: u64,
    /// Where the reference is, without `.a.exr` and `.b.exr`, and what is known of it.
    pub reference: results::Reference,
}

/// What `twolight inspect` tells of a file.
#[derive(Debug, Deserialize)]
pub struct Inspected {
    /// Triangles that can be seen.
    pub triangles: u64,
    /// In the order of the file.
    pub cameras: Vec<InspectedCamera>,
}

/// One camera of a file.
#[derive(Debug, Deserialize)]
pub struct InspectedCamera {
    /// Its name.
    pub name: String,
    /// Width over height, if the file states it.
    pub aspect: Option<f32>,
}

/// The scenes in the folder `assets` that have references in its folder `reference`, in order of their names. Where a
/// scene has several cameras, `reference/NAME.camera` names the one that took the reference; else it is the first.
pub fn of_assets(assets: &Path) -> Result<Vec<Subject>> {
    let folder = assets.join("reference");
    let mut names: Vec<String> = files(&folder)?
        .iter()
        .filter_map(|path| Some(path.file_name()?.to_str()?.strip_suffix(".a.exr")?.to_string()))
        .collect();
    names.sort();
    let scene = |name: &str| {
        let candidates = ["gltf", "glb"].map(|extension| assets.join(format!("{name}.{extension}")));
        candidates
            .into_iter()
            .find(|path| path.is_file())
            .with_context(|| format!("no scene for reference {name}"))
    };
    let subject = |name: &String| {
        let camera = std::fs::read_to_string(folder.join(format!("{name}.camera"))).ok();
        Subject::new(&scene(name)?, camera.as_deref().map(str::trim), &folder.join(name))
    };
    names.iter().map(subject).collect()
}

/// The files in a folder.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("reading the folder {}", folder.display()))?;
    entries.map(|entry| Ok(entry?.path())).collect()
}

/// What `twolight inspect` says of `file`.
pub fn inspect(file: &Path) -> Result<Inspected> {
    let mut command = Command::new(method::twolight());
    let ran = process::run(command.arg("inspect").arg(file).arg("--json"), Duration::from_secs(600))?;
    ensure!(ran.code == Some(0), "cannot inspect {}: {}", file.display(), ran.last_words());
    serde_json::from_str(&ran.stdout).with_context(|| format!("what inspect says of {}", file.display()))
}

impl Subject {
    /// The scene `file` seen by `camera` (its first where `None`), and the reference that lies at `reference`.
    pub fn new(file: &Path, camera: Option<&str>, reference: &Path) -> Result<Subject> {
        let inspected = inspect(file)?;
        let first = inspected.cameras.first().map(|c| c.name.as_str());
        let camera = camera.or(first).with_context(|| format!("{} has no camera", file.display()))?;
        let truth = read(reference)?;
        Ok(Subject {
            name: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            file: file.into(),
            camera: camera.into(),
            width: truth.mean.width,
            height: truth.mean.height,
            triangles: inspected.triangles,
            reference: results::Reference {
                path: reference.into(),
                made_by: made_by(reference).unwrap_or_default(),
                noise: noise(&truth)?,
            },
        })
    }

    /// The reference.
    pub fn truth(&self) -> Result<Reference> {
        read(&self.reference.path)
    }

    /// As `results.json` shows it, before anything was rendered.
    pub fn result(&self) -> results::Scene {
        let from_root = |path: &Path| path.strip_prefix(crate::root()).unwrap_or(path).to_path_buf();
        results::Scene {
            name: self.name.clone(),
            file: from_root(&self.file),
            camera: self.camera.clone(),
            width: self.width,
            height: self.height,
            triangles: self.triangles,
            reference: results::Reference { path: from_root(&self.reference.path), ..self.reference.clone() },
            curves: Vec::new(),
        }
    }
}

fn read(reference: &Path) -> Result<Reference> {
    let path = PathBuf::from(format!("{}.exr", reference.display()));
    Ok(raytrace::exr::read_reference(&path)?)
}

/// Error of the mean of two independent halves, by the metric of `compare`: a − mean is half their difference.
fn noise(truth: &Reference) -> Result<f64> {
    let Some((a, _)) = &truth.halves else { return Ok(0.0) };
    if is_black(truth) {
        return Ok(0.0);
    }
    let mean = Reference { mean: truth.mean.clone(), halves: None };
    Ok(metrics::compare(a, &mean, false)?.raw_error)
}

/// Whether no light is in the reference, so that no error can be relative to it.
pub fn is_black(truth: &Reference) -> bool {
    truth.mean.pixels.iter().all(|p| p.max_channel() <= 0.0)
}

/// The comment in the reference's header: renderer, version and samples, if whoever made it said so.
fn made_by(reference: &Path) -> Option<String> {
    let path = format!("{}.a.exr", reference.display());
    let header = exr::meta::MetaData::read_from_file(path, false).ok()?.headers.into_iter().next()?;
    Some(header.own_attributes.comments?.to_string())
}
