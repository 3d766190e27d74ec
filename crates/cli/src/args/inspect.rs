//! `twolight inspect`.

use super::WhichArgs;
use crate::values;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `inspect`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight inspect room.glb --json | jq .cameras
  twolight inspect room.glb --plan --error 1%                what light is in it, and how it will be found")]
pub struct InspectArgs {
    /// Scene, .gltf or .glb; or a solution, .twl
    pub scene: PathBuf,
    /// Say instead what light each camera sees, and how a render will find it
    #[arg(long)]
    pub plan: bool,
    /// Error that the render would be asked for
    #[arg(long, value_name = "PERCENT", default_value = "2%", requires = "plan", value_parser = values::share)]
    pub error: f32,
    #[command(flatten)]
    pub which: WhichArgs,
    /// Print as JSON
    #[arg(long)]
    pub json: bool,
}
