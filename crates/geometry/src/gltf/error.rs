//! What can be wrong with a file: each error names the file, the place in its JSON, and the value.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file was refused.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file, or one that it refers to, cannot be read.
    #[error("{}: cannot read {}", file.display(), target.display())]
    Io {
        /// The glTF file.
        file: PathBuf,
        /// The file that cannot be read; the glTF file itself, or a buffer of it.
        target: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Not glTF, a broken GLB container, or JSON that does not follow glTF's schema.
    #[error("{}: not a readable glTF 2.0 file: {problem}", file.display())]
    Container {
        /// The glTF file.
        file: PathBuf,
        /// What the parser said.
        problem: String,
    },
    /// The file cannot be shown rightly without an extension that twolight does not have.
    #[error("{}: requires the extension {extension}, which is not supported: {remedy}", file.display())]
    Extension {
        /// The glTF file.
        file: PathBuf,
        /// Name in `extensionsRequired`.
        extension: String,
        /// What the user can do.
        remedy: &'static str,
    },
    /// A value that contradicts glTF or another value of the file.
    #[error("{}: {at} = {value}: {problem}", file.display())]
    Value {
        /// The glTF file.
        file: PathBuf,
        /// Path in the JSON, like `meshes[3].primitives[0].attributes.POSITION`.
        at: String,
        /// The offending value.
        value: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Asked for by name, and not there.
    #[error("{}: there is no {what} \"{asked}\"; the file has {}", file.display(), if known.is_empty() { "none" } else { known })]
    NoSuch {
        /// The glTF file.
        file: PathBuf,
        /// "scene" or "variant".
        what: &'static str,
        /// What was asked for.
        asked: String,
        /// Names of those there are.
        known: String,
    },
    /// More than [`Limits`](super::Limits) allow.
    #[error("{}: {at}: {value} {what}, more than the limit of {limit}", file.display())]
    Limit {
        /// The glTF file.
        file: PathBuf,
        /// Path in the JSON, or of the file that is too large.
        at: String,
        /// What there is too much of, plural.
        what: &'static str,
        /// How many there are (at least).
        value: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// A panic of a parser or decoder, caught at the edge.
    #[error("{}: the loader failed on this file: {problem}; this is a defect, please report it", file.display())]
    Defect {
        /// The glTF file.
        file: PathBuf,
        /// The panic's message.
        problem: String,
    },
}

impl Error {
    /// An [`Error::Value`].
    pub(super) fn value(file: &Path, at: impl Display, value: impl Display, problem: impl Display) -> Error {
        Error::Value {
            file: file.into(),
            at: at.to_string(),
            value: value.to_string(),
            problem: problem.to_string(),
        }
    }
}

/// An error with its cause, on one line.
pub(super) fn chain(e: &Error) -> String {
    match std::error::Error::source(e) {
        Some(cause) => format!("{e}: {cause}"),
        None => e.to_string(),
    }
}
