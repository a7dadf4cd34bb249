//! `marmor converge` as a user calls it: files, page, messages.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball_under_sky, folder, marmor, two_lamps};
use std::fs;

#[test]
fn a_report_has_its_page_plots_table_and_records() {
    let folder = ball_under_sky();
    let arguments =
        ["converge", "scene.toml", "--methods", "all,notes+100,all+standard", "--time-budget", "150ms", "-o", "out"];
    let output = marmor(folder.path(), &arguments);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(told.contains("At equal time (") && told.contains("index.html"), "{told}");
    let out = folder.path().join("out");
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.len() < 2_000_000, "{}", page.len());
    for part in ["notes+100", "<svg", "data:image/png;base64,", "marmor converge scene.toml", "threads", "reference"] {
        assert!(page.contains(part), "`{part}`");
    }
    for remote in ["src=\"http", "href=", "<script", "@import"] {
        assert!(!page.contains(remote), "the page fetches nothing: {remote}");
    }
    for svg in ["error_seconds.svg", "error_samples.svg"] {
        let svg = fs::read_to_string(out.join(svg)).unwrap();
        assert!(svg.starts_with("<svg") && !svg.contains("NaN") && !svg.contains("inf"));
        assert!(svg.contains("Machine: ") && svg.contains("marmor converge"), "alone, a plot says how it was made");
    }
    let csv = fs::read_to_string(out.join("converge.csv")).unwrap();
    let columns = csv.lines().nth(1).unwrap().split(',').count();
    assert!(csv.lines().skip(2).all(|l| l.split(',').count() == columns), "{csv}");
    for method in ["all", "notes+100", "all+standard"] {
        assert!(csv.lines().any(|l| l.starts_with(&format!("{method},"))), "{method}");
        let records = fs::read_to_string(out.join(format!("{method}.jsonl"))).unwrap();
        let last: serde_json::Value = serde_json::from_str(records.lines().last().unwrap()).unwrap();
        assert!(last["relmse"].as_f64().unwrap() > 0.0 && last["self_relmse"].as_f64().unwrap() > 0.0);
    }
}

/// Whether a coarse cut of centroids has come to its floor depends on the machine (`report/verdict.rs` tests the words by made-up
/// curves); the unbiased cut never has one.
#[test]
fn a_method_without_a_floor_is_not_said_to_have_one() {
    let folder = ball_under_sky();
    let methods = "cut,cluster+cut_error=0.9";
    let arguments = ["converge", "scene.toml", "--methods", methods, "--time-budget", "400ms", "-o", "out"];
    // The reference is rendered by the scene's own method, which would walk through a body of no named model.
    let more = ["-D", "method.cache_samples=2000", "-D", "material.wax.model=standard"];
    let output = marmor(folder.path(), &[&arguments[..], &more].concat());
    assert!(output.status.success(), "{}", command::text(&output.stderr));
    let page = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    assert!(page.contains("cluster+cut_error=0.9") && page.contains("At equal time"), "{page:.2000}");
    assert!(!page.contains(">cut flattens"), "{page:.2000}");
}

/// A diffusion model of a ball of few mean free paths against the path tracer has a floor, which a time of a test comes to; the path
/// tracer with other random numbers has none. Three seeds, each with a reference of its own, agree about where it is.
#[test]
fn a_floor_is_told_where_there_is_one_and_three_seeds_agree() {
    let folder = ball_under_sky();
    let run = |arguments: &[&str]| {
        let output = marmor(folder.path(), arguments);
        let told = command::text(&output.stderr);
        assert!(output.status.success(), "{told}");
        told
    };
    let floors: Vec<[f64; 2]> = ["1", "2", "3"]
        .iter()
        .map(|seed| {
            let of_reference = format!("10{seed}");
            let film = format!("{seed}.film");
            let reference = ["render", "scene.toml", "-q", "-o", &film, "--method", "volume_path", "--spp", "40"];
            run(&[&reference[..], &["--seed", &of_reference]].concat());
            let arguments = ["converge", "scene.toml", "--methods", "cut+standard,volume_path", "--reference", &film];
            let told = run(&[&arguments[..], &["--seed", seed, "--time-budget", "500ms", "-o", "out"]].concat());
            assert!(!told.contains("volume_path flattens"), "seed {seed}: {told}");
            let said = told.lines().find_map(|l| l.strip_prefix("cut+standard flattens: relMSE "));
            let said = said.unwrap_or_else(|| panic!("seed {seed}: no floor: {told}"));
            let interval = said.split_once("(95 %: ").unwrap().1.split_once(')').unwrap().0.split_once(" to ").unwrap();
            [interval.0, interval.1].map(|end| end.parse().unwrap())
        })
        .collect();
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        assert!(floors[i][0] <= floors[j][1] && floors[j][0] <= floors[i][1], "{floors:?}");
    }
    // Intervals that hold everything would agree too.
    assert!(floors.iter().all(|[low, high]| *low > 0.0 && high / low < 4.0), "{floors:?}");
}

#[test]
fn a_reference_may_be_given() {
    let folder = ball_under_sky();
    assert!(marmor(folder.path(), &["render", "scene.toml", "-q", "-o", "r.exr", "--spp", "64"]).status.success());
    let output = marmor(
        folder.path(),
        &[
            "converge",
            "scene.toml",
            "--methods",
            "all",
            "--reference",
            "r.exr",
            "--time-budget",
            "50ms",
            "-o",
            "o",
            "-q",
        ],
    );
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty());
    assert!(
        fs::read_to_string(folder.path().join("o/index.html")).unwrap().contains("r.exr; its own noise is not known")
    );
}

/// A millionth of the samples asks for the right lamp: no time of a test finds it often. Said by the terminal, the page and
/// the records; a verdict is left out.
#[test]
fn a_light_that_was_not_met_is_said_by_reports() {
    let folder = folder(&two_lamps(1.0, ""));
    for (words, file) in [(["converge", "--methods"], "direct.jsonl"), (["compare", "--models"], "compare.json")] {
        let more = ["scene.toml", words[1], "direct", "--time-budget", "100ms", "-o", words[0]];
        let truth: &[&str] = if words[0] == "compare" { &["--truth", "direct"] } else { &[] };
        let output = marmor(folder.path(), &[&words[..1], &more, truth].concat());
        let told = command::text(&output.stderr);
        assert!(output.status.success(), "{told}");
        let out = folder.path().join(words[0]);
        let page = fs::read_to_string(out.join("index.html")).unwrap().replace("&quot;", "\"");
        for said in [&told, &page] {
            assert!(said.contains("direct: not met yet: \"right\"; too few paths found it"), "{}: {told}", words[0]);
        }
        let written = fs::read_to_string(out.join(file)).unwrap();
        if words[0] == "converge" {
            assert!(page.contains("direct: no verdict: too few of its paths have met \"right\""), "{told}");
            let last: serde_json::Value = serde_json::from_str(written.lines().last().unwrap()).unwrap();
            assert_eq!(last["not_met"], serde_json::json!(["right"]));
            assert!(last["self_interval"].is_null(), "{last}");
        } else {
            assert!(written.contains("not met yet: \\\"right\\\""), "{written}");
        }
    }
    let met = command::folder(&two_lamps(1e6, ""));
    let output =
        marmor(met.path(), &["converge", "scene.toml", "--methods", "direct", "--time-budget", "200ms", "-o", "o"]);
    let told = command::text(&output.stderr);
    assert!(output.status.success() && !told.contains("not met"), "{told}");
}

/// What the methods render is what the reference is: there is nothing to tell apart.
#[test]
fn a_reference_with_the_seed_of_a_method_is_no_reference() {
    let folder = ball_under_sky();
    assert!(marmor(folder.path(), &["render", "scene.toml", "-q", "-o", "r.film", "--spp", "16"]).status.success());
    let arguments = ["converge", "scene.toml", "--methods", "all", "--reference", "r.film", "--time-budget", "20ms"];
    let output = marmor(folder.path(), &[&arguments[..], &["-o", "o"]].concat());
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    let page = fs::read_to_string(folder.path().join("o/index.html")).unwrap();
    assert!(page.contains("r.film, 16 samples; its own noise is relMSE ") && !page.contains("flattens"), "{told}");
    let csv = fs::read_to_string(folder.path().join("o/converge.csv")).unwrap();
    let columns: Vec<&str> = csv.lines().nth(1).unwrap().split(',').collect();
    for column in
        ["relmse_trimmed", "error_trimmed_low", "error_trimmed_high", "bias_trimmed_half_width", "worst_share"]
    {
        assert!(columns.contains(&column), "{column}");
    }
}

/// Refused before the methods have used their time, and before their files are made.
#[test]
fn a_reference_of_another_size_or_black_is_refused_first() {
    let folder = ball_under_sky();
    let render = |more: &[&str]| {
        let output = marmor(folder.path(), &[&["render", "scene.toml", "-q", "--spp", "2"], more].concat());
        assert!(output.status.success(), "{}", command::text(&output.stderr));
    };
    render(&["-o", "small.exr", "-D", "camera.resolution=[8,8]"]);
    render(&["-o", "black.exr", "-D", "environment.radiance=0", "-D", "material.lamp.radiance=0"]);
    for (reference, part) in [("small.exr", "8x8"), ("black.exr", "black")] {
        let arguments = ["converge", "scene.toml", "--methods", "all", "--reference", reference, "-o", "out"];
        let output = marmor(folder.path(), &arguments);
        let told = command::text(&output.stderr);
        assert!(!output.status.success() && told.contains(part), "{reference}: {told}");
        assert!(!folder.path().join("out/all.jsonl").exists(), "{reference}");
    }
}

#[test]
fn a_wrong_method_is_named_with_the_nearest_one() {
    let folder = ball_under_sky();
    for (methods, part) in
        [("cut,notse", "did you mean `notes`"), ("cut+as_notes", "as_notes has its own"), ("cut_eror=0.1", "cut_error")]
    {
        let output = marmor(folder.path(), &["converge", "scene.toml", "--methods", methods, "-o", "out"]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && told.contains(part), "{methods}: {told}");
    }
}

#[test]
fn an_error_to_reach_ends_a_render() {
    let folder = ball_under_sky();
    let output = marmor(
        folder.path(),
        &["render", "scene.toml", "-o", "x.exr", "--target-error", "2e-3", "--records", "r.jsonl", "--spp", "4000"],
    );
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && told.contains("reached --target-error"), "{told}");
    let records = fs::read_to_string(folder.path().join("r.jsonl")).unwrap();
    let figures: Vec<f64> = records
        .lines()
        .map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap()["self_relmse"].as_f64().unwrap_or(f64::MAX))
        .collect();
    let (last, before) = figures.split_last().unwrap();
    // What ends a render is a little more careful than what it tells.
    assert!(*last <= 2e-3 && before.iter().skip(8).all(|v| *v > 1.7e-3), "{figures:?}");
    assert!(told.contains("estimated relMSE"));
}

#[test]
fn variance_is_a_layer_of_the_exr() {
    let folder = ball_under_sky();
    let arguments = ["render", "scene.toml", "-q", "-o", "x.exr", "--layers", "variance", "--spp", "16"];
    assert!(marmor(folder.path(), &arguments).status.success());
    let layer = marmor::film::Image::read_exr_layer(&folder.path().join("x.exr"), Some("Variance")).unwrap();
    assert!(layer.pixels.iter().all(|p| p.min() >= 0.0) && layer.pixels.iter().any(|p| p[0] > 0.0));
    let one = marmor(folder.path(), &["render", "scene.toml", "-o", "x.exr", "--layers", "variance", "--spp", "1"]);
    assert!(String::from_utf8_lossy(&one.stderr).contains("at least 2 samples"));
}
