//! Embree beside us: a small program, compiled on the spot where its headers are, that traces the same rays.

use super::rays::Batch;
use anyhow::{Context, Result, bail, ensure};
use geometry::Mesh;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use tempfile::TempDir;

/// Its ways of tracing, in the order the program numbers them.
pub const NAMES: [&str; 2] = ["Embree", "Embree, robust"];

/// The running program.
pub struct Embree {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    _folder: TempDir,
}

impl Embree {
    /// Compiles and starts it; `None` where Embree is not installed.
    pub fn start(include: &Path, mesh: &Mesh, batches: &[Batch]) -> Result<Option<Embree>> {
        let Some(version) = [4, 3].into_iter().find(|v| include.join(format!("embree{v}/rtcore.h")).exists())
        else {
            return Ok(None);
        };
        let folder = tempfile::tempdir()?;
        let [source, program, data] = ["embree.cpp", "embree", "data"].map(|n| folder.path().join(n));
        std::fs::write(&source, include_str!("embree.cpp"))?;
        let compiled = Command::new("g++")
            .args(["-O2", "-std=c++17", "-msse2", &format!("-DEMBREE={version}"), "-I"])
            .arg(include)
            .arg("-o")
            .arg(&program)
            .arg(&source)
            .arg(format!("-lembree{version}"))
            .status()
            .context("g++")?;
        ensure!(compiled.success(), "embree.cpp does not compile");
        std::fs::write(&data, pack(mesh, batches))?;
        let mut child =
            Command::new(&program).arg(&data).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("no pipes to {}", program.display());
        };
        let mut embree = Embree { child, input, output: BufReader::new(output), _folder: folder };
        let built = embree.line()?;
        println!("Embree {version} built in (default, robust; CPU s): {}", built.trim());
        Ok(Some(embree))
    }

    /// Traces batch `batch` in the way `mode`: CPU seconds and number of hits.
    pub fn trace(&mut self, mode: usize, batch: usize) -> Result<(f64, usize)> {
        writeln!(self.input, "{mode} {batch}")?;
        let line = self.line()?;
        let (seconds, hits) = line.trim().split_once(' ').context("what Embree's program says")?;
        Ok((seconds.parse()?, hits.parse()?))
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(line)
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // It may have gone already; then there is nothing to end.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Mesh and rays as the program reads them: counts, corners, indices; then of each batch kind, count, rays.
fn pack(mesh: &Mesh, batches: &[Batch]) -> Vec<u8> {
    let mut words = vec![mesh.positions.len() as u32, mesh.triangles.len() as u32];
    words.extend(mesh.positions.iter().flat_map(|p| p.to_array().map(f32::to_bits)));
    words.extend(mesh.triangles.iter().flatten());
    words.push(batches.len() as u32);
    for batch in batches {
        words.extend([u32::from(batch.any), batch.rays.len() as u32]);
        for ray in &batch.rays {
            let (o, d) = (ray.origin, ray.direction);
            words.extend([o.x, o.y, o.z, ray.t_min, d.x, d.y, d.z, ray.t_max].map(f32::to_bits));
        }
    }
    words.iter().flat_map(|w| w.to_ne_bytes()).collect()
}
