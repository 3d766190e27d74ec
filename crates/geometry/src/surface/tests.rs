//! Surfaces of a single triangle.

use super::*;
use crate::bsdf::Shading;
use crate::math::{Affine2, Vec2, Vec4};
use crate::texture::{Texture, Wrap};
use crate::{AlphaMode, Material, Mesh, Part, TextureRef};

/// One triangle in the plane z = 0, front toward +z, of the given material.
fn scene(material: Material) -> Scene {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = Mesh {
        normals: vec![Vec3::Z; 3],
        uvs: [vec![Vec2::ZERO; 3], vec![]],
        positions,
        triangles: vec![[0, 1, 2]],
        materials: vec![MaterialId(0)],
        parts: vec![Part { name: "t".into(), first: 0, count: 1, source: None }],
        ..Mesh::default()
    };
    Scene { mesh, materials: vec![material], ..Scene::default() }
}

/// The hit at (0.25, 0.25, 0) of a ray that travels along `direction`.
fn meet(direction: Vec3) -> (Ray, Hit) {
    let (target, d) = (Vec3::new(0.25, 0.25, 0.0), direction.normalize());
    (Ray::new(target - d * 2.0, d), Hit { t: 2.0, triangle: 0, u: target.x, v: target.y })
}

fn surface(scene: &Scene, direction: Vec3) -> Surface {
    let (ray, hit) = meet(direction);
    Surface::new(scene, &ray, &hit)
}

#[test]
fn the_ray_decides_the_side() {
    let scene = scene(Material { emissive: Rgb::splat(3.0), ..Material::default() });
    let above = surface(&scene, Vec3::new(0.3, 0.0, -1.0));
    assert!(above.front && above.ng == Vec3::Z && above.ns == Vec3::Z && above.smooth == Vec3::Z);
    assert_eq!(above.emission, Rgb::splat(3.0));
    assert!((above.position - Vec3::new(0.25, 0.25, 0.0)).length() < 1e-7);
    let below = surface(&scene, Vec3::new(0.3, 0.0, 1.0));
    assert!(!below.front && below.ng == -Vec3::Z && below.ns == -Vec3::Z);
    assert_eq!(below.emission, Rgb::BLACK);
}

#[test]
fn emission_of_a_double_sided_lamp_leaves_both_sides_and_unlit_is_apart() {
    let mut scene = scene(Material { emissive: Rgb::WHITE, double_sided: true, ..Material::default() });
    assert_eq!(surface(&scene, Vec3::Z).emission, Rgb::WHITE);
    scene.materials[0].unlit = true;
    scene.materials[0].base_color = Rgb::new(0.2, 0.4, 0.6);
    let s = surface(&scene, Vec3::Z);
    assert_eq!(s.unlit, Some(Rgb::new(0.2, 0.4, 0.6)));
    assert!(s.emission.is_black() && !s.bsdf.has_diffuse() && !s.bsdf.has_specular());
}

#[test]
fn a_shading_normal_never_faces_away_from_viewer_or_triangle() {
    let mut scene = scene(Material::default());
    for n in [Vec3::new(0.9, 0.0, 0.1), Vec3::new(-1.0, 0.0, 1e-4), Vec3::new(0.0, 0.0, -1.0)] {
        scene.mesh.normals = vec![n.normalize(); 3];
        for d in [Vec3::new(1.0, 0.0, -0.01), Vec3::new(-1.0, 0.2, 0.05), Vec3::NEG_Z, Vec3::Z] {
            let s = surface(&scene, d);
            assert!(s.ns.dot(-d.normalize()) > 0.0 && s.ns.dot(s.ng) > 0.0 && s.smooth.dot(s.ng) >= 0.0);
            assert!((s.ns.length() - 1.0).abs() < 1e-5);
        }
    }
}

#[test]
fn alpha_means_what_its_mode_says() {
    let mut scene = scene(Material { alpha: 0.3, ..Material::default() });
    scene.mesh.colors = vec![Vec4::new(0.5, 1.0, 1.0, 0.5); 3];
    let (ray, hit) = meet(Vec3::NEG_Z);
    for (mode, coverage) in [
        (AlphaMode::Opaque, 1.0),
        (AlphaMode::Mask(0.1), 1.0),
        (AlphaMode::Mask(0.2), 0.0),
        (AlphaMode::Blend, 0.15),
    ] {
        scene.materials[0].alpha_mode = mode;
        assert!((coverage_at(&scene, &hit) - coverage).abs() < 1e-6, "{mode:?}");
        assert_eq!(Surface::new(&scene, &ray, &hit).coverage, coverage_at(&scene, &hit));
        let through = straight_through(&scene, &ray, &hit).r;
        assert!((through - (1.0 - coverage)).abs() < 1e-6, "{mode:?}");
    }
    assert_eq!(shading_at(&scene, 0, 0.2, 0.2).base_color, Rgb::new(0.5, 1.0, 1.0));
}

#[test]
fn a_window_lets_through_what_its_delta_lobe_says() {
    let glass = Material {
        base_color: Rgb::new(0.8, 0.9, 1.0),
        metallic: 0.1,
        roughness: 0.0,
        transmission: 0.75,
        ..Material::default()
    };
    let mut scene = scene(glass);
    for d in [Vec3::NEG_Z, Vec3::new(1.0, 0.0, -0.4), Vec3::new(0.2, 0.3, 0.9)] {
        let (ray, hit) = meet(d);
        let s = Surface::new(&scene, &ray, &hit);
        let passed = s.bsdf.delta_lobes(-ray.direction)[1].expect("the window lets light through");
        assert!(passed.straight && (passed.wi - ray.direction).length() < 1e-6);
        let through = straight_through(&scene, &ray, &hit);
        assert!((through - passed.weight).max_channel().abs() < 1e-6);
        assert!(through.b > 0.3 && through.r < through.b);
    }
    // A rough window scatters, a solid one refracts; one with the index of air does neither.
    let (ray, hit) = meet(Vec3::new(0.5, 0.0, -1.0));
    scene.materials[0].roughness = 0.3;
    assert!(!scene.materials[0].may_pass_straight());
    scene.materials[0].volume =
        Some(Volume { attenuation_color: Rgb::WHITE, attenuation_distance: f32::INFINITY });
    assert_eq!(straight_through(&scene, &ray, &hit), Rgb::BLACK);
    scene.materials[0].ior = 1.0;
    assert!((straight_through(&scene, &ray, &hit).b - 0.9 * 0.75).abs() < 1e-5);
}

#[test]
fn the_inside_of_a_volume_is_behind_its_front() {
    let volume = Volume { attenuation_color: Rgb::splat(0.5), attenuation_distance: 1.0 };
    let scene = scene(Material {
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        volume: Some(volume),
        ..Material::default()
    });
    let (outside, inside) = (surface(&scene, Vec3::NEG_Z), surface(&scene, Vec3::Z));
    assert_eq!((outside.before, outside.beyond), (None, Some(volume)));
    assert_eq!((inside.before, inside.beyond), (Some(volume), None));
    assert!(!scene.materials[0].may_pass_straight() && scene.materials[0].has_specular(0.5));
}

#[test]
fn questions_about_materials() {
    let lambert = Material { metallic: 0.0, specular: 0.0, ..Material::default() };
    assert!(!lambert.has_specular(0.0) && !lambert.is_emissive() && !lambert.may_pass_straight());
    let plastic = Material { metallic: 0.0, ..Material::default() };
    assert!(plastic.has_specular(0.03) && !plastic.has_specular(0.05));
    assert!(Material::default().has_specular(0.5));
}

/// A texture of one texel, and how a material names it.
fn texel(value: [u8; 4]) -> (Texture, Option<TextureRef>) {
    let wrap = Wrap::Repeat;
    let name = "one".into();
    let texture =
        Texture { name, width: 1, height: 1, texels: vec![value], wrap_s: wrap, wrap_t: wrap, linear: false };
    (texture, Some(TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY }))
}

#[test]
fn textures_multiply_their_factors_each_in_its_channel() {
    let (texture, reference) = texel([255, 128, 64, 51]);
    let mut scene = scene(Material {
        base_color: Rgb::new(0.5, 1.0, 1.0),
        base_color_texture: reference,
        metallic_roughness_texture: reference,
        specular_texture: reference,
        transmission: 0.5,
        transmission_texture: reference,
        alpha_mode: AlphaMode::Blend,
        ..Material::default()
    });
    scene.textures = vec![texture];
    let s = shading_at(&scene, 0, 0.2, 0.2);
    // sRGB 128 is 0.2159 linear (IEC 61966-2-1), linear 128 is 0.502.
    assert!((s.base_color.r - 0.5).abs() < 1e-4 && (s.base_color.g - 0.2159).abs() < 1e-3, "{s:?}");
    assert!((s.roughness - 0.502).abs() < 1e-3 && (s.metallic - 0.251).abs() < 1e-3, "{s:?}");
    assert!((s.specular - 0.2).abs() < 1e-3 && (s.transmission - 0.5).abs() < 1e-4, "{s:?}");
    assert!((surface(&scene, Vec3::NEG_Z).coverage - 0.2).abs() < 1e-3);
    // A texture that is not there is none.
    scene.textures.clear();
    assert_eq!(shading_at(&scene, 0, 0.2, 0.2).base_color, Rgb::new(0.5, 1.0, 1.0));
}

#[test]
fn a_normal_map_leans_along_the_tangent_on_either_side() {
    // x = 0.6 and z = 0.8, encoded as (1 + x)/2.
    let (texture, reference) = texel([204, 128, 230, 255]);
    let mut scene = scene(Material { normal_texture: reference, ..Material::default() });
    scene.textures = vec![texture];
    scene.mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3];
    let front = surface(&scene, Vec3::NEG_Z);
    assert!((front.ns - Vec3::new(0.6, 0.0, 0.8)).length() < 1e-2, "{}", front.ns);
    assert_eq!(front.smooth, Vec3::Z);
    // Seen from behind it is the same relief from behind.
    assert!((surface(&scene, Vec3::Z).ns + front.ns).length() < 1e-6);
    scene.materials[0].normal_scale = 0.0;
    assert!((surface(&scene, Vec3::NEG_Z).ns - Vec3::Z).length() < 1e-6);
}

fn shading_at(scene: &Scene, triangle: u32, u: f32, v: f32) -> Shading {
    let point = Point::new(scene, triangle, u, v);
    point.shading(point.base_color().0)
}
