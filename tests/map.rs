//! Imports point down: a room uses only rooms of lower rows, and rooms of one row do not know each other.
#![allow(clippy::unwrap_used)] // a test that cannot read its files has failed

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The map of docs/design.md.
const ROWS: &[(&str, u32)] = &[
    ("cli", 9),
    ("render", 8),
    ("report", 8),
    ("integrator", 7),
    ("cache", 6),
    ("light", 5),
    ("scene", 4),
    ("query", 3),
    ("bssrdf", 3),
    ("film", 3),
    ("surface", 3),
    ("geometry", 2),
    ("optics", 2),
    ("sampling", 2),
    ("math", 1),
    ("memory", 1),
    ("input", 1),
    ("error", 1),
    ("tally", 1),
    ("words", 1),
];

fn row(room: &str) -> Option<u32> {
    ROWS.iter().find(|(name, _)| *name == room).map(|(_, row)| *row)
}

fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

/// Names that follow `crate::` or `marmor::` outside comments, braces opened: `crate::{a::B, c}` gives a and c.
fn rooms_used(source: &str) -> BTreeSet<String> {
    let code: String = source.lines().map(|l| l.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
    let mut used = BTreeSet::new();
    for (start, prefix) in code.match_indices("crate::").chain(code.match_indices("marmor::")) {
        let rest = &code[start + prefix.len()..];
        if let Some(list) = rest.strip_prefix('{') {
            let (mut depth, mut item) = (0, String::new());
            for c in list.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => {
                        used.insert(first_word(&item));
                        item.clear();
                        continue;
                    }
                    _ => {}
                }
                item.push(c);
            }
            used.insert(first_word(&item));
        } else {
            used.insert(first_word(rest));
        }
    }
    used
}

fn first_word(text: &str) -> String {
    text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[test]
fn imports_point_down() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    let mut wrong = Vec::new();
    for file in files {
        let inside = file.strip_prefix(&src).unwrap();
        let room = inside.iter().next().unwrap().to_string_lossy().trim_end_matches(".rs").to_string();
        if room == "main" || room == "lib" {
            continue;
        }
        let own = row(&room).unwrap_or_else(|| panic!("{} is in no row of the map", file.display()));
        for used in rooms_used(&std::fs::read_to_string(&file).unwrap()) {
            if let Some(other) = row(&used)
                && used != room
                && (other >= own)
                && !(own == 1 && (used == "error" || (room == "input" && used == "memory")))
            {
                wrong.push(format!("{}: `{room}` (row {own}) uses `{used}` (row {other})", inside.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "imports must point down:\n{}", wrong.join("\n"));
}

/// `a::{b, c::D}` as `a::b` and `a::c::D`.
fn leaves(tree: &str, before: &str, out: &mut Vec<String>) {
    let tree = tree.trim();
    let Some(open) = tree.find('{') else {
        let name = tree.split(" as ").next().unwrap_or("").trim();
        if !name.is_empty() {
            out.push(format!("{before}{name}"));
        }
        return;
    };
    let before = format!("{before}{}", &tree[..open]);
    let (mut depth, mut item) = (0, String::new());
    for c in tree[open + 1..tree.rfind('}').unwrap()].chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if c == ',' && depth == 0 {
            leaves(&item, &before, out);
            item.clear();
        } else {
            item.push(c);
        }
    }
    leaves(&item, &before, out);
}

/// Every path that a file imports or names by `super::` or `crate::`, comments and its tests aside; split at `::`.
fn paths(source: &str) -> Vec<Vec<String>> {
    let code: String = source.lines().map(|l| l.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
    let tests = code.match_indices("#[cfg(test)]").find(|(at, _)| {
        let item = code[at + 12..].lines().find(|line| !line.is_empty() && !line.starts_with("#["));
        item.is_some_and(|line| line.contains("mod tests {"))
    });
    let code = &code[..tests.map_or(code.len(), |(at, _)| at)];
    let mut found = Vec::new();
    for statement in code.split(';') {
        let line = statement.rsplit('\n').find(|l| l.trim_start().starts_with("use ") || l.contains("pub use "));
        if let Some(at) = line.and_then(|l| statement.rfind(l)) {
            let tree = &statement[at..];
            leaves(&tree[tree.find("use ").unwrap() + 4..], "", &mut found);
        }
    }
    for (start, _) in code.match_indices("super::").chain(code.match_indices("crate::")) {
        let rest = &code[start..];
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).unwrap_or(rest.len());
        found.push(rest[..end].trim_end_matches(':').to_string());
    }
    found.iter().map(|path| path.split("::").map(str::to_string).collect()).collect()
}

/// Files of `src` by their modules, `mod.rs` by its folder's.
fn modules() -> BTreeMap<Vec<String>, PathBuf> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    let module = |file: PathBuf| {
        let inside = file.strip_prefix(&src).unwrap().with_extension("");
        let mut names: Vec<String> = inside.iter().map(|n| n.to_string_lossy().into_owned()).collect();
        if names.last().is_some_and(|name| name == "mod") {
            names.pop();
        }
        (names, file)
    };
    files.into_iter().map(module).collect()
}

/// What each file needs of others. What a room's `mod.rs` names anew is the file's that it comes from.
fn needs(modules: &BTreeMap<Vec<String>, PathBuf>) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let is_room = |file: &Path| file.file_name().is_some_and(|name| name == "mod.rs");
    let read = |file: &Path| paths(&std::fs::read_to_string(file).unwrap());
    let below = |module: &[String], name: &str| [module, &[name.to_string()]].concat();
    let mut named: BTreeMap<(Vec<String>, String), Vec<String>> = BTreeMap::new();
    for (module, file) in modules.iter().filter(|(_, file)| is_room(file)) {
        for path in read(file) {
            let path = &path[usize::from(path[0] == "self")..];
            if path.len() > 1 && modules.contains_key(&below(module, &path[0])) {
                named.insert((module.clone(), path[path.len() - 1].clone()), below(module, &path[0]));
            }
        }
    }
    let place = |module: &[String], file: &Path, path: &[String]| -> Option<Vec<String>> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        let (mut at, rest) = match path[0].as_str() {
            "crate" => (Vec::new(), &path[1..]),
            "super" => (module[..module.len().checked_sub(ups)?].to_vec(), &path[ups..]),
            name if is_room(file) && modules.contains_key(&below(module, name)) => (module.to_vec(), path),
            _ => return None,
        };
        for name in rest {
            let next = below(&at, name);
            match named.get(&(at.clone(), name.clone())) {
                _ if modules.contains_key(&next) => at = next,
                Some(file) => return Some(file.clone()),
                None => break,
            }
        }
        Some(at)
    };
    let of = |(module, file): (&Vec<String>, &PathBuf)| {
        let found = read(file).into_iter().filter_map(|path| place(module, file, &path));
        (module.clone(), found.filter(|other| other != module && modules.contains_key(other)).collect())
    };
    modules.iter().map(of).collect()
}

/// Files that are left when all are taken away, again and again, that need none of those left, or that none of them needs.
fn in_circles(mut needs: BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Vec<String> {
    loop {
        let left: BTreeSet<Vec<String>> = needs.keys().cloned().collect();
        let needed: BTreeSet<Vec<String>> = needs.values().flatten().cloned().collect();
        needs.values_mut().for_each(|others| others.retain(|other| left.contains(other)));
        needs.retain(|file, others| !others.is_empty() && needed.contains(file));
        if needs.len() == left.len() {
            let line = |(file, others): (&Vec<String>, &BTreeSet<Vec<String>>)| {
                let others: Vec<String> = others.iter().map(|o| o.join("/")).collect();
                format!("{} needs {}", file.join("/"), others.join(", "))
            };
            return needs.iter().map(line).collect();
        }
    }
}

/// A room's `mod.rs` has what all its files share; they need no others in circles.
#[test]
fn files_do_not_need_each_other() {
    let modules = modules();
    let is_room = |module: &Vec<String>| modules[module].file_name().is_some_and(|name| name == "mod.rs");
    let mut needs = needs(&modules);
    assert!(needs[&vec!["cache".into(), "cut".into()]].contains(&vec!["cache".to_string(), "tree".into()]));
    needs.retain(|file, _| !is_room(file));
    needs.values_mut().for_each(|others| others.retain(|other| !is_room(other)));
    let circles = in_circles(needs);
    assert!(circles.is_empty(), "files that need each other:\n{}", circles.join("\n"));
}

#[test]
fn circles_are_found() {
    let name = |n: &str| vec![n.to_string()];
    let needs = [("a", "b"), ("b", "c"), ("c", "b"), ("c", "d"), ("d", "e")];
    let map = needs.iter().fold(BTreeMap::new(), |mut map: BTreeMap<_, BTreeSet<_>>, (a, b)| {
        map.entry(name(a)).or_default().insert(name(b));
        map
    });
    assert_eq!(in_circles(map), ["b needs c", "c needs b"]);
    assert_eq!(paths("use super::{a::B, c};\npub use d::{E, f::G};\nlet x = crate::film::Film::new();").len(), 6);
}

#[test]
fn the_reader_of_imports_sees_lists_and_ignores_comments() {
    let used = rooms_used("use crate::{math::{Rgb, Vec3}, query}; // crate::render\nlet x = crate::film::Film::new();");
    assert_eq!(used, ["math", "query", "film"].map(String::from).into());
}
