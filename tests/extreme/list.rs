//! docs/robustness.md lists every case of this folder, and no other.

use std::collections::BTreeSet;
use std::path::Path;

/// Names of tests, with their file's: `meshes::needles_ok`.
fn cases() -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/extreme");
    let mut cases = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let module = path.file_stem().unwrap().to_string_lossy().into_owned();
        if ["main", "harness", "furnace", "list"].contains(&module.as_str()) {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let mut is_test = false;
        for line in text.lines() {
            if let Some(rest) = line.strip_prefix("fn ")
                && std::mem::take(&mut is_test)
            {
                cases.insert(format!("{module}::{}", rest.split('(').next().unwrap()));
            }
            is_test |= line == "#[test]";
        }
    }
    cases
}

#[test]
fn every_case_has_an_outcome_and_a_line_in_the_manual() {
    let cases = cases();
    assert!(cases.len() > 80, "{}", cases.len());
    for case in &cases {
        assert!(["_ok", "_warns", "_refused"].iter().any(|outcome| case.ends_with(outcome)), "{case}");
    }
    let manual = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/robustness.md")).unwrap();
    let listed: BTreeSet<String> = manual
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(name, _)| name.to_string())
        .filter(|name| name.contains("::"))
        .collect();
    for line in manual.lines().filter(|line| line.starts_with("| `") && line.contains("::")) {
        let columns: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
        let known = columns.len() == 3 && columns[2].len() > 10;
        assert!(known, "three columns, the last of them how it is known to be right: {line}");
    }
    let missing: Vec<_> = cases.difference(&listed).collect();
    let stale: Vec<_> = listed.difference(&cases).collect();
    assert!(missing.is_empty() && stale.is_empty(), "not in docs/robustness.md: {missing:?}; no such test: {stale:?}");
}
