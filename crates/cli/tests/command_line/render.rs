//! `twolight render`.

use super::{folder, scene, twolight};
use std::fs;

fn cornell() -> String {
    scene("cornell-box.gltf").to_str().expect("the repository's path is UTF-8").into()
}

/// A glTF file of one triangle that does not shine, with `more` at its top and a camera for each name.
fn triangle(more: &str, cameras: &[&str]) -> String {
    let nodes: String = cameras.iter().map(|name| format!(r#",{{"camera":0,"name":"{name}"}}"#)).collect();
    let all: String = (0..cameras.len()).map(|i| format!(",{}", i + 1)).collect();
    format!(
        r#"{{"asset":{{"version":"2.0"}},{more}"scene":0,"scenes":[{{"nodes":[0{all}]}}],
        "nodes":[{{"mesh":0}}{nodes}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}]}}"#
    )
}

#[test]
fn each_camera_gets_a_file() {
    let dir = folder();
    let cameras =
        r#""cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1,"aspectRatio":2}}],"#;
    fs::write(dir.path().join("a.gltf"), triangle(cameras, &["Hall", "Kitchen"])).expect("it can be written");
    let args = ["render", "a.gltf", "-o", "a.exr", "--camera", "all", "--width", "8", "--sky", "1"];
    let run = twolight(dir.path(), &args);
    assert_eq!(run.status, 0, "{}", run.err);
    for name in ["a.Hall.exr", "a.Kitchen.exr"] {
        let image = raytrace::exr::read_rgb(&dir.path().join(name)).expect("it was written");
        assert_eq!((image.width, image.height), (8, 4));
    }
    let run = twolight(dir.path(), &["render", "a.gltf", "-o", "b.exr", "--size", "8x4", "--sky", "1"]);
    assert!(run.err.contains("2 cameras") && run.out.contains("\"Hall\""), "{}{}", run.err, run.out);
}

#[test]
fn a_picture_is_written_and_described() {
    let dir = folder();
    let args =
        ["render", &cornell(), "-o", "a.exr", "--preview", "a.png", "--size", "16x12", "--error", "20%"];
    let run = twolight(dir.path(), &args);
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(run.out.starts_with("a.exr: 16x12"), "{}", run.out);
    let image = raytrace::exr::read_rgb(&dir.path().join("a.exr")).expect("an EXR was written");
    assert_eq!((image.width, image.height), (16, 12));
    assert!(dir.path().join("a.png").is_file());
    let beauty: geometry::Rgb = image.pixels.into_iter().sum();
    let layer = |name| -> geometry::Rgb {
        let layer = raytrace::exr::read_layer(&dir.path().join("a.exr"), name).expect("the layer is there");
        layer.pixels.into_iter().sum()
    };
    let sum: geometry::Rgb = ["direct", "indirect", "specular", "emission"].into_iter().map(layer).sum();
    assert!((beauty - sum).luminance().abs() < 1e-2 * beauty.luminance(), "{beauty:?} {sum:?}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let dir = folder();
    let render = |out: &str, threads: &str| {
        let args =
            ["render", &cornell(), "-o", out, "--size", "24x16", "--error", "20%", "--threads", threads];
        let run = twolight(dir.path(), &args);
        assert_eq!(run.status, 0, "{}", run.err);
        fs::read(dir.path().join(out)).expect("it was written")
    };
    assert!(render("1.exr", "1") == render("3.exr", "3"));
}

#[test]
fn json_describes_the_picture() {
    let dir = folder();
    let args = ["render", &cornell(), "-o", "a.exr", "--width", "16", "--error", "20%", "--json"];
    let run = twolight(dir.path(), &args);
    let json: serde_json::Value = serde_json::from_str(&run.out).expect("stdout is JSON and nothing else");
    let picture = &json["pictures"][0];
    assert_eq!((picture["output"].as_str(), picture["width"].as_u64()), (Some("a.exr"), Some(16)));
    assert_eq!(picture["finished"], true);
}

#[test]
fn a_picture_that_missed_its_error_is_written_and_says_so() {
    let dir = folder();
    // One ray through a pixel leaves every edge as it falls: far from 5 %.
    let cornell = cornell();
    let args = ["render", &cornell, "-o", "a.exr", "--size", "48x48", "--error", "5%", "--samples", "1"];
    let run = twolight(dir.path(), &[&args[..], &["--json"]].concat());
    assert_eq!(run.status, 3, "{}", run.err);
    assert!(run.err.contains("not as exact as asked"), "{}", run.err);
    let json: serde_json::Value = serde_json::from_str(&run.out).expect("stdout is JSON and nothing else");
    let accuracy = &json["pictures"][0]["accuracy"];
    let number = |name: &str| accuracy[name].as_f64().expect("it is a number");
    assert!(number("asked") == 5.0 && number("low") > 5.0, "{accuracy}");
    assert!(number("measured") > number("low") && number("measured") < number("high"), "{accuracy}");
    assert_eq!(accuracy["judgement"], "missed");
    let bytes = fs::read(dir.path().join("a.exr")).expect("it was written");
    assert!(bytes.windows(23).any(|w| w == b"twolight:error measured"));
    // Unasked it is not judged.
    let run = twolight(dir.path(), &[&args[..], &["--no-verify"]].concat());
    assert_eq!(run.status, 0, "{}", run.err);
}

#[test]
fn no_time_gives_a_picture_that_says_so_or_leaves_the_old_one() {
    let dir = folder();
    fs::write(dir.path().join("a.exr"), "precious").expect("it can be written");
    let args = ["render", &cornell(), "-o", "a.exr", "--size", "64x64", "--time-limit", "0.000001s"];
    let run = twolight(dir.path(), &args);
    let bytes = fs::read(dir.path().join("a.exr")).expect("it is there");
    match run.status {
        0 => {
            assert!(run.out.contains("unfinished"), "{}", run.out);
            assert!(bytes.windows(19).any(|w| w == b"twolight:unfinished"));
        }
        _ => assert!(bytes == b"precious" && run.err.contains("the time was up"), "{}", run.err),
    }
}

#[test]
fn what_cannot_work_fails_at_once_with_one_line_that_names_it() {
    let dir = folder();
    fs::write(dir.path().join("bad.glb"), "no scene").expect("it can be written");
    fs::write(dir.path().join("old.exr"), "precious").expect("it can be written");
    let cornell = cornell();
    for (args, word) in [
        (["render", "absent.glb", "-o", "old.exr"], "absent.glb"),
        (["render", "bad.glb", "-o", "old.exr"], "bad.glb"),
        (["render", ".", "-o", "old.exr"], "folder"),
        (["render", &cornell, "-o", "no/such/folder/a.exr"], "no/such/folder"),
        (["render", &cornell, "-o", "."], "folder"),
    ] {
        let run = twolight(dir.path(), &args);
        assert_eq!(run.status, 1, "{args:?}: {}", run.err);
        assert!(run.err.contains(word) && run.err.lines().count() == 1, "{args:?}: {}", run.err);
        assert!(run.out.is_empty());
    }
    assert_eq!(fs::read(dir.path().join("old.exr")).expect("it is still there"), b"precious");
    assert_eq!(fs::read_dir(dir.path()).expect("it is a folder").count(), 2, "nothing is left beside");
}

#[test]
fn an_unknown_camera_or_a_wrong_kind_of_file_is_asked_wrongly() {
    let dir = folder();
    let cornell = cornell();
    for more in
        [["-o", "a.exr", "--camera", "Attic"], ["-o", "a.png", "--seed", "2"], ["-o", "a.glb", "--seed", "2"]]
    {
        let run = twolight(dir.path(), &[&["render", &cornell][..], &more].concat());
        assert_eq!(run.status, 2, "{more:?}: {}", run.err);
    }
    assert_eq!(fs::read_dir(dir.path()).expect("it is a folder").count(), 0);
}

#[test]
fn a_dark_or_cameraless_scene_is_told_so_unless_quiet() {
    let dir = folder();
    fs::write(dir.path().join("dark.gltf"), triangle("", &[])).expect("it can be written");
    let render = |more: &[&str]| {
        let run = twolight(
            dir.path(),
            &[&["render", "dark.gltf", "-o", "a.exr", "--size", "8x8"][..], more].concat(),
        );
        assert_eq!(run.status, 0, "{}", run.err);
        run.err
    };
    let notes = render(&[]);
    assert!(notes.contains("--sky") && notes.contains("no camera"), "{notes}");
    assert!(!render(&["--sky", "100"]).contains("nothing in the file shines"));
    assert_eq!(render(&["--quiet"]), "");
}
