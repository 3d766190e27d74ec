//! What was typed.

use crate::values::{self, SkyValue};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

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
    /// Show what is in a scene, what lights it, and what is wrong with it
    Inspect(InspectArgs),
    /// Measure how far a picture is from a reference
    Compare(CompareArgs),
}

/// Arguments of `render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight render room.glb -o room.exr                       2 % error, 512 pixels on the shorter side
  twolight render room.glb -o room.exr --error 1% --size 1920x1080
  twolight render room.glb -o room.exr --preview room.png    also a picture to look at
  twolight render room.glb -o room.exr --camera all          room.Kitchen.exr, room.Hall.exr, ...
  twolight render room.glb -o room.exr --time-limit 60s      the best that a minute gives
  twolight render room.glb -o room.exr --sky 1000            an even sky of 1000 cd/m2, if no lamp is in the file
  twolight render room.glb -o ref.exr --integrator path --spp 4096

The EXR holds R,G,B,A and the layers direct, indirect, specular, emission (their sum is R,G,B), albedo,
normal, depth, position, irradiance (lx) and variance. The same seed gives the same file, whatever the
number of threads. Ctrl-C saves what there is, marked unfinished; a second Ctrl-C quits at once.")]
pub struct RenderArgs {
    /// Scene, .gltf or .glb
    pub scene: PathBuf,
    /// Picture to write, .exr; an old one is replaced once the new one is complete
    #[arg(short, long, value_name = "OUT.exr")]
    pub output: PathBuf,
    /// Also write an 8-bit sRGB picture to look at
    #[arg(long, value_name = "P.png")]
    pub preview: Option<PathBuf>,
    /// Exposure value (EV at ISO 100) of the preview; automatic if absent, and then printed
    #[arg(long, value_name = "EV", requires = "preview", allow_negative_numbers = true, value_parser = values::number)]
    pub exposure: Option<f32>,
    #[command(flatten)]
    pub which: WhichArgs,
    /// Camera by name or by its number in `inspect`, or `all`; the first if absent
    #[arg(long, value_name = "NAME|NUMBER|all")]
    pub camera: Option<String>,
    /// Pixels, such as 1920x1080; 512 on the shorter side if absent
    #[arg(long, value_name = "WxH", conflicts_with = "width", value_parser = values::size)]
    pub size: Option<(u32, u32)>,
    /// Pixels across; the camera's aspect gives the height
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u32).range(1..))]
    pub width: Option<u32>,
    /// Error to aim at: the one knob of quality, which sets rays, mesh and samples
    #[arg(long, value_name = "PERCENT", default_value = "2%", value_parser = values::share)]
    pub error: f32,
    /// Stop after this time with what there is: 60s, 5m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    pub time_limit: Option<Duration>,
    /// Light from beyond the scene: a panorama (.hdr, .exr) or an even radiance in cd/m2, V or R,G,B
    #[arg(long, value_name = "FILE|R,G,B", value_parser = values::sky)]
    pub sky: Option<SkyValue>,
    /// Factor on the sky
    #[arg(long, value_name = "FACTOR", default_value = "1", requires = "sky", value_parser = values::strength)]
    pub sky_strength: f32,
    /// How the light is found
    #[arg(long, value_enum, default_value_t = IntegratorArg::Hybrid, help_heading = "Methods")]
    pub integrator: IntegratorArg,
    /// Paths through each pixel, with --integrator path; 256 if absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Methods")]
    pub spp: Option<u32>,
    /// How the hybrid shades diffuse surfaces; `split` if absent
    #[arg(long, value_enum, help_heading = "Methods")]
    pub diffuse: Option<DiffuseArg>,
    /// Rays from each vertex, in place of what --error asks for
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Methods")]
    pub gather_rays: Option<u32>,
    /// Rays through each pixel, in place of what --error asks for
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Methods")]
    pub samples: Option<u32>,
    /// Do not measure the picture's error by probes, nor go on where it is missed
    #[arg(long)]
    pub no_verify: bool,
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

/// `--integrator`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IntegratorArg {
    /// Radiosity at vertices, then rays: fast, without noise
    Hybrid,
    /// Path tracing: slow, the reference
    Path,
}

/// `--diffuse`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DiffuseArg {
    /// All light from the vertices: fastest, shadows as coarse as the mesh
    Vertex,
    /// Indirect light from the vertices, direct light for each pixel
    Split,
    /// A bounce of rays for each pixel: slowest
    Gather,
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

/// Arguments of `inspect`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight inspect room.glb --json | jq .cameras
  twolight inspect room.glb --plan --error 1%                what light is in it, and how it will be found")]
pub struct InspectArgs {
    /// Scene, .gltf or .glb
    pub scene: PathBuf,
    #[command(flatten)]
    pub which: WhichArgs,
    /// Say instead what light each camera sees, and how a render will find it
    #[arg(long)]
    pub plan: bool,
    /// Error that the render would be asked for
    #[arg(long, value_name = "PERCENT", default_value = "2%", requires = "plan", value_parser = values::share)]
    pub error: f32,
    /// Print as JSON
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight compare out.exr ref.exr
  twolight compare out.exr ref.exr --difference where.png    where the error is, in false colour
  twolight compare out.exr ref.exr --max-error 3%            fails (1) if the error is larger

error is the root of the mean squared error relative to each pixel's brightness; flip, in [0, 1], says
how much the eye would notice. Where ref.a.exr and ref.b.exr, independent halves of the reference, lie
beside ref.exr, the reference's own noise is removed.")]
pub struct CompareArgs {
    /// Picture, .exr
    pub picture: PathBuf,
    /// Reference, .exr, of the same size
    pub reference: PathBuf,
    /// Write the error of each pixel: .png in false colour (black 0.1 %, pale yellow 100 %), .exr as numbers
    #[arg(long, value_name = "D.png|D.exr")]
    pub difference: Option<PathBuf>,
    /// Leave out FLIP, the slowest of the numbers
    #[arg(long)]
    pub no_flip: bool,
    /// Fail if the error is larger
    #[arg(long, value_name = "PERCENT", value_parser = values::share)]
    pub max_error: Option<f32>,
    /// Print as JSON, in percent (flip in [0, 1])
    #[arg(long)]
    pub json: bool,
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
