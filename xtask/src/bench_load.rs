//! `cargo xtask bench load`: how long a file takes to load, and how much memory for its size.

use anyhow::Result;
use geometry::gltf;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Vertices along each side of the grid that is made where no file is named: 5 million triangles.
const SIDE: u32 = 1582;

/// What to load.
#[derive(clap::Args)]
pub struct Args {
    /// glTF files; a grid of 5 million triangles (120 MB) if absent
    files: Vec<PathBuf>,
}

/// Loads each file once; for memory that means what, name one file only.
pub fn run(args: Args) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let mut files = args.files;
    if files.is_empty() {
        let file = folder.path().join("grid.glb");
        write_grid(&file)?;
        files.push(file);
    }
    for file in files {
        let size = file.metadata()?.len() as f64 / 1e6;
        let start = Instant::now();
        let loaded = gltf::load(&file)?;
        let seconds = start.elapsed().as_secs_f64();
        let peak = crate::fuzz::peak()? as f64 * 1.024e-3;
        println!(
            "{}: {size:.1} MB, {} triangles, {seconds:.2} s, {peak:.0} MB at most, {:.2} times the file",
            file.display(),
            loaded.scene.mesh.triangles.len(),
            peak / size
        );
    }
    Ok(())
}

/// A wavy sheet with normals, indices of 32 bits.
fn write_grid(file: &Path) -> Result<()> {
    let (n, triangles) = (SIDE * SIDE, 2 * (SIDE - 1) * (SIDE - 1));
    let bytes = 24 * n + 12 * triangles;
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{bytes}}}],"bufferViews":[
        {{"buffer":0,"byteLength":{0}}},{{"buffer":0,"byteOffset":{0},"byteLength":{0}}},{{"buffer":0,"byteOffset":{1},"byteLength":{2}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{n},"type":"VEC3","min":[0,-1,0],"max":[1,1,1]}},
        {{"bufferView":1,"componentType":5126,"count":{n},"type":"VEC3"}},{{"bufferView":2,"componentType":5125,"count":{3},"type":"SCALAR"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}},"indices":2}}]}}],"nodes":[{{"mesh":0}}],
        "scene":0,"scenes":[{{"nodes":[0]}}]}}"#,
        12 * n,
        24 * n,
        12 * triangles,
        3 * triangles
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let mut out = std::io::BufWriter::new(std::fs::File::create(file)?);
    out.write_all(b"glTF\x02\0\0\0")?;
    out.write_all(&(28 + json.len() as u32 + bytes).to_le_bytes())?;
    out.write_all(&(json.len() as u32).to_le_bytes())?;
    out.write_all(b"JSON")?;
    out.write_all(json.as_bytes())?;
    out.write_all(&bytes.to_le_bytes())?;
    out.write_all(b"BIN\0")?;
    let at = |i: u32| (i % SIDE) as f32 / SIDE as f32;
    for i in 0..n {
        let (x, z) = (at(i), at(i / SIDE));
        for v in [x, 0.1 * (9.0 * x).sin() * (7.0 * z).cos(), z] {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    for _ in 0..n {
        for v in [0f32, 1.0, 0.0] {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    for y in 0..SIDE - 1 {
        for x in 0..SIDE - 1 {
            let a = y * SIDE + x;
            for v in [a, a + SIDE, a + 1, a + 1, a + SIDE, a + SIDE + 1] {
                out.write_all(&v.to_le_bytes())?;
            }
        }
    }
    out.flush()?;
    Ok(())
}
