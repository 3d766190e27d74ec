//! Scene and sky from their files.

use crate::args::WhichArgs;
use crate::job::AskedWrongly;
use crate::values::SkyValue;
use anyhow::{Context, Result};
use geometry::gltf::{self, Error, Loaded, Options};
use geometry::ies::{self, Web};
use geometry::{Light, LightKind, Rgb, Sky};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads a scene. A scene or variant that is not in the file was asked for wrongly.
pub fn scene(path: &Path, which: &WhichArgs, webs: &[(String, PathBuf)]) -> Result<Loaded> {
    let WhichArgs { scene, variant, time } = which.clone();
    let webs: Result<Vec<_>> =
        webs.iter().map(|(name, file)| Ok((name.clone(), Arc::new(web(file)?)))).collect();
    let options = Options { scene, variant, time, webs: webs?, ..Options::default() };
    let loaded = gltf::load_with(path, &options).map_err(|e| match e {
        Error::NoSuch { .. } => anyhow::Error::from(AskedWrongly(e.to_string())),
        e => e.into(),
    })?;
    let measured = |light: &&Light| matches!(light.kind, LightKind::Photometric { .. });
    for (name, _) in &options.webs {
        if !loaded.scene.lights.iter().filter(measured).any(|light| light.name == *name) {
            let place = |light: &&Light| !matches!(light.kind, LightKind::Directional { .. });
            let names: Vec<&str> =
                loaded.scene.lights.iter().filter(place).map(|l| l.name.as_str()).collect();
            let known = if names.is_empty() { "none".into() } else { names.join(", ") };
            return Err(AskedWrongly(format!(
                "there is no point or spot lamp {name:?}; the file has {known}"
            ))
            .into());
        }
    }
    Ok(loaded)
}

/// Reads a photometric file.
fn web(path: &Path) -> Result<Web> {
    let cannot = || format!("cannot use {} as a photometric file", path.display());
    let size = std::fs::metadata(path).with_context(cannot)?.len();
    anyhow::ensure!(size <= ies::LARGEST as u64, "{}: {size} bytes are too many for one", cannot());
    ies::parse(&std::fs::read(path).with_context(cannot)?).with_context(cannot)
}

/// Makes the sky that was asked for, `strength` times as bright.
pub fn sky(value: &SkyValue, strength: f32) -> Result<Sky> {
    let sky = match value {
        SkyValue::Constant(radiance) => Sky::Constant(*radiance),
        SkyValue::File(path) => {
            panorama(path).with_context(|| format!("cannot use {} as sky", path.display()))?
        }
    };
    Ok(sky.scaled(Rgb::splat(strength)))
}

fn panorama(path: &Path) -> Result<Sky> {
    let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let (width, height, pixels) = match is_exr {
        true => {
            let image = raytrace::exr::read_rgb(path)?;
            (image.width, image.height, image.pixels)
        }
        false => {
            // The decoder's own limits (512 MiB) keep a header of a few bytes from asking for all memory.
            let image = image::ImageReader::open(path)?.with_guessed_format()?.decode()?;
            anyhow::ensure!(
                matches!(image, image::DynamicImage::ImageRgb32F(_)),
                "it is no picture of high dynamic range: use .hdr or .exr"
            );
            let image = image.into_rgb32f();
            let pixels = image.pixels().map(|p| Rgb::from(p.0)).collect();
            (image.width(), image.height(), pixels)
        }
    };
    Sky::image(width, height, pixels).context("it has no pixels")
}
