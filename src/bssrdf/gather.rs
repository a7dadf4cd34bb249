//! Cached entries in columns of numbers, and sums over them: what the vectorised sums of the models share.

use super::{Entry, Exit, Partition};
use crate::math::{Rgb, Vec3};

/// Columns of all models: x, y, z and one weight a channel.
pub const LEAST_COLUMNS: usize = 6;
/// Columns of a model at most.
pub const MOST_COLUMNS: usize = 12;

/// One cached sample: x, y, z, a weight of each channel, then what else its model needs.
pub type Row = [f32; MOST_COLUMNS];

/// What a model's columns have beside point and weights: first unit vectors of three columns each, then numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Unit vectors.
    pub vectors: usize,
    /// Other numbers.
    pub numbers: usize,
}

impl Layout {
    /// The distance alone decides: no more.
    pub const POINTS: Self = Self { vectors: 0, numbers: 0 };
    /// Normal and refracted direction of the entry.
    pub const DIRECTIONS: Self = Self { vectors: 2, numbers: 0 };

    /// Number of columns.
    pub fn columns(self) -> usize {
        LEAST_COLUMNS + 3 * self.vectors + self.numbers
    }
}

/// Entries in columns of one length.
#[derive(Clone, Copy, Debug)]
pub struct EntryColumns<'a> {
    /// x, y, z of the points \[unit\].
    pub x: [&'a [f32]; 3],
    /// Flux or any other weight, per channel.
    pub weight: [&'a [f32]; 3],
    /// What else the model's [`Layout`] has; the rest is empty.
    pub more: [&'a [f32]; MOST_COLUMNS - LEAST_COLUMNS],
    /// The part of S_d that is summed.
    pub partition: Partition,
}

impl EntryColumns<'_> {
    /// Number of entries: the length of the shortest of the columns that all models have and the first `more` of the others.
    #[inline(always)]
    pub(super) fn count(&self, more: usize) -> usize {
        let columns = self.x.iter().chain(&self.weight).chain(&self.more[..more]);
        columns.map(|c| c.len()).min().unwrap_or(0)
    }
}

/// Σ S_d weight per channel by a loop over pairs, for models without a vectorised sum; columns of [`Layout::DIRECTIONS`].
/// Values below zero count as 0; returns how many there were.
pub(super) fn one_by_one(
    s_d: impl Fn(&Entry, &Exit) -> Rgb,
    exits: &[Exit],
    entries: &EntryColumns<'_>,
    sums: &mut [[f64; 3]],
) -> u64 {
    let mut below_zero = 0;
    let vector = |c: &[&[f32]], i: usize| Vec3::new(c[0][i], c[1][i], c[2][i]);
    for (exit, sum) in exits.iter().zip(sums) {
        *sum = [0.0; 3];
        for i in 0..entries.count(6) {
            let (n, w) = (vector(&entries.more[..3], i), vector(&entries.more[3..], i));
            let entry = Entry { x: vector(&entries.x, i), n, w };
            let s = s_d(&entry, exit);
            let part = entries.partition.share(entry.x.distance_squared(exit.x));
            for (c, sum) in sum.iter_mut().enumerate() {
                let weight = entries.weight[c][i];
                below_zero += u64::from(s[c] < 0.0 && weight > 0.0);
                *sum += f64::from(s[c].max(0.0) * weight * part);
            }
        }
    }
    below_zero
}

/// Entries handled between two visits to memory; a multiple of the lanes of the sum.
pub(super) const BLOCK: usize = 64;
/// Lanes of the sum, whatever the instruction set.
pub(super) const LANES: usize = 16;

/// Numbers `start..start + N` of a column, those past `count` being `fill`.
#[inline(always)]
pub(super) fn block<const N: usize>(column: &[f32], start: usize, count: usize, fill: f32) -> [f32; N] {
    let rest = &column[start..count];
    if let Some(full) = rest.first_chunk::<N>() {
        return *full;
    }
    let mut padded = [fill; N];
    padded[..rest.len()].copy_from_slice(rest);
    padded
}

/// Adds products, rounded to f32, to the lanes of a sum.
#[inline(always)]
pub(super) fn add(lanes: &mut [f64; LANES], s: &[f32; BLOCK], weight: &[f32; BLOCK]) {
    for (s, w) in s.chunks_exact(LANES).zip(weight.chunks_exact(LANES)) {
        for ((lane, s), w) in lanes.iter_mut().zip(s).zip(w) {
            *lane += f64::from(s * w);
        }
    }
}
