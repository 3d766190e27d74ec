//! What must hold before anything lands: one list of commands, the same by hand and in CI.

use anyhow::{Context, Result, ensure};
use std::process::Command;
use std::time::Instant;

/// One step: its name for `--without`, the command as one would type it, and variables it wants set.
struct Step {
    name: &'static str,
    command: &'static str,
    env: &'static [(&'static str, &'static str)],
}

/// Cheap ones first. All in release: one set of built dependencies serves all, and the tests are numerical.
const STEPS: &[Step] = &[
    Step { name: "fmt", command: "cargo fmt --all --check", env: &[] },
    Step {
        name: "scenes",
        command: "cargo run --release --quiet --package xtask -- scenes --check",
        env: &[],
    },
    Step {
        name: "clippy",
        command: "cargo clippy --release --workspace --all-targets -- -D warnings",
        env: &[],
    },
    Step {
        name: "doc",
        command: "cargo doc --release --workspace --no-deps --document-private-items",
        env: &[("RUSTDOCFLAGS", "-D warnings")],
    },
    Step { name: "test", command: "cargo test --release --workspace", env: &[] },
    Step {
        name: "fuzz",
        command: "cargo run --release --quiet --package xtask -- fuzz --seconds 10",
        env: &[],
    },
    Step {
        name: "pictures",
        command: "cargo run --release --quiet --package xtask -- reference-comparison --quick",
        env: &[],
    },
];

/// The names that `--without` takes.
pub fn names() -> Vec<&'static str> {
    STEPS.iter().map(|step| step.name).collect()
}

/// Runs every step but those named in `without`, from the repository's root, and stops at the first that fails.
/// `browser` adds the one that needs what not every machine has.
pub fn run(without: &[String], browser: bool) -> Result<()> {
    for step in STEPS.iter().filter(|step| !without.iter().any(|name| name == step.name)) {
        println!("\n== {}", step.command);
        let start = Instant::now();
        let mut words = step.command.split(' ');
        let program = words.next().context("a step has a command")?;
        let status = Command::new(program)
            .args(words)
            .envs(step.env.iter().copied())
            .current_dir(crate::root())
            .status()
            .with_context(|| format!("starting `{}`", step.command))?;
        ensure!(status.success(), "`{}` failed", step.command);
        println!("== {} took {:.0} s", step.name, start.elapsed().as_secs_f64());
    }
    if browser {
        println!("\n== the page of reference-comparison, and baked rooms, in a browser");
        let start = Instant::now();
        crate::browser::check()?;
        println!("== browser took {:.0} s", start.elapsed().as_secs_f64());
    }
    Ok(())
}
