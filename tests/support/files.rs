//! Scenes and data in files: the repository's own, and a folder beside it that need not be there.

use geometry::{Camera, Scene, gltf};
use std::path::{Path, PathBuf};

/// The repository's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A scene of `assets/` with its cameras.
pub fn asset(name: &str) -> (Scene, Vec<Camera>) {
    load(&root().join("assets").join(name))
}

/// Any glTF file, which must load.
pub fn load(path: &Path) -> (Scene, Vec<Camera>) {
    match gltf::load(path) {
        Ok(loaded) => (loaded.scene, loaded.cameras),
        Err(e) => panic!("{e}"),
    }
}

/// A file of the folder of scenes and references too large for the repository: the one that the environment variable
/// `TWOLIGHT_SHARED` names, or `shared` beside the repository. `None`, with a note, where it is not.
pub fn shared(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("TWOLIGHT_SHARED").map_or_else(|| root().join("../shared"), PathBuf::from);
    let path = folder.join(name);
    let found = path.is_file();
    if !found {
        println!("skipped: {} is not here (TWOLIGHT_SHARED names the folder)", path.display());
    }
    found.then_some(path)
}
