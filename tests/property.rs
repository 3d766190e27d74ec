//! What must not matter, and what must matter in proportion: threads, the scale of light, place, turn and size.

use geometry::math::Mat4;
use geometry::{Camera, Rgb, Scene, Vec3, World};
use rayon::ThreadPoolBuilder;
use raytrace::{Film, Pixel, Settings};
use support::blocks::compare;
use support::build::{Build, camera, moved};
use support::files::asset;
use support::picture::{hybrid, path, shoot};
use support::stuff::{CLEAR, glass, lamp, matt, metal};

/// A box open to the front with a lamp, a block and a mirror ball: every kind of light path that the two passes part.
fn room() -> (Scene, Camera) {
    room_lit([true, true])
}

/// The same, with either of two lamps or both.
fn room_lit([first, second]: [bool; 2]) -> (Scene, Camera) {
    let (white, red) = (matt(0.7), support::stuff::tinted(Rgb::new(0.6, 0.1, 0.1)));
    let mut build = Build::new()
        .level(0.0, [-1.0, -1.0], [1.0, 1.0], true, &white)
        .quad([[-1., 0., -1.], [1., 0., -1.], [1., 2., -1.], [-1., 2., -1.]].map(Vec3::from), &white)
        .quad([[-1., 0., 1.], [-1., 0., -1.], [-1., 2., -1.], [-1., 2., 1.]].map(Vec3::from), &red)
        .block(Vec3::new(0.2, 0.0, -0.6), Vec3::new(0.7, 0.8, -0.1), &white)
        .ball(Vec3::new(-0.4, 0.3, 0.2), 0.3, 3, false, |_| metal(0.9, 0.0));
    if first {
        build = build.level(1.95, [-0.4, -0.4], [0.1, 0.1], false, &lamp(100.0));
    }
    if second {
        build = build.point_lamp(Vec3::new(0.6, 1.6, 0.7), 20.0);
    }
    (build.scene, camera(Vec3::new(0.2, 1.2, 4.0), Vec3::new(0.0, 0.8, 0.0), 0.6))
}

fn picture((scene, camera): &(Scene, Camera), settings: &Settings) -> Film {
    shoot(&World::new(scene.clone()), camera, settings)
}

/// Same seed, same picture to the last bit, whatever the number of threads, with photons, mirrors and glass in it.
#[test]
fn threads_do_not_matter() {
    let (scene, cameras) = asset("cornell-specular.gltf");
    let shot = (scene, cameras[0].clone());
    for settings in [Settings { gather_rays: Some(64), ..hybrid(24, 24, 0.2) }, path(24, 24, 8)] {
        let with = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
            pool.install(|| picture(&shot, &settings))
        };
        let (one, two, three) = (with(1), with(2), with(3));
        assert!(one == two && one == three, "{:?}", settings.integrator);
        let other = picture(&shot, &Settings { seed: 1, ..settings.clone() });
        assert!(one != other, "another seed is another picture");
    }
}

/// Twice the lamps, exactly twice the light: in every layer and every bit, for 2 is a power of two.
#[test]
fn twice_the_lamps_is_twice_the_light() {
    let once = room();
    let mut twice = once.clone();
    twice.0.materials.iter_mut().for_each(|m| m.emissive *= 2.0);
    twice.0.lights.iter_mut().for_each(|l| l.intensity *= 2.0);
    for settings in [hybrid(24, 24, 0.05), path(24, 24, 8)] {
        let (a, b) = (picture(&once, &settings), picture(&twice, &settings));
        let layers = |p: &Pixel| [p.direct, p.indirect, p.specular, p.emission, p.irradiance];
        for (i, (a, b)) in a.pixels.iter().zip(&b.pixels).enumerate() {
            assert_eq!(layers(a).map(|l| l * 2.0), layers(b), "pixel {i}, {:?}", settings.integrator);
        }
    }
}

/// Two lamps together are the sum of each alone, within the 2 % that each picture asks for.
#[test]
fn two_lamps_add_up() {
    let settings = hybrid(32, 32, 0.02);
    let both = picture(&room(), &settings);
    let mut sum = picture(&room_lit([true, false]), &settings);
    let second = picture(&room_lit([false, true]), &settings);
    for (a, b) in sum.pixels.iter_mut().zip(&second.pixels) {
        a.direct += b.direct;
        a.indirect += b.indirect;
        a.specular += b.specular;
        a.emission += b.emission;
        a.variance += b.variance;
    }
    let c = compare(&sum, &both);
    println!("two lamps: {c:?}");
    assert!(c.agrees(0.01, 0.03), "{c:?}");
}

/// Scene and camera moved and turned together: the same picture, within the 2 % asked for; the rays differ.
#[test]
fn place_and_turn_do_not_matter() {
    let settings = hybrid(32, 32, 0.02);
    let (scene, eye) = room();
    let here = picture(&(scene.clone(), eye.clone()), &settings);
    let turn = Mat4::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), 2.1);
    for (what, turn, shift) in [
        ("turned", turn, Vec3::ZERO),
        ("moved by 1 km", Mat4::IDENTITY, Vec3::new(700.0, -300.0, 600.0)),
        ("both", turn, Vec3::new(-60.0, 20.0, 50.0)),
    ] {
        let c = compare(&picture(&moved(&scene, &eye, 1.0, turn, shift), &settings), &here);
        println!("{what}: {c:?}");
        assert!(c.agrees(0.01, 0.03), "{what}: {c:?}");
    }
}

/// A room of two millimetres, and one of two kilometres: the same picture when the lamps without extent grow with the
/// square of the size, as lamps with extent do by themselves.
#[test]
fn size_does_not_matter() {
    let settings = hybrid(32, 32, 0.02);
    let (scene, eye) = room();
    let here = picture(&(scene.clone(), eye.clone()), &settings);
    for scale in [1e-3f32, 1e3] {
        let mut other = moved(&scene, &eye, scale, Mat4::IDENTITY, Vec3::ZERO);
        other.0.lights.iter_mut().for_each(|l| l.intensity *= scale * scale);
        let c = compare(&picture(&other, &settings), &here);
        println!("scale {scale}: {c:?}");
        assert!(c.agrees(0.01, 0.03), "scale {scale}: {c:?}");
    }
}

/// An inside-out ball of glass, a camera within glass, a triangle alone, and nothing at all: finite pictures.
#[test]
fn odd_scenes_give_finite_pictures() {
    let glass = glass(1.5, Some(CLEAR));
    let floor = |b: Build| b.level(-1.0, [-2.0, -2.0], [2.0, 2.0], true, &matt(0.5)).sky(1.0);
    let inside_out = floor(Build::new()).ball(Vec3::ZERO, 0.5, 2, true, |_| glass.clone());
    let around = floor(Build::new()).ball(Vec3::Z * 3.0, 0.5, 2, false, |_| glass.clone());
    let buried = floor(Build::new()).block(Vec3::splat(-0.5), Vec3::splat(0.5), &matt(0.5));
    let eye = camera(Vec3::Z * 3.0, Vec3::ZERO, 0.6);
    for (what, build) in [("inside out", inside_out), ("within glass", around), ("plain", buried)] {
        for settings in [hybrid(8, 8, 0.1), path(8, 8, 8)] {
            let film = picture(&(build.scene.clone(), eye.clone()), &settings);
            let mean = support::picture::mean(&film);
            // Nothing absorbs but the floor, and nothing shines but the sky; within glass radiance is n² = 2.25 times
            // that in air.
            assert!(mean > 0.3 && mean < 2.26, "{what}, {:?}: {mean}", settings.integrator);
        }
    }
    for settings in [hybrid(4, 4, 0.1), path(4, 4, 2)] {
        let film = picture(&(Scene::default(), eye.clone()), &settings);
        assert_eq!(support::picture::mean(&film), 0.0);
    }
}
