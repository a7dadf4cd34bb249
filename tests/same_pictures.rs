//! Before and after a change that must not change pictures: every scene by every method, model and estimator, pixel by pixel,
//! bit by bit, on one machine.
//!
//! ```text
//! MARMOR_PICTURES=/tmp/before MARMOR_PROGRAM=/path/to/old/marmor cargo test --release --test same_pictures -- --ignored
//! MARMOR_PICTURES=/tmp/before cargo test --release --test same_pictures -- --ignored
//! ```
//!
//! The first call writes the pictures' hashes, the second compares with them. They are not kept in the project: the sine of
//! another machine's library may differ in its last digit.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // a test that cannot render has failed; it prints what it did

mod command;

use marmor::bssrdf::ModelName;
use marmor::film::Image;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

const ESTIMATORS: [&str; 5] = ["cut", "cluster", "all", "thinned", "notes"];

/// What a medium of many mean free paths and a sheet need: a near field, a thickness.
const STIFF: &str = "-D material.wax.sigma_s_prime=300";
const SHEET: &str = "--model slab -D material.wax.thickness=3";

/// Options of every picture of a scene; `translucent` by all models, with all estimators.
fn pictures(translucent: bool) -> Vec<String> {
    let mut all = ["ambient_occlusion", "direct", "volume_path"].map(|method| format!("--method {method}")).to_vec();
    if translucent {
        let more = ["--as-notes", "-D method.single=false", "-D method.entry=\"cosine\"", "-D method.spread=\"area\""];
        all.extend(more.map(String::from));
        let models = ModelName::half_spaces().chain([ModelName::AUTO]);
        all.extend(models.map(|model| format!("--model {}", model.name())));
        all.extend(ESTIMATORS.map(|estimator| format!("--model beam --estimator {estimator}")));
    }
    all
}

#[test]
#[ignore = "compares two builds of the program; see the head of the file"]
fn pictures_are_the_same_bit_for_bit() {
    let kept = std::env::var("MARMOR_PICTURES").expect("MARMOR_PICTURES names the file of hashes");
    let program = std::env::var("MARMOR_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_marmor").into());
    let folder = tempfile::tempdir().unwrap();
    let mut found = BTreeMap::new();
    let sky = "[environment]\nradiance = [0.5, 0.6, 0.7]\n";
    std::fs::write(folder.path().join("scene.toml"), command::ball([40, 30], sky)).unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let at = |name: &str| (name.to_string(), scenes.join(name).join("scene.toml"));
    let ball = ("ball".to_string(), folder.path().join("scene.toml"));
    for (scene, file) in [ball, at("lotus"), at("box"), at("tholos")] {
        let mut all = pictures(scene == "ball" || scene == "lotus");
        if scene == "ball" {
            all.extend(ModelName::half_spaces().map(|model| format!("--model {} {STIFF}", model.name())));
            all.extend(ESTIMATORS.map(|estimator| format!("{SHEET} --estimator {estimator}")));
        }
        for options in all {
            let out = folder.path().join("picture.exr");
            let _ = std::fs::remove_file(&out);
            let ran = Command::new(&program)
                .arg("render")
                .arg(&file)
                .args(["--backend", "bvh", "--spp", "3", "-D", "camera.resolution=[40,30]"])
                .args(["-D", "method.cache_samples=20000", "--output"])
                .arg(&out)
                .args(options.split(' '))
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&ran.stderr);
            let name = format!("{scene} {}", options);
            // What is refused must be refused before and after.
            let value = if ran.status.success() {
                format!("{:016x}", Image::read_exr(&out).unwrap().fingerprint())
            } else {
                format!("exit {:?}", ran.status.code())
            };
            println!("{name}: {value} {}", if ran.status.success() { "" } else { said.lines().last().unwrap_or("") });
            found.insert(name, value);
        }
    }
    let text: String = found.iter().map(|(name, value)| format!("{name}\t{value}\n")).collect();
    match std::fs::read_to_string(&kept) {
        Ok(before) => {
            let before: BTreeMap<String, String> =
                before.lines().filter_map(|l| l.split_once('\t')).map(|(n, v)| (n.into(), v.into())).collect();
            let differ: Vec<&String> =
                found.iter().filter(|(n, v)| before.get(*n) != Some(v)).map(|(n, _)| n).collect();
            assert!(
                differ.is_empty() && before.len() == found.len(),
                "{} of {}: {differ:?}",
                differ.len(),
                found.len()
            );
        }
        Err(_) => std::fs::write(&kept, text).unwrap(),
    }
}
