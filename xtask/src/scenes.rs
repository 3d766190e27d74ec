//! The scenes in `assets/` that functions describe: metres, y up, linear Rec. 709, emission in cd/m².
//!
//! Running this twice, or on another machine, gives the same bytes: positions and texels are computed in f64 and
//! rounded once, so that a last-bit difference between two sine functions does not reach the file.

pub mod cornell;
pub mod document;
pub mod downlight;
pub mod furnace;
pub mod gallery;
pub mod material;
mod paint;
mod round;
pub mod shapes;
mod two_rooms;
mod wall;

use anyhow::{Context, Result, ensure};
use document::Document;
use std::path::Path;

/// Name of a file in `assets/`, and the function that describes it.
type Entry = (&'static str, fn() -> Document);

/// Every scene we write.
const SCENES: &[Entry] = &[
    ("cornell-box.gltf", cornell::cornell_box),
    ("cornell-specular.gltf", cornell::cornell_specular),
    ("furnace.gltf", furnace::furnace),
    ("furnace-mixed.gltf", furnace::furnace_mixed),
    ("two-rooms.gltf", two_rooms::two_rooms),
    ("gallery.glb", gallery::gallery),
];

/// The bytes of the file `name`: binary if the name ends in `.glb`, else JSON with its buffer embedded.
fn bytes(name: &str, document: Document) -> Vec<u8> {
    if name.ends_with(".glb") { document.into_glb() } else { document.into_gltf() }
}

/// Writes every scene into the folder `assets`.
pub fn write(assets: &Path) -> Result<()> {
    std::fs::create_dir_all(assets)?;
    for (name, describe) in SCENES {
        let document = describe();
        let triangles = document.triangles();
        let bytes = bytes(name, document);
        let path = assets.join(name);
        std::fs::write(&path, &bytes).with_context(|| format!("writing {}", path.display()))?;
        println!("{name}: {triangles} triangles, {} kB", bytes.len().div_ceil(1000));
    }
    std::fs::write(assets.join(downlight::NAME), downlight::downlight())?;
    Ok(())
}

/// Fails, naming the files, where the folder `assets` does not hold what the functions give.
pub fn check(assets: &Path) -> Result<()> {
    let stale: Vec<&str> = SCENES
        .iter()
        .filter(|(name, describe)| std::fs::read(assets.join(name)).ok() != Some(bytes(name, describe())))
        .map(|(name, _)| *name)
        .chain(
            (std::fs::read(assets.join(downlight::NAME)).ok() != Some(downlight::downlight().into_bytes()))
                .then_some(downlight::NAME),
        )
        .collect();
    ensure!(stale.is_empty(), "not what `cargo xtask scenes` writes: {}", stale.join(", "));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assets_match_their_functions() {
        check(&crate::root().join("assets")).unwrap();
    }
}
