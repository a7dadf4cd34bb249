//! The path code of the renderer against the tables of another Monte Carlo program in `MARMOR_REFERENCE_DIR`
//! (`mc_totals.csv`, `mc_profile_normal.csv`, `mc_profile_slab.csv`): half spaces and slabs, ring by ring and by order.
//! `MARMOR_BENCH_PATHS` (200000) sets the paths a run, `MARMOR_BENCH_ONLY` picks runs by the first letters of their names.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)] // a bench that cannot run says so by stopping

#[path = "../tests/support/pencils.rs"]
mod pencils;
#[path = "../tests/support/profiles.rs"]
mod profiles;
#[path = "../tests/support/mod.rs"]
mod support;

use std::time::Instant;
use support::{Row, whole_table};

fn main() {
    let Some(totals) = whole_table("mc_totals.csv") else {
        println!("set MARMOR_REFERENCE_DIR to the folder of the tables");
        return;
    };
    let set = |name: &str| std::env::var(name).ok();
    let paths: u64 = set("MARMOR_BENCH_PATHS").and_then(|n| n.parse().ok()).unwrap_or(200_000);
    let only = set("MARMOR_BENCH_ONLY").unwrap_or_default();
    let tables = ["mc_profile_normal.csv", "mc_profile_slab.csv"].map(|name| whole_table(name).unwrap());
    println!("{:28} {:>8} {:>12} {:>7} {:>6} {:>6} {:>7}", "run", "paths", "chi2 / dof", "p", "z R", "z T", "s");
    let (mut all, mut freedom, mut low, mut runs, mut zs) = (0.0, 0, 1.0_f64, 0, Vec::new());
    for (seed, row) in totals.iter().enumerate() {
        let (name, start) = (row.text("name"), Instant::now());
        let of = |table: &Vec<Row>| table.iter().any(|b| b.text("name") == name);
        // A half space without absorption lets light go arbitrarily far.
        let endless = row.number("thickness") == 0.0 && row.number("mua") == 0.0;
        let Some(table) = tables.iter().find(|t| of(t)).filter(|_| !endless && name.starts_with(&only)) else {
            continue;
        };
        let bins: Vec<&Row> = table.iter().filter(|b| b.text("name") == name).collect();
        let found = profiles::against(row, &bins, paths, 11 + seed as u64);
        let text = |z: Option<f64>| z.map_or("-".into(), |z| format!("{z:.2}"));
        println!(
            "{name:28} {paths:>8} {:>6.1} / {:>3} {:>7.3} {:>6} {:>6} {:>7.1}",
            found.chi_square,
            found.freedom,
            found.p(),
            text(found.z[0]),
            text(found.z[1]),
            start.elapsed().as_secs_f64()
        );
        (all, freedom, low, runs) = (all + found.chi_square, freedom + found.freedom, low.min(found.p()), runs + 1);
        zs.extend(found.z.into_iter().flatten());
    }
    let rms = (zs.iter().map(|z| z * z).sum::<f64>() / zs.len().max(1) as f64).sqrt();
    let largest = zs.iter().fold(0.0_f64, |m, z| m.max(z.abs()));
    println!(
        "{runs} runs: chi-square {all:.0} of {freedom}; smallest p {low:.4}; z of totals: rms {rms:.2}, largest {largest:.2}"
    );
}
