//! Where a ray that leaves a patch arrives: at every diffuse surface on its way through mirrors, glass and gloss (the
//! *extended* form factors of Sillion and Puech, SIGGRAPH 1989).
//!
//! Which way it took decides what light it may bring, so that every path is counted once (Heckbert's letters):
//! - straight: emission as direct light (`L D`, which pass 2 fetches for itself in its `split` mode), and what is reflected;
//! - by one rough surface: emission as indirect light (`L S D`), and what is reflected;
//! - by mirrors and glass: what is reflected only, for emission that comes this way is the photons' part ([`crate::caustic`]).

use crate::element::Side;
use crate::gather::ROUGH;
use crate::patches::Patches;
use geometry::math::offset_origin;
use geometry::sampling::Rng;
use geometry::{Passage, Ray, Rgb, World};

/// Surfaces that one ray meets at most.
const LONGEST: usize = 32;

/// How light came from one patch to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// With nothing on the way but what lets it straight through.
    Straight,
    /// By one rough surface.
    Rough,
    /// By mirrors, glass, or several surfaces.
    Specular,
}

/// Part of what left a patch, where it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// At which patch.
    pub patch: u32,
    /// By which way.
    pub way: Way,
    /// Share of the light that left.
    pub share: Rgb,
}

/// Follows `ray` and calls `arrive` with every patch on its way, the way so far and what is left of 1.
pub fn follow(
    world: &World,
    patches: &Patches,
    mut ray: Ray,
    rng: &mut Rng,
    mut arrive: impl FnMut(u32, Way, Rgb),
) {
    let mut left = Rgb::WHITE;
    let mut way = Way::Straight;
    let mut passage = Passage::default();
    for _ in 0..LONGEST {
        let Some(hit) = world.bvh.closest_hit(&ray) else { return };
        let mut surface = world.surface(&ray, &hit);
        left *= passage.meet(&mut surface, hit.t - ray.t_min, rng);
        if surface.coverage < 1.0 && rng.f32() >= surface.coverage {
            ray.t_min = hit.t;
            continue;
        }
        if surface.unlit.is_some() {
            return;
        }
        if let Some(patch) = patches.at(hit.triangle, hit.u, hit.v, Side::met(surface.front)) {
            arrive(patch, way, left);
        }
        if !surface.bsdf.has_specular() {
            return;
        }
        let on = surface.bsdf.specular_albedo(-ray.direction).luminance().min(1.0);
        if on <= 0.0 || rng.f32() >= on {
            return;
        }
        let Some(next) = surface.bsdf.sample_specular(-ray.direction, rng.array()) else { return };
        left *= next.weight * (1.0 / on);
        if !next.straight {
            let rough = surface.bsdf.glossy_roughness() >= ROUGH;
            way = if way == Way::Straight && rough { Way::Rough } else { Way::Specular };
        }
        left *= passage.leave(&surface, next.wi);
        let away = if next.wi.dot(surface.ng) > 0.0 { surface.ng } else { -surface.ng };
        ray = Ray::new(offset_origin(surface.position, away), next.wi);
    }
}
