//! Morph targets and skins: a mesh bent before it is placed (glTF 2.0, 3.7.2.2 and 3.7.3).

use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

use super::accessor::Accessor;
use super::animation::Pose;
use super::document::Document;
use super::error::Error;
use super::primitive::Primitive;
use crate::math::Vec3;

/// Sets of four joints that a vertex may hang on.
const SETS: u32 = 4;

/// How a node bends its mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Deform {
    /// Of each morph target.
    weights: Vec<f32>,
    /// From bind space to the world, by joint; the node's own transform then does not count.
    pub joints: Option<Vec<DAffine3>>,
}

/// What a primitive was decoded from.
pub(super) struct Attributes<'a> {
    pub document: &'a Document,
    pub json: &'a json::mesh::Primitive,
    /// Its path in the file.
    pub at: &'a str,
    /// Which element of the attributes each of its vertices is.
    pub source: &'a [u32],
    /// Elements of each attribute.
    pub vertices: usize,
}

impl Attributes<'_> {
    /// The accessor called `name` below the primitive's path, of one element for each of POSITION.
    fn open(
        &self,
        index: json::Index<json::Accessor>,
        name: &str,
        kind: Type,
        components: &[ComponentType],
    ) -> Result<Accessor<'_>, Error> {
        let user = format!("{}.{name}", self.at);
        let accessor = Accessor::open(self.document, index, &user, &[kind], components)?;
        if accessor.len() != self.vertices {
            let problem = format!("POSITION has {}", self.vertices);
            return Err(self.document.fault(format!("{user}.count"), accessor.len(), problem));
        }
        Ok(accessor)
    }
}

impl Deform {
    /// What node `i` does to its mesh; `None` where it leaves it as it is.
    ///
    /// `world_of`: where each node of the scene stands.
    pub fn of(
        document: &Document,
        i: usize,
        pose: &Pose,
        world_of: &dyn Fn(usize) -> Option<DAffine3>,
    ) -> Result<Option<Deform>, Error> {
        let root = &document.root;
        let node = &root.nodes[i];
        let mesh = node.mesh.and_then(|m| root.meshes.get(m.value()));
        let morphs = mesh.is_some_and(|m| m.primitives.iter().any(|p| p.targets.is_some()));
        let moved = pose.get(&i).and_then(|m| m.weights.as_ref());
        let weights = if morphs {
            moved.or(node.weights.as_ref()).or(mesh.and_then(|m| m.weights.as_ref())).cloned()
        } else {
            None
        };
        let weights = weights.unwrap_or_default();
        let joints = match node.skin {
            None => None,
            Some(skin) => Some(joints(document, i, skin.value(), world_of)?),
        };
        let bends = joints.is_some() || weights.iter().any(|&w| w != 0.0);
        Ok(bends.then_some(Deform { weights, joints }))
    }

    /// Bends `out`, which was decoded from `file`.
    pub fn apply(&self, file: &Attributes, out: &mut Primitive) -> Result<(), Error> {
        self.morph(file, out)?;
        match &self.joints {
            Some(joints) => skin(file, joints, out),
            None => Ok(()),
        }
    }

    fn morph(&self, file: &Attributes, out: &mut Primitive) -> Result<(), Error> {
        let targets = file.json.targets.as_deref().unwrap_or_default();
        let numbers = [ComponentType::F32, ComponentType::I8, ComponentType::I16];
        for (t, (target, &weight)) in targets.iter().zip(&self.weights).enumerate() {
            if weight == 0.0 {
                continue;
            }
            let add = |index: Option<json::Index<json::Accessor>>, to: &mut [Vec3], name: &str| {
                let Some(index) = index.filter(|_| !to.is_empty()) else { return Ok(()) };
                let accessor = file.open(index, &format!("targets[{t}].{name}"), Type::Vec3, &numbers)?;
                for (v, &i) in to.iter_mut().zip(file.source) {
                    *v += Vec3::from_array(accessor.get(i as usize)) * weight;
                }
                Ok(())
            };
            add(target.positions, &mut out.positions, "POSITION")?;
            add(target.normals, &mut out.normals, "NORMAL")?;
        }
        Ok(())
    }
}

/// From bind space to the world, for each joint of skin `s`.
fn joints(
    document: &Document,
    node: usize,
    s: usize,
    world_of: &dyn Fn(usize) -> Option<DAffine3>,
) -> Result<Vec<DAffine3>, Error> {
    let skin =
        document.root.skins.get(s).ok_or_else(|| {
            document.fault(format!("nodes[{node}].skin"), s, "there is no skin of this number")
        })?;
    let at = format!("skins[{s}].inverseBindMatrices");
    let inverse = match skin.inverse_bind_matrices {
        None => None,
        Some(index) => {
            let matrices = Accessor::open(document, index, &at, &[Type::Mat4], &[ComponentType::F32])?;
            if matrices.len() < skin.joints.len() {
                let problem = format!("there are {} joints", skin.joints.len());
                return Err(document.fault(format!("{at}.count"), matrices.len(), problem));
            }
            Some(matrices)
        }
    };
    let joints = skin.joints.iter().enumerate().map(|(k, joint)| {
        let world = world_of(joint.value()).ok_or_else(|| {
            document.fault(format!("skins[{s}].joints[{k}]"), joint.value(), "not a node of the scene shown")
        })?;
        let Some(inverse) = &inverse else { return Ok(world) };
        let columns: [f32; 16] = inverse.get(k);
        Ok(world * DAffine3::from_mat4(DMat4::from_cols_array(&columns.map(f64::from))))
    });
    joints.collect()
}

fn skin(file: &Attributes, joints: &[DAffine3], out: &mut Primitive) -> Result<(), Error> {
    let mut blended = vec![(DMat3::ZERO, DVec3::ZERO, 0.0f64); file.source.len()];
    for set in 0..SETS {
        let open = |semantic: Semantic, components: &[ComponentType]| {
            let Some(&index) = file.json.attributes.get(&Checked::Valid(semantic.clone())) else {
                return Ok(None);
            };
            let name = format!("attributes.{}", semantic.to_string());
            file.open(index, &name, Type::Vec4, components).map(Some)
        };
        let whole = [ComponentType::U8, ComponentType::U16];
        let shares = [ComponentType::F32, ComponentType::U8, ComponentType::U16];
        let (Some(numbers), Some(weights)) =
            (open(Semantic::Joints(set), &whole)?, open(Semantic::Weights(set), &shares)?)
        else {
            break;
        };
        for (sum, &i) in blended.iter_mut().zip(file.source) {
            let (j, w): ([f32; 4], [f32; 4]) = (numbers.get(i as usize), weights.get(i as usize));
            for (j, w) in j.into_iter().zip(w).filter(|(_, w)| *w > 0.0) {
                let Some(m) = joints.get(j as usize) else {
                    let user = format!("{}.attributes.JOINTS_{set}, element {i}", file.at);
                    return Err(file.document.fault(
                        user,
                        j,
                        format!("the skin has {} joints", joints.len()),
                    ));
                };
                let w = f64::from(w);
                *sum = (sum.0 + m.matrix3 * w, sum.1 + m.translation * w, sum.2 + w);
            }
        }
    }
    for (k, (m, t, w)) in blended.into_iter().enumerate() {
        if w <= 0.0 {
            continue;
        }
        let m = m * (1.0 / w);
        out.positions[k] = (m * out.positions[k].as_dvec3() + t / w).as_vec3();
        if let Some(n) = out.normals.get_mut(k) {
            let cofactor = DMat3::from_cols(
                m.y_axis.cross(m.z_axis),
                m.z_axis.cross(m.x_axis),
                m.x_axis.cross(m.y_axis),
            );
            *n = (cofactor * n.as_dvec3()).normalize_or_zero().as_vec3();
        }
    }
    Ok(())
}
