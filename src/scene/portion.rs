//! Which part of a mesh file an object is: `part`, or an entry of `materials`, in place of all of it.

use super::tree::{Fields, Node};
use crate::error::{Error, Result, did_you_mean};
use crate::geometry::{Label, PartKind, Parts, RawMesh};
use crate::words::{counted, first_of};
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

/// The key of `materials` for all parts that it does not name.
const REST: &str = "*";

/// What of a mesh file is the object.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Portion {
    /// All of it.
    #[default]
    Whole,
    /// What has this name: one object, group or material of the file.
    Part(String),
    /// What one entry of `materials` names.
    Entry {
        /// Its key; `None` of `"*"`.
        key: Option<String>,
        /// All keys of the table but `"*"`.
        keys: Arc<[String]>,
        /// Whether `"*"` is among them.
        has_rest: bool,
    },
}

/// An object that an entry of the scene file asks for.
pub(super) struct Asked {
    pub portion: Portion,
    /// What follows the entry's name in the object's.
    pub suffix: String,
    /// The name of its material.
    pub material: String,
}

/// What the `material`, `part` and `materials` of an entry ask for: one object, or one for each part.
pub(super) fn read(o: &Fields<'_>) -> Result<Vec<Asked>> {
    const NAME: &str = "the name of a [material.NAME]";
    const PART: &str = "the name of an object, a group or a material of the mesh file";
    let text = |n: &Node| n.text().filter(|t| !t.is_empty()).map(String::from);
    if let Some(key) = ["part", "materials"].into_iter().find(|key| o.has(key) && o.has("shape")) {
        return Err(o.error_at(key, "is of mesh files, and a `shape` has no parts; remove it"));
    }
    let Some(table) = o.table("materials")? else {
        let material = o.need("material", NAME, |n| n.text().map(String::from))?;
        let portion = o.get("part", PART, text)?.map_or(Portion::Whole, Portion::Part);
        return Ok(vec![Asked { portion, suffix: String::new(), material }]);
    };
    if let Some(key) = ["material", "part"].into_iter().find(|key| o.has(key)) {
        return Err(o.error_at(key, "stands beside `materials`, which names parts and their materials; remove one"));
    }
    let keys: Arc<[String]> = table.keys().filter(|key| *key != REST).map(String::from).collect();
    let has_rest = table.has(REST);
    if keys.is_empty() {
        let what = "names no part; expected { NAME = \"material\", ... }, or `material` for all of the mesh";
        return Err(o.error_at("materials", what));
    }
    let entry = |key: &str| {
        let material = table.need(key, NAME, |n| n.text().map(String::from))?;
        let named = Some(key).filter(|key| *key != REST).map(String::from);
        let portion = Portion::Entry { key: named, keys: keys.clone(), has_rest };
        Ok(Asked { portion, suffix: format!("/{key}"), material })
    };
    table.keys().map(entry).collect()
}

impl Portion {
    /// The triangles of `mesh`, which was read from `path`, that are the object; `at` is where it says so.
    ///
    /// # Errors
    /// A scene error of a name that the file does not have, has for different faces, or has and gives no material.
    pub(super) fn of(&self, mesh: &RawMesh, path: &Path) -> Result<RawMesh> {
        let found = self.find(mesh).map_err(|what| Error::scene(format!("{}: {what}", path.display())))?;
        if found.triangles.is_empty() {
            return Err(Error::scene(format!("{}: the part has no triangles; leave it out", path.display())));
        }
        Ok(found)
    }

    fn find(&self, mesh: &RawMesh) -> std::result::Result<RawMesh, String> {
        let parts = &mesh.parts;
        match self {
            Self::Whole => Ok(RawMesh { parts: Parts::default(), ..mesh.clone() }),
            Self::Part(name) => {
                let has = |label: &Label| PartKind::ALL.iter().any(|kind| label.names(*kind).any(|n| n == name));
                if !parts.labels().iter().any(has) {
                    return Err(format!("no part {name:?}{}", there_are(parts, name, &PartKind::ALL)));
                }
                if let [first, .., last] = parts.ambiguous(name)[..] {
                    let [a, b] = [first, last].map(|kind| kind.noun()[0]);
                    let remedy = "give one another name in the modelling program";
                    return Err(format!("{name:?} is the name of a {a} and of a {b} of other faces; {remedy}"));
                }
                Ok(mesh.portion(has))
            }
            Self::Entry { key, keys, has_rest } => {
                let kinds = parts.kinds();
                let has = |label: &Label, name: &str| kinds.iter().any(|kind| label.names(*kind).any(|n| n == name));
                let named = |label: &Label| keys.iter().filter(|key| has(label, key)).count();
                if let Some(missing) = keys.iter().find(|key| !parts.labels().iter().any(|label| has(label, key))) {
                    return Err(format!("no part {missing:?}{}", there_are(parts, missing, kinds)));
                }
                if parts.labels().iter().any(|label| named(label) > 1) {
                    let twice = "`materials` names some faces twice, by their object and by a group, or by two groups";
                    return Err(format!("{twice}; name each once"));
                }
                let left: Vec<&Label> = parts.labels().iter().filter(|label| named(label) == 0).collect();
                if !left.is_empty() && !has_rest {
                    return Err(format!(
                        "`materials` has none for {}; name them, or give \"*\" one",
                        without(mesh, &left, kinds)
                    ));
                }
                if left.is_empty() && key.is_none() {
                    return Err("`materials` names all parts of the file, and leaves none for \"*\"; remove it".into());
                }
                Ok(mesh.portion(|label| match key {
                    Some(key) => has(label, key),
                    None => named(label) == 0,
                }))
            }
        }
    }
}

/// The names of the labels in `left`, and how many triangles have none.
fn without(mesh: &RawMesh, left: &[&Label], kinds: &[PartKind]) -> String {
    let mut seen = HashSet::new();
    let names = left.iter().flat_map(|label| kinds.iter().flat_map(|kind| label.names(*kind)));
    let mut out: Vec<String> = names.filter(|name| seen.insert(*name)).map(|name| format!("{name:?}")).collect();
    let nameless = |label: &Label| kinds.iter().all(|kind| label.names(*kind).next().is_none());
    let triangles = mesh.parts.count(mesh.triangles.len(), nameless);
    if triangles > 0 {
        out.insert(0, counted(triangles, "triangle without a name", "triangles without a name"));
    }
    first_of(&out, 12)
}

/// The names that there are in place of `typed`.
fn there_are(parts: &Parts, typed: &str, kinds: &[PartKind]) -> String {
    let lists = kinds.iter().map(|kind| (kind, parts.names(*kind))).filter(|(_, names)| !names.is_empty());
    let say = |(kind, names): (&PartKind, Vec<&str>)| {
        let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
        format!("the {} {}", kind.noun()[usize::from(names.len() != 1)], first_of(&quoted, 24))
    };
    let all: Vec<&str> = kinds.iter().flat_map(|kind| parts.names(*kind)).collect();
    match lists.map(say).collect::<Vec<_>>() {
        none if none.is_empty() => ": the file has no parts; leave out the key".into(),
        some => format!("{}; there are {}", did_you_mean(typed, all), some.join(", ")),
    }
}

/// That a mesh of several parts is one object, and how to take it apart.
pub(super) fn joined(parts: &Parts, material: &str) -> Option<String> {
    let lists = PartKind::ALL.map(|kind| (kind, parts.names(kind)));
    let (kind, names) = lists.iter().find(|(_, names)| names.len() > 1)?;
    let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
    let key = match kind {
        _ if parts.kinds().contains(kind) => {
            format!("`materials = {{ {} = {material:?}, \"*\" = {material:?} }}`, or ", quoted[0])
        }
        _ => String::new(),
    };
    Some(format!(
        "its {} {} ({}) are one object of the material {material:?}; to take them apart, give {key}`part = {}` beside `material` to one \
         object for each",
        names.len(),
        kind.noun()[1],
        first_of(&quoted, 4),
        quoted[0]
    ))
}
