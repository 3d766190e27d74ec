//! One file for each subcommand.

pub mod bake;
pub mod compare;
pub mod false_colour;
pub mod inspect;
pub mod manual;
pub mod measure;
pub mod render;
mod snapshots;
pub mod solve;

use std::io::{ErrorKind, Write};

/// Prints a result on stdout, with an end of line. A reader that has seen enough (`| head`) is no failure.
fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(e).context("cannot write to stdout"))
        }
        _ => Ok(()),
    }
}
