//! Files of `converge`, `compare` and `profile`: none over what is read, none lost for another, and what cannot be compared is
//! said before anything is rendered.
#![cfg(all(feature = "cli", unix))]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball_under_sky, marmor, text};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn refused(output: &Output, words: &[&str]) {
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    for word in words {
        assert!(told.contains(word), "`{word}` in {told}");
    }
    // Said first.
    assert!(!told.contains("reference: ") && !told.contains("in turns"), "{told}");
}

fn ok(folder: &Path, arguments: &[&str]) {
    let output = marmor(folder, arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
}

/// In a shell that lets no file have more than `blocks` of 512 bytes, and makes that an error instead of a signal.
fn with_small_files(folder: &Path, blocks: u32, arguments: &str) -> Output {
    let line = format!("trap '' XFSZ; ulimit -f {blocks}; exec {} {arguments}", env!("CARGO_BIN_EXE_marmor"));
    Command::new("sh").current_dir(folder).args(["-c", &line]).output().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_report_is_not_written_over_what_it_is_made_of() {
    let folder = ball_under_sky();
    let folder = folder.path();
    ok(folder, &["render", "scene.toml", "-q", "-o", "reference.exr", "-o", "standard.exr", "--spp", "2"]);
    let before = fs::read(folder.join("reference.exr")).unwrap();
    let compare = ["compare", "scene.toml", "--models", "standard", "-o", ".", "--reference"];
    refused(&marmor(folder, &[&compare[..], &["reference.exr"]].concat()), &["over the reference", "another folder"]);
    refused(&marmor(folder, &[&compare[..], &["./standard.exr"]].concat()), &["over the reference"]);
    let sky = "environment.image=reference.exr";
    let converge = ["converge", "scene.toml", "--methods", "all", "-o", ".", "-D", sky];
    refused(&marmor(folder, &converge), &["over the picture of [environment]"]);
    let twice = ["converge", "scene.toml", "--methods", "all,all", "-o", "out"];
    refused(&marmor(folder, &twice), &["all.jsonl", "same file as", "each method once"]);
    fs::copy(folder.join("scene.toml"), folder.join("index.html")).unwrap();
    refused(&marmor(folder, &["compare", "index.html", "--models", "all", "-o", "."]), &["over the scene file"]);
    assert!(fs::read(folder.join("reference.exr")).unwrap() == before);
}

#[test]
fn pictures_of_other_sizes_are_refused_before_anything_is_rendered() {
    let folder = ball_under_sky();
    let folder = folder.path();
    ok(
        folder,
        &["render", "scene.toml", "-q", "-o", "r.exr", "-o", "r.film", "--spp", "2", "-D", "camera.resolution=[9,9]"],
    );
    for (command, list) in [("converge", "--methods"), ("compare", "--models")] {
        let given = [command, "scene.toml", list, "all", "-o", "out", "--reference", "r.exr"];
        refused(&marmor(folder, &given), &["--reference r.exr", "9x9", "24x16"]);
    }
    let film = ["compare", "scene.toml", "--models", "all", "-o", "out", "--reference", "r.film"];
    refused(&marmor(folder, &film), &["--reference r.film", "9x9", "24x16"]);
}

/// A full disk costs files of a report, not what was measured: the table goes to standard output.
#[test]
fn a_full_disk_costs_no_result() {
    let folder = ball_under_sky();
    let folder = folder.path();
    // 512 bytes: no page, no table.
    let output = with_small_files(folder, 1, "converge scene.toml --methods all,notes --time-budget 400ms -o out");
    let (said, table) = (text(&output.stderr), text(&output.stdout));
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(said.contains("the smallest error") || said.contains("At equal time"), "{said}");
    assert!(said.contains("cannot write"), "{said}");
    assert!(table.lines().any(|l| l.starts_with("all,")) && table.lines().any(|l| l.starts_with("notes,")), "{table}");
    assert!(names(&folder.join("out")).iter().all(|n| !n.contains("tmp") && !n.contains("part")));
    // 2 kB: the table of `compare` goes through, the page does not.
    let arguments = "compare scene.toml --models standard --truth all --time-budget 400ms -o out2";
    let output = with_small_files(folder, 4, arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(said.contains("standard: ") && said.contains("cannot write"), "{said}");
    assert!(text(&output.stdout).contains("standard,"));
    let left = names(&folder.join("out2"));
    assert!(left.contains(&"compare.csv".into()) && !left.contains(&"index.html".into()), "{left:?}");
}

#[test]
fn a_profile_is_whole_or_not_there() {
    let folder = ball_under_sky();
    let folder = folder.path();
    fs::write(folder.join("p.svg"), "old").unwrap();
    let output = with_small_files(folder, 1, "profile --material marble --model standard -o p.svg");
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    assert_eq!(fs::read_to_string(folder.join("p.svg")).unwrap(), "old");
    assert_eq!(names(folder), ["p.svg", "scene.toml"]);
}

/// A model that an interruption left without a pass is no black picture.
#[test]
fn what_was_not_rendered_is_not_judged() {
    let folder = ball_under_sky();
    let folder = folder.path();
    let arguments = ["compare", "scene.toml", "--models", "standard,beam,better", "--truth", "all", "-o", "out"];
    let mut child = command::command(folder, &[&arguments[..], &["--time-budget", "1000s"]].concat());
    let child = child.stderr(std::process::Stdio::piped()).spawn().unwrap();
    // Once it listens for signals, and so at work on the reference.
    let status = format!("/proc/{}/status", child.id());
    let listens = || {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let caught = text.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or_default();
        u64::from_str_radix(caught.trim(), 16).is_ok_and(|caught| caught & (1 << 14) != 0)
    };
    let begin = std::time::Instant::now();
    while !listens() {
        assert!(begin.elapsed().as_secs() < 60, "nothing happens for a minute");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(Command::new("sh").args(["-c", &format!("kill -TERM {}", child.id())]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(75), "{said}");
    assert!(said.contains("`beam` has no pass yet and is left out"), "{said}");
    let table = fs::read_to_string(folder.join("out/compare.csv")).unwrap();
    assert!(table.lines().any(|l| l.starts_with("standard,")) && !table.contains("beam,"), "{table}");
}
