//! `twolight solve`.

use super::{LightArgs, RunArgs, WhichArgs};
use crate::values;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `solve`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight solve room.glb -o room.twl                        the light of the whole room, once
  twolight render room.glb -o a.exr --solution room.twl --camera Hall
  twolight render room.glb -o b.exr --solution room.twl --light 'Desk lamp=0' --light sky=1,0.8,0.6

The file belongs to the scene: changed geometry or materials are refused, lamps may be dimmed and tinted, in
the glTF as well as by --light. While it works, what was gathered is in OUT.twl.partial: a solve that was
stopped, even killed, goes on from there when the same command is given again, to the same bytes.")]
pub struct SolveArgs {
    /// Scene, .gltf or .glb
    pub scene: PathBuf,
    /// Solution to write, .twl
    #[arg(short, long, value_name = "OUT.twl")]
    pub output: PathBuf,
    #[command(flatten)]
    pub which: WhichArgs,
    /// Take care of what this camera sees (a name, its number in `inspect`, or `all`); all of the room alike if absent
    #[arg(long, value_name = "NAME|NUMBER|all")]
    pub camera: Option<String>,
    /// Error of the pictures it is for
    #[arg(long, value_name = "PERCENT", default_value = "2%", value_parser = values::share)]
    pub error: f32,
    #[command(flatten)]
    pub light: LightArgs,
    #[command(flatten)]
    pub run: RunArgs,
}
