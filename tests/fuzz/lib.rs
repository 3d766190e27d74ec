//! What the targets share: bytes to a file, and the file to the loader.

use geometry::gltf::{Error, load};

/// Loads `bytes` as a file of this extension. A panic that the loader caught is one all the same.
pub fn check(bytes: &[u8], extension: &str) {
    let folder = std::env::temp_dir();
    let file = folder.join(format!("twolight-fuzz-{}.{extension}", std::process::id()));
    if std::fs::write(&file, bytes).is_err() {
        return;
    }
    if let Err(Error::Defect { problem, .. }) = load(&file) {
        panic!("{problem}");
    }
}

/// A GLB of two chunks: `parts` up to its first zero byte is the JSON, the rest the binary one. So a fuzzer need not learn
/// to count lengths.
pub fn glb(parts: &[u8]) -> Vec<u8> {
    let split = parts.iter().position(|&b| b == 0);
    let (json, bin) = split.map_or((parts, &[][..]), |at| (&parts[..at], &parts[at + 1..]));
    let padded = |chunk: &[u8], with: u8| {
        let mut chunk = chunk.to_vec();
        chunk.resize(chunk.len().next_multiple_of(4), with);
        chunk
    };
    let (json, bin) = (padded(json, b' '), padded(bin, 0));
    let word = |n: usize| (n as u32).to_le_bytes();
    [
        b"glTF",
        &word(2)[..],
        &word(28 + json.len() + bin.len()),
        &word(json.len()),
        b"JSON",
        &json,
        &word(bin.len()),
        b"BIN\0",
        &bin,
    ]
    .concat()
}
