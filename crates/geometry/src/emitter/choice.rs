//! Which light for which point, and how likely: the density of the whole draw.

use super::{EmitterKind, Emitters, LightSample};
use crate::Scene;
use crate::math::Vec3;

/// Lights from infinitely far that are asked one by one at most, for each costs a shadow ray: a sky, a sun, and one to spare.
const MANY: u32 = 3;

impl Emitters {
    /// One way to one light for the point `p`; `None` when the draw meets a light that sends nothing there.
    ///
    /// - `n`: unit shading normal of a surface that only reflects, so that lights below its horizon are not drawn;
    ///   zero for no preference.
    /// - `u`: in [0, 1)³; the first chooses the light.
    pub fn sample(&self, scene: &Scene, p: Vec3, n: Vec3, u: [f32; 3]) -> Option<LightSample> {
        let (light, probability) = self.choose(p, n, u[0])?;
        self.toward(scene, light, probability, p, n, [u[1], u[2]])
    }

    /// Kinds of light that one asks by themselves: those that have a place, and each of those from infinitely far; all
    /// of the latter as one where they are many.
    pub fn kinds(&self) -> u32 {
        let far = self.far.len() as u32;
        u32::from(self.tree_lights > 0) + if far > MANY { 1 } else { far }
    }

    /// As [`Emitters::sample`] for one of [`Emitters::kinds`]. The sum over them varies less: a lamp in a room by day is
    /// not drawn less often for the sun that does not get there.
    pub fn sample_kind(
        &self,
        scene: &Scene,
        kind: u32,
        p: Vec3,
        n: Vec3,
        u: [f32; 3],
    ) -> Option<LightSample> {
        let placed = u32::from(self.tree_lights > 0);
        let (light, probability) = match kind.checked_sub(placed) {
            None => self.tree.choose(p, n, u[0])?,
            Some(far) if self.far.len() as u32 <= MANY => (self.far.get(far as usize)?.0, 1.0),
            Some(_) => {
                let (light, share) = self.choose_far(u[0] * (1.0 - self.tree_share))?;
                (light, share / (1.0 - self.tree_share))
            }
        };
        self.toward(scene, light, probability, p, n, [u[1], u[2]])
    }

    /// A way to one light that was chosen with `probability`.
    fn toward(
        &self,
        scene: &Scene,
        light: u32,
        probability: f32,
        p: Vec3,
        n: Vec3,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let s = self.sample_light(scene, light, p, n, u);
        s.map(|s| LightSample { pdf: s.pdf * probability, ..s }).filter(|s| s.pdf > 0.0)
    }

    /// The density (1/sr) with which [`Emitters::sample`] draws `point` on an emissive `triangle` for a receiver at
    /// `p`; what multiple importance sampling weighs a ray by that met the lamp by itself. 0 for a dark triangle.
    pub fn pdf_triangle(&self, p: Vec3, n: Vec3, triangle: u32, point: Vec3) -> f32 {
        let Some(light) = self.light_of_triangle(triangle) else { return 0.0 };
        match &self.lights[light as usize] {
            EmitterKind::Polygon(shape) | EmitterKind::Textured(shape) => {
                let pdf = shape.pdf(p, point);
                if pdf > 0.0 { pdf * self.tree_share * self.tree.probability(light, p, n) } else { 0.0 }
            }
            _ => 0.0,
        }
    }

    /// The density (1/sr) with which [`Emitters::sample`] draws the sky in the unit direction `wi`.
    pub fn pdf_sky(&self, p: Vec3, n: Vec3, wi: Vec3) -> f32 {
        // The sky, when there is one, is the last light.
        self.far.last().map_or(0.0, |&(light, share)| share * self.pdf_of_sky(light, p, n, wi))
    }

    /// A light for `p`, and the probability of that choice.
    fn choose(&self, p: Vec3, n: Vec3, u: f32) -> Option<(u32, f32)> {
        if u < self.tree_share {
            let (light, probability) = self.tree.choose(p, n, u / self.tree_share)?;
            return Some((light, probability * self.tree_share));
        }
        self.choose_far(u - self.tree_share)
    }

    /// One of those from infinitely far for `u` in [0, the sum of their probabilities), and that of its choice.
    fn choose_far(&self, mut u: f32) -> Option<(u32, f32)> {
        for &(light, share) in &self.far {
            if u < share {
                return Some((light, share));
            }
            u -= share;
        }
        // Rounding may leave a little beyond the last.
        self.far.last().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::testing::*;
    use crate::math::{Affine2, Vec2};
    use crate::polygon::polygon_irradiance;
    use crate::scene::{Light, LightKind};
    use crate::texture::Wrap;
    use crate::{Mesh, Rgb, Sky, Texture, TextureRef};
    use std::f32::consts::PI;

    /// Unshadowed irradiance by quasi-random draws; each carries the density that is told of it.
    fn irradiance(scene: &Scene, p: Vec3, n: Vec3) -> f32 {
        let emitters = Emitters::build(scene);
        let mut sum = 0f64;
        let k = 50_000;
        for u in points(k) {
            let Some(s) = emitters.sample(scene, p, n, [u[0], u[1], u[2]]) else { continue };
            if !s.delta && s.distance.is_finite() {
                let EmitterKind::Polygon(shape) = &emitters.lights()[s.light as usize] else {
                    panic!("even")
                };
                let density = emitters.pdf_triangle(p, n, shape.triangles[0], p + s.wi * s.distance);
                assert!((density / s.pdf - 1.0).abs() < 1e-3);
            }
            if s.distance.is_infinite() && !s.delta {
                assert!((emitters.pdf_sky(p, n, s.wi) / s.pdf - 1.0).abs() < 1e-3);
            }
            sum += (s.radiance.g * s.wi.dot(n).max(0.0) / s.pdf) as f64;
        }
        (sum / k as f64) as f32
    }

    #[test]
    fn a_disc_lamp_gives_the_closed_form() {
        // E = π L R² / (R² + h²); a 64-gon is smaller than its circle by 0.16 %.
        let (r, h) = (1.0f32, 2.0f32);
        let scene = scene_of(disc(64, r, h), 1.0);
        let e = irradiance(&scene, Vec3::ZERO, Vec3::Y);
        let exact = PI * r * r / (r * r + h * h);
        assert!((e / exact - 1.0).abs() < 4e-3, "{e} {exact}");
    }

    #[test]
    fn a_mix_of_all_kinds_adds_up() {
        let mut scene = scene_of(quad(), 5.0);
        scene.sky = Some(Sky::Constant(Rgb::splat(0.5)));
        let lamp = |kind| Light { name: String::new(), intensity: Rgb::splat(3.0), kind };
        scene.lights = vec![
            lamp(LightKind::Directional { direction: Vec3::NEG_Y }),
            lamp(LightKind::Point { position: Vec3::new(0.0, 2.0, 0.0), range: f32::INFINITY }),
        ];
        let corners: Vec<Vec3> = scene.mesh.positions.clone();
        let exact = 0.5 * PI + 3.0 + 3.0 / 4.0 + 5.0 * PI * polygon_irradiance(Vec3::ZERO, Vec3::Y, &corners);
        let e = irradiance(&scene, Vec3::ZERO, Vec3::Y);
        assert!((e / exact - 1.0).abs() < 0.01, "{e} {exact}");
        let e = by_kinds(&scene, 3);
        assert!((e / exact - 1.0).abs() < 0.01, "by kinds {e} {exact}");
        // Many suns are asked as one, with the sky.
        let sun = LightKind::Directional { direction: Vec3::NEG_Y };
        scene.lights.extend((0..5).map(|_| Light {
            name: String::new(),
            intensity: Rgb::splat(0.4),
            kind: sun.clone(),
        }));
        let e = by_kinds(&scene, 2);
        assert!((e / (exact + 2.0) - 1.0).abs() < 0.01, "many {e} {exact}");
    }

    /// Unshadowed irradiance at the origin of all kinds of light by themselves, which are to be so many.
    fn by_kinds(scene: &Scene, kinds: u32) -> f32 {
        let emitters = Emitters::build(scene);
        assert_eq!(emitters.kinds(), kinds);
        let mut sum = 0f64;
        let k = 50_000;
        for (kind, u) in (0..kinds).flat_map(|kind| points(k).map(move |u| (kind, u))) {
            let sample = emitters.sample_kind(scene, kind, Vec3::ZERO, Vec3::Y, [u[0], u[1], u[2]]);
            sum += sample.map_or(0.0, |s| f64::from(s.radiance.g * s.wi.y.max(0.0) / s.pdf));
        }
        (sum / k as f64) as f32
    }

    /// However bright the day, each look brings about what the lamp sends: at most the whole of it seen at a right angle.
    #[test]
    fn a_lamp_by_day_is_drawn_every_time() {
        let mut scene = scene_of(quad(), 5.0);
        let kind = LightKind::Directional { direction: Vec3::Y };
        scene.lights = vec![Light { name: String::new(), intensity: Rgb::splat(1e5), kind }];
        let emitters = Emitters::build(&scene);
        let exact = 5.0 * PI * polygon_irradiance(Vec3::ZERO, Vec3::Y, &scene.mesh.positions);
        let largest = |draw: &dyn Fn([f32; 3]) -> Option<LightSample>| {
            let drawn = points(5_000).filter_map(|u| draw([u[0], u[1], u[2]])).filter(|s| s.wi.y > 0.0);
            drawn.map(|s| s.radiance.g * s.wi.y / s.pdf).fold(0.0, f32::max)
        };
        let alone = largest(&|u| emitters.sample_kind(&scene, 0, Vec3::ZERO, Vec3::Y, u));
        let mixed = largest(&|u| emitters.sample(&scene, Vec3::ZERO, Vec3::Y, u));
        assert!(alone < 2.0 * exact, "{alone} {exact}");
        assert!(mixed > 4.0 * exact, "{mixed} {exact}: then kinds are of no use");
    }

    #[test]
    fn a_hundred_lamps_add_up() {
        let mut mesh = Mesh::default();
        let mut exact = 0.0;
        for i in 0..100 {
            let at = Vec3::new((i % 10) as f32 - 4.5, 1.0, (i / 10) as f32 - 4.5);
            let corners = append_quad(&mut mesh, at, 0.1);
            exact += PI * polygon_irradiance(Vec3::ZERO, Vec3::Y, &corners);
        }
        let scene = scene_of(mesh, 1.0);
        assert_eq!(Emitters::build(&scene).len(), 100);
        let e = irradiance(&scene, Vec3::ZERO, Vec3::Y);
        assert!((e / exact - 1.0).abs() < 0.02, "{e} {exact}");
    }

    #[test]
    fn the_sky_alone_gives_pi_l() {
        let scene = Scene { sky: Some(Sky::Constant(Rgb::splat(2.0))), ..Scene::default() };
        assert!((irradiance(&scene, Vec3::ZERO, Vec3::Y) / (2.0 * PI) - 1.0).abs() < 1e-4);
        assert!(Emitters::build(&Scene::default()).is_empty());
    }

    /// A lamp whose texture is black but for one half: its mean and each sample are the texture's.
    #[test]
    fn a_textured_lamp_shines_where_its_texture_does() {
        let mut scene = scene_of(quad(), 4.0);
        let texture = |texels: Vec<[u8; 4]>| Texture {
            name: String::new(),
            width: texels.len() as u32,
            height: 1,
            texels,
            wrap_s: Wrap::ClampToEdge,
            wrap_t: Wrap::ClampToEdge,
            linear: false,
        };
        scene.textures = vec![texture(vec![[255; 4], [0, 0, 0, 255]])];
        scene.mesh.uvs[0] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from).to_vec();
        let transform = Affine2::IDENTITY;
        scene.materials[0].emissive_texture = Some(TextureRef { texture: 0, uv_set: 0, transform });
        let emitters = Emitters::build(&scene);
        assert_eq!(emitters.len(), 2);
        let flux: f32 = emitters.power().iter().map(|p| p.g).sum();
        assert!((flux / (PI * 4.0 * 0.5) - 1.0).abs() < 0.03, "{flux}");
        let c = &scene.mesh.positions;
        let bright = [c[0], 0.5 * (c[0] + c[1]), 0.5 * (c[2] + c[3]), c[3]];
        let exact = 4.0 * PI * polygon_irradiance(Vec3::ZERO, Vec3::Y, &bright);
        let k = 50_000;
        let draw = |u: [f32; 6]| emitters.sample(&scene, Vec3::ZERO, Vec3::Y, [u[0], u[1], u[2]]);
        let e: f64 = points(k).filter_map(draw).map(|s| (s.radiance.g * s.wi.y / s.pdf) as f64).sum();
        assert!((e as f32 / k as f32 / exact - 1.0).abs() < 0.01, "{e} {exact}");
        scene.materials[0].unlit = true;
        assert!(Emitters::build(&scene).is_empty());
    }
}
