//! The directional dipole as a model: its contract, and vectorised sums over many cached entries.

use super::directional::{DirectionalChannel, DirectionalDipole, DirectionalGeometry, clamped};
use super::gather::{EntryColumns, LANES, block};
use super::{Bssrdf, Claims, Entry, Exit, ModelName};
use crate::math::{DVec3, Kernel, Level, Rgb, dispatch_at};

/// Entries handled between two visits to memory.
const BLOCK: usize = LANES;

/// Σ weight_i · S_d(entry i, exit) per channel, by the code that gives [`super::Bssrdf::eval`], summed in a fixed order.
pub(super) struct Sum<'a> {
    pub channels: &'a [DirectionalChannel; 3],
    pub grey: bool,
    pub exits: &'a [Exit],
    pub entries: &'a EntryColumns<'a>,
    pub sums: &'a mut [[f64; 3]],
}

impl Kernel for Sum<'_> {
    /// How many values with a weight were below zero and taken as 0.
    type Out = u64;

    #[inline(always)]
    fn run(self) -> u64 {
        let mut below_zero = 0;
        for (exit, sum) in self.exits.iter().zip(self.sums) {
            let (at, clamped_ones) = sum_at(self.channels, self.grey, exit, self.entries);
            *sum = at;
            below_zero += clamped_ones;
        }
        below_zero
    }
}

#[inline(always)]
fn sum_at(channels: &[DirectionalChannel; 3], grey: bool, exit: &Exit, e: &EntryColumns<'_>) -> ([f64; 3], u64) {
    let (at, n_o) = (exit.x.as_dvec3(), exit.n.as_dvec3());
    let count = e.count(6);
    let mut lanes = [[0.0_f64; BLOCK]; 3];
    let mut below_zero = [0_u64; BLOCK];
    let mut start = 0;
    while start < count {
        // Past the end, entries like none: of weight 0, at a distance from the exit.
        let x: [[f32; BLOCK]; 3] = std::array::from_fn(|k| block(e.x[k], start, count, at[k] as f32 + 1.0));
        let n: [[f32; BLOCK]; 3] = std::array::from_fn(|k| block(e.more[k], start, count, 1.0));
        let w: [[f32; BLOCK]; 3] = std::array::from_fn(|k| block(e.more[3 + k], start, count, -1.0));
        let mut weight: [[f32; BLOCK]; 3] = e.weight.map(|column| block(column, start, count, 0.0));
        let mut pairs = [[0.0_f64; BLOCK]; 7];
        for i in 0..BLOCK {
            let vector = |v: &[[f32; BLOCK]; 3]| DVec3::new(v[0][i].into(), v[1][i].into(), v[2][i].into());
            let apart = at - vector(&x);
            let part = e.partition.share(apart.length_squared() as f32);
            weight.iter_mut().for_each(|w| w[i] *= part);
            let pair = DirectionalGeometry::new(apart, vector(&n), vector(&w), n_o).columns();
            for (column, value) in pairs.iter_mut().zip(pair) {
                column[i] = value;
            }
        }
        let mut s = [0.0_f64; BLOCK];
        let mut negative = [0_u64; BLOCK];
        for c in 0..3 {
            if c == 0 || !grey {
                let channel = channels[c];
                for (i, (s, negative)) in s.iter_mut().zip(&mut negative).enumerate() {
                    let value =
                        channel.kernel(&DirectionalGeometry::from_columns(std::array::from_fn(|k| pairs[k][i])), 0.0);
                    *s = clamped(value).min(f64::from(f32::MAX));
                    *negative = u64::from(value < 0.0);
                }
            }
            for ((lane, s), &weight) in lanes[c].iter_mut().zip(&s).zip(&weight[c]) {
                *lane += s * f64::from(weight);
            }
            for ((sum, negative), &weight) in below_zero.iter_mut().zip(&negative).zip(&weight[c]) {
                *sum += if weight > 0.0 { *negative } else { 0 };
            }
        }
        start += BLOCK;
    }
    (lanes.map(|l| l.iter().sum()), below_zero.iter().sum())
}

impl Bssrdf for DirectionalDipole {
    fn eval_compensated(&self, entry: &Entry, exit: &Exit, rate: f32) -> Rgb {
        self.each_channel(entry, exit, rate, clamped)
    }

    fn decay(&self) -> f32 {
        self.decay
    }

    fn clamps(&self) -> bool {
        true
    }

    fn eval_signed(&self, entry: &Entry, exit: &Exit) -> Rgb {
        self.each_channel(entry, exit, 0.0, |value| value)
    }

    fn name(&self) -> ModelName {
        ModelName::DIRECTIONAL
    }

    /// Of S_d by directions, about.
    fn variation(&self) -> f32 {
        0.3
    }

    fn gather_at(&self, level: Level, exits: &[Exit], entries: &EntryColumns<'_>, sums: &mut [[f64; 3]]) -> u64 {
        dispatch_at(level, Sum { channels: &self.channels, grey: self.grey, exits, entries, sums })
    }

    fn claims(&self) -> Claims {
        Claims { unscattered: true, first_order: true, reciprocal: false, bounded_energy: false }
    }

    /// Total over a plane at normal incidence; above 1 for weak absorption unless calibrated.
    fn total(&self) -> Rgb {
        Rgb::from_fn(|c| self.totals[c] as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Partition;
    use super::*;
    use crate::math::{Vec3, hash, unit_f32};
    use crate::optics::Medium;

    #[test]
    fn the_sum_is_the_sum_of_single_evaluations_to_the_bits_of_every_instruction_set() {
        let (s, a) = ([0.74, 0.88, 1.01], [0.032, 0.17, 0.48]);
        for (s, a) in [(s, a), ([1.0; 3], [0.0; 3]), ([0.9, 0.0, 30.0], [0.1, 1.0, 0.0])] {
            let model = DirectionalDipole::new(&Medium { sigma_s: Rgb(s), sigma_a: Rgb(a), g: 0.0, eta: 1.3 }, false);
            for count in [1_u64, 15, 16, 1000] {
                let mut columns: [Vec<f32>; 12] = Default::default();
                let (at, n_o) = (Vec3::new(0.3, -0.2, 1.0), Vec3::new(0.6, 0.0, 0.8));
                let (mut expected, mut clamped_ones) = ([0.0; 3], 0);
                for i in 0..count {
                    let u = |k: u64| unit_f32((hash(16 * i + k) >> 32) as u32) - 0.5;
                    let entry = Entry {
                        x: if i % 50 == 7 { at } else { Vec3::new(9.0 * u(0), 9.0 * u(1), 3.0 * u(2)) },
                        n: Vec3::new(u(3), u(4), 1.0).normalize(),
                        w: Vec3::new(u(5), u(6), -1.0).normalize(),
                    };
                    let exit = Exit { x: at, n: n_o, w: n_o };
                    let value = model.eval(&entry, &exit);
                    let weight = [1.0, u(7) + 0.5, 2.0];
                    clamped_ones += model.eval_signed(&entry, &exit).0.iter().filter(|&&v| v < 0.0).count() as u64;
                    let row = [entry.x, entry.n, entry.w].map(|v| v.to_array()).concat();
                    for (column, value) in columns.iter_mut().zip(row.into_iter().chain(weight)) {
                        column.push(value);
                    }
                    for c in 0..3 {
                        expected[c] += f64::from(value[c]) * f64::from(weight[c]);
                    }
                }
                let [x, y, z, n0, n1, n2, w0, w1, w2, r, g, b] = columns.each_ref().map(Vec::as_slice);
                let more = [n0, n1, n2, w0, w1, w2];
                let entries = EntryColumns { x: [x, y, z], weight: [r, g, b], more, partition: Partition::NONE };
                let of = |level| {
                    let mut sums = [[0.0; 3]];
                    let clamps = model.gather_at(level, &[Exit { x: at, n: n_o, w: n_o }], &entries, &mut sums);
                    (sums[0], clamps)
                };
                let (sum, clamps) = of(Level::Baseline);
                assert_eq!(clamps, clamped_ones);
                for c in 0..3 {
                    assert!((sum[c] - expected[c]).abs() <= 1e-6 * expected[c], "{count}: {sum:?} {expected:?}");
                }
                for level in Level::available() {
                    assert_eq!(of(level), (sum, clamps), "{level:?}");
                }
            }
        }
    }
}
