//! Standard output. A reader that has left (`| head`) is no fault of ours; a write that fails for another reason, such as
//! a full disk, is, and the program says so in the end.

use marmor::{Error, Result};
use std::fmt;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Mutex;

/// The first write that failed.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Writes `text`; what goes wrong is kept for [`finish`].
pub fn write(text: fmt::Arguments<'_>) {
    let mut failed = FAILED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if failed.is_none() {
        *failed = io::stdout().write_fmt(text).err();
    }
}

/// What is still to be written, and what became of all of it.
///
/// # Errors
/// File if anything was not written, unless the reader has left.
pub fn finish() -> Result<()> {
    let mut failed = FAILED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    match failed.take().or_else(|| io::stdout().flush().err()) {
        Some(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error_of(error)),
        _ => Ok(()),
    }
}

/// The error of a write to standard output that failed.
pub fn error_of(cause: io::Error) -> Error {
    Error::file(Path::new("standard output"), "write", cause)
}
