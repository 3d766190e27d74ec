//! `twolight false-colour`, and what any false-colour picture can be told.

use crate::values;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `false-colour`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  twolight false-colour room.exr -o luminance.png                  cd/m2, up to a round value
  twolight false-colour room.exr -o lux.png --layer irradiance --max 500 --isolines 100,200,300
  twolight false-colour room.exr -o glare.png --scale log --max 10000")]
pub struct FalseColourCommand {
    /// Picture, .exr
    pub picture: PathBuf,
    /// False-colour picture to write, .png
    #[arg(short, long, value_name = "OUT.png")]
    pub output: PathBuf,
    /// Which layer of the file to show the luminance of; the picture itself if absent
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,
    #[command(flatten)]
    pub colours: FalseColourArgs,
    /// Print the values' statistics and the scale as JSON
    #[arg(long)]
    pub json: bool,
}

/// Scale and lines of a false-colour picture.
#[derive(Clone, Debug, Args)]
pub struct FalseColourArgs {
    /// How colours follow values
    #[arg(long, value_enum, default_value_t = ScaleArg::Linear, help_heading = "False colour")]
    pub scale: ScaleArg,
    /// Value of the brightest colour; a round one above what there is if absent
    #[arg(long, value_name = "VALUE", value_parser = values::length, help_heading = "False colour")]
    pub max: Option<f32>,
    /// Draw lines of equal value at these; `measure` draws some if absent, and `none` is none
    #[arg(long, value_name = "A,B,...", value_parser = values::levels, help_heading = "False colour")]
    pub isolines: Option<values::Levels>,
}

/// `--scale`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum ScaleArg {
    /// From 0
    Linear,
    /// Three decades
    Log,
}
