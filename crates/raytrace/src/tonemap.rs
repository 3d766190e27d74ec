//! Light in cd/m² to a picture for a screen: exposure, roll-off of highlights, sRGB.

use crate::error::Error;
use crate::metrics::brightness;
use crate::output::write_atomically;
use geometry::Rgb;
use std::io::Cursor;
use std::path::Path;

/// Where the mean brightness of a picture is shown, as a share of white: chosen by eye on seven rooms, half a stop
/// above the 18 % of a light meter, since [`brightness`] lies below the mean that a meter takes.
const SHOWN_BRIGHTNESS: f64 = 0.25;
/// Share of white from which highlights are compressed; below it the picture is the light itself.
const KNEE: f32 = 0.76;
/// How fast highlights lose their colour on the way to white.
const BLEACH: f32 = 0.15;

/// Light that a camera at this exposure value (ISO 100) shows as white, cd/m².
///
/// A reflected-light meter reads EV from L = 2^EV K/S with K = 12.5 cd s/(m² ISO) and S = 100 (ISO 2720:1974),
/// and what it reads is shown at 18 % of white.
pub fn white_of_exposure(ev: f32) -> f32 {
    ev.exp2() * 0.125 / 0.18
}

/// The exposure value (ISO 100) at which a picture in cd/m² is neither dark nor burnt, whatever lamps are in view.
pub fn automatic_exposure(pixels: &[Rgb]) -> f32 {
    let white = brightness(pixels) / SHOWN_BRIGHTNESS;
    // A black picture is shown as if it were 1 µcd/m², so that the scale stays finite.
    ((white.max(1e-6) * 0.18 / 0.125) as f32).log2()
}

/// The exposure value (ISO 100) for a room of mean irradiance `e`, lx, whatever part of it is in view: as an incident-light
/// meter would set it, for surfaces that reflect a half.
pub fn incident_exposure(e: f32) -> f32 {
    let white = 0.5 * e / std::f32::consts::PI / SHOWN_BRIGHTNESS as f32;
    (white.max(1e-6) * 0.18 / 0.125).log2()
}

/// Linear light over white to what a screen can show, [0, 1], still linear.
///
/// Khronos' PBR Neutral (2024) without its toe: colours below the knee stay exactly as they are; above, the
/// largest channel approaches 1 with a continuous slope, hue is kept, and colour fades to white.
pub fn roll_off(c: Rgb) -> Rgb {
    let peak = c.max_channel();
    if peak <= KNEE {
        return c;
    }
    let room = 1.0 - KNEE;
    let shown = 1.0 - room * room / (peak - KNEE + room);
    let faded = 1.0 - 1.0 / (BLEACH * (peak - shown) + 1.0);
    (c * (shown / peak)).lerp(Rgb::splat(shown), faded)
}

/// The sRGB transfer function (IEC 61966-2-1), [0, 1] to [0, 1].
pub fn srgb_encode(v: f32) -> f32 {
    match v <= 0.003_130_8 {
        true => 12.92 * v,
        false => 1.055 * v.powf(1.0 / 2.4) - 0.055,
    }
}

/// A picture in cd/m² as 8-bit sRGB for the exposure value `ev` (ISO 100).
pub fn to_srgb(pixels: &[Rgb], ev: f32) -> Vec<[u8; 3]> {
    let scale = 1.0 / white_of_exposure(ev);
    let byte = |v: f32| (255.0 * srgb_encode(v.clamp(0.0, 1.0)) + 0.5) as u8;
    pixels.iter().map(|&c| roll_off(c * scale).to_array().map(byte)).collect()
}

/// Writes 8-bit sRGB pixels, rows from the top, as PNG, atomically.
pub fn write_png(width: u32, height: u32, pixels: &[[u8; 3]], path: &Path) -> Result<(), Error> {
    let encode_error = |reason: String| Error::Encode { path: path.into(), reason };
    let buffer = image::RgbImage::from_raw(width, height, pixels.as_flattened().to_vec())
        .ok_or_else(|| encode_error("the number of pixels is not width x height".into()))?;
    let mut bytes = Vec::new();
    buffer
        .write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png)
        .map_err(|e| encode_error(e.to_string()))?;
    write_atomically(path, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_roll_off_is_continuous_monotone_and_below_white() {
        let mut last = 0.0;
        for i in 0..4000 {
            let v = i as f32 * 0.005;
            let shown = roll_off(Rgb::splat(v)).g;
            assert!(shown >= last && shown - last < 0.0051 && shown < 1.0, "{v}: {last} {shown}");
            last = shown;
        }
        assert_eq!(roll_off(Rgb::new(0.7, 0.1, 0.0)), Rgb::new(0.7, 0.1, 0.0));
    }

    #[test]
    fn a_lamp_in_view_does_not_darken_the_room() {
        let room = vec![Rgb::splat(30.0); 1000];
        let mut with_lamp = room.clone();
        with_lamp[..50].fill(Rgb::splat(1e5));
        let (a, b) = (automatic_exposure(&room), automatic_exposure(&with_lamp));
        assert!((a - b).abs() < 1e-3, "{a} {b}");
        let shown = to_srgb(&room, a)[0][0];
        assert_eq!(shown, (255.0 * srgb_encode(0.25) + 0.5) as u8);
    }

    #[test]
    fn a_black_picture_is_black() {
        let black = vec![Rgb::BLACK; 4];
        assert_eq!(to_srgb(&black, automatic_exposure(&black)), vec![[0; 3]; 4]);
    }

    #[test]
    fn a_png_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write_png(2, 1, &[[1, 2, 3], [255, 0, 128]], &path).unwrap();
        let back = image::open(&path).unwrap().into_rgb8();
        assert_eq!(back.into_raw(), [1, 2, 3, 255, 0, 128]);
        assert!(write_png(2, 2, &[[0; 3]], &path).is_err());
    }
}
