//! Normalised diffusion.

use super::radial::{Channel, Channels, Columns, DistanceOnly, Formula, columns, finite, left};
use super::{Claims, ModelKind, ModelName, ModelOption};
use crate::error::{Error, Result};
use crate::math::{Rgb, exp2};
use crate::optics::{FresnelMoments, Medium, standard_total};
use std::f64::consts::{LOG2_E, PI};

/// Which of the three published fits gives the width d = l / s(A).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WidthFit {
    /// Normal incidence, l the mean free path: s = 1.85 - A + 7 |A - 0.8|³.
    Searchlight,
    /// Diffuse incidence, l the mean free path: s = 1.9 - A + 3.5 (A - 0.8)².
    Diffuse,
    /// Diffuse incidence, l the diffusion length 1/σ_tr: s = 3.5 + 100 (A - 0.33)⁴.
    DiffusionLength,
}

impl WidthFit {
    /// All fits.
    pub const ALL: [Self; 3] = [Self::Searchlight, Self::Diffuse, Self::DiffusionLength];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Searchlight => "searchlight",
            Self::Diffuse => "diffuse",
            Self::DiffusionLength => "dmfp",
        }
    }

    /// s(A) for an albedo in [0, 1].
    pub fn s(self, albedo: f64) -> f64 {
        match self {
            Self::Searchlight => 1.85 - albedo + 7.0 * (albedo - 0.8).abs().powi(3),
            Self::Diffuse => 1.9 - albedo + 3.5 * (albedo - 0.8).powi(2),
            Self::DiffusionLength => 3.5 + 100.0 * (albedo - 0.33).powi(4),
        }
    }
}

impl std::str::FromStr for WidthFit {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|fit| fit.name() == name).ok_or_else(|| {
            let hint = crate::error::did_you_mean(name, Self::ALL.map(Self::name));
            Error::usage(format!("no fit `{name}`{hint}; there are searchlight, diffuse, dmfp"))
        })
    }
}

pub(super) static MODEL: ModelKind = ModelKind {
    takes: &[ModelOption::Width, ModelOption::Boundary],
    evidence: |_| Some("normalised"),
    ..ModelKind::new("normalised", |medium, options| {
        Ok(Box::new(NormalisedDiffusion::behind(medium, &options.moments(medium), options.exit_normalisation)))
    })
};

/// Normalised diffusion \[CB15\]: two exponentials fitted to Monte Carlo profiles, with the integral A built in.
///
///   R_d(r) = A (exp(-r/d) + exp(-r/3d)) / (8π d r),   CDF(r) = 1 - exp(-r/d)/4 - 3 exp(-r/3d)/4
///
/// S_d = R_d / π, over 4 C_phi(1/η) with exit normalisation [1/(unit² sr)]. All orders of scattering. Reciprocal.
/// Fitted without a boundary: at η = 1 within 3 % of the truth, at 1.3 with the diffusion length 16 %, with the mean
/// free path 35 %. R_d grows as 1/r towards 0; below 1e-9 d it is constant, at its
/// mean over that disk, so that the total is A all the same.
pub struct NormalisedDiffusion {
    channels: Channels<Width>,
    /// d [unit].
    widths: [f64; 3],
}

/// The diffusion length is taken as at most so many transport mean free paths: that of a conservative medium is
/// infinite, its profile is not.
const LONGEST_DIFFUSION: f64 = 40.0;
/// R_d is constant below this part of d.
const CORE: f32 = 1e-9;

/// One channel.
#[derive(Clone, Copy, Debug)]
pub struct Width {
    /// log2 e / 3d [1/unit].
    decay_log2: f32,
    /// [`CORE`] d [unit].
    core: f32,
    /// A / 8π d, over π and the exit normalisation [1/(unit sr)].
    scale: f32,
}

impl NormalisedDiffusion {
    /// From a medium: A is the standard dipole's total, l the diffusion length (at most 40 transport mean free
    /// paths): the variant nearest to transport behind a boundary. See [`super::ModelOptions`].
    pub fn new(medium: &Medium, exit_normalisation: bool) -> Self {
        Self::behind(medium, &FresnelMoments::new(f64::from(medium.eta)), exit_normalisation)
    }

    /// The same behind a boundary of these moments.
    pub fn behind(medium: &Medium, moments: &FresnelMoments, exit_normalisation: bool) -> Self {
        let fit = WidthFit::DiffusionLength;
        let channels = medium.channels().map(|k| {
            let albedo = standard_total(&k, moments);
            let length = (1.0 / k.relative_decay()).min(LONGEST_DIFFUSION) / k.sigma_t_prime;
            (albedo, length / fit.s(albedo))
        });
        Self::from_widths(channels, moments, exit_normalisation)
    }

    /// From the albedo A in [0, 1] and the length l \[unit\] that `fit` expects, behind a boundary `eta`.
    ///
    /// # Errors
    /// An albedo outside [0, 1], a length or an `eta` that is not positive and finite.
    pub fn from_albedo(fit: WidthFit, albedo: Rgb, length: Rgb, eta: f32, exit_normalisation: bool) -> Result<Self> {
        if !(eta > 0.0 && eta.is_finite()) {
            return Err(Error::scene(format!("eta = {eta}: n_inside / n_outside must be positive and finite")));
        }
        for c in 0..3 {
            if !(0.0..=1.0).contains(&albedo[c]) {
                return Err(Error::scene(format!("albedo {}: it lies in 0..1", albedo[c])));
            }
            if !(length[c] > 0.0 && length[c].is_finite()) {
                return Err(Error::scene(format!("length {}: it must be positive and finite", length[c])));
            }
        }
        let channels = std::array::from_fn(|c| {
            let a = f64::from(albedo[c]);
            (a, f64::from(length[c]) / fit.s(a))
        });
        Ok(Self::from_widths(channels, &FresnelMoments::new(f64::from(eta)), exit_normalisation))
    }

    /// From (A, d \[unit\]) per channel; an infinite d stands for no medium.
    fn from_widths(channels: [(f64, f64); 3], moments: &FresnelMoments, exit_normalisation: bool) -> Self {
        let exit = if exit_normalisation { moments.four_c_phi_outside } else { 1.0 };
        let each = channels.map(|(albedo, d)| {
            if !d.is_finite() {
                return Width { decay_log2: 0.0, core: 1.0, scale: 0.0 };
            }
            let scale = finite(albedo / (8.0 * PI * PI * exit * d));
            // Neither 0 nor so small that the value at the core leaves f32.
            let core = (d as f32 * CORE).max(f32::MIN_POSITIVE).max(scale * 1e-37);
            Width { decay_log2: finite(LOG2_E / (3.0 * d)), core, scale }
        });
        let [r, g, b] = channels;
        Self {
            channels: Channels {
                each,
                columns: Widths::of(each),
                grey: r == g && g == b,
                decay: channels.iter().map(|(_, d)| finite(1.0 / (3.0 * d))).fold(f32::INFINITY, f32::min),
                total: Rgb(channels.map(|(albedo, _)| albedo as f32)),
                exitance: (PI * exit) as f32,
            },
            widths: channels.map(|(_, d)| d),
        }
    }

    /// The width d \[unit\] of `channel`; infinite where there is no medium.
    pub fn width(&self, channel: usize) -> f64 {
        self.widths[channel]
    }

    /// The part of the exitance of `channel` within `r` \[unit\].
    pub fn cdf(&self, channel: usize, r: f64) -> f64 {
        let x = r / self.widths[channel];
        -0.25 * (-x).exp_m1() - 0.75 * (-x / 3.0).exp_m1()
    }

    /// The radius \[unit\] within which the part `u` in [0, 1) of the exitance of `channel` lies: a sample of the radius
    /// if `u` is uniform. In closed form: with y the real root of y³ + 3y = 4(1 - u), r = -3 d ln y.
    pub fn sample_radius(&self, channel: usize, u: f64) -> f64 {
        let d = self.widths[channel];
        if u <= 0.0 {
            return 0.0;
        }
        let rest = 1.0 - u.clamp(0.0, 1.0 - f64::EPSILON);
        // y = 2 sinh(asinh(2 rest) / 3): Cardano without the difference of two cube roots.
        let x = -3.0 * (2.0 * ((2.0 * rest).asinh() / 3.0).sinh()).ln();
        // Small radii lose digits in the logarithm of a number near 1: one Newton step gives them back.
        let x = if u < 0.25 {
            let excess = -0.25 * (-x).exp_m1() - 0.75 * (-x / 3.0).exp_m1() - u;
            x - excess / (0.25 * ((-x).exp() + (-x / 3.0).exp()))
        } else {
            x
        };
        d * x.max(0.0)
    }

    /// Density per area [1/unit²] of the points that [`Self::sample_radius`] and a uniform angle give.
    pub fn pdf_area(&self, channel: usize, r: f64) -> f64 {
        let d = self.widths[channel];
        let x = r / d;
        ((-x).exp() + (-x / 3.0).exp()) / (8.0 * PI * d * r)
    }
}

columns!(Width, Widths { decay_log2, core, scale });

impl Channel for Width {
    type Columns = Widths;
}

impl Formula for Width {
    #[inline(always)]
    fn eval<const COMPENSATED: bool>(self, r2: f32, rate: f32) -> f32 {
        let (r, over_r) = self.outside_core(r2);
        // exp(-r/6d): its square may leave the range of f32 where the product with the scale does not.
        let root = exp2(-(0.5 * self.decay_log2 * r));
        let y = root * root;
        let mut gained = root;
        if COMPENSATED {
            // exp(rate r) (y + y³) with the gain in the exponent.
            gained = exp2(-(0.5 * left(self.decay_log2, rate * std::f32::consts::LOG2_E) * r));
        }
        self.scale * over_r * (1.0 + y * y) * gained * gained
    }
}

impl Width {
    /// r for the exponentials and what stands for 1/r: within the core c its mean over the disk, ∫ 2πr/r dr / πc² = 2/c.
    #[inline(always)]
    fn outside_core(self, r2: f32) -> (f32, f32) {
        let r = r2.sqrt();
        let r = if r < 1e18 { r } else { 1e18 };
        let (inside, nearest) = (r < self.core, if r > self.core { r } else { self.core });
        (r, if inside { 2.0 } else { 1.0 } / nearest)
    }
}

impl DistanceOnly for NormalisedDiffusion {
    type Channel = Width;
    const NAME: ModelName = ModelName::NORMALISED;
    const CLAIMS: Claims = Claims { unscattered: true, first_order: true, reciprocal: true, bounded_energy: true };

    fn channels(&self) -> &Channels<Width> {
        &self.channels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_invert_the_distribution_and_follow_the_density() {
        let one = Rgb::splat(1.0);
        for fit in [WidthFit::Searchlight, WidthFit::Diffuse, WidthFit::DiffusionLength] {
            let model = NormalisedDiffusion::from_albedo(fit, one * 0.7, one * 2.0, 1.3, true).unwrap();
            for i in 0..1000 {
                let u = f64::from(i) / 1000.0;
                let r = model.sample_radius(0, u);
                assert!((model.cdf(0, r) - u).abs() < 1e-12, "{fit:?} {u}");
                let h = 1e-5 * r.max(1e-3);
                let slope = (model.cdf(0, r + h) - model.cdf(0, r)) / h;
                let middle = r + 0.5 * h;
                assert!((2.0 * PI * middle * model.pdf_area(0, middle) / slope - 1.0).abs() < 1e-5, "{fit:?} {u}");
            }
            for u in [1e-12, 1e-6, 1.0 - 1e-12] {
                assert!((model.cdf(0, model.sample_radius(0, u)) - u).abs() < 1e-15, "{fit:?} {u}");
            }
            assert_eq!(model.sample_radius(0, 0.0), 0.0);
            assert!(model.sample_radius(0, 1.0).is_finite());
        }
    }

    #[test]
    fn numbers_that_are_no_albedo_are_refused() {
        let one = Rgb::splat(1.0);
        let make = |a, l, eta| NormalisedDiffusion::from_albedo(WidthFit::Diffuse, a, l, eta, true);
        assert!(make(one * 1.1, one, 1.3).is_err());
        assert!(make(one * f32::NAN, one, 1.3).is_err());
        assert!(make(one, one * 0.0, 1.3).is_err());
        assert!(make(one, one, 0.0).is_err());
    }
}
