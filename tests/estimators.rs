//! Every estimator has the mean of the plain sum over the same samples, for every model.
#![allow(clippy::unwrap_used)] // a test that cannot make its model has failed

use marmor::bssrdf::{Bssrdf, Entry, Exit, ModelName, ModelOptions};
use marmor::cache::{Cache, CachedSample, Detail, Envelope, Gatherer, Scratch, Tuning};
use marmor::math::{Rgb, Vec3, hash, unit_f32};
use marmor::optics::Medium;
use marmor::scene::Estimator;
use marmor::tally::GatherTally;

const COLOURED: Medium =
    Medium { sigma_a: Rgb([0.032, 0.17, 0.48]), sigma_s: Rgb([0.74, 0.88, 1.01]), g: 0.0, eta: 1.3 };
const CLEAR: Medium = Medium { sigma_a: Rgb::BLACK, ..COLOURED };
/// As wide as a few decay lengths: the lecture's loop must keep some samples to tell its own error.
const MILD: Medium = Medium { sigma_a: Rgb([0.003, 0.017, 0.04]), sigma_s: Rgb([0.24, 0.38, 0.51]), g: 0.0, eta: 1.3 };
/// A hundred mean free paths between samples.
const STIFF: Medium = Medium { sigma_a: Rgb([1.0, 30.0, 0.0]), sigma_s: Rgb([100.0, 70.0, 200.0]), g: 0.0, eta: 1.5 };

fn number(i: u64, dimension: u64) -> f32 {
    unit_f32((hash(i * 16 + dimension + 1) >> 32) as u32)
}

/// Samples on a sphere of radius 8 with uneven, coloured flux and oblique directions.
fn cache(model: &dyn Bssrdf, count: u64) -> Cache {
    let sample = |i| {
        let z = 2.0 * number(i, 0) - 1.0;
        let (sin, cos) = (std::f32::consts::TAU * number(i, 1)).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        let n = Vec3::new(r * cos, r * sin, z);
        let aside = Vec3::new(number(i, 5) - 0.5, number(i, 6) - 0.5, number(i, 7) - 0.5);
        CachedSample {
            entry: Entry { x: 8.0 * n, n, w: (aside - n).normalize() },
            depth: model.sample_depth(number(i, 8)),
            flux: Rgb::from_fn(|c| 0.05 + number(i, 2 + c as u64).powi(3)),
        }
    };
    Cache { lit: (0..count).map(sample).collect(), attempted: 2 * count as u32 }
}

fn copy(cache: &Cache) -> Cache {
    Cache { lit: cache.lit.clone(), attempted: cache.attempted }
}

fn exits() -> [Exit; 3] {
    // On a sample's side, between, and where few samples are near.
    [Vec3::X, Vec3::new(0.6, -0.48, 0.64), -Vec3::Z].map(|n| Exit { x: 8.0 * n, n, w: n })
}

/// The sum written out, one evaluation a sample.
fn exact_sum(model: &dyn Bssrdf, cache: &Cache, exit: &Exit) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for s in &cache.lit {
        let value = model.eval_cached(&s.entry, s.depth, exit, 0.0);
        for c in 0..3 {
            sum[c] += f64::from(value[c]) * f64::from(s.flux[c]) / f64::from(cache.attempted);
        }
    }
    sum
}

/// One exit alone.
fn gather(
    gatherer: &Gatherer,
    model: &dyn Bssrdf,
    envelope: &Envelope,
    exit: &Exit,
    key: u64,
    scratch: &mut Scratch,
    tally: &mut GatherTally,
) -> Rgb {
    let mut out = Vec::new();
    gatherer.gather((model, envelope), (&[*exit], Detail::Fine), &[key], scratch, tally, &mut out);
    out[0]
}

/// Worst deviation of the mean of `runs` estimates from the exact sum, in standard errors; `off` is a planted factor.
/// Errors of f32 sums are counted as part of the standard error.
fn deviation(estimator: Estimator, model: &dyn Bssrdf, medium: &Medium, count: u64, runs: u64, off: f64) -> f64 {
    let cache = cache(model, count);
    let envelope = Envelope::new(model, medium);
    let gatherer = Gatherer::new(estimator, copy(&cache), model, Tuning::relative(0.1));
    let (mut scratch, mut tally, mut worst) = (Scratch::default(), GatherTally::default(), 0.0_f64);
    for (at, exit) in exits().iter().enumerate() {
        let exact = exact_sum(model, &cache, exit);
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for run in 0..runs {
            let key = hash(hash(run + 1) + at as u64);
            let value = gather(&gatherer, model, &envelope, exit, key, &mut scratch, &mut tally);
            for c in 0..3 {
                // About the exact value, so that squares keep their digits.
                let apart = f64::from(value[c]) * off - exact[c];
                sum[c] += apart;
                squares[c] += apart * apart;
            }
        }
        let n = runs as f64;
        for c in 0..3 {
            let mean = sum[c] / n;
            let error = ((squares[c] / n - mean * mean).max(0.0) / (n - 1.0)).sqrt();
            let rounding = 5e-6 * exact[c].abs() + 1e-30;
            worst = worst.max(mean.abs() / error.hypot(rounding));
        }
    }
    worst
}

fn models(medium: &Medium) -> Vec<Box<dyn Bssrdf>> {
    ModelName::models().map(|name| name.build(medium, &ModelOptions::thick(50.0)).unwrap()).collect()
}

#[test]
fn every_estimator_has_the_mean_of_the_sum() {
    for medium in [MILD, CLEAR, COLOURED, STIFF] {
        for model in models(&medium) {
            for &estimator in Estimator::ALL {
                if matches!(estimator, Estimator::Notes | Estimator::Thinned) && (medium == COLOURED || medium == STIFF)
                {
                    continue;
                }
                let (count, runs) = match estimator {
                    Estimator::Notes => (200, 300),
                    Estimator::All => (1500, 2),
                    Estimator::Thinned => (200, 300),
                    Estimator::Cut => (1500, 300),
                    // Biased: a test of its own.
                    Estimator::Cluster => continue,
                    new => panic!("{new:?} has no counts here"),
                };
                let found = deviation(estimator, &*model, &medium, count, runs, 1.0);
                assert!(found < 6.0, "{} {}: {found}", estimator.name(), model.name().name());
            }
        }
    }
}

#[test]
fn a_mean_that_is_two_percent_off_is_refused() {
    for model in models(&COLOURED) {
        for off in [0.98, 1.02] {
            let found = deviation(Estimator::Cut, &*model, &COLOURED, 1500, 600, off);
            assert!(found > 6.0, "{}: {found}", model.name().name());
        }
    }
}

#[test]
fn caches_of_a_few_samples_and_of_none_are_summed() {
    let model = ModelName::STANDARD.build(&COLOURED, &ModelOptions::DEFAULT).unwrap();
    let envelope = Envelope::new(&*model, &COLOURED);
    let mut scratch = Scratch::default();
    for count in [0, 1, 7, 8, 9, 1025] {
        let cache = cache(&*model, count);
        for &estimator in &[Estimator::All, Estimator::Cut] {
            let exact = exact_sum(&*model, &cache, &exits()[0]);
            let gatherer = Gatherer::new(estimator, copy(&cache), &*model, Tuning::relative(1e-4));
            let mut tally = GatherTally::default();
            let value = gather(&gatherer, &*model, &envelope, &exits()[0], 5, &mut scratch, &mut tally);
            for c in 0..3 {
                assert!((f64::from(value[c]) - exact[c]).abs() <= 1e-3 * exact[c], "{count} {}", estimator.name());
            }
            assert_eq!(tally.exits, 1);
        }
    }
}

#[test]
fn a_cut_visits_few_of_many_samples_and_its_noise_follows_the_error_asked_for() {
    let model = ModelName::STANDARD.build(&COLOURED, &ModelOptions::DEFAULT).unwrap();
    let envelope = Envelope::new(&*model, &COLOURED);
    let cache = cache(&*model, 20_000);
    let exact = exact_sum(&*model, &cache, &exits()[1]);
    let mut scratch = Scratch::default();
    let noise = [0.01, 0.1].map(|error| {
        let gatherer = Gatherer::new(Estimator::Cut, copy(&cache), &*model, Tuning::relative(error));
        let mut tally = GatherTally::default();
        let mut squares = 0.0;
        for run in 0..100 {
            let value = gather(&gatherer, &*model, &envelope, &exits()[1], hash(run), &mut scratch, &mut tally);
            squares += (f64::from(value[0]) / exact[0] - 1.0).powi(2) / 100.0;
        }
        assert!(tally.evaluated < 100 * 4000, "{tally:?}");
        squares.sqrt()
    });
    assert!(noise[0] < 0.04 && noise[0] < 0.6 * noise[1] && noise[1] < 0.1, "{noise:?}");
}

/// Exits side by side share a cut and its draws; each has the mean of its own sum.
#[test]
fn a_group_of_exits_has_the_means_of_its_sums() {
    for name in [ModelName::STANDARD, ModelName::BEAM, ModelName::DIRECTIONAL] {
        let model = name.build(&MILD, &ModelOptions::DEFAULT).unwrap();
        let envelope = Envelope::new(&*model, &MILD);
        let cache = cache(&*model, 3000);
        let gatherer = Gatherer::new(Estimator::Cut, copy(&cache), &*model, Tuning::relative(0.1));
        // Forty beside each other and five elsewhere.
        let exits: Vec<Exit> = (0..45_u64)
            .map(|i| {
                let aside = if i < 40 { 0.2 } else { 2.0 };
                let n = Vec3::new(1.0, aside * number(i, 9), aside * number(i, 10)).normalize();
                Exit { x: 8.0 * n, n, w: n }
            })
            .collect();
        let (mut scratch, mut tally, mut out) = (Scratch::default(), GatherTally::default(), Vec::new());
        let (runs, mut sums) = (300_u64, vec![[[0.0_f64; 3]; 2]; exits.len()]);
        let exact: Vec<[f64; 3]> = exits.iter().map(|exit| exact_sum(&*model, &cache, exit)).collect();
        for run in 0..runs {
            let keys: Vec<u64> = (0..exits.len() as u64).map(|i| hash(1 + run * 1000 + i)).collect();
            gatherer.gather((&*model, &envelope), (&exits, Detail::Fine), &keys, &mut scratch, &mut tally, &mut out);
            for ((sum, value), exact) in sums.iter_mut().zip(&out).zip(&exact) {
                for c in 0..3 {
                    let apart = f64::from(value[c]) - exact[c];
                    sum[0][c] += apart;
                    sum[1][c] += apart * apart;
                }
            }
        }
        assert!(tally.nodes < tally.exits * 100, "the walk is not shared: {tally:?}");
        let n = runs as f64;
        for (i, (sum, exact)) in sums.iter().zip(&exact).enumerate() {
            for c in 0..3 {
                let mean = sum[0][c] / n;
                let error = ((sum[1][c] / n - mean * mean).max(0.0) / (n - 1.0)).sqrt();
                let found = mean.abs() / error.hypot(5e-6 * exact[c]);
                assert!(found < 6.0, "{} exit {i}: {found} standard errors", name.name());
            }
        }
    }
}

/// Centroids are biased, the less the finer the cut; at the finest it is the plain sum.
#[test]
fn clusters_come_near_the_sum() {
    for name in [ModelName::STANDARD, ModelName::BEAM, ModelName::DIRECTIONAL] {
        let model = name.build(&MILD, &ModelOptions::DEFAULT).unwrap();
        let envelope = Envelope::new(&*model, &MILD);
        let cache = cache(&*model, 3000);
        let (mut scratch, mut tally) = (Scratch::default(), GatherTally::default());
        let exit = &exits()[1];
        let exact = exact_sum(&*model, &cache, exit);
        let bias = [1e-6, 0.03].map(|error| {
            let gatherer = Gatherer::new(Estimator::Cluster, copy(&cache), &*model, Tuning::relative(error));
            let draws = [1, 2].map(|key| gather(&gatherer, &*model, &envelope, exit, key, &mut scratch, &mut tally));
            assert!(draws[0] == draws[1], "nothing is left to chance");
            (f64::from(draws[0][0]) / exact[0] - 1.0).abs()
        });
        assert!(bias[0] < 1e-5 && bias[1] < 0.05 && bias[1] > bias[0], "{}: {bias:?}", name.name());
    }
}

/// The tree is built by several tasks, and nothing of it may depend on who does what.
#[test]
fn the_same_bits_come_out_for_any_number_of_threads() {
    for name in [ModelName::STANDARD, ModelName::BEAM, ModelName::DIRECTIONAL] {
        let model = name.build(&COLOURED, &ModelOptions::DEFAULT).unwrap();
        let envelope = Envelope::new(&*model, &COLOURED);
        let cache = cache(&*model, 20_000);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let gatherer = Gatherer::new(Estimator::Cut, copy(&cache), &*model, Tuning::relative(0.1));
                let mut scratch = Scratch::default();
                let mut tally = GatherTally::default();
                exits()
                    .map(|e| gather(&gatherer, &*model, &envelope, &e, 9, &mut scratch, &mut tally).0.map(f32::to_bits))
            })
        };
        let one = run(1);
        for threads in [2, 5] {
            assert_eq!(run(threads), one, "{}: {threads} threads", name.name());
        }
    }
}
