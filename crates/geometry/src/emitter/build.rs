//! Reads a scene and gathers all that shines in it.

use super::area::PolygonLight;
use super::bounds::LightBounds;
use super::merge::polygons;
use super::tree::LightTree;
use super::{EmitterKind, Emitters, NO_LIGHT, shone_at};
use crate::math::Vec3;
use crate::scene::{AlphaMode, Light, LightKind, Material};
use crate::{Hit, Rgb, Scene, Sky};
use std::f32::consts::{FRAC_PI_2, PI};

/// Points per edge of the grid on which a textured triangle's emission is averaged: 32 · 33 / 2 look-ups.
const TEXTURE_GRID: u32 = 32;

/// Share of the choice among tree, sky and each directional light that is dealt evenly, whatever they promise: the
/// estimates know nothing of walls.
const EVEN_SHARE: f32 = 0.25;

impl Emitters {
    /// Gathers the lights of a scene: lamps, emissive triangles that are not unlit, sky.
    pub fn build(scene: &Scene) -> Emitters {
        let mut lights = surfaces(scene);
        let has_place = |l: &&Light| !matches!(l.kind, LightKind::Directional { .. });
        let shines = |l: &&Light| l.intensity.max_channel() > 0.0 && l.intensity.is_finite();
        let lamps = || scene.lights.iter().filter(shines);
        lights.extend(lamps().filter(has_place).cloned().map(EmitterKind::Punctual));
        let tree_lights = lights.len() as u32;
        lights.extend(lamps().filter(|l| !has_place(l)).cloned().map(EmitterKind::Punctual));
        let sky = scene.sky.as_ref().filter(|s| s.mean().max_channel() > 0.0);
        lights.extend(sky.cloned().map(EmitterKind::Sky));

        let mut of_triangle = Vec::new();
        for (i, light) in lights.iter().enumerate() {
            if let EmitterKind::Polygon(shape) | EmitterKind::Textured(shape) = light {
                of_triangle.resize(scene.mesh.triangles.len(), NO_LIGHT);
                shape.triangles.iter().for_each(|&t| of_triangle[t as usize] = i as u32);
            }
        }
        let (lo, hi) = scene.mesh.bounds().unwrap_or_default();
        let (centre, radius) = (0.5 * (lo + hi), 0.5 * (hi - lo).length());
        let tree = LightTree::build(&lights[..tree_lights as usize].iter().map(bounds).collect::<Vec<_>>());
        let power: Vec<Rgb> = lights.iter().map(|l| power(l, radius)).collect();
        let power_sums = running_sums(&power);
        let mut emitters = Emitters {
            lights,
            of_triangle,
            tree,
            tree_lights,
            power,
            power_sums,
            centre,
            radius,
            ..Emitters::default()
        };
        emitters.divide_choice();
        emitters
    }

    /// Fixes the probabilities of the tree, the sky and each directional light by the irradiance each may throw.
    fn divide_choice(&mut self) {
        let placed = self.tree_lights as usize;
        // What the placed lights' power would throw on the bounding sphere from within.
        let flux: f32 = self.power[..placed].iter().map(|p| p.mean()).sum();
        let area = 4.0 * PI * self.radius * self.radius;
        let of_tree = if placed > 0 { flux / area.max(f32::MIN_POSITIVE) } else { 0.0 };
        let promises: Vec<f32> = self.lights[placed..]
            .iter()
            .map(|l| match l {
                EmitterKind::Sky(sky) => PI * sky.mean().mean(),
                EmitterKind::Punctual(lamp) => lamp.intensity.mean(),
                _ => 0.0,
            })
            .collect();
        let total = of_tree + promises.iter().sum::<f32>();
        let ways = promises.len() + usize::from(placed > 0);
        let share = |promise: f32| {
            let even = 1.0 / ways as f32;
            let by_promise = if total.is_finite() && total > 0.0 { promise / total } else { even };
            EVEN_SHARE * even + (1.0 - EVEN_SHARE) * by_promise
        };
        self.tree_share = if placed > 0 { share(of_tree) } else { 0.0 };
        self.far = promises.iter().enumerate().map(|(i, &e)| ((placed + i) as u32, share(e))).collect();
    }
}

/// Emissive triangles, joined where they may be.
fn surfaces(scene: &Scene) -> Vec<EmitterKind> {
    let mesh = &scene.mesh;
    let (mut even, mut uneven) = (Vec::new(), Vec::new());
    for (t, id) in (0u32..).zip(&mesh.materials) {
        let Some(material) = scene.materials.get(id.0 as usize) else { continue };
        let shines =
            material.emissive.max_channel() > 0.0 && material.emissive.is_finite() && !material.unlit;
        let area = mesh.area(t);
        if !(shines && area > 0.0 && area.is_finite()) {
            continue;
        }
        if shines_evenly(material) {
            even.push((t, material.emissive, material.double_sided));
            continue;
        }
        let radiance = mean_emission(scene, t);
        // A triangle that is black at every point looked up is left to rays that find it by chance.
        if radiance.max_channel() > 0.0 {
            let (corners, normal) = (mesh.corners(t).to_vec(), mesh.geometric_normal(t));
            let both = material.double_sided;
            let light = PolygonLight::new(corners, normal, area, radiance, both, vec![t]);
            uneven.push(EmitterKind::Textured(light));
        }
    }
    polygons(mesh, &even).into_iter().map(EmitterKind::Polygon).chain(uneven).collect()
}

fn shines_evenly(material: &Material) -> bool {
    material.emissive_texture.is_none() && material.alpha_mode == AlphaMode::Opaque
}

/// Mean radiance of a triangle's front, cd/m², on an even grid.
fn mean_emission(scene: &Scene, triangle: u32) -> Rgb {
    let n = TEXTURE_GRID;
    let mut sum = Rgb::BLACK;
    for i in 0..n {
        for j in 0..n - i {
            let third = 1.0 / 3.0;
            let (u, v) = ((i as f32 + third) / n as f32, (j as f32 + third) / n as f32);
            sum += shone_at(scene, &Hit { t: 0.0, triangle, u, v }, true);
        }
    }
    sum / (n * (n + 1) / 2) as f32
}

fn bounds(light: &EmitterKind) -> LightBounds {
    match light {
        EmitterKind::Polygon(shape) | EmitterKind::Textured(shape) => LightBounds {
            lo: shape.vertices.iter().fold(Vec3::INFINITY, |lo, v| lo.min(*v)),
            hi: shape.vertices.iter().fold(Vec3::NEG_INFINITY, |hi, v| hi.max(*v)),
            axis: shape.normal,
            spread: 0.0,
            reach: FRAC_PI_2,
            two_sided: shape.two_sided,
            intensity: shape.radiance.mean() * shape.area,
        },
        EmitterKind::Punctual(Light {
            intensity,
            kind: LightKind::Spot { position, direction, cos_outer, .. },
            ..
        }) => {
            LightBounds {
                lo: *position,
                hi: *position,
                axis: *direction,
                // Within the cone a spot shines alike; the cosine of `reach` must not dim its rim.
                spread: cos_outer.clamp(-1.0, 1.0).acos(),
                reach: 0.01,
                two_sided: false,
                intensity: intensity.mean(),
            }
        }
        EmitterKind::Punctual(Light { intensity, kind: LightKind::Point { position, .. }, .. }) => {
            LightBounds {
                lo: *position,
                hi: *position,
                axis: Vec3::Y,
                spread: PI,
                reach: FRAC_PI_2,
                two_sided: false,
                intensity: intensity.mean(),
            }
        }
        EmitterKind::Punctual(Light {
            intensity,
            kind: LightKind::Photometric { position, turn, web, .. },
            ..
        }) => LightBounds {
            lo: *position,
            hi: *position,
            axis: turn.transpose() * web.aim(),
            spread: web.reach(),
            reach: 0.01,
            two_sided: false,
            intensity: intensity.mean(),
        },
        EmitterKind::Punctual(_) | EmitterKind::Sky(_) => {
            unreachable!("lights without a place stay out of the tree")
        }
    }
}

fn power(light: &EmitterKind, radius: f32) -> Rgb {
    match light {
        EmitterKind::Polygon(shape) | EmitterKind::Textured(shape) => shape.flux(),
        EmitterKind::Punctual(lamp) => lamp.flux(radius),
        EmitterKind::Sky(sky) => sky_flux(sky, radius),
    }
}

/// Light that enters a sphere from all directions, lm: ∫ L π R² dω.
fn sky_flux(sky: &Sky, radius: f32) -> Rgb {
    sky.mean() * (4.0 * PI * PI * radius * radius)
}

fn running_sums(power: &[Rgb]) -> Vec<f32> {
    let total: f64 = power.iter().map(|p| p.mean() as f64).sum();
    let mut sum = 0.0;
    let shares = power.iter().map(|p| {
        sum += p.mean() as f64;
        (sum / total) as f32
    });
    std::iter::once(0.0).chain(shares).collect()
}
