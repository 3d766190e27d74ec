//! Light's own rays: photons that leave the lights, at random or toward what bends them.

use super::area::PolygonLight;
use super::{EmitterKind, Emitters, hit_at, range_window, shone_at};
use crate::math::{Vec2, Vec3, frame, offset_origin, to_world};
use crate::scene::{Light, LightKind};
use crate::{Ray, Rgb, Scene, sampling};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// A ray that leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// From the light, or from outside the scene for sky and directional lights.
    pub ray: Ray,
    /// What it carries, lm: the light's flux along it over the density of drawing it.
    pub flux: Rgb,
    /// Index into [`Emitters::lights`].
    pub light: u32,
    /// How far the lamp reaches, m; infinite but for lamps with a range.
    pub range: f32,
    /// The target it was sent to, by its number; `None` for one that was not guided.
    pub target: Option<usize>,
}

/// A sphere that light is sent toward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Its middle.
    pub centre: Vec3,
    /// Its radius, m, > 0.
    pub radius: f32,
    /// Rays for the solid angle it fills, beside those for other targets; > 0.
    pub weight: f32,
}

impl Emission {
    /// Share of the flux that counts after `distance` m from the lamp, 1 but for lamps with a range.
    pub fn window(&self, distance: f32) -> f32 {
        range_window(distance, self.range)
    }
}

/// Half of the guided rays are drawn as if unguided, so that no light goes missing and no weight exceeds two.
const UNGUIDED: f32 = 0.5;

/// A ray, what it carries (lm), and the target it was sent to.
type Way = (Ray, Rgb, Option<usize>);

/// One draw in the making.
struct Start<'a> {
    emitters: &'a Emitters,
    targets: &'a [Target],
    /// Chooses guided or not, and the target.
    u: f32,
    /// Of the light.
    probability: f32,
}

impl Emitters {
    /// A ray of light drawn in proportion to power; its flux averaged over draws is the flux of all lights.
    ///
    /// `u` in [0, 1)⁵: light, point or disc, direction. `None` where the draw carries nothing.
    pub fn emit(&self, scene: &Scene, u: [f32; 5]) -> Option<Emission> {
        self.emit_toward(scene, &[], [u[0], u[1], u[2], u[3], u[4], 0.0])
    }

    /// As [`Emitters::emit`], but half of the rays head for `targets`: bounding spheres of what the caller wants to hit.
    ///
    /// Unbiased for light that misses them too: a mixture of both ways of drawing, weighed by the density of the
    /// mixture (Veach's balance heuristic for one sample; Veach and Guibas, SIGGRAPH 1995).
    pub fn emit_toward(&self, scene: &Scene, targets: &[Target], u: [f32; 6]) -> Option<Emission> {
        let light = self.power_sums.partition_point(|&s| s <= u[0]).clamp(1, self.lights.len().max(1)) - 1;
        let kind = self.lights.get(light)?;
        let probability = self.power_sums[light + 1] - self.power_sums[light];
        let start = Start { emitters: self, targets, u: u[5], probability };
        let (a, b) = ([u[1], u[2]], [u[3], u[4]]);
        let mut range = f32::INFINITY;
        let (ray, flux, target) = match kind {
            EmitterKind::Polygon(shape) => start.leave_polygon(shape, a, b, |_| shape.radiance)?,
            EmitterKind::Textured(shape) => start.leave_polygon(shape, a, b, |(point, d)| {
                shone_at(scene, &hit_at(scene, shape.triangles[0], point, 0.0), d.dot(shape.normal) > 0.0)
            })?,
            EmitterKind::Punctual(lamp) => match &lamp.kind {
                LightKind::Directional { direction } => {
                    start.come_from_afar(*direction, a, lamp.intensity)?
                }
                LightKind::Point { position, range: r } => {
                    range = *r;
                    start.leave_cone(lamp, *position, Vec3::Y, -1.0, b)?
                }
                LightKind::Spot { position, direction, cos_outer, range: r, .. } => {
                    range = *r;
                    start.leave_cone(lamp, *position, *direction, *cos_outer, b)?
                }
                LightKind::Photometric { position, turn, range: r, web } => {
                    range = *r;
                    let draw = || turn.transpose() * web.sample(b);
                    start.leave_lamp(lamp, *position, b, draw, |d| web.pdf(*turn * d))?
                }
            },
            EmitterKind::Sky(sky) => {
                let s = sky.sample(b);
                start.come_from_afar(-s.direction, a, s.radiance / s.pdf)?
            }
        };
        let usable = flux.is_finite() && flux.max_channel() > 0.0;
        usable.then_some(Emission { ray, flux, light: light as u32, range, target })
    }
}

impl Start<'_> {
    /// From a surface: even in area, cosine or guided in direction.
    fn leave_polygon(
        &self,
        shape: &PolygonLight,
        a: [f32; 2],
        b: [f32; 2],
        radiance: impl Fn((Vec3, Vec3)) -> Rgb,
    ) -> Option<Way> {
        let point = shape.point(a);
        let sides = if shape.two_sided { 2.0 } else { 1.0 };
        let plain = |d: Vec3| {
            let cos = d.dot(shape.normal);
            (if shape.two_sided { cos.abs() } else { cos.max(0.0) }) * FRAC_1_PI / sides
        };
        let (d, ratio, target) = self.direction(point, b, || shape.direction(b), plain)?;
        let cos = d.dot(shape.normal);
        let flux = radiance((point, d)) * (PI * shape.area * sides * ratio / self.probability);
        let ray = Ray::new(offset_origin(point, shape.normal * cos.signum()), d);
        Some((ray, flux, target))
    }

    /// From a point, even within the cone of cosine `cos_outer` around `axis`.
    fn leave_cone(
        &self,
        lamp: &Light,
        position: Vec3,
        axis: Vec3,
        cos_outer: f32,
        b: [f32; 2],
    ) -> Option<Way> {
        let solid_angle = TAU * (1.0 - cos_outer);
        let plain = |d: Vec3| if d.dot(axis) >= cos_outer - 1e-6 { 1.0 / solid_angle } else { 0.0 };
        let draw = || to_world(sampling::cone(Vec2::from(b), cos_outer), axis);
        self.leave_lamp(lamp, position, b, draw, plain)
    }

    /// From a point, along what `draw` gives with the density `plain`, 1/sr.
    fn leave_lamp(
        &self,
        lamp: &Light,
        position: Vec3,
        b: [f32; 2],
        draw: impl Fn() -> Vec3,
        plain: impl Fn(Vec3) -> f32,
    ) -> Option<Way> {
        let (d, ratio, target) = self.direction(position, b, draw, &plain)?;
        let weight = lamp.relative(d) * ratio / (plain(d) * self.probability);
        weight.is_finite().then(|| (Ray::new(position, d), lamp.intensity * weight, target))
    }

    /// Along `d` from a disc outside the scene, with the irradiance (lx) across it.
    fn come_from_afar(&self, d: Vec3, a: [f32; 2], irradiance: Rgb) -> Option<Way> {
        let Emitters { centre, radius, .. } = *self.emitters;
        if radius <= 0.0 {
            return None;
        }
        let (s, t) = frame(d);
        let on_disc = |centre: Vec3, radius: f32| {
            let p = sampling::disc(Vec2::from(a)) * radius;
            centre + s * p.x + t * p.y
        };
        let within = |x: Vec3, c: Vec3, r: f32| (x - c).reject_from_normalized(d).length_squared() <= r * r;
        let disc = PI * radius * radius;
        // A hair wider than the draw, lest rounding puts its rim outside.
        let plain = |x: Vec3| if within(x, centre, radius * 1.0001) { 1.0 / disc } else { 0.0 };
        let of = |t: &Target| t.weight * PI * t.radius * t.radius;
        let total: f32 = self.targets.iter().map(of).sum();
        let target = self.guided(of, total);
        let (c, r) = target.map_or((centre, radius), |k| (self.targets[k].centre, self.targets[k].radius));
        let x = on_disc(c, r);
        let over = |t: &&Target| within(x, t.centre, t.radius);
        let ratio = self.ratio(plain(x), over, total);
        // To a plane in front of the whole scene.
        let back = (x - centre).dot(d) + 1.01 * radius;
        let flux = irradiance * (disc * ratio / self.probability);
        (ratio > 0.0).then(|| (Ray::new(x - d * back, d), flux, target))
    }

    /// A direction from `from`, its plain density over that of the mixture, and its target.
    fn direction(
        &self,
        from: Vec3,
        b: [f32; 2],
        unguided: impl Fn() -> Vec3,
        plain: impl Fn(Vec3) -> f32,
    ) -> Option<(Vec3, f32, Option<usize>)> {
        let of = |t: &Target| t.weight * Cone::around(from, t).solid_angle;
        let total: f32 = self.targets.iter().map(of).sum();
        let target = self.guided(of, total);
        let d = match target {
            None => unguided(),
            Some(k) => Cone::around(from, &self.targets[k]).sample(b),
        };
        let ratio = self.ratio(plain(d), |t| Cone::around(from, t).contains(d), total);
        (ratio > 0.0 && ratio.is_finite()).then_some((d, ratio, target))
    }

    /// The `plain` density of a draw over that of the mixture; `over`: whether it is within a target.
    fn ratio(&self, plain: f32, over: impl Fn(&&Target) -> bool, total: f32) -> f32 {
        if self.targets.is_empty() {
            return 1.0;
        }
        let guided = self.targets.iter().filter(over).map(|t| t.weight).sum::<f32>() / total;
        plain / (UNGUIDED * plain + (1.0 - UNGUIDED) * guided)
    }

    /// `None` for an unguided draw, else a target in proportion to `weight`, which sums to `total`.
    fn guided(&self, weight: impl Fn(&Target) -> f32, total: f32) -> Option<usize> {
        if self.u < UNGUIDED || self.targets.is_empty() {
            return None;
        }
        let mut left = (self.u - UNGUIDED) / (1.0 - UNGUIDED) * total;
        let chosen = self.targets.iter().position(|t| {
            left -= weight(t);
            left < 0.0
        });
        Some(chosen.unwrap_or(self.targets.len() - 1))
    }
}

/// The directions in which a sphere is seen from a point.
struct Cone {
    axis: Vec3,
    /// 1 − the cosine of the half angle, without the cancellation that would leave a narrow cone no digits.
    depth: f32,
    sin2: f32,
    solid_angle: f32,
}

impl Cone {
    /// From `from`; all directions from within the sphere.
    fn around(from: Vec3, &Target { centre, radius, .. }: &Target) -> Cone {
        let way = centre - from;
        let d2 = way.length_squared();
        let sin2 = radius * radius / d2;
        if d2 <= radius * radius || sin2 >= 1.0 {
            return Cone { axis: Vec3::Y, depth: 2.0, sin2: f32::INFINITY, solid_angle: 2.0 * TAU };
        }
        let depth = sin2 / (1.0 + (1.0 - sin2).sqrt());
        Cone { axis: way / d2.sqrt(), depth, sin2, solid_angle: TAU * depth }
    }

    /// By the sine, whose square still has digits where the cosine of a narrow cone has rounded to one.
    fn contains(&self, d: Vec3) -> bool {
        self.sin2.is_infinite()
            || (d.dot(self.axis) > 0.0 && d.cross(self.axis).length_squared() <= self.sin2)
    }

    /// A unit direction, even in solid angle.
    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let down = u[0] * self.depth;
        let r = (down * (2.0 - down)).max(0.0).sqrt();
        let (sin, cos) = (TAU * u[1]).sin_cos();
        to_world(Vec3::new(r * cos, r * sin, 1.0 - down), self.axis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sky;
    use crate::emitter::testing::{points, quad, scene_of};
    use crate::math::Mat3;
    use std::sync::Arc;

    /// Everything that shines, and one draw for each point of a low-discrepancy sequence.
    fn scene() -> Scene {
        let mut scene = scene_of(quad(), 5.0);
        scene.materials[0].double_sided = true;
        scene.sky = Some(Sky::Constant(Rgb::splat(0.3)));
        let (position, direction, range) = (Vec3::new(1.0, 3.0, 0.0), Vec3::NEG_Y, f32::INFINITY);
        let ies = "TILT=NONE\n";
        let file =
            format!("{ies}1 -1 1 5 3 1 2 0 0 0 1 1 0 0 30 60 90 180 0 60 180 9 7 5 1 0 9 5 2 0 0 9 9 1 1 1");
        let web = Arc::new(crate::ies::parse(file.as_bytes()).expect("a web"));
        scene.lights = [
            LightKind::Directional { direction: Vec3::new(0.6, -0.8, 0.0) },
            LightKind::Point { position, range },
            LightKind::Spot { position, direction, cos_inner: 0.9, cos_outer: 0.7, range },
            LightKind::Photometric { position, turn: web.frame() * Mat3::from_rotation_x(0.7), range, web },
        ]
        .map(|kind| Light { name: String::new(), intensity: Rgb::splat(2.0), kind })
        .to_vec();
        scene
    }

    /// Flux of all, and of what passes through a small sphere, plain and guided.
    #[test]
    fn guided_or_not_the_same_flux() {
        let scene = scene();
        let emitters = Emitters::build(&scene);
        let whole: f32 = emitters.power().iter().map(|p| p.g).sum();
        let ball = Target { centre: Vec3::new(0.4, 1.2, -0.3), radius: 0.12, weight: 3.0 };
        let targets = [ball, Target { centre: Vec3::new(0.2, 1.45, 0.1), radius: 0.2, weight: 0.7 }];
        let n = 400_000;
        let tally = |targets: &[Target]| {
            let (mut all, mut near) = (0f64, 0f64);
            for e in points(n).filter_map(|u| emitters.emit_toward(&scene, targets, u)) {
                assert!((e.ray.direction.length() - 1.0).abs() < 1e-4);
                let way = ball.centre - e.ray.origin;
                let flux = (e.flux.g / n as f32) as f64;
                all += flux;
                let close = way.reject_from_normalized(e.ray.direction).length() < ball.radius;
                near += if close && way.dot(e.ray.direction) > 0.0 { flux } else { 0.0 };
            }
            (all as f32, near as f32)
        };
        let (plain, guided) = (tally(&[]), tally(&targets));
        assert!((plain.0 / whole - 1.0).abs() < 2e-3, "{plain:?} {whole}");
        assert!((guided.0 / whole - 1.0).abs() < 1e-2, "{guided:?} {whole}");
        assert!((plain.1 / guided.1 - 1.0).abs() < 4e-2, "{plain:?} {guided:?}");
    }

    #[test]
    fn each_light_gives_its_power() {
        let scene = scene();
        let emitters = Emitters::build(&scene);
        let n = 200_000;
        let mut sums = vec![0f64; emitters.len()];
        points(n).filter_map(|u| emitters.emit(&scene, [u[0], u[1], u[2], u[3], u[4]])).for_each(|e| {
            sums[e.light as usize] += (e.flux.g / n as f32) as f64;
        });
        for (sum, power) in sums.iter().zip(emitters.power()) {
            assert!((*sum as f32 / power.g - 1.0).abs() < 2e-2, "{sum} {power:?}");
        }
    }

    #[test]
    fn nothing_shines_nothing_leaves() {
        assert!(Emitters::build(&Scene::default()).emit(&Scene::default(), [0.5; 5]).is_none());
    }
}
