//! Properties that every BSSRDF model has to have; a new model joins by its line in the registry.
#![allow(clippy::unwrap_used)] // media of these tests are in range

use marmor::bssrdf::{
    Bssrdf, Entry, EntryColumns, Exit, LEAST_COLUMNS, MOST_COLUMNS, ModelName, ModelOptions, Partition, all_models,
};
use marmor::math::{GaussLegendre, Level, Rgb, Vec3, hash, unit_f32};
use marmor::optics::{FresnelMoments, Medium};
use proptest::prelude::*;

/// One evaluation: entry, exit and rate.
struct Eval(Entry, Exit, f32);

impl Eval {
    fn by(self, model: &dyn Bssrdf) -> Rgb {
        model.eval_compensated(&self.0, &self.1, self.2)
    }
}

/// Entry at the origin of a plane at normal incidence, exit at distance `r`.
fn plane(r: f32) -> (Entry, Exit) {
    let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z };
    (entry, Exit { x: Vec3::new(r, 0.0, 0.0), n: Vec3::Z, w: Vec3::Z })
}

fn eval_at(model: &dyn Bssrdf, r: f32) -> Rgb {
    let (entry, exit) = plane(r);
    Eval(entry, exit, 0.0).by(model)
}

/// Coefficients over six decades, albedos from dark to white, both sides of index match.
fn media() -> impl Strategy<Value = Medium> {
    let coefficient = || (-3.0_f32..3.0).prop_map(|e| 10.0_f32.powf(e));
    ([coefficient(), coefficient(), coefficient()], [0.0_f32..0.9, 0.0_f32..0.9, 0.0_f32..0.9], 0.4_f32..4.0).prop_map(
        |(s, a, eta)| {
            let sigma_a = Rgb::from_fn(|c| s[c] * a[c].powi(4));
            Medium::reduced(Rgb(s), sigma_a, eta).unwrap()
        },
    )
}

/// A medium whose channels have the same length, so that one r suits all.
fn even_media() -> impl Strategy<Value = Medium> {
    ([0.0_f32..0.9, 0.0_f32..0.9, 0.0_f32..0.9], 0.4_f32..4.0).prop_map(|(a, eta)| {
        let absorbed = a.map(|a| a.powi(4));
        Medium::reduced(Rgb(absorbed.map(|a| 1.0 - a)), Rgb(absorbed), eta).unwrap()
    })
}

fn all(medium: &Medium) -> Vec<Box<dyn Bssrdf>> {
    all_models(medium, true).unwrap()
}

fn unit(seed: u64) -> f32 {
    unit_f32((hash(seed) >> 32) as u32)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn s_is_a_density_per_area(medium in even_media(), r in 0.01_f32..20.0, k in 0.01_f32..100.0) {
        for (small, large) in all(&medium).iter().zip(all(&medium.scaled_by(k))) {
            let (a, b) = (eval_at(&**small, r), eval_at(&*large, k * r) * (k * k));
            for c in 0..3 {
                prop_assert!((a[c] - b[c]).abs() <= 2e-5 * a[c].abs() + 1e-30, "{:?}: {a:?} {b:?}", small.name());
            }
        }
    }

    /// Light at an angle and a tilted exit: directions do not scale.
    #[test]
    fn s_is_a_density_per_area_for_oblique_light(
        medium in even_media(), r in 0.01_f32..10.0, k in 0.01_f32..100.0, mu in 0.05_f32..1.0, phi in 0.0_f32..6.3, tilt in -1.0_f32..1.0,
    ) {
        let pair = |scale: f32| {
            let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: Vec3::new((1.0 - mu * mu).sqrt(), 0.0, -mu) };
            let x = Vec3::new(phi.cos(), phi.sin(), 0.0) * (r * scale);
            Eval(entry, Exit { x, n: Vec3::new(0.5 * tilt, 0.0, 1.0).normalize(), w: Vec3::Z }, 0.0)
        };
        for (small, large) in all(&medium).iter().zip(all(&medium.scaled_by(k))) {
            let (a, b) = (pair(1.0).by(&**small), pair(k).by(&*large) * (k * k));
            for c in 0..3 {
                // Where the directional dipole changes sign its digits cancel: against the size of S_d at such an r.
                let size = a[c].abs().max(1e-3 * eval_at(&**small, r)[c]);
                prop_assert!((a[c] - b[c]).abs() <= 1e-4 * size + 1e-30, "{:?}: {a:?} {b:?}", small.name());
            }
        }
    }

    #[test]
    fn channels_do_not_know_each_other(medium in media(), e in -3.0_f32..1.5) {
        for c in 0..3 {
            let one = Medium { sigma_a: Rgb::splat(medium.sigma_a[c]), sigma_s: Rgb::splat(medium.sigma_s[c]), ..medium };
            let options = ModelOptions::thick(1e4);
            // `auto` looks at all channels before it chooses.
            for name in ModelName::models() {
                let make = |m: &Medium| name.build(m, &options).unwrap();
                let r = 10.0_f32.powf(e) / medium.sigma_t_prime()[c];
                let (coloured, grey) = (eval_at(&*make(&medium), r), eval_at(&*make(&one), r));
                // Models that integrate over depth choose their nodes by the colour: not to the bit.
                prop_assert!((coloured[c] - grey[c]).abs() <= 1e-4 * grey[c].abs(), "{name:?}: {coloured:?} {grey:?}");
                prop_assert!(grey.is_grey());
            }
        }
    }

    #[test]
    fn reciprocity_where_claimed(medium in even_media(), seed in any::<u64>()) {
        let random = |i: u64| Vec3::from_array(std::array::from_fn(|k| unit(seed ^ (3 * i + k as u64)) - 0.5));
        let (x, y) = (random(0) * 4.0, random(1) * 4.0);
        let (n, m) = (random(2).normalize_or(Vec3::Z), random(3).normalize_or(Vec3::X));
        for model in all(&medium) {
            if model.claims().reciprocal {
                let there = Eval(Entry { x, n, w: -n }, Exit { x: y, n: m, w: m }, 0.0).by(&*model);
                let back = Eval(Entry { x: y, n: m, w: -m }, Exit { x, n, w: n }, 0.0).by(&*model);
                for c in 0..3 {
                    prop_assert!((there[c] - back[c]).abs() <= 1e-5 * there[c], "{:?}", model.name());
                }
            }
        }
    }

    #[test]
    fn the_compensated_value_is_the_value_times_the_exponential(medium in media(), e in -2.0_f32..1.0, part in 0.0_f32..1.0) {
        for model in all(&medium) {
            let rate = part * model.decay();
            let r = 10.0_f32.powf(e) * medium.transport_mean_free_path().min();
            let (entry, exit) = plane(r);
            let (kept, plain) = (Eval(entry, exit, rate).by(&*model), Eval(entry, exit, 0.0).by(&*model));
            prop_assert_eq!(plain, model.eval(&entry, &exit));
            for c in 0..3 {
                let expected = f64::from(plain[c]) * (f64::from(rate) * f64::from(r)).exp();
                if plain[c] > 1e-35 {
                    let error = (f64::from(kept[c]) / expected - 1.0).abs();
                    prop_assert!(error < 2e-5, "{:?} {c}: {} {expected}", model.name(), kept[c]);
                }
            }
        }
    }

    #[test]
    fn vectorised_loops_give_the_bits_of_the_scalar_code(medium in media(), seed in any::<u64>()) {
        let length = medium.transport_mean_free_path();
        // 203 is no multiple of any number of lanes.
        let r: Vec<f32> = (0..203).map(|i| length[0] * 10.0_f32.powf(9.0 * unit(seed ^ i) - 4.0)).collect();
        for model in all(&medium) {
            let Some(radial) = model.radial() else { continue };
            for level in Level::available() {
                for c in 0..3 {
                    let mut out = vec![0.0; r.len()];
                    radial.exitance_batch_at(level, c, &r, &mut out);
                    for (r, out) in r.iter().zip(&out) {
                        let scalar = radial.exitance(*r)[c];
                        prop_assert_eq!(out.to_bits(), scalar.to_bits(), "{:?} {:?} at {}", model.name(), level, r);
                    }
                }
            }
        }
    }

    #[test]
    fn sums_over_entries_are_sums_of_values(medium in even_media(), seed in any::<u64>(), count in 0_usize..300) {
        let vector = |i: usize, k: u64| Vec3::from_array([0, 1, 2].map(|c| 2.0 * unit(seed ^ (16 * i as u64 + k + c)) - 1.0));
        let ends = [(Vec3::new(0.1, -0.2, 0.3), Vec3::Z), (Vec3::new(2.0, 0.5, -0.4), Vec3::new(0.6, 0.0, 0.8))];
        let exits = ends.map(|(x, n)| Exit { x, n, w: n });
        for model in all(&medium) {
            let (mut columns, used) = (vec![Vec::new(); MOST_COLUMNS], model.layout().columns());
            let mut expected = [[0.0_f64; 3]; 2];
            for i in 0..count {
                let w = (vector(i, 3) - 2.0 * Vec3::Z).normalize();
                let entry = Entry { x: 3.0 * vector(i, 0), n: (0.5 * vector(i, 6) + Vec3::Z).normalize(), w };
                let (depth, flux) = (model.sample_depth(unit(seed ^ (16 * i as u64 + 9))), Rgb((vector(i, 10) + Vec3::ONE).to_array()));
                for (column, value) in columns[..used].iter_mut().zip(model.row(&entry, depth, flux)) {
                    column.push(value);
                }
                for (exit, sum) in exits.iter().zip(&mut expected) {
                    let s = model.eval_cached(&entry, depth, exit, 0.0);
                    (0..3).for_each(|c| sum[c] += f64::from(s[c]) * f64::from(flux[c]));
                }
            }
            let column = |k: usize| -> &[f32] { &columns[k] };
            let entries = EntryColumns {
                x: std::array::from_fn(column),
                weight: std::array::from_fn(|c| column(3 + c)),
                more: std::array::from_fn(|k| column(LEAST_COLUMNS + k)),
                partition: Partition::NONE,
            };
            let sums = |level| {
                let mut sums = [[f64::NAN; 3]; 2];
                let below_zero = model.gather_at(level, &exits, &entries, &mut sums);
                (sums, below_zero)
            };
            let baseline = sums(Level::Baseline);
            prop_assert!(model.clamps() || baseline.1 == 0);
            for level in Level::available() {
                prop_assert_eq!(sums(level), baseline, "{:?} {:?}", model.name(), level);
            }
            for (sum, expected) in baseline.0.iter().zip(&expected) {
                for c in 0..3 {
                    // Distances of glam and of the loop round differently; products are rounded to f32.
                    let most = 2e-5 * expected[c];
                    prop_assert!((sum[c] - expected[c]).abs() <= most, "{:?}: {sum:?} {expected:?}", model.name());
                }
            }
        }
    }

    #[test]
    fn energy_where_claimed(medium in media()) {
        for model in all(&medium) {
            let (claims, total) = (model.claims(), model.total());
            if claims.bounded_energy {
                prop_assert!(total.min() >= 0.0 && total.max() <= 1.0 + 1e-6, "{:?}: {total:?}", model.name());
            }
        }
    }
}

/// 2π ∫ r M(r) dr over all r, per channel; M is S_d · π 4 C_phi(1/η) where the model is no function of r alone.
fn integral(model: &dyn Bssrdf, eta: f32, length: f64) -> [f64; 3] {
    let exit = (std::f64::consts::PI * FresnelMoments::new(f64::from(eta)).four_c_phi_outside) as f32;
    let exitance = |r: f32| model.radial().map_or_else(|| eval_at(model, r) * exit, |radial| radial.exitance(r));
    // r = length · exp(v); beyond, an r⁻³ tail is a half of its first ring.
    let rule = GaussLegendre::new(16);
    let ring = |r: f64| exitance(r as f32).0.map(|m| 2.0 * std::f64::consts::PI * r * r * f64::from(m));
    let mut sum = ring(length * 14.0_f64.exp());
    for panel in 0..56 {
        let a = -14.0 + 0.5 * f64::from(panel);
        for (v, weight) in rule.points_on(a, a + 0.5) {
            let value = ring(length * v.exp());
            (0..3).for_each(|c| sum[c] += weight * value[c]);
        }
    }
    sum
}

#[test]
fn closed_form_totals_are_the_integrals_of_the_profile() {
    for eta in [0.75_f32, 1.0, 1.3, 1.5, 2.5] {
        for absorbed in [[0.0_f32, 1e-4, 1e-2], [0.1, 0.5, 0.9]] {
            let medium =
                Medium::reduced(Rgb(absorbed.map(|a| 2.0 - 2.0 * a)), Rgb(absorbed.map(|a| 2.0 * a)), eta).unwrap();
            for model in all(&medium) {
                let (total, sums) = (model.total(), integral(&*model, eta, 0.5));
                for c in 0..3 {
                    let (sum, exact) = (sums[c], f64::from(total[c]));
                    assert!(
                        (sum / exact - 1.0).abs() < 1e-5,
                        "{:?} {eta} {}: {sum} {exact}",
                        model.name(),
                        absorbed[c]
                    );
                }
            }
        }
    }
}

/// Every combination of the ends of each range has a finite value, and 0 where nothing scatters.
#[test]
fn no_input_gives_nan_or_infinity() {
    let numbers = [0.0_f32, 1e-6, 1.0, 1e6];
    for sigma_s in numbers {
        for sigma_a in [0.0_f32, 1e-12, 1e-6, 1.0, 1e6] {
            for g in [-0.9, 0.0, 0.999, 1.0 - 1e-9] {
                for eta in [0.4_f32, 0.75, 1.0, 1.000_000_1, 1.3, 4.0] {
                    // Slabs of five mean free paths, and none where there is no medium.
                    let medium = Medium::unreduced(Rgb::splat(sigma_s), Rgb::splat(sigma_a), g, eta).unwrap();
                    for model in all(&medium) {
                        for r in [0.0_f32, 1e-20, 1e-6, 1.0, 1e4, 1e10, 1e19, f32::MAX] {
                            let value = eval_at(&*model, r);
                            let case = format!("{:?} s {sigma_s} a {sigma_a} g {g} eta {eta} r {r}", model.name());
                            assert!(value.is_finite() && value.min() >= 0.0, "{case}: {value:?}");
                            assert!(sigma_s > 0.0 || value.is_black(), "{case}: {value:?}");
                            let rate = model.decay();
                            let (entry, exit) = plane(r);
                            let kept = Eval(entry, exit, rate).by(&*model);
                            assert!(kept.is_finite() && kept.min() >= 0.0, "{case}: compensated {kept:?}");
                        }
                        let (total, decay) = (model.total(), model.decay());
                        assert!(total.is_finite() && decay.is_finite() && decay >= 0.0, "{:?}", model.name());
                    }
                }
            }
        }
    }
}

#[test]
fn far_away_there_is_no_light_and_near_by_there_is() {
    let medium = Medium::reduced(Rgb::splat(1.0), Rgb([0.0, 0.01, 1.0]), 1.3).unwrap();
    for model in all(&medium) {
        let (near, far) = (eval_at(&*model, 1e-3), eval_at(&*model, 1e7));
        assert!(near.min() > 0.0, "{:?}: {near:?}", model.name());
        // Without absorption the slowest fall is r⁻³.
        for c in 0..3 {
            assert!(far[c] <= 1e-20 * near[c], "{:?}: {far:?} against {near:?}", model.name());
        }
    }
}

/// Without absorption, far out: R_d r³ → (z_r + z_v)/4π for the standard dipole.
#[test]
fn the_far_field_of_a_white_medium_is_a_dipole() {
    let medium = Medium::reduced(Rgb::splat(1.0), Rgb::BLACK, 1.3).unwrap();
    for model in all(&medium).iter().take(2) {
        let radial = model.radial().unwrap();
        let at = |r: f32| f64::from(radial.exitance(r)[0]) * f64::from(r).powi(3);
        assert!((at(1e4) / at(1e3) - 1.0).abs() < 1e-4, "{:?}: {} {}", model.name(), at(1e4), at(1e3));
        let expected = 5.467 / (4.0 * std::f64::consts::PI);
        if model.name() == ModelName::STANDARD {
            assert!((at(1e4) / expected - 1.0).abs() < 1e-3, "{} {expected}", at(1e4));
        }
    }
}
