//! Scene and sky from their files.

use crate::args::WhichArgs;
use crate::job::AskedWrongly;
use crate::values::SkyValue;
use anyhow::{Context, Result};
use geometry::gltf::{self, Error, Loaded, Options};
use geometry::{Rgb, Sky};
use std::path::Path;

/// Reads a scene. A scene or variant that is not in the file was asked for wrongly.
pub fn scene(path: &Path, which: &WhichArgs) -> Result<Loaded> {
    let WhichArgs { scene, variant, time } = which.clone();
    gltf::load_with(path, &Options { scene, variant, time, ..Options::default() }).map_err(|e| match e {
        Error::NoSuch { .. } => AskedWrongly(e.to_string()).into(),
        e => e.into(),
    })
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
