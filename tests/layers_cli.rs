//! Layers of an EXR as a user asks for them: values that are known, names that other readers know, merges, refusals; and
//! what `check` says of models.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;
mod parts;

use exr::prelude::*;
use parts::{camera, diffuse, rectangle, sky, sphere, translucent};
use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::Output;

/// A ball of radius 2 at (10, 0, 0), its transport mean free path 0.5: radius 4, thickness 8 of them. A floor below.
fn scene(model: &str) -> String {
    camera([10.0, 0.0, 12.0], [10.0, 0.0, 0.0], 24.0, [24, 24])
        + &sphere("ball", [10.0, 0.0, 0.0], 2.0, 96, "wax")
        + &rectangle("floor", [10.0, -2.2, 0.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0], "grey")
        + &translucent("wax", &format!("sigma_s_prime = 1.998\nsigma_a = 0.002\neta = 1.3\nmodel = \"{model}\""))
        + &diffuse("grey", [0.2, 0.4, 0.6])
        + &sky(1)
        + "[method]\ncache_samples = 200\n"
}

fn folder(model: &str) -> tempfile::TempDir {
    command::folder(&scene(model))
}

fn marmor(folder: &Path, arguments: &str) -> Output {
    command::marmor(folder, &arguments.split(' ').collect::<Vec<_>>())
}

fn told(output: &Output) -> String {
    command::text(&output.stderr) + &command::text(&output.stdout)
}

/// All channels of a file by name, as the exr crate reads them.
fn channels(path: &Path) -> HashMap<String, Vec<f32>> {
    let image = read_first_flat_layer_from_file(path).unwrap();
    let list = image.layer_data.channel_data.list;
    list.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}

const WIDTH: usize = 24;

fn at(x: usize, y: usize) -> usize {
    y * WIDTH + x
}

#[test]
fn layers_have_the_values_of_a_ball() {
    let folder = folder("beam");
    let all = "render scene.toml -q --spp 4 -o x.exr --layers variance,albedo,N,P,Z,single,validity";
    let output = marmor(folder.path(), all);
    assert!(output.status.success(), "{}", told(&output));
    let c = channels(&folder.path().join("x.exr"));
    let mut names: Vec<&str> = c.keys().map(String::as_str).collect();
    names.sort_unstable();
    let expected = "B G N.X N.Y N.Z P.X P.Y P.Z R Variance.B Variance.G Variance.R Z albedo.B albedo.G albedo.R single.B \
                    single.G single.R validity.Y validity.curvature validity.thickness";
    assert_eq!(names.join(" "), expected);
    let [middle, corner, below] = [at(12, 12), at(0, 0), at(12, 23)];
    // Half a pixel of the 24 is 0.106 at the ball.
    let near = |name: &str, i: usize, value: f32, tolerance: f32| {
        let found = c[name][i];
        assert!((found - value).abs() <= tolerance, "{name} at {i}: {found}, not {value}");
    };
    near("P.X", middle, 10.1, 0.1);
    near("P.Z", middle, 2.0, 0.02);
    near("Z", middle, 10.0, 0.02);
    near("N.Z", middle, 1.0, 0.01);
    near("albedo.G", below, 0.4, 1e-6);
    near("N.Y", below, 1.0, 1e-6);
    near("P.Y", below, -2.2, 1e-5);
    near("N.Z", corner, 0.0, 0.0);
    near("albedo.R", corner, 0.0, 0.0);
    assert_eq!(c["Z"][corner], f32::INFINITY);
    // A half space of this medium reflects 0.8716 of what enters.
    near("albedo.R", middle, 0.8716, 2e-3);
    // Thickness 8 and curvature 1/4 in transport mean free paths; the table between balls of radius 2 and 5.
    near("validity.thickness", middle, 8.0, 0.1);
    near("validity.curvature", middle, 0.25, 0.01);
    let weight = (4.0_f32 / 2.0).ln() / (5.0_f32 / 2.0).ln();
    near("validity.Y", middle, 0.158 + weight * (0.054 - 0.158), 0.006);
    near("validity.Y", below, 0.0, 0.0);
    // Light scattered once is a part of the picture: some tenth on the ball, none on the floor.
    let sum = |name: &str| (8..16).flat_map(|y| (8..16).map(move |x| at(x, y))).map(|i| c[name][i]).sum::<f32>();
    let share = sum("single.R") / sum("R");
    assert!((0.02..0.3).contains(&share) && c["single.R"][below] == 0.0, "{share}");
}

#[test]
fn the_single_layer_is_what_the_picture_has_more() {
    let folder = folder("beam");
    for (file, more) in [("with", ""), ("without", " -D method.single=false")] {
        let layers = if file == "with" { " --layers single" } else { "" };
        let arguments = format!("render scene.toml -q --spp 6 -D method.bounces=0 -o {file}.exr{layers}{more}");
        assert!(marmor(folder.path(), &arguments).status.success());
    }
    let [with, without] = ["with", "without"].map(|name| channels(&folder.path().join(format!("{name}.exr"))));
    for i in 0..WIDTH * WIDTH {
        let difference = with["G"][i] - without["G"][i];
        assert!((with["single.G"][i] - difference).abs() < 2e-6 * with["G"][i].max(1.0), "{i}");
    }
    let refused = marmor(folder.path(), "render scene.toml -q -D method.single=false --layers single -o x.exr");
    assert!(refused.status.code() == Some(2) && told(&refused).contains("single = false"), "{}", told(&refused));
}

#[test]
fn layers_are_right_after_a_resume_and_a_merge_or_refused() {
    let folder = folder("beam");
    let run = |arguments: &str| {
        let output = marmor(folder.path(), arguments);
        assert!(output.status.success(), "{arguments}: {}", told(&output));
    };
    let layers = "--layers variance,single,validity,Z";
    run(&format!("render scene.toml -q --spp 8 -o whole.exr {layers}"));
    run("render scene.toml -q --spp 3 -o part.film");
    run(&format!("render scene.toml -q --spp 8 -o part.film -o resumed.exr --resume {layers}"));
    let [whole, resumed] = ["whole", "resumed"].map(|name| channels(&folder.path().join(format!("{name}.exr"))));
    assert!(whole.len() > 8 && whole == resumed);
    for (a, b) in [(0, 3), (3, 8)] {
        run(&format!("render scene.toml -q --samples-range {a}..{b} -o {a}.film"));
    }
    run("merge -q 3.film 0.film -o merged.exr --layers variance");
    let merged = channels(&folder.path().join("merged.exr"));
    assert_eq!(merged["Variance.G"], whole["Variance.G"]);
    assert!(whole["Variance.G"].iter().any(|v| *v > 0.0));
    let refused = marmor(folder.path(), "merge -q 3.film 0.film -o x.exr --layers variance,validity");
    let text = told(&refused);
    assert!(refused.status.code() == Some(2) && text.contains("marmor render SCENE"), "{text}");
    assert!(!folder.path().join("x.exr").exists());
}

#[test]
fn check_says_which_model_to_trust() {
    // The ball of 4 transport mean free paths: `beam` 8 %, `standard` a third.
    let folder = folder("standard");
    let text = told(&marmor(folder.path(), "check scene.toml"));
    assert!(text.contains("which model to trust") && text.contains("ball (material wax):"), "{text}");
    assert!(text.contains("8 to 8 transport mean free paths thick, median 8; reduced albedo 0.9990"), "{text}");
    assert!(text.contains("`standard` (chosen): expected error 34 %") && text.contains("--model beam"), "{text}");
    let json: serde_json::Value =
        serde_json::from_slice(&marmor(folder.path(), "check scene.toml --json").stdout).unwrap();
    let models = json["validity"][0]["models"].as_array().unwrap();
    assert_eq!(models[0]["model"], "beam");
    assert!((models[0]["distribution"].as_f64().unwrap() - 0.079).abs() < 0.01, "{json:#}");
    // Mean curvature from heights around each place: 1/4 in transport mean free paths.
    assert!((json["validity"][0]["curvature"][1].as_f64().unwrap() - 0.25).abs() < 0.01, "{json:#}");
    // Held to less, it is trusted nowhere.
    let strict = told(&marmor(folder.path(), "check scene.toml --tolerance 0.02"));
    assert!(strict.contains("no model is right in this medium") && strict.contains("--method volume_path"), "{strict}");
    // Nothing is said where nothing is translucent.
    let opaque = scene("standard").replace("material = \"wax\"", "material = \"grey\"");
    fs::write(folder.path().join("opaque.toml"), opaque).unwrap();
    assert!(!told(&marmor(folder.path(), "check opaque.toml")).contains("which model"));
}

#[test]
fn the_validity_layer_has_no_number_where_none_was_measured() {
    let folder = folder("beam");
    // A medium beyond the table, and an open sheet in place of the floor.
    let render = "render scene.toml -q --spp 1 -o x.exr --layers validity";
    assert!(marmor(folder.path(), &format!("{render} -D material.wax.sigma_a=0")).status.success());
    let c = channels(&folder.path().join("x.exr"));
    let middle = at(12, 12);
    assert!(c["validity.Y"][middle].is_nan() && (c["validity.thickness"][middle] - 8.0).abs() < 0.1);
    assert_eq!(c["validity.Y"][at(0, 0)], 0.0, "nothing is there");
    assert!(marmor(folder.path(), &format!("{render} -D object.1.material=wax")).status.success());
    let c = channels(&folder.path().join("x.exr"));
    let below = at(12, 23);
    assert!(c["validity.Y"][below].is_nan() && c["validity.thickness"][below].is_nan());
    assert!(c["validity.Y"][middle] < 0.2);
}
