//! EXT_lights_ies: lamps as their makers measured them.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use gltf::json;
use serde_json::Value;

use super::document::Document;
use super::error::{Error, chain};
use super::nodes::Placed;
use super::warnings::Warnings;
use crate::Rgb;
use crate::ies::{self, Web};
use crate::math::Mat3;
use crate::scene::{Light, LightKind};

const NAME: &str = "EXT_lights_ies";

/// The file's photometric webs; `None` for one that cannot be had, which is a warning.
pub(super) fn load(document: &mut Document, warnings: &mut Warnings) -> Result<Vec<Option<Arc<Web>>>, Error> {
    let extension = document.root.extensions.as_ref().and_then(|e| e.others.get(NAME));
    let Some(Value::Array(lights)) = extension.and_then(|e| e.get("lights")).cloned() else {
        return Ok(Vec::new());
    };
    let mut webs = Vec::with_capacity(lights.len());
    for (i, light) in lights.iter().enumerate() {
        let at = format!("extensions.{NAME}.lights[{i}]");
        let web = match bytes(document, &at, light) {
            Ok(bytes) => ies::parse(&bytes).map_err(|fault| document.fault(&at, "its file", fault)),
            Err(limit @ Error::Limit { .. }) => return Err(limit),
            Err(e) => Err(e),
        };
        webs.push(match web {
            Ok(web) => Some(Arc::new(web)),
            Err(e) => {
                warnings.say(format!("lamps are left out: {}", chain(&e)));
                None
            }
        });
    }
    Ok(webs)
}

fn bytes(document: &mut Document, at: &str, light: &Value) -> Result<Vec<u8>, Error> {
    if let Some(uri) = light.get("uri") {
        let uri =
            uri.as_str().ok_or_else(|| document.fault(format_args!("{at}.uri"), uri, "not a string"))?;
        return document.fetch(uri, &format_args!("{at}.uri"));
    }
    let view = light.get("bufferView").unwrap_or(&Value::Null);
    let index = view.as_u64().and_then(|i| u32::try_from(i).ok());
    let index = index.ok_or_else(|| document.fault(at, light, "it has neither uri nor bufferView"))?;
    document.view(json::Index::new(index), &at).map(|(bytes, _)| bytes.to_vec())
}

/// The measured lamp of a node, if it has one and its web is there.
pub(super) fn read(
    document: &Document,
    placed: &Placed,
    webs: &[Option<Arc<Web>>],
    warnings: &mut Warnings,
) -> Result<Option<Light>, Error> {
    let node = &document.root.nodes[placed.node];
    let extension = node.extensions.as_ref().and_then(|e| e.others.get(NAME));
    let Some(extension) = extension else { return Ok(None) };
    let at = format!("nodes[{}].extensions.{NAME}", placed.node);
    let index = extension.get("light").unwrap_or(&Value::Null);
    let i = index.as_u64().and_then(|i| usize::try_from(i).ok()).filter(|i| *i < webs.len());
    let i = i.ok_or_else(|| {
        document.fault(format_args!("{at}.light"), index, "there is no photometric file of this number")
    })?;
    let Some(web) = &webs[i] else { return Ok(None) };
    let number = |key: &str, value: &Value| match value.as_f64().map(|v| v as f32) {
        Some(v) if v.is_finite() && v >= 0.0 => Ok(v),
        _ => Err(document.fault(format_args!("{at}.{key}"), value, "not a number of 0 or more")),
    };
    let multiplier = extension.get("multiplier").map_or(Ok(1.0), |v| number("multiplier", v))?;
    let color = match extension.get("color") {
        None => Rgb::WHITE,
        Some(Value::Array(c)) if c.len() == 3 => {
            Rgb::new(number("color", &c[0])?, number("color", &c[1])?, number("color", &c[2])?)
        }
        Some(other) => return Err(document.fault(format_args!("{at}.color"), other, "not three numbers")),
    };
    let name = node.name.clone().unwrap_or_else(|| format!("lamp {}", placed.node));
    let intensity = color * (multiplier * web.peak());
    match kind(&placed.world, web, f32::INFINITY) {
        Some(kind) if intensity.is_finite() => Ok(Some(Light { name, intensity, kind })),
        _ => {
            warnings
                .say(format!("lamp \"{name}\" is left out: its node or its intensity is beyond all numbers"));
            Ok(None)
        }
    }
}

/// A lamp of that web where `node` puts it: it aims along −z of the node, whose scale does not matter. `None` for a node
/// scaled to nothing.
pub(super) fn kind(node: &DAffine3, web: &Arc<Web>, range: f32) -> Option<LightKind> {
    let position = node.translation.as_vec3();
    let z = node.matrix3.z_axis.try_normalize()?;
    let x = (node.matrix3.x_axis - z * z.dot(node.matrix3.x_axis)).try_normalize().unwrap_or_else(|| {
        let other = if z.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
        (other - z * z.dot(other)).normalize()
    });
    let to_node = Mat3::from_cols(x.as_vec3(), z.cross(x).as_vec3(), z.as_vec3()).transpose();
    let turn = web.frame() * to_node;
    let web = Arc::clone(web);
    (position.is_finite() && turn.is_finite()).then_some(LightKind::Photometric {
        position,
        turn,
        range,
        web,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::nodes::walk;
    use crate::math::Vec3;
    use std::f32::consts::PI;

    /// 100 cd straight ahead, 50 at 90° in the plane of 0°, 25 at 90° in the plane of 90°, nothing behind.
    const WEB: &str = "TILT=NONE\n1 -1 1 2 5 1 2 0 0 0\n1 1 1\n0 90\n0 90 180 270 360\n100 50\n100 25\n100 1\n100 1\n100 50\n";

    fn lamp(node: &str, light: &str) -> (Result<Option<Light>, Error>, Vec<String>) {
        let json = format!(
            r#""extensions":{{"{NAME}":{{"lights":[{light}]}}}},"bufferViews":[{{"buffer":0,"byteLength":{}}}],
            "nodes":[{{"name":"L","translation":[1,2,3],{node}}}]"#,
            WEB.len()
        );
        let mut document = Document::for_test(&json, WEB.as_bytes().to_vec());
        let mut warnings = Warnings::default();
        let webs = load(&mut document, &mut warnings).expect("within limits");
        let placed = walk(&document, None, &Default::default(), &mut warnings).expect("a tree");
        let light = read(&document, &placed[0], &webs, &mut warnings);
        (light, warnings.into_lines())
    }

    const VIEW: &str = r#"{"bufferView":0,"mimeType":"application/x-ies-lm-63"}"#;

    #[test]
    fn a_lamp_hangs_and_turns_with_its_node() {
        // Turned by −90° about x: ahead is down, its +x stays, its +y is what was behind.
        let node = r#""rotation":[-0.70710678,0,0,0.70710678],"scale":[2,2,2],
            "extensions":{"EXT_lights_ies":{"light":0,"multiplier":2,"color":[1,0.5,0]}}"#;
        let (light, warnings) = lamp(node, VIEW);
        let light = light.expect("valid").expect("there");
        assert!(warnings.iter().all(|w| w.starts_with("no scene")), "{warnings:?}");
        assert_eq!(light.intensity, Rgb::new(200.0, 100.0, 0.0));
        for (d, relative) in
            [(Vec3::NEG_Y, 1.0), (Vec3::X, 0.5), (Vec3::NEG_Z, 0.25), (Vec3::NEG_X, 0.01), (Vec3::Y, 0.0)]
        {
            assert!((light.relative(d) - relative).abs() < 1e-4, "{d}: {}", light.relative(d));
        }
        let (wi, distance, e) = light.reaching(Vec3::new(1.0, -2.0, 3.0)).expect("below it");
        assert_eq!((wi, distance), (Vec3::Y, 4.0));
        assert!((e.r - 200.0 / 16.0).abs() < 1e-4, "I / d²");
        assert!(light.flux(1.0).r > 0.0 && light.flux(1.0).r < 200.0 * 2.0 * PI);
    }

    #[test]
    fn by_uri_too_and_what_cannot_be_used_is_left_out_or_refused() {
        let node = |rest: &str| format!(r#""extensions":{{"EXT_lights_ies":{{{rest}}}}}"#);
        let whole = node(r#""light":0"#);
        let uri = format!(r#"{{"uri":"data:application/x-ies-lm-63,{}"}}"#, WEB.replace('\n', "%0A"));
        assert!(lamp(&whole, &uri).0.is_ok_and(|light| light.is_some()));
        for broken in [r#"{"uri":"data:,TILT=NONE"}"#, r#"{"uri":"../a.ies"}"#, "{}", r#"{"bufferView":7}"#] {
            let (light, warnings) = lamp(&whole, broken);
            assert!(light.is_ok_and(|l| l.is_none()), "{broken}");
            assert!(warnings.concat().contains("extensions.EXT_lights_ies.lights[0]"), "{warnings:?}");
        }
        for (wrong, said) in [
            (r#""light":1"#, "nodes[0].extensions.EXT_lights_ies.light = 1"),
            (r#""light":"a""#, "EXT_lights_ies.light"),
            (r#""light":0,"multiplier":-2"#, "EXT_lights_ies.multiplier = -2"),
            (r#""light":0,"color":[1,2]"#, "EXT_lights_ies.color"),
        ] {
            let message = lamp(&node(wrong), VIEW).0.expect_err(wrong).to_string();
            assert!(message.contains(said), "{message}");
        }
    }
}
