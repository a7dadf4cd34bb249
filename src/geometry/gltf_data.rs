//! The numbers of a glTF file: buffers beside it, in it or in its text, and accessors, which say what is where in them.

use super::gltf_json::{Accessor, Root};
use super::loading::require_bytes;
use crate::error::{Error, Result};
use crate::input;
use std::path::{Path, PathBuf};

/// The buffers of a file, each read when it is first asked for.
pub(super) struct Data<'a> {
    root: &'a Root,
    path: &'a Path,
    /// What a GLB file has beside its JSON: its buffer 0.
    binary: Option<&'a [u8]>,
    buffers: Vec<Option<Vec<u8>>>,
}

/// How many numbers one element of an accessor has.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    name: &'static str,
    size: usize,
}

pub(super) const SCALAR: Kind = Kind { name: "SCALAR", size: 1 };
pub(super) const VEC2: Kind = Kind { name: "VEC2", size: 2 };
pub(super) const VEC3: Kind = Kind { name: "VEC3", size: 3 };

/// A type of numbers.
#[derive(Clone, Copy)]
struct Number {
    bytes: usize,
    read: fn(&[u8]) -> f64,
    /// What stands for 1 where an accessor is normalized.
    one: f64,
    is_index: bool,
}

fn number(component_type: u32) -> Option<Number> {
    let of = |bytes, read: fn(&[u8]) -> f64, one, is_index| Some(Number { bytes, read, one, is_index });
    match component_type {
        5120 => of(1, |b| (b[0] as i8).into(), 127.0, false),
        5121 => of(1, |b| b[0].into(), 255.0, true),
        5122 => of(2, |b| i16::from_le_bytes([b[0], b[1]]).into(), 32767.0, false),
        5123 => of(2, |b| u16::from_le_bytes([b[0], b[1]]).into(), 65535.0, true),
        5125 => of(4, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(), 4_294_967_295.0, true),
        5126 => of(4, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(), 1.0, false),
        _ => None,
    }
}

impl<'a> Data<'a> {
    pub(super) fn new(root: &'a Root, path: &'a Path, binary: Option<&'a [u8]>) -> Self {
        Self { root, path, binary, buffers: root.buffers.iter().map(|_| None).collect() }
    }

    fn wrong(&self, what: impl std::fmt::Display) -> Error {
        Error::scene(format!("{}: {what}", self.path.display()))
    }

    /// Elements of accessor `index`, each of as many numbers as `kind` says; as an index, with `as_index`.
    ///
    /// # Errors
    /// A scene error that names the accessor if it is of another kind, sparse, or of bytes that are not there; of a buffer, as
    /// [`input::read_all`].
    pub(super) fn elements<const N: usize>(
        &mut self,
        index: usize,
        kind: Kind,
        as_index: bool,
    ) -> Result<Vec<[f64; N]>> {
        let Some(accessor) = self.root.accessors.get(index) else {
            return Err(
                self.wrong(format_args!("no accessor {index}: there are {}; export again", self.root.accessors.len()))
            );
        };
        let wrong = |what: String| Error::scene(format!("{}: accessor {index}: {what}", self.path.display()));
        if accessor.sparse.is_some() {
            return Err(wrong("it is sparse, which is not read; export without sparse accessors".into()));
        }
        let found = number(accessor.component_type).filter(|n| n.is_index || !as_index);
        let (Some(number), true) = (found, accessor.kind == kind.name && kind.size == N) else {
            let (a, b) = (&accessor.kind, accessor.component_type);
            let what = format!("it is {a} of component type {b}; expected {} of a known type", kind.name);
            return Err(wrong(format!("{what}{}; export again", if as_index { " of indices" } else { "" })));
        };
        let (size, path) = (N * number.bytes, self.path);
        let (bytes, stride) = self.bytes(accessor, size, &wrong)?;
        let scale = if accessor.normalized && number.one != 1.0 { number.one } else { 1.0 };
        let of = |element: &[u8]| {
            std::array::from_fn(|i| {
                let value = (number.read)(&element[i * number.bytes..]);
                // The least of a signed type is a little below -1.
                if scale == 1.0 { value } else { (value / scale).max(-1.0) }
            })
        };
        require_bytes(bytes.len() / size * size_of::<[f64; N]>()).map_err(|e| e.within(path.display()))?;
        // The last element may end before a whole stride.
        Ok(bytes.chunks(stride).map(|element| of(&element[..size])).collect())
    }

    /// The bytes of an accessor with elements of `size` bytes, and how far apart these begin; every chunk of them holds one.
    fn bytes(&mut self, accessor: &Accessor, size: usize, wrong: &dyn Fn(String) -> Error) -> Result<(&[u8], usize)> {
        let view = accessor.buffer_view.map(|view| (view, self.root.buffer_views.get(view)));
        let (view_index, view) = match view {
            Some((index, Some(view))) => (index, view),
            Some((index, None)) => return Err(wrong(format!("no buffer view {index}; export again"))),
            None => return Err(wrong("it has no buffer view, and so no numbers; export again".into())),
        };
        let stride = view.byte_stride.unwrap_or(size as u64);
        if stride < size as u64 || stride > 252 {
            return Err(wrong(format!("buffer view {view_index} has a stride of {stride} bytes; export again")));
        }
        let length = match accessor.count.checked_sub(1) {
            None => 0,
            Some(last) => last.saturating_mul(stride).saturating_add(size as u64),
        };
        let (first, end) = (accessor.byte_offset, accessor.byte_offset.saturating_add(length));
        if end > view.byte_length {
            let what = format!("it ends {end} bytes into buffer view {view_index}, which has {}", view.byte_length);
            return Err(wrong(format!("{what}; export again")));
        }
        let buffer = self.buffer(view.buffer)?;
        let all = buffer.len();
        let range = usize::try_from(view.byte_offset.saturating_add(first)).ok().zip(usize::try_from(length).ok());
        let bytes = range.and_then(|(from, length)| buffer.get(from..)?.get(..length));
        let cut = || format!("buffer {} ends before it, after {all} bytes; copy or export it again", view.buffer);
        Ok((bytes.ok_or_else(|| wrong(cut()))?, stride as usize))
    }

    fn buffer(&mut self, index: usize) -> Result<&[u8]> {
        let Some(buffer) = self.root.buffers.get(index) else {
            return Err(self.wrong(format_args!("no buffer {index}; export again")));
        };
        let Some(uri) = &buffer.uri else {
            return self.binary.filter(|_| index == 0).ok_or_else(|| {
                self.wrong(format_args!("buffer {index} is not in the file, and has no uri; copy or export it again"))
            });
        };
        if self.buffers[index].is_none() {
            self.buffers[index] = Some(self.load(index, uri, buffer.byte_length)?);
        }
        Ok(self.buffers[index].as_deref().unwrap_or_default())
    }

    fn load(&self, index: usize, uri: &str, length: u64) -> Result<Vec<u8>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let text = data.split_once(";base64,").map(|(_, text)| text);
            let bytes = text.and_then(from_base64);
            return bytes
                .ok_or_else(|| self.wrong(format_args!("the data of buffer {index} are no base64; export again")));
        }
        let Some(file) = file_of(uri, self.path) else {
            let at = super::shown(uri);
            return Err(self.wrong(format!("buffer {index} is elsewhere ({at}); save it as a file beside it")));
        };
        let bytes = input::read_all(&file, 3).map_err(|e| e.within(self.path.display()))?;
        if (bytes.len() as u64) < length {
            let n = bytes.len();
            return Err(self.wrong(format!("{uri:?} has {n} bytes of {length}; copy or export it again")));
        }
        Ok(bytes)
    }
}

/// The file that a uri of the glTF file at `path` names; `None` where it is data, or elsewhere.
pub(super) fn file_of(uri: &str, path: &Path) -> Option<PathBuf> {
    let is_scheme = |s: &str| s.len() > 1 && s.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b));
    let elsewhere = uri.split_once(':').is_some_and(|(scheme, _)| is_scheme(scheme));
    (!elsewhere).then(|| path.parent().unwrap_or(Path::new("")).join(unescaped(uri)))
}

/// The text with `%20` and the like as the characters that they stand for.
fn unescaped(uri: &str) -> String {
    let (mut out, mut rest) = (Vec::new(), uri.as_bytes());
    while let Some((first, after)) = rest.split_first() {
        let digits = after.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        match digits.and_then(|two| u8::from_str_radix(two, 16).ok()) {
            Some(byte) if *first == b'%' => {
                out.push(byte);
                rest = &after[2..];
            }
            _ => {
                out.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// The bytes that base64 stands for; `None` if it is none.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut count) = (0_u32, 0);
    for byte in text {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        (bits, count) = (bits << 6 | u32::from(value), count + 6);
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
        }
    }
    Some(out)
}
