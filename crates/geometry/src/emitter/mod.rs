//! Lamps, emissive triangles and sky as things one samples: choose a light, sample it, and the pdf of both.

mod area;
mod bounds;
mod build;
mod choice;
mod emit;
mod group;
mod merge;
mod punctual;
mod spherical;
#[cfg(test)]
pub(crate) mod testing;
mod tree;

pub use area::{PolygonLight, Seen};
pub use emit::{Emission, Target};
pub use group::Group;
pub use merge::MAX_CORNERS;
pub use punctual::{range_window, spot_falloff};

use crate::math::{Vec3, offset_origin};
use crate::outlook::{Outlook, SeenSky};
use crate::scene::Light;
use crate::surface::{coverage_at, emission_at};
use crate::{Hit, Ray, Rgb, Scene, Sky};
use std::f32::consts::PI;
use std::sync::Arc;
use tree::LightTree;

/// All that shines in a scene. Unlit materials show but do not shine.
#[derive(Clone, Debug, Default)]
pub struct Emitters {
    lights: Vec<EmitterKind>,
    /// Light of each triangle of the mesh, [`NO_LIGHT`] for none; empty when no triangle shines.
    of_triangle: Vec<u32>,
    /// Over `lights[..tree_lights]`: what has a place.
    tree: LightTree,
    tree_lights: u32,
    /// Probability with which the tree is asked.
    tree_share: f32,
    /// Lights from infinitely far, and the probability of each.
    far: Vec<(u32, f32)>,
    /// Of each light, lm.
    power: Vec<Rgb>,
    /// Running sums of the power's share, one more than lights.
    power_sums: Vec<f32>,
    /// Middle of the scene's bounding sphere.
    centre: Vec3,
    /// Its radius, m.
    radius: f32,
    /// Through which windows the sky is seen, where that is known.
    pub(crate) outlook: Option<Arc<Outlook>>,
}

const NO_LIGHT: u32 = u32::MAX;

/// One light.
#[derive(Clone, Debug)]
pub enum EmitterKind {
    /// Emissive triangles of one radiance, joined to a convex polygon.
    Polygon(PolygonLight),
    /// A triangle whose emission a texture or alpha varies; its radiance is the mean.
    Textured(PolygonLight),
    /// A lamp of KHR_lights_punctual: point, spot or directional.
    Punctual(Light),
    /// Light from beyond all triangles.
    Sky(Sky),
}

/// One way from a point to a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit, toward the light.
    pub wi: Vec3,
    /// How far, m; infinite for sky and directional lights.
    pub distance: f32,
    /// Radiance, cd/m²; for a delta light the irradiance on a surface that faces it, lx.
    pub radiance: Rgb,
    /// Density over solid angle, 1/sr, choice of the light included; for a delta light the probability of the choice.
    pub pdf: f32,
    /// Whether the light has no extent, so that no other way of sampling can find it.
    pub delta: bool,
    /// Index into [`Emitters::lights`].
    pub light: u32,
}

impl LightSample {
    /// The same point of the light, drawn as seen from `p`, seen from `q` instead.
    pub fn seen_from(&self, p: Vec3, q: Vec3) -> LightSample {
        if !self.distance.is_finite() || p == q {
            return *self;
        }
        let way = p + self.wi * self.distance - q;
        let distance = way.length();
        LightSample { wi: if distance > 0.0 { way / distance } else { self.wi }, distance, ..*self }
    }

    /// From `p`, on a surface of unit geometric normal `ng` (zero in mid-air), to just before the light.
    pub fn shadow_ray(&self, p: Vec3, ng: Vec3) -> Ray {
        let side = if self.wi.dot(ng) < 0.0 { -ng } else { ng };
        let origin = if ng == Vec3::ZERO { p } else { offset_origin(p, side) };
        if !self.distance.is_finite() {
            return Ray::new(origin, self.wi);
        }
        // The offset may be longer than what one would leave free before the light (8 mm at 300 m from the world's
        // origin): the way is measured from where the ray starts. Free are 0.01 % of it, and what coordinates of this
        // size round by.
        let light = p + self.wi * self.distance;
        let way = light - origin;
        let length = way.length();
        let rounding = 4.0 * f32::EPSILON * light.abs().max(origin.abs()).max_element();
        let t_max = (length * (1.0 - 1e-4) - rounding).max(0.0);
        Ray { origin, direction: if length > 0.0 { way / length } else { self.wi }, t_min: 0.0, t_max }
    }
}

impl Emitters {
    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// All lights, so that a caller may treat few of them one by one.
    pub fn lights(&self) -> &[EmitterKind] {
        &self.lights
    }

    /// The light that a triangle of the mesh belongs to.
    pub fn light_of_triangle(&self, triangle: u32) -> Option<u32> {
        self.of_triangle.get(triangle as usize).copied().filter(|&l| l != NO_LIGHT)
    }

    /// Light that leaves each light, lm; for sky and directional lights what enters the scene's bounding sphere.
    pub fn power(&self) -> &[Rgb] {
        &self.power
    }

    /// One light as `p` sees it, on a surface of unit normal `n` or from all sides with a zero one; `None` where a lamp's
    /// surface sends no light there.
    #[inline]
    pub fn seen_from(&self, light: u32, p: Vec3, n: Vec3) -> Option<SeenLight<'_>> {
        let kind = match self.lights.get(light as usize)? {
            EmitterKind::Polygon(shape) => SeenKind::Surface(shape.seen_from(p)?, false),
            EmitterKind::Textured(shape) => SeenKind::Surface(shape.seen_from(p)?, true),
            EmitterKind::Punctual(lamp) => SeenKind::Lamp(lamp),
            EmitterKind::Sky(sky) => SeenKind::Sky(SeenSky::new(sky, self.outlook(), p, n)),
        };
        Some(SeenLight { kind, light, p })
    }

    /// Whether all light comes from one surface or lamp.
    pub fn is_one_lamp(&self) -> bool {
        matches!(&self.lights[..], [light] if !matches!(light, EmitterKind::Sky(_)))
    }

    /// Through which windows the sky is seen, where that is known.
    pub fn outlook(&self) -> Option<&Outlook> {
        self.outlook.as_deref()
    }

    /// The sky as [`Emitters::seen_from`] gives it, but by what `outlook` knows of the windows; `None` without one.
    pub fn sky_seen_from<'a>(
        &'a self,
        outlook: Option<&'a Outlook>,
        p: Vec3,
        n: Vec3,
    ) -> Option<SeenLight<'a>> {
        let light = self.lights.len().checked_sub(1)?;
        let EmitterKind::Sky(sky) = &self.lights[light] else { return None };
        Some(SeenLight { kind: SeenKind::Sky(SeenSky::new(sky, outlook, p, n)), light: light as u32, p })
    }

    /// A way from `p` with unit normal `n`, or zero, to one given light, the pdf without the probability of choosing that
    /// light; `u` in [0, 1)². `None` where it sends no light.
    pub fn sample_light(
        &self,
        scene: &Scene,
        light: u32,
        p: Vec3,
        n: Vec3,
        u: [f32; 2],
    ) -> Option<LightSample> {
        self.seen_from(light, p, n)?.sample(scene, u)
    }

    /// The density (1/sr) with which [`Emitters::sample_light`] draws the unit direction `wi` of the sky, if `light` is one.
    pub fn pdf_of_sky(&self, light: u32, p: Vec3, n: Vec3, wi: Vec3) -> f32 {
        match self.lights.get(light as usize) {
            Some(EmitterKind::Sky(sky)) => SeenSky::new(sky, self.outlook(), p, n).pdf(wi),
            _ => 0.0,
        }
    }

    /// About the irradiance (mean of the channels, lx) that one light throws on `p` with unit normal `n` if nothing
    /// stood between: exact for lamps, and for polygons unless they look small; the sky's mean for a sky. With a zero
    /// `n` the surface faces the light.
    pub fn importance(&self, light: u32, p: Vec3, n: Vec3) -> f32 {
        let cos = |wi: Vec3| if n == Vec3::ZERO { 1.0 } else { wi.dot(n).max(0.0) };
        match self.lights.get(light as usize) {
            Some(EmitterKind::Polygon(shape) | EmitterKind::Textured(shape)) => shape.irradiance_about(p, n),
            Some(EmitterKind::Punctual(lamp)) => {
                lamp.reaching(p).map_or(0.0, |(wi, _, e)| e.mean() * cos(wi))
            }
            Some(EmitterKind::Sky(sky)) => PI * sky.mean().mean(),
            None => 0.0,
        }
    }
}

/// One light as one point sees it: what all samples toward it share.
#[derive(Clone, Debug)]
pub struct SeenLight<'a> {
    kind: SeenKind<'a>,
    light: u32,
    p: Vec3,
}

#[derive(Clone, Debug)]
enum SeenKind<'a> {
    /// Whether a texture varies its radiance.
    Surface(Seen<'a>, bool),
    Lamp(&'a Light),
    Sky(SeenSky<'a>),
}

impl SeenLight<'_> {
    /// Which one.
    pub fn light(&self) -> u32 {
        self.light
    }

    /// The density (1/sr) with which [`SeenLight::sample`] draws the unit direction `wi` of the sky; 0 of other lights.
    pub fn pdf_of_sky(&self, wi: Vec3) -> f32 {
        match &self.kind {
            SeenKind::Sky(sky) => sky.pdf(wi),
            _ => 0.0,
        }
    }

    /// A way to the light, the pdf without the probability of choosing it; `u` in [0, 1)². `None` where it sends none.
    #[inline]
    pub fn sample(&self, scene: &Scene, u: [f32; 2]) -> Option<LightSample> {
        let SeenLight { light, p, .. } = *self;
        match &self.kind {
            SeenKind::Surface(seen, textured) => {
                let (point, pdf) = seen.sample(u)?;
                let way = point - p;
                let distance = way.length();
                let wi = way / distance;
                let shape = seen.shape();
                let radiance = if *textured {
                    let hit = hit_at(scene, shape.triangles[0], point, distance);
                    shone_at(scene, &hit, wi.dot(shape.normal) < 0.0)
                } else {
                    shape.radiance
                };
                Some(LightSample { wi, distance, radiance, pdf, delta: false, light })
            }
            SeenKind::Lamp(lamp) => {
                let (wi, distance, radiance) = lamp.reaching(p)?;
                Some(LightSample { wi, distance, radiance, pdf: 1.0, delta: true, light })
            }
            SeenKind::Sky(sky) => {
                let s = sky.sample(u);
                let usable = s.pdf > 0.0 && s.pdf.is_finite();
                usable.then_some(LightSample {
                    wi: s.direction,
                    distance: f32::INFINITY,
                    radiance: s.radiance,
                    pdf: s.pdf,
                    delta: false,
                    light,
                })
            }
        }
    }
}

/// The point of a triangle as a ray of length `t` would have found it.
fn hit_at(scene: &Scene, triangle: u32, point: Vec3, t: f32) -> Hit {
    let [a, b, c] = scene.mesh.corners(triangle).map(|v| v.as_dvec3());
    let p = point.as_dvec3() - a;
    let (e, f) = (b - a, c - a);
    let n = e.cross(f);
    let (u, v) = (p.cross(f).dot(n) / n.length_squared(), e.cross(p).dot(n) / n.length_squared());
    let u = u.clamp(0.0, 1.0);
    Hit { t, triangle, u: u as f32, v: v.clamp(0.0, 1.0 - u) as f32 }
}

/// Radiance that one point of a triangle adds to a ray, cd/m²: what it emits, as far as alpha leaves it there.
fn shone_at(scene: &Scene, hit: &Hit, front: bool) -> Rgb {
    emission_at(scene, hit, front) * coverage_at(scene, hit)
}
