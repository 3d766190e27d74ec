//! Tests of the repository on itself: what `craft` asks of every file and no compiler checks.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The crates in the order in which one may import another: each only those before it.
const ORDER: [(&str, &str); 4] = [
    ("geometry", "crates/geometry"),
    ("radiosity", "crates/radiosity"),
    ("raytrace", "crates/raytrace"),
    ("twolight", "crates/cli"),
];

/// All files below `folder` of the repository, built ones left out.
fn files(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![crate::root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true if path.ends_with("target") || path.ends_with(".git") => {}
                true => folders.push(path),
                false => found.push(path),
            }
        }
    }
    found
}

/// Rust sources of the repository, with their text.
fn sources() -> Vec<(PathBuf, String)> {
    let rust = files(".").into_iter().filter(|path| path.extension().is_some_and(|e| e == "rs"));
    rust.map(|path| (path.clone(), read(&path))).collect()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The names under `[dependencies]` (and, like it, of build scripts); tests may import whom they like.
fn dependencies(manifest: &str) -> BTreeSet<&str> {
    let mut within = false;
    let mut names = BTreeSet::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            within = line.ends_with("dependencies]") && !line.contains("dev-");
        } else if within && let Some(end) = line.find(['.', ' ', '=']) {
            names.insert(&line[..end]);
        }
    }
    names
}

#[test]
fn the_arrows_between_crates_point_one_way() {
    for (i, (name, folder)) in ORDER.iter().enumerate() {
        let manifest = read(&crate::root().join(folder).join("Cargo.toml"));
        let imported = dependencies(&manifest);
        for (later, _) in &ORDER[i..] {
            assert!(!imported.contains(later), "{name} imports {later}, which comes after it");
        }
    }
}

#[test]
fn dependencies_are_found_in_a_manifest() {
    let manifest = "[package]\nname = \"x\"\n[dependencies]\na.workspace = true\nb = \"1\"\n[dev-dependencies]\nc = \"1\"\n";
    assert_eq!(dependencies(manifest), BTreeSet::from(["a", "b"]));
}

#[test]
fn every_module_opens_with_a_line_about_itself() {
    let silent = sources().into_iter().filter(|(_, text)| !text.starts_with("//! "));
    let silent: Vec<PathBuf> = silent.map(|(path, _)| path).collect();
    assert!(silent.is_empty(), "no `//!` line opens {silent:?}");
}

#[test]
fn no_file_grows_past_what_one_reads_in_a_sitting() {
    let long = sources().into_iter().filter(|(_, text)| text.lines().count() > 600);
    let long: Vec<PathBuf> = long.map(|(path, _)| path).collect();
    assert!(long.is_empty(), "over 600 lines, so probably two ideas: {long:?}");
}

#[test]
fn assets_stay_small_enough_to_clone() {
    let bytes: u64 = files("assets").iter().map(|path| path.metadata().unwrap().len()).sum();
    assert!(bytes < 30_000_000, "assets/ holds {} MB", bytes / 1_000_000);
}
