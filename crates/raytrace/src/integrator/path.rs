//! The reference: a path tracer, unbiased but for a bound on the path's length, which never sees a radiosity solution.
//!
//! From the eye, at every surface one ray to a light and one by the material, weighed against each other (Veach and
//! Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995), and Russian roulette
//! (Arvo and Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990).
//!
//! A window or a surface with alpha lets rays straight on. Such an event is no scattering: the density that a lamp
//! found beyond is weighed by stays that of the last real one, and shadow rays pass the same panes.
//!
//! What it cannot find: light of point, spot and directional lamps by way of perfect mirrors or refraction, since no
//! camera ray meets a lamp without extent. Probes that have photons of their own ([`Aid`]) find that too.

use super::{Layers, Seen};
use crate::film::Pixel;
use geometry::bsdf::BsdfSample;
use geometry::math::offset_origin;
use geometry::sampling::Rng;
use geometry::{Camera, Passage, Ray, Rgb, Surface, Vec3, World, photometry};
use radiosity::caustic::Caustics;
use radiosity::gather::ROUGH;
use std::f32::consts::PI;

mod even;

use even::Choice;
pub use even::Even;

/// Scatterings after which a path ends whatever it carries. At ρ = 0.95 roulette leaves 2e-6 of the paths so long.
pub const MAX_BOUNCES: u32 = 256;

/// Straight passages after which a path ends: alpha cards in a row.
const MAX_STRAIGHT: u32 = 1024;

/// Roulette spares the first bounces, which carry most of the light.
const ROULETTE_FROM: u32 = 5;

/// Radiance that arrives along `ray`, one unbiased sample, and what the ray met first.
pub fn radiance(world: &World, ray: Ray, rng: &mut Rng) -> (Layers, Option<Seen>) {
    Path::new(world, ray, true).trace(rng)
}

/// What makes a path less noisy, at the price of the photons' blur.
#[derive(Clone, Copy, Debug)]
pub struct Aid<'a> {
    /// Light that comes to diffuse surfaces by way of mirrors and glass: paths leave it to these photons, for they
    /// meet it seldom and then find it a thousand times too bright.
    pub caustics: Option<&'a Caustics>,
    /// The numbers that choose it, even over the paths of a pixel.
    pub even: Even,
}

/// As [`radiance`], all layers together, with some aid.
pub fn aided_radiance(world: &World, ray: Ray, aid: Aid, rng: &mut Rng) -> Rgb {
    let path = Path { even: Some(aid.even), caustics: aid.caustics, ..Path::new(world, ray, true) };
    path.trace(rng).0.total()
}

/// Mean of `spp` paths through random points of pixel (x, y), from the top left; the filter is the pixel's box.
///
/// The numbers drawn depend on `seed`, the pixel and the sample alone. The variance is that of the mean's luminance,
/// from the spread of the samples; zero for a single one.
pub fn render_pixel(
    world: &World,
    camera: &Camera,
    (width, height): (u32, u32),
    (x, y): (u32, u32),
    spp: u32,
    seed: u64,
) -> Pixel {
    let aspect = width as f32 / height as f32;
    let mut pixel = Pixel { samples: spp, ..Pixel::default() };
    let (mut mean, mut spread, mut met) = (0f64, 0f64, 0u32);
    // Sums over thousands of samples in f64 would cost twelve more words; the running mean keeps f32 honest.
    for i in 0..spp {
        let index = (u64::from(y) * u64::from(width) + u64::from(x)) << 32 | u64::from(i);
        let mut rng = Rng::new(seed, index);
        let (u, v) = ((x as f32 + rng.f32()) / width as f32, (y as f32 + rng.f32()) / height as f32);
        let (layers, seen) = radiance(world, camera.ray(u, v, aspect), &mut rng);
        let share = 1.0 / (i + 1) as f32;
        pixel.direct = pixel.direct.lerp(layers.direct, share);
        pixel.indirect = pixel.indirect.lerp(layers.indirect, share);
        pixel.specular = pixel.specular.lerp(layers.specular, share);
        pixel.emission = pixel.emission.lerp(layers.emission, share);
        if let Some(seen) = seen {
            met += 1;
            let share = 1.0 / met as f32;
            pixel.albedo = pixel.albedo.lerp(seen.albedo, share);
            pixel.normal = pixel.normal.lerp(seen.normal, share);
            pixel.position = pixel.position.lerp(seen.position, share);
            pixel.depth += (seen.depth - pixel.depth) * share;
        }
        let luminance = f64::from(layers.total().luminance());
        let step = luminance - mean;
        mean += step / f64::from(i + 1);
        spread += step * (luminance - mean);
    }
    if spp > 1 {
        pixel.variance = (spread / (f64::from(spp) * f64::from(spp - 1))) as f32;
    }
    pixel.alpha = met as f32 / spp.max(1) as f32;
    let light = (pixel.direct + pixel.indirect) * PI;
    let per = |light: f32, albedo: f32| if albedo > 0.0 { light / albedo } else { 0.0 };
    pixel.irradiance =
        Rgb::new(per(light.r, pixel.albedo.r), per(light.g, pixel.albedo.g), per(light.b, pixel.albedo.b));
    pixel
}

/// The last real scattering, for weighing what its ray meets against a shadow ray from the same place.
struct Scattering {
    position: Vec3,
    /// The normal the light was chosen by; zero for none.
    preference: Vec3,
    /// 1/sr; `None` after a perfect mirror or glass, whose light no shadow ray finds.
    pdf: Option<f32>,
}

/// A path in the making.
struct Path<'a> {
    world: &'a World,
    ray: Ray,
    /// Whether shadow rays are sent; without them only rays that meet lamps count, as a check on the weights.
    light_sampling: bool,
    layers: Layers,
    seen: Option<Seen>,
    /// Radiance at the eye per radiance found.
    throughput: Rgb,
    /// Of it, the share that went through the diffuse lobe at the first surface.
    diffuse_first: Rgb,
    /// Of it, the share that went through no diffuse lobe at all.
    never_diffuse: Rgb,
    bounces: u32,
    last: Option<Scattering>,
    passage: Passage,
    /// See [`Aid`].
    caustics: Option<&'a Caustics>,
    even: Option<Even>,
    /// Surfaces met, those passed straight on too: the numbers that let a path pass must not choose again at the next.
    met: u32,
    /// Specular scatterings since the last diffuse one, if there are photons.
    chain: Option<Chain>,
}

/// Specular scatterings after a diffuse one.
#[derive(Clone, Copy, Default)]
struct Chain {
    length: u32,
    /// The first was rough enough to be lit by shadow rays.
    rough: bool,
}

impl Chain {
    /// Whether light found at its end is the photons' ([`radiosity::caustic`]).
    fn is_the_photons(self) -> bool {
        self.length > 1 || (self.length == 1 && !self.rough)
    }

    /// With one more scattering, at a surface that is rough or not.
    fn longer(self, rough: bool) -> Chain {
        Chain { length: self.length + 1, rough: if self.length == 0 { rough } else { self.rough } }
    }
}

impl<'a> Path<'a> {
    fn new(world: &'a World, ray: Ray, light_sampling: bool) -> Path<'a> {
        Path {
            world,
            ray,
            light_sampling,
            layers: Layers::default(),
            seen: None,
            throughput: Rgb::WHITE,
            diffuse_first: Rgb::BLACK,
            never_diffuse: Rgb::WHITE,
            bounces: 0,
            last: None,
            passage: Passage::default(),
            caustics: None,
            even: None,
            met: 0,
            chain: None,
        }
    }

    fn trace(mut self, rng: &mut Rng) -> (Layers, Option<Seen>) {
        let mut straight = 0;
        while self.bounces <= MAX_BOUNCES && straight <= MAX_STRAIGHT {
            let Some(hit) = self.world.closest(&self.ray) else {
                self.escape();
                break;
            };
            let mut surface = self.world.surface(&self.ray, &hit);
            self.throughput *= self.passage.meet(&mut surface, hit.t - self.ray.t_min, rng);
            if surface.coverage < 1.0 && rng.f32() >= surface.coverage {
                self.ray.t_min = hit.t;
                straight += 1;
                continue;
            }
            if let Some(color) = surface.unlit {
                self.look(&surface, hit.t);
                self.show(color);
                break;
            }
            self.emission(&surface);
            let Some(goes_straight) = self.scatter(&surface, hit.t, rng) else { break };
            if goes_straight {
                straight += 1;
                continue;
            }
            self.bounces += 1;
            if self.bounces >= ROULETTE_FROM && !self.survives(rng) {
                break;
            }
        }
        (self.layers, self.seen)
    }

    /// Light found: to the layer that the path so far belongs to. `weight` by the share of other ways to find it.
    fn add(&mut self, radiance: Rgb, weight: f32) {
        if self.chain.is_some_and(Chain::is_the_photons) {
            return;
        }
        let light = self.throughput * radiance * weight;
        match self.bounces {
            0 => self.layers.emission += light,
            bounces => self.add_split(light, self.diffuse_first, bounces),
        }
    }

    /// Light that came over `bounces` ≥ 1 surfaces; `diffuse`: its share by the first surface's diffuse lobe.
    fn add_split(&mut self, light: Rgb, diffuse: Rgb, bounces: u32) {
        let by_diffuse = light * diffuse;
        if bounces == 1 {
            self.layers.direct += by_diffuse;
        } else {
            self.layers.indirect += by_diffuse;
        }
        self.layers.specular += light - by_diffuse;
    }

    /// An unlit colour: seen directly or in mirrors and gloss, but it lights nothing.
    fn show(&mut self, color: Rgb) {
        let light = self.throughput * self.never_diffuse * color;
        match self.bounces {
            0 => self.layers.emission += light,
            _ => self.layers.specular += light,
        }
    }

    /// Weight of a lamp met by itself, when a shadow ray would have drawn it with density `pdf_light`.
    fn weight(&self, pdf_light: impl Fn(Vec3, Vec3) -> f32) -> f32 {
        match &self.last {
            Some(Scattering { position, preference, pdf: Some(pdf) }) if self.light_sampling => {
                power_heuristic(*pdf, pdf_light(*position, *preference))
            }
            _ => 1.0,
        }
    }

    fn escape(&mut self) {
        if let Some(sky) = &self.world.scene.sky {
            let d = self.ray.direction;
            let weight = self.weight(|p, n| self.world.emitters.pdf_sky(p, n, d));
            self.add(sky.radiance(d), weight);
        }
    }

    fn emission(&mut self, surface: &Surface) {
        if surface.emission.is_black() {
            return;
        }
        let weight =
            self.weight(|p, n| self.world.emitters.pdf_triangle(p, n, surface.triangle, surface.position));
        self.add(surface.emission, weight);
    }

    /// Lights the surface by a shadow ray and sends the path on; whether straight. `None` where it is absorbed.
    fn scatter(&mut self, surface: &Surface, t: f32, rng: &mut Rng) -> Option<bool> {
        let bsdf = &surface.bsdf;
        let wo = -self.ray.direction;
        self.met += 1;
        let u = self.numbers(Choice::Direction, rng);
        let sample = bsdf.sample(wo, u);
        // A rough pane is lit from both sides, and so is what light comes through diffusely.
        let rough = !bsdf.is_delta();
        let preference = if (rough && !bsdf.layers.transmission(1.0).is_black()) || bsdf.is_translucent() {
            Vec3::ZERO
        } else {
            surface.ns
        };
        let goes_straight = sample.is_some_and(|s| s.straight);
        if !goes_straight {
            self.look(surface, t);
        }
        // Drawn whether the path goes straight on or not: the lobes that scatter are lit by every path alike.
        if self.light_sampling && (rough || bsdf.has_diffuse() || bsdf.is_translucent()) {
            self.next_event(surface, wo, preference, rng);
        }
        if let Some(caustics) = self.caustics
            && (bsdf.has_diffuse() || bsdf.is_translucent())
        {
            // A look-up takes as long as a path: a few of them do.
            let chance = if self.bounces == 0 { 0.25 } else { 0.125 };
            if rng.f32() < chance {
                let by = |albedo: Rgb, n: Vec3| match albedo.is_black() {
                    true => Rgb::BLACK,
                    false => photometry::reflected_radiance(albedo, caustics.irradiance(surface.position, n)),
                };
                let sent =
                    by(bsdf.diffuse_albedo(wo), surface.ng) + by(bsdf.translucent_albedo(wo), -surface.ng);
                self.layers.indirect += self.throughput * sent / chance;
            }
        }
        let s = sample?;
        self.throughput *= s.weight;
        self.throughput *= self.passage.leave(surface, s.wi);
        if s.straight {
            self.ray.t_min = t;
            return Some(true);
        }
        if s.delta {
            if self.bounces == 0 {
                self.diffuse_first = Rgb::BLACK;
            }
        } else {
            let diffuse = share(bsdf.eval_diffuse(wo, s.wi), bsdf.eval(wo, s.wi));
            if self.bounces == 0 {
                self.diffuse_first = diffuse;
            }
            self.never_diffuse *= Rgb::WHITE - diffuse;
        }
        if self.caustics.is_some() {
            self.link(surface, wo, &s, rng);
        }
        let side = if s.wi.dot(surface.ng) < 0.0 { -surface.ng } else { surface.ng };
        self.ray = Ray::new(offset_origin(surface.position, side), s.wi);
        let pdf = (!s.delta).then_some(s.pdf);
        self.last = Some(Scattering { position: surface.position, preference, pdf });
        Some(false)
    }

    /// Notes whether the scattering was diffuse or one more of a specular chain: by chance where the direction may
    /// have come of either, with weights that make up for it in each channel.
    fn link(&mut self, surface: &Surface, wo: Vec3, s: &BsdfSample, rng: &mut Rng) {
        let diffuse = match s.delta {
            true => Rgb::BLACK,
            false => share(surface.bsdf.eval_diffuse(wo, s.wi), surface.bsdf.eval(wo, s.wi)),
        };
        let chance = diffuse.luminance();
        if rng.f32() < chance {
            self.throughput *= diffuse * (1.0 / chance);
            self.chain = Some(Chain::default());
        } else {
            self.throughput *= (Rgb::WHITE - diffuse) * (1.0 / (1.0 - chance));
            let rough = surface.bsdf.glossy_roughness() >= ROUGH;
            self.chain = self.chain.map(|chain| chain.longer(rough));
        }
    }

    /// One shadow ray.
    fn next_event(&mut self, surface: &Surface, wo: Vec3, preference: Vec3, rng: &mut Rng) {
        let World { scene, emitters, .. } = self.world;
        let u = self.numbers(Choice::Light, rng);
        let Some(light) = emitters.sample(scene, surface.position, preference, u) else { return };
        let (diffuse, mut glossy) =
            (surface.bsdf.eval_diffuse(wo, light.wi), surface.bsdf.eval_glossy(wo, light.wi));
        let rough = surface.bsdf.glossy_roughness() >= ROUGH;
        if self.chain.is_some_and(|chain| chain.longer(rough).is_the_photons()) {
            glossy = Rgb::BLACK;
        }
        let f = diffuse + glossy;
        if f.is_black() {
            return;
        }
        let left = self.world.transmittance(&light.shadow_ray(surface.position, surface.ng));
        if left.is_black() {
            return;
        }
        let weight = match light.delta {
            true => 1.0,
            false => power_heuristic(light.pdf, surface.bsdf.pdf(wo, light.wi)),
        };
        let cos = light.wi.dot(surface.ns).abs();
        let found = self.throughput * f * left * light.radiance * (weight * cos / light.pdf);
        let by_diffuse = if self.bounces == 0 { share(diffuse, f) } else { self.diffuse_first };
        self.add_split(found, by_diffuse, self.bounces + 1);
    }

    /// Three numbers in [0, 1) for a choice at this scattering.
    fn numbers(&self, choice: Choice, rng: &mut Rng) -> [f32; 3] {
        match self.even {
            Some(even) => even.numbers(self.met, choice),
            None => rng.array(),
        }
    }

    /// Notes the first surface that did not let the ray straight on.
    fn look(&mut self, surface: &Surface, t: f32) {
        if self.bounces == 0 && self.seen.is_none() {
            let albedo = surface.unlit.unwrap_or_else(|| surface.bsdf.diffuse_albedo(-self.ray.direction));
            let (normal, position) = (surface.ns, surface.position);
            self.seen = Some(Seen { albedo, normal, position, depth: t });
        }
    }

    /// Ends dim paths by chance, and makes up for it in those that live.
    fn survives(&mut self, rng: &mut Rng) -> bool {
        let chance = self.throughput.max_channel().min(1.0);
        if rng.f32() >= chance {
            return false;
        }
        self.throughput *= 1.0 / chance;
        true
    }
}

/// Weight of a sample drawn with density `own` where another way would have had `other` (Veach 1997, sec. 9.2.3).
fn power_heuristic(own: f32, other: f32) -> f32 {
    // By the ratio: squares of large densities overflow.
    let r = other / own;
    1.0 / (1.0 + r * r)
}

/// `part` / `whole` by channel, 0 of nothing.
fn share(part: Rgb, whole: Rgb) -> Rgb {
    let of = |part: f32, whole: f32| if whole > 0.0 { (part / whole).min(1.0) } else { 0.0 };
    Rgb::new(of(part.r, whole.r), of(part.g, whole.g), of(part.b, whole.b))
}

#[cfg(test)]
mod tests;
