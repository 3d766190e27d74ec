//! Other renderers for `reference-comparison`: which of them are here, and how to install the rest.
//!
//! None is needed to build, test or run twolight.

use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A renderer, and how to ask whether it is here.
struct Peer {
    name: &'static str,
    /// Prints the version on its last line, or fails.
    probe: Probe,
    /// The Debian package that brings it, or that it wants besides the Python one.
    debian: Option<&'static str>,
}

enum Probe {
    /// Python statements for the virtual environment.
    Python(&'static str),
    /// A program on the path, the argument that makes it tell its version, and how the line with it begins.
    Program(&'static str, &'static str, &'static str),
}

const PEERS: &[Peer] = &[
    Peer {
        name: "mitsuba",
        probe: Probe::Python(
            "import mitsuba as mi, drjit as dr\n\
             try:\n mi.set_variant('llvm_ad_rgb'); dr.eval(mi.Float(0) + 1)\n\
             except Exception: mi.set_variant('scalar_rgb')\n\
             slow = ' (slow: no LLVM library)' if mi.variant() == 'scalar_rgb' else ''\n\
             print(f'Mitsuba {mi.__version__}, {mi.variant()}{slow}')",
        ),
        debian: Some("libllvm19"),
    },
    Peer {
        name: "cycles",
        probe: Probe::Python("import bpy; print(f'Cycles of Blender {bpy.app.version_string}')"),
        debian: None,
    },
    Peer {
        name: "luxcore",
        probe: Probe::Python("import pyluxcore; print(f'LuxCore {pyluxcore.Version()}')"),
        debian: None,
    },
    Peer {
        name: "radiance",
        probe: Probe::Python(
            "import pyradiance; print(pyradiance.rtrace(b'', '', version=True).decode().strip())",
        ),
        debian: None,
    },
    Peer {
        name: "povray",
        probe: Probe::Program("povray", "--version", "POV-Ray 3"),
        debian: Some("povray"),
    },
];

/// Says of each renderer its version, or what is missing.
pub fn list() -> Result<()> {
    let python = python();
    let found: Vec<Result<String, String>> = PEERS.iter().map(|peer| peer.probe.ask(&python)).collect();
    for (peer, found) in PEERS.iter().zip(&found) {
        match found {
            Ok(version) => println!("{:<9} {version}", peer.name),
            Err(why) => println!("{:<9} missing: {why}", peer.name),
        }
    }
    if found.iter().any(Result::is_err) {
        println!("\n`cargo xtask peers install` installs what Python's registry has. {}", debian());
    }
    Ok(())
}

/// Makes target/peers-venv, fills it with `xtask/peers/requirements.txt`, and lists what is there then.
pub fn install() -> Result<()> {
    let root = crate::root();
    let python = python();
    if !python.exists() {
        // 3.11 is the version that every package in the list has a build for.
        let maker = ["python3.11", "python3"].into_iter().find(|name| runs(name));
        let maker = maker.context("python3 is not installed")?;
        let folder = root.join("target/peers-venv");
        println!("{maker} -m venv {}", folder.display());
        let status = Command::new(maker).args(["-m", "venv"]).arg(&folder).status();
        ensure!(
            status.with_context(|| format!("starting {maker}"))?.success(),
            "no virtual environment: on Debian it wants the package python3-venv"
        );
    }
    let list = root.join("xtask/peers/requirements.txt");
    println!("pip install -r {}", list.display());
    let status = Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(&list).status();
    ensure!(status.context("starting pip")?.success(), "pip failed: bpy of that version wants Python 3.11");
    println!("{}\n", debian());
    self::list()
}

/// The interpreter that has the other renderers.
fn python() -> PathBuf {
    crate::root().join("target/peers-venv/bin/python")
}

/// What apt installs, in a sentence.
fn debian() -> String {
    let packages: Vec<&str> = PEERS.iter().filter_map(|peer| peer.debian).collect();
    format!("From Debian: apt install {}", packages.join(" "))
}

/// Whether a program of this name can be started.
fn runs(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

impl Probe {
    /// The version, or why there is none.
    fn ask(&self, python: &Path) -> Result<String, String> {
        let (mut command, wanted) = match *self {
            Probe::Python(_) if !python.exists() => return Err("target/peers-venv is not there".into()),
            Probe::Python(code) => {
                let mut command = Command::new(python);
                command.args(["-c", code]);
                (command, None)
            }
            Probe::Program(name, version, begins) => {
                let mut command = Command::new(name);
                command.arg(version);
                (command, Some(begins))
            }
        };
        let output = command.output().map_err(|error| error.to_string())?;
        let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        match wanted {
            Some(begins) => text.iter().flat_map(|text| text.lines()).find(|line| line.starts_with(begins)),
            None if output.status.success() => text[0].lines().last(),
            None => return Err(text[1].lines().last().unwrap_or("it ends without a word").trim().into()),
        }
        .map(|line| line.trim().to_string())
        .ok_or_else(|| "it tells no version".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_not_there_is_missing() {
        let probe = Probe::Program("no-such-renderer", "--version", "");
        assert!(probe.ask(Path::new("/nowhere")).is_err());
        assert!(Probe::Python("print(1)").ask(Path::new("/nowhere")).is_err());
    }

    #[test]
    fn the_version_is_the_line_that_begins_with_the_name() {
        let probe = Probe::Program("cargo", "--version", "cargo ");
        assert!(probe.ask(Path::new("/nowhere")).unwrap().starts_with("cargo 1."));
    }

    #[test]
    fn every_peer_has_a_script() {
        for peer in PEERS {
            let script = crate::root().join(format!("xtask/peers/render_{}.py", peer.name));
            assert!(script.exists(), "{}", script.display());
        }
    }
}
