//! Where diffusion theory holds: the numbers of a medium that decide which models may be trusted.

use super::Medium;
use std::fmt;

/// One channel of a medium, lengths in the unit of the coefficients it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelOptics {
    /// Reduced albedo σ_s′ / σ_t′; 0 where there is no medium.
    pub alpha_prime: f64,
    /// 1 - α′ = σ_a / σ_t′, formed without cancellation; 1 where there is no medium.
    pub absorbed_prime: f64,
    /// Albedo σ_s / σ_t with unreduced scattering.
    pub alpha: f64,
    /// Mean cosine of the phase function.
    pub g: f64,
    /// Mean free path 1 / σ_t \[unit\]; infinite where there is no medium.
    pub mean_free_path: f64,
    /// Transport mean free path 1 / σ_t′ \[unit\].
    pub transport_mean_free_path: f64,
    /// Diffusion length 1 / σ_tr = 1 / sqrt(3 σ_a σ_t′) \[unit\]; infinite without absorption.
    pub diffusion_length: f64,
}

impl ChannelOptics {
    /// From σ_s′ and σ_a [1/unit] and the mean cosine `g` < 1.
    pub fn new(sigma_s_prime: f64, sigma_a: f64, g: f64) -> Self {
        let (sigma_t_prime, sigma_s) = (sigma_s_prime + sigma_a, sigma_s_prime / (1.0 - g));
        let ratio = |a: f64, b: f64, none: f64| if b > 0.0 { a / b } else { none };
        Self {
            alpha_prime: ratio(sigma_s_prime, sigma_t_prime, 0.0),
            absorbed_prime: ratio(sigma_a, sigma_t_prime, 1.0),
            alpha: ratio(sigma_s, sigma_s + sigma_a, 0.0),
            g,
            mean_free_path: 1.0 / (sigma_s + sigma_a),
            transport_mean_free_path: 1.0 / sigma_t_prime,
            diffusion_length: 1.0 / (3.0 * sigma_a * sigma_t_prime).sqrt(),
        }
    }

    /// The three channels of `medium`, lengths in its unit.
    pub fn of(medium: &Medium) -> [Self; 3] {
        medium.channels().map(|k| Self::new(k.sigma_s_prime, k.sigma_a, medium.g))
    }

    /// Light is absorbed sooner than it is turned round: α′ < 0.5. No diffusion model means anything here.
    pub fn outside_diffusion(&self) -> bool {
        self.alpha_prime < 0.5
    }

    fn trust(&self) -> Trust {
        if self.outside_diffusion() || (self.g > 0.9 && self.alpha < 0.99) {
            Trust::PathTracing
        } else if self.alpha_prime < 0.6 || self.g > 0.8 {
            Trust::Marginal
        } else if self.alpha_prime < 0.9 {
            Trust::WithSingleScattering
        } else {
            Trust::Diffusion
        }
    }
}

/// Which models are near the truth, after Monte Carlo runs of a half space at normal incidence: median error of the
/// radial profile 5 % for `beam` with single scattering, 14 % for `better` with it, 28 % for `standard`; the total of
/// `standard` is within 2 % for α′ > 0.9. docs/models.md has the chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trust {
    /// α′ ≥ 0.9, g ≤ 0.8: every diffusion model has the colour, `beam` and `better` also the sharpness.
    Diffusion,
    /// α′ ≥ 0.6, g ≤ 0.8: models to which exact single scattering is added.
    WithSingleScattering,
    /// α′ in 0.5 .. 0.6 or g > 0.8: `beam` with single scattering, with errors of 8 to 15 %.
    Marginal,
    /// α′ < 0.5, or g > 0.9 with α < 0.99: trace paths.
    PathTracing,
}

impl Trust {
    /// The verdict for a medium: that of its worst channel.
    pub fn of(channels: &[ChannelOptics]) -> Self {
        channels.iter().map(ChannelOptics::trust).max().unwrap_or(Self::Diffusion)
    }

    /// The models of a half space to trust, best first; none where only path tracing will do.
    pub fn models(self) -> &'static [&'static str] {
        match self {
            Self::Diffusion => &["beam", "better", "standard"],
            Self::WithSingleScattering => &["beam", "better"],
            Self::Marginal => &["beam"],
            Self::PathTracing => &[],
        }
    }
}

impl fmt::Display for Trust {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Diffusion => "beam, better, standard",
            Self::WithSingleScattering => "beam, better",
            Self::Marginal => "beam (marginal)",
            Self::PathTracing => "none: trace paths",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_have_declared_values() {
        let nothing = ChannelOptics::new(0.0, 0.0, 0.0);
        assert_eq!((nothing.alpha_prime, nothing.absorbed_prime), (0.0, 1.0));
        assert!(nothing.mean_free_path.is_infinite() && nothing.diffusion_length.is_infinite());
        let clear = ChannelOptics::new(2.0, 0.0, 0.5);
        assert_eq!((clear.alpha_prime, clear.absorbed_prime, clear.mean_free_path), (1.0, 0.0, 0.25));
        assert!(clear.diffusion_length.is_infinite());
    }

    #[test]
    fn the_worst_channel_decides() {
        let good = ChannelOptics::new(1.0, 0.001, 0.0);
        let bad = ChannelOptics::new(0.03, 1.45, 0.0);
        assert_eq!(Trust::of(&[good, good, good]), Trust::Diffusion);
        assert_eq!(Trust::of(&[good, bad, good]), Trust::PathTracing);
        assert!(bad.outside_diffusion() && !good.outside_diffusion());
    }
}
