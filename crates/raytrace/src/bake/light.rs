//! The light at a point of a surface, whoever looks at it.

use super::Light;
use crate::direct::{Gloss, Plan, Spend, Start, direct};
use crate::integrator::final_gather::FinalGather;
use crate::integrator::hybrid::{Diffuse, Gather, Hybrid, Photons, Quality};
use crate::render::DiffuseMode;
use geometry::bsdf::{Bsdf, Shading};
use geometry::math::offset_origin;
use geometry::photometry::reflected_radiance;
use geometry::sampling::Rng;
use geometry::surface::base_color_at;
use geometry::{Hit, Ray, Rgb, Surface, World};
use radiosity::Solution;
use radiosity::element::Side;

/// A place on one side of a scene triangle.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Scene triangle.
    pub triangle: u32,
    /// Barycentrics of its second and third corner.
    pub uv: [f32; 2],
    /// Which side.
    pub side: Side,
}

/// What comes from there.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// What a white matt surface would send back, E/π, cd/m².
    pub white: Rgb,
    /// The surface's own radiance, cd/m².
    pub emission: Rgb,
    /// Base colour, [0, 1].
    pub base: Rgb,
    /// Alpha, [0, 1].
    pub alpha: f32,
    /// Whether hardly an eye can get there: something lies close above, or around it.
    pub hidden: bool,
    /// Variance of the luminance of `white`: right in the mean of many places, not for one.
    pub variance: f32,
}

impl Seen {
    /// The radiance of the surface taken for matt: what it reflects, and its own, cd/m².
    pub fn radiance(&self) -> Rgb {
        self.base * self.white + self.emission
    }
}

/// Looks light up: direct light by shadow rays, the rest from the solution, or gathered where it has none.
#[derive(Clone, Debug)]
pub struct Lamp<'a> {
    by_vertices: Hybrid<'a>,
    by_rays: Hybrid<'a>,
    shadow: u32,
}

impl<'a> Lamp<'a> {
    /// - `shadow`: shadow rays of each look.
    pub fn new(world: &'a World, solution: &'a Solution, shadow: u32) -> Lamp<'a> {
        let gathers = FinalGather::new(GATHER_RAYS, DOUBTED, solution.report.mean.mean());
        let outlook = world.emitters.outlook();
        let by_vertices = Hybrid { world, solution, outlook, mode: DiffuseMode::Split, gathers };
        let by_rays = Hybrid { mode: DiffuseMode::Gather, ..by_vertices.clone() };
        Lamp { by_vertices, by_rays, shadow }
    }

    /// What is seen at `place` from straight above it, by two looks, whose difference tells the noise.
    ///
    /// With A and B the looks and m their mean, (x − m)² less the variance stated is (x − A)(x − B): what x is off, free
    /// of the noise that the looks do not share.
    pub fn seen(&self, place: Place, rng: &mut Rng) -> Seen {
        let spot = self.spot(place);
        let (first, plan) = self.shine(&spot, rng);
        // Only what is drawn by chance is looked at twice: vertices and photons say the same again.
        let chance_alone = spot.known && !spot.translucent && first.gather_variance == 0.0;
        let second = match chance_alone {
            true => Diffuse { direct: self.straight(&spot, &plan, rng), ..first },
            false => self.shine(&spot, rng).0,
        };
        let [a, b] = [first, second].map(|shown| spot.white(&shown));
        let half = 0.5 * (a - b).luminance();
        Seen { variance: half * half, ..self.told(spot, (a + b) * 0.5) }
    }

    /// The same by one look, whose noise is not known.
    pub fn look(&self, place: Place, rng: &mut Rng) -> Seen {
        let spot = self.spot(place);
        let white = spot.white(&self.shine(&spot, rng).0);
        self.told(spot, white)
    }

    fn spot(&self, place: Place) -> Spot {
        let scene = &self.by_vertices.world.scene;
        let surface = surface_at(self.by_vertices.world, place);
        let (base, alpha) = base_color_at(scene, &hit(place));
        let emission = surface.emission;
        // The solution has values only where light is reflected diffusely.
        let known = scene.materials[surface.material.0 as usize].may_be_diffuse();
        let translucent = surface.bsdf.is_translucent();
        let surface = match translucent {
            true => surface,
            false => {
                let bsdf = Bsdf::new(&Shading::LAMBERT, surface.ns, surface.ng, surface.front);
                Surface { bsdf, unlit: None, ..surface }
            }
        };
        Spot { surface, base, alpha, emission, known, translucent }
    }

    fn shine(&self, spot: &Spot, rng: &mut Rng) -> (Diffuse, Plan<'_>) {
        let hybrid = if spot.known { &self.by_vertices } else { &self.by_rays };
        let quality = Quality { shadow: self.shadow, gather: Gather::Worth(1.0), photons: Photons::Always };
        let phase = rng.below(16);
        hybrid.diffuse(
            &spot.surface,
            spot.surface.ng,
            quality,
            phase,
            &[Start::at(spot.surface.position)],
            rng,
        )
    }

    /// The light of the lamps alone, once more.
    fn straight(&self, spot: &Spot, plan: &Plan, rng: &mut Rng) -> Rgb {
        let (world, surface) = (self.by_vertices.world, &spot.surface);
        let spend = Spend { phase: rng.below(16), places: &[Start::at(surface.position)] };
        direct(world, surface, surface.ng, plan, Gloss::None, spend, rng).diffuse
    }

    fn told(&self, spot: Spot, white: Rgb) -> Seen {
        let white = if white.is_finite() { white } else { Rgb::BLACK };
        let hidden = self.is_hidden(&spot.surface, white);
        let Spot { base, alpha, emission, .. } = spot;
        Seen { white, emission, base, alpha, hidden, variance: 0.0 }
    }

    /// Whether the ray straight up from `surface` ends close by, or in the dark on something's inside.
    fn is_hidden(&self, surface: &Surface, white: Rgb) -> bool {
        let world = self.by_vertices.world;
        let ray = Ray::new(offset_origin(surface.position, surface.ng), surface.ng);
        let Some(hit) = world.closest(&ray) else { return false };
        let inside = world.scene.mesh.geometric_normal(hit.triangle).dot(ray.direction) > 0.0;
        let usual = reflected_radiance(Rgb::WHITE, self.by_vertices.solution.report.mean);
        hit.t < CLOSE * world.scale || (inside && white.luminance() < DARK * usual.luminance())
    }
}

/// A place's surface, taken for white and matt where it is not translucent.
struct Spot {
    surface: Surface,
    base: Rgb,
    alpha: f32,
    emission: Rgb,
    /// Whether the solution has values there.
    known: bool,
    translucent: bool,
}

impl Spot {
    /// What a white matt surface would send back, cd/m².
    fn white(&self, shown: &Diffuse) -> Rgb {
        let white = shown.direct + shown.indirect;
        if !self.translucent {
            return white;
        }
        // What comes through from behind, as if it had come from the front.
        let per = |l: f32, base: f32| l / base.max(0.02);
        Rgb::new(per(white.r, self.base.r), per(white.g, self.base.g), per(white.b, self.base.b))
    }
}

/// Closer than this nobody looks in, in units of the rooms' size: 2 cm in a room of 5 m.
const CLOSE: f32 = 0.004;
/// Darker than this share of the usual indirect light is the inside of things.
const DARK: f32 = 0.1;

/// Rays of a gather in one look: many looks make up a vertex or a texel's neighbourhood.
const GATHER_RAYS: u32 = 64;
/// Relative error of the mesh from which on a look gathers: where it knows next to nothing. Where what is gathered meets what
/// is not, light has a step that vertices had to follow: at 0.25 they were off by 2.2 % instead of 1.7 %.
const DOUBTED: f32 = 1.0;

/// The surface at `place`, looked at along its normal.
fn surface_at(world: &World, place: Place) -> Surface {
    let Place { triangle, uv: [u, v], side } = place;
    let mesh = &world.scene.mesh;
    let n = mesh.geometric_normal(triangle) * side.sign();
    let p = mesh.interpolate(triangle, u, v, &mesh.positions);
    Surface::new(&world.scene, &Ray::new(p + n, -n), &hit(place))
}

fn hit(Place { triangle, uv: [u, v], .. }: Place) -> Hit {
    Hit { t: 1.0, triangle, u, v }
}

/// The same by the solution's vertices alone: coarse, and without a ray.
pub fn roughly(world: &World, solution: &Solution, place: Place) -> Seen {
    let Place { triangle, uv: [u, v], side } = place;
    let (base, alpha) = base_color_at(&world.scene, &hit(place));
    let spot = solution.spot(world, triangle, u, v, side);
    let e = spot.irradiance() + spot.direct() + spot.caustic();
    let white = reflected_radiance(Rgb::WHITE, e);
    let emission = surface_at(world, place).emission;
    Seen { white, emission, base, alpha, hidden: false, variance: 0.0 }
}

/// The world for the light that is wanted, where it is another than all of it.
pub fn without_lamps(world: &World, light: Light) -> Option<World> {
    (light == Light::Indirect && !world.scene.lights.is_empty()).then(|| {
        let mut scene = world.scene.clone();
        scene.lights.clear();
        World::new(scene)
    })
}
