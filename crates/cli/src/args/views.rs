//! Which pictures of a scene are asked for.

use crate::values;
use clap::Args;
use std::ops::Range;

/// Sequences of views.
#[derive(Clone, Debug, Default, Args)]
pub struct ViewArgs {
    /// Frames of the file's animation, or of --orbit or --walk: 0..120 is 120 of them, 7 is one
    #[arg(long, value_name = "A..B", value_parser = values::frames, help_heading = "Sequences")]
    pub frames: Option<Range<u32>>,
    /// Frames of the animation in a second; 24 if absent
    #[arg(long, value_name = "N", value_parser = values::positive, help_heading = "Sequences")]
    pub fps: Option<f32>,
    /// N views on a circle around what the camera looks at
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Sequences")]
    pub orbit: Option<u32>,
    /// Views along a line through these places (m), looking ahead: "0,1.6,3 2,1.6,0"
    #[arg(long, value_name = "X,Y,Z X,Y,Z ...", conflicts_with = "orbit", allow_hyphen_values = true, value_parser = values::places, help_heading = "Sequences")]
    pub walk: Option<values::Places>,
    /// Views of the whole walk; 24 between two places if absent
    #[arg(long, value_name = "N", requires = "walk", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Sequences")]
    pub steps: Option<u32>,
    /// Leave out pictures that were finished before
    #[arg(long, help_heading = "Sequences")]
    pub skip_existing: bool,
}
