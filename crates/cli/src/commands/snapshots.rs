//! Pictures on the way: what progressive refinement knows after 0, 1, 2, 5, 10, 20, 50 ... shots.

use super::print;
use crate::job::{RenderJob, with_name};
use crate::picture::{Picture, save};
use crate::progress::Bars;
use anyhow::Result;
use geometry::{Camera, Rgb, World};
use radiosity::Solution;
use radiosity::classical::{Config, Room};
use raytrace::{Film, Progress, render, tonemap};
use std::path::{Path, PathBuf};

/// Solves `world` progressively and writes what `camera` sees on the way, beside the job's own pictures: out.exr,
/// out.shots-00010.exr.
pub fn take(
    job: &RenderJob,
    world: &World,
    camera: &Camera,
    config: &Config,
    error: f32,
    bars: &Bars,
) -> Result<(Solution, Vec<Picture>)> {
    let room = Room::new(world, config, bars);
    let mut shooting = room.shooting(config);
    let mut pictures = Vec::new();
    for shots in std::iter::once(0).chain(ladder()) {
        bars.stage("shooting", 0);
        shooting.shoot_until(shots.min(config.shots), |s| bars.stopped() || s.finished(config.tolerance));
        let solution = room.shown(&shooting, config);
        if shooting.shots < shots || bars.stopped() {
            return Ok((solution, pictures));
        }
        let settings = job.settings(camera, error)?;
        let outcome = render(world, camera, Some(&solution), &settings, bars)?;
        let path = |base: &PathBuf| with_name(base, &format!("shots-{shots:05}"));
        let (output, preview) = (path(&job.output), job.preview.as_ref().map(path));
        let picture = save(job.exposure, camera, &settings, outcome, output, preview, 0)?;
        if !job.json {
            print(&picture.line())?;
        }
        pictures.push(picture);
    }
    unreachable!("the ladder has no end")
}

/// 1, 2, 5, 10, 20, 50 ...
fn ladder() -> impl Iterator<Item = u64> {
    (0..18u32).flat_map(|k| [1, 2, 5].map(|m| m * 10u64.pow(k)))
}

/// One picture of `film` without what radiosity adds, and beside it the whole one, at one exposure.
pub fn side_by_side(film: &Film, ev: f32, path: &Path) -> Result<()> {
    let (w, h) = (film.width as usize, film.height as usize);
    let mut pixels = vec![Rgb::BLACK; 2 * w * h];
    for (i, p) in film.pixels.iter().enumerate() {
        let (x, y) = (i % w, i / w);
        pixels[2 * w * y + x] = p.beauty() - p.indirect;
        pixels[2 * w * y + w + x] = p.beauty();
    }
    tonemap::write_png(2 * film.width, film.height, &tonemap::to_srgb(&pixels, ev), path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_ladder_is_that_of_coins() {
        assert_eq!(super::ladder().take(7).collect::<Vec<_>>(), [1, 2, 5, 10, 20, 50, 100]);
    }
}
