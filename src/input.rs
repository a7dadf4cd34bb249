//! Files that are read: regular ones alone. A pipe or a device may have no end, and nobody waits for one.

use crate::{Error, Result, memory};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Opens a regular file; its length [bytes] beside it.
///
/// # Errors
/// File if it is not there, a folder, a pipe or a device, or may not be read.
pub fn open(path: &Path) -> Result<(File, u64)> {
    // Before it is opened: opening a pipe waits for its writer.
    let found = std::fs::metadata(path).map_err(|e| Error::file(path, "read", e))?;
    if found.is_dir() {
        return Err(Error::file(path, "read", "it is a folder"));
    }
    if !found.is_file() {
        return Err(Error::file(
            path,
            "read",
            "it is a pipe or a device, no regular file; save its content in a file first",
        ));
    }
    Ok((File::open(path).map_err(|e| Error::file(path, "read", e))?, found.len()))
}

/// All bytes of a regular file, where `factor` times as much memory is available.
///
/// # Errors
/// As [`open`]; Memory.
pub fn read_all(path: &Path, factor: u128) -> Result<Vec<u8>> {
    let (file, length) = open(path)?;
    let what = format!("{}: a file of {length} bytes", path.display());
    memory::require(u128::from(length) * factor, memory::available(), &what, "use a smaller one")?;
    let mut bytes = Vec::new();
    // Files of /proc say 0; what grows while it is read has no end.
    let most = length.max(1 << 16);
    file.take(most + 1).read_to_end(&mut bytes).map_err(|e| Error::file(path, "read", e))?;
    if bytes.len() as u64 > most {
        return Err(Error::file(
            path,
            "read",
            "it has more bytes than the system says; save its content in a file first",
        ));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ErrorKind;

    #[test]
    fn folders_and_devices_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let error = open(folder.path()).unwrap_err();
        assert_eq!((error.kind(), error.to_string().contains("a folder")), (ErrorKind::File, true));
        #[cfg(unix)]
        assert!(read_all(Path::new("/dev/zero"), 1).unwrap_err().to_string().contains("pipe or a device"));
        assert!(open(&folder.path().join("gone")).is_err());
    }

    #[test]
    fn a_file_beyond_memory_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "text").unwrap();
        assert_eq!(read_all(&path, 1).unwrap(), b"text");
        // Sparse: 4 TB by its length, none on the disk; not every file system has them.
        if File::options().write(true).open(&path).unwrap().set_len(1 << 42).is_ok() && memory::available().is_some() {
            assert_eq!(read_all(&path, 1 << 20).unwrap_err().kind(), ErrorKind::Memory);
        }
    }
}
