//! The cases that rooms are: every solver on each.

use super::{Measure, Row, Section};
use crate::build::{Build, camera, moved};
use crate::files::asset;
use crate::picture::{hybrid, mean, mean_of, range, shoot_with};
use crate::solved::{area_mean, indirect_mean};
use crate::stuff::{glowing, lamp, matt, metal};
use geometry::math::Mat4;
use geometry::{Material, Rgb, Scene, Vec3, World};
use radiosity::classical::{Config, Room};
use radiosity::element::Side;
use radiosity::patch_to_vertex::{corner_rule, fit, vertex_flux};
use radiosity::{Solution, classical, patch_to_vertex};
use raytrace::{DiffuseMode, Settings};
use std::f32::consts::PI;

const LEAK: &str = "a patch that a wall cuts in two has one value for both sides of the wall";
const COARSE: &str = "light from the mesh alone is as coarse as the mesh";

/// A way to solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// The default.
    Gather,
    /// Matrix, by rays.
    Matrix,
    /// Progressive, by rays.
    Progressive,
    /// Progressive, by hemicubes of 32 pixels.
    Hemicube,
}

impl Solver {
    /// All of them.
    pub const ALL: [Solver; 4] = [Solver::Gather, Solver::Matrix, Solver::Progressive, Solver::Hemicube];

    /// Settings at 2 %, of `patches` patches at most where it has some.
    pub fn settings(self, side: u32, patches: usize) -> Settings {
        let classical = |solver| Config {
            patches,
            photons: 200_000,
            tolerance: 0.005,
            ..Config::for_error(solver, 0.02)
        };
        let classical = match self {
            Solver::Gather => None,
            Solver::Matrix => Some(classical(classical::Solver::Matrix)),
            Solver::Progressive => Some(classical(classical::Solver::Progressive)),
            Solver::Hemicube => Some(classical(classical::Solver::Progressive).with_hemicube(32)),
        };
        // The default with fewer rays than 2 % asks for: means over whole rooms need no more.
        Settings { classical, gather_rays: Some(128), ..hybrid(side, side, 0.03) }
    }

    /// The solution at 2 %, of 600 patches at most where it has some; 150 where each shot costs 3000 rays.
    pub fn solve(self, world: &World) -> Solution {
        crate::picture::solve(world, &self.settings(1, if self == Solver::Hemicube { 150 } else { 600 }))
    }
}

type Case = fn(Solver) -> Option<Measure>;

/// The cases.
pub fn section() -> Section {
    let rows: [(&str, &str, Case); 22] = [
        ("C4", "missing light over its bound, stopped early", bound),
        ("C5", "furnace, reflectance 0.5: rms over vertices", furnace),
        ("C6", "sphere of two reflectances: mean", sphere),
        ("C7", "cube of 4 m, 10 000 lm, reflectance 0.2, 0.8, 0.95: worst mean", cube),
        ("C8", "endless plates (by mirrors): worse mean", plates),
        ("C9", "reflectance 0.99: mean", white),
        ("C9", "reflectance 1: ends, finite; 1 if it claims a bound", sealed),
        ("C13", "disc of 5 cm over a floor of 100 m: E on the axis", |s| disc(s, DiffuseMode::Split)),
        ("C13", "the same, all light from the mesh", |s| disc(s, DiffuseMode::Vertex)),
        ("C14", "wall of 2 triangles, or 800 slivers: mean", slivers),
        ("C15", "dark room beside a lit one on one floor: brightest pixel", dark),
        ("C17", "floor with and without T-junctions: mean", junctions),
        ("C18", "sheet lit from above: light below it", sheet),
        ("C21", "least vertex value below the least patch; light lost by the fit", kept),
        ("C21", "the lecture's corner rule on 1, 0.1, 0.1, 0.1: below zero", corners),
        ("C22", "floor under one lamp: indirect light", once),
        ("C23", "1 or 3 threads: other bits", threads),
        ("C23", "triangles in another order: mean", order),
        ("C24", "twice the lamp: light over 2, less 1", twice),
        ("C24", "turned, and 1e-3 or 1e3 times as large: worst mean", rigid),
        ("C24", "moved by 100 km, the room 256 m: mean", far),
        ("C26", "energy balance less 1", balance),
    ];
    let rows = rows.map(|(id, what, case)| {
        let begin = std::time::Instant::now();
        let cells = Solver::ALL.map(case).into();
        println!("{id} {what}: {:.1} s", begin.elapsed().as_secs_f64());
        Row { id, what, cells }
    });
    Section {
        title: "Solvers",
        methods: vec!["gather (default)", "matrix", "progressive", "hemicube 32"],
        rows: rows.into(),
    }
}

/// A room 2 × 2 × 2 m with a block and a lamp on the ceiling.
fn room() -> Build {
    let white = matt(0.6);
    Build::new()
        .room(Vec3::ZERO, Vec3::splat(2.0), [&matt(0.3), &white, &white, &white, &white, &white])
        .block(Vec3::new(0.9, 0.0, 0.5), Vec3::new(1.5, 0.7, 1.1), &white)
        .level(1.98, [0.6, 0.6], [1.2, 1.2], false, &lamp(100.0))
}

/// Area mean of the indirect light of [`room`] wherever it is fronts that see it.
fn mean_of_room(solver: Solver, scene: Scene) -> f64 {
    let world = World::new(scene);
    let solution = solver.solve(&world);
    indirect_mean(&world, &solution)
}

fn bound(solver: Solver) -> Option<Measure> {
    let settings = solver.settings(1, 200);
    let config = settings.classical.filter(|c| c.solver == classical::Solver::Progressive)?;
    // Everything shines and reflects a half: Σ A E is twice the emission, whatever the shape.
    let m = glowing(1.0 / PI, 0.5);
    let world = Build::new().room(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), [&m; 6]).world();
    let room = Room::new(&world, &config, &());
    let mut shooting = room.shooting(&config);
    let mut worst = 0f64;
    for shots in [10, 100, 200, 300, 500] {
        shooting.shoot_until(shots, |_| false);
        let arrived: Rgb = room
            .patches
            .all
            .iter()
            .enumerate()
            .map(|(i, p)| (shooting.direct[i] + shooting.indirect[i]) * p.area)
            .sum();
        let missing = f64::from(44.0 - arrived.g) / f64::from(arrived.g);
        worst = worst.max(missing / f64::from(shooting.bound()));
    }
    // f32 sums of hundreds of shots.
    Measure::new(worst, 1.0 + 1e-4)
}

fn furnace(solver: Solver) -> Option<Measure> {
    let m = glowing(1.0 / PI, 0.5);
    let world = Build::new().room(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), [&m; 6]).world();
    let solution = solver.solve(&world);
    // B = 2, of which 1 arrives straight.
    let values: Vec<f64> = solution.vertices(Side::Front).map(|(_, e)| f64::from(e.g)).collect();
    let rms = (values.iter().map(|e| (e - 1.0).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
    // Every surface is a lamp, which few rays sample badly: twice what is asked for.
    Measure::new(rms, 0.06)
}

fn sphere(solver: Solver) -> Option<Measure> {
    let rho = |centre: Vec3| if centre.y > 0.0 { 0.9f32 } else { 0.3 };
    let at = Vec3::new(0.2, -0.4, 0.1);
    let world = Build::new().ball(Vec3::ZERO, 1.0, 3, true, |c| matt(rho(c))).point_lamp(at, 100.0).world();
    let (mut caught, mut absorbed) = (0.0, 0.0);
    for t in 0..world.scene.mesh.triangles.len() as u32 {
        let [a, b, c] = world.scene.mesh.corners(t).map(|p| p - at);
        let omega = f64::from(geometry::triangle::solid_angle(a, b, c));
        let rho =
            f64::from(world.scene.materials[world.scene.mesh.materials[t as usize].0 as usize].base_color.g);
        caught += 100.0 * omega * rho;
        absorbed += f64::from(world.scene.mesh.area(t)) * (1.0 - rho);
    }
    let solution = solver.solve(&world);
    // In a sphere everything sees everything alike: H = Σ ρ Φ / Σ (1 − ρ) A. Facets of 0.2 m bend away by 0.5 %.
    Measure::new((indirect_mean(&world, &solution) / (caught / absorbed) - 1.0).abs(), 0.02)
}

fn cube_error(solver: Solver, rho: f32) -> (f64, Solution) {
    let wall = matt(rho);
    let world = Build::new()
        .room(Vec3::splat(-2.0), Vec3::splat(2.0), [&wall; 6])
        .point_lamp(Vec3::ZERO, 10_000.0 / (4.0 * PI))
        .world();
    let solution = solver.solve(&world);
    let exact = f64::from(10_000.0 * rho / (96.0 * (1.0 - rho)));
    ((indirect_mean(&world, &solution) / exact - 1.0).abs(), solution)
}

fn cube(solver: Solver) -> Option<Measure> {
    Measure::new([0.2, 0.8, 0.95].map(|rho| cube_error(solver, rho).0).into_iter().fold(0.0, f64::max), 0.02)
}

fn plates(solver: Solver) -> Option<Measure> {
    let (rho1, rho2) = (0.8f32, 0.5);
    let (floor, ceiling, mirror) = (glowing(1.0 / PI, rho1), matt(rho2), metal(1.0, 0.0));
    let world = Build::new()
        .room(Vec3::ZERO, Vec3::new(1.0, 0.5, 1.0), [&mirror, &mirror, &floor, &ceiling, &mirror, &mirror])
        .world();
    let solution = solver.solve(&world);
    let b1 = f64::from(1.0 / (1.0 - rho1 * rho2));
    let worst = [(-1.0f32, b1), (1.0, f64::from(rho2) * b1)].map(|(up, exact)| {
        // The ceiling looks down and receives B1; the floor looks up and receives B2.
        let of = |t: u32| world.scene.mesh.geometric_normal(t).y * up > 0.5;
        let e = area_mean(&world, of, |t, u, v| {
            solution.irradiance(&world, t, u, v, Side::Front)
                + solution.direct(&world, t, u, v, Side::Front)
                + solution.caustic(&world, t, u, v, Side::Front)
        });
        (e / exact - 1.0).abs()
    });
    Measure::new(worst[0].max(worst[1]), 0.02)
}

fn white(solver: Solver) -> Option<Measure> {
    if solver == Solver::Hemicube {
        return None; // a thousand shots from every patch, of 3000 rays each, show nothing that rays do not
    }
    let (error, solution) = cube_error(solver, 0.99);
    let converged = solution.report.convergence.converged;
    // Errors of a row's sum come back a hundredfold.
    Measure::new(if converged { error } else { f64::INFINITY }, 0.06)
}

fn sealed(solver: Solver) -> Option<Measure> {
    let wall = matt(1.0);
    let world = Build::new()
        .room(Vec3::splat(-2.0), Vec3::splat(2.0), [&wall; 6])
        .point_lamp(Vec3::ZERO, 1.0)
        .world();
    let settings = solver.settings(1, 100);
    let solved = match &settings.classical {
        // Progressive refinement needs as many shots as light needs bounces: stopped, as by Ctrl-C or a time limit.
        Some(config) => classical::solve(&world, &Config { shots: 2000, ..config.clone() }, &()),
        None => raytrace::prepass(&world, &settings, &()),
    };
    let odd = match solved {
        Err(_) => 0.0,
        Ok(s) if !s.vertices(Side::Front).all(|(_, e)| e.is_finite() && e.min_channel() >= 0.0) => {
            f64::INFINITY
        }
        Ok(s) => f64::from(u8::from(s.report.convergence.converged && s.report.norm >= 1.0)),
    };
    Measure::new(odd, 0.0)
}

fn disc(solver: Solver, mode: DiffuseMode) -> Option<Measure> {
    let (r, h, n) = (0.05f32, 1.0f32, 32);
    let mut build = Build::new().level(0.0, [-50.0, -50.0], [50.0, 50.0], true, &matt(0.5));
    // Quadrilaterals of four corners of the disc's outline each.
    let at = |k: usize| {
        let a = 2.0 * PI * k as f32 / n as f32;
        Vec3::new(r * a.cos(), h, r * a.sin())
    };
    for k in (0..n).step_by(2) {
        build = build.quad([Vec3::Y * h, at(k), at(k + 1), at(k + 2)], &lamp(1000.0));
    }
    let world = build.world();
    let settings = Settings { diffuse: mode, ..solver.settings(4, 600) };
    let solution = crate::picture::solve(&world, &settings);
    let eye = crate::build::parallel(Vec3::Y * 0.9, Vec3::ZERO, 0.01, 0.0);
    let got = mean(&shoot_with(&world, &eye, Some(&solution), &settings));
    // A polygon of 32 corners has sin(2π/n) / (2π/n) of the disc's area.
    let area = f64::from((2.0 * PI / n as f32).sin() / (2.0 * PI / n as f32));
    let exact = 0.5 * 1000.0 * f64::from(r * r / (r * r + h * h)) * area;
    let error = (got / exact - 1.0).abs();
    match mode {
        DiffuseMode::Vertex => Measure::limit(error, 0.02, COARSE),
        _ => Measure::new(error, 0.002),
    }
}

fn slivers(solver: Solver) -> Option<Measure> {
    let with = |cells: usize| {
        let white = matt(0.7);
        let c = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let back = |x0: f32, x1: f32| [c(x0, 0.0, 0.0), c(x1, 0.0, 0.0), c(x1, 2.0, 0.0), c(x0, 2.0, 0.0)];
        let mut build = Build::new().level(0.0, [0.0, 0.0], [2.0, 2.0], true, &white).level(
            1.9,
            [0.5, 0.5],
            [1.5, 1.5],
            false,
            &lamp(100.0),
        );
        for k in 0..cells {
            let x = |k: usize| 2.0 * k as f32 / cells as f32;
            build = build.quad(back(x(k), x(k + 1)), &white);
        }
        let world = build.world();
        let solution = solver.solve(&world);
        indirect_mean(&world, &solution)
    };
    // Triangles 1 to 400 long. They eat up all patches there are, and leave two for the floor.
    Measure::new((with(400) / with(1) - 1.0).abs(), if solver == Solver::Gather { 0.02 } else { 0.05 })
}

fn dark(solver: Solver) -> Option<Measure> {
    let (scene, cameras) = asset("two-rooms.gltf");
    let world = World::new(scene);
    let settings = solver.settings(24, if solver == Solver::Hemicube { 300 } else { 600 });
    let solution = crate::picture::solve(&world, &settings);
    let lit = camera(Vec3::new(0.3, 1.5, 2.7), Vec3::new(2.9, 0.5, 0.5), 1.0);
    let bright = mean(&shoot_with(&world, &lit, Some(&solution), &settings));
    let most = range(&shoot_with(&world, &cameras[0], Some(&solution), &settings)).1 / bright;
    match solver {
        Solver::Gather => Measure::new(most, 0.005),
        _ => Measure::limit(most, 0.005, LEAK),
    }
}

fn junctions(solver: Solver) -> Option<Measure> {
    let with = |parts: usize| {
        let white = matt(0.6);
        let mut build = Build::new()
            .room(Vec3::ZERO, Vec3::splat(2.0), [&white, &white, &matt(0.0), &white, &white, &white])
            .level(1.98, [0.6, 0.6], [1.2, 1.2], false, &lamp(100.0));
        // A second floor a hair above the black one, in strips that do not meet the walls' corners.
        for k in 0..parts {
            let x = |k: usize| 2.0 * k as f32 / parts as f32;
            build = build.level(1e-3, [x(k), 0.0], [x(k + 1), 2.0], true, &white);
        }
        let world = build.world();
        let solution = solver.solve(&world);
        let floor = |t: u32| world.scene.mesh.corners(t).iter().all(|p| p.y == 1e-3);
        area_mean(&world, floor, |t, u, v| solution.irradiance(&world, t, u, v, Side::Front))
    };
    Measure::new((with(3) / with(1) - 1.0).abs(), 0.02)
}

fn sheet(solver: Solver) -> Option<Measure> {
    let white = matt(0.8);
    let world = Build::new()
        .level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &white)
        .level(0.0, [-1.0, -1.0], [1.0, 1.0], false, &white)
        .block(Vec3::new(-0.2, 0.1, -0.2), Vec3::new(0.2, 0.4, 0.2), &white)
        .point_lamp(Vec3::new(0.5, 1.0, 0.5), 100.0)
        .world();
    let solution = solver.solve(&world);
    let below =
        |t: u32| world.scene.mesh.geometric_normal(t).y < -0.5 && world.scene.mesh.corners(t)[0].y == 0.0;
    let e = area_mean(&world, below, |t, u, v| {
        solution.irradiance(&world, t, u, v, Side::Front) + solution.direct(&world, t, u, v, Side::Front)
    });
    Measure::new(e, 0.0)
}

fn kept(solver: Solver) -> Option<Measure> {
    let config = solver.settings(1, 600).classical?;
    let world = room().world();
    let room = Room::new(&world, &config, &());
    // A value for each patch with steep steps: what a lamp and its shadows leave.
    let values: Vec<Rgb> = (0..room.patches.len() as u32)
        .map(|i| {
            let [a, b, c] = room.patches.corners(i);
            let middle = (a + b + c) / 3.0;
            Rgb::splat(if middle.x < 1.0 { 0.1 } else { 10.0 * middle.y + 0.1 })
        })
        .collect();
    let (slots, usable) = fit(&room.patches, &values, patch_to_vertex::Fit::Conservative);
    let least =
        slots.iter().zip(&usable).filter(|(_, u)| **u).map(|(v, _)| v.g).fold(f32::INFINITY, f32::min);
    let before: f32 = room.patches.all.iter().zip(&values).map(|(p, v)| p.area * v.g).sum();
    let lost = (vertex_flux(&room.patches, &slots).g / before - 1.0).abs();
    Measure::new(f64::from((0.1 - least).max(0.0).max(lost)), 1e-5)
}

fn corners(solver: Solver) -> Option<Measure> {
    if solver != Solver::Matrix {
        return None;
    }
    let squares = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]];
    let v = corner_rule(&squares, 9, &[1.0, 0.1, 0.1, 0.1].map(Rgb::splat));
    let least = v.iter().map(|v| v.g).fold(f32::INFINITY, f32::min);
    Measure::limit(
        f64::from(-least),
        0.0,
        "it extrapolates beyond the patches; as an option it is cut back to their range",
    )
}

fn once(solver: Solver) -> Option<Measure> {
    let world = Build::new()
        .level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5))
        .level(1.0, [-0.5, -0.5], [0.5, 0.5], false, &lamp(1000.0))
        .world();
    let eye = crate::build::parallel(Vec3::Y * 3.0, Vec3::ZERO, 1.5, 2.5);
    let settings = solver.settings(8, 600);
    let solution = crate::picture::solve(&world, &settings);
    let film = shoot_with(&world, &eye, Some(&solution), &settings);
    Measure::new(mean_of(&film, |p| p.indirect) / mean_of(&film, |p| p.direct), 1e-6)
}

fn threads(solver: Solver) -> Option<Measure> {
    let world = room().world();
    let with = |n: usize| -> Vec<(Vec3, Rgb)> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads can be started");
        pool.install(|| crate::picture::solve(&world, &solver.settings(1, 300)))
            .vertices(Side::Front)
            .collect()
    };
    Measure::new(f64::from(u8::from(with(1) != with(3))), 0.0)
}

fn order(solver: Solver) -> Option<Measure> {
    let scene = room().scene;
    let mut other = scene.clone();
    let n = other.mesh.triangles.len();
    for i in 0..n {
        // 7 has no factor in common with the number of triangles.
        let j = (7 * i + 3) % n;
        other.mesh.triangles[i] = scene.mesh.triangles[j];
        other.mesh.materials[i] = scene.mesh.materials[j];
    }
    assert!(!n.is_multiple_of(7), "{n} triangles");
    Measure::new((mean_of_room(solver, other) / mean_of_room(solver, scene) - 1.0).abs(), 0.01)
}

fn twice(solver: Solver) -> Option<Measure> {
    let scene = room().scene;
    let mut bright = scene.clone();
    bright.materials.iter_mut().for_each(|m: &mut Material| m.emissive *= 2.0);
    Measure::new((mean_of_room(solver, bright) / mean_of_room(solver, scene) / 2.0 - 1.0).abs(), 1e-5)
}

fn rigid(solver: Solver) -> Option<Measure> {
    let scene = room().scene;
    let here = mean_of_room(solver, scene.clone());
    let eye = camera(Vec3::ONE, Vec3::ZERO, 1.0);
    let turn = Mat4::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), 2.1);
    let error = |scale: f32, turn: Mat4| {
        (mean_of_room(solver, moved(&scene, &eye, scale, turn, Vec3::ZERO).0) / here - 1.0).abs()
    };
    Measure::new(error(1.0, turn).max(error(1e-3, Mat4::IDENTITY)).max(error(1e3, Mat4::IDENTITY)), 0.02)
}

fn far(solver: Solver) -> Option<Measure> {
    let scene = room().scene;
    let eye = camera(Vec3::ONE, Vec3::ZERO, 1.0);
    // A power of two, so that both meshes have the same bits up to 2^-7 m, a thousandth of the lamp's side.
    let [near, far] = [0.0f32, 131_072.0]
        .map(|x| mean_of_room(solver, moved(&scene, &eye, 128.0, Mat4::IDENTITY, Vec3::new(x, -x, x)).0));
    Measure::new((far / near - 1.0).abs(), 0.02)
}

fn balance(solver: Solver) -> Option<Measure> {
    let solution = solver.solve(&room().world());
    Measure::new(f64::from((solution.report.balance - 1.0).abs()), 0.01)
}
