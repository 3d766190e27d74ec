//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views unpacked before anything else looks at them.
//!
//! The bitstreams and filters as the extension's specification gives them, version 0 of attributes and version 1 of
//! triangles, which is what exporters write. No pure Rust library takes a stride that is known at run time only.

use gltf::json::buffer::Stride;
use gltf::json::validation::USize64;
use serde_json::Value;

use super::document::Document;
use super::error::Error;

/// Unpacks every compressed buffer view into a buffer of its own.
pub(super) fn decompress(document: &mut Document) -> Result<(), Error> {
    for i in 0..document.root.buffer_views.len() {
        let others = document.root.buffer_views[i].extensions.as_ref().map(|e| &e.others);
        let names = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
        let found = names.iter().find_map(|name| Some((*name, others?.get(*name)?.clone())));
        let Some((name, value)) = found else { continue };
        let at = format!("bufferViews[{i}].extensions.{name}");
        let (bytes, stride) = unpack(document, &value, &at)?;
        let length = bytes.len() as u64;
        let view = document.add_view(&at, bytes, Some(stride))?;
        let added = document.root.buffer_views[view.value()].clone();
        let view = &mut document.root.buffer_views[i];
        // Indices have no stride of their own.
        let keep = view.byte_stride.map(|_| Stride(stride));
        (view.buffer, view.byte_offset, view.byte_length) = (added.buffer, None, USize64(length));
        (view.byte_stride, view.extensions) = (keep, None);
    }
    Ok(())
}

fn unpack(document: &Document, value: &Value, at: &str) -> Result<(Vec<u8>, usize), Error> {
    let number = |key: &str| value.get(key).and_then(Value::as_u64);
    let needed = |key: &str| {
        number(key).ok_or_else(|| document.fault(format!("{at}.{key}"), "nothing", "must be a whole number"))
    };
    let (buffer, length) = (needed("buffer")?, needed("byteLength")?);
    let (stride, count) = (needed("byteStride")?, needed("count")?);
    let (mode, filter) = (
        value.get("mode").and_then(Value::as_str).unwrap_or_default(),
        value.get("filter").and_then(Value::as_str).unwrap_or("NONE"),
    );
    let source = document.range(buffer, number("byteOffset").unwrap_or(0), length, at)?;
    let size = count.saturating_mul(stride);
    document.within(at, "bytes to unpack", size, document.limits.bytes)?;
    // Nothing packs more than a hundredfold, so that a claim of gigabytes needs megabytes.
    if size > 128 * length + 4096 {
        return Err(document.fault(format!("{at}.count"), count, "more than so few bytes can hold"));
    }
    let (stride, count) = (stride as usize, count as usize);
    let fits = match mode {
        "ATTRIBUTES" => stride > 0 && stride % 4 == 0 && stride <= 256,
        "TRIANGLES" => (stride == 2 || stride == 4) && count % 3 == 0,
        "INDICES" => stride == 2 || stride == 4,
        _ => return Err(document.fault(format!("{at}.mode"), mode, "no mode of the extension")),
    };
    if !fits {
        return Err(document.fault(format!("{at}.byteStride"), stride, format!("does not suit {mode}")));
    }
    let unpacked = match mode {
        "ATTRIBUTES" => attributes(source, count, stride),
        "TRIANGLES" => triangles(source, count).map(|indices| narrow(&indices, stride)),
        _ => sequence(source, count).map(|indices| narrow(&indices, stride)),
    };
    let Some(mut bytes) = unpacked else {
        let value = format!("{length} bytes");
        return Err(document.fault(format!("{at}.byteLength"), value, format!("not a stream of {mode}")));
    };
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => bytes.as_chunks_mut::<4>().0.iter_mut().for_each(octahedral8),
        ("OCTAHEDRAL", 8) => bytes.as_chunks_mut::<8>().0.iter_mut().for_each(octahedral16),
        ("QUATERNION", 8) => bytes.as_chunks_mut::<8>().0.iter_mut().for_each(quaternion),
        ("EXPONENTIAL", _) => bytes.as_chunks_mut::<4>().0.iter_mut().for_each(exponential),
        _ => return Err(document.fault(format!("{at}.filter"), filter, "does not suit the stride")),
    }
    Ok((bytes, stride))
}

fn narrow(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|i| i.to_le_bytes().into_iter().take(stride)).collect()
}

/// Bytes in order, none beyond the end.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(head)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|b| b[0])
    }

    /// Seven bits a byte, the lowest first.
    fn number(&mut self) -> Option<u32> {
        let mut value = 0u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << shift;
            if byte < 128 {
                break;
            }
        }
        Some(value)
    }

    /// A difference to `last`, its sign in the lowest bit.
    fn index(&mut self, last: u32) -> Option<u32> {
        let v = self.number()?;
        Some(last.wrapping_add((v >> 1) ^ (v & 1).wrapping_neg()))
    }
}

/// Mode 0: blocks of elements, byte by byte of the stride, as differences to the element before.
fn attributes(source: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let mut r = Reader(source);
    if r.byte()? != 0xa0 {
        return None;
    }
    // The element before the first lies at the very end, in a tail of 32 bytes at least.
    let tail = stride.max(32);
    let mut last = source.get(source.len().checked_sub(stride)?..)?.to_vec();
    let data = r.0.len().checked_sub(tail)?;
    r.0 = &r.0[..data];
    let block = ((8192 / stride) & !15).min(256);
    let mut out = Vec::new();
    let mut lane = [0u8; 256];
    while out.len() < count * stride {
        let first = out.len();
        let n = block.min(count - first / stride);
        out.resize(first + n * stride, 0);
        for k in 0..stride {
            bytes(&mut r, &mut lane[..n.next_multiple_of(16)])?;
            let mut value = last[k];
            for (i, d) in lane[..n].iter().enumerate() {
                value = value.wrapping_add((d >> 1) ^ (d & 1).wrapping_neg());
                out[first + i * stride + k] = value;
            }
            last[k] = value;
        }
    }
    Some(out)
}

/// Groups of 16 bytes: none, two or four bits each with escapes, or whole; two bits of a header tell which.
fn bytes(r: &mut Reader, out: &mut [u8]) -> Option<()> {
    let groups = out.len() / 16;
    let header = r.take(groups.div_ceil(4))?;
    for (g, group) in out.chunks_exact_mut(16).enumerate() {
        let bits = match header[g / 4] >> (g % 4 * 2) & 3 {
            0 => {
                group.fill(0);
                continue;
            }
            1 => 2,
            2 => 4,
            _ => {
                group.copy_from_slice(r.take(16)?);
                continue;
            }
        };
        let packed = r.take(2 * bits)?;
        let escape = (1u8 << bits) - 1;
        for (i, slot) in group.iter_mut().enumerate() {
            let bit = i * bits;
            let v = packed[bit / 8] >> (8 - bits - bit % 8) & escape;
            *slot = if v == escape { r.byte()? } else { v };
        }
    }
    Some(())
}

/// The last 16 things seen.
struct Fifo<T> {
    seen: [T; 16],
    next: usize,
}

impl<T: Copy> Fifo<T> {
    fn push(&mut self, v: T) {
        self.seen[self.next & 15] = v;
        self.next += 1;
    }

    /// The `back`-th last, from 1 on.
    fn get(&self, back: usize) -> T {
        self.seen[self.next.wrapping_sub(back) & 15]
    }
}

/// Mode 1: a code for each triangle, by which edge and which vertex of the recent ones it shares.
fn triangles(source: &[u8], count: usize) -> Option<Vec<u32>> {
    let version = match source.first()? {
        0xe0 => 0,
        0xe1 => 1,
        _ => return None,
    };
    let codes = source.get(1..1 + count / 3)?;
    let table = source.get(source.len().checked_sub(16)?..)?;
    let mut r = Reader(source.get(1 + count / 3..source.len() - 16)?);
    let mut edges = Fifo { seen: [(0u32, 0u32); 16], next: 0 };
    let mut vertices = Fifo { seen: [0u32; 16], next: 0 };
    let (mut next, mut last) = (0u32, 0u32);
    let mut fresh = |next: &mut u32| {
        *next = next.wrapping_add(1);
        next.wrapping_sub(1)
    };
    // Codes of the vertex that stand for the one after or before the last index: version 1 only.
    let most = if version == 1 { 13 } else { 15 };
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        if code < 0xf0 {
            let (a, b) = edges.get(usize::from(code >> 4) + 1);
            let how = code & 15;
            let c = if how < most {
                if how == 0 { fresh(&mut next) } else { vertices.get(usize::from(how) + 1) }
            } else {
                last = match how {
                    13 => last.wrapping_sub(1),
                    14 => last.wrapping_add(1),
                    _ => r.index(last)?,
                };
                last
            };
            if how == 0 || how >= most {
                vertices.push(c);
            }
            edges.push((c, b));
            edges.push((a, c));
            out.extend([a, b, c]);
            continue;
        }
        // A triangle that shares no edge: which of its corners are new, recent, or spelled out.
        let (first, aux) = match code {
            0xfe => (0, r.byte()?),
            0xff => (15, r.byte()?),
            _ => (0, table[usize::from(code & 15)]),
        };
        if code >= 0xfe && aux == 0 {
            next = 0;
        }
        let (second, third) = (aux >> 4, aux & 15);
        let spelled = code >= 0xfe;
        let known = |how: u8, next: &mut u32, fresh: &mut dyn FnMut(&mut u32) -> u32| {
            if how == 0 { fresh(next) } else { vertices.get(usize::from(how)) }
        };
        let mut a = if first == 0 { fresh(&mut next) } else { 0 };
        let mut b = known(second, &mut next, &mut fresh);
        let mut c = known(third, &mut next, &mut fresh);
        for (v, how) in [(&mut a, first), (&mut b, second), (&mut c, third)] {
            if spelled && how == 15 {
                last = r.index(last)?;
                *v = last;
            }
        }
        vertices.push(a);
        if second == 0 || (spelled && second == 15) {
            vertices.push(b);
        }
        if third == 0 || (spelled && third == 15) {
            vertices.push(c);
        }
        edges.push((b, a));
        edges.push((c, b));
        edges.push((a, c));
        out.extend([a, b, c]);
    }
    Some(out)
}

/// Mode 2: differences to one of two running indices.
fn sequence(source: &[u8], count: usize) -> Option<Vec<u32>> {
    if source.first()? & 0xf0 != 0xd0 {
        return None;
    }
    let mut r = Reader(source.get(1..source.len().checked_sub(4)?)?);
    let mut last = [0u32; 2];
    (0..count)
        .map(|_| {
            let v = r.number()?;
            let (which, v) = ((v & 1) as usize, v >> 1);
            last[which] = last[which].wrapping_add((v >> 1) ^ (v & 1).wrapping_neg());
            Some(last[which])
        })
        .collect()
}

/// A unit vector from two components on an octahedron, the third holding what stands for 1.
fn octahedron(x: f32, y: f32, one: f32) -> [f32; 3] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| if length > 0.0 { v / length } else { 0.0 })
}

fn octahedral8(v: &mut [u8; 4]) {
    let of = |b: u8| f32::from(b as i8);
    let n = octahedron(of(v[0]), of(v[1]), of(v[2]));
    (0..3).for_each(|i| v[i] = (n[i] * 127.0).round() as i8 as u8);
}

fn halves(v: &[u8; 8]) -> [i16; 4] {
    [0, 2, 4, 6].map(|i| i16::from_le_bytes([v[i], v[i + 1]]))
}

fn octahedral16(v: &mut [u8; 8]) {
    let [x, y, one, _] = halves(v).map(f32::from);
    for (i, n) in octahedron(x, y, one).into_iter().enumerate() {
        v[2 * i..2 * i + 2].copy_from_slice(&((n * 32767.0).round() as i16).to_le_bytes());
    }
}

fn quaternion(v: &mut [u8; 8]) {
    let [x, y, z, w] = halves(v);
    // The two lowest bits of the last number tell which component is left out, the rest what stands for 1/√2.
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(w | 3);
    let three = [x, y, z].map(|c| f32::from(c) * scale);
    let left = (1.0 - three.iter().map(|c| c * c).sum::<f32>()).max(0.0).sqrt();
    let all = [three[0], three[1], three[2], left];
    for (k, c) in all.into_iter().enumerate() {
        let i = ((w & 3) as usize + k + 1) & 3;
        v[2 * i..2 * i + 2].copy_from_slice(&((c * 32767.0).round() as i16).to_le_bytes());
    }
}

/// A signed exponent in the highest byte, a signed mantissa in the three below.
fn exponential(v: &mut [u8; 4]) {
    let bits = i32::from_le_bytes(*v);
    let (exponent, mantissa) = (bits >> 24, bits << 8 >> 8);
    // Beyond what a float holds, infinity: the triangle is dropped later.
    *v = ((f64::from(mantissa) * 2f64.powi(exponent)) as f32).to_le_bytes();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_the_specification_unpack() {
        // A quad: (0, 1, 2), (2, 1, 3), as meshoptimizer's own test has it.
        let packed = [
            0xe0, 0xf0, 0x10, 0xfe, 0xff, 0xf0, 0x0c, 0xff, 0x02, 0x02, 0x02, 0x00, 0x76, 0x87, 0x56, 0x67,
            0x78, 0xa9, 0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0x00, 0x00,
        ];
        assert_eq!(triangles(&packed, 12).expect("a stream"), [0, 1, 2, 2, 1, 3, 4, 6, 5, 7, 8, 9]);
        let packed = [0xd1, 0x00, 0x04, 0xcd, 0x01, 0x04, 0x07, 0x98, 0x1f, 0x00, 0x00, 0x00, 0x00];
        assert_eq!(sequence(&packed, 6).expect("a stream"), [0, 1, 51, 2, 49, 1000]);
    }

    #[test]
    fn attributes_are_differences_of_bytes() {
        // One block of two elements of four bytes; lanes: 2 bits with an escape, none, whole, none.
        let mut packed = vec![0xa0];
        packed.extend([1, 0b1011_0000, 0, 0, 0, 200]);
        packed.push(0);
        packed.push(3);
        packed.extend([2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        packed.push(0);
        packed.extend([0; 28]);
        packed.extend([10, 20, 30, 40]);
        // 2 is +1, 1 is −1, 3 is the escape: 200 is +100.
        let out = attributes(&packed, 2, 4).expect("a stream");
        assert_eq!(out, [11, 20, 31, 40, 111, 20, 30, 40]);
        for cut in 0..packed.len() {
            let _ = attributes(&packed[..cut], 2, 4);
        }
    }

    #[test]
    fn filters_give_back_vectors() {
        let mut v = [0, 0, 127, 5];
        octahedral8(&mut v);
        assert_eq!(v, [0, 0, 127, 5]);
        let mut v = 0x0300_0005u32.to_le_bytes();
        exponential(&mut v);
        assert_eq!(f32::from_le_bytes(v), 40.0);
        let mut q = [0u8; 8];
        q[6..].copy_from_slice(&((32767i16 & !3) | 1).to_le_bytes());
        quaternion(&mut q);
        assert_eq!(halves(&q), [0, 32767, 0, 0]);
    }
}
