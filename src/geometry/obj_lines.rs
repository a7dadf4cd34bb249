//! The lines of an OBJ file on their way to `tobj`: counted, so that a complaint can name one, and reduced to what we
//! use, so that neither a bad texture index, a Latin-1 comment nor a missing MTL file stops a mesh.

use super::loading::{Budget, MAX_COUNT, MAX_LINE};
use super::obj_remarks::{CALLS, CURVED, KNOWN, OddLines};
use super::parts::{Label, Labelled};
use super::{CornerUv, shown};
use crate::Error;
use crate::words::either;
use std::io::{self, BufRead, Read};

/// Texture coordinates as they are typed. tobj, which refuses a file for one bad number, does not see them.
#[derive(Default)]
pub(super) struct TypedUv {
    /// What is no finite number is NaN.
    values: Vec<[f32; 2]>,
    /// For each corner of each face the number of its coordinates, from 1; 0 of one without.
    corners: Vec<u32>,
}

impl TypedUv {
    /// Of the triangle whose corners have these places among those of all faces; `None` if one of them is without.
    pub(super) fn of(&self, corners: [usize; 3]) -> Option<CornerUv> {
        let at = |corner: usize| {
            let uv = self.values.get((self.corners[corner] as usize).checked_sub(1)?)?;
            uv.iter().all(|x| x.is_finite()).then_some(*uv)
        };
        Some([at(corners[0])?, at(corners[1])?, at(corners[2])?])
    }

    /// `vt u`, `vt u v` or `vt u v w`.
    fn add(&mut self, text: &str) {
        let mut numbers = text.split('#').next().unwrap_or_default().split_whitespace().skip(1);
        let mut number = || numbers.next().map(|word| word.parse::<f64>().map_or(f32::NAN, |v| v as f32));
        self.values.push([number().unwrap_or(f32::NAN), number().unwrap_or(0.0)]);
    }

    fn add_corner(&mut self, typed: Option<i64>) {
        let count = self.values.len() as i64;
        let number =
            typed.map_or(0, |typed| if typed < 0 { count.saturating_add(typed).saturating_add(1) } else { typed });
        self.corners.push(u32::try_from(number).unwrap_or(0));
    }

    /// Whether any corner has coordinates.
    pub(super) fn is_used(&self) -> bool {
        self.corners.iter().any(|&number| number > 0)
    }
}

/// Hands on `v`, `vn` and `f` lines alone; indices come out absolute, checked, without texture coordinates.
pub(super) struct ObjLines<R> {
    source: R,
    /// The line being handed on, and how much of it is gone.
    out: String,
    taken: usize,
    /// Number of the last line read, from 1.
    line: usize,
    /// The last line ended in a carriage return: a line feed after it is no line of its own.
    after_return: bool,
    vertices: usize,
    normals: usize,
    /// Of all faces, cut into triangles.
    triangles: usize,
    /// Largest positive index that had no vertex or normal yet, with its line: a file may define them later.
    forward: [Option<(usize, usize)>; 2],
    has_normals: Vec<bool>,
    polygon_lines: Vec<usize>,
    /// Where they are asked for.
    uv: Option<TypedUv>,
    /// Which object, group and material faces are of.
    labelled: Labelled,
    ignored: usize,
    odd: OddLines,
    complaint: Option<(usize, String)>,
    failed: Option<io::Error>,
    budget: Budget,
    out_of_memory: Option<Error>,
}

impl<R: BufRead> ObjLines<R> {
    /// With `uv` texture coordinates are kept.
    pub(super) fn new(source: R, uv: bool) -> Self {
        Self {
            source,
            out: String::new(),
            taken: 0,
            line: 0,
            after_return: false,
            vertices: 0,
            normals: 0,
            triangles: 0,
            forward: [None; 2],
            has_normals: Vec::new(),
            polygon_lines: Vec::new(),
            uv: uv.then(TypedUv::default),
            labelled: Labelled::default(),
            ignored: 0,
            odd: OddLines::default(),
            complaint: None,
            failed: None,
            budget: Budget::new(uv),
            out_of_memory: None,
        }
    }

    /// Number of the last line handed on.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// The last line handed on.
    pub(super) fn current(&self) -> &str {
        &self.out
    }

    pub(super) fn vertices(&self) -> usize {
        self.vertices
    }

    /// Points, lines, and faces with fewer than three corners.
    pub(super) fn ignored(&self) -> usize {
        self.ignored
    }

    /// For each face, whether all its corners had a normal.
    pub(super) fn has_normals(&self) -> &[bool] {
        &self.has_normals
    }

    /// The lines of the faces with more than three corners.
    pub(super) fn polygon_lines(&self) -> &[usize] {
        &self.polygon_lines
    }

    /// Which object, group and material faces are of.
    pub(super) fn labelled(&self) -> &Labelled {
        &self.labelled
    }

    /// Texture coordinates, where they are asked for.
    pub(super) fn uv(&self) -> Option<&TypedUv> {
        self.uv.as_ref()
    }

    /// What a user should hear of who expects the file to be shown as it is.
    pub(super) fn remarks(&self) -> impl Iterator<Item = String> {
        let unused = (!self.has_normals.contains(&true)).then_some(self.normals);
        self.odd.remarks(self.ignored, unused)
    }

    /// That the mesh is more than what is available, if it is.
    pub(super) fn out_of_memory(&mut self) -> Option<Error> {
        self.out_of_memory.take()
    }

    /// Whether there is memory to read on: as much again as what has been read needs.
    fn fits(&mut self, count: usize) -> bool {
        self.out_of_memory = self.budget.check(count).err();
        self.out_of_memory.is_none()
    }

    /// Why the source could not be read, if it could not.
    pub(super) fn failed_read(&mut self) -> Option<io::Error> {
        self.failed.take()
    }

    /// The first thing wrong with a line itself, with its number.
    pub(super) fn complaint(&mut self) -> Option<(usize, String)> {
        self.complaint.take()
    }

    /// The largest index that no line up to the end defines, with the number of its line. Ask when all are read.
    pub(super) fn never_defined(&self) -> Option<(usize, String)> {
        let counts = [("vertex", self.vertices), ("normal", self.normals)];
        self.forward.iter().zip(counts).find_map(|(forward, (name, count))| {
            let (index, line) = (*forward)?;
            (index > count).then(|| (line, out_of_range(name, index as i64, count)))
        })
    }

    /// The bytes up to the next line end, which may be a line feed, a carriage return or both, added to `raw`; false at
    /// the end of the file.
    fn read_to_line_end(&mut self, raw: &mut Vec<u8>) -> io::Result<bool> {
        let mut any = false;
        loop {
            let buffer = match self.source.fill_buf() {
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                buffer => buffer?,
            };
            let Some(first) = buffer.first() else {
                self.line += usize::from(any);
                return Ok(any);
            };
            if std::mem::take(&mut self.after_return) && *first == b'\n' {
                self.source.consume(1);
                continue;
            }
            any = true;
            let end = buffer.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            let taken = end.unwrap_or(buffer.len()).min(MAX_LINE + 1 - raw.len());
            raw.extend_from_slice(&buffer[..taken]);
            if raw.len() > MAX_LINE {
                self.line += 1;
                self.complaint = Some((self.line, "a line of more than 16 MiB; is it an OBJ file?".into()));
                return Ok(false);
            }
            self.after_return = end.is_some_and(|end| buffer[end] == b'\r');
            self.source.consume(taken + usize::from(end.is_some()));
            if end.is_some() {
                self.line += 1;
                return Ok(true);
            }
        }
    }

    /// One line of the source into `raw`, `\` at its end joining the next; false at the end of the file. A comment ends
    /// with its line: the paths in them may end in `\`.
    fn read_line(&mut self, raw: &mut Vec<u8>) -> io::Result<bool> {
        raw.clear();
        loop {
            let start = raw.len();
            if !self.read_to_line_end(raw)? {
                return Ok(start > 0 && self.complaint.is_none());
            }
            if self.line == 1 && is_utf_16(raw) {
                let what = "the file is UTF-16 text; save it as UTF-8 or plain ASCII";
                self.complaint = Some((1, what.into()));
                return Ok(false);
            }
            while raw.last().is_some_and(u8::is_ascii_whitespace) {
                raw.pop();
            }
            if raw.last() != Some(&b'\\') || raw.trim_ascii_start().starts_with(b"#") {
                return Ok(true);
            }
            raw.pop();
            raw.push(b' ');
        }
    }

    /// The next line that matters into `out`; leaves it empty at the end or at a complaint.
    fn advance(&mut self) -> io::Result<()> {
        let mut raw = Vec::new();
        self.taken = 0;
        self.out.clear();
        while self.out.is_empty() && self.read_line(&mut raw)? {
            let words = raw.trim_ascii();
            // Some programs begin with a byte order mark.
            let words = words.strip_prefix(b"\xef\xbb\xbf").filter(|_| self.line == 1).unwrap_or(words);
            let keyword = words.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            match keyword {
                b"l" | b"p" => self.ignored += 1,
                b"o" | b"g" | b"usemtl" => self.label(&String::from_utf8_lossy(words)),
                b"vt" if self.uv.is_some() => {
                    if let Some(uv) = &mut self.uv {
                        uv.add(&String::from_utf8_lossy(words));
                        let count = uv.values.len();
                        if !self.fits(count) {
                            return Ok(());
                        }
                    }
                }
                // `fo` is the face of version 2.
                b"v" | b"vn" | b"f" | b"fo" => {
                    // Anything but UTF-8 is no number; the replacement character makes tobj say so.
                    let text = String::from_utf8_lossy(words);
                    let checked =
                        if keyword[0] == b'f' { self.face(&text) } else { self.vector(&text, keyword == b"v") };
                    let count = self.vertices.max(self.normals).max(self.triangles).max(self.labelled.weight());
                    let fits =
                        || if count < MAX_COUNT { Ok(()) } else { Err("2^31 entries; split the mesh".to_string()) };
                    if let Err(what) = checked.and_then(|()| fits()) {
                        self.complaint = Some((self.line, what));
                        self.out.clear();
                        return Ok(());
                    }
                    if !self.fits(count) {
                        self.out.clear();
                        return Ok(());
                    }
                }
                b"" => {}
                _ if keyword[0] == b'#' => {}
                _ => {
                    let (is, line) = (|words: &[&str]| words.iter().any(|w| w.as_bytes() == keyword), self.line);
                    let word = || shown(&String::from_utf8_lossy(keyword));
                    if is(CURVED) {
                        self.odd.curved.count(word, line);
                    } else if is(CALLS) {
                        self.odd.calls.count(word, line);
                    } else if !is(KNOWN) {
                        self.odd.unknown.count(word, line);
                    }
                }
            }
        }
        Ok(())
    }

    /// What faces are called from here on. A line without a name ends the last one's.
    fn label(&mut self, text: &str) {
        let (keyword, rest) = text.split_at(text.find(|c: char| c.is_ascii_whitespace()).unwrap_or(text.len()));
        let name = Some(rest.trim()).filter(|name| !name.is_empty()).map(String::from);
        self.labelled.change(|label: &mut Label| match keyword {
            "o" => label.object = name,
            "usemtl" => label.material = name,
            _ => label.groups = rest.split_whitespace().map(String::from).collect(),
        });
    }

    /// A vertex or normal: finite, its three numbers alone.
    fn vector(&mut self, text: &str, is_vertex: bool) -> Result<(), String> {
        // A comment, but not the end of `1.#IND`, as an old compiler writes what is no number.
        let comment = text.match_indices('#').find(|(at, _)| !text[..*at].ends_with('.'));
        let words = || text[..comment.map_or(text.len(), |(at, _)| at)].split_whitespace();
        for word in words().skip(1).take(3) {
            let lower = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
            let named = lower.starts_with("nan") || lower.starts_with("inf") || lower.contains('#');
            if named || word.parse::<f64>().is_ok_and(|v| !v.is_finite()) {
                let what = if is_vertex { "vertex" } else { "normal" };
                return Err(format!("a {what} that is not finite in `{}`; mend it or export again", shown(text)));
            }
        }
        if is_vertex {
            self.vertices += 1;
            // x y z r g b, as scanners write it, is common and says nothing about the shape.
            let further = words().skip(4).map(str::parse::<f64>).collect::<Result<Vec<_>, _>>();
            match further.map_err(|_| format!("no vertex in `{}`; expected numbers after `v`", shown(text)))?[..] {
                [] | [_, _, _] => {}
                [1.0] => {}
                [weight] => self.odd.weighted.count(|| weight, self.line),
                ref further => self.odd.further.count(|| further.len(), self.line),
            }
        } else {
            self.normals += 1;
        }
        for word in words().take(4) {
            self.out.push_str(word);
            self.out.push(' ');
        }
        self.out.push('\n');
        Ok(())
    }

    /// A face with absolute indices, `v` or `v//vn`.
    fn face(&mut self, text: &str) -> Result<(), String> {
        let malformed =
            || format!("no face in `{}`; expected `f` and vertex numbers v, v/vt, v//vn or v/vt/vn", shown(text));
        let before_comment = text.split('#').next().unwrap_or_default();
        let corners = before_comment.split_whitespace().skip(1).map(|word| {
            let mut parts = word.split('/');
            let mut part = || match parts.next() {
                None | Some("") => Ok(None),
                Some(number) => number.parse::<i64>().map(Some).map_err(|_| malformed()),
            };
            let (v, vt, vn) = (part()?.ok_or_else(malformed)?, part()?, part()?);
            if parts.next().is_some() {
                return Err(malformed());
            }
            Ok((v, vt, vn))
        });
        let corners = corners.collect::<Result<Vec<_>, String>>()?;
        if corners.is_empty() {
            return Err(malformed());
        }
        if corners.len() < 3 {
            self.ignored += 1;
            return Ok(());
        }
        let with_normals = corners.iter().all(|(_, _, vn)| vn.is_some());
        let mut out = std::mem::take(&mut self.out);
        out.push('f');
        for (v, vt, vn) in &corners {
            self.uv.iter_mut().for_each(|uv| uv.add_corner(*vt));
            let v = self.resolve(0, *v)?;
            out.push_str(&format!(" {v}"));
            if let Some(vn) = *vn
                && with_normals
            {
                let vn = self.resolve(1, vn)?;
                out.push_str(&format!("//{vn}"));
            }
        }
        out.push('\n');
        self.out = out;
        self.triangles += corners.len() - 2;
        self.labelled.face(self.has_normals.len());
        self.has_normals.push(with_normals);
        if !with_normals && corners.iter().any(|(_, _, vn)| vn.is_some()) {
            self.odd.half_shaded.count(|| (), self.line);
        }
        if corners.len() > 3 {
            self.polygon_lines.push(self.line);
        }
        Ok(())
    }

    /// The absolute index, from 1, of a typed one.
    fn resolve(&mut self, kind: usize, typed: i64) -> Result<usize, String> {
        let (name, count) = [("vertex", self.vertices), ("normal", self.normals)][kind];
        let index = if typed < 0 { (count as i64).saturating_add(typed).saturating_add(1) } else { typed };
        if index < 1 || index > i64::from(u32::MAX) {
            return Err(out_of_range(name, typed, count));
        }
        let index = index as usize;
        if index > count && self.forward[kind].is_none_or(|(largest, _)| index > largest) {
            self.forward[kind] = Some((index, self.line));
        }
        Ok(index)
    }
}

/// By its mark, or by the zero bytes that letters and blanks have in it.
fn is_utf_16(line: &[u8]) -> bool {
    match line {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        [a, 0, b, 0, ..] | [0, a, 0, b, ..] => *a != 0 && *b != 0,
        _ => false,
    }
}

fn out_of_range(name: &str, typed: i64, count: usize) -> String {
    if typed == 0 {
        return format!("{name} number 0 in a face; OBJ counts from 1");
    }
    format!(
        "{name} number {typed} in a face, but there {} {count}; export again, or mend the number",
        either(count, "is", "are")
    )
}

impl<R: BufRead> Read for ObjLines<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let n = available.len().min(into.len());
        into[..n].copy_from_slice(&available[..n]);
        self.consume(n);
        Ok(n)
    }
}

impl<R: BufRead> BufRead for ObjLines<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.out.len()
            && self.complaint.is_none()
            && self.failed.is_none()
            && let Err(e) = self.advance()
        {
            self.failed = Some(e);
        }
        Ok(&self.out.as_bytes()[self.taken..])
    }

    fn consume(&mut self, n: usize) {
        self.taken += n;
    }
}
