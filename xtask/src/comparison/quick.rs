//! `--quick` and `--baseline`: is this state worse than the last one was? Our own binary, a few fixed settings, the
//! references in `assets/`. Times are shown and never judged: they belong to the machine and the day.

use super::baseline::{Baseline, Entry, SEEDS, Spread};
use super::measure::{self, Outcome};
use super::method::{Program, Rung, Shot};
use super::results::Point;
use super::scene::Subject;
use super::{machine, sanity};
use anyhow::{Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What is rendered of each scene: the two-pass method as most people use it, and the path tracer, so that a change
/// in one of them, or in what they share, can be told apart. Rough settings find a wrong factor as well as fine ones.
const SETTINGS: [&[&str]; 2] = [&["--error", "5%"], &["--integrator", "path", "--spp", "16"]];
/// The seed of `--quick`; not among those of the baseline, which are counted from 1.
const SEED: u64 = 1000;

/// The committed baseline.
fn file() -> PathBuf {
    crate::root().join("assets/reference/baseline.json")
}

/// Renders every subject by every setting, and fails, naming them, if one is worse than its baseline.
pub fn check(subjects: &[Subject], threads: u32) -> Result<()> {
    let (baseline, begin) = (Baseline::read(&file())?, Instant::now());
    let folder = tempfile::tempdir()?;
    let mut complaints = Vec::new();
    for (subject, args) in cases(subjects) {
        let setting = args.join(" ");
        let Some(entry) = baseline.entry(&subject.name, &setting) else {
            complaints.push(format!(
                "{}, {setting}: not in the baseline (write a new one by --baseline)",
                subject.name
            ));
            continue;
        };
        let point = picture(subject, args, threads, SEED, folder.path())?;
        println!(
            "{:18} {setting:26} {:6.1} s   error {:7.3} % (at most {:7.3})   bias {:+7.3} % ({:+7.3} ± {:.3})",
            subject.name,
            point.seconds,
            100.0 * point.error,
            100.0 * (entry.error.mean + entry.error_noise()),
            100.0 * point.bias,
            100.0 * entry.bias.mean,
            100.0 * entry.bias_noise()
        );
        complaints.extend(entry.complaints(point.error, point.bias));
    }
    ensure!(
        complaints.is_empty(),
        "worse than the baseline of commit {}:\n  {}",
        baseline.commit,
        complaints.join("\n  ")
    );
    println!(
        "no picture is worse than at commit {}; {:.0} s",
        baseline.commit,
        begin.elapsed().as_secs_f64()
    );
    Ok(())
}

/// Measures every subject by every setting with several seeds, and writes the baseline. Entries of other scenes stay.
pub fn write(subjects: &[Subject], threads: u32) -> Result<()> {
    // Now: by the end, someone may have gone on to edit.
    let commit = machine::commit();
    let old = Baseline::read(&file()).unwrap_or_default();
    let folder = tempfile::tempdir()?;
    let mut entries = Vec::new();
    for (subject, args) in cases(subjects) {
        let points = (1..=SEEDS).map(|seed| picture(subject, args, threads, seed, folder.path()));
        let points = points.collect::<Result<Vec<Point>>>()?;
        let spread = |number: fn(&Point) -> f64| Spread::of(&points.iter().map(number).collect::<Vec<_>>());
        let entry = Entry {
            scene: subject.name.clone(),
            setting: args.join(" "),
            error: spread(|p| p.error),
            bias: spread(|p| p.bias),
        };
        println!(
            "{:18} {:26} error {:7.3} ± {:.3} %   bias {:+7.3} ± {:.3} %   (standard deviations)",
            entry.scene,
            entry.setting,
            100.0 * entry.error.mean,
            100.0 * entry.error.deviation,
            100.0 * entry.bias.mean,
            100.0 * entry.bias.deviation
        );
        entries.push(entry);
    }
    let measured =
        |old: &Entry| entries.iter().any(|new| (&new.scene, &new.setting) == (&old.scene, &old.setting));
    let kept: Vec<Entry> = old.entries.into_iter().filter(|entry| !measured(entry)).collect();
    entries.extend(kept);
    entries.sort_by(|a, b| (&a.scene, &a.setting).cmp(&(&b.scene, &b.setting)));
    Baseline { commit, entries }.write(&file())
}

fn cases(subjects: &[Subject]) -> impl Iterator<Item = (&Subject, &'static [&'static str])> {
    subjects.iter().flat_map(|subject| SETTINGS.map(|args| (subject, args)))
}

/// One picture; here a renderer that fails is the end, for it is ours.
fn picture(subject: &Subject, args: &[&str], threads: u32, seed: u64, folder: &Path) -> Result<Point> {
    let out = folder.join("picture.exr");
    let shot = Shot { subject, threads, seed, out: &out };
    let rung = Rung { setting: args.join(" "), args: args.iter().map(|s| s.to_string()).collect() };
    let told = match measure::render(Program::Twolight, &rung, shot, Duration::from_secs(600))? {
        Outcome::Done(told) => told,
        Outcome::Absent(why) | Outcome::Failed(why) => bail!("{}, {}: {why}", subject.name, rung.setting),
    };
    let (image, truth) = (raytrace::exr::read_rgb(&out)?, subject.truth()?);
    if let Some(shift) = sanity::find(&image, &truth).and_then(|finding| finding.shift) {
        ensure!(
            shift.iter().all(|s| s.abs() <= sanity::SHIFT_TOLERANCE),
            "{}, {}: shifted by {shift:.2?} pixels",
            subject.name,
            rung.setting
        );
    }
    measure::point(&told, &image, &truth)
}
