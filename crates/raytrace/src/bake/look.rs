//! What becomes of each material: a viewer without lamps shows glTF's unlit materials only.

use super::light::{Place, roughly};
use super::{Light, Settings, Target};
use geometry::sampling::{self, Rng};
use geometry::{Material, World};
use radiosity::Solution;
use radiosity::element::Side;

/// How a material is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Unlit: base colour and its texture, times the light E/π.
    Reflecting,
    /// Unlit: the light is the whole radiance, its own and what it reflects.
    Glowing,
    /// Unlit: its emissive texture, for that is what one sees of it.
    Screen,
    /// As it is, and light is added to what lamps give it.
    Lit,
    /// As it is: it was unlit before, one sees through it, or it is a lamp among lit materials.
    Kept,
}

impl Look {
    /// Whether light is baked for it.
    pub fn takes_light(self) -> bool {
        matches!(self, Look::Reflecting | Look::Glowing | Look::Lit)
    }
}

/// A share of mirrored light from which a material is not itself without it: more than that of plastic.
const MIRRORS: f32 = 0.2;
/// Places at which own and reflected light are compared.
const PLACES: u32 = 64;

/// The look of each material, and what to say about it.
pub fn looks(world: &World, solution: &Solution, settings: &Settings) -> (Vec<Look>, Vec<String>) {
    let scene = &world.scene;
    let mut used = vec![Vec::new(); scene.materials.len()];
    for (t, m) in scene.mesh.materials.iter().enumerate() {
        if scene.mesh.area(t as u32) > 0.0 {
            used[m.0 as usize].push(t as u32);
        }
    }
    let looks: Vec<Look> = scene
        .materials
        .iter()
        .zip(&used)
        .map(|(m, triangles)| look(world, solution, settings, m, triangles))
        .collect();
    let named = |which: &dyn Fn(&Material, Look) -> bool| -> Vec<String> {
        let of = scene.materials.iter().zip(&looks).zip(&used);
        of.filter(|((m, look), used)| !used.is_empty() && which(m, **look))
            .map(|((m, _), _)| format!("{:?}", m.name))
            .collect()
    };
    let all = settings.light == Light::All;
    let mut warnings = Vec::new();
    let mut say = |names: Vec<String>, what: &str| {
        if !names.is_empty() {
            warnings.push(format!("{what}: {}", some_of(&names)));
        }
    };
    say(
        named(&|m, look| all && look == Look::Reflecting && m.has_specular(MIRRORS)),
        "what mirrors is shown matt, in its base colour, for light at a surface knows no eye",
    );
    say(
        named(&|m, look| look == Look::Kept && is_glass(m)),
        "glass keeps its own material and mirrors nothing unless the viewer has an environment",
    );
    say(
        named(&|m, look| all && look == Look::Reflecting && m.is_emissive()),
        "a faint glow is left out, for a viewer has one texture for both light and colour",
    );
    say(
        named(&|m, look| !all && look == Look::Kept && m.is_emissive()),
        "a lamp shows its own light, not what it reflects",
    );
    say(
        named(&|m, look| matches!(look, Look::Kept | Look::Lit) && m.has_lobes()),
        "clearcoat, sheen, film, brushed or translucent lobes are left out",
    );
    say(named(&|_, look| look == Look::Screen), "a screen shows its own light, not what it reflects");
    (looks, warnings)
}

fn look(
    world: &World,
    solution: &Solution,
    settings: &Settings,
    material: &Material,
    triangles: &[u32],
) -> Look {
    if material.unlit || is_glass(material) {
        return Look::Kept;
    }
    if settings.light == Light::Indirect {
        return if material.is_emissive() { Look::Kept } else { Look::Lit };
    }
    if !material.is_emissive() {
        return Look::Reflecting;
    }
    let textured = material.emissive_texture.is_some();
    if !textured || matches!(settings.to, Target::Lightmap { .. }) {
        return Look::Glowing;
    }
    let (mut own, mut reflected) = (0.0, 0.0);
    let mut rng = Rng::new(settings.seed, 0x6c6f_6f6b);
    for _ in 0..PLACES.min(PLACES * triangles.len() as u32) {
        let triangle = triangles[rng.below(triangles.len() as u32) as usize];
        let (u, v) = sampling::triangle(rng.vec2());
        let seen = roughly(world, solution, Place { triangle, uv: [u, v], side: Side::Front });
        let area = world.scene.mesh.area(triangle);
        own += area * seen.emission.luminance();
        reflected += area * (seen.base * seen.white).luminance();
    }
    if own >= reflected { Look::Screen } else { Look::Reflecting }
}

/// Whether one sees more through it than of it.
fn is_glass(material: &Material) -> bool {
    material.may_transmit() && material.transmission * (1.0 - material.metallic) >= 0.5
}

/// Some names, and how many more there are.
fn some_of(names: &[String]) -> String {
    const SHOWN: usize = 6;
    let shown = names[..names.len().min(SHOWN)].join(", ");
    if names.len() > SHOWN { format!("{shown} and {} more", names.len() - SHOWN) } else { shown }
}
