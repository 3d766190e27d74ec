//! A baked mesh to a `.glb`: nodes, cameras, lamps, and how its numbers are to be read.

use super::materials::{Materials, Written, light_texture};
use super::{Baked, Light, Look, Map, Part, Settings};
use crate::tonemap::{srgb_encode, white_of_exposure};
use geometry::gltf::write::Writer;
use geometry::math::{Mat3, Quat, Vec3};
use geometry::{Camera, LightKind, Projection, Rgb, World};
use serde_json::{Value, json};

/// Why there is no file.
#[derive(Debug, thiserror::Error)]
pub enum DocumentError {
    /// A .glb states its length in 32 bits.
    #[error("the baked scene is larger than the 4 GB that a .glb can hold: allow fewer vertices")]
    TooLarge,
    /// A picture of light could not be put into its file format.
    #[error("the light map could not be written as PNG")]
    Picture,
}

/// What a share of a lit map's texels may exceed its range by: single ones beside a lamp.
const BURNT: f32 = 0.001;

/// The file.
///
/// - `exposure`: EV (ISO 100) that unlit colours are for; lit materials are in cd/m² and know none.
/// - `source`: name of the file that was baked.
pub fn write(
    world: &World,
    cameras: &[Camera],
    baked: &Baked,
    settings: &Settings,
    exposure: f32,
    source: &str,
) -> Result<Vec<u8>, DocumentError> {
    let mut writer = Writer::default();
    let all = settings.light == Light::All;
    let scale = if all { 1.0 / white_of_exposure(exposure) } else { 1.0 };
    let (mut map, mut strength) = (None, 1.0);
    if let Some(texels) = &baked.map {
        if !all {
            strength = brightest(texels);
        }
        let rgba = encode(texels, if all { scale } else { 1.0 / strength });
        let index = light_texture(&mut writer, texels.width, texels.height, &rgba, all);
        map = Some(index.ok_or(DocumentError::Picture)?);
    }
    let mut materials = Materials::new(&world.scene, scale, map, strength);
    let mut known: Vec<Option<(usize, Vec<u8>, Rgb)>> = vec![None; baked.looks.len()];
    for part in &baked.parts {
        let m = part.material as usize;
        let look = baked.looks[m];
        let (material, sets, gain) = known[m].get_or_insert_with(|| {
            let brightest = brightest_of(baked, m as u32);
            let Written { json, uv_sets, gain } =
                materials.write(&world.scene.materials[m], look, brightest, &mut writer);
            (writer.push("materials", json), uv_sets, gain)
        });
        let (material, sets, gain) = (*material, sets.clone(), *gain);
        add(&mut writer, part, look, material, &sets, gain);
    }
    for camera in cameras {
        add_camera(&mut writer, camera, world.diagonal);
    }
    if !all {
        add_lamps(&mut writer, world);
    }
    let asset = json!({
        "version": "2.0",
        "generator": concat!("twolight ", env!("CARGO_PKG_VERSION")),
        "extras": { "twolight": notes(baked, settings, exposure, scale, source) },
    });
    writer.into_glb(asset).ok_or(DocumentError::TooLarge)
}

/// What a reader needs to have physical values back.
fn notes(baked: &Baked, settings: &Settings, exposure: f32, scale: f32, source: &str) -> Value {
    let light = if settings.light == Light::All { "all" } else { "indirect" };
    let mut notes = json!({ "source": source, "light": light, "error_asked": settings.error });
    if settings.light == Light::All {
        notes["exposure_ev"] = json!(exposure);
        notes["scale"] = json!(scale);
        notes["meaning"] = json!(
            "linear colour shown / scale = radiance, cd/m2; COLOR_0 / extras.twolight.gain of the material * pi = irradiance, lx"
        );
    } else {
        notes["meaning"] = match baked.map {
            Some(_) => json!("emissive texture * strength = reflected radiance in cd/m2"),
            None => json!("_IRRADIANCE = irradiance in lx, point, spot and sun lamps' own light left out"),
        };
    }
    if let Some(error) = baked.report.error {
        notes["error_rms"] = json!(error);
    }
    notes
}

/// Brightest light at the vertices of a material, channel by channel, with their own colour, cd/m².
fn brightest_of(baked: &Baked, material: u32) -> Rgb {
    let mut most = Rgb::BLACK;
    for part in baked.parts.iter().filter(|p| p.material == material) {
        for (i, &l) in part.light.iter().enumerate() {
            let [r, g, b, _] = *part.colors.get(i).unwrap_or(&[1.0; 4]);
            most = most.max(l * Rgb::new(r, g, b));
        }
    }
    most
}

/// A part as a node with a mesh.
///
/// - `gain`: what COLOR_0 is for light of 1 cd/m².
fn add(writer: &mut Writer, part: &Part, look: Look, material: usize, sets: &[u8], gain: Rgb) {
    let positions: Vec<[f32; 3]> = part.positions.iter().map(|p| p.to_array()).collect();
    let mut attributes = json!({ "POSITION": writer.floats(&positions, true) });
    let mut coordinates: Vec<Vec<[f32; 2]>> =
        sets.iter().map(|&s| part.uvs[usize::from(s)].iter().map(|v| v.to_array()).collect()).collect();
    if look.takes_light() && !part.map_uvs.is_empty() {
        coordinates.push(part.map_uvs.iter().map(|v| v.to_array()).collect());
    }
    for (i, uvs) in coordinates.iter().enumerate().filter(|(_, uvs)| !uvs.is_empty()) {
        attributes[format!("TEXCOORD_{i}")] = json!(writer.floats(uvs, false));
    }
    let lit = matches!(look, Look::Lit | Look::Kept);
    if lit {
        let normals: Vec<[f32; 3]> = part.normals.iter().map(|n| n.to_array()).collect();
        attributes["NORMAL"] = json!(writer.floats(&normals, false));
    }
    match look {
        Look::Lit if !part.light.is_empty() => {
            let lx = |&l: &Rgb| (l * std::f32::consts::PI).to_array();
            let irradiance: Vec<[f32; 3]> = part.light.iter().map(lx).collect();
            attributes["_IRRADIANCE"] = json!(writer.floats(&irradiance, false));
        }
        Look::Reflecting | Look::Glowing if !part.light.is_empty() => {
            let color = |(i, &l): (usize, &Rgb)| {
                let tint = if look == Look::Reflecting { part.colors.get(i) } else { None };
                let [r, g, b, a] = *tint.unwrap_or(&[1.0; 4]);
                let c = l * gain * Rgb::new(r, g, b);
                [c.r, c.g, c.b, a]
            };
            let colors: Vec<[f32; 4]> = part.light.iter().enumerate().map(color).collect();
            attributes["COLOR_0"] = json!(writer.colors(&colors));
        }
        _ => {}
    }
    if matches!(look, Look::Kept | Look::Lit) && !part.colors.is_empty() {
        attributes["COLOR_0"] = json!(writer.colors(&part.colors));
    }
    let indices = writer.indices(&part.triangles, part.positions.len());
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
    let mesh = writer.push("meshes", json!({ "name": part.name, "primitives": [primitive] }));
    writer.push("nodes", json!({ "name": part.name, "mesh": mesh }));
}

fn add_camera(writer: &mut Writer, camera: &Camera, diagonal: f32) {
    let lens = match camera.projection {
        Projection::Perspective { yfov } => {
            let mut lens =
                json!({ "yfov": yfov, "znear": if camera.near > 0.0 { camera.near } else { 0.01 } });
            if let Some(aspect) = camera.aspect {
                lens["aspectRatio"] = json!(aspect);
            }
            json!({ "name": camera.name, "type": "perspective", "perspective": lens })
        }
        Projection::Orthographic { ymag } => {
            let xmag = ymag * camera.aspect.unwrap_or(1.0);
            let far = camera.near + 10.0 * diagonal.max(1.0);
            let lens = json!({ "xmag": xmag, "ymag": ymag, "znear": camera.near, "zfar": far });
            json!({ "name": camera.name, "type": "orthographic", "orthographic": lens })
        }
    };
    let index = writer.push("cameras", lens);
    let (_, rotation, translation) = camera.to_world.to_scale_rotation_translation();
    writer.push(
        "nodes",
        json!({
            "name": camera.name,
            "camera": index,
            "rotation": rotation.normalize().to_array(),
            "translation": translation.to_array(),
        }),
    );
}

/// The lamps that a viewer lights the scene with.
fn add_lamps(writer: &mut Writer, world: &World) {
    let (mut lamps, mut measured) = (Vec::new(), Vec::new());
    for light in &world.scene.lights {
        let strength = light.intensity.max_channel();
        if strength <= 0.0 {
            continue;
        }
        let mut json = json!({
            "name": light.name,
            "color": (light.intensity / strength).to_array(),
            "intensity": strength,
        });
        let (kind, place, along, range) = match &light.kind {
            LightKind::Photometric { position, turn, web, .. } => {
                let text: String = web.to_lm63().replace(' ', "%20").replace('\n', "%0A");
                let rotation = Quat::from_mat3(&(turn.transpose() * web.frame())).normalize();
                let instance = json!({
                    "light": measured.len(),
                    "multiplier": strength / web.peak(),
                    "color": (light.intensity / strength).to_array(),
                });
                measured.push(json!({ "uri": format!("data:application/x-ies-lm-63,{text}") }));
                writer.push(
                    "nodes",
                    json!({
                        "name": light.name,
                        "translation": position.to_array(),
                        "rotation": rotation.to_array(),
                        "extensions": { "EXT_lights_ies": instance },
                    }),
                );
                continue;
            }
            LightKind::Point { position, range } => ("point", *position, Vec3::NEG_Z, *range),
            LightKind::Directional { direction } => ("directional", Vec3::ZERO, *direction, f32::INFINITY),
            LightKind::Spot { position, direction, cos_inner, cos_outer, range } => {
                let [inner, outer] = [*cos_inner, *cos_outer].map(|c| c.clamp(0.0, 1.0).acos());
                json["spot"] =
                    json!({ "innerConeAngle": inner.min(outer - 1e-4).max(0.0), "outerConeAngle": outer });
                ("spot", *position, *direction, *range)
            }
        };
        json["type"] = json!(kind);
        if range.is_finite() {
            json["range"] = json!(range);
        }
        let (x, y) = geometry::math::frame(-along);
        let rotation = Quat::from_mat3(&Mat3::from_cols(x, y, -along)).normalize();
        let reference = json!({ "KHR_lights_punctual": { "light": lamps.len() } });
        lamps.push(json);
        writer.push(
            "nodes",
            json!({
                "name": light.name,
                "translation": place.to_array(),
                "rotation": rotation.to_array(),
                "extensions": reference,
            }),
        );
    }
    if !lamps.is_empty() {
        writer.uses("KHR_lights_punctual");
        writer.extensions.insert("KHR_lights_punctual".into(), json!({ "lights": lamps }));
    }
    if !measured.is_empty() {
        writer.uses("EXT_lights_ies");
        writer.extensions.insert("EXT_lights_ies".into(), json!({ "lights": measured }));
    }
}

/// Brightest channel of a map, but for a thousandth of its texels; above 0.
fn brightest(map: &Map) -> f32 {
    let mut peaks: Vec<f32> =
        map.texels.iter().map(|t| t.max_channel()).filter(|p| p.is_finite() && *p > 0.0).collect();
    if peaks.is_empty() {
        return 1.0;
    }
    let at = ((1.0 - BURNT) * (peaks.len() - 1) as f32) as usize;
    *peaks.select_nth_unstable_by(at, f32::total_cmp).1
}

/// sRGB bytes of light times `scale`, and linear alpha.
fn encode(map: &Map, scale: f32) -> Vec<[u8; 4]> {
    let byte = |v: f32| (255.0 * srgb_encode(v.clamp(0.0, 1.0)) + 0.5) as u8;
    let texel = |(&light, &alpha): (&Rgb, &f32)| {
        let [r, g, b] = (light * scale).to_array().map(byte);
        [r, g, b, (255.0 * alpha.clamp(0.0, 1.0) + 0.5) as u8]
    };
    map.texels.iter().zip(&map.alpha).map(texel).collect()
}
