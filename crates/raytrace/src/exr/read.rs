//! OpenEXR to a plain picture, whoever wrote it; damaged files give an error.

use super::Image;
use crate::error::Error;
use crate::metrics::Reference;
use ::exr::prelude::*;
use geometry::Rgb;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The most samples (pixels × channels, over all parts) that a file may claim: 2³⁰, or 4 GiB as floats.
/// A header of a few bytes must not make us ask the system for all its memory.
const MOST_SAMPLES: u64 = 1 << 30;

/// Whether `path` is a picture whose work was done: one that was stopped on the way says so in its header.
pub fn is_finished(path: &Path) -> bool {
    let Ok(meta) = ::exr::meta::MetaData::read_from_file(path, false) else { return false };
    let unfinished = |name: &Text| *name == *"twolight:unfinished";
    !meta.headers.iter().any(|header| header.own_attributes.other.keys().any(unfinished))
}

/// Reads the main picture: R, G, B of the first part that has them, whatever their number format; else of
/// the first layer that has them; else a single luminance channel Y, as grey.
pub fn read_rgb(path: &Path) -> std::result::Result<Image, Error> {
    let parts = load(path)?;
    let found = parts
        .iter()
        .find_map(|p| p.triple("", ["R", "G", "B"]))
        .or_else(|| parts.iter().find_map(Part::first_layer))
        .or_else(|| parts.iter().find_map(|p| p.triple("", ["Y", "Y", "Y"])));
    found.ok_or_else(|| Error::NoSuchLayer {
        path: path.into(),
        wanted: "R, G, B".into(),
        present: describe(&parts),
    })
}

/// Reads a reference, and its two independent halves if they lie beside it: `box.a.exr` and `box.b.exr` beside
/// `box.exr`. Where only the halves are there, the reference is their mean.
pub fn read_reference(path: &Path) -> std::result::Result<Reference, Error> {
    let beside = |half: &str| match path.extension() {
        Some(e) if e == "exr" => path.with_extension(format!("{half}.exr")),
        _ => PathBuf::from(format!("{}.{half}.exr", path.display())),
    };
    let (a, b) = (beside("a"), beside("b"));
    let halves = match a.is_file() && b.is_file() {
        true => Some((read_rgb(&a)?, read_rgb(&b)?)),
        false => None,
    };
    let mean = match &halves {
        Some((a, b)) if !path.is_file() && a.pixels.len() == b.pixels.len() => {
            let pixels = a.pixels.iter().zip(&b.pixels).map(|(&a, &b)| (a + b) * 0.5).collect();
            Image { pixels, ..*a }
        }
        _ => read_rgb(path)?,
    };
    Ok(Reference { mean, halves })
}

/// Reads the layer `name`: its R, G, B, or X, Y, Z, or its only channel three times. A layer is a prefix of the
/// channels' names (`direct.R`) or a part of that name.
pub fn read_layer(path: &Path, name: &str) -> std::result::Result<Image, Error> {
    let parts = load(path)?;
    let prefix = format!("{name}.");
    let sets = [["R", "G", "B"], ["X", "Y", "Z"], ["Z"; 3], ["Y"; 3], ["V"; 3]];
    let in_part = |p: &Part, prefix: &str| sets.iter().find_map(|&set| p.triple(prefix, set));
    let found = parts
        .iter()
        .find_map(|p| in_part(p, &prefix))
        .or_else(|| parts.iter().filter(|p| p.name == name).find_map(|p| in_part(p, "")))
        .or_else(|| parts.iter().find_map(|p| p.triple("", [name; 3])));
    found.ok_or_else(|| Error::NoSuchLayer {
        path: path.into(),
        wanted: format!("of a layer {name:?}"),
        present: describe(&parts),
    })
}

/// One part of a file, its channels by name.
struct Part {
    name: String,
    size: Vec2<usize>,
    channels: Vec<(String, FlatSamples)>,
}

impl Part {
    /// The picture made of three channels, `prefix` before each name.
    fn triple(&self, prefix: &str, names: [&str; 3]) -> Option<Image> {
        let find = |n: &str| {
            self.channels.iter().find(|(c, _)| c.strip_prefix(prefix) == Some(n)).map(|(_, samples)| samples)
        };
        let [r, g, b] = [find(names[0])?, find(names[1])?, find(names[2])?];
        let pixels: Vec<Rgb> = r
            .values_as_f32()
            .zip(g.values_as_f32())
            .zip(b.values_as_f32())
            .map(|((r, g), b)| Rgb::new(r, g, b))
            .collect();
        // Subsampled channels are shorter than the picture.
        (pixels.len() == self.size.area()).then(|| Image {
            width: self.size.width() as u32,
            height: self.size.height() as u32,
            pixels,
        })
    }

    /// The first layer, in the order of the file, that has R, G and B.
    fn first_layer(&self) -> Option<Image> {
        self.channels
            .iter()
            .filter_map(|(name, _)| name.strip_suffix(".R"))
            .find_map(|layer| self.triple(&format!("{layer}."), ["R", "G", "B"]))
    }
}

fn load(path: &Path) -> std::result::Result<Vec<Part>, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let damaged = |reason: String| Error::Damaged { path: path.into(), reason };
    decode(&bytes).map_err(damaged)
}

fn decode(bytes: &[u8]) -> std::result::Result<Vec<Part>, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    let samples = meta.headers.iter().try_fold(0u64, |sum, h| {
        let pixels = (h.layer_size.width() as u64).checked_mul(h.layer_size.height() as u64)?;
        pixels.checked_mul(h.channels.list.len() as u64)?.checked_add(sum)
    });
    if samples.is_none_or(|n| n > MOST_SAMPLES) {
        return Err(format!("it claims more than {MOST_SAMPLES} samples"));
    }
    let image = ::exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let part = |layer: ::exr::image::Layer<AnyChannels<FlatSamples>>| Part {
        name: layer.attributes.layer_name.map(|n| n.to_string()).unwrap_or_default(),
        size: layer.size,
        channels: layer.channel_data.list.into_iter().map(|c| (c.name.to_string(), c.sample_data)).collect(),
    };
    Ok(image.layer_data.into_iter().map(part).collect())
}

fn describe(parts: &[Part]) -> String {
    let names: Vec<&str> = parts.iter().flat_map(|p| p.channels.iter().map(|(n, _)| n.as_str())).collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::super::{Metadata, write_rgb};
    use super::*;

    fn small_file() -> Vec<u8> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("small.exr");
        let pixels = (0..35).map(|i| Rgb::new(i as f32, 1.0, 0.5)).collect();
        write_rgb(&Image { width: 7, height: 5, pixels }, &Metadata::default(), &path).unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn no_damage_does_worse_than_an_error() {
        let good = small_file();
        assert!(decode(&good).is_ok());
        for cut in (0..good.len()).step_by(3) {
            let _ = decode(&good[..cut]);
        }
        for at in (0..good.len()).step_by(2) {
            for value in [0xff, good[at] ^ 1] {
                let mut bad = good.clone();
                bad[at] = value;
                let _ = decode(&bad);
            }
        }
    }

    #[test]
    fn any_part_and_any_kind_of_number_is_read() {
        let part = |name: &str, channels: Vec<AnyChannel<FlatSamples>>| {
            let attributes = LayerAttributes::named(name);
            let channels = AnyChannels::sort(channels.into());
            ::exr::image::Layer::new((2, 1), attributes, Encoding::UNCOMPRESSED, channels)
        };
        let whole = |n: &str, v| AnyChannel::new(n, FlatSamples::U32(vec![v, 2 * v]));
        let float = |n: &str, v| AnyChannel::new(n, FlatSamples::F32(vec![v, 2.0 * v]));
        let parts = vec![
            part("depth", vec![float("Z", 7.0)]),
            part("beauty", vec![whole("R", 1), whole("G", 2), whole("B", 3)]),
            part("more", vec![float("sun.R", 4.0), float("sun.G", 5.0), float("sun.B", 6.0)]),
        ];
        let window = ::exr::meta::attribute::IntegerBounds::from_dimensions((2, 1));
        let image = ::exr::image::Image::from_layers(ImageAttributes::new(window), parts);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("parts.exr");
        image.write().to_file(&path).unwrap();
        assert_eq!(read_rgb(&path).unwrap().pixels[1], Rgb::new(2.0, 4.0, 6.0));
        assert_eq!(read_layer(&path, "sun").unwrap().pixels[0], Rgb::new(4.0, 5.0, 6.0));
        assert_eq!(read_layer(&path, "depth").unwrap().pixels[0], Rgb::splat(7.0));
    }

    #[test]
    fn messages_name_the_file_and_what_is_in_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        assert!(read_rgb(&path).unwrap_err().to_string().contains("a.exr"));
        std::fs::write(&path, b"not a picture").unwrap();
        assert!(matches!(read_rgb(&path), Err(Error::Damaged { .. })));
        std::fs::write(&path, small_file()).unwrap();
        let error = read_layer(&path, "direct").unwrap_err().to_string();
        assert!(error.contains("direct") && error.contains("B, G, R"), "{error}");
    }
}
