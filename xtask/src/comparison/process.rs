//! One program, run to its end: what it said, how long it took, and the most memory it held.
//!
//! The system counts a program's peak memory from before it is loaded, so that it is never below the peak of the
//! process that started it. A small process of ours, `cargo xtask measured`, therefore stands between.

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use wait4::Wait4;

/// A program that has ended, or was ended.
#[derive(Debug)]
pub struct Ran {
    /// Its exit status; `None` where a signal ended it.
    pub code: Option<i32>,
    /// Wall-clock seconds from before it was started until after it had gone.
    pub seconds: f64,
    /// Peak resident memory, 10⁶ bytes; nothing below the 5 or so of an idle process is told.
    pub peak_mb: f64,
    /// What it wrote to stdout.
    pub stdout: String,
    /// What it wrote to stderr.
    pub stderr: String,
    /// Whether we ended it because it ran past the limit.
    pub late: bool,
}

impl Ran {
    /// The last line it wrote to stderr that is not blank: where programs say what went wrong.
    pub fn last_words(&self) -> &str {
        let line = self.stderr.lines().rev().find(|line| !line.trim().is_empty());
        line.map_or("it said nothing", str::trim)
    }
}

/// Arguments of `cargo xtask measured`, which only [`run`] calls.
#[derive(clap::Args)]
pub struct Measured {
    /// File for what was measured
    facts: PathBuf,
    /// Seconds after which the program is ended
    limit: f64,
    /// The program and its arguments
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
    command: Vec<OsString>,
}

/// What `cargo xtask measured` writes.
#[derive(Debug, Serialize, Deserialize)]
struct Facts {
    code: Option<i32>,
    seconds: f64,
    peak_mb: f64,
    late: bool,
}

/// Runs `command` and waits; ends it after `limit`.
pub fn run(command: &Command, limit: Duration) -> Result<Ran> {
    let facts = tempfile::NamedTempFile::new()?;
    // Files, not pipes: a full pipe would stop the program while we wait for it.
    let (mut out, mut err) = (tempfile::tempfile()?, tempfile::tempfile()?);
    let status = Command::new(std::env::current_exe()?)
        .arg("measured")
        .arg(facts.path())
        .arg(limit.as_secs_f64().to_string())
        .arg(command.get_program())
        .args(command.get_args())
        .stdin(Stdio::null())
        .stdout(out.try_clone()?)
        .stderr(err.try_clone()?)
        .status()?;
    let (stdout, stderr) = (whole(&mut out)?, whole(&mut err)?);
    ensure!(status.success(), "{}", stderr.lines().next().unwrap_or("cargo xtask measured failed"));
    let Facts { code, seconds, peak_mb, late } = read(facts.path())?;
    Ok(Ran { code, seconds, peak_mb, stdout, stderr, late })
}

/// What `cargo xtask measured` does.
pub fn measured(args: Measured) -> Result<()> {
    let (program, words) = args.command.split_first().context("no program")?;
    let facts = watch(Command::new(program).args(words), Duration::from_secs_f64(args.limit))?;
    Ok(std::fs::write(args.facts, serde_json::to_string(&facts)?)?)
}

/// Starts the command and waits for its end, or for `limit`.
fn watch(command: &mut Command, limit: Duration) -> Result<Facts> {
    let begin = Instant::now();
    let mut child = command.spawn().with_context(|| format!("starting {}", text(command)))?;
    let pid = child.id().to_string();
    let (ended, waiting) = mpsc::channel::<()>();
    let patience = move || {
        let late = waiting.recv_timeout(limit) == Err(RecvTimeoutError::Timeout);
        // By the command of that name: the standard library cannot end a child that another thread waits for.
        late && Command::new("kill").args(["-KILL", &pid]).status().is_ok()
    };
    let patience = std::thread::spawn(patience);
    let end = child.wait4().with_context(|| format!("waiting for {}", text(command)))?;
    let seconds = begin.elapsed().as_secs_f64();
    drop(ended);
    let late = patience.join().unwrap_or(false);
    Ok(Facts { code: end.status.code(), seconds, peak_mb: end.rusage.maxrss as f64 / 1e6, late })
}

/// A command as one would type it, for messages.
fn text(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

fn read(facts: &Path) -> Result<Facts> {
    let text = std::fs::read_to_string(facts)?;
    serde_json::from_str(&text).context("what a measured process came to")
}

fn whole(file: &mut File) -> Result<String> {
    let mut bytes = Vec::new();
    file.rewind()?;
    file.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str, limit: f64) -> Facts {
        watch(Command::new("sh").args(["-c", script]), Duration::from_secs_f64(limit)).unwrap()
    }

    #[test]
    fn a_program_is_timed_and_its_end_is_known() {
        let facts = shell("sleep 0.1; exit 3", 10.0);
        assert_eq!((facts.code, facts.late), (Some(3), false));
        assert!((0.1..5.0).contains(&facts.seconds) && facts.peak_mb > 0.1, "{facts:?}");
    }

    #[test]
    fn a_program_that_runs_too_long_is_ended() {
        let facts = shell("exec sleep 20", 0.05);
        assert!(facts.late && facts.code.is_none() && facts.seconds < 10.0, "{facts:?}");
    }

    #[test]
    fn the_last_line_tells_what_went_wrong() {
        let ran = |stderr: &str| Ran {
            code: Some(1),
            seconds: 0.0,
            peak_mb: 0.0,
            stdout: String::new(),
            stderr: stderr.into(),
            late: false,
        };
        assert_eq!(ran("warning\nno such file \n\n").last_words(), "no such file");
        assert_eq!(ran(" \n").last_words(), "it said nothing");
    }
}
