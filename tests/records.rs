//! Records: their keys are those of docs/records.md, and their clock stands while they are measured and written.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;
mod rendering;

use command::{ball, marmor, text, two_lamps};
use marmor::integrator::{AmbientOcclusion, View};
use marmor::query::{self, Backend};
use marmor::render::{Observer, Progress};
use rendering::{load, run};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// All keys of an object, those of objects in it as `outer.inner`.
fn keys(value: &Value, before: &str, out: &mut BTreeSet<String>) {
    for (key, value) in value.as_object().unwrap() {
        let name = format!("{before}{key}");
        if value.is_object() {
            keys(value, &format!("{name}."), out);
        } else {
            out.insert(name);
        }
    }
}

/// Keys in the first column of the first table of docs/records.md.
fn documented() -> BTreeSet<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/records.md");
    let text = fs::read_to_string(path).unwrap();
    let rows = text.lines().skip_while(|l| !l.starts_with("|---")).skip(1).take_while(|l| l.starts_with('|'));
    let names = |row: &str| -> Vec<String> {
        row.split('|').nth(1).unwrap().split('`').skip(1).step_by(2).map(str::to_owned).collect()
    };
    rows.flat_map(names).collect()
}

#[test]
fn each_pass_is_a_line_with_the_documented_keys() {
    let folder = command::ball_under_sky();
    let folder = folder.path();
    let render = |more: &[&str]| {
        let output = marmor(folder, &[&["render", "scene.toml", "-q", "-o", "x.exr", "--spp", "6"], more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
    };
    render(&["-o", "reference.exr", "--seed", "5"]);
    render(&["--records", "r.jsonl", "--reference", "reference.exr"]);
    let records = fs::read_to_string(folder.join("r.jsonl")).unwrap();
    let lines: Vec<Value> = records.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.iter().map(|l| l["pass"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 2, 3, 4, 5, 6]);
    let mut written = BTreeSet::new();
    keys(lines.last().unwrap(), "", &mut written);
    assert_eq!(written, documented(), "keys of a record, and docs/records.md");
    for pair in lines.windows(2) {
        let total = |l: &Value| l["seconds_total"].as_f64().unwrap();
        assert!(total(&pair[1]) > total(&pair[0]), "totals grow");
    }
}

/// Takes its time, as a slow disk or a large reference does, and notes how long the render was at work in between.
struct Slow {
    since: Instant,
    at_work: f64,
    told: f64,
}

const PAUSE: Duration = Duration::from_millis(20);

impl Observer for Slow {
    fn after_pass(&mut self, progress: &Progress<'_>) -> marmor::Result<()> {
        self.at_work += self.since.elapsed().as_secs_f64();
        self.told = progress.seconds.total();
        std::thread::sleep(PAUSE);
        self.since = Instant::now();
        Ok(())
    }
}

#[test]
fn the_clock_stands_while_observers_measure_and_write() {
    let scene = load(&ball([24, 16], "[environment]\nradiance = 1\n"));
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let mut slow = Slow { since: Instant::now(), at_work: 0.0, told: 0.0 };
    let method = AmbientOcclusion { radius: f32::INFINITY, rays: 1 };
    let view = View { scene: &scene, rays: &*rays };
    let (_, outcome) = run(&method, view, 1, 0..10, &mut [&mut slow]);
    // Whatever the machine does: what is told lies within the time that was not spent in the observer.
    assert!(slow.told > 0.0 && slow.told <= slow.at_work, "{} s told, {} s at work", slow.told, slow.at_work);
    assert_eq!(outcome.seconds.total(), slow.told);
}

#[test]
fn a_light_that_is_not_met_is_named_in_place_of_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let render = |scene: String, more: &[&str]| {
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let records = ["render", "scene.toml", "-o", "x.exr", "--records", "r.jsonl", "--target-error", "0.5"];
        let output = marmor(folder.path(), &[&records, more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let records = fs::read_to_string(folder.path().join("r.jsonl")).unwrap();
        (text(&output.stderr), serde_json::from_str::<Value>(records.lines().last().unwrap()).unwrap())
    };
    // A millionth of the samples asks for the right one.
    let (said, last) = render(two_lamps(1.0, ""), &["--spp", "12"]);
    assert!(said.contains("estimated relMSE: not met yet: \"right\"") && !said.contains("reached"), "{said}");
    assert_eq!(last["not_met"], serde_json::json!(["right"]));
    assert!(last["self_relmse"].is_f64() && last["self_interval"].is_null(), "{last}");
    // Half of them do.
    let (said, last) = render(two_lamps(1e6, ""), &["--spp", "12"]);
    assert!(said.contains("reached --target-error") && !said.contains("not met"), "{said}");
    assert_eq!(last["not_met"], serde_json::json!([]));
    // Something stands before it: it is waited for, but not for ever.
    let screen = "[[object]]\nname = \"screen\"\nshape = \"rectangle\"\ncentre = [2, 0, 1.4]\nedge_u = [0.7, 0, -0.7]\nedge_v = [0, 3, 0]\n\
                  material = \"wall\"\n";
    let (said, last) = render(two_lamps(1e6, screen), &["--spp", "200"]);
    assert!(said.contains("reached --target-error") && last["pass"].as_u64() > Some(20), "{said}");
    let [asked, came] = [0, 1].map(|i| last["rays"]["lights"][2][i].as_u64().unwrap());
    assert!(asked >= 1 << 16 && came == 0, "{last}");
}
