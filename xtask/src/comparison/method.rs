//! Who renders, and with which settings: one method, one ladder from rough to fine.

use super::scene::Subject;
use std::path::Path;
use std::process::Command;

/// A way to render, as the comparison shows it: a curve each.
#[derive(Clone, Debug)]
pub struct Method {
    /// Unique key, for `--methods`, `--peers` and `results.json`.
    pub key: &'static str,
    /// What a reader calls it.
    pub label: &'static str,
    /// What is run.
    pub program: Program,
    /// Cheapest first.
    pub ladder: Vec<Rung>,
}

/// What is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// Our binary.
    Twolight,
    /// Another renderer, by `xtask/peers/render_NAME.py`.
    Peer(&'static str),
}

/// One setting of a method.
#[derive(Clone, Debug)]
pub struct Rung {
    /// What a reader calls it: `--error 2%`, `64 spp`.
    pub setting: String,
    /// What the program is told beside scene, camera and size.
    pub args: Vec<String>,
}

/// What a picture needs beside method and rung.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// What is seen.
    pub subject: &'a Subject,
    /// Threads to render with.
    pub threads: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// EXR to write.
    pub out: &'a Path,
}

/// Errors that the two-pass method is asked for.
const ERRORS: [&str; 6] = ["10%", "5%", "3%", "2%", "1%", "0.5%"];
/// Samples a pixel of a path tracer; the time limit, not the list, ends the climb.
const SAMPLES: [u32; 9] = [4, 16, 64, 256, 1024, 4096, 16384, 65536, 262144];

/// Every method of ours. A new one is a line here.
pub fn ours() -> Vec<Method> {
    vec![
        by_error("vertex", "twolight vertex", &["--diffuse", "vertex"]),
        by_error("split", "twolight split", &["--diffuse", "split"]),
        by_error("gather", "twolight gather", &["--diffuse", "gather"]),
        by_samples("path", "twolight path", Program::Twolight, &["--integrator", "path"]),
    ]
}

/// A two-pass method, steered by the error asked.
fn by_error(key: &'static str, label: &'static str, fixed: &[&str]) -> Method {
    let ladder = ERRORS.map(|error| Rung::new(format!("--error {error}"), fixed, "--error", error));
    Method { key, label, program: Program::Twolight, ladder: ladder.into() }
}

/// A path tracer, steered by its number of samples.
pub fn by_samples(key: &'static str, label: &'static str, program: Program, fixed: &[&str]) -> Method {
    let option = if program == Program::Twolight { "--spp" } else { "--effort" };
    let ladder = SAMPLES.map(|n| Rung::new(format!("{n} spp"), fixed, option, &n.to_string()));
    Method { key, label, program, ladder: ladder.into() }
}

impl Rung {
    /// The words `fixed`, then `option value`.
    pub fn new(setting: String, fixed: &[&str], option: &str, value: &str) -> Rung {
        let args = fixed.iter().chain(&[option, value]).map(|s| s.to_string()).collect();
        Rung { setting, args }
    }
}

impl Program {
    /// The command that renders one picture.
    pub fn command(self, args: &[String], shot: Shot) -> Command {
        let subject = shot.subject;
        let target = crate::root().join("target");
        let mut command = match self {
            Program::Twolight => {
                let mut command = Command::new(target.join("release/twolight"));
                command.arg("render").arg(&subject.file).arg("-o").arg(shot.out).args(["--json", "--quiet"]);
                command
            }
            Program::Peer(name) => {
                let mut command = Command::new(target.join("peers-venv/bin/python"));
                command.arg(crate::root().join(format!("xtask/peers/render_{name}.py")));
                command.arg(&subject.file).arg(shot.out);
                command
            }
        };
        command.arg("--size").arg(format!("{}x{}", subject.width, subject.height));
        command.arg("--camera").arg(&subject.camera);
        command.arg("--threads").arg(shot.threads.to_string()).arg("--seed").arg(shot.seed.to_string());
        command.args(args);
        command
    }
}
