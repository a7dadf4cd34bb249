//! STL files, in text and binary: triangles that share no corners, joined where these are at exactly one place.

use super::RawMesh;
use super::builder::Builder;
use super::counted_bytes::CountedBytes;
use super::loading::{Budget, MAX_COUNT};
use crate::error::Result;
use crate::math::DVec3;
use crate::words::{counted, either};
use std::collections::HashMap;
use std::io::BufRead;
use std::path::Path;

/// Bytes that tell text from binary: the header of a binary file and its first triangles.
const HEAD: u64 = 512;

/// Reads an STL file; see [`super::load_mesh`]. It has no texture coordinates, and the normals of its facets, which are those of
/// the triangles, are only compared with them. Text may have several solids.
pub(super) fn read(source: Box<dyn BufRead + '_>, path: &Path, uv: bool) -> Result<RawMesh> {
    let mut file = CountedBytes::new(source, path);
    let head = file.peek(HEAD)?;
    if head.is_empty() {
        return Err(file.wrong("no faces: the file is empty; export the surface as triangles"));
    }
    // Binary files may begin with `solid` too: then there are zeros in their first numbers.
    let word = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head).trim_ascii_start().get(..5);
    let is_text = word.is_some_and(|w| w.eq_ignore_ascii_case(b"solid")) && !head.contains(&0);
    let mut stl = Stl {
        file,
        number_at: HashMap::new(),
        builder: Builder::new(uv, "in line"),
        budget: Budget::new(false),
        against: 0,
        first_against: 0,
        remarks: Vec::new(),
    };
    if is_text {
        stl.text()?
    } else {
        stl.binary()?
    }
    let Stl { against, first_against, .. } = stl;
    if against > 0 {
        let n = counted(against, "triangle runs", "triangles run");
        let (own, first) = (either(against, "its own normal", "their own normals"), first_against);
        let place = if is_text { "in line" } else { "number" };
        stl.remarks
            .push(format!("{n} round against {own} (the first {place} {first}): the outside is told by the corners"));
    }
    if stl.builder.count() == 0 {
        return Err(stl.file.wrong("no faces: there is no triangle; export the surface again"));
    }
    let mut mesh = stl.builder.finish();
    mesh.remarks.splice(0..0, stl.remarks);
    Ok(mesh)
}

struct Stl<'a> {
    file: CountedBytes<'a>,
    /// The vertex at a place, by the bits of its coordinates.
    number_at: HashMap<[u64; 3], u32>,
    builder: Builder,
    budget: Budget,
    /// Triangles that look to the other side than their own normal, and the place of the first.
    against: usize,
    first_against: usize,
    remarks: Vec<String>,
}

impl Stl<'_> {
    fn binary(&mut self) -> Result<()> {
        let mut head = [0; 84];
        if !self.file.fill(&mut head)? {
            let what = "the file is shorter than the 84 bytes before the first triangle; is it an STL file?";
            return Err(self.file.wrong(what));
        }
        let count = u32::from_le_bytes([head[80], head[81], head[82], head[83]]);
        let mut record = [0; 50];
        for i in 0..count {
            if !self.file.fill(&mut record)? {
                let of = format!("the file ends after {i} of {count} triangles (byte {})", self.file.at());
                return Err(self.file.wrong(format!("{of}; copy or export it again")));
            }
            let number = |at: usize| {
                let b = 4 * at;
                f64::from(f32::from_le_bytes([record[b], record[b + 1], record[b + 2], record[b + 3]]))
            };
            let [normal, a, b, c] = [0, 3, 6, 9].map(|at| DVec3::new(number(at), number(at + 1), number(at + 2)));
            if ![a, b, c].iter().all(|p| p.is_finite()) {
                let at = self.file.at();
                let what = format!("triangle {i} (before byte {at}) has a corner that is not finite");
                return Err(self.file.wrong(format!("{what}; mend it or export again")));
            }
            self.triangle(Some(normal), [a, b, c], i as usize)?;
        }
        if self.file.has_more()? {
            let at = self.file.at();
            self.remarks.push(format!("what follows the last triangle (from byte {at} on) is not read"));
        }
        Ok(())
    }

    fn text(&mut self) -> Result<()> {
        const ORDER: &str = "expected `facet`, three `vertex x y z` and `endfacet`";
        let mut corners: Vec<DVec3> = Vec::with_capacity(3);
        let (mut normal, mut in_facet, mut in_solid) = (None, false, false);
        while let Some(line) = self.file.next_line()? {
            let line = line.trim_start_matches('\u{feff}');
            let mut words = line.split_ascii_whitespace();
            let Some(word) = words.next() else { continue };
            let word = word.to_ascii_lowercase();
            let numbers = |words: &mut dyn Iterator<Item = &str>| {
                let mut next = || words.next().and_then(|word| word.parse::<f64>().ok());
                Some(DVec3::new(next()?, next()?, next()?))
            };
            match (word.as_str(), in_facet) {
                ("solid", false) => in_solid = true,
                ("endsolid", false) => in_solid = false,
                ("facet", false) => {
                    normal = words.next().and_then(|_| numbers(&mut words));
                    (in_facet, in_solid) = (true, true);
                    corners.clear();
                }
                ("outer" | "endloop", true) => {}
                ("vertex", true) => {
                    let p = numbers(&mut words).filter(|_| words.next().is_none());
                    let Some(p) = p else {
                        let what = format!("no vertex in `{}`; expected `vertex x y z`", super::shown(line));
                        return Err(self.file.wrong_line(what));
                    };
                    if !p.is_finite() {
                        let what = format!("a vertex that is not finite in `{}`", super::shown(line));
                        return Err(self.file.wrong_line(format_args!("{what}; mend it or export again")));
                    }
                    corners.push(p);
                    if corners.len() > 3 {
                        return Err(self.file.wrong_line("a facet of more than three corners; cut it into triangles"));
                    }
                }
                ("endfacet", true) => {
                    let &[a, b, c] = &corners[..] else {
                        let n = counted(corners.len(), "corner", "corners");
                        return Err(self.file.wrong_line(format_args!("a facet of {n}; export again")));
                    };
                    in_facet = false;
                    self.triangle(normal, [a, b, c], self.file.line())?;
                }
                _ => {
                    let what = format!("`{}` is out of place in an STL file; {ORDER}", super::shown(line));
                    return Err(self.file.wrong_line(what));
                }
            }
        }
        if in_facet {
            return Err(self.file.wrong_line("the file ends within a facet; copy or export it again"));
        }
        if in_solid {
            self.remarks.push("it ends without `endsolid`: it may be cut short".into());
        }
        Ok(())
    }

    /// Adds a triangle at place number `place`; its own normal is compared with its corners.
    fn triangle(&mut self, normal: Option<DVec3>, corners: [DVec3; 3], place: usize) -> Result<()> {
        if self.builder.count().max(self.builder.vertices.positions.len()) >= MAX_COUNT {
            return Err(self.file.wrong("2^31 triangles or corners; split the mesh"));
        }
        let [a, b, c] = corners;
        let turned = (b - a).cross(c - a);
        // Not of slivers, whose normals are rounding.
        if normal.is_some_and(|n| n.dot(turned) < -0.1 * n.length() * turned.length()) {
            self.against += 1;
            if self.against == 1 {
                self.first_against = place;
            }
        }
        let positions = &mut self.builder.vertices.positions;
        let numbers = corners.map(|p| {
            // + 0.0 makes -0 and 0 one place.
            *self.number_at.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
        });
        let count = positions.len();
        self.builder.face(&numbers, None, place);
        self.budget.check(self.builder.count().max(count)).map_err(|e| self.file.within(e))
    }
}
