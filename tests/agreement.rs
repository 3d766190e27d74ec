//! Radiosity and paths, which share little but rays, must give one picture of every scene we ship.
//!
//! Each comparison: blocks of 8 × 8 pixels and the mean luminance, by the variance that both pictures state, and beyond
//! it what the two passes are allowed: 1 % of the mean, and in a block a few per cent of its light.

use geometry::math::Affine2;
use geometry::texture::Wrap;
use geometry::{Camera, Material, Texture, TextureRef, Vec2, Vec3, World};
use radiosity::Config;
use raytrace::{Film, Settings};
use std::sync::OnceLock;
use support::blocks::compare;
use support::build::{Build, camera, parallel};
use support::files::{asset, load, shared};
use support::picture::{hybrid, mean, mean_of, path, range, shoot, shoot_with, solve};
use support::stuff::{lamp, matt, metal};

/// Cornell box by paths, for several tests: 48 × 48, 256 paths a pixel, standard error of the mean 0.1 %.
fn cornell() -> &'static (World, Camera, Film) {
    static ONCE: OnceLock<(World, Camera, Film)> = OnceLock::new();
    ONCE.get_or_init(|| {
        let (scene, mut cameras) = asset("cornell-box.gltf");
        let (world, eye) = (World::new(scene), cameras.swap_remove(0));
        let film = shoot(&world, &eye, &path(48, 48, 256));
        (world, eye, film)
    })
}

/// Every camera of the asset `name`: the two passes asked for 2 %, against `spp` paths a pixel.
fn agrees(name: &str, size: (u32, u32), spp: u32, bias: f64, block: f64) {
    let (scene, cameras) = asset(name);
    let world = World::new(scene);
    let settings = Settings { gather_rays: Some(128), ..hybrid(size.0, size.1, 0.02) };
    let solution = solve(&world, &settings);
    for eye in &cameras {
        let two_pass = shoot_with(&world, eye, Some(&solution), &settings);
        let c = compare(&two_pass, &shoot(&world, eye, &path(size.0, size.1, spp)));
        println!("{name}, {}: {c:?}", eye.name);
        assert!(c.agrees(bias, block), "{name}, {}: {c:?}", eye.name);
    }
}

#[test]
fn the_cornell_box() {
    let (world, eye, reference) = cornell();
    let two_pass = shoot(world, eye, &hybrid(48, 48, 0.02));
    let c = compare(&two_pass, reference);
    println!("cornell-box: {c:?}");
    assert!(c.agrees(0.01, 0.03), "{c:?}");
    // Layer by layer too, so that no light is merely in the wrong one: within 1.5 % of the picture's mean.
    for (name, layer) in [
        ("direct", (|p| p.direct) as fn(&raytrace::Pixel) -> geometry::Rgb),
        ("indirect", |p| p.indirect),
        ("specular", |p| p.specular),
        ("emission", |p| p.emission),
    ] {
        let (a, b) = (mean_of(&two_pass, layer), mean_of(reference, layer));
        println!("cornell-box, {name}: {a:.3} against {b:.3}");
        assert!((a - b).abs() < 0.015 * mean(reference), "{name}: {a} against {b}");
    }
}

/// The comparison above is sharp: with every reflectance 5 % higher it finds the difference.
#[test]
fn five_per_cent_of_albedo_are_noticed() {
    let (world, eye, reference) = cornell();
    let mut scene = world.scene.clone();
    scene.materials.iter_mut().for_each(|m| m.base_color *= 1.05);
    let brighter = shoot(&World::new(scene), eye, &hybrid(48, 48, 0.02));
    let c = compare(&brighter, reference);
    println!("albedo × 1.05: {c:?}");
    assert!(!c.agrees(0.01, 0.03) && c.bias > 0.02, "{c:?}");
}

/// Mirror and glass balls: what paths find of their caustics by chance, photons bring at once, smoothed over 2 cm.
#[test]
fn the_cornell_box_with_mirror_and_glass() {
    agrees("cornell-specular.gltf", (48, 48), 256, 0.01, 0.05);
}

/// Textures, gloss, windows, a sky and many lamps, from every camera.
#[test]
fn the_gallery() {
    agrees("gallery.glb", (48, 32), 96, 0.01, 0.05);
}

/// The measured Cornell box against another renderer's picture of the same file (Mitsuba 3): mean luminance within 3 %.
#[test]
fn another_renderer_sees_the_same_cornell_box() {
    let (Some(file), Some(picture)) = (
        shared("scenes/interiors/cornell-measured.glb"),
        shared("scenes/interiors/reference/cornell-measured.mitsuba.exr"),
    ) else {
        return;
    };
    let (scene, cameras) = load(&file);
    let theirs = raytrace::exr::read_rgb(&picture).expect("the reference can be read");
    let height = (64 * theirs.height).div_ceil(theirs.width);
    let ours = shoot(&World::new(scene), &cameras[0], &hybrid(64, height, 0.02));
    let by_them =
        theirs.pixels.iter().map(|p| f64::from(p.luminance())).sum::<f64>() / theirs.pixels.len() as f64;
    println!("cornell-measured: {} against {by_them}", mean(&ours));
    assert!((mean(&ours) / by_them - 1.0).abs() < 0.03, "{} against {by_them}", mean(&ours));
}

/// A floor of black and white texels, a few to a pixel, under an even sky of 10 cd/m²: every pixel shows about 5, and none
/// is black because the ray nearest its middle met a black one.
#[test]
fn fine_print() {
    let white = Material { base_color_texture: Some(print()), ..matt(1.0) };
    let world = Build::new().level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &white).sky(10.0).world();
    let mut scene = world.scene;
    scene.textures = vec![Texture {
        name: "print".into(),
        width: 2,
        height: 2,
        texels: vec![[0, 0, 0, 255], [255; 4], [255; 4], [0, 0, 0, 255]],
        wrap_s: Wrap::Repeat,
        wrap_t: Wrap::Repeat,
        linear: false,
    }];
    // Texels of 7 mm, pixels of 25 mm.
    scene.mesh.uvs[0] = scene.mesh.positions.iter().map(|p| Vec2::new(p.x, p.z) / 0.014).collect();
    let world = World::new(scene);
    let eye = parallel(Vec3::Y, Vec3::ZERO, 0.2, 0.0);
    let film = shoot(&world, &eye, &hybrid(16, 16, 0.02));
    let (low, high) = range(&film);
    println!("fine print: {:.4}, {low:.3} to {high:.3}", mean(&film));
    assert!((mean(&film) / 5.0 - 1.0).abs() < 0.01, "{}", mean(&film));
    assert!(low > 2.5 && high < 7.5, "{low} to {high}");
}

fn print() -> TextureRef {
    TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY }
}

/// Close up, a white ball on a white table of two triangles, in a large room: light gathers in the wedge between them, which no
/// corner of the table's first mesh lies near.
#[test]
fn a_white_ball_on_a_white_table() {
    let (grey, white) = (matt(0.5), matt(0.95));
    let world = Build::new()
        .room(Vec3::new(-2.5, -1.0, -2.5), Vec3::new(2.5, 2.0, 2.5), [&grey; 6])
        .level(0.0, [-0.6, -0.6], [0.6, 0.6], true, &white)
        .ball(Vec3::new(0.0, 0.0802, 0.0), 0.08, 3, false, |_| white.clone())
        .quad(
            [[0.6, 0.3], [-0.6, 0.3], [-0.6, 1.3], [0.6, 1.3]].map(|[x, y]| Vec3::new(x, y, 2.4)),
            &lamp(20.0),
        )
        .world();
    let eye = camera(Vec3::new(0.0, 0.12, 0.5), Vec3::new(0.0, 0.03, 0.0), 0.4);
    let two_pass = shoot(&world, &eye, &hybrid(64, 40, 0.05));
    let c = compare(&two_pass, &shoot(&world, &eye, &path(64, 40, 1024)));
    println!("a white ball on a white table: {c:?}");
    assert!(c.agrees(0.02, 0.05), "{c:?}");
}

/// Balls of brushed metal, a pixel and a half wide, under a lamp: each shows its highlight on a small part of its side, which
/// is not where the middle of a pixel meets it.
#[test]
fn highlights_smaller_than_a_pixel() {
    let brushed = metal(0.5, 0.25);
    let mut build = Build::new().quad(
        [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]].map(|[x, z]| Vec3::new(x + 1.0, 1.5, z)),
        &lamp(20.0),
    );
    for k in 0..64 {
        let (i, j) = ((k % 8) as f32 - 3.5, (k / 8) as f32 - 3.5);
        build = build.ball(Vec3::new(0.0913 * i, 0.0913 * j, 0.0), 0.015, 3, false, |_| brushed.clone());
    }
    let world = build.world();
    let eye = parallel(Vec3::Z, Vec3::ZERO, 0.4, 0.0);
    let two_pass = shoot(&world, &eye, &hybrid(40, 40, 0.05));
    let reference = shoot(&world, &eye, &path(40, 40, 4096));
    let c = compare(&two_pass, &reference);
    println!("highlights smaller than a pixel: {c:?}");
    assert!(c.agrees(0.02, 0.2), "{c:?}");
}

/// A level bar a third of a pixel thick, which rises by one row from left to right: the middles of most pixels miss it.
#[test]
fn a_bar_thinner_than_a_pixel() {
    let bar = [[-1.0, 0.011], [-1.0, -0.005], [1.0, 0.035], [1.0, 0.051]];
    let world = Build::new()
        .quad(bar.map(|[x, y]| Vec3::new(x, y, 0.0)), &matt(0.8))
        .point_lamp(Vec3::new(0.0, 0.0, 2.0), 100.0)
        .world();
    let eye = parallel(Vec3::Z, Vec3::ZERO, 1.0, 0.0);
    let two_pass = shoot(&world, &eye, &hybrid(40, 40, 0.05));
    let reference = shoot(&world, &eye, &path(40, 40, 1024));
    let c = compare(&two_pass, &reference);
    println!("a bar thinner than a pixel: {c:?}");
    assert!(c.agrees(0.02, 0.1) && c.rms < 0.02, "{c:?}");
}

/// A mesh of few sites errs and knows where. Asked for half of the light, a picture shows what it says; asked for 2 %, its pixels
/// gather for themselves where that is not good enough.
#[test]
fn pixels_gather_where_a_coarse_mesh_is_in_doubt() {
    let (scene, cameras) = asset("cornell-box.gltf");
    let world = World::new(scene);
    let solved = |config: &Config| radiosity::solve(&world, config, &()).expect("it converges");
    let coarse = solved(&Config { h0: 0.4, rounds: 0, ..Config::for_error(0.05) });
    let fine = solved(&Config::for_error(0.01));
    let indirect = |solution, error| {
        let settings = Settings { samples: Some(1), ..hybrid(96, 96, error) };
        let film = shoot_with(&world, &cameras[0], Some(solution), &settings);
        film.pixels.iter().map(|p| p.indirect.luminance()).collect::<Vec<f32>>()
    };
    let truth = indirect(&fine, 0.5);
    let off = |solution, error| {
        let picture = indirect(solution, error);
        let square = |(a, b): (&f32, &f32)| (a - b) * (a - b);
        let scale: f32 = truth.iter().map(|t| t * t).sum();
        (picture.iter().zip(&truth).map(square).sum::<f32>() / scale).sqrt()
    };
    let [believed, doubted] = [off(&coarse, 0.5), off(&coarse, 0.02)];
    println!("the mesh is off by {believed}, the picture by {doubted}");
    assert!(believed > 0.05 && doubted < 0.6 * believed, "{believed} {doubted}");
}
