//! The page of `reference-comparison`, and baked scenes, in a browser: what no test of text and bytes can tell.
//!
//! Pictures are rendered small and on the spot, a page is made of them and of invented numbers, and
//! `xtask/browser/report.mjs` uses it as a reader would, in a headless Chromium (Debian's `chromium`, or what the
//! variable CHROMIUM names). Rooms are baked and shown by three.js in the same browser (`xtask/browser/baked.mjs`), beside
//! our own picture of them. Needs node and npm.

mod baked;
mod sample;

use crate::comparison::report;
use anyhow::{Context, Result, ensure};
use std::process::Command;

/// What drives the browser: the library alone, without browsers of its own.
const DRIVER: &str = "playwright-core@1.65.1";
/// What shows glTF on most web pages.
const VIEWER: &str = "three@0.187.0";

/// Makes the page and tries it; everything lands in `target/browser`.
pub fn check() -> Result<()> {
    let root = crate::root();
    let folder = root.join("target/browser");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let results = sample::make(&folder)?;
    results.write(&folder.join("results.json"))?;
    report::write(&results, &folder)?;

    let modules = folder.join("node_modules");
    let install = ["install", "--silent", "--no-audit", "--no-fund", "--no-save", "--prefix"];
    run(Command::new("npm").args(install).arg(&folder).args([DRIVER, VIEWER]))?;
    let script = root.join("xtask/browser/report.mjs");
    run(Command::new("node").arg(script).arg(&folder).env("NODE_PATH", &modules))?;
    baked::check(&folder, &modules)
}

/// Runs it from the repository's root, its output beside ours.
fn run(command: &mut Command) -> Result<()> {
    let name = command.get_program().to_owned();
    let status = command.current_dir(crate::root()).status();
    let status = status.with_context(|| format!("starting {}", name.display()))?;
    ensure!(status.success(), "{} failed", name.display());
    Ok(())
}
