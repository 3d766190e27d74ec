//! Lamps by name: what is switched, dimmed and coloured together.
//!
//! A lamp of the file goes by its own name, an emissive surface by its material's, light from beyond the scene is
//! [`SKY`]. What shares a name is one group, like lamps on one switch.

use crate::emitter::EmitterKind;
use crate::{Light, Material, Rgb, Scene, Sky, World};
use std::collections::HashMap;

/// Name of the light from beyond the scene.
pub const SKY: &str = "sky";
/// Name of what is weak where there are more names than groups.
pub const OTHERS: &str = "others";

/// Groups that are kept apart at most; each costs a solution 24 bytes for every place where it was gathered.
const MOST: usize = 32;

/// What shines, by the scene's own order: its lamps, its materials, its sky.
impl Scene {
    /// Emission of each: cd or lx of a lamp, cd/m² of a material, of an even sky; a factor for a panorama.
    pub fn emissions(&self) -> Vec<Rgb> {
        let sky = self.sky.iter().map(|sky| match sky {
            Sky::Constant(radiance) => *radiance,
            Sky::Image(image) => image.strength(),
        });
        let materials = self.materials.iter().map(|m| m.emissive);
        self.lights.iter().map(|l| l.intensity).chain(materials).chain(sky).collect()
    }

    /// Name of each, in the order of [`Scene::emissions`].
    pub fn emission_names(&self) -> impl Iterator<Item = &str> {
        let materials = self.materials.iter().map(|m| &*m.name);
        self.lights.iter().map(|l| &*l.name).chain(materials).chain(self.sky.iter().map(|_| SKY))
    }

    /// Names of what shines, each once, in order.
    pub fn light_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for (name, emission) in self.emission_names().zip(self.emissions()) {
            if !emission.is_black() && !names.iter().any(|n| n == name) {
                names.push(name.into());
            }
        }
        names
    }

    /// Makes everything that is called `name` shine `factor` times as bright, channel by channel; returns whether
    /// anything is called so.
    pub fn scale_lights(&mut self, name: &str, factor: Rgb) -> bool {
        let mut any = false;
        for lamp in self.lights.iter_mut().filter(|l| l.name == name) {
            lamp.intensity *= factor;
            any = true;
        }
        for material in self.materials.iter_mut().filter(|m| !m.emissive.is_black() && m.name == name) {
            material.emissive *= factor;
            any = true;
        }
        if name == SKY && self.sky.is_some() {
            self.sky = self.sky.take().map(|sky| sky.scaled(factor));
            any = true;
        }
        any
    }

    /// What [`Scene::scale_lights`] and the like change.
    pub fn lights_and_materials(&self) -> (Vec<Light>, Vec<Material>, Option<Sky>) {
        (self.lights.clone(), self.materials.clone(), self.sky.clone())
    }

    /// Puts back what [`Scene::lights_and_materials`] gave.
    pub fn restore(&mut self, (lights, materials, sky): &(Vec<Light>, Vec<Material>, Option<Sky>)) {
        (self.lights, self.materials, self.sky) = (lights.clone(), materials.clone(), sky.clone());
    }

    /// Switches off everything of [`Scene::emissions`] but what `stays` tells by its number.
    pub fn leave_lights(&mut self, stays: impl Fn(usize) -> bool) {
        let lamps = self.lights.iter_mut().map(|l| &mut l.intensity);
        let mut count = 0;
        for emission in lamps.chain(self.materials.iter_mut().map(|m| &mut m.emissive)) {
            if !stays(count) {
                *emission = Rgb::BLACK;
            }
            count += 1;
        }
        if !stays(count) {
            self.sky = self.sky.take().map(|sky| sky.scaled(Rgb::BLACK));
        }
    }
}

/// In no group: it shines on nothing, for it is black wherever one looks, or no triangle uses it.
pub const NO_GROUP: u16 = u16::MAX;

/// Which group everything that shines belongs to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    /// Name of each group; the last is [`OTHERS`] where there are too many names.
    pub names: Vec<String>,
    /// Group of each of [`Scene::emissions`].
    of_emission: Vec<u16>,
    /// Group of each of [`crate::Emitters::lights`].
    of_light: Vec<u16>,
}

impl LightGroups {
    /// The groups of a world: all names, or the strongest of them.
    pub fn new(world: &World) -> LightGroups {
        let scene = &world.scene;
        let name_of = |kind: &EmitterKind| match kind {
            EmitterKind::Polygon(shape) | EmitterKind::Textured(shape) => {
                let material = scene.mesh.materials[shape.triangles[0] as usize];
                scene.materials[material.0 as usize].name.clone()
            }
            EmitterKind::Punctual(lamp) => lamp.name.clone(),
            EmitterKind::Sky(_) => SKY.into(),
        };
        let of_lights: Vec<String> = world.emitters.lights().iter().map(name_of).collect();
        let mut power: HashMap<&str, f32> = HashMap::new();
        for (name, p) in of_lights.iter().zip(world.emitters.power()) {
            *power.entry(name).or_default() += p.luminance();
        }
        // What shines by a texture that is black everywhere looked up is no light that one samples.
        let mut names = scene.light_names();
        names.retain(|name| power.contains_key(&**name));
        let crowded = names.len() > MOST;
        if crowded {
            let mut ranked = names.clone();
            ranked.sort_by(|a, b| power[&**b].total_cmp(&power[&**a]));
            let strongest = &ranked[..MOST - 1];
            names.retain(|name| strongest.contains(name));
            names.push(OTHERS.into());
        }
        let number: HashMap<&str, u16> = (0u16..).zip(&names).map(|(i, n)| (&**n, i)).collect();
        let last = names.len().saturating_sub(1) as u16;
        let of = |name: &str| match number.get(name) {
            Some(&group) => group,
            None if crowded && power.contains_key(name) => last,
            None => NO_GROUP,
        };
        LightGroups {
            of_emission: scene.emission_names().map(of).collect(),
            of_light: of_lights.iter().map(|n| of(n)).collect(),
            names,
        }
    }

    /// Groups of which only these are known, as a file holds them: they tell nothing of a world's emitters.
    ///
    /// - `of_emissions`: group of each of [`Scene::emissions`].
    pub fn stored(names: Vec<String>, of_emissions: Vec<u16>) -> LightGroups {
        LightGroups { names, of_emission: of_emissions, of_light: Vec::new() }
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Group of a light of the world's emitters.
    pub fn of_light(&self, light: u32) -> usize {
        self.of_light[light as usize] as usize
    }

    /// Group of each of [`Scene::emissions`], or [`NO_GROUP`].
    pub fn of_emissions(&self) -> &[u16] {
        &self.of_emission
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LightKind;
    use crate::{MaterialId, Mesh, Vec3};

    fn scene() -> Scene {
        let lamp = |name: &str, x: f32| Light {
            name: name.into(),
            intensity: Rgb::splat(10.0),
            kind: LightKind::Point { position: Vec3::new(x, 1.0, 0.0), range: f32::INFINITY },
        };
        let glow = Material { name: "panel".into(), emissive: Rgb::splat(5.0), ..Material::default() };
        Scene {
            mesh: Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Z],
                normals: vec![Vec3::Y; 3],
                triangles: vec![[0, 2, 1]],
                materials: vec![MaterialId(1)],
                ..Mesh::default()
            },
            materials: vec![Material::default(), glow],
            lights: vec![lamp("spot", 0.0), lamp("bulb", 1.0), lamp("spot", 2.0)],
            sky: Some(Sky::Constant(Rgb::WHITE)),
            ..Scene::default()
        }
    }

    #[test]
    fn what_shares_a_name_is_one_group() {
        let world = World::new(scene());
        let groups = LightGroups::new(&world);
        assert_eq!(groups.names, ["spot", "bulb", "panel", "sky"]);
        assert_eq!(world.scene.light_names(), groups.names);
        for (i, light) in world.emitters.lights().iter().enumerate() {
            let name = match light {
                EmitterKind::Punctual(lamp) => &*lamp.name,
                EmitterKind::Sky(_) => "sky",
                _ => "panel",
            };
            assert_eq!(groups.names[groups.of_light(i as u32)], name);
        }
    }

    #[test]
    fn lights_are_scaled_by_name() {
        let mut scene = scene();
        assert!(scene.scale_lights("spot", Rgb::new(2.0, 1.0, 0.0)));
        assert_eq!(scene.lights[2].intensity, Rgb::new(20.0, 10.0, 0.0));
        assert_eq!(scene.lights[1].intensity, Rgb::splat(10.0));
        assert!(!scene.scale_lights("default", Rgb::WHITE), "it does not shine");
        // Three lamps, the plain material, the panel, the sky.
        scene.leave_lights(|i| i == 4);
        assert_eq!(scene.light_names(), ["panel"]);
        assert_eq!(scene.materials[1].emissive, Rgb::splat(5.0));
    }

    #[test]
    fn of_too_many_names_the_weak_ones_stay_together() {
        let mut scene = scene();
        for i in 0..50 {
            let lamp = Light {
                name: format!("lamp {i}"),
                intensity: Rgb::splat(i as f32 + 1.0),
                ..scene.lights[0].clone()
            };
            scene.lights.push(lamp);
        }
        let groups = LightGroups::new(&World::new(scene));
        assert_eq!(groups.len(), MOST);
        assert_eq!(groups.names.last().map(|n| &**n), Some(OTHERS));
        assert!(groups.names.contains(&"lamp 49".into()) && !groups.names.contains(&"lamp 0".into()));
    }
}
