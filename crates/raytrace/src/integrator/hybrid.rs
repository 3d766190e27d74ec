//! The two-pass method: what the eye sees of a diffuse surface comes from the solution, everything else by rays.
//!
//! In Heckbert's letters, from light to eye: `L D E` by shadow rays, `L (D|S)* D E` from the vertices, `L S+ D E`
//! from the photons, and any of them seen through `S+` by following mirror, glass and glossy rays to the first
//! diffuse surface. Each path is counted once: a glossy ray that runs into a lamp is weighed against the shadow
//! rays that looked for the same light.

use super::Layers;
use super::final_gather::{FinalGather, Gathered, trust};
use crate::direct::{Direct, Gloss, Plan, Spend, Start, direct};
use crate::render::DiffuseMode;
use geometry::bsdf::BsdfSample;
use geometry::dispersion::Hue;
use geometry::math::{offset_origin, to_world};
use geometry::sampling::{Lattice2, Rng, cosine_hemisphere};
use geometry::{Hit, Outlook, Passage, Ray, Rgb, Surface, Vec3, World, photometry};
use radiosity::Solution;
use radiosity::element::Side;
use radiosity::gather::{self, ROUGH};

/// Rays of less weight than this live on by chance, in proportion.
const CUTOFF: f32 = 0.005;
/// Surfaces one ray tree passes at most.
const DEEPEST: u32 = 48;
/// Both of a glass surface's rays are followed down to this depth, then one by chance.
const BRANCHING: u32 = 6;
/// A lobe as rough as [`ROUGH`] that sends on less than this is shown the surface's irradiance in place of rays:
/// a dielectric coat is, a rough metal is not.
const FAINT: f32 = 0.12;

/// A caustic of this share of the other light is looked up photon by photon in a mirror.
const HARDLY: f32 = 0.15;

/// Points of a pixel at most that caustics are averaged over.
const CAUSTIC_PLACES: usize = 16;

/// A gather ray lands near by where it flew less than so many times what the mesh resolves there: many others land on the
/// same, and what is wrong with that does not average out. Twice that, and half the doubt that is let be, bring the
/// gallery's error at 5 % from 5.53 to 5.51 % and the image takes a twentieth more time.
const NEAR: f32 = 2.0;
/// What the mesh resolves at most, in units of the rooms' size.
const FINE: f32 = 0.01;
/// Relative error of the mesh up to which a ray that lands near by believes it. Between books it is four times too bright,
/// known at the edges of their covers only.
const UNSURE: f32 = 0.2;

/// The same for what is seen in gloss, where what is wrong with the mesh is blurred, and gathers are many. At half of it the
/// image of a classroom with steel chairs took half as long again and was 8.3 % off instead of 8.6.
const UNSURE_IN_GLOSS: f32 = 0.4;

/// How much to spend on one surface.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// Shadow rays: see [`Plan::new`].
    pub shadow: u32,
    /// Whether to gather at the surface, where the mode or doubt of the mesh asks for it: for what the eye sees directly.
    pub gather: Gather,
    /// Where to look caustics up photon by photon.
    pub photons: Photons,
}

/// Whether to gather at a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gather {
    /// Believe the mesh.
    Never,
    /// Where it is worth it, for a surface that fills this share of a pixel.
    Worth(f32),
    /// It was done before, with this before the surface and behind it.
    Done([Option<Gathered>; 2]),
    /// Where it is worth it, by one of several samples of a pixel that share the rays.
    Shared {
        /// Share of the sample's light that comes by way of the surface.
        part: f32,
        /// Samples of the pixel.
        times: u32,
        /// Relative error of the mesh up to which it is believed in any case.
        unless: f32,
    },
}

/// Where caustics are looked up photon by photon; elsewhere the vertices' blurred ones will do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Photons {
    /// For what the eye sees directly.
    Always,
    /// For what it sees in a mirror or through glass.
    WhereTheyMatter,
    /// For what hardly shows.
    Never,
}

/// Shades surfaces of one world with one solution.
#[derive(Clone, Debug)]
pub struct Hybrid<'a> {
    /// The world.
    pub world: &'a World,
    /// The prepass over it.
    pub solution: &'a Solution,
    /// Through which windows the sky is seen, where that is known.
    pub outlook: Option<&'a Outlook>,
    /// Where a diffuse surface's light comes from.
    pub mode: DiffuseMode,
    /// What surfaces may spend on gathers of their own.
    pub gathers: FinalGather,
}

/// Diffuse light of one surface toward the eye.
#[derive(Clone, Copy, Debug, Default)]
pub struct Diffuse {
    /// Light of emitters, cd/m².
    pub direct: Rgb,
    /// Light by way of other surfaces, cd/m².
    pub indirect: Rgb,
    /// Emitters' light through the glossy lobes, cd/m².
    pub glossy: Rgb,
    /// All irradiance, lx.
    pub irradiance: Rgb,
    /// Of it, what comes straight from emitters by way of shadow rays.
    pub straight: Rgb,
    /// Of that, what lamps without extent bring.
    pub hard: Rgb,
    /// Estimated variance of the luminance from shadow rays.
    pub variance: f32,
    /// The same from where the shadow rays of lamps without extent start.
    pub hard_variance: f32,
    /// The same from a gather.
    pub gather_variance: f32,
    /// What was gathered before the surface and, where light passes it, behind.
    pub gathered: [Option<Gathered>; 2],
}

impl Hybrid<'_> {
    /// The diffuse part of `surface`, and the lamps in its glossy lobes.
    ///
    /// - `phase`: see [`Spend`].
    /// - `places`: points of the surface that caustics are averaged over, which may be finer than a pixel, and that shadow
    ///   rays start from; at least one.
    pub fn diffuse(
        &self,
        surface: &Surface,
        wo: Vec3,
        quality: Quality,
        phase: u32,
        places: &[Start],
        rng: &mut Rng,
    ) -> (Diffuse, Plan<'_>) {
        let (mut out, plan) = self.diffuse_of_side(surface, wo, quality, phase, places, rng);
        if let Some(turned) = surface.turned() {
            let gather = match quality.gather {
                Gather::Done([_, behind]) => Gather::Done([behind, None]),
                other => other,
            };
            let quality = Quality { gather, ..quality };
            let (through, _) = self.diffuse_of_side(&turned, -wo, quality, phase, places, rng);
            out.direct += through.direct;
            out.indirect += through.indirect;
            out.variance += through.variance;
            out.hard_variance += through.hard_variance;
            out.gather_variance += through.gather_variance;
            out.gathered[1] = through.gathered[0];
        }
        (out, plan)
    }

    /// The same without what comes through from the other side.
    fn diffuse_of_side(
        &self,
        surface: &Surface,
        wo: Vec3,
        quality: Quality,
        phase: u32,
        places: &[Start],
        rng: &mut Rng,
    ) -> (Diffuse, Plan<'_>) {
        let plan = Plan::new(self.world, self.outlook, surface.position, surface.ns, quality.shadow);
        let gloss = gloss_of(surface, wo);
        let has_diffuse = surface.bsdf.has_diffuse();
        let from_vertices = self.mode == DiffuseMode::Vertex && has_diffuse;
        let lit = if from_vertices && gloss == Gloss::None {
            Direct::default()
        } else if has_diffuse || gloss != Gloss::None {
            direct(self.world, surface, wo, &plan, gloss, Spend { phase, places }, rng)
        } else {
            Direct::default()
        };
        let mut out = Diffuse {
            direct: lit.diffuse,
            glossy: lit.glossy,
            irradiance: lit.irradiance,
            straight: lit.irradiance,
            hard: lit.hard,
            variance: lit.variance,
            hard_variance: lit.hard_variance,
            ..Diffuse::default()
        };
        let quasi = quasi_diffuse(surface, wo);
        if !has_diffuse && quasi.is_black() {
            return (out, plan);
        }
        let side = Side::met(surface.front);
        let (t, u, v) = (surface.triangle, surface.u, surface.v);
        let spot = self.solution.spot(self.world, t, u, v, side);
        let albedo = surface.bsdf.diffuse_albedo(wo);
        if from_vertices {
            let e = spot.direct();
            out.direct = photometry::reflected_radiance(albedo, e);
            (out.irradiance, out.straight, out.hard) = (e, Rgb::BLACK, Rgb::BLACK);
            (out.variance, out.hard_variance) = (0.0, 0.0);
        }
        let (mut e, doubt) = (spot.irradiance(), spot.doubt());
        let light = e.mean() + out.straight.mean();
        let gathered = match (self.mode, quality.gather) {
            (DiffuseMode::Vertex, _) | (_, Gather::Never) => None,
            (_, Gather::Done([here, _])) => here,
            (DiffuseMode::Split, Gather::Worth(part)) => {
                self.gathers.rays(doubt, light, part).map(|rays| self.gather(surface, rays, rng))
            }
            (DiffuseMode::Gather, Gather::Worth(part)) => {
                Some(self.gather(surface, self.gathers.all_rays(part), rng))
            }
            (_, Gather::Shared { part, times, unless }) => {
                if doubt.mesh > (unless * light).powi(2)
                    && let Some((rays, all)) = self.gathers.some_rays(doubt, light, part, times)
                {
                    e += (self.gather(surface, rays, rng).e - e) * trust(doubt, all);
                }
                None
            }
        };
        out.gathered = [gathered, None];
        if let Some(gathered) = gathered {
            // In `split` it corrects the vertices, in `gather` it stands for itself.
            let trust = if self.mode == DiffuseMode::Gather { 1.0 } else { trust(doubt, gathered.rays) };
            e += (gathered.e - e) * trust;
            let seen = photometry::reflected_radiance(albedo, Rgb::WHITE).luminance();
            out.gather_variance = trust * trust * gathered.variance * seen * seen;
        }
        // Only what the eye sees directly, or nearly so, needs a caustic's own sharpness; in a mirror only where the
        // vertices know of one.
        let blurred = spot.caustic();
        let sharp = match quality.photons {
            Photons::Always => true,
            Photons::WhereTheyMatter => blurred.luminance() > HARDLY * e.luminance(),
            Photons::Never => false,
        };
        e += if sharp && !from_vertices {
            self.caustic_over(places, surface.ng, 0.1 * e.luminance())
        } else {
            blurred
        };
        out.indirect = photometry::reflected_radiance(albedo + quasi, e);
        out.irradiance += e;
        (out, plan)
    }

    /// Mean irradiance by photons over `places`, lx: a few of them where those agree within `tolerance` lx.
    fn caustic_over(&self, places: &[Start], ng: Vec3, tolerance: f32) -> Rgb {
        const FEW: usize = 3;
        let spread_out = |n: usize| places.iter().step_by(places.len().div_ceil(n).max(1));
        let mean = |n: usize| {
            let (mut sum, mut count, mut low, mut high) = (Rgb::BLACK, 0.0, f32::INFINITY, 0f32);
            for place in spread_out(n) {
                let e = self.solution.caustics.irradiance(place.position, ng);
                let y = e.luminance();
                (sum, count, low, high) = (sum + e, count + 1.0, low.min(y), high.max(y));
            }
            (sum / f32::max(count, 1.0), high - low)
        };
        match mean(FEW) {
            (few, spread) if spread <= tolerance || places.len() <= FEW => few,
            _ => mean(CAUSTIC_PLACES).0,
        }
    }

    /// Indirect irradiance by a gather of rays that read the solution where they end.
    fn gather(&self, surface: &Surface, rays: &Lattice2, rng: &mut Rng) -> Gathered {
        let shift = rng.vec2();
        let (mut sum, mut square) = (Rgb::BLACK, 0.0);
        for i in 0..rays.len() {
            let wi = to_world(cosine_hemisphere(rays.point(i, shift)), surface.ns);
            if wi.dot(surface.ng) <= 0.0 {
                continue;
            }
            let ray = Ray::new(offset_origin(surface.position, surface.ng), wi);
            let brought = self.brought(ray, true, rng);
            sum += brought;
            square += brought.luminance() * brought.luminance();
        }
        let n = rays.len() as f32;
        let e = sum / n;
        let spread = (square / n - e.luminance() * e.luminance()).max(0.0);
        Gathered { e, rays: rays.len(), variance: gather::lattice_share(rays.len()) * spread / n }
    }

    /// What one gather ray brings, lx: the light straight from emitters where it lands, and by the solution the rest.
    ///
    /// - `wary`: whether not to believe the solution where the ray lands near by and that is in doubt.
    fn brought(&self, ray: Ray, wary: bool, rng: &mut Rng) -> Rgb {
        // Before the surface and, where light passes it, behind.
        let (mut landings, mut count) = ([None; 2], 0);
        let land = |hit: &Hit, side, weight| {
            landings[count] = Some((*hit, side, weight));
            count += 1;
        };
        let mut sum = gather::follow(self.world, ray, rng, land, |_, _| ()).direct;
        for (hit, side, weight) in landings.into_iter().flatten() {
            let spot = self.solution.spot(self.world, hit.triangle, hit.u, hit.v, side);
            let mut e = spot.irradiance();
            let near = NEAR * spot.extent().max(FINE * self.world.scale);
            if wary && hit.t < near && spot.doubt().mesh > (UNSURE * e.mean()).powi(2) {
                let mesh = &self.world.scene.mesh;
                let at = mesh.interpolate(hit.triangle, hit.u, hit.v, &mesh.positions);
                let normal = mesh.geometric_normal(hit.triangle) * side.sign();
                let onward = to_world(cosine_hemisphere(rng.vec2()), normal);
                e = self.brought(Ray::new(offset_origin(at, normal), onward), false, rng);
            }
            sum += weight * (e + spot.caustic());
        }
        sum
    }

    /// What mirrors, glass and gloss of `surface` show toward `wo`, cd/m², by following one ray for each perfect lobe or
    /// one for a glossy one.
    ///
    /// - `plan`: the lights that shadow rays at `surface` looked for.
    /// - `before`: where the glossy ray came from that met `surface`, if one did: it goes on straight through a pane.
    fn specular(
        &self,
        surface: &Surface,
        wo: Vec3,
        plan: &Plan,
        strand: Strand,
        before: Option<&From>,
        rng: &mut Rng,
    ) -> Rgb {
        let beyond = strand.depth >= DEEPEST;
        if !surface.bsdf.has_specular() || beyond || !quasi_diffuse(surface, wo).is_black() {
            return Rgb::BLACK;
        }
        if !surface.bsdf.is_delta() {
            let u = [rng.f32(), rng.f32(), rng.f32()];
            let Some(next) = surface.bsdf.sample_specular(wo, u) else { return Rgb::BLACK };
            let from = (!next.delta).then_some(From {
                position: surface.position,
                normal: surface.ns,
                plan,
                pdf: next.pdf,
            });
            return self.follow(surface, &next, strand, from.as_ref(), rng);
        }
        // What shadow rays saw through the pane counts but once.
        let onward = |next: &BsdfSample, rng: &mut Rng| {
            self.follow(surface, next, strand, before.filter(|_| next.straight), rng)
        };
        if strand.depth < BRANCHING {
            let lobes = surface.bsdf.delta_lobes(wo);
            return lobes.into_iter().flatten().map(|next| onward(&next, rng)).sum();
        }
        let u = [rng.f32(), rng.f32(), rng.f32()];
        match surface.bsdf.sample_specular(wo, u) {
            Some(next) => onward(&next, rng),
            None => Rgb::BLACK,
        }
    }

    /// One specular ray onward; ends it by chance when little hangs on it.
    fn follow(
        &self,
        surface: &Surface,
        next: &BsdfSample,
        mut strand: Strand,
        from: Option<&From>,
        rng: &mut Rng,
    ) -> Rgb {
        let mut scale = next.weight;
        strand.weight *= scale.max_channel();
        if strand.weight < CUTOFF {
            let live = (strand.weight / CUTOFF).max(0.05);
            if rng.f32() >= live {
                return Rgb::BLACK;
            }
            scale *= 1.0 / live;
            strand.weight = CUTOFF;
        }
        strand.weight = strand.weight.min(1.0);
        strand.depth += 1;
        strand.blurred |= !next.delta;
        scale *= strand.passage.leave(surface, next.wi);
        let away = if next.wi.dot(surface.ng) > 0.0 { surface.ng } else { -surface.ng };
        let ray = Ray::new(offset_origin(surface.position, away), next.wi);
        scale * self.incoming(ray, strand, from, rng)
    }

    /// Radiance that arrives along `ray`, cd/m².
    fn incoming(&self, ray: Ray, mut strand: Strand, from: Option<&From>, rng: &mut Rng) -> Rgb {
        let Some(hit) = self.world.closest(&ray) else {
            let Some(sky) = &self.world.scene.sky else { return Rgb::BLACK };
            let share = from.map_or(1.0, |f| {
                let by_light = f.plan.density_sky(ray.direction);
                f.pdf / (f.pdf + by_light)
            });
            return sky.radiance(ray.direction) * share;
        };
        let mut surface = self.world.surface(&ray, &hit);
        let left = strand.passage.meet(&mut surface, hit.t - ray.t_min, rng);
        let mut sum = Rgb::BLACK;
        if surface.coverage < 1.0 && strand.depth < DEEPEST {
            let beside = strand.beside(surface.coverage);
            if beside.weight > 1e-3 {
                let onward = Ray { t_min: hit.t, ..ray };
                sum += self.incoming(onward, beside, from, rng) * (1.0 - surface.coverage);
            }
        }
        if surface.coverage > 0.0 {
            let share = match from {
                Some(f) if !surface.emission.is_black() => {
                    let light =
                        f.plan.density(self.world, f.position, f.normal, hit.triangle, surface.position);
                    f.pdf / (f.pdf + light)
                }
                _ => 1.0,
            };
            let here = surface.emission * share + self.surface(&surface, -ray.direction, strand, from, rng);
            sum += here * surface.coverage;
        }
        left * sum
    }

    /// Light that a surface met by a specular ray sends back, its own emission left out.
    fn surface(
        &self,
        surface: &Surface,
        wo: Vec3,
        strand: Strand,
        from: Option<&From>,
        rng: &mut Rng,
    ) -> Rgb {
        if let Some(shown) = surface.unlit {
            return shown;
        }
        let shadow = if strand.weight > 0.25 { 4 } else { 1 };
        let sharp = strand.weight > 0.5 && !strand.blurred;
        let photons = if sharp { Photons::WhereTheyMatter } else { Photons::Never };
        let gather = match strand.weight > 0.25 {
            true => Gather::Shared {
                part: strand.weight,
                times: strand.times,
                unless: if strand.blurred { UNSURE_IN_GLOSS } else { 0.0 },
            },
            false => Gather::Never,
        };
        let phase = (rng.f32() * 16.0) as u32;
        let here = Start::at(surface.position);
        let (diffuse, plan) =
            self.diffuse(surface, wo, Quality { shadow, gather, photons }, phase, &[here], rng);
        let specular = self.specular(surface, wo, &plan, strand, from, rng);
        diffuse.direct + diffuse.indirect + diffuse.glossy + specular
    }

    /// What the eye gets of one primary surface besides its diffuse part: emission as such, and the ray tree.
    ///
    /// - `times`: rays that the pixel sends.
    pub fn beside_diffuse(
        &self,
        surface: &Surface,
        ray: &Ray,
        plan: &Plan,
        times: u32,
        rng: &mut Rng,
    ) -> Layers {
        let wo = -ray.direction;
        let mut out = Layers { emission: surface.emission, ..Layers::default() };
        if let Some(shown) = surface.unlit {
            out.emission += shown;
        } else {
            let strand = Strand::one_of(times);
            out.specular = match surface.disperses() {
                false => self.specular(surface, wo, plan, strand, None, rng),
                true => self.rainbow(surface, wo, plan, strand, rng),
            };
        }
        if surface.coverage < 1.0 {
            let onward = Ray::new(offset_origin(surface.position, -surface.ng), ray.direction);
            let beside = Strand::one_of(times).beside(surface.coverage);
            out.emission *= surface.coverage;
            out.specular = out.specular * surface.coverage
                + self.incoming(onward, beside, None, rng) * (1.0 - surface.coverage);
        }
        // What the eye is in.
        let left = Passage::default().absorb(surface, surface.position.distance(ray.origin));
        (out.emission, out.specular) = (out.emission * left, out.specular * left);
        out
    }

    /// The same as [`Hybrid::specular`] of a prism, by a ray of each colour: chance among them would be noise.
    fn rainbow(&self, surface: &Surface, wo: Vec3, plan: &Plan, strand: Strand, rng: &mut Rng) -> Rgb {
        let mut of = |channel| {
            let (mut surface, mut strand) = (surface.clone(), strand);
            let mask = strand.passage.part(&mut surface, Hue::of_channel(channel, rng.f32()));
            mask * self.specular(&surface, wo, plan, strand, None, rng)
        };
        of(0) + of(1) + of(2)
    }
}

/// One ray of the tree that starts at the eye.
#[derive(Clone, Copy, Debug)]
struct Strand {
    /// Share of the pixel's light that comes along it, [0, 1].
    weight: f32,
    /// Surfaces it has passed.
    depth: u32,
    /// Whether one of them was rough: what it meets is seen as through frosted glass.
    blurred: bool,
    /// Such rays that the pixel sends.
    times: u32,
    passage: Passage,
}

impl Strand {
    /// One of so many from the eye.
    fn one_of(times: u32) -> Strand {
        Strand { weight: 1.0, depth: 0, blurred: false, times, passage: Passage::default() }
    }

    /// What goes on beside a surface that covers `coverage` of the way, [0, 1].
    fn beside(self, coverage: f32) -> Strand {
        Strand { weight: self.weight * (1.0 - coverage), depth: self.depth + 1, ..self }
    }
}

/// Where a glossy ray came from, for weighing it against shadow rays.
struct From<'a> {
    position: Vec3,
    normal: Vec3,
    plan: &'a Plan<'a>,
    pdf: f32,
}

/// What shadow rays at `surface` do for its glossy lobes.
fn gloss_of(surface: &Surface, wo: Vec3) -> Gloss {
    if !surface.bsdf.has_specular() || surface.bsdf.is_delta() {
        Gloss::None
    } else if quasi_diffuse(surface, wo).is_black() {
        Gloss::Shared
    } else {
        Gloss::All
    }
}

/// Directional albedo of a lobe so rough and faint that it is shown the diffuse irradiance; black for others.
fn quasi_diffuse(surface: &Surface, wo: Vec3) -> Rgb {
    if !surface.bsdf.has_specular() || surface.bsdf.glossy_roughness() < ROUGH {
        return Rgb::BLACK;
    }
    let albedo = surface.bsdf.specular_albedo(wo);
    if albedo.max_channel() < FAINT { albedo } else { Rgb::BLACK }
}
