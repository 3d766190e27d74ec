//! The binary as a user meets it: exit status, messages, and files that survive.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};

mod bake;
mod classical;
mod compare;
mod kill;
mod measure;
mod render;
mod sequence;
mod solve;

/// A folder for one test.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

/// What a run gave.
struct Run {
    status: i32,
    out: String,
    err: String,
}

/// Runs `twolight` with `args` in the folder `dir`.
fn twolight(dir: &Path, args: &[&str]) -> Run {
    let output = Command::cargo_bin("twolight")
        .expect("the binary is built")
        .current_dir(dir)
        .args(args)
        .output()
        .expect("it runs");
    let text = |bytes| String::from_utf8(bytes).expect("output is UTF-8");
    Run {
        status: output.status.code().expect("it ends by itself"),
        out: text(output.stdout),
        err: text(output.stderr),
    }
}

/// A scene of the repository.
fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(name)
}

#[test]
fn help_teaches() {
    let dir = folder();
    for (args, words) in [
        (&["--help"][..], &["render", "bake", "inspect", "compare", "Exit status"][..]),
        (&["render", "--help"], &["--error", "--camera", "--sky", "--preview", "Examples", "cd/m2"]),
        (&["solve", "--help"], &["--camera", "partial", "Examples"]),
        (&["bake", "--help"], &["--lightmap", "--exposure", "Examples", "KHR_materials_unlit"]),
        (&["inspect", "--help"], &["--json"]),
        (&["measure", "--help"], &["--workplane", "--surface", "--false-colour", "Examples", "lx"]),
        (&["false-colour", "--help"], &["--layer", "--isolines", "Examples"]),
        (&["compare", "--help"], &["--difference", "--max-error", "Examples"]),
    ] {
        let run = twolight(dir.path(), args);
        assert_eq!(run.status, 0);
        for word in words {
            assert!(run.out.contains(word), "{args:?} does not mention {word}");
        }
    }
    assert!(twolight(dir.path(), &["--version"]).out.starts_with("twolight "));
}

#[test]
fn shells_and_man_know_every_command() {
    let dir = folder();
    for args in [&["completions", "bash"][..], &["completions", "zsh"], &["completions", "fish"], &["man"]] {
        let run = twolight(dir.path(), args);
        assert_eq!(run.status, 0, "{}", run.err);
        for command in ["render", "solve", "inspect", "compare"] {
            assert!(run.out.contains(command), "{args:?} does not know {command}");
        }
    }
    let page = twolight(dir.path(), &["man"]).out;
    assert!(page.starts_with(".ie") && page.contains("RENDER") && page.contains("light"), "{page}");
}

#[test]
fn wrong_arguments_exit_2() {
    let dir = folder();
    for args in [
        &[][..],
        &["rendr"],
        &["render"],
        &["render", "a.glb"],
        &["render", "a.glb", "-o", "a.exr", "--error", "2"],
        &["render", "a.glb", "-o", "a.exr", "--size", "640"],
        &["render", "a.glb", "-o", "a.exr", "--size", "0x4"],
        &["render", "a.glb", "-o", "a.exr", "--threads", "0"],
        &["render", "a.glb", "-o", "a.exr", "--exposure", "3"],
        &["render", "a.glb", "-o", "a.exr", "--sky", "1,2"],
        &["render", "a.glb", "-o", "a.exr", "--spp", "16"],
        &["render", "a.glb", "-o", "a.exr", "--light", "Lamp"],
        &["solve", "a.glb"],
        &["compare", "a.exr"],
        &["measure", "a.glb", "--workplane", "high"],
        &["measure", "a.glb", "--margin", "1", "--point", "0,0,0"],
        &["false-colour", "a.exr"],
        &["inspect"],
    ] {
        let run = twolight(dir.path(), args);
        assert_eq!(run.status, 2, "{args:?}: {}", run.err);
        assert!(run.out.is_empty() && !run.err.is_empty(), "{args:?}");
    }
}

#[test]
fn inspect_counts_and_gives_units() {
    let dir = folder();
    let path = scene("cornell-box.gltf");
    let path = path.to_str().expect("the repository's path is UTF-8");
    let run = twolight(dir.path(), &["inspect", path]);
    assert_eq!(run.status, 0, "{}", run.err);
    for word in ["triangles", "Materials", "cd/m2", "lm", "Cameras"] {
        assert!(run.out.contains(word), "{word}: {}", run.out);
    }
    let json: serde_json::Value =
        serde_json::from_str(&twolight(dir.path(), &["inspect", path, "--json"]).out).expect("it is JSON");
    assert!(json["triangles"].as_u64() > Some(0));
    assert_eq!(json["lights"][0]["unit"], "cd/m2");
    assert_eq!(twolight(dir.path(), &["inspect", "absent.glb"]).status, 1);
    fs::write(dir.path().join("bad.glb"), "glTF but no more").expect("it can be written");
    let run = twolight(dir.path(), &["inspect", "bad.glb"]);
    assert_eq!(run.status, 1);
    assert!(run.err.contains("bad.glb") && run.err.lines().count() == 1, "{}", run.err);
}
