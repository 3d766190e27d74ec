//! `twolight compare`.

use crate::values;
use clap::Args;
use std::path::PathBuf;

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
