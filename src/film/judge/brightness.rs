//! How bright a film is against a reference.

use super::super::Film;
use super::super::metrics::{Estimate, same_size, student_975};
use super::super::self_error::{SelfError, State};
use super::truth::Truth;
use crate::Result;
use serde::Serialize;

/// mean(x) / mean(r) of a film and its reference over the pixels of `set`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Brightness {
    /// R, G, B; none where the reference is black.
    pub channels: [Option<f64>; 3],
    /// Mean of the channels, with the interval that the noise of both makes.
    pub mean: Option<Estimate>,
}

/// How bright `film`, which `error` has followed, is against the reference. The halves of a film and of its earlier passes
/// differ by pure noise: three independent differences tell how uncertain a mean over many pixels is, shared noise included.
///
/// # Errors
/// Usage if the sizes differ.
pub fn brightness(film: &Film, error: &SelfError, truth: &Truth, set: Option<&[bool]>) -> Result<Brightness> {
    let x = film.image();
    same_size(&x, &truth.image)?;
    let pixels: Vec<usize> = truth.finite(set).into_iter().filter(|&i| x.pixels[i].is_finite()).collect();
    let sum = |value: &dyn Fn(usize) -> f64| pixels.iter().map(|&i| value(i)).sum::<f64>();
    let below: [f64; 3] = std::array::from_fn(|c| sum(&|i| f64::from(truth.image.pixels[i][c])));
    let channel = |c: usize| (below[c] > 0.0).then(|| sum(&|i| f64::from(x.pixels[i][c])) / below[c]);
    let channels = [0, 1, 2].map(channel);
    let lit: Vec<usize> = (0..3).filter(|&c| channels[c].is_some()).collect();
    // A linear function of a picture that is the mean of the ratios for x, and 1 for r.
    let level = |of: &dyn Fn(usize, usize) -> f64| {
        lit.iter().map(|&c| sum(&|i| of(i, c)) / below[c]).sum::<f64>() / lit.len() as f64
    };
    let value = level(&|i, c| f64::from(x.pixels[i][c]));
    let own = State::of(film).map(|now| noise_of_mean(&now, error.before(&now), level));
    let reference = truth.known.as_ref().map(|k| noise_of_mean(&k.halves.state, k.before.as_ref(), level));
    let interval = own.map(|(own, freedom)| {
        let (of_r, freedom_r) = reference.map_or((0.0, 1.0), |(v, f)| (v * value * value, f));
        let all = own + of_r;
        // [Wel47]
        let freedom = if all > 0.0 { all * all / (own * own / freedom + of_r * of_r / freedom_r) } else { 1.0 };
        let half = student_975(freedom as usize) * all.sqrt();
        [value - half, value + half]
    });
    Ok(Brightness { channels, mean: (!lit.is_empty()).then_some(Estimate { value, interval }) })
}

/// Variance of a linear function of the whole film's mean, and its degrees of freedom.
pub(super) fn noise_of_mean(
    now: &State,
    before: Option<&State>,
    level: impl Fn(&dyn Fn(usize, usize) -> f64) -> f64,
) -> (f64, f64) {
    let halves = now.scale() * level(&|i, c| now.half(0, i, c) - now.half(1, i, c)).powi(2);
    let Some(before) = before else { return (halves, 1.0) };
    let of_half = |half: usize| {
        let (n, later) = (f64::from(before.passes[half]), f64::from(now.passes[half] - before.passes[half]));
        let contrast = level(&|i, c| before.contrast(now, half, i)[c]);
        contrast * contrast * n * later / (n + later) / f64::from(now.total())
    };
    ((halves + of_half(0) + of_half(1)) / 3.0, 3.0)
}
