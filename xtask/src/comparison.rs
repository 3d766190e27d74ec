//! `cargo xtask reference-comparison`: how fast, how exact, compared with what.
//!
//! Every picture is made by a whole process (`twolight`, or another renderer by its script in `xtask/peers`), timed
//! from start to end, and held against a reference by the metric of `twolight compare`. What was found is written to
//! `results.json` after every picture, so that nothing is lost when a run is stopped, and shown by `index.html`.

mod anywhere;
mod baseline;
mod climb;
mod machine;
mod measure;
mod method;
mod peer;
mod process;
mod quick;
pub mod report;
pub mod results;
mod sanity;
mod scaling;
mod scene;

use anyhow::{Context, Result, ensure};
use anywhere::Making;
use clap::builder::PossibleValuesParser;
use climb::Climber;
use method::Method;
pub use process::{Measured, measured};
use results::{Results, Scene};
use scene::Subject;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::process::Command;

/// What to compare.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  cargo xtask reference-comparison                             all of it, under an hour on two cores
  cargo xtask reference-comparison --only cornell-box --peers none --longest 5
  cargo xtask reference-comparison --quick                     is this state worse than the last?
  cargo xtask reference-comparison --keep --methods none --peers none --scaling
  cargo xtask reference-comparison --scenes my-rooms --reference-seconds 120
  cargo xtask reference-comparison --report                    the page once more, from results.json

Every other renderer that is installed takes part unless --peers says otherwise. None is needed;
the scripts in xtask/peers say how to install them. The page is index.html in the folder of --out.")]
pub struct Args {
    /// Is this state worse than the last? Our errors beside assets/reference/baseline.json, in under two minutes;
    /// fails, naming scenes and numbers, if one rose by more than noise
    #[arg(long, conflicts_with_all = ["baseline", "report"])]
    quick: bool,
    /// Write that baseline anew: every scene with a dozen seeds
    #[arg(long, conflicts_with = "report")]
    baseline: bool,
    /// Scenes of your own, .gltf and .glb, in place of those in assets/; Mitsuba makes their references
    #[arg(long, value_name = "DIR", conflicts_with_all = ["quick", "baseline"])]
    scenes: Option<PathBuf>,
    /// How long Mitsuba may take for a reference of --scenes; it is kept in target/own-references
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, requires = "scenes")]
    reference_seconds: f64,
    /// Only these scenes, by the stems of their files
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    only: Vec<String>,
    /// Only these methods of ours: vertex, split, gather, path; or none
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "all")]
    methods: Vec<String>,
    /// Other renderers: mitsuba, mitsuba-oidn, cycles, cycles-oidn, luxcore, povray, radiance; or none
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "all")]
    peers: Vec<String>,
    /// Threads of every renderer; one for each processor if absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// A method whose run took longer than this climbs its ladder of settings no further
    #[arg(long, value_name = "SECONDS", default_value_t = 12.0)]
    longest: f64,
    /// Also measure how time, memory and error grow with triangles, lights and so on: with all of these, or only some. Sweeps
    /// heed neither --methods nor --peers: `tour`, views of the gallery, runs other renderers too
    #[arg(long, value_name = "SWEEP,...", num_args = 0..=1, default_missing_value = scaling::ALL, value_delimiter = ',')]
    #[arg(value_parser = PossibleValuesParser::new(scaling::names()))]
    #[arg(conflicts_with_all = ["quick", "baseline", "report", "scenes"])]
    scaling: Vec<String>,
    /// Keep what results.json in --out already holds, but for the curves measured now
    #[arg(long)]
    keep: bool,
    /// Measure nothing: write the page anew from results.json
    #[arg(long)]
    report: bool,
    /// Folder for results.json, index.html and the pictures
    #[arg(long, value_name = "DIR", default_value = "target/reference-comparison")]
    out: PathBuf,
}

/// Does what was asked.
pub fn run(args: Args) -> Result<()> {
    let out = crate::root().join(&args.out);
    let file = out.join("results.json");
    if args.report {
        return report::write(&Results::read(&file)?, &out);
    }
    let threads = args.threads.unwrap_or_else(machine::cores);
    if args.quick || args.baseline {
        build()?;
        let subjects = subjects(&args)?;
        return if args.quick { quick::check(&subjects, threads) } else { quick::write(&subjects, threads) };
    }
    let methods = chosen(method::ours(), &args.methods)?;
    let peers = chosen(peer::all(), &args.peers)?;
    let methods: Vec<Method> = methods.into_iter().chain(peers).collect();
    build()?;
    std::fs::create_dir_all(&out).with_context(|| format!("making {}", out.display()))?;

    let before = if args.keep && file.is_file() { Results::read(&file)? } else { Results::default() };
    let commit = machine::commit();
    if !before.commit.is_empty() && before.commit != commit {
        println!("note: what is kept was measured at commit {}, not at {commit}", before.commit);
    }
    let mut results =
        Results { commit, date: machine::date(), machine: machine::machine(), threads, ..before };
    results.versions.insert("twolight".into(), format!("{} ({})", env!("CARGO_PKG_VERSION"), results.commit));

    let mut climber = Climber {
        threads,
        longest: args.longest,
        out: &out,
        absent: BTreeSet::new(),
        versions: BTreeMap::new(),
    };
    let subjects = subjects(&args)?;
    for subject in subjects.iter().filter(|_| !methods.is_empty()) {
        climber.climb(subject, &methods, |scene, versions| {
            results.versions.extend(versions.clone());
            put(&mut results.scenes, scene);
            results.write(&file)
        })?;
    }
    if results.rays.is_empty() && args.only.is_empty() && args.scenes.is_none() {
        results.rays = crate::bench_rays::speeds()?;
        results.write(&file)?;
    }
    if !args.scaling.is_empty() {
        let sweeps = &args.scaling;
        let settings =
            scaling::Settings { sweeps, threads, longest: args.longest, out: &out, known: &subjects };
        scaling::run(&settings, |sweep| {
            match results.scaling.iter_mut().find(|old| old.name == sweep.name) {
                Some(old) => *old = sweep.clone(),
                None => results.scaling.push(sweep.clone()),
            }
            results.write(&file)
        })?;
    }
    report::write(&results, &out)?;
    println!("\n{}", out.join("index.html").display());
    Ok(())
}

/// The scenes asked for.
fn subjects(args: &Args) -> Result<Vec<Subject>> {
    if let Some(folder) = &args.scenes {
        let threads = args.threads.unwrap_or_else(machine::cores);
        let making = Making { threads, seconds: args.reference_seconds };
        return anywhere::of_folder(folder, &args.only, making);
    }
    let mut subjects = scene::of_assets(&crate::root().join("assets"))?;
    let names: Vec<String> = subjects.iter().map(|s| s.name.clone()).collect();
    for name in &args.only {
        ensure!(names.contains(name), "no scene {name:?} with a reference; there are {}", names.join(", "));
    }
    subjects.retain(|s| args.only.is_empty() || args.only.contains(&s.name));
    Ok(subjects)
}

/// Those of `methods` whose keys `asked` names; `all` and `none` mean what they say.
fn chosen(methods: Vec<Method>, asked: &[String]) -> Result<Vec<Method>> {
    let keys: Vec<&str> = methods.iter().map(|method| method.key).collect();
    for name in asked {
        let known = keys.contains(&name.as_str()) || name == "all" || name == "none";
        ensure!(known, "no method {name:?}; there are {}", keys.join(", "));
    }
    let all = asked.iter().any(|name| name == "all");
    Ok(methods.into_iter().filter(|method| all || asked.iter().any(|name| name == method.key)).collect())
}

/// Builds what is measured.
fn build() -> Result<()> {
    let status = Command::new("cargo")
        .args(["build", "--release", "--package", "twolight"])
        .current_dir(crate::root())
        .status()
        .context("starting cargo")?;
    ensure!(status.success(), "twolight does not build");
    Ok(())
}

/// Puts what was measured of a scene into the results: its curves replace those of the same method.
fn put(scenes: &mut Vec<Scene>, measured: &Scene) {
    if !scenes.iter().any(|scene| scene.name == measured.name) {
        scenes.push(Scene { curves: Vec::new(), ..measured.clone() });
    }
    let Some(scene) = scenes.iter_mut().find(|scene| scene.name == measured.name) else { return };
    let mut curves = std::mem::take(&mut scene.curves);
    // A renderer that is not installed, or whose turn has not come, has neither.
    for curve in measured.curves.iter().filter(|curve| !(curve.points.is_empty() && curve.notes.is_empty())) {
        match curves.iter_mut().find(|old| old.method == curve.method) {
            Some(old) => *old = curve.clone(),
            None => curves.push(curve.clone()),
        }
    }
    *scene = Scene { curves, ..measured.clone() };
}

#[cfg(test)]
mod tests {
    use super::*;
    use results::{Curve, Point};

    fn scene(curves: &[(&str, usize)]) -> Scene {
        let curve = |&(method, points): &(&str, usize)| Curve {
            method: method.into(),
            points: vec![Point::default(); points],
            ..Curve::default()
        };
        Scene { name: "room".into(), curves: curves.iter().map(curve).collect(), ..Scene::default() }
    }

    #[test]
    fn what_was_measured_replaces_what_was_known() {
        let mut scenes = vec![scene(&[("split", 1), ("path", 2)])];
        put(&mut scenes, &scene(&[("split", 3), ("path", 0), ("mitsuba", 4)]));
        let found: Vec<_> = scenes[0].curves.iter().map(|c| (c.method.as_str(), c.points.len())).collect();
        assert_eq!(found, [("split", 3), ("path", 2), ("mitsuba", 4)]);
        put(&mut scenes, &Scene { name: "hall".into(), ..Scene::default() });
        assert_eq!(scenes.len(), 2);
    }

    #[test]
    fn methods_are_chosen_by_name() {
        let keys = |asked: &[&str]| -> Vec<&str> {
            let asked: Vec<String> = asked.iter().map(|s| s.to_string()).collect();
            chosen(method::ours(), &asked).unwrap().iter().map(|m| m.key).collect()
        };
        assert_eq!(keys(&["all"]).len(), method::ours().len());
        assert_eq!(keys(&["path", "split"]), ["split", "path"]);
        assert!(keys(&["none"]).is_empty());
        let error = chosen(peer::all(), &["blender".into()]).unwrap_err().to_string();
        assert!(error.contains("blender") && error.contains("cycles"), "{error}");
    }
}
