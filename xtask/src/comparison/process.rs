//! One program, run to its end: what it said, how long it took, and the most memory it held.

use anyhow::{Context, Result};
use std::fs::File;
use std::io::{Read, Seek};
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
    /// Peak resident memory, 10⁶ bytes. The system counts from before the program is loaded, so it is never below
    /// the peak of the process that started it: ours stays below 60 by reading one picture at a time.
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

/// Runs `command` and waits; ends it after `limit`.
pub fn run(command: &mut Command, limit: Duration) -> Result<Ran> {
    // Files, not pipes: a full pipe would stop the program while we wait for it.
    let (mut out, mut err) = (tempfile::tempfile()?, tempfile::tempfile()?);
    command.stdin(Stdio::null()).stdout(out.try_clone()?).stderr(err.try_clone()?);
    let begin = Instant::now();
    let mut child = command.spawn().with_context(|| format!("starting {}", text(command)))?;
    let pid = child.id().to_string();
    let (ended, watched) = mpsc::channel::<()>();
    let watch = move || {
        let late = watched.recv_timeout(limit) == Err(RecvTimeoutError::Timeout);
        // By the command of that name: the standard library cannot end a child that another thread waits for.
        late && Command::new("kill").args(["-KILL", &pid]).status().is_ok()
    };
    let watch = std::thread::spawn(watch);
    let end = child.wait4().with_context(|| format!("waiting for {}", text(command)))?;
    let seconds = begin.elapsed().as_secs_f64();
    drop(ended);
    let late = watch.join().unwrap_or(false);
    Ok(Ran {
        code: end.status.code(),
        seconds,
        peak_mb: end.rusage.maxrss as f64 / 1e6,
        stdout: whole(&mut out)?,
        stderr: whole(&mut err)?,
        late,
    })
}

/// A command as one would type it, for messages.
pub fn text(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
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

    fn shell(script: &str, limit: f64) -> Ran {
        run(Command::new("sh").args(["-c", script]), Duration::from_secs_f64(limit)).unwrap()
    }

    #[test]
    fn a_program_is_heard_and_timed() {
        let ran = shell("echo out; echo first >&2; echo last >&2; echo >&2; sleep 0.1; exit 3", 10.0);
        assert_eq!(
            (ran.code, ran.stdout.as_str(), ran.last_words(), ran.late),
            (Some(3), "out\n", "last", false)
        );
        assert!((0.1..5.0).contains(&ran.seconds) && ran.peak_mb > 0.1, "{ran:?}");
    }

    #[test]
    fn a_program_that_runs_too_long_is_ended() {
        let ran = shell("exec sleep 20", 0.05);
        assert!(ran.late && ran.code.is_none() && ran.seconds < 10.0, "{ran:?}");
    }
}
