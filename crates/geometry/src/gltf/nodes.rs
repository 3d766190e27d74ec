//! The node tree: every node of the scene with its transform to the world.

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json;

use super::animation::Pose;
use super::document::Document;
use super::error::Error;
use super::warnings::Warnings;

/// A node of the scene shown, in world space.
pub(super) struct Placed {
    /// Index into the file's nodes.
    pub node: usize,
    /// Node to world, f64: a deep chain of rotations keeps its precision.
    pub world: DAffine3,
}

/// All nodes of the scene asked for, or of the default one, parents first.
pub(super) fn walk(
    document: &Document,
    scene: Option<&str>,
    pose: &Pose,
    warnings: &mut Warnings,
) -> Result<Vec<Placed>, Error> {
    let nodes = &document.root.nodes;
    let parents = parents(document)?;
    let roots = roots(document, scene, &parents, warnings)?;
    let mut placed = Vec::new();
    // A stack, not recursion: depth is the file's choice.
    let mut stack: Vec<(usize, DAffine3, usize)> = Vec::new();
    stack.extend(roots.into_iter().rev().map(|i| (i, DAffine3::IDENTITY, 1)));
    while let Some((i, parent, depth)) = stack.pop() {
        let limit = document.limits.node_depth as u64;
        document.within(format_args!("nodes[{i}]"), "generations of nodes", depth as u64, limit)?;
        let world = parent * local(document, i, &nodes[i], pose)?;
        placed.push(Placed { node: i, world });
        let children = nodes[i].children.as_deref().unwrap_or_default();
        stack.extend(children.iter().rev().map(|child| (child.value(), world, depth + 1)));
    }
    Ok(placed)
}

/// The parent of each node. An error unless the nodes form trees (glTF 2.0, 3.5.3): with two parents and
/// forty generations, one mesh could stand in 2⁴⁰ places.
fn parents(document: &Document) -> Result<Vec<Option<usize>>, Error> {
    let nodes = &document.root.nodes;
    let mut parents = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (k, child) in node.children.iter().flatten().enumerate() {
            let at = || format!("nodes[{i}].children[{k}]");
            let c = child.value();
            let parent = parents
                .get_mut(c)
                .ok_or_else(|| document.fault(at(), c, "there is no node of this number"))?;
            if let Some(other) = parent.replace(i) {
                return Err(document.fault(
                    at(),
                    c,
                    format_args!("this node has another parent, nodes[{other}]"),
                ));
            }
        }
    }
    // Where every node has at most one parent, going up either ends or runs in a circle.
    const NEVER: usize = usize::MAX;
    let mut seen_from = vec![NEVER; nodes.len()];
    for start in 0..nodes.len() {
        let mut next = Some(start);
        while let Some(at) = next {
            if seen_from[at] == start {
                let problem = "nodes run in a circle";
                return Err(document.fault(format_args!("nodes[{at}]"), "its own descendant", problem));
            }
            next = if seen_from[at] == NEVER { parents[at] } else { None };
            seen_from[at] = seen_from[at].min(start);
        }
    }
    Ok(parents)
}

/// The root nodes of the scene to show.
fn roots(
    document: &Document,
    asked: Option<&str>,
    parents: &[Option<usize>],
    warnings: &mut Warnings,
) -> Result<Vec<usize>, Error> {
    let root = &document.root;
    let scene = scene_number(document, asked)?;
    let Some(chosen) = root.scenes.get(scene) else {
        if root.scene.is_some() {
            return Err(document.fault("scene", scene, "there is no scene of this number"));
        }
        if !root.nodes.is_empty() {
            warnings.say("no scene: all root nodes are shown");
        }
        return Ok((0..root.nodes.len()).filter(|&i| parents[i].is_none()).collect());
    };
    if asked.is_none() && root.scene.is_none() && root.scenes.len() > 1 {
        warnings.say(format!("no default scene among {}: the first is shown", root.scenes.len()));
    }
    let mut listed = vec![false; root.nodes.len()];
    for (k, node) in chosen.nodes.iter().enumerate() {
        let i = node.value();
        let problem = match parents.get(i) {
            None => "there is no node of this number",
            Some(Some(_)) => "this node is not a root: it has a parent",
            Some(None) if std::mem::replace(&mut listed[i], true) => "this node is listed twice",
            Some(None) => continue,
        };
        return Err(document.fault(format_args!("scenes[{scene}].nodes[{k}]"), i, problem));
    }
    Ok(chosen.nodes.iter().map(|node| node.value()).collect())
}

/// The number of the scene asked for, or of the default one; there may be no scene of it.
pub(super) fn scene_number(document: &Document, asked: Option<&str>) -> Result<usize, Error> {
    match asked {
        Some(asked) => find(document, asked),
        None => Ok(document.root.scene.map_or(0, |scene| scene.value())),
    }
}

/// The number of the scene of that name, or of that number where none has the name.
fn find(document: &Document, asked: &str) -> Result<usize, Error> {
    let scenes = &document.root.scenes;
    let named = scenes.iter().position(|s| s.name.as_deref() == Some(asked));
    let numbered = asked.parse().ok().filter(|i| *i < scenes.len());
    named.or(numbered).ok_or_else(|| Error::NoSuch {
        file: document.file.clone(),
        what: "scene",
        asked: asked.into(),
        known: scenes
            .iter()
            .enumerate()
            .map(|(i, s)| s.name.as_ref().map_or(i.to_string(), |name| format!("{i} \"{name}\"")))
            .collect::<Vec<_>>()
            .join(", "),
    })
}

/// The node's own transform: its matrix, or translation · rotation · scale.
fn local(document: &Document, i: usize, node: &json::Node, pose: &Pose) -> Result<DAffine3, Error> {
    let check = |member: &str, values: &[f32]| match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(document.fault(format_args!("nodes[{i}].{member}"), v, "not a finite number")),
        None => Ok(()),
    };
    let moved = pose.get(&i);
    if let (Some(matrix), None) = (&node.matrix, moved) {
        check("matrix", matrix)?;
        // glTF 2.0, 3.5.3: the fourth row is (0, 0, 0, 1).
        return Ok(DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from))));
    }
    let translation = moved.and_then(|m| m.translation).or(node.translation).unwrap_or([0.0; 3]);
    let rotation = moved.and_then(|m| m.rotation).unwrap_or(node.rotation.unwrap_or_default().0);
    let scale = moved.and_then(|m| m.scale).or(node.scale).unwrap_or([1.0; 3]);
    check("translation", &translation)?;
    check("rotation", &rotation)?;
    check("scale", &scale)?;
    Ok(trs(translation, rotation, scale))
}

/// Translation · rotation · scale; a quaternion of length 0 is no rotation, of any other length its direction.
pub(super) fn trs(translation: [f32; 3], rotation: [f32; 4], scale: [f32; 3]) -> DAffine3 {
    let q = DQuat::from_array(rotation.map(f64::from));
    let q = if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(
        DVec3::from_array(scale.map(f64::from)),
        q,
        DVec3::from_array(translation.map(f64::from)),
    )
}

/// What messages call a node: its name, its mesh's name, or its number.
pub(super) fn name(root: &json::Root, i: usize) -> String {
    let node = root.nodes.get(i);
    let mesh = node.and_then(|n| n.mesh).and_then(|m| root.meshes.get(m.value()));
    node.and_then(|n| n.name.clone()).or_else(|| mesh?.name.clone()).unwrap_or_else(|| format!("node {i}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(json: &str) -> Result<Vec<Placed>, String> {
        walk(&Document::for_test(json, Vec::new()), None, &Pose::new(), &mut Warnings::default())
            .map_err(|e| e.to_string())
    }

    #[test]
    fn transforms_multiply_down_the_tree() {
        let json = r#""scenes":[{"nodes":[0]}],"nodes":[
            {"translation":[1,0,0],"scale":[2,2,2],"children":[1]},
            {"rotation":[0,0,0.70710678,0.70710678],"children":[2]},
            {"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 3,0,0,1]}]"#;
        let placed = placed(json).expect("valid");
        let p = placed[2].world.transform_point3(DVec3::ZERO);
        assert!((p - DVec3::new(1.0, 6.0, 0.0)).length() < 1e-6, "{p}");
    }

    #[test]
    fn cycles_shared_children_and_wrong_numbers_are_errors() {
        let errors = [
            (r#""scenes":[{"nodes":[0]}],"nodes":[{"children":[0]}]"#, "nodes[0] = its own descendant"),
            (
                r#""nodes":[{},{"children":[2]},{"children":[3]},{"children":[1]}]"#,
                "nodes[1] = its own descendant",
            ),
            (r#""scenes":[{"nodes":[0]}],"nodes":[{"children":[1,1]},{}]"#, "nodes[0].children[1] = 1"),
            (
                r#""scenes":[{"nodes":[0]}],"nodes":[{"children":[1]},{},{"children":[1]}]"#,
                "nodes[2].children[0] = 1",
            ),
            (r#""scenes":[{"nodes":[0]}],"nodes":[{"children":[4]}]"#, "nodes[0].children[0] = 4"),
            (r#""scenes":[{"nodes":[1]}],"nodes":[{"children":[1]},{}]"#, "scenes[0].nodes[0] = 1"),
            (r#""scenes":[{"nodes":[0,0]}],"nodes":[{}]"#, "scenes[0].nodes[1] = 0"),
            (r#""scenes":[{"nodes":[5]}],"nodes":[{}]"#, "scenes[0].nodes[0] = 5"),
            (r#""scene":2,"scenes":[{"nodes":[0]}],"nodes":[{}]"#, "scene = 2"),
            (r#""scenes":[{"nodes":[0]}],"nodes":[{"scale":[1,1e39,1]}]"#, "nodes[0].scale = inf"),
        ];
        for (json, place) in errors {
            let message = placed(json).err().expect(place);
            assert!(message.contains(place), "{message}");
        }
    }

    #[test]
    fn a_chain_of_a_hundred_thousand_nodes_is_an_error_and_no_overflow() {
        let chain: Vec<String> = (1..100_000).map(|i| format!(r#"{{"children":[{i}]}}"#)).collect();
        let json = format!(r#""scenes":[{{"nodes":[0]}}],"nodes":[{},{{}}]"#, chain.join(","));
        assert!(placed(&json).is_err_and(|e| e.contains("generations")));
    }

    #[test]
    fn without_scenes_the_roots_are_shown() {
        assert_eq!(placed(r#""nodes":[{"children":[1]},{},{}]"#).expect("valid").len(), 3);
        assert!(placed(r#""meshes":[]"#).expect("valid").is_empty());
    }
}
