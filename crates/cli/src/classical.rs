//! What was typed of the classical radiosity methods, checked.

use crate::args::{IntegratorArg, RenderArgs, SolverArg};
use crate::job::AskedWrongly;
use anyhow::Result;
use radiosity::classical::{Config, Solver};
use radiosity::form_factor::FormFactors;
use radiosity::patch_to_vertex::Fit;

/// Bytes that a matrix may take where the system does not say what is free.
const USUAL_MEMORY: u64 = 4 << 30;

/// The classical solver that is asked for, or none, for a picture of relative error `error`.
pub fn config(args: &RenderArgs, error: f32) -> Result<Option<Config>> {
    let wrong = |message: &str| Err(AskedWrongly(message.into()).into());
    let solver = match args.solver {
        Some(SolverArg::Matrix) => Some(Solver::Matrix),
        Some(SolverArg::Progressive) => Some(Solver::Progressive),
        Some(SolverArg::Gather) | None => None,
    };
    if args.integrator == IntegratorArg::Path && args.solver.is_some() {
        return wrong("--solver steers the hybrid, not --integrator path");
    }
    let steered = args.patches.is_some() || args.hemicube.is_some() || args.corner_rule;
    let progressive = args.overshoot || args.no_ambient || args.snapshots;
    match solver {
        None if steered => {
            wrong("--patches, --hemicube and --corner-rule need --solver matrix or progressive")
        }
        Some(Solver::Matrix) | None if progressive => {
            wrong("--overshoot, --no-ambient and --snapshots need --solver progressive")
        }
        Some(Solver::Progressive) | None if args.reciprocal => wrong("--reciprocal needs --solver matrix"),
        None => Ok(None),
        Some(solver) => {
            let mut config = Config {
                seed: args.run.seed,
                enforce: args.reciprocal,
                overshoot: args.overshoot,
                ambient: !args.no_ambient,
                most_bytes: free_memory().map_or(USUAL_MEMORY, |free| free / 10 * 8),
                ..Config::for_error(solver, error)
            };
            if let Some(n) = args.patches {
                config.patches = n as usize;
            }
            if let Some(rays) = args.gather_rays {
                config.form_factors = FormFactors::RayCast(rays);
            }
            if let Some(n) = args.hemicube {
                config = config.with_hemicube(n);
            }
            if args.corner_rule {
                config.fit = Fit::Corner;
            }
            Ok(Some(config))
        }
    }
}

/// Bytes that the system has to give, where it says so (Linux).
fn free_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024)
}
