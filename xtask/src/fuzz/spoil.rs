//! Ways to spoil a file.

use super::pick;
use geometry::sampling::Rng;

/// A sound file, its parts apart.
pub enum Seed {
    /// JSON.
    Gltf(Vec<u8>),
    /// A GLB's two chunks.
    Glb {
        /// The first.
        json: Vec<u8>,
        /// The second.
        bin: Vec<u8>,
    },
}

impl Seed {
    /// Takes a file apart; one that is no GLB is JSON.
    pub fn read(bytes: &[u8]) -> Seed {
        let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
        if bytes.starts_with(b"glTF")
            && let Some(json) = word(12).and_then(|n| bytes.get(20..20 + n))
        {
            let bin = bytes.get(28 + json.len()..).unwrap_or_default();
            return Seed::Glb { json: json.to_vec(), bin: bin.to_vec() };
        }
        Seed::Gltf(bytes.to_vec())
    }

    /// Whether it is a GLB.
    pub fn is_glb(&self) -> bool {
        matches!(self, Seed::Glb { .. })
    }

    fn json(&self) -> &[u8] {
        match self {
            Seed::Gltf(json) | Seed::Glb { json, .. } => json,
        }
    }
}

/// Values at and beyond the ends of what fields hold.
const NUMBERS: [&str; 22] = [
    "0",
    "1",
    "2",
    "-1",
    "255",
    "256",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551615",
    "1e39",
    "-1e39",
    "1e-40",
    "0.5",
    "-0.0",
    "null",
    "[]",
    "\"x\"",
];

/// `seed` spoiled in one to four ways, `other` lending it parts.
pub fn spoil(seed: &Seed, other: &Seed, rng: &mut Rng) -> Vec<u8> {
    let mut json = seed.json().to_vec();
    let mut bin = if let Seed::Glb { bin, .. } = seed { bin.clone() } else { Vec::new() };
    // Broken JSON is refused at once: seven of eight files keep theirs well-formed.
    let whole = pick(rng, 8) > 0;
    for _ in 0..1 + pick(rng, 3) {
        match pick(rng, 10) {
            0 | 1 if !bin.is_empty() => flip(&mut bin, rng),
            2 if !bin.is_empty() => cut(&mut bin, rng),
            3 if !whole => flip(&mut json, rng),
            4 if !whole => cut(&mut json, rng),
            5 if !whole => splice(&mut json, other.json(), rng),
            6 if !whole => repeat(&mut json, rng),
            _ => number(&mut json, rng),
        }
    }
    if !seed.is_glb() {
        return json;
    }
    let mut out = pack(&json, &bin);
    if pick(rng, 8) == 0 {
        flip(&mut out, rng);
    }
    out
}

fn pack(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

fn flip(bytes: &mut [u8], rng: &mut Rng) {
    for _ in 0..1 + pick(rng, 6) {
        if !bytes.is_empty() {
            let at = pick(rng, bytes.len());
            bytes[at] = match pick(rng, 3) {
                0 => [0, 1, 0x7f, 0x80, 0xff][pick(rng, 5)],
                1 => bytes[at] ^ (1 << pick(rng, 8)),
                _ => pick(rng, 256) as u8,
            };
        }
    }
}

/// A short run of `bytes`.
fn run(bytes: &[u8], rng: &mut Rng) -> std::ops::Range<usize> {
    let from = pick(rng, bytes.len());
    from..(from + 1 + pick(rng, 60)).min(bytes.len())
}

fn cut(bytes: &mut Vec<u8>, rng: &mut Rng) {
    if !bytes.is_empty() {
        let run = run(bytes, rng);
        bytes.drain(run);
    }
}

fn repeat(bytes: &mut Vec<u8>, rng: &mut Rng) {
    if !bytes.is_empty() {
        let piece = bytes[run(bytes, rng)].to_vec();
        let at = pick(rng, bytes.len());
        bytes.splice(at..at, piece);
    }
}

/// Puts a piece of `other` in place of one that begins with the same quoted word, or anywhere.
fn splice(bytes: &mut Vec<u8>, other: &[u8], rng: &mut Rng) {
    if !bytes.is_empty() && !other.is_empty() {
        let piece = other[run(other, rng)].to_vec();
        let to = run(bytes, rng);
        bytes.splice(to, piece);
    }
}

/// Puts an extreme value in place of some number.
fn number(json: &mut Vec<u8>, rng: &mut Rng) {
    let digit = |b: u8| b.is_ascii_digit() || b == b'-' || b == b'.';
    let starts: Vec<usize> = (1..json.len())
        .filter(|&i| digit(json[i]) && matches!(json[i - 1], b':' | b',' | b'[' | b' '))
        .collect();
    let Some(&from) = starts.get(pick(rng, starts.len())) else { return };
    let to = (from..json.len()).find(|&i| !digit(json[i])).unwrap_or(json.len());
    let value = NUMBERS[pick(rng, NUMBERS.len())];
    json.splice(from..to, value.bytes());
}
