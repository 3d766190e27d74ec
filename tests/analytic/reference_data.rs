//! Tables of view factors and enclosures that others made, where they are at hand.

use geometry::polygon::polygon_irradiance;
use geometry::{Material, Rgb, Vec3};
use glam::DVec3;
use radiosity::element::Side;
use radiosity::form_factor::analytic::polygon_to_polygon;
use radiosity::form_factor::matrix::Matrix;
use radiosity::form_factor::ray_cast::estimate;
use radiosity::patches::Patches;
use radiosity::solver::gauss_seidel;
use std::f32::consts::PI;
use support::build::Build;
use support::files::shared;
use support::picture::solve;
use support::solved::area_mean;
use support::stability::Solver;
use support::stuff::glowing;

/// Fields of the lines of a CSV file after its first; commas within quotes belong to a field.
fn table(name: &str) -> Option<Vec<Vec<String>>> {
    let text = std::fs::read_to_string(shared(&format!("reference-data/{name}"))?).expect("it can be read");
    let fields = |line: &str| {
        let (mut all, mut quoted) = (vec![String::new()], false);
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                ',' if !quoted => all.push(String::new()),
                c => all.last_mut().expect("there is one").push(c),
            }
        }
        all
    };
    Some(text.lines().skip(1).map(fields).collect())
}

/// The number after `name=` in a text.
fn number(text: &str, name: &str) -> f64 {
    let word = text.split_whitespace().find_map(|w| w.strip_prefix(&format!("{name}=")));
    word.and_then(|w| w.parse().ok()).unwrap_or_else(|| panic!("{name} in {text}"))
}

fn level(x: [f64; 2], y: [f64; 2], z: f64, up: bool) -> Vec<DVec3> {
    let mut c: Vec<DVec3> = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| DVec3::new(x[i], y[j], z)).into();
    if !up {
        c.reverse();
    }
    c
}

fn disc(r: f64, z: f64, n: usize, up: bool) -> Vec<DVec3> {
    let turn = |i: usize| std::f64::consts::TAU * i as f64 / n as f64 * if up { 1.0 } else { -1.0 };
    (0..n).map(|i| DVec3::new(r * turn(i).cos(), r * turn(i).sin(), z)).collect()
}

/// Closed forms within 1e-6; what stands between, by rays within 5.4 of their own standard errors (one false alarm in a
/// million for Student's t of 63 degrees of freedom).
#[test]
fn view_factors_are_those_of_the_catalogue() {
    let Some(rows) = table("view-factors.csv") else { return };
    let mut seen = 0;
    for row in &rows {
        let (p, exact) = (&row[2], row[3].parse::<f64>().expect("a number"));
        let n = |name: &str| number(p, name);
        let f = match row[0].as_str() {
            "C-11" => {
                let side = |z, up| level([0.0, n("a")], [0.0, n("b")], z, up);
                polygon_to_polygon(&side(0.0, true), &side(n("c"), false))
            }
            "C-14" => {
                let wall =
                    [[0., 0., 0.], [0., n("l"), 0.], [0., n("l"), n("h")], [0., 0., n("h")]].map(DVec3::from);
                polygon_to_polygon(&level([0.0, n("w")], [0.0, n("l")], 0.0, true), &wall)
            }
            "C-41" => {
                // Polygons of n corners lack 1/n²; Richardson's rule finds the limit.
                let of =
                    |k| polygon_to_polygon(&disc(n("r1"), 0.0, k, true), &disc(n("r2"), n("a"), k, false));
                let [a, b, c] = [48, 96, 192].map(of);
                let (d, e) = ((4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0);
                (16.0 * e - d) / 15.0
            }
            "B-4" => {
                let lamp: Vec<Vec3> =
                    level([0.0, n("a")], [0.0, n("b")], n("c"), false).iter().map(|c| c.as_vec3()).collect();
                f64::from(polygon_irradiance(Vec3::ZERO, Vec3::Z, &lamp))
            }
            "B-5" => {
                let (a, b, c) = (n("a") as f32, n("b") as f32, n("c") as f32);
                let wall = [[c, 0., 0.], [c, b, 0.], [c, b, a], [c, 0., a]].map(Vec3::from);
                f64::from(polygon_irradiance(Vec3::ZERO, Vec3::Z, &wall))
            }
            "obstructed" => {
                let m = glowing(1.0, 0.5);
                let at = |name: &str| n(name) as f32;
                let world = Build::new()
                    .level(0.0, [0.0, 0.0], [1.0, 1.0], true, &m)
                    .level(1.0, [0.0, 0.0], [1.0, 1.0], false, &m)
                    .level(at("z"), [at("x0"), at("y0")], [at("x1"), at("y1")], true, &m)
                    .world();
                let patches = Patches::new(&world, 6, 0);
                let of = |i: u32| {
                    let all = estimate(&world, &patches, i, 16_384, 64, u64::from(i));
                    let to = patches.all.iter().zip(&all).filter(|(p, _)| (2..4).contains(&p.triangle));
                    to.fold((0.0, 0.0), |(f, s), (_, e)| (f + e.form_factor, s + e.variance))
                };
                let ((a, va), (b, vb)) = (of(0), of(1));
                let (f, sigma) = (0.5 * (a + b), 0.5 * (va + vb).sqrt());
                println!("{} {p}: {f:.6} ± {sigma:.6}, not {exact}", row[0]);
                assert!((f - exact).abs() < 5.4 * sigma && sigma < 1e-3, "{p}: {f} ± {sigma}, not {exact}");
                seen += 1;
                continue;
            }
            _ => continue, // a sphere, which no polygon is
        };
        assert!((f - exact).abs() < 1e-6, "{} {p}: {f}, not {exact}", row[0]);
        seen += 1;
    }
    println!("{seen} of {} view factors", rows.len());
    assert!(seen + 1 >= rows.len(), "{seen} of {}", rows.len());
}

/// Numbers in brackets after `name=`.
fn list(text: &str, name: &str) -> Vec<f32> {
    let after = text.split(&format!("{name}=[")).nth(1).unwrap_or_else(|| panic!("{name} in {text}"));
    let inside = after.split(']').next().expect("it ends");
    inside.split(',').map(|w| w.trim().parse().expect("a number")).collect()
}

/// Six patches of a cube by the matrix, within 1e-6; facing sides are in pairs.
#[test]
fn six_patches_are_those_of_the_table() {
    let Some(rows) = table("enclosures.csv") else { return };
    let faces: Vec<Vec<DVec3>> = (0..6)
        .map(|k| {
            let (axis, end) = (k / 2, (k % 2) as f64);
            let corner = |s: f64, t: f64| {
                let mut p = DVec3::ZERO;
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (end, s, t);
                p
            };
            let mut face = vec![corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
            if k % 2 == 1 {
                face.reverse();
            }
            face
        })
        .collect();
    let matrix =
        Matrix::from_fn(
            &[1.0; 6],
            |i, j| if i == j { 0.0 } else { polygon_to_polygon(&faces[i], &faces[j]) },
        );
    let cubes: Vec<_> = rows.iter().filter(|r| r[0] == "cube, 6 patches").collect();
    for row in &cubes {
        let colours = |name: &str| -> Vec<Rgb> { list(&row[1], name).into_iter().map(Rgb::splat).collect() };
        let (b, report) = gauss_seidel::solve(&matrix, &colours("rho"), &colours("E"), 1e-9, 1000);
        let exact: Vec<f64> = row[3].split_whitespace().map(|w| w.parse().expect("a number")).collect();
        for (b, exact) in b.iter().zip(exact) {
            assert!((f64::from(b.g) - exact).abs() < 1e-6 * exact, "{}: {} {exact} {report:?}", row[1], b.g);
        }
    }
    assert!(cubes.len() >= 4, "{}", cubes.len());
}

/// The inside of a sphere in parts of their own emission and reflectance: H = Σ f M / (1 − Σ f ρ) everywhere.
#[test]
fn a_sphere_in_parts_by_every_solver() {
    for parts in
        [&[(0.5, 1.0, 0.0), (0.5, 0.0, 0.8)][..], &[(0.1, 1.0, 0.5), (0.4, 0.0, 0.2), (0.5, 0.0, 0.9)]]
    {
        // Archimedes: bands of equal height have equal area.
        let band = |y: f32| {
            let mut below = 0.0;
            let of = parts.iter().position(|(f, ..)| {
                below += f;
                0.5 * (y + 1.0) <= below + 1e-6
            });
            of.unwrap_or(parts.len() - 1)
        };
        let material = |c: Vec3| -> Material {
            let (_, m, rho) = parts[band(c.normalize().y)];
            glowing(m / PI, rho)
        };
        let world = Build::new().ball(Vec3::ZERO, 1.0, 4, true, material).world();
        // The facets' own areas, which are not quite the parts'.
        let (mut shone, mut absorbed) = (0.0, 0.0);
        for t in 0..world.scene.mesh.triangles.len() as u32 {
            let m = &world.scene.materials[world.scene.mesh.materials[t as usize].0 as usize];
            let area = f64::from(world.scene.mesh.area(t));
            shone += area * f64::from(m.emissive.g * PI);
            absorbed += area * (1.0 - f64::from(m.base_color.g));
        }
        let exact = shone / absorbed;
        for solver in [Solver::Gather, Solver::Matrix, Solver::Progressive] {
            let solution = solve(&world, &solver.settings(1, 2500));
            let h = area_mean(
                &world,
                |_| true,
                |t, u, v| {
                    solution.irradiance(&world, t, u, v, Side::Front)
                        + solution.direct(&world, t, u, v, Side::Front)
                },
            );
            let bound = f64::from(solution.report.convergence.bound);
            println!(
                "sphere in {} parts, {solver:?}: {:+.3} %, bound {:.3} %",
                parts.len(),
                100.0 * (h / exact - 1.0),
                100.0 * bound / exact
            );
            // Beyond the solver's bound the facets bend away by 0.1 %, and vertices of the default have noise of their own.
            let allowed = bound + if solver == Solver::Gather { 0.02 } else { 0.005 } * exact;
            assert!((h - exact).abs() < allowed, "{solver:?}: {h}, not {exact}");
        }
    }
}
