//! What the program is made of may be given away with it: every licence of a dependency is one that docs/robustness.md
//! lists, and the list has no others.
#![allow(clippy::unwrap_used)] // no cargo, no test

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

#[test]
fn every_licence_is_listed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let tree = ["tree", "--offline", "--locked", "--features", "embree", "-e", "normal,build", "--prefix", "none"];
    let output =
        Command::new(env!("CARGO")).current_dir(root).args(tree).args(["--format", "{l}|{p}"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: BTreeSet<String> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .filter_map(|line| line.split_once('|'))
        .map(|(licence, _)| licence.to_string())
        .collect();
    let manual = std::fs::read_to_string(root.join("docs/robustness.md")).unwrap();
    let section = manual.split("## Dependencies").nth(1).unwrap().split("\n## ").next().unwrap();
    let listed: BTreeSet<String> = section
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(licence, _)| licence.to_string())
        .collect();
    assert_eq!(found, listed);
}
