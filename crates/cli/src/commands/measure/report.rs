//! Readings as a table, as CSV and as JSON.

use super::sets::{Set, Spot, Taken};
use crate::args::MeasureArgs;
use anyhow::Result;
use raytrace::measure::Statistics;
use serde::Serialize;
use std::path::PathBuf;

/// Single points of the table at most; a file takes more.
const LISTED: usize = 40;

/// Illuminance of a set.
pub fn statistics(taken: &[Taken]) -> Statistics {
    Statistics::of(
        taken.iter().map(|t| (f64::from(t.reading.illuminance()), f64::from(t.reading.standard_error))),
    )
}

/// Luminance of a set, of a surface.
fn luminances(taken: &[Taken]) -> Option<Statistics> {
    let values: Option<Vec<f64>> = taken.iter().map(|t| t.luminance.map(f64::from)).collect();
    values.filter(|v| !v.is_empty()).map(|v| Statistics::of(v.into_iter().map(|v| (v, 0.0))))
}

/// What stdout shows.
pub fn table(sets: &[(Set, Vec<Taken>)]) -> String {
    let mut text = String::new();
    for (set, taken) in sets.iter().filter(|(set, _)| set.kind == "points") {
        for (spot, t) in set.places.iter().zip(taken).take(LISTED) {
            let [direct, indirect, specular] = parts(t).map(short);
            text += &format!(
                "({}) facing ({}): {} lx ± {} (direct {direct}, indirect {indirect}, specular {specular})\n",
                numbers(spot.sensor.position),
                numbers(spot.sensor.normal),
                short(t.reading.illuminance()),
                short(t.reading.standard_error),
            );
        }
        if taken.len() > LISTED {
            text += &format!("and {} more (-o writes them all)\n", taken.len() - LISTED);
        }
    }
    let rows: Vec<_> = sets.iter().filter(|(set, taken)| set.kind != "points" || taken.len() > 1).collect();
    if rows.is_empty() {
        return text;
    }
    let width = rows.iter().map(|(set, _)| set.name.chars().count() + 7).max().unwrap_or(0).max(24);
    let heading = ["points", "min", "mean", "max", "U0", "Ud", "noise"];
    text += &format!("{:<width$}", "");
    heading.iter().for_each(|h| text += &format!("{h:>9}"));
    for (set, taken) in rows {
        let s = statistics(taken);
        text += &format!("\n{:<width$}{:>9}", format!("{}, lx", set.name), s.points);
        [s.min, s.mean, s.max].iter().for_each(|v| text += &format!("{:>9}", short(*v as f32)));
        text += &format!("{:>9.3}{:>9.3}{:>7.2} %", s.uniformity(), s.diversity(), 100.0 * s.noise);
        if let Some(l) = luminances(taken) {
            text += &format!("\n{:<width$}{:>9}", format!("{}, cd/m2", set.name), "");
            [l.min, l.mean, l.max].iter().for_each(|v| text += &format!("{:>9}", short(*v as f32)));
        }
        if set.left_out > 0 {
            text += &format!("\n{:<width$}{:>9} left out", "", set.left_out);
        }
    }
    text
}

/// Every reading, a line each.
pub fn csv(sets: &[(Set, Vec<Taken>)]) -> Result<String> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record([
        "x",
        "y",
        "z",
        "nx",
        "ny",
        "nz",
        "E_lx",
        "E_direct_lx",
        "E_indirect_lx",
        "E_specular_lx",
        "E_standard_error_lx",
        "L_cd_m2",
        "set",
    ])?;
    for (set, taken) in sets {
        for (spot, t) in set.places.iter().zip(taken) {
            let Spot { sensor, .. } = spot;
            let mut fields: Vec<String> = sensor
                .position
                .to_array()
                .iter()
                .chain(&sensor.normal.to_array())
                .map(f32::to_string)
                .collect();
            fields.push(t.reading.illuminance().to_string());
            fields.extend(parts(t).map(|v| v.to_string()));
            fields.push(t.reading.standard_error.to_string());
            fields.push(t.luminance.map_or(String::new(), |l| l.to_string()));
            fields.push(set.name.clone());
            out.write_record(&fields)?;
        }
    }
    Ok(String::from_utf8(out.into_inner()?)?)
}

/// What `--json` prints.
#[derive(Serialize)]
pub struct Report {
    scene: PathBuf,
    warnings: Vec<String>,
    /// Percent.
    error_asked: f32,
    output: Option<PathBuf>,
    sets: Vec<SetReport>,
}

/// One set, in lx but for its luminance.
#[derive(Serialize)]
struct SetReport {
    name: String,
    kind: &'static str,
    points: usize,
    left_out: usize,
    min: f64,
    mean: f64,
    max: f64,
    u0: f64,
    ud: f64,
    /// Standard error of the mean, lx, and root mean square of the points' over the mean, percent.
    mean_standard_error: f64,
    noise: f64,
    /// Least, mean and greatest, cd/m².
    luminance: Option<[f64; 3]>,
    false_colour: Option<PathBuf>,
    /// Of single points only: all are in the CSV.
    readings: Option<Vec<PointReport>>,
}

#[derive(Serialize)]
struct PointReport {
    position: [f32; 3],
    normal: [f32; 3],
    illuminance: f32,
    direct: f32,
    indirect: f32,
    specular: f32,
    standard_error: f32,
}

/// All of it, for scripts.
pub fn json(
    args: &MeasureArgs,
    warnings: Vec<String>,
    sets: &[(Set, Vec<Taken>)],
    pictures: &[Option<PathBuf>],
) -> Report {
    let point = |(spot, t): (&Spot, &Taken)| {
        let [direct, indirect, specular] = parts(t);
        PointReport {
            position: spot.sensor.position.to_array(),
            normal: spot.sensor.normal.to_array(),
            illuminance: t.reading.illuminance(),
            direct,
            indirect,
            specular,
            standard_error: t.reading.standard_error,
        }
    };
    let set = |((set, taken), picture): (&(Set, Vec<Taken>), &Option<PathBuf>)| {
        let s = statistics(taken);
        let single = set.kind == "points";
        SetReport {
            name: set.name.clone(),
            kind: set.kind,
            points: s.points,
            left_out: set.left_out,
            min: s.min,
            mean: s.mean,
            max: s.max,
            u0: s.uniformity(),
            ud: s.diversity(),
            mean_standard_error: s.mean_error,
            noise: 100.0 * s.noise,
            luminance: luminances(taken).map(|l| [l.min, l.mean, l.max]),
            false_colour: picture.clone(),
            readings: single.then(|| set.places.iter().zip(taken).map(point).collect()),
        }
    };
    Report {
        scene: args.scene.clone(),
        warnings,
        error_asked: 100.0 * args.error,
        output: args.output.clone(),
        sets: sets.iter().zip(pictures).map(set).collect(),
    }
}

/// Direct, indirect and specular, lx.
fn parts(t: &Taken) -> [f32; 3] {
    [t.reading.direct, t.reading.indirect, t.reading.specular].map(|e| e.luminance())
}

fn numbers(v: geometry::Vec3) -> String {
    v.to_array().map(|x| ((f64::from(x) * 1e4).round() / 1e4 + 0.0).to_string()).join(", ")
}

/// Four digits.
pub fn short(v: f32) -> String {
    let digits = if v > 0.0 { (3 - v.log10().floor() as i32).clamp(0, 6) as usize } else { 0 };
    format!("{v:.digits$}")
}
