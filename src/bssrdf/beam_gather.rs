//! Vectorised sums of photon beam diffusion over many cached entries, one depth each.

use super::Partition;
use super::beam::PhotonBeamDiffusion;
use super::radial::{BLOCK, LANES, add, in_mean_free_paths};
use crate::math::{Kernel, Level, Vec3, dispatch_at, exp2_m1, times_exp2};

/// Nearest distance of an exit to a source [mean free paths].
const LEAST_DISTANCE: f32 = 1e-6;

/// Cached entries in columns of one length: the source of each on its refracted ray, at the depth t that
/// [`PhotonBeamDiffusion::sample_depth`] gave it.
#[derive(Clone, Copy, Debug)]
pub struct SourceColumns<'a> {
    /// Coordinates of x_i + t w [unit].
    pub x: &'a [f32],
    /// Coordinates [unit].
    pub y: &'a [f32],
    /// Coordinates [unit].
    pub z: &'a [f32],
    /// Depth below the surface, -t w·n_i ≥ 0 [unit].
    pub below: &'a [f32],
    /// t [unit].
    pub travelled: &'a [f32],
    /// Flux or any other weight, per channel, times [`super::DepthLaw::weights`] of t.
    pub weight: [&'a [f32]; 3],
    /// The part of S_d that is summed, by [`Partition::share_source`].
    pub partition: Partition,
}

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

struct Sum<'a> {
    channels: [SourceKernel; 3],
    grey: bool,
    at: Vec3,
    sources: SourceColumns<'a>,
}

impl Kernel for Sum<'_> {
    type Out = [f64; 3];

    #[inline(always)]
    fn run(self) -> [f64; 3] {
        let e = &self.sources;
        let columns = [e.x, e.y, e.z, e.below, e.travelled, e.weight[0], e.weight[1], e.weight[2]];
        let count = columns.iter().map(|c| c.len()).min().unwrap_or(0);
        let mut lanes = [[0.0_f64; LANES]; 3];
        let mut start = 0;
        while start < count {
            // Past the end, sources at the exit that weigh nothing.
            let [x, y, z] = [(e.x, self.at.x), (e.y, self.at.y), (e.z, self.at.z)].map(|(c, at)| {
                let mut apart = block(c, start, count, at);
                apart.iter_mut().for_each(|v| *v -= at);
                apart
            });
            let (below, travelled) = (block(e.below, start, count, 1.0), block(e.travelled, start, count, 1.0));
            let (mut s, mut part) = ([0.0_f32; BLOCK], [0.0_f32; BLOCK]);
            for i in 0..BLOCK {
                part[i] = e.partition.share_source(x[i] * x[i] + y[i] * y[i] + z[i] * z[i], travelled[i]);
            }
            for (c, lanes) in lanes.iter_mut().enumerate() {
                if c == 0 || !self.grey {
                    let channel = self.channels[c];
                    for i in 0..BLOCK {
                        let r2 = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
                        s[i] = channel.value(r2, below[i], travelled[i]);
                    }
                }
                let mut weight = block(e.weight[c], start, count, 0.0);
                for (weight, part) in weight.iter_mut().zip(&part) {
                    *weight *= part;
                }
                add(lanes, &s, &weight);
            }
            start += BLOCK;
        }
        lanes.map(|l| l.iter().sum())
    }
}

#[inline(always)]
fn block(column: &[f32], start: usize, count: usize, fill: f32) -> [f32; BLOCK] {
    let rest = &column[start..count];
    if let Some(full) = rest.first_chunk::<BLOCK>() {
        return *full;
    }
    let mut padded = [fill; BLOCK];
    padded[..rest.len()].copy_from_slice(rest);
    padded
}

impl PhotonBeamDiffusion {
    /// Σ weight_i · [`Self::eval_at_depth`]_i per channel over all sources, without the channels' weights of t, to an
    /// exit at `at`. In f32, each term within 1e-5; summed in f64 in a fixed order, so that the bits do not depend on
    /// `level`.
    pub fn gather_at(&self, level: Level, at: Vec3, sources: SourceColumns<'_>) -> [f64; 3] {
        dispatch_at(level, Sum { channels: self.source_kernels(), grey: self.is_grey(), at, sources })
    }

    /// [`Self::gather_at`] with the widest instruction set of this machine.
    pub fn gather(&self, at: Vec3, sources: SourceColumns<'_>) -> [f64; 3] {
        self.gather_at(Level::best(), at, sources)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Entry, Exit, KappaExtinction};
    use super::*;
    use crate::math::{Rgb, hash, unit_f32};
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

        fn columns(&self) -> SourceColumns<'_> {
            let [x, y, z, below, travelled] = &self.columns;
            let weight = [&*self.weight[0], &*self.weight[1], &*self.weight[2]];
            SourceColumns { x, y, z, below, travelled, weight, partition: Partition::NONE }
        }
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
                let sum = model.gather(at, cache.columns());
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
            let first = model.gather_at(Level::Baseline, at, cache.columns());
            for level in Level::available() {
                assert_eq!(model.gather_at(level, at, cache.columns()), first, "{level:?}");
            }
        }
    }

    #[test]
    fn a_source_at_the_exit_and_one_far_away_are_finite() {
        for model in models() {
            for (x, below, t) in [(0.0, 0.0, 0.0), (0.0, 1.0, 1.0), (1e20, 1.0, 1.0), (3e38, 1e30, 1e30)] {
                let one = [1.0];
                let sources = SourceColumns {
                    x: &[x],
                    y: &[0.0],
                    z: &[0.0],
                    below: &[below],
                    travelled: &[t],
                    weight: [&one; 3],
                    partition: Partition::NONE,
                };
                assert!(model.gather(Vec3::ZERO, sources).iter().all(|v| v.is_finite()), "{x} {below} {t}");
            }
        }
    }
}
