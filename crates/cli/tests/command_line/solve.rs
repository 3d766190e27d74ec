//! `twolight solve`, and pictures from its file.

use super::{Run, folder, scene, twolight};
use geometry::Rgb;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// The Cornell box with a bulb of 20 cd beside its lamp, as `room.gltf` in `dir`.
fn room(dir: &Path) {
    let text = fs::read_to_string(scene("cornell-box.gltf")).expect("the scene is there");
    let mut json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let bulb =
        serde_json::json!({ "type": "point", "name": "bulb", "intensity": 20.0, "color": [1.0, 0.8, 0.6] });
    json["extensions"]["KHR_lights_punctual"] = serde_json::json!({ "lights": [bulb] });
    json["extensionsUsed"].as_array_mut().expect("it uses some").push("KHR_lights_punctual".into());
    let nodes = json["nodes"].as_array_mut().expect("it has nodes");
    nodes.push(serde_json::json!({
        "name": "bulb", "translation": [0.1, 0.3, 0.1], "extensions": { "KHR_lights_punctual": { "light": 0 } }
    }));
    let last = nodes.len() - 1;
    json["scenes"][0]["nodes"].as_array_mut().expect("it has roots").push(last.into());
    fs::write(dir.join("room.gltf"), json.to_string()).expect("it can be written");
}

/// `render room.gltf -o NAME`, small, with `more`.
fn render(dir: &Path, name: &str, more: &[&str]) -> Run {
    let fixed = ["render", "room.gltf", "-o", name, "--size", "48x48", "--no-verify"];
    twolight(dir, &fixed.iter().chain(more).copied().collect::<Vec<_>>())
}

fn solve(dir: &Path, more: &[&str]) -> Run {
    let fixed = ["solve", "room.gltf", "-o", "room.twl", "--error", "8%"];
    twolight(dir, &fixed.iter().chain(more).copied().collect::<Vec<_>>())
}

fn pixels(dir: &Path, name: &str) -> Vec<Rgb> {
    raytrace::exr::read_rgb(&dir.join(name)).expect("it was written").pixels
}

/// The error of the picture `a` beside the picture `b`, as a fraction.
fn difference(dir: &Path, a: &str, b: &str) -> f32 {
    let [a, b] = [a, b].map(|name| raytrace::exr::read_rgb(&dir.join(name)).expect("it was written"));
    let errors = raytrace::metrics::error_map(&a, &b).expect("they are of one size");
    (errors.iter().map(|e| e * e).sum::<f32>() / errors.len() as f32).sqrt()
}

#[test]
fn a_picture_from_a_file_is_the_one_that_is_solved_for() {
    let dir = folder();
    room(dir.path());
    let run = solve(dir.path(), &["--camera", "0"]);
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(run.out.contains("bulb") && run.out.contains("lamp"), "{}", run.out);
    assert!(!dir.path().join("room.twl.partial").exists());
    let (kept, fresh) = (
        render(dir.path(), "a.exr", &["--solution", "room.twl"]),
        render(dir.path(), "b.exr", &["--error", "8%"]),
    );
    assert_eq!((kept.status, fresh.status), (0, 0), "{}{}", kept.err, fresh.err);
    assert!(pixels(dir.path(), "a.exr") == pixels(dir.path(), "b.exr"), "not the same to the last bit");
    let again = twolight(
        dir.path(),
        &["solve", "room.gltf", "-o", "b.twl", "--error", "8%", "--camera", "0", "--threads", "1"],
    );
    assert_eq!(again.status, 0, "{}", again.err);
    let read = |name| fs::read(dir.path().join(name)).expect("it was written");
    assert!(read("room.twl") == read("b.twl"), "the same seed gives the same bytes");
}

#[test]
fn lamps_stay_live_after_the_solve() {
    let dir = folder();
    room(dir.path());
    assert_eq!(solve(dir.path(), &[]).status, 0);
    let dimmed = ["--light", "lamp=0.2", "--light", "bulb=3,2,1"];
    let kept = render(dir.path(), "a.exr", &[&["--solution", "room.twl"], &dimmed[..]].concat());
    let fresh = render(dir.path(), "b.exr", &[&["--error", "4%"], &dimmed[..]].concat());
    assert_eq!((kept.status, fresh.status), (0, 0), "{}{}", kept.err, fresh.err);
    let off = difference(dir.path(), "a.exr", "b.exr");
    assert!(off < 0.1, "8 % and 4 % are at most 9 % apart: {off}");

    // A light that was brighter in the file when it was solved is the same as one dimmed by hand.
    let text = fs::read_to_string(dir.path().join("room.gltf")).expect("it is there");
    fs::write(dir.path().join("room.gltf"), text.replace("20.0", "40.0")).expect("it can be written");
    assert_eq!(render(dir.path(), "c.exr", &["--solution", "room.twl", "--light", "bulb=0.5"]).status, 0);
    fs::write(dir.path().join("room.gltf"), &text).expect("it can be written");
    assert_eq!(render(dir.path(), "d.exr", &["--solution", "room.twl"]).status, 0);
    assert!(difference(dir.path(), "c.exr", "d.exr") < 1e-3);

    let unknown = render(dir.path(), "e.exr", &["--light", "Attic=1"]);
    assert!(unknown.status == 2 && unknown.err.contains("bulb"), "{}", unknown.err);
}

#[test]
fn the_layers_of_lights_sum_to_the_picture() {
    let dir = folder();
    room(dir.path());
    let run = render(dir.path(), "a.exr", &["--light-layers", "--error", "8%"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let layer =
        |name| raytrace::exr::read_layer(&dir.path().join("a.exr"), name).expect("it is there").pixels;
    let (lamp, bulb, all) = (layer("light.lamp"), layer("light.bulb"), pixels(dir.path(), "a.exr"));
    let sum: Vec<Rgb> = lamp.iter().zip(&bulb).map(|(&a, &b)| a + b).collect();
    // Half floats round to 1 in 2048.
    let far = |(a, b): (&Rgb, &Rgb)| (*a - *b).map(f32::abs).max_channel() > 2e-3 * (b.max_channel() + 1e-2);
    assert_eq!(sum.iter().zip(&all).filter(|&p| far(p)).count(), 0);
    assert!(lamp.iter().all(|c| c.is_finite()) && bulb.iter().any(|c| c.luminance() > 0.0));
    // And the picture is that of both together.
    assert_eq!(render(dir.path(), "b.exr", &["--error", "4%"]).status, 0);
    let off = difference(dir.path(), "a.exr", "b.exr");
    assert!(off < 0.1, "8 % and 4 % are at most 9 % apart: {off}");
}

/// Names and materials that mean something else to us, or nothing to anyone.
#[test]
fn odd_lamps_have_layers_too() {
    let dir = folder();
    room(dir.path());
    let text = fs::read_to_string(dir.path().join("room.gltf")).expect("it is there");
    let mut json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let last = json["nodes"].as_array().expect("nodes").len() - 1;
    json["nodes"][last]["name"] = "unlit".into();
    let materials = json["materials"].as_array_mut().expect("it has materials");
    // One that nothing uses, and a wall that shows its own colour.
    materials.push(serde_json::json!({ "name": "東京", "emissiveFactor": [1.0, 1.0, 1.0] }));
    let red = materials.iter_mut().find(|m| m["name"] == "red").expect("the red wall");
    red["extensions"] = serde_json::json!({ "KHR_materials_unlit": {} });
    red["emissiveFactor"] = serde_json::json!([0.5, 0.5, 0.5]);
    json["extensionsUsed"].as_array_mut().expect("it uses some").push("KHR_materials_unlit".into());
    fs::write(dir.path().join("room.gltf"), json.to_string()).expect("it can be written");
    let run = render(dir.path(), "a.exr", &["--light-layers", "--error", "20%"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let layer = |name: &str| raytrace::exr::read_layer(&dir.path().join("a.exr"), name).expect(name).pixels;
    let mut sum = layer("light.lamp");
    for name in ["light.unlit", "light.unlit 2"] {
        let part = layer(name);
        assert!(part.iter().any(|c| c.luminance() > 0.0), "{name} is black");
        sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
    }
    let all = pixels(dir.path(), "a.exr");
    let far = |(a, b): (&Rgb, &Rgb)| (*a - *b).map(f32::abs).max_channel() > 3e-3 * (b.max_channel() + 1e-2);
    assert_eq!(sum.iter().zip(&all).filter(|&p| far(p)).count(), 0);

    // Solved in the dark it serves no one who switches the light on, and says which.
    let dark = ["--light", "lamp=0", "--light", "unlit=0"];
    assert_eq!(solve(dir.path(), &dark).status, 0);
    let lit = render(dir.path(), "b.exr", &["--solution", "room.twl", "--light", "unlit=0"]);
    assert!(lit.status == 1 && lit.err.contains("\"lamp\" did not shine"), "{} {}", lit.status, lit.err);
    assert_eq!(render(dir.path(), "b.exr", &[&["--solution", "room.twl"], &dark[..]].concat()).status, 0);
}

#[test]
fn a_file_that_is_not_what_was_written_is_refused() {
    let dir = folder();
    room(dir.path());
    assert_eq!(solve(dir.path(), &[]).status, 0);
    let whole = fs::read(dir.path().join("room.twl")).expect("it was written");
    let refused = |bytes: &[u8], word: &str| {
        fs::write(dir.path().join("bad.twl"), bytes).expect("it can be written");
        let run = render(dir.path(), "a.exr", &["--solution", "bad.twl"]);
        assert!(
            run.status == 1 && run.err.contains("bad.twl") && run.err.contains(word),
            "{word}: {}",
            run.err
        );
        assert!(!dir.path().join("a.exr").exists());
    };
    refused(b"", "no radiosity solution");
    refused(b"twolight", "ends after");
    for at in [40, whole.len() / 2, whole.len() - 1] {
        refused(&whole[..at], "ends after");
        let mut altered = whole.clone();
        altered[at] ^= 4;
        refused(&altered, "checksum");
    }
    refused(&[&whole[..], b"x"].concat(), "checksum");
    let mut newer = whole.clone();
    newer[8] = 9;
    refused(&newer, "format 9");
    // Another scene: the same file with a wall that reflects otherwise.
    let text = fs::read_to_string(dir.path().join("room.gltf")).expect("it is there");
    fs::write(dir.path().join("room.gltf"), text.replace("0.3,0.1]", "0.3,0.2]")).expect("it can be written");
    refused(&whole, "another scene");
}

/// Killed at many moments, a solve never leaves half a file, and goes on to the same bytes.
/// Where the rows cannot be kept, for a folder is in the way, Ctrl-C promises nothing.
#[cfg(unix)]
#[test]
fn an_interrupted_solve_promises_what_is_kept() {
    let dir = folder();
    room(dir.path());
    let interrupted = || {
        let child = Command::new(assert_cmd::cargo::cargo_bin("twolight"))
            .args(["solve", "room.gltf", "-o", "room.twl", "--error", "0.3%", "--quiet"])
            .current_dir(dir.path())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        // Until there are rows to keep, or would be.
        for _ in 0..200 {
            std::thread::sleep(Duration::from_millis(10));
            if dir.path().join("room.twl.partial").is_file() {
                break;
            }
        }
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(kill.is_ok_and(|status| status.success()), "it worked still");
        let end = child.wait_with_output().expect("it ends");
        assert_eq!(end.status.code(), Some(130));
        String::from_utf8_lossy(&end.stderr).into_owned()
    };
    let said = interrupted();
    assert!(said.contains("goes on from here"), "{said}");
    fs::remove_file(dir.path().join("room.twl.partial")).expect("rows were kept");
    fs::create_dir(dir.path().join("room.twl.partial")).expect("it is in the way");
    let said = interrupted();
    assert!(said.contains("nothing is kept"), "{said}");
}

#[test]
fn a_killed_solve_goes_on_to_the_same_bytes() {
    let dir = folder();
    room(dir.path());
    let want = {
        assert_eq!(solve(dir.path(), &[]).status, 0);
        fs::read(dir.path().join("room.twl")).expect("it was written")
    };
    fs::write(dir.path().join("room.twl"), "an earlier file").expect("it can be written");
    let (mut killed, mut found_partial) = (0, 0);
    for moment in 0..20u64 {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("twolight"))
            .args(["solve", "room.gltf", "-o", "room.twl", "--error", "8%", "--quiet"])
            .current_dir(dir.path())
            .stdout(Stdio::null())
            .spawn()
            .expect("it starts");
        std::thread::sleep(Duration::from_millis(20 + 37 * moment * moment % 400));
        killed += u32::from(child.try_wait().expect("it can be asked").is_none());
        let _ = child.kill();
        child.wait().expect("it ends");
        found_partial += u32::from(dir.path().join("room.twl.partial").exists());
        let now = fs::read(dir.path().join("room.twl")).expect("it is there at any moment");
        assert!(now == b"an earlier file" || now == want, "half a file after kill {moment}");
    }
    assert!(killed > 0 && found_partial > 0, "{killed} killed, {found_partial} left rows behind");
    assert_eq!(solve(dir.path(), &[]).status, 0);
    assert!(fs::read(dir.path().join("room.twl")).expect("it was written") == want);
}
