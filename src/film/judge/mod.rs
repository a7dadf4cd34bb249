//! How far a film is from a reference, for verdicts: each figure with a 95 % interval, over all pixels and without the
//! worst 0.1 %.
//!
//! The weights w = 1 / (r^2 + 0.01 mean(r)^2) come from the reference alone, for the error, its noise and its bias alike: a
//! bright speck of the film cannot make its own error small. With the halves e, o of the film and re, ro of the reference,
//!
//!   measured = mean(w (x - r)^2)    noise = mean(w (x - limit)^2), see `self_error.rs`    bias = mean(w (e - re) (o - ro)),
//!
//! the last without noise in its expectation. w ((e - re)^2 - (o - ro)^2) / 2 has no mean and, for equal halves, the variance of
//! that product, bias or none: its sums over blocks tell how uncertain the bias is. The interval is the widest of this and three
//! others, because each knows what the others do not: what the told noise allows; noise that all pixels share; and what the
//! spread of single samples allows in the reference, where it has met what the film has not.

mod bias;
mod brightness;
#[cfg(test)]
mod tests;
mod truth;

pub use bias::Bias;
pub use brightness::{Brightness, brightness};
pub use truth::Truth;

use super::Film;
use super::metrics::{Estimate, TRIMMED};
use super::self_error::SelfError;
use crate::Result;
use bias::few_pixels_width;
use serde::Serialize;
use truth::{Halves, Weights};

/// Told noise is not believed to better than this share.
const LEAST_WIDTH: f64 = 0.3;

/// A pixel with more of the error than this leaves no verdict on the rest.
const MOST_OF_IT: f64 = 0.5;

/// Noise over error, at the least, of a film that is taken to have the reference's random numbers.
const NEARER: f64 = 10.0;

/// Errors over some pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// How many.
    pub pixels: usize,
    /// relMSE against the reference as it is, the reference's own noise in it.
    pub measured: f64,
    /// The noise of the reference; 0 where it tells none.
    pub reference_noise: f64,
    /// Half of the 95 % interval of its logarithm.
    pub reference_width: f64,
    /// The film's own noise, told by its halves; none before each half has a pass.
    pub noise: Option<f64>,
    /// Half of the 95 % interval of log(error): of the noise, or of the few pixels that carry the error, whichever is wider.
    pub width: Option<f64>,
    /// None before the noise has an interval.
    pub bias: Option<Bias>,
    /// Share of the measured error in the worst pixel.
    pub worst_share: f64,
    /// Which that is.
    pub worst_pixel: [u32; 2],
}

/// The same film over all pixels and without the worst.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Judgement {
    /// All pixels.
    pub all: Judged,
    /// Without the 0.1 % with the largest error.
    pub trimmed: Judged,
}

impl Judged {
    /// relMSE against what the reference stands for: the noise of the reference is independent, so it is taken off. The lower
    /// end of the interval is 0 where the error is not told from that noise; there is none before the noise has one.
    pub fn error(&self) -> Estimate {
        let noise = self.reference_noise;
        let value = (self.measured - noise).max(0.0);
        let interval = self.width.map(|w| {
            let of_reference = noise * (self.reference_width.exp() - 1.0) + w.min(1.0) * (value * noise).sqrt();
            let below = (value * (1.0 - (-w).exp())).hypot(of_reference);
            let above = (value * (w.exp() - 1.0)).hypot(of_reference);
            // What is left of equal numbers is rounding.
            let low = if value - below > 1e-9 * value { value - below } else { 0.0 };
            [low, value + above]
        });
        Estimate { value, interval }
    }

    /// Whether the error is told from the noise of the reference.
    pub fn is_told(&self) -> bool {
        let error = self.error();
        let low = error.interval.map_or(error.value - 0.3 * self.reference_noise, |[low, _]| low);
        error.value > 0.0 && low > 0.0
    }

    /// Whether one pixel carries most of the error.
    pub fn hangs_on_one_pixel(&self) -> bool {
        self.worst_share > MOST_OF_IT
    }

    /// Whether the film is much nearer to the reference than its own noise lets an independent one be. To be asked over all
    /// pixels: trimming takes more off the error than off the noise.
    fn shares_numbers(&self) -> bool {
        let noise = self.noise.unwrap_or(0.0) + self.reference_noise;
        self.width.is_some_and(|w| self.measured * (2.0 * w).exp().max(NEARER) < noise)
    }
}

impl Judgement {
    /// Whether the film is much nearer to the reference than its own noise lets an independent one be.
    pub fn shares_numbers(&self) -> bool {
        self.all.shares_numbers()
    }
}

/// Judges `film`, which `error` has followed, over the pixels of `set`, or all. None where the set has no finite pixel or the
/// reference is black there.
///
/// # Errors
/// Usage if the sizes differ.
pub fn judge(film: &Film, error: &mut SelfError, truth: &Truth, set: Option<&[bool]>) -> Result<Option<Judgement>> {
    let (x, r) = (film.image(), &truth.image);
    super::metrics::same_size(&x, r)?;
    let pixels: Vec<usize> = truth.finite(set).into_iter().filter(|&i| x.pixels[i].is_finite()).collect();
    let Some(weights) = Weights::of(r, &pixels) else { return Ok(None) };
    error.measure(film);
    let square = |i: usize| {
        let one = |c: usize| weights.at(i, c) * (f64::from(x.pixels[i][c]) - f64::from(r.pixels[i][c])).powi(2);
        (0..3).map(one).sum::<f64>()
    };
    let mut squares: Vec<(usize, f64)> = pixels.iter().map(|&i| (i, square(i))).collect();
    let judged = Judging { film, error, truth, weights, halves: Halves::of(film) };
    let all = judged.over(&squares);
    let kept = squares.len() - (TRIMMED * squares.len() as f64) as usize;
    if kept == squares.len() {
        return Ok(Some(Judgement { all, trimmed: all }));
    }
    // Equal values go by pixel, so that the choice is always the same.
    squares.select_nth_unstable_by(kept, |a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    squares.truncate(kept);
    squares.sort_unstable_by_key(|&(i, _)| i);
    Ok(Some(Judgement { all, trimmed: judged.over(&squares) }))
}

struct Judging<'a> {
    film: &'a Film,
    error: &'a SelfError,
    truth: &'a Truth,
    weights: Weights<'a>,
    halves: Option<Halves>,
}

impl Judging<'_> {
    /// From pixels in ascending order, with the squared error of each.
    fn over(&self, squares: &[(usize, f64)]) -> Judged {
        let window = self.film.window();
        let pixels: Vec<usize> = squares.iter().map(|s| s.0).collect();
        let sum: f64 = squares.iter().map(|s| s.1).sum();
        let worst = squares.iter().fold((0, 0.0), |worst, s| if s.1 > worst.1 { *s } else { worst });
        let weight = |i: usize, c: usize| self.weights.at(i, c);
        let noise = self.halves.as_ref().map(|h| self.error.estimate(window, &h.state, &pixels, &weight));
        let width = noise.and_then(|n| n.interval).map(|[low, high]| (high / low).ln() / 2.0);
        // The picture without noise tells no width; then nothing is uncertain but what few pixels carry.
        let width = width.or(noise.filter(|n| n.value == 0.0 && self.film.passes() >= 4).map(|_| 0.0));
        let reference_noise = self.truth.noise_over(&pixels, &self.weights);
        let reference_width = self.truth.known.as_ref().map_or(0.0, |k| k.log_width);
        let shared = self.shared(&pixels);
        // Of the noise v is one error: with k of them log(error) is known to 2 / sqrt(k), and 1 / k is (v / noise)^2 at least.
        let by_shared =
            noise.map_or(0.0, |n| if n.value > 0.0 { 2.0 * shared.1 * (shared.0 / n.value).min(1.0) } else { 0.0 });
        Judged {
            pixels: pixels.len(),
            measured: sum / (3 * pixels.len()) as f64,
            reference_noise,
            reference_width,
            noise: noise.map(|n| n.value),
            width: width.map(|w| w.max(few_pixels_width(squares)).max(by_shared)),
            bias: noise.zip(width).and_then(|(n, w)| {
                let widest = w.max(reference_width).max(LEAST_WIDTH);
                self.bias(&pixels, n.value + reference_noise, widest, shared)
            }),
            worst_share: if sum > 0.0 { worst.1 / sum } else { 0.0 },
            worst_pixel: window.pixel(worst.0),
        }
    }
}
