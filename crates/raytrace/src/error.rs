//! What can go wrong with a picture: always a file, never a pixel.

use std::io;
use std::path::PathBuf;

/// A picture that could not be read, written or compared. Every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read.
    #[error("cannot read {path}")]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The operating system refused to write.
    #[error("cannot write {path}")]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is no OpenEXR file, is damaged, or uses something we do not read.
    #[error("{path} is not an OpenEXR picture that can be read: {reason}")]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// What the decoder met.
        reason: String,
    },
    /// The file is sound but holds no such picture.
    #[error("{path} has no channels {wanted}; it has {present}")]
    NoSuchLayer {
        /// Which file.
        path: PathBuf,
        /// What was looked for, such as "R, G, B".
        wanted: String,
        /// What there is.
        present: String,
    },
    /// The picture could not be put into its file format.
    #[error("cannot encode {path}: {reason}")]
    Encode {
        /// Which file.
        path: PathBuf,
        /// What the encoder said.
        reason: String,
    },
    /// Two pictures that should be compared differ in size.
    #[error("the pictures differ in size: {0}x{1} against {2}x{3}")]
    SizeMismatch(u32, u32, u32, u32),
    /// A picture without pixels, or a reference without light, has no error to speak of.
    #[error("nothing to compare: {0}")]
    NothingToCompare(&'static str),
}
