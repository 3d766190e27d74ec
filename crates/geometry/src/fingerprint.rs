//! Two scenes with one fingerprint send light on alike: what is the same for them can be kept.

use crate::math::{Vec2, Vec3, Vec4};
use crate::{Light, Material, Rgb, Scene, Sky, Texture};
use blake3::Hasher;
use std::io::Write;

/// 32 bytes that change when anything changes that light meets, or a lamp's place; how bright lamps are, and the
/// colour of their light, does not matter, nor do cameras.
pub type Fingerprint = [u8; 32];

impl Scene {
    /// The scene's fingerprint (BLAKE3).
    pub fn fingerprint(&self) -> Fingerprint {
        let mut hasher = Hasher::new();
        let mesh = &self.mesh;
        let flat3 = |all: &[Vec3]| all.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
        let flat4 = |all: &[Vec4]| all.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
        let flat2 = |all: &[Vec2]| all.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
        floats(&mut hasher, &flat3(&mesh.positions));
        floats(&mut hasher, &flat3(&mesh.normals));
        for set in &mesh.uvs {
            floats(&mut hasher, &flat2(set));
        }
        floats(&mut hasher, &flat4(&mesh.colors));
        floats(&mut hasher, &flat4(&mesh.tangents));
        words(&mut hasher, mesh.triangles.iter().flatten().copied());
        words(&mut hasher, mesh.materials.iter().map(|m| m.0));
        // Numbers are printed so that they can be read back exactly: what is printed alike is alike.
        let mut told = String::new();
        for material in &self.materials {
            let dark = Material { emissive: Rgb::BLACK, ..material.clone() };
            told += &format!("{dark:?}\n");
        }
        for Light { name, kind, .. } in &self.lights {
            told += &format!("{name} {kind:?}\n");
        }
        for Texture { width, height, wrap_s, wrap_t, linear, .. } in &self.textures {
            told += &format!("{width} {height} {wrap_s:?} {wrap_t:?} {linear}\n");
        }
        if let Some(Sky::Constant(_)) = self.sky {
            told += "an even sky\n";
        }
        words(&mut hasher, [told.len() as u32]);
        hasher.update(told.as_bytes());
        for texture in &self.textures {
            hasher.update_rayon(texture.texels.as_flattened());
        }
        if let Some(Sky::Image(image)) = &self.sky {
            words(&mut hasher, image.size());
            floats(&mut hasher, &image.pixels().iter().flat_map(|p| p.to_array()).collect::<Vec<f32>>());
        }
        *hasher.finalize().as_bytes()
    }
}

/// How many, then all of them.
fn floats(hasher: &mut Hasher, all: &[f32]) {
    words(hasher, all.iter().map(|x| x.to_bits()));
}

fn words(hasher: &mut Hasher, all: impl IntoIterator<Item = u32>) {
    let bytes: Vec<u8> = all.into_iter().flat_map(u32::to_le_bytes).collect();
    // Hashing is to memory: nothing fails.
    let _ = hasher.write_all(&(bytes.len() as u64).to_le_bytes());
    hasher.update_rayon(&bytes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LightKind;
    use crate::{MaterialId, Mesh};
    use std::sync::Arc;

    fn scene() -> Scene {
        Scene {
            mesh: Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Z],
                normals: vec![Vec3::Y; 3],
                triangles: vec![[0, 2, 1]],
                materials: vec![MaterialId(0)],
                ..Mesh::default()
            },
            materials: vec![Material { emissive: Rgb::WHITE, ..Material::default() }],
            lights: vec![Light {
                name: "bulb".into(),
                intensity: Rgb::WHITE,
                kind: LightKind::Point { position: Vec3::Y, range: f32::INFINITY },
            }],
            ..Scene::default()
        }
    }

    #[test]
    fn brightness_does_not_count_and_all_else_does() {
        let known = scene().fingerprint();
        let mut brighter = scene();
        brighter.materials[0].emissive = Rgb::new(3.0, 2.0, 1.0);
        brighter.lights[0].intensity = Rgb::splat(7.0);
        assert_eq!(brighter.fingerprint(), known);
        let changes: [fn(&mut Scene); 6] = [
            |s| s.mesh.positions[1].x = 1.000_000_1,
            |s| s.mesh.triangles[0] = [0, 1, 2],
            |s| s.materials[0].roughness = 0.5,
            |s| s.lights[0].kind = LightKind::Point { position: Vec3::X, range: f32::INFINITY },
            |s| {
                let file = b"TILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 0 0 180 0 2 1";
                let web = Arc::new(crate::ies::parse(file).expect("a web"));
                let (position, turn, range) = (Vec3::Y, web.frame(), f32::INFINITY);
                s.lights[0].kind = LightKind::Photometric { position, turn, range, web };
            },
            |s| s.sky = Some(Sky::Constant(Rgb::WHITE)),
        ];
        for (i, change) in changes.iter().enumerate() {
            let mut other = scene();
            change(&mut other);
            assert_ne!(other.fingerprint(), known, "change {i}");
        }
    }
}
