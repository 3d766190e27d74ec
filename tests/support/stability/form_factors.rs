//! C1, C2, C10, C11, C12: form factors between squares by every way to find them.

use super::{Measure, Row, Section};
use crate::build::Build;
use crate::stuff::glowing;
use geometry::{Vec3, World};
use radiosity::form_factor::FormFactors;
use radiosity::form_factor::analytic::{corners, polygon_to_polygon};
use radiosity::form_factor::hemicube::{Hemicube, published_share};
use radiosity::form_factor::matrix::Matrix;
use radiosity::form_factor::ray_cast::{Estimate, estimate};
use radiosity::patches::Patches;

/// One chance in a million of a false alarm, for Student's t of 63 degrees of freedom.
const T_63: f64 = 5.4;
const ONE_POINT: &str = "a hemicube stands at one point of the patch, and what is near looks otherwise from there than from the rest of it";
const ALIASING: &str =
    "what falls between the middles of pixels is not seen, and what covers one counts as the whole pixel";

/// The cases, by closed form, hemicubes of 64 pixels, and rays.
pub fn section() -> Section {
    let rows: [(&str, &str, Case); 7] = [
        ("C1", "unit squares, parallel at distance 1: F = 0.199825", |how| {
            squares(how, &parallel(), 0.199_824_895_7, 2)
        }),
        ("C1", "unit squares at right angles: F = 0.200044", |how| {
            squares(how, &corner(), 0.200_043_776_1, 2)
        }),
        ("C2", "box of 1 × 2 × 3: rows sum to 1", |how| closure(how, false)),
        ("C2", "the same, reciprocity enforced", |how| closure(how, true)),
        ("C10", "0.998 · Σ of a row, above 1", row_sum),
        ("C11", "lamp of 1/50 over a floor, moved by half a pixel", small_lamp),
        ("C12", "squares at right angles, 128 patches each, worst pair that touches", touching),
    ];
    let ways = [Way::Closed, Way::Hemicube(64), Way::Rays, Way::Published];
    let rows = rows.map(|(id, what, case)| Row { id, what, cells: ways.iter().map(|w| case(*w)).collect() });
    Section {
        title: "Form factors",
        methods: vec!["closed form", "hemicube 64", "rays (in 5.4 σ)", "hemicube, weights as published"],
        rows: rows.into(),
    }
}

type Case = fn(Way) -> Option<Measure>;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Closed,
    Hemicube(u32),
    Rays,
    Published,
}

impl Way {
    fn form_factors(self) -> Option<FormFactors> {
        match self {
            Way::Closed => Some(FormFactors::Analytic),
            Way::Hemicube(n) => Some(FormFactors::Hemicube(Hemicube::new(n))),
            Way::Rays => Some(FormFactors::RayCast(1024)),
            Way::Published => None,
        }
    }
}

fn v(p: [f32; 3]) -> Vec3 {
    Vec3::from(p)
}

/// The floor of a unit cube and the square above it, which shine so that both are patches.
fn parallel() -> Build {
    let m = glowing(1.0, 0.5);
    Build::new().level(0.0, [0.0, 0.0], [1.0, 1.0], true, &m).level(1.0, [0.0, 0.0], [1.0, 1.0], false, &m)
}

/// The floor and the wall at x = 0.
fn corner() -> Build {
    let m = glowing(1.0, 0.5);
    let wall = [[0., 0., 1.], [0., 0., 0.], [0., 1., 0.], [0., 1., 1.]].map(v);
    Build::new().level(0.0, [0.0, 0.0], [1.0, 1.0], true, &m).quad(wall, &m)
}

/// Form factor from the first quadrilateral of a scene to the second, of which both are cut into `most / 2` patches.
fn whole(how: &FormFactors, world: &World, most: usize) -> f64 {
    let patches = Patches::new(world, most, 0);
    let (mut sum, mut area) = (0.0, 0.0);
    for (i, p) in patches.all.iter().enumerate().filter(|(_, p)| p.triangle < 2) {
        let row = how.row(world, &patches, i as u32, 0, i as u64);
        let to = row.iter().filter(|a| patches.all[a.patch as usize].triangle >= 2);
        sum += f64::from(p.area) * to.map(|a| f64::from(a.share.g)).sum::<f64>();
        area += f64::from(p.area);
    }
    sum / area
}

fn squares(way: Way, build: &Build, exact: f64, patches: usize) -> Option<Measure> {
    let (how, world) = (way.form_factors()?, build.clone().world());
    if way == Way::Rays {
        // Of the first triangle, and of the second, which rays know nothing of each other.
        let patches = Patches::new(&world, 2 * patches, 0);
        let of = |i: u32| {
            let all = estimate(&world, &patches, i, 1024, 64, u64::from(i));
            let to = patches.all.iter().zip(&all).filter(|(p, _)| p.triangle >= 2);
            to.fold((0.0, 0.0), |(f, s), (_, e)| (f + e.form_factor, s + e.variance))
        };
        let ((a, va), (b, vb)) = (of(0), of(1));
        // Shares of one row exclude each other, so their variances add up to too much rather than too little.
        return Measure::new((0.5 * (a + b) - exact).abs() / (0.5 * (va + vb).sqrt()), T_63);
    }
    let error = (whole(&how, &world, 2 * patches) / exact - 1.0).abs();
    match way {
        Way::Closed => Measure::new(error, 1e-6),
        _ => Measure::limit(error, 1e-3, ONE_POINT),
    }
}

/// Relative error (root mean square over places) of a small lamp's form factor by hemicubes of each resolution: for a chart.
pub fn hemicube_errors() -> Vec<(u32, f64)> {
    const PLACES: u32 = 24;
    let of = |n: u32| {
        let cube = FormFactors::Hemicube(Hemicube::new(n));
        let square: f64 = (0..PLACES)
            .map(|k| {
                let world = small_lamp_scene(0.013 + 0.37 * k as f32 / PLACES as f32, 0.1);
                let patches = Patches::new(&world, 4, 0);
                (seen(&cube, &world, &patches) / lamp_exact(&patches) - 1.0).powi(2)
            })
            .sum();
        (n, (square / f64::from(PLACES)).sqrt())
    };
    [8, 16, 32, 64, 128, 256, 512].map(of).into()
}

fn closed_box() -> World {
    let m = glowing(1.0, 0.5);
    Build::new().room(Vec3::ZERO, v([1., 2., 3.]), [&m; 6]).world()
}

fn closure(way: Way, enforce: bool) -> Option<Measure> {
    let (how, world) = (way.form_factors()?, closed_box());
    let patches = Patches::new(&world, 200, 0);
    let mut matrix = Matrix::fill(&world, &patches, &how, 0, || ());
    if enforce {
        matrix.enforce();
        let closure = matrix.closure();
        let sums = f64::from((closure.sums[0] - 1.0).max(1.0 - closure.sums[1]));
        return Measure::new(closure.reciprocity.max(sums), 1e-4);
    }
    let [most, least] = matrix.closure().sums;
    Measure::new(f64::from((most - 1.0).max(1.0 - least)), 1e-5)
}

fn row_sum(way: Way) -> Option<Measure> {
    // The coarsest cube that anybody would take.
    let n = 4;
    let cube = Hemicube::new(n);
    let above = |sum: f64| (0.998 * sum - 1.0).max(0.0);
    match way {
        Way::Hemicube(_) => Measure::new(above(cube.pixels().iter().map(|p| p.share).sum()), 1e-12),
        Way::Published => {
            let sum = cube.pixels().iter().map(|p| published_share(p.direction, n)).sum();
            Measure::limit(
                above(sum),
                1e-12,
                "midpoint weights of 4 pixels sum to 1.036: at reflectances above 0.965 light grows with every bounce",
            )
        }
        _ => None,
    }
}

/// A small square of floor, and a lamp of side `side` one metre over it, shifted by `shift`.
fn small_lamp_scene(shift: f32, side: f32) -> World {
    let m = glowing(1.0, 0.0);
    Build::new()
        .level(0.0, [-0.001, -0.001], [0.001, 0.001], true, &m)
        .level(1.0, [shift, 0.05], [shift + side, 0.05 + side], false, &m)
        .world()
}

fn lamp_exact(patches: &Patches) -> f64 {
    let from = corners(patches.corners(0));
    (0..patches.len() as u32)
        .filter(|&j| patches.all[j as usize].triangle >= 2)
        .map(|j| polygon_to_polygon(&from, &corners(patches.corners(j))))
        .sum()
}

fn seen(how: &FormFactors, world: &World, patches: &Patches) -> f64 {
    let row = how.row(world, patches, 0, 0, 0);
    row.iter().filter(|a| patches.all[a.patch as usize].triangle >= 2).map(|a| f64::from(a.share.g)).sum()
}

fn small_lamp(way: Way) -> Option<Measure> {
    let how = way.form_factors()?;
    let mut worst = 0f64;
    for k in 0..16 {
        let world = small_lamp_scene(0.2 + k as f32 / 64.0 / 8.0, 0.02);
        let patches = Patches::new(&world, 4, 0);
        let exact = lamp_exact(&patches);
        let error = match way {
            Way::Rays => {
                let all: Vec<Estimate> = estimate(&world, &patches, 0, 4096, 64, k);
                let to = patches.all.iter().zip(&all).filter(|(p, _)| p.triangle >= 2);
                let (f, s) = to.fold((0.0, 0.0), |(f, s), (_, e)| (f + e.form_factor, s + e.variance));
                (f - exact).abs() / s.sqrt()
            }
            Way::Closed => {
                // Against itself it would say nothing: against Lambert's formula from the middle.
                let lamp: Vec<Vec3> = [0, 1, 2, 3].map(|i| world.scene.mesh.positions[4 + i]).into();
                let point = geometry::polygon::polygon_irradiance(Vec3::ZERO, Vec3::Y, &lamp);
                let from = [0, 1].map(|i| corners(patches.corners(i)));
                let to = [2, 3].map(|i| corners(patches.corners(i)));
                let f: f64 = from
                    .iter()
                    .map(|a| to.iter().map(|b| polygon_to_polygon(a, b)).sum::<f64>())
                    .sum::<f64>()
                    / 2.0;
                (f / f64::from(point) - 1.0).abs()
            }
            _ => (seen(&how, &world, &patches) / exact - 1.0).abs(),
        };
        worst = worst.max(error);
    }
    match way {
        Way::Closed => Measure::new(worst, 1e-5),
        Way::Rays => Measure::new(worst, T_63),
        _ => Measure::limit(worst, 0.1, ALIASING),
    }
}

fn touching(way: Way) -> Option<Measure> {
    let (how, world) = (way.form_factors()?, corner().world());
    let patches = Patches::new(&world, 256, 0);
    let mut worst = 0f64;
    for i in (0..patches.len() as u32).filter(|&i| patches.all[i as usize].triangle < 2) {
        let mine = patches.corners(i);
        let touches = |j: u32| {
            patches.corners(j).iter().filter(|q| mine.iter().any(|p| p.distance(**q) < 1e-6)).count() == 2
        };
        for j in (0..patches.len() as u32).filter(|&j| patches.all[j as usize].triangle >= 2 && touches(j)) {
            let exact = polygon_to_polygon(&corners(mine), &corners(patches.corners(j)));
            if way == Way::Rays {
                let e = estimate(&world, &patches, i, 1024, 64, u64::from(i))[j as usize];
                worst = worst.max((e.form_factor - exact).abs() / e.variance.sqrt());
                continue;
            }
            let row = how.row(&world, &patches, i, 0, 0);
            let f: f64 = row.iter().filter(|a| a.patch == j).map(|a| f64::from(a.share.g)).sum();
            worst = worst.max((f / exact - 1.0).abs());
        }
    }
    match way {
        Way::Closed => Measure::new(worst, 1e-6),
        // The worst of up to 16 pairs: one false alarm in a million at 5.9 for them together.
        Way::Rays => Measure::new(worst, 5.9),
        _ => Measure::limit(worst, 0.02, ONE_POINT),
    }
}
