//! Baked rooms as three.js shows them, beside our own picture of the same view at the same exposure.

use super::run;
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::{Command, Stdio};

/// Dark enough that nothing but the lamp is rolled off in the preview: a browser only cuts.
const EXPOSURE: &str = "9.4";
/// Pixels on a side.
const SIDE: u32 = 384;
/// Mean absolute difference allowed, 8-bit sRGB values. Measured: 0.9 for both; outlines, which the
/// two filter differently, are half of it.
const MOST: f64 = 2.0;

/// Bakes the Cornell box both ways into `folder`, and compares.
pub fn check(folder: &Path, modules: &Path) -> Result<()> {
    let twolight = || {
        let mut command = Command::new(crate::root().join("target/release/twolight"));
        command.stdout(Stdio::null());
        command
    };
    let scene = "assets/cornell-box.gltf";
    let expected = folder.join("vertices.expected.png");
    let size = format!("{SIDE}x{SIDE}");
    run(twolight()
        .args(["render", scene, "--quiet", "--no-verify", "--size", &size, "--exposure", EXPOSURE, "-o"])
        .arg(folder.join("expected.exr"))
        .arg("--preview")
        .arg(&expected))?;
    std::fs::copy(&expected, folder.join("lightmap.expected.png")).context("copying the expected picture")?;
    let bake = |name: &str, options: &[&str]| {
        let path = folder.join(name);
        run(twolight().args(["bake", scene, "--quiet", "--exposure", EXPOSURE, "-o"]).arg(path).args(options))
    };
    bake("vertices.glb", &[])?;
    bake("lightmap.glb", &["--lightmap", "512"])?;
    let script = crate::root().join("xtask/browser/baked.mjs");
    let output = Command::new("node")
        .arg(script)
        .arg(folder)
        .args(["vertices", "lightmap"])
        .env("NODE_PATH", modules)
        .stderr(Stdio::inherit())
        .output()
        .context("starting node")?;
    ensure!(output.status.success(), "baked.mjs failed");
    let mut compared = 0;
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        println!("{line}");
        let line: serde_json::Value = serde_json::from_str(line).context("reading what baked.mjs says")?;
        let difference = line["difference"].as_f64().context("baked.mjs compared nothing")?;
        ensure!(difference < MOST, "{} looks different in three.js: {difference:.2} of 255", line["name"]);
        compared += 1;
    }
    ensure!(compared == 2, "{compared} of 2 baked rooms were shown");
    Ok(())
}
