//! `twolight measure` and `twolight false-colour`.

use super::{Run, folder, scene, twolight};
use serde_json::{Value, json};
use std::path::Path;

/// A lamp of 800 cd, 2.5 m over a black floor of 4 m × 2 m, which is named Floor.
fn lamp_over_floor(dir: &Path) {
    let mut bytes = Vec::new();
    let corners = [[-2f32, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 0.0, -1.0], [-2.0, 0.0, -1.0]];
    corners.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    [0u16, 1, 2, 0, 2, 3].iter().for_each(|i| bytes.extend(i.to_le_bytes()));
    std::fs::write(dir.join("lamp.bin"), &bytes).expect("it can be written");
    let scene = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_specular"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 800.0}]}},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"name": "Floor", "mesh": 0},
            {"translation": [0.0, 2.5, 0.0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{
            "name": "black",
            "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
            "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
        }],
        "buffers": [{"uri": "lamp.bin", "byteLength": 60}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-2, 0, -1], "max": [2, 0, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
    });
    std::fs::write(dir.join("lamp.gltf"), scene.to_string()).expect("it can be written");
}

/// I cos θ / d² of that lamp on a level plane.
fn exact(x: f64, y: f64, z: f64) -> f64 {
    let h = 2.5 - y;
    800.0 * h / (x * x + h * h + z * z).powf(1.5)
}

fn measure(dir: &Path, args: &[&str]) -> Run {
    twolight(dir, &[&["measure", "lamp.gltf", "-q"], args].concat())
}

fn parsed(run: &Run) -> Value {
    assert_eq!(run.status, 0, "{}", run.err);
    serde_json::from_str(&run.out).expect("stdout is JSON")
}

#[test]
fn points_are_measured_where_they_are() {
    let dir = folder();
    lamp_over_floor(dir.path());
    let run = measure(dir.path(), &["--point", "1,0.85,-0.5", "--point", "-1,0,0", "--json"]);
    let report = parsed(&run);
    let readings = report["sets"][0]["readings"].as_array().expect("points are listed");
    for (reading, (x, y, z)) in readings.iter().zip([(1.0, 0.85, -0.5), (-1.0, 0.0, 0.0)]) {
        let got = reading["illuminance"].as_f64().expect("a number");
        assert!((got / exact(x, y, z) - 1.0).abs() < 1e-4, "{got} for {}", exact(x, y, z));
        assert_eq!((&reading["indirect"], &reading["specular"]), (&json!(0.0), &json!(0.0)));
    }
    let run = measure(dir.path(), &["--point", "0,1.5,0", "--normal", "0,-1,0"]);
    assert!(run.out.contains("(0, 1.5, 0) facing (0, -1, 0): 0 lx"), "{}", run.out);
    std::fs::write(dir.path().join("p.csv"), "x,y,z\n# the middle\n0,0.5,0\n").expect("it can be written");
    let run = measure(dir.path(), &["--points", "p.csv"]);
    assert!(run.out.contains("200.0 lx"), "800 cd at 2 m: {}", run.out);
}

#[test]
fn a_work_plane_gives_csv_statistics_and_a_picture() {
    let dir = folder();
    lamp_over_floor(dir.path());
    let args =
        ["--workplane", "0.5", "--surface", "Floor", "-o", "lux.csv", "--false-colour", "lux.png", "--json"];
    let report = parsed(&measure(dir.path(), &args));
    let mut reader = csv::Reader::from_path(dir.path().join("lux.csv")).expect("it is written");
    let heading = reader.headers().expect("it has a heading").clone();
    let column = |name: &str| heading.iter().position(|h| h == name).expect("the column is there");
    let (e, set) = (column("E_lx"), column("set"));
    let (mut sums, mut least, mut count) = ([0.0, 0.0], f64::INFINITY, 0);
    for record in reader.records() {
        let record = record.expect("it parses");
        let value = |i: usize| record[i].parse::<f64>().expect("a number");
        let (x, y, z) = (value(column("x")), value(column("y")), value(column("z")));
        assert!((value(e) / exact(x, y, z) - 1.0).abs() < 1e-3, "{record:?}");
        let on_floor = &record[set] == "Floor";
        assert_eq!(on_floor, y < 1e-4);
        assert_eq!(record[column("L_cd_m2")].is_empty(), !on_floor);
        sums[usize::from(on_floor)] += value(e);
        if !on_floor {
            least = value(e).min(least);
            count += 1;
        }
    }
    assert_eq!(count, 16 * 8, "0.25 m apart");
    let plane = &report["sets"][0];
    let number = |name: &str| plane[name].as_f64().expect("a number");
    let mean = sums[0] / 128.0;
    assert!((number("mean") / mean - 1.0).abs() < 1e-6 && (number("min") / least - 1.0).abs() < 1e-6);
    assert!((number("u0") - least / mean).abs() < 1e-6 && number("ud") < number("u0"));
    assert_eq!(report["sets"][1]["points"], 128);
    for set in report["sets"].as_array().expect("two sets") {
        let path = dir.path().join(set["false_colour"].as_str().expect("it is drawn"));
        let picture = image::open(path).expect("it is a PNG").into_rgb8();
        assert!(picture.width() > 700, "{}", picture.width());
    }
}

#[test]
fn the_same_seed_gives_the_same_readings_on_any_number_of_threads() {
    let dir = folder();
    let box_scene = scene("cornell-box.gltf");
    let run = |threads: &str, out: &str| {
        let args = ["measure", box_scene.to_str().expect("UTF-8"), "--workplane", "0.2", "--spacing", "0.1"];
        let run =
            twolight(dir.path(), &[&args[..], &["--error", "20%", "--threads", threads, "-o", out]].concat());
        assert_eq!(run.status, 0, "{}", run.err);
        std::fs::read(dir.path().join(out)).expect("it is written")
    };
    assert_eq!(run("1", "a.csv"), run("3", "b.csv"));
}

#[test]
fn a_solution_serves_for_measuring() {
    let dir = folder();
    let box_scene = scene("cornell-box.gltf");
    let file = box_scene.to_str().expect("UTF-8");
    let solve = twolight(dir.path(), &["solve", file, "-o", "box.twl", "--error", "10%", "-q"]);
    assert_eq!(solve.status, 0, "{}", solve.err);
    let read = |more: &[&str]| {
        let args = ["measure", file, "--point", "0.278,0.3,0.28", "--error", "3%", "--json", "-q"];
        let reading =
            parsed(&twolight(dir.path(), &[&args[..], more].concat()))["sets"][0]["readings"][0].clone();
        ["illuminance", "indirect"].map(|name| reading[name].as_f64().expect("a number"))
    };
    let ([with, indirect], [without, _]) = (read(&["--solution", "box.twl"]), read(&[]));
    assert!((with / without - 1.0).abs() < 0.04 && indirect > 0.05 * with, "{with} {without} {indirect}");
    let run = twolight(dir.path(), &["measure", file, "--point", "0,0,0", "--solution", "no.twl"]);
    assert!(run.status == 1 && run.err.contains("no.twl"), "{}", run.err);
}

#[test]
fn what_is_asked_wrongly_is_said() {
    let dir = folder();
    lamp_over_floor(dir.path());
    std::fs::write(dir.path().join("bad.csv"), "x,y,z\n1,2,3\n1,two,3\n").expect("it can be written");
    for (args, status, word) in [
        (&["--surface", "Flor"][..], 2, "\"Floor\", \"black\""),
        (&[], 2, "say where"),
        (&["--point", "1,2"], 2, "X,Y,Z"),
        (&["--plane", "0,0,0 1,0,0 1,1,0"], 2, "right angles"),
        (&["--plane", "0,0,0 1,0,0 0,0,0"], 2, "no area"),
        (&["--workplane", "1", "--spacing", "0.0001"], 2, "larger spacing"),
        (&["--surface", "Floor", "--spacing", "0.0001"], 2, "larger --spacing"),
        (&["--point", "0,1,0", "-o", "lux.exr"], 2, ".csv"),
        (&["--point", "0,1,0", "--max", "5"], 2, "--false-colour"),
        (&["--point", "0,1,0", "--false-colour", "lux.png"], 2, "there is none"),
        (&["--points", "bad.csv"], 1, "line 3"),
        (&["--points", "no.csv"], 1, "no.csv"),
        (&["--plane", "0,-1,1 1,0,0 0,0,-1"], 1, "no point is left"),
    ] {
        let run = measure(dir.path(), args);
        assert_eq!(run.status, status, "{args:?}: {}{}", run.out, run.err);
        assert!(run.err.contains(word), "{args:?}: {}", run.err);
    }
}

#[test]
fn a_picture_in_false_colour_has_the_colours_of_its_scale() {
    use geometry::Rgb;
    use raytrace::exr::{Image, Metadata, write_rgb};
    use raytrace::false_colour::Scale;
    let dir = folder();
    let pixels = (0..64 * 48).map(|i| Rgb::splat((i % 64) as f32)).collect();
    let image = Image { width: 64, height: 48, pixels };
    write_rgb(&image, &Metadata::default(), &dir.path().join("a.exr")).expect("it can be written");
    let run = twolight(dir.path(), &["false-colour", "a.exr", "-o", "a.png", "--max", "100"]);
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(run.out.contains("up to 100 cd/m2"), "{}", run.out);
    let picture = image::open(dir.path().join("a.png")).expect("it is a PNG").into_rgb8();
    let scale = Scale::linear(100.0);
    let row = |y: u32| (0..picture.width()).map(move |x| (x, y));
    let wanted: Vec<[u8; 3]> = (0..64).map(|v| scale.colour(f64::from(v))).collect();
    let found = (0..picture.height()).any(|y| {
        let colours: Vec<[u8; 3]> = row(y).map(|(x, y)| picture.get_pixel(x, y).0).collect();
        colours.windows(64).any(|w| w == wanted)
    });
    assert!(found, "a row of the picture is the ramp by the scale");
    let run = twolight(
        dir.path(),
        &["false-colour", "a.exr", "-o", "a.png", "--max", "50", "--isolines", "10,20", "--json"],
    );
    let told: Value = serde_json::from_str(&run.out).expect("it is JSON");
    assert_eq!((&told["values"]["min"], &told["values"]["max"]), (&0.0.into(), &63.0.into()), "{told}");
    assert!((told["values"]["mean"].as_f64().unwrap() - 31.5).abs() < 1e-3, "{told}");
    assert_eq!((&told["scale"], &told["scale_max"]), (&"linear".into(), &50.0.into()), "{told}");
    assert_eq!((&told["isolines"], &told["unit"]), (&vec![10.0, 20.0].into(), &"cd/m2".into()), "{told}");
    for (args, word) in [
        (&["a.exr", "-o", "a.jpg"][..], ".png"),
        (&["a.exr", "-o", "b.png", "--layer", "irradiance"], "irradiance"),
        (&["no.exr", "-o", "b.png"], "no.exr"),
    ] {
        let run = twolight(dir.path(), &[&["false-colour"], args].concat());
        assert!(run.status > 0 && run.err.contains(word), "{}", run.err);
    }
}
