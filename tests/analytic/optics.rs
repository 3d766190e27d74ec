//! Mirrors and glass through the whole renderer, by both integrators: closed forms of plates, balls and series.

use geometry::lobes::{Clearcoat, DiffuseTransmission, Sheen};
use geometry::{Camera, Light, LightKind, Material, Rgb, Vec3, World};
use radiosity::Config;
use raytrace::{DiffuseMode, Settings};
use std::f32::consts::PI;
use support::blocks::{ALARM, compare};
use support::build::{Build, camera, parallel};
use support::picture::{hybrid, mean, path, range, shoot, standard_error};
use support::stuff::{CLEAR, glass, glowing, lamp, matt, metal};

/// Mean luminance by the two passes and by paths must be `exact`: by the first within `tolerance` (relative), by the
/// second within its noise.
fn assert_both(what: &str, world: &World, eye: &Camera, exact: f64, tolerance: f64) {
    let two_pass = mean(&shoot(world, eye, &quick(8)));
    let film = shoot(world, eye, &path(8, 8, 256));
    let (by_paths, se) = (mean(&film), standard_error(&film));
    println!("{what}: two passes {two_pass:.5}, paths {by_paths:.5} ± {se:.5}, exact {exact:.5}");
    assert!((two_pass / exact - 1.0).abs() < tolerance, "{what}: {two_pass}, not {exact}");
    assert!((by_paths - exact).abs() < ALARM * se + 1e-5 * exact, "{what}: {by_paths} ± {se}, not {exact}");
}

/// Two passes where the prepass matters little.
fn quick(side: u32) -> Settings {
    Settings { gather_rays: Some(32), ..hybrid(side, side, 0.02) }
}

/// Index 1.5 at normal incidence. A slab of two faces that refracts, all orders between them: R = 2r / (1 + r) = 0.0769
/// and T = (1 − r) / (1 + r) = 0.9231 with r = 0.04. A thin pane is one face, as glTF has it: r and 1 − r.
#[test]
fn a_slab_of_glass_reflects_and_passes_its_share() {
    let pane = |z: f32, front: bool, material: &Material, build: Build| {
        let mut corners =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vec3::new(x, y, z));
        if !front {
            corners.reverse();
        }
        build.quad(corners, material)
    };
    let thin = |build| pane(0.0, true, &glass(1.5, None), build);
    let solid = |build| {
        let glass = glass(1.5, Some(CLEAR));
        pane(-0.1, false, &glass, pane(0.0, true, &glass, build))
    };
    let eye = parallel(Vec3::Z, Vec3::ZERO, 0.05, 0.0);
    for (name, slab, r) in [("thin", &thin as &dyn Fn(Build) -> Build, 0.04), ("solid", &solid, 0.08 / 1.04)]
    {
        // Behind the slab, seen through it; behind the camera, seen in it.
        let behind = slab(pane(-0.5, true, &lamp(100.0), Build::new())).world();
        // A sharp lobe of little weight is followed by chance: 64 pixels leave 1 % of R, and nothing of T but orders.
        assert_both(&format!("{name} slab, through"), &behind, &eye, 100.0 * (1.0 - r), 2e-3);
        let before = slab(pane(2.0, false, &lamp(100.0), Build::new())).world();
        assert_both(&format!("{name} slab, back"), &before, &eye, 100.0 * r, 2e-2);
    }
}

/// A liquid of index 1.33 that reaches into a plate of index 1.5: three boundaries are there, of the four modelled. In
/// series, all orders between them, R / (1 − R) = Σ r / (1 − r).
#[test]
fn a_liquid_on_glass_has_one_boundary_with_it() {
    let (plate, liquid) = (glass(1.5, Some(CLEAR)), glass(1.33, Some(CLEAR)));
    let block = |build: Build, low: f32, high: f32, material: &Material| {
        build.solid(Vec3::new(-3.0, -3.0, low), Vec3::new(3.0, 3.0, high), material)
    };
    let build = block(block(Build::new(), -0.1, 0.0, &plate), -0.2, -0.09, &liquid);
    let corners = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]].map(|[x, y]| Vec3::new(x, y, -0.5));
    let world = build.quad(corners, &lamp(100.0)).world();
    let r = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let odds: f64 = [r(1.0, 1.5), r(1.5, 1.33), r(1.33, 1.0)].iter().map(|r| r / (1.0 - r)).sum();
    let eye = parallel(Vec3::Z, Vec3::ZERO, 0.05, 0.0);
    assert_both("glass over liquid", &world, &eye, 100.0 / (1.0 + odds), 1e-3);
}

/// A ball that bends every colour by another angle, under an even sky of which it hides nothing.
#[test]
fn a_dispersive_ball_vanishes_under_an_even_sky() {
    let flint = Material { dispersion: 1.0, ..glass(1.8, Some(CLEAR)) };
    let world = Build::new().ball(Vec3::ZERO, 0.5, 4, false, |_| flint.clone()).sky(10.0).world();
    let eye = camera(Vec3::Z * 3.0, Vec3::ZERO, 0.3);
    assert_both("prism", &world, &eye, 10.0, 1e-2);
}

/// Glass of index 1 bends and reflects nothing: the picture is the one without it.
#[test]
fn glass_of_index_one_is_invisible() {
    let room = |ball: bool| {
        let build = Build::new().level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &matt(0.6)).level(
            2.0,
            [-0.3, -0.3],
            [0.3, 0.3],
            false,
            &lamp(100.0),
        );
        let build = if ball {
            build.ball(Vec3::new(0.0, 0.5, 0.0), 0.4, 3, false, |_| glass(1.0, Some(CLEAR)))
        } else {
            build
        };
        build.world()
    };
    let eye = camera(Vec3::new(0.0, 1.2, 3.0), Vec3::new(0.0, 0.4, 0.0), 0.6);
    for settings in [quick(24), path(24, 24, 64)] {
        let c = compare(&shoot(&room(true), &eye, &settings), &shoot(&room(false), &eye, &settings));
        println!("index 1, {:?}: {c:?}", settings.integrator);
        assert!(c.agrees(0.002, 0.01), "{c:?}");
    }
}

/// A ball of anything that absorbs nothing, under a sky of 1 cd/m²: it vanishes, but for 3 % near the outline of what is
/// rough, and 7 % of what is under varnish.
#[test]
fn under_an_even_sky_a_ball_vanishes() {
    let white = Sheen { color: Rgb::WHITE, color_texture: None, roughness: 0.5, roughness_texture: None };
    let varnish = Clearcoat {
        strength: 1.0,
        strength_texture: None,
        roughness: 0.0,
        roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
    };
    let balls = [
        ("matt", matt(1.0), 0.006),
        ("mirror", metal(1.0, 0.0), 0.006),
        ("glass", glass(1.5, Some(CLEAR)), 0.006),
        ("thin glass", glass(1.5, None), 0.006),
        ("rough metal", metal(1.0, 0.5), 0.01),
        ("very rough metal", metal(1.0, 1.0), 0.01),
        ("rough glass", Material { roughness: 0.5, ..glass(1.5, Some(CLEAR)) }, 0.015),
        ("cloth", Material { sheen: Some(white), ..matt(1.0) }, 0.01),
        ("varnished wood", Material { clearcoat: Some(varnish), ..matt(1.0) }, 0.01),
        ("varnished metal", Material { clearcoat: Some(varnish), ..metal(1.0, 0.3) }, 0.04),
    ];
    for (name, material, slack) in balls {
        let world = Build::new().ball(Vec3::ZERO, 1.0, 4, false, |_| material.clone()).sky(1.0).world();
        // Only the ball: its outline is at tan θ = 1 / √(8² − 1).
        let eye = camera(Vec3::Z * 8.0, Vec3::ZERO, 0.17);
        let two_pass = mean(&shoot(&world, &eye, &quick(16)));
        let film = shoot(&world, &eye, &path(16, 16, 64));
        let (by_paths, se) = (mean(&film), standard_error(&film));
        println!("{name}: two passes {two_pass:.5}, paths {by_paths:.5} ± {se:.5}");
        // 2 % of noise asked for in each of 256 pixels is 0.13 % of the mean, times 4.9.
        assert!((two_pass - 1.0).abs() < slack + 0.006, "{name}: {two_pass}");
        // Smooth normals on facets of 4° lose 0.04 % of what matt reflects: it would go below the facet.
        let noise = ALARM * se + 1e-3;
        assert!((two_pass - by_paths).abs() < slack + noise, "{name}: {two_pass}, {by_paths} ± {se}");
    }
}

/// A lampshade: a lamp behind a translucent sheet over a floor. Both integrators show the sheet and the floor alike; a
/// sheet that lets all through, lit from behind by E on both sides alike, shows E τ / π.
#[test]
fn light_comes_through_paper() {
    let sheet = |share: f32| Material {
        diffuse_transmission: Some(DiffuseTransmission {
            share,
            share_texture: None,
            color: Rgb::splat(0.8),
            color_texture: None,
        }),
        ..matt(0.8)
    };
    let room = |share: f32| {
        Build::new()
            .level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5))
            .level(1.0, [-1.0, -1.0], [1.0, 1.0], false, &sheet(share))
            .level(1.5, [-0.3, -0.3], [0.3, 0.3], false, &lamp(100.0))
            .world()
    };
    let from_below = camera(Vec3::new(0.5, 0.3, 1.8), Vec3::new(0.0, 0.6, 0.0), 1.0);
    for share in [0.5, 1.0] {
        let world = room(share);
        let settings = Settings { gather_rays: Some(256), ..hybrid(24, 24, 0.01) };
        let (two_pass, paths) =
            (shoot(&world, &from_below, &settings), shoot(&world, &from_below, &path(24, 24, 512)));
        let c = compare(&two_pass, &paths);
        println!("paper, share {share}: {c:?}, mean {}", mean(&two_pass));
        assert!(mean(&two_pass) > 0.5 && c.agrees(0.015, 0.06), "share {share}: {c:?}");
    }
}

/// Two such sheets 1 mm apart, a lampshade's two sides: between them it is bright, before them dim, and a pixel that is
/// done again must not take the one gather for the other.
#[test]
fn light_comes_through_two_sheets_of_paper() {
    let sheet = Material {
        diffuse_transmission: Some(DiffuseTransmission {
            share: 0.5,
            share_texture: None,
            color: Rgb::splat(0.5),
            color_texture: None,
        }),
        ..matt(0.5)
    };
    let world = Build::new()
        .level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5))
        .level(1.0, [-1.0, -1.0], [1.0, 1.0], false, &sheet)
        .level(1.001, [-1.0, -1.0], [1.0, 1.0], false, &sheet)
        .level(1.5, [-0.3, -0.3], [0.3, 0.3], false, &lamp(100.0))
        .level(0.9, [-0.1, -0.1], [0.1, 0.1], true, &matt(0.5))
        .point_lamp(Vec3::new(0.0, 0.4, 0.0), 5.0)
        .world();
    let from_below = camera(Vec3::new(0.2, 0.1, 0.6), Vec3::new(0.0, 1.0, 0.0), 0.6);
    let paths = shoot(&world, &from_below, &path(32, 32, 512));
    for diffuse in [DiffuseMode::Split, DiffuseMode::Gather] {
        let two_pass = shoot(&world, &from_below, &Settings { diffuse, ..hybrid(32, 32, 0.02) });
        let c = compare(&two_pass, &paths);
        println!("two sheets, {diffuse:?}: {c:?}, mean {}", mean(&two_pass));
        // 2 % is asked, half of it for noise; one gather taken for the other made the mean 1.9 % and a block 9 % too dark.
        assert!(mean(&two_pass) > 0.5 && c.agrees(0.01, 0.05), "{diffuse:?}: {c:?}");
    }
}

/// A mirror shows a lamp at the lamp's radiance times what it reflects: the lamp is in the mirror, and not once more by
/// its shadow ray. Rough metal under the same lamp is the same by both integrators.
#[test]
fn a_mirror_shows_a_lamp_once() {
    let over = |material: &Material, size: f32| {
        Build::new()
            .level(0.0, [-1.0, -1.0], [1.0, 1.0], true, material)
            .level(1.0, [-size, -size], [size, size], false, &lamp(100.0))
            .world()
    };
    let down = parallel(Vec3::Y * 0.5, Vec3::ZERO, 0.05, 0.0);
    assert_both("mirror", &over(&metal(0.9, 0.0), 0.2), &down, 90.0, 1e-5);
    let aslant = camera(Vec3::new(0.0, 0.8, 1.5), Vec3::ZERO, 0.6);
    for roughness in [0.15, 0.4, 0.8] {
        let world = over(&metal(0.9, roughness), 0.3);
        let c = compare(&shoot(&world, &aslant, &quick(24)), &shoot(&world, &aslant, &path(24, 24, 256)));
        println!("metal of roughness {roughness}: {c:?}");
        assert!(c.agrees(0.01, 0.05), "roughness {roughness}: {c:?}");
    }
}

/// Between two facing mirrors the k-th image is ρ^k: a ray at 45° that meets ten of them before the sky.
#[test]
fn facing_mirrors_make_a_geometric_series() {
    let mirror = metal(0.8, 0.0);
    let wall = |x: f32| {
        // From z = −9.75 to z = 1, fronts inward.
        let mut c = [[-1.0, 1.0], [1.0, 1.0], [1.0, -9.75], [-1.0, -9.75]].map(|[y, z]| Vec3::new(x, y, z));
        if x < 0.0 {
            c.reverse();
        }
        c
    };
    let world = Build::new().quad(wall(-0.5), &mirror).quad(wall(0.5), &mirror).sky(1.0).world();
    let eye = camera(Vec3::ZERO, Vec3::new(1.0, 0.0, -1.0), 1e-3);
    // Schlick: F = F0 + (1 − F0)(1 − cos θ)^5, θ = 45°. Met at z = −0.5, −1.5, …, −9.5.
    let f = 0.8 + 0.2 * (1.0 - 0.5f64.sqrt()).powi(5);
    assert_both("ten mirrors", &world, &eye, f.powi(10), 1e-3);
}

/// A closed box of perfect mirrors with a matt ball in it: every path ends, and what is seen is finite. The box is the
/// ball's furnace, L = 1 / (1 − 0.5), wherever a ray ends on it; some light is lost with rays that never do.
#[test]
fn a_box_of_perfect_mirrors_ends() {
    let mirror = metal(1.0, 0.0);
    let world = Build::new()
        .room(Vec3::splat(-1.0), Vec3::splat(1.0), [&mirror; 6])
        .ball(Vec3::ZERO, 0.3, 2, false, |_| glowing(1.0, 0.5))
        .world();
    let eye = camera(Vec3::new(0.3, 0.6, 0.9), Vec3::new(-0.9, 0.2, 0.1), 1.0);
    // Photons by the million would bounce 32 times each: a coarse prepass will do.
    for settings in [hybrid(8, 8, 0.3), path(8, 8, 16)] {
        let film = shoot(&world, &eye, &settings);
        println!("mirror box, {:?}: {:?}, mean {}", settings.integrator, range(&film), mean(&film));
        assert!(mean(&film) > 1.0 && mean(&film) < 2.0 + ALARM * standard_error(&film), "{}", mean(&film));
    }
}

/// Sun or lamp on a mirror on the ceiling: the image source adds ρ I cos / d², d all the way. No camera ray finds a lamp
/// without extent there, so it is the photons' part, and `path` does not see it.
#[test]
fn a_mirror_throws_a_lamp_on_the_ceiling() {
    let (lamp_y, top) = (1.0f32, 2.0f32);
    let world = Build::new()
        .level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &metal(0.8, 0.0))
        .level(top, [-2.0, -2.0], [2.0, 2.0], false, &matt(0.5))
        .point_lamp(Vec3::new(0.0, lamp_y, 0.0), 100.0)
        .world();
    let eye = parallel(Vec3::new(0.0, 1.5, 0.0), Vec3::new(0.0, 2.0, 0.0), 0.3, 0.0);
    let film = shoot(&world, &eye, &hybrid(16, 16, 0.02));
    // The middle of the ceiling: 1 m from the lamp, 3 m from its image. Means over the square of 0.6 m by 100 points.
    let mean_over = |h: f32| -> f32 {
        let at = |k: i32| ((k % 10) as f32 * 0.06 - 0.27, (k / 10) as f32 * 0.06 - 0.27);
        (0..100).map(|k| h / (at(k).0.powi(2) + at(k).1.powi(2) + h * h).powf(1.5)).sum::<f32>() / 100.0
    };
    let direct = f64::from(100.0 * mean_over(top - lamp_y) * 0.5 / PI);
    // Schlick's term at under 6° from the normal is below 1e-6.
    let image = f64::from(0.8 * 100.0 * mean_over(top + lamp_y) * 0.5 / PI);
    let indirect = support::picture::mean_of(&film, |p| p.indirect);
    let got = support::picture::mean_of(&film, |p| p.direct);
    println!("ceiling: direct {got} of {direct}, by mirror {indirect}, at least {image}");
    assert!((got / direct - 1.0).abs() < 2e-3, "{got} {direct}");
    // The ceiling's own light comes back by the mirror as well: an even ceiling of radiosity B would see F B.
    assert!(indirect > 0.98 * image, "{indirect} {image}");
}

/// Of the sun that shines on a hectare, what a mirror in a courtyard throws on the wall is a forty-thousandth. It is all there, by
/// more particles than its share of the light alone would be worth.
#[test]
fn a_small_mirror_in_the_sun_gets_its_particles() {
    let (v, m, mirror, sun) = (Vec3::new, matt(0.5), metal(0.9, 0.0), 10_000.0f32);
    let reflectance = 0.9 + 0.1 * (1.0 - 0.5f32.sqrt()).powi(5);
    let mut build = Build::new()
        .level(-0.01, [-50.0, -50.0], [50.0, 50.0], true, &m)
        .level(0.0, [-2.0, -2.0], [2.0, 2.0], true, &m)
        .block(v(2.0, 0.0, -2.0), v(2.2, 3.0, 2.0), &m)
        .block(v(-2.2, 0.0, -2.0), v(-2.0, 3.0, 2.0), &m)
        .block(v(-2.0, 0.0, -2.2), v(2.0, 3.0, -2.0), &m)
        // Half a metre square as seen from above; it throws what comes down at the wall at x = 2.
        .quad([v(-0.25, 1.5, 0.25), v(0.25, 1.0, 0.25), v(0.25, 1.0, -0.25), v(-0.25, 1.5, -0.25)], &mirror);
    let kind = LightKind::Directional { direction: -Vec3::Y };
    build.scene.lights.push(Light { name: "sun".into(), intensity: Rgb::splat(sun), kind });
    let world = build.world();
    let solution = radiosity::solve(&world, &Config::for_error(0.04), &()).expect("finite");
    let (sent, gathered) = (solution.caustics.sent, 2 * solution.report.landings);
    let (flux, exact) = (solution.report.caustic_flux.g, 0.25 * sun * reflectance);
    println!("{sent} particles beside {gathered} rays; {flux} of {exact} lm");
    assert!((flux / exact - 1.0).abs() < 0.02, "{flux} of {exact} lm");
    // A pilot has 65 536.
    assert!(sent > 2 * 65_536 && sent < gathered / 9, "{sent} particles beside {gathered} rays");
}
