//! Numbers as bytes, little-endian, and back: what files are made of.

use crate::doubt::Doubt;
use crate::element::{Node, Side, Vertex};
use crate::field::Source;
use geometry::{Rgb, Vec3};

/// Something of a fixed number of bytes.
pub(crate) trait Plain: Sized {
    /// How many.
    const SIZE: usize;
    /// Appends them.
    fn put(&self, out: &mut Vec<u8>);
    /// Reads them from the front of `bytes`, of which there are enough.
    fn get(bytes: &[u8]) -> Self;
}

macro_rules! number {
    ($($t:ty),*) => {$(
        impl Plain for $t {
            const SIZE: usize = size_of::<$t>();
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn get(bytes: &[u8]) -> $t {
                <$t>::from_le_bytes(std::array::from_fn(|i| bytes[i]))
            }
        }
    )*};
}
number!(u8, u16, u32, u64, f32);

impl<T: Plain, const N: usize> Plain for [T; N] {
    const SIZE: usize = N * T::SIZE;
    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|x| x.put(out));
    }
    fn get(bytes: &[u8]) -> [T; N] {
        std::array::from_fn(|i| T::get(&bytes[i * T::SIZE..]))
    }
}

/// Members one after the other.
macro_rules! record {
    ($name:ty { $($field:ident: $t:ty),* } => $build:expr) => {
        impl Plain for $name {
            const SIZE: usize = 0 $(+ <$t as Plain>::SIZE)*;
            fn put(&self, out: &mut Vec<u8>) {
                $(Plain::put(&self.$field, out);)*
            }
            #[allow(unused_assignments)]
            fn get(mut bytes: &[u8]) -> $name {
                $(let $field = <$t as Plain>::get(bytes); bytes = &bytes[<$t as Plain>::SIZE..];)*
                $build
            }
        }
    };
}
pub(crate) use record;

record!(Rgb { r: f32, g: f32, b: f32 } => Rgb { r, g, b });
record!(Doubt { mesh: f32, ray: f32 } => Doubt { mesh, ray });
record!(Vec3 { x: f32, y: f32, z: f32 } => Vec3 { x, y, z });
record!(Vertex { position: Vec3, normal: Vec3, piece: u32, face: u32 } => Vertex { position, normal, piece, face });
record!(Node { vertices: [u32; 3], child: u32, edge: u8 } => Node { vertices, child, edge });

impl Plain for Side {
    const SIZE: usize = 1;
    fn put(&self, out: &mut Vec<u8>) {
        out.push(self.index() as u8);
    }
    fn get(bytes: &[u8]) -> Side {
        Side::BOTH[usize::from(bytes[0] != 0)]
    }
}

/// Appends the number of the elements, then all of them.
pub(crate) fn put_all<T: Plain>(all: &[T], out: &mut Vec<u8>) {
    (all.len() as u64).put(out);
    out.reserve(all.len() * T::SIZE);
    all.iter().for_each(|x| x.put(out));
}

/// Bytes being read; `None` when there are fewer than asked for.
pub(crate) struct Reader<'a>(pub &'a [u8]);

impl<'a> Reader<'a> {
    /// The next `n` bytes.
    pub(crate) fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(head)
    }

    /// The next number or record.
    pub(crate) fn one<T: Plain>(&mut self) -> Option<T> {
        self.take(T::SIZE).map(T::get)
    }

    /// What [`put_all`] wrote. A count of more than there are bytes for is refused before memory is asked for.
    pub(crate) fn all<T: Plain>(&mut self) -> Option<Vec<T>> {
        let n = usize::try_from(self.one::<u64>()?).ok()?;
        let bytes = self.take(n.checked_mul(T::SIZE)?)?;
        Some(bytes.chunks_exact(T::SIZE).map(T::get).collect())
    }

    /// Whether all were read.
    pub(crate) fn is_at_end(&self) -> bool {
        self.0.is_empty()
    }
}

/// Appends where slots' values come from: most come from one site, or from few.
pub(crate) fn put_sources(all: &[Source], out: &mut Vec<u8>) {
    (all.len() as u64).put(out);
    for source in all {
        match source {
            Source::Nothing => out.push(0),
            Source::Site(i) => {
                out.push(1);
                i.put(out);
            }
            Source::Between(a, b) => {
                out.push(2);
                [*a, *b].put(out);
            }
            Source::Near(sites, weights) => {
                let used = (0..4).filter(|&k| weights[k] > 0.0);
                out.push(2 + used.clone().count().max(1) as u8);
                for k in used {
                    sites[k].put(out);
                    weights[k].put(out);
                }
            }
        }
    }
}

/// What [`put_sources`] wrote.
pub(crate) fn get_sources(from: &mut Reader) -> Option<Vec<Source>> {
    let n = usize::try_from(from.one::<u64>()?).ok()?;
    let mut all = Vec::with_capacity(n.min(from.0.len()));
    for _ in 0..n {
        all.push(match from.one::<u8>()? {
            0 => Source::Nothing,
            1 => Source::Site(from.one()?),
            2 => {
                let [a, b] = from.one()?;
                Source::Between(a, b)
            }
            used @ 3..=6 => {
                let (mut sites, mut weights) = ([0; 4], [0.0; 4]);
                for k in 0..usize::from(used - 2) {
                    (sites[k], weights[k]) = (from.one()?, from.one()?);
                }
                Source::Near(sites, weights)
            }
            _ => return None,
        });
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_put_is_read_again() {
        let nodes = [Node { vertices: [1, 2, 3], child: 7, edge: 2 }; 3];
        let sources = [
            Source::Nothing,
            Source::Site(9),
            Source::Near([4, 5, 0, 0], [0.25, 0.75, 0.0, 0.0]),
            Source::Between(1, 2),
        ];
        let mut bytes = Vec::new();
        put_all(&nodes, &mut bytes);
        put_sources(&sources, &mut bytes);
        put_all(&[Rgb::new(1.0, f32::MIN_POSITIVE, -0.0)], &mut bytes);
        let mut reader = Reader(&bytes);
        let read: Vec<Node> = reader.all().expect("whole");
        assert_eq!(
            read.iter().map(|n| (n.vertices, n.child, n.edge)).collect::<Vec<_>>(),
            [([1, 2, 3], 7, 2); 3]
        );
        assert_eq!(get_sources(&mut reader).expect("whole"), sources);
        assert_eq!(reader.all::<Rgb>().expect("whole"), [Rgb::new(1.0, f32::MIN_POSITIVE, -0.0)]);
        assert!(reader.is_at_end());
        // No shortened file is read past its end, and no count in it is believed.
        for n in 0..bytes.len() {
            let mut reader = Reader(&bytes[..n]);
            let whole = reader.all::<Node>().is_some()
                && get_sources(&mut reader).is_some()
                && reader.all::<Rgb>().is_some();
            assert!(!whole, "{n} bytes");
        }
        assert!(Reader(&[0xff; 16]).all::<u32>().is_none());
    }
}
