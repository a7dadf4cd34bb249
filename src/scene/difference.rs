//! Where two scenes differ, in the words of whoever typed one of them.

use super::tree::{Node, Origin, Value};
use std::collections::{HashMap, HashSet};

/// The first value that two scenes do not share.
pub(super) struct Difference<'a> {
    /// Dotted, as options take it: `camera.fov`, `object.0.radius`.
    key: String,
    /// Where the value was typed in the first scene, or the table that lacks it.
    pub place: &'a Origin,
    values: [Option<String>; 2],
}

impl Difference<'_> {
    /// The key with both values; `here` and `there` say whose they are.
    pub fn values(&self, here: &str, there: &str) -> String {
        let one = |value: &Option<String>| value.clone().unwrap_or("not set".into());
        format!("`{}` is {} {here}, {} {there}", self.key, one(&self.values[0]), one(&self.values[1]))
    }
}

/// The first value of `here`, in its order, that `there` does not have; else the first that only `there` has.
pub(super) fn first<'a>(here: &'a Node, there: &Node) -> Option<Difference<'a>> {
    between(String::new(), here, there)
}

/// The first difference of two scenes as TOML, of which neither was typed so.
pub fn difference(a: &str, b: &str, [of_a, of_b]: [&str; 2]) -> Option<String> {
    let parse = |text| Node::parse(text, std::path::Path::new("")).ok();
    let (a, b) = (parse(a)?, parse(b)?);
    first(&a, &b).map(|found| found.values(of_a, of_b))
}

fn between<'a>(key: String, here: &'a Node, there: &Node) -> Option<Difference<'a>> {
    let inside = |name: &str| if key.is_empty() { name.to_string() } else { format!("{key}.{name}") };
    let differ = |key: String, place: &'a Origin, values: [Option<&Node>; 2]| {
        Some(Difference { key, place, values: values.map(|node| node.map(Node::shown)) })
    };
    let only_here = |key: String, node: &'a Node| {
        let (key, node) = first_value(key, node);
        differ(key, &node.place, [Some(node), None])
    };
    let only_there = |key: String, node: &Node| {
        let (key, node) = first_value(key, node);
        differ(key, &here.place, [None, Some(node)])
    };
    match (&here.value, &there.value) {
        (Value::Table(ours), Value::Table(theirs)) => {
            let known: HashMap<&str, &Node> = theirs.iter().map(|(name, node)| (name.as_str(), node)).collect();
            let have: HashSet<&str> = ours.iter().map(|(name, _)| name.as_str()).collect();
            let of = |(name, node): &'a (String, Node)| match known.get(name.as_str()) {
                Some(other) => between(inside(name), node, other),
                None => only_here(inside(name), node),
            };
            let lacks = |(name, _): &&(String, Node)| !have.contains(name.as_str());
            let missing = || theirs.iter().find(lacks).and_then(|(name, node)| only_there(inside(name), node));
            ours.iter().find_map(of).or_else(missing)
        }
        (Value::List(ours), Value::List(theirs)) if of_tables(ours) && of_tables(theirs) => {
            let pairs = ours.iter().zip(theirs).zip(0_usize..);
            pairs.into_iter().find_map(|((a, b), i)| between(inside(&i.to_string()), a, b)).or_else(|| {
                let at = ours.len().min(theirs.len());
                match (ours.get(at), theirs.get(at)) {
                    (Some(node), _) => only_here(inside(&at.to_string()), node),
                    (None, Some(node)) => only_there(inside(&at.to_string()), node),
                    (None, None) => None,
                }
            })
        }
        (a, b) => (!a.same(b)).then(|| differ(key, &here.place, [Some(here), Some(there)])).flatten(),
    }
}

/// The first value of a table that the other scene lacks.
fn first_value(mut key: String, mut node: &Node) -> (String, &Node) {
    while let Value::Table(entries) = &node.value
        && let Some((name, inner)) = entries.first()
    {
        (key, node) = (format!("{key}.{name}"), inner);
    }
    (key, node)
}

fn of_tables(list: &[Node]) -> bool {
    list.iter().all(|node| matches!(node.value, Value::Table(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(a: &str, b: &str) -> Option<String> {
        difference(a, b, ["here", "there"])
    }

    #[test]
    fn the_first_difference_is_named_by_its_key() {
        let a = "unit = \"mm\"\n[camera]\nfov = 30\nup = [0, 1, 0]\n[[object]]\nname = \"a\"\n";
        assert_eq!(told(a, a), None);
        let fov = told(a, &a.replace("30", "31"));
        assert_eq!(fov.as_deref(), Some("`camera.fov` is 30 here, 31 there"));
        let up = told(a, &a.replace("[0, 1, 0]", "[0, 1, 1]"));
        assert_eq!(up.as_deref(), Some("`camera.up` is [0, 1, 0] here, [0, 1, 1] there"));
        let missing = told(a, &a.replace("fov = 30\n", ""));
        assert_eq!(missing.as_deref(), Some("`camera.fov` is 30 here, not set there"));
        let more = told(&a.replace("fov = 30\n", ""), a);
        assert_eq!(more.as_deref(), Some("`camera.fov` is not set here, 30 there"));
        let object = told(a, &format!("{a}[[object]]\nname = \"b\"\n"));
        assert_eq!(object.as_deref(), Some("`object.1.name` is not set here, the text \"b\" there"));
        assert_eq!(told("a = 1", "a = 1.0").as_deref(), Some("`a` is 1 here, 1.0 there"));
        assert_eq!(told("a = nan", "a = nan"), None);
    }

    #[test]
    fn of_a_missing_table_the_first_value_is_named() {
        let told = told("a = 1\n", "a = 1\n[method]\nmodel = \"beam\"\n");
        assert_eq!(told.as_deref(), Some("`method.model` is not set here, the text \"beam\" there"));
    }

    #[test]
    fn order_is_no_difference() {
        assert_eq!(told("a = 1\n[b]\nc = 2\nd = 3\n", "b = { d = 3, c = 2 }\na = 1\n"), None);
    }
}
