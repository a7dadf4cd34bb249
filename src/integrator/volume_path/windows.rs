//! Weight windows: where paths in a body are split, and where they go on by chance, so that what the camera sees gets as many of them
//! wherever it is, bright or dark [WPM14] [VK16].

use super::VolumePath;
use super::draws::PathSampler;
use super::interior::{Edge, Interior, WalkExit, WalkObserver, russian_roulette};
use super::spectrum::Spectrum;
use crate::geometry::SurfacePoint;
use crate::integrator::View;
use crate::math::{Aabb, DVec3, Rgb, Vec3, hash_combine};
use crate::optics::refract;
use crate::sampling::cosine_hemisphere;
use crate::tally::{Tally, WalkTally};
use rayon::prelude::*;

/// Cells along the longest side of a body's box.
const CELLS: f64 = 32.0;
/// The least importance, as a share of the mean: light that nobody sees enters bodies again.
const LEAST: f64 = 0.1;
/// A path is worth this factor more or less than wanted before it is split or goes on by chance.
const WIDE: f32 = 2.0;
/// Parts that a path is split in at once.
const MOST_PARTS: f32 = 8.0;
/// And by one walk after the other.
const MOST_WALKS: u32 = 1 << 10;
/// Collisions from one look at the weight to the next.
const PATIENCE: u32 = 3;

/// Tasks in which importance is found: each has sums of its own.
const TASKS: usize = 8;

/// Importance by place: the share of what is seen that light brings which is scattered there.
pub struct Windows {
    lower: DVec3,
    edge: f64,
    size: [usize; 3],
    /// One over the wanted weight in each channel.
    importance: Vec<Rgb>,
}

impl Windows {
    /// Over the box `bounds`, nothing known yet.
    pub fn new(bounds: Aabb) -> Self {
        let extent = bounds.extent();
        let edge = extent.max_element() / CELLS;
        let size = extent.to_array().map(|e| ((e / edge).ceil() as usize).clamp(1, CELLS as usize + 1));
        Self { lower: bounds.lower, edge, size, importance: vec![Rgb::BLACK; size.iter().product()] }
    }

    /// How many cells.
    fn count(&self) -> usize {
        self.importance.len()
    }

    #[inline]
    fn cell(&self, x: DVec3) -> usize {
        let [i, j, k] = ((x - self.lower) / self.edge).to_array();
        let at = |v: f64, axis: usize| (v.max(0.0) as usize).min(self.size[axis] - 1);
        (at(k, 2) * self.size[1] + at(j, 1)) * self.size[0] + at(i, 0)
    }

    /// What `sums`, of paths from what is seen, tell: smoothed, over their mean.
    pub fn learn(&mut self, sums: &[[f64; 3]]) {
        let [nx, ny, nz] = self.size;
        let smooth = |k: usize, j: usize, i: usize| {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for (dk, dj, di) in (0..27).map(|d| (d / 9, d / 3 % 3, d % 3)) {
                let at = [i + di, j + dj, k + dk];
                if (0..3).any(|a| at[a] == 0 || at[a] > self.size[a]) {
                    continue;
                }
                let own = sums[((at[2] - 1) * ny + at[1] - 1) * nx + at[0] - 1];
                let weight = if [di, dj, dk] == [1, 1, 1] { 4.0 } else { 1.0 };
                // Cells that no path came to are outside, or far away.
                if own.iter().any(|v| *v > 0.0) {
                    (0..3).for_each(|c| sum[c] += weight * own[c]);
                    count += weight;
                }
            }
            if count > 0.0 { sum.map(|s| s / count) } else { [0.0; 3] }
        };
        let smoothed: Vec<[f64; 3]> = (0..nx * ny * nz).map(|n| smooth(n / (nx * ny), n / nx % ny, n % nx)).collect();
        let filled = smoothed.iter().filter(|s| s.iter().any(|v| *v > 0.0)).count().max(1) as f64;
        let mean: [f64; 3] = std::array::from_fn(|c| smoothed.iter().map(|s| s[c]).sum::<f64>() / filled);
        self.importance = smoothed
            .iter()
            .map(|s| Rgb::from_fn(|c| if mean[c] > 0.0 { (s[c] / mean[c]).max(LEAST) as f32 } else { 1.0 }))
            .collect();
    }

    /// Makes all paths worth more by `factor`.
    pub fn scale(&mut self, factor: f32) {
        self.importance.iter_mut().for_each(|i| *i *= factor);
    }

    /// How much more a path of weight `value` at `x` is worth than wanted.
    #[inline]
    pub fn worth(&self, x: DVec3, value: Rgb) -> f32 {
        (self.importance[self.cell(x)] * value).max()
    }
}

/// A part of a path that waits to be walked.
struct Waiting {
    from: (DVec3, Vec3),
    /// Whether that is where and how it came to a collision.
    collides: bool,
    spectrum: Spectrum,
    draws: PathSampler,
    order: u32,
}

/// Splits paths, and lets them go on by chance.
struct Splitting<'a> {
    body: &'a Interior,
    windows: Option<&'a Windows>,
    waiting: &'a mut Vec<Waiting>,
    /// Collisions so far.
    order: u32,
    /// Parts so far, of the whole path.
    parts: &'a mut u32,
}

impl WalkObserver for Splitting<'_> {
    fn collision(
        &mut self,
        x: DVec3,
        w: Vec3,
        _: Option<Edge>,
        spectrum: &mut Spectrum,
        draws: &mut PathSampler,
    ) -> bool {
        self.order = self.order.saturating_add(1);
        let Some(windows) = self.windows.filter(|_| self.order % PATIENCE == 1) else { return true };
        let worth = windows.worth(x, spectrum.value(&self.body.medium));
        if worth * WIDE < 1.0 {
            return russian_roulette(worth, spectrum, draws);
        }
        if worth > WIDE && *self.parts < MOST_WALKS {
            let parts = worth.min(MOST_PARTS).round();
            spectrum.scale(Rgb::splat(1.0 / parts));
            for k in 1..parts as u32 {
                *self.parts += 1;
                let (from, draws) = ((x, w), draws.fork(k.into()));
                self.waiting.push(Waiting { from, collides: true, spectrum: *spectrum, draws, order: self.order });
            }
            // What goes on draws other numbers than what was split off before.
            *draws = draws.fork(0);
        }
        true
    }

    fn plays_roulette(&self) -> bool {
        self.windows.is_some()
    }

    fn jumps(&self) -> bool {
        true
    }

    fn passed(&mut self) {
        self.order = self.order.saturating_add(1);
    }
}

/// Light that has come out of a body.
pub struct Out {
    /// Where and how.
    pub exit: WalkExit,
    /// How much.
    pub flux: Rgb,
    /// How often it was scattered.
    pub order: u32,
    /// Numbers for what becomes of it.
    pub draws: PathSampler,
}

impl VolumePath {
    /// Light of flux `flux` that has come through the boundary of a body at and along `from`, until it leaves it in one or more parts, each
    /// of which is given to `each`.
    pub(in super::super) fn walk_through(
        &self,
        (view, object): (View<'_>, u32),
        (from, flux): ((DVec3, Vec3), Rgb),
        windows: Option<&Windows>,
        mut draws: PathSampler,
        tally: &mut Tally,
        mut each: impl FnMut(Out, &mut Tally),
    ) {
        let Some(body) = self.body(object) else { return };
        let spectrum = Spectrum::new(flux, draws.number());
        let mut waiting = vec![Waiting { from, collides: false, spectrum, draws, order: 0 }];
        let mut parts = 1;
        while let Some(Waiting { mut from, collides, mut spectrum, mut draws, order }) = waiting.pop() {
            let mut watch = Splitting { body, windows, waiting: &mut waiting, order, parts: &mut parts };
            if collides {
                from = body.scattered(from, &mut spectrum, &mut draws, &mut watch, &mut tally.walk);
            }
            let exit = body.walk(view, from, &mut spectrum, &mut draws, &mut watch, &mut tally.walk);
            let order = watch.order;
            if let Some(exit) = exit {
                each(Out { exit, flux: spectrum.value_outside(), order, draws }, tally);
            }
        }
    }

    /// Importance in the body of number `object` of what leaves it at `seen`, points with what light there counts for.
    pub(in super::super) fn importance(
        &self,
        view: View<'_>,
        object: u32,
        bounds: Aabb,
        seen: &[(SurfacePoint, Rgb)],
        (walks, key): (usize, u64),
    ) -> Option<Windows> {
        let body = self.body(object)?;
        let mut windows = Windows::new(bounds);
        let tasks: Vec<Vec<[f64; 3]>> = (0..TASKS)
            .into_par_iter()
            .map(|task| {
                let mut sums = vec![[0.0; 3]; windows.count()];
                let mut walk = WalkTally::default();
                for i in (task..walks).step_by(TASKS) {
                    let (at, weight) = &seen[i * seen.len() / walks];
                    let mut draws = PathSampler::new(&[], hash_combine(key, i as u64));
                    let out = cosine_hemisphere(at.n_geometric, draws.pair());
                    let Some(inside) = refract(out, at.n_geometric, body.eta) else { continue };
                    let mut spectrum = Spectrum::new(*weight, draws.number());
                    let mut watch = Counting { body, windows: &windows, sums: &mut sums };
                    let from = (at.leave(inside), inside);
                    let _ = body.walk(view, from, &mut spectrum, &mut draws, &mut watch, &mut walk);
                }
                sums
            })
            .collect();
        let mut sums = vec![[0.0; 3]; windows.count()];
        tasks
            .iter()
            .for_each(|task| sums.iter_mut().zip(task).for_each(|(sum, own)| (0..3).for_each(|c| sum[c] += own[c])));
        windows.learn(&sums);
        Some(windows)
    }
}

/// Counts what comes to each cell.
struct Counting<'a> {
    body: &'a Interior,
    windows: &'a Windows,
    sums: &'a mut [[f64; 3]],
}

impl WalkObserver for Counting<'_> {
    fn collision(&mut self, x: DVec3, _: Vec3, _: Option<Edge>, spectrum: &mut Spectrum, _: &mut PathSampler) -> bool {
        let value = spectrum.value(&self.body.medium);
        let sum = &mut self.sums[self.windows.cell(x)];
        (0..3).for_each(|c| sum[c] += f64::from(value[c] / self.body.medium.sigma_t[c].max(f32::MIN_POSITIVE)));
        true
    }
}
