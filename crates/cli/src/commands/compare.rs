//! `twolight compare`: how far a picture is from a reference.

use super::print;
use crate::args::CompareArgs;
use anyhow::Result;
use raytrace::metrics::{Metrics, compare};
use raytrace::output::check_writable;
use raytrace::{difference, exr};
use serde_json::{Map, Value};
use std::process::ExitCode;

/// Runs the command; failure if the error is above `--max-error`.
pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    if let Some(path) = &args.difference {
        check_writable(path)?;
    }
    let picture = exr::read_rgb(&args.picture)?;
    let reference = exr::read_reference(&args.reference)?;
    let metrics = compare(&picture, &reference, !args.no_flip)?;
    if let Some(path) = &args.difference {
        difference::write(&picture, &reference.mean, path)?;
    }
    print(&match args.json {
        true => serde_json::to_string_pretty(&json(&metrics))?,
        false => table(&metrics),
    })?;
    if metrics.nonfinite > 0 {
        eprintln!("warning: {} pixels of the picture are not finite; they count as black", metrics.nonfinite);
    }
    match args.max_error {
        Some(most) if metrics.error > f64::from(most) => {
            eprintln!("the error, {:.3} %, is above {} %", 100.0 * metrics.error, 100.0 * most);
            Ok(ExitCode::FAILURE)
        }
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// The numbers in percent, by name, with what each says.
fn rows(m: &Metrics) -> [(&'static str, Option<f64>, &'static str); 12] {
    let percent = |v: f64| Some(100.0 * v);
    [
        ("error", percent(m.error), "root mean squared error relative to each pixel's brightness"),
        ("error_se", m.error_se.and_then(percent), "standard error of that, from its spread over pixels"),
        ("trimmed", percent(m.trimmed), "error without the worst 0.1 % of pixels"),
        ("raw_error", percent(m.raw_error), "error with the reference's own noise left in"),
        ("rmse", percent(m.rmse), "root mean squared error over the mean, not weighted"),
        ("bias", percent(m.bias), "too bright (+) or too dark (-) on the whole"),
        ("bias_clipped", percent(m.bias_clipped), "the same without the brightest 0.5 % of the reference"),
        ("p95", percent(m.p95), "95 % of pixels have a smaller error"),
        ("p99", percent(m.p99), "99 % of pixels have a smaller error"),
        ("p999", percent(m.p999), "99.9 % of pixels have a smaller error"),
        ("block16", m.block16.and_then(percent), "error of 16 x 16 block means"),
        ("bias_floor", m.bias_floor.and_then(percent), "what that holds beyond noise: slow bias"),
    ]
}

fn table(m: &Metrics) -> String {
    let mut text = String::new();
    for (name, value, meaning) in rows(m) {
        let value = value.map_or("-".into(), |v| format!("{v:.3} %"));
        text += &format!("{name:<12} {value:>12}   {meaning}\n");
    }
    if let Some(flip) = m.flip {
        text += &format!(
            "{:<12} {:>12}   mean HDR-FLIP: what the eye would notice, 0 to 1\n",
            "flip",
            format!("{flip:.5}  ")
        );
    }
    if m.reference_noise_removed {
        text += "The reference's noise is removed with its two halves.\n";
    }
    text
}

fn json(m: &Metrics) -> Value {
    let mut map: Map<String, Value> =
        rows(m).into_iter().map(|(name, value, _)| (name.to_string(), Value::from(value))).collect();
    map.insert("flip".into(), m.flip.into());
    map.insert("nonfinite".into(), m.nonfinite.into());
    map.insert("ref_noise_removed".into(), m.reference_noise_removed.into());
    Value::Object(map)
}
