//! What was typed: a file for each subcommand, and here what several share.

mod bake;
mod compare;
mod false_colour;
mod inspect;
mod measure;
mod render;
mod solve;
mod views;

pub use bake::BakeArgs;
pub use compare::CompareArgs;
pub use false_colour::{FalseColourArgs, FalseColourCommand, ScaleArg};
pub use inspect::InspectArgs;
pub use measure::MeasureArgs;
pub use render::{DiffuseArg, IntegratorArg, RenderArgs, SolverArg};
pub use solve::SolveArgs;
pub use views::ViewArgs;

use crate::values::{self, SkyValue};
use clap::{Args, Parser, Subcommand};
use geometry::Rgb;
use std::path::PathBuf;

/// Render glTF rooms in physical units: radiosity once, rays for the rest.
#[derive(Debug, Parser)]
#[command(
    name = "twolight",
    version,
    arg_required_else_help = true,
    after_help = "Results go to stdout, progress and warnings to stderr.\n\
                  Exit status: 0 done, 1 failed, 2 asked wrongly, 3 written but not as exact as asked.\n\n\
                  Start with:\n  \
                  twolight inspect room.glb\n  \
                  twolight render room.glb -o room.exr --preview room.png"
)]
pub struct Cli {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to an EXR file with its layers, in cd/m2
    Render(Box<RenderArgs>),
    /// Solve a room's indirect light once, for any view of it, into a file
    Solve(SolveArgs),
    /// Bake a scene's light into a .glb that any viewer shows
    Bake(BakeArgs),
    /// Show what is in a scene, what lights it, and what is wrong with it
    Inspect(InspectArgs),
    /// Measure illuminance in a scene, in lx: at points, on planes and on surfaces
    Measure(Box<MeasureArgs>),
    /// Show the luminance or illuminance of a picture in false colour
    FalseColour(FalseColourCommand),
    /// Measure how far a picture is from a reference
    Compare(CompareArgs),
    /// Print completions for a shell: source <(twolight completions bash)
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
    },
    /// Print the manual page: twolight man | man -l -
    Man,
}

/// What of a file to show.
#[derive(Clone, Debug, Default, Args)]
pub struct WhichArgs {
    /// Scene by name or number; the file's default if absent
    #[arg(long = "scene", value_name = "NAME|NUMBER", id = "which-scene")]
    pub scene: Option<String>,
    /// Variant of the materials by name (KHR_materials_variants); the default ones if absent
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Time in the first animation, in seconds; the rest pose if absent
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::number)]
    pub time: Option<f32>,
}

/// What shines, beside and instead of what the file says.
#[derive(Clone, Debug, Default, Args)]
pub struct LightArgs {
    /// Make the lamps of this name (of light, emissive material, or `sky`) so many times as bright: 0 is off; R,G,B tints
    #[arg(long = "light", value_name = "NAME=FACTOR", value_parser = values::light)]
    pub lights: Vec<(String, Rgb)>,
    /// Let the point or spot lamps of this name shine as a photometric file (IES LM-63) says, aimed along -z of their nodes
    #[arg(long = "ies", value_name = "NAME=FILE", value_parser = values::web)]
    pub webs: Vec<(String, PathBuf)>,
    /// Light from beyond the scene: a panorama (.hdr, .exr) or an even radiance in cd/m2, V or R,G,B
    #[arg(long, value_name = "FILE|R,G,B", value_parser = values::sky)]
    pub sky: Option<SkyValue>,
    /// Factor on the sky
    #[arg(long, value_name = "FACTOR", default_value = "1", requires = "sky", value_parser = values::strength)]
    pub sky_strength: f32,
}

/// How the program runs, whatever it does.
#[derive(Clone, Copy, Debug, Args)]
pub struct RunArgs {
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Threads to use; one for each processor if absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
    /// No progress, notes or warnings
    #[arg(short, long)]
    pub quiet: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
