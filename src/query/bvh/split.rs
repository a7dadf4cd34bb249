//! Where a range of triangles is cut in two: the surface area heuristic over bins along each axis [Wald 2007].

use glam::Vec4;
use rayon::prelude::*;

use super::triangle::LANES;
use crate::math::Vec3;

/// A triangle's box in the unit cube. The last components are the lower and the upper half of its number, as numbers: its
/// bits would be one near zero, on which arithmetic takes a hundred times as long.
#[derive(Clone, Copy, Debug)]
pub struct Ref {
    lower: Vec4,
    upper: Vec4,
}

impl Ref {
    pub fn new(lower: Vec3, upper: Vec3, item: u32) -> Self {
        Self { lower: lower.extend((item & 0xffff) as f32), upper: upper.extend((item >> 16) as f32) }
    }

    /// The triangle's number.
    pub fn item(&self) -> u32 {
        (self.upper.w as u32) << 16 | self.lower.w as u32
    }

    /// Twice the middle of the box.
    #[inline]
    fn middle(&self) -> Vec4 {
        (self.lower + self.upper).with_w(0.0)
    }
}

/// A box; the last component means nothing.
#[derive(Clone, Copy, Debug)]
struct Extent {
    lower: Vec4,
    upper: Vec4,
}

impl Extent {
    const EMPTY: Self = Self { lower: Vec4::INFINITY, upper: Vec4::NEG_INFINITY };

    #[inline]
    fn add(&mut self, lower: Vec4, upper: Vec4) {
        self.lower = self.lower.min(lower);
        self.upper = self.upper.max(upper);
    }

    #[inline]
    fn union(mut self, other: Self) -> Self {
        self.add(other.lower, other.upper);
        self
    }

    fn half_area(&self) -> f32 {
        let d = self.upper - self.lower;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// Triangles and the box of them all.
pub struct Range<'r> {
    pub refs: &'r mut [Ref],
    bounds: Extent,
    /// Box of [`Ref::middle`].
    middles: Extent,
}

/// Ranges of more triangles than this are looked through by several threads.
const PARALLEL: usize = 1 << 16;
const CHUNK: usize = 1 << 13;

/// Bins along each axis for ranges of many and of few triangles.
const BINS: usize = 32;
const FEW_BINS: usize = 8;
/// Ranges of no more triangles than this are few.
const FEW: usize = 32;

impl<'r> Range<'r> {
    pub fn new(refs: &'r mut [Ref]) -> Self {
        let of = |refs: &[Ref]| {
            let (mut bounds, mut middles) = (Extent::EMPTY, Extent::EMPTY);
            for r in refs {
                bounds.add(r.lower, r.upper);
                middles.add(r.middle(), r.middle());
            }
            (bounds, middles)
        };
        let (bounds, middles) = if refs.len() > PARALLEL {
            // Smallest and largest do not depend on the order.
            let empty = || (Extent::EMPTY, Extent::EMPTY);
            refs.par_chunks(CHUNK).map(of).reduce(empty, |a, b| (a.0.union(b.0), a.1.union(b.1)))
        } else {
            of(refs)
        };
        Self { refs, bounds, middles }
    }

    pub fn len(&self) -> usize {
        self.refs.len()
    }

    pub fn half_area(&self) -> f32 {
        self.bounds.half_area()
    }
}

#[derive(Clone, Copy)]
struct Bin {
    extent: Extent,
    count: u32,
}

/// Bins along each axis.
struct Bins<const N: usize> {
    bins: [[Bin; N]; 3],
}

/// From the middle of a box to the number of its bin, by axis.
#[derive(Clone, Copy)]
struct Binning {
    start: Vec4,
    per_unit: Vec4,
    last: Vec4,
}

impl Binning {
    fn new(middles: &Extent, count: usize) -> Self {
        let size = middles.upper - middles.lower;
        // Boxes in one plane are all in the first bin.
        let per_unit = Vec4::select(size.cmpgt(Vec4::splat(1e-30)), Vec4::splat(count as f32) / size, Vec4::ZERO);
        Self { start: middles.lower, per_unit, last: Vec4::splat(count as f32 - 1.0) }
    }

    #[inline]
    fn of(&self, r: &Ref) -> [usize; 3] {
        let at = ((r.middle() - self.start) * self.per_unit).min(self.last);
        [at.x as usize, at.y as usize, at.z as usize]
    }
}

impl<const N: usize> Bins<N> {
    fn fill(refs: &[Ref], binning: Binning) -> Self {
        let mut bins = [[Bin { extent: Extent::EMPTY, count: 0 }; N]; 3];
        for r in refs {
            for (bins, bin) in bins.iter_mut().zip(binning.of(r)) {
                let bin = &mut bins[bin % N];
                bin.extent.add(r.lower, r.upper);
                bin.count += 1;
            }
        }
        Self { bins }
    }

    fn union(mut self, other: &Self) -> Self {
        for (mine, theirs) in self.bins.as_flattened_mut().iter_mut().zip(other.bins.as_flattened()) {
            mine.extent = mine.extent.union(theirs.extent);
            mine.count += theirs.count;
        }
        self
    }

    /// The cheapest cut: axis and first bin of the right side. Packs are what costs, not triangles.
    fn best(&self) -> Option<(usize, usize)> {
        let packs = |count: u32| count.div_ceil(LANES as u32) as f32;
        let mut best = (f32::INFINITY, None);
        for (axis, bins) in self.bins.iter().enumerate() {
            let mut right_cost = [f32::INFINITY; N];
            let (mut extent, mut count) = (Extent::EMPTY, 0);
            for i in (1..N).rev() {
                extent = extent.union(bins[i].extent);
                count += bins[i].count;
                if count > 0 {
                    right_cost[i] = extent.half_area() * packs(count);
                }
            }
            let (mut extent, mut count) = (Extent::EMPTY, 0);
            for i in 1..N {
                extent = extent.union(bins[i - 1].extent);
                count += bins[i - 1].count;
                let cost = extent.half_area() * packs(count) + right_cost[i];
                if count > 0 && cost < best.0 {
                    best = (cost, Some((axis, i)));
                }
            }
        }
        best.1
    }
}

/// The two parts of a range of at least two triangles; `halve` cuts by number alone.
pub fn split(range: Range<'_>, halve: bool) -> (Range<'_>, Range<'_>) {
    let Range { refs, middles, .. } = range;
    let few = refs.len() <= FEW;
    let binning = Binning::new(&middles, if few { FEW_BINS } else { BINS });
    let found = if halve {
        None
    } else if refs.len() > PARALLEL {
        let fill = |chunk: &[Ref]| Bins::<BINS>::fill(chunk, binning);
        refs.par_chunks(CHUNK).map(fill).reduce_with(|a, b| a.union(&b)).and_then(|bins| bins.best())
    } else if few {
        Bins::<FEW_BINS>::fill(refs, binning).best()
    } else {
        Bins::<BINS>::fill(refs, binning).best()
    };
    let at = match found {
        Some((axis, first_right)) => partition(refs, |r| binning.of(r)[axis] < first_right),
        None => {
            let size = middles.upper - middles.lower;
            let axis = size.truncate().max_position();
            let left = (refs.len() / 2).next_multiple_of(LANES).min(refs.len() - 1);
            refs.select_nth_unstable_by(left, |a, b| {
                a.middle()[axis].total_cmp(&b.middle()[axis]).then(a.item().cmp(&b.item()))
            });
            left
        }
    };
    let (left, right) = refs.split_at_mut(at);
    (Range::new(left), Range::new(right))
}

/// Those that belong to the left first; their number.
fn partition(refs: &mut [Ref], is_left: impl Fn(&Ref) -> bool) -> usize {
    let (mut left, mut right) = (0, refs.len());
    loop {
        while left < right && is_left(&refs[left]) {
            left += 1;
        }
        while left < right && !is_left(&refs[right - 1]) {
            right -= 1;
        }
        if left >= right {
            return left;
        }
        refs.swap(left, right - 1);
    }
}
