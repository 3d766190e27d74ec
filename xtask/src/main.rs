//! Our chores, as `cargo xtask NAME`.

mod base64;
mod bench_load;
mod bench_rays;
mod browser;
mod check;
mod comparison;
mod fuzz;
mod guide;
#[cfg(test)]
mod ourselves;
mod peers;
mod scenes;
mod stability;

use anyhow::Result;
use clap::{Parser, Subcommand};
use std::path::{Path, PathBuf};

/// Chores of the twolight repository.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Args {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Subcommand)]
enum Chore {
    /// Measure speed
    #[command(subcommand)]
    Bench(Bench),
    /// Run everything that must pass before a change lands
    Check {
        /// Leave out a step
        #[arg(long, value_parser = clap::builder::PossibleValuesParser::new(check::names()))]
        without: Vec<String>,
        /// Also try the page of `reference-comparison` in a browser; needs node, npm and Chromium
        #[arg(long)]
        browser: bool,
    },
    /// Spoil sound glTF files at random and load them: no panic, no hang, no hunger for memory
    Fuzz(fuzz::Args),
    /// Run every command of assets/guide.md, and make its pictures
    Guide,
    /// Compare speed and error with references and other renderers
    ReferenceComparison(comparison::Args),
    /// Run a program and write down its time and memory: for `reference-comparison`
    #[command(hide = true)]
    Measured(comparison::Measured),
    /// Say which other renderers are here, for `reference-comparison`
    Peers {
        #[command(subcommand)]
        what: Option<Peers>,
    },
    /// Write the scenes that a function describes into assets/
    Scenes {
        /// Write nothing; fail if a file in assets/ differs from what its function gives
        #[arg(long)]
        check: bool,
    },
    /// Measure where each method fails, and write it down in assets/stability.md
    Stability,
}

#[derive(Subcommand)]
enum Bench {
    /// Seconds and memory that a large file takes to load
    Load(bench_load::Args),
    /// Rays per second, beside Embree's where it is installed
    Rays(bench_rays::Args),
}

#[derive(Subcommand)]
enum Peers {
    /// Install them into target/peers-venv, from Python's registry
    Install,
}

fn main() -> Result<()> {
    match Args::parse().chore {
        Chore::Bench(Bench::Load(args)) => bench_load::run(args),
        Chore::Bench(Bench::Rays(args)) => bench_rays::run(args),
        Chore::Check { without, browser } => check::run(&without, browser),
        Chore::ReferenceComparison(args) => comparison::run(args),
        Chore::Guide => guide::run(),
        Chore::Fuzz(args) => fuzz::run(args),
        Chore::Measured(args) => comparison::measured(args),
        Chore::Peers { what: None } => peers::list(),
        Chore::Peers { what: Some(Peers::Install) } => peers::install(),
        Chore::Scenes { check: false } => scenes::write(&root().join("assets")),
        Chore::Stability => stability::run(),
        Chore::Scenes { check: true } => scenes::check(&root().join("assets")),
    }
}

/// The repository's root: chores work from any folder within it.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the root").to_path_buf()
}
