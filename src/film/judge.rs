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

use super::metrics::{Estimate, TRIMMED, student_975};
use super::self_error::{FEWEST_BLOCKS, FEWEST_FREEDOM, LEVELS, SelfError, State, block_side};
use super::{Film, Image, Window};
use crate::{Error, Result};
use serde::Serialize;

/// A reference picture with what is known of its noise.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The picture.
    pub image: Image,
    known: Option<Known>,
}

/// What a film knows of its noise.
#[derive(Clone, Debug)]
struct Known {
    halves: Halves,
    /// Half of the 95 % interval of log(noise).
    log_width: f64,
    /// The film when it had fewer passes.
    before: Option<State>,
}

/// Sums of even and odd passes, and the variance of single samples.
#[derive(Clone, Debug)]
struct Halves {
    state: State,
    single: Image,
}

impl Halves {
    fn of(film: &Film) -> Option<Self> {
        let state = State::of(film)?;
        let mut single = film.variance()?;
        single.pixels.iter_mut().for_each(|p| *p *= film.passes() as f32);
        Some(Self { state, single })
    }
}

/// The noise of a film that told no interval is known to this factor, as a logarithm.
const UNKNOWN_WIDTH: f64 = 1.0;

/// Told noise is not believed to better than this share.
const LEAST_WIDTH: f64 = 0.3;

/// Variance of the reference's samples at a pixel over that of the film's, beyond which the film is taken not to have met light
/// that the reference has. Samples of a low-discrepancy sequence spread more than their mean errs, so they count only then.
const UNMET: f64 = 4.0;

/// What announces a bias is this times its 95 % interval, 3 standard errors: several methods are judged at once.
const SURE: f64 = 1.5;

/// A pixel with more of the error than this leaves no verdict on the rest.
const MOST_OF_IT: f64 = 0.5;

/// Noise over error, at the least, of a film that is taken to have the reference's random numbers.
const NEARER: f64 = 10.0;

impl Truth {
    /// A picture that does not tell its noise.
    pub fn picture(image: Image) -> Self {
        Self { image, known: None }
    }

    /// A film; `error` has followed it, or is new.
    pub fn of_film(film: &Film, error: &mut SelfError) -> Self {
        let told = error.measure(film).and_then(|e| e.relmse).and_then(|e| e.interval);
        let log_width = told.map_or(UNKNOWN_WIDTH, |[low, high]| (high / low).ln() / 2.0);
        let known = Halves::of(film).map(|halves| {
            let before = error.before(&halves.state).cloned();
            Known { halves, log_width, before }
        });
        Self { image: film.image(), known }
    }

    /// Whether the noise of the reference is known: without, nothing tells it from a bias.
    pub fn tells_noise(&self) -> bool {
        self.known.is_some()
    }

    /// relMSE of its noise, over all pixels.
    pub fn noise(&self) -> Option<Estimate> {
        let known = self.known.as_ref()?;
        let pixels = self.finite(None);
        let weights = Weights::of(&self.image, &pixels)?;
        let value = self.noise_over(&pixels, &weights);
        let w = known.log_width;
        Some(Estimate { value, interval: Some([value * (-w).exp(), value * w.exp()]) })
    }

    fn noise_over(&self, pixels: &[usize], weights: &Weights<'_>) -> f64 {
        self.known.as_ref().map_or(0.0, |known| known.halves.state.noise(pixels, &|i, c| weights.at(i, c)))
    }

    fn finite(&self, set: Option<&[bool]>) -> Vec<usize> {
        (0..self.image.pixels.len())
            .filter(|&i| self.image.pixels[i].is_finite() && set.is_none_or(|set| set[i]))
            .collect()
    }
}

/// 1 / (r^2 + 0.01 mean(r)^2).
struct Weights<'a> {
    reference: &'a Image,
    floor: f64,
}

impl<'a> Weights<'a> {
    /// None where the reference is black.
    fn of(reference: &'a Image, pixels: &[usize]) -> Option<Self> {
        let floor = 0.01 * mean_over(pixels, |i, c| f64::from(reference.pixels[i][c])).powi(2);
        (floor > 0.0 && floor.is_finite()).then_some(Self { reference, floor })
    }

    fn at(&self, i: usize, c: usize) -> f64 {
        1.0 / (f64::from(self.reference.pixels[i][c]).powi(2) + self.floor)
    }
}

fn mean_over(pixels: &[usize], value: impl Fn(usize, usize) -> f64) -> f64 {
    pixels.iter().map(|&i| (0..3).map(|c| value(i, c)).sum::<f64>()).sum::<f64>() / (3 * pixels.len().max(1)) as f64
}

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
}

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

impl Truth {
    /// Refuses a reference of other pixels, and one that is black.
    ///
    /// # Errors
    /// Usage, with the two sizes.
    pub fn check(&self, film: &Film) -> Result<()> {
        super::metrics::same_size(&film.image(), &self.image)?;
        match Weights::of(&self.image, &self.finite(None)) {
            Some(_) => Ok(()),
            None => Err(Error::usage("the reference is black: no error is relative to it")),
        }
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
    super::metrics::same_size(&x, &truth.image)?;
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
fn noise_of_mean(
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

    /// Relative noise that all pixels share, film and reference together: its variance, and Student's factor.
    fn shared(&self, pixels: &[usize]) -> (f64, f64) {
        let level =
            |of: &dyn Fn(usize, usize) -> f64| mean_over(pixels, |i, c| self.weights.at(i, c).sqrt() * of(i, c));
        let Some(halves) = &self.halves else { return (0.0, 0.0) };
        let (own, freedom) = noise_of_mean(&halves.state, self.error.before(&halves.state), level);
        let known = self.truth.known.as_ref();
        let of_reference = known.map_or(0.0, |k| noise_of_mean(&k.halves.state, k.before.as_ref(), level).0);
        (own + of_reference, student_975(freedom as usize))
    }

    /// `noise` is that of film and reference together, `width` half of the interval of its logarithm.
    fn bias(&self, pixels: &[usize], noise: f64, width: f64, shared: (f64, f64)) -> Option<Bias> {
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
fn few_pixels_width(squares: &[(usize, f64)]) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rgb, hash};

    /// Uniform in -0.5..0.5.
    fn noise(seed: u64, pass: u32, i: usize) -> f32 {
        (hash(seed << 40 | u64::from(pass) << 20 | i as u64) >> 40) as f32 / 16_777_216.0 - 0.5
    }

    /// A film of `passes` whose samples are `sample(pass, pixel)`, and its error after each pass.
    fn film(passes: u32, sample: impl Fn(u32, usize) -> f32) -> (Film, SelfError) {
        let window = Window::full([64, 48]);
        let (mut film, mut error) = (Film::new([64, 48], window).unwrap(), SelfError::new());
        for pass in 0..passes {
            film.add(window, &(0..window.area()).map(|i| Rgb::splat(sample(pass, i))).collect::<Vec<_>>());
            film.end_pass();
            if pass % 8 == 7 || pass < 8 {
                error.measure(&film);
            }
        }
        (film, error)
    }

    fn truth(passes: u32, sample: impl Fn(u32, usize) -> f32) -> Truth {
        let (film, mut error) = film(passes, sample);
        Truth::of_film(&film, &mut error)
    }

    fn judged(one: &mut (Film, SelfError), truth: &Truth) -> Judgement {
        judge(&one.0, &mut one.1, truth, None).unwrap().unwrap()
    }

    /// 1.2 times its reference, both with noise of 50 % a sample: the square of 0.2 comes out, and only then.
    #[test]
    fn a_bias_is_told_from_noise() {
        let reference = truth(64, |pass, i| 1.0 + noise(1, pass, i));
        let bias = |level: f32| {
            let mut one = film(16, |pass, i| level * (1.0 + noise(2, pass, i)));
            judged(&mut one, &reference).trimmed.bias.unwrap()
        };
        let (none, some) = (bias(1.0), bias(1.2));
        assert!(!none.is_seen() && none.value.abs() <= none.half_width, "{none:?}");
        assert!(some.is_seen() && (some.value - 0.04 / 1.01).abs() <= some.half_width, "{some:?}");
        assert!(some.half_width < 0.01, "{some:?}");
    }

    /// A brightness that wanders from pass to pass is noise that all pixels share: no spread between blocks knows of it.
    #[test]
    fn noise_that_all_pixels_share_is_no_bias() {
        let reference = truth(64, |pass, i| 1.0 + noise(1, pass, i));
        for seed in 2..22 {
            let mut one = film(16, |pass, i| (1.0 + noise(seed, pass, 1 << 19)) * (1.0 + 0.1 * noise(seed, pass, i)));
            let judged = judged(&mut one, &reference).trimmed;
            assert!(!judged.bias.unwrap().is_seen(), "seed {seed}: {judged:?}");
        }
    }

    /// 40 pixels with one bright sample in 500: the reference has met them, the film not yet.
    #[test]
    fn light_that_was_not_met_is_no_bias() {
        let sample = |seed: u64| {
            move |pass: u32, i: usize| {
                let met = i.is_multiple_of(77) && noise(seed, pass, (1 << 18) + i) > 0.498;
                if met { 500.0 } else { 1.0 + 0.1 * noise(seed, pass, i) }
            }
        };
        let reference = truth(2048, sample(1));
        for seed in 2..12 {
            let judged = judged(&mut film(8, sample(seed)), &reference);
            assert!(!judged.trimmed.bias.unwrap().is_seen(), "seed {seed}: {:?}", judged.trimmed);
            assert!(!judged.all.bias.unwrap().is_seen(), "seed {seed}: {:?}", judged.all);
        }
    }

    #[test]
    fn a_speck_is_told_by_its_pixel_and_left_out() {
        let reference = truth(64, |pass, i| 1.0 + noise(1, pass, i));
        let mut one = film(16, |pass, i| if (pass, i) == (5, 3 * 64 + 10) { 3000.0 } else { 1.0 + noise(2, pass, i) });
        let judged = judged(&mut one, &reference);
        assert!(judged.all.hangs_on_one_pixel() && judged.all.worst_pixel == [10, 3], "{:?}", judged.all);
        assert!(!judged.trimmed.hangs_on_one_pixel() && judged.trimmed.pixels == 64 * 48 - 3);
        let [low, high] = judged.trimmed.error().interval.unwrap();
        // (1 / 12) / 16 over 1.01, the noise of the reference taken off, a little less for what is left out.
        assert!((low..high).contains(&(1.0 / 12.0 / 16.0 / 1.01)), "{low} {high}");
        let [low, high] = judged.all.error().interval.unwrap();
        assert!(high / low > 100.0, "one pixel says nothing of the next render: {low} {high}");
    }

    /// A speck in the reference makes that pixel and the mean bright, for the error and the noise alike.
    #[test]
    fn a_speck_in_the_reference_is_no_bias() {
        let reference = truth(64, |pass, i| if (pass, i) == (5, 300) { 1e5 } else { 1.0 + noise(1, pass, i) });
        let mut one = film(16, |pass, i| 1.0 + noise(2, pass, i));
        let judged = judged(&mut one, &reference);
        assert!(!judged.all.bias.unwrap().is_seen() && !judged.trimmed.bias.unwrap().is_seen(), "{judged:?}");
    }

    #[test]
    fn a_copy_is_known_and_a_picture_tells_no_noise() {
        let sample = |pass, i| 1.0 + noise(1, pass, i);
        let (mut copy, mut other) = (film(16, sample), film(16, |pass, i| 1.0 + noise(2, pass, i)));
        let exact = Truth::picture(copy.0.image());
        assert!(!exact.tells_noise() && exact.noise().is_none());
        assert!(judged(&mut copy, &exact).shares_numbers() && !judged(&mut other, &exact).shares_numbers());
        // As noisy as what it judges: no error is told.
        let same = Truth::of_film(&copy.0, &mut copy.1);
        assert!(same.tells_noise() && judged(&mut copy, &same).shares_numbers());
        let noisy = truth(4, |pass, i| 1.0 + noise(3, pass, i));
        let mut clean = film(16, |pass, i| 1.0 + 1e-3 * noise(4, pass, i));
        assert!(!judged(&mut clean, &noisy).trimmed.is_told());
        let black = Truth::picture(Image::from_fn([64, 48], |_, _| Rgb::BLACK));
        assert!(black.check(&other.0).is_err() && judge(&other.0, &mut other.1, &black, None).unwrap().is_none());
    }

    /// Brightness that wanders by 29 % a pass: the interval of 16 passes is to hold 1 in 95 % of seeds.
    #[test]
    fn brightness_has_an_interval_that_holds() {
        let exact = Truth::picture(Image::from_fn([64, 48], |_, _| Rgb::splat(1.0)));
        let held = (1..=100).filter(|&seed| {
            let (film, error) = film(16, |pass, _| 1.0 + noise(seed, pass, 1 << 19));
            let [low, high] = brightness(&film, &error, &exact, None).unwrap().mean.unwrap().interval.unwrap();
            assert!(high - low < 1.0, "{low} {high}");
            low <= 1.0 && 1.0 <= high
        });
        // 95 of 100, 4 standard errors of 2.2 below.
        let held = held.count();
        assert!(held >= 87, "{held}");
    }
}
