//! Where to measure: sets of points, from what was typed.

use crate::args::MeasureArgs;
use crate::job::AskedWrongly;
use anyhow::{Context, Result};
use geometry::{Scene, Vec3, World};
use radiosity::Solution;
use radiosity::element::Side;
use raytrace::measure::grid::{Grid, floor_level, has_floor, has_room, is_free};
use raytrace::measure::surface::{self, Place};
use raytrace::measure::{Reading, Sensor};
use std::path::Path;

/// Points that statistics are made of together.
#[derive(Debug)]
pub struct Set {
    /// For tables, and for file names.
    pub name: String,
    /// `points`, `workplane`, `plane` or `surface`.
    pub kind: &'static str,
    /// Where.
    pub places: Vec<Spot>,
    /// Cells that the places lie in.
    pub grid: Option<Grid>,
    /// Points that were left out.
    pub left_out: usize,
}

/// One point.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// What is measured with.
    pub sensor: Sensor,
    /// Number of its cell in the grid.
    pub cell: usize,
    /// The place on a surface that was asked for.
    pub on: Option<Place>,
}

/// What was measured at one point.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Illuminance.
    pub reading: Reading,
    /// Luminance along the normal, cd/m², of a surface.
    pub luminance: Option<f32>,
}

impl Set {
    fn new(name: String, kind: &'static str, grid: Option<Grid>, spots: Vec<Option<Spot>>) -> Set {
        let all = spots.len();
        let places: Vec<Spot> = spots.into_iter().flatten().collect();
        Set { name, kind, grid, left_out: all - places.len(), places }
    }
}

/// The points and planes that were asked for; `listed` are those of a file.
pub fn in_the_air(world: &World, args: &MeasureArgs, listed: Option<Vec<[Vec3; 2]>>) -> Result<Vec<Set>> {
    let mut sets = Vec::new();
    let typed: Vec<[Vec3; 2]> = args.point.iter().map(|&p| [p, args.normal.normalize()]).collect();
    let points: Vec<[Vec3; 2]> = typed.into_iter().chain(listed.into_iter().flatten()).collect();
    if !points.is_empty() {
        // Whoever names a point wants to know of it, wherever it is.
        let spot = |(cell, [p, n]): (usize, [Vec3; 2])| {
            Some(Spot { sensor: Sensor::at(world, p, n), cell, on: None })
        };
        sets.push(Set::new(
            "points".into(),
            "points",
            None,
            points.into_iter().enumerate().map(spot).collect(),
        ));
    }
    for &height in &args.workplane {
        let y = args.floor.unwrap_or_else(|| floor_level(world)) + height;
        let whole = Grid::level(world, y, args.spacing)
            .map_err(|e| AskedWrongly(format!("--workplane {height}: {e}")))?;
        let has_room = |s: &Sensor| args.margin == 0.0 || has_room(world, s, args.margin);
        let keep = |s: &Sensor| args.keep_all || (is_free(world, s) && has_floor(world, s) && has_room(s));
        let (grid, sensors) = whole.cropped(&whole.sensors(world, keep));
        let name = match height == y {
            true => format!("work plane {height} m"),
            false => format!("work plane {height} m (y = {})", (100.0 * y).round() / 100.0),
        };
        sets.push(plane(name, "workplane", grid, sensors));
    }
    for (i, &[corner, across, up]) in args.plane.iter().enumerate() {
        let grid = Grid::new(corner, across, up, args.spacing)
            .map_err(|e| AskedWrongly(format!("--plane {}: {e}", i + 1)))?;
        let keep = |s: &Sensor| args.keep_all || is_free(world, s);
        sets.push(plane(format!("plane {}", i + 1), "plane", grid, grid.sensors(world, keep)));
    }
    Ok(sets)
}

fn plane(name: String, kind: &'static str, grid: Grid, sensors: Vec<Option<Sensor>>) -> Set {
    let sensors = sensors.into_iter().enumerate();
    let spots = sensors.map(|(cell, sensor)| Some(Spot { sensor: sensor?, cell, on: None }));
    Set::new(name, kind, Some(grid), spots.collect())
}

/// The surfaces that were asked for, a set for each lit side.
pub fn on_surfaces(world: &World, solution: &Solution, args: &MeasureArgs) -> Result<Vec<Set>> {
    let mut sets = Vec::new();
    for name in &args.surface {
        let triangles = surface::triangles_named(&world.scene, name);
        let area: f64 = triangles.iter().map(|&t| f64::from(world.scene.mesh.area(t))).sum();
        let points = area / f64::from(args.spacing).powi(2);
        if points > raytrace::measure::grid::MOST as f64 {
            let message =
                format!("--surface {name:?} has {area:.0} m2, {points:.0} points: take a larger --spacing");
            return Err(AskedWrongly(message).into());
        }
        let sheets = surface::sheets(world, solution, &triangles, args.spacing, args.keep_all);
        let several = sheets.len() > 1;
        for sheet in sheets {
            let side = if sheet.side == Side::Front { "front" } else { "back" };
            let name = if several { format!("{name} {side}") } else { name.clone() };
            let places = sheet.places.into_iter().enumerate();
            let spots = places.map(|(cell, place)| Some(Spot { sensor: place?.sensor, cell, on: place }));
            sets.push(Set::new(name, "surface", sheet.grid, spots.collect()));
        }
    }
    Ok(sets)
}

/// Fails for a name that the scene does not have, with those that it has.
pub fn check_names(scene: &Scene, wanted: &[String]) -> Result<()> {
    const SHOWN: usize = 60;
    for name in wanted {
        if surface::triangles_named(scene, name).is_empty() {
            let names = surface::names(scene);
            let more = if names.len() > SHOWN {
                format!(" and {} more", names.len() - SHOWN)
            } else {
                String::new()
            };
            let names: Vec<String> = names.iter().take(SHOWN).map(|n| format!("{n:?}")).collect();
            let message =
                format!("no node or material is called {name:?}; there are {}{more}", names.join(", "));
            return Err(AskedWrongly(message).into());
        }
    }
    Ok(())
}

/// Points and normals of a file: x,y,z in each line, or x,y,z,nx,ny,nz and whatever follows. A first line that is no
/// numbers is a heading, and # begins a remark.
pub fn read_points(path: &Path) -> Result<Vec<[Vec3; 2]>> {
    let file = std::fs::File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(file);
    let mut points = Vec::new();
    for (i, record) in reader.records().enumerate() {
        let record = record.with_context(|| format!("cannot read {}", path.display()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let numbers: Option<Vec<f32>> = record.iter().take(6).map(|v| v.parse().ok()).collect();
        let numbers = match numbers {
            Some(numbers) if numbers.iter().all(|v| v.is_finite()) => numbers,
            None if i == 0 => continue,
            _ => anyhow::bail!("{}, line {line}: {:?} are no numbers", path.display(), record.as_slice()),
        };
        let vector = |at: usize| Vec3::new(numbers[at], numbers[at + 1], numbers[at + 2]);
        match (record.len(), numbers.len()) {
            (3, _) => points.push([vector(0), Vec3::Y]),
            (_, 6) if vector(3).length() > 1e-6 => points.push([vector(0), vector(3).normalize()]),
            (_, 6) => anyhow::bail!("{}, line {line}: the normal 0,0,0 is no direction", path.display()),
            (n, _) => anyhow::bail!("{}, line {line}: 3 or 6 numbers are wanted, not {n}", path.display()),
        }
    }
    anyhow::ensure!(!points.is_empty(), "{} has no points", path.display());
    Ok(points)
}
