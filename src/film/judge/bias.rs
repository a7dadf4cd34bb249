//! The part of an error that does not go away with samples, and how uncertain that is.

use super::super::Window;
use super::super::metrics::student_975;
use super::super::self_error::{FEWEST_BLOCKS, FEWEST_FREEDOM, LEVELS, block_side};
use super::Judging;
use super::brightness::noise_of_mean;
use super::truth::{Halves, mean_over};
use serde::Serialize;

/// The square of the relative bias.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bias {
    /// relMSE that does not go away with samples; by chance it may be below 0.
    pub value: f64,
    /// Half of its 95 % interval.
    pub half_width: f64,
}

impl Bias {
    /// Whether it is told from none: by half more than the 95 % interval asks for, since several are judged at once.
    pub fn is_seen(&self) -> bool {
        self.value > SURE * self.half_width
    }

    /// Ends of the 95 % interval, from 0 on.
    pub fn interval(&self) -> [f64; 2] {
        [self.value - self.half_width, self.value + self.half_width].map(|v| v.max(0.0))
    }

    /// What a table says of one that is not seen.
    pub fn at_most(&self) -> String {
        match self.interval()[1] {
            most if most > 0.0 => format!("below {most:.0e}"),
            _ => "none told".into(),
        }
    }
}

/// Variance of the reference's samples at a pixel over that of the film's, beyond which the film is taken not to have met light
/// that the reference has. Samples of a low-discrepancy sequence spread more than their mean errs, so they count only then.
const UNMET: f64 = 4.0;

/// What announces a bias is this times its 95 % interval, 3 standard errors: several methods are judged at once.
const SURE: f64 = 1.5;

impl Judging<'_> {
    /// Relative noise that all pixels share, film and reference together: its variance, and Student's factor.
    pub(super) fn shared(&self, pixels: &[usize]) -> (f64, f64) {
        let level =
            |of: &dyn Fn(usize, usize) -> f64| mean_over(pixels, |i, c| self.weights.at(i, c).sqrt() * of(i, c));
        let Some(halves) = &self.halves else { return (0.0, 0.0) };
        let (own, freedom) = noise_of_mean(&halves.state, self.error.before(&halves.state), level);
        let known = self.truth.known.as_ref();
        let of_reference = known.map_or(0.0, |k| noise_of_mean(&k.halves.state, k.before.as_ref(), level).0);
        (own + of_reference, student_975(freedom as usize))
    }

    /// `noise` is that of film and reference together, `width` half of the interval of its logarithm.
    pub(super) fn bias(&self, pixels: &[usize], noise: f64, width: f64, shared: (f64, f64)) -> Option<Bias> {
        let halves = self.halves.as_ref()?;
        let known = self.truth.known.as_ref().map(|k| &k.halves);
        let (mut products, mut single) = (0.0, 0.0);
        let mut likewise = |i: usize| {
            let (mut sum, mut deviation) = (0.0, 0.0);
            for c in 0..3 {
                let w = self.weights.at(i, c);
                let reference =
                    |half| known.map_or(f64::from(self.truth.image.pixels[i][c]), |k| k.state.half(half, i, c));
                let [e, o] = [0, 1].map(|half| halves.state.half(half, i, c) - reference(half));
                products += w * e * o;
                sum += w * (e * e - o * o) / 2.0;
                let variance = |h: &Halves| f64::from(h.single.pixels[i][c]);
                // Samples spread far more in the reference: it has met what the film has not.
                let own = known.map_or(0.0, variance);
                let own = if own > UNMET * variance(halves) { own } else { 0.0 };
                let passes = |h: &Halves, half: usize| f64::from(h.state.passes[half]);
                let of_half = |half| own / passes(halves, half) + known.map_or(0.0, |k| own / passes(k, half));
                deviation += w * (of_half(0) * of_half(1)).sqrt();
            }
            single += deviation * deviation;
            (i, sum)
        };
        let likewise: Vec<(usize, f64)> = pixels.iter().map(|&i| likewise(i)).collect();
        let n = (3 * pixels.len()) as f64;
        let value = products / n;
        let square = value.max(0.0);
        let (v, student) = shared;
        let widths = [
            between_blocks(self.film.window(), &likewise) / n,
            2.0 * single.sqrt() / n,
            (noise * (width.exp() - 1.0)).hypot(width.min(1.0) * (square * noise).sqrt()),
            2.0 * v * student * student + 2.0 * student * (v * square).sqrt(),
        ];
        Some(Bias { value, half_width: widths.into_iter().fold(0.0, f64::max) })
    }
}

/// Half of the 95 % interval of the logarithm of a sum of squares that few pixels carry: the standard error of a sum of
/// independent terms of which each may as well not be there.
pub(super) fn few_pixels_width(squares: &[(usize, f64)]) -> f64 {
    let (sum, squared) = squares.iter().fold((0.0, 0.0), |(a, b), s| (a + s.1, b + s.1 * s.1));
    if sum <= 0.0 {
        return 0.0;
    }
    let share = squared / (sum * sum);
    student_975((1.0 / share).max(FEWEST_FREEDOM) as usize) * share.sqrt()
}

/// Half of the 95 % interval of a sum over pixels whose terms have no mean, from its sums over blocks of up to three sizes: the
/// widest, since noise of a cache may be as wide as that.
fn between_blocks(window: Window, values: &[(usize, f64)]) -> f64 {
    let mut side = block_side(window);
    let mut widest = 0.0_f64;
    for level in 0..LEVELS {
        let columns = window.width().div_ceil(side);
        let mut blocks = vec![0.0; columns * window.height().div_ceil(side)];
        if level > 0 && blocks.len() < FEWEST_BLOCKS {
            break;
        }
        for &(i, value) in values {
            blocks[i / window.width() / side * columns + i % window.width() / side] += value;
        }
        let squares = blocks.iter().map(|b| b * b);
        let (second, fourth) = squares.fold((0.0, 0.0), |(sum, fourth), s| (sum + s, fourth + s * s));
        if second > 0.0 {
            let freedom = (3.0 * second * second / fourth - 2.0).max(FEWEST_FREEDOM);
            widest = widest.max(student_975(freedom as usize) * second.sqrt());
        }
        side *= 2;
    }
    widest
}
