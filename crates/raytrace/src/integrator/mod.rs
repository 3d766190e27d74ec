//! Light along one camera ray: which methods there are, and the layers they all sort their light into.

pub mod final_gather;
pub mod hybrid;
pub mod path;

use geometry::{Rgb, Vec3};

/// Radiance toward the eye, cd/m², by what happened at the first surface that did not let the ray straight on.
///
/// In Heckbert's letters, from light to eye, with S for every lobe that is not diffuse and windows left out:
/// emission `LE`, direct `LDE`, indirect `L(D|S)+DE`, specular `L(D|S)*SE`. Each path is in one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layers {
    /// Light of lamps and sky that the diffuse lobe received straight from them, panes and alpha between included.
    pub direct: Rgb,
    /// Light that the diffuse lobe received over other surfaces.
    pub indirect: Rgb,
    /// All that came through another lobe.
    pub specular: Rgb,
    /// Lamps and sky themselves.
    pub emission: Rgb,
}

impl Layers {
    /// The sum, cd/m².
    pub fn total(&self) -> Rgb {
        self.direct + self.indirect + self.specular + self.emission
    }
}

/// The first surface that did not let the camera ray straight on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Share of a uniform light that the diffuse lobe sends back, [0, 1].
    pub albedo: Rgb,
    /// Unit shading normal on the eye's side.
    pub normal: Vec3,
    /// World space, m.
    pub position: Vec3,
    /// Along the camera ray, m.
    pub depth: f32,
}
