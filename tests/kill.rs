//! `kill -9` at random moments of renders with checkpoints: nothing is lost but what came after the last checkpoint, the
//! result is that of the undisturbed render bit for bit, and whatever has a name is whole. Five kills in the suite; for
//! the figures of docs/robustness.md
//!
//!     MARMOR_KILLS=200 cargo test --release --test kill -- --nocapture
#![cfg(all(feature = "cli", unix))]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball, folder};
use marmor::film::Checkpoint;
use marmor::math::hash;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Between two checkpoints.
const INTERVAL: Duration = Duration::from_millis(30);

fn marmor(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = command::command(folder, arguments);
    command.env("SOURCE_DATE_EPOCH", "1700000000").stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap()
}

/// Passes of the film file; 0 without one. A film file is whole, whenever one looks.
fn kept(folder: &Path) -> u32 {
    let path = folder.join("x.film");
    if path.exists() { Checkpoint::read(&path).unwrap().film.passes() } else { 0 }
}

/// Pass and time of rendering in the last whole line of the records.
fn recorded(folder: &Path, upto: u64) -> (u64, f64) {
    let text = fs::read_to_string(folder.join("r.jsonl")).unwrap_or_default();
    let lines = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let passes =
        lines.filter_map(|v| Some((v["pass"].as_u64()?, v["seconds_cache"].as_f64()? + v["seconds_gather"].as_f64()?)));
    passes.filter(|(pass, _)| *pass <= upto).fold((0, 0.0), |_, last| last)
}

#[test]
fn renders_that_are_killed_lose_one_interval_at_most() {
    let kills: u32 = std::env::var("MARMOR_KILLS").ok().and_then(|v| v.parse().ok()).unwrap_or(5);
    let folder = folder(&ball([96, 72], "[environment]\nradiance = 1\n[method]\ncache_samples = 500\n"));
    let folder = folder.path();
    // As many passes as take a second or so.
    let start = Instant::now();
    assert!(marmor(folder, &["render", "scene.toml", "-o", "old.exr", "--spp", "4"]).status().unwrap().success());
    let spp = ((4.0 / start.elapsed().as_secs_f64()) as u32).clamp(8, 4000).to_string();
    assert!(marmor(folder, &["render", "scene.toml", "-o", "whole.exr", "--spp", &spp]).status().unwrap().success());
    let (old, whole) = (bytes(folder, "old.exr"), bytes(folder, "whole.exr"));

    let every = format!("{}ms", INTERVAL.as_millis());
    let call = [
        "render",
        "scene.toml",
        "-o",
        "x.exr",
        "--spp",
        &spp,
        "--checkpoint-every",
        &every,
        "--resume",
        "--records",
        "r.jsonl",
    ];
    let (mut killed, mut finished, mut resumed, mut lost_most, mut moment) = (0, 0, 0, 0.0_f64, 0);
    let fresh = || {
        fs::write(folder.join("x.exr"), &old).unwrap();
        let _ = fs::remove_file(folder.join("r.jsonl"));
    };
    fresh();
    while killed < kills {
        let before = kept(folder);
        let mut child = marmor(folder, &call).spawn().unwrap();
        moment += 1;
        std::thread::sleep(Duration::from_micros(hash(moment) % 200_000));
        let done = child.try_wait().unwrap();
        if let Some(status) = done {
            assert!(status.success(), "after {killed} kills: {status}");
            assert!(bytes(folder, "x.exr") == whole, "the result of a killed render differs, after {killed} kills");
            assert!(!folder.join("x.film").exists());
            finished += 1;
            fresh();
            continue;
        }
        child.kill().unwrap(); // SIGKILL
        child.wait().unwrap();
        killed += 1;
        let picture = bytes(folder, "x.exr");
        if picture == whole {
            // The last thing that a finished render does is to take its film file away; the kill may come before.
            let _ = fs::remove_file(folder.join("x.film"));
            finished += 1;
            fresh();
            continue;
        }
        assert!(picture == old, "the old picture is not intact after {killed} kills");
        let now = kept(folder);
        assert!(now >= before, "a checkpoint of {now} passes replaced one of {before}");
        resumed += u32::from(now > before);
        let lost = recorded(folder, u64::MAX).1 - recorded(folder, now.into()).1;
        lost_most = lost_most.max(lost);
    }
    // One interval, the pass during which it ended, and what else the machine was doing.
    assert!(lost_most < INTERVAL.as_secs_f64() + 2.0, "{lost_most} s are lost");
    if folder.join("x.film").exists() || kept(folder) == 0 {
        assert!(marmor(folder, &call).status().unwrap().success());
        assert!(bytes(folder, "x.exr") == whole, "the result of a killed render differs");
    }
    println!(
        "{killed} kills of renders of {spp} passes: {resumed} left a newer checkpoint, {finished} renders finished in spite \
         of them, each with the bytes of the undisturbed one; most time of rendering lost: {:.0} ms, checkpoints every {} ms",
        lost_most * 1e3,
        INTERVAL.as_millis()
    );
}
