//! One pixel of the hybrid picture: as many rays through it as it needs, each surface they find shaded once.

use crate::direct::Start;
use crate::film::Pixel;
use crate::integrator::final_gather::Gathered;
use crate::integrator::hybrid::{Gather, Hybrid, Photons, Quality};
use geometry::sampling::Rng;
use geometry::{Camera, MaterialId, Projection, Ray, Rgb, Surface, Vec3, World};
use radiosity::Progress;
use rayon::prelude::*;

/// A camera with a film behind it.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Where from.
    pub camera: &'a Camera,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl View<'_> {
    /// The ray through film coordinates in pixels, from the top left.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let (w, h) = (self.width as f32, self.height as f32);
        self.camera.ray(x / w, y / h, w / h)
    }

    /// Side of a pixel at `depth` metres, m.
    fn footprint(&self, depth: f32) -> f32 {
        match self.camera.projection {
            Projection::Perspective { yfov } => 2.0 * (0.5 * yfov).tan() * depth / self.height as f32,
            Projection::Orthographic { ymag } => 2.0 * ymag / self.height as f32,
        }
    }
}

/// How much to spend on a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Rays through it: 1 (its middle) or a square number (jittered grid).
    pub camera: u32,
    /// Shadow rays for each of its surfaces.
    pub shadow: u32,
}

/// What a pixel's middle ray found, to be compared with its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    material: MaterialId,
    position: Vec3,
    normal: Vec3,
    footprint: f32,
}

impl Key {
    fn new(surface: &Surface, footprint: f32) -> Key {
        Key { material: surface.material, position: surface.position, normal: surface.ng, footprint }
    }

    /// Whether two points lie on one smooth surface: same material, nearly one plane.
    pub fn continues(&self, other: &Key) -> bool {
        let tolerance = 2.0 * self.footprint.max(other.footprint);
        self.material == other.material
            && self.normal.dot(other.normal) > 0.95
            && (other.position - self.position).dot(self.normal).abs() < tolerance
    }

    /// Whether two points lie on the same material, a few pixels apart at most.
    fn near(&self, other: &Key) -> bool {
        let tolerance = 6.0 * self.footprint.max(other.footprint);
        self.material == other.material && self.position.distance(other.position) < tolerance
    }
}

/// A pixel with what decides whether it gets more.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// Its light.
    pub pixel: Pixel,
    /// What was spent.
    pub effort: Effort,
    /// What its first ray met; `None` for nothing.
    pub key: Option<Key>,
    /// Luminance of the direct irradiance of what covers most of the pixel, lx: by lamps with an extent,
    pub lit: f32,
    /// and by those without.
    pub hard: f32,
    /// What of it is sent on toward the eye, 1/sr.
    pub sent: f32,
    /// Variance of the luminance from rays through the pixel: edges, textures, gloss.
    pub camera_variance: f32,
    /// Variance of the luminance from shadow rays.
    pub light_variance: f32,
    /// Rays through the pixel go on by way of mirrors, glass or gloss.
    pub specular: bool,
    /// What the surface gathered that covers most of the pixel, before it and behind.
    pub gathered: [Option<Gathered>; 2],
}

impl Shot {
    /// Whether the first rays of two pixels met one smooth surface, or both nothing.
    pub fn continues(&self, other: &Shot) -> bool {
        match (&self.key, &other.key) {
            (Some(a), Some(b)) => a.continues(b),
            (None, None) => true,
            _ => false,
        }
    }

    /// Whether what one pixel tells of its noise holds for another too: they see one smooth surface, or near parts of a glossy
    /// one that is bent (a tube), whose highlight may have been met in one only.
    pub fn like(&self, other: &Shot) -> bool {
        let near = || self.key.zip(other.key).is_some_and(|(a, b)| a.near(&b));
        self.continues(other) || (self.specular && other.specular && near())
    }

    /// Adds what was seen `before`, with fewer rays.
    pub fn join(&mut self, before: &Shot) {
        let share = before.pixel.samples as f32 / (before.pixel.samples + self.pixel.samples) as f32;
        let of = |old: f32, new: f32| old * share * share + new * (1.0 - share) * (1.0 - share);
        self.camera_variance = of(before.camera_variance, self.camera_variance);
        self.light_variance = of(before.light_variance, self.light_variance);
        self.pixel = self.pixel.merged(&before.pixel);
    }
}

/// One surface seen through a pixel: hits that belong together.
struct Group {
    key: Key,
    hits: Vec<usize>,
}

/// Shades pixel (x, y); what was gathered `before` is not gathered again.
pub fn shade(
    hybrid: &Hybrid,
    view: &View,
    x: u32,
    y: u32,
    effort: Effort,
    before: Option<&Shot>,
    seed: u64,
) -> Shot {
    let mut rng = Rng::new(seed ^ u64::from(effort.camera) << 40, u64::from(y) << 32 | u64::from(x));
    let n = effort.camera;
    let side = (n as f32).sqrt().round() as u32;
    let mut hits: Vec<(Ray, Surface)> = Vec::with_capacity(n as usize);
    let mut shot = Shot {
        pixel: Pixel { samples: n, ..Pixel::default() },
        effort,
        key: None,
        lit: 0.0,
        hard: 0.0,
        sent: 0.0,
        camera_variance: 0.0,
        light_variance: 0.0,
        specular: false,
        gathered: [None; 2],
    };
    let mut sky = Rgb::BLACK;
    for i in 0..n {
        let (jx, jy) = if n == 1 { (0.5, 0.5) } else { (rng.f32(), rng.f32()) };
        let fx = x as f32 + ((i % side) as f32 + jx) / side as f32;
        let fy = y as f32 + ((i / side) as f32 + jy) / side as f32;
        let ray = view.ray(fx, fy);
        match first_surface(hybrid.world, ray) {
            Some(found) => hits.push(found),
            None => sky += hybrid.world.scene.sky.as_ref().map_or(Rgb::BLACK, |s| s.radiance(ray.direction)),
        }
    }
    let share = 1.0 / n as f32;
    shot.pixel.emission = sky * share;
    shot.pixel.alpha = hits.len() as f32 * share;
    let groups = group(&hits, view);
    let mut levels: Vec<(f32, f32)> = Vec::with_capacity(groups.len() + 1); // share and luminance of each surface
    if hits.len() < n as usize {
        let missed = n as usize - hits.len();
        levels.push((missed as f32 * share, sky.luminance() / missed as f32));
    }
    let mut largest = 0;
    for g in &groups {
        let so_far = shot.pixel.beauty().luminance();
        let gather = match before {
            Some(Shot { key: Some(key), gathered, .. })
                if gathered.iter().any(Option::is_some) && key.continues(&g.key) =>
            {
                Gather::Done(*gathered)
            }
            _ => Gather::Worth(g.hits.len() as f32 * share),
        };
        let gathered =
            one_surface(hybrid, g, &hits, effort, gather, share, phase(x, y, seed), &mut shot, &mut rng);
        let part = g.hits.len() as f32 * share;
        levels.push((part, (shot.pixel.beauty().luminance() - so_far) / part));
        if g.hits.len() > largest {
            largest = g.hits.len();
            shot.pixel.position = g.key.position;
            shot.key = Some(g.key);
            shot.gathered = gathered;
        }
    }
    let mean: f32 = levels.iter().map(|&(p, l)| p * l).sum();
    let spread: f32 = levels.iter().map(|&(p, l)| p * (l - mean) * (l - mean)).sum();
    // An edge through a jittered grid of n: the share of one side has variance ∝ n^-1.5.
    shot.camera_variance += spread * share.powf(1.5);
    shot
}

/// Whether another ray through pixel (x, y) meets another surface than that of the first. Along a row and along a column such
/// rays lie at all heights and widths of their pixels, as evenly as the golden ratio spreads them.
pub(crate) fn meets_another(world: &World, view: &View, x: u32, y: u32, shot: &Shot) -> bool {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let [jx, jy] = [2 * x + y, x + 2 * y].map(|k| (GOLDEN * f64::from(k)).fract());
    let ray = view.ray(x as f32 + jx as f32, y as f32 + jy as f32);
    match (first_surface(world, ray), &shot.key) {
        (Some((ray, surface)), Some(key)) => {
            let depth = surface.position.distance(ray.origin);
            !key.continues(&Key::new(&surface, view.footprint(depth)))
        }
        (found, key) => found.is_some() != key.is_some(),
    }
}

/// Calls `pixel` for every index of `which`, in parallel, until stopped; pixels not reached are `None`.
pub(crate) fn over_pixels<T: Send>(
    which: &[u32],
    progress: &dyn Progress,
    pixel: impl Fn(u32) -> T + Sync,
) -> Vec<Option<T>> {
    let run = |chunk: &[u32]| -> Vec<Option<T>> {
        if progress.stopped() {
            return chunk.iter().map(|_| None).collect();
        }
        let done = chunk.iter().map(|&i| Some(pixel(i))).collect();
        progress.advance(chunk.len() as u64);
        done
    };
    which.par_chunks(256).flat_map_iter(run).collect()
}

/// Place of a pixel in the 4 × 4 pattern whose members are spread as evenly as Bayer's matrix does, turned on by a
/// random amount in each block of 4 × 4: a pattern that stood still would show every pixel of a row the same part of
/// a lamp. In a highlight one row high that made 28 % too little light, measured.
fn phase(x: u32, y: u32, seed: u64) -> u32 {
    const BAYER: [u32; 16] = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5];
    let block = u64::from(y / 4) << 32 | u64::from(x / 4);
    let turn = (Rng::new(seed ^ 0x0070_6861_7365, block).f32() * 16.0) as u32;
    (BAYER[(4 * (y % 4) + x % 4) as usize] + turn) % 16
}

/// The first surface that is there: past what an alpha mask cuts out.
fn first_surface(world: &World, mut ray: Ray) -> Option<(Ray, Surface)> {
    for _ in 0..64 {
        let hit = world.closest(&ray)?;
        let surface = world.surface(&ray, &hit);
        if surface.coverage > 0.0 {
            return Some((ray, surface));
        }
        ray.t_min = hit.t;
    }
    None
}

/// Puts hits that continue one another together.
fn group(hits: &[(Ray, Surface)], view: &View) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (i, (ray, surface)) in hits.iter().enumerate() {
        let depth = surface.position.distance(ray.origin);
        let key = Key::new(surface, view.footprint(depth));
        match groups.iter_mut().find(|g| g.key.continues(&key)) {
            Some(g) => g.hits.push(i),
            None => groups.push(Group { key, hits: vec![i] }),
        }
    }
    groups
}

/// Adds the light of one surface: its diffuse part once, at the hit nearest its middle; its specular part for each ray.
/// Returns what it gathered.
fn one_surface(
    hybrid: &Hybrid,
    g: &Group,
    hits: &[(Ray, Surface)],
    effort: Effort,
    gather: Gather,
    share: f32,
    phase: u32,
    shot: &mut Shot,
    rng: &mut Rng,
) -> [Option<Gathered>; 2] {
    let count = g.hits.len() as f32;
    let part = count * share;
    let middle = g.hits.iter().map(|&i| hits[i].1.position).sum::<Vec3>() / count;
    let textured = varies(hybrid.world, g.key.material);
    let albedo_of = |i: usize| hits[i].1.bsdf.diffuse_albedo(-hits[i].0.direction);
    let covered: f32 = g.hits.iter().map(|&i| hits[i].1.coverage).sum();
    let mean_albedo = if textured && g.hits.len() > 1 && covered > 0.0 {
        g.hits.iter().map(|&i| albedo_of(i) * hits[i].1.coverage).sum::<Rgb>() / covered
    } else {
        albedo_of(g.hits[0])
    };
    // Not a black letter where most is white paper: it would tell nothing of the light.
    let telling = |i: usize| {
        !textured || albedo_of(i).luminance() * hits[i].1.coverage >= 0.5 * mean_albedo.luminance()
    };
    let order = |&i: &usize| (!telling(i), hits[i].1.position.distance_squared(middle));
    let first = |a: &&usize, b: &&usize| {
        let (a, b) = (order(a), order(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    let chosen = g.hits.iter().min_by(first).copied().unwrap_or(g.hits[0]);
    let (ray, surface) = &hits[chosen];
    let wo = -ray.direction;
    // A sliver of a pixel needs fewer shadow rays for the same noise in the pixel.
    let shadow = if part < 0.3 && effort.shadow > 4 { effort.shadow / 4 } else { effort.shadow };
    let quality = Quality { shadow, gather, photons: Photons::Always };
    let place = |&i: &usize| {
        let (ray, surface) = &hits[i];
        Start { position: surface.position, seen: Some((surface, -ray.direction)) }
    };
    let places: Vec<Start> = g.hits.iter().map(place).collect();
    let (lit, plan) = hybrid.diffuse(surface, wo, quality, phase, &places, rng);
    let albedo = surface.bsdf.diffuse_albedo(wo);
    let (mean_albedo, coverage) = match textured && g.hits.len() > 1 {
        true => (mean_albedo, covered * share),
        false => (albedo, surface.coverage * part),
    };
    let p = &mut shot.pixel;
    // The texture is averaged over the pixel, the light on it is not.
    p.direct += retinted(lit.direct, albedo, mean_albedo, lit.straight) * coverage;
    p.indirect += retinted(lit.indirect, albedo, mean_albedo, lit.irradiance - lit.straight) * coverage;
    p.irradiance += lit.irradiance * coverage;
    p.albedo += mean_albedo * part;
    let (mut sum, mut steps, mut before) = (Rgb::BLACK, 0.0, None);
    // Light of the diffuse surface per luminance of its texture.
    let per_albedo = lit.irradiance.luminance() / std::f32::consts::PI;
    for &i in &g.hits {
        let (ray, surface) = &hits[i];
        let beside = hybrid.beside_diffuse(surface, ray, &plan, effort.camera, rng);
        p.emission += beside.emission * share;
        sum += beside.specular;
        let mut level = beside.specular.luminance();
        if textured {
            level += beside.emission.luminance()
                + per_albedo * surface.bsdf.diffuse_albedo(-ray.direction).luminance();
        }
        steps += before.replace(level).map_or(0.0, |before: f32| (level - before).powi(2));
        p.normal += surface.ns * share;
        p.depth += surface.position.distance(ray.origin) * share / shot_alpha(hits.len() as f32 * share);
    }
    p.specular += sum * share + lit.glossy * coverage;
    if count > 1.0 {
        // Half the mean square of the step from one stratum to the next: noise counts whole, and a slope across the
        // pixel, which the strata average out, hardly (von Neumann, "Distribution of the Ratio of the Mean Square
        // Successive Difference to the Variance", 1941).
        shot.camera_variance += 0.5 * steps / (count - 1.0) / count * part * part;
    }
    shot.light_variance += lit.variance * coverage * coverage;
    shot.camera_variance += lit.hard_variance * coverage * coverage;
    p.variance += lit.gather_variance * coverage * coverage;
    if part > 0.49 {
        shot.hard = lit.hard.luminance();
        shot.lit = lit.straight.luminance() - shot.hard;
        shot.sent = albedo.luminance() * surface.coverage / std::f32::consts::PI;
    }
    shot.specular |= surface.bsdf.has_specular() || surface.coverage < 1.0;
    lit.gathered
}

/// `light` sent back by a texel of `albedo`, as one of `mean` albedo would send it; where the texel is black in a channel,
/// by the irradiance `e` there.
fn retinted(light: Rgb, albedo: Rgb, mean: Rgb, e: Rgb) -> Rgb {
    let channel = |light: f32, albedo: f32, mean: f32, e: f32| match albedo {
        a if a > 1e-3 || a >= mean => light * if a > 0.0 { mean / a } else { 1.0 },
        _ => mean * e * std::f32::consts::FRAC_1_PI,
    };
    Rgb::new(
        channel(light.r, albedo.r, mean.r, e.r),
        channel(light.g, albedo.g, mean.g, e.g),
        channel(light.b, albedo.b, mean.b, e.b),
    )
}

fn shot_alpha(alpha: f32) -> f32 {
    alpha.max(1e-6)
}

/// Whether a material's look changes within a triangle.
fn varies(world: &World, material: MaterialId) -> bool {
    let m = &world.scene.materials[material.0 as usize];
    m.base_color_texture.is_some()
        || m.metallic_roughness_texture.is_some()
        || m.normal_texture.is_some()
        || m.emissive_texture.is_some()
        || m.has_lobes()
        || !world.scene.mesh.colors.is_empty()
}
