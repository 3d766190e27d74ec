//! Solution files: reading, writing, and the reasons why one is refused.

use anyhow::{Context, Result};
use geometry::World;
use radiosity::Solution;
use radiosity::solution_file::{About, decode, describe, encode};
use raytrace::output::write_atomically;
use std::path::Path;

/// The solution in `path`, for `world` as it is lit now.
pub fn read(path: &Path, world: &World) -> Result<(Solution, About)> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    decode(&bytes, world).with_context(|| format!("cannot use {}", path.display()))
}

/// Whether `path` is named like a solution.
pub fn is_one(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("twl"))
}

/// What the solution in `path` says of itself.
pub fn described(path: &Path, json: bool) -> Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let (about, lights) = describe(&bytes).with_context(|| format!("cannot use {}", path.display()))?;
    let About { program, error, seed, cameras } = about;
    let error = 100.0 * error;
    if json {
        let all = serde_json::json!({
            "solution": path, "bytes": bytes.len(), "program": program, "error": error, "seed": seed,
            "cameras": cameras, "lights": lights,
        });
        return Ok(serde_json::to_string_pretty(&all)?);
    }
    let views = if cameras.is_empty() { "any alike".into() } else { cameras.join(", ") };
    let size = bytes.len() as f64 / 1e6;
    Ok(format!(
        "{}: radiosity solution by {program}, {size:.1} MB\n  for pictures of {error} %, seed {seed}; views: {views}\n  lights that may be dimmed: {}",
        path.display(),
        lights.join(", ")
    ))
}

/// Writes `solution`, of `world`, and says how many bytes it took.
pub fn write(path: &Path, solution: &Solution, world: &World, about: &About) -> Result<usize> {
    let bytes = encode(solution, world, about).with_context(|| format!("cannot write {}", path.display()))?;
    write_atomically(path, &bytes)?;
    Ok(bytes.len())
}
