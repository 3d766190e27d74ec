//! Photometric webs: files of every kind, and closed forms.

use super::*;
use crate::sampling::Rng;

/// An LM-63 file of `kind` whose candela at (vertical, horizontal) degrees is `of`.
fn file(kind: u32, vertical: &[f32], horizontal: &[f32], of: impl Fn(f32, f32) -> f32) -> String {
    let list = |all: &[f32]| all.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    let mut text = format!(
        "IESNA:LM-63-2002\n[TEST] a\nTILT=NONE\n1 -1 1 {} {} {kind} 2 0 0 0\n1 1 60\n{}\n{}\n",
        vertical.len(),
        horizontal.len(),
        list(vertical),
        list(horizontal)
    );
    for &h in horizontal {
        text += &format!("{}\n", list(&vertical.iter().map(|&v| of(v, h)).collect::<Vec<_>>()));
    }
    text
}

fn steps(from: f32, to: f32, n: usize) -> Vec<f32> {
    (0..=n).map(|i| from + (to - from) * i as f32 / n as f32).collect()
}

fn read(text: &str) -> Web {
    parse(text.as_bytes()).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Toward a direction in the node's space.
fn toward(web: &Web, d: Vec3) -> f32 {
    web.peak() * web.relative(web.frame() * d.normalize())
}

#[test]
fn a_cosine_lamp_has_pi_times_its_intensity() {
    let web = read(&file(1, &steps(0.0, 90.0, 90), &[0.0], |v, _| 100.0 * v.to_radians().cos()));
    assert!((web.peak() - 100.0).abs() < 1e-4);
    // Chords of 1° under the cosine: (π/180)²/12 less.
    let flux = web.peak() * web.solid_angle();
    assert!((flux / (100.0 * PI) - 1.0).abs() < 5e-5, "{flux}");
    assert!((toward(&web, Vec3::new(0.6, 0.0, -0.8)) - 80.0).abs() < 0.01);
    assert_eq!(toward(&web, Vec3::new(0.6, 0.0, 0.8)), 0.0, "nothing above its last angle");
    assert_eq!(web.reach(), 0.5 * PI);
}

#[test]
fn an_even_lamp_is_a_point() {
    let web = read(&file(1, &[0.0, 180.0], &[0.0], |_, _| 7.0));
    assert!((web.solid_angle() / (4.0 * PI) - 1.0).abs() < 1e-6);
    let mut rng = Rng::new(1, 0);
    for _ in 0..100 {
        let d = crate::sampling::sphere(rng.vec2());
        assert_eq!(web.relative(d), 1.0);
        assert!((web.pdf(d) * 4.0 * PI - 1.0).abs() < 1e-5);
    }
}

/// Every symmetry that the file format knows is the same web as the one written out in full.
#[test]
fn symmetries_unfold() {
    let vertical = steps(0.0, 180.0, 12);
    let full = steps(0.0, 360.0, 24);
    let quarter = |v: f32, h: f32| 10.0 + (2.0 * h.to_radians()).cos() * v.to_radians().sin();
    let half = |v: f32, h: f32| 10.0 + h.to_radians().cos() * v.to_radians().sin();
    let other = |v: f32, h: f32| 10.0 + h.to_radians().sin() * v.to_radians().sin();
    let same = |part: Vec<f32>, of: &dyn Fn(f32, f32) -> f32| {
        let (web, all) = (read(&file(1, &vertical, &part, of)), read(&file(1, &vertical, &full, of)));
        let mut rng = Rng::new(2, 0);
        for _ in 0..200 {
            let d = crate::sampling::sphere(rng.vec2());
            let (a, b) = (toward(&web, d), toward(&all, d));
            assert!((a - b).abs() < 1e-3, "{part:?}, {d}: {a} {b}");
        }
    };
    same(steps(0.0, 90.0, 6), &quarter);
    same(steps(0.0, 180.0, 12), &half);
    same(steps(90.0, 270.0, 12), &other);
    same(steps(0.0, 345.0, 23), &half);
    // No plane of 0° among those of the symmetric half: halfway between 10° and 350°.
    let coarse = read(&file(1, &vertical, &[90.0, 170.0, 190.0, 270.0], other));
    assert!((toward(&coarse, Vec3::X) - 10.0).abs() < 0.2);
}

/// The 0° plane along +x, the 90° plane along +y, seen from above counter-clockwise.
#[test]
fn angles_turn_the_way_of_the_extension() {
    let ahead = |a: f32, b: f32| if a == 0.0 && b == 0.0 { 50.0 } else { 1.0 };
    let marked = |vertical: f32, horizontal: f32| {
        move |v: f32, h: f32| {
            if v == vertical && h.rem_euclid(360.0) == horizontal.rem_euclid(360.0) {
                100.0
            } else {
                ahead(v, h)
            }
        }
    };
    let c = read(&file(1, &steps(0.0, 180.0, 4), &steps(0.0, 360.0, 4), marked(90.0, 90.0)));
    assert!((toward(&c, Vec3::Y) - 100.0).abs() < 1e-3);
    let (right, up) = (steps(-90.0, 90.0, 4), steps(-90.0, 90.0, 4));
    for kind in [2, 3] {
        let web = read(&file(kind, &up, &right, |v, h| marked(90.0, 0.0)(v, h)));
        assert!((toward(&web, Vec3::X) - 100.0).abs() < 1e-3, "type {kind}: vertical angles toward +x");
        assert!((toward(&web, Vec3::NEG_Z) - 50.0).abs() < 1e-3, "type {kind}: 0, 0 is ahead");
        let web = read(&file(kind, &up, &right, marked(0.0, 90.0)));
        assert!((toward(&web, Vec3::NEG_Y) - 100.0).abs() < 1e-3, "type {kind}: clockwise");
        assert_eq!(toward(&web, Vec3::Z), 0.0);
    }
}

#[test]
fn half_of_a_floodlight_is_the_whole_one() {
    let of = |v: f32, h: f32| 100.0 * v.to_radians().cos() * h.to_radians().cos() + v;
    for kind in [2, 3] {
        let whole = read(&file(kind, &steps(-90.0, 90.0, 12), &steps(-90.0, 90.0, 12), |v, h| {
            of(v, h.abs()).max(0.0)
        }));
        let half = read(&file(kind, &steps(-90.0, 90.0, 12), &steps(0.0, 90.0, 6), |v, h| of(v, h).max(0.0)));
        assert_eq!(whole, half);
    }
}

/// Moments of the sampler against the web's own integral, every type.
#[test]
fn sampling_follows_the_intensity() {
    let of = |v: f32, h: f32| 1.0 + (v * 0.05).sin().powi(2) * 40.0 + if h > 20.0 { h } else { 0.0 };
    let webs = [
        file(1, &steps(0.0, 120.0, 17), &steps(0.0, 360.0, 12), of),
        file(2, &steps(-60.0, 90.0, 11), &steps(-90.0, 90.0, 9), of),
        file(3, &steps(-60.0, 60.0, 11), &steps(-90.0, 90.0, 9), of),
    ];
    for text in webs {
        let web = read(&text);
        let n = 200_000;
        let mut rng = Rng::new(3, 0);
        let (mut sum, mut moment, mut even, mut even_moment) = (0f64, 0f64, 0f64, 0f64);
        for _ in 0..n {
            let d = web.sample(rng.array());
            assert!((d.length() - 1.0).abs() < 1e-5);
            let weight = f64::from(web.relative(d) / web.pdf(d));
            assert!(weight.is_finite() && weight > 0.0, "{d}: {weight}");
            (sum, moment) = (sum + weight, moment + weight * f64::from(d.x + 2.0 * d.y - d.z));
            let d = crate::sampling::sphere(rng.vec2());
            let l = f64::from(web.relative(d)) * 4.0 * std::f64::consts::PI;
            (even, even_moment) = (even + l, even_moment + l * f64::from(d.x + 2.0 * d.y - d.z));
        }
        let exact = f64::from(web.solid_angle());
        let n = f64::from(n);
        assert!((sum / n / exact - 1.0).abs() < 5e-3, "{} {exact}", sum / n);
        assert!((even / n / exact - 1.0).abs() < 2e-2, "{} {exact}", even / n);
        assert!((moment / n - even_moment / n).abs() < 0.02 * exact, "{} {}", moment / n, even_moment / n);
    }
}

#[test]
fn what_is_written_is_read_again() {
    let of = |v: f32, h: f32| (200.0 + v - 0.3 * h).max(0.0);
    for (kind, vertical, horizontal) in [
        (1, steps(0.0, 90.0, 9), steps(0.0, 180.0, 6)),
        (2, steps(-90.0, 90.0, 8), steps(0.0, 90.0, 4)),
        (3, steps(-40.0, 90.0, 8), steps(-90.0, 90.0, 4)),
    ] {
        let web = read(&file(kind, &vertical, &horizontal, of));
        let again = read(&web.to_lm63());
        assert_eq!(web.photometry, again.photometry);
        assert!((web.solid_angle() / again.solid_angle() - 1.0).abs() < 1e-5);
        let mut rng = Rng::new(4, 0);
        for _ in 0..200 {
            let d = crate::sampling::sphere(rng.vec2());
            assert!((web.relative(d) - again.relative(d)).abs() < 1e-4, "type {kind}, {d}");
        }
    }
}

/// What makers' files look like: no first line, CR LF, code pages, commas, a tilt's table, values over many lines,
/// factors.
#[test]
fn files_as_they_come() {
    let quirky = b"[MANUFAC] L\xfcmen & S\xf6hne\r\n[MORE]\r\n  tilt=include\r\n1\r\n2\r\n0 90\r\n1.0 0.9\r\n\
        1, 1000, 2.0, 3,\r\n 2 1 1 0.1 0.2 0.3\r\n0.5 1.1 42\r\n0\r\n45 90.0\r\n0 90\r\n10\r\n20 30 1e1 20 -1\r\n\r\n";
    let web = parse(quirky).expect("usable");
    assert!((web.peak() - 30.0 * 2.0 * 0.5 * 1.1).abs() < 1e-4);
    assert!((toward(&web, Vec3::NEG_Z) - 11.0).abs() < 1e-4);
    assert_eq!(toward(&web, Vec3::Y), 0.0, "a negative value is 0");
}

#[test]
fn what_is_no_web_is_refused_with_its_line_and_value() {
    let good = file(1, &[0.0, 45.0, 90.0], &[0.0], |_, _| 1.0);
    let with = |from: &str, to: &str| parse(good.replacen(from, to, 1).as_bytes()).expect_err(to).to_string();
    for (from, to, said) in [
        ("TILT=NONE", "", "no TILT="),
        ("1 -1 1 3 1 1", "1 -1 1 3 1 4", "line 4: photometric type 4"),
        ("1 -1 1 3 1 1", "1 -1 0 3 1 1", "multiplier times ballast factors is 0"),
        ("1 -1 1 3 1 1", "1 -1 1 -3 1 1", "-3 vertical angles"),
        ("1 -1 1 3 1 1", "1 -1 1 3.5 1 1", "3.5 vertical angles"),
        ("1 -1 1 3 1 1", "1 -1 1 1000000 1000000 1", "too many"),
        ("1 -1 1 3 1 1", "1 -1 1 1000000 1 1", "must rise"),
        ("0 45 90", "0 x5 90", "line 6: \"x5\" is not a number, where a vertical angle should be"),
        ("0 45 90", "0 nan 90", "\"nan\" is not a number"),
        ("0 45 90", "0 95 90", "the vertical angle 90 comes after 95"),
        ("0 45 90", "0 45 190", "190 is not within 0 to 180"),
        ("1 1 1\n", "1 1\n", "line 8: the file ends before a candela value"),
        ("1 1 1\n", "0 0 0\n", "shines in no direction"),
        ("1 1 1\n", "1e38 1e39 1\n", "\"1e39\" is not a number"),
    ] {
        let message = with(from, to);
        assert!(message.contains(said), "{to}: {message}");
    }
    let wide = file(1, &[0.0, 90.0], &[0.0, 45.0], |_, _| 1.0);
    assert!(parse(wide.as_bytes()).is_err_and(|e| e.to_string().contains("from 0 to 45")));
    assert!(parse(&vec![b' '; LARGEST + 1]).is_err_and(|e| e.problem.contains("bytes")));
    assert!(parse(b"").is_err() && parse(b"\xff\xfe\x00TILT=").is_err() && parse(b"TILT=NONE").is_err());
}

proptest::proptest! {
    #[test]
    fn no_text_panics(head in "\\PC{0,20}", numbers in proptest::collection::vec(-5i32..400, 0..60)) {
        let text = format!("{head}\nTILT=NONE\n1 1 1 {}", numbers.iter().map(i32::to_string).collect::<Vec<_>>().join(" "));
        let _ = parse(text.as_bytes());
        let _ = parse(format!("TILT={head}").as_bytes());
    }
}
