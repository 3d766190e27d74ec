//! The file as it lies on disk: container, JSON, buffers; nothing of it is believed yet.

use std::fmt::Display;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use gltf::json;
use gltf::json::validation::USize64;

use super::error::Error;
use super::limits::Limits;
use super::uri::{self, Target};
use super::{draco, meshopt};

/// The parsed JSON with the bytes that it refers to.
pub(super) struct Document {
    /// The glTF file, for messages.
    pub file: PathBuf,
    /// The JSON, its structure checked by the parser, its values not checked at all.
    pub root: json::Root,
    /// What may be asked of us.
    pub limits: Limits,
    /// Bytes of each buffer, of the length that the JSON states; none for a buffer without any source,
    /// which is an error only where something reads it.
    buffers: Vec<Option<Vec<u8>>>,
    /// Bytes read so far.
    read: u64,
}

impl Document {
    /// Reads the file and its buffers.
    pub fn open(file: &Path, limits: Limits) -> Result<Document, Error> {
        let mut document =
            Document { file: file.into(), root: json::Root::default(), limits, buffers: Vec::new(), read: 0 };
        let bytes = document.read_file(file)?;
        let container = |problem: String| Error::Container { file: file.into(), problem };
        let (root, blob) = parse(bytes).map_err(container)?;
        document.root = root;
        document.check_version()?;
        document.read_buffers(blob)?;
        meshopt::decompress(&mut document)?;
        draco::decompress(&mut document)?;
        Ok(document)
    }

    /// Lets go of all bytes, once everything has been decoded.
    pub fn close(&mut self) {
        self.buffers = Vec::new();
    }

    /// An [`Error::Value`] in this file.
    pub fn fault(&self, at: impl Display, value: impl Display, problem: impl Display) -> Error {
        Error::value(&self.file, at, value, problem)
    }

    /// `value`, unless it is more than `limit`.
    pub fn within(&self, at: impl Display, what: &'static str, value: u64, limit: u64) -> Result<(), Error> {
        if value <= limit {
            return Ok(());
        }
        Err(Error::Limit { file: self.file.clone(), at: at.to_string(), what, value, limit })
    }

    /// The bytes of a buffer view and its stride, if it states one.
    pub fn view(
        &self,
        index: json::Index<json::buffer::View>,
        user: &dyn Display,
    ) -> Result<(&[u8], Option<usize>), Error> {
        let i = index.value();
        let view = self.root.buffer_views.get(i).ok_or_else(|| {
            self.fault(format_args!("{user}.bufferView"), i, "there is no buffer view of this number")
        })?;
        let offset = view.byte_offset.unwrap_or_default().0;
        let at = format_args!("bufferViews[{i}] ({user})").to_string();
        let bytes = self.range(view.buffer.value() as u64, offset, view.byte_length.0, &at)?;
        Ok((bytes, view.byte_stride.map(|stride| stride.0)))
    }

    /// `length` bytes of a buffer from `offset` on, for what stands at the path `at`.
    pub fn range(&self, buffer: u64, offset: u64, length: u64, at: &str) -> Result<&[u8], Error> {
        let place = |member: &str| match at.split_once(' ') {
            Some((path, user)) => format!("{path}.{member} {user}"),
            None => format!("{at}.{member}"),
        };
        let bytes = usize::try_from(buffer)
            .ok()
            .and_then(|b| self.buffers.get(b))
            .ok_or_else(|| self.fault(place("buffer"), buffer, "there is no buffer of this number"))?;
        let bytes = bytes.as_deref().ok_or_else(|| {
            self.fault(format_args!("buffers[{buffer}].uri"), "nothing", format_args!("needed by {at}"))
        })?;
        let range = offset
            .checked_add(length)
            .and_then(|end| Some(usize::try_from(offset).ok()?..usize::try_from(end).ok()?));
        range.and_then(|range| bytes.get(range)).ok_or_else(|| {
            let value = format_args!("{offset} + {length}").to_string();
            let problem = format!("ends beyond buffers[{buffer}], which has {} bytes", bytes.len());
            self.fault(place("byteOffset + byteLength"), value, problem)
        })
    }

    /// A new buffer view over a new buffer of `bytes`, which count as if they had been read.
    pub fn add_view(
        &mut self,
        at: &str,
        bytes: Vec<u8>,
        stride: Option<usize>,
    ) -> Result<json::Index<json::buffer::View>, Error> {
        let total = self.read.saturating_add(bytes.len() as u64);
        self.within(at, "bytes to unpack in all", total, self.limits.bytes)?;
        self.read = total;
        let view = json::buffer::View {
            buffer: json::Index::new(self.buffers.len() as u32),
            byte_length: USize64(bytes.len() as u64),
            byte_offset: None,
            byte_stride: stride.map(json::buffer::Stride),
            name: None,
            target: None,
            extensions: None,
            extras: None,
        };
        self.buffers.push(Some(bytes));
        self.root.buffer_views.push(view);
        Ok(json::Index::new(self.root.buffer_views.len() as u32 - 1))
    }

    /// The bytes that `uri` leads to.
    pub fn fetch(&mut self, uri: &str, at: &dyn Display) -> Result<Vec<u8>, Error> {
        match uri::resolve(uri).map_err(|problem| self.fault(at, uri::shown(uri), problem))? {
            Target::Bytes(bytes) => Ok(bytes),
            Target::File(path, as_it_stands) => {
                let folder = self.file.parent().unwrap_or(Path::new("")).to_owned();
                let plain = as_it_stands.map(|p| folder.join(p)).filter(|p| p.is_file());
                let path = folder.join(path);
                let path = plain.filter(|_| !path.is_file()).unwrap_or(path);
                self.read_file(&path)
            }
        }
    }

    fn read_file(&mut self, path: &Path) -> Result<Vec<u8>, Error> {
        let failed = |source| Error::Io { file: self.file.clone(), target: path.into(), source };
        let facts = fs::metadata(path).map_err(failed)?;
        if !facts.is_file() {
            // A pipe could keep us waiting for ever.
            return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file")));
        }
        let total = self.read.saturating_add(facts.len());
        self.within(path.display(), "bytes to read in all", total, self.limits.bytes)?;
        self.read = total;
        fs::read(path).map_err(|source| Error::Io { file: self.file.clone(), target: path.into(), source })
    }

    fn check_version(&self) -> Result<(), Error> {
        let asset = &self.root.asset;
        let number = |text: &str| -> Option<(u32, u32)> {
            let (major, minor) = text.split_once('.')?;
            Some((major.parse().ok()?, minor.parse().ok()?))
        };
        match number(&asset.version) {
            Some((2, _)) => {}
            Some(_) => {
                return Err(self.fault(
                    "asset.version",
                    &asset.version,
                    "only glTF 2 is read; export it again as glTF 2.0",
                ));
            }
            None => return Err(self.fault("asset.version", &asset.version, "not a version number like 2.0")),
        }
        match asset.min_version.as_deref().map(|text| (text, number(text))) {
            Some((text, Some(min))) if min > (2, 0) => {
                Err(self.fault("asset.minVersion", text, "needs a newer glTF than 2.0"))
            }
            Some((text, None)) => Err(self.fault("asset.minVersion", text, "not a version number like 2.0")),
            _ => Ok(()),
        }
    }

    fn read_buffers(&mut self, mut blob: Option<Vec<u8>>) -> Result<(), Error> {
        for i in 0..self.root.buffers.len() {
            let buffer = &self.root.buffers[i];
            let length = buffer.byte_length.0;
            let bytes = match buffer.uri.clone() {
                Some(uri) => Some(self.fetch(&uri, &format_args!("buffers[{i}].uri"))?),
                // GLB-stored buffer: only the first may be it (glTF 2.0, 3.6.1.2).
                None if i == 0 => blob.take(),
                None => None,
            };
            let bytes = match (bytes, usize::try_from(length)) {
                (None, _) => None,
                (Some(mut bytes), Ok(length)) if length <= bytes.len() => {
                    bytes.truncate(length);
                    Some(bytes)
                }
                (Some(bytes), _) => {
                    let problem = format!("its source has only {} bytes", bytes.len());
                    return Err(self.fault(format_args!("buffers[{i}].byteLength"), length, problem));
                }
            };
            self.buffers.push(bytes);
        }
        Ok(())
    }
}

/// JSON and the binary chunk of a GLB, or the JSON alone.
///
/// The chunk is what is left of `bytes`: a file of a gigabyte need not be held twice.
fn parse(mut bytes: Vec<u8>) -> Result<(json::Root, Option<Vec<u8>>), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok((parse_json(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes))?, None));
    }
    // What follows the length stated in the header is to be ignored (glTF 2.0, 4.4.1), which the gltf crate
    // does not; where the file is shorter than stated, it says so.
    let length = bytes.get(8..12).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes) as usize;
    if length < 12 {
        return Err(format!("GLB: a stated length of {length} bytes"));
    }
    let glb = gltf::Glb::from_slice(bytes.get(..length).unwrap_or(&bytes)).map_err(|e| match e {
        gltf::Error::Binary(e) => format!("GLB: {e}"),
        e => e.to_string(),
    })?;
    let root = parse_json(&glb.json)?;
    let bin = glb.bin.as_ref().map(|bin| (bin.as_ptr() as usize - bytes.as_ptr() as usize, bin.len()));
    drop(glb);
    let Some((start, length)) = bin else { return Ok((root, None)) };
    bytes.truncate(start + length);
    bytes.drain(..start);
    Ok((root, Some(bytes)))
}

fn parse_json(text: &[u8]) -> Result<json::Root, String> {
    json::Root::from_slice(text).or_else(|error| {
        // The gltf crate insists on members that glTF leaves optional: a scene's nodes, and the target of an
        // animation, which is no concern of ours. Such files are rare: only they are parsed twice.
        let mut value: json::Value =
            json::deserialize::from_slice(text).map_err(|_| format!("JSON: {error}"))?;
        if let Some(members) = value.as_object_mut() {
            members.remove("animations");
            let scenes = members.get_mut("scenes").and_then(|scenes| scenes.as_array_mut());
            for scene in scenes.into_iter().flatten().filter_map(|scene| scene.as_object_mut()) {
                scene.entry("nodes").or_insert(json::Value::Array(Vec::new()));
            }
        }
        // The first message has line and column.
        json::deserialize::from_value(value).map_err(|_| format!("JSON: {error}"))
    })
}

#[cfg(test)]
impl Document {
    /// A document in memory: `json` without the asset, and the bytes of buffer 0.
    pub fn for_test(json: &str, buffer: Vec<u8>) -> Document {
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}}}],{json}}}"#,
            buffer.len()
        );
        let root = json::Root::from_str(&text).expect("the test's JSON parses");
        Document {
            file: "test.gltf".into(),
            root,
            limits: Limits::default(),
            buffers: vec![Some(buffer)],
            read: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_that_gltf_leaves_optional_may_be_absent() {
        let text = br#"{"asset":{"version":"2.0"},"scenes":[{}],"animations":[{"channels":[{"target":{"path":"pointer"},
            "sampler":0}],"samplers":[]}]}"#;
        assert_eq!(parse_json(text).expect("legal").scenes.len(), 1);
        assert!(parse_json(br#"{"asset":{"version":2}}"#).is_err_and(|e| e.contains("line 1")));
    }

    #[test]
    fn bytes_after_a_glb_are_ignored_and_missing_ones_are_not() {
        let json = br#"{"asset":{"version":"2.0"}} "#;
        let mut glb = b"glTF\x02\0\0\0\x30\0\0\0\x1c\0\0\0JSON".to_vec();
        glb.extend(json);
        assert!(parse(glb.clone()).is_ok());
        assert!(parse([&glb[..], b"tail"].concat()).is_ok());
        assert!(parse(glb[..glb.len() - 1].to_vec()).is_err());
        for length in 0..20 {
            // In whatever place it ends, and whatever length the header states.
            assert!(parse(glb[..length].to_vec()).is_err());
            glb[8] = length as u8;
            assert!(parse(glb.clone()).is_err());
        }
    }

    #[test]
    fn views_are_checked_against_their_buffer() {
        let views = r#""bufferViews":[{"buffer":0,"byteOffset":2,"byteLength":2},{"buffer":0,"byteLength":5},
            {"buffer":1,"byteLength":1},{"buffer":0,"byteOffset":18446744073709551615,"byteLength":2}]"#;
        let document = Document::for_test(views, vec![1, 2, 3, 4]);
        let view = |i| {
            document.view(json::Index::new(i), &"test").map(|(b, _)| b.to_vec()).map_err(|e| e.to_string())
        };
        assert_eq!(view(0), Ok(vec![3, 4]));
        assert!(view(1).is_err_and(|e| e.contains("bufferViews[1].byteOffset + byteLength (test) = 0 + 5")));
        assert!(view(2).is_err_and(|e| e.contains("bufferViews[2].buffer (test) = 1")));
        assert!(view(3).is_err() && view(4).is_err_and(|e| e.contains("test.bufferView = 4")));
    }
}
