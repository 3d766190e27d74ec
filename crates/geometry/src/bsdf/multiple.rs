//! Light that bounces more than once between the microfacets of what only reflects: metal, and coats as bright.
//!
//! Single scattering loses it. Where the lobe is narrow it comes out near where the rest goes, so the lobe is made
//! that much stronger; where it is wide it comes out in all directions, so it joins the diffuse light, which the
//! radiosity carries (C. Kulla and A. Conty, "Revisiting Physically Based Shading at Imageworks", SIGGRAPH 2017 course).

use super::albedo;
use crate::Rgb;

/// A lobe that loses more than this on the average gives it to the diffuse light: from a roughness of 0.32 on.
const WIDE: f32 = 0.03;
/// Where all reflect less than this, what bounces twice is not worth a lobe: 0.6 % of the light at F0 = 0.1 and
/// roughness 1, 0.2 % for the usual 0.04.
const FAINT: f32 = 0.1;

/// From this width α on, what bounces between the facets leaves diffusely.
pub fn is_wide(alpha: f32) -> bool {
    alpha > 0.0 && 1.0 - albedo::hemispherical(alpha).all > WIDE
}

/// Share of the light that meets a second facet which gets out at last, by the reflectance at normal incidence.
///
/// The geometric series of bounces F̅ (1 − E̅) F̅ …, of which E̅ leaves each time, with Schlick's cosine-weighted
/// mean F̅ = F0 + (1 − F0)/21. White loses nothing, a coloured metal grows deeper in colour.
pub fn regained(alpha: f32, f0: Rgb) -> Rgb {
    if alpha == 0.0 || f0.max_channel() < FAINT {
        return Rgb::BLACK;
    }
    let e = albedo::hemispherical(alpha).all;
    f0.map(|f0| {
        let f = f0 + (1.0 - f0) / 21.0;
        f * f * e / (1.0 - f * (1.0 - e))
    })
}

/// By how much to strengthen a narrow lobe whose facets reflect everything: 1/√(E(θo) E(θi)) − 1. Reciprocal, and exact
/// as far as E does not change within the lobe.
pub fn strengthening(alpha: f32, cos_o: f32, cos_i: f32) -> f32 {
    let e = albedo::directional(alpha, cos_o).all * albedo::directional(alpha, cos_i).all;
    1.0 / e.max(0.25).sqrt() - 1.0
}
