//! What is odd about the lines of an OBJ file, in one sentence for each kind.

use crate::words::{counted, either};

/// Lines that are read in part or not at all: how many, and the first.
#[derive(Default)]
pub(super) struct OddLines {
    /// Free-form curves and surfaces.
    pub curved: Seen<String>,
    /// Lines that call for other files or for commands.
    pub calls: Seen<String>,
    /// Lines whose first word is none of OBJ's.
    pub unknown: Seen<String>,
    /// Vertices with a fourth number other than 1.
    pub weighted: Seen<f64>,
    /// Vertices with numbers that are neither a weight nor colours.
    pub further: Seen<usize>,
    /// Faces with normals at some of their corners.
    pub half_shaded: Seen<()>,
}

/// How often something was seen, and what and where first.
pub(super) struct Seen<T> {
    count: usize,
    first: Option<(T, usize)>,
}

impl<T> Default for Seen<T> {
    fn default() -> Self {
        Self { count: 0, first: None }
    }
}

impl<T> Seen<T> {
    pub(super) fn count(&mut self, what: impl FnOnce() -> T, line: usize) {
        self.count += 1;
        self.first.get_or_insert_with(|| (what(), line));
    }

    /// A sentence of the number, what was first and its line.
    fn say(&self, sentence: impl FnOnce(usize, &T, usize) -> String) -> Option<String> {
        self.first.as_ref().map(|(what, line)| sentence(self.count, what, *line))
    }
}

/// What OBJ has besides vertices, normals and faces, and that is not geometry.
pub(super) const KNOWN: &[&str] = &[
    "vt",
    "vp",
    "s",
    "mg",
    "usemap",
    "mtllib",
    "maplib",
    "cstype",
    "deg",
    "bmat",
    "step",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
];

/// Other files, and commands of the system.
pub(super) const CALLS: &[&str] = &["call", "csh"];

/// Free-form geometry, the patches of version 2 included.
pub(super) const CURVED: &[&str] = &["curv", "curv2", "surf", "bzp", "bsp", "cdc", "cdp", "res"];

impl OddLines {
    /// What there is to say; besides, points and lines were `ignored`, and `unused` normals belong to no face: `None` where
    /// some face has normals, and each object tells which of its triangles have none.
    pub(super) fn remarks(&self, ignored: usize, unused: Option<usize>) -> impl Iterator<Item = String> {
        [
            (ignored > 0).then(|| {
                let what = counted(
                    ignored,
                    "point, line or face with fewer than three corners is",
                    "points, lines or faces with fewer than three corners are",
                );
                format!("{what} left out")
            }),
            self.curved.say(|n, word, line| {
                let what = counted(n, "free-form curve or surface is", "free-form curves or surfaces are");
                format!(
                    "{what} left out (the first, `{word}`, in line {line}): only polygons are \
                     read; convert them in the modelling program"
                )
            }),
            self.calls.say(|n, word, line| {
                format!(
                    "{n} lines call for other files or for commands (the first, `{word}`, in line {line}) and are left out: what \
                     they would bring is missing"
                )
            }),
            self.unknown.say(|n, word, line| {
                let (what, are) = (counted(n, "line begins", "lines begin"), either(n, "is", "are"));
                format!("{what} with a word that OBJ does not have (the first, `{word}`, in line {line}) and {are} left out")
            }),
            self.weighted.say(|n, value, line| {
                let what = counted(n, "vertex has", "vertices have");
                format!(
                    "{what} a fourth number other than 1 (the first, {value}, in line {line}). It is the weight of \
                     free-form curves and moves no corner of a polygon: vertices were not divided by their fourth number"
                )
            }),
            self.further.say(|n, further, line| {
                let what = counted(n, "vertex has", "vertices have");
                format!("{what} further numbers ({further} after x y z in line {line}), which are not read")
            }),
            unused.and(self.half_shaded.say(|n, (), line| {
                let (what, are) = (counted(n, "face has", "faces have"), either(n, "is", "are"));
                format!("{what} normals at some corners only (the first in line {line}) and {are} shaded flat")
            })),
            unused
                .filter(|&n| n > 0 && self.half_shaded.count == 0)
                .map(|n| if n == 1 { "its one normal".into() } else { format!("any of its {n} normals") })
                .map(|which| format!("no face refers to {which}: it is shaded flat; set `normals`")),
        ]
        .into_iter()
        .flatten()
    }
}
