//! Glossy reflection: metal, coat and the outside of glass, which share one width.

use super::ggx::Ggx;
use super::layers::Layers;
use crate::Rgb;
use crate::math::Vec3;

/// f = F D G / (4 cos θo cos θi), 1/sr; both directions local, above the horizon.
pub fn eval(layers: &Layers, wo: Vec3, wi: Vec3) -> Rgb {
    let ggx = Ggx { alpha: layers.alpha() };
    let Some(h) = (wo + wi).try_normalize() else { return Rgb::BLACK };
    layers.reflection(wo.dot(h)) * (ggx.d(h) * ggx.g2_reflection(wo, wi) / (4.0 * wo.z * wi.z))
}

/// Density over wi, 1/sr, of mirroring `wo` at a visible microfacet, whatever the Fresnel term, and that facet.
pub fn pdf(alpha: f32, wo: Vec3, wi: Vec3) -> Option<(f32, Vec3)> {
    let ggx = Ggx { alpha };
    let h = (wo + wi).try_normalize()?;
    // dωh/dωi = 1/(4 wo·h); the wo·h of the visible normals cancels.
    Some((ggx.g1(wo) * ggx.d(h) / (4.0 * wo.z), h))
}
