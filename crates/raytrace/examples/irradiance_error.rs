//! How exact E is where a camera sees it, and what the error is made of: noise that another seed would change, or bias
//! that it would not; where the mesh is trusted, or where pass 2 gathers for itself.
//!
//! The truth is two long gathers at each point that a camera ray meets, which read a finer solution where they end. It is
//! kept in a file, for it costs more than what is judged by it.
//!
//!     cargo run --release -p raytrace --example irradiance_error -- assets/gallery.glb --error 0.05

use geometry::math::{offset_origin, to_world};
use geometry::sampling::{Lattice2, Rng, cosine_hemisphere};
use geometry::{Camera, Hit, Ray, Rgb, Surface, Vec3, World, photometry};
use radiosity::element::Side;
use radiosity::gather::{self, Origin};
use radiosity::{Config, Solution};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A point that a camera ray meets.
struct Place {
    ray: Ray,
    hit: Hit,
}

type Failure = Box<dyn std::error::Error>;

/// Indirect irradiance by either gather, and the direct one, lx.
type Truth = [Rgb; 3];

fn main() -> Result<(), Failure> {
    let mut scenes = Vec::new();
    let mut aware = true;
    let (mut error, mut seeds, mut truth_rays, mut across, mut finer) =
        (0.02f32, 1u64, 2048u32, 24u32, 0.01f32);
    let (mut folder, mut points) = (PathBuf::from("target/irradiance"), None);
    let mut set: Vec<(String, String)> = Vec::new();
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or(format!("{arg} needs a value"));
        match arg.as_str() {
            "--error" => error = value()?.parse()?,
            "--seeds" => seeds = value()?.parse()?,
            "--truth" => finer = value()?.parse()?,
            "--truth-rays" => truth_rays = value()?.parse()?,
            "--across" => across = value()?.parse()?,
            "--blind" => aware = false,
            "--folder" => folder = value()?.into(),
            "--points" => points = Some(PathBuf::from(value()?)),
            "--rays" | "--sites" | "--tolerance" | "--hmin" | "--rounds" | "--photons" | "--radius" => {
                let v = value()?;
                set.push((arg.clone(), v));
            }
            _ => scenes.push(PathBuf::from(arg)),
        }
    }
    std::fs::create_dir_all(&folder)?;
    for scene in scenes {
        let loaded = geometry::gltf::load(&scene)?;
        let world = World::new(loaded.scene);
        let (lo, hi) = world.bounds;
        let camera = loaded.cameras.first().cloned().unwrap_or_else(|| Camera::framing(lo, hi));
        let places = places(&world, &camera, across);
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let truth =
            truths(&world, &places, truth_rays, finer, &folder.join(format!("{name}-{across}-{finer}.txt")))?;
        let mut found: Vec<Vec<Rgb>> = Vec::new();
        let mut last = None;
        for seed in 0..seeds {
            let mut config = Config { seed, ..Config::for_error(error) };
            for (key, v) in &set {
                match key.as_str() {
                    "--rays" => config.rays = v.parse()?,
                    "--sites" => config.most_sites = v.parse()?,
                    "--tolerance" => config.tolerance = v.parse()?,
                    "--hmin" => config.h_min = v.parse()?,
                    "--rounds" => config.rounds = v.parse()?,
                    "--radius" => config.cluster_radius = v.parse()?,
                    _ => config.photons = v.parse()?,
                }
            }
            let matters = aware.then(|| {
                raytrace::importance::importance(
                    &world,
                    std::slice::from_ref(&camera),
                    camera.aspect.unwrap_or(1.5),
                )
            });
            let (start, before) = (Instant::now(), world.bvh.rays_cast());
            let solution = radiosity::solve_for(&world, &config, matters.as_ref(), &())?;
            let (seconds, rays) = (start.elapsed().as_secs_f64(), world.bvh.rays_cast() - before);
            let e: Vec<Rgb> = places.iter().map(|p| at(&world, &solution, p)).collect();
            let r = &solution.report;
            println!(
                "{name} {error} seed {seed}: {seconds:.2} s, {:.2} M rays, {} sites, {} vertices, {} landings, flagged {:.3}",
                rays as f64 * 1e-6,
                r.sites,
                r.vertices,
                r.landings,
                r.flagged
            );
            found.push(e);
            last = Some(solution);
        }
        let Some(solution) = last else { continue };
        let open: Vec<bool> = places
            .iter()
            .map(|p| solution.unresolved(p.hit.triangle, p.hit.u, p.hit.v, side(&world, p)))
            .collect();
        judge(&world, &places, &truth, &found, &open);
        if let Some(path) = &points {
            write_points(&world, &places, &truth, &found, &open, path)?;
        }
    }
    Ok(())
}

/// The first diffuse surface along a jittered grid of camera rays, for those that meet one at once.
fn places(world: &World, camera: &Camera, across: u32) -> Vec<Place> {
    let aspect = camera.aspect.unwrap_or(1.5);
    let down = (across as f32 / aspect).round().max(1.0) as u32;
    let mut rng = Rng::new(0x706c_6163_6573, 0);
    let mut places = Vec::new();
    for i in 0..across * down {
        let (x, y) = ((i % across) as f32 + rng.f32(), (i / across) as f32 + rng.f32());
        let ray = camera.ray(x / across as f32, y / down as f32, aspect);
        let Some(hit) = world.closest(&ray) else { continue };
        let surface = Surface::new(&world.scene, &ray, &hit);
        if surface.bsdf.has_diffuse() && surface.unlit.is_none() && surface.emission.is_black() {
            places.push(Place { ray, hit });
        }
    }
    places
}

fn side(world: &World, place: &Place) -> Side {
    Side::met(Surface::new(&world.scene, &place.ray, &place.hit).front)
}

fn at(world: &World, solution: &Solution, p: &Place) -> Rgb {
    solution.irradiance(world, p.hit.triangle, p.hit.u, p.hit.v, side(world, p))
}

/// What is true at every place, from the file where it was kept or by two gathers of `rays` rays that read a solution
/// made for `error`.
fn truths(
    world: &World,
    places: &[Place],
    rays: u32,
    error: f32,
    kept: &Path,
) -> Result<Vec<Truth>, Failure> {
    if let Ok(text) = std::fs::read_to_string(kept) {
        let numbers: Vec<f32> = text.split_whitespace().filter_map(|n| n.parse().ok()).collect();
        if numbers.len() == 9 * places.len() {
            let rgb = |n: &[f32]| Rgb::new(n[0], n[1], n[2]);
            return Ok(numbers.chunks(9).map(|n| [rgb(n), rgb(&n[3..]), rgb(&n[6..])]).collect());
        }
    }
    let solution =
        radiosity::solve(world, &Config { seed: 0x0074_7275_7468, ..Config::for_error(error) }, &())?;
    let pattern = Lattice2::new(rays);
    let truth: Vec<Truth> = places
        .par_iter()
        .enumerate()
        .map(|(i, place)| {
            let s = Surface::new(&world.scene, &place.ray, &place.hit);
            let half = |k: u64| {
                let mut rng = Rng::new(0x0070_6c61_6365 + k, i as u64);
                let shift = rng.vec2();
                let brought = |wi: Vec3, rng: &mut Rng| {
                    let mut reflected = Rgb::BLACK;
                    let ray = Ray::new(offset_origin(s.position, s.ng), wi);
                    let land = |hit: &Hit, side, weight| {
                        let (t, u, v) = (hit.triangle, hit.u, hit.v);
                        let e = solution.irradiance(world, t, u, v, side)
                            + solution.caustic(world, t, u, v, side);
                        reflected = weight * e;
                    };
                    let followed = gather::follow(world, ray, rng, land, |_, _| ());
                    followed.direct + reflected
                };
                let sum: Rgb = (0..rays)
                    .map(|j| to_world(cosine_hemisphere(pattern.point(j, shift)), s.ns))
                    .filter(|wi| wi.dot(s.ng) > 0.0)
                    .map(|wi| brought(wi, &mut rng))
                    .sum();
                sum / rays as f32
            };
            let origin = [Origin { position: s.position, ng: s.ng }];
            [half(0), half(1), gather::direct(world, &origin, s.ns, 256, 1, i as u64, |_, _| ())]
        })
        .collect();
    let line = |t: &Truth| t.map(|c| format!("{} {} {}", c.r, c.g, c.b)).join(" ");
    std::fs::write(kept, truth.iter().map(line).collect::<Vec<_>>().join("\n"))?;
    Ok(truth)
}

/// Square of the error at a place relative to what the picture shows there (the metric of the pictures, mean of channels).
fn squares(world: &World, places: &[Place], truth: &[Truth], e: &[Rgb]) -> Vec<f64> {
    let albedo: Vec<Rgb> = places
        .iter()
        .map(|p| Surface::new(&world.scene, &p.ray, &p.hit).bsdf.diffuse_albedo(-p.ray.direction))
        .collect();
    let seen = |i: usize, e: Rgb| photometry::reflected_radiance(albedo[i], e);
    let mut bright: Vec<f32> = (0..places.len())
        .map(|i| seen(i, (truth[i][0] + truth[i][1]) * 0.5 + truth[i][2]).luminance())
        .collect();
    bright.sort_by(f32::total_cmp);
    let top = bright[bright.len() * 9 / 10];
    let m = bright.iter().map(|y| y.min(top)).sum::<f32>() / bright.len() as f32;
    (0..places.len())
        .map(|i| {
            let [a, b, direct] = truth[i];
            let all = seen(i, (a + b) * 0.5 + direct);
            let (da, db) = (seen(i, e[i] - a), seen(i, e[i] - b));
            f64::from((da * db).mean()) / f64::from((all * all).mean() + 0.01 * m * m)
        })
        .collect()
}

fn percent(squares: impl Iterator<Item = f64>, of: usize) -> f64 {
    100.0 * (squares.sum::<f64>() / of.max(1) as f64).max(0.0).sqrt()
}

fn judge(world: &World, places: &[Place], truth: &[Truth], found: &[Vec<Rgb>], open: &[bool]) {
    let n = places.len();
    let (k, flagged) = (found.len() as f64, open.iter().filter(|o| **o).count());
    let each: Vec<Vec<f64>> = found.iter().map(|e| squares(world, places, truth, e)).collect();
    let mean: Vec<Rgb> =
        (0..n).map(|i| found.iter().map(|e| e[i]).sum::<Rgb>() / found.len() as f32).collect();
    let of_mean = squares(world, places, truth, &mean);
    for (what, which) in [("trusted", false), ("flagged", true)] {
        let some = |s: &Vec<f64>| percent((0..n).filter(|&i| open[i] == which).map(|i| s[i]), n).powi(2);
        let all = each.iter().map(some).sum::<f64>() / k;
        let noise = (all - some(&of_mean)).max(0.0) * k / (k - 1.0).max(1.0);
        let bias = (all - noise).max(0.0);
        let [all, noise, bias] = [all, noise, bias].map(f64::sqrt);
        println!("  {what}: error of E in the picture {all:.2} %: noise {noise:.2} %, bias {bias:.2} %");
    }
    let mut sorted: Vec<f64> = each.concat();
    sorted.sort_by(f64::total_cmp);
    let at =
        |q: f64| 100.0 * sorted[((sorted.len() as f64 * q) as usize).min(sorted.len() - 1)].max(0.0).sqrt();
    println!(
        "  90th percentile {:.1} %, 99th {:.1} %; {:.1} % of the points flagged",
        at(0.9),
        at(0.99),
        100.0 * flagged as f64 / n as f64
    );
}

/// A line for each place: x, y, z, mean E of all seeds, its spread, the truth, its noise, direct, square of the error, flag.
fn write_points(
    world: &World,
    places: &[Place],
    truth: &[Truth],
    found: &[Vec<Rgb>],
    open: &[bool],
    path: &Path,
) -> std::io::Result<()> {
    let k = found.len() as f32;
    let mean: Vec<Rgb> = (0..places.len()).map(|i| found.iter().map(|e| e[i]).sum::<Rgb>() / k).collect();
    let bias = squares(world, places, truth, &mean);
    let lines: Vec<String> = (0..places.len())
        .map(|i| {
            let s = Surface::new(&world.scene, &places[i].ray, &places[i].hit);
            let spread = (found.iter().map(|e| (e[i].mean() - mean[i].mean()).powi(2)).sum::<f32>()
                / (k - 1.0).max(1.0))
            .sqrt();
            let material = world.scene.mesh.materials[places[i].hit.triangle as usize].0;
            let [a, b, d] = truth[i].map(|c| c.mean());
            format!(
                "{:.3} {:.3} {:.3} {:.4} {:.4} {:.4} {:.4} {:.4} {:.6} {} {}",
                s.position.x,
                s.position.y,
                s.position.z,
                mean[i].mean(),
                spread,
                0.5 * (a + b),
                0.5 * (a - b).abs(),
                d,
                bias[i],
                u8::from(open[i]),
                material
            )
        })
        .collect();
    std::fs::write(path, lines.join("\n"))
}
