//! A small comparison with everything that a page can hold: real pictures, invented numbers, awkward names.

use super::run;
use crate::comparison::results::{
    Curve, Machine, Point, RaySpeed, Reference, Results, Scene, Sweep, SweepLine, SweepPoint,
};
use anyhow::Result;
use std::path::Path;
use std::process::{Command, Stdio};

/// Size of the pictures, pixels on a side.
const SIDE: u32 = 64;

/// Renders the pictures into `folder`, and tells what they are.
pub fn make(folder: &Path) -> Result<Results> {
    let build = ["build", "--release", "--quiet", "--package", "twolight"];
    run(Command::new(env!("CARGO")).args(build))?;
    let render = |name: &str, options: &[&str]| {
        let size = format!("{SIDE}x{SIDE}");
        let mut command = Command::new(crate::root().join("target/release/twolight"));
        command.args(["render", "assets/cornell-box.gltf", "--quiet", "--size", &size, "-o"]);
        run(command.arg(folder.join(name)).args(options).stdout(Stdio::null()))
    };
    render("split.exr", &["--error", "5%"])?;
    render("path.exr", &["--integrator", "path", "--spp", "4"])?;
    render("reference.a.exr", &["--integrator", "path", "--spp", "64", "--seed", "2"])?;
    render("reference.b.exr", &["--integrator", "path", "--spp", "64", "--seed", "3"])?;

    // Named so that markup in names would show; spread so that curves cross, and one point has no error.
    let mut scenes = Vec::new();
    for name in ["cornell-box", "a <b>bold</b> room & \"more\""] {
        let curves = vec![
            curve(
                "split",
                "twolight split",
                &[(0.4, 0.09), (1.1, 0.04), (4.0, 0.018), (11.0, 0.011)],
                "split.exr",
            ),
            curve("gather", "twolight gather", &[(2.0, 0.05), (9.0, 0.02), (35.0, 0.008)], "split.exr"),
            curve("path", "twolight path", &[(0.5, 0.8), (2.0, 0.4), (8.0, 0.2), (32.0, 0.0)], "path.exr"),
            curve("mitsuba", "Mitsuba path", &[(2.5, 0.5), (7.0, 0.13), (100.0, 0.035)], "path.exr"),
            curve(
                "mitsuba-oidn",
                "Mitsuba path + OIDN",
                &[(3.1, 0.1), (7.7, 0.05), (101.0, 0.013)],
                "split.exr",
            ),
            Curve {
                comparable: false,
                ..curve("povray", "POV-Ray <radiosity>", &[(9.0, 0.3), (99.0, 0.2)], "path.exr")
            },
        ];
        scenes.push(Scene {
            name: name.into(),
            file: "assets/cornell-box.gltf".into(),
            camera: "camera".into(),
            width: SIDE,
            height: SIDE,
            triangles: 34,
            reference: Reference {
                path: folder.join("reference"),
                made_by: "twolight path, 64 samples a pixel".into(),
                noise: 0.1,
            },
            curves,
        });
    }
    let sweep = |name: &str, logarithmic: bool, at: &[f64]| Sweep {
        name: name.into(),
        title: format!("Cost against {name}"),
        axis: name.into(),
        logarithmic,
        lines: ["room", "gallery"].map(|label| line(label, at)).into(),
    };
    Ok(Results {
        commit: "0123456789ab+".into(),
        date: "2026-01-31".into(),
        machine: Machine {
            processor: "a processor".into(),
            cores: 2,
            memory_gb: 8.0,
            system: "Linux x86_64".into(),
        },
        threads: 2,
        versions: [("mitsuba".to_string(), "Mitsuba 3".to_string())].into(),
        scenes,
        scaling: vec![
            sweep("triangles", true, &[1e3, 1e4, 1e5, 1e6]),
            sweep("albedo", false, &[0.1, 0.5, 0.9]),
        ],
        rays: vec![RaySpeed {
            scene: "cornell-box".into(),
            kind: "diffuse".into(),
            ours: 4.0,
            embree: Some(5.0),
        }],
    })
}

fn curve(method: &str, label: &str, points: &[(f64, f64)], picture: &str) -> Curve {
    let point = |&(seconds, error): &(f64, f64)| Point {
        setting: format!("{seconds} s"),
        seconds,
        stages: [("prepass".to_string(), 0.5 * seconds), ("image".to_string(), 0.4 * seconds)].into(),
        peak_mb: 40.0,
        rays: Some(12_345_678),
        error,
        error_se: Some(0.1 * error),
        bias: -0.1 * error,
        p99: 4.0 * error,
        flip: 0.05,
        picture: Some(picture.into()),
    };
    Curve {
        method: method.into(),
        label: label.into(),
        ours: label.starts_with("twolight"),
        comparable: true,
        notes: vec!["Lamps are seen from one side only.".into()],
        points: points.iter().map(point).collect(),
    }
}

fn line(label: &str, at: &[f64]) -> SweepLine {
    let point = |&x: &f64| SweepPoint {
        x,
        seconds: 1.0 + x.sqrt() / 100.0,
        prepass_seconds: 0.5 + x.sqrt() / 300.0,
        peak_mb: 30.0 + x / 1e4,
        error: None,
    };
    SweepLine { label: label.into(), points: at.iter().map(point).collect() }
}
