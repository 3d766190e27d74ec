//! What the eye sees: a solved world becomes a picture, a file, and a measure of the picture's error.
//!
//! [`render()`] makes a [`Film`] by one of two [`integrator`]s: the two-pass method, which takes the light between diffuse
//! surfaces from a [`radiosity::Solution`], and a path tracer, the reference, which never sees one. [`exr`] writes the
//! film with its layers, [`tonemap`] a picture for a screen, and [`metrics`] compares two pictures.
//!
//! ```no_run
//! use raytrace::{Settings, exr, render};
//!
//! let room = geometry::gltf::load("assets/cornell-box.gltf".as_ref())?;
//! let world = geometry::World::new(room.scene);
//! let settings = Settings { error: 0.01, ..Settings::default() };
//! // Without a solution it makes its own; for many views, pass that of `prepass`.
//! let outcome = render(&world, &room.cameras[0], None, &settings, &())?;
//! exr::write(&outcome.film, &[], &exr::Metadata::default(), "cornell.exr".as_ref())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adaptive;
pub mod bake;
pub mod by_light;
pub mod difference;
pub mod direct;
pub mod effort;
pub mod error;
pub mod exr;
pub mod false_colour;
pub mod film;
pub mod flip;
pub mod importance;
pub mod integrator;
pub mod level;
pub mod measure;
pub mod metrics;
pub mod output;
pub mod pixel;
pub mod plan;
pub mod render;
pub mod tonemap;
pub mod verify;

pub use by_light::render_by_light;
pub use error::Error;
pub use film::{Film, Pixel};
pub use render::{
    DiffuseMode, Integrator, Outcome, Progress, Report, Settings, prepass, prepass_for, prepass_resumable,
    render,
};
