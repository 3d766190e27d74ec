//! A file whole or not at all: written beside its name, synchronised, then renamed.

use crate::error::Error;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Puts `bytes` into the file `path`. Whoever reads `path`, at any moment, finds the old file or the new one.
///
/// The data go to a temporary file in the same folder (a rename does not cross file systems), are flushed to the
/// disk, and then take the name. A link is followed, so that what it points to is replaced, not the link; a path
/// that is no ordinary file, such as `/dev/null`, is written to directly.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let fail = |source| Error::Write { path: path.into(), source };
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.into());
    if fs::metadata(&target).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        return fs::OpenOptions::new()
            .write(true)
            .open(&target)
            .and_then(|mut f| f.write_all(bytes))
            .map_err(fail);
    }
    let mut file = temporary(&target).map_err(fail)?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(fail)?;
    file.persist(&target).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Whether [`write_atomically`] could succeed now: asked before the hours of work, not after.
///
/// Makes and removes an empty temporary file in the folder of `path`; touches nothing else.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let fail = |source| Error::Write { path: path.into(), source };
    if path.is_dir() {
        return Err(fail(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")));
    }
    if path.file_name().is_none() {
        return Err(fail(io::Error::new(io::ErrorKind::InvalidInput, "it names no file")));
    }
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.into());
    match fs::metadata(&target) {
        Ok(m) if !m.is_file() => Ok(()),
        // A name that is too long, say, or a folder on the way that may not be entered.
        Err(e) if e.kind() != io::ErrorKind::NotFound && folder(&target).is_dir() => Err(fail(e)),
        _ if !folder(&target).is_dir() => Err(fail(io::Error::new(
            io::ErrorKind::NotFound,
            format!("the folder {} does not exist", folder(&target).display()),
        ))),
        _ => temporary(&target).map(drop).map_err(fail),
    }
}

/// A temporary file beside `target`, with the permissions that a plainly created file would have.
fn temporary(target: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".twolight-").suffix(".tmp");
    let permissions = {
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // Narrowed by the umask, as `File::create` does; tempfile's own default is for secrets, 0600.
            Some(fs::metadata(target).map_or_else(|_| fs::Permissions::from_mode(0o666), |m| m.permissions()))
        }
        #[cfg(not(unix))]
        {
            None::<fs::Permissions>
        }
    };
    if let Some(permissions) = permissions {
        builder.permissions(permissions);
    }
    builder.tempfile_in(folder(target))
}

/// The folder of `path`; a bare name lies in the current one.
fn folder(path: &Path) -> PathBuf {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.into(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_new_file_replaces_the_old_and_leaves_nothing_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        write_atomically(&path, b"old").unwrap();
        write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_cannot_be_written_is_known_beforehand() {
        let dir = tempfile::tempdir().unwrap();
        assert!(check_writable(&dir.path().join("fine.exr")).is_ok());
        assert!(check_writable(dir.path()).is_err());
        assert!(check_writable(&dir.path().join("long".repeat(100))).is_err());
        let absent = check_writable(&dir.path().join("no/such/folder.exr")).unwrap_err();
        let Error::Write { source, .. } = absent else { panic!("{absent}") };
        assert!(source.to_string().contains("does not exist"), "{source}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let dir = tempfile::tempdir().unwrap();
        let (real, link) = (dir.path().join("real"), dir.path().join("link"));
        fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, b"new").unwrap();
        assert_eq!(fs::read(&real).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
