//! Constant patches, the unknowns of the classical methods: the leaves of the element mesh, uniformly fine, each side
//! that light can reach a patch of its own.

use crate::element::{Elements, Side};
use crate::gather::ROUGH;
use crate::reach::Reach;
use geometry::math::{Vec2, offset_origin};
use geometry::sampling::{self, Lattice2, Rng};
use geometry::{Hit, Material, Ray, Rgb, Surface, Vec3, World, photometry, triangle};
use rayon::prelude::*;

/// Points that a patch's textures are averaged over.
const TEXELS: u32 = 16;
/// Points of a patch that light from lamps which are no patches is sampled at, and samples of a sky.
const LAMP_POINTS: u32 = 4;
const SKY_SAMPLES: u32 = 64;

/// One side of one leaf.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Leaf of the element mesh.
    pub leaf: u32,
    /// Scene triangle it is part of.
    pub triangle: u32,
    /// Which side of it.
    pub side: Side,
    /// Barycentrics of the leaf's corners on the scene triangle.
    pub uv: [[f32; 2]; 3],
    /// Area, less what alpha leaves out, m².
    pub area: f32,
    /// Share reflected diffusely, mean over the patch, [0, 1].
    pub reflectance: Rgb,
    /// Share reflected by a rough coat, mean over the patch and all directions, [0, 1]; 0 for a sharp one.
    pub gloss: Rgb,
    /// Own light, mean over the patch, lm/m².
    pub exitance: Rgb,
}

/// All patches of a world.
#[derive(Clone, Debug)]
pub struct Patches {
    /// The mesh whose leaves they are.
    pub elements: Elements,
    /// In the order of the leaves.
    pub all: Vec<Patch>,
    /// Patch of each side of each node, at 2 · node + side.
    of: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Patches {
    /// Splits the scene's triangles evenly into as many patches as fit into `most`; a scene with more triangles keeps its own.
    ///
    /// A side is a patch if it reflects diffusely and light can come to it, or if it shines.
    pub fn new(world: &World, most: usize, seed: u64) -> Patches {
        let whole = Elements::new(&world.scene.mesh);
        let reach = Reach::explore(world, &whole, seed);
        let split = |longest: f32| {
            let mut elements = whole.clone();
            elements.split_longer_than(longest, usize::MAX);
            let patches = Patches::of_leaves(world, elements, &reach);
            (patches.all.len() <= most).then_some(patches)
        };
        let lit = Patches::of_leaves(world, whole.clone(), &reach);
        if lit.all.len() >= most {
            return lit.averaged(world);
        }
        // Bisection makes right triangles of longest edge h and area h²/4, or halves of that.
        let area: f32 = lit.all.iter().map(|p| p.area).sum();
        let guess = (5.0 * area / most as f32).sqrt();
        let (mut low, mut high) = (0.4 * guess, 4.0 * guess);
        let mut best = lit;
        for _ in 0..6 {
            let middle = (low * high).sqrt();
            match split(middle) {
                Some(finer) => {
                    if finer.all.len() >= best.all.len() {
                        best = finer;
                    }
                    high = middle;
                }
                None => low = middle,
            }
        }
        best.averaged(world)
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The patch that holds the point (u, v) of a scene triangle, on one side.
    pub fn at(&self, triangle: u32, u: f32, v: f32, side: Side) -> Option<u32> {
        self.elements.piece(triangle)?;
        let (leaf, _) = self.elements.locate(triangle, u, v);
        self.of_leaf(leaf, side)
    }

    /// The patch on one side of a leaf.
    pub fn of_leaf(&self, leaf: u32, side: Side) -> Option<u32> {
        let patch = self.of[2 * leaf as usize + side.index()];
        (patch != NONE).then_some(patch)
    }

    /// Corners of a patch, counter-clockwise seen from its side.
    pub fn corners(&self, patch: u32) -> [Vec3; 3] {
        let Patch { leaf, side, .. } = self.all[patch as usize];
        let [a, b, c] = self.elements.corners(leaf);
        if side == Side::Front { [a, b, c] } else { [a, c, b] }
    }

    /// Unit normal on the patch's side.
    pub fn normal(&self, patch: u32) -> Vec3 {
        let [a, b, c] = self.corners(patch);
        triangle::normal(a, b, c)
    }

    /// The point with weights 1 − s − t, s and t of a patch's corners, in the world and on the scene's triangle, which
    /// has the same corners in the leaf's own order.
    pub fn point(&self, patch: u32, [s, t]: [f32; 2]) -> (Vec3, [f32; 2]) {
        let p = &self.all[patch as usize];
        let [a, b, c] = self.elements.corners(p.leaf);
        let uv = [0, 1].map(|k| p.uv[0][k] * (1.0 - s - t) + p.uv[1][k] * s + p.uv[2][k] * t);
        (a + ((b - a) * s + (c - a) * t), uv)
    }

    /// Light that all patches send out by themselves, lm.
    pub fn power(&self) -> Rgb {
        self.all.iter().map(|p| p.exitance * p.area).sum()
    }

    fn of_leaves(world: &World, elements: Elements, reach: &Reach) -> Patches {
        let scene = &world.scene;
        let mut all = Vec::new();
        elements.visit_leaf_corners(scene.mesh.triangles.len() as u32, |leaf, triangle, uv| {
            let material = &scene.materials[scene.mesh.materials[triangle as usize].0 as usize];
            for side in Side::BOTH {
                let shines = material.is_emissive() && (side == Side::Front || material.double_sided);
                let lit = reach.alive(elements.face_of(leaf), side) && material.may_be_diffuse();
                if shines || lit {
                    let [a, b, c] = elements.corners(leaf);
                    let area = triangle::area(a, b, c);
                    let (reflectance, gloss, exitance) = (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK);
                    all.push(Patch { leaf, triangle, side, uv, area, reflectance, gloss, exitance });
                }
            }
        });
        // Leaves come by scene triangle and depth first; in the order of the leaves neighbours of a number are neighbours.
        all.sort_unstable_by_key(|p: &Patch| (p.leaf, p.side.index()));
        let mut of = vec![NONE; 2 * elements.nodes.len()];
        for (i, p) in all.iter().enumerate() {
            of[2 * p.leaf as usize + p.side.index()] = i as u32;
        }
        Patches { elements, all, of }
    }

    /// With reflectance, exitance and coverage averaged over every patch.
    fn averaged(mut self, world: &World) -> Patches {
        let values: Vec<_> =
            (0..self.all.len() as u32).into_par_iter().map(|i| self.average(world, i)).collect();
        for (p, (reflectance, gloss, exitance, coverage)) in self.all.iter_mut().zip(values) {
            (p.reflectance, p.gloss, p.exitance) = (reflectance, gloss, exitance);
            p.area *= coverage;
        }
        self
    }

    fn average(&self, world: &World, patch: u32) -> (Rgb, Rgb, Rgb, f32) {
        let p = &self.all[patch as usize];
        let normal = self.normal(patch);
        let material = &world.scene.materials[world.scene.mesh.materials[p.triangle as usize].0 as usize];
        let points = if is_textured(material) || !world.scene.mesh.colors.is_empty() { TEXELS } else { 1 };
        let pattern = Lattice2::new(points);
        let (mut rho, mut gloss, mut exitance, mut coverage) = (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK, 0.0);
        for k in 0..points {
            let (s, t) = match points {
                1 => (1.0 / 3.0, 1.0 / 3.0),
                _ => sampling::triangle(pattern.point(k, Vec2::splat(0.5 / points as f32))),
            };
            let (position, [u, v]) = self.point(patch, [s, t]);
            let ray = Ray::new(position + normal, -normal);
            let surface = Surface::new(&world.scene, &ray, &Hit { t: 1.0, triangle: p.triangle, u, v });
            if surface.unlit.is_some() {
                continue;
            }
            coverage += surface.coverage;
            exitance += photometry::exitance_from_radiance(surface.emission) * surface.coverage;
            rho += surface.bsdf.diffuse_reflectance() * surface.coverage;
            if surface.bsdf.has_specular() && surface.bsdf.glossy_roughness() >= ROUGH {
                gloss += hemispherical_gloss(&surface) * surface.coverage;
            }
        }
        if coverage <= 0.0 {
            return (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK, 0.0);
        }
        (rho / coverage, gloss / coverage, exitance / coverage, coverage / points as f32)
    }

    /// Irradiance straight from lamps that are no patches (punctual ones and the sky), mean over every patch, lx.
    pub fn lamps(&self, world: &World, seed: u64) -> Vec<Rgb> {
        use geometry::emitter::EmitterKind;
        let far = |(i, kind): (usize, &EmitterKind)| match kind {
            EmitterKind::Punctual(_) => Some((i as u32, LAMP_POINTS)),
            EmitterKind::Sky(_) => Some((i as u32, SKY_SAMPLES)),
            _ => None,
        };
        let lamps: Vec<(u32, u32)> = world.emitters.lights().iter().enumerate().filter_map(far).collect();
        let at = |patch: u32| {
            let normal = self.normal(patch);
            let mut rng = Rng::new(seed ^ 0x6c61_6d70, u64::from(patch));
            let mut sum = Rgb::BLACK;
            for &(light, samples) in &lamps {
                let pattern = Lattice2::new(samples);
                let (on, of) = (rng.vec2(), rng.vec2());
                for k in 0..samples {
                    let (s, t) = sampling::triangle(pattern.point(k, on));
                    let (position, _) = self.point(patch, [s, t]);
                    let u = pattern.point(k * 7 + 3, of).to_array();
                    let Some(l) = world.emitters.sample_light(&world.scene, light, position, normal, u)
                    else {
                        continue;
                    };
                    let cos = l.wi.dot(normal);
                    let brought = l.radiance * (cos / l.pdf / samples as f32);
                    if cos > 0.0 && brought.is_finite() && !brought.is_black() {
                        sum += brought * world.transmittance(&l.shadow_ray(position, normal));
                    }
                }
            }
            sum
        };
        (0..self.all.len() as u32).into_par_iter().map(at).collect()
    }

    /// A ray that leaves a patch from the point with weights `st`, toward `wi`, and the share of light that alpha lets
    /// leave there.
    pub fn leave(&self, world: &World, patch: u32, st: [f32; 2], wi: Vec3) -> (Ray, f32) {
        let p = &self.all[patch as usize];
        let (position, [u, v]) = self.point(patch, st);
        let material = &world.scene.materials[world.scene.mesh.materials[p.triangle as usize].0 as usize];
        let coverage = match material.alpha_mode {
            geometry::AlphaMode::Opaque => 1.0,
            _ => {
                let mean = p.area / self.whole_area(patch);
                geometry::surface::coverage_at(&world.scene, &Hit { t: 0.0, triangle: p.triangle, u, v })
                    / mean
            }
        };
        (Ray::new(offset_origin(position, self.normal(patch)), wi), coverage)
    }

    fn whole_area(&self, patch: u32) -> f32 {
        let [a, b, c] = self.corners(patch);
        triangle::area(a, b, c).max(f32::MIN_POSITIVE)
    }
}

fn is_textured(m: &Material) -> bool {
    [
        &m.base_color_texture,
        &m.metallic_roughness_texture,
        &m.emissive_texture,
        &m.specular_texture,
        &m.specular_color_texture,
        &m.transmission_texture,
    ]
    .iter()
    .any(|t| t.is_some())
}

/// Share that the lobes other than diffuse send on of light that is the same from everywhere: the mean of their albedo
/// over directions by the cosine, at four of equal weight.
fn hemispherical_gloss(surface: &Surface) -> Rgb {
    let (tangent, _) = geometry::math::frame(surface.ns);
    let toward = |k: u32| {
        let cos2 = (k as f32 + 0.5) / 4.0;
        surface.ns * cos2.sqrt() + tangent * (1.0 - cos2).sqrt()
    };
    (0..4).map(|k| surface.bsdf.specular_albedo(toward(k))).sum::<Rgb>() * 0.25
}
