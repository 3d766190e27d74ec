//! `twolight bake`.

use super::{LightArgs, RunArgs, WhichArgs};
use crate::values;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `bake`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight bake room.glb -o lit.glb                          light at vertices: textures stay as sharp as they are
  twolight bake room.glb -o lit.glb --lightmap 2048          light in a texture: shadows as sharp as its texels
  twolight bake room.glb -o lit.glb --exposure 9             as bright as render --exposure 9 shows it
  twolight bake room.glb -o lit.glb --indirect --lightmap 1024
                                                             for a viewer that lights the room by its lamps itself

Materials become unlit (KHR_materials_unlit) and COLOR_0 the light, so that every viewer shows the room as it
is without lamps or environment. What is opaque is shown matt; glass keeps its own material. Instances, skins
and morph targets become plain meshes in world space; nodes, materials, cameras and textures keep their names.
asset.extras says how to have physical values back.")]
pub struct BakeArgs {
    /// Scene, .gltf or .glb
    pub scene: PathBuf,
    /// Scene with its light to write, .glb; an old one is replaced once the new one is complete
    #[arg(short, long, value_name = "LIT.glb")]
    pub output: PathBuf,
    /// Light in a texture of at most N x N texels instead of at vertices
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub lightmap: Option<u32>,
    /// Vertices at most that the mesh is refined to where direct light has edges
    #[arg(long, value_name = "N", default_value_t = 200_000, conflicts_with = "lightmap")]
    pub vertices: usize,
    /// Leave out what point, spot and sun lamps give directly: they stay, and materials stay lit. The light is an
    /// emissive texture then, in cd/m2, with --lightmap; at vertices the attribute _IRRADIANCE, in lx, for a shader of
    /// your own
    #[arg(long)]
    pub indirect: bool,
    /// Exposure value (EV at ISO 100) that colours are for; automatic if absent, as of a preview from the first
    /// camera
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = values::number)]
    pub exposure: Option<f32>,
    #[command(flatten)]
    pub which: WhichArgs,
    /// Error of the light to aim at; 5 % if absent, or that of the solution
    #[arg(long, value_name = "PERCENT", value_parser = values::share)]
    pub error: Option<f32>,
    /// Bake this solution of `twolight solve`, in place of solving
    #[arg(long, value_name = "ROOM.twl")]
    pub solution: Option<PathBuf>,
    #[command(flatten)]
    pub light: LightArgs,
    #[command(flatten)]
    pub run: RunArgs,
}
