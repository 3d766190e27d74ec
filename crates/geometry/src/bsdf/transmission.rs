//! Glossy transmission: the lobe mirrored through a thin wall, or refraction into a volume.

use super::Transport;
use super::layers::Layers;
use super::reflection;
use crate::Rgb;
use crate::math::Vec3;

/// f, 1/sr; `wo` local above the horizon, `wi` below.
///
/// A thin wall is the reflection lobe turned inside out. A volume follows Walter et al. 2007, eq. 21:
/// ```text
/// f = |i·h| |o·h| / (|cos θi| |cos θo|) · η² T D G / (η o·h + i·h)²,   η = n_o / n_i
/// ```
/// for radiance; importance has no η² (see [`Transport`]).
pub fn eval(layers: &Layers, wo: Vec3, wi: Vec3, transport: Transport) -> Rgb {
    let ggx = layers.ggx;
    if !layers.refracts() {
        let mirrored = Vec3::new(wi.x, wi.y, -wi.z);
        let Some(h) = (wo + mirrored).try_normalize() else { return Rgb::BLACK };
        let shape = ggx.d(h) * ggx.g2_reflection(wo, mirrored) / (4.0 * wo.z * mirrored.z);
        return layers.transmission(wo.dot(h)) * shape;
    }
    let Some((h, jacobian)) = facet(layers.eta(), wo, wi) else { return Rgb::BLACK };
    let cos_o = wo.dot(h);
    let shape = cos_o * jacobian * ggx.d(h) * ggx.g2_transmission(wo, wi) / (wo.z * -wi.z);
    layers.transmission(cos_o) * (shape * eta_squared(layers, transport))
}

/// Density over wi, 1/sr, of sending `wo` through a visible microfacet, whatever the Fresnel term, and that facet.
pub fn pdf(layers: &Layers, wo: Vec3, wi: Vec3) -> Option<(f32, Vec3)> {
    if !layers.refracts() {
        return reflection::pdf(layers.ggx, wo, Vec3::new(wi.x, wi.y, -wi.z));
    }
    let (h, jacobian) = facet(layers.eta(), wo, wi)?;
    Some((layers.ggx.pdf_visible(wo, h) * jacobian, h))
}

/// What radiance gains on its way from wi's medium to wo's; 1 for importance and for thin walls.
pub fn eta_squared(layers: &Layers, transport: Transport) -> f32 {
    match transport {
        Transport::Radiance => layers.eta() * layers.eta(),
        Transport::Importance => 1.0,
    }
}

/// The microfacet that refracts `wo` into `wi`, and dωh/dωi = |i·h| / (η o·h + i·h)² (Walter 2007, eq. 17).
fn facet(eta: f32, wo: Vec3, wi: Vec3) -> Option<(Vec3, f32)> {
    let h = (wo * eta + wi).try_normalize()?;
    let h = if h.z < 0.0 { -h } else { h };
    let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
    // Both must see the facet from their own side, or it does not refract one into the other.
    if cos_o <= 0.0 || cos_i >= 0.0 {
        return None;
    }
    let denominator = eta * cos_o + cos_i;
    Some((h, -cos_i / (denominator * denominator)))
}
