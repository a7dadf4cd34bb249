//! The bytes and lines of a mesh file, counted, so that every complaint can name its place.

use super::loading::MAX_LINE;
use crate::error::{Error, Result};
use std::io::{self, BufRead, Read};
use std::path::Path;

/// A file being read: where it is, and what is wrong there.
pub(super) struct CountedBytes<'a> {
    source: Box<dyn BufRead + 'a>,
    path: &'a Path,
    /// Bytes read.
    at: u64,
    /// Lines read.
    line: usize,
    /// The end of a line: a line feed, or a carriage return alone.
    line_end: u8,
    text: String,
}

impl<'a> CountedBytes<'a> {
    pub(super) fn new(source: Box<dyn BufRead + 'a>, path: &'a Path) -> Self {
        Self { source, path, at: 0, line: 0, line_end: b'\n', text: String::new() }
    }

    /// Number of the last line read, from 1.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// Bytes read so far.
    pub(super) fn at(&self) -> u64 {
        self.at
    }

    /// The first bytes, up to `most`, which stay to be read; what lines end in is told by them.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn peek(&mut self, most: u64) -> Result<Vec<u8>> {
        let mut head = Vec::new();
        let source = std::mem::replace(&mut self.source, Box::new(io::empty()));
        let mut limited = source.take(most);
        let read = limited.read_to_end(&mut head);
        read.map_err(|e| Error::file(self.path, "read", e))?;
        let first = head.iter().position(|b| matches!(b, b'\n' | b'\r'));
        if first.is_some_and(|at| head[at] == b'\r' && head.get(at + 1) != Some(&b'\n')) {
            self.line_end = b'\r';
        }
        self.source = Box::new(io::Cursor::new(head.clone()).chain(limited.into_inner()));
        Ok(head)
    }

    /// The next line, without its end; `None` at the end of the file. What is not UTF-8 becomes the replacement character.
    ///
    /// # Errors
    /// What the system says; a scene error of a line longer than 16 MiB.
    pub(super) fn next_line(&mut self) -> Result<Option<&str>> {
        let mut raw = std::mem::take(&mut self.text).into_bytes();
        raw.clear();
        let mut limited = self.source.by_ref().take(MAX_LINE as u64 + 1);
        let n = limited.read_until(self.line_end, &mut raw).map_err(|e| Error::file(self.path, "read", e))?;
        if n == 0 {
            return Ok(None);
        }
        (self.at, self.line) = (self.at + n as u64, self.line + 1);
        if n > MAX_LINE {
            return Err(self.wrong_line("a line of more than 16 MiB; is it a mesh file?"));
        }
        while raw.last().is_some_and(|b| matches!(b, b'\n' | b'\r')) {
            raw.pop();
        }
        self.text = String::from_utf8(raw).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned());
        Ok(Some(&self.text))
    }

    /// The last line read.
    pub(super) fn current(&self) -> &str {
        &self.text
    }

    /// Fills `into`; false where the file ends before.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn fill(&mut self, into: &mut [u8]) -> Result<bool> {
        match self.source.read_exact(into) {
            Ok(()) => {
                self.at += into.len() as u64;
                Ok(true)
            }
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            Err(e) => Err(Error::file(self.path, "read", e)),
        }
    }

    /// Whether anything but blanks is left.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn has_more(&mut self) -> Result<bool> {
        loop {
            let buffer = self.source.fill_buf().map_err(|e| Error::file(self.path, "read", e))?;
            let length = buffer.len();
            if length == 0 || !buffer.iter().all(|b| b.is_ascii_whitespace() || *b == 0) {
                return Ok(length > 0);
            }
            self.source.consume(length);
        }
    }

    /// A scene error about the last line.
    pub(super) fn wrong_line(&self, what: impl std::fmt::Display) -> Error {
        Error::scene(format!("{}:{}: {what}", self.path.display(), self.line))
    }

    /// A scene error about the file.
    pub(super) fn wrong(&self, what: impl std::fmt::Display) -> Error {
        Error::scene(format!("{}: {what}", self.path.display()))
    }

    /// The same error, about the file.
    pub(super) fn within(&self, error: Error) -> Error {
        error.within(self.path.display())
    }
}
