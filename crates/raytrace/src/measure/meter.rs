//! Illuminance at one point: direct light by shadow rays, the rest by rays that read the solution where they end.
//!
//! In Heckbert's letters, from light to sensor, each path once: `L x` by light samples; `L (D|S)* D S* x` by gather rays;
//! `L S+ x` by the same gather rays where they run into an emitter. These find no lamp without extent (point, spot, sun)
//! in a mirror or through glass that bends light, and a small one seldom. On a diffuse surface the solution's photons
//! stand in for them then; in mid-air, where no photon lands, such light is not measured.

use super::Statistics;
use crate::direct::{Gloss, Plan, Spend, Start, direct};
use geometry::math::{offset_origin, to_world};
use geometry::sampling::{Lattice2, Rng, cosine_hemisphere};
use geometry::{Hit, Ray, Rgb, Surface, Vec3, World};
use radiosity::element::Side;
use radiosity::gather::follow;
use radiosity::{Progress, Solution};
use rayon::prelude::*;

/// Independent estimates at least, from whose spread the standard error is read: with 16 it is known to a sixth.
const FEWEST: u32 = 16;
/// And at most, where light is hard to find: a sensor costs so much and no more.
const MOST: u32 = 128;
/// Shadow rays of one estimate for a lamp that brings all of the light. Their share of the exact light is a ratio of two
/// sums, and of a lamp half hidden 1.4 % too large with 16 rays, 0.5 % with 64, and so on.
const SHADOW_RAYS: u32 = 256;
/// The standard error may be this share of the error asked, so that about 95 of 100 readings keep to it.
const DOUBT: f32 = 0.5;
/// Standard error of an estimate by photons: of the 80 that it takes the kernel leaves 60 effective ones.
const PHOTON_NOISE: f32 = 0.13;
/// Rays one after the other at most where the mesh does not resolve the light.
const DEEPEST: u32 = 4;
/// So many rays that ran into an emitter by way of mirrors and glass tell as much as those photons.
const ENOUGH: u32 = 64;
/// A sensor this near a surface that faces its way lies on it, in units of the size of the rooms: 1 mm in one of 10 m.
const TOUCHING: f32 = 1e-4;

/// Where to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Its middle, m.
    pub position: Vec3,
    /// Unit; light is weighed by its cosine with this.
    pub normal: Vec3,
    /// Whether it lies on a diffuse surface of the scene, where photons land, and not in mid-air.
    pub on_surface: bool,
}

impl Sensor {
    /// At `position`, facing the unit `normal`; moved onto the surface that it all but touches.
    pub fn at(world: &World, position: Vec3, normal: Vec3) -> Sensor {
        let near = TOUCHING * world.scale;
        let ray = Ray { t_max: 2.0 * near, ..Ray::new(position + normal * near, -normal) };
        if let Some(hit) = world.closest(&ray) {
            let surface = Surface::new(&world.scene, &ray, &hit);
            if surface.ng.dot(normal) > 0.9 && surface.coverage == 1.0 {
                let on_surface = surface.bsdf.has_diffuse();
                return Sensor { position: surface.position, normal, on_surface };
            }
        }
        Sensor { position, normal, on_surface: false }
    }
}

/// Light on one sensor, lx.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Straight from the emitters.
    pub direct: Rgb,
    /// By way of at least one diffuse or rough surface.
    pub indirect: Rgb,
    /// By way of mirrors and glass alone; of lamps without extent on surfaces only.
    pub specular: Rgb,
    /// Standard error of the luminance of the sum, from its own noise: what the solution is off by is not in it.
    pub standard_error: f32,
}

impl Reading {
    /// All light, lx.
    pub fn total(&self) -> Rgb {
        self.direct + self.indirect + self.specular
    }

    /// Illuminance, lx: the luminance of the channels, for these are photometric.
    pub fn illuminance(&self) -> f32 {
        self.total().luminance()
    }
}

/// Measures in one world with one solution.
#[derive(Clone, Copy, Debug)]
pub struct Meter<'a> {
    world: &'a World,
    solution: &'a Solution,
    /// Relative noise to aim at.
    error: f32,
    seed: u64,
    pattern: Lattice2,
    /// Whether some lamp has no extent.
    has_points: bool,
}

impl<'a> Meter<'a> {
    /// For readings whose noise is below `error` (0.01 is 1 %), as far as `MOST` estimates go.
    ///
    /// The rays of one estimate are chosen so that `FEWEST` of them suffice in most rooms.
    pub fn new(world: &'a World, solution: &'a Solution, error: f32, seed: u64) -> Meter<'a> {
        let rays = (128.0 * (0.01 / error.clamp(1e-4, 1.0)).powf(1.25)).clamp(16.0, 2048.0);
        let pattern = Lattice2::new((rays as u32).next_multiple_of(8));
        Meter { world, solution, error, seed, pattern, has_points: !world.scene.lights.is_empty() }
    }

    /// Reads all of `sensors`, over threads; number `first` + i seeds the i-th. `None` when `progress` said stop. It hears
    /// of one step for each sensor.
    ///
    /// All get the same number of estimates, doubled until their noise together is what was asked: a sensor that
    /// stopped by itself where it seems to know enough would leave out what few rays find, and read 1 % too dark in a
    /// furnished room.
    pub fn read_all(&self, sensors: &[Sensor], first: u64, progress: &dyn Progress) -> Option<Vec<Reading>> {
        let mut tallies = vec![Tally::default(); sensors.len()];
        let (mut done, mut wanted) = (0, FEWEST);
        loop {
            let add = |(i, (sensor, tally)): (usize, (&Sensor, &mut Tally))| {
                if !progress.stopped() {
                    self.add(sensor, first + i as u64, done..wanted, tally);
                }
                progress.advance(u64::from(done == 0));
            };
            sensors.par_iter().zip(&mut tallies).enumerate().for_each(add);
            if progress.stopped() {
                return None;
            }
            let read = |(sensor, tally): (&Sensor, &Tally)| self.reading(sensor, tally);
            let readings: Vec<Reading> = sensors.par_iter().zip(&tallies).map(read).collect();
            let noise = Statistics::of_readings(&readings).noise;
            if noise <= f64::from(DOUBT * self.error) || wanted >= MOST {
                return Some(readings);
            }
            (done, wanted) = (wanted, 2 * wanted);
        }
    }

    /// Reads one sensor; `stream` seeds it.
    pub fn read(&self, sensor: &Sensor, stream: u64) -> Reading {
        self.read_all(&[*sensor], stream, &()).and_then(|r| r.first().copied()).unwrap_or_default()
    }

    /// Adds the estimates of these numbers to what is known at a sensor.
    fn add(&self, sensor: &Sensor, stream: u64, numbers: std::ops::Range<u32>, tally: &mut Tally) {
        let sheet = Surface::white_sheet(sensor.position, sensor.normal);
        let plan =
            Plan::new(self.world, self.world.emitters.outlook(), sensor.position, sensor.normal, SHADOW_RAYS);
        for number in numbers {
            let mut rng = Rng::new(self.seed ^ 0x006d_6574_6572, (stream << 12) | u64::from(number));
            let (one, found) = self.estimate(sensor, &sheet, &plan, &mut rng);
            let share = 1.0 / (number + 1) as f32;
            tally.mean.direct = tally.mean.direct.lerp(one.direct, share);
            tally.mean.indirect = tally.mean.indirect.lerp(one.indirect, share);
            tally.mean.specular = tally.mean.specular.lerp(one.specular, share);
            tally.whole.add(one.illuminance());
            tally.rest.add((one.direct + one.indirect).luminance());
            tally.found += found;
        }
    }

    /// What the estimates come to; photons stand in where rays tell less.
    fn reading(&self, sensor: &Sensor, tally: &Tally) -> Reading {
        if sensor.on_surface && (self.has_points || tally.found < ENOUGH) {
            let photons = self.solution.caustics.irradiance(sensor.position, sensor.normal);
            if !photons.is_black() {
                let noise = PHOTON_NOISE * photons.luminance();
                let standard_error = tally.rest.standard_error().hypot(noise);
                return Reading { specular: photons, standard_error, ..tally.mean };
            }
        }
        Reading { standard_error: tally.whole.standard_error(), ..tally.mean }
    }

    /// One estimate, and the number of rays that ran into an emitter by way of mirrors and glass.
    fn estimate(&self, sensor: &Sensor, sheet: &Surface, plan: &Plan, rng: &mut Rng) -> (Reading, u32) {
        let Sensor { position, normal, .. } = *sensor;
        let spend = Spend { phase: rng.below(16), places: &[Start::at(position)] };
        let straight = direct(self.world, sheet, normal, plan, Gloss::None, spend, rng);
        let mut out = Reading { direct: straight.irradiance, ..Reading::default() };
        let mut found = 0;
        let shift = rng.vec2();
        let share = 1.0 / self.pattern.len() as f32;
        for i in 0..self.pattern.len() {
            let wi = to_world(cosine_hemisphere(self.pattern.point(i, shift)), normal);
            let ray = Ray::new(offset_origin(position, normal), wi);
            let mut landings = Landings::default();
            let followed =
                follow(self.world, ray, rng, |hit, side, weight| landings.push(hit, side, weight), |_, _| ());
            out.indirect += (followed.direct + self.reflected(&landings, 0, rng)) * share;
            out.specular += followed.mirrored * share;
            found += u32::from(!followed.mirrored.is_black());
        }
        (out, found)
    }

    /// π times the radiance that comes back from where a ray landed of light that was there before, cd/m².
    fn reflected(&self, landings: &Landings, depth: u32, rng: &mut Rng) -> Rgb {
        let of = |(hit, side, weight): (Hit, Side, Rgb)| weight * self.indirect(&hit, side, depth, rng);
        landings.at.into_iter().flatten().map(of).sum()
    }

    /// Irradiance (lx) on a place of a surface of all but the emitters' own light: the solution's, or by a further ray
    /// where its mesh does not resolve the light.
    fn indirect(&self, hit: &Hit, side: Side, depth: u32, rng: &mut Rng) -> Rgb {
        let (world, t, u, v) = (self.world, hit.triangle, hit.u, hit.v);
        let caustic = self.solution.caustic(world, t, u, v, side);
        if depth >= DEEPEST || !self.solution.unresolved(t, u, v, side) {
            return caustic + self.solution.irradiance(world, t, u, v, side);
        }
        let n = world.scene.mesh.geometric_normal(t) * side.sign();
        let p = world.scene.mesh.interpolate(t, u, v, &world.scene.mesh.positions);
        let ray = Ray::new(offset_origin(p, n), to_world(cosine_hemisphere(rng.vec2()), n));
        let mut landings = Landings::default();
        let followed =
            follow(world, ray, rng, |hit, side, weight| landings.push(hit, side, weight), |_, _| ());
        caustic + followed.direct + self.reflected(&landings, depth + 1, rng)
    }
}

/// Where one ray landed: the surface and the share of its irradiance that comes back. Two sides of a translucent one.
#[derive(Default)]
struct Landings {
    at: [Option<(Hit, Side, Rgb)>; 2],
}

impl Landings {
    fn push(&mut self, hit: &Hit, side: Side, weight: Rgb) {
        let free = if self.at[0].is_none() { 0 } else { 1 };
        self.at[free] = Some((*hit, side, weight));
    }
}

/// Estimates of one sensor so far.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    mean: Reading,
    /// Of all that the rays find.
    whole: Spread,
    /// Without what photons may stand in for.
    rest: Spread,
    /// Rays that ran into an emitter by way of mirrors and glass.
    found: u32,
}

/// Mean and spread of numbers as they come (Welford, Technometrics 4, 1962).
#[derive(Clone, Copy, Debug, Default)]
struct Spread {
    count: f64,
    mean: f64,
    square: f64,
}

impl Spread {
    fn add(&mut self, v: f32) {
        let step = f64::from(v) - self.mean;
        self.count += 1.0;
        self.mean += step / self.count;
        self.square += step * (f64::from(v) - self.mean);
    }

    /// Of the mean.
    fn standard_error(&self) -> f32 {
        (self.square.max(0.0) / (self.count * (self.count - 1.0).max(1.0))).sqrt() as f32
    }
}
