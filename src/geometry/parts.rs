//! The parts of a mesh file: which of its triangles are of which object, group and material.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// What a file calls some of its faces.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Label {
    /// Its object: `o` of OBJ, a node of glTF.
    pub object: Option<String>,
    /// Its groups: `g` of OBJ, which may name several; a mesh of glTF.
    pub groups: Vec<String>,
    /// Its material: `usemtl` of OBJ, a material of glTF.
    pub material: Option<String>,
}

/// Which name of a [`Label`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// [`Label::material`].
    Material,
    /// [`Label::object`].
    Object,
    /// [`Label::groups`].
    Group,
}

impl PartKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Material, Self::Object, Self::Group];

    /// The noun.
    pub fn noun(self) -> [&'static str; 2] {
        match self {
            Self::Material => ["material", "materials"],
            Self::Object => ["object", "objects"],
            Self::Group => ["group", "groups"],
        }
    }
}

impl Label {
    /// Its names of one kind.
    pub fn names(&self, kind: PartKind) -> impl Iterator<Item = &str> {
        let (one, many): (Option<&String>, &[String]) = match kind {
            PartKind::Material => (self.material.as_ref(), &[]),
            PartKind::Object => (self.object.as_ref(), &[]),
            PartKind::Group => (None, &self.groups),
        };
        one.into_iter().chain(many).map(String::as_str)
    }
}

/// The labels of a mesh's triangles, as runs: most files change them seldom.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// Each once, in the order of the file.
    labels: Vec<Label>,
    /// The first triangle of a run, and the label of all up to the next run.
    runs: Vec<(u32, u32)>,
}

impl Parts {
    /// Of these labels, and runs by their first triangles, the first of which is 0.
    pub(super) fn new(labels: Vec<Label>, runs: Vec<(u32, u32)>) -> Self {
        Self { labels, runs }
    }

    /// The names of one kind, each once, in the order of the file.
    pub fn names(&self, kind: PartKind) -> Vec<&str> {
        let mut seen = HashSet::new();
        self.labels.iter().flat_map(|label| label.names(kind)).filter(|name| seen.insert(*name)).collect()
    }

    /// The kinds that parts are told apart by: materials where the file has any, else objects and groups.
    pub fn kinds(&self) -> &'static [PartKind] {
        if self.labels.iter().any(|label| label.material.is_some()) {
            &[PartKind::Material]
        } else {
            &[PartKind::Object, PartKind::Group]
        }
    }

    /// Whether every label that `test` takes by one kind is one it takes by the other.
    fn agree(&self, [a, b]: [PartKind; 2], name: &str) -> bool {
        self.labels.iter().all(|l| l.names(a).any(|n| n == name) == l.names(b).any(|n| n == name))
    }

    /// The kinds that have `name`, where these are of different faces; empty if the name has one meaning or none.
    pub fn ambiguous(&self, name: &str) -> Vec<PartKind> {
        let has = |kind: &PartKind| self.names(*kind).contains(&name);
        let kinds: Vec<PartKind> = PartKind::ALL.into_iter().filter(has).collect();
        let differ = kinds.windows(2).any(|pair| !self.agree([pair[0], pair[1]], name));
        if differ { kinds } else { Vec::new() }
    }

    /// Each label that a face has, once, in the order of the file.
    pub fn labels(&self) -> &[Label] {
        &self.labels
    }

    /// How many of the mesh's `all` triangles have a label that `keep` takes.
    pub fn count(&self, all: usize, keep: impl Fn(&Label) -> bool) -> usize {
        self.spans(all, keep).map(|span| span.len()).sum()
    }

    /// The runs of triangles, of `all`, whose label `keep` takes, which is asked once of each label.
    pub(super) fn spans(&self, all: usize, keep: impl Fn(&Label) -> bool) -> impl Iterator<Item = Range<usize>> {
        let kept: Vec<bool> = self.labels.iter().map(keep).collect();
        let ends = self.runs.iter().skip(1).map(|(first, _)| *first as usize).chain([all]);
        let runs = self.runs.iter().zip(ends);
        runs.filter(move |((_, label), _)| kept[*label as usize]).map(|((first, _), end)| *first as usize..end)
    }
}

/// Labels that faces are given one by one, as a file is read.
#[derive(Default)]
pub(super) struct Labelled {
    known: HashMap<Label, u32>,
    labels: Vec<Label>,
    runs: Vec<(u32, u32)>,
    /// Letters of all labels: what they take of memory.
    letters: usize,
    /// The label of the next faces, and whether the last run has another.
    pub next: Label,
    changed: bool,
}

impl Labelled {
    /// What the next faces are called.
    pub(super) fn change(&mut self, change: impl FnOnce(&mut Label)) {
        change(&mut self.next);
        self.changed = true;
    }

    /// Face number `face` is called so.
    pub(super) fn face(&mut self, face: usize) {
        if !self.changed && !self.runs.is_empty() {
            return;
        }
        self.changed = false;
        let number = *self.known.entry(self.next.clone()).or_insert_with(|| {
            let names = PartKind::ALL.iter().flat_map(|kind| self.next.names(*kind));
            self.letters += 2 * names.map(|name| name.len() + 64).sum::<usize>();
            self.labels.push(self.next.clone());
            self.labels.len() as u32 - 1
        });
        if self.runs.last().is_none_or(|(_, last)| *last != number) {
            self.runs.push((face as u32, number));
        }
    }

    /// About what the names take of memory, in triangles' worth.
    pub(super) fn weight(&self) -> usize {
        self.letters / super::loading::LOADING_BYTES
    }

    /// Faces and labels of the runs.
    pub(super) fn runs(&self) -> &[(u32, u32)] {
        &self.runs
    }

    /// The labels, each once.
    pub(super) fn labels(&self) -> &[Label] {
        &self.labels
    }

    /// Of a mesh whose faces were numbered by their triangles.
    pub(super) fn into_parts(self) -> Parts {
        Parts::new(self.labels, self.runs)
    }
}
