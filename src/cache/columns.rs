//! Cached samples in columns, as the vectorised sums of the models want them.

use super::CachedSample;
use crate::bssrdf::{Bssrdf, DirectionColumns, Entry, EntryColumns, Exit, Model, SourceColumns};
use crate::math::Vec3;
use std::ops::Range;

/// Columns a model may need: point, weight, and two of a source or six of directions.
const MOST: usize = 12;
/// Columns of all models: x, y, z and one weight a channel.
const LEAST: usize = 6;

/// Samples of one model, column by column: point [unit], weight of each channel, then what else decides S_d. For `beam`
/// the point is the source on the refracted ray at the sample's own depth, and the weight has the channels' share of
/// that depth.
pub struct Columns {
    columns: [Vec<f32>; MOST],
    used: usize,
}

impl Columns {
    /// Empty columns for `model`.
    pub fn new(model: &Model) -> Self {
        let used = match model {
            Model::Standard(_) | Model::Better(_) | Model::Normalised(_) | Model::Slab(_) => LEAST,
            Model::Beam(_) => LEAST + 2,
            Model::Directional(_) => LEAST + 6,
        };
        Self { columns: std::array::from_fn(|_| Vec::new()), used }
    }

    /// `samples` for `model`, in their order.
    pub fn of(model: &Model, samples: &[CachedSample]) -> Self {
        let mut all = Self::new(model);
        for column in &mut all.columns[..all.used] {
            column.reserve_exact(samples.len());
        }
        for sample in samples {
            all.push_sample(model, sample);
        }
        all
    }

    fn push_sample(&mut self, model: &Model, sample: &CachedSample) {
        let Entry { x, n, w } = sample.entry;
        let (mut row, flux) = ([0.0; MOST], sample.flux.0);
        row[..LEAST].copy_from_slice(&[x.x, x.y, x.z, flux[0], flux[1], flux[2]]);
        match model {
            Model::Beam(beam) => {
                let t = sample.depth;
                let source = x + w * t;
                let own = beam.depths().weights(f64::from(t));
                row[..3].copy_from_slice(&source.to_array());
                for c in 0..3 {
                    row[3 + c] = (own[c] * f64::from(flux[c])) as f32;
                }
                row[LEAST..LEAST + 2].copy_from_slice(&[(-w.dot(n) * t).max(0.0), t]);
            }
            Model::Directional(_) => row[LEAST..].copy_from_slice(&[n.x, n.y, n.z, w.x, w.y, w.z]),
            _ => {}
        }
        for (column, value) in self.columns[..self.used].iter_mut().zip(row) {
            column.push(value);
        }
    }

    /// Number of samples.
    #[inline]
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    /// True without samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of the columns.
    pub fn bytes(&self) -> usize {
        self.used * self.len() * size_of::<f32>()
    }

    /// Where sample `i` is [unit].
    #[inline]
    pub fn point(&self, i: usize) -> Vec3 {
        Vec3::new(self.columns[0][i], self.columns[1][i], self.columns[2][i])
    }

    /// Weights of sample `i`, all at least 0.
    #[inline]
    pub fn weight(&self, i: usize) -> [f32; 3] {
        [self.columns[3][i], self.columns[4][i], self.columns[5][i]]
    }

    /// The same samples in another order.
    pub fn permuted(&self, order: &[u32]) -> Self {
        let mut columns: [Vec<f32>; MOST] = std::array::from_fn(|_| Vec::new());
        for (new, old) in columns.iter_mut().zip(&self.columns[..self.used]) {
            *new = order.iter().map(|&i| old[i as usize]).collect();
        }
        Self { columns, used: self.used }
    }

    /// Forgets all samples and keeps the memory.
    pub fn clear(&mut self) {
        for column in &mut self.columns[..self.used] {
            column.clear();
        }
    }

    /// Takes the samples `range` of `other`, columns of the same model.
    #[inline]
    pub fn extend(&mut self, other: &Self, range: Range<usize>) {
        for (column, from) in self.columns[..self.used].iter_mut().zip(&other.columns) {
            column.extend_from_slice(&from[range.clone()]);
        }
    }

    /// Takes sample `i` of `other`, columns of the same model, with `factor` times its weight.
    #[inline]
    pub fn push(&mut self, other: &Self, i: usize, factor: f32) {
        for (k, (column, from)) in self.columns[..self.used].iter_mut().zip(&other.columns).enumerate() {
            column.push(if (3..6).contains(&k) { from[i] * factor } else { from[i] });
        }
    }

    /// Σ S_d · weight per channel over all samples, by the vectorised code of `model` where it has one.
    pub fn sum(&self, model: &Model, exit: &Exit) -> [f64; 3] {
        let c = &self.columns;
        let entries = EntryColumns { x: &c[0], y: &c[1], z: &c[2], weight: [&c[3], &c[4], &c[5]] };
        if let Some(model) = model.gather() {
            return model.gather(exit.x, entries);
        }
        match model {
            Model::Beam(beam) => {
                let EntryColumns { x, y, z, weight } = entries;
                beam.gather(exit.x, SourceColumns { x, y, z, below: &c[6], travelled: &c[7], weight })
            }
            Model::Directional(dipole) => {
                let directions = DirectionColumns { n: [&c[6], &c[7], &c[8]], w: [&c[9], &c[10], &c[11]] };
                dipole.gather(exit.x, exit.n, entries, directions)
            }
            Model::Slab(slab) => self.plain(&**slab, exit),
            // The others have vectorised sums.
            Model::Standard(model) => self.plain(model, exit),
            Model::Better(model) => self.plain(model, exit),
            Model::Normalised(model) => self.plain(model, exit),
        }
    }

    /// A loop over pairs, for models of the distance alone.
    fn plain<B: Bssrdf>(&self, model: &B, exit: &Exit) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for i in 0..self.len() {
            let s = model.eval(&Entry { x: self.point(i), n: exit.n, w: -exit.n }, exit);
            let weight = self.weight(i);
            for c in 0..3 {
                sum[c] += f64::from(s[c] * weight[c]);
            }
        }
        sum
    }
}
