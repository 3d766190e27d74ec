//! One sick scene for each kind of finding, and a sound one.

use super::*;
use geometry::gltf::Facts;
use geometry::math::Mat4;
use geometry::{Camera, Material, MaterialId, Part, Projection, Rgb, Scene, Vec3, Volume};

/// The six faces of a box, outward; `skip` leaves one out.
fn block(scene: &mut Scene, name: &str, lo: Vec3, hi: Vec3, m: u32, inward: bool, skip: Option<usize>) {
    let mesh = &mut scene.mesh;
    let at = |i: usize| Vec3::new([lo.x, hi.x][i & 1], [lo.y, hi.y][i >> 1 & 1], [lo.z, hi.z][i >> 2 & 1]);
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let first = mesh.triangles.len() as u32;
    for (_, face) in faces.iter().enumerate().filter(|(f, _)| Some(*f) != skip) {
        let base = mesh.positions.len() as u32;
        let corners = face.map(at);
        let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        mesh.positions.extend(corners);
        mesh.normals.extend([if inward { -n } else { n }; 4]);
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| base + k);
        mesh.triangles.extend(match inward {
            false => [[a, b, c], [a, c, d]],
            true => [[a, c, b], [a, d, c]],
        });
    }
    let count = mesh.triangles.len() as u32 - first;
    mesh.materials.resize(mesh.triangles.len(), MaterialId(m));
    mesh.parts.push(Part { name: name.into(), first, count, source: None });
}

/// A room of 4 m with a lamp under its ceiling; materials: paint, lamp, glass.
fn room() -> Scene {
    let paint = Material {
        name: "paint".into(),
        base_color: Rgb::splat(0.7),
        metallic: 0.0,
        specular: 0.0,
        ..Material::default()
    };
    let lamp = Material { name: "lamp".into(), emissive: Rgb::splat(1000.0), ..paint.clone() };
    let volume = Some(Volume { attenuation_color: Rgb::WHITE, attenuation_distance: f32::INFINITY });
    let glass = Material { name: "glass".into(), transmission: 1.0, roughness: 0.0, volume, ..paint.clone() };
    let mut scene = Scene { materials: vec![paint, lamp, glass], ..Scene::default() };
    block(&mut scene, "room", Vec3::ZERO, Vec3::splat(4.0), 0, true, None);
    block(&mut scene, "lamp", Vec3::new(1.5, 3.8, 1.5), Vec3::new(2.5, 3.9, 2.5), 1, false, None);
    scene
}

fn kinds(scene: Scene, eye: Vec3) -> Vec<&'static str> {
    let camera = Camera {
        name: "eye".into(),
        to_world: Mat4::from_translation(eye),
        projection: Projection::Perspective { yfov: 1.0 },
        aspect: None,
        near: 0.0,
    };
    let loaded = Loaded { scene, cameras: vec![camera], warnings: vec![], facts: Facts::default() };
    let found = examine(&loaded);
    found.iter().for_each(|f| println!("{f:?}"));
    found.iter().map(|f| f.kind).collect()
}

const EYE: Vec3 = Vec3::new(0.6, 1.5, 3.3);

#[test]
fn a_sound_room_has_no_findings() {
    let mut scene = room();
    let (lo, hi) = (Vec3::new(1.0, 0.5, 1.0), Vec3::new(1.5, 1.0, 1.5));
    block(&mut scene, "cube", lo, hi, 2, false, None);
    block(&mut scene, "table", Vec3::new(2.0, 0.0, 2.0), Vec3::new(3.0, 0.7, 3.0), 0, false, None);
    assert!(kinds(scene, EYE).is_empty());
}

#[test]
fn glass_that_is_open_or_inside_out_is_found() {
    let (lo, hi) = (Vec3::new(1.0, 0.5, 1.0), Vec3::new(1.5, 1.0, 1.5));
    for (inward, skip) in [(false, Some(3)), (true, None)] {
        let mut scene = room();
        block(&mut scene, "cube", lo, hi, 2, inward, skip);
        assert_eq!(kinds(scene, EYE), ["glass"]);
    }
}

#[test]
fn white_walls_and_darkness_are_found() {
    let mut scene = room();
    scene.materials[0].base_color = Rgb::WHITE;
    scene.materials[1].emissive = Rgb::BLACK;
    assert_eq!(kinds(scene, EYE), ["albedo", "light"]);
    let mut scene = room();
    scene.materials[1].emissive = Rgb::splat(1e-5);
    assert_eq!(kinds(scene, EYE), ["light"]);
}

#[test]
fn faces_in_one_place_are_found() {
    let mut scene = room();
    block(&mut scene, "a", Vec3::splat(1.0), Vec3::splat(1.5), 0, false, None);
    scene.materials.push(Material { name: "other".into(), ..scene.materials[0].clone() });
    block(&mut scene, "b", Vec3::splat(1.0), Vec3::splat(1.5), 3, false, None);
    assert_eq!(kinds(scene, EYE), ["faces"]);
}

#[test]
fn a_wall_on_a_floor_that_goes_on_is_found() {
    let mut scene = room();
    block(&mut scene, "wall", Vec3::new(1.2, 0.0, 0.0), Vec3::new(1.3, 4.0, 4.0), 0, false, None);
    let found = kinds(scene, EYE);
    assert!(!found.is_empty() && found.iter().all(|k| *k == "room"), "{found:?}");
}

#[test]
fn a_camera_in_a_block_is_found() {
    let mut scene = room();
    block(&mut scene, "pillar", EYE - Vec3::splat(0.2), EYE + Vec3::splat(0.2), 0, false, None);
    assert_eq!(kinds(scene, EYE), ["camera"]);
    assert_eq!(kinds(room(), Vec3::new(0.002, 1.5, 3.3)), ["camera"]);
}
