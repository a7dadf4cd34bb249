//! `marmor compare` as a user calls it: files, page, messages.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball_under_sky, marmor};
use std::fs;

#[test]
fn models_are_held_against_a_truth() {
    let folder = ball_under_sky();
    let arguments = [
        "compare",
        "scene.toml",
        "--models",
        "standard,normalised",
        "--truth",
        "beam",
        "--time-budget",
        "400ms",
        "-o",
        "out",
    ];
    let output = marmor(folder.path(), &arguments);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(told.contains("nearest to the reference") && told.contains("Judged by the "), "{told}");
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
    // Two models, four parts of the picture each, which have all pixels.
    assert_eq!(csv.lines().count(), 2 + 2 * 4, "{csv}");
    let pixels = |part: &str| cell(&csv, "standard", part, "pixels");
    assert_eq!(pixels("translucent") + pixels("mixed") + pixels("background"), 24.0 * 16.0, "{csv}");
    // A ball of radius 1, 6.32 away, 30 degrees over 16 pixels: tan(9.1 degrees) 8 / tan(15 degrees) = 4.8 pixels of radius, an
    // area of 72. Of the pixels at its rim some half is on it.
    let area = pixels("translucent") + 0.5 * pixels("mixed");
    assert!((65.0..79.0).contains(&area) && pixels("mixed") > 20.0, "{csv}");
    let json: serde_json::Value = serde_json::from_str(&fs::read_to_string(out.join("compare.json")).unwrap()).unwrap();
    assert_eq!(json["models"][0]["parts"][2]["part"], "background");
    assert_eq!(json["models"][0]["parts"][0]["pixels"].as_f64(), Some(pixels("translucent")));
}

/// A number of compare.csv.
fn cell(csv: &str, model: &str, part: &str, column: &str) -> f64 {
    let k = csv.lines().nth(1).unwrap().split(',').position(|name| name == column).unwrap();
    let row = csv.lines().find(|l| l.starts_with(&format!("{model},{part},"))).unwrap();
    row.split(',').nth(k).unwrap().parse().unwrap()
}

/// The scattering of the ball is halved in the reference: the object is far darker, the sky the same, and the picture as a
/// whole hardly differs. The headline is of the object.
#[test]
fn background_does_not_dilute_what_an_object_is_wrong_by() {
    let folder = ball_under_sky();
    let dark = ["-D", "material.wax.sigma_a=[2,2,2]", "--model", "standard"];
    let run = |arguments: &[&str]| {
        let output = marmor(folder.path(), arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let render = ["render", "scene.toml", "-q", "--seed", "9", "--spp", "256", "-o"];
    run(&[&render[..], &["truth.film", "--model", "standard"]].concat());
    run(&[&render[..], &["truth.exr", "--model", "standard"]].concat());
    for reference in ["truth.film", "truth.exr"] {
        let compare =
            ["compare", "scene.toml", "--models", "standard", "--reference", reference, "--time-budget", "2s"];
        let told = run(&[&compare[..], &dark[..2], &["-o", "out"]].concat());
        let csv = fs::read_to_string(folder.path().join("out/compare.csv")).unwrap();
        let ratio = |part: &str| cell(&csv, "standard", part, "mean_ratio");
        assert!((0.1..0.6).contains(&ratio("translucent")) && ratio("all") > 0.85, "{csv}");
        assert!((ratio("background") - 1.0).abs() < 1e-3, "{csv}");
        let darker = format!("{:.1} % darker in the mean (95 %: ", 100.0 * (1.0 - ratio("translucent")));
        assert!(told.contains(&darker), "{darker}: {told}");
        assert_eq!(told.contains("does not tell its noise"), reference == "truth.exr", "{told}");
    }
}

#[test]
fn a_model_against_itself_shows_no_bias() {
    let folder = ball_under_sky();
    let arguments =
        ["compare", "scene.toml", "--models", "standard", "--truth", "standard", "--time-budget", "300ms", "-o", "out"];
    let told = marmor(folder.path(), &arguments);
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    let csv = fs::read_to_string(folder.path().join("out/compare.csv")).unwrap();
    let of = |column| cell(&csv, "standard", "translucent", column);
    assert!((of("mean_ratio_g") - 1.0).abs() < 0.05, "{csv}");
    // How many passes there are is the machine's: one run of twenty is outside its interval of 95 %, and says so.
    let (mean, low, high) = (of("mean_ratio"), of("mean_ratio_low"), of("mean_ratio_high"));
    assert!((mean - 1.0).abs() < 3.0 * 0.5 * (high - low), "{csv}");
    assert!(of("bias").abs() < 3.0 * of("bias_half_width"), "{told}: {csv}");
    assert!(told.contains("no difference is told from noise") || !(low..=high).contains(&1.0), "{told}");
}

#[test]
fn a_stored_film_is_a_truth_with_noise() {
    let folder = ball_under_sky();
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
    // `standard` against itself shows no bias; `better` is some 10 % brighter.
    let bias = |model| (cell(&csv, model, "all", "bias"), cell(&csv, model, "all", "bias_half_width"));
    let (same, other) = (bias("standard"), bias("better"));
    assert!(same.0.abs() < 1.5 * same.1, "{csv}");
    assert!((1e-4..0.1).contains(&other.0) && cell(&csv, "better", "translucent", "bias") > other.0, "{csv}");
}
