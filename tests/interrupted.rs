//! Law 4 through the real binary: the same bytes for any stop and resume, any split and merge; signals; film files of
//! something else.
#![cfg(all(feature = "cli", unix))]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball, text};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Diffuse ground under the ball.
const MORE: &str = r#"
[[object]]
name = "floor"
mesh = "floor.obj"
material = "grey"
[material.grey]
type = "diffuse"
albedo = 0.5
[method]
cache_samples = 500
[render]
spp = 12
"#;

fn folder() -> tempfile::TempDir {
    let folder = command::folder(&ball([40, 30], MORE));
    fs::write(folder.path().join("floor.obj"), "v -5 -1 -5\nv -5 -1 5\nv 5 -1 5\nv 5 -1 -5\nf 1 2 3 4\n").unwrap();
    folder
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = command::command(folder, arguments);
    // No times in the files: then equal pictures are equal bytes.
    command.env("SOURCE_DATE_EPOCH", "1700000000");
    command
}

fn marmor(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

fn ok(folder: &Path, arguments: &[&str]) -> String {
    let output = marmor(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stderr)
}

fn refused(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = marmor(folder, arguments);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {told}");
    for word in words {
        assert!(told.contains(word), "{arguments:?}: `{word}` in {told}");
    }
}

fn same(folder: &Path, a: &str, b: &str) {
    assert!(fs::read(folder.join(a)).unwrap() == fs::read(folder.join(b)).unwrap(), "{a} and {b} differ");
}

/// A render without end, of which `passes` passes at least are done and recorded.
fn running(folder: &Path, passes: usize, more: &[&str]) -> Child {
    let records = folder.join("r.jsonl");
    let _ = fs::remove_file(&records);
    let base = ["render", "scene.toml", "-o", "x.exr", "--records", "r.jsonl", "--spp", "1000000"];
    let child = command(folder, &[&base[..], more].concat()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(|| fs::read_to_string(&records).is_ok_and(|r| r.lines().count() >= passes));
    child
}

fn wait_for(mut done: impl FnMut() -> bool) {
    let patience = Instant::now();
    while !done() {
        assert!(patience.elapsed() < Duration::from_secs(60), "nothing happens for a minute");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn signal(child: &Child, name: &str) {
    // The shell's own `kill`: a minimal system has no other.
    assert!(Command::new("sh").args(["-c", &format!("kill -{name} {}", child.id())]).status().unwrap().success());
}

#[test]
fn any_split_and_merge_gives_the_bytes_of_the_whole() {
    let folder = folder();
    let folder = folder.path();
    ok(folder, &["render", "scene.toml", "-o", "whole.exr", "-o", "whole.png", "-o", "whole.film"]);
    ok(folder, &["render", "scene.toml", "--samples-range", "0..5", "-o", "a.film", "--threads", "1"]);
    ok(folder, &["render", "scene.toml", "--samples-range", "5..6", "-o", "b.film"]);
    ok(folder, &["render", "scene.toml", "--samples-range", "6..12"]);
    let told = ok(folder, &["merge", "scene.6-12.film", "a.film", "b.film", "-o", "all.exr", "-o", "all.png"]);
    assert!(told.contains("passes 0..12"), "{told}");
    same(folder, "whole.exr", "all.exr");
    same(folder, "whole.png", "all.png");
    let told = ok(folder, &["merge", "a.film", "scene.6-12.film", "-o", "gap.exr"]);
    assert!(told.contains("passes are missing"), "{told}");
    refused(folder, &["merge", "a.film", "a.film", "-o", "x.exr"], 2, &["0..5 are in both"]);
    ok(folder, &["render", "scene.toml", "--samples-range", "5..6", "-o", "seed.film", "--seed", "1"]);
    refused(folder, &["merge", "a.film", "seed.film", "-o", "x.exr"], 2, &["seed.film", "seed: `0` there, `1` here"]);
    refused(folder, &["merge", "whole.exr", "-o", "x.exr"], 4, &["whole.exr", "no film file"]);
    assert!(!folder.join("x.exr").exists());
    let told = ok(folder, &["render", "scene.toml", "--samples-range", "0..1", "-o", "lost.exr"]);
    assert!(told.contains("warning: `marmor merge` needs film files"), "{told}");
}

#[test]
fn every_signal_does_what_it_says_and_resume_gives_the_bytes_of_the_whole() {
    let folder = folder();
    let folder = folder.path();
    for (name, threads) in [("INT", "1"), ("TERM", "2"), ("USR1", "3")] {
        let _ = fs::remove_file(folder.join("x.film"));
        let child = running(folder, 3, &["--threads", threads]);
        signal(&child, name);
        let output = child.wait_with_output().unwrap();
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(75), "{name}: {told}");
        assert!(told.contains("wrote x.film: the same call with --resume goes on"), "{told}");
        let done = fs::read_to_string(folder.join("r.jsonl")).unwrap().lines().count();
        let spp = (done + 4).to_string();
        let told =
            ok(folder, &["render", "scene.toml", "-o", "x.exr", "--resume", "--records", "r.jsonl", "--spp", &spp]);
        assert!(told.contains(&format!("after {done} passes")), "{told}");
        assert!(!folder.join("x.film").exists(), "a finished render takes its film file away");
        ok(folder, &["render", "scene.toml", "-o", "y.exr", "--spp", &spp]);
        same(folder, "x.exr", "y.exr");
        let passes: Vec<serde_json::Value> = fs::read_to_string(folder.join("r.jsonl"))
            .unwrap()
            .lines()
            .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["pass"].clone())
            .collect();
        assert_eq!(passes, (1..=done + 4).map(serde_json::Value::from).collect::<Vec<_>>(), "records go on too");
    }
}

#[test]
fn hangup_writes_and_goes_on() {
    let folder = folder();
    let folder = folder.path();
    let mut child = running(folder, 2, &[]);
    signal(&child, "HUP");
    wait_for(|| folder.join("x.exr").exists() && folder.join("x.film").exists());
    assert!(child.try_wait().unwrap().is_none(), "it goes on");
    marmor::film::Image::read_exr(&folder.join("x.exr")).unwrap();
    marmor::film::Checkpoint::read(&folder.join("x.film")).unwrap();
    signal(&child, "TERM");
    assert_eq!(child.wait().unwrap().code(), Some(75));
}

#[test]
fn a_render_is_resumed_by_the_same_call_alone() {
    let folder = folder();
    let folder = folder.path();
    // No file: a normal start.
    ok(folder, &["render", "scene.toml", "-o", "x.exr", "-o", "x.film", "--resume", "--spp", "3"]);
    let again = ["render", "scene.toml", "-o", "x.exr", "-o", "x.film", "--resume", "--spp"];
    let with = |more: &[&'static str]| [&again[..], &["5"], more].concat();
    refused(folder, &with(&["--seed", "3"]), 2, &["x.film", "seed: `0` there, `3` here"]);
    refused(folder, &with(&["--method", "direct"]), 2, &["method: `subsurface` there, `direct` here"]);
    refused(folder, &with(&["--crop", "0,0,9,9"]), 2, &["picture:"]);
    refused(
        folder,
        &with(&["-D", "camera.fov=31"]),
        2,
        &["scene.toml with -D camera.fov=31", "`camera.fov` is 31 here, 30 in the film"],
    );
    refused(folder, &with(&["--as-notes"]), 2, &["the lecture's form"]);
    refused(folder, &[&again[..], &["2"]].concat(), 2, &["passes 0..3, but 0..2"]);
    let mesh = fs::read_to_string(folder.join("floor.obj")).unwrap();
    fs::write(folder.join("floor.obj"), mesh.replace("f 1 2 3 4", "f 2 3 4 1")).unwrap();
    refused(folder, &with(&[]), 2, &["mesh of floor", "hash"]);
    fs::write(folder.join("floor.obj"), mesh).unwrap();
    // Neither threads, nor exposure, nor the number of samples are another render.
    ok(folder, &with(&["--threads", "1", "--exposure", "1", "-D", "render.exposure=2"]));
    ok(folder, &["render", "scene.toml", "-o", "y.exr", "--spp", "5", "-D", "render.exposure=2"]);
    same(folder, "x.exr", "y.exr");
    fs::write(folder.join("x.film"), &fs::read(folder.join("x.film")).unwrap()[..2000]).unwrap();
    refused(folder, &with(&[]), 4, &["x.film", "cut short"]);
}

#[test]
fn strict_is_exit_5_with_a_line_that_replays_the_pixel() {
    let folder = folder();
    let folder = folder.path();
    ok(folder, &["render", "scene.toml", "-o", "x.exr", "--strict"]);
    // A wide lamp of nearly the largest f32: products leave it.
    let render = ["render", "scene.toml", "-o", "x.exr", "--spp", "2", "--method", "direct"];
    let wide =
        ["-D", "material.lamp.radiance=3e38", "-D", "object.1.edge_u=[20,0,0]", "-D", "object.1.edge_v=[0,0,20]"];
    let arguments = [&render[..], &wide].concat();
    let told = ok(folder, &arguments);
    let last = told.lines().last().unwrap();
    assert!(last.starts_with("dropped ") && !last.contains("dropped 0"), "{told}");
    let output = marmor(folder, &[&arguments[..], &["--strict"]].concat());
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{told}");
    assert!(folder.join("x.exr").exists());
    let line = told.lines().last().unwrap().split("to look at one: marmor ").nth(1).unwrap();
    let words: Vec<&str> = line.split(' ').map(|w| w.trim_matches('\'')).collect();
    let output = marmor(folder, &words);
    let shown = text(&output.stdout);
    assert!(output.status.success(), "{line}: {}", text(&output.stderr));
    assert!(shown.contains("inf") || shown.contains("NaN"), "{line}: {shown}");
    assert!(shown.contains("meets object"), "{shown}");
}

/// The sample that a replay shows is the one of the render.
#[test]
fn a_replay_shows_the_sample_of_the_render() {
    let folder = folder();
    let folder = folder.path();
    for method in ["ambient_occlusion", "direct", "subsurface"] {
        let range = ["render", "scene.toml", "-o", "p.exr", "--samples-range", "7..8", "-q", "--method", method];
        ok(folder, &range);
        let image = marmor::film::Image::read_exr(&folder.join("p.exr")).unwrap();
        for pixel in [[20, 15], [1, 1], [20, 28]] {
            let [x, y] = pixel;
            let at = format!("{x},{y}");
            let output = marmor(folder, &["render", "scene.toml", "--method", method, "--pixel", &at, "--pass", "7"]);
            let shown = text(&output.stdout);
            let expected = format!("radiance {:?}", image.get(x, y).unwrap().0);
            assert!(shown.contains(&expected), "{method} {at}: {expected} in {shown}");
        }
    }
    refused(folder, &["render", "scene.toml", "--pixel", "40,3"], 2, &["not in the picture"]);
}

/// The first pass is finished, the picture is written without what it cannot have yet, and the exit code is that of an
/// interruption.
#[test]
fn an_interruption_in_the_first_pass_is_an_interruption() {
    let folder = folder();
    let folder = folder.path();
    let slow = ["-D", "method.cache_samples=16000", "-D", "method.estimator=notes"];
    let call = ["render", "scene.toml", "-o", "x.exr", "--layers", "variance,Z", "--spp", "40"];
    let child = command(folder, &[&call[..], &slow].concat()).stderr(Stdio::piped()).spawn().unwrap();
    // Once it listens for signals; before, SIGTERM ends any program.
    let status = format!("/proc/{}/status", child.id());
    wait_for(|| {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let caught = text.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or_default();
        u64::from_str_radix(caught.trim(), 16).is_ok_and(|caught| caught & (1 << 14) != 0)
    });
    signal(&child, "TERM");
    let output = child.wait_with_output().unwrap();
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(75), "{told}");
    assert!(told.contains("--layers variance is left out"), "{told}");
    marmor::film::Image::read_exr(&folder.join("x.exr")).unwrap();
    assert_eq!(marmor::film::Checkpoint::read(&folder.join("x.film")).unwrap().film.passes(), 1);
    refused(folder, &["render", "scene.toml", "-o", "y.exr", "--layers", "variance", "--spp", "1"], 2, &["at least 2"]);
    refused(folder, &["render", "scene.toml", "-o", "y.png", "--layers", "Z"], 2, &["only an EXR holds layers"]);
}
