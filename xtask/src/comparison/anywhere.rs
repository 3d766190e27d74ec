//! `--scenes DIR`: scenes of one's own, with references by Mitsuba made on first sight and kept.
//!
//! A reference is two pictures of different seeds, so that its own noise is known and drops out of the errors.

use super::measure::{self, Outcome};
use super::method::{Program, Rung, Shot};
use super::results;
use super::scene::{self, Subject};
use anyhow::{Context, Result, bail, ensure};
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Columns of a reference.
const WIDTH: u32 = 320;
/// Width over height where the camera states none: that of `twolight render`.
const USUAL_ASPECT: f32 = 4.0 / 3.0;
/// Seeds of the two halves; that of every renderer that is compared is 1.
const SEEDS: [u64; 2] = [1001, 1002];
/// Samples a pixel of the picture that tells what a sample costs.
const TRIAL: u32 = 16;

/// How a reference is made.
#[derive(Clone, Copy, Debug)]
pub struct Making {
    /// Threads to render with.
    pub threads: u32,
    /// Seconds that both halves may take together, about.
    pub seconds: f64,
}

/// The scenes in `folder` by name, each with its reference. One that has no camera, or none of which a reference can
/// be made, is left out and named.
pub fn of_folder(folder: &Path, only: &[String], making: Making) -> Result<Vec<Subject>> {
    let mut files = scene::files(folder)?;
    let is_scene = |path: &Path| {
        path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"))
    };
    files.retain(|path| is_scene(path) && (only.is_empty() || only.contains(&name(path))));
    files.sort();
    ensure!(!files.is_empty(), "no .gltf or .glb that is asked for in {}", folder.display());
    let mut subjects = Vec::new();
    for file in files {
        match subject(&file, making) {
            Ok(subject) => {
                let noise = 100.0 * subject.reference.noise;
                println!("{}: reference {}, noise {noise:.2} %", subject.name, subject.reference.made_by);
                subjects.push(subject);
            }
            Err(error) => println!("{} is left out: {error:#}", file.display()),
        }
    }
    Ok(subjects)
}

fn name(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// One scene, its reference made if there is none yet of this content, size and time.
fn subject(file: &Path, making: Making) -> Result<Subject> {
    let inspected = scene::inspect(file)?;
    let camera = inspected.cameras.first().context("it has no camera")?;
    let aspect = camera.aspect.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(USUAL_ASPECT);
    let height = (WIDTH as f32 / aspect).round().clamp(1.0, 4096.0) as u32;
    let folder = crate::root().join("target/own-references");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let key = format!("{}-{:016x}-{WIDTH}x{height}-{}s", name(file), content(file)?, making.seconds);
    let reference = folder.join(key);
    if !half(&reference, "b").is_file() {
        let frame = Subject {
            name: name(file),
            file: file.into(),
            camera: camera.name.clone(),
            width: WIDTH,
            height,
            triangles: inspected.triangles,
            reference: results::Reference::default(),
        };
        make(&frame, &reference, making)?;
    }
    Subject::new(file, Some(&camera.name), &reference)
}

fn half(reference: &Path, which: &str) -> PathBuf {
    PathBuf::from(format!("{}.{which}.exr", reference.display()))
}

/// Renders both halves: a trial tells the price of a sample, and the samples are as many as the time buys.
fn make(frame: &Subject, reference: &Path, making: Making) -> Result<()> {
    let trial = half(reference, "trial");
    let start = mitsuba(frame, 1, SEEDS[0], &trial, making)?;
    let both = mitsuba(frame, TRIAL, SEEDS[0], &trial, making)?;
    std::fs::remove_file(&trial)?;
    let samples = affordable(start, both, making.seconds);
    println!("{}: making its reference, 2 x {samples} samples a pixel", frame.name);
    for (which, seed) in ["a", "b"].into_iter().zip(SEEDS) {
        // Under another name until it is whole: the half's presence says that it is there.
        mitsuba(frame, samples, seed, &trial, making)?;
        std::fs::rename(&trial, half(reference, which))?;
    }
    Ok(())
}

/// Samples a pixel of each half, where one sample took `start` seconds and [`TRIAL`] took `trial`: a square, which
/// stratified samplers like.
fn affordable(start: f64, trial: f64, seconds: f64) -> u32 {
    let each = ((trial - start) / f64::from(TRIAL - 1)).max(1e-4);
    let most = ((0.5 * seconds - start) / each).clamp(f64::from(TRIAL), 1e6);
    (most.sqrt().floor() as u32).pow(2)
}

/// Renders one picture with Mitsuba; its seconds.
fn mitsuba(frame: &Subject, samples: u32, seed: u64, out: &Path, making: Making) -> Result<f64> {
    let shot = Shot { subject: frame, threads: making.threads, seed, out };
    let rung = Rung::new(format!("{samples} spp"), &[], "--effort", &samples.to_string());
    let limit = Duration::from_secs_f64(2.0 * making.seconds + 120.0);
    match measure::render(Program::Peer("mitsuba"), &rung, shot, limit)? {
        Outcome::Done(told) => Ok(told.seconds),
        Outcome::Absent(why) => bail!("no reference without Mitsuba: {why}"),
        Outcome::Failed(why) => bail!("no reference: {why}"),
    }
}

/// A number that changes with the file, and with the buffers and images beside it that it names. Good for as long
/// as a build folder lives: another compiler may hash otherwise.
fn content(file: &Path) -> Result<u64> {
    let bytes = std::fs::read(file).with_context(|| format!("reading {}", file.display()))?;
    let mut hasher = DefaultHasher::new();
    hasher.write(&bytes);
    let json: serde_json::Value = serde_json::from_slice(&bytes).unwrap_or_default();
    let lists = ["buffers", "images"].iter().filter_map(|list| json[list].as_array()).flatten();
    for uri in lists.filter_map(|item| item["uri"].as_str()).filter(|uri| !uri.starts_with("data:")) {
        // One that is not there, or written with escapes, is for the renderer to judge.
        hasher.write(&std::fs::read(file.with_file_name(uri)).unwrap_or_default());
    }
    Ok(hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_buys_samples() {
        // 2 s to start, 0.1 s a sample: each half has 300 s, so 2980 samples, of which 54² are a square.
        assert_eq!(affordable(2.1, 3.6, 600.0), 2916);
        assert_eq!(affordable(20.0, 20.0, 10.0), 16, "never fewer than the trial");
    }

    #[test]
    fn content_counts_and_so_do_buffers_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let (file, buffer) = (folder.path().join("a.gltf"), folder.path().join("a.bin"));
        let mut seen = Vec::new();
        for (text, bytes) in [
            ("{}", "1"),
            (r#"{"buffers": [{"uri": "a.bin"}]}"#, "1"),
            (r#"{"buffers": [{"uri": "a.bin"}]}"#, "2"),
        ] {
            std::fs::write(&file, text).unwrap();
            std::fs::write(&buffer, bytes).unwrap();
            assert_eq!(content(&file).unwrap(), content(&file).unwrap());
            seen.push(content(&file).unwrap());
        }
        assert!(seen[0] != seen[1] && seen[1] != seen[2], "{seen:?}");
    }
}
