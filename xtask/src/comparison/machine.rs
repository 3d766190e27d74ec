//! Where and what was measured: the machine, the commit, the day.

use super::results::Machine;
use std::process::Command;

/// This machine; what the system does not tell stays empty.
pub fn machine() -> Machine {
    let read = |path| std::fs::read_to_string(path).unwrap_or_default();
    let field = |text: &str, name: &str| {
        let line = text.lines().find(|line| line.starts_with(name))?;
        Some(line.split_once(':')?.1.trim().to_string())
    };
    let kilobytes = field(&read("/proc/meminfo"), "MemTotal");
    let kilobytes: Option<f64> = kilobytes.and_then(|s| s.split_whitespace().next()?.parse().ok());
    Machine {
        processor: field(&read("/proc/cpuinfo"), "model name").unwrap_or_default(),
        cores: cores(),
        memory_gb: kilobytes.map_or(0.0, |kb| (kb * 1024.0 / 1e8).round() / 10.0),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
    }
}

/// Processors that our threads may run on.
pub fn cores() -> u32 {
    std::thread::available_parallelism().map_or(1, |n| n.get() as u32)
}

/// The commit checked out, `+` behind it where files that git knows differ from it.
pub fn commit() -> String {
    let git = |args: &[&str]| said("git", args);
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|s| !s.is_empty());
    let commit = git(&["rev-parse", "--short=10", "HEAD"]).unwrap_or_default();
    commit + if changed { "+" } else { "" }
}

/// Today, as 2026-01-31.
pub fn date() -> String {
    said("date", &["+%Y-%m-%d"]).unwrap_or_default()
}

/// What a command prints, trimmed; `None` where it fails.
fn said(program: &str, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).current_dir(crate::root()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_day_is_written_as_iso_8601_has_it() {
        let date = super::date();
        assert!(date.len() == 10 && date.split('-').all(|part| part.parse::<u32>().is_ok()), "{date}");
    }
}
