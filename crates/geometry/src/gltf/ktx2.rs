//! KTX2 images in Basis Universal's codecs, ETC1S and UASTC, as KHR_texture_basisu prescribes for textures.

use std::panic::{AssertUnwindSafe, catch_unwind};

use basisu::{DecodeFlags, TargetFormat, Transcoder};

const MAGIC: [u8; 12] = [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n'];

/// Whether `bytes` begin as a KTX2 file.
pub(super) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Columns and rows of the largest level, from the header.
pub(super) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    match (word(20), word(24)) {
        (Some(width), Some(height)) if width > 0 && height > 0 => Ok((width, height)),
        (Some(width), Some(height)) => Err(format!("a KTX2 image of {width} × {height}")),
        _ => Err("a KTX2 file that ends in its header".into()),
    }
}

/// RGBA of the largest level, row by row from the top; of its unpacked data no more than `most` bytes.
pub(super) fn decode(bytes: &[u8], most: u64) -> Result<Vec<u8>, String> {
    // KTX2 2.0, 3.9: the level index follows the header of 80 bytes.
    let unpacked = bytes.get(96..104).map_or(0, |b| u64::from_le_bytes(std::array::from_fn(|i| b[i])));
    if unpacked > most {
        return Err(format!("a KTX2 level of {unpacked} bytes"));
    }
    // The decoder is young: what it cannot take shall cost one image.
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        Transcoder::new(bytes)?.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
    }));
    match decoded {
        Ok(Ok(rgba)) => Ok(rgba),
        Ok(Err(e)) => Err(format!("a KTX2 file that is not sound, or not of Basis Universal ({e:?})")),
        Err(_) => Err("a KTX2 file that the decoder fails on".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    /// Both made by testdata/make-ktx2.mjs.
    const FILES: [&[u8]; 2] = [include_bytes!("testdata/etc1s.ktx2"), include_bytes!("testdata/uastc.ktx2")];

    #[test]
    fn both_codecs_give_the_picture() {
        for bytes in FILES {
            assert!(is_ktx2(bytes));
            assert_eq!(size(bytes), Ok((16, 8)));
            let rgba = decode(bytes, 1 << 20).expect("sound");
            assert_eq!(rgba.len(), 4 * 16 * 8);
            for (x, y, colour) in
                [(3, 4, [200, 30, 20, 255]), (12, 1, [20, 180, 40, 128]), (12, 6, [30, 60, 220, 128])]
            {
                let texel = &rgba[4 * (y * 16 + x)..][..4];
                let off = texel.iter().zip(colour).map(|(&a, b): (&u8, u8)| a.abs_diff(b)).max();
                assert!(off <= Some(16), "({x}, {y}): {texel:?} for {colour:?}");
            }
        }
    }

    #[test]
    fn spoiled_files_are_refused_or_decoded() {
        let mut rng = Rng::new(5, 0);
        for bytes in FILES {
            for cut in 0..bytes.len() {
                assert!(size(&bytes[..cut]).is_ok() || cut < 28);
                let _ = decode(&bytes[..cut], 1 << 20);
            }
            for _ in 0..2000 {
                let mut spoiled = bytes.to_vec();
                for _ in 0..1 + (rng.f32() * 3.0) as usize {
                    let at = 28 + (rng.f32() * (bytes.len() - 28) as f32) as usize;
                    spoiled[at] = (rng.f32() * 256.0) as u8;
                }
                if let Ok(rgba) = decode(&spoiled, 1 << 20) {
                    assert_eq!(rgba.len(), 512);
                }
            }
        }
        assert!(decode(FILES[1], 1).is_err_and(|e| e.contains("bytes")), "more than there may be");
    }
}
