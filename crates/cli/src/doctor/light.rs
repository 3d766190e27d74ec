//! What surfaces send back, and how much light there is.

use super::{Finding, Severity};
use geometry::emitter::EmitterKind;
use geometry::{LightKind, Material, Scene, World};
use std::f32::consts::PI;

/// Fresh snow and barium sulphate reflect less.
const WHITEST: f32 = 0.98;
/// The sun's disc has 1.6·10⁹ cd/m², the filament of a lamp 10⁷, a bare LED 10⁸.
const BRIGHTEST: f32 = 2e9;
/// Lux on the average surface: less than a quarter moon's, more than a hundred suns'.
const LEVELS: [f32; 2] = [2e-3, 1e7];

/// Materials that reflect all, and lamps that are switched off.
pub fn materials(scene: &Scene, found: &mut Vec<Finding>) {
    let mut used = vec![false; scene.materials.len()];
    scene.mesh.materials.iter().for_each(|m| used[m.0 as usize] = true);
    for (i, m) in scene.materials.iter().enumerate().filter(|(i, _)| used[*i]) {
        let place = format!("materials[{i}] \"{}\"", m.name);
        let plain = m.base_color_texture.is_none() && scene.mesh.colors.is_empty();
        if m.may_be_diffuse() && m.metallic < 1.0 && plain && !m.is_emissive() && reflects(m) > WHITEST {
            found.push(Finding {
                severity: Severity::Doubtful,
                kind: "albedo",
                place: place.clone(),
                problem: format!(
                    "it reflects {:.1} % of the light: in a closed room that hardly ever dies out",
                    100.0 * reflects(m)
                ),
                remedy: "lower its base colour: white paint has 0.8 (sRGB 231), and nothing more than 0.95",
            });
        }
        if m.is_emissive() && m.emissive.max_channel() > BRIGHTEST {
            found.push(Finding {
                severity: Severity::Doubtful,
                kind: "light",
                place,
                problem: format!("it shines with {:.1e} cd/m2, more than the sun", m.emissive.max_channel()),
                remedy: "check its emissiveStrength: a ceiling panel has 2000 to 10000 cd/m2",
            });
        }
    }
}

/// Largest channel that a material without textures reflects.
fn reflects(m: &Material) -> f32 {
    m.base_color.max_channel() * (1.0 - m.transmission)
}

/// No light, lamps that are off, or a level that no room has.
pub fn levels(world: &World, found: &mut Vec<Finding>) {
    let scene = &world.scene;
    for (i, lamp) in scene.lights.iter().enumerate() {
        let place = format!("light {i} \"{}\"", lamp.name);
        let bright = lamp.intensity.max_channel();
        if bright == 0.0 {
            found.push(Finding {
                severity: Severity::Doubtful,
                kind: "light",
                place,
                problem: "its intensity is 0".into(),
                remedy: "give it an intensity, or take it out",
            });
        } else if bright > 1e6 {
            let unit = if matches!(lamp.kind, LightKind::Directional { .. }) { "lx" } else { "cd" };
            found.push(Finding {
                severity: Severity::Doubtful,
                kind: "light",
                place,
                problem: format!("{bright:.1e} {unit} is beyond any lamp of a room"),
                remedy: "check the unit: a bulb of 800 lm has 64 cd, the sun 100000 lx (Blender: export Standard, not Unitless)",
            });
        }
    }
    if world.emitters.is_empty() {
        if scene.sky.is_none() && !scene.mesh.triangles.is_empty() && scene.materials.iter().all(|m| !m.unlit)
        {
            found.push(Finding {
                severity: Severity::Wrong,
                kind: "light",
                place: "the scene".into(),
                problem: "nothing shines in it: the picture will be black".into(),
                remedy: "add a lamp or an emissive surface, or render with --sky 1000",
            });
        }
        return;
    }
    let far = |l: &EmitterKind| match l {
        EmitterKind::Sky(_) => true,
        EmitterKind::Punctual(lamp) => matches!(lamp.kind, LightKind::Directional { .. }),
        _ => false,
    };
    // Flux over the sides of the room's size: the level of the first bounce; a sun's is its own.
    let side = world.scale.max(1e-6);
    let level: f32 = world
        .emitters
        .lights()
        .iter()
        .zip(world.emitters.power())
        .map(|(light, power)| match light {
            EmitterKind::Punctual(lamp) if far(light) => lamp.intensity.luminance(),
            EmitterKind::Sky(sky) => PI * sky.mean().luminance(),
            _ => power.luminance() / (6.0 * side * side),
        })
        .sum();
    if !(LEVELS[0]..=LEVELS[1]).contains(&level) {
        let dark = level < LEVELS[0];
        found.push(Finding {
            severity: Severity::Doubtful,
            kind: "light",
            place: "the scene".into(),
            problem: format!("all lamps together give about {level:.1e} lx in a room of {side:.2} m"),
            remedy: match dark {
                true => "check the units of lamps and of lengths: glTF has metres, cd and cd/m2; an office has 500 lx",
                false => "check the units of lamps and of lengths (millimetres taken for metres?); an office has 500 lx",
            },
        });
    }
}
