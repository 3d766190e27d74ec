//! `twolight render` of several views.

use super::{folder, scene, twolight};
use geometry::{Rgb, Vec3};
use std::fs;
use std::path::Path;

/// The Cornell box whose camera moves 10 cm to the right in a second, and a node `also` that rises, as `room.gltf`.
fn moving(dir: &Path, also: Option<usize>) {
    let text = fs::read_to_string(scene("cornell-box.gltf")).expect("the scene is there");
    let mut json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let eye = json["nodes"].as_array().expect("nodes").iter().position(|n| n.get("camera").is_some());
    let eye = eye.expect("it has a camera");
    let number = |v: &serde_json::Value| v.as_f64().expect("a number") as f32;
    let start: Vec<f32> =
        json["nodes"][eye]["translation"].as_array().expect("it stands").iter().map(number).collect();
    let mut floats = vec![0.0f32, 1.0];
    floats.extend([start[0], start[1], start[2], start[0] + 0.1, start[1], start[2]]);
    floats.extend([0.0, 0.0, 0.0, 0.0, 0.05, 0.0]);
    let bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    fs::write(dir.join("keys.bin"), &bytes).expect("it can be written");
    let push = |json: &mut serde_json::Value, list: &str, item: serde_json::Value| {
        let all = json[list].as_array_mut().expect("a list");
        all.push(item);
        all.len() - 1
    };
    let buffer =
        push(&mut json, "buffers", serde_json::json!({ "byteLength": bytes.len(), "uri": "keys.bin" }));
    let view =
        push(&mut json, "bufferViews", serde_json::json!({ "buffer": buffer, "byteLength": bytes.len() }));
    let accessor = |offset: usize, kind: &str| {
        serde_json::json!({
            "bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 2, "type": kind,
            "min": [0.0], "max": [1.0],
        })
    };
    let times = push(&mut json, "accessors", accessor(0, "SCALAR"));
    let vec3 = |offset| {
        let mut a = accessor(offset, "VEC3");
        a.as_object_mut().expect("an object").retain(|key, _| key != "min" && key != "max");
        a
    };
    let (eyes, lifts) = (push(&mut json, "accessors", vec3(8)), push(&mut json, "accessors", vec3(32)));
    let mut channels =
        vec![serde_json::json!({ "sampler": 0, "target": { "node": eye, "path": "translation" } })];
    channels.extend(
        also.map(|n| serde_json::json!({ "sampler": 1, "target": { "node": n, "path": "translation" } })),
    );
    json["animations"] = serde_json::json!([{
        "channels": channels,
        "samplers": [{ "input": times, "output": eyes }, { "input": times, "output": lifts }],
    }]);
    fs::write(dir.join("room.gltf"), json.to_string()).expect("it can be written");
}

const SMALL: [&str; 6] = ["--size", "64x64", "--error", "10%", "--no-verify", "--quiet"];

fn render(dir: &Path, more: &[&str]) -> super::Run {
    twolight(dir, &["render", "room.gltf"].iter().chain(more).chain(&SMALL).copied().collect::<Vec<_>>())
}

#[test]
fn parts_of_a_sequence_are_the_same_whoever_renders_them() {
    let dir = folder();
    moving(dir.path(), None);
    let all = render(dir.path(), &["-o", "all.##.exr", "--frames", "0..4", "--fps", "4"]);
    assert_eq!(all.status, 0, "{}", all.err);
    assert!(all.out.contains("4 pictures in"), "{}", all.out);
    for part in ["0..1", "1..4"] {
        assert_eq!(render(dir.path(), &["-o", "part.##.exr", "--frames", part, "--fps", "4"]).status, 0);
    }
    let read = |name: &str| fs::read(dir.path().join(name)).expect("it was written");
    for frame in 0..4 {
        assert!(
            read(&format!("all.{frame:02}.exr")) == read(&format!("part.{frame:02}.exr")),
            "frame {frame}"
        );
    }
    assert!(read("all.00.exr") != read("all.03.exr"), "the camera moved");

    // What is there stays, what is missing or unfinished is made.
    fs::remove_file(dir.path().join("all.02.exr")).expect("it was there");
    let before = fs::metadata(dir.path().join("all.01.exr")).and_then(|m| m.modified()).expect("it is there");
    let again =
        render(dir.path(), &["-o", "all.##.exr", "--frames", "0..4", "--fps", "4", "--skip-existing"]);
    assert!(again.status == 0 && again.out.contains("1 picture in"), "{}{}", again.out, again.err);
    let after = fs::metadata(dir.path().join("all.01.exr")).and_then(|m| m.modified()).expect("it is there");
    assert_eq!(before, after);
    assert!(read("all.02.exr") == read("part.02.exr"));
}

#[test]
fn the_light_on_what_stands_still_does_not_flicker() {
    let dir = folder();
    moving(dir.path(), None);
    let run = render(dir.path(), &["-o", "a.##.exr", "--frames", "0..2", "--fps", "2"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let layer = |frame: u32, name: &str| {
        raytrace::exr::read_layer(&dir.path().join(format!("a.{frame:02}.exr")), name)
            .expect("it is there")
            .pixels
    };
    // Indirect irradiance of both frames, by place: reflected light over reflectance.
    let points = |frame| -> Vec<(Vec3, f32)> {
        let (at, light, rho) = (layer(frame, "position"), layer(frame, "indirect"), layer(frame, "albedo"));
        let solid = |c: &Rgb| c.luminance() > 0.05;
        at.iter()
            .zip(light.iter().zip(&rho))
            .filter(|(_, (_, rho))| solid(rho))
            .map(|(p, (l, rho))| (Vec3::new(p.r, p.g, p.b), l.luminance() / rho.luminance()))
            .collect()
    };
    let (first, second) = (points(0), points(1));
    let mut changes: Vec<f32> = Vec::new();
    for (p, e) in &first {
        let near = second.iter().min_by(|a, b| a.0.distance_squared(*p).total_cmp(&b.0.distance_squared(*p)));
        if let Some((q, f)) = near.filter(|n| n.0.distance(*p) < 2e-3) {
            assert!(q.is_finite());
            changes.push((e - f).abs() / e.max(1e-3));
        }
    }
    changes.sort_by(f32::total_cmp);
    assert!(changes.len() > 300, "{} places are in both", changes.len());
    let at = |share: f32| changes[(share * (changes.len() - 1) as f32) as usize];
    // Places differ by up to 2 mm, on which light changes a little; noise of 10 % would show in every one.
    assert!(at(0.5) < 0.005 && at(0.9) < 0.03, "half below {}, nine tenths below {}", at(0.5), at(0.9));
}

#[test]
fn things_that_move_have_light_of_their_own() {
    let dir = folder();
    let text = fs::read_to_string(scene("cornell-box.gltf")).expect("the scene is there");
    let json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let nodes = json["nodes"].as_array().expect("nodes");
    let block = nodes.iter().position(|n| n["name"].as_str().is_some_and(|n| n.contains("block")));
    moving(dir.path(), Some(block.expect("it has a block")));
    let run = render(dir.path(), &["-o", "a.exr", "--frames", "0..2", "--fps", "1"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let alone = twolight(
        dir.path(),
        &["render", "room.gltf", "-o", "b.exr", "--time", "1"]
            .iter()
            .chain(&SMALL)
            .copied()
            .collect::<Vec<_>>(),
    );
    assert_eq!(alone.status, 0, "{}", alone.err);
    let pixels = |name| raytrace::exr::read_rgb(&dir.path().join(name)).expect("it was written");
    let errors = raytrace::metrics::error_map(&pixels("a.0001.exr"), &pixels("b.exr")).expect("of one size");
    let mean = errors.iter().sum::<f32>() / errors.len() as f32;
    assert!(mean < 0.08, "{mean}");
}

#[test]
fn orbits_and_walks_are_numbered() {
    let dir = folder();
    moving(dir.path(), None);
    let orbit = render(dir.path(), &["-o", "o.#.exr", "--orbit", "8", "--frames", "2..4"]);
    assert_eq!(orbit.status, 0, "{}", orbit.err);
    assert!(dir.path().join("o.2.exr").exists() && dir.path().join("o.3.exr").exists());
    let walk = ["-o", "w.exr", "--walk", "-0.1,0.2,0.3 0.3,0.2,0.3", "--steps", "3", "--frames", "1"];
    let walk = render(dir.path(), &walk);
    assert!(walk.status == 0 && dir.path().join("w.0001.exr").exists(), "{}", walk.err);
    for wrong in [
        &["-o", "a.exr", "--orbit", "4", "--frames", "2..6"][..],
        &["-o", "a.exr", "--walk", "0,0,0"],
        &["-o", "a.exr", "--frames", "0..4294967295"],
        &["-o", "a.exr", "--orbit", "4294967295"],
        &["-o", "a.exr", "--frames", "0..2", "--time", "1"],
        &["-o", "a.exr", "--steps", "3"],
    ] {
        assert_eq!(render(dir.path(), wrong).status, 2, "{wrong:?}");
    }
}

/// Whatever part of the room is in view, by paths too: previews of a sequence share their exposure.
#[test]
fn a_sequence_by_paths_is_exposed_alike() {
    let dir = folder();
    moving(dir.path(), None);
    let args =
        ["render", "room.gltf", "-o", "a.##.exr", "--preview", "a.##.png", "--frames", "0..2", "--fps", "2"];
    let more = ["--integrator", "path", "--spp", "2", "--size", "16x16", "--json", "--quiet"];
    let run = twolight(dir.path(), &[&args[..], &more[..]].concat());
    assert_eq!(run.status, 0, "{}", run.err);
    let report: serde_json::Value = serde_json::from_str(&run.out).expect("it is JSON");
    let pictures = report["pictures"].as_array().expect("pictures");
    let exposures: Vec<f64> = pictures.iter().filter_map(|p| p["exposure"].as_f64()).collect();
    assert!(exposures.len() > 1 && exposures.iter().all(|e| *e == exposures[0]), "{exposures:?}");
    assert_eq!(exposures.len(), pictures.len());
}
