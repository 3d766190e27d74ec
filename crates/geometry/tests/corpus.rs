//! The loader over a folder of real, unusual and broken files, when it is there.
//!
//! The files are too many and too varied in licence for the repository. They are looked for in
//! `$TWOLIGHT_SHARED/scenes`, then in `../shared/scenes` beside the workspace; without them each test says
//! that it has checked nothing.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use geometry::gltf::{Error, Loaded, Options, load, load_with};
use geometry::math::{Vec2, Vec3};
use geometry::{LightKind, Projection};

fn folder(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let places = std::env::var_os("TWOLIGHT_SHARED").map(PathBuf::from).into_iter().chain([beside]);
    let found = places.map(|place| place.join("scenes").join(name)).find(|path| path.is_dir());
    if found.is_none() {
        eprintln!("no folder of scenes: nothing is checked (set TWOLIGHT_SHARED to have it)");
    }
    found
}

/// All glTF files below `folder`, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()) {
            match entry.extension().and_then(|e| e.to_str()) {
                _ if entry.is_dir() => open.push(entry),
                Some("gltf" | "glb") => found.push(entry),
                _ => {}
            }
        }
    }
    found.sort();
    found
}

/// What every loaded scene promises to those who use it.
fn check_promises(loaded: &Loaded, file: &Path) {
    let (mesh, file) = (&loaded.scene.mesh, file.display());
    let n = mesh.positions.len();
    assert_eq!(mesh.normals.len(), n, "{file}");
    for length in [mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.len(), mesh.tangents.len()] {
        assert!(length == 0 || length == n, "{file}: optional arrays are empty or full");
    }
    assert!(mesh.positions.iter().all(|p| p.is_finite()), "{file}");
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "{file}");
    assert!(
        mesh.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-4 && t.w.abs() == 1.0),
        "{file}"
    );
    assert_eq!(mesh.materials.len(), mesh.triangles.len(), "{file}");
    assert!(mesh.materials.iter().all(|m| (m.0 as usize) < loaded.scene.materials.len()), "{file}");
    assert!((0..mesh.triangles.len() as u32).all(|t| mesh.area(t) > 0.0), "{file}");
    let end = mesh.parts.iter().fold(0, |at, part| {
        assert_eq!(part.first, at, "{file}: parts follow each other");
        at + part.count
    });
    assert_eq!(end as usize, mesh.triangles.len(), "{file}");
}

#[test]
fn hostile_files_are_loaded_or_refused_in_time() {
    let Some(folder) = folder("malformed") else { return };
    let index = std::fs::read_to_string(folder.join("INDEX.csv")).expect("the index");
    let (mut loaded_wrongly, mut refused_wrongly) = (0, Vec::new());
    for line in index.lines().skip(1) {
        let (name, verdict) = line.split_once(',').expect("a file and its verdict");
        let file = folder.join(name);
        let start = Instant::now();
        let result = load(&file);
        assert!(start.elapsed() < Duration::from_secs(10), "{name}");
        match result {
            Err(Error::Defect { problem, .. }) => panic!("{name}: a panic was caught: {problem}"),
            Err(e) => {
                assert!(e.to_string().contains(&*file.to_string_lossy()), "an error names the file: {e}");
                if verdict.starts_with("0,") {
                    refused_wrongly.push(name.rsplit('/').next().unwrap_or(name));
                }
            }
            Ok(loaded) => {
                check_promises(&loaded, &file);
                loaded_wrongly += u32::from(!verdict.starts_with("0,"));
            }
        }
    }
    // Both ask for glTF 2.1, where glTF says to refuse and the validator only warns.
    refused_wrongly.sort_unstable();
    assert_eq!(refused_wrongly, ["min_version_valid.gltf", "version-unsupported-min.gltf"]);
    // Their faults lie in what is never looked at, like animations, or do no harm, like wrong bounds.
    eprintln!("{loaded_wrongly} files load although the validator finds errors");
}

#[test]
fn every_feature_model_loads_or_names_what_it_requires() {
    let Some(folder) = folder("features") else { return };
    for file in files(&folder) {
        let name = file.strip_prefix(&folder).expect("below").to_string_lossy().replace('\\', "/");
        // Drawn as points and lines only, or without any mesh.
        let nothing = ["Mode_00", "Mode_01", "Mode_03", "Mode_07", "Mode_09", "Mode_10", "unicode-names"];
        match load(&file) {
            Ok(loaded) => {
                check_promises(&loaded, &file);
                assert_eq!(
                    loaded.scene.mesh.triangles.is_empty(),
                    nothing.iter().any(|n| name.contains(n)),
                    "{name}"
                );
            }
            // minVersion 2.1: made to be refused.
            Err(e) => assert!(name.contains("Compatibility_04"), "{e}"),
        }
    }
}

#[test]
fn interiors_have_their_triangles_and_their_camera() {
    let Some(folder) = folder("interiors") else { return };
    let expected = [
        ("cornell-box", 36, 0.340_339),
        ("veach-ajar", 382_690, 0.628_029),
        ("wooden-staircase", 262_659, 1.021_785),
        ("white-room", 400_407, 1.024_779),
        ("japanese-classroom", 103_832, 0.628_029),
        ("cornell-measured", 38, 0.686_049),
        ("radiance-closed-box", 3_982, 1.396_263),
        ("obvhs-kitchen", 56_941, std::f32::consts::FRAC_PI_3),
        ("rrv-room2", 4_108, 1.221_730),
    ];
    for (name, triangles, fov) in expected {
        let file = folder.join(name).with_extension("glb");
        let start = Instant::now();
        let loaded = load(&file).unwrap_or_else(|e| panic!("{e}"));
        eprintln!("{name}: {} ms", start.elapsed().as_millis());
        check_promises(&loaded, &file);
        let dropped = triangles - loaded.scene.mesh.triangles.len();
        assert!(dropped <= triangles / 1000, "{name}: {dropped} dropped");
        assert_eq!(loaded.warnings.iter().any(|w| w.contains("dropped")), dropped > 0, "{name}");
        let [camera] = &loaded.cameras[..] else { panic!("{name} has one camera") };
        let Projection::Perspective { yfov } = camera.projection else {
            panic!("{name}: {:?}", camera.projection)
        };
        assert!((yfov - fov).abs() < 1e-5 && camera.name == "camera", "{name}");
        let eye = camera.to_world.transform_point3(Vec3::ZERO);
        let (low, high) = loaded.scene.mesh.bounds().expect("triangles");
        let reach = 2.0 * (high - low).length();
        assert!((eye - 0.5 * (low + high)).length() < reach, "{name}: the camera is near the room");
    }
}

fn feature(name: &str) -> Option<Loaded> {
    let file = folder("features")?.join(name);
    Some(load(&file).unwrap_or_else(|e| panic!("{e}")))
}

#[test]
fn quantized_and_plain_positions_agree() {
    let (Some(plain), Some(quantized)) = (feature("Duck.glb"), feature("Duck-quantized/Duck.gltf")) else {
        return;
    };
    let bounds = |loaded: &Loaded| loaded.scene.mesh.bounds().expect("a duck");
    let ((a, b), (c, d)) = (bounds(&plain), bounds(&quantized));
    let size = (b - a).length();
    assert!((a - c).length() < 1e-3 * size && (b - d).length() < 1e-3 * size, "{a} {b} and {c} {d}");
    assert_eq!(plain.scene.mesh.triangles.len(), quantized.scene.mesh.triangles.len());
}

#[test]
fn compressed_and_plain_meshes_agree() {
    let bounds = |loaded: &Loaded| loaded.scene.mesh.bounds().expect("triangles");
    for (plain, packed) in [
        ("Duck.glb", "Duck-draco/Duck.gltf"),
        ("Box.glb", "BoxDraco/BoxDraco.gltf"),
        ("Box.glb", "BoxMeshopt.glb"),
    ] {
        let (Some(a), Some(b)) = (feature(plain), feature(packed)) else { return };
        let ((lo, hi), (lo2, hi2)) = (bounds(&a), bounds(&b));
        let size = (hi - lo).length();
        assert!(
            (lo - lo2).length() < 2e-3 * size && (hi - hi2).length() < 2e-3 * size,
            "{packed}: {lo2} {hi2}"
        );
        assert_eq!(a.scene.mesh.triangles.len(), b.scene.mesh.triangles.len(), "{packed}");
        let area =
            |l: &Loaded| (0..l.scene.mesh.triangles.len() as u32).map(|t| l.scene.mesh.area(t)).sum::<f32>();
        assert!((area(&a) / area(&b) - 1.0).abs() < 5e-3, "{packed}: {} {}", area(&a), area(&b));
    }
}

#[test]
fn bent_meshes_stand_where_their_pose_puts_them() {
    // The one triangle of SimpleMorph: weights 0.5 and 0.5 by default.
    let Some(morph) = feature("SimpleMorph.gltf") else { return };
    let high = |l: &Loaded| l.scene.mesh.bounds().expect("triangles").1.y;
    eprintln!("morph: {:?}", morph.scene.mesh.positions);
    let Some(folder) = folder("features") else { return };
    let at = |name: &str, time: f32| {
        let options = Options { time: Some(time), ..Options::default() };
        load_with(&folder.join(name), &options).unwrap_or_else(|e| panic!("{e}"))
    };
    let tops: Vec<f32> = [0.0, 1.0, 2.0].map(|t| high(&at("SimpleMorph.gltf", t))).to_vec();
    assert!(tops[0] != tops[1] && tops.iter().all(|t| t.is_finite()), "{tops:?}");
    let (rest, bent) = (feature("RiggedSimple.glb").expect("there"), at("RiggedSimple.glb", 1.0));
    let (a, b) = (rest.scene.mesh.bounds().expect("one"), bent.scene.mesh.bounds().expect("one"));
    eprintln!("rigged: {a:?}, bent {b:?}");
    assert!((a.0 - b.0).length() + (a.1 - b.1).length() > 0.1 && rest.scene.mesh.triangles.len() == 188);
}

#[test]
fn variants_and_scenes_are_chosen_by_name() {
    let Some(folder) = folder("features") else { return };
    let file = folder.join("blender-18_variants/18_variants.gltf");
    let plain = load(&file).unwrap_or_else(|e| panic!("{e}"));
    assert!(plain.facts.variants.len() > 1, "{:?}", plain.facts.variants);
    let colors: Vec<_> = plain
        .facts
        .variants
        .iter()
        .map(|name| {
            let options = Options { variant: Some(name.clone()), ..Options::default() };
            let loaded = load_with(&file, &options).unwrap_or_else(|e| panic!("{e}"));
            loaded.scene.mesh.materials[0]
        })
        .collect();
    assert!(colors.windows(2).any(|pair| pair[0] != pair[1]), "{colors:?}");
    for options in [
        Options { variant: Some("none such".into()), ..Options::default() },
        Options { scene: Some("none such".into()), ..Options::default() },
    ] {
        assert!(matches!(load_with(&file, &options), Err(Error::NoSuch { .. })));
    }
}

#[test]
fn all_ways_to_store_a_box_give_one_box() {
    let names = ["Box.glb", "Box-separate/Box.gltf", "Box-embedded.gltf"];
    let Some(first) = feature(names[0]) else { return };
    for name in names {
        let mesh = feature(name).expect("there").scene.mesh;
        assert_eq!(
            (mesh.positions, mesh.triangles),
            (first.scene.mesh.positions.clone(), first.scene.mesh.triangles.clone())
        );
    }
    for (name, textures) in [
        ("box-textured-webp.gltf", 1),
        ("CubeImageUriSpaces/CubeImageUriSpaces.gltf", 1),
        ("BoxTextured.glb", 1),
    ] {
        assert_eq!(feature(name).expect("there").scene.textures.len(), textures, "{name}");
    }
}

#[test]
fn negative_scale_keeps_the_outside_out() {
    let Some(folder) = folder("features") else { return };
    let files = files(&folder.join("asset-generator"));
    let files: Vec<_> = files.iter().filter(|f| f.to_string_lossy().contains("Node_")).collect();
    assert!(!files.is_empty());
    for file in files {
        let mesh = load(file).unwrap_or_else(|e| panic!("{e}")).scene.mesh;
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let face = mesh.geometric_normal(t as u32);
            assert!(triangle.iter().all(|&v| face.dot(mesh.normals[v as usize]) > 0.5), "{}", file.display());
        }
    }
}

#[test]
fn generated_tangents_lie_in_the_surface() {
    let Some(loaded) = feature("NormalTangentTest.glb") else { return };
    let mesh = &loaded.scene.mesh;
    assert_eq!((mesh.tangents.len(), mesh.triangles.len()), (mesh.positions.len(), 7774));
    assert!(mesh.tangents.iter().zip(&mesh.normals).all(|(t, n)| t.truncate().dot(*n).abs() < 1e-3));
}

#[test]
fn texture_transforms_instances_lights_and_cameras_arrive() {
    let Some(loaded) = feature("blender-09_texture_transform/09_texture_transform.gltf") else { return };
    let texture = loaded.scene.materials[0].base_color_texture.expect("a texture");
    // Offset (0.1, 0.2), rotation 0.3, scale (4, 5) of the u axis.
    let u = texture.transform.transform_point2(Vec2::X);
    assert!((u - Vec2::new(0.1 + 4.0 * 0.3f32.cos(), 0.2 - 4.0 * 0.3f32.sin())).length() < 1e-5, "{u}");
    assert!(!loaded.scene.textures[texture.texture as usize].linear);

    let truck = feature("CesiumMilkTruck.glb").expect("there");
    assert_eq!(truck.scene.mesh.triangles.len(), 2856 + 768, "the wheels stand twice");
    assert_eq!(feature("simple-instancing.glb").expect("there").scene.mesh.parts.len(), 125);

    let cameras = feature("Cameras/Cameras.gltf").expect("there").cameras;
    assert!(matches!(cameras[0].projection, Projection::Perspective { .. }));
    assert_eq!(cameras[1].projection, Projection::Orthographic { ymag: 1.0 });

    let room = load(&folder("interiors").expect("beside the features").join("japanese-classroom.glb"));
    let room = room.unwrap_or_else(|e| panic!("{e}"));
    let [sun] = &room.scene.lights[..] else { panic!("one sun") };
    let LightKind::Directional { direction } = sun.kind else { panic!("{:?}", sun.kind) };
    assert!((direction.length() - 1.0).abs() < 1e-6 && direction.y < 0.0 && sun.intensity.luminance() > 0.0);
}
