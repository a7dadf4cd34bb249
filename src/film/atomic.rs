//! Files that are either the old one or the new one, never half of one.

use crate::{Error, Result};
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

/// Writes `path` by way of a temporary file in the same folder: written, flushed to the disk, renamed. If `write`
/// or any step fails, the old file is as it was and the temporary is removed. A link is followed.
///
/// # Errors
/// File, in one line: the folder is missing, the folder or the file is read-only, the path is a folder, or what
/// the system said while writing.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let target = resolve(path)?;
    let (temporary, file) = Temporary::beside(&target, path)?;
    fill(file, write)
        .and_then(|()| fs::rename(&temporary.0, &target))
        .map_err(|e| Error::file(path, "write", format!("{e}; a file of that name is unchanged")))?;
    // The rename reaches the disk with the folder. Not every system can flush a folder; the file is whole either way.
    let _ = File::open(folder(&target)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Whether [`write_atomically`] could write `path` now; leaves nothing behind.
///
/// # Errors
/// As [`write_atomically`].
pub fn check_replaceable(path: &Path) -> Result<()> {
    let target = resolve(path)?;
    sweep(&target);
    Temporary::beside(&target, path).map(drop)
}

/// Removes temporaries of `target` that killed processes have left: nobody here has their number, and they are old
/// enough not to belong to another machine's.
fn sweep(target: &Path) {
    const OLD: Duration = Duration::from_secs(3600);
    let Some(name) = target.file_name().and_then(|n| n.to_str()) else { return };
    for entry in fs::read_dir(folder(target)).into_iter().flatten().flatten() {
        let found = entry.file_name();
        let numbers = found.to_str().and_then(|f| {
            f.strip_prefix('.')?.strip_prefix(name)?.strip_prefix('.')?.strip_suffix(".tmp")?.split_once('-')
        });
        let Some((process, count)) = numbers else { continue };
        let ours = process.parse::<u32>().is_ok() && count.parse::<u32>().is_ok();
        let alive = !Path::new("/proc/self").exists() || Path::new("/proc").join(process).exists();
        let age = entry.metadata().and_then(|m| m.modified()).ok().and_then(|m| m.elapsed().ok());
        if ours && !alive && age.is_some_and(|age| age > OLD) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn fill(file: File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffered = BufWriter::new(file);
    write(&mut buffered)?;
    buffered.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// Where `path` leads, with what stands in the way of replacing it told apart.
fn resolve(path: &Path) -> Result<PathBuf> {
    let no = |cause: &str| Err(Error::file(path, "write", cause));
    if path.as_os_str().is_empty() {
        return Err(Error::usage("an output file needs a name"));
    }
    // A link whose end is missing is replaced by the file.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    if let Ok(found) = fs::metadata(&target) {
        if found.is_dir() {
            return no("it is a folder; give the name of a file in it");
        }
        if !found.is_file() {
            return no("it is neither a file nor a folder; give another name");
        }
        if found.permissions().readonly() {
            return no("the file is read-only; make it writable or give another name");
        }
    }
    if target.file_name().is_none() {
        return no("it does not end in a file name");
    }
    let folder = folder(&target);
    match fs::metadata(folder) {
        Ok(found) if found.is_dir() => Ok(target),
        Ok(_) => no(&format!("`{}` is not a folder", folder.display())),
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            no(&format!("the folder `{}` does not exist; make it first", folder.display()))
        }
        Err(e) => Err(Error::file(path, "write", e)),
    }
}

/// The folder that holds `path`; `.` for a bare name.
fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A file that goes when its owner does; after a rename there is nothing left to remove.
struct Temporary(PathBuf);

impl Temporary {
    /// A new file in `target`'s folder, hidden and named after it; errors name `asked`, the path as typed.
    fn beside(target: &Path, asked: &Path) -> Result<(Self, File)> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        loop {
            let mut name = OsString::from(".");
            name.push(target.file_name().unwrap_or_default());
            name.push(format!(".{}-{}.tmp", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
            let path = folder(target).join(name);
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Self(path), file)),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {} // left by a killed process of the same id
                Err(e) => {
                    let folder = folder(target).display();
                    let cause = format!("no new file can be made in the folder `{folder}` ({e}); choose another");
                    return Err(Error::file(asked, "write", cause));
                }
            }
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}
