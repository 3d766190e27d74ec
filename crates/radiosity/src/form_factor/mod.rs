//! Form factors.
pub mod analytic;
