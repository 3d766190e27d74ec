//! Film to OpenEXR: one part, named layers, half where that loses nothing worth having.

use super::{Image, Metadata};
use crate::error::Error;
use crate::film::{Film, Pixel};
use crate::output::write_atomically;
use ::exr::prelude::*;
use geometry::Rgb;
use half::f16;
use std::io::Cursor;
use std::path::Path;

/// Writes all layers of `film` to `path`, atomically.
///
/// Beauty is R, G, B, A without a prefix, so that every viewer shows it; then `direct`, `indirect`, `specular`,
/// `emission` (their sum is the beauty), `albedo`, `irradiance` as .R .G .B, `normal` and `position` as .X .Y .Z,
/// `depth.Z` and `variance.Y`. Light is in cd/m², irradiance in lx, lengths in metres.
///
/// - `by_light`: what each group of lamps adds to the beauty, as layers `light.NAME`.
pub fn write(
    film: &Film,
    by_light: &[(String, Vec<Rgb>)],
    metadata: &Metadata,
    path: &Path,
) -> std::result::Result<(), Error> {
    type Get = fn(&Pixel) -> [f32; 3];
    const RGB: [&str; 3] = ["R", "G", "B"];
    const XYZ: [&str; 3] = ["X", "Y", "Z"];
    let triples: [(&str, [&str; 3], Format, Get); 8] = [
        ("direct", RGB, Format::Fitting, |p| p.direct.to_array()),
        ("indirect", RGB, Format::Fitting, |p| p.indirect.to_array()),
        ("specular", RGB, Format::Fitting, |p| p.specular.to_array()),
        ("emission", RGB, Format::Fitting, |p| p.emission.to_array()),
        ("albedo", RGB, Format::Fitting, |p| p.albedo.to_array()),
        ("irradiance", RGB, Format::Fitting, |p| p.irradiance.to_array()),
        ("normal", XYZ, Format::Fitting, |p| p.normal.to_array()),
        ("position", XYZ, Format::Float, |p| p.position.to_array()),
    ];
    let n = film.pixels.len();
    let mut channels = layer(["R", "G", "B", "A"], Format::Fitting, n, |i| {
        let Rgb { r, g, b } = film.pixels[i].beauty();
        [r, g, b, film.pixels[i].alpha]
    });
    for (name, names, format, get) in triples {
        channels.extend(layer(names.map(|c| format!("{name}.{c}")), format, n, |i| get(&film.pixels[i])));
    }
    let layers = layer_names(by_light.iter().map(|(name, _)| &**name));
    for (name, (_, part)) in layers.iter().zip(by_light) {
        let names = RGB.map(|c| format!("light.{name}.{c}"));
        channels.extend(layer(names, Format::Fitting, n, |i| part[i].to_array()));
    }
    channels.extend(layer(["depth.Z"], Format::Float, n, |i| [film.pixels[i].depth]));
    channels.extend(layer(["variance.Y"], Format::Fitting, n, |i| [film.pixels[i].variance]));
    save(channels, film.width, film.height, metadata, path)
}

/// Names as a file can hold them: without the point that divides a layer's name from its channel's, not too long (OpenEXR
/// allows 255 bytes with the channel), all different.
fn layer_names<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    const LONGEST: usize = 200;
    let mut fitted: Vec<String> = Vec::new();
    for name in names {
        let unfit = |c: char| if c == '.' || c.is_control() { '_' } else { c };
        let mut name: String = name.chars().map(unfit).collect();
        while name.len() > LONGEST {
            name.pop();
        }
        let taken = |name: &String| fitted.contains(name);
        let numbered = (2..).map(|n| format!("{name} {n}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|name| !taken(name));
        fitted.push(free.unwrap_or_default());
    }
    fitted
}

/// Writes a plain picture as R, G, B to `path`, atomically.
pub fn write_rgb(image: &Image, metadata: &Metadata, path: &Path) -> std::result::Result<(), Error> {
    let channels =
        layer(["R", "G", "B"], Format::Fitting, image.pixels.len(), |i| image.pixels[i].to_array());
    save(channels, image.width, image.height, metadata, path)
}

/// How the numbers of a layer are stored.
#[derive(Clone, Copy, PartialEq)]
enum Format {
    /// 32 bits.
    Float,
    /// 16 bits where they can hold the layer, else 32.
    Fitting,
}

/// The channels of one layer, each of `n` pixels. They share a format: viewers expect R, G and B to be of one kind.
/// The numbers are asked for twice rather than kept: a large picture has gigabytes of them.
fn layer<const C: usize>(
    names: [impl AsRef<str>; C],
    format: Format,
    n: usize,
    get: impl Fn(usize) -> [f32; C],
) -> Vec<AnyChannel<FlatSamples>> {
    let peak = || (0..n).flat_map(&get).fold(0f32, |m, v| m.max(v.abs()));
    let half = format == Format::Fitting && fits_half(peak());
    let samples = |c: usize| match half {
        true => FlatSamples::F16((0..n).map(|i| f16::from_f32(get(i)[c])).collect()),
        false => FlatSamples::F32((0..n).map(|i| get(i)[c]).collect()),
    };
    names.iter().enumerate().map(|(c, name)| AnyChannel::new(text(name.as_ref()), samples(c))).collect()
}

/// Whether half floats hold a layer whose largest number is `peak`: none above their own largest, 65504, and the
/// peak at least 2⁻⁴, so that a thousandth of it is still above 2⁻¹⁴, below which halves lose digits.
fn fits_half(peak: f32) -> bool {
    peak == 0.0 || (0.0625..=65504.0).contains(&peak)
}

fn save(
    channels: Vec<AnyChannel<FlatSamples>>,
    width: u32,
    height: u32,
    metadata: &Metadata,
    path: &Path,
) -> std::result::Result<(), Error> {
    let encode_error = |reason: String| Error::Encode { path: path.into(), reason };
    if width == 0 || height == 0 {
        return Err(encode_error("it has no pixels".into()));
    }
    let size = Vec2(width as usize, height as usize);
    let channels = AnyChannels::sort(channels.into());
    let mut own = LayerAttributes {
        software_name: Some(Text::from(concat!("twolight ", env!("CARGO_PKG_VERSION")))),
        // OpenEXR multiplies row vectors from the left, glam column vectors from the right: the same sixteen
        // numbers in the same order.
        world_to_camera: metadata.world_to_camera.map(|m| m.to_cols_array()),
        ..LayerAttributes::default()
    };
    for (name, value) in &metadata.texts {
        own.other.insert(text(&format!("twolight:{name}")), AttributeValue::Text(text(value)));
    }
    own.other.insert(text("colorInteropID"), AttributeValue::Text(text("lin_rec709_scene")));
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        // In order, so that threads that finish in another order still write the same file.
        line_order: LineOrder::Increasing,
    };
    let mut image = ::exr::image::Image::from_layer(::exr::image::Layer::new(size, own, encoding, channels));
    image.attributes.chromaticities = Some(::exr::meta::attribute::Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    let mut bytes = Vec::new();
    image.write().to_buffered(Cursor::new(&mut bytes)).map_err(|e| encode_error(e.to_string()))?;
    if sort_attributes(&mut bytes).is_none() {
        return Err(encode_error("its header is not in order".into()));
    }
    write_atomically(path, &bytes)
}

/// UTF-8 as it stands (OpenEXR since 2.0 reads text so); the crate's own conversion panics beyond Latin-1.
fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

/// Puts the attributes of a one-part file in the order of their names. The crate keeps ours in a hash map whose
/// order changes from run to run, and the same picture shall give the same bytes.
///
/// The header follows 8 bytes of magic number and version: name, 0, type, 0, length (4 bytes), value; and ends
/// with an empty name (OpenEXR File Layout, "Header attributes"). Its length does not change, so the offsets of
/// the scan lines stay true. `None` when the bytes are not such a header.
fn sort_attributes(bytes: &mut [u8]) -> Option<()> {
    const START: usize = 8;
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut at = START;
    while *bytes.get(at)? != 0 {
        let name = bytes[at..].iter().position(|&b| b == 0)? + 1;
        let kind = bytes.get(at + name..)?.iter().position(|&b| b == 0)? + 1;
        let value = at + name + kind;
        let length = u32::from_le_bytes(bytes.get(value..value + 4)?.try_into().ok()?) as usize;
        attributes.push(bytes.get(at..value + 4 + length)?);
        at = value + 4 + length;
    }
    // No name is another's beginning with the 0 that ends it, so comparing whole records compares names.
    attributes.sort_unstable();
    let sorted = attributes.concat();
    bytes[START..at].copy_from_slice(&sorted);
    Some(())
}

#[cfg(test)]
mod tests {
    use super::super::{read_layer, read_rgb};
    use super::*;
    use geometry::Vec3;
    use geometry::math::Mat4;

    #[test]
    fn layers_have_names_that_a_file_can_hold() {
        let long = "é".repeat(300);
        let names = layer_names(["a.b", "a_b", "東京", "x\0y", &long, &long].into_iter());
        assert_eq!(names[..4], ["a_b", "a_b 2", "東京", "x_y"]);
        assert!(names[4].len() <= 200 && names[5] == format!("{} 2", names[4]));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let part = vec![Rgb::WHITE; 35];
        let layers: Vec<_> = ["東京", "a.b", "a_b", &long].map(|n| (n.to_string(), part.clone())).into();
        write(&film(), &layers, &Metadata::default(), &path).unwrap();
        assert_eq!(read_layer(&path, "light.a_b 2").unwrap().pixels, part);
    }

    /// A small film whose every layer differs from pixel to pixel.
    fn film() -> Film {
        let mut film = Film::new(7, 5);
        for (i, p) in film.pixels.iter_mut().enumerate() {
            let v = i as f32;
            p.direct = Rgb::new(v, 0.5 * v, 2.0);
            p.indirect = Rgb::splat(0.25 * v);
            p.emission = Rgb::splat(if i == 3 { 1e6 } else { 0.0 });
            p.alpha = 1.0;
            p.normal = Vec3::new(0.0, -1.0, 0.0);
            p.depth = 1.0 + v / 3.0;
            p.position = Vec3::new(v / 7.0, -v, 1e5);
        }
        film
    }

    fn saved(film: &Film, metadata: &Metadata) -> (tempfile::TempDir, std::path::PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("film.exr");
        write(film, &[], metadata, &path).unwrap();
        (dir, path)
    }

    #[test]
    fn layers_come_back_and_add_up() {
        let film = film();
        let (_dir, path) = saved(&film, &Metadata::default());
        let beauty = read_rgb(&path).unwrap();
        assert_eq!((beauty.width, beauty.height), (7, 5));
        let layer = |name| read_layer(&path, name).unwrap();
        let parts = ["direct", "indirect", "specular", "emission"].map(layer);
        for (i, b) in beauty.pixels.iter().enumerate() {
            let sum: Rgb = parts.iter().map(|l| l.pixels[i]).sum();
            assert!((*b - sum).map(f32::abs).max_channel() <= 1e-3 * b.max_channel(), "{i}: {b:?} {sum:?}");
        }
        assert_eq!(beauty.pixels[3].r, film.pixels[3].beauty().r, "a lamp above 65504 is stored as float");
        let position = layer("position");
        assert_eq!(position.pixels[6].to_array(), film.pixels[6].position.to_array());
        assert_eq!(layer("depth").pixels[6].r, film.pixels[6].depth);
        assert_eq!(layer("normal").pixels[0], Rgb::new(0.0, -1.0, 0.0));
    }

    #[test]
    fn half_is_chosen_only_where_it_keeps_the_digits() {
        for (peak, half) in [(0.0, true), (1.0, true), (65504.0, true), (65505.0, false), (1e-3, false)] {
            assert_eq!(fits_half(peak), half, "{peak}");
        }
    }

    #[test]
    fn the_same_picture_gives_the_same_bytes_with_its_attributes_in_order() {
        let mut metadata = Metadata { world_to_camera: Some(Mat4::IDENTITY), ..Metadata::default() };
        for i in 0..20 {
            metadata.push(format!("key {i:02}"), "Zürich → 東京");
        }
        let read = || {
            let (_dir, path) = saved(&film(), &metadata);
            std::fs::read(path).unwrap()
        };
        let first = read();
        assert!((0..4).all(|_| read() == first));
        let find = |s: &str| first.windows(s.len()).position(|w| w == s.as_bytes());
        assert!(find("colorInteropID") < find("twolight:key 00"));
        assert!(find("twolight:key 00") < find("twolight:key 19") && find("東京").is_some());
    }

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("old.exr");
        std::fs::write(&path, b"precious").unwrap();
        assert!(write(&Film::new(0, 4), &[], &Metadata::default(), &path).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"precious");
    }
}
