//! `--stats`: what was built, what it cost, how fast it went.

use super::advice::Advice;
use marmor::film::{Film, write_atomically};
use marmor::integrator::Part;
use marmor::render::Outcome;
use marmor::scene::Scene;
use marmor::{Error, Result};
use serde_json::json;
use std::path::Path;

/// What is known when a render has ended.
pub struct Stats<'a> {
    /// The scene file with all options folded in.
    pub effective: &'a str,
    pub scene: &'a Scene,
    pub backend: &'a str,
    pub seconds_setup: f64,
    pub parts: &'a [Part],
    /// What was said before the first pass.
    pub advice: Option<&'a Advice<'a>>,
    pub outcome: &'a Outcome,
    pub film: &'a Film,
}

/// Writes the statistics of a finished render.
pub fn write(path: &Path, stats: &Stats<'_>) -> Result<()> {
    let Stats { effective, scene, backend, seconds_setup, parts, advice, outcome, film } = stats;
    let (seconds, tally) = (outcome.seconds, outcome.tally);
    let per_second = |count: u64, seconds: f64| if seconds > 0.0 { count as f64 / seconds } else { 0.0 };
    let exits = tally.gather.exits.max(1) as f64;
    let stats = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "scene": scene.name,
        "effective_scene": effective,
        "backend": backend,
        "threads": rayon::current_num_threads(),
        "objects": scene.objects.iter().map(|o| json!({
            "name": o.name,
            "triangles": o.mesh.triangles.len(),
            "material": scene.materials[o.material].name,
        })).collect::<Vec<_>>(),
        "parts": parts,
        "validity": advice.map(|a| a.bodies.iter().map(|t| a.json(t)).collect::<Vec<_>>()),
        "in_picture": advice.map(|a| &a.shares),
        "says": advice.map(|a| a.lines()),
        "passes": film.passes(),
        "peak_bytes": marmor::memory::peak(),
        "seconds": { "setup": seconds_setup, "cache": seconds.cache, "gather": seconds.gather },
        "clock": tally.clock,
        "rays": tally.rays,
        "gather": tally.gather,
        "walk": tally.walk,
        "per_exit": {
            "nodes": tally.gather.nodes as f64 / exits,
            "pairs": tally.gather.pairs as f64 / exits,
            "evaluated": tally.gather.evaluated as f64 / exits,
            "near_points": tally.gather.near_points as f64 / exits,
            "near": tally.gather.near as f64 / exits,
        },
        "per_second": {
            "rays": per_second(tally.rays.total(), seconds.total()),
            "cache_samples": per_second(tally.gather.samples, seconds.cache),
            "pairs": per_second(tally.gather.pairs, seconds.gather),
        },
        "counts": film.counts(),
    });
    let text = format!("{stats:#}\n");
    write_atomically(path, |out| out.write_all(text.as_bytes())).map_err(|e: Error| e.within("statistics"))
}
