//! `twolight render --solver`.

use super::{folder, scene, twolight};

fn cornell() -> String {
    scene("cornell-box.gltf").to_str().expect("the repository's path is UTF-8").into()
}

#[test]
fn every_solver_gives_a_picture_in_every_mode_and_says_how() {
    let dir = folder();
    for solver in ["gather", "matrix", "progressive"] {
        for diffuse in ["vertex", "split", "gather"] {
            let name = cornell();
            let mut args =
                vec!["render", &name, "-o", "a.exr", "--size", "8x8", "--error", "20%", "--no-verify"];
            args.extend(["--solver", solver, "--diffuse", diffuse]);
            if solver != "gather" {
                args.extend(["--patches", "300"]);
            }
            let run = twolight(dir.path(), &args);
            assert_eq!(run.status, 0, "{solver} {diffuse}: {}", run.err);
            for word in ["radiosity solver", solver, "iterations", "balance", "MB", "within"] {
                assert!(run.out.contains(word), "{solver} {diffuse} does not say {word}: {}", run.out);
            }
        }
    }
}

#[test]
fn snapshots_are_written_as_the_light_spreads() {
    let dir = folder();
    let name = cornell();
    let mut args = vec![
        "render",
        &name,
        "-o",
        "a.exr",
        "--preview",
        "a.png",
        "--size",
        "8x8",
        "--error",
        "50%",
        "--no-verify",
    ];
    args.extend([
        "--solver",
        "progressive",
        "--patches",
        "100",
        "--diffuse",
        "vertex",
        "--snapshots",
        "--no-ambient",
    ]);
    let run = twolight(dir.path(), &args);
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(dir.path().join("a.without-and-with.png").is_file() && dir.path().join("a.exr").is_file());
    let mean = |shots: u32| {
        let path = dir.path().join(format!("a.shots-{shots:05}.exr"));
        // The lamp, seen at an edge of the picture by chance, is left out.
        let layers = ["direct", "indirect"].map(|l| raytrace::exr::read_layer(&path, l));
        let sum = |l: Result<raytrace::exr::Image, _>| {
            l.unwrap_or_else(|e| panic!("{e}")).pixels.iter().map(|p| p.luminance()).sum::<f32>()
        };
        layers.map(sum).iter().sum::<f32>()
    };
    // Without ambient light every shot makes it brighter.
    assert!(mean(1) > mean(0) && mean(10) > mean(1), "{} {} {}", mean(0), mean(1), mean(10));
}

#[test]
fn what_does_not_fit_is_refused_with_its_size() {
    let dir = folder();
    let name = cornell();
    let args = ["render", &name, "-o", "a.exr", "--size", "8x8", "--solver", "matrix", "--patches", "200000"];
    let run = twolight(dir.path(), &args);
    assert!(run.status == 1 && run.err.contains("GB") && run.err.contains("progressive"), "{}", run.err);
    assert!(!dir.path().join("a.exr").exists());
}

#[test]
fn options_of_another_solver_are_refused() {
    let dir = folder();
    let name = cornell();
    for (more, word) in [
        (&["--patches", "9"][..], "--patches"),
        (&["--solver", "matrix", "--snapshots"], "--snapshots"),
        (&["--solver", "progressive", "--reciprocal"], "--reciprocal"),
        (&["--solver", "matrix", "--integrator", "path"], "--solver"),
    ] {
        let args: Vec<&str> =
            ["render", &name, "-o", "a.exr"].into_iter().chain(more.iter().copied()).collect();
        let run = twolight(dir.path(), &args);
        assert!(run.status == 2 && run.err.contains(word), "{more:?}: {} {}", run.status, run.err);
    }
}
