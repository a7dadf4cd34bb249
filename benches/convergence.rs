//! Time to a given error of the default method on the project's own scenes, for comparing two commits.
//! docs/convergence.md shows how. `MARMOR_BENCH_SEEDS` (3) and `MARMOR_BENCH_BASELINE` (an earlier output) change it.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // a bench that cannot run says so by stopping

use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// Scene and the relMSE to reach at 192x192 pixels: a few seconds each on two cores.
const SCENES: [(&str, f64); 3] = [("lotus", 1e-3), ("box", 3e-3), ("tholos", 1e-3)];

/// Rendering time to the target [s] and passes, for one seed.
fn run(scene: &str, target: f64, seed: u32, folder: &Path) -> (f64, f64) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let records = folder.join("records.jsonl");
    let status = Command::new(env!("CARGO_BIN_EXE_marmor"))
        .arg("render")
        .arg(root.join("scenes").join(scene).join("scene.toml"))
        .args(["-q", "-D", "camera.resolution=[192,192]", "--seed", &seed.to_string()])
        .args(["--target-error", &target.to_string(), "--records"])
        .arg(&records)
        .arg("-o")
        .arg(folder.join("x.exr"))
        .status()
        .unwrap();
    assert!(status.success(), "{scene}");
    let text = std::fs::read_to_string(records).unwrap();
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    let number = |key: &str| last[key].as_f64().unwrap();
    // A pass is a coarse step: what the last one did too much is taken off by error x time = constant.
    let share = number("self_relmse") / target;
    ((number("seconds_cache") + number("seconds_gather")) * share, number("pass"))
}

fn main() {
    let seeds: u32 = std::env::var("MARMOR_BENCH_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(3);
    let baseline: Vec<Value> = std::env::var_os("MARMOR_BENCH_BASELINE")
        .map(|path| std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", Path::new(&path).display())))
        .map(|text| text.lines().map(|l| serde_json::from_str(l).unwrap()).collect())
        .unwrap_or_default();
    let folder = tempfile::tempdir().unwrap();
    let mut lines = String::new();
    for (scene, target) in SCENES {
        let runs: Vec<(f64, f64)> = (1..=seeds).map(|seed| run(scene, target, seed, folder.path())).collect();
        let n = runs.len() as f64;
        let seconds = runs.iter().map(|r| r.0).sum::<f64>() / n;
        let spread = (runs.iter().map(|r| (r.0 - seconds).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
        let error = spread / n.sqrt();
        let passes = runs.iter().map(|r| r.1).sum::<f64>() / n;
        let line = json!({
            "scene": scene, "target_relmse": target, "seconds": seconds, "standard_error": error, "passes": passes,
            "seeds": seeds, "threads": std::thread::available_parallelism().map_or(1, |n| n.get()),
        });
        lines += &format!("{line}\n");
        let before = baseline.iter().find(|b| b["scene"] == scene && b["target_relmse"] == json!(target));
        let change = before.map_or(String::new(), |b| {
            let old = b["seconds"].as_f64().unwrap();
            let both = (error / seconds).hypot(b["standard_error"].as_f64().unwrap() / old);
            format!("; {:.3} ± {:.3} times the baseline's {old:.2} s", seconds / old, seconds / old * both)
        });
        println!("{scene:8} relMSE {target:.0e}: {seconds:.2} ± {error:.2} s, {passes:.0} passes{change}");
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("convergence.jsonl");
    std::fs::write(&path, lines).unwrap();
    println!("wrote {}", path.display());
}
