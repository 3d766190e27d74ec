//! The file as it lies on disk: container, JSON, buffers; nothing of it is believed yet.

use std::fmt::Display;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use gltf::json;

use super::error::Error;
use super::limits::Limits;
use super::uri::{self, Target};

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
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
        let parsed = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| container(describe(&e)))?;
        document.root = parsed.document.into_json();
        document.check_version()?;
        document.read_buffers(parsed.blob)?;
        Ok(document)
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
        let at = format_args!("bufferViews[{i}]");
        let b = view.buffer.value();
        let buffer = self.buffers.get(b).ok_or_else(|| {
            self.fault(
                format_args!("{at}.buffer"),
                b,
                format_args!("there is no buffer of this number ({user})"),
            )
        })?;
        let buffer = buffer.as_deref().ok_or_else(|| {
            self.fault(format_args!("buffers[{b}].uri"), "nothing", format_args!("needed by {user}"))
        })?;
        let offset = view.byte_offset.unwrap_or_default().0;
        let range = offset
            .checked_add(view.byte_length.0)
            .and_then(|end| Some(usize::try_from(offset).ok()?..usize::try_from(end).ok()?));
        let bytes = range.and_then(|range| buffer.get(range)).ok_or_else(|| {
            let value = format_args!("{offset} + {}", view.byte_length.0).to_string();
            let problem = format!("ends beyond buffers[{b}], which has {} bytes ({user})", buffer.len());
            self.fault(format_args!("{at}.byteOffset + byteLength"), value, problem)
        })?;
        Ok((bytes, view.byte_stride.map(|stride| stride.0)))
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

/// The gltf crate's message; for JSON that includes line and column.
fn describe(error: &gltf::Error) -> String {
    match error {
        gltf::Error::Deserialize(e) => format!("JSON: {e}"),
        gltf::Error::Binary(e) => format!("GLB: {e}"),
        e => e.to_string(),
    }
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
