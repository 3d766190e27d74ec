//! `twolight measure`.

use super::{FalseColourArgs, LightArgs, RunArgs, WhichArgs};
use crate::values;
use clap::Args;
use geometry::Vec3;
use std::path::PathBuf;

/// Arguments of `measure`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight measure room.glb --point 1,0.85,2                 illuminance there, facing up
  twolight measure room.glb --workplane 0.75 -o lux.csv --false-colour lux.png
  twolight measure room.glb --surface Floor --surface \"North wall\" --spacing 0.5
  twolight measure room.glb --plane \"0,1.2,0 4,0,0 0,0.6,0\"  a rectangle at eye height: corner and two edges
  twolight measure room.glb --points sensors.csv --json      x,y,z or x,y,z,nx,ny,nz in each line

Positions are metres, y up. Illuminance is in lx, direct, indirect and specular (by way of mirrors and glass
alone) apart, each with its standard error. U0 is least over mean, Ud least over greatest. Of a surface also
the luminance along its normal is given, in cd/m2, of its own and of diffuse light. Points within furniture,
or behind walls, are left out: those from where the surface straight above, or most surfaces around, show
their backs; on a work plane also those without a floor below.")]
pub struct MeasureArgs {
    /// Scene, .gltf or .glb
    pub scene: PathBuf,
    /// Measure at this point; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = values::vector)]
    pub point: Vec<Vec3>,
    /// Where the sensors of --point face
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", allow_hyphen_values = true, value_parser = values::vector)]
    pub normal: Vec3,
    /// Measure at the points of this file; those without a normal face up
    #[arg(long, value_name = "FILE.csv")]
    pub points: Option<PathBuf>,
    /// Measure on a level plane at this height over the floor; may be repeated
    #[arg(long, value_name = "HEIGHT", allow_negative_numbers = true, value_parser = values::number)]
    pub workplane: Vec<f32>,
    /// Height of the floor (y); the largest level with a room's height above it if absent
    #[arg(long, value_name = "Y", requires = "workplane", allow_negative_numbers = true, value_parser = values::number)]
    pub floor: Option<f32>,
    /// Leave out of --workplane what is nearer than this to a wall, or to anything else that stands as high
    #[arg(long, value_name = "METRES", default_value = "0", requires = "workplane", value_parser = values::strength)]
    pub margin: f32,
    /// Measure on a rectangle: its lower left corner, lower edge and left edge, as its sensors see it; may be repeated
    #[arg(long, value_name = "X,Y,Z X,Y,Z X,Y,Z", allow_hyphen_values = true, value_parser = values::rectangle)]
    pub plane: Vec<[Vec3; 3]>,
    /// Measure on the lit sides of the node or material of this name; may be repeated
    #[arg(long, value_name = "NAME")]
    pub surface: Vec<String>,
    /// Distance of points on planes and surfaces
    #[arg(long, value_name = "METRES", default_value = "0.25", value_parser = values::length)]
    pub spacing: f32,
    /// Also keep points within objects and behind walls
    #[arg(long)]
    pub keep_all: bool,
    /// Noise to aim at, of each point, with 95 % confidence; sets rays, and mesh
    #[arg(long, value_name = "PERCENT", default_value = "1%", value_parser = values::share)]
    pub error: f32,
    /// Take the light between surfaces from this file of `solve`
    #[arg(long, value_name = "ROOM.twl")]
    pub solution: Option<PathBuf>,
    /// Write every reading to this file
    #[arg(short, long, value_name = "LUX.csv")]
    pub output: Option<PathBuf>,
    /// Draw the planes and flat surfaces: with several of them, a file for each
    #[arg(long, value_name = "OUT.png")]
    pub false_colour: Option<PathBuf>,
    #[command(flatten)]
    pub colours: FalseColourArgs,
    #[command(flatten)]
    pub which: WhichArgs,
    #[command(flatten)]
    pub light: LightArgs,
    #[command(flatten)]
    pub run: RunArgs,
}
