//! glTF 2.0 files to a [`Scene`] in world space, its cameras, and what was odd about the file.
//!
//! The gltf crate parses container and JSON; everything it says is checked here before it is used, so that
//! a broken or hostile file costs an [`Error`] and no panic. Features that a file uses and we lack are
//! [`Loaded::warnings`], never silence.

mod accessor;
mod animation;
mod bake;
mod cameras;
mod clean;
mod deform;
mod document;
mod draco;
mod environment;
mod error;
mod extensions;
mod instancing;
mod ktx2;
mod lights;
mod limits;
mod lobes;
mod materials;
mod meshopt;
mod nodes;
mod options;
mod primitive;
mod profiles;
mod tangents;
mod textures;
mod topology;
mod uri;
mod variants;
mod warnings;
pub mod write;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use glam::DAffine3;
use gltf::json;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

pub use error::Error;
pub use limits::Limits;
pub use options::Options;

use self::animation::Pose;
use self::bake::Layout;
use self::deform::Deform;
use self::document::Document;
use self::primitive::{Needs, Primitive};
use self::warnings::Warnings;
use crate::scene::{Material, MaterialId};
use crate::{Camera, Scene};

/// A file, loaded.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Everything that light meets, in world space.
    pub scene: Scene,
    /// Cameras in the order of the file's nodes, parents first; names differ.
    pub cameras: Vec<Camera>,
    /// What was left out, replaced or clamped: one line each, with counts.
    pub warnings: Vec<String>,
    /// What the file says of itself.
    pub facts: Facts,
}

/// What a file says of itself, for `inspect`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// `asset.version`.
    pub version: String,
    /// `asset.generator`.
    pub generator: Option<String>,
    /// `asset.copyright`.
    pub copyright: Option<String>,
    /// `extensionsUsed`.
    pub extensions_used: Vec<String>,
    /// `extensionsRequired`.
    pub extensions_required: Vec<String>,
    /// Nodes in the scene shown.
    pub nodes: usize,
    /// Meshes in the file.
    pub meshes: usize,
    /// Copies of mesh primitives in the scene, points and lines included.
    pub instances: u64,
    /// Triangles in the scene before useless ones were dropped.
    pub triangles: u64,
    /// Names of the scenes, where they have any.
    pub scenes: Vec<Option<String>>,
    /// Names of the variants of its materials.
    pub variants: Vec<String>,
}

/// Loads a `.gltf` or `.glb` file with its buffers and images: its default scene in its rest pose.
pub fn load(path: &Path) -> Result<Loaded, Error> {
    load_with(path, &Options::default())
}

/// Loads a `.gltf` or `.glb` file with its buffers and images.
///
/// Only files below the folder of `path` are read. Errors are for what would make the picture wrong, like a
/// missing buffer; a missing image is a warning.
pub fn load_with(path: &Path, options: &Options) -> Result<Loaded, Error> {
    // We know of no input that panics, but parsers and decoders of other people are called in here.
    catch_unwind(AssertUnwindSafe(|| import(path, options))).unwrap_or_else(|payload| {
        let text = payload.downcast_ref::<String>().cloned();
        let text = text.or_else(|| payload.downcast_ref::<&str>().map(|s| s.to_string()));
        Err(Error::Defect { file: path.into(), problem: text.unwrap_or_else(|| "a panic".into()) })
    })
}

fn import(path: &Path, options: &Options) -> Result<Loaded, Error> {
    let mut document = Document::open(path, options.limits)?;
    let mut warnings = Warnings::default();
    let root = &document.root;
    extensions::check(path, &root.extensions_used, &root.extensions_required, &mut warnings)?;
    let mut scene = Scene { materials: materials::read_all(&document, &mut warnings)?, ..Scene::default() };
    let pose = match options.time {
        Some(time) => animation::pose(&document, time)?,
        None => Pose::new(),
    };
    match (options.time, root.animations.len()) {
        (None, 1..) => warnings.say("animated: everything stands in its rest pose (--time shows another)"),
        (Some(_), 0) => warnings.say("there is no animation: --time changes nothing"),
        (Some(_), 2..) => warnings.say("of several animations the first is shown"),
        _ => {}
    }
    let webs = profiles::load(&mut document, &mut warnings)?;
    let variant = options.variant.as_ref().map(|name| variants::find(&document, name)).transpose()?;
    let placed = nodes::walk(&document, options.scene.as_deref(), &pose, &mut warnings)?;
    let mut cameras = Vec::new();
    for node in &placed {
        cameras.extend(cameras::read(&document, node, &mut warnings)?);
        scene.lights.extend(lights::read(&document, node, &options.webs, &mut warnings)?);
        scene.lights.extend(profiles::read(&document, node, &webs, &mut warnings)?);
    }
    cameras::make_names_differ(&mut cameras);
    let number = nodes::scene_number(&document, options.scene.as_deref())?;
    scene.sky = environment::load(&mut document, number, &mut warnings)?;
    scene.textures = textures::load(&mut document, &mut scene.materials, &mut warnings)?;

    let uses = uses_of_meshes(&document, &placed, &pose)?;
    let (instances, triangles) = build(&document, &uses, variant, &mut scene, &mut warnings)?;
    document.close();
    clean::clean(&mut scene, &mut warnings);
    if scene.mesh.triangles.is_empty() {
        warnings.say("the scene has no triangles");
    }
    let variants = variants::names(&document.root);
    let json::Root { asset, scenes, extensions_used, extensions_required, meshes, .. } = document.root;
    let facts = Facts {
        version: asset.version,
        generator: asset.generator,
        copyright: asset.copyright,
        extensions_used,
        extensions_required,
        nodes: placed.len(),
        meshes: meshes.len(),
        instances,
        triangles,
        scenes: scenes.into_iter().map(|s| s.name).collect(),
        variants,
    };
    Ok(Loaded { scene, cameras, warnings: warnings.into_lines(), facts })
}

/// The places where one mesh stands.
#[derive(Default)]
struct Uses {
    /// Node and transform of each.
    places: Vec<(usize, DAffine3)>,
    /// Those that bend the mesh, each in its own way.
    bent: Vec<(usize, Vec<DAffine3>, Deform)>,
}

/// For each mesh of the file, where it stands in the scene.
fn uses_of_meshes(document: &Document, placed: &[nodes::Placed], pose: &Pose) -> Result<Vec<Uses>, Error> {
    let root = &document.root;
    let mut uses: Vec<Uses> = root.meshes.iter().map(|_| Uses::default()).collect();
    let mut total = 0;
    let mut worlds = vec![None; root.nodes.len()];
    placed.iter().for_each(|place| worlds[place.node] = Some(place.world));
    let world_of = |node: usize| worlds.get(node).copied().flatten();
    for place in placed {
        let node = &root.nodes[place.node];
        let Some(index) = node.mesh else { continue };
        let m = index.value();
        let Some(mesh) = root.meshes.get(m) else {
            return Err(document.fault(
                format_args!("nodes[{}].mesh", place.node),
                m,
                "there is no mesh of this number",
            ));
        };
        let transforms = instancing::transforms(document, place)?;
        total += transforms.len() as u64 * mesh.primitives.len() as u64;
        document.within(
            format_args!("nodes[{}]", place.node),
            "instances",
            total,
            document.limits.instances,
        )?;
        match Deform::of(document, place.node, pose, &world_of)? {
            None => uses[m].places.extend(transforms.iter().map(|&t| (place.node, t))),
            Some(bent) => {
                // Joints lead to the world by themselves.
                let skinned = bent.joints.is_some();
                let transforms = if skinned { vec![DAffine3::IDENTITY] } else { transforms.into_owned() };
                uses[m].bent.push((place.node, transforms, bent));
            }
        }
    }
    Ok(uses)
}

/// Decodes every mesh in use and bakes it into the scene, as often as it stands there. Returns the numbers
/// of instances and of triangles.
fn build(
    document: &Document,
    uses: &[Uses],
    variant: Option<u64>,
    scene: &mut Scene,
    warnings: &mut Warnings,
) -> Result<(u64, u64), Error> {
    let root = &document.root;
    let used = || {
        root.meshes
            .iter()
            .zip(uses)
            .enumerate()
            .filter(|(_, (_, u))| !(u.places.is_empty() && u.bent.is_empty()))
    };
    let uv_sets: Vec<[bool; 2]> = scene.materials.iter_mut().map(uv_sets).collect();
    let layout = Layout {
        uvs: [0, 1].map(|set| uv_sets.iter().any(|sets| sets[set])),
        colors: used().any(|(_, (mesh, _))| mesh.primitives.iter().any(has_colors)),
        tangents: scene.materials.iter().any(|m| materials::tangent_set(m).is_some()),
    };
    // Corners must be countable in 32 bits.
    let limit = document.limits.triangles.min(u64::from(u32::MAX) / 3);
    let (mut instances, mut triangles) = (0, 0);
    let mut default_material = None;
    for (m, (mesh, uses)) in used() {
        for (p, json) in mesh.primitives.iter().enumerate() {
            let at = format!("meshes[{m}].primitives[{p}]");
            let own = json.material.map(|i| i.value());
            let material = match variant.and_then(|v| variants::material(json, v)).or(own) {
                Some(i) if i < root.materials.len() => MaterialId(i as u32),
                Some(i) => {
                    return Err(document.fault(
                        format_args!("{at}.material"),
                        i,
                        "there is no material of this number",
                    ));
                }
                None => *default_material.get_or_insert_with(|| {
                    scene.materials.push(Material::default());
                    MaterialId((scene.materials.len() - 1) as u32)
                }),
            };
            let tangents = materials::tangent_set(&scene.materials[material.0 as usize]);
            let uvs = uv_sets.get(material.0 as usize).copied().unwrap_or_default();
            let needs = Needs { uvs, colors: layout.colors, tangents };
            let plain = (!uses.places.is_empty()).then_some((&uses.places[..], None));
            let bent: Vec<(Vec<(usize, DAffine3)>, &Deform)> = uses
                .bent
                .iter()
                .map(|(node, places, deform)| (places.iter().map(|&t| (*node, t)).collect(), deform))
                .collect();
            let bent = bent.iter().map(|(places, deform)| (&places[..], Some(*deform)));
            for (places, deform) in plain.into_iter().chain(bent) {
                instances += places.len() as u64;
                let Some(mut primitive) = Primitive::read(document, json, &at, needs, deform)? else {
                    warnings.count("points and lines are left out", &at, 1);
                    break;
                };
                let textured = textured_sets(&mut scene.materials[material.0 as usize]);
                if [0, 1].into_iter().any(|set| textured[set] && primitive.uvs[set].is_empty()) {
                    warnings.count("primitives lack a TEXCOORD that their textures need: taken as 0", &at, 1);
                }
                triangles += primitive.triangles.len() as u64 * places.len() as u64;
                document.within(&at, "triangles", triangles, limit)?;
                for (k, (node, world)) in places.iter().enumerate() {
                    let name = (nodes::name(root, *node), [*node as u32, p as u32]);
                    let last = k + 1 == places.len();
                    let mesh = &mut scene.mesh;
                    let replaced = bake::append(mesh, &mut primitive, last, world, material, name, layout);
                    warnings.count("normals replaced by that of a face: zero or not finite", &at, replaced);
                }
            }
        }
    }
    Ok((instances, triangles))
}

/// Which uv sets the textures of a material use.
fn textured_sets(material: &mut Material) -> [bool; 2] {
    let mut sets = [false; 2];
    for texture in materials::texture_refs(material).into_iter().flatten() {
        sets[usize::from(texture.uv_set.min(1))] = true;
    }
    sets
}

/// Those, and the one that its tangents run along.
fn uv_sets(material: &mut Material) -> [bool; 2] {
    let mut sets = textured_sets(material);
    if let Some(set) = materials::tangent_set(material) {
        sets[usize::from(set.min(1))] = true;
    }
    sets
}

fn has_colors(primitive: &json::mesh::Primitive) -> bool {
    primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(0)))
}
