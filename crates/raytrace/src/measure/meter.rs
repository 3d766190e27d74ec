//! Illuminance at one point: direct light by shadow rays, the rest by rays that read the solution where they end.
//!
//! In Heckbert's letters, from light to sensor, each path once: `L x` by light samples; `L (D|S)* D S* x` by gather rays;
//! `L S+ x` by the same gather rays where they run into an emitter. These find no lamp without extent (point, spot, sun)
//! in a mirror or through glass that bends light, and a small one seldom. On a diffuse surface the solution's photons
//! stand in for them then; in mid-air, where no photon lands, such light is not measured.

use crate::direct::{Gloss, Plan, Spend, direct};
use geometry::math::{offset_origin, to_world};
use geometry::sampling::{Lattice2, Rng, cosine_hemisphere};
use geometry::{Ray, Rgb, Surface, Vec3, World};
use radiosity::gather::follow;
use radiosity::{Progress, Solution};
use rayon::prelude::*;

/// Independent estimates at least, from whose spread the standard error is read: with 8 it is known to a quarter.
const FEWEST: u32 = 8;
/// And at most, where light is hard to find: a sensor costs so much and no more.
const MOST: u32 = 128;
/// Shadow rays of one estimate for a lamp that brings all of the light.
const SHADOW_RAYS: u32 = 64;
/// The standard error may be this share of the error asked, so that about 95 of 100 readings keep to it.
const DOUBT: f32 = 0.5;
/// Standard error of an estimate by photons: of the 80 that it takes the kernel leaves 60 effective ones.
const PHOTON_NOISE: f32 = 0.13;
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
    /// For readings whose noise is below `error` (0.01 is 1 %), as far as [`MOST`] estimates go.
    ///
    /// The rays of one estimate are chosen so that eight of them suffice in a furnished room.
    pub fn new(world: &'a World, solution: &'a Solution, error: f32, seed: u64) -> Meter<'a> {
        let rays = (128.0 * (0.01 / error.clamp(1e-4, 1.0)).powf(1.25)).clamp(16.0, 2048.0);
        let pattern = Lattice2::new((rays as u32).next_multiple_of(8));
        Meter { world, solution, error, seed, pattern, has_points: !world.scene.lights.is_empty() }
    }

    /// Reads all of `sensors`, over threads; number `first` + i seeds the i-th. `None` for those not reached when
    /// `progress` said stop.
    pub fn read_all(&self, sensors: &[Sensor], first: u64, progress: &dyn Progress) -> Vec<Option<Reading>> {
        let read = |(i, sensor): (usize, &Sensor)| {
            let reading = (!progress.stopped()).then(|| self.read(sensor, first + i as u64));
            progress.advance(1);
            reading
        };
        sensors.par_iter().enumerate().map(read).collect()
    }

    /// Reads one sensor; `stream` seeds it.
    pub fn read(&self, sensor: &Sensor, stream: u64) -> Reading {
        let sheet = Surface::white_sheet(sensor.position, sensor.normal);
        let plan = Plan::new(self.world, sensor.position, sensor.normal, SHADOW_RAYS);
        let photons = if sensor.on_surface {
            self.solution.caustics.irradiance(sensor.position, sensor.normal)
        } else {
            Rgb::BLACK
        };
        let by_photons = |found: u32| !photons.is_black() && (self.has_points || found < ENOUGH);
        let mut mean = Reading::default();
        // Of all that the rays find, and without what the photons may stand in for.
        let (mut whole, mut rest) = (Spread::default(), Spread::default());
        let (mut estimates, mut found) = (0, 0);
        while estimates < MOST {
            let mut rng = Rng::new(self.seed ^ 0x006d_6574_6572, (stream << 8) | u64::from(estimates));
            let (one, mirrored) = self.estimate(sensor, &sheet, &plan, &mut rng);
            estimates += 1;
            found += mirrored;
            let share = 1.0 / estimates as f32;
            mean.direct = mean.direct.lerp(one.direct, share);
            mean.indirect = mean.indirect.lerp(one.indirect, share);
            mean.specular = mean.specular.lerp(one.specular, share);
            whole.add(one.illuminance());
            rest.add((one.direct + one.indirect).luminance());
            let spread = if by_photons(found) { &rest } else { &whole };
            let goal = DOUBT * self.error * mean.illuminance();
            if estimates >= FEWEST && spread.standard_error() <= goal {
                break;
            }
        }
        if by_photons(found) {
            mean.specular = photons;
            mean.standard_error = rest.standard_error().hypot(PHOTON_NOISE * photons.luminance());
        } else {
            mean.standard_error = whole.standard_error();
        }
        mean
    }

    /// One estimate, and the number of rays that ran into an emitter by way of mirrors and glass.
    fn estimate(&self, sensor: &Sensor, sheet: &Surface, plan: &Plan, rng: &mut Rng) -> (Reading, u32) {
        let Sensor { position, normal, .. } = *sensor;
        let spend = Spend { samples: SHADOW_RAYS, phase: rng.below(16), places: &[position] };
        let straight = direct(self.world, sheet, normal, plan, Gloss::None, spend, rng);
        let mut out = Reading { direct: straight.irradiance, ..Reading::default() };
        let mut found = 0;
        let shift = rng.vec2();
        let share = 1.0 / self.pattern.len() as f32;
        for i in 0..self.pattern.len() {
            let wi = to_world(cosine_hemisphere(self.pattern.point(i, shift)), normal);
            let ray = Ray::new(offset_origin(position, normal), wi);
            let mut reflected = Rgb::BLACK;
            let followed = follow(self.world, ray, rng, |hit, side, weight| {
                let (t, u, v) = (hit.triangle, hit.u, hit.v);
                reflected += weight
                    * (self.solution.irradiance(self.world, t, u, v, side)
                        + self.solution.caustic(self.world, t, u, v, side));
            });
            out.indirect += (followed.direct + reflected) * share;
            out.specular += followed.mirrored * share;
            found += u32::from(!followed.mirrored.is_black());
        }
        (out, found)
    }
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
