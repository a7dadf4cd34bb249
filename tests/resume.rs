//! What `--resume` goes on from and what it leaves alone: time of this run, films that somebody asked for, films of another
//! sky or another build.
#![cfg(all(feature = "cli", unix))]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball, marmor, text};
use marmor::film::{Checkpoint, Image, Metadata, Window, save};
use marmor::math::Rgb;
use std::fs;
use std::path::Path;
use std::process::Output;

const SKY: &str = "[environment]\nimage = \"sky.exr\"\n[method]\nname = \"direct\"\n";

/// A folder whose scene has a sky of `radiance`.
fn folder(radiance: f32) -> tempfile::TempDir {
    let folder = command::folder(&ball([24, 16], SKY));
    sky(folder.path(), radiance);
    folder
}

fn sky(folder: &Path, radiance: f32) {
    let image = Image::from_fn([8, 4], |_, _| Rgb::splat(radiance));
    save(&image, &folder.join("sky.exr"), &Metadata::default(), Default::default()).unwrap();
}

fn render(folder: &Path, more: &[&str]) -> Output {
    marmor(folder, &[&["render", "scene.toml"], more].concat())
}

fn ok(folder: &Path, more: &[&str]) -> String {
    let output = render(folder, more);
    assert!(output.status.success(), "{more:?}: {}", text(&output.stderr));
    text(&output.stderr)
}

fn refused(output: &Output, words: &[&str]) {
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    for word in words {
        assert!(told.contains(word), "`{word}` in {told}");
    }
}

fn passes(folder: &Path, name: &str) -> u32 {
    Checkpoint::read(&folder.join(name)).unwrap().film.passes()
}

#[test]
fn the_time_of_earlier_runs_is_not_that_of_this_one() {
    let folder = folder(1.0);
    let folder = folder.path();
    let call = &["-o", "x.film", "-o", "x.exr", "--resume", "--time", "50ms"];
    let mut before = 0;
    for run in 0..3 {
        let told = ok(folder, call);
        let now = passes(folder, "x.film");
        assert!(now > before, "{now} passes after {before}: {told}");
        assert!(told.contains("stopped by --time"), "{told}");
        if run > 0 {
            assert!(told.contains(&format!("after {before} passes")) && told.contains("in this run"), "{told}");
        }
        before = now;
    }
}

#[test]
fn seconds_of_all_runs_add_up() {
    let folder = folder(1.0);
    let folder = folder.path();
    for spp in ["3", "6", "9"] {
        ok(folder, &["-q", "-o", "x.film", "--resume", "--records", "r.jsonl", "--spp", spp]);
    }
    let records = fs::read_to_string(folder.join("r.jsonl")).unwrap();
    let lines: Vec<serde_json::Value> = records.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 9);
    let seconds = |line: &serde_json::Value, key: &str| line[key].as_f64().unwrap();
    for (pass, pair) in (2..).zip(lines.windows(2)) {
        let of = |key| (seconds(&pair[0], key), seconds(&pair[1], key));
        let (before, now) = of("seconds_setup");
        // Each run reads the scene and builds its tables.
        assert!(if pass % 3 == 1 { now > before } else { now == before }, "pass {pass}: {before} {now}");
        let (before, now) = of("seconds_total");
        assert!(now > before, "pass {pass}: {before} {now}");
    }
    for line in &lines {
        let parts = ["seconds_setup", "seconds_cache", "seconds_gather"].map(|key| seconds(line, key));
        assert!((parts.iter().sum::<f64>() - seconds(line, "seconds_total")).abs() < 1e-9);
    }
}

/// A film that has all its passes tells no error of them, and says why.
#[test]
fn a_film_that_is_complete_says_that_this_run_made_no_pass() {
    let folder = folder(1.0);
    let call = ["-o", "x.film", "-o", "x.exr", "--resume", "--spp", "8"];
    assert!(!ok(folder.path(), &call).contains("no relMSE"));
    let told = ok(folder.path(), &call);
    assert!(told.contains("no relMSE is estimated: all 8 passes were there before, and this run made none"), "{told}");
}

/// The film that an earlier call asked for, under the name that a checkpoint would have.
#[test]
fn a_film_that_was_asked_for_is_never_taken_away() {
    let folder = folder(1.0);
    let folder = folder.path();
    ok(folder, &["-q", "-o", "x.film", "--spp", "3"]);
    let film = fs::read(folder.join("x.film")).unwrap();
    ok(folder, &["-q", "-o", "x.exr", "--resume", "--spp", "6"]);
    assert!(fs::read(folder.join("x.film")).unwrap() == film, "it is read, and stays as it is");
    // Without --resume it is not even looked at, and checkpoints go elsewhere.
    let told = ok(folder, &["-o", "x.exr", "--checkpoint-every", "0.0001s", "--spp", "20"]);
    assert!(told.contains("x.film is there already and stays as it is") && told.contains("x-2.film"), "{told}");
    assert!(fs::read(folder.join("x.film")).unwrap() == film);
    assert!(!folder.join("x-2.film").exists(), "a checkpoint is taken away");
    // With it, checkpoints go on with it, and it still stays.
    ok(folder, &["-q", "-o", "x.exr", "--resume", "--checkpoint-every", "0.0001s", "--spp", "20"]);
    assert!(passes(folder, "x.film") > 3);
}

#[test]
fn a_film_with_another_picture_on_a_surface_is_refused() {
    let folder = folder(1.0);
    let folder = folder.path();
    let paint = |grey: f32| {
        let image = Image::from_fn([4, 4], |_, _| Rgb::splat(grey));
        save(&image, &folder.join("wood.exr"), &Metadata::default(), Default::default()).unwrap();
    };
    let wood = [
        "-D",
        "object.1.material=wood",
        "-D",
        "material.wood.type=diffuse",
        "-D",
        "material.wood.albedo.image=wood.exr",
        "-q",
    ];
    let with = |more: &[&'static str]| [&wood[..], more].concat();
    paint(0.5);
    ok(folder, &with(&["-o", "a.film", "--spp", "2"]));
    paint(0.6);
    let resumed = render(folder, &with(&["-o", "a.film", "--spp", "4", "--resume"]));
    refused(&resumed, &["a.film", "picture of material wood", "wood.exr", "hash"]);
    let over = text(&render(folder, &with(&["-o", "wood.exr", "--spp", "2"])).stderr);
    assert!(over.contains("would be written over the picture of material \"wood\""), "{over}");
    paint(0.5);
    ok(folder, &with(&["-o", "a.film", "--spp", "4", "--resume"]));
}

/// Files that are named in the scene are in the film: not by name, by what is in them.
#[test]
fn a_film_under_another_sky_is_refused() {
    let folder = folder(1.0);
    let folder = folder.path();
    ok(folder, &["-q", "-o", "a.film", "--samples-range", "0..2"]);
    ok(folder, &["-q", "-o", "b.film", "--samples-range", "2..4"]);
    sky(folder, 5.0);
    let resumed = render(folder, &["-q", "-o", "a.film", "--resume", "--spp", "4"]);
    refused(&resumed, &["a.film", "picture of the environment", "sky.exr", "hash"]);
    ok(folder, &["-q", "-o", "c.film", "--samples-range", "2..4"]);
    refused(&marmor(folder, &["merge", "a.film", "c.film", "-o", "x.exr"]), &["c.film", "picture of the environment"]);
    assert!(marmor(folder, &["merge", "a.film", "b.film", "-o", "x.exr"]).status.success());
    sky(folder, 1.0);
    ok(folder, &["-q", "-o", "a.film", "--resume", "--spp", "4"]);
    let other = render(folder, &["-q", "-o", "a.film", "--resume", "--spp", "6", "--repair"]);
    refused(&other, &["meshes mended: `false` there, `true` here"]);
}

#[test]
fn a_film_of_another_build_is_refused() {
    let folder = folder(1.0);
    let folder = folder.path();
    ok(folder, &["-q", "-o", "x.film", "--spp", "2"]);
    let path = folder.join("x.film");
    let mut read = Checkpoint::read(&path).unwrap();
    let build = read.identity.0.iter_mut().find(|(name, _)| name == "build").unwrap();
    let hash = build.1.split(['(', ')']).nth(1).unwrap().to_string();
    assert!(hash.len() == 16 && u64::from_str_radix(&hash, 16).is_ok(), "{}", build.1);
    build.1 = build.1.replace(&hash, "0123456789abcdef");
    let write = |read: &Checkpoint| {
        Checkpoint::write(&path, &read.film, &read.identity, &read.attributes, read.progress.clone()).unwrap();
    };
    write(&read);
    let resumed = render(folder, &["-q", "-o", "x.film", "--resume", "--spp", "4"]);
    refused(&resumed, &["build: `", "0123456789abcdef", "go on with the program that made it"]);
}

/// Everything that is named by `--resume` in the user's own words.
#[test]
fn an_option_that_differs_is_named_as_a_key() {
    let folder = command::folder(&ball([24, 16], "[environment]\nradiance = 1\n[method]\ncache_samples = 200\n"));
    let folder = folder.path();
    ok(folder, &["-q", "-o", "x.film", "--spp", "2"]);
    let resumed = render(folder, &["-q", "-o", "x.film", "--resume", "--spp", "4", "--model", "beam"]);
    refused(
        &resumed,
        &["scene.toml with -D method.model=beam", "`method.model` is the text \"beam\" here, not set in the film"],
    );
    assert_eq!(Checkpoint::read(&folder.join("x.film")).unwrap().film.window(), Window::full([24, 16]));
}
