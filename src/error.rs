//! One error type. The library returns it; the command line prints it once and turns its kind into an exit code.

use std::fmt;
use std::path::Path;

/// Result of everything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong, by who can mend it. The command line maps each kind to one exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The call itself: options, names, a part that is not in this build (exit code 2).
    Usage,
    /// What a scene file or a mesh says (exit code 3).
    Scene,
    /// Reading or writing files (exit code 4).
    File,
    /// Samples that are not numbers, where the caller asked to be strict (exit code 5).
    Numeric,
    /// More memory than there is, known before the start (exit code 6).
    Memory,
}

/// A message that names the file, the item and the remedy.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    message: String,
}

impl Error {
    /// An error of `kind`; `message` names file, item and remedy.
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// See [`ErrorKind::Usage`].
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Usage, message)
    }

    /// See [`ErrorKind::Scene`].
    pub fn scene(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Scene, message)
    }

    /// See [`ErrorKind::File`]; `doing` completes "path: cannot ...".
    pub fn file(path: &Path, doing: &str, cause: impl fmt::Display) -> Self {
        Self::new(ErrorKind::File, format!("{}: cannot {doing}: {cause}", path.display()))
    }

    /// The same error with `prefix: ` before its message, for callers that know the item.
    #[must_use]
    pub fn within(mut self, prefix: impl fmt::Display) -> Self {
        self.message = format!("{prefix}: {}", self.message);
        self
    }

    /// Who can mend it.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

/// The name in `known` nearest to `typed`, as ` (did you mean ...?)`, or nothing if none is near.
pub fn did_you_mean<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(typed, name), name))
        .filter(|&(distance, name)| distance <= 1 + name.len() / 3)
        .min()
        .map_or(String::new(), |(_, name)| format!(" (did you mean `{name}`?)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_near_name_is_offered_and_a_far_one_is_not() {
        let known = ["standard", "directional"];
        assert_eq!(did_you_mean("dirctional", known), " (did you mean `directional`?)");
        assert_eq!(did_you_mean("xyz", known), "");
    }
}
