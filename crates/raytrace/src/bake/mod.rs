//! Light baked into a mesh that any viewer of glTF shows: at its vertices, or in a texture.
//!
//! ```text
//! Solution ─ look (what each material becomes) ─┬─ vertices (refine, sample, fit) ─┬─▶ Baked ─ document ─▶ .glb
//!   World ─ light (E/π at a place) ─────────────┴─ lightmap (atlas, texels) ───────┘
//! ```
//!
//! What a rasteriser can multiply is baked: E/π, the light that a white matt surface would send back, beside the base
//! colour and its texture, which stay what they are. So all that is opaque is shown matt; what mirrors or shines
//! by lobes of its own has lost them, and glass keeps its own material.

mod atlas;
mod document;
mod exposure;
mod fit;
mod light;
mod lightmap;
mod look;
mod materials;
#[cfg(test)]
mod tests;
mod vertices;

pub use document::{DocumentError, write};
pub use exposure::automatic_exposure;
pub use look::Look;

use crate::render::Progress;
use geometry::{Rgb, Vec2, Vec3, World};
use radiosity::Solution;

/// What is to be baked.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Which light.
    pub light: Light,
    /// Vertices or a texture.
    pub to: Target,
    /// Error to aim at, relative: 0.05 for 5 %.
    pub error: f32,
    /// Same seed, same file.
    pub seed: u64,
}

/// Which light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// All of it: materials become unlit.
    All,
    /// All but what point, spot and sun lamps give directly: these stay in the file, and materials stay lit.
    Indirect,
}

/// Where light is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// At vertices, `most` of them where the scene has not more of its own.
    Vertices {
        /// Vertices of the element mesh at most.
        most: usize,
    },
    /// In a square texture.
    Lightmap {
        /// Texels on a side at most.
        side: u32,
    },
}

/// A mesh with its light.
#[derive(Clone, Debug)]
pub struct Baked {
    /// What becomes of each material of the scene.
    pub looks: Vec<Look>,
    /// One for each part of the scene that has triangles left.
    pub parts: Vec<Part>,
    /// Radiance of each texel, cd/m²; `None` for light at vertices.
    pub map: Option<Map>,
    /// How it went.
    pub report: Report,
}

/// Triangles of one material, for one node.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Name of the node.
    pub name: String,
    /// Index into the scene's materials.
    pub material: u32,
    /// World space, m.
    pub positions: Vec<Vec3>,
    /// Unit.
    pub normals: Vec<Vec3>,
    /// The scene's uv sets; empty where it has none.
    pub uvs: [Vec<Vec2>; 2],
    /// Vertex colours and alpha of the scene; empty where it has none.
    pub colors: Vec<[f32; 4]>,
    /// Light at the vertices, cd/m², by the material's [`Look`]; empty where it keeps none there.
    pub light: Vec<Rgb>,
    /// Places in the light map; empty without one.
    pub map_uvs: Vec<Vec2>,
    /// Corners, counter-clockwise from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// A texture of light.
#[derive(Clone, Debug)]
pub struct Map {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, cd/m², rows from v = 0.
    pub texels: Vec<Rgb>,
    /// Opacity.
    pub alpha: Vec<f32>,
    /// Charts.
    pub charts: u32,
    /// Texels for a metre.
    pub density: f32,
    /// Share of the texels that hold a surface.
    pub covered: f32,
}

/// How a bake went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Vertices written.
    pub vertices: usize,
    /// Triangles written.
    pub triangles: usize,
    /// How far what is baked is off the light that was looked up, measured at places that it was not made from: root of the
    /// mean over the area of the squared difference relative to the brighter of both (a tenth of the mean stands for what is
    /// darker), luminance. The solution's own error is not in it. `None` where nothing is lit.
    pub error: Option<f32>,
    /// The same before the mesh was refined for direct light; vertices only.
    pub first_error: Option<f32>,
    /// Whether the mesh would have gone on, had it been allowed more vertices.
    pub out_of_vertices: bool,
    /// Light that the mesh or map sends back were it white, over that which it was made from: Σ A E of both.
    pub flux_kept: f32,
    /// What is shown otherwise than the file says: a line each.
    pub warnings: Vec<String>,
}

/// Bakes the light of `solution`, which was solved for `world`.
pub fn bake(world: &World, solution: &Solution, settings: &Settings, progress: &dyn Progress) -> Baked {
    let (looks, warnings) = look::looks(world, solution, settings);
    let other = light::without_lamps(world, settings.light);
    let lit = other.as_ref().unwrap_or(world);
    let mut baked = match settings.to {
        Target::Vertices { most } => vertices::bake(lit, solution, looks, settings, most, progress),
        Target::Lightmap { side } => lightmap::bake(lit, solution, looks, settings, side, progress),
    };
    baked.report.warnings.splice(0..0, warnings);
    baked.report.vertices = baked.parts.iter().map(|p| p.positions.len()).sum();
    baked.report.triangles = baked.parts.iter().map(|p| p.triangles.len()).sum();
    baked
}
