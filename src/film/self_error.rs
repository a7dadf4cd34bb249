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
//! k comes from the picture as well. Two runs of passes, an earlier and a later one, give in each half a difference that is
//! pure noise, a and b; they are independent, so (a, b)^2 has the expectation tr(C_a C_b). Taken block by block, since
//! errors far apart do not go together, this has as many degrees of freedom as there are blocks that count. How far is
//! far differs, so blocks of three sizes are tried.

use super::metrics::{BLOCK, Estimate, student_975};
use super::{Film, Window};
use crate::math::Rgb;
use serde::Serialize;

/// Errors of a picture against what it converges to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SelfErrors {
    /// sqrt(mean((x - limit)^2)), in the unit of the picture.
    pub rmse: Estimate,
    /// mean((x - limit)^2 / (limit^2 + 0.01 mean(limit)^2)); none where the picture is black.
    pub relmse: Option<Estimate>,
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
struct State {
    passes: [u32; 2],
    sums: [Vec<Rgb>; 2],
}

impl State {
    fn of(film: &Film) -> Option<Self> {
        let passes = film.half_passes();
        if passes.contains(&0) {
            return None;
        }
        let [e, o] = film.half_images()?;
        let sum = |image: super::Image, n: u32| image.pixels.into_iter().map(|p| p * n as f32).collect();
        Some(Self { passes, sums: [sum(e, passes[0]), sum(o, passes[1])] })
    }

    fn total(&self) -> u32 {
        self.passes[0] + self.passes[1]
    }

    /// Mean of half `half` over the passes of `self`, less the mean over the passes from then to `later`, at pixel i.
    fn contrast(&self, later: &Self, half: usize, i: usize) -> [f64; 3] {
        let (n, more) = (f64::from(self.passes[half]), f64::from(later.passes[half] - self.passes[half]));
        std::array::from_fn(|c| {
            let (before, all) = (f64::from(self.sums[half][i][c]), f64::from(later.sums[half][i][c]));
            before / n - (all - before) / more
        })
    }
}

/// Weight of the squared error in each channel of each pixel.
type Weight<'a> = &'a dyn Fn(usize, usize) -> f64;

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
    /// None before both halves have a pass; without intervals before both have two.
    pub fn measure(&mut self, film: &Film) -> Option<SelfErrors> {
        let now = State::of(film)?;
        self.earlier.retain(|s| (0..2).all(|h| s.passes[h] <= now.passes[h]));
        let n = [0, 1].map(|h| f64::from(now.passes[h]));
        let all = n[0] + n[1];
        let pixels = self.pixels.take().unwrap_or_else(|| (0..film.window().area()).collect());
        let halves = |i: usize, c: usize| [0, 1].map(|h| f64::from(now.sums[h][i][c]) / n[h]);
        let mean = |i: usize, c: usize| (n[0] * halves(i, c)[0] + n[1] * halves(i, c)[1]) / all;
        let level = pixels.iter().map(|&i| (0..3).map(|c| mean(i, c)).sum::<f64>()).sum::<f64>();
        let floor = 0.01 * (level / (3 * pixels.len()) as f64).powi(2);
        let scale = n[0] * n[1] / (all * all * (3 * pixels.len()) as f64);
        let mut times: Vec<&State> =
            self.earlier.iter().filter(|s| (0..2).all(|h| s.passes[h] < now.passes[h])).collect();
        times.push(&now);
        let estimate = |weight: Weight<'_>| {
            let square = |i: usize, c: usize| weight(i, c) * (halves(i, c)[0] - halves(i, c)[1]).powi(2);
            let value = scale * pixels.iter().map(|&i| (0..3).map(|c| square(i, c)).sum::<f64>()).sum::<f64>();
            let width = Together::of(film.window(), &pixels, &times, weight).and_then(Together::log_width);
            Estimate { value, interval: width.map(|w| [value * (-w).exp(), value * w.exp()]) }
        };
        let errors = SelfErrors {
            rmse: estimate(&|_, _| 1.0).sqrt(),
            relmse: (floor > 0.0).then(|| estimate(&|i, c| 1.0 / (mean(i, c).powi(2) + floor))),
        };
        if self.pixels.is_none() && pixels.len() != film.window().area() {
            self.pixels = Some(pixels);
        }
        self.keep(now);
        self.last = Some(errors);
        Some(errors)
    }

    /// What [`Self::measure`] said last.
    pub fn last(&self) -> Option<SelfErrors> {
        self.last
    }

    /// Keeps the states at about a quarter and a half of the passes to come.
    fn keep(&mut self, now: State) {
        if self.earlier.last().is_none_or(|last| now.total() >= 2 * last.total()) {
            if self.earlier.len() == KEPT {
                self.earlier.remove(0);
            }
            self.earlier.push(now);
        }
    }
}

/// Earlier states kept: at about a half and a quarter of the passes.
const KEPT: usize = 2;

/// Errors go together more in the whole than in the runs it is judged by, since the sequence spreads out first what is
/// each pixel's own: measured over the renders of docs/convergence.md, 1 / k is larger by this.
const CLOSER: f64 = 1.4;

/// How many errors of a picture are independent of each other.
#[derive(Clone, Copy, Debug)]
struct Together {
    /// k, see the head of this file.
    independent: f64,
    /// Degrees of freedom of 1 / k.
    freedom: f64,
}

impl Together {
    /// From the runs of passes between `times`; none without two runs.
    fn of(window: Window, pixels: &[usize], times: &[&State], weight: Weight<'_>) -> Option<Self> {
        let runs = times.len() - 1;
        let side = block_side(window);
        let columns = window.width().div_ceil(side);
        let mut products = vec![[0.0; KEPT * KEPT]; columns * window.height().div_ceil(side)];
        let mut squares = [[0.0; KEPT]; 2];
        for &i in pixels {
            let block = &mut products[i / window.width() / side * columns + i % window.width() / side];
            let noise = |half: usize| -> [[f64; 3]; KEPT] {
                std::array::from_fn(|r| if r < runs { times[r].contrast(times[r + 1], half, i) } else { [0.0; 3] })
            };
            let (a, b) = (noise(0), noise(1));
            for c in 0..3 {
                let w = weight(i, c);
                for r in 0..runs {
                    squares[0][r] += w * a[r][c] * a[r][c];
                    squares[1][r] += w * b[r][c] * b[r][c];
                    for t in 0..runs {
                        block[r * KEPT + t] += w * a[r][c] * b[t][c];
                    }
                }
            }
        }
        let mut worst = None;
        let mut grid = [columns, products.len() / columns];
        for _ in 0..LEVELS {
            let at_level = Self::of_blocks(&products, &squares, runs);
            if worst.is_none_or(|w: Self| at_level.independent < w.independent) {
                worst = Some(at_level);
            }
            products = four_to_one(&products, &mut grid);
        }
        worst.filter(|_| runs > 0)
    }

    /// From the products of the noise of both halves in each block, and the squares of that noise.
    fn of_blocks(products: &[[f64; KEPT * KEPT]], squares: &[[f64; KEPT]; 2], runs: usize) -> Self {
        let (mut second, mut fourth) = (0.0, 0.0);
        for r in 0..runs {
            for t in 0..runs {
                let size = squares[0][r] * squares[1][t];
                for block in products {
                    let shared = block[r * KEPT + t].powi(2) / size;
                    second += shared;
                    fourth += shared * shared;
                }
            }
        }
        // For products p of normal errors E p^4 = 3 (E p^2)^2, and E (sum of p^2)^2 has twice the sum of (E p^2)^2 on top.
        let freedom = 3.0 * second * second / fourth - 2.0;
        Self { independent: (runs * runs) as f64 / second, freedom }
    }

    /// Half of the 95 % interval of log(T / S); none without noise.
    fn log_width(self) -> Option<f64> {
        let width =
            student_975(self.freedom.max(1.0) as usize) * 2.0 / (self.independent / CLOSER - 1.0).max(1.0).sqrt();
        width.is_finite().then_some(width)
    }
}

/// Blocks of 1, 2 and 4 times the side are tried: noise of the cache may be as wide as that, and the widest counts.
const LEVELS: usize = 3;

/// Sums over 2x2 blocks; `grid` is columns and rows before and after.
fn four_to_one(blocks: &[[f64; KEPT * KEPT]], grid: &mut [usize; 2]) -> Vec<[f64; KEPT * KEPT]> {
    let columns = grid[0].div_ceil(2);
    let mut out = vec![[0.0; KEPT * KEPT]; columns * grid[1].div_ceil(2)];
    for (i, block) in blocks.iter().enumerate() {
        let sum = &mut out[i / grid[0] / 2 * columns + i % grid[0] / 2];
        for (sum, value) in sum.iter_mut().zip(block) {
            *sum += value;
        }
    }
    *grid = [columns, grid[1].div_ceil(2)];
    out
}

/// Side of the smallest blocks within which errors may go together [pixels]: smaller where the picture has few.
fn block_side(window: Window) -> usize {
    (((window.area() as f64).sqrt() / 8.0) as usize).clamp(4, BLOCK as usize)
}
