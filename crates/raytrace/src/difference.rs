//! The error of each pixel as a picture: false colour to look at, or numbers to measure.

use crate::error::Error;
use crate::exr::{self, Image, Metadata};
use crate::false_colour::palette;
use crate::metrics::error_map;
use crate::tonemap::write_png;
use geometry::Rgb;
use std::path::Path;

/// Errors that the first and the last colour stand for. The scale is logarithmic and the same for all pictures,
/// so that two difference pictures can be laid side by side.
pub const SCALE: [f32; 2] = [0.001, 1.0];

/// Writes the error of each pixel, |picture − reference| as the metric weighs it, to `path`: `.exr` gets the
/// number itself (0.02 is 2 %) in R, G and B, every other name a false-colour PNG.
pub fn write(picture: &Image, reference: &Image, path: &Path) -> Result<(), Error> {
    let map = error_map(picture, reference)?;
    let (width, height) = (reference.width, reference.height);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        let pixels = map.into_iter().map(Rgb::splat).collect();
        let mut metadata = Metadata::default();
        metadata.push("units", "weighted relative error, 1 = 100 %");
        return exr::write_rgb(&Image { width, height, pixels }, &metadata, path);
    }
    let pixels: Vec<[u8; 3]> = map.into_iter().map(false_colour).collect();
    write_png(width, height, &pixels, path)
}

/// The colour of an error (a fraction), sRGB.
pub fn false_colour(error: f32) -> [u8; 3] {
    let [lo, hi] = SCALE.map(f32::ln);
    palette::colour(&palette::MAGMA, (error.max(SCALE[0]).ln() - lo) / (hi - lo))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greater_errors_are_brighter() {
        let grey = |e| {
            let [r, g, b] = false_colour(e).map(f32::from);
            Rgb::new(r, g, b).luminance()
        };
        let steps: Vec<f32> = (0..=30).map(|i| grey(10f32.powf(-3.0 + 0.1 * i as f32))).collect();
        assert!(steps.windows(2).all(|w| w[1] > w[0]), "{steps:?}");
        assert_eq!(false_colour(0.0), false_colour(SCALE[0]));
        assert_eq!(false_colour(f32::INFINITY), false_colour(SCALE[1]));
    }

    #[test]
    fn the_numbers_can_be_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("d.exr");
        let image = |v| Image { width: 4, height: 2, pixels: vec![Rgb::splat(v); 8] };
        write(&image(1.5), &image(1.0), &path).unwrap();
        // d²/(ref² + 0.01 M²) with M = ref = 1.
        let expected = 0.5 / 1.01f32.sqrt();
        let back = exr::read_rgb(&path).unwrap();
        assert!(back.pixels.iter().all(|p| (p.r - expected).abs() < 1e-3), "{:?}", back.pixels[0]);
        write(&image(1.5), &image(1.0), &dir.path().join("d.png")).unwrap();
    }
}
