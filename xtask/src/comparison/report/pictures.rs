//! The pictures of a scene, all shown at the exposure of its reference, and where each of them errs.

use super::front::moment;
use super::words::{percent, seconds};
use crate::base64::base64;
use crate::comparison::results::{Curve, Point, Scene};
use anyhow::{Context, Result};
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};
use image::{ImageEncoder, RgbImage};
use raytrace::difference::false_colour;
use raytrace::exr::{Image, read_reference, read_rgb};
use raytrace::metrics::error_map;
use raytrace::tonemap::{automatic_exposure, to_srgb};
use std::path::Path;

/// The error at which pictures are compared, beside [`moment`].
pub const ERROR: f64 = 0.02;
/// Bytes that all pictures of a page may take before they become text, a third longer.
const BUDGET: usize = 9_000_000;
/// Longest side and JPEG quality, best first: the first whose sum fits the budget is taken.
const SIZES: [(u32, u8); 5] = [(1024, 92), (640, 88), (512, 84), (384, 78), (256, 70)];

/// The pictures of one scene.
pub struct Gallery {
    /// Exposure value (ISO 100) of all of them.
    pub exposure: f32,
    /// Seconds around which `at_time` were chosen.
    pub moment: Option<f64>,
    /// The reference first, then the methods' in the order of the scene.
    pub pictures: Vec<Picture>,
    /// Which of them is first laid over the reference.
    pub first: usize,
    /// What could not be shown, and why.
    pub missing: Vec<String>,
}

/// One picture to be shown.
pub struct Picture {
    /// The method's label, or `reference`.
    pub name: String,
    /// Setting, seconds and error.
    pub caption: String,
    /// Whether it is the method's picture nearest to the moment.
    pub at_time: bool,
    /// Whether it is the method's picture nearest to [`ERROR`].
    pub at_error: bool,
    shown: RgbImage,
    errors: Option<RgbImage>,
}

impl Picture {
    /// Whether it is what the others are held against.
    pub fn is_reference(&self) -> bool {
        self.errors.is_none()
    }
}

/// A picture ready for the page.
pub struct Encoded {
    /// `data:` URI of the picture.
    pub shown: String,
    /// `data:` URI of its error map; the reference has none.
    pub errors: Option<String>,
    /// Columns and rows as rendered, whatever the size it is embedded at.
    pub size: (u32, u32),
}

/// Reads the pictures of `scene` that are to be shown: paths from `folder`, the reference's from `root`. Whatever
/// cannot be read is listed, not fatal: a page without one picture is better than none.
pub fn read(scene: &Scene, folder: &Path, root: &Path) -> Gallery {
    let mut gallery = Gallery {
        exposure: 0.0,
        moment: moment(scene).map(|(_, s)| s),
        pictures: vec![],
        first: 1,
        missing: vec![],
    };
    let reference = match read_reference(&root.join(&scene.reference.path)) {
        Ok(reference) => reference.mean,
        Err(e) => {
            gallery.missing.push(format!("the reference, and so any picture: {e}"));
            return gallery;
        }
    };
    gallery.exposure = automatic_exposure(&reference.pixels);
    gallery.pictures.extend(to_screen(&reference, gallery.exposure).map(|shown| Picture {
        name: "reference".into(),
        caption: scene.reference.made_by.clone(),
        at_time: true,
        at_error: true,
        shown,
        errors: None,
    }));
    let ours = moment(scene).map(|(curve, _)| &curve.method);
    for curve in &scene.curves {
        let name = if curve.comparable { curve.label.clone() } else { format!("{} †", curve.label) };
        let by_time = gallery.moment.and_then(|m| nearest(curve, m, |p| p.seconds));
        let by_error = nearest(curve, ERROR, |p| p.error);
        for (i, point) in curve.points.iter().enumerate() {
            let (at_time, at_error) = (by_time == Some(i), by_error == Some(i));
            let Some(path) = point.picture.as_ref().filter(|_| at_time || at_error) else { continue };
            if at_time && ours == Some(&curve.method) {
                gallery.first = gallery.pictures.len();
            }
            match one(&folder.join(path), &reference, gallery.exposure) {
                Ok((shown, errors)) => gallery.pictures.push(Picture {
                    name: name.clone(),
                    caption: caption(point),
                    at_time,
                    at_error,
                    shown,
                    errors: Some(errors),
                }),
                Err(e) => gallery.missing.push(format!("{}, {}: {e:#}", curve.label, point.setting)),
            }
        }
    }
    gallery
}

/// Setting, seconds and error of a point, in a line.
fn caption(point: &Point) -> String {
    format!("{} · {} · {}", point.setting, seconds(point.seconds), percent(point.error))
}

/// The point with a picture that is nearest to `wanted`, by factors.
fn nearest(curve: &Curve, wanted: f64, of: impl Fn(&Point) -> f64) -> Option<usize> {
    let distance = |p: &Point| (of(p) / wanted).ln().abs();
    let points = curve.points.iter().enumerate().filter(|(_, p)| p.picture.is_some());
    let finite = points.filter(|(_, p)| distance(p).is_finite());
    finite.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b))).map(|(i, _)| i)
}

fn one(path: &Path, reference: &Image, exposure: f32) -> Result<(RgbImage, RgbImage)> {
    let picture = read_rgb(path)?;
    let map: Vec<[u8; 3]> = error_map(&picture, reference)?.into_iter().map(false_colour).collect();
    let shown = to_screen(&picture, exposure).context("it has no pixels")?;
    let errors = bitmap(picture.width, picture.height, &map).context("it has no pixels")?;
    Ok((shown, errors))
}

fn to_screen(picture: &Image, exposure: f32) -> Option<RgbImage> {
    bitmap(picture.width, picture.height, &to_srgb(&picture.pixels, exposure))
}

fn bitmap(width: u32, height: u32, pixels: &[[u8; 3]]) -> Option<RgbImage> {
    RgbImage::from_raw(width, height, pixels.as_flattened().to_vec()).filter(|_| width > 0 && height > 0)
}

/// All pictures of all scenes as text for one page, at the first of [`SIZES`] that fits; and how many bytes they are.
pub fn encode(galleries: &[Gallery]) -> Result<(Vec<Vec<Encoded>>, usize)> {
    let mut last = (Vec::new(), 0);
    for (side, quality) in SIZES {
        let mut bytes = 0;
        let mut uri = |picture: &RgbImage| -> Result<String> {
            let data = jpeg(picture, side, quality)?;
            bytes += data.len();
            Ok(format!("data:image/jpeg;base64,{}", base64(&data)))
        };
        let mut all = Vec::new();
        for gallery in galleries {
            let mut encoded = Vec::new();
            for p in &gallery.pictures {
                let errors = p.errors.as_ref().map(&mut uri).transpose()?;
                encoded.push(Encoded { shown: uri(&p.shown)?, errors, size: p.shown.dimensions() });
            }
            all.push(encoded);
        }
        last = (all, bytes);
        if bytes <= BUDGET {
            break;
        }
    }
    Ok(last)
}

fn jpeg(picture: &RgbImage, side: u32, quality: u8) -> Result<Vec<u8>> {
    let longest = picture.width().max(picture.height());
    let shrunk;
    let picture = match longest > side {
        true => {
            let scaled = |v: u32| (u64::from(v) * u64::from(side) / u64::from(longest)).max(1) as u32;
            shrunk = resize(picture, scaled(picture.width()), scaled(picture.height()), FilterType::Triangle);
            &shrunk
        }
        false => picture,
    };
    let mut data = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut data, quality);
    let colour = image::ExtendedColorType::Rgb8;
    encoder.write_image(picture.as_raw(), picture.width(), picture.height(), colour)?;
    Ok(data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::report::tests::{curve, scene};
    use geometry::Rgb;
    use raytrace::exr::{Metadata, write_rgb};

    #[test]
    fn pictures_are_found_exposed_and_held_against_the_reference() {
        let dir = tempfile::tempdir().unwrap();
        let save = |name: &str, v: f32, n: u32| {
            let image = Image { width: n, height: n, pixels: vec![Rgb::splat(v); (n * n) as usize] };
            write_rgb(&image, &Metadata::default(), &dir.path().join(name)).unwrap();
        };
        save("r.a.exr", 100.0, 8);
        save("r.b.exr", 100.0, 8);
        save("good.exr", 101.0, 8);
        save("small.exr", 101.0, 4);
        let mut ours = curve("split", true, &[(1.0, 0.02), (9.0, 0.001)]);
        ours.points[0].picture = Some("good.exr".into());
        let mut small = curve("y", false, &[(1.0, 0.05)]);
        small.points[0].picture = Some("small.exr".into());
        let mut other = curve("x", false, &[(1.0, 0.05), (f64::NAN, 0.0)]);
        other.points[0].picture = Some("nowhere.exr".into());
        other.points[1].picture = Some("good.exr".into());
        let mut scene = scene(vec![ours, small, other]);
        scene.reference.path = "r".into();

        let gallery = read(&scene, dir.path(), dir.path());
        let names: Vec<&str> = gallery.pictures.iter().map(|p| p.name.as_str()).collect();
        assert_eq!((names, gallery.missing.len()), (vec!["reference", "split"], 2), "{:?}", gallery.missing);
        let (encoded, bytes) = encode(&[gallery]).unwrap();
        assert!(encoded[0][1].errors.as_ref().unwrap().starts_with("data:image/jpeg;base64,/9j/"));
        assert!(bytes > 100 && bytes < 5000);

        scene.reference.path = "elsewhere".into();
        assert_eq!(read(&scene, dir.path(), dir.path()).missing.len(), 1);
    }

    #[test]
    fn large_pictures_are_shrunk_not_distorted() {
        let data = jpeg(&RgbImage::new(400, 100), 100, 80).unwrap();
        assert_eq!(image::load_from_memory(&data).unwrap().into_rgb8().dimensions(), (100, 25));
    }
}
