//! Film files: the sums themselves, what they belong to and what they cost. One format for checkpoints, for parts that
//! are merged, and for renders that go on later. docs/robustness.md has the layout.

use super::sums::Sums;
use super::{Counts, Film, Window, atomic};
use crate::math::hash_combine;
use crate::{Error, Result, memory};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::ops::Range;
use std::path::Path;

/// What every film file begins with; the number is the version of the layout.
const MAGIC: &[u8] = b"marmor film 1\n";
/// Memory for each byte of the header while it is read.
const BYTES_PER_BYTE: u128 = 4;
/// Runs of passes in one file: far more than anybody merges.
const MOST_RANGES: usize = 1 << 16;

/// The facts that decide every bit of a picture, by name and in order: version, method, backend, seed, scene, meshes.
/// Films may be continued or joined only where all agree.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity(pub Vec<(String, String)>);

impl Identity {
    /// One number for all of it.
    pub fn hash(&self) -> u64 {
        let mut sum = Checksum::default();
        for (name, value) in &self.0 {
            for text in [name, value] {
                sum.update(&(text.len() as u64).to_le_bytes());
                sum.update(text.as_bytes());
            }
        }
        sum.value()
    }

    /// The value of the fact `name`.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// The name of the first fact that differs. `None` where all agree.
    pub fn differs<'a>(&'a self, other: &'a Self) -> Option<&'a str> {
        fn map(of: &Identity) -> HashMap<&str, &str> {
            of.0.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect()
        }
        let (ours, theirs) = (map(self), map(other));
        let mut names = self.0.iter().chain(&other.0).map(|(name, _)| name.as_str());
        names.find(|name| ours.get(name) != theirs.get(name))
    }

    /// The first fact that differs, with both values; of long texts the first line that differs. `None` where all agree.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let name = self.differs(other)?;
        Some(match (self.get(name), other.get(name)) {
            (Some(a), Some(b)) => {
                let (mut left, mut right) = (a.lines(), b.lines());
                let (mut line, mut differing) = (0, (None, None));
                while differing.0 == differing.1 {
                    (differing, line) = ((left.next(), right.next()), line + 1);
                    if differing == (None, None) {
                        break;
                    }
                }
                let shown = |text: Option<&str>| text.map_or("nothing".into(), |t| format!("`{}`", cut(t)));
                let lines = a.lines().count().max(b.lines().count());
                let at = if lines > 1 { format!(", line {line}") } else { String::new() };
                format!("{name}{at}: {} there, {} here", shown(differing.0), shown(differing.1))
            }
            (Some(_), None) => format!("{name}: there, but not here"),
            _ => format!("{name}: here, but not there"),
        })
    }
}

fn cut(text: &str) -> String {
    let mut shown: String = text.chars().take(100).collect();
    if text.chars().nth(100).is_some() {
        shown.push_str("...");
    }
    shown
}

/// A film with all that is needed to go on with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// What the film belongs to.
    pub identity: Identity,
    /// What pictures made of it say of their making: EXR attributes by name.
    pub attributes: Vec<(String, String)>,
    /// Time and work so far, in the words of whoever writes them (JSON).
    pub progress: serde_json::Value,
    /// The sums.
    pub film: Film,
}

/// The first part of a film file.
#[derive(Serialize, Deserialize)]
struct Header {
    /// [`Identity::hash`], in hexadecimal digits.
    hash: String,
    resolution: [u32; 2],
    window: Window,
    ranges: Vec<Range<u32>>,
    counts: Counts,
    identity: Identity,
    attributes: Vec<(String, String)>,
    progress: serde_json::Value,
}

impl Checkpoint {
    /// Writes a film file, so that `path` is the old or the new one at any time.
    ///
    /// # Errors
    /// File if it cannot be written.
    pub fn write(
        path: &Path,
        film: &Film,
        identity: &Identity,
        attributes: &[(String, String)],
        progress: serde_json::Value,
    ) -> Result<()> {
        let header = Header {
            hash: format!("{:016x}", identity.hash()),
            resolution: film.resolution(),
            window: film.window(),
            ranges: film.ranges().to_vec(),
            counts: film.counts(),
            identity: identity.clone(),
            attributes: attributes.to_vec(),
            progress,
        };
        let header = serde_json::to_vec(&header).map_err(|e| Error::file(path, "write", e))?;
        atomic::write_atomically(path, |out| {
            let mut out = Summing { inner: out, sum: Checksum::default() };
            out.write_all(MAGIC)?;
            out.write_all(&(header.len() as u64).to_le_bytes())?;
            out.write_all(&header)?;
            film.write_sums(&mut out)?;
            let sum = out.sum.value();
            out.inner.write_all(&sum.to_le_bytes())
        })
    }

    /// Reads a film file. Memory is checked before it is taken, sizes against the length of the file.
    ///
    /// # Errors
    /// File if it cannot be read, is no film file, is of another version, cut short or damaged; Memory if its film is
    /// more than what is available.
    pub fn read(path: &Path) -> Result<Self> {
        let no = |what: &str| Error::file(path, "read", what);
        let damaged = |e: io::Error| match e.kind() {
            io::ErrorKind::UnexpectedEof => no("the film file is cut short"),
            io::ErrorKind::InvalidData => no(&format!("the film file is damaged: {e}")),
            _ => Error::file(path, "read", e),
        };
        let metadata = std::fs::metadata(path).map_err(|e| Error::file(path, "read", e))?;
        if !metadata.is_file() {
            return Err(no("it is no regular file"));
        }
        let file = File::open(path).map_err(|e| Error::file(path, "read", e))?;
        let mut from = Summing { inner: BufReader::with_capacity(1 << 18, file), sum: Checksum::default() };
        let mut magic = [0; MAGIC.len()];
        from.read_exact(&mut magic).map_err(|_| no("it is no film file of marmor"))?;
        if magic != MAGIC {
            let family = magic.starts_with(b"marmor film ");
            return Err(no(if family {
                "it is a film file of another version of marmor; use that version, or render anew"
            } else {
                "it is no film file of marmor"
            }));
        }
        let mut length = [0; 8];
        from.read_exact(&mut length).map_err(damaged)?;
        let length = u64::from_le_bytes(length);
        if length > metadata.len() {
            return Err(no("the film file is cut short or damaged: its header is longer than the file"));
        }
        let what = format!("{}: its header", path.display());
        memory::require(u128::from(length) * BYTES_PER_BYTE, memory::available(), &what, "use a smaller scene")?;
        let mut header = vec![0; length as usize];
        from.read_exact(&mut header).map_err(damaged)?;
        let header: Header =
            serde_json::from_slice(&header).map_err(|e| no(&format!("the film file is damaged: its header: {e}")))?;
        let film = header.film(path, metadata.len())?;
        let Header { identity, attributes, progress, ranges, counts, .. } = header;
        let mut read = Self { identity, attributes, progress, film };
        read.film.read_sums(&mut from, ranges, counts).map_err(damaged)?;
        let expected = from.sum.value();
        let mut sum = [0; 8];
        from.inner.read_exact(&mut sum).map_err(damaged)?;
        if u64::from_le_bytes(sum) != expected {
            return Err(no("the film file is damaged: its checksum is wrong"));
        }
        match from.inner.read(&mut [0]) {
            Ok(0) => Ok(read),
            _ => Err(no("the film file is damaged: something follows its end")),
        }
    }

    /// Refuses a film that belongs to something else than `identity`.
    ///
    /// # Errors
    /// Usage, with the first difference.
    pub fn belongs_to(&self, identity: &Identity, path: &Path) -> Result<()> {
        match self.identity.difference(identity) {
            None => Ok(()),
            Some(what) => Err(Error::usage(format!("{}: its film is of another picture: {what}", path.display()))),
        }
    }
}

impl Header {
    /// The empty film that the header asks for, where it makes sense and `bytes` of file can fill it.
    fn film(&self, path: &Path, bytes: u64) -> Result<Film> {
        let no = |what: &str| Error::file(path, "read", format!("the film file is damaged: {what}"));
        if self.window.is_empty() || !Window::full(self.resolution).contains(self.window) {
            return Err(no("its window leaves the picture"));
        }
        if self.window.area() as u128 * Sums::LEAST_BYTES as u128 > u128::from(bytes) {
            return Err(Error::file(path, "read", "the film file is cut short: it is too small for its picture"));
        }
        let ordered = self.ranges.windows(2).all(|w| w[0].end < w[1].start && !w[1].is_empty());
        let passes: u64 = self.ranges.iter().map(|r| u64::from(r.end.saturating_sub(r.start))).sum();
        if !ordered
            || self.ranges.is_empty()
            || self.ranges.len() > MOST_RANGES
            || self.ranges.iter().any(|r| r.end < r.start)
            || (self.ranges.len() > 1 && self.ranges[0].is_empty())
            || passes > u64::from(Film::MOST_PASSES)
        {
            return Err(no("its passes are in disorder"));
        }
        let all = u128::from(passes) * self.window.area() as u128;
        let c = self.counts;
        if u128::from(c.samples) + u128::from(c.non_finite) > all || c.negative > c.samples {
            return Err(no("its counts are larger than its passes allow"));
        }
        if self.hash != format!("{:016x}", self.identity.hash()) {
            return Err(no("its hash is not that of its scene and options"));
        }
        Film::new(self.resolution, self.window).map_err(|e| e.within(path.display()))
    }
}

/// A hash of bytes, to notice damage, not malice.
#[derive(Clone, Copy, Default)]
struct Checksum {
    state: u64,
    word: u64,
    bytes: u64,
}

impl Checksum {
    fn update(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.word = self.word << 8 | u64::from(byte);
            self.bytes += 1;
            if self.bytes.is_multiple_of(8) {
                self.state = hash_combine(self.state, self.word);
                self.word = 0;
            }
        }
    }

    fn value(&self) -> u64 {
        hash_combine(hash_combine(self.state, self.word), self.bytes)
    }
}

/// The number that ends a film file with these bytes before it: for tests of what reads the rest.
pub fn checksum(bytes: &[u8]) -> u64 {
    let mut sum = Checksum::default();
    sum.update(bytes);
    sum.value()
}

/// Reads or writes and sums up what goes by.
struct Summing<T> {
    inner: T,
    sum: Checksum,
}

impl<W: Write> Write for Summing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<R: Read> Read for Summing<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(bytes)?;
        self.sum.update(&bytes[..read]);
        Ok(read)
    }
}
