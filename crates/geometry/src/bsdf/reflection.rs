//! Glossy reflection: metal, coat and the outside of glass, which share one width.

use super::ggx::Ggx;
use super::layers::Layers;
use crate::Rgb;
use crate::math::Vec3;

/// f = F D G / (4 cos θo cos θi), 1/sr, and what bounces between narrow facets besides; both directions local, above
/// the horizon.
pub fn eval(layers: &Layers, wo: Vec3, wi: Vec3) -> Rgb {
    let ggx = layers.ggx;
    let Some(h) = (wo + wi).try_normalize() else { return Rgb::BLACK };
    let cos = wo.dot(h);
    let reflected = layers.reflection(cos) + layers.regained(cos, wo.z, wi.z);
    reflected * (ggx.d(h) * ggx.g2_reflection(wo, wi) / (4.0 * wo.z * wi.z))
}

/// Density over wi, 1/sr, of mirroring `wo` at a visible microfacet, whatever the Fresnel term, and that facet.
pub fn pdf(ggx: Ggx, wo: Vec3, wi: Vec3) -> Option<(f32, Vec3)> {
    let h = (wo + wi).try_normalize()?;
    // dωh/dωi = 1/(4 wo·h); the wo·h of the visible normals cancels.
    Some((ggx.g1(wo) * ggx.d(h) / (4.0 * wo.z), h))
}
