//! Readings of a grid in false colour.

use super::report::{short, statistics};
use super::sets::{Set, Taken};
use crate::args::{FalseColourArgs, MeasureArgs};
use crate::commands::false_colour::chart;
use crate::job::{AskedWrongly, with_name};
use anyhow::Result;
use raytrace::false_colour::Field;
use raytrace::measure::grid::Grid;
use std::path::{Path, PathBuf};

/// Pixels of a plane's longer side, about.
const SIDE: f32 = 720.0;

/// Draws every set that has a grid; the file of each, in their order.
pub fn draw(sets: &[(Set, Vec<Taken>)], args: &MeasureArgs, path: &Path) -> Result<Vec<Option<PathBuf>>> {
    let several = sets.iter().filter(|(set, _)| set.grid.is_some()).count() > 1;
    let mut files = Vec::new();
    for (set, taken) in sets {
        let Some(grid) = &set.grid else {
            files.push(None);
            continue;
        };
        let path = if several { with_name(path, &set.name) } else { path.to_path_buf() };
        one(set, taken, grid, &args.colours, args.spacing, &path)?;
        files.push(Some(path));
    }
    match files.iter().all(Option::is_none) {
        true => {
            Err(AskedWrongly("--false-colour draws planes and flat surfaces, and there is none".into())
                .into())
        }
        false => Ok(files),
    }
}

fn one(
    set: &Set,
    taken: &[Taken],
    grid: &Grid,
    colours: &FalseColourArgs,
    spacing: f32,
    path: &Path,
) -> Result<()> {
    let mut values = vec![None; grid.len()];
    for (spot, t) in set.places.iter().zip(taken) {
        values[spot.cell] = Some(t.reading.illuminance());
    }
    let (width, height) = (grid.across.length(), grid.up.length());
    let per_metre = SIDE / width.max(height);
    let pixels = |edge: f32, cells: usize| (edge / cells as f32 * per_metre).round().max(1.0) as usize;
    let (across, up) = (pixels(width, grid.columns), pixels(height, grid.rows));
    let field = Field::of_grid(grid.columns, grid.rows, &values, across, up);
    let mut chart = chart(field, colours, 0.0);
    if colours.isolines.is_none() {
        let ticks = chart.scale.ticks();
        chart.isolines = ticks.into_iter().filter(|t| *t > 0.0).collect();
    }
    let s = statistics(taken);
    chart.title = format!("Illuminance, {}", set.name);
    chart.unit = "lx".into();
    chart.pixels_per_metre = Some(across as f32 * grid.columns as f32 / width);
    let [min, mean, max] = [s.min, s.mean, s.max].map(|v| short(v as f32));
    chart.caption = vec![
        format!("min {min}   mean {mean}   max {max} lx"),
        format!("U0 {:.2}   Ud {:.2}", s.uniformity(), s.diversity()),
        format!("{} points {spacing} m apart, noise {:.1} %", s.points, 100.0 * s.noise),
    ];
    chart.write(path)?;
    Ok(())
}
