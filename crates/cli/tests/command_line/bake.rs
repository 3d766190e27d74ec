//! `twolight bake`.

use super::{Run, folder, scene, twolight};
use geometry::gltf;
use std::fs;
use std::path::Path;

/// Bakes a scene of the repository into lit.glb, coarsely.
fn bake(dir: &Path, name: &str, more: &[&str]) -> Run {
    let scene = scene(name);
    let fixed =
        ["bake", scene.to_str().expect("the path is UTF-8"), "-o", "lit.glb", "--error", "20%", "--json"];
    twolight(dir, &[&fixed[..], more].concat())
}

#[test]
fn a_baked_scene_is_unlit_and_keeps_its_names() {
    let dir = folder();
    for more in [&["--vertices", "3000"][..], &["--lightmap", "64"]] {
        let run = bake(dir.path(), "cornell-specular.gltf", more);
        assert_eq!(run.status, 0, "{}", run.err);
        let json: serde_json::Value = serde_json::from_str(&run.out).expect("it is JSON");
        assert!(json["error"].as_f64() > Some(0.0) && json["exposure"].is_f64(), "{json}");
        assert!(run.err.contains("matt") && run.err.contains("glass"), "{}", run.err);
        let lit = gltf::load(&dir.path().join("lit.glb")).expect("it is glTF");
        let original = gltf::load(&scene("cornell-specular.gltf")).expect("it is glTF");
        assert_eq!(lit.cameras[0].name, original.cameras[0].name);
        let names =
            |l: &gltf::Loaded| -> Vec<String> { l.scene.mesh.parts.iter().map(|p| p.name.clone()).collect() };
        assert_eq!(names(&lit), names(&original));
        let glass = |m: &geometry::Material| m.transmission > 0.0;
        assert!(lit.scene.materials.iter().all(|m| m.unlit != glass(m)), "all but glass is unlit");
        assert!(lit.scene.materials.iter().any(glass));
    }
}

#[test]
fn indirect_light_leaves_lamps_and_materials_as_they_are() {
    let dir = folder();
    let run = bake(dir.path(), "two-rooms.gltf", &["--indirect", "--lightmap", "64"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let lit = gltf::load(&dir.path().join("lit.glb")).expect("it is glTF");
    let original = gltf::load(&scene("two-rooms.gltf")).expect("it is glTF");
    assert_eq!(lit.scene.lights.len(), original.scene.lights.len());
    assert!(lit.scene.materials.iter().all(|m| !m.unlit));
    assert!(lit.scene.materials.iter().any(|m| m.emissive_texture.is_some()));
}

#[test]
fn nothing_is_lost_and_the_scene_is_never_overwritten() {
    let dir = folder();
    let name = scene("cornell-box.gltf");
    let name = name.to_str().expect("the path is UTF-8");
    fs::copy(name, dir.path().join("room.glb")).expect("it can be copied");
    for (args, status, word) in [
        (&["bake", "room.glb", "-o", "room.glb"][..], 2, "replace the scene"),
        (&["bake", "room.glb", "-o", "./room.glb"], 2, "replace the scene"),
        (&["bake", "room.glb", "-o", "lit.gltf"], 2, ".glb"),
        (&["bake", "room.glb", "-o", "lit.glb", "--lightmap", "8"], 2, "--lightmap"),
        (&["bake", "absent.glb", "-o", "lit.glb"], 1, "absent.glb"),
        (&["bake", "room.glb", "-o", "no/such/lit.glb"], 1, "no/such"),
    ] {
        let run = twolight(dir.path(), args);
        assert_eq!(run.status, status, "{args:?}: {}", run.err);
        assert!(run.err.contains(word), "{args:?}: {}", run.err);
    }
    let left: Vec<_> = fs::read_dir(dir.path()).expect("it can be listed").collect();
    assert_eq!(left.len(), 1, "{left:?}");
    let as_before = fs::read(dir.path().join("room.glb")).expect("it is still there");
    assert_eq!(as_before, fs::read(name).expect("it is there"));
}
