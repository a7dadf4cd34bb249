//! Evaluations of S_d per second, one channel: the scalar code, and the same code vectorised for each instruction set
//! of this machine. Distances lie in L1 cache and spread over 1e-2..1e2 transport mean free paths.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)] // a bench prints, and its media are in range

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use marmor::bssrdf::{
    Bssrdf, DirectionalDipole, Entry, EntryColumns, Exit, KappaExtinction, Layout, Partition, PhotonBeamDiffusion,
    all_models,
};
use marmor::math::{Level, Rgb, Vec3};
use marmor::optics::Medium;
use std::hint::black_box;
use std::time::Instant;

const COUNT: usize = 2048;

fn distances() -> Vec<f32> {
    (0..COUNT).map(|i| 10.0_f32.powf(4.0 * ((i * 1217 % COUNT) as f32 / COUNT as f32) - 2.0)).collect()
}

/// Whole milk, red; slab of five transport mean free paths.
fn models() -> Vec<Box<dyn Bssrdf>> {
    let medium = Medium::reduced(Rgb::splat(2.55), Rgb::splat(0.0011), 1.3).unwrap();
    all_models(&medium, true).unwrap()
}

/// Evaluations per second of `f`, which makes [`COUNT`] of them: the best of twenty runs of some 5 ms.
fn rate(mut f: impl FnMut()) -> f64 {
    let start = Instant::now();
    f();
    let repeats = (5e-3 / start.elapsed().as_secs_f64().max(1e-9)).ceil().clamp(1.0, 10_000.0) as u32;
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let start = Instant::now();
        for _ in 0..repeats {
            f();
        }
        best = best.min(start.elapsed().as_secs_f64());
    }
    f64::from(repeats) * COUNT as f64 / best
}

/// Whole milk, all channels.
fn coloured() -> Medium {
    Medium::reduced(Rgb([2.55, 3.21, 3.77]), Rgb([0.0011, 0.0024, 0.014]), 1.3).unwrap()
}

/// The sums that the cache makes, light refracted at 45 degrees: entries of the directional dipole, sources of `beam`
/// with one depth each. A pair is a point of entry and its three channels.
fn gathers(medium: &Medium, name: &str, r: &[f32]) {
    let column = |v: f32| vec![v; COUNT];
    let (zero, one, slant) = (column(0.0), column(1.0), column(std::f32::consts::FRAC_1_SQRT_2));
    let down = column(-std::f32::consts::FRAC_1_SQRT_2);
    let directional = DirectionalDipole::new(medium, false);
    let more: [&[f32]; 6] = [&zero, &zero, &one, &slant, &zero, &down];
    let entries = EntryColumns { x: [r, &zero, &zero], weight: [&one; 3], more, partition: Partition::NONE };
    let beam = PhotonBeamDiffusion::new(medium, true, KappaExtinction::default());
    let w = Vec3::new(slant[0], 0.0, down[0]);
    let t: Vec<f32> = (0..COUNT).map(|i| beam.sample_depth((i * 769 % COUNT) as f32 / COUNT as f32)).collect();
    let x: Vec<f32> = r.iter().zip(&t).map(|(r, t)| r + t * w.x).collect();
    let (z, below): (Vec<f32>, Vec<f32>) = t.iter().map(|t| (t * w.z, -t * w.z)).unzip();
    let more: [&[f32]; 6] = [&below, &t, &[], &[], &[], &[]];
    let sources = EntryColumns { x: [&x, &zero, &z], weight: [&one; 3], more, partition: Partition::NONE };
    let exits = [Exit { x: Vec3::ZERO, n: Vec3::Z, w: Vec3::Z }];
    let scalar = rate(|| {
        for (&r, &t) in black_box(r).iter().zip(&t) {
            let entry = Entry { x: Vec3::new(r, 0.0, 0.0), n: Vec3::Z, w };
            black_box(beam.eval_at_depth(&entry, t, &Exit { x: Vec3::ZERO, n: Vec3::Z, w: Vec3::Z }, 0.0));
        }
    });
    println!("{:<32} {:>10.1} 1e6 pairs/s, scalar", format!("beam at one depth, {name}"), scalar / 1e6);
    for level in Level::available() {
        let d = rate(|| {
            black_box(directional.gather_at(level, black_box(&exits), &entries, black_box(&mut [[0.0; 3]])));
        });
        let b = rate(|| {
            black_box(beam.gather_at(level, black_box(&exits), &sources, black_box(&mut [[0.0; 3]])));
        });
        println!(
            "{:<32} {:>10.1} 1e6 pairs/s; beam at one depth {:.1}, {level:?}",
            format!("gather directional, {name}"),
            d / 1e6,
            b / 1e6
        );
    }
}

/// Evaluations of S_d in three channels, one pair of points after the other.
fn pairs(model: &dyn Bssrdf, r: &[f32]) -> f64 {
    let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z };
    rate(|| {
        for &r in black_box(r) {
            black_box(model.eval(&entry, &Exit { x: Vec3::new(r, 0.0, 0.0), n: Vec3::Z, w: Vec3::Z }));
        }
    })
}

fn table() {
    println!("{:<12} {:>12} {:>24} {:>8} {:>16}", "model", "scalar 1e6/s", "vectorised 1e6/s", "ratio", "gather 1e6/s");
    let (r, mut out) = (distances(), vec![0.0; COUNT]);
    let (zero, one) = (vec![0.0; COUNT], vec![1.0; COUNT]);
    for model in models() {
        let Some(radial) = model.radial() else { continue };
        let scalar = rate(|| {
            for &r in black_box(&r) {
                black_box(radial.exitance_one(0, black_box(r)));
            }
        });
        let levels: Vec<f64> = Level::available()
            .into_iter()
            .map(|level| rate(|| radial.exitance_batch_at(level, 0, black_box(&r), black_box(&mut out))))
            .collect();
        let gathered = (model.layout() == Layout::POINTS).then(|| {
            let (x, more): ([&[f32]; 3], [&[f32]; 6]) = ([&r, &zero, &zero], [&[]; 6]);
            let entries = EntryColumns { x, weight: [&one; 3], more, partition: Partition::NONE };
            let exits = [Exit { x: Vec3::ZERO, n: Vec3::Z, w: Vec3::Z }];
            rate(|| {
                black_box(model.gather(black_box(&exits), &entries, black_box(&mut [[0.0; 3]])));
            })
        });
        let shown = levels.iter().map(|v| format!("{:.0}", v / 1e6)).collect::<Vec<_>>().join(" / ");
        let best = levels.last().copied().unwrap_or(scalar);
        println!(
            "{:<12} {:>12.0} {:>24} {:>8.1} {:>16}",
            model.name().name(),
            scalar / 1e6,
            shown,
            best / scalar,
            gathered.map_or("-".into(), |v| format!("{:.0}", v / 1e6))
        );
    }
    for model in all_models(&coloured(), true).unwrap() {
        println!(
            "{:<12} {:>12.2} 1e6 pairs of points per second, three channels",
            model.name().name(),
            pairs(&*model, &r) / 1e6
        );
    }
    gathers(&Medium::reduced(Rgb::splat(2.55), Rgb::splat(0.0011), 1.3).unwrap(), "grey", &r);
    gathers(&coloured(), "three channels", &r);
    println!("vectorised: {:?}; gather: grey medium, three weights", Level::available());
}

fn bench(criterion: &mut Criterion) {
    table();
    let (r, mut out) = (distances(), vec![0.0; COUNT]);
    let mut group = criterion.benchmark_group("exitance");
    group.throughput(Throughput::Elements(COUNT as u64));
    for model in models() {
        let Some(radial) = model.radial() else { continue };
        group.bench_function(format!("{} vectorised", model.name().name()), |b| {
            b.iter(|| radial.exitance_batch(0, black_box(&r), black_box(&mut out)));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
