//! Direct light and where it ends: counted once, with sharp and soft edges in their places, and nothing beyond walls.

use geometry::polygon::polygon_irradiance;
use geometry::sampling::Rng;
use geometry::{Rgb, Vec3, World};
use radiosity::element::Side;
use raytrace::{DiffuseMode, Film, Pixel, Settings};
use std::f32::consts::PI;
use support::build::{Build, camera, parallel};
use support::files::asset;
use support::picture::{hybrid, mean, mean_of, range, shoot, shoot_with, solve};
use support::stuff::{lamp, matt};

const MODES: [DiffuseMode; 3] = [DiffuseMode::Split, DiffuseMode::Gather, DiffuseMode::Vertex];

/// Corners of a lamp that spans `lo` to `hi` in (x, z) at height `y`.
fn rectangle(y: f32, lo: [f32; 2], hi: [f32; 2]) -> [Vec3; 4] {
    [[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]].map(|[x, z]| Vec3::new(x, y, z))
}

/// A floor under one lamp that reflects nothing: no light has bounced, and the direct light is Lambert's closed form
/// in every pixel, in each of the three modes (from the vertices within the mesh's error).
#[test]
fn one_lamp_over_a_floor_is_counted_once() {
    let world = Build::new()
        .level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5))
        .level(1.0, [-0.5, -0.5], [0.5, 0.5], false, &lamp(1000.0))
        .world();
    let eye = parallel(Vec3::Y * 3.0, Vec3::ZERO, 1.5, 2.5);
    let solution = solve(&world, &hybrid(24, 24, 0.02));
    for mode in MODES {
        let film =
            shoot_with(&world, &eye, Some(&solution), &Settings { diffuse: mode, ..hybrid(24, 24, 0.02) });
        let mut worst = 0f32;
        for p in &film.pixels {
            assert_eq!(
                (p.indirect, p.specular, p.emission),
                (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK),
                "{mode:?}"
            );
            let e = PI
                * 1000.0
                * polygon_irradiance(p.position, Vec3::Y, &rectangle(1.0, [-0.5, -0.5], [0.5, 0.5]));
            worst = worst.max((p.direct.g / (0.5 * e / PI) - 1.0).abs());
        }
        println!("{mode:?}: worst pixel {worst}");
        // Pixels are lit exactly, for the whole lamp is seen. Vertices have 64 samples each and lie 0.1 m apart.
        assert!(worst < if mode == DiffuseMode::Vertex { 0.15 } else { 1e-4 }, "{mode:?}: {worst}");
    }
}

/// Half a plane between lamp and floor: the penumbra is s · d2 / d1 wide, and every pixel in it sees the part of the
/// lamp beyond the edge.
#[test]
fn a_penumbra_is_as_wide_as_geometry_says() {
    let (height, edge, half) = (1.0f32, 0.5f32, 0.05f32);
    let world = Build::new()
        .level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5))
        .level(edge, [-2.0, -2.0], [0.0, 2.0], true, &matt(0.0))
        .level(height, [-half, -half], [half, half], false, &lamp(1000.0))
        .world();
    // 64 pixels of 0.5 cm in x; the camera looks past the screen and the lamp, from beneath them.
    let (width, rows, pixel) = (64u32, 8u32, 0.005f32);
    let eye = parallel(Vec3::Y * 2.0, Vec3::ZERO, 0.5 * rows as f32 * pixel, 1.75);
    let film = shoot(&world, &eye, &Settings { gather_rays: Some(32), ..hybrid(width, rows, 0.005) });
    let exact = |x: f32| {
        // The line from a lamp's point at xl to the floor's at x passes the screen's plane at x + (xl − x) edge / height.
        let from = (x - x * height / edge).clamp(-half, half);
        let seen = rectangle(height, [from, -half], [half, half]);
        let p = Vec3::new(x, 0.0, 0.0);
        0.5 * 1000.0 * if from < half { polygon_irradiance(p, Vec3::Y, &seen) } else { 0.0 }
    };
    let open = exact(0.15);
    let (mut partial, mut worst) = (0, 0f32);
    // Image columns run along +x or −x with the camera's idea of up: positions tell.
    for x in 0..width {
        let column: Vec<&Pixel> = (0..rows).map(|y| film.get(x, y)).collect();
        let got = column.iter().map(|p| p.direct.g).sum::<f32>() / rows as f32;
        // Pixel means, by eight points.
        let centre = (column[0].position.x / pixel).floor() * pixel;
        let want = (0..8).map(|k| exact(centre + (k as f32 + 0.5) / 8.0 * pixel)).sum::<f32>() / 8.0;
        worst = worst.max((got - want).abs() / open);
        partial += u32::from(got > 0.1 * open && got < 0.9 * open);
    }
    let expected = 2.0 * half * (edge / (height - edge)) / pixel * 0.8; // from 10 to 90 %
    println!("penumbra: {partial} pixels of {expected}, worst {worst}");
    assert!((partial as f32 - expected).abs() <= 2.0, "{partial} pixels of {expected}");
    // 0.5 % was asked for, and neighbours that all see the same skip the rays that would find a sliver of lamp.
    assert!(worst < 0.02, "{worst}");
}

/// Slats between a point lamp and a floor, 1.3 pixels wide, their edges along the pixels' columns: every pixel shows the
/// share of it that is lit, as exactly as is asked.
#[test]
fn hard_shadows_finer_than_a_pixel() {
    let (height, above, pixel) = (8.0f32, 0.25f32, 0.005f32);
    let (wide, period) = (1.3 * pixel, 3.7 * pixel);
    let slats: Vec<f32> = (-30..30).map(|k| k as f32 * period).collect();
    let floor = Build::new().level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5));
    let world = slats
        .iter()
        .fold(floor, |b, &x| b.level(above, [x, -2.0], [x + wide, 2.0], true, &matt(0.0)))
        .point_lamp(Vec3::new(0.0, height, 0.0), 100.0)
        .world();
    let (width, rows) = (64u32, 8u32);
    let eye = parallel(Vec3::Y * 2.0, Vec3::ZERO, 0.5 * rows as f32 * pixel, 1.9);
    // Where a shadow of x at height `above` falls.
    let cast = |x: f32| x * height / (height - above);
    let shaded = |lo: f32, hi: f32| -> f32 {
        slats.iter().map(|&x| (cast(x + wide).min(hi) - cast(x).max(lo)).max(0.0)).sum::<f32>() / (hi - lo)
    };
    for error in [0.1, 0.01, 0.003] {
        let film = shoot(&world, &eye, &Settings { gather_rays: Some(16), ..hybrid(width, rows, error) });
        let off = |(x, y): (u32, u32)| {
            let p = film.get(x, y);
            // The middle of the pixel, wherever its rays went.
            let middle = (p.position.x / pixel).floor() * pixel;
            let r2 = p.position.x * p.position.x + p.position.z * p.position.z + height * height;
            let open = 0.5 * 100.0 * height / (r2 * r2.sqrt()) / PI;
            let lit = 1.0 - shaded(middle, middle + pixel);
            f64::from(p.direct.g / open - lit).powi(2) / f64::from(lit.powi(2) + 0.01)
        };
        let pixels = (0..rows).flat_map(|y| (0..width).map(move |x| (x, y)));
        let rms = (pixels.map(off).sum::<f64>() / f64::from(width * rows)).sqrt();
        println!("asked {error}: {rms}");
        assert!(rms < f64::from(error), "{error} asked: {rms}");
    }
}

/// Two hundred point lamps of all strengths over a floor, nothing between: what each sends is known, and only the choice
/// among them by few rays is random. It is seen as noise, and taken down to what is asked.
#[test]
fn a_choice_among_many_point_lamps_is_as_exact_as_asked() {
    let mut rng = Rng::new(5, 5);
    let lamps: Vec<(Vec3, f32)> = (0..200)
        .map(|_| {
            let [x, y, z, strength] = rng.array();
            (Vec3::new(4.0 * x - 2.0, 0.5 + y, 4.0 * z - 2.0), 20.0 * strength * strength * strength)
        })
        .collect();
    let floor = Build::new().level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5));
    let world = lamps.iter().fold(floor, |b, &(p, intensity)| b.point_lamp(p, intensity)).world();
    let eye = parallel(Vec3::Y * 0.4, Vec3::ZERO, 0.4, 0.1);
    for error in [0.1, 0.03] {
        let film = shoot(&world, &eye, &Settings { gather_rays: Some(16), ..hybrid(32, 32, error) });
        let off = |p: &Pixel| {
            let sent = |&(lamp, intensity): &(Vec3, f32)| {
                let way = lamp - p.position;
                intensity * way.y / way.length().powi(3)
            };
            let open = 0.5 * lamps.iter().map(sent).sum::<f32>() / PI;
            f64::from(p.direct.g / open - 1.0).powi(2)
        };
        let rms = (film.pixels.iter().map(off).sum::<f64>() / film.pixels.len() as f64).sqrt();
        println!("many lamps, asked {error}: {rms}");
        assert!(rms < f64::from(error), "{error} asked: {rms}");
    }
}

/// Nothing leaks under a wall that stands on one floor: the camera's room has no opening to the lit one.
#[test]
fn the_dark_room_stays_dark() {
    let (scene, cameras) = asset("two-rooms.gltf");
    let world = World::new(scene);
    let settings = hybrid(32, 32, 0.05);
    let solution = solve(&world, &settings);
    let lit = camera(Vec3::new(0.3, 1.5, 2.7), Vec3::new(2.9, 0.5, 0.5), 1.0);
    let bright = mean(&shoot_with(&world, &lit, Some(&solution), &settings));
    for mode in MODES {
        let dark =
            shoot_with(&world, &cameras[0], Some(&solution), &Settings { diffuse: mode, ..settings.clone() });
        let (_, most) = range(&dark);
        println!("{mode:?}: brightest pixel of the dark room {:.2e} of the lit room's mean", most / bright);
        assert!(bright > 10.0 && most < 0.005 * bright, "{mode:?}: {most} of {bright}");
    }
}

/// A sheet without thickness, and one of two coinciding faces back to back, lit from above: below them it is exactly
/// dark, though light bounces about above.
#[test]
fn a_sheet_lit_on_one_side_is_dark_on_the_other() {
    let white = matt(0.8);
    let sheet = |two_faces: bool| {
        let build = Build::new()
            .level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &white)
            .block(Vec3::new(-0.2, 0.1, -0.2), Vec3::new(0.2, 0.4, 0.2), &white)
            .point_lamp(Vec3::new(0.5, 1.0, 0.5), 100.0);
        let build = if two_faces { build.level(0.0, [-1.0, -1.0], [1.0, 1.0], false, &white) } else { build };
        build.world()
    };
    let above = camera(Vec3::new(0.0, 2.0, 3.0), Vec3::ZERO, 0.6);
    let below = camera(Vec3::new(0.0, -2.0, 3.0), Vec3::ZERO, 0.6);
    for two_faces in [false, true] {
        let world = sheet(two_faces);
        let settings = hybrid(24, 24, 0.05);
        let solution = solve(&world, &settings);
        for mode in MODES {
            let shoot = |eye| -> Film {
                shoot_with(&world, eye, Some(&solution), &Settings { diffuse: mode, ..settings.clone() })
            };
            let (lit, dark) = (shoot(&above), shoot(&below));
            assert!(mean_of(&lit, |p| p.direct) > 1.0 && mean_of(&lit, |p| p.indirect) > 0.01, "{mode:?}");
            let seen = mean_of(&dark, |p| Rgb::splat(p.alpha));
            assert!(
                seen > 0.1 && range(&dark).1 == 0.0,
                "{mode:?}, two faces {two_faces}: {:?}",
                range(&dark)
            );
        }
    }
}

/// A block with smooth normals is not as dark or bright around its edges as the lit side next door: with vertices that
/// two sides share, light must not bleed from the lit side to the others.
#[test]
fn a_side_that_faces_away_gets_no_direct_light() {
    let world = Build::new()
        .block(Vec3::splat(-0.5), Vec3::splat(0.5), &matt(0.8))
        .point_lamp(Vec3::new(0.0, 3.0, 0.0), 100.0)
        .world();
    let side = camera(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 0.5);
    let solution = solve(&world, &hybrid(16, 16, 0.05));
    for mode in MODES {
        let film =
            shoot_with(&world, &side, Some(&solution), &Settings { diffuse: mode, ..hybrid(16, 16, 0.05) });
        assert!(mean_of(&film, |p| Rgb::splat(p.alpha)) > 0.1);
        assert_eq!(range(&film).1, 0.0, "{mode:?}");
    }
    let top = (0..12).find(|&t| world.scene.mesh.geometric_normal(t).y > 0.5).expect("a block has a top");
    let e = solution.direct(&world, top, 0.3, 0.3, Side::Front).g;
    assert!((e / 16.0 - 1.0).abs() < 0.1, "100 cd from 2.5 m: {e} lx");
}

/// A ball that touches a plane, a kilometre from the origin: the same picture as at the origin, without acne. The
/// distance is a power of two, so that both meshes have the same bits up to 2^-13 m, an eighth of a millimetre.
#[test]
fn far_from_the_origin_nothing_breaks_out() {
    let picture = |shift: Vec3| {
        let world = Build::new()
            .level(0.0, [-4.0, -4.0], [4.0, 4.0], true, &matt(0.5))
            .ball(Vec3::Y, 1.0, 3, false, |_| matt(0.5))
            .point_lamp(Vec3::new(2.0, 4.0, 3.0), 1000.0)
            .world();
        let eye = camera(Vec3::new(0.0, 1.0, 7.0), Vec3::new(0.0, 0.6, 0.0), 0.6);
        let (scene, eye) = support::build::moved(&world.scene, &eye, 1.0, Default::default(), shift);
        shoot(&World::new(scene), &eye, &hybrid(48, 48, 0.05))
    };
    let (near, far) = (picture(Vec3::ZERO), picture(Vec3::new(1024.0, 512.0, -1024.0)));
    let c = support::blocks::compare(&far, &near);
    let off = near.pixels.iter().zip(&far.pixels).filter(|(a, b)| {
        let difference = (a.beauty().luminance() - b.beauty().luminance()).abs();
        f64::from(difference) > 0.1 * mean(&near)
    });
    let off = off.count();
    println!("far away: {c:?}, {off} pixels differ by a tenth");
    // A hard shadow's edge moves by a tenth of a millimetre and flips a pixel here and there, 1.6 % of its block each;
    // acne would speckle the whole floor.
    assert!(c.agrees(0.005, 0.06) && off < 12, "{c:?}, {off} pixels");
}
