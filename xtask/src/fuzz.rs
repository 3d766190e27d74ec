//! `cargo xtask fuzz`: broken and hostile glTF by the thousand, from sound files spoiled at random.
//!
//! No compiler but the usual one is needed. A file that makes the loader panic, takes more than ten seconds or more
//! than a gibibyte ends the run and stays in `target/fuzz/`. The same seed spoils in the same way.

mod seeds;
mod spoil;

use anyhow::{Context, Result, bail};
use geometry::gltf::{Error, load};
use geometry::sampling::Rng;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// One file may take so long, s.
const LONGEST: u64 = 10;
/// And the process so much, KiB.
const MOST_MEMORY: u64 = 1 << 20;

/// What to spoil, and for how long.
#[derive(clap::Args)]
pub struct Args {
    /// Sound files or folders of them, besides assets/ and the small ones that a function makes
    files: Vec<PathBuf>,
    /// Seconds
    #[arg(long, default_value_t = 60)]
    seconds: u64,
    /// Seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the sound files into this folder, for the cargo-fuzz targets of tests/fuzz, and do no more
    #[arg(long)]
    corpus: Option<PathBuf>,
    /// Load this one file and say what came of it
    #[arg(long)]
    replay: Option<PathBuf>,
}

/// When the present file began, ms since the start, for the watchdog; 0 between files.
static BEGAN: AtomicU64 = AtomicU64::new(0);

/// Runs until the time is over or a file does harm.
pub fn run(args: Args) -> Result<()> {
    if let Some(file) = &args.replay {
        let start = Instant::now();
        let result = load(file).map(|l| l.scene.mesh.triangles.len()).map_err(|e| e.to_string());
        println!("{result:?} in {:.3} s, {} MiB at most", start.elapsed().as_secs_f64(), peak()? / 1024);
        return Ok(());
    }
    let folder = crate::root().join("target/fuzz");
    std::fs::create_dir_all(&folder)?;
    let seeds = seeds::all(&args.files)?;
    anyhow::ensure!(!seeds.is_empty(), "nothing to spoil");
    if let Some(corpus) = &args.corpus {
        return seeds::write(&seeds, corpus);
    }
    // A panic is what we look for: caught in the loader, its trace would only drown the rest.
    std::panic::set_hook(Box::new(|_| {}));
    let start = Instant::now();
    watch(start);
    let (mut loaded, mut refused) = (0u64, 0u64);
    for n in 0.. {
        if start.elapsed() > Duration::from_secs(args.seconds) {
            break;
        }
        let mut rng = Rng::new(args.seed, n);
        let seed = &seeds[pick(&mut rng, seeds.len())];
        let other = &seeds[pick(&mut rng, seeds.len())];
        let file = folder.join(if seed.is_glb() { "now.glb" } else { "now.gltf" });
        std::fs::write(&file, spoil::spoil(seed, other, &mut rng))?;
        BEGAN.store(start.elapsed().as_millis() as u64 + 1, Ordering::Relaxed);
        let result = load(&file);
        BEGAN.store(0, Ordering::Relaxed);
        match result {
            Ok(_) => loaded += 1,
            Err(Error::Defect { problem, .. }) => bail!("{}: {}", keep(&file, n)?.display(), problem),
            Err(_) => refused += 1,
        }
        let memory = peak()?;
        if memory > MOST_MEMORY {
            bail!("{}: {} MiB", keep(&file, n)?.display(), memory / 1024);
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{} files in {seconds:.0} s: {loaded} loaded, {refused} refused, {} MiB at most",
        loaded + refused,
        peak()? / 1024
    );
    Ok(())
}

/// A number below `n`.
fn pick(rng: &mut Rng, n: usize) -> usize {
    ((rng.f32() * n as f32) as usize).min(n.saturating_sub(1))
}

/// Ends the process when one file takes too long; the file is then still `now.gltf` or `now.glb`.
fn watch(start: Instant) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(200));
            let began = BEGAN.load(Ordering::Relaxed);
            let now = start.elapsed().as_millis() as u64 + 1;
            if began > 0 && now > began + 1000 * LONGEST {
                eprintln!("a file takes more than {LONGEST} s: see target/fuzz/now.*");
                std::process::exit(1);
            }
        }
    });
}

/// Gives a harmful file a name that stays.
fn keep(file: &Path, n: u64) -> Result<PathBuf> {
    let extension = file.extension().unwrap_or_default().to_string_lossy().into_owned();
    let kept = file.with_file_name(format!("harm-{n}.{extension}"));
    std::fs::copy(file, &kept)?;
    Ok(kept)
}

/// Most memory that this process has held, KiB (Linux; 0 elsewhere).
pub fn peak() -> Result<u64> {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return Ok(0) };
    let line = status.lines().find(|l| l.starts_with("VmHWM:")).context("no VmHWM in /proc/self/status")?;
    Ok(line.split_whitespace().nth(1).and_then(|v| v.parse().ok()).unwrap_or(0))
}
