//! How far a picture is from what it converges to, found from the picture alone, with a 95 % interval.
//!
//! The mean e of the even passes and the mean o of the odd ones are independent, because their random numbers are
//! (`sampling/turn.rs`), and both have the limit r as their expectation. With the whole x = (n_e e + n_o o) / (n_e + n_o),
//!
//!   S = mean(w (e - o)^2) n_e n_o / (n_e + n_o)^2   has the expectation of   T = mean(w (x - r)^2),
//!
//! whatever the sequence within each half does. The difference of the two is a product of what is independent:
//! for equal halves T - S = mean(w (e - r)(o - r)). Its spread depends on how many pixels err together, for all pixels
//! of a pass share a cache: with C the covariance of the weighted error of x, T / S is distributed about as F(k, k),
//! k = (tr C)^2 / tr C^2, the number of independent errors in the picture.
//!
//! k comes from the picture as well. The earlier and the later passes of a half differ by pure noise, a in one half and b in
//! the other; a and b are independent, so (a, b)^2 has the expectation tr(C_a C_b). Taken block by block, since errors far
//! apart do not go together, this has as many degrees of freedom as there are blocks that count. How far is far differs,
//! so blocks of up to three sizes are tried.
//!
//! w = 1 / (l^2 + 0.01 mean(l)^2) needs the level l of each pixel, and x will not do: a firefly would raise the level that its
//! own error is divided by, and hide itself. So x is shrunk towards m, the mean of x over the pixels around, which has nothing of
//! the pixel's own samples:
//!
//!   l = (x M^2 + m V^2) / (M^2 + V^2), but no farther than from e to o,   V = (e - o)^2 n_e n_o / (n_e + n_o)^2,
//!
//! with M the variance of x among the pixels around, times 1 + 1 / their number. A firefly has a large V and is in one half alone:
//! l is at the other half, where the pixel was before. Next to one, and at edges, M is large: l is x.
//!
//! What is left of a pixel's noise in its level is told by half of it, taken off the square of the level: that changes S by a
//! factor e^c. The error of S by its weights is of that size, of either sign, and no spread tells of it: it widens the interval,
//! and where it is large there is none. docs/convergence.md has what that covers.

use super::metrics::{BLOCK, Estimate, student_975};
use super::{Film, Window};
use crate::math::Rgb;
use serde::Serialize;

/// Errors of a picture against what it converges to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SelfErrors {
    /// sqrt(mean((x - limit)^2)), in the unit of the picture.
    pub rmse: Estimate,
    /// mean((x - limit)^2 / (limit^2 + 0.01 mean(limit)^2)), with levels for the limit that a pixel's own bright samples do not
    /// raise; none where the picture is black.
    pub relmse: Option<Estimate>,
    /// The same, with more weight for a pixel that has met little light and much at a time: for ending a render. `relmse`
    /// may be too small where many pixels are like that, this is a little too large where few are.
    pub relmse_careful: Option<f64>,
    /// The pixel that carries most of the noise, where a speck of one half does not count for the level of its pixel; none
    /// without noise.
    pub worst: Option<WorstPixel>,
    /// Why `rmse` and `relmse` have no interval; none where they have one, and without noise.
    pub no_interval: Option<NoInterval>,
}

/// Why an error is told without an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoInterval {
    /// Fewer than [`FEWEST_PASSES`].
    FewPasses,
    /// Few pixels carry most of the noise: other passes would have others.
    FewPixels,
    /// Single pixels are so noisy that it is not known how much they count.
    NoisyPixels,
    /// The film was not followed while it grew.
    NotFollowed,
}

impl NoInterval {
    /// `by_weights` is c of the head of this file.
    fn of(now: &State, rmse: &Estimate, worst: Option<WorstPixel>, by_weights: f64) -> Option<Self> {
        if rmse.value == 0.0 {
            None
        } else if now.total() < FEWEST_PASSES {
            Some(Self::FewPasses)
        } else if worst.is_some_and(|worst| worst.carriers < FEWEST_CARRIERS) {
            Some(Self::FewPixels)
        } else if by_weights > MOST_BY_WEIGHTS {
            Some(Self::NoisyPixels)
        } else {
            rmse.interval.is_none().then_some(Self::NotFollowed)
        }
    }
}

/// Passes before an error has an interval: below, intervals are measured to hold in up to 99 % of renders.
pub const FEWEST_PASSES: u32 = 12;

/// A pixel and what hangs on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WorstPixel {
    /// Column and row of the whole picture.
    pub pixel: [u32; 2],
    /// Its share of the noise.
    pub share: f64,
    /// How many pixels the noise is spread over, (sum of squares)² / sum of their squares.
    pub carriers: f64,
    /// relMSE of all pixels, with the lesser half for the level of each: what it is if bright specks are noise.
    pub relmse: f64,
}

/// Follows a film while it grows and estimates its error. It keeps two earlier states of the film, 24 bytes each for a
/// pixel, for the intervals.
#[derive(Clone, Debug, Default)]
pub struct SelfError {
    earlier: Vec<State>,
    pixels: Option<Vec<usize>>,
    last: Option<SelfErrors>,
}

/// Sums of radiance and passes of the two halves at one time.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) passes: [u32; 2],
    sums: [Vec<Rgb>; 2],
}

impl State {
    pub(super) fn of(film: &Film) -> Option<Self> {
        let passes = film.half_passes();
        if passes.contains(&0) {
            return None;
        }
        let [e, o] = film.half_images()?;
        let sum = |image: super::Image, n: u32| image.pixels.into_iter().map(|p| p * n as f32).collect();
        Some(Self { passes, sums: [sum(e, passes[0]), sum(o, passes[1])] })
    }

    pub(super) fn total(&self) -> u32 {
        self.passes[0] + self.passes[1]
    }

    /// Mean of half `half` at pixel i.
    pub(super) fn half(&self, half: usize, i: usize, c: usize) -> f64 {
        f64::from(self.sums[half][i][c]) / f64::from(self.passes[half])
    }

    /// Even less odd.
    fn difference(&self, i: usize, c: usize) -> f64 {
        self.half(0, i, c) - self.half(1, i, c)
    }

    fn mean(&self, i: usize, c: usize) -> f64 {
        (f64::from(self.sums[0][i][c]) + f64::from(self.sums[1][i][c])) / f64::from(self.total())
    }

    /// Level of pixel i, see the head of this file.
    fn level(&self, window: Window, i: usize) -> [f64; 3] {
        let (width, height) = (window.width(), window.height());
        let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        let (mut sums, mut squares, mut n) = ([0.0; 3], [0.0; 3], 0.0);
        for row in near(i / width, height) {
            for column in near(i % width, width) {
                let k = row * width + column;
                if k != i {
                    n += 1.0;
                    for c in 0..3 {
                        let mean = self.mean(k, c);
                        sums[c] += mean;
                        squares[c] += mean * mean;
                    }
                }
            }
        }
        std::array::from_fn(|c| {
            let (own, [e, o]) = (self.mean(i, c), [0, 1].map(|half| self.half(half, i, c)));
            let noise = self.scale() * (e - o).powi(2);
            if n < 2.0 || noise == 0.0 {
                return own;
            }
            let around = sums[c] / n;
            // How far a pixel is from the mean of those around it: by how far they are from each other.
            let far = ((squares[c] - n * around * around) / (n - 1.0)).max(0.0) * (1.0 + 1.0 / n);
            let level = (own * far * far + around * noise * noise) / (far * far + noise * noise);
            level.max(e.min(o)).min(e.max(o))
        })
    }

    /// What the square of [`Self::difference`] is to be multiplied by to be that of an error of the mean.
    pub(super) fn scale(&self) -> f64 {
        let n = self.passes.map(f64::from);
        n[0] * n[1] / (n[0] + n[1]).powi(2)
    }

    /// S of the head of this file.
    pub(super) fn noise(&self, pixels: &[usize], weight: Weight<'_>) -> f64 {
        let square = |i: usize, c: usize| weight(i, c) * self.difference(i, c).powi(2);
        let sum: f64 = pixels.iter().map(|&i| (0..3).map(|c| square(i, c)).sum::<f64>()).sum();
        self.scale() * sum / (3 * pixels.len()) as f64
    }

    /// The worst pixel, weighted by the lesser half: a bright speck is in one half alone.
    fn worst(&self, pixels: &[usize], window: Window) -> Option<WorstPixel> {
        let lesser = |i: usize, c: usize| self.half(0, i, c).min(self.half(1, i, c)).max(0.0);
        let level: f64 = pixels.iter().map(|&i| (0..3).map(|c| lesser(i, c)).sum::<f64>()).sum();
        let floor = 0.01 * (level / (3 * pixels.len()) as f64).powi(2);
        let square =
            |i: usize| -> f64 { (0..3).map(|c| self.difference(i, c).powi(2) / (lesser(i, c).powi(2) + floor)).sum() };
        let (mut sum, mut squared, mut worst) = (0.0, 0.0, (0, 0.0));
        for &i in pixels {
            let one = square(i);
            sum += one;
            squared += one * one;
            worst = if one > worst.1 { (i, one) } else { worst };
        }
        let relmse = self.scale() * sum / (3 * pixels.len()) as f64;
        let (share, carriers) = (worst.1 / sum, sum * sum / squared);
        (floor > 0.0 && sum > 0.0).then(|| WorstPixel { pixel: window.pixel(worst.0), share, carriers, relmse })
    }

    /// Whether both halves of `later` have passes that this has not, together so many that their noise is like that of
    /// the passes before.
    fn is_far_before(&self, later: &Self) -> bool {
        let more = |half: usize| later.passes[half] > self.passes[half];
        more(0) && more(1) && f64::from(later.total()) >= FAR * f64::from(self.total())
    }

    /// Mean of half `half` over the passes of `self`, less the mean over the passes from then to `later`, at pixel i.
    pub(super) fn contrast(&self, later: &Self, half: usize, i: usize) -> [f64; 3] {
        let (n, more) = (f64::from(self.passes[half]), f64::from(later.passes[half] - self.passes[half]));
        std::array::from_fn(|c| {
            let (before, all) = (f64::from(self.sums[half][i][c]), f64::from(later.sums[half][i][c]));
            before / n - (all - before) / more
        })
    }
}

/// Weight of the squared error in each channel of each pixel.
pub(super) type Weight<'a> = &'a dyn Fn(usize, usize) -> f64;

impl SelfError {
    /// Of all pixels.
    pub fn new() -> Self {
        Self::default()
    }

    /// Of the pixels with these numbers, in row-major order of the film's window.
    pub fn of_pixels(pixels: Vec<usize>) -> Self {
        Self { pixels: Some(pixels), ..Self::default() }
    }

    /// The errors of `film` as it is now, which must be the film of the earlier calls with passes added, or a new one.
    /// None before both halves have a pass; without intervals before [`FEWEST_PASSES`].
    pub fn measure(&mut self, film: &Film) -> Option<SelfErrors> {
        let now = State::of(film)?;
        self.earlier.retain(|s| (0..2).all(|h| s.passes[h] <= now.passes[h]));
        let pixels = self.pixels.take().unwrap_or_else(|| (0..film.window().area()).collect());
        // By number in the window, for the pixels that count.
        let mut levels = vec![[0.0; 3]; film.window().area()];
        pixels.iter().for_each(|&i| levels[i] = now.level(film.window(), i));
        let level = pixels.iter().map(|&i| levels[i].iter().sum::<f64>()).sum::<f64>();
        let floor = 0.01 * (level / (3 * pixels.len()) as f64).powi(2);
        let estimate = |weight: Weight<'_>| self.estimate(film.window(), &now, &pixels, weight);
        // The square of the level without some of the noise that may be in it.
        let careful = |i: usize, c: usize| {
            let (square, noise) = (levels[i][c].powi(2), now.scale() * now.difference(i, c).powi(2));
            square - CAREFUL * noise.min(square)
        };
        let lit = floor > 0.0;
        let mut rmse = estimate(&|_, _| 1.0).sqrt();
        let mut relmse = lit.then(|| estimate(&|i, c| 1.0 / (levels[i][c].powi(2) + floor)));
        let relmse_careful = lit.then(|| now.noise(&pixels, &|i, c| 1.0 / (careful(i, c) + floor)));
        let worst = now.worst(&pixels, film.window());
        let by_weights = relmse.zip(relmse_careful).map_or(0.0, |(plain, careful)| (careful / plain.value).ln());
        let no_interval = NoInterval::of(&now, &rmse, worst, by_weights);
        if no_interval.is_some() {
            rmse.interval = None;
        }
        relmse = relmse.map(|plain| match plain.interval {
            Some([low, high]) if no_interval.is_none() => {
                let width = ((high / low).ln() / 2.0).hypot(WEIGHTS * by_weights);
                Estimate { interval: Some([plain.value * (-width).exp(), plain.value * width.exp()]), ..plain }
            }
            _ => Estimate { interval: None, ..plain },
        });
        let errors = SelfErrors { rmse, relmse, relmse_careful, worst, no_interval };
        if self.pixels.is_none() && pixels.len() != film.window().area() {
            self.pixels = Some(pixels);
        }
        self.keep(now);
        self.last = Some(errors);
        Some(errors)
    }

    /// The film when it had fewer passes, so many fewer that the difference between then and now tells noise.
    pub(super) fn before(&self, now: &State) -> Option<&State> {
        self.earlier.iter().rev().find(|s| s.is_far_before(now))
    }

    /// mean(weight (x - limit)^2) over `pixels` and channels of the film that [`Self::measure`] saw last, `now`.
    pub(super) fn estimate(&self, window: Window, now: &State, pixels: &[usize], weight: Weight<'_>) -> Estimate {
        let value = now.noise(pixels, weight);
        let width = self
            .before(now)
            .and_then(|before| Together::of(window, pixels, [before, now], weight))
            .and_then(Together::log_width);
        Estimate { value, interval: width.map(|w| [value * (-w).exp(), value * w.exp()]) }
    }

    /// What [`Self::measure`] said last.
    pub fn last(&self) -> Option<SelfErrors> {
        self.last
    }

    /// Keeps the two newest states of a row in which each has twice the passes of the one before.
    fn keep(&mut self, now: State) {
        if self.earlier.last().is_none_or(|last| now.total() >= 2 * last.total()) {
            if self.earlier.len() == KEPT {
                self.earlier.remove(0);
            }
            self.earlier.push(now);
        }
    }
}

/// Earlier states kept: one of them is between a quarter and 1 / [`FAR`] of the passes.
const KEPT: usize = 2;

/// Share of a pixel's noise that is taken off the square of its level for `relmse_careful`. All of it would be right in the
/// mean of the level, but the inverse is then far too large where the noise is; half is measured to serve all scenes.
const CAREFUL: f64 = 0.5;

/// Pixels that the noise is spread over, at the least, for an interval: with fewer, the next pass may bring one as bad.
const FEWEST_CARRIERS: f64 = 4.0;

/// What the weights may be wrong by, in units of c at the head of this file: about 1 is what it is in single pictures; this holds it
/// in large ones too, where nothing else widens the interval.
const WEIGHTS: f64 = 1.6;

/// The largest c of an error that has an interval: beyond, light that has not been met may be most of it.
const MOST_BY_WEIGHTS: f64 = 0.25;

/// Passes now over passes then, at the least, for a difference between the two that is like the error of all. That of a
/// few passes more is not: noise of single passes is spread over more pixels.
const FAR: f64 = 1.4;

/// Errors go together more in the whole than in the differences they are judged by, since the sequence spreads out first
/// what is each pixel's own: measured over the renders of docs/convergence.md, 1 / k is larger by this.
const CLOSER: f64 = 1.25;

/// How many errors of a picture are independent of each other.
#[derive(Clone, Copy, Debug)]
struct Together {
    /// k, see the head of this file.
    independent: f64,
    /// Degrees of freedom of 1 / k.
    freedom: f64,
}

impl Together {
    /// From the passes up to the first of `times` and those from there to the second.
    fn of(window: Window, pixels: &[usize], times: [&State; 2], weight: Weight<'_>) -> Option<Self> {
        let [before, now] = times;
        let side = block_side(window);
        let mut grid = [window.width().div_ceil(side), window.height().div_ceil(side)];
        let mut products = vec![0.0; grid[0] * grid[1]];
        let mut squares = [0.0; 2];
        for &i in pixels {
            let block = &mut products[i / window.width() / side * grid[0] + i % window.width() / side];
            let (a, b) = (before.contrast(now, 0, i), before.contrast(now, 1, i));
            for c in 0..3 {
                let w = weight(i, c);
                squares[0] += w * a[c] * a[c];
                squares[1] += w * b[c] * b[c];
                *block += w * a[c] * b[c];
            }
        }
        let mut worst: Option<Self> = None;
        for _ in 0..LEVELS {
            if worst.is_some() && products.len() < FEWEST_BLOCKS {
                break;
            }
            let at_level = Self::of_blocks(&products, squares[0] * squares[1]);
            if worst.is_none_or(|w| at_level.independent < w.independent) {
                worst = Some(at_level);
            }
            products = four_to_one(&products, &mut grid);
        }
        worst
    }

    /// From the products of the noise of both halves in each block, and the product of their squares.
    fn of_blocks(products: &[f64], size: f64) -> Self {
        let shared = products.iter().map(|p| p * p / size);
        let (second, fourth) = shared.fold((0.0, 0.0), |(sum, squares), s| (sum + s, squares + s * s));
        // For products p of normal errors E p^4 = 3 (E p^2)^2, and E (sum of p^2)^2 has twice the sum of (E p^2)^2 on top.
        Self { independent: 1.0 / second, freedom: 3.0 * second * second / fourth - 2.0 }
    }

    /// Half of the 95 % interval of log(T / S); none without noise.
    fn log_width(self) -> Option<f64> {
        let width = student_975(self.freedom.max(FEWEST_FREEDOM) as usize) * 2.0
            / (self.independent / CLOSER - 1.0).max(1.0).sqrt();
        self.independent.is_finite().then_some(width)
    }
}

/// Degrees of freedom at the least: one block with most of what is shared looks like one, but that too is chance, and Student's
/// factor for one is so large that it says nothing.
pub(super) const FEWEST_FREEDOM: f64 = 2.0;

/// Blocks of 1, 2 and 4 times the side are tried: noise of the cache may be as wide as that, and the widest counts.
pub(super) const LEVELS: usize = 3;

/// Wider blocks are not tried where they are fewer: what they say is mostly chance, and the widest of chances would count.
pub(super) const FEWEST_BLOCKS: usize = 9;

/// Sums over 2x2 blocks; `grid` is columns and rows before and after.
fn four_to_one(blocks: &[f64], grid: &mut [usize; 2]) -> Vec<f64> {
    let columns = grid[0].div_ceil(2);
    let mut out = vec![0.0; columns * grid[1].div_ceil(2)];
    for (i, block) in blocks.iter().enumerate() {
        out[i / grid[0] / 2 * columns + i % grid[0] / 2] += block;
    }
    *grid = [columns, grid[1].div_ceil(2)];
    out
}

/// Side of the smallest blocks within which errors may go together [pixels]: smaller where the picture has few.
pub(super) fn block_side(window: Window) -> usize {
    (((window.area() as f64).sqrt() / 8.0) as usize).clamp(4, BLOCK as usize)
}
