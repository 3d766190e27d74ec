//! What was typed, checked: a job that can be done, or the reason why not.

use crate::args::{DiffuseArg, IntegratorArg, LightArgs, RenderArgs, WhichArgs};
use crate::classical;
use crate::views::Views;
use anyhow::Result;
use geometry::Camera;
use radiosity::classical::Config as Classical;
use radiosity::solution_file::About;
use raytrace::exr;
use raytrace::output::check_writable;
use raytrace::{DiffuseMode, Integrator, Settings};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Pixels on the shorter side where no size is asked for.
const SHORTER_SIDE: f32 = 512.0;
/// Width over height where neither file nor user says: that of most rooms' pictures.
const USUAL_ASPECT: f32 = 4.0 / 3.0;
/// Most pixels of a picture: the film takes about 120 bytes for each, so 12 GB here.
const MOST_PIXELS: u64 = 100_000_000;
/// Paths through each pixel where none are asked for.
const USUAL_SPP: u32 = 256;
/// Error where none is asked for.
const USUAL_ERROR: f32 = 0.02;

/// A request that no scene could satisfy, or that this scene cannot: exit status 2.
#[derive(Debug)]
pub struct AskedWrongly(pub String);

impl std::fmt::Display for AskedWrongly {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (see --help)", self.0)
    }
}

impl std::error::Error for AskedWrongly {}

/// A render that can begin.
#[derive(Debug)]
pub struct RenderJob {
    /// Scene file.
    pub scene: PathBuf,
    /// EXR to write.
    pub output: PathBuf,
    /// PNG to write.
    pub preview: Option<PathBuf>,
    /// Exposure value of the preview; automatic if absent.
    pub exposure: Option<f32>,
    /// What of the file to show.
    which: WhichArgs,
    /// How the views follow from one another.
    pub views: Views,
    /// Leave out what is there.
    pub skip_existing: bool,
    /// Which camera, as typed.
    pub camera: Option<String>,
    /// What shines, beside what the file says.
    pub light: LightArgs,
    /// Solution to use.
    pub solution: Option<PathBuf>,
    /// A layer for each lamp.
    pub light_layers: bool,
    /// Result as JSON.
    pub json: bool,
    /// No notes.
    pub quiet: bool,
    /// Threads; all if absent.
    pub threads: Option<u32>,
    /// Pictures on the way, of a progressive solver.
    pub snapshots: bool,
    /// A classical solver in place of the default one.
    pub classical: Option<Classical>,
    size: Size,
    error: Option<f32>,
    seed: u64,
    integrator: Integrator,
    diffuse: DiffuseMode,
    time_limit: Option<Duration>,
    gather_rays: Option<u32>,
    samples: Option<u32>,
    verify: bool,
}

/// A picture to be made.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The camera that was chosen; in a sequence it moves.
    pub camera: Camera,
    /// Its number in a sequence.
    pub frame: Option<u32>,
    /// EXR to write.
    pub output: PathBuf,
    /// PNG to write.
    pub preview: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug)]
enum Size {
    Both(u32, u32),
    Width(u32),
    Usual,
}

impl RenderJob {
    /// Checks what can be checked before the scene is read; above all, that the pictures can be written.
    pub fn new(args: RenderArgs) -> Result<RenderJob> {
        let wrong = |message: String| Err(AskedWrongly(message).into());
        let path_traced = args.integrator == IntegratorArg::Path;
        if args.spp.is_some() && !path_traced {
            return wrong("--spp counts paths: it needs --integrator path; the hybrid has --samples".into());
        }
        if path_traced && (args.diffuse.is_some() || args.gather_rays.is_some() || args.samples.is_some()) {
            return wrong(
                "--diffuse, --gather-rays and --samples steer the hybrid, not --integrator path".into(),
            );
        }
        if args.solution.is_some() && (path_traced || args.solver.is_some() || args.gather_rays.is_some()) {
            return wrong(
                "--solution stands in for the first pass: not with --integrator path, --solver or --gather-rays"
                    .into(),
            );
        }
        if args.light_layers && (args.solver.is_some() || args.snapshots) {
            return wrong(
                "the classical solvers keep no lamps apart: --light-layers needs the default one".into(),
            );
        }
        let classical = classical::config(&args, args.error.unwrap_or(USUAL_ERROR))?;
        if let Some((w, h)) = args.size {
            check_size(w, h)?;
        }
        if !args.scene.is_file() {
            let why = if args.scene.is_dir() { "it is a folder" } else { "there is no such file" };
            anyhow::bail!("cannot read {}: {why}", args.scene.display());
        }
        let extension =
            |p: &Path| p.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        if matches!(extension(&args.output).as_str(), "png" | "jpg" | "jpeg" | "hdr" | "gltf" | "glb" | "tif")
        {
            return wrong(format!(
                "{} is written as EXR: name it .exr (--preview writes a PNG)",
                args.output.display()
            ));
        }
        if let Some(preview) = &args.preview
            && extension(preview) != "png"
        {
            return wrong(format!("the preview {} is written as PNG: name it .png", preview.display()));
        }
        let views = Views::new(&args.views)?;
        if let Views::Animation { .. } = views
            && args.which.time.is_some()
        {
            return wrong("--frames go through the animation: not with --time".into());
        }
        if views.frames().is_some() && args.snapshots {
            return wrong("--snapshots are of one picture: not with a sequence".into());
        }
        for path in [Some(&args.output), args.preview.as_ref()].into_iter().flatten() {
            check_writable(path)?;
        }
        Ok(RenderJob {
            scene: args.scene,
            output: args.output,
            preview: args.preview,
            exposure: args.exposure,
            which: args.which,
            views,
            skip_existing: args.views.skip_existing,
            camera: args.camera,
            light: args.light,
            json: args.run.json,
            quiet: args.run.quiet,
            threads: args.run.threads,
            snapshots: args.snapshots,
            classical,
            size: match (args.size, args.width) {
                (Some((w, h)), _) => Size::Both(w, h),
                (None, Some(w)) => Size::Width(w),
                (None, None) => Size::Usual,
            },
            error: args.error,
            seed: args.run.seed,
            integrator: match args.integrator {
                IntegratorArg::Hybrid => Integrator::Hybrid,
                IntegratorArg::Path => Integrator::Path { spp: args.spp.unwrap_or(USUAL_SPP) },
            },
            diffuse: match args.diffuse.unwrap_or(DiffuseArg::Split) {
                DiffuseArg::Vertex => DiffuseMode::Vertex,
                DiffuseArg::Split => DiffuseMode::Split,
                DiffuseArg::Gather => DiffuseMode::Gather,
            },
            time_limit: args.time_limit,
            gather_rays: args.gather_rays,
            samples: args.samples,
            verify: !args.no_verify,
            solution: args.solution,
            light_layers: args.light_layers,
        })
    }

    /// What of the file to show at `time`, where that is given.
    pub fn which_at(&self, time: Option<f32>) -> WhichArgs {
        WhichArgs { time: time.or(self.which.time), ..self.which.clone() }
    }

    /// Whether a picture is to be left out, for it was finished before, with the preview that belongs to it.
    pub fn is_there(&self, output: &Path, preview: Option<&Path>) -> bool {
        self.skip_existing && exr::is_finished(output) && preview.is_none_or(Path::is_file)
    }

    /// Numbers of the frames that are not there yet; `None` where each camera has one picture.
    pub fn frames(&self) -> Option<Vec<u32>> {
        let there = |&frame: &u32| {
            self.is_there(
                &numbered(&self.output, frame),
                self.preview.as_ref().map(|p| numbered(p, frame)).as_deref(),
            )
        };
        self.views.frames().map(|frames| frames.filter(|frame| !there(frame)).collect())
    }

    /// The pictures to make, of `frames` or of each of `cameras`.
    pub fn shots(&self, frames: Option<Vec<u32>>, cameras: &[Camera]) -> Result<Vec<Shot>> {
        let named = |camera: &Camera, name: &dyn Fn(&Path) -> PathBuf, frame| Shot {
            camera: camera.clone(),
            frame,
            output: name(&self.output),
            preview: self.preview.as_deref().map(name),
        };
        let several = self.camera.as_deref() == Some("all");
        match frames {
            Some(_) if cameras.len() > 1 => {
                Err(AskedWrongly("a sequence is seen by one camera: name one (--camera)".into()).into())
            }
            Some(frames) => Ok(frames
                .into_iter()
                .map(|frame| named(&cameras[0], &|path| numbered(path, frame), Some(frame)))
                .collect()),
            None if several => {
                Ok(cameras.iter().map(|c| named(c, &|path| with_name(path, &c.name), None)).collect())
            }
            None => Ok(cameras.iter().map(|c| named(c, &|path| path.to_path_buf(), None)).collect()),
        }
    }

    /// Error that is asked of the pictures: what was typed, or what a solution was made for, or 2 %.
    pub fn error(&self, solution: Option<&About>) -> f32 {
        self.error.or(solution.map(|about| about.error)).unwrap_or(USUAL_ERROR)
    }

    /// The settings for one camera, at this error; the time limit starts to run now.
    pub fn settings(&self, camera: &Camera, error: f32) -> Result<Settings> {
        let (width, height) = self.picture_size(camera.aspect)?;
        Ok(Settings {
            width,
            height,
            seed: self.seed,
            error,
            integrator: self.integrator,
            diffuse: self.diffuse,
            classical: self.classical.clone(),
            deadline: self.time_limit.and_then(|limit| Instant::now().checked_add(limit)),
            gather_rays: self.gather_rays,
            samples: self.samples,
            verify: self.verify,
            keep_solution: self.solution.is_some() || self.views.frames().is_some(),
            by_light: self.light_layers,
        })
    }

    /// Columns and rows for a camera whose file states `aspect`, width over height, or nothing.
    fn picture_size(&self, aspect: Option<f32>) -> Result<(u32, u32)> {
        let aspect = aspect.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(USUAL_ASPECT);
        let pixels = |v: f32| v.round().clamp(1.0, u32::MAX as f32) as u32;
        let (w, h) = match self.size {
            Size::Both(w, h) => (w, h),
            Size::Width(w) => (w, pixels(w as f32 / aspect)),
            Size::Usual if aspect >= 1.0 => (pixels(SHORTER_SIDE * aspect), SHORTER_SIDE as u32),
            Size::Usual => (SHORTER_SIDE as u32, pixels(SHORTER_SIDE / aspect)),
        };
        check_size(w, h)?;
        Ok((w, h))
    }
}

fn check_size(w: u32, h: u32) -> Result<()> {
    match u64::from(w) * u64::from(h) <= MOST_PIXELS {
        true => Ok(()),
        false => Err(AskedWrongly(format!("{w}x{h} is more than {MOST_PIXELS} pixels")).into()),
    }
}

/// `path` with `name` before its extension, for the picture of one of several cameras: out.exr, Hall: out.Hall.exr.
/// Characters that a file name cannot have on some system become `_`.
pub fn with_name(path: &Path, name: &str) -> PathBuf {
    let name = fit_for_file(name);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    path.with_file_name(format!("{stem}.{name}{extension}"))
}

/// `name` without what file names of some system cannot have.
pub fn fit_for_file(name: &str) -> String {
    let unfit = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    name.chars().map(|c| if unfit(c) { '_' } else { c }).collect()
}

/// `path` for one frame: its number in place of the last run of #, as long as that; before the extension where there is none.
pub fn numbered(path: &Path, frame: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let Some(end) = name.rfind('#').map(|i| i + 1) else { return with_name(path, &format!("{frame:04}")) };
    let start = name[..end].trim_end_matches('#').len();
    let digits = end - start;
    path.with_file_name(format!("{}{frame:0digits$}{}", &name[..start], &name[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser;

    /// The job of `render SCENE -o OUT` and `more`, for files that can be read and written.
    fn job(more: &[&str]) -> Result<RenderJob> {
        let dir = tempfile::tempdir().unwrap();
        let (scene, out) = (dir.path().join("a.glb"), dir.path().join("a.exr"));
        std::fs::write(&scene, "").unwrap();
        let fixed = ["twolight", "render", scene.to_str().unwrap(), "-o", out.to_str().unwrap()];
        let cli = Cli::try_parse_from(fixed.iter().chain(more)).unwrap();
        let Command::Render(args) = cli.command else { panic!("render was asked for") };
        RenderJob::new(*args)
    }

    #[test]
    fn the_shorter_side_has_512_pixels_unless_a_size_is_given() {
        let size = |more: &[&str], aspect| job(more).unwrap().picture_size(aspect).unwrap();
        assert_eq!(size(&[], Some(1.0)), (512, 512));
        assert_eq!(size(&[], Some(2.0)), (1024, 512));
        assert_eq!(size(&[], Some(0.5)), (512, 1024));
        assert_eq!(size(&[], None), (683, 512));
        assert_eq!(size(&["--width", "300"], Some(1.5)), (300, 200));
        assert_eq!(size(&["--size", "10x20"], Some(1.5)), (10, 20));
        assert!(job(&[]).unwrap().picture_size(Some(1e30)).is_err());
    }

    #[test]
    fn options_of_the_other_method_are_refused() {
        for wrong in [
            &["--spp", "4"][..],
            &["--integrator", "path", "--diffuse", "split"],
            &["--integrator", "path", "--samples", "4"],
            &["--size", "100000x100000"],
            &["--preview", "a.jpg"],
        ] {
            assert!(job(wrong).unwrap_err().is::<AskedWrongly>(), "{wrong:?}");
        }
        assert_eq!(job(&["--integrator", "path"]).unwrap().integrator, Integrator::Path { spp: USUAL_SPP });
    }

    #[test]
    fn names_of_cameras_become_names_of_files() {
        assert_eq!(with_name(Path::new("d/out.exr"), "Hall 2"), Path::new("d/out.Hall 2.exr"));
        assert_eq!(with_name(Path::new("out.exr"), "a/../b"), Path::new("out.a_.._b.exr"));
        assert_eq!(numbered(Path::new("d/a.####.exr"), 7), Path::new("d/a.0007.exr"));
        assert_eq!(numbered(Path::new("a#1-##.exr"), 123), Path::new("a#1-123.exr"));
        assert_eq!(numbered(Path::new("d#/a.exr"), 7), Path::new("d#/a.0007.exr"));
    }
}
