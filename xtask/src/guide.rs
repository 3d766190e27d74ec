//! The guide, held to its word: every command of `assets/guide.md` is run, and makes the guide's pictures.

use anyhow::{Context, Result, ensure};
use std::fs;
use std::process::Command;
use std::time::Instant;

/// Commands that say how far they are, unless told not to.
const WORK: [&str; 4] = ["render", "solve", "measure", "bake"];

/// Runs the commands in `target/guide`, and puts the pictures that the guide shows into `assets/pictures`.
pub fn run() -> Result<()> {
    let root = crate::root();
    let text = fs::read_to_string(root.join("assets/guide.md"))?;
    let built = Command::new("cargo").args(["build", "--release", "--quiet"]).current_dir(&root).status()?;
    ensure!(built.success(), "twolight does not build");
    let dir = root.join("target/guide");
    let _ = fs::remove_dir_all(&dir);
    fs::create_dir_all(&dir)?;
    fs::copy(root.join("assets/gallery.glb"), dir.join("room.glb"))?;
    fs::copy(root.join("assets/downlight.ies"), dir.join("downlight.ies"))?;
    for command in commands(&text) {
        println!("$ {}", command.join(" "));
        let start = Instant::now();
        let status = Command::new(root.join("target/release/twolight"))
            .args(&command[1..])
            .args(WORK.contains(&&*command[1]).then_some("--quiet"))
            .current_dir(&dir)
            .status()?;
        // A rough picture may be found to be rougher than asked.
        ensure!(matches!(status.code(), Some(0 | 3)), "`{}` failed", command.join(" "));
        println!("  ({:.1} s)", start.elapsed().as_secs_f64());
    }
    for name in pictures(&text) {
        let from = dir.join(name.strip_prefix("guide-").context("a picture of the guide is called guide-")?);
        let to = root.join("assets/pictures").join(&name);
        fs::copy(&from, &to).with_context(|| format!("no command of the guide makes {}", from.display()))?;
    }
    Ok(())
}

/// The words of every `twolight` command, each on an indented line of its own.
fn commands(text: &str) -> Vec<Vec<String>> {
    text.lines()
        .filter_map(|line| line.strip_prefix("    twolight "))
        .map(|line| words(&format!("twolight {line}")))
        .collect()
}

/// A command line in words, as a shell takes it as far as the guide needs: "..." holds spaces.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (i, part) in line.split('"').enumerate() {
        match i % 2 {
            1 => words.push(part.to_string()),
            _ => words.extend(part.split_whitespace().map(String::from)),
        }
    }
    words
}

/// File names of the pictures that the guide shows.
fn pictures(text: &str) -> Vec<String> {
    text.split("](pictures/").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0.to_string())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guide_has_commands_and_its_pictures_are_there() -> Result<()> {
        let text = fs::read_to_string(crate::root().join("assets/guide.md"))?;
        assert!(commands(&text).len() > 8);
        assert_eq!(
            words(r#"twolight render --walk "0,1 2,3" -o a"#),
            ["twolight", "render", "--walk", "0,1 2,3", "-o", "a"]
        );
        for name in pictures(&text) {
            let path = crate::root().join("assets/pictures").join(&name);
            ensure!(path.is_file(), "{name} is missing: cargo xtask guide");
        }
        Ok(())
    }
}
