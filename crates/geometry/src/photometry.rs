//! B, E, M and L into one another: the one home of that π.
//!
//! | symbol | name | meaning | unit |
//! |---|---|---|---|
//! | L | radiance | along a direction | cd/m² |
//! | E | irradiance | arriving on a surface | lx |
//! | B | radiosity | leaving it: its own light plus what it reflects | lm/m² |
//! | M | exitance | its own light only | lm/m² |

use crate::Rgb;
use std::f32::consts::{FRAC_1_PI, PI};

/// Radiance (cd/m²) of a diffuse surface whose radiosity is `b` (lm/m²): L = B / π.
pub fn radiance_from_radiosity(b: Rgb) -> Rgb {
    b * FRAC_1_PI
}

/// Exitance (lm/m²) of a surface that shines `radiance` (cd/m²) evenly over its hemisphere: M = π L.
pub fn exitance_from_radiance(radiance: Rgb) -> Rgb {
    radiance * PI
}

/// Radiance (cd/m²) reflected by a diffuse surface of `reflectance` under `irradiance` (lx): L = ρ E / π.
pub fn reflected_radiance(reflectance: Rgb, irradiance: Rgb) -> Rgb {
    radiance_from_radiosity(reflectance * irradiance)
}
