//! Cached samples in columns, as the vectorised sums of the models want them.

use super::CachedSample;
use crate::bssrdf::{Bssrdf, EntryColumns, Exit, LEAST_COLUMNS, Layout, MOST_COLUMNS, Partition, Row};
use crate::math::Vec3;

/// Where the weights stand.
const WEIGHTS: std::ops::Range<usize> = 3..LEAST_COLUMNS;

/// Samples of one model, column by column: point [unit], weight of each channel, then what else decides S_d; see
/// [`Bssrdf::row`].
pub struct Columns {
    columns: [Vec<f32>; MOST_COLUMNS],
    layout: Layout,
}

impl Columns {
    /// Empty columns.
    pub fn new(layout: Layout) -> Self {
        Self { columns: std::array::from_fn(|_| Vec::new()), layout }
    }

    /// `samples` for `model`, in their order.
    pub fn of(model: &dyn Bssrdf, samples: &[CachedSample]) -> Self {
        let mut all = Self::new(model.layout());
        all.refill(model, samples.iter());
        all
    }

    /// Becomes `samples`, in their order; `model` is that of the columns.
    pub fn refill<'a>(&mut self, model: &dyn Bssrdf, samples: impl ExactSizeIterator<Item = &'a CachedSample>) {
        let used = self.layout.columns();
        for column in &mut self.columns[..used] {
            column.clear();
            column.reserve_exact(samples.len());
        }
        for sample in samples {
            self.push(model.row(&sample.entry, sample.depth, sample.flux));
        }
    }

    /// Entry points and weights alone.
    pub fn points(samples: &[CachedSample]) -> Self {
        let mut all = Self::new(Layout::POINTS);
        for CachedSample { entry, flux, .. } in samples {
            let mut row = Row::default();
            row[..3].copy_from_slice(&entry.x.to_array());
            row[WEIGHTS].copy_from_slice(&flux.0);
            all.push(row);
        }
        all
    }

    fn push(&mut self, row: Row) {
        for (column, value) in self.columns[..self.layout.columns()].iter_mut().zip(row) {
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
        self.layout.columns() * self.len() * size_of::<f32>()
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
        let mut all = Self::new(self.layout);
        for (new, old) in all.columns.iter_mut().zip(&self.columns[..self.layout.columns()]) {
            *new = order.iter().map(|&i| old[i as usize]).collect();
        }
        all
    }

    /// Becomes the samples `picked` of `other`, each with a factor on its weight.
    pub fn pick(&mut self, other: &Self, picked: &[(u32, f32)]) {
        self.layout = other.layout;
        for (k, (column, from)) in self.columns[..other.layout.columns()].iter_mut().zip(&other.columns).enumerate() {
            column.clear();
            if WEIGHTS.contains(&k) {
                column.extend(picked.iter().map(|&(i, factor)| from[i as usize] * factor));
            } else {
                column.extend(picked.iter().map(|&(i, _)| from[i as usize]));
            }
        }
    }

    /// Becomes the samples `picked` of `other`, each moved by a vector [unit].
    pub fn pick_moved(&mut self, other: &Self, picked: &[(u32, Vec3)]) {
        self.layout = other.layout;
        for (k, (column, from)) in self.columns[..other.layout.columns()].iter_mut().zip(&other.columns).enumerate() {
            column.clear();
            if k < 3 {
                column.extend(picked.iter().map(|&(i, by)| from[i as usize] + by[k]));
            } else {
                column.extend(picked.iter().map(|&(i, _)| from[i as usize]));
            }
        }
    }

    /// For each range of samples their mean, weighted by `mass`, with the sum of their weights; directions of unit length.
    pub fn means(&self, ranges: impl Iterator<Item = std::ops::Range<usize>>, mass: impl Fn(usize) -> f64) -> Self {
        let (mut all, used) = (Self::new(self.layout), self.layout.columns());
        for range in ranges {
            let (mut row, mut total) = ([0.0_f64; MOST_COLUMNS], 0.0);
            for i in range {
                let own = mass(i);
                total += own;
                for (k, (mean, column)) in row.iter_mut().zip(&self.columns[..used]).enumerate() {
                    *mean += f64::from(column[i]) * if WEIGHTS.contains(&k) { 1.0 } else { own };
                }
            }
            let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
            for k in (0..used).filter(|k| !WEIGHTS.contains(k)) {
                row[k] *= scale;
            }
            for vector in row[LEAST_COLUMNS..].chunks_exact_mut(3).take(self.layout.vectors) {
                let length = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
                vector.iter_mut().for_each(|v| *v /= if length > 0.0 { length } else { 1.0 });
            }
            all.push(row.map(|value| value as f32));
        }
        all
    }

    /// Σ S_d · weight per channel over all samples to each of `exits`, into `sums`; of S_d the part `partition`. Values of S_d
    /// below zero count as 0; returns how many there were.
    pub fn sum(&self, model: &dyn Bssrdf, exits: &[Exit], partition: Partition, sums: &mut [[f64; 3]]) -> u64 {
        let column = |k: usize| -> &[f32] { &self.columns[k] };
        let entries = EntryColumns {
            x: std::array::from_fn(column),
            weight: std::array::from_fn(|k| column(WEIGHTS.start + k)),
            more: std::array::from_fn(|k| column(LEAST_COLUMNS + k)),
            partition,
        };
        model.gather(exits, &entries, sums)
    }
}
