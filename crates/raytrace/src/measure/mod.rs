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
