//! `twolight compare`.

use super::{folder, twolight};
use geometry::Rgb;
use raytrace::exr::{Image, Metadata, write_rgb};
use std::path::Path;

/// An even picture of `value`, 32 × 32.
fn even(dir: &Path, name: &str, value: f32) {
    let image = Image { width: 32, height: 32, pixels: vec![Rgb::splat(value); 32 * 32] };
    write_rgb(&image, &Metadata::default(), &dir.join(name)).expect("it can be written");
}

#[test]
fn the_numbers_are_those_of_the_formula() {
    let dir = folder();
    even(dir.path(), "out.exr", 1.5);
    even(dir.path(), "ref.exr", 1.0);
    let run = twolight(dir.path(), &["compare", "out.exr", "ref.exr", "--json"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let json: serde_json::Value = serde_json::from_str(&run.out).expect("stdout is JSON");
    // d = 0.5, den = 1 + 0.01.
    let expected = 50.0 / 1.01f64.sqrt();
    for name in ["error", "raw_error", "p99", "block16"] {
        let got = json[name].as_f64().expect("it is a number");
        assert!((got - expected).abs() < 1e-6, "{name}: {got} against {expected}");
    }
    assert!((json["bias"].as_f64().expect("it is a number") - 50.0).abs() < 1e-6);
    assert!(json["flip"].as_f64() > Some(0.0));
    let table = twolight(dir.path(), &["compare", "out.exr", "ref.exr", "--no-flip"]).out;
    assert!(table.contains("49.752 %") && !table.contains("flip"), "{table}");
}

#[test]
fn halves_beside_the_reference_are_used() {
    let dir = folder();
    for (name, value) in [("out.exr", 1.5), ("ref.exr", 1.0), ("ref.a.exr", 0.5), ("ref.b.exr", 1.5)] {
        even(dir.path(), name, value);
    }
    let json = twolight(dir.path(), &["compare", "out.exr", "ref.exr", "--json", "--no-flip"]).out;
    let json: serde_json::Value = serde_json::from_str(&json).expect("stdout is JSON");
    assert_eq!(json["ref_noise_removed"], true);
    assert_eq!(json["error"], 0.0, "(1.5 - 0.5)(1.5 - 1.5) = 0");
    assert!(json["error_se"].is_null() && json["flip"].is_null());
}

#[test]
fn an_error_above_the_limit_fails() {
    let dir = folder();
    even(dir.path(), "out.exr", 1.02);
    even(dir.path(), "ref.exr", 1.0);
    let status = |most| twolight(dir.path(), &["compare", "out.exr", "ref.exr", "--max-error", most]).status;
    assert_eq!((status("3%"), status("1%")), (0, 1));
}

#[test]
fn the_difference_is_written_as_asked() {
    let dir = folder();
    even(dir.path(), "out.exr", 1.5);
    even(dir.path(), "ref.exr", 1.0);
    for name in ["d.png", "d.exr"] {
        let run = twolight(dir.path(), &["compare", "out.exr", "ref.exr", "--difference", name]);
        assert_eq!(run.status, 0, "{}", run.err);
        assert!(dir.path().join(name).is_file());
    }
}

#[test]
fn pictures_that_do_not_fit_are_refused_by_name_or_size() {
    let dir = folder();
    even(dir.path(), "ref.exr", 1.0);
    let small = Image { width: 3, height: 2, pixels: vec![Rgb::WHITE; 6] };
    write_rgb(&small, &Metadata::default(), &dir.path().join("small.exr")).expect("it can be written");
    std::fs::write(dir.path().join("text.exr"), "text").expect("it can be written");
    for (name, word) in
        [("small.exr", "3x2 against 32x32"), ("text.exr", "text.exr"), ("absent.exr", "absent.exr")]
    {
        let run = twolight(dir.path(), &["compare", name, "ref.exr"]);
        assert_eq!(run.status, 1);
        assert!(run.err.contains(word) && run.err.lines().count() == 1, "{}", run.err);
    }
}
