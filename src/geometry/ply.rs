//! PLY files, in text and binary of both byte orders: the elements `vertex` and `face`.

use super::RawMesh;
use super::builder::Builder;
use super::counted_bytes::CountedBytes;
use super::loading::{Budget, MAX_COUNT};
use super::ply_header::{Element, Encoding, Header, Number, read as read_header};
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::words::{counted, either};
use std::io::BufRead;
use std::path::Path;

/// More corners than any real polygon has; a length beyond it is damage.
const MOST_CORNERS: f64 = (1 << 24) as f64;

/// Bytes of a list that are read at once: its length is not trusted.
const CHUNK: usize = 1 << 12;

/// Names of the two texture coordinates of a vertex.
const UV: [[&str; 2]; 4] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

/// Reads a PLY file; see [`super::load_mesh`]. With `uv` texture coordinates of vertices are kept, or those that faces bring
/// corner by corner (`texcoord`).
pub(super) fn read(source: Box<dyn BufRead + '_>, path: &Path, uv: bool) -> Result<RawMesh> {
    let mut file = CountedBytes::new(source, path);
    file.peek(1 << 12)?;
    let header = read_header(&mut file)?;
    let place = if header.encoding == Encoding::Ascii { "in line" } else { "at face" };
    let mut ply = Ply {
        encoding: header.encoding,
        row: Vec::new(),
        lists: Default::default(),
        bytes: Vec::new(),
        budget: Budget::new(uv),
        builder: Builder::new(uv, place),
        few_corners: 0,
        file,
    };
    let mut remarks = unread(&header);
    refuse(&ply.file, &header)?;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => ply.vertices(element, uv)?,
            "face" => ply.faces(element, uv)?,
            _ => (0..element.count).try_for_each(|i| ply.element(element, i, [None; 2]))?,
        }
    }
    if ply.builder.count() == 0 {
        let vertices = counted(ply.builder.vertices.positions.len(), "vertex", "vertices");
        let remedy = "a cloud of points has no surface: make a mesh of it, and export polygons";
        return Err(ply.file.wrong(format_args!("no faces: {vertices}; {remedy}")));
    }
    if ply.few_corners > 0 {
        let what = counted(
            ply.few_corners,
            "face with fewer than three corners is",
            "faces with fewer than three corners are",
        );
        remarks.push(format!("{what} left out"));
    }
    if ply.file.has_more()? {
        remarks.push(format!("what follows the last element (from byte {} on) is not read", ply.file.at()));
    }
    let mut mesh = ply.builder.finish();
    mesh.remarks.splice(0..0, remarks);
    Ok(mesh)
}

/// Refuses what has no vertices, no faces, or these in another order.
fn refuse(file: &CountedBytes<'_>, header: &Header) -> Result<()> {
    let at = |name: &str| header.elements.iter().position(|e| e.name == name);
    if let Some(strips) = header.elements.iter().find(|e| e.name == "tristrips" && e.count > 0) {
        let what =
            format_args!("element {:?}: strips of triangles are not read; export polygons (`face`)", strips.name);
        return Err(file.wrong(what));
    }
    match (at("vertex"), at("face")) {
        (Some(vertex), Some(face)) if face < vertex => {
            Err(file.wrong("its faces come before its vertices, which is not read; export again"))
        }
        (None, _) => Err(file.wrong("no element `vertex` in the header; export again")),
        _ => Ok(()),
    }
}

/// What of each vertex and face, and which other elements, are not read.
fn unread(header: &Header) -> Vec<String> {
    let mut out = Vec::new();
    for element in header.elements.iter().filter(|e| e.count > 0) {
        let known: &[&str] = match element.name.as_str() {
            "vertex" => &["x", "y", "z", "nx", "ny", "nz"],
            "face" => &["vertex_indices", "vertex_index", "texcoord", "texnumber"],
            name => {
                out.push(format!(
                    "its {} of the kind {name:?} are not read",
                    counted(element.count, "element", "elements")
                ));
                continue;
            }
        };
        let is_uv = |name: &str| element.name == "vertex" && UV.iter().flatten().any(|uv| *uv == name);
        let names = element.properties.iter().map(|p| p.name.as_str());
        let names: Vec<&str> = names.filter(|name| !known.contains(name) && !is_uv(name)).collect();
        if !names.is_empty() {
            let colours = names.iter().any(|name| name.contains("red"));
            out.push(format!(
                "{} of each {} {} not read{}",
                names.join(", "),
                element.name,
                either(names.len(), "is", "are"),
                if colours { ": colours come from the materials of the scene file" } else { "" }
            ));
        }
    }
    out
}

struct Ply<'a> {
    file: CountedBytes<'a>,
    encoding: Encoding,
    /// Of the element read last, a number for each property; of a list its length.
    row: Vec<f64>,
    /// Of the element read last, the lists that were asked for.
    lists: [Vec<f64>; 2],
    bytes: Vec<u8>,
    budget: Budget,
    builder: Builder,
    few_corners: usize,
}

impl Ply<'_> {
    fn vertices(&mut self, element: &Element, uv: bool) -> Result<()> {
        let scalar = |name: &str| element.find(&[name]).filter(|&i| element.properties[i].length.is_none());
        let all = |names: &[&str]| names.iter().map(|name| scalar(name)).collect::<Option<Vec<usize>>>();
        let Some(position) = all(&["x", "y", "z"]) else {
            return Err(self.file.wrong("element `vertex` has no x, y and z in the header; export again"));
        };
        let normal = all(&["nx", "ny", "nz"]);
        let uv = UV.iter().find_map(|names| all(names)).filter(|_| uv);
        for i in 0..element.count {
            self.element(element, i, [None; 2])?;
            let vector = |at: &[usize]| DVec3::new(self.row[at[0]], self.row[at[1]], self.row[at[2]]);
            let p = vector(&position);
            if !p.is_finite() {
                return Err(self.wrong(element, i, "a position that is not finite; mend it or export again"));
            }
            if let Some(normal) = &normal {
                let n = vector(normal);
                if !n.is_finite() {
                    return Err(self.wrong(element, i, "a normal that is not finite; mend it or export again"));
                }
                self.builder.vertices.normals.push(super::unit_or_zero(n));
            }
            if let Some(uv) = &uv {
                self.builder.vertices.uv.push([self.row[uv[0]] as f32, self.row[uv[1]] as f32]);
            }
            self.builder.vertices.positions.push(p);
            self.fits(element, i, self.builder.vertices.positions.len())?;
        }
        Ok(())
    }

    fn faces(&mut self, element: &Element, uv: bool) -> Result<()> {
        if element.count == 0 {
            return Ok(());
        }
        let list = |names: &[&str]| element.find(names).filter(|&i| element.properties[i].length.is_some());
        let Some(corners_at) = list(&["vertex_indices", "vertex_index"]) else {
            return Err(self.file.wrong("element `face` has no list `vertex_indices` in the header; export again"));
        };
        // Coordinates of vertices serve first.
        let uv_at = list(&["texcoord"]).filter(|_| uv && self.builder.vertices.uv.is_empty());
        let count = self.builder.vertices.positions.len();
        let (mut corners, mut of_corners) = (Vec::<u32>::new(), Vec::<[f32; 2]>::new());
        for i in 0..element.count {
            self.element(element, i, [Some(corners_at), uv_at])?;
            corners.clear();
            for &typed in &self.lists[0] {
                if !(typed >= 0.0 && typed < count as f64 && typed.fract() == 0.0) {
                    let what = format!("vertex number {typed}, but there {} {count}", either(count, "is", "are"));
                    return Err(self.wrong(element, i, &format!("{what}, counted from 0; export again")));
                }
                corners.push(typed as u32);
            }
            if corners.len() < 3 {
                self.few_corners += 1;
                continue;
            }
            of_corners.clear();
            of_corners.extend(self.lists[1].chunks_exact(2).map(|uv| [uv[0] as f32, uv[1] as f32]));
            let own = uv_at.map(|_| &of_corners[..]).map(|uv| if uv.len() == corners.len() { uv } else { &[] });
            let place = if self.encoding == Encoding::Ascii { self.file.line() } else { i as usize };
            self.builder.face(&corners, own, place);
            self.fits(element, i, self.builder.count())?;
        }
        Ok(())
    }

    /// That there may be `count` vertices or triangles.
    fn fits(&mut self, element: &Element, number: u64, count: usize) -> Result<()> {
        if count >= MAX_COUNT {
            return Err(self.wrong(element, number, "2^31 entries; split the mesh"));
        }
        self.budget.check(count).map_err(|e| self.file.within(e))
    }

    /// Reads element number `number`, and of it the lists at the places `wanted`.
    fn element(&mut self, element: &Element, number: u64, wanted: [Option<usize>; 2]) -> Result<()> {
        self.row.clear();
        self.lists.iter_mut().for_each(Vec::clear);
        if self.encoding == Encoding::Ascii {
            self.line(element, number, wanted)
        } else {
            self.record(element, number, wanted)
        }
    }

    /// One line of text.
    fn line(&mut self, element: &Element, number: u64, wanted: [Option<usize>; 2]) -> Result<()> {
        loop {
            match self.file.next_line()? {
                None => return Err(self.cut_short(element, number)),
                Some(line) if line.trim_ascii().is_empty() => {}
                Some(_) => break,
            }
        }
        let (row, lists) = (&mut self.row, &mut self.lists);
        let mut words = self.file.current().split_ascii_whitespace();
        let mut next = || {
            let word = words.next().ok_or_else(|| "fewer numbers than the header says".to_string())?;
            word.parse::<f64>().map_err(|_| format!("`{}` is no number", super::shown(word)))
        };
        let mut read = || -> std::result::Result<(), String> {
            for (at, property) in element.properties.iter().enumerate() {
                let value = next()?;
                row.push(value);
                if property.length.is_none() {
                    continue;
                }
                if let Some(what) = wrong_length(value) {
                    return Err(what);
                }
                let place = wanted.iter().position(|w| *w == Some(at));
                for _ in 0..value as u64 {
                    let value = next()?;
                    place.into_iter().for_each(|place| lists[place].push(value));
                }
            }
            Ok(())
        };
        let result = read();
        if let Err(what) =
            result.and_then(|()| words.next().map_or(Ok(()), |_| Err("more numbers than the header says".into())))
        {
            return Err(self.wrong(element, number, &format!("{what}; export again")));
        }
        Ok(())
    }

    /// One record of bytes.
    fn record(&mut self, element: &Element, number: u64, wanted: [Option<usize>; 2]) -> Result<()> {
        let mut at = 0;
        while at < element.properties.len() {
            // Numbers up to the next list, at once.
            let run = &element.properties[at..];
            let run = &run[..run.iter().position(|p| p.length.is_some()).unwrap_or(run.len())];
            if !run.is_empty() {
                self.bytes.resize(run.iter().map(|p| p.number.size()).sum(), 0);
                self.fill(element, number)?;
                let mut rest = &self.bytes[..];
                for property in run {
                    self.row.push(property.number.of(rest, self.encoding));
                    rest = &rest[property.number.size()..];
                }
                at += run.len();
                continue;
            }
            let (length, value) = (element.properties[at].length.unwrap_or(Number::U8), element.properties[at].number);
            self.bytes.resize(length.size(), 0);
            self.fill(element, number)?;
            let count = length.of(&self.bytes, self.encoding);
            self.row.push(count);
            let place = wanted.iter().position(|w| *w == Some(at));
            if let Some(what) = wrong_length(count) {
                return Err(self.wrong(element, number, &format!("{what}; export again")));
            }
            let mut left = count as usize * value.size();
            while left > 0 {
                self.bytes.resize(left.min(CHUNK), 0);
                self.fill(element, number)?;
                left -= self.bytes.len();
                if let Some(place) = place {
                    let values = self.bytes.chunks_exact(value.size()).map(|bytes| value.of(bytes, self.encoding));
                    self.lists[place].extend(values);
                }
            }
            at += 1;
        }
        Ok(())
    }

    fn fill(&mut self, element: &Element, number: u64) -> Result<()> {
        if self.file.fill(&mut self.bytes)? { Ok(()) } else { Err(self.cut_short(element, number)) }
    }

    fn cut_short(&self, element: &Element, number: u64) -> Error {
        let of = format!("the file ends after {number} of {} elements {:?}", element.count, element.name);
        self.file.wrong(format_args!("{of} (byte {}); copy or export it again", self.file.at()))
    }

    /// What is wrong with an element, which was read last.
    fn wrong(&self, element: &Element, number: u64, what: &str) -> Error {
        let name = &element.name;
        match self.encoding {
            Encoding::Ascii => self.file.wrong_line(format_args!("{name} {number}: {what}")),
            _ => self.file.wrong(format_args!("{name} {number} (before byte {}): {what}", self.file.at())),
        }
    }
}

/// What is wrong with the length of a list, if anything.
fn wrong_length(length: f64) -> Option<String> {
    let good = (0.0..=MOST_CORNERS).contains(&length) && length.fract() == 0.0;
    (!good).then(|| format!("a list of {length}: its length is damaged"))
}
