//! `cargo xtask bench rays`: how many rays a second, beside Embree where it is installed.
//!
//! One thread, CPU time, rounds of all tracers in turn and the best of each: what another process takes then
//! counts for all alike. Trust the ratios; absolute numbers belong to the machine and the day.

mod embree;
mod rays;
mod scene;

use crate::comparison::results::RaySpeed;
use anyhow::Result;
use embree::Embree;
use geometry::Ray;
use geometry::bvh::{Bvh, Kernel};
use rays::Batch;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

/// What to measure.
#[derive(clap::Args)]
pub struct Args {
    /// glTF files, or `room` (49 000 triangles) and `million`, which a function makes
    #[arg(default_values_t = ["room".to_string(), "million".to_string()])]
    scenes: Vec<String>,
    /// Rounds; the best of each tracer counts
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// Leave the portable kernel out, which takes most of the time
    #[arg(long)]
    fast: bool,
    /// Folder of Embree's headers' parent
    #[arg(long, default_value = "/usr/include")]
    embree: PathBuf,
}

/// Measures all scenes and prints a table for each.
pub fn run(args: Args) -> Result<()> {
    for name in &args.scenes {
        measure(name, &args)?;
    }
    Ok(())
}

/// Speed of our best kernel and of Embree on the scenes that a function makes, for a report.
pub fn speeds() -> Result<Vec<RaySpeed>> {
    let args = Args { scenes: Vec::new(), rounds: 3, fast: true, embree: "/usr/include".into() };
    let mut all = Vec::new();
    for scene in ["room", "million"] {
        all.extend(measure(scene, &args)?);
    }
    Ok(all)
}

/// One scene: builds, then rounds of every batch by every tracer; prints a table, and returns our best kernel's line.
fn measure(name: &str, args: &Args) -> Result<Vec<RaySpeed>> {
    let (mesh, camera) = scene::load(name)?;
    let kernels: Vec<Kernel> = Kernel::ALL
        .into_iter()
        .filter(|&k| k.is_available() && !(args.fast && k == Kernel::Portable))
        .collect();
    let begin = (Instant::now(), cpu_seconds());
    let tracers: Vec<Bvh> = kernels.iter().map(|&k| Bvh::build_for(&mesh, k)).collect();
    let n = kernels.len() as f64;
    let (wall, cpu) = (begin.0.elapsed().as_secs_f64() / n, (cpu_seconds() - begin.1) / n);
    let triangles = mesh.triangles.len();
    println!("\n{name}: {triangles} triangles, built in {wall:.2} s (CPU {cpu:.2} s)");
    println!("{:.0} bytes per triangle", tracers[0].bytes() as f64 / triangles.max(1) as f64);

    let batches = rays::batches(&mesh, &camera, &tracers[tracers.len() - 1]);
    let mut embree = Embree::start(&args.embree, &mesh, &batches)?;
    if embree.is_none() {
        println!("(no Embree 3 or 4 in {}: nothing to compare with)", args.embree.display());
    }
    let mut names: Vec<String> = embree.iter().flat_map(|_| embree::NAMES).map(String::from).collect();
    let others = names.len();
    names.extend(kernels.iter().map(|k| format!("ours, {k:?}")));
    let mut best = vec![vec![(f64::INFINITY, 0); batches.len()]; names.len()];
    for _ in 0..args.rounds {
        for (i, batch) in batches.iter().enumerate() {
            for (j, row) in best.iter_mut().enumerate() {
                let (seconds, hits) = match &mut embree {
                    Some(embree) if j < others => embree.trace(j, i)?,
                    _ => trace(&tracers[j - others], batch),
                };
                row[i] = (seconds.min(row[i].0), hits);
            }
        }
    }

    print!("{:18}", "Mray/s (ratio)");
    batches.iter().for_each(|b| print!("{:>18}", format!("{} {}k", b.name, b.rays.len() / 1000)));
    println!("{:>24}", "hits");
    for (name, row) in names.iter().zip(&best) {
        print!("{name:18}");
        for (i, &(seconds, _)) in row.iter().enumerate() {
            let rate = batches[i].rays.len() as f64 / seconds / 1e6;
            print!("{:>18}", format!("{rate:.2} ({:.2})", best[0][i].0 / seconds));
        }
        println!("    {}", row.iter().map(|h| h.1.to_string()).collect::<Vec<_>>().join(" "));
    }
    let speed = |(i, batch): (usize, &Batch)| {
        let rate = |row: &Vec<(f64, usize)>| batch.rays.len() as f64 / row[i].0 / 1e6;
        RaySpeed {
            scene: format!("{name}, {triangles} triangles"),
            kind: batch.name.to_string(),
            ours: best[others..].iter().map(rate).fold(0.0, f64::max),
            embree: best[..others].first().map(rate),
        }
    };
    Ok(batches.iter().enumerate().map(speed).collect())
}

/// Traces a batch with our tree: CPU seconds and number of hits.
fn trace(bvh: &Bvh, batch: &Batch) -> (f64, usize) {
    let hit = |ray: &Ray| match batch.any {
        true => bvh.occluded(ray),
        false => black_box(bvh.closest_hit(ray)).is_some(),
    };
    let begin = thread_seconds();
    let hits = batch.rays.iter().filter(|ray| hit(ray)).count();
    (thread_seconds() - begin, hits)
}

/// CPU time of this thread, s; wall time where the system does not tell.
fn thread_seconds() -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(wall_seconds, |ns| 1e-9 * ns)
}

/// CPU time of all threads of this process, s, to 0.01; wall time where the system does not tell.
fn cpu_seconds() -> f64 {
    // Fields 14 and 15 of proc_pid_stat(5), in ticks of 10 ms; the second may hold spaces and ends with ')'.
    let ticks = std::fs::read_to_string("/proc/self/stat").ok().and_then(|s| {
        let fields: Vec<&str> = s.rsplit(')').next()?.split_whitespace().collect();
        Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
    });
    ticks.map_or_else(wall_seconds, |t| 0.01 * t)
}

fn wall_seconds() -> f64 {
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}
