//! What the eye sees: film, files and the measure of a picture's error.

pub mod difference;
pub mod direct;
pub mod error;
pub mod exr;
pub mod film;
pub mod flip;
pub mod integrator;
pub mod metrics;
pub mod output;
pub mod pixel;
pub mod render;
pub mod tonemap;

pub use error::Error;
pub use film::{Film, Pixel};
pub use render::{DiffuseMode, Integrator, Outcome, Progress, Report, Settings, prepass, render};
