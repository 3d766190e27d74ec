//! Closed rooms, where the light that bounces is known by its balance alone.

use geometry::{Material, Rgb, Vec3, World};
use radiosity::element::Side;
use radiosity::{Config, Solution};
use raytrace::Settings;
use raytrace::measure::Sensor;
use std::f32::consts::PI;
use support::blocks::compare;
use support::build::{Build, camera};
use support::files::asset;
use support::picture::{hybrid, luminance, mean, path, range, shoot, shoot_with, solve};
use support::solved::{by_paths, indirect_mean};
use support::stuff::{glowing, lamp, matt, metal};

/// Case 5.8 of CIE 171:2006: a cube of 4 m, 10 000 lm at its centre.
const FLUX: f32 = 10_000.0;

fn cube(rho: f32) -> World {
    let wall = matt(rho);
    Build::new()
        .room(Vec3::splat(-2.0), Vec3::splat(2.0), [&wall; 6])
        .point_lamp(Vec3::ZERO, FLUX / (4.0 * PI))
        .world()
}

fn cube_solved(rho: f32, error: f32) -> (World, Solution) {
    let world = cube(rho);
    let solution = solve(&world, &hybrid(1, 1, error));
    (world, solution)
}

/// Φ ρ / (A (1 − ρ)), the area mean of what has bounced: the energy balance, whatever the shape. Asked for 2 %.
#[test]
fn what_bounces_in_a_closed_cube_is_its_balance() {
    for rho in [0.2, 0.5, 0.8, 0.9, 0.95] {
        let (world, solution) = cube_solved(rho, 0.02);
        let error = indirect_mean(&world, &solution) / f64::from(FLUX * rho / (96.0 * (1.0 - rho))) - 1.0;
        println!("rho {rho}: {:+.3} %", 100.0 * error);
        assert!(error.abs() < 0.02, "rho {rho}: {error}");
        let report = &solution.report;
        assert!(report.convergence.converged, "rho {rho}: {report:?}");
        // What leaves the walls and what arrives at them are summed over the same vertices, so that only the rays'
        // noise and the interpolation part them.
        assert!((report.balance - 1.0).abs() < 0.01, "rho {rho}: balance {}", report.balance);
    }
}

/// A vertex receives no more than the brightest place sends out, and no less than the dimmest: F sums to 1.
///
/// With the lamp at the centre, direct light is I / 4 at the middle of a wall and I · 2 / 12^1.5 in a corner. The
/// estimate at one vertex has noise; 5 % is six times the root mean square that 2 % asks for, in thousands of vertices.
#[test]
fn no_vertex_leaves_the_range_of_what_it_sees() {
    let rho = 0.8;
    let (_, solution) = cube_solved(rho, 0.02);
    let direct = |d: f32| FLUX / (4.0 * PI) * 2.0 / d.powi(3);
    let values: Vec<f32> = solution.vertices(Side::Front).map(|(_, e)| e.g).collect();
    let (least, most) = values.iter().fold((f32::MAX, 0f32), |(a, b), &v| (a.min(v), b.max(v)));
    assert!(values.len() > 100 && most < 1.05 * rho * (most + direct(2.0)), "{most}");
    assert!(least > 0.95 * rho * (least + direct(12f32.sqrt())), "{least}");
}

/// The answer is within the bound that the report states: against a solve of the same rows to a hundredth of it.
#[test]
fn the_solver_stops_at_its_bound() {
    let world = cube(0.9);
    let config = |solve_tolerance| Config { solve_tolerance, rays: 64, ..Config::for_error(0.05) };
    let run = |tolerance| radiosity::solve(&world, &config(tolerance), &()).expect("a cube has a solution");
    let (rough, exact) = (run(0.02), run(2e-4));
    let (a, b) = (rough.report.convergence, exact.report.convergence);
    assert!(a.converged && b.converged && a.iterations <= b.iterations, "{a:?} {b:?}");
    assert!(a.bound <= 0.02 * 1.1 * rough.report.mean.mean(), "{a:?}");
    let pairs = rough.vertices(Side::Front).zip(exact.vertices(Side::Front));
    let apart = pairs.map(|((p, a), (q, b))| {
        assert_eq!(p, q, "both have the same mesh");
        (a - b).map(f32::abs).max_channel()
    });
    let apart: Vec<f32> = apart.collect();
    let mean = apart.iter().sum::<f32>() / apart.len() as f32;
    assert!(mean > 0.0 && mean <= a.bound + b.bound, "{mean} {a:?} {b:?}");
}

/// Of a panel whose corners all lie within its frame the first mesh knows nothing; its middles tell. Without refinement,
/// which would find it too where gathers are left, against paths.
#[test]
fn a_panel_in_its_frame_is_lit() {
    let wall = matt(0.6);
    let mut build = Build::new().room(Vec3::splat(-2.0), Vec3::splat(2.0), [&wall; 6]);
    build = build.point_lamp(Vec3::new(0.5, 1.0, 0.0), 500.0);
    // 1.2 m across, its border 10 cm deep in bars of 20 cm.
    let (edge, bar) = (0.6, 0.1);
    let first = 12; // triangles of the room
    build = build.level(-1.0, [-edge, -edge], [edge, edge], true, &wall);
    for [lo, hi] in [
        [[-edge - bar, -edge - bar], [edge + bar, -edge + bar]],
        [[-edge - bar, edge - bar], [edge + bar, edge + bar]],
        [[-edge - bar, -edge + bar], [-edge + bar, edge - bar]],
        [[edge - bar, -edge + bar], [edge + bar, edge - bar]],
    ] {
        build = build.block(Vec3::new(lo[0], -1.1, lo[1]), Vec3::new(hi[0], -0.9, hi[1]), &wall);
    }
    let world = build.world();
    let config = Config { rounds: 0, h0: 0.45, ..Config::for_error(0.05) };
    let solution = radiosity::solve(&world, &config, &()).expect("it has a solution");
    for t in [first, first + 1] {
        let mesh = &world.scene.mesh;
        let position = mesh.interpolate(t, 1.0 / 3.0, 1.0 / 3.0, &mesh.positions);
        let sensor = Sensor { position, normal: Vec3::Y, on_surface: true };
        let (all, noise) = by_paths(&world, &sensor, 200_000, 1);
        // The path tracer's rays from a point find no point lamp: what it sees there has bounced.
        let got = f64::from(solution.irradiance(&world, t, 1.0 / 3.0, 1.0 / 3.0, Side::Front).luminance());
        println!("panel, triangle {t}: {got:.1} lx, {all:.1} ± {noise:.1} by paths");
        assert!((got / all - 1.0).abs() < 0.15, "{got} {all}");
    }
}

/// At ρ = 0.99 a bounce keeps 99 %, and errors of the rows' sums come back a hundredfold: 0.05 % of them make 5 %.
#[test]
fn almost_white_converges_and_says_how() {
    let (world, solution) = cube_solved(0.99, 0.02);
    let report = &solution.report;
    assert!(report.convergence.converged && report.convergence.iterations < 200, "{report:?}");
    assert!((report.norm - 0.99).abs() < 2e-3, "{report:?}");
    let error = indirect_mean(&world, &solution) / f64::from(FLUX * 0.99 / (96.0 * 0.01)) - 1.0;
    assert!(error.abs() < 0.06, "{error}");
}

/// Where nothing absorbs there is no steady light: that must end, without NaN, and not be called converged.
#[test]
fn a_sealed_white_room_is_not_called_solved() {
    let world = cube(1.0);
    let config = Config { rays: 32, rounds: 1, ..Config::for_error(0.1) };
    match radiosity::solve(&world, &config, &()) {
        Err(e) => assert!(e.to_string().contains("not finite"), "{e}"),
        Ok(solution) => {
            let report = &solution.report;
            // Half of the time the rows of a sampled K sum to a hair less than 1, and there is an answer of sorts.
            assert!(!report.convergence.converged || report.norm < 1.0, "{report:?}");
            assert!(solution.vertices(Side::Front).all(|(_, e)| e.is_finite() && e.g >= 0.0));
        }
    }
}

/// L = L_e + ρ L everywhere whatever the shapes: the furnaces must be plain white. Within 0.5 % in every block of 8 × 8
/// beyond the pixels' stated noise, and in the mean.
#[test]
fn furnaces_are_plain_white() {
    for name in ["furnace.gltf", "furnace-mixed.gltf"] {
        let (scene, cameras) = asset(name);
        let world = World::new(scene);
        for settings in [Settings { gather_rays: Some(64), ..hybrid(32, 32, 0.02) }, path(32, 32, 64)] {
            let film = shoot(&world, &cameras[0], &settings);
            let mut white = film.clone();
            for p in &mut white.pixels {
                *p = raytrace::Pixel { emission: Rgb::WHITE, ..raytrace::Pixel::default() };
            }
            let c = compare(&film, &white);
            let square = luminance(&film).iter().map(|y| (y - 1.0).powi(2)).sum::<f64>() / 1024.0;
            println!("{name}, {:?}: rms {}, {c:?}", settings.integrator, square.sqrt());
            assert!(c.agrees(0.005, 0.005), "{name}, {:?}: {c:?}", settings.integrator);
            // Noise alone: the paths leave 2.4 %, the two passes 3.4 % where 2 % was asked for.
            assert!(square.sqrt() < 0.06, "{name}, {:?}: {}", settings.integrator, square.sqrt());
        }
    }
}

/// Every surface of a furnace is a lamp: hundreds share a point's shadow rays, and of some only a sliver rises over its
/// horizon. No ray that finds one may count for thousands.
#[test]
fn no_lamp_that_is_hardly_seen_leaves_a_white_dot() {
    let (scene, cameras) = asset("furnace.gltf");
    let world = World::new(scene);
    let coarse = hybrid(96, 96, 0.1);
    let solution = solve(&world, &coarse);
    for seed in 0..6 {
        let film = shoot_with(&world, &cameras[0], Some(&solution), &Settings { seed, ..coarse.clone() });
        let (_, brightest) = range(&film);
        assert!(brightest < 5.0, "seed {seed}: {brightest} cd/m2 where all is 1");
    }
}

/// In a sphere F = A_j / A, so whatever bounces is the same everywhere: H = mean(ρ E) / (1 − mean(ρ)) by area, for
/// any lamp and any ρ. Here one half reflects 0.9, the other 0.3, and the lamp is off the centre, toward the dark.
#[test]
fn what_bounces_in_a_sphere_is_even() {
    let lamp_at = Vec3::new(0.2, -0.4, 0.1);
    let rho = |centre: Vec3| if centre.y > 0.0 { 0.9f32 } else { 0.3 };
    let world = Build::new()
        .ball(Vec3::ZERO, 1.0, 4, true, |centre| matt(rho(centre)))
        .point_lamp(lamp_at, 100.0)
        .world();
    // Flux on each facet: intensity times solid angle; so the sums are those of the facets, not of the sphere.
    let (mut caught, mut absorbed, mut area) = (0.0, 0.0, 0.0);
    for t in 0..world.scene.mesh.triangles.len() as u32 {
        let [a, b, c] = world.scene.mesh.corners(t).map(|p| (p - lamp_at).normalize().as_dvec3());
        let omega = 2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let (size, rho) = (f64::from(world.scene.mesh.area(t)), f64::from(world_rho(&world, t)));
        caught += 100.0 * omega * rho;
        absorbed += size * (1.0 - rho);
        area += size;
    }
    let exact = caught / absorbed;
    let solution = solve(&world, &hybrid(1, 1, 0.02));
    let mean = indirect_mean(&world, &solution);
    println!("sphere: {:+.3} %", 100.0 * (mean / exact - 1.0));
    // Facets of 0.1 m bend away from the sphere by 0.1²/8 = 0.1 %.
    assert!(area > 12.4 && (mean / exact - 1.0).abs() < 0.02, "{mean} {exact}");
    let values: Vec<f64> = solution.vertices(Side::Front).map(|(_, e)| f64::from(e.g)).collect();
    let spread = values.iter().map(|v| (v / exact - 1.0).powi(2)).sum::<f64>() / values.len() as f64;
    assert!(spread.sqrt() < 0.03, "rms over vertices {}", spread.sqrt());
}

fn world_rho(world: &World, t: u32) -> f32 {
    world.scene.materials[world.scene.mesh.materials[t as usize].0 as usize].base_color.g
}

/// Two endless plates, by mirrors all around: B1 = M / (1 − ρ1 ρ2) and B2 = ρ2 B1. Light comes over mirrors to each
/// plate directly (photons), by way of the other, and by itself; each once.
#[test]
fn plates_between_mirrors_are_endless() {
    let (rho1, rho2) = (0.8f32, 0.5);
    let (floor, ceiling, mirror) = (glowing(1.0 / PI, rho1), matt(rho2), metal(1.0, 0.0));
    let world = Build::new()
        .room(Vec3::ZERO, Vec3::new(1.0, 0.5, 1.0), [&mirror, &mirror, &floor, &ceiling, &mirror, &mirror])
        .world();
    let b1 = 1.0 / (1.0 - rho1 * rho2);
    let settings = hybrid(16, 16, 0.02);
    let solution = solve(&world, &settings);
    let middle = Vec3::new(0.5, 0.25, 0.5);
    for (direction, b) in [(Vec3::Y, rho2 * b1), (Vec3::NEG_Y, b1)] {
        let eye = camera(middle, middle + direction, 0.8);
        let exact = f64::from(b / PI);
        let two_pass = mean(&shoot_with(&world, &eye, Some(&solution), &settings)) / exact - 1.0;
        let paths = shoot(&world, &eye, &path(16, 16, 64));
        let se = support::picture::standard_error(&paths) / exact;
        let by_paths = mean(&paths) / exact - 1.0;
        println!("plate toward {direction}: two passes {two_pass:+.4}, paths {by_paths:+.4} ± {se:.4}");
        assert!(two_pass.abs() < 0.02, "toward {direction}: {two_pass}");
        // A path ends after 256 mirrors at the latest, which leaves nothing to see here.
        assert!(by_paths.abs() < support::blocks::ALARM * se, "toward {direction}: {by_paths} ± {se}");
    }
}

/// A wall of two triangles or of 200: the same light.
#[test]
fn finer_input_is_the_same_room() {
    let room = |cells: usize| {
        let (white, shine) = (matt(0.7), lamp(100.0));
        let c = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let floor = [c(0.0, 0.0, 2.0), c(2.0, 0.0, 2.0), c(2.0, 0.0, 0.0), c(0.0, 0.0, 0.0)];
        let back = [c(0.0, 0.0, 0.0), c(2.0, 0.0, 0.0), c(2.0, 2.0, 0.0), c(0.0, 2.0, 0.0)];
        Build::new()
            .grid(floor, cells, &white)
            .grid(back, cells, &white)
            .level(1.9, [0.5, 0.5], [1.5, 1.5], false, &shine)
            .world()
    };
    let eye = camera(Vec3::new(1.0, 1.2, 4.0), Vec3::new(1.0, 0.7, 0.0), 0.6);
    let [coarse, fine] = [1, 10].map(|cells| shoot(&room(cells), &eye, &hybrid(32, 32, 0.02)));
    let c = compare(&fine, &coarse);
    println!("finer input: {c:?}");
    assert!(c.agrees(0.01, 0.02), "{c:?}");
}

/// ρ = 1 in one channel is no reason to give up where light finds something black in the end.
#[test]
fn one_channel_may_be_white_while_others_are_not() {
    let wall = Material { base_color: Rgb::new(1.0, 0.5, 0.0), ..matt(1.0) };
    let world = Build::new()
        .room(Vec3::splat(-1.0), Vec3::new(1.0, 2.0, 1.0), [&wall, &wall, &wall, &matt(0.0), &wall, &wall])
        .point_lamp(Vec3::ZERO, 1.0)
        .world();
    let solution = solve(&world, &hybrid(1, 1, 0.05));
    assert!(solution.vertices(Side::Front).all(|(_, e)| e.is_finite() && e.b == 0.0 && e.r > e.g));
}
