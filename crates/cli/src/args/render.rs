//! `twolight render`.

use super::{LightArgs, RunArgs, ViewArgs, WhichArgs};
use crate::values;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight render room.glb -o room.exr                       2 % error, 512 pixels on the shorter side
  twolight render room.glb -o room.exr --error 1% --size 1920x1080
  twolight render room.glb -o room.exr --preview room.png    also a picture to look at
  twolight render room.glb -o room.exr --camera all          room.Kitchen.exr, room.Hall.exr, ...
  twolight render room.glb -o walk.####.exr --frames 0..120  the file's animation: walk.0000.exr, ...
  twolight render room.glb -o turn.####.exr --orbit 36       around what the camera looks at
  twolight render room.glb -o room.exr --time-limit 60s      the best that a minute gives
  twolight render room.glb -o room.exr --solution room.twl   what `twolight solve` found, for another view
  twolight render room.glb -o room.exr --light Lamp=0.5,0.4,0.3   dimmed and tinted
  twolight render room.glb -o room.exr --sky 1000            an even sky of 1000 cd/m2, if no lamp is in the file
  twolight render room.glb -o ref.exr --integrator path --spp 4096
  twolight render room.glb -o room.exr --solver progressive --diffuse vertex --snapshots --preview room.png

The EXR holds R,G,B,A and the layers direct, indirect, specular, emission (their sum is R,G,B), albedo,
normal, depth, position, irradiance (lx) and variance. The same seed gives the same file, whatever the
number of threads. Ctrl-C saves what there is, marked unfinished; a second Ctrl-C quits at once.")]
pub struct RenderArgs {
    /// Scene, .gltf or .glb
    pub scene: PathBuf,
    /// Picture to write, .exr; an old one is replaced once the new one is complete. #### stands for a frame's number
    #[arg(short, long, value_name = "OUT.exr")]
    pub output: PathBuf,
    /// Also write an 8-bit sRGB picture to look at; while it works, P.partial.png shows how far it is
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
    #[command(flatten)]
    pub views: ViewArgs,
    /// Pixels, such as 1920x1080; 512 on the shorter side if absent
    #[arg(long, value_name = "WxH", conflicts_with = "width", value_parser = values::size)]
    pub size: Option<(u32, u32)>,
    /// Pixels across; the camera's aspect gives the height
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u32).range(1..))]
    pub width: Option<u32>,
    /// Error to aim at: the one knob of quality, which sets rays, mesh and samples; 2 % if absent, or that of the solution
    #[arg(long, value_name = "PERCENT", value_parser = values::share)]
    pub error: Option<f32>,
    /// Take the indirect light from this file, made by `solve`
    #[arg(long, value_name = "ROOM.twl")]
    pub solution: Option<PathBuf>,
    /// Stop after this time with what there is, each picture of several: 60s, 5m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    pub time_limit: Option<Duration>,
    #[command(flatten)]
    pub light: LightArgs,
    /// How the light is found
    #[arg(long, value_enum, default_value_t = IntegratorArg::Hybrid, help_heading = "Methods")]
    pub integrator: IntegratorArg,
    /// Paths through each pixel, with --integrator path; 256 if absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Methods")]
    pub spp: Option<u32>,
    /// How the hybrid shades diffuse surfaces; `split` if absent
    #[arg(long, value_enum, help_heading = "Methods")]
    pub diffuse: Option<DiffuseArg>,
    /// How the radiosity is solved; `gather` if absent
    #[arg(long, value_enum, help_heading = "Classical radiosity")]
    pub solver: Option<SolverArg>,
    /// Patches at most, in place of what --error asks for; a scene with more triangles keeps its own
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Classical radiosity")]
    pub patches: Option<u32>,
    /// Form factors by a hemicube, N pixels along an edge, in place of rays from all over a patch
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=2048), help_heading = "Classical radiosity")]
    pub hemicube: Option<u32>,
    /// Patches to vertices by the rule of 1985, which is not exact about energy
    #[arg(long, help_heading = "Classical radiosity")]
    pub corner_rule: bool,
    /// Matrix: make form factors reciprocal
    #[arg(long, help_heading = "Classical radiosity")]
    pub reciprocal: bool,
    /// Progressive: shoot what is going to arrive beforehand
    #[arg(long, help_heading = "Classical radiosity")]
    pub overshoot: bool,
    /// Progressive: do not show light that is yet to be shot as if it were spread evenly
    #[arg(long, help_heading = "Classical radiosity")]
    pub no_ambient: bool,
    /// Progressive: also write the picture after 0, 1, 2, 5, 10, 20, 50 ... shots, and with --preview one with and
    /// without radiosity side by side
    #[arg(long, help_heading = "Classical radiosity")]
    pub snapshots: bool,
    /// Also write what each lamp adds, as layers light.NAME of the EXR, which sum to the picture
    #[arg(long)]
    pub light_layers: bool,
    /// Rays from each vertex (or patch), in place of what --error asks for
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Methods")]
    pub gather_rays: Option<u32>,
    /// Rays through each pixel, in place of what --error asks for
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Methods")]
    pub samples: Option<u32>,
    /// Do not measure the picture's error by probes, nor go on where it is missed
    #[arg(long)]
    pub no_verify: bool,
    #[command(flatten)]
    pub run: RunArgs,
}

/// `--integrator`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IntegratorArg {
    /// Radiosity at vertices, then rays: fast, without noise
    Hybrid,
    /// Path tracing: slow, the reference
    Path,
}

/// `--solver`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SolverArg {
    /// Rays gathered at the vertices of a mesh that is fine where light bends
    Gather,
    /// All form factors of constant patches, by Gauss and Seidel's iteration (1984)
    Matrix,
    /// The brightest patch shoots, again and again (1988)
    Progressive,
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
