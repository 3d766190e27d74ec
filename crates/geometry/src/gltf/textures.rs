//! Images: found, measured before they are decoded, decoded on all threads.

use std::collections::HashMap;
use std::io::Cursor;

use gltf::json;
use gltf::json::texture::{MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::Checked;
use image::ImageReader;
use rayon::prelude::*;

use super::document::Document;
use super::error::{Error, chain};
use super::ktx2;
use super::limits::Limits;
use super::materials::texture_refs;
use super::warnings::Warnings;
use crate::Rgb;
use crate::scene::Material;
use crate::texture::{Texture, Wrap};

/// Decodes the textures that `materials` use and points their references into the list returned.
///
/// A texture that cannot be had is a warning, and the material does without: but one that lost its emissive
/// texture emits nothing, since it would otherwise shine all over.
pub(super) fn load(
    document: &mut Document,
    materials: &mut [Material],
    warnings: &mut Warnings,
) -> Result<Vec<Texture>, Error> {
    let mut numbers: Vec<u32> =
        materials.iter_mut().flat_map(texture_refs).filter_map(|t| t.map(|t| t.texture)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    // Textures that share image and sampler share the texels.
    let mut sources: Vec<Source> = Vec::new();
    let mut known: HashMap<(usize, Sampler), usize> = HashMap::new();
    let mut of_texture: HashMap<u32, usize> = HashMap::new();
    for number in numbers {
        let i = number as usize;
        let sampler = Sampler::of(document, i)?;
        let Some(image) = image_of(document, i, warnings)? else { continue };
        let slot = match known.get(&(image, sampler)) {
            Some(&slot) => slot,
            None => {
                let Some(source) = Source::fetch(document, image, sampler, warnings)? else { continue };
                known.insert((image, sampler), sources.len());
                sources.push(source);
                sources.len() - 1
            }
        };
        of_texture.insert(number, slot);
    }
    measure(&mut sources, &document.limits, warnings);
    let decoded: Vec<Result<Texture, String>> = sources.into_par_iter().map(Source::decode).collect();
    let mut textures = Vec::new();
    let place: Vec<Option<u32>> = decoded
        .into_iter()
        .map(|result| match result {
            Ok(texture) => {
                textures.push(texture);
                Some(textures.len() as u32 - 1)
            }
            Err(problem) => {
                if !problem.is_empty() {
                    warnings.say(problem);
                }
                None
            }
        })
        .collect();
    for material in materials {
        let emissive = material.emissive_texture.is_some();
        for slot in texture_refs(material) {
            *slot = slot.and_then(|mut t| {
                t.texture = place[*of_texture.get(&t.texture)?]?;
                Some(t)
            });
        }
        if emissive && material.emissive_texture.is_none() && !material.emissive.is_black() {
            warnings.say(format!(
                "material \"{}\" emits nothing: its emissive texture is missing",
                material.name
            ));
            material.emissive = Rgb::BLACK;
        }
    }
    Ok(textures)
}

/// The images of these numbers, decoded, within the limits; `None`, with a warning, where one cannot be had.
pub(super) fn images(
    document: &mut Document,
    numbers: &[usize],
    warnings: &mut Warnings,
) -> Result<Option<Vec<Texture>>, Error> {
    let sampler = Sampler { wrap_s: 2, wrap_t: 2, linear: true };
    let mut sources = Vec::new();
    for &image in numbers {
        let Some(source) = Source::fetch(document, image, sampler, warnings)? else { return Ok(None) };
        sources.push(source);
    }
    measure(&mut sources, &document.limits, warnings);
    let decoded: Result<Vec<Texture>, String> = sources.into_par_iter().map(Source::decode).collect();
    match decoded {
        Ok(images) => Ok(Some(images)),
        Err(problem) => {
            if !problem.is_empty() {
                warnings.say(problem);
            }
            Ok(None)
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Sampler {
    wrap_s: u8,
    wrap_t: u8,
    linear: bool,
}

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];

impl Sampler {
    /// The sampler of texture `i`; linear and repeating when it has none.
    fn of(document: &Document, i: usize) -> Result<Sampler, Error> {
        let Some(index) = document.root.textures[i].sampler else {
            return Ok(Sampler { wrap_s: 0, wrap_t: 0, linear: true });
        };
        let s = index.value();
        let sampler = document.root.samplers.get(s).ok_or_else(|| {
            document.fault(format_args!("textures[{i}].sampler"), s, "there is no sampler of this number")
        })?;
        let wrap = |mode: &Checked<WrappingMode>, axis: &str| match mode {
            Checked::Valid(WrappingMode::Repeat) => Ok(0),
            Checked::Valid(WrappingMode::MirroredRepeat) => Ok(1),
            Checked::Valid(WrappingMode::ClampToEdge) => Ok(2),
            Checked::Invalid => {
                Err(document.fault(format_args!("samplers[{s}].{axis}"), "?", "no wrap mode of glTF's"))
            }
        };
        let linear = match (sampler.mag_filter, sampler.min_filter) {
            (Some(Checked::Valid(filter)), _) => filter == MagFilter::Linear,
            (_, Some(Checked::Valid(filter))) => !matches!(
                filter,
                MinFilter::Nearest | MinFilter::NearestMipmapNearest | MinFilter::NearestMipmapLinear
            ),
            _ => true,
        };
        Ok(Sampler {
            wrap_s: wrap(&sampler.wrap_s, "wrapS")?,
            wrap_t: wrap(&sampler.wrap_t, "wrapT")?,
            linear,
        })
    }
}

/// The image of texture `i`: WebP where the file offers it, for the other is a fallback of less quality; KTX2 where there
/// is no other, for it loses most.
fn image_of(document: &Document, i: usize, warnings: &mut Warnings) -> Result<Option<usize>, Error> {
    let texture = &document.root.textures[i];
    let others = texture.extensions.as_ref().map(|e| &e.others);
    let source = |extension: &str| -> Option<usize> {
        usize::try_from(others?.get(extension)?.get("source")?.as_u64()?).ok()
    };
    // The gltf crate's sign for no source.
    let plain = Some(texture.source.value()).filter(|image| *image != u32::MAX as usize);
    let image = match source("EXT_texture_webp").or(plain).or(source("KHR_texture_basisu")) {
        Some(image) => image,
        None => {
            let kinds: Vec<&str> = others.into_iter().flat_map(|o| o.keys().map(String::as_str)).collect();
            let why = if kinds.is_empty() {
                "it has no image".into()
            } else {
                format!("only {}", kinds.join(", "))
            };
            warnings.say(format!("textures[{i}] is left out: {why}"));
            return Ok(None);
        }
    };
    if image >= document.root.images.len() {
        return Err(document.fault(
            format_args!("textures[{i}].source"),
            image,
            "there is no image of this number",
        ));
    }
    Ok(Some(image))
}

/// An image's file in memory.
struct Source {
    name: String,
    bytes: Vec<u8>,
    sampler: Sampler,
    /// Columns times rows; none when it shall not be decoded, for a reason already said.
    pixels: Option<u64>,
}

impl Source {
    fn fetch(
        document: &mut Document,
        i: usize,
        sampler: Sampler,
        warnings: &mut Warnings,
    ) -> Result<Option<Source>, Error> {
        let image = &document.root.images[i];
        let (view, uri) = (image.buffer_view, image.uri.clone());
        let name = image
            .name
            .clone()
            .or_else(|| uri.clone().filter(|u| u.len() < 80))
            .unwrap_or(format!("image {i}"));
        let at = format!("images[{i}]");
        let bytes = match (view, uri) {
            (Some(view), _) => view_bytes(document, view, &at),
            (None, Some(uri)) => document.fetch(&uri, &format_args!("{at}.uri")),
            (None, None) => Err(document.fault(&at, "{}", "it has neither uri nor bufferView")),
        };
        match bytes {
            Ok(bytes) => Ok(Some(Source { name, bytes, sampler, pixels: None })),
            Err(limit @ Error::Limit { .. }) => Err(limit),
            Err(e) => {
                warnings.say(format!("image \"{name}\" is left out: {}", chain(&e)));
                Ok(None)
            }
        }
    }

    /// Columns and rows from the header.
    fn size(&self) -> Result<(u32, u32), String> {
        if ktx2::is_ktx2(&self.bytes) {
            return ktx2::size(&self.bytes);
        }
        let reader =
            ImageReader::new(Cursor::new(&self.bytes)).with_guessed_format().map_err(|e| e.to_string())?;
        reader.into_dimensions().map_err(|e| e.to_string())
    }

    fn decode(self) -> Result<Texture, String> {
        let Some(pixels) = self.pixels else { return Err(String::new()) };
        let failed = |e: &dyn std::fmt::Display| format!("image \"{}\" is left out: {e}", self.name);
        // The size has been judged; what is left is room for its texels, at most 4 × 32 bits, and some more.
        let most = 16 * pixels + (64 << 20);
        let rgba = if ktx2::is_ktx2(&self.bytes) {
            let (width, height) = self.size().map_err(|e| failed(&e))?;
            let texels = ktx2::decode(&self.bytes, most).map_err(|e| failed(&e))?;
            image::RgbaImage::from_raw(width, height, texels).ok_or_else(|| failed(&"too few texels"))?
        } else {
            let reader = ImageReader::new(Cursor::new(&self.bytes)).with_guessed_format();
            let mut reader = reader.map_err(|e| failed(&e))?;
            let mut limits = image::Limits::default();
            limits.max_alloc = Some(most);
            reader.limits(limits);
            reader.decode().map_err(|e| failed(&e))?.into_rgba8()
        };
        let (width, height) = rgba.dimensions();
        let texels = rgba.as_raw().as_chunks::<4>().0.to_vec();
        let Sampler { wrap_s, wrap_t, linear } = self.sampler;
        let [wrap_s, wrap_t] = [wrap_s, wrap_t].map(|w| WRAPS[usize::from(w)]);
        Ok(Texture { name: self.name, width, height, texels, wrap_s, wrap_t, linear })
    }
}

fn view_bytes(
    document: &Document,
    view: json::Index<json::buffer::View>,
    at: &str,
) -> Result<Vec<u8>, Error> {
    document.view(view, &at).map(|(bytes, _)| bytes.to_vec())
}

/// Refuses, with a warning, images that are broken or larger than the limits, before a texel is decoded.
fn measure(sources: &mut [Source], limits: &Limits, warnings: &mut Warnings) {
    let mut total = 0u64;
    for source in sources {
        let problem = match source.size() {
            Err(e) => e,
            Ok((w, h)) => {
                let pixels = u64::from(w) * u64::from(h);
                if pixels > limits.image_pixels {
                    format!("{w} × {h} pixels are more than the limit of {}", limits.image_pixels)
                } else if total.saturating_add(pixels) > limits.total_pixels {
                    format!("all images together have more pixels than the limit of {}", limits.total_pixels)
                } else {
                    total += pixels;
                    source.pixels = Some(pixels);
                    continue;
                }
            }
        };
        warnings.say(format!("image \"{}\" is left out: {problem}", source.name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TextureRef;

    fn png(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba([x as u8, y as u8, 7, 255]));
        image.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png).expect("memory is writable");
        bytes
    }

    /// One emissive material per texture of `json`.
    fn load_all(json: &str, buffer: Vec<u8>, limits: Limits) -> (Vec<Texture>, Vec<Material>, Vec<String>) {
        let mut document = Document::for_test(json, buffer);
        document.limits = limits;
        let reference =
            |texture| TextureRef { texture, uv_set: 0, transform: crate::math::Affine2::IDENTITY };
        let mut materials: Vec<Material> = (0..document.root.textures.len() as u32)
            .map(|i| Material {
                emissive_texture: Some(reference(i)),
                emissive: Rgb::WHITE,
                ..Material::default()
            })
            .collect();
        let mut warnings = Warnings::default();
        let textures = load(&mut document, &mut materials, &mut warnings).expect("valid");
        (textures, materials, warnings.into_lines())
    }

    fn json(bytes: usize) -> String {
        format!(
            r#""bufferViews":[{{"buffer":0,"byteLength":{bytes}}}],"images":[{{"bufferView":0,"mimeType":"image/png"}},
            {{"uri":"absent.png"}},{{"uri":"../../secret.png"}}],"samplers":[{{"magFilter":9728,"wrapS":33648,"wrapT":33071}}],
            "textures":[{{"source":0}},{{"source":0}},{{"source":0,"sampler":0}},{{"source":1}},{{"source":2}},{{}}]"#
        )
    }

    #[test]
    fn images_are_decoded_once_for_each_sampler_and_missing_ones_warned_of() {
        let bytes = png(3, 2);
        let (textures, materials, warnings) = load_all(&json(bytes.len()), bytes, Limits::default());
        assert_eq!(textures.len(), 2);
        assert_eq!((textures[0].width, textures[0].height, textures[0].texels[4]), (3, 2, [1, 1, 7, 255]));
        assert!(textures[0].linear && !textures[1].linear);
        assert_eq!((textures[1].wrap_s, textures[1].wrap_t), (Wrap::MirroredRepeat, Wrap::ClampToEdge));
        let used: Vec<Option<u32>> =
            materials.iter().map(|m| m.emissive_texture.map(|t| t.texture)).collect();
        assert_eq!(used, [Some(0), Some(0), Some(1), None, None, None]);
        assert!(materials[3].emissive.is_black() && !materials[0].emissive.is_black());
        assert!(
            warnings.iter().any(|w| w.contains("absent.png"))
                && warnings.iter().any(|w| w.contains("leaves"))
        );
    }

    #[test]
    fn limits_are_checked_before_decoding() {
        let bytes = png(30, 20);
        let limits = Limits { image_pixels: 599, ..Limits::default() };
        let (textures, _, warnings) = load_all(&json(bytes.len()), bytes.clone(), limits);
        assert!(textures.is_empty() && warnings.iter().any(|w| w.contains("30 × 20")), "{warnings:?}");
        let limits = Limits { total_pixels: 700, ..Limits::default() };
        assert_eq!(load_all(&json(bytes.len()), bytes, limits).0.len(), 1);
    }

    /// KTX2 by its extension; where there is a PNG too, that; and a file cut short is a warning.
    #[test]
    fn ktx2_is_read_where_there_is_nothing_else() {
        let (ktx2, png) = (include_bytes!("testdata/uastc.ktx2"), png(3, 2));
        let (n, cut) = (ktx2.len(), ktx2.len() - 20);
        let json = format!(
            r#""bufferViews":[{{"buffer":0,"byteLength":{n}}},{{"buffer":0,"byteOffset":{n},"byteLength":{}}},{{"buffer":0,"byteLength":{cut}}}],
            "images":[{{"bufferView":0,"mimeType":"image/ktx2"}},{{"bufferView":1,"mimeType":"image/png"}},{{"bufferView":2,"mimeType":"image/ktx2","name":"cut"}}],
            "textures":[{{"extensions":{{"KHR_texture_basisu":{{"source":0}}}}}},{{"source":1,"extensions":{{"KHR_texture_basisu":{{"source":0}}}}}},
            {{"extensions":{{"KHR_texture_basisu":{{"source":2}}}}}}]"#,
            png.len()
        );
        let (textures, materials, warnings) =
            load_all(&json, [&ktx2[..], &png[..]].concat(), Limits::default());
        let sizes: Vec<(u32, u32)> = textures.iter().map(|t| (t.width, t.height)).collect();
        assert_eq!(sizes, [(16, 8), (3, 2)], "{warnings:?}");
        assert!(
            materials[2].emissive_texture.is_none() && warnings.concat().contains("\"cut\""),
            "{warnings:?}"
        );
    }

    #[test]
    fn broken_images_are_warnings() {
        let mut bytes = png(30, 20);
        let n = bytes.len();
        bytes[n / 2..].fill(0);
        assert!(load_all(&json(n), bytes, Limits::default()).0.is_empty());
        assert!(load_all(&json(4), vec![1; 4], Limits::default()).0.is_empty());
    }
}
