//! `marmor compare` as a user calls it: files, page, messages.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SCENE: &str = r#"
unit = "mm"
[camera]
position = [0, 2, 6]
look_at = [0, 0, 0]
fov = 30
resolution = [24, 16]
[[object]]
name = "ball"
shape = "sphere"
centre = [0, 0, 0]
radius = 1
rings = 16
segments = 32
material = "wax"
[[object]]
name = "lamp"
shape = "rectangle"
centre = [0, 5, 0]
edge_u = [2, 0, 0]
edge_v = [0, 0, 2]
material = "lamp"
[material.wax]
type = "translucent"
sigma_s_prime = [2, 3, 4]
sigma_a = [0.05, 0.1, 0.2]
eta = 1.3
[material.lamp]
type = "emissive"
radiance = 5
[environment]
radiance = 1
[method]
cache_samples = 200
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

fn marmor(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_marmor")).current_dir(folder).args(arguments).output().unwrap()
}

#[test]
fn models_are_held_against_a_truth() {
    let folder = folder();
    let arguments = [
        "compare",
        "scene.toml",
        "--models",
        "standard,normalised",
        "--truth",
        "beam",
        "--time-budget",
        "150ms",
        "-o",
        "out",
    ];
    let output = marmor(folder.path(), &arguments);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(told.contains("comes nearest to the reference"), "{told}");
    let out = folder.path().join("out");
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.len() < 2_000_000);
    for part in ["standard", "normalised", "data:image/png;base64,", "Where they differ", "marmor compare scene.toml"] {
        assert!(page.contains(part), "`{part}`");
    }
    // Signed: picture less reference; relative: over the root of r² and a hundredth of the mean square.
    let read = |name: &str| marmor::film::Image::read_exr(&out.join(name)).unwrap();
    let (x, r, d, q) =
        (read("standard.exr"), read("reference.exr"), read("standard_difference.exr"), read("standard_relative.exr"));
    let mean = r.pixels.iter().flat_map(|p| p.0).sum::<f32>() / (3 * r.pixels.len()) as f32;
    for i in [0, 100, 200] {
        let difference = x.pixels[i][1] - r.pixels[i][1];
        assert_eq!(d.pixels[i][1], difference);
        let relative = difference / (r.pixels[i][1].powi(2) + 0.01 * mean * mean).sqrt();
        assert!((q.pixels[i][1] - relative).abs() < 1e-5, "{} {relative}", q.pixels[i][1]);
    }
    for file in ["standard.png", "standard_relative.png", "normalised_difference.exr", "reference.png", "compare.csv"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let csv = fs::read_to_string(out.join("compare.csv")).unwrap();
    assert_eq!(csv.lines().count(), 4, "{csv}");
}

#[test]
fn a_model_against_itself_shows_no_bias() {
    let folder = folder();
    let arguments =
        ["compare", "scene.toml", "--models", "standard", "--truth", "standard", "--time-budget", "300ms", "-o", "out"];
    let told = marmor(folder.path(), &arguments);
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    let csv = fs::read_to_string(folder.path().join("out/compare.csv")).unwrap();
    let cells: Vec<f64> = csv.lines().last().unwrap().split(',').skip(1).map(|c| c.parse().unwrap()).collect();
    assert!((cells[1] - 1.0).abs() < 0.05, "{csv}");
    assert!(cells[4].abs() < 5.0 * cells[5], "bias {} within {}: {told}", cells[4], cells[5]);
}

#[test]
fn a_stored_film_is_a_truth_with_noise() {
    let folder = folder();
    let run = |arguments: &[&str]| {
        let output = marmor(folder.path(), arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(&["render", "scene.toml", "-q", "--model", "standard", "--seed", "9", "--spp", "16", "-o", "truth.film"]);
    let compare =
        ["compare", "scene.toml", "--models", "standard,better", "--reference", "truth.film", "--time-budget"];
    run(&[&compare[..], &["300ms", "-q", "-o", "out"]].concat());
    let csv = fs::read_to_string(folder.path().join("out/compare.csv")).unwrap();
    assert!(
        csv.starts_with("# scene; reference: truth.film, 16 samples; its noise: relMSE ") && !csv.contains("0.000e0")
    );
    let number = |row: usize, column: usize| -> f64 {
        csv.lines().nth(2 + row).unwrap().split(',').nth(column).unwrap().parse().unwrap()
    };
    // `standard` against itself shows no bias; `better` is some 10 % brighter.
    assert!(number(0, 5).abs() < 5.0 * number(0, 6), "{csv}");
    assert!((3e-3..0.1).contains(&number(1, 5)), "{csv}");
}
