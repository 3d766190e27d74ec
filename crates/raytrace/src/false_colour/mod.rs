//! Values as a picture that can be read: colours by a scale, contour lines, and a bar with numbers on it.

mod canvas;
mod chart;
mod field;
mod isolines;
pub mod palette;
mod scale;

pub use chart::Chart;
pub use field::Field;
pub use scale::{Scale, number};
