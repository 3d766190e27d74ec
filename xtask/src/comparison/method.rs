//! Who renders, and with which settings: one method, one ladder from rough to fine.

use super::scene::Subject;
use std::path::{Path, PathBuf};
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
        by_error("matrix", "twolight matrix", &["--solver", "matrix"]),
        by_error("progressive", "twolight progressive", &["--solver", "progressive"]),
        by_error("hemicube", "twolight hemicube", &["--solver", "progressive", "--hemicube", "64"]),
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
        let mut command = match self {
            Program::Twolight => {
                let mut command = Command::new(twolight());
                command.arg("render").arg(&subject.file).arg("-o").arg(shot.out).args(["--json", "--quiet"]);
                // The comparison itself measures the error, of others' pictures too.
                command.arg("--no-verify");
                command
            }
            Program::Peer(name) => {
                let mut command = Command::new(crate::root().join("target/peers-venv/bin/python"));
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

/// Our binary: beside this program's folder, for that is where Cargo was told to build.
pub fn twolight() -> PathBuf {
    let target = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.parent()?.to_path_buf()));
    let target = target.unwrap_or_else(|| crate::root().join("target"));
    target.join("release").join(format!("twolight{}", std::env::consts::EXE_SUFFIX))
}

#[cfg(test)]
mod tests {
    use super::super::peer;
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_method_has_a_key_and_a_ladder_of_its_own() {
        let methods: Vec<Method> = ours().into_iter().chain(peer::all()).collect();
        let keys: BTreeSet<&str> = methods.iter().map(|m| m.key).collect();
        assert_eq!(keys.len(), methods.len());
        for method in &methods {
            let settings: BTreeSet<&str> = method.ladder.iter().map(|r| r.setting.as_str()).collect();
            assert!(settings.len() == method.ladder.len() && settings.len() > 3, "{}", method.key);
        }
    }

    #[test]
    fn a_rung_becomes_a_command() {
        let subject = Subject {
            name: "room".into(),
            file: "room.glb".into(),
            camera: "door".into(),
            width: 30,
            height: 20,
            triangles: 12,
            reference: Default::default(),
        };
        let shot = Shot { subject: &subject, threads: 2, seed: 7, out: Path::new("out.exr") };
        let words = |method: &Method| -> Vec<String> {
            let command = method.program.command(&method.ladder[1].args, shot);
            command.get_args().skip(1).map(|word| word.to_string_lossy().into_owned()).collect()
        };
        let common = "--size 30x20 --camera door --threads 2 --seed 7";
        let split = ours().into_iter().find(|m| m.key == "split").unwrap();
        let expected =
            format!("room.glb -o out.exr --json --quiet --no-verify {common} --diffuse split --error 5%");
        assert_eq!(words(&split).join(" "), expected);
        let denoised = peer::all().into_iter().find(|m| m.key == "cycles-oidn").unwrap();
        assert_eq!(words(&denoised).join(" "), format!("room.glb out.exr {common} --denoise --effort 16"));
    }
}
