//! `cargo xtask reference-comparison`: how fast, how exact, compared with what.

pub mod report;
pub mod results;
