//! `twolight measure`: illuminance at points, on planes and on surfaces.

mod picture;
mod report;
mod sets;

use super::print;
use crate::args::MeasureArgs;
use crate::job::AskedWrongly;
use crate::progress::Bars;
use crate::room::{Room, start_threads};
use crate::solutions;
use anyhow::{Context, Result};
use geometry::World;
use radiosity::Solution;
use raytrace::Progress;
use raytrace::measure::{Meter, Reading, Sensor, prepass, surface};
use raytrace::output::{check_writable, write_atomically};
use sets::{Set, Spot, Taken};
use std::path::Path;
use std::process::ExitCode;

/// Streams of random numbers from here on are for the other sides of surfaces.
const BEHIND: u64 = 1 << 40;

/// Runs the command; failure if the user stopped it.
pub fn run(args: MeasureArgs) -> Result<ExitCode> {
    check(&args)?;
    let listed = args.points.as_deref().map(sets::read_points).transpose()?;
    let bars = Bars::new(args.run.quiet);
    start_threads(args.run.threads)?;
    bars.listen_for_interrupts();
    let Room { world, warnings, .. } = Room::open(&args.scene, &args.which, &args.light, &bars)?;
    sets::check_names(&world.scene, &args.surface)?;

    // Planes before light: whoever typed a wrong one need not wait for the solution.
    let mut sets = sets::in_the_air(&world, &args, listed)?;
    let solution = match &args.solution {
        Some(path) => solutions::read(path, &world)?.0,
        None => prepass(&world, args.error, args.run.seed, &bars)
            .with_context(|| format!("cannot solve {}", args.scene.display()))?,
    };
    sets.extend(sets::on_surfaces(&world, &solution, &args)?);
    if sets.iter().all(|set| set.places.is_empty()) {
        anyhow::bail!("no point is left: all lie within objects or behind walls (--keep-all keeps them)");
    }

    let meter = Meter::new(&world, &solution, args.error, args.run.seed);
    bars.stage("measure", sets.iter().map(|set| set.places.len() as u64).sum());
    let mut first = 0;
    let mut taken = Vec::new();
    for set in &sets {
        let sensors: Vec<_> = set.places.iter().map(|p| p.sensor).collect();
        let readings = meter.read_all(&sensors, first, &bars);
        let Some(readings) = readings else {
            bars.done();
            anyhow::bail!("stopped before all points were measured: nothing is written");
        };
        taken.push(with_luminance(&world, &meter, set, readings, first));
        first += sensors.len() as u64;
    }
    bars.done();
    notes(&world, &solution, &args, &sets, &taken, &bars);

    let sets: Vec<(Set, Vec<Taken>)> = sets.into_iter().zip(taken).collect();
    if let Some(path) = &args.output {
        write_atomically(path, report::csv(&sets)?.as_bytes())?;
    }
    let pictures = match &args.false_colour {
        Some(path) => picture::draw(&sets, &args, path)?,
        None => vec![None; sets.len()],
    };
    print(&match args.run.json {
        true => serde_json::to_string_pretty(&report::json(&args, warnings, &sets, &pictures))?,
        false => report::table(&sets),
    })?;
    Ok(ExitCode::SUCCESS)
}

/// What can be checked before the scene is read.
fn check(args: &MeasureArgs) -> Result<()> {
    let wrong = |message: String| Err(AskedWrongly(message).into());
    let in_the_air = args.point.len() + args.workplane.len() + args.plane.len();
    if in_the_air + args.surface.len() == 0 && args.points.is_none() {
        return wrong("say where to measure: --point, --points, --workplane, --plane or --surface".into());
    }
    if args.normal.length() < 1e-6 {
        return wrong("--normal is a direction, not 0,0,0".into());
    }
    if args.false_colour.is_none() && (args.colours.max.is_some() || args.colours.isolines.is_some()) {
        return wrong("--max and --isolines steer --false-colour OUT.png".into());
    }
    let ends = |path: &Path, ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    for (path, ending) in [(&args.output, "csv"), (&args.false_colour, "png")] {
        let Some(path) = path else { continue };
        if !ends(path, ending) {
            return wrong(format!(
                "{} is written as {}: name it .{ending}",
                path.display(),
                ending.to_uppercase()
            ));
        }
        check_writable(path)?;
    }
    if !args.scene.is_file() {
        let why = if args.scene.is_dir() { "it is a folder" } else { "there is no such file" };
        anyhow::bail!("cannot read {}: {why}", args.scene.display());
    }
    Ok(())
}

/// Readings with the luminance of the places that lie on a surface that was asked for; `first` seeds what is read on
/// their other sides.
fn with_luminance(world: &World, meter: &Meter, set: &Set, readings: Vec<Reading>, first: u64) -> Vec<Taken> {
    let sensor = |spot: &Spot| spot.on.as_ref().and_then(|place| surface::behind(world, place));
    let behind: Vec<Option<Sensor>> = set.places.iter().map(sensor).collect();
    let sensors: Vec<Sensor> = behind.iter().flatten().copied().collect();
    let mut through = meter.read_all(&sensors, BEHIND + first, &()).unwrap_or_default().into_iter();
    let spots = set.places.iter().zip(behind).zip(readings);
    let taken = spots.map(|((spot, behind), reading)| {
        let through = behind.and_then(|_| through.next());
        let shown = |place| surface::luminance(world, place, &reading, through.as_ref());
        Taken { reading, luminance: spot.on.as_ref().map(shown) }
    });
    taken.collect()
}

/// What was measured less well than asked.
fn notes(
    world: &World,
    solution: &Solution,
    args: &MeasureArgs,
    sets: &[Set],
    taken: &[Vec<Taken>],
    bars: &Bars,
) {
    let noisy = |t: &&Taken| 2.0 * t.reading.standard_error > 1.001 * args.error * t.reading.illuminance();
    let count = taken.iter().flatten().filter(noisy).count();
    if count > 0 {
        bars.note(&format!(
            "note: {count} points are noisier than the {} % asked; each line's standard error says how much",
            100.0 * args.error
        ));
    }
    let in_the_air = sets.iter().flat_map(|s| &s.places).any(|p| !p.sensor.on_surface);
    if in_the_air && !world.scene.lights.is_empty() && !solution.caustics.is_empty() {
        bars.note(
            "note: light of point, spot and sun lamps by way of mirrors and bent by glass is measured on surfaces only, \
             not in mid-air",
        );
    }
}
