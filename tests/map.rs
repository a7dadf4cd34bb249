//! Imports point down: a room uses only rooms of lower rows, and rooms of one row do not know each other.
#![allow(clippy::unwrap_used)] // a test that cannot read its files has failed

use std::collections::BTreeSet;
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

#[test]
fn the_reader_of_imports_sees_lists_and_ignores_comments() {
    let used = rooms_used("use crate::{math::{Rgb, Vec3}, query}; // crate::render\nlet x = crate::film::Film::new();");
    assert_eq!(used, ["math", "query", "film"].map(String::from).into());
}
