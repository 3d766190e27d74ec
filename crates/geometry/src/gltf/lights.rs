//! KHR_lights_punctual: lamps without extent, placed by their nodes.

use std::sync::Arc;

use gltf::json;
use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::validation::Checked;

use super::document::Document;
use super::error::Error;
use super::nodes::Placed;
use super::profiles;
use super::warnings::Warnings;
use crate::Rgb;
use crate::ies::Web;
use crate::scene::{Light, LightKind};

/// The lamp of a node, if it has one and it is usable.
pub(super) fn read(
    document: &Document,
    placed: &Placed,
    webs: &[(String, Arc<Web>)],
    warnings: &mut Warnings,
) -> Result<Option<Light>, Error> {
    let node = &document.root.nodes[placed.node];
    let reference = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let Some(i) = reference.map(|r| r.light.value()) else { return Ok(None) };
    let lights = document.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let light = lights.and_then(|list| list.lights.get(i)).ok_or_else(|| {
        let at = format_args!("nodes[{}].extensions.KHR_lights_punctual.light", placed.node).to_string();
        document.fault(at, i, "there is no light of this number")
    })?;
    let name = node.name.clone().or_else(|| light.name.clone()).unwrap_or_else(|| format!("light {i}"));
    match kind(light, placed, &name, warnings) {
        Ok(kind) => {
            let plain = Light { intensity: Rgb::from(light.color) * light.intensity, name, kind };
            let web = webs.iter().rev().find(|(name, _)| *name == plain.name);
            Ok(Some(web.and_then(|(_, web)| measured(&plain, placed, web)).unwrap_or(plain)))
        }
        Err(problem) => {
            warnings.say(format!("light \"{name}\" is left out: {problem}"));
            Ok(None)
        }
    }
}

/// `light` as its maker measured it: its colour and reach, the web's candela. `None` for a sun, which has none.
fn measured(light: &Light, placed: &Placed, web: &Arc<Web>) -> Option<Light> {
    let range = match light.kind {
        LightKind::Point { range, .. } | LightKind::Spot { range, .. } => range,
        _ => return None,
    };
    let level = light.intensity.luminance();
    let color = if level > 0.0 { light.intensity / level } else { Rgb::WHITE };
    let kind = profiles::kind(&placed.world, web, range)?;
    Some(Light { name: light.name.clone(), intensity: color * web.peak(), kind })
}

fn kind(
    light: &json::extensions::scene::khr_lights_punctual::Light,
    placed: &Placed,
    name: &str,
    warnings: &mut Warnings,
) -> Result<LightKind, String> {
    let power = Rgb::from(light.color) * light.intensity;
    if !power.is_finite() || power.min_channel() < 0.0 {
        return Err(format!("its intensity times colour is {:?}", power.to_array()));
    }
    let position = placed.world.translation.as_vec3();
    if !position.is_finite() {
        return Err(format!("it stands at {position}"));
    }
    let range = match light.range {
        Some(range) if range > 0.0 => range,
        None => f32::INFINITY,
        Some(range) => {
            warnings.say(format!("light \"{name}\": range = {range} is taken as endless"));
            f32::INFINITY
        }
    };
    // Lamps shine along −z of their node; its scale does not matter (KHR_lights_punctual).
    let direction = || {
        let axis = (-placed.world.matrix3.z_axis).try_normalize().map(|d| d.as_vec3());
        axis.ok_or_else(|| "its node is scaled to nothing".to_string())
    };
    match light.type_ {
        Checked::Valid(Type::Point) => Ok(LightKind::Point { position, range }),
        Checked::Valid(Type::Directional) => Ok(LightKind::Directional { direction: direction()? }),
        Checked::Valid(Type::Spot) => {
            let spot = light.spot.as_ref().ok_or("a spot without its cone")?;
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            let right = std::f32::consts::FRAC_PI_2;
            if !(outer > 0.0 && inner.is_finite() && outer.is_finite()) {
                return Err(format!("its cone has the angles {inner} and {outer}"));
            }
            if !(0.0 <= inner && inner <= outer && outer <= right) {
                warnings.say(format!("light \"{name}\": cone angles {inner} and {outer} are clamped"));
            }
            let outer = outer.min(right);
            let inner = inner.clamp(0.0, outer);
            let direction = direction()?;
            Ok(LightKind::Spot { position, direction, cos_inner: inner.cos(), cos_outer: outer.cos(), range })
        }
        Checked::Invalid => Err("its type is none of point, spot, directional".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::nodes::walk;
    use crate::math::Vec3;

    fn light(light: &str) -> (Option<Light>, Vec<String>) {
        light_with(light, &[])
    }

    fn light_with(light: &str, webs: &[(String, Arc<Web>)]) -> (Option<Light>, Vec<String>) {
        let json = format!(
            r#""extensions":{{"KHR_lights_punctual":{{"lights":[{{{light}}}]}}}},"nodes":[{{"name":"L",
            "translation":[1,2,3],"rotation":[-0.70710678,0,0,0.70710678],"scale":[2,2,2],
            "extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}]"#
        );
        let document = Document::for_test(&json, Vec::new());
        let placed = walk(&document, None, &Default::default(), &mut Warnings::default()).expect("a tree");
        let mut warnings = Warnings::default();
        let light = read(&document, &placed[0], webs, &mut warnings).expect("valid");
        (light, warnings.into_lines())
    }

    #[test]
    fn the_three_kinds_stand_where_their_node_puts_them() {
        let (point, _) = light(r#""type":"point","intensity":100,"color":[1,0.5,0],"range":7"#);
        let point = point.expect("usable");
        assert_eq!(point.intensity, Rgb::new(100.0, 50.0, 0.0));
        assert_eq!(point.kind, LightKind::Point { position: Vec3::new(1.0, 2.0, 3.0), range: 7.0 });
        let (sun, _) = light(r#""type":"directional""#);
        let LightKind::Directional { direction } = sun.expect("usable").kind else { panic!("a sun") };
        assert!((direction - Vec3::NEG_Y).length() < 1e-6, "{direction}");
        let (spot, _) = light(r#""type":"spot","spot":{"outerConeAngle":1.0471976}"#);
        let LightKind::Spot { cos_inner, cos_outer, range, .. } = spot.expect("usable").kind else {
            panic!("a spot")
        };
        assert!(cos_inner == 1.0 && (cos_outer - 0.5).abs() < 1e-6 && range == f32::INFINITY);
    }

    #[test]
    fn a_photometric_file_takes_the_place_of_an_intensity() {
        let file = "TILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n300 0";
        let webs = [("L".to_owned(), Arc::new(crate::ies::parse(file.as_bytes()).expect("a web")))];
        let (lamp, _) = light_with(r#""type":"point","intensity":5,"color":[1,0.5,0],"range":7"#, &webs);
        let lamp = lamp.expect("usable");
        assert!(
            (lamp.intensity.luminance() - 300.0).abs() < 1e-3 && lamp.intensity.g == 0.5 * lamp.intensity.r
        );
        assert!(matches!(lamp.kind, LightKind::Photometric { range: 7.0, .. }));
        assert!((lamp.relative(Vec3::NEG_Y) - 1.0).abs() < 1e-4 && lamp.relative(Vec3::Y) == 0.0);
        let (other, _) = light_with(r#""type":"point""#, &[("M".to_owned(), Arc::clone(&webs[0].1))]);
        assert!(matches!(other.expect("usable").kind, LightKind::Point { .. }));
        let (sun, _) = light_with(r#""type":"directional""#, &webs);
        assert!(matches!(sun.expect("usable").kind, LightKind::Directional { .. }));
    }

    #[test]
    fn lamps_that_make_no_sense_are_left_out_with_a_warning() {
        for bad in [
            r#""type":"point","intensity":-1"#,
            r#""type":"point","intensity":1e39"#,
            r#""type":"point","color":[-1,0,0]"#,
            r#""type":"star""#,
            r#""type":"spot""#,
            r#""type":"spot","spot":{"outerConeAngle":0}"#,
        ] {
            let (light, warnings) = light(bad);
            assert!(light.is_none() && warnings.len() == 1, "{bad}");
        }
    }
}
