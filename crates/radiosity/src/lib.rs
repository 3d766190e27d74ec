//! What the light does, wherever we stand: diffuse interreflection solved once, without a camera, and kept at
//! mesh vertices.
//!
//! ```text
//! World ─ element ─▶ Elements ─ gather ─▶ rows of F ─ solver ─▶ E at vertices ─▶ Solution
//!                        ▲                                          │
//!                        └──────────── refine: where E bends ◀──────┘
//! ```
//!
//! The unknown is the *indirect* irradiance E (lx): light that has left at least one diffuse surface. The
//! emitters' own light is not in it, because pass 2 fetches that for each pixel; the light they throw on the
//! surfaces that a gather ray hits is. Light that arrives from an emitter by way of mirrors and glass alone is
//! kept apart, as photons ([`caustic`]).
//!
//! ```no_run
//! use radiosity::element::Side;
//!
//! let room = geometry::gltf::load("assets/cornell-box.gltf".as_ref())?;
//! let world = geometry::World::new(room.scene);
//! let solution = radiosity::solve(&world, &radiosity::Config::for_error(0.02), &())?;
//! assert!(solution.report.convergence.converged);
//! // Indirect light on the first triangle, a third of the way along two of its edges.
//! println!("{:?} lx", solution.irradiance(&world, 0, 0.33, 0.33, Side::Front));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bytes;
pub mod caustic;
pub mod classical;
mod clusters;
mod crowded;
pub mod doubt;
pub mod element;
pub mod field;
mod first_mesh;
pub mod flags;
pub mod form_factor;
pub mod gather;
pub mod importance;
mod influence;
pub mod journal;
mod levels;
mod lights;
mod neighbours;
mod noise;
mod orphans;
pub mod patch_to_vertex;
pub mod patches;
pub mod reach;
pub mod refine;
mod reveal;
mod settle;
mod sites;
mod smooth;
pub mod solution;
pub mod solution_file;
pub mod solver;
pub mod transport;

mod solve;

pub use importance::Importance;
pub use journal::Journal;
pub use lights::RelightError;
pub use solution::{Report, Solution};
pub use solve::{Config, Error, Progress, solve, solve_for, solve_resumable};
