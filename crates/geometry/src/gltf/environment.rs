//! EXT_lights_image_based: the light around a scene, as six faces of a cube.
//!
//! The faces of the first mip hold radiance in cd/m², JPEG as it is and PNG as RGBD (colour over alpha). The blurred
//! mips and the irradiance coefficients are what a viewer precomputes; we compute both for ourselves.

use glam::{DVec3, Quat};
use rayon::prelude::*;
use serde_json::Value;

use super::document::Document;
use super::error::Error;
use super::textures;
use super::warnings::Warnings;
use crate::texture::{Texture, srgb_decode};
use crate::{Rgb, Sky};

const NAME: &str = "EXT_lights_image_based";

/// Columns of the panorama at most.
const WIDEST: u32 = 4096;
/// Directions averaged for each of its pixels, along both sides.
const FINE: u32 = 3;

/// The sky of scene number `scene`, if it has one and it is usable.
pub(super) fn load(
    document: &mut Document,
    scene: usize,
    warnings: &mut Warnings,
) -> Result<Option<Sky>, Error> {
    let chosen = document.root.scenes.get(scene).and_then(|s| s.extensions.as_ref());
    let Some(user) = chosen.and_then(|e| e.others.get(NAME)) else { return Ok(None) };
    let at = format!("scenes[{scene}].extensions.{NAME}.light");
    let index = user.get("light").unwrap_or(&Value::Null).clone();
    let lights = document.root.extensions.as_ref().and_then(|e| e.others.get(NAME));
    let lights = lights.and_then(|e| e.get("lights")).and_then(Value::as_array);
    let light = index.as_u64().and_then(|i| lights?.get(usize::try_from(i).ok()?)).cloned();
    let Some(light) = light else {
        return Err(document.fault(at, index, "there is no image-based light of this number"));
    };
    let at = format!("extensions.{NAME}.lights[{index}]");
    let intensity = match light.get("intensity") {
        None => 1.0,
        Some(v) => number(v)
            .filter(|v| *v >= 0.0)
            .ok_or_else(|| document.fault(format_args!("{at}.intensity"), v, "not a number of 0 or more"))?,
    };
    let rotation = match light.get("rotation") {
        None => Quat::IDENTITY,
        Some(v) => numbers::<4>(v)
            .and_then(|q| (Quat::from_array(q).length() > 0.0).then(|| Quat::from_array(q).normalize()))
            .ok_or_else(|| document.fault(format_args!("{at}.rotation"), v, "not a quaternion"))?,
    };
    let faces = light.get("specularImages").and_then(|mips| mips.get(0)).and_then(Value::as_array);
    let count = document.root.images.len();
    let face = |v: &Value| v.as_u64().and_then(|i| usize::try_from(i).ok()).filter(|i| *i < count);
    let faces: Option<Vec<usize>> = faces.filter(|f| f.len() == 6).and_then(|f| f.iter().map(face).collect());
    let Some(faces) = faces else {
        let value = light.get("specularImages").map_or("nothing", |_| "a list");
        return Err(document.fault(format_args!("{at}.specularImages"), value, "no six images of a cube"));
    };
    let Some(images) = textures::images(document, &faces, warnings)? else {
        warnings.say("the light around the scene is left out: a face of its cube is missing");
        return Ok(None);
    };
    if intensity == 0.0 {
        return Ok(None);
    }
    let cube: Vec<Face> = images.iter().map(Face::new).collect();
    let sky = panorama(&cube, rotation);
    Ok(sky.map(|sky| sky.scaled(Rgb::splat(intensity))))
}

fn number(v: &Value) -> Option<f32> {
    v.as_f64().map(|v| v as f32).filter(|v| v.is_finite())
}

fn numbers<const N: usize>(v: &Value) -> Option<[f32; N]> {
    let all: Option<Vec<f32>> = v.as_array()?.iter().map(number).collect();
    all?.try_into().ok()
}

/// One face of the cube: +x, −x, +y, −y, +z, −z in this order, upright as seen from within.
struct Face {
    width: u32,
    height: u32,
    radiance: Vec<Rgb>,
}

impl Face {
    fn new(image: &Texture) -> Face {
        let decode = |&[r, g, b, a]: &[u8; 4]| {
            let [r, g, b] = [r, g, b].map(srgb_decode);
            // Nothing is divided by nothing: an alpha of 0 says as little as one of 1/255.
            Rgb::new(r, g, b) * (255.0 / f32::from(a.max(1)))
        };
        Face { width: image.width, height: image.height, radiance: image.texels.iter().map(decode).collect() }
    }

    /// The texel at (`u`, `v`) in [0, 1], from the top left.
    fn at(&self, u: f64, v: f64) -> Rgb {
        let index = |x: f64, n: u32| ((x * f64::from(n)) as u32).min(n - 1);
        self.radiance[(index(v, self.height) * self.width + index(u, self.width)) as usize]
    }
}

/// Radiance from direction `d`, in the cube's own space.
fn look_up(cube: &[Face], d: DVec3) -> Rgb {
    let a = d.abs();
    let (face, across, down, depth) = if a.x >= a.y && a.x >= a.z {
        if d.x > 0.0 { (0, d.z, -d.y, a.x) } else { (1, -d.z, -d.y, a.x) }
    } else if a.y >= a.z {
        if d.y > 0.0 { (2, -d.x, d.z, a.y) } else { (3, -d.x, -d.z, a.y) }
    } else if d.z > 0.0 {
        (4, -d.x, -d.y, a.z)
    } else {
        (5, d.x, -d.y, a.z)
    };
    cube[face].at(0.5 + 0.5 * across / depth, 0.5 + 0.5 * down / depth)
}

/// The cube, turned by `rotation`, as a panorama ([`Sky::image`]).
fn panorama(cube: &[Face], rotation: Quat) -> Option<Sky> {
    let size = cube.iter().map(|f| f.width.max(f.height)).max()?;
    let width = size.saturating_mul(4).clamp(16, WIDEST);
    let height = width / 2;
    let back = rotation.inverse().as_dquat();
    let pixel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let mut sum = Rgb::BLACK;
        for k in 0..FINE * FINE {
            let within = |part: u32| (f64::from(part) + 0.5) / f64::from(FINE);
            let u = (f64::from(x) + within(k % FINE)) / f64::from(width);
            let v = (f64::from(y) + within(k / FINE)) / f64::from(height);
            let ((sin_p, cos_p), (sin_t, cos_t)) =
                ((std::f64::consts::TAU * u).sin_cos(), (std::f64::consts::PI * v).sin_cos());
            sum += look_up(cube, back * DVec3::new(-cos_p * sin_t, cos_t, -sin_p * sin_t));
        }
        sum / (FINE * FINE) as f32
    };
    Sky::image(width, height, (0..width * height).into_par_iter().map(pixel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::texture::Wrap;

    const FACES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

    /// A cube whose faces are 8 × 8, each of one colour; the left half of each is darker by half.
    fn cube() -> Vec<Face> {
        let level = |f: usize| 1.0 + f as f32;
        let half = |f: usize| move |i: u32| Rgb::splat(if i % 8 < 4 { 0.5 * level(f) } else { level(f) });
        (0..6).map(|f| Face { width: 8, height: 8, radiance: (0..64).map(half(f)).collect() }).collect()
    }

    #[test]
    fn faces_lie_where_they_should_and_are_seen_upright() {
        let sky = panorama(&cube(), Quat::IDENTITY).expect("a sky");
        for (f, toward) in FACES.into_iter().enumerate() {
            // Of the side faces, what lies to the right as one looks at them with +y up.
            if toward.y == 0.0 {
                let right = toward.cross(Vec3::Y);
                let see = |d: Vec3| sky.radiance(d.normalize()).g;
                assert!((see(toward + 0.4 * right) - (1.0 + f as f32)).abs() < 1e-3, "face {f}, right");
                assert!((see(toward - 0.4 * right) - 0.5 * (1.0 + f as f32)).abs() < 1e-3, "face {f}, left");
            }
        }
        // Looking up with the back of the head to +z, −x is to the left as in a face seen upright: +x is darker.
        let up = |x: f32| sky.radiance(Vec3::new(x, 1.0, 0.1).normalize()).g;
        assert!((up(-0.4) - 3.0).abs() < 1e-3 && (up(0.4) - 1.5).abs() < 1e-3);
        // Σ over six equal faces, halves of them halved: 21 · 3/4 / 6.
        assert!((sky.mean().g / (21.0 * 0.75 / 6.0) - 1.0).abs() < 5e-3, "{:?}", sky.mean());
    }

    #[test]
    fn a_rotation_turns_the_light() {
        let sky = panorama(&cube(), Quat::from_rotation_y(std::f32::consts::FRAC_PI_2)).expect("a sky");
        // What was seen along +z is now along +x, upright: its right half to the right.
        for (z, level) in [(0.4, 5.0), (-0.4, 2.5)] {
            assert!((sky.radiance(Vec3::new(1.0, 0.3, z).normalize()).g - level).abs() < 1e-3, "{z}");
        }
    }

    #[test]
    fn colours_are_divided_by_alpha() {
        let texels = vec![[255, 0, 255, 51], [128, 255, 0, 0]];
        let (wrap_s, wrap_t) = (Wrap::ClampToEdge, Wrap::ClampToEdge);
        let image =
            Texture { name: String::new(), width: 2, height: 1, texels, wrap_s, wrap_t, linear: true };
        let face = Face::new(&image);
        assert_eq!(face.radiance[0], Rgb::new(5.0, 0.0, 5.0));
        assert!((face.at(0.9, 0.5).g - 255.0).abs() < 1e-3 && face.at(1.0, 1.0).is_finite());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let scene = |light: &str| {
            let json = format!(
                r#""images":[{{"uri":"data:,x"}}],"scenes":[{{"nodes":[],"extensions":{{"{NAME}":{{"light":0}}}}}}],
                "extensions":{{"{NAME}":{{"lights":[{light}]}}}}"#
            );
            let mut document = Document::for_test(&json, Vec::new());
            let mut warnings = Warnings::default();
            (load(&mut document, 0, &mut warnings), warnings.into_lines())
        };
        for (light, said) in [
            ("", "scenes[0].extensions.EXT_lights_image_based.light = 0"),
            (r#"{"intensity":-1}"#, "lights[0].intensity = -1"),
            (r#"{"rotation":[0,0,0,0]}"#, "lights[0].rotation"),
            ("{}", "lights[0].specularImages"),
            (r#"{"specularImages":[[0,0,0,0,0,1]]}"#, "lights[0].specularImages"),
        ] {
            let message = scene(light).0.expect_err(light).to_string();
            assert!(message.contains(said), "{message}");
        }
        let (sky, warnings) = scene(r#"{"specularImages":[[0,0,0,0,0,0]]}"#);
        assert!(sky.is_ok_and(|s| s.is_none()) && warnings.concat().contains("light around the scene"));
    }
}
