//! Vectorised sums of photon beam diffusion over many cached entries, one depth each.

use super::Exit;
use super::gather::{BLOCK, EntryColumns, LANES, Layout, add, block};
use super::radial::in_mean_free_paths;
use crate::math::{Kernel, Vec3, exp2_m1, times_exp2};

/// Nearest distance of an exit to a source [mean free paths].
const LEAST_DISTANCE: f32 = 1e-6;

/// One channel of the kernel in f32, lengths in transport mean free paths.
#[derive(Clone, Copy, Debug)]
pub(super) struct SourceKernel {
    /// σ_t′ [1/unit] and its square.
    pub sigma: f32,
    pub sigma_squared: f32,
    pub s: f32,
    /// s log2 e.
    pub s_log2: f32,
    pub h: f32,
    pub c_phi_over_d: f32,
    pub c_e: f32,
    /// 2 σ / σ_t′ log2 e.
    pub kappa_log2: f32,
    /// α′² σ_t′² / 4π, over π and the exit normalisation [1/(unit² sr)].
    pub scale: f32,
}

impl SourceKernel {
    /// κ dip α′²: what one depth gives over its density [1/(unit² sr)]; as `BeamChannel::at_depth`.
    #[inline(always)]
    fn value(self, r2: f32, below: f32, travelled: f32) -> f32 {
        let (s, h) = (self.s, self.h);
        let (z_r, depth) = (below * self.sigma, travelled * self.sigma);
        let d = in_mean_free_paths(r2, self.sigma_squared).sqrt();
        let d = if d > z_r { d } else { z_r };
        let d_r = if d > LEAST_DISTANCE { d } else { LEAST_DISTANCE };
        let z_v = z_r + h;
        let apart = h * (z_r + z_v);
        let d_v = (d_r * d_r + apart).sqrt();
        let (over_r, over_v) = (1.0 / d_r, 1.0 / d_v);
        let t = apart / (d_r + d_v);
        let m = exp2_m1(-self.s_log2 * t);
        let fluence = (t * over_r - m) * over_v;
        let flux = (z_r * over_r) * over_r * (over_r + s) + (z_v * over_v) * over_v * (over_v + s) * (1.0 + m);
        let kappa = -exp2_m1(-self.kappa_log2 * (d_r + depth));
        times_exp2(self.scale * kappa * (self.c_phi_over_d * fluence + self.c_e * flux), -self.s_log2 * d_r)
    }
}

/// Columns beside point and weights: depth below the surface, -t w·n_i ≥ 0, and t [unit].
pub(super) const LAYOUT: Layout = Layout { vectors: 0, numbers: 2 };

/// Entries as sources: the point is x_i + t w, at the depth t that [`super::PhotonBeamDiffusion::sample_depth`] gave it, and the
/// weight has the factor [`super::DepthLaw::weights`] of t. The part of S_d is by [`super::Partition::share_source`].
pub(super) struct Sum<'a> {
    pub channels: [SourceKernel; 3],
    pub grey: bool,
    pub exits: &'a [Exit],
    pub sources: &'a EntryColumns<'a>,
    pub sums: &'a mut [[f64; 3]],
}

impl Kernel for Sum<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        for (exit, sum) in self.exits.iter().zip(self.sums) {
            *sum = sum_at(&self.channels, self.grey, exit.x, self.sources);
        }
    }
}

#[inline(always)]
fn sum_at(channels: &[SourceKernel; 3], grey: bool, at: Vec3, e: &EntryColumns<'_>) -> [f64; 3] {
    let count = e.count(2);
    let mut lanes = [[0.0_f64; LANES]; 3];
    let mut start = 0;
    while start < count {
        // Past the end, sources at the exit that weigh nothing.
        let [x, y, z]: [[f32; BLOCK]; 3] = std::array::from_fn(|k| {
            let mut apart = block(e.x[k], start, count, at[k]);
            apart.iter_mut().for_each(|v| *v -= at[k]);
            apart
        });
        let [below, travelled]: [[f32; BLOCK]; 2] = std::array::from_fn(|k| block(e.more[k], start, count, 1.0));
        let (mut s, mut part) = ([0.0_f32; BLOCK], [0.0_f32; BLOCK]);
        for i in 0..BLOCK {
            part[i] = e.partition.share_source(x[i] * x[i] + y[i] * y[i] + z[i] * z[i], travelled[i]);
        }
        for (c, lanes) in lanes.iter_mut().enumerate() {
            if c == 0 || !grey {
                for i in 0..BLOCK {
                    let r2 = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
                    s[i] = channels[c].value(r2, below[i], travelled[i]);
                }
            }
            let mut weight: [f32; BLOCK] = block(e.weight[c], start, count, 0.0);
            for (weight, part) in weight.iter_mut().zip(&part) {
                *weight *= part;
            }
            add(lanes, &s, &weight);
        }
        start += BLOCK;
    }
    lanes.map(|l| l.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::super::{Bssrdf, Entry, KappaExtinction, Partition, PhotonBeamDiffusion};
    use super::*;
    use crate::math::{Level, Rgb, hash, unit_f32};
    use crate::optics::Medium;

    struct Cache {
        entries: Vec<(Entry, f32)>,
        columns: [Vec<f32>; 5],
        weight: [Vec<f32>; 3],
    }

    impl Cache {
        fn new(model: &PhotonBeamDiffusion, count: u64) -> Self {
            let random = |i: u64| unit_f32((hash(i) >> 32) as u32);
            let mut cache = Self { entries: Vec::new(), columns: Default::default(), weight: [vec![], vec![], vec![]] };
            for i in 0..count {
                let u = |k: u64| random(8 * i + k);
                let n = Vec3::new(u(0) - 0.5, u(1) - 0.5, 1.0).normalize();
                let w = (Vec3::new(u(2) - 0.5, u(3) - 0.5, -1.0)).normalize();
                let x = Vec3::new(20.0 * (u(4) - 0.5), 20.0 * (u(5) - 0.5), 3.0 * u(6));
                let t = model.sample_depth(u(7));
                let source = x + w * t;
                for (column, value) in cache.columns.iter_mut().zip([source.x, source.y, source.z, -w.dot(n) * t, t]) {
                    column.push(value);
                }
                let own = model.depths().weights(f64::from(t));
                for (column, own) in cache.weight.iter_mut().zip(own) {
                    column.push(own as f32);
                }
                cache.entries.push((Entry { x, n, w }, t));
            }
            cache
        }

        fn columns(&self) -> EntryColumns<'_> {
            let [x, y, z, below, travelled] = &self.columns;
            let weight = [&*self.weight[0], &*self.weight[1], &*self.weight[2]];
            let more: [&[f32]; 6] = [below, travelled, &[], &[], &[], &[]];
            EntryColumns { x: [x, y, z], weight, more, partition: Partition::NONE }
        }
    }

    fn sum(model: &PhotonBeamDiffusion, level: Level, at: Vec3, columns: EntryColumns<'_>) -> [f64; 3] {
        let mut sums = [[0.0; 3]];
        model.gather_at(level, &[Exit { x: at, n: Vec3::Z, w: Vec3::Z }], &columns, &mut sums);
        sums[0]
    }

    fn models() -> Vec<PhotonBeamDiffusion> {
        [([0.74, 0.88, 1.01], [0.032, 0.17, 0.48]), ([1.0; 3], [0.0; 3]), ([0.9, 0.0, 30.0], [0.1, 1.0, 0.0])]
            .into_iter()
            .map(|(s, a)| Medium { sigma_s: Rgb(s), sigma_a: Rgb(a), g: 0.0, eta: 1.3 })
            .map(|m| PhotonBeamDiffusion::new(&m, true, KappaExtinction::Reduced))
            .collect()
    }

    #[test]
    fn the_sum_is_the_sum_of_single_evaluations() {
        for model in models() {
            for count in [1, 63, 64, 1000] {
                let cache = Cache::new(&model, count);
                let at = Vec3::new(0.3, -0.2, 1.0);
                let sum = sum(&model, Level::best(), at, cache.columns());
                let mut expected = [0.0; 3];
                for (entry, t) in &cache.entries {
                    let value = model.eval_at_depth(entry, *t, &Exit { x: at, n: Vec3::Z, w: Vec3::Z }, 0.0);
                    for c in 0..3 {
                        expected[c] += f64::from(value[c]);
                    }
                }
                for c in 0..3 {
                    assert!((sum[c] - expected[c]).abs() <= 1e-5 * expected[c], "{count}: {sum:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        for model in models() {
            let cache = Cache::new(&model, 1000);
            let at = Vec3::new(2.0, 1.0, 0.5);
            let first = sum(&model, Level::Baseline, at, cache.columns());
            for level in Level::available() {
                assert_eq!(sum(&model, level, at, cache.columns()), first, "{level:?}");
            }
        }
    }

    #[test]
    fn a_source_at_the_exit_and_one_far_away_are_finite() {
        for model in models() {
            for (x, below, t) in [(0.0, 0.0, 0.0), (0.0, 1.0, 1.0), (1e20, 1.0, 1.0), (3e38, 1e30, 1e30)] {
                let one = [1.0];
                let sources = EntryColumns {
                    x: [&[x], &[0.0], &[0.0]],
                    weight: [&one; 3],
                    more: [&[below], &[t], &[], &[], &[], &[]],
                    partition: Partition::NONE,
                };
                assert!(
                    sum(&model, Level::best(), Vec3::ZERO, sources).iter().all(|v| v.is_finite()),
                    "{x} {below} {t}"
                );
            }
        }
    }
}
