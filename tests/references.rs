//! Every paper cited in code or manual is in docs/references.md.
#![allow(clippy::unwrap_used)] // a file that cannot be read is a failed test

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Whether the text between two brackets is a key: initials and two digits of the year (`JMLH01`, `dEI11`), or a name
/// and the whole year (`Burley 2020`, `Steele et al. 2014`).
fn is_key(text: &str) -> bool {
    let digits = text.bytes().rev().take_while(u8::is_ascii_digit).count();
    let (name, year) = text.split_at(text.len() - digits);
    let word =
        |w: &str| w.starts_with(|c: char| c.is_ascii_uppercase()) && w.chars().all(|c| c.is_alphabetic() || c == '-');
    match (digits, name.strip_suffix(' ')) {
        (2, None) => {
            (2..=5).contains(&name.len())
                && name.chars().all(|c| c.is_ascii_alphabetic())
                && name.chars().any(|c| c.is_ascii_uppercase())
        }
        (4, Some(name)) => (year.starts_with("19") || year.starts_with("20")) && word(name.trim_end_matches(" et al.")),
        _ => false,
    }
}

fn keys(text: &str) -> BTreeSet<String> {
    let after = text.split('[').skip(1);
    after
        .filter_map(|rest| rest.split_once(']'))
        .map(|(key, _)| key)
        .filter(|key| is_key(key))
        .map(str::to_owned)
        .collect()
}

fn files(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs" || e == "md") {
            into.push(path);
        }
    }
}

#[test]
fn every_key_is_in_the_list() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = std::fs::read_to_string(root.join("docs/references.md")).unwrap();
    let listed: BTreeSet<String> = list
        .lines()
        .filter_map(|line| line.strip_prefix("* **[")?.split_once("]**"))
        .map(|(key, _)| key.to_owned())
        .collect();
    assert!(listed.len() > 20 && listed.iter().all(|key| is_key(key)), "{listed:?}");
    let mut paths = Vec::new();
    for folder in ["src", "docs", "tests", "examples", "benches", "scenes"] {
        files(&root.join(folder), &mut paths);
    }
    let mut cited = 0;
    for path in paths.iter().filter(|p| !p.ends_with("tests/references.rs")) {
        let found = keys(&std::fs::read_to_string(path).unwrap());
        let missing: Vec<_> = found.difference(&listed).collect();
        assert!(missing.is_empty(), "{}: not in docs/references.md: {missing:?}", path.display());
        cited += found.len();
    }
    assert!(cited > 50, "only {cited} citations found");
}

#[test]
fn keys_are_told_from_other_brackets() {
    for key in ["JMLH01", "dEI11", "dEo12", "HK93", "Burley 2020", "Steele et al. 2014"] {
        assert!(is_key(key), "{key}");
    }
    for other in ["1/unit", "0", "f32", "u64", "unit²", "Self::new", "2 * 10", "JMLH", "x 2020"] {
        assert!(!is_key(other), "{other}");
    }
    assert_eq!(keys("as [JB02] and [`eval`], [1/unit], [Ize 2013]").len(), 2);
}
