//! A reference with what is known of its noise, and the weights that it gives.

use super::super::metrics::{self, Estimate};
use super::super::self_error::{SelfError, State};
use super::super::{Film, Image};
use crate::{Error, Result};

/// A reference picture with what is known of its noise.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The picture.
    pub image: Image,
    pub(super) known: Option<Known>,
}

/// What a film knows of its noise.
#[derive(Clone, Debug)]
pub(super) struct Known {
    pub(super) halves: Halves,
    /// Half of the 95 % interval of log(noise).
    pub(super) log_width: f64,
    /// The film when it had fewer passes.
    pub(super) before: Option<State>,
}

/// Sums of even and odd passes, and the variance of single samples.
#[derive(Clone, Debug)]
pub(super) struct Halves {
    pub(super) state: State,
    pub(super) single: Image,
}

impl Halves {
    pub(super) fn of(film: &Film) -> Option<Self> {
        let state = State::of(film)?;
        let mut single = film.variance()?;
        single.pixels.iter_mut().for_each(|p| *p *= film.passes() as f32);
        Some(Self { state, single })
    }
}

/// The noise of a film that told no interval is known to this factor, as a logarithm.
const UNKNOWN_WIDTH: f64 = 1.0;

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

    pub(super) fn noise_over(&self, pixels: &[usize], weights: &Weights<'_>) -> f64 {
        self.known.as_ref().map_or(0.0, |known| known.halves.state.noise(pixels, &|i, c| weights.at(i, c)))
    }

    pub(super) fn finite(&self, set: Option<&[bool]>) -> Vec<usize> {
        (0..self.image.pixels.len())
            .filter(|&i| self.image.pixels[i].is_finite() && set.is_none_or(|set| set[i]))
            .collect()
    }

    /// Refuses a reference of other pixels, and one that is black.
    ///
    /// # Errors
    /// Usage, with the two sizes.
    pub fn check(&self, film: &Film) -> Result<()> {
        metrics::same_size(&film.image(), &self.image)?;
        match Weights::of(&self.image, &self.finite(None)) {
            Some(_) => Ok(()),
            None => Err(Error::usage("the reference is black: no error is relative to it")),
        }
    }
}

/// 1 / (r^2 + 0.01 mean(r)^2).
pub(super) struct Weights<'a> {
    reference: &'a Image,
    floor: f64,
}

impl<'a> Weights<'a> {
    /// None where the reference is black.
    pub(super) fn of(reference: &'a Image, pixels: &[usize]) -> Option<Self> {
        let floor = 0.01 * mean_over(pixels, |i, c| f64::from(reference.pixels[i][c])).powi(2);
        (floor > 0.0 && floor.is_finite()).then_some(Self { reference, floor })
    }

    pub(super) fn at(&self, i: usize, c: usize) -> f64 {
        1.0 / (f64::from(self.reference.pixels[i][c]).powi(2) + self.floor)
    }
}

pub(super) fn mean_over(pixels: &[usize], value: impl Fn(usize, usize) -> f64) -> f64 {
    pixels.iter().map(|&i| (0..3).map(|c| value(i, c)).sum::<f64>()).sum::<f64>() / (3 * pixels.len().max(1)) as f64
}
