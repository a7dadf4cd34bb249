//! Cached samples in columns, as the vectorised sums of the models want them.

use super::CachedSample;
use crate::bssrdf::{DirectionColumns, Entry, EntryColumns, Exit, Model, Partition, Slab, SourceColumns};
use crate::math::Vec3;

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
            Model::Standard(_) | Model::Better(_) | Model::Normalised(_) => LEAST,
            Model::Beam(_) => LEAST + 2,
            Model::Directional(_) | Model::Slab(_) => LEAST + 6,
        };
        Self { columns: std::array::from_fn(|_| Vec::new()), used }
    }

    /// `samples` for `model`, in their order.
    pub fn of(model: &Model, samples: &[CachedSample]) -> Self {
        let mut all = Self::new(model);
        all.refill(model, samples.iter());
        all
    }

    /// Becomes `samples`, in their order; `model` is that of the columns.
    pub fn refill<'a>(&mut self, model: &Model, samples: impl ExactSizeIterator<Item = &'a CachedSample>) {
        for column in &mut self.columns[..self.used] {
            column.clear();
            column.reserve_exact(samples.len());
        }
        for sample in samples {
            self.push_sample(model, sample);
        }
    }

    /// Entry points and weights alone.
    pub fn points(model: &Model, samples: &[CachedSample]) -> Self {
        let mut all = Self { used: LEAST, ..Self::new(model) };
        for sample in samples {
            let (x, flux) = (sample.entry.x, sample.flux.0);
            for (column, value) in all.columns.iter_mut().zip([x.x, x.y, x.z, flux[0], flux[1], flux[2]]) {
                column.push(value);
            }
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
            Model::Directional(_) | Model::Slab(_) => row[LEAST..].copy_from_slice(&[n.x, n.y, n.z, w.x, w.y, w.z]),
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

    /// Becomes the samples `picked` of `other`, columns of the same model, each with a factor on its weight.
    pub fn pick(&mut self, other: &Self, picked: &[(u32, f32)]) {
        for (k, (column, from)) in self.columns[..self.used].iter_mut().zip(&other.columns).enumerate() {
            column.clear();
            if (3..LEAST).contains(&k) {
                column.extend(picked.iter().map(|&(i, factor)| from[i as usize] * factor));
            } else {
                column.extend(picked.iter().map(|&(i, _)| from[i as usize]));
            }
        }
    }

    /// Becomes the samples `picked` of `other`, columns of the same model, each moved by a vector [unit].
    pub fn pick_moved(&mut self, other: &Self, picked: &[(u32, Vec3)]) {
        for (k, (column, from)) in self.columns[..self.used].iter_mut().zip(&other.columns).enumerate() {
            column.clear();
            if k < 3 {
                column.extend(picked.iter().map(|&(i, by)| from[i as usize] + by[k]));
            } else {
                column.extend(picked.iter().map(|&(i, _)| from[i as usize]));
            }
        }
    }

    /// For each range of samples their mean, weighted by `mass`, with the sum of their weights; directions of unit length.
    pub fn means(
        &self,
        model: &Model,
        ranges: impl Iterator<Item = std::ops::Range<usize>>,
        mass: impl Fn(usize) -> f64,
    ) -> Self {
        let mut all = Self::new(model);
        for range in ranges {
            let (mut row, mut total) = ([0.0_f64; MOST], 0.0);
            for i in range {
                let own = mass(i);
                total += own;
                for (k, (mean, column)) in row.iter_mut().zip(&self.columns[..self.used]).enumerate() {
                    *mean += f64::from(column[i]) * if (3..LEAST).contains(&k) { 1.0 } else { own };
                }
            }
            let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
            for k in (0..self.used).filter(|k| !(3..LEAST).contains(k)) {
                row[k] *= scale;
            }
            if self.used == MOST {
                for k in [LEAST, LEAST + 3] {
                    let length = row[k..k + 3].iter().map(|v| v * v).sum::<f64>().sqrt();
                    row[k..k + 3].iter_mut().for_each(|v| *v /= if length > 0.0 { length } else { 1.0 });
                }
            }
            for (column, value) in all.columns[..all.used].iter_mut().zip(row) {
                column.push(value as f32);
            }
        }
        all
    }

    /// Σ S_d · weight per channel over all samples, by the vectorised code of `model` where it has one; of S_d the part
    /// `partition`, by the points of the columns. Values of S_d below zero, which count as 0, add to
    /// `clamped`.
    pub fn sum(&self, model: &Model, exit: &Exit, partition: Partition, clamped: &mut u64) -> [f64; 3] {
        let c = &self.columns;
        let entries = EntryColumns { x: &c[0], y: &c[1], z: &c[2], weight: [&c[3], &c[4], &c[5]], partition };
        if let Some(model) = model.gather() {
            return model.gather(exit.x, entries);
        }
        match model {
            Model::Beam(beam) => {
                let EntryColumns { x, y, z, weight, partition } = entries;
                beam.gather(exit.x, SourceColumns { x, y, z, below: &c[6], travelled: &c[7], weight, partition })
            }
            Model::Directional(dipole) => {
                let directions = DirectionColumns { n: [&c[6], &c[7], &c[8]], w: [&c[9], &c[10], &c[11]] };
                let (sum, below_zero) = dipole.gather(exit.x, exit.n, entries, directions);
                *clamped += below_zero;
                sum
            }
            Model::Slab(slab) => self.plain(slab, exit, partition, clamped),
            // Those that know the distance alone have been summed above.
            Model::Standard(_) | Model::Better(_) | Model::Normalised(_) => [0.0; 3],
        }
    }

    /// A loop over pairs: a slab has columns of normals and directions and no vectorised sum.
    fn plain(&self, slab: &Slab, exit: &Exit, partition: Partition, clamped: &mut u64) -> [f64; 3] {
        let (mut sum, c) = ([0.0; 3], &self.columns);
        let vector = |k: usize, i: usize| Vec3::new(c[k][i], c[k + 1][i], c[k + 2][i]);
        for i in 0..self.len() {
            let entry = Entry { x: self.point(i), n: vector(LEAST, i), w: vector(LEAST + 3, i) };
            let s = slab.eval_signed(&entry, exit);
            let part = partition.share(entry.x.distance_squared(exit.x));
            let weight = self.weight(i);
            for c in 0..3 {
                *clamped += u64::from(s[c] < 0.0 && weight[c] > 0.0);
                sum[c] += f64::from(s[c].max(0.0) * weight[c] * part);
            }
        }
        sum
    }
}
