//! `cargo xtask reference-comparison`: how fast, how exact, compared with what.

pub mod results;
