//! Measured lamps (IES LM-63) through the light meter and both integrators.

use geometry::ies;
use geometry::math::Mat3;
use geometry::{Light, LightKind, Rgb, Vec3, World};
use raytrace::measure::{Meter, Sensor, prepass};
use std::sync::Arc;
use support::blocks::compare;
use support::build::{Build, camera};
use support::picture::{hybrid, path, shoot};
use support::solved::by_paths;
use support::stuff::{matt, metal};

/// A lamp at `position` that aims down, its 0° plane along +x and its 90° plane along −z: candela at (vertical,
/// horizontal) degrees are `of`, every `step` degrees.
fn downlight(position: Vec3, step: usize, of: impl Fn(f32, f32) -> f32) -> Light {
    let angles = |end: usize| (0..=end / step).map(|i| (i * step) as f32).collect::<Vec<_>>();
    let (vertical, horizontal) = (angles(180), angles(360));
    let list = |all: &[f32]| all.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    let mut file = format!("TILT=NONE\n1 -1 1 {} {} 1 2 0 0 0 1 1 0\n", vertical.len(), horizontal.len());
    file += &format!("{}\n{}\n", list(&vertical), list(&horizontal));
    for &h in &horizontal {
        file += &format!("{}\n", list(&vertical.iter().map(|&v| of(v, h)).collect::<Vec<_>>()));
    }
    let web = Arc::new(ies::parse(file.as_bytes()).expect("a web"));
    // The node is turned by −90° about x.
    let turn = web.frame() * Mat3::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let intensity = Rgb::splat(web.peak());
    Light {
        name: "lamp".into(),
        intensity,
        kind: LightKind::Photometric { position, turn, range: f32::INFINITY, web },
    }
}

fn with(build: Build, light: Light) -> World {
    let mut scene = build.world().scene;
    scene.lights.push(light);
    World::new(scene)
}

/// I = 900 cos θ: E = 900 cos² θ / d² on a floor; lopsided lamps are brighter on the side of their file.
#[test]
fn the_floor_under_a_measured_lamp() {
    let lamp = Vec3::new(0.3, 2.5, -0.2);
    let floor = || Build::new().level(0.0, [-5.0, -5.0], [5.0, 5.0], true, &matt(0.0));
    let read = |world: &World, p: Vec3| {
        let solution = prepass(world, 0.01, 1, &()).expect("a solution");
        Meter::new(world, &solution, 0.01, 1).read(&Sensor::at(world, p, Vec3::Y), 0).illuminance()
    };
    let world = with(floor(), downlight(lamp, 1, |v, _| (900.0 * v.to_radians().cos()).max(0.0)));
    for p in [Vec3::ZERO, Vec3::new(0.3, 0.0, -0.2), Vec3::new(2.0, 0.0, -3.0), Vec3::new(-4.0, 0.0, 1.0)] {
        let cos = 2.5 / p.distance(lamp);
        let exact = 900.0 * cos * cos / p.distance_squared(lamp);
        let got = read(&world, p);
        // Chords of a degree under the cosine: 4e-5 of it.
        assert!((got / exact - 1.0).abs() < 2e-4, "{p}: {got} for {exact}");
    }
    let lopsided = with(floor(), downlight(lamp, 10, |_, h| if h == 90.0 { 500.0 } else { 100.0 }));
    let at = |x: f32, z: f32| read(&lopsided, Vec3::new(0.3 + x, 0.0, -0.2 + z));
    assert!((at(0.0, -1.0) / at(0.0, 1.0) - 5.0).abs() < 1e-3, "90° lies along −z");
    assert!((at(1.0, 0.0) / at(-1.0, 0.0) - 1.0).abs() < 1e-3);
}

/// One that shines alike everywhere is a point, bit for bit where it is seen and within rounding elsewhere; a lopsided one
/// in a room with a mirror gives the same light by radiosity, photons and paths.
#[test]
fn a_measured_lamp_in_a_room() {
    let room = || {
        let (grey, mirror) = (matt(0.6), metal(0.9, 0.0));
        let walls = [&grey, &grey, &grey, &grey, &mirror, &grey];
        Build::new().room(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0), walls)
    };
    let place = Vec3::new(0.4, 1.9, 0.3);
    let eye = camera(Vec3::new(-1.5, 1.4, 1.5), Vec3::new(0.3, 0.6, -0.6), 0.9);
    let point = room().point_lamp(place, 300.0).world();
    let even = with(room(), downlight(place, 30, |_, _| 300.0));
    let quick = hybrid(24, 24, 0.02);
    let c = compare(&shoot(&even, &eye, &quick), &shoot(&point, &eye, &quick));
    println!("even against point: {c:?}");
    assert!(c.bias.abs() < 2e-3 && c.rms < 0.02, "{c:?}");
    // Paths find no lamp by a mirror, so that their room has none; its photons are held against the point's above.
    let matt_room =
        || Build::new().room(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0), [&matt(0.6); 6]);
    let of = |v: f32, h: f32| if v < 60.0 { 400.0 + h } else { 20.0 };
    let world = with(matt_room(), downlight(place, 15, of));
    let c = compare(&shoot(&world, &eye, &hybrid(24, 24, 0.01)), &shoot(&world, &eye, &path(24, 24, 256)));
    println!("lopsided, two passes against paths: {c:?}");
    assert!(c.agrees(0.01, 0.03), "{c:?}");
    let solution = prepass(&world, 0.01, 1, &()).expect("a solution");
    let sensor = Sensor::at(&world, Vec3::new(-1.0, 2.499, -1.0), Vec3::NEG_Y);
    // A ray from the sensor meets no lamp without extent: paths know the indirect light only.
    let by_meter = f64::from(Meter::new(&world, &solution, 0.005, 1).read(&sensor, 0).indirect.luminance());
    let (exact, se) = by_paths(&world, &sensor, 100_000, 7);
    assert!((by_meter / exact - 1.0).abs() < 0.015 + 4.9 * se / exact, "{by_meter} for {exact} ± {se}");
}
