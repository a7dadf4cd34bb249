//! The files of one command: what it reads is never written over, and no two of its outputs are one file. Asked before
//! anything is rendered.

use marmor::{Error, Result};
use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What a user can do about a file that collides.
#[derive(Clone, Copy)]
pub enum Remedy {
    /// Another name after this option; a free one is offered.
    Name(&'static str),
    /// In these words.
    Say(&'static str),
}

/// Everything that a command reads and writes.
#[derive(Default)]
pub struct Files {
    read: Vec<(String, PathBuf)>,
    written: Vec<(String, PathBuf, Remedy)>,
}

impl Files {
    /// The command reads `path`, which is `what`.
    pub fn reads(&mut self, what: impl Into<String>, path: &Path) {
        self.read.push((what.into(), path.to_path_buf()));
    }

    /// A scene file and all that it names.
    pub fn reads_scene(&mut self, file: &marmor::scene::SceneFile) {
        self.reads("the scene file", &file.path);
        self.read.extend(file.inputs());
    }

    /// The command may write `path`, which is `what`.
    pub fn writes(&mut self, what: impl Into<String>, path: &Path, remedy: Remedy) {
        self.written.push((what.into(), path.to_path_buf(), remedy));
    }

    /// Refuses an output that is an input, or another output, under whatever name.
    ///
    /// # Errors
    /// Usage, with both and with what to do.
    pub fn check(&self) -> Result<()> {
        let mut taken: HashMap<FileId, (&str, &Path, bool)> = HashMap::new();
        for (what, path) in &self.read {
            taken.entry(FileId::of(path)).or_insert((what, path, true));
        }
        for (what, path, remedy) in &self.written {
            let Some((other, at, is_input)) = taken.insert(FileId::of(path), (what, path, false)) else { continue };
            let same = if at == path { String::new() } else { format!(" ({})", at.display()) };
            let would = if is_input { "would be written over" } else { "would be the same file as" };
            let remedy = match remedy {
                Remedy::Name(option) => {
                    format!("give another name, such as {option} {}", self.free_beside(path).display())
                }
                Remedy::Say(words) => (*words).to_string(),
            };
            return Err(Error::usage(format!("{}: {what} {would} {other}{same}; {remedy}", path.display())));
        }
        Ok(())
    }

    /// A name like `path`'s that neither is there nor one of the command's own.
    fn free_beside(&self, path: &Path) -> PathBuf {
        free_name(path, |name| self.written.iter().any(|(_, other, _)| other == name))
    }
}

/// `NAME-2.END`, or the next number that nobody has.
pub fn free_name(path: &Path, taken: impl Fn(&Path) -> bool) -> PathBuf {
    let numbered = |n: u32| {
        let mut name = path.file_stem().unwrap_or_default().to_os_string();
        name.push(format!("-{n}"));
        if let Some(ending) = path.extension() {
            name.push(".");
            name.push(ending);
        }
        path.with_file_name(name)
    };
    (2..u32::MAX)
        .map(numbered)
        .find(|name| std::fs::symlink_metadata(name).is_err() && !taken(name))
        .unwrap_or_default()
}

/// A file, whatever it is called.
#[derive(PartialEq, Eq, Hash)]
enum FileId {
    /// What is there: links of both kinds, other spellings and other cases lead to it.
    There(Identity),
    /// What is not there yet: its folder, and its name without regard to case, which many systems have none for.
    New(PathBuf, OsString),
}

#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

impl FileId {
    fn of(path: &Path) -> Self {
        let mut path = path.to_path_buf();
        // A link to what is not there yet ends where it points; a ring of links has no end.
        for _ in 0..40 {
            if let Some(found) = identity(&path) {
                return Self::There(found);
            }
            let Ok(next) = std::fs::read_link(&path) else { break };
            path = folder(&path).join(next);
        }
        let folder = folder(&path);
        let folder = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
        let name = path.file_name().unwrap_or_default();
        Self::New(folder, name.to_str().map_or_else(|| name.to_os_string(), |name| name.to_lowercase().into()))
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt as _;
    std::fs::metadata(path).ok().map(|found| (found.dev(), found.ino()))
}
#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    std::fs::canonicalize(path).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(read: &[&Path], written: &[&Path]) -> Result<()> {
        let mut files = Files::default();
        read.iter().for_each(|path| files.reads("the scene file", path));
        written.iter().for_each(|path| files.writes("the picture", path, Remedy::Name("-o")));
        files.check()
    }

    #[test]
    fn one_file_under_two_names_is_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::write(at("a.exr"), "a").unwrap();
        std::fs::write(at("b.exr"), "b").unwrap();
        checked(&[&at("a.exr")], &[&at("b.exr"), &at("c.exr")]).unwrap();
        let refused = |written: &[&Path]| checked(&[&at("a.exr")], written).unwrap_err().to_string();
        for name in ["a.exr", "sub/../a.exr", "./a.exr"] {
            let told = refused(&[&at(name)]);
            assert!(told.contains("written over the scene file") && told.contains("a-2.exr"), "{told}");
        }
        // Of files that are not there, the name alone.
        assert!(refused(&[&at("c.exr"), &at("sub/../C.EXR")]).contains("same file as the picture"));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("a.exr"), at("soft.exr")).unwrap();
            std::fs::hard_link(at("a.exr"), at("hard.exr")).unwrap();
            std::os::unix::fs::symlink("new.exr", at("ahead.exr")).unwrap();
            std::os::unix::fs::symlink(at("ring.exr"), at("ring.exr")).unwrap();
            refused(&[&at("soft.exr")]);
            refused(&[&at("hard.exr")]);
            refused(&[&at("new.exr"), &at("ahead.exr")]);
            checked(&[], &[&at("ring.exr")]).unwrap();
        }
    }

    #[test]
    fn a_free_name_is_free() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.film");
        std::fs::write(folder.path().join("x-2.film"), "").unwrap();
        assert_eq!(free_name(&path, |_| false), folder.path().join("x-3.film"));
        assert_eq!(free_name(&path, |name| name.ends_with("x-3.film")), folder.path().join("x-4.film"));
    }
}
