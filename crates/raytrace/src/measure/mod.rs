//! A light meter: illuminance at any point and direction of a solved world, with its standard error.
//!
//! [`Meter`] reads one [`Sensor`]; [`grid`] and [`surface`] lay sensors out, and [`Statistics`] says of many readings
//! what lighting standards ask for.

pub mod grid;
mod meter;
mod statistics;
pub mod surface;

pub use meter::{Meter, Reading, Sensor};
pub use statistics::Statistics;

use geometry::World;
use radiosity::{Config, Error, Progress, Solution, solve};

/// What the solution is asked for, in units of the error asked: a reading takes the mean of it over a thousand places.
/// With 5 readings in small simple rooms were off by more than 1 %; 2 takes twice as long in a furnished one.
const MESH_SHARE: f32 = 3.0;

/// A solution that is exact enough for readings within `error` (0.01 is 1 %).
pub fn prepass(world: &World, error: f32, seed: u64, progress: &dyn Progress) -> Result<Solution, Error> {
    // Direct light is sampled where it is needed: here it is for the energy balance only.
    let config = Config { seed, light_samples: 8, ..Config::for_error((MESH_SHARE * error).min(0.5)) };
    solve(world, &config, progress)
}
