//! Cameras of the file, placed by their nodes.

use glam::DVec3;
use gltf::json;

use super::document::Document;
use super::error::Error;
use super::nodes::Placed;
use super::warnings::Warnings;
use crate::camera::{Camera, Projection};
use crate::math::Mat4;

/// The camera of a node, if it has one and it is usable.
pub(super) fn read(
    document: &Document,
    placed: &Placed,
    warnings: &mut Warnings,
) -> Result<Option<Camera>, Error> {
    let node = &document.root.nodes[placed.node];
    let Some(index) = node.camera else { return Ok(None) };
    let i = index.value();
    let camera = document.root.cameras.get(i).ok_or_else(|| {
        document.fault(format_args!("nodes[{}].camera", placed.node), i, "there is no camera of this number")
    })?;
    let name = node.name.clone().or_else(|| camera.name.clone()).unwrap_or_else(|| format!("camera {i}"));
    let Some(to_world) = rigid(placed) else {
        warnings.say(format!("camera \"{name}\" is left out: its node is scaled to nothing"));
        return Ok(None);
    };
    let Some((projection, near, aspect)) = projection(document, camera, i)? else {
        warnings.say(format!("camera \"{name}\" is left out: cameras[{i}] has no usable projection"));
        return Ok(None);
    };
    if near < 0.0 {
        warnings.say(format!("camera \"{name}\": znear = {near} is taken as 0"));
    }
    Ok(Some(Camera { name, to_world, projection, near: near.max(0.0), aspect }))
}

/// What the lens does, nearest distance, aspect; none where the numbers show nothing.
fn projection(
    document: &Document,
    camera: &json::Camera,
    i: usize,
) -> Result<Option<(Projection, f32, Option<f32>)>, Error> {
    let finite = |member: &str, v: f32| {
        if v.is_finite() {
            Ok(v)
        } else {
            Err(document.fault(format_args!("cameras[{i}].{member}"), v, "not finite"))
        }
    };
    if let Some(lens) = &camera.perspective {
        let yfov = finite("perspective.yfov", lens.yfov)?;
        let near = finite("perspective.znear", lens.znear)?;
        let aspect = lens.aspect_ratio.filter(|a| a.is_finite() && *a > 0.0);
        let usable = yfov > 0.0 && yfov < std::f32::consts::PI;
        return Ok(usable.then_some((Projection::Perspective { yfov }, near, aspect)));
    }
    let Some(lens) = &camera.orthographic else { return Ok(None) };
    // Negative magnifications mirror in some viewers; glTF 2.0, 3.10.3.2, advises against them.
    let xmag = finite("orthographic.xmag", lens.xmag)?.abs();
    let ymag = finite("orthographic.ymag", lens.ymag)?.abs();
    let near = finite("orthographic.znear", lens.znear)?;
    let aspect = (xmag > 0.0 && ymag > 0.0).then(|| xmag / ymag);
    Ok((ymag > 0.0).then_some((Projection::Orthographic { ymag }, near, aspect)))
}

/// The node's transform without scale, shear and mirror: the view axis stays, up is made square to it.
fn rigid(placed: &Placed) -> Option<Mat4> {
    let m = placed.world.matrix3;
    let back = m.z_axis.try_normalize()?;
    let up = (m.y_axis - back * m.y_axis.dot(back)).try_normalize()?;
    let right = up.cross(back);
    let column = |v: DVec3, w: f32| v.as_vec3().extend(w);
    let at = placed.world.translation;
    let to_world = Mat4::from_cols(column(right, 0.0), column(up, 0.0), column(back, 0.0), column(at, 1.0));
    to_world.is_finite().then_some(to_world)
}

/// Makes the names differ, so that `--camera` can tell: a second "Camera" becomes "Camera 2".
pub(super) fn make_names_differ(cameras: &mut [Camera]) {
    for i in 1..cameras.len() {
        let (before, this) = cameras.split_at_mut(i);
        let taken = |name: &str| before.iter().any(|c| c.name == name);
        if taken(&this[0].name) {
            let free = (2..).map(|n| format!("{} {n}", this[0].name)).find(|name| !taken(name));
            this[0].name = free.unwrap_or_default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::nodes::walk;
    use crate::math::Vec3;

    fn cameras(node: &str, camera: &str) -> Result<(Vec<Camera>, Vec<String>), Error> {
        let json = format!(r#""nodes":[{{"camera":0{node}}}],"cameras":[{camera}]"#);
        let document = Document::for_test(&json, Vec::new());
        let mut warnings = Warnings::default();
        let placed = walk(&document, None, &Default::default(), &mut Warnings::default())?;
        let camera = read(&document, &placed[0], &mut warnings)?;
        Ok((camera.into_iter().collect(), warnings.into_lines()))
    }

    const LENS: &str = r#"{"type":"perspective","perspective":{"yfov":1.0,"znear":0.1}}"#;

    #[test]
    fn scale_and_mirror_leave_a_rigid_frame() {
        let node = r#","name":"Eye","translation":[1,2,3],"scale":[-2,3,0.5],"rotation":[0,0.70710678,0,0.70710678]"#;
        let (cameras, _) = cameras(node, LENS).expect("valid");
        let camera = &cameras[0];
        assert_eq!(
            (camera.name.as_str(), camera.to_world.transform_point3(Vec3::ZERO)),
            ("Eye", Vec3::new(1.0, 2.0, 3.0))
        );
        assert!((camera.to_world.determinant() - 1.0).abs() < 1e-6);
        assert!((camera.ray(0.5, 0.5, 1.0).direction - Vec3::NEG_X).length() < 1e-6);
    }

    #[test]
    fn useless_cameras_are_left_out_and_nonsense_is_refused() {
        for camera in [
            r#"{"type":"perspective","perspective":{"yfov":0,"znear":0.1}}"#,
            r#"{"type":"perspective","perspective":{"yfov":3.2,"znear":0.1}}"#,
            r#"{"type":"orthographic","orthographic":{"xmag":1,"ymag":0,"znear":0,"zfar":1}}"#,
            r#"{"type":"perspective"}"#,
        ] {
            let (cameras, warnings) = cameras("", camera).expect("valid");
            assert!(cameras.is_empty() && warnings.len() == 1, "{camera}");
        }
        assert!(cameras("", r#"{"type":"perspective","perspective":{"yfov":1e39,"znear":0.1}}"#).is_err());
        let json = r#""nodes":[{"camera":3}]"#;
        let document = Document::for_test(json, Vec::new());
        let placed = walk(&document, None, &Default::default(), &mut Warnings::default()).expect("a tree");
        let message =
            read(&document, &placed[0], &mut Warnings::default()).expect_err("no camera 3").to_string();
        assert!(message.contains("nodes[0].camera = 3"), "{message}");
    }

    #[test]
    fn equal_names_are_numbered() {
        let mut list = vec![Camera::framing(Vec3::ZERO, Vec3::ONE); 3];
        make_names_differ(&mut list);
        let names: Vec<&str> = list.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["framing", "framing 2", "framing 3"]);
    }
}
