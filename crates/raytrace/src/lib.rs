//! What the eye sees: film, files and the measure of a picture's error.

pub mod error;
pub mod exr;
pub mod film;
pub mod output;

pub use error::Error;
pub use film::{Film, Pixel};
