//! `twolight false-colour`: the luminance of a picture, or of one of its layers, by a scale.

use crate::args::{FalseColourArgs, FalseColourCommand, ScaleArg};
use crate::commands::print;
use crate::job::AskedWrongly;
use anyhow::Result;
use raytrace::exr;
use raytrace::false_colour::{Chart, Field, number};
use raytrace::output::check_writable;
use serde::Serialize;
use serde_json::json;
use std::process::ExitCode;

/// Share of a picture's pixels that may be brighter than its scale: lamps, mostly.
const LAMPS: f64 = 0.01;
/// Contour lines are drawn of medians over so many pixels to each side.
const SMOOTHING: usize = 4;

/// Runs the command.
pub fn run(args: &FalseColourCommand) -> Result<ExitCode> {
    if !args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(AskedWrongly(format!("{} is written as PNG: name it .png", args.output.display())).into());
    }
    check_writable(&args.output)?;
    let image = match args.layer.as_deref() {
        None | Some("luminance") => exr::read_rgb(&args.picture)?,
        Some(layer) => exr::read_layer(&args.picture, layer)?,
    };
    let (what, unit) = match args.layer.as_deref() {
        Some("irradiance") => ("Illuminance", "lx"),
        Some("depth" | "position") => ("Distance", "m"),
        Some("albedo" | "normal" | "variance") => ("Value", ""),
        _ => ("Luminance", "cd/m\u{b2}"),
    };
    let field = Field::of_picture(&image);
    let values = Statistics::of(&field);
    let [mean, max] = [values.mean, values.max].map(number);
    let mut chart = chart(field, &args.colours, LAMPS);
    chart.smoothing = SMOOTHING;
    let layer = args.layer.as_ref().filter(|l| *l != "luminance" && *l != "irradiance");
    chart.title = layer.map_or(what.to_string(), |layer| format!("{what}, {layer}"));
    chart.unit = unit.into();
    let beyond = if values.max > chart.scale.high() { ", beyond the scale" } else { "" };
    chart.caption = vec![format!("mean {mean}   max {max} {unit}{beyond}")];
    chart.write(&args.output)?;
    let ascii = unit.replace('\u{b2}', "2");
    let high = chart.scale.high();
    print(&match args.json {
        true => serde_json::to_string_pretty(&json!({
            "picture": args.picture, "output": args.output, "quantity": what.to_lowercase(), "unit": ascii,
            "layer": args.layer, "scale": args.colours.scale, "scale_max": high, "isolines": chart.isolines,
            "values": values,
        }))?,
        false => format!(
            "{}: {what} up to {} {ascii} (mean {mean}, max {max})",
            args.output.display(),
            number(high)
        ),
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Of the finite values of a picture, in its unit.
#[derive(Serialize)]
struct Statistics {
    pixels: usize,
    min: f64,
    median: f64,
    mean: f64,
    max: f64,
}

impl Statistics {
    fn of(field: &Field) -> Statistics {
        let finite = || field.values.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v));
        let pixels = finite().count();
        let mean = finite().sum::<f64>() / pixels.max(1) as f64;
        let [min, median, max] = [0.0, 0.5, 1.0].map(|share| field.quantile(share));
        Statistics { pixels, min, median, mean, max }
    }
}

/// A chart of `field` as asked; `clip`: see [`Chart::new`].
pub fn chart(field: Field, colours: &FalseColourArgs, clip: f64) -> Chart {
    let most = colours.max.map(f64::from);
    let mut chart = Chart::new(field, colours.scale == ScaleArg::Log, most, clip);
    chart.isolines = colours.isolines.clone().unwrap_or_default().0;
    chart
}
