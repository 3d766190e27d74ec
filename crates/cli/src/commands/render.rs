//! `twolight render`: a scene to an EXR, and a picture to look at; and whether it is as exact as it was asked to be.

use super::{print, snapshots};
use crate::args::RenderArgs;
use crate::job::{AskedWrongly, RenderJob, Shot, with_name};
use crate::picture::{Picture, save};
use crate::progress::Bars;
use crate::room::{Room, lap, start_threads};
use crate::{cameras, solutions};
use anyhow::{Context, Result};
use geometry::Camera;
use radiosity::Solution;
use raytrace::level::level;
use raytrace::tonemap::incident_exposure;
use raytrace::{Integrator, Settings, prepass_for, render, render_by_light};
use serde::Serialize;
use std::path::PathBuf;
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

    let start = Instant::now();
    let frames = job.frames();
    let time = frames.iter().flatten().next().and_then(|&frame| job.views.time(frame));
    let room = Room::open(&job.scene, &job.which_at(time), &job.light, &bars)?;
    if time.is_some() && room.cameras.is_empty() {
        return Err(AskedWrongly("an animation is seen by a camera, and the file has none".into()).into());
    }
    let choice = cameras::choose(job.camera.as_deref(), &room.cameras, &room.world.scene)?;
    if let Some(note) = &choice.note {
        bars.note(&format!("note: {note}"));
    }
    let warnings = room.warnings.clone();
    let mut work = Work::new(&job, &bars, room, &choice.cameras)?;
    let shots = job.shots(frames, &choice.cameras)?;
    let wanted = job.views.frames().map_or(shots.len(), |frames| frames.len());
    let (mut missed, mut done) = (false, 0);
    for shot in shots {
        if job.is_there(&shot.output, shot.preview.as_deref()) {
            continue;
        }
        let picture = work.picture(&shot)?;
        if picture.repaired > 0 {
            let message = "pixels were not finite or negative and are black instead; please report it";
            bars.note(&format!("warning: {} {message}", picture.repaired));
        }
        if picture.missed() {
            missed = true;
            let why = if job.solution.is_some() { ": the solution is too rough for this view" } else { "" };
            bars.note(&format!("warning: {} is not as exact as asked{why}", picture.output.display()));
        }
        if !job.json {
            print(&if shot.frame.is_some() { picture.short_line() } else { picture.line() })?;
        }
        work.pictures.push(picture);
        done += 1;
        if bars.interrupted() {
            break;
        }
    }
    let report = Report { skipped: wanted - done, warnings, pictures: work.pictures, scene: job.scene };
    match job.json {
        true => print(&serde_json::to_string_pretty(&report)?)?,
        false if wanted > 1 => print(&report.summary(start.elapsed().as_secs_f64()))?,
        false => (),
    }
    Ok(match () {
        () if bars.interrupted() => ExitCode::FAILURE,
        () if missed => ExitCode::from(MISSED),
        () => ExitCode::SUCCESS,
    })
}

/// A room, and its light as far as it is known.
struct Work<'a> {
    job: &'a RenderJob,
    bars: &'a Bars,
    room: Room,
    /// Whose views the first pass takes care of; none for all of the room alike.
    seen_by: Vec<Camera>,
    solution: Option<Solution>,
    /// Relative error that is asked.
    error: f32,
    /// Seconds of what pictures share: told with the next of them.
    shared: Vec<(&'static str, f64)>,
    /// Rays cast before.
    rays: u64,
    pictures: Vec<Picture>,
}

impl<'a> Work<'a> {
    fn new(job: &'a RenderJob, bars: &'a Bars, mut room: Room, cameras: &[Camera]) -> Result<Work<'a>> {
        let mut clock = Instant::now();
        let mut shared = std::mem::take(&mut room.stages);
        let (mut solution, mut error) = (None, job.error(None));
        if let Some(path) = &job.solution {
            let (read, about) = solutions::read(path, &room.world)?;
            (solution, error) = (Some(read), job.error(Some(&about)));
            shared.push(("solution", lap(&mut clock)));
            if error < about.error {
                let [asked, made] = [error, about.error].map(|e| (100.0 * e).to_string());
                bars.note(&format!("note: {asked} % is asked, and the solution was made for {made} %"));
            }
        }
        // A part of a sequence is to be the same whoever renders it: its first pass knows none of the views.
        let seen_by = if job.views.frames().is_some() { Vec::new() } else { cameras.to_vec() };
        Ok(Work { job, bars, room, seen_by, solution, error, shared, rays: 0, pictures: Vec::new() })
    }

    /// Renders one picture and writes it.
    fn picture(&mut self, shot: &Shot) -> Result<Picture> {
        let (job, bars) = (self.job, self.bars);
        let mut camera = shot.camera.clone();
        if let Some(frame) = shot.frame {
            if let Some(time) = job.views.time(frame) {
                // Where things moved, and not only the camera, their light is another.
                if self.room.go_to(&job.scene, &job.which_at(Some(time)), &job.light)? {
                    self.solution = match &job.solution {
                        Some(path) => Some(solutions::read(path, &self.room.world)?.0),
                        None => None,
                    };
                    self.rays = 0;
                }
                let of_now = self.room.cameras.iter().find(|c| c.name == camera.name);
                camera = of_now.cloned().unwrap_or(camera);
            }
            camera = job.views.camera(frame, &camera, &self.room.world);
        }
        let settings = job.settings(&camera, self.error)?;
        self.solve(&settings, &camera)?;
        // Frames that follow one another are exposed alike.
        let exposure = job.exposure.or_else(|| {
            let level = shot.frame.map(|_| match &self.solution {
                Some(solution) => solution.level(),
                None => level(&self.room.world),
            });
            level.filter(|&e| e > 0.0).map(incident_exposure)
        });
        // An earlier preview is worth more than one that is half done.
        bars.show_in(shot.preview.as_ref().map(|p| with_name(p, "partial")), exposure);
        let (world, solution) = (&mut self.room.world, self.solution.as_ref());
        let mut outcome = match job.light_layers {
            true => render_by_light(world, &camera, solution, &settings, bars)?,
            false => render(world, &camera, solution, &settings, bars)?,
        };
        outcome.report.stages.append(&mut self.shared);
        let rays = self.room.world.bvh.rays_cast();
        let rays = rays - std::mem::replace(&mut self.rays, rays);
        bars.done();
        if !outcome.finished && outcome.film.is_blank() {
            // An old picture is worth more than a black one.
            let why = if bars.interrupted() { "stopped" } else { "the time was up" };
            anyhow::bail!("{why} before a pixel was rendered: {} is not written", shot.output.display());
        }
        let pair = shot.preview.as_ref().filter(|_| job.snapshots).map(|p| with_name(p, "without-and-with"));
        let film = pair.is_some().then(|| outcome.film.clone());
        let (output, preview) = (shot.output.clone(), shot.preview.clone());
        bars.show_in(None, None);
        let picture = save(exposure, &camera, &settings, outcome, output, preview, rays)?;
        if let (Some(pair), Some(film), Some(ev)) = (pair, film, picture.exposure) {
            snapshots::side_by_side(&film, ev, &pair)?;
        }
        Ok(picture)
    }

    /// Light does not know where we stand: one solution serves all views.
    fn solve(&mut self, settings: &Settings, camera: &Camera) -> Result<()> {
        if settings.integrator != Integrator::Hybrid || self.solution.is_some() {
            return Ok(());
        }
        let (job, bars, world) = (self.job, self.bars, &self.room.world);
        let mut clock = Instant::now();
        self.solution = Some(match &job.classical {
            Some(config) if job.snapshots => {
                let (solution, on_the_way) = snapshots::take(job, world, camera, config, self.error, bars)?;
                self.pictures.extend(on_the_way);
                solution
            }
            _ => prepass_for(world, &self.seen_by, settings, bars)
                .with_context(|| format!("cannot solve {}", job.scene.display()))?,
        });
        self.shared.push(("prepass", lap(&mut clock)));
        Ok(())
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    scene: PathBuf,
    warnings: Vec<String>,
    /// Pictures that were there already.
    skipped: usize,
    pictures: Vec<Picture>,
}

impl Report {
    /// All pictures in a few words.
    fn summary(&self, seconds: f64) -> String {
        let mut errors: Vec<f64> = self.pictures.iter().filter_map(Picture::measured).collect();
        errors.sort_by(f64::total_cmp);
        let s = if self.pictures.len() == 1 { "" } else { "s" };
        let mut words = format!("{} picture{s} in {seconds:.1} s", self.pictures.len());
        if self.skipped > 0 {
            words += &format!(", {} were there or are left", self.skipped);
        }
        if let Some(middle) = errors.get(errors.len() / 2) {
            let (least, most) = (errors[0], errors[errors.len() - 1]);
            words +=
                &format!("; errors measured: {least:.1} to {most:.1} %, half of them below {middle:.1} %");
        }
        words
    }
}
