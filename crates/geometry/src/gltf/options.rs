//! What of a file to show.

use std::sync::Arc;

use super::limits::Limits;
use crate::ies::Web;

/// Which of the things that a file offers are loaded, and how much of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Name or number of the scene; the file's own choice if absent.
    pub scene: Option<String>,
    /// Name of the materials' variant (KHR_materials_variants); the file's default if absent.
    pub variant: Option<String>,
    /// Time in the first animation, s; the rest pose if absent.
    pub time: Option<f32>,
    /// Photometric webs for lamps by name, in place of what the file says of their intensity.
    pub webs: Vec<(String, Arc<Web>)>,
    /// Bounds on what the file may ask for.
    pub limits: Limits,
}
