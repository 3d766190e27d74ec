//! Whether what is random has the mean and the spread that it states.
//!
//! Samples are independent and seeds fixed; z by the measured variance, |z| < 4.9, so one false alarm in a million each.

use geometry::sampling::Rng;
use geometry::{Camera, Rgb, Vec3, World};
use radiosity::Config;
use radiosity::caustic::Caustics;
use radiosity::element::Side;
use raytrace::integrator::path::{Aid, Even, aided_radiance, radiance};
use raytrace::{DiffuseMode, Film, Settings};
use support::blocks::ALARM;
use support::build::{Build, camera};
use support::files::asset;
use support::picture::{hybrid, mean, path, shoot, shoot_with, solve};
use support::solved::area_mean;
use support::stuff::{glass, lamp, matt, metal};

/// The variance layer of the reference is that of its pixels: squared differences of two independent pictures over the
/// sum of their variances average 1. Over 24² pixels of 64 paths the average has a standard error of 6 % (√(2/576)), or
/// rather more where a few paths carry much of the light: an error of a third would be found.
#[test]
fn the_variance_of_paths_is_as_stated() {
    let (scene, cameras) = asset("cornell-box.gltf");
    let world = World::new(scene);
    let [a, b] = [1, 2].map(|seed| shoot(&world, &cameras[0], &Settings { seed, ..path(24, 24, 64) }));
    let ratio = |(p, q): (&raytrace::Pixel, &raytrace::Pixel)| {
        let d = p.beauty().luminance() - q.beauty().luminance();
        let v = p.variance + q.variance;
        (v > 0.0).then(|| f64::from(d * d / v))
    };
    let ratios: Vec<f64> = a.pixels.iter().zip(&b.pixels).filter_map(ratio).collect();
    let average = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("squared differences over stated variance: {average} of {} pixels", ratios.len());
    assert!(ratios.len() > 500 && (average - 1.0).abs() < 0.33, "{average}");
}

/// Pixels of `film` in which no lamp is seen: the edges of a lamp, fifty times as bright as the room, would drown the
/// rest in their noise.
fn without_lamps(film: &Film) -> Vec<usize> {
    (0..film.pixels.len()).filter(|&i| film.pixels[i].emission.is_black()).collect()
}

fn mean_over(film: &Film, pixels: &[usize]) -> f64 {
    pixels.iter().map(|&i| f64::from(film.pixels[i].beauty().luminance())).sum::<f64>() / pixels.len() as f64
}

/// Sixteen prepasses and pictures of the two passes, each with its own seed: their mean luminance is that of the paths, by
/// Student's t with the fifteen degrees of freedom that they leave (|t| < 7.8 is one alarm in a million). The mesh's
/// own error is the same in all of them, hence the 0.5 % allowed beyond the noise.
#[test]
fn the_mean_over_seeds_is_that_of_paths() {
    let (scene, cameras) = asset("cornell-box.gltf");
    let world = World::new(scene);
    let paths = shoot(&world, &cameras[0], &path(16, 16, 1024));
    let room = without_lamps(&paths);
    let exact = mean_over(&paths, &room);
    let se =
        room.iter().map(|&i| f64::from(paths.pixels[i].variance)).sum::<f64>().sqrt() / room.len() as f64;
    let modes = [DiffuseMode::Split, DiffuseMode::Gather];
    let runs: Vec<[f64; 2]> = (0..16)
        .map(|seed| {
            let settings = Settings { seed, gather_rays: Some(64), ..hybrid(16, 16, 0.05) };
            let solution = solve(&world, &settings);
            modes.map(|diffuse| {
                let settings = Settings { diffuse, ..settings.clone() };
                mean_over(&shoot_with(&world, &cameras[0], Some(&solution), &settings), &room)
            })
        })
        .collect();
    for (k, mode) in modes.into_iter().enumerate() {
        let means: Vec<f64> = runs.iter().map(|run| run[k]).collect();
        let average = means.iter().sum::<f64>() / 16.0;
        let variance = means.iter().map(|m| (m - average).powi(2)).sum::<f64>() / 15.0 / 16.0;
        println!("{mode:?}: {average} ± {} against {exact} ± {se}", variance.sqrt());
        let noise = ((7.8 * variance.sqrt()).powi(2) + (ALARM * se).powi(2)).sqrt();
        assert!((average - exact).abs() < noise + 0.005 * exact, "{mode:?}: {average}, not {exact}");
        assert!(noise < 0.02 * exact, "the test finds 2.5 %: {noise} of {exact}");
    }
}

/// Probes leave light by way of mirrors to photons, and are to find the same as plain paths: a floor beside a mirror,
/// under a lamp large enough for paths to meet. Leaving that light out, or counting it twice, would be off by its share.
#[test]
fn aided_paths_have_the_mean_of_plain_ones() {
    let c = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let mirror = [c(-1.0, 0.0, -1.0), c(-1.0, 0.0, 1.0), c(-1.0, 2.0, 1.0), c(-1.0, 2.0, -1.0)];
    let world = Build::new()
        .level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &matt(0.5))
        .level(2.0, [-0.6, -0.6], [0.6, 0.6], false, &lamp(10.0))
        .quad(mirror, &metal(0.9, 0.0))
        .world();
    let caustics = Caustics::trace(&world, 1_000_000, 1);
    let eye = camera(c(-0.2, 1.0, 0.0), c(-0.2, 0.0, 0.001), 0.5);
    let ((plain, v), (aided, w)) = plain_and_aided(&world, &eye, Some(&caustics));
    let share = {
        let e = caustics.irradiance(c(-0.2, 0.0, 0.0), Vec3::Y);
        f64::from(0.5 * e.g / std::f32::consts::PI) / plain
    };
    println!("plain {plain}, aided {aided}, of which by the mirror {share}");
    assert!(share > 0.1, "the test would find a tenth of the light: {share}");
    // Of what the mirror brings a fiftieth is left to the estimate by photons.
    let allowed = ALARM * (v + w).sqrt() + 0.02 * share * plain;
    assert!((aided - plain).abs() < allowed && allowed < 0.02 * plain, "{aided}, not {plain}: {allowed}");
}

/// Mean and variance of that mean over paths of one picture, plain and with aid.
fn plain_and_aided(world: &World, eye: &Camera, caustics: Option<&Caustics>) -> ((f64, f64), (f64, f64)) {
    let mean = |aided: bool| {
        const PATHS: u32 = 200_000;
        let (mut sum, mut square) = (0.0, 0.0);
        for i in 0..PATHS {
            let mut rng = Rng::new(7 + u64::from(aided), u64::from(i));
            let light = match aided {
                false => {
                    let ray = eye.ray(rng.f32(), rng.f32(), 1.0);
                    radiance(world, ray, &mut rng).0.total()
                }
                true => {
                    let even = Even::new(i % 64, i / 64);
                    let [x, y] = even.place();
                    aided_radiance(world, eye.ray(x, y, 1.0), Aid { caustics, even }, &mut rng)
                }
            };
            sum += f64::from(light.g);
            square += f64::from(light.g).powi(2);
        }
        let n = f64::from(PATHS);
        (sum / n, (square / n - (sum / n).powi(2)).max(0.0) / n)
    };
    (mean(false), mean(true))
}

/// Three panes between the eye and a floor in the light: a number that let a path through the first must not choose again
/// at the second, or all would let pass what one does.
#[test]
fn probes_look_through_panes_as_plain_paths_do() {
    let pane = glass(1.5, None);
    let at = |b: Build, y: f32| b.level(y, [-2.0, -2.0], [2.0, 2.0], true, &pane);
    let floor = Build::new().level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &matt(0.5)).level(
        0.4,
        [-0.9, -0.9],
        [-0.5, 0.9],
        false,
        &lamp(10.0),
    );
    let world = [0.6, 0.7, 0.8].into_iter().fold(floor, at).world();
    let eye = camera(Vec3::new(0.3, 1.0, 0.0), Vec3::new(0.3, 0.0, 0.001), 0.3);
    let ((plain, v), (aided, w)) = plain_and_aided(&world, &eye, None);
    println!("plain {plain}, aided {aided}");
    // With the same numbers for each pane 3.4 % too much came through.
    let allowed = ALARM * (v + w).sqrt();
    assert!((aided - plain).abs() < allowed && allowed < 0.03 * plain, "{aided}, not {plain}: {allowed}");
}

/// Rough metal under a lamp and the sky, with a pane between that does not bend or mirror anything: what shadow rays see
/// through it and what the gloss's own rays see through it are the same light, and count once.
#[test]
fn gloss_under_a_pane_is_as_bright_as_without_it() {
    let under = |panes: &[f32]| {
        let open = Build::new()
            .level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &metal(0.8, 0.4))
            .level(2.0, [-0.5, -0.5], [0.5, 0.5], false, &lamp(10.0))
            .sky(1.0);
        let pane = glass(1.0, None);
        let at = |b: Build, &y: &f32| b.level(y, [-6.0, -6.0], [6.0, 6.0], true, &pane);
        let world = panes.iter().fold(open, at).world();
        let eye = camera(Vec3::new(0.3, 0.5, 1.0), Vec3::new(0.0, 0.0, -0.3), 0.6);
        mean(&shoot(&world, &eye, &Settings { verify: false, ..hybrid(8, 8, 0.05) }))
    };
    let (open, one, two) = (under(&[]), under(&[1.0]), under(&[0.8, 1.0]));
    println!("open {open}, under a pane {one}, under two {two}");
    // 1.6 times as bright when the pane made them two.
    assert!((one / open - 1.0).abs() < 0.01 && (two / open - 1.0).abs() < 0.01, "{open} {one} {two}");
}

/// A dark room beside a bright one, with a gap of 10 cm between: its light is found by one ray in a hundred, and its mean
/// does not hang on how many are cast. Were only sites cast again whose own rays met the gap, it would be too dark.
#[test]
fn light_through_a_gap_has_the_same_mean_with_few_rays() {
    let m = matt(0.5);
    let world = Build::new()
        .room(Vec3::ZERO, Vec3::new(6.0, 3.0, 4.0), [&m; 6])
        .block(Vec3::new(3.0, -0.1, -0.1), Vec3::new(3.1, 3.1, 3.9), &m)
        .point_lamp(Vec3::new(1.5, 2.0, 2.0), 100.0)
        .world();
    let mean = |config: &Config| {
        let solution = radiosity::solve(&world, config, &()).expect("finite");
        area_mean(
            &world,
            |_| true,
            |t, u, v| {
                let at = world.scene.mesh.interpolate(t, u, v, &world.scene.mesh.positions);
                if at.x > 3.2 { solution.irradiance(&world, t, u, v, Side::Front) } else { Rgb::BLACK }
            },
        )
    };
    // One mesh for all: which leaves few rays would split is another question.
    let one_mesh = Config { most_sites: 1500, rounds: 0, ..Config::for_error(0.05) };
    let exact = mean(&Config { rays: 2048, noise: f32::INFINITY, ..one_mesh.clone() });
    let few = |seed| mean(&Config { rays: 64, noise: 0.05, seed, ..one_mesh.clone() }) / exact;
    let few: Vec<f64> = (0..16).map(few).collect();
    let average = few.iter().sum::<f64>() / few.len() as f64;
    // By their own luck it was 0.915.
    assert!((average - 1.0).abs() < 0.03, "{average} of {exact} lx: {few:.3?}");
}
