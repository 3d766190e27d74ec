//! Square to disc, hemisphere, triangle, with the pdf beside each; seeded streams of numbers.

mod lattice;
mod rng;
mod shapes;

pub use lattice::Lattice2;
pub use rng::Rng;
pub use shapes::{
    cone, cone_pdf_solid_angle, cosine_hemisphere, cosine_hemisphere_pdf_solid_angle, disc, disc_pdf_area,
    sphere, sphere_pdf_solid_angle, triangle, triangle_pdf_area,
};
