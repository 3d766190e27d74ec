//! Accessors: typed arrays in buffers, checked when opened so that reading an element cannot fail.

use std::fmt::Display;

use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use super::document::Document;
use super::error::Error;

/// An accessor whose every element is known to lie inside its buffer.
pub(super) struct Accessor<'a> {
    /// From the first element on; none means zeros (glTF 2.0, 3.6.2.1).
    data: Option<&'a [u8]>,
    stride: usize,
    count: usize,
    format: Format,
    sparse: Option<Sparse<'a>>,
}

/// Elements that replace those of `data`.
struct Sparse<'a> {
    /// Strictly increasing.
    indices: Vec<u32>,
    values: &'a [u8],
}

/// How the bytes of one element are read.
#[derive(Clone, Copy)]
struct Format {
    component: ComponentType,
    width: usize,
    normalized: bool,
}

impl<'a> Accessor<'a> {
    /// Opens accessor `index` for `user`, a path like `meshes[3].primitives[0].attributes.POSITION`,
    /// who can read only `types` of `components`.
    pub fn open(
        document: &'a Document,
        index: json::Index<json::Accessor>,
        user: &dyn Display,
        types: &[Type],
        components: &[ComponentType],
    ) -> Result<Self, Error> {
        let i = index.value();
        let accessor = document
            .root
            .accessors
            .get(i)
            .ok_or_else(|| document.fault(user, i, "there is no accessor of this number"))?;
        let at = format!("{user} → accessors[{i}]");
        let width = match accessor.type_ {
            Checked::Valid(t) if types.contains(&t) => t.multiplicity(),
            Checked::Valid(t) => {
                return Err(document.fault(format_args!("{at}.type"), name(t), "not a type allowed here"));
            }
            Checked::Invalid => {
                return Err(document.fault(format_args!("{at}.type"), "?", "no type of glTF's"));
            }
        };
        let component = match accessor.component_type {
            Checked::Valid(c) if components.contains(&c.0) => c.0,
            Checked::Valid(c) => {
                let code = c.0.as_gl_enum();
                return Err(document.fault(format_args!("{at}.componentType"), code, "not allowed here"));
            }
            Checked::Invalid => {
                return Err(document.fault(
                    format_args!("{at}.componentType"),
                    "?",
                    "no component type of glTF's",
                ));
            }
        };
        let format = Format { component, width, normalized: accessor.normalized };
        let count = usize::try_from(accessor.count.0)
            .map_err(|_| document.fault(format_args!("{at}.count"), accessor.count.0, "too many"))?;
        let (data, stride) = match accessor.buffer_view {
            None => (None, 0),
            Some(view) => {
                let (bytes, stride) = document.view(view, &at)?;
                let stride = stride.unwrap_or(format.size());
                if stride < format.size() {
                    let view = view.value();
                    let problem = format!("less than the {} bytes of one element ({at})", format.size());
                    return Err(document.fault(
                        format_args!("bufferViews[{view}].byteStride"),
                        stride,
                        problem,
                    ));
                }
                let offset = accessor.byte_offset.unwrap_or_default().0;
                let data = slice(bytes, offset, count, stride, format.size()).ok_or_else(|| {
                    let value = format!("{offset} + {count} × {stride} bytes");
                    let problem = format!("ends beyond its buffer view of {} bytes", bytes.len());
                    document.fault(format_args!("{at}.count"), value, problem)
                })?;
                (Some(data), stride)
            }
        };
        let sparse =
            accessor.sparse.as_ref().map(|s| Sparse::open(document, s, &at, count, format)).transpose()?;
        Ok(Accessor { data, stride, count, format, sparse })
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Element `i` < `len()` as floats: integers as they are, or to [0, 1] and [−1, 1] when normalized.
    /// Components that the accessor lacks are 1, so that a colour without alpha is opaque.
    pub fn get<const N: usize>(&self, i: usize) -> [f32; N] {
        let Some(bytes) = self.bytes(i) else { return [0.0; N] };
        let size = self.format.component.size();
        std::array::from_fn(
            |k| {
                if k < self.format.width { self.format.float(&bytes[k * size..]) } else { 1.0 }
            },
        )
    }

    /// Element `i` < `len()` of an accessor of unsigned scalars.
    pub fn index(&self, i: usize) -> u32 {
        self.bytes(i).map_or(0, |bytes| self.format.unsigned(bytes))
    }

    fn bytes(&self, i: usize) -> Option<&'a [u8]> {
        assert!(i < self.count, "callers stay below len()");
        if let Some(sparse) = &self.sparse
            && let Some(k) = u32::try_from(i).ok().and_then(|i| sparse.indices.binary_search(&i).ok())
        {
            return Some(&sparse.values[k * self.format.size()..]);
        }
        self.data.map(|data| &data[i * self.stride..])
    }
}

impl<'a> Sparse<'a> {
    fn open(
        document: &'a Document,
        sparse: &json::accessor::sparse::Sparse,
        at: &str,
        count: usize,
        format: Format,
    ) -> Result<Self, Error> {
        let at = format!("{at}.sparse");
        let n = match usize::try_from(sparse.count.0) {
            Ok(n) if n <= count => n,
            _ => {
                return Err(document.fault(
                    format_args!("{at}.count"),
                    sparse.count.0,
                    "more than the elements",
                ));
            }
        };
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(document.fault(format_args!("{at}.indices.componentType"), "?", "must be unsigned"));
        };
        let index = Format { component: component.0, width: 1, normalized: false };
        let run = |view, offset: u64, format: Format, what: &str| {
            let (bytes, _) = document.view(view, &format_args!("{at}.{what}"))?;
            slice(bytes, offset, n, format.size(), format.size()).ok_or_else(|| {
                let problem = format!("{n} elements end beyond the buffer view of {} bytes", bytes.len());
                document.fault(format_args!("{at}.{what}.byteOffset"), offset, problem)
            })
        };
        let raw = run(sparse.indices.buffer_view, sparse.indices.byte_offset.0, index, "indices")?;
        let values = run(sparse.values.buffer_view, sparse.values.byte_offset.0, format, "values")?;
        let indices: Vec<u32> = (0..n).map(|i| index.unsigned(&raw[i * index.size()..])).collect();
        for (k, &i) in indices.iter().enumerate() {
            if i as usize >= count || (k > 0 && indices[k - 1] >= i) {
                let problem = format!("indices must increase and stay below {count}");
                return Err(document.fault(format_args!("{at}.indices[{k}]"), i, problem));
            }
        }
        Ok(Sparse { indices, values })
    }
}

impl Format {
    /// Bytes of one element. Of matrices, which may have padding, only those of floats are read, which have none.
    fn size(self) -> usize {
        self.width * self.component.size()
    }

    /// The first component in `b` (glTF 2.0, 3.6.2.2).
    fn float(self, b: &[u8]) -> f32 {
        let (value, scale) = match self.component {
            ComponentType::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            ComponentType::I8 => (f32::from(b[0] as i8), 127.0),
            ComponentType::U8 => (f32::from(b[0]), 255.0),
            ComponentType::I16 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            ComponentType::U16 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            ComponentType::U32 => (self.unsigned(b) as f32, u32::MAX as f32),
        };
        if self.normalized { (value / scale).max(-1.0) } else { value }
    }

    fn unsigned(self, b: &[u8]) -> u32 {
        match self.component {
            ComponentType::U8 => u32::from(b[0]),
            ComponentType::U16 => u32::from(u16::from_le_bytes([b[0], b[1]])),
            ComponentType::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            // Signed and float indices are refused when the accessor is opened.
            ComponentType::I8 | ComponentType::I16 | ComponentType::F32 => 0,
        }
    }
}

/// The part of `bytes` from `offset` on, if `count` elements fit in it.
fn slice(bytes: &[u8], offset: u64, count: usize, stride: usize, size: usize) -> Option<&[u8]> {
    let data = bytes.get(usize::try_from(offset).ok()?..)?;
    let needed = match count.checked_sub(1) {
        None => 0,
        Some(last) => last.checked_mul(stride)?.checked_add(size)?,
    };
    (needed <= data.len()).then_some(data)
}

fn name(t: Type) -> &'static str {
    match t {
        Type::Scalar => "SCALAR",
        Type::Vec2 => "VEC2",
        Type::Vec3 => "VEC3",
        Type::Vec4 => "VEC4",
        Type::Mat2 => "MAT2",
        Type::Mat3 => "MAT3",
        Type::Mat4 => "MAT4",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ANY: [ComponentType; 6] = [
        ComponentType::I8,
        ComponentType::U8,
        ComponentType::I16,
        ComponentType::U16,
        ComponentType::U32,
        ComponentType::F32,
    ];

    /// Accessor 0 of `accessor`, over one buffer view with the extra members `view`.
    fn document(accessor: &str, view: &str, bytes: &[u8]) -> Document {
        let views = format!(r#"[{{"buffer":0,"byteLength":{}{view}}}]"#, bytes.len());
        Document::for_test(&format!(r#""bufferViews":{views},"accessors":[{{{accessor}}}]"#), bytes.to_vec())
    }

    fn open(document: &Document) -> Result<Accessor<'_>, Error> {
        Accessor::open(document, json::Index::new(0), &"test", &[Type::Scalar, Type::Vec2, Type::Vec3], &ANY)
    }

    fn scalars(component: u32, normalized: bool, bytes: &[u8], size: usize) -> Vec<f32> {
        let count = bytes.len() / size;
        let json = format!(
            r#""bufferView":0,"componentType":{component},"normalized":{normalized},"count":{count},"type":"SCALAR""#
        );
        let document = document(&json, "", bytes);
        let accessor = open(&document).expect("fits");
        (0..accessor.len()).map(|i| accessor.get::<1>(i)[0]).collect()
    }

    #[test]
    fn every_component_type_is_read_plain_and_normalized() {
        assert_eq!(scalars(5120, false, &[0x80, 0x7F], 1), [-128.0, 127.0]);
        assert_eq!(scalars(5120, true, &[0x80, 0x81, 0x7F], 1), [-1.0, -1.0, 1.0]);
        assert_eq!(scalars(5121, true, &[0, 51, 255], 1), [0.0, 0.2, 1.0]);
        assert_eq!(scalars(5122, false, &[0xFF, 0xFF], 2), [-1.0]);
        assert_eq!(scalars(5122, true, &[0x00, 0x80, 0xFF, 0x7F], 2), [-1.0, 1.0]);
        assert_eq!(scalars(5123, true, &[0xFF, 0xFF], 2), [1.0]);
        assert_eq!(scalars(5123, false, &[0x01, 0x02], 2), [513.0]);
        assert_eq!(scalars(5125, false, &[0, 0, 1, 0], 4), [65536.0]);
        assert_eq!(scalars(5126, false, &1.5f32.to_le_bytes(), 4), [1.5]);
    }

    #[test]
    fn strides_and_offsets_pick_the_right_bytes() {
        let json = r#""bufferView":0,"byteOffset":1,"componentType":5121,"count":2,"type":"VEC2""#;
        let document = document(json, r#","byteStride":4"#, &[9, 1, 2, 9, 9, 3, 4]);
        let accessor = open(&document).expect("the last element need not fill its stride");
        assert_eq!(accessor.get::<2>(0), [1.0, 2.0]);
        assert_eq!(accessor.get::<3>(1), [3.0, 4.0, 1.0], "missing components are 1");
    }

    #[test]
    fn overruns_are_errors_that_name_the_place() {
        let cases = [
            (r#""count":4"#, ""),
            (r#""count":1099511627776"#, ""),
            (r#""count":18446744073709551615"#, ""),
            (r#""count":1,"byteOffset":99"#, ""),
            (r#""count":1,"byteOffset":18446744073709551615"#, ""),
            (r#""count":1"#, r#","byteStride":2"#),
            (r#""count":2"#, r#","byteStride":18446744073709551615"#),
            (r#""count":1"#, r#","byteOffset":18446744073709551615"#),
        ];
        for (members, view) in cases {
            let json = format!(r#""bufferView":0,"componentType":5126,"type":"SCALAR",{members}"#);
            let document = document(&json, view, &[0; 12]);
            let message = open(&document).err().expect(members).to_string();
            assert!(message.contains("accessors[0]"), "{message}");
        }
    }

    #[test]
    fn an_accessor_without_view_is_zeros_however_long() {
        let document = document(r#""componentType":5126,"count":1099511627776,"type":"VEC3""#, "", &[]);
        let accessor = open(&document).expect("legal");
        assert_eq!(accessor.get::<3>((1 << 40) - 1), [0.0; 3]);
    }

    fn sparse(count: u32, indices: &[u8]) -> Result<Vec<f32>, String> {
        let json = format!(
            r#""componentType":5121,"count":4,"type":"SCALAR","sparse":{{"count":{count},
            "indices":{{"bufferView":0,"componentType":5121}},"values":{{"bufferView":0,"byteOffset":2}}}}"#
        );
        let document = document(&json, "", &[indices, &[70, 80]].concat());
        let accessor = open(&document).map_err(|e| e.to_string())?;
        Ok((0..4).map(|i| accessor.get::<1>(i)[0]).collect())
    }

    #[test]
    fn sparse_elements_replace_and_are_checked() {
        assert_eq!(sparse(2, &[1, 3]), Ok(vec![0.0, 70.0, 0.0, 80.0]));
        assert!(sparse(2, &[1, 4]).is_err_and(|e| e.contains("sparse.indices[1] = 4")));
        assert!(sparse(2, &[3, 1]).is_err());
        assert!(sparse(3, &[1, 2]).is_err(), "values overrun");
        assert!(sparse(5, &[1, 2]).is_err(), "more than the accessor has");
    }

    proptest! {
        #[test]
        fn no_numbers_make_it_panic(
            component in 5119u32..5128, count: u64, offset: u64, small in 0u64..20, stride in 0u64..16,
            view_offset in 0u64..20, length in 0u64..40, bytes in prop::collection::vec(any::<u8>(), 0..32),
            normalized: bool, huge: bool,
        ) {
            let (count, offset) = if huge { (count, offset) } else { (count % 20, small) };
            let json = format!(
                r#""bufferViews":[{{"buffer":0,"byteOffset":{view_offset},"byteLength":{length},"byteStride":{stride}}}],
                "accessors":[{{"bufferView":0,"byteOffset":{offset},"count":{count},"componentType":{component},
                "normalized":{normalized},"type":"VEC2","sparse":{{"count":{small},
                "indices":{{"bufferView":0,"byteOffset":{stride},"componentType":5121}},
                "values":{{"bufferView":0,"byteOffset":{small}}}}}}}]"#
            );
            let document = Document::for_test(&json, bytes);
            if let Ok(accessor) = open(&document) {
                for i in (0..accessor.len()).take(50) {
                    accessor.get::<4>(i);
                    accessor.index(i);
                }
            }
        }
    }
}
