//! The lecture's estimator.

use super::Cache;
use crate::bssrdf::{Bssrdf, Exit};
use crate::math::{Rgb, hash};
use crate::tally::GatherTally;

/// (1/M) Σ S_d L_t over all cached samples, each kept with probability exp(-σ_tr d) and then weighted by its inverse
/// [Frisvad, "Subsurface Scattering", rejection control]. σ_tr is the smallest of the three channels': with
/// the mean or the largest the least absorbing channel has infinite variance. `key` seeds the decisions.
pub fn notes(cache: &Cache, model: &dyn Bssrdf, exit: &Exit, key: u64, tally: &mut GatherTally) -> Rgb {
    let decay = model.decay();
    let mut sum = [0.0_f64; 3];
    let (mut evaluated, clamps) = (0, model.clamps());
    for (number, sample) in cache.lit.iter().enumerate() {
        let distance = sample.entry.x.distance(exit.x);
        if chance(key, number) < f64::from((-decay * distance).exp()) {
            evaluated += 1;
            let s = model.eval_cached(&sample.entry, sample.depth, exit, decay);
            let light = s * sample.flux;
            for c in 0..3 {
                tally.clamped += u64::from(clamps && s[c] == 0.0 && sample.flux[c] > 0.0);
                sum[c] += f64::from(light[c]);
            }
        }
    }
    tally.pairs += cache.lit.len() as u64;
    tally.evaluated += evaluated;
    Rgb::from_fn(|c| (sum[c] / f64::from(cache.attempted.max(1))) as f32)
}

/// Uniform in [0, 1) with 53 bits, so that even very small probabilities are met exactly.
#[inline]
fn chance(key: u64, number: usize) -> f64 {
    let bits = hash(key.wrapping_add((number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bssrdf::{Entry, StandardDipole};
    use crate::cache::CachedSample;
    use crate::math::{Vec3, unit_f32};
    use crate::optics::Medium;

    /// Samples scattered over a square of 20 units, with uneven flux.
    fn cache(count: u32) -> Cache {
        let number = |i: u32, d: u32| unit_f32((hash(u64::from(i) * 8 + u64::from(d) + 1) >> 32) as u32);
        let sample = |i| CachedSample {
            entry: Entry {
                x: Vec3::new(20.0 * number(i, 0) - 10.0, 20.0 * number(i, 1) - 10.0, 0.0),
                n: Vec3::Z,
                w: -Vec3::Z,
            },
            depth: 0.0,
            flux: Rgb::from_fn(|c| 0.1 + number(i, 2 + c as u32)),
        };
        Cache { lit: (0..count).map(sample).collect(), attempted: 2 * count }
    }

    /// Mean over many decisions against the sum over all samples, channel by channel, within 6 standard errors.
    fn deviation(medium: &Medium, rate_of_decisions: f32) -> [f64; 3] {
        let model = StandardDipole::new(medium, true);
        let (cache, exit) = (cache(300), Exit { x: Vec3::new(1.0, 2.0, 0.0), n: Vec3::Z, w: Vec3::Z });
        let exact: [f64; 3] = std::array::from_fn(|c| {
            cache.lit.iter().map(|s| f64::from((model.eval(&s.entry, &exit) * s.flux)[c])).sum::<f64>()
                / f64::from(cache.attempted)
        });
        let (runs, mut sum, mut squares) = (4000_u64, [0.0; 3], [0.0; 3]);
        let mut tally = GatherTally::default();
        for run in 0..runs {
            let estimate = notes(&cache, &model, &exit, hash(run + 1), &mut tally);
            for c in 0..3 {
                let value = f64::from(estimate[c] * rate_of_decisions);
                sum[c] += value;
                squares[c] += value * value;
            }
        }
        assert!(tally.evaluated < tally.pairs, "rejection control keeps only some samples");
        std::array::from_fn(|c| {
            let n = runs as f64;
            let mean = sum[c] / n;
            let error = ((squares[c] / n - mean * mean) / (n - 1.0)).sqrt();
            (mean - exact[c]) / error
        })
    }

    const SKIN: Medium =
        Medium { sigma_a: Rgb([0.032, 0.17, 0.48]), sigma_s: Rgb([0.74, 0.88, 1.01]), g: 0.0, eta: 1.3 };

    #[test]
    fn the_mean_is_the_exact_sum() {
        for (channel, deviation) in deviation(&SKIN, 1.0).into_iter().enumerate() {
            assert!(deviation.abs() < 6.0, "channel {channel}: {deviation} standard errors");
        }
    }

    #[test]
    fn the_test_refuses_a_mean_that_is_two_percent_off() {
        assert!(deviation(&SKIN, 1.02).iter().all(|d| d.abs() > 6.0));
    }

    #[test]
    fn without_absorption_nothing_is_rejected() {
        let medium = Medium { sigma_a: Rgb::BLACK, ..SKIN };
        let (cache, model) = (cache(100), StandardDipole::new(&medium, true));
        let exit = Exit { x: Vec3::ZERO, n: Vec3::Z, w: Vec3::Z };
        let mut tally = GatherTally::default();
        let first = notes(&cache, &model, &exit, 1, &mut tally);
        assert_eq!(tally.evaluated, 100);
        assert_eq!(first, notes(&cache, &model, &exit, 2, &mut tally), "no decision is left to chance");
    }
}
