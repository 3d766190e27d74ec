//! The path tracer against closed forms, and its two ways of finding a lamp against each other.
//!
//! All statistical tests: independent samples, z by the measured variance, |z| < 4.9, so one false alarm in a million
//! each. Beside each stands the standard error it reaches; 4.9 times that is the smallest error it would catch.

use super::*;
use geometry::math::Mat4;
use geometry::polygon::polygon_irradiance;
use geometry::{Light, LightKind, Material, MaterialId, Projection, Scene, Sky, Volume};

/// Lambertian.
fn matt(rho: f32) -> Material {
    Material { base_color: Rgb::splat(rho), metallic: 0.0, specular: 0.0, ..Material::default() }
}

fn lamp(radiance: f32) -> Material {
    Material { emissive: Rgb::splat(radiance), ..matt(0.0) }
}

fn glass(volume: Option<Volume>, ior: f32) -> Material {
    Material { transmission: 1.0, roughness: 0.0, metallic: 0.0, ior, volume, ..Material::default() }
}

const CLEAR: Volume = Volume { attenuation_color: Rgb::WHITE, attenuation_distance: f32::INFINITY };

fn add(scene: &mut Scene, corners: [Vec3; 4], material: Material) {
    let first = scene.mesh.positions.len() as u32;
    let id = MaterialId(scene.materials.len() as u32);
    scene.materials.push(material);
    scene.mesh.positions.extend(corners);
    scene.mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    scene.mesh.materials.extend([id; 2]);
}

/// A square of half side `h` in the plane y = const; its front faces up or down.
fn level(y: f32, h: f32, up: bool) -> [Vec3; 4] {
    let s = if up { h } else { -h };
    [[-s, h], [s, h], [s, -h], [-s, -h]].map(|[x, z]| Vec3::new(x, y, z))
}

/// A box of half side `h` around the origin whose fronts face inward, or outward; scaled by `scale`.
fn cube(scene: &mut Scene, scale: Vec3, inward: bool, material: &Material) {
    for axis in 0..3 {
        for side in [-1f32, 1.0] {
            let corner = |a: f32, b: f32| {
                let mut p = Vec3::splat(side);
                p[(axis + 1) % 3] = a;
                p[(axis + 2) % 3] = b;
                p * scale
            };
            let mut corners = [corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)];
            if (side > 0.0) == inward {
                corners.reverse();
            }
            add(scene, corners, material.clone());
        }
    }
}

/// Mean and variance of the mean of `n` independent values.
fn estimate(n: u64, mut value: impl FnMut(&mut Rng) -> f32) -> (f64, f64) {
    let (mut sum, mut squares) = (0f64, 0f64);
    for i in 0..n {
        let x = f64::from(value(&mut Rng::new(1, i)));
        sum += x;
        squares += x * x;
    }
    let mean = sum / n as f64;
    (mean, (squares / n as f64 - mean * mean).max(0.0) / (n - 1) as f64)
}

fn assert_agrees((mean, variance): (f64, f64), exact: f64) {
    let sigma = variance.sqrt();
    // Where every sample is the same, rounding is all there is.
    assert!((mean - exact).abs() < 4.9 * sigma + 2e-5 * exact, "{mean} ± {sigma} for {exact}");
}

fn total(world: &World, ray: Ray, rng: &mut Rng) -> f32 {
    radiance(world, ray, rng).0.total().luminance()
}

fn down_to(target: Vec3) -> Ray {
    let from = Vec3::new(0.3, 0.9, -0.2);
    Ray::new(from, (target - from).normalize())
}

/// Closed, ρ = ½ and L_emitted = ½ all over: L = ½ / (1 − ½). 5 000 paths: σ = 0.3 %.
#[test]
fn a_furnace_shines_evenly() {
    let mut scene = Scene::default();
    cube(&mut scene, Vec3::ONE, true, &Material { emissive: Rgb::splat(0.5), ..matt(0.5) });
    let world = World::new(scene);
    let d = Vec3::new(0.3, -0.5, 0.8).normalize();
    assert_agrees(estimate(5000, |rng| total(&world, Ray::new(Vec3::ZERO, d), rng)), 1.0);
}

/// Floor under a square lamp: L = ρ L_lamp F, in the layer of direct light, whose two ways of sampling meet.
/// 5 000 paths: σ = 0.1 %; without shadow rays 3 %.
#[test]
fn a_floor_under_a_lamp_is_the_closed_form() {
    let mut scene = Scene::default();
    add(&mut scene, level(0.0, 5.0, true), matt(0.7));
    add(&mut scene, level(1.0, 0.4, false), lamp(10.0));
    let target = Vec3::new(0.2, 0.0, 0.1);
    let exact = 0.7 * 10.0 * polygon_irradiance(target, Vec3::Y, &level(1.0, 0.4, false));
    let world = World::new(scene);
    for light_sampling in [true, false] {
        let direct = estimate(5000, |rng| {
            let (layers, seen) = Path::new(&world, down_to(target), light_sampling).trace(rng);
            assert!((seen.expect("the floor").position - target).length() < 1e-5);
            assert!(layers.specular.is_black() && layers.emission.is_black() && layers.indirect.is_black());
            layers.direct.g
        });
        assert_agrees(direct, f64::from(exact));
    }
}

/// Sphere of one ρ around a point lamp: E = I/r² directly, E/(1 − ρ) in all. 20 000 paths: σ = 0.24 %.
#[test]
fn a_sphere_around_a_point_multiplies_its_light() {
    let (rho, n) = (0.6f32, 48u32);
    let mut scene = Scene::default();
    let at = |i: u32, j: u32| {
        let (sin_t, cos_t) = (PI * i as f32 / n as f32).sin_cos();
        let (sin_p, cos_p) = (PI * j as f32 / n as f32).sin_cos();
        Vec3::new(sin_t * cos_p, cos_t, sin_t * sin_p)
    };
    for i in 0..n {
        for j in 0..2 * n {
            add(&mut scene, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], matt(rho));
        }
    }
    let kind = LightKind::Point { position: Vec3::ZERO, range: f32::INFINITY };
    scene.lights = vec![Light { name: String::new(), intensity: Rgb::splat(PI), kind }];
    let world = World::new(scene);
    let (mean, variance) = estimate(20_000, |rng| {
        let d = geometry::sampling::sphere(rng.vec2());
        total(&world, Ray::new(Vec3::ZERO, d), rng)
    });
    let exact = f64::from(rho / (1.0 - rho));
    // The facets lie inside the sphere by up to (π/n)²/4 of its radius, and so does the light's distance.
    assert!((mean - exact).abs() < 4.9 * variance.sqrt() + 5e-3 * exact, "{mean} {exact}");
}

#[test]
fn a_mirror_shows_the_lamp_and_nothing_twice() {
    let mut scene = Scene::default();
    let mirror = Material { base_color: Rgb::splat(0.8), roughness: 0.0, ..Material::default() };
    add(&mut scene, level(0.0, 5.0, true), mirror);
    add(&mut scene, level(2.0, 1.0, false), lamp(10.0));
    let world = World::new(scene);
    for i in 0..100 {
        let (layers, _) = radiance(&world, Ray::new(Vec3::Y, Vec3::NEG_Y), &mut Rng::new(2, i));
        assert!((layers.specular.g - 8.0).abs() < 1e-5 && layers.total() == layers.specular);
    }
}

/// n = 1.5, straight on: one slab passes T = 1/(1 + 2R/(1 − R)) = 0.9231 in all orders, two pass T/(2 − T).
/// 20 000 paths: σ = 0.3 %.
#[test]
fn two_slabs_of_glass_pass_what_all_orders_add_up_to() {
    for (slabs, exact) in [(1, 12.0 / 13.0), (2, 6.0 / 7.0)] {
        let mut scene = Scene::default();
        for i in 0..slabs {
            let (y, pane) = (i as f32 * 0.5, glass(Some(CLEAR), 1.5));
            add(&mut scene, level(y + 0.1, 9.0, true), pane.clone());
            add(&mut scene, level(y - 0.1, 9.0, false), pane);
        }
        add(&mut scene, level(-1.0, 9.0, true), lamp(1.0));
        let world = World::new(scene);
        let ray = Ray::new(Vec3::Y * 3.0, Vec3::NEG_Y);
        let seen = estimate(20_000, |rng| radiance(&world, ray, rng).0.specular.g);
        assert_agrees(seen, exact);
    }
}

/// A lamp behind a window: with shadow rays through the pane, and by paths that meet the lamp through it alone.
/// 40 000 paths each: σ of direct light 0.13 % with shadow rays and 0.26 % without, of indirect light 2.1 and 2.5 %.
#[test]
fn a_window_is_no_matter_which_way_the_lamp_is_found() {
    let mut scene = Scene::default();
    add(&mut scene, level(0.0, 5.0, true), matt(0.7));
    add(&mut scene, level(0.5, 5.0, true), Material { base_color: Rgb::splat(0.8), ..glass(None, 1.5) });
    add(&mut scene, level(1.0, 2.0, false), lamp(10.0));
    let world = World::new(scene);
    let eye = Ray::new(Vec3::new(0.0, 0.4, 0.0), Vec3::new(0.2, -1.0, 0.1).normalize());
    let layer = |light_sampling: bool, of: fn(&Layers) -> Rgb| {
        estimate(40_000, |rng| of(&Path::new(&world, eye, light_sampling).trace(rng).0).g)
    };
    for of in [|l: &Layers| l.direct, |l: &Layers| l.indirect] {
        let (both, alone) = (layer(true, of), layer(false, of));
        assert!(both.0 > 0.0 && both.1 < alone.1, "shadow rays help: {both:?} {alone:?}");
        let z = (both.0 - alone.0) / (both.1 + alone.1).sqrt();
        assert!(z.abs() < 4.9, "z = {z}: {both:?} {alone:?}");
    }
}

/// The same for a mixture of gloss and matt, where one ray serves two layers. 20 000 paths: σ = 1 %.
#[test]
fn gloss_and_matt_share_their_rays_without_bias() {
    let mut scene = Scene::default();
    let plastic =
        Material { base_color: Rgb::splat(0.5), metallic: 0.0, roughness: 0.4, ..Material::default() };
    add(&mut scene, level(0.0, 5.0, true), plastic);
    add(&mut scene, level(1.0, 0.5, false), lamp(10.0));
    scene.sky = Some(Sky::Constant(Rgb::splat(0.4)));
    let world = World::new(scene);
    let eye = Ray::new(Vec3::new(-1.0, 0.5, 0.0), Vec3::new(1.0, -0.5, 0.0).normalize());
    for of in [|l: &Layers| l.direct, |l: &Layers| l.specular] {
        let [both, alone] = [true, false]
            .map(|light| estimate(20_000, |rng| of(&Path::new(&world, eye, light).trace(rng).0).g));
        let z = (both.0 - alone.0) / (both.1 + alone.1).sqrt();
        assert!(z.abs() < 4.9, "z = {z}: {both:?} {alone:?}");
    }
}

/// A matt floor under an even sky: ρ L, whatever part of it shadow rays find.
#[test]
fn a_floor_under_the_sky() {
    let mut scene = Scene { sky: Some(Sky::Constant(Rgb::splat(3.0))), ..Scene::default() };
    add(&mut scene, level(0.0, 5.0, true), matt(0.5));
    let world = World::new(scene);
    let direct = estimate(5000, |rng| radiance(&world, down_to(Vec3::ZERO), rng).0.direct.g);
    assert_agrees(direct, 1.5);
    let (layers, seen) = radiance(&world, Ray::new(Vec3::Y, Vec3::Y), &mut Rng::new(0, 0));
    assert!(layers.emission == Rgb::splat(3.0) && seen.is_none());
}

/// Light that a medium without refraction absorbs, seen through it and thrown through it by a lamp.
#[test]
fn a_medium_absorbs_by_the_way_in_it() {
    let mut scene = Scene::default();
    let volume = Volume { attenuation_color: Rgb::splat(0.25), attenuation_distance: 0.4 };
    add(&mut scene, level(0.6, 9.0, true), glass(Some(volume), 1.0));
    add(&mut scene, level(0.4, 9.0, false), glass(Some(volume), 1.0));
    add(&mut scene, level(0.0, 9.0, true), matt(1.0));
    let kind = LightKind::Point { position: Vec3::Y, range: f32::INFINITY };
    scene.lights = vec![Light { name: String::new(), intensity: Rgb::splat(PI), kind }];
    let world = World::new(scene);
    // Half the distance in it leaves √¼, on the way of the light and again on the way to the eye.
    for i in 0..20 {
        let (layers, seen) = radiance(&world, Ray::new(Vec3::Y * 2.0, Vec3::NEG_Y), &mut Rng::new(0, i));
        assert!((layers.direct.g - 0.25).abs() < 1e-4, "{layers:?}");
        assert!((seen.expect("the floor").depth - 2.0).abs() < 1e-5);
    }
}

#[test]
fn an_unlit_surface_shows_but_lights_nothing() {
    let mut scene = Scene::default();
    let unlit = Material { base_color: Rgb::splat(0.6), unlit: true, ..Material::default() };
    let mirror = Material { roughness: 0.0, ..Material::default() };
    add(&mut scene, level(2.0, 9.0, false), unlit);
    add(&mut scene, level(0.0, 1.0, true), mirror);
    add(&mut scene, level(-0.1, 9.0, true), matt(0.9));
    let world = World::new(scene);
    let look = |from: Vec3, d: Vec3| radiance(&world, Ray::new(from, d), &mut Rng::new(0, 0)).0;
    assert_eq!(look(Vec3::Y, Vec3::Y).emission, Rgb::splat(0.6));
    assert!((look(Vec3::Y, Vec3::NEG_Y).specular.g - 0.6).abs() < 1e-6);
    assert!(look(Vec3::new(4.0, 1.0, 0.0), Vec3::NEG_Y).total().is_black());
}

/// Alpha ¼ before a lamp: ¾ of it is seen. 5 000 paths: σ = 0.8 %.
#[test]
fn alpha_lets_its_share_through() {
    let mut scene = Scene::default();
    let veil = Material { alpha: 0.25, alpha_mode: geometry::AlphaMode::Blend, ..matt(0.0) };
    add(&mut scene, level(0.5, 1.0, true), veil);
    add(&mut scene, level(0.0, 1.0, true), lamp(2.0));
    let world = World::new(scene);
    let seen = estimate(5000, |rng| radiance(&world, Ray::new(Vec3::Y, Vec3::NEG_Y), rng).0.emission.g);
    assert_agrees(seen, 1.5);
}

#[test]
fn a_pixel_is_the_same_twice_and_states_its_variance() {
    let mut scene = Scene::default();
    cube(&mut scene, Vec3::ONE, true, &Material { emissive: Rgb::splat(0.5), ..matt(0.5) });
    let world = World::new(scene);
    let projection = Projection::Perspective { yfov: 1.0 };
    let camera =
        Camera { name: String::new(), to_world: Mat4::IDENTITY, projection, near: 0.0, aspect: None };
    let pixel = |seed| render_pixel(&world, &camera, (8, 4), (3, 1), 64, seed);
    let (a, b, c) = (pixel(5), pixel(5), pixel(6));
    assert_eq!(a, b);
    assert_ne!(a, c);
    assert!(a.alpha == 1.0 && a.normal.z > 0.99 && (a.depth - 1.0).abs() < 0.2 && a.albedo.g == 0.5);
    assert!((a.irradiance.g * 0.5 / PI + 0.5 - a.beauty().g).abs() < 1e-5);
    assert!(f64::from((a.beauty().luminance() - 1.0).abs()) < 4.9 * f64::from(a.variance).sqrt());
}
