//! The Cornell box baked: its light is all there, its charts lie apart, and it looks as the room does.

use super::{Baked, Light, Settings, Target, bake, write};
use crate::render;
use crate::tonemap::white_of_exposure;
use geometry::sampling::{self, Rng};
use geometry::{Camera, Ray, Rgb, Surface, Vec2, World, gltf};
use radiosity::element::Side;
use radiosity::{Config, Solution, solve};
use std::f32::consts::PI;
use std::path::Path;
use std::sync::LazyLock;

struct Room {
    world: World,
    cameras: Vec<Camera>,
    solution: Solution,
}

static ROOM: LazyLock<Room> = LazyLock::new(|| {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/cornell-box.gltf");
    let loaded = gltf::load(&path).unwrap();
    let world = World::new(loaded.scene);
    let solution = solve(&world, &Config { seed: 3, ..Config::for_error(0.03) }, &()).unwrap();
    Room { world, cameras: loaded.cameras, solution }
});

fn settings(to: Target) -> Settings {
    Settings { light: Light::All, to, error: 0.05, seed: 3 }
}

const VERTICES: Target = Target::Vertices { most: 20_000 };
const MAP: Target = Target::Lightmap { side: 256 };

fn baked(to: Target) -> (Settings, Baked) {
    let settings = settings(to);
    let baked = bake(&ROOM.world, &ROOM.solution, &settings, &());
    (settings, baked)
}

/// Luminance of the picture that a viewer without lamps shows of `glb`, cd/m², and what is white in it.
fn shown(glb: &[u8], side: u32) -> Vec<Rgb> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("lit.glb");
    std::fs::write(&path, glb).unwrap();
    let loaded = gltf::load(&path).unwrap();
    assert_eq!(loaded.warnings, [""; 0]);
    let (world, camera) = (World::new(loaded.scene), &loaded.cameras[0]);
    let pixel = |i: u32| {
        // Four rays, so that outlines are as soft as in the other picture.
        let ray = |k: u32| {
            let x = ((i % side) as f32 + 0.25 + 0.5 * (k % 2) as f32) / side as f32;
            let y = ((i / side) as f32 + 0.25 + 0.5 * (k / 2) as f32) / side as f32;
            let ray: Ray = camera.ray(x, y, 1.0);
            let hit = world.closest(&ray)?;
            Some(Surface::new(&world.scene, &ray, &hit).unlit.expect("all that is baked is unlit"))
        };
        (0..4).map(|k| ray(k).unwrap_or(Rgb::BLACK)).sum::<Rgb>() / 4.0
    };
    (0..side * side).map(pixel).collect()
}

#[test]
fn a_baked_room_looks_as_the_room_does() {
    const SIDE: u32 = 64;
    const EV: f32 = 9.0;
    let room = &*ROOM;
    let picture = crate::Settings {
        width: SIDE,
        height: SIDE,
        error: 0.03,
        verify: false,
        ..crate::Settings::default()
    };
    let film = render(&room.world, &room.cameras[0], Some(&room.solution), &picture, &()).unwrap().film;
    let white = white_of_exposure(EV);
    for to in [VERTICES, MAP] {
        let (settings, baked) = baked(to);
        let glb = write(&room.world, &room.cameras, &baked, &settings, EV, "box").unwrap();
        let (mut off, mut all) = (0.0, 0.0);
        for (got, want) in shown(&glb, SIDE).into_iter().zip(film.beauty()) {
            let (got, want) = (got.luminance(), want.luminance() / white);
            // The lamp is brighter than white.
            if want < 0.9 {
                off += (got - want).powi(2);
                all += want.powi(2);
            }
        }
        let error = (off / all).sqrt();
        // Outlines, which the two pictures filter differently, are most of it.
        assert!(error < 0.05, "{to:?}: {error}");
    }
}

#[test]
fn all_light_of_the_solution_is_on_the_baked_mesh() {
    let room = &*ROOM;
    let (_, baked) = baked(VERTICES);
    let scene = &room.world.scene;
    // Places on the baked mesh that an eye can see, looked up anew.
    let lamp = super::light::Lamp::new(&room.world, &room.solution, 16);
    let mut rng = Rng::new(11, 0);
    let (mut got, mut want) = (0.0, 0.0);
    for part in baked.parts.iter().filter(|p| !scene.materials[p.material as usize].is_emissive()) {
        for t in &part.triangles {
            let [a, b, c] = t.map(|i| part.positions[i as usize]);
            let area = geometry::triangle::area(a, b, c);
            let normal = geometry::triangle::normal(a, b, c);
            for _ in 0..(area * 40_000.0) as u32 + 1 {
                let (u, v) = sampling::triangle(rng.vec2());
                let p = a + (b - a) * u + (c - a) * v + normal * 1e-4;
                let hit = room.world.closest(&Ray::new(p, -normal)).unwrap();
                let place =
                    super::light::Place { triangle: hit.triangle, uv: [hit.u, hit.v], side: Side::Front };
                let seen = lamp.look(place, &mut rng);
                if seen.hidden {
                    continue;
                }
                let [x, y, z] = t.map(|i| part.light[i as usize]);
                let held = x * (1.0 - u - v) + y * u + z * v;
                let each = area / ((area * 40_000.0) as u32 + 1) as f32;
                got += f64::from(each * PI * held.luminance());
                want += f64::from(each * PI * seen.white.luminance());
            }
        }
    }
    assert!((got / want - 1.0).abs() < 0.01, "{got} lm of {want}");
    assert!((baked.report.flux_kept - 1.0).abs() < 0.002, "{}", baked.report.flux_kept);
}

#[test]
fn more_vertices_leave_less_error() {
    // One bake measures its error to about a half of it: 1.3 to 2.4 % by the seed.
    let (mut few, mut many) = (0.0, 0.0);
    for seed in 3..6 {
        let report = |most| {
            let settings = Settings { error: 0.01, seed, ..settings(Target::Vertices { most }) };
            bake(&ROOM.world, &ROOM.solution, &settings, &()).report
        };
        let (least, most) = (report(1), report(20_000));
        assert_eq!(least.error, least.first_error);
        assert!(least.out_of_vertices && most.vertices > least.vertices);
        few += least.error.unwrap().powi(2);
        many += most.error.unwrap().powi(2);
    }
    // Seven rounds of a fifth more vertices are 3.6 times as many; what is left is at the shadows' edges, where the error
    // falls as the root of their number: to 0.53.
    let ratio = (many / few).sqrt();
    println!("of the error is left {ratio}");
    assert!(ratio < 0.6, "{ratio}");
}

#[test]
fn charts_lie_apart_and_within_the_texture() {
    let scene = &ROOM.world.scene;
    let looks = vec![super::Look::Reflecting; scene.materials.len()];
    // Both sides of all triangles.
    let wanted: Vec<(u32, Side)> =
        (0..scene.mesh.triangles.len() as u32).flat_map(|t| Side::BOTH.map(|s| (t, s))).collect();
    assert_eq!(super::atlas::wanted(scene, &looks, |_| false).len(), scene.mesh.triangles.len());
    let atlas = super::atlas::unwrap(scene, &wanted, 256).unwrap();
    assert_eq!(atlas.chartlets.len(), wanted.len());
    let size = Vec2::new(atlas.width as f32, atlas.height as f32);
    for c in &atlas.chartlets {
        assert!(c.uv.iter().all(|uv| uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all()));
    }
    // Triangles of different charts are as far apart as twice the padding; those of one chart share a corner at least.
    for (i, a) in atlas.chartlets.iter().enumerate() {
        for b in &atlas.chartlets[i + 1..] {
            let joined = a.uv.iter().any(|p| b.uv.iter().any(|q| (*p - *q).abs().max_element() < 1e-6));
            let gap = |x: &super::atlas::Chartlet, y: &super::atlas::Chartlet| {
                let points = (0..=8).flat_map(|i| (0..=8 - i).map(move |j| (i as f32 / 8.0, j as f32 / 8.0)));
                let [p, q, r] = x.uv.map(|uv| uv * size);
                points
                    .map(|(u, v)| y.nearest(p + (q - p) * u + (r - p) * v, size).1)
                    .fold(f32::INFINITY, f32::min)
            };
            let apart = gap(a, b).min(gap(b, a));
            assert!(joined || apart >= 2.0 * super::atlas::PADDING as f32 - 0.01, "{apart} texels");
        }
    }
}

#[test]
fn the_same_seed_bakes_the_same_file_on_any_number_of_threads() {
    let bytes = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            [VERTICES, Target::Lightmap { side: 64 }].map(|to| {
                let (settings, baked) = baked(to);
                write(&ROOM.world, &ROOM.cameras, &baked, &settings, 9.0, "box").unwrap()
            })
        })
    };
    assert!(bytes(1) == bytes(3));
}
