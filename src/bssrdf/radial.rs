//! What models share that know the distance between entry and exit alone: one formula per channel, from which come
//! the value for a pair of points, vectorised batches, and sums over a cache of entry points.

use super::gather::{BLOCK, EntryColumns, LANES, Layout, add, block};
use super::{Bssrdf, Claims, Entry, Exit, ModelName};
use crate::math::{Kernel, Level, Rgb, Vec3, dispatch_at};

/// A model that can say M(r): exitance at distance r per flux that entered.
pub trait Radial: Bssrdf {
    /// M(r) [1/unit²] at distance `r` ≥ 0 \[unit\] on a plane, by the code that renders: S_d times π, and times
    /// 4 C_phi(1/eta) where S_d was divided by it.
    fn exitance(&self, r: f32) -> Rgb;

    /// [`Self::exitance`] of one `channel`.
    fn exitance_one(&self, channel: usize, r: f32) -> f32;

    /// M(r) of one `channel` for each `r` \[unit\], vectorised with `level` or the widest instruction set below it; the
    /// bits do not depend on it, and are those of [`Self::exitance`]. Extra items of the longer slice are left alone.
    fn exitance_batch_at(&self, level: Level, channel: usize, r: &[f32], out: &mut [f32]);

    /// [`Self::exitance_batch_at`] with the widest instruction set of this machine.
    fn exitance_batch(&self, channel: usize, r: &[f32], out: &mut [f32]) {
        self.exitance_batch_at(Level::best(), channel, r, out);
    }
}

/// One channel of a distance-only model.
///
/// Implementations are straight-line f32 code, `#[inline(always)]`, with choices by value and no calls that do not
/// inline: the loops over them are what vectorises.
pub trait Formula: Copy + Send + Sync {
    /// S_d [1/(unit² sr)] from r² ≥ 0 [unit²], which may be infinite; if `COMPENSATED`, S_d exp(rate r), formed in the exponent:
    /// `rate` [1/unit] is at most the channel's decay.
    fn eval<const COMPENSATED: bool>(self, r2: f32, rate: f32) -> f32;

    /// S_d alone.
    #[inline(always)]
    fn value(self, r2: f32) -> f32 {
        self.eval::<false>(r2, 0.0)
    }

    /// [`Self::value`] of a block; the same bits. For formulas that vectorise in parts only.
    #[inline(always)]
    fn values(self, r2: &[f32; BLOCK]) -> [f32; BLOCK] {
        let mut out = [0.0; BLOCK];
        for (out, &r2) in out.iter_mut().zip(r2) {
            *out = self.value(r2);
        }
        out
    }
}

/// A formula whose constants are numbers.
pub trait Channel: Formula {
    /// The constants of three channels side by side.
    type Columns: Columns<Row = Self>;
}

/// The constants of three channels as columns of four, the last one repeated: a loop over the channels of one pair of
/// points then fills a vector, which is twice as fast as one channel after the other. See [`columns!`].
pub trait Columns: Copy + Send + Sync {
    /// One channel.
    type Row;
    /// Side by side.
    fn of(rows: [Self::Row; 3]) -> Self;
    /// Channel `i` of 0..4.
    fn row(&self, i: usize) -> Self::Row;
}

/// Defines the [`Columns`] of a struct of `f32` fields.
macro_rules! columns {
    ($row:ident, $columns:ident { $($field:ident),+ $(,)? }) => {
        #[doc = concat!("Columns of [`", stringify!($row), "`].")]
        #[derive(Clone, Copy, Debug)]
        pub struct $columns {
            $($field: [f32; 4],)+
        }

        impl $crate::bssrdf::radial::Columns for $columns {
            type Row = $row;

            fn of([r, g, b]: [$row; 3]) -> Self {
                Self { $($field: [r.$field, g.$field, b.$field, b.$field],)+ }
            }

            #[inline(always)]
            fn row(&self, i: usize) -> $row {
                $row { $($field: self.$field[i],)+ }
            }
        }
    };
}
pub(super) use columns;

/// The constants of a distance-only model.
#[derive(Clone, Copy, Debug)]
pub struct Channels<C: Channel> {
    /// Red, green, blue.
    pub each: [C; 3],
    /// The same side by side.
    pub columns: C::Columns,
    /// The three do not differ.
    pub grey: bool,
    /// Slowest decay [1/unit].
    pub decay: f32,
    /// Closed-form total.
    pub total: Rgb,
    /// M over S_d [sr].
    pub exitance: f32,
}

/// A model that is its channels; all the rest follows.
pub trait DistanceOnly: Send + Sync {
    /// Its formula.
    type Channel: Channel;
    /// What it is called.
    const NAME: ModelName;
    /// What it promises.
    const CLAIMS: Claims;
    /// Its constants.
    fn channels(&self) -> &Channels<Self::Channel>;
}

impl<M: DistanceOnly> Bssrdf for M {
    #[inline]
    fn eval_compensated(&self, entry: &Entry, exit: &Exit, rate: f32) -> Rgb {
        let k = self.channels();
        let r2 = entry.x.distance_squared(exit.x);
        if k.grey {
            return Rgb::splat(k.each[0].eval::<true>(r2, rate));
        }
        k.side_by_side(|c| c.eval::<true>(r2, rate))
    }

    #[inline]
    fn eval(&self, entry: &Entry, exit: &Exit) -> Rgb {
        let k = self.channels();
        let r2 = entry.x.distance_squared(exit.x);
        if k.grey {
            return Rgb::splat(k.each[0].value(r2));
        }
        k.side_by_side(|c| c.value(r2))
    }

    fn decay(&self) -> f32 {
        self.channels().decay
    }

    fn total(&self) -> Rgb {
        self.channels().total
    }

    fn claims(&self) -> Claims {
        M::CLAIMS
    }

    fn name(&self) -> ModelName {
        M::NAME
    }

    fn radial(&self) -> Option<&dyn Radial> {
        Some(self)
    }

    fn layout(&self) -> Layout {
        Layout::POINTS
    }

    fn gather_at(&self, level: Level, exits: &[Exit], entries: &EntryColumns<'_>, sums: &mut [[f64; 3]]) -> u64 {
        let k = self.channels();
        dispatch_at(level, Sum { channels: &k.each, grey: k.grey, exits, entries, sums });
        0
    }
}

impl<C: Channel> Channels<C> {
    #[inline(always)]
    fn side_by_side(&self, f: impl Fn(C) -> f32) -> Rgb {
        let mut out = [0.0; 4];
        for (i, out) in out.iter_mut().enumerate() {
            *out = f(self.columns.row(i));
        }
        let [r, g, b, _] = out;
        Rgb([r, g, b])
    }
}

impl<M: DistanceOnly> Radial for M {
    fn exitance(&self, r: f32) -> Rgb {
        let k = self.channels();
        k.side_by_side(|c| c.value(r * r) * k.exitance)
    }

    fn exitance_one(&self, channel: usize, r: f32) -> f32 {
        let k = self.channels();
        k.each[channel].value(r * r) * k.exitance
    }

    fn exitance_batch_at(&self, level: Level, channel: usize, r: &[f32], out: &mut [f32]) {
        let k = self.channels();
        dispatch_at(level, Batch { channel: k.each[channel], exitance: k.exitance, r, out });
    }
}

/// M(r) of one channel over a slice.
pub(super) struct Batch<'a, C> {
    pub channel: C,
    pub exitance: f32,
    pub r: &'a [f32],
    pub out: &'a mut [f32],
}

impl<C: Formula> Kernel for Batch<'_, C> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let count = self.r.len().min(self.out.len());
        let (r, out) = (&self.r[..count], &mut self.out[..count]);
        for (r, out) in r.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            let mut r2 = [1.0; BLOCK];
            for (r2, r) in r2.iter_mut().zip(r) {
                *r2 = r * r;
            }
            let values = self.channel.values(&r2);
            for (out, value) in out.iter_mut().zip(&values) {
                *out = value * self.exitance;
            }
        }
    }
}

struct Sum<'a, C> {
    channels: &'a [C; 3],
    grey: bool,
    exits: &'a [Exit],
    entries: &'a EntryColumns<'a>,
    sums: &'a mut [[f64; 3]],
}

impl<C: Formula> Kernel for Sum<'_, C> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        for (exit, sum) in self.exits.iter().zip(self.sums) {
            *sum = sum_at(self.channels, self.grey, exit.x, self.entries);
        }
    }
}

#[inline(always)]
fn sum_at<C: Formula>(channels: &[C; 3], grey: bool, at: Vec3, e: &EntryColumns<'_>) -> [f64; 3] {
    let count = e.count(0);
    let mut lanes = [[0.0_f64; LANES]; 3];
    let mut start = 0;
    while start < count {
        // Past the end, points at the exit that weigh nothing.
        let x: [[f32; BLOCK]; 3] = std::array::from_fn(|k| block(e.x[k], start, count, at[k]));
        let mut r2 = [0.0; BLOCK];
        for (i, r2) in r2.iter_mut().enumerate() {
            let (x, y, z) = (x[0][i] - at.x, x[1][i] - at.y, x[2][i] - at.z);
            *r2 = x * x + y * y + z * z;
        }
        let mut share = [0.0; BLOCK];
        for (share, &r2) in share.iter_mut().zip(&r2) {
            *share = e.partition.share(r2);
        }
        let mut s = [0.0_f32; BLOCK];
        for (c, lanes) in lanes.iter_mut().enumerate() {
            if c == 0 || !grey {
                s = channels[c].values(&r2);
            }
            let mut weight: [f32; BLOCK] = block(e.weight[c], start, count, 0.0);
            for (weight, share) in weight.iter_mut().zip(&share) {
                *weight *= share;
            }
            add(lanes, &s, &weight);
        }
        start += BLOCK;
    }
    lanes.map(|l| l.iter().sum())
}

/// The largest squared distance in transport mean free paths that is told from infinity.
pub(super) const FARTHEST_SQUARED: f32 = 1e24;

/// r² σ², in transport mean free paths, with r² or the product overflowing taken as [`FARTHEST_SQUARED`].
#[inline(always)]
pub(super) fn in_mean_free_paths(r2: f32, sigma_squared: f32) -> f32 {
    let x2 = r2 * sigma_squared;
    // Also where 0 · ∞ is not a number.
    if x2 < FARTHEST_SQUARED { x2 } else { FARTHEST_SQUARED }
}

/// What is left of a `decay` after a `rate` that is at most as large, but for rounding.
#[inline(always)]
pub(super) fn left(decay: f32, rate: f32) -> f32 {
    if decay > rate { decay - rate } else { 0.0 }
}

/// `value` in f32, finite.
pub(super) fn finite(value: f64) -> f32 {
    value.min(1e37) as f32
}
