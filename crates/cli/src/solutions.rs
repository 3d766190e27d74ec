//! Solution files: reading, writing, and the reasons why one is refused.

use anyhow::{Context, Result};
use geometry::World;
use radiosity::Solution;
use radiosity::solution_file::{About, decode, encode};
use raytrace::output::write_atomically;
use std::path::Path;

/// The solution in `path`, for `world` as it is lit now.
pub fn read(path: &Path, world: &World) -> Result<(Solution, About)> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    decode(&bytes, world).with_context(|| format!("cannot use {}", path.display()))
}

/// Writes `solution`, of `world`, and says how many bytes it took.
pub fn write(path: &Path, solution: &Solution, world: &World, about: &About) -> Result<usize> {
    let bytes = encode(solution, world, about).with_context(|| format!("cannot write {}", path.display()))?;
    write_atomically(path, &bytes)?;
    Ok(bytes.len())
}
