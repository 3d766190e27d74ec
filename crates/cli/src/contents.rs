//! What is in a scene, counted and in units: the data behind `inspect`.

use crate::doctor::{self, Finding};
use geometry::gltf::Loaded;
use geometry::{Camera, LightKind, Material, Projection, Rgb, Scene, Sky, Texture};
use serde::Serialize;
use std::f32::consts::PI;
use std::path::{Path, PathBuf};

/// A scene in numbers; what `inspect --json` prints.
#[derive(Debug, Serialize)]
pub struct Contents {
    /// The file.
    pub scene: PathBuf,
    /// The program that wrote it.
    pub generator: Option<String>,
    /// Whose it is.
    pub copyright: Option<String>,
    /// glTF extensions it uses.
    pub extensions_used: Vec<String>,
    /// Those without which it must not be shown.
    pub extensions_required: Vec<String>,
    /// Scenes of the file, for `--scene`.
    pub scenes: Vec<String>,
    /// Variants of its materials, for `--variant`.
    pub variants: Vec<String>,
    /// Triangles.
    pub triangles: usize,
    /// Vertices.
    pub vertices: usize,
    /// Primitives of nodes.
    pub parts: usize,
    /// Lowest and highest corner, m; absent for an empty scene.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// In the order of the file.
    pub materials: Vec<MaterialRow>,
    /// In the order of the file.
    pub textures: Vec<TextureRow>,
    /// Emissive materials, then lamps, then the sky.
    pub lights: Vec<LightRow>,
    /// In the order of the file, which is how `--camera` counts them.
    pub cameras: Vec<CameraRow>,
    /// What the loader had to say.
    pub warnings: Vec<String>,
    /// What the doctor has to say.
    pub findings: Vec<Finding>,
}

/// One material.
#[derive(Debug, Serialize)]
pub struct MaterialRow {
    /// Name.
    pub name: String,
    /// What it is, in a word.
    pub kind: &'static str,
    /// Lowest and highest luminance of its base colour, over its texture, [0, 1]: what a diffuse surface or a metal
    /// reflects, what glass lets through.
    pub base_color: [f32; 2],
    /// Triangles that have it.
    pub triangles: usize,
}

/// One image.
#[derive(Debug, Serialize)]
pub struct TextureRow {
    /// Name.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// One light.
#[derive(Debug, Serialize)]
pub struct LightRow {
    /// Of the material or the lamp.
    pub name: String,
    /// "surface", "point", "spot", "directional" or "sky".
    pub kind: &'static str,
    /// Luminance of its intensity, in `unit`.
    pub intensity: f32,
    /// cd/m2, cd or lx.
    pub unit: &'static str,
    /// Luminous flux, lm, where it is finite and known: M A = π L A for surfaces, 4 π I for points.
    pub lumens: Option<f32>,
    /// Shining area, m2, of surfaces.
    pub area: Option<f32>,
}

/// One camera.
#[derive(Debug, Serialize)]
pub struct CameraRow {
    /// Name.
    pub name: String,
    /// "perspective" or "orthographic".
    pub kind: &'static str,
    /// Where it stands, m.
    pub position: [f32; 3],
    /// Angle or height of view.
    pub view: String,
    /// Width over height, if the file says.
    pub aspect: Option<f32>,
}

/// Counts a scene.
pub fn contents(path: &Path, loaded: &Loaded) -> Contents {
    let scene = &loaded.scene;
    let mut use_of = vec![(0usize, 0f64); scene.materials.len()];
    for (t, m) in scene.mesh.materials.iter().enumerate() {
        if let Some((triangles, area)) = use_of.get_mut(m.0 as usize) {
            *triangles += 1;
            *area += f64::from(scene.mesh.area(t as u32));
        }
    }
    let material = |(m, (triangles, _)): (&Material, &(usize, f64))| MaterialRow {
        name: m.name.clone(),
        kind: kind(m),
        base_color: base_color(m, scene),
        triangles: *triangles,
    };
    let surfaces =
        scene.materials.iter().zip(&use_of).filter_map(|(m, (_, area))| surface(m, *area as f32, scene));
    Contents {
        scene: path.into(),
        generator: loaded.facts.generator.clone(),
        copyright: loaded.facts.copyright.clone(),
        extensions_used: loaded.facts.extensions_used.clone(),
        extensions_required: loaded.facts.extensions_required.clone(),
        scenes: (0..)
            .zip(&loaded.facts.scenes)
            .map(|(i, name): (usize, _)| name.clone().unwrap_or_else(|| i.to_string()))
            .collect(),
        variants: loaded.facts.variants.clone(),
        triangles: scene.mesh.triangles.len(),
        vertices: scene.mesh.positions.len(),
        parts: scene.mesh.parts.len(),
        bounds: scene.mesh.bounds().map(|(lo, hi)| [lo.to_array(), hi.to_array()]),
        materials: scene.materials.iter().zip(&use_of).map(material).collect(),
        textures: scene
            .textures
            .iter()
            .map(|t| TextureRow { name: t.name.clone(), width: t.width, height: t.height })
            .collect(),
        lights: surfaces.chain(lamps(scene)).chain(sky(scene)).collect(),
        cameras: loaded.cameras.iter().map(camera).collect(),
        warnings: loaded.warnings.clone(),
        findings: doctor::examine(loaded),
    }
}

/// What a material is, in a word, by its factors; where a texture varies roughness or metalness, "textured".
fn kind(m: &Material) -> &'static str {
    // Below this GGX width (0.05²) a reflection shows no blur at the sizes of a picture.
    let smooth = m.roughness < 0.05;
    match m {
        m if m.unlit => "unlit",
        m if m.clearcoat.is_some() => "clearcoat",
        m if m.sheen.is_some() => "cloth",
        m if m.diffuse_transmission.is_some() => "translucent",
        m if m.may_transmit() && m.volume.is_some() => "glass",
        m if m.may_transmit() => "thin glass",
        m if m.metallic_roughness_texture.is_some() => "textured gloss",
        m if m.metallic >= 1.0 && smooth => "mirror",
        m if m.metallic >= 1.0 => "metal",
        m if m.metallic > 0.0 => "part metal",
        // Specular-glossiness, whose metals have bright coats.
        m if m.ior == 0.0 && m.specular_color.max_channel() >= 0.2 => {
            ["metal", "mirror"][usize::from(smooth)]
        }
        // Index 1 reflects nothing; 0 stands for the opposite.
        m if m.specular <= 0.0 || m.ior == 1.0 => "diffuse",
        _ if smooth => "varnished",
        _ => "glossy",
    }
}

/// Range of the luminance of a material's base colour, over its texture.
fn base_color(m: &Material, scene: &Scene) -> [f32; 2] {
    let texture = m.base_color_texture.and_then(|t| scene.textures.get(t.texture as usize));
    let Some(texture) = texture.filter(|t| !t.texels.is_empty()) else {
        return [m.base_color.luminance(); 2];
    };
    texels(texture)
        .map(|c| (c * m.base_color).luminance())
        .fold([f32::INFINITY, 0.0], |[lo, hi], y| [lo.min(y), hi.max(y)])
}

/// Every texel as linear colour.
fn texels(texture: &Texture) -> impl Iterator<Item = Rgb> {
    let linear: [f32; 256] = std::array::from_fn(|i| {
        let v = i as f32 / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    });
    texture
        .texels
        .iter()
        .map(move |t| Rgb::new(linear[t[0] as usize], linear[t[1] as usize], linear[t[2] as usize]))
}

/// The light of all triangles of one material; a texture counts with its mean, as if evenly used.
fn surface(m: &Material, area: f32, scene: &Scene) -> Option<LightRow> {
    if m.emissive.is_black() || area == 0.0 || m.unlit {
        return None;
    }
    let texture = m.emissive_texture.and_then(|t| scene.textures.get(t.texture as usize));
    let mean = match texture.filter(|t| !t.texels.is_empty()) {
        Some(t) => texels(t).sum::<Rgb>() / t.texels.len() as f32,
        None => Rgb::WHITE,
    };
    let radiance = (m.emissive * mean).luminance();
    let sides = if m.double_sided { 2.0 } else { 1.0 };
    Some(LightRow {
        name: m.name.clone(),
        kind: "surface",
        intensity: radiance,
        unit: "cd/m2",
        lumens: Some(sides * area * PI * radiance),
        area: Some(area),
    })
}

fn lamps(scene: &Scene) -> impl Iterator<Item = LightRow> {
    scene.lights.iter().map(|l| {
        let intensity = l.intensity.luminance();
        let (kind, unit) = match l.kind {
            LightKind::Point { .. } => ("point", "cd"),
            LightKind::Spot { .. } => ("spot", "cd"),
            LightKind::Photometric { .. } => ("photometric", "cd"),
            LightKind::Directional { .. } => ("directional", "lx"),
        };
        let lumens = (unit == "cd").then(|| l.flux(0.0).luminance());
        LightRow { name: l.name.clone(), kind, intensity, unit, lumens, area: None }
    })
}

fn sky(scene: &Scene) -> Option<LightRow> {
    let intensity = scene.sky.as_ref().map(Sky::mean)?.luminance();
    Some(LightRow { name: "sky".into(), kind: "sky", intensity, unit: "cd/m2", lumens: None, area: None })
}

fn camera(c: &Camera) -> CameraRow {
    let (kind, view) = match c.projection {
        Projection::Perspective { yfov } => ("perspective", format!("{:.1} degrees high", yfov.to_degrees())),
        Projection::Orthographic { ymag } => ("orthographic", format!("{} m high", 2.0 * ymag)),
    };
    let position = c.to_world.w_axis.truncate().to_array();
    CameraRow { name: c.name.clone(), kind, position, view, aspect: c.aspect }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::gltf::Facts;
    use geometry::{Mesh, Vec3};

    #[test]
    fn a_panel_of_two_square_metres_has_2_pi_l_lumens() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y],
            triangles: vec![[0, 1, 2]],
            materials: vec![geometry::MaterialId(0)],
            ..Mesh::default()
        };
        let lamp = Material {
            name: "lamp".into(),
            emissive: Rgb::splat(10.0),
            metallic: 0.0,
            ..Material::default()
        };
        let scene = Scene { mesh, materials: vec![lamp], ..Scene::default() };
        let light = contents(
            Path::new("a"),
            &Loaded { scene, cameras: vec![], warnings: vec![], facts: Facts::default() },
        )
        .lights
        .remove(0);
        assert!((light.lumens.unwrap() - 2.0 * PI * 10.0).abs() < 1e-3);
        assert_eq!((light.kind, light.unit), ("surface", "cd/m2"));
    }

    #[test]
    fn materials_are_named_by_what_they_do() {
        let default = Material::default();
        let with = |f: fn(&mut Material)| {
            let mut m = Material { metallic: 0.0, ..default.clone() };
            f(&mut m);
            kind(&m)
        };
        assert_eq!(with(|m| m.specular = 0.0), "diffuse");
        assert_eq!(with(|_| {}), "glossy");
        assert_eq!(with(|m| (m.metallic, m.roughness) = (1.0, 0.0)), "mirror");
        assert_eq!(with(|m| m.transmission = 1.0), "thin glass");
    }
}
