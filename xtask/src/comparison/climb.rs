//! All methods up their ladders on one scene, a rung at a time in turn, so that a slow minute of the machine hits all.

use super::measure::{self, Outcome, Told};
use super::method::{Method, Program, Shot};
use super::results::{Curve, Scene};
use super::sanity;
use super::scene::{Subject, is_black};
use anyhow::Result;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How to climb, and what was learnt on the way.
pub struct Climber<'a> {
    /// Threads of every renderer.
    pub threads: u32,
    /// Seconds; a method whose run took longer climbs no further.
    pub longest: f64,
    /// Folder of `results.json`.
    pub out: &'a Path,
    /// Methods whose renderer, or denoiser, turned out not to be installed.
    pub absent: BTreeSet<&'static str>,
    /// Renderers that took part.
    pub versions: BTreeMap<String, String>,
}

impl Climber<'_> {
    /// Renders `subject` by all `methods`; `save` is told of the scene after every picture.
    pub fn climb(
        &mut self,
        subject: &Subject,
        methods: &[Method],
        mut save: impl FnMut(&Scene, &BTreeMap<String, String>) -> Result<()>,
    ) -> Result<Scene> {
        let mut scene = subject.result();
        scene.curves = methods.iter().map(curve).collect();
        let mut climbing = vec![true; methods.len()];
        for step in 0.. {
            let mut rendered = Vec::new();
            for (i, method) in methods.iter().enumerate() {
                if !climbing[i] || step >= method.ladder.len() || self.absent.contains(method.key) {
                    continue;
                }
                match self.picture(subject, method, step, &mut scene.curves[i])? {
                    Some(told) => {
                        climbing[i] = told.seconds <= self.longest;
                        rendered.push((i, vec![told]));
                    }
                    None => climbing[i] = false,
                }
                save(&scene, &self.versions)?;
            }
            if rendered.is_empty() {
                break;
            }
            self.repeat(subject, methods, step, &mut rendered)?;
            for (i, runs) in rendered {
                if let Some(point) = scene.curves[i].points.last_mut() {
                    let told = measure::median(runs);
                    (point.seconds, point.stages, point.peak_mb) = (told.seconds, told.stages, told.peak_mb);
                }
            }
            save(&scene, &self.versions)?;
        }
        scene.curves.retain(|curve| !(curve.points.is_empty() && curve.notes.is_empty()));
        let truth = subject.truth()?;
        for curve in &mut scene.curves {
            if is_black(&truth) {
                let note = "the reference is black: 1 % of error or bias stands for 0.01 cd/m² of light where none is";
                curve.notes.push(note.into());
            }
            sanity::judge(curve, &truth, self.out)?;
        }
        save(&scene, &self.versions)?;
        Ok(scene)
    }

    /// One picture and its point at the end of `curve`; `None`, with a note where it is worth one, if there is none.
    fn picture(
        &mut self,
        subject: &Subject,
        method: &Method,
        step: usize,
        curve: &mut Curve,
    ) -> Result<Option<Told>> {
        let rung = &method.ladder[step];
        let name = format!("{}-{}.exr", method.key, step + 1);
        let picture = PathBuf::from("pictures").join(&subject.name).join(name);
        let told = match self.render(subject, method, step, &self.out.join(&picture))? {
            Outcome::Done(told) => told,
            Outcome::Absent(why) => {
                println!("{} does not take part: {why}", method.key);
                self.absent.insert(method.key);
                return Ok(None);
            }
            Outcome::Failed(why) => {
                println!("{:18} {:14} {:14} {why}", subject.name, method.key, rung.setting);
                curve.notes.push(format!("{}: {why}", rung.setting));
                return Ok(None);
            }
        };
        let held = raytrace::exr::read_rgb(&self.out.join(&picture))
            .map_err(anyhow::Error::from)
            .and_then(|image| measure::point(&told, &image, &subject.truth()?));
        let mut point = match held {
            Ok(point) => point,
            Err(error) => {
                curve.notes.push(format!("{}: {error:#}", rung.setting));
                return Ok(None);
            }
        };
        point.setting = told.setting.clone().unwrap_or_else(|| rung.setting.clone());
        point.picture = Some(picture);
        println!(
            "{:18} {:14} {:14} {:8.2} s {:6.0} MB   error {:7.3} %   bias {:+7.3} %",
            subject.name,
            method.key,
            point.setting,
            point.seconds,
            point.peak_mb,
            100.0 * point.error,
            100.0 * point.bias
        );
        curve.points.push(point);
        for note in &told.notes {
            if !curve.notes.contains(note) {
                curve.notes.push(note.clone());
            }
        }
        if let (Some(version), Program::Peer(name)) = (&told.version, method.program) {
            self.versions.insert(name.into(), version.clone());
        }
        Ok(Some(told))
    }

    /// Renders `step` again by all methods that were quick at it, in turn.
    fn repeat(
        &self,
        subject: &Subject,
        methods: &[Method],
        step: usize,
        rendered: &mut [(usize, Vec<Told>)],
    ) -> Result<()> {
        let spare = self.out.join("pictures/again.exr");
        for _ in 1..measure::TIMES {
            for (i, runs) in rendered.iter_mut().filter(|(_, runs)| runs[0].seconds < measure::SHORT) {
                if let Outcome::Done(told) = self.render(subject, &methods[*i], step, &spare)? {
                    runs.push(told);
                }
            }
        }
        Ok(())
    }

    fn render(&self, subject: &Subject, method: &Method, step: usize, out: &Path) -> Result<Outcome> {
        if let Some(folder) = out.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let shot = Shot { subject, threads: self.threads, seed: 1, out };
        // A rung costs about four times the one below it; beyond twice that, something hangs.
        let limit = Duration::from_secs_f64(8.0 * self.longest + 60.0);
        measure::render(method.program, &method.ladder[step], shot, limit)
    }
}

/// A curve without points yet.
fn curve(method: &Method) -> Curve {
    Curve {
        method: method.key.into(),
        label: method.label.into(),
        ours: method.program == Program::Twolight,
        comparable: true,
        ..Curve::default()
    }
}
