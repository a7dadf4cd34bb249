//! The real binary in a temporary folder: pictures, messages, exit codes, interruption, determinism.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball, marmor, text};
use marmor::film::Image;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn scene() -> String {
    ball([40, 30], "[method]\ncache_samples = 500\n[render]\nspp = 4\n")
}

/// A folder with a scene and a mesh in it.
fn folder() -> tempfile::TempDir {
    let folder = command::folder(&scene());
    fs::write(folder.path().join("triangle.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    folder
}

/// The picture of a render that must succeed.
fn picture(folder: &Path, name: &str, arguments: &[&str]) -> Image {
    let all: Vec<&str> = ["render", "scene.toml", "-q", "-o", name].iter().chain(arguments).copied().collect();
    let output = marmor(folder, &all);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    Image::read_exr(&folder.join(name)).unwrap()
}

#[test]
fn a_render_writes_what_it_says() {
    let folder = folder();
    let arguments =
        ["render", "scene.toml", "-o", "a.exr", "-o", "a.png", "--records", "r.jsonl", "--stats", "s.json", "-v"];
    let output = marmor(folder.path(), &arguments);
    let told = text(&output.stderr);
    assert!(output.status.success(), "{told}");
    for part in ["2 objects", "wrote a.exr, a.png", "dropped 0 non-finite", "left out environment: black", "100 %"] {
        assert!(told.contains(part), "`{part}` in {told}");
    }
    assert!(!told.contains("none of"), "light does enter: {told}");
    let image = Image::read_exr(&folder.path().join("a.exr")).unwrap();
    assert_eq!(image.resolution, [40, 30]);
    assert!(image.pixels.iter().any(|p| p[0] > 0.05), "the ball shines");
    assert_eq!(&fs::read(folder.path().join("a.png")).unwrap()[1..4], b"PNG");

    let records = fs::read_to_string(folder.path().join("r.jsonl")).unwrap();
    let lines: Vec<serde_json::Value> = records.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    for (i, line) in lines.iter().enumerate() {
        assert_eq!(line["pass"], i + 1);
        assert_eq!(line["rays"]["camera"], (i + 1) * 40 * 30);
        // A quarter of what is asked for: the body is walked through.
        assert_eq!(line["gather"]["samples"], (i + 1) * 125);
        assert!(line["seconds_total"].as_f64() >= line["seconds_gather"].as_f64());
        assert_eq!(line["non_finite"], 0);
        assert!(line.get("rmse").is_none(), "no figure without a reference");
    }
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(folder.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["passes"], 4);
    let clock = |key: &str| stats["clock"][key].as_f64().unwrap();
    let seconds = |key: &str| stats["seconds"][key].as_f64().unwrap();
    let cache = ["survey", "fill", "tree"].map(clock);
    assert!(cache.iter().all(|s| *s > 0.0) && cache.iter().sum::<f64>() <= 1.001 * seconds("cache"), "{stats}");
    let threads = stats["threads"].as_f64().unwrap();
    let tiles = ["rays", "near", "gather"].map(clock);
    assert!(tiles[0] > 0.0 && tiles[2] > 0.0, "{stats}");
    assert!(tiles.iter().sum::<f64>() <= 1.001 * threads * seconds("gather"), "{stats}");
    for key in ["nodes", "pairs", "evaluated", "near_points", "near"] {
        assert!(stats["per_exit"][key].is_number(), "{key}");
    }
    assert!(stats["parts"].as_array().unwrap().iter().any(|p| p["built"] == false));
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_does_not() {
    let folder = folder();
    let pixels = |name, arguments: &[&str]| picture(folder.path(), name, arguments).pixels;
    let one = pixels("1.exr", &["--threads", "1"]);
    assert!(one == pixels("3.exr", &["--threads", "3"]), "the number of threads changes the picture");
    assert!(one != pixels("s.exr", &["--seed", "1"]), "the seed does not change the picture");
}

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let folder = folder();
    let whole = picture(folder.path(), "whole.exr", &[]);
    let crop = picture(folder.path(), "crop.exr", &["--crop", "11,7,30,22"]);
    assert_eq!(crop.resolution, whole.resolution);
    assert!(crop.pixels == whole.cropped(crop.window).pixels, "a crop differs from the whole");
    assert_eq!([crop.window.x0, crop.window.y1], [11, 22]);
}

#[test]
fn a_reference_gives_figures_that_fall() {
    let folder = folder();
    picture(folder.path(), "reference.exr", &["--spp", "64", "--seed", "9"]);
    let output = marmor(
        folder.path(),
        &["render", "scene.toml", "-o", "x.exr", "--reference", "reference.exr", "--records", "r.jsonl", "--spp", "32"],
    );
    assert!(output.status.success());
    assert!(text(&output.stderr).contains("against the reference: RMSE"));
    let records = fs::read_to_string(folder.path().join("r.jsonl")).unwrap();
    let relmse: Vec<f64> = records
        .lines()
        .map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap()["relmse"].as_f64().unwrap())
        .collect();
    assert!(relmse[31] < 0.3 * relmse[0], "{relmse:?}");
}

#[test]
fn the_lecture_to_the_letter_has_the_same_mean_as_the_same_model_here() {
    let folder = folder();
    let mean = |image: &Image| image.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>();
    let plain: Vec<&str> = vec![
        "-D",
        "material.wax.model=standard",
        "-D",
        "method.specular=false",
        "-D",
        "method.cache_samples=4000",
        "-D",
        "method.bounces=0",
        "--spp",
        "16",
    ];
    let run = |name: &str, seed: u32, more: &[&str]| {
        let seed = seed.to_string();
        let arguments: Vec<&str> = plain.iter().chain(more).chain(&["--seed", &seed]).copied().collect();
        mean(&picture(folder.path(), name, &arguments))
    };
    let (mut here, mut notes) = (Vec::new(), Vec::new());
    for seed in 0..10 {
        here.push(run("h.exr", seed, &["-D", "material.wax.exit_normalisation=false"]));
        notes.push(run("n.exr", seed, &["--as-notes"]));
    }
    let n = here.len() as f64;
    let average = |v: &[f64]| v.iter().sum::<f64>() / n;
    let variance = |v: &[f64]| v.iter().map(|x| (x - average(v)).powi(2)).sum::<f64>() / (n - 1.0) / n;
    let error = (variance(&here) + variance(&notes)).sqrt();
    let difference = average(&here) - average(&notes);
    assert!(error < 0.03 * average(&here), "too noisy to say anything: {error} of {}", average(&here));
    assert!(difference.abs() < 8.0 * error, "{difference} +- {error} of {}", average(&here));
    // With the exit normalisation the two differ by 6 %: the test must see that.
    let normalised: Vec<f64> = (0..10).map(|seed| run("e.exr", seed, &[])).collect();
    assert!((average(&normalised) - average(&here)) > 0.04 * average(&here));
}

#[test]
fn check_says_what_is_built_and_what_is_left_out() {
    let folder = folder();
    let output = marmor(folder.path(), &["check", "scene.toml"]);
    let told = text(&output.stdout);
    for part in
        ["method subsurface", "sample cache of `ball`", "left out", "environment: black", "transport mean free path"]
    {
        assert!(told.contains(part), "`{part}` in {told}");
    }
    let told = text(&marmor(folder.path(), &["check", "scene.toml", "--method", "ambient_occlusion"]).stdout);
    assert!(told.contains("light table: ambient occlusion asks no light"), "{told}");
    let told = text(
        &marmor(
            folder.path(),
            &["check", "scene.toml", "-D", "material.wax.sigma_a=0.1", "-D", "material.wax.sigma_s_prime=2"],
        )
        .stdout,
    );
    assert!(told.contains("a grey medium: S_d is evaluated in one channel"), "{told}");
    let json = marmor(folder.path(), &["check", "scene.toml", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json["objects"][0]["triangles"], 2 * 32 * 15);
}

#[test]
fn a_model_without_the_first_order_is_told() {
    let folder = folder();
    let told = |model: &str, single: &str| {
        text(&marmor(folder.path(), &["check", "scene.toml", "--model", model, "-D", single]).stdout)
    };
    for model in ["better", "beam"] {
        assert!(told(model, "method.single=false").contains("leaves out light scattered once"), "{model}");
        let added = told(model, "method.single=true");
        assert!(
            added.contains("single scattering: straight from lamps") && !added.contains("leaves out"),
            "{model}: {added}"
        );
    }
    for model in ["standard", "directional"] {
        assert!(!told(model, "method.single=false").contains("scattered once"), "{model}");
        assert!(told(model, "method.single=true").contains("single scattering: the models have it"), "{model}");
    }
}

#[test]
fn light_that_faces_away_is_told() {
    let folder = folder();
    let output = marmor(folder.path(), &["render", "scene.toml", "-o", "x.png", "-D", "object.1.flip=true"]);
    assert!(text(&output.stderr).contains("warning: none of 500 samples"), "{}", text(&output.stderr));
}

/// Each wrong call or input: the arguments, the exit code, and words of its one message.
#[test]
fn wrong_input_gives_one_clear_error_and_its_exit_code() {
    let folder = folder();
    let write = |name: &str, content: &str| fs::write(folder.path().join(name), content).unwrap();
    write("not.toml", "camera = {");
    write("empty.toml", "");
    write("typo.toml", &scene().replace("look_at", "lookat"));
    write("nomaterial.toml", &scene().replace("material = \"wax\"", "material = \"wxa\""));
    write("negative.toml", &scene().replace("[0.05, 0.1, 0.2]", "[-0.05, 0.1, 0.2]"));
    write("noeta.toml", &scene().replace("eta = 1.3", ""));
    write("nomesh.toml", &(scene() + "[[object]]\nname = \"m\"\nmesh = \"gone.obj\"\nmaterial = \"wax\"\n"));
    write("badmesh.toml", &(scene() + "[[object]]\nname = \"m\"\nmesh = \"bad.obj\"\nmaterial = \"wax\"\n"));
    write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
    write("nan.toml", &(scene() + "[[object]]\nname = \"m\"\nmesh = \"nan.obj\"\nmaterial = \"wax\"\n"));
    write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    write("file", "");
    write("notexr.exr", "hello");
    fs::create_dir(folder.path().join("dir.exr")).unwrap();

    let cases: &[(&[&str], i32, &[&str])] = &[
        (&["render"], 2, &["SCENE"]),
        (&["rendr", "scene.toml"], 2, &["rendr"]),
        (&["render", "gone.toml"], 4, &["gone.toml", "cannot read"]),
        (&["render", "not.toml"], 3, &["not.toml:1", "TOML"]),
        (&["render", "empty.toml"], 3, &["empty.toml", "camera"]),
        (&["render", "typo.toml"], 3, &["typo.toml:5", "lookat", "did you mean `look_at`"]),
        (&["render", "nomaterial.toml"], 3, &["wxa", "did you mean `wax`"]),
        (&["render", "negative.toml"], 3, &["sigma_a", "-0.05"]),
        (&["render", "noeta.toml"], 3, &["eta"]),
        (&["render", "nomesh.toml"], 4, &["gone.obj"]),
        (&["render", "badmesh.toml"], 3, &["bad.obj:4", "4"]),
        (&["render", "nan.toml"], 3, &["nan.obj:2"]),
        (&["render", "scene.toml", "--method", "sub"], 2, &["sub"]),
        (&["render", "scene.toml", "--model", "standrad"], 2, &["did you mean `standard`"]),
        (&["render", "scene.toml", "--estimator", "note"], 2, &["did you mean `notes`"]),
        (&["render", "scene.toml", "--backend", "embre"], 2, &["did you mean `embree`"]),
        (&["render", "scene.toml", "--as-notes", "--method", "direct"], 2, &["--as-notes", "subsurface"]),
        (&["render", "scene.toml", "--as-notes", "--model", "standard"], 2, &["--as-notes", "--model"]),
        (&["render", "scene.toml", "-o", "x.jpg"], 2, &["x.jpg", ".exr", ".png"]),
        (&["render", "scene.toml", "-o", "gone/x.exr"], 4, &["gone"]),
        (&["render", "scene.toml", "-o", "file/x.exr"], 4, &["file"]),
        (&["render", "scene.toml", "-o", "dir.exr"], 4, &["dir.exr", "folder"]),
        (&["render", "scene.toml", "--crop", "5,5,5,9"], 2, &["x0 < x1"]),
        (&["render", "scene.toml", "--crop", "0,0,41,30"], 2, &["41"]),
        (&["render", "scene.toml", "--time", "soon"], 2, &["30s"]),
        (&["render", "scene.toml", "--spp", "0"], 2, &["at least 1"]),
        (&["render", "scene.toml", "-D", "camera.fov"], 2, &["camera.fov"]),
        (&["render", "scene.toml", "-D", "camera.fov=190"], 3, &["fov", "190"]),
        (&["render", "scene.toml", "-D", "camera.fvo=30"], 3, &["fvo", "did you mean `fov`"]),
        (&["render", "scene.toml", "-D", "object.7.name=x"], 2, &["7"]),
        (&["render", "scene.toml", "--reference", "gone.exr"], 4, &["gone.exr"]),
        (&["render", "scene.toml", "--reference", "notexr.exr"], 4, &["notexr.exr"]),
        (&["render", "scene.toml", "-o", "x.png", "--records", "gone/r.jsonl"], 4, &["gone"]),
        (&["diff", "gone.exr", "notexr.exr"], 4, &["gone.exr"]),
        (&["check", "typo.toml"], 3, &["lookat"]),
    ];
    for (arguments, code, words) in cases {
        let output = marmor(folder.path(), arguments);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(*code), "{arguments:?}: {told}");
        for word in *words {
            assert!(told.contains(word), "{arguments:?}: `{word}` in {told}");
        }
        assert!(!told.contains("panicked"), "{arguments:?}: {told}");
    }
    let missing =
        ["bvh", "embree"].into_iter().find(|name| !name.parse::<marmor::query::Backend>().unwrap().is_built_in());
    if let Some(name) = missing {
        let output = marmor(folder.path(), &["render", "scene.toml", "-o", "x.png", "--backend", name]);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(&format!("rebuild with `--features {name}`")));
    }
    assert!(!folder.path().join("x.png").exists(), "a refused call writes nothing");
}

#[test]
fn the_reference_must_have_the_pictures_size() {
    let folder = folder();
    picture(folder.path(), "small.exr", &["-D", "camera.resolution=[8,8]"]);
    let output = marmor(folder.path(), &["render", "scene.toml", "-o", "x.png", "--reference", "small.exr"]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}

#[test]
fn a_time_limit_ends_the_render() {
    let folder = folder();
    let start = Instant::now();
    let output = marmor(folder.path(), &["render", "scene.toml", "-o", "x.exr", "--time", "300ms"]);
    assert!(output.status.success());
    assert!(text(&output.stderr).contains("stopped by --time"), "{}", text(&output.stderr));
    assert!(start.elapsed() < Duration::from_secs(20));
}

#[cfg(unix)]
#[test]
fn an_interrupt_writes_what_there_is() {
    let folder = folder();
    let child = Command::new(env!("CARGO_BIN_EXE_marmor"))
        .current_dir(folder.path())
        .args(["render", "scene.toml", "-o", "x.exr", "--records", "r.jsonl", "--spp", "1000000"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let records = folder.path().join("r.jsonl");
    let patience = Instant::now();
    while fs::read_to_string(&records).is_ok_and(|r| r.lines().count() < 3) || !records.exists() {
        assert!(patience.elapsed() < Duration::from_secs(60), "no pass is done after a minute");
        std::thread::sleep(Duration::from_millis(20));
    }
    // The shell's own `kill`: a minimal system has no other.
    assert!(Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(75), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("interrupted"));
    let passes = fs::read_to_string(&records).unwrap().lines().count();
    let undisturbed = picture(folder.path(), "same.exr", &["--spp", &passes.to_string()]);
    let interrupted = Image::read_exr(&folder.path().join("x.exr")).unwrap();
    assert!(interrupted.pixels == undisturbed.pixels, "{passes} passes, interrupted, are not {passes} passes");
}

#[test]
fn what_auto_chose_is_said_with_the_reason() {
    let folder = folder();
    let auto = ["-D", "material.wax.model=auto"];
    let told = text(&marmor(folder.path(), &[&["check", "scene.toml"], &auto[..]].concat()).stdout);
    assert!(told.contains("model auto -> beam (least reduced albedo 0.952"), "{told}");
    let thick = ["-D", "material.wax.thickness=2"];
    let told = text(&marmor(folder.path(), &[&["check", "scene.toml"], &auto[..], &thick].concat()).stdout);
    assert!(told.contains("model auto -> slab (4.1 transport mean free paths thick"), "{told}");
    let render = ["render", "scene.toml", "-o", "out.exr", "--spp", "1", "-q", "-D", "render.spp=1"];
    let output = marmor(folder.path(), &[&render[..], &auto, &thick].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let bytes = text(&fs::read(folder.path().join("out.exr")).unwrap());
    assert!(bytes.contains("wax: auto -> slab (4.1 transport mean free paths thick"), "the header names the choice");
}
