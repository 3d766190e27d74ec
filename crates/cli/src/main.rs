//! The command line: parses, runs, prints and exits.
//!
//! What was typed ([`args`]) is checked and becomes a job ([`job`]), which one of [`commands`] does. Results go to
//! stdout; progress, notes and warnings ([`progress`]) to stderr. Exit status: 0 done, 1 failed, 2 asked wrongly, 3 written
//! but not as exact as asked.

mod args;
mod cameras;
mod classical;
mod commands;
mod contents;
mod doctor;
mod job;
mod load;
mod picture;
mod progress;
mod room;
mod solutions;
mod values;
mod views;

use args::{Cli, Command};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Render(args) => commands::render::run(*args),
        Command::Solve(args) => commands::solve::run(&args),
        Command::Bake(args) => commands::bake::run(args),
        Command::Inspect(args) => commands::inspect::run(&args),
        Command::Measure(args) => commands::measure::run(*args),
        Command::FalseColour(args) => commands::false_colour::run(&args),
        Command::Compare(args) => commands::compare::run(&args),
        Command::Completions { shell } => commands::manual::completions(shell),
        Command::Man => commands::manual::page(),
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.is::<job::AskedWrongly>() { 2 } else { 1 })
        }
    }
}
