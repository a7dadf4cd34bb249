//! What the anisotropic models need of one colour channel, in f64.

use crate::optics::{FresnelMoments, Medium};

/// One channel of a homogeneous medium with its boundary. The coefficients stay in f64 because 1 - g and σ_a / σ_t′
/// lose all their digits in f32 where g or the albedo is near 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelMedium {
    /// Scattering coefficient, not reduced [1/unit], at least 0.
    pub sigma_s: f64,
    /// Absorption coefficient [1/unit], at least 0.
    pub sigma_a: f64,
    /// Mean cosine of the phase function, in (-1, 1).
    pub g: f64,
    /// n_inside / n_outside, above 0.
    pub eta: f64,
}

impl ChannelMedium {
    /// Channel `c` of `medium`.
    pub fn of(medium: &Medium, c: usize) -> Self {
        Self {
            sigma_s: f64::from(medium.sigma_s[c]),
            sigma_a: f64::from(medium.sigma_a[c]),
            g: medium.g,
            eta: f64::from(medium.eta),
        }
    }

    /// Extinction σ_s + σ_a [1/unit].
    pub fn sigma_t(&self) -> f64 {
        self.sigma_s + self.sigma_a
    }

    /// Reduced extinction σ_s (1 - g) + σ_a [1/unit].
    pub fn sigma_t_prime(&self) -> f64 {
        self.sigma_s * (1.0 - self.g) + self.sigma_a
    }

    /// Reduced albedo σ_s′ / σ_t′ in [0, 1]; 0 where there is no medium.
    pub fn alpha_prime(&self) -> f64 {
        let t = self.sigma_t_prime();
        if t > 0.0 { self.sigma_s * (1.0 - self.g) / t } else { 0.0 }
    }

    /// 1 - α′ = σ_a / σ_t′, without the subtraction; 1 where there is no medium.
    pub fn absorbed(&self) -> f64 {
        let t = self.sigma_t_prime();
        if t > 0.0 { self.sigma_a / t } else { 1.0 }
    }
}

/// The constants of a boundary that enter the kernels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boundary {
    /// C_phi(η) = (1 - 2 C_1) / 4.
    pub c_phi: f64,
    /// C_E(η) = (1 - 3 C_2) / 2.
    pub c_e: f64,
    /// A of the extrapolated boundary with both moments, (1 - C_E) / (2 C_phi); at least 1.
    pub a: f64,
    /// 4 C_phi(1/η).
    pub four_c_phi_outside: f64,
}

impl Boundary {
    pub fn new(eta: f64) -> Self {
        let m = FresnelMoments::new(eta);
        Self {
            c_phi: 0.25 * (1.0 - m.two_c1),
            c_e: 0.5 * (1.0 - m.three_c2),
            a: m.a_mixed(),
            four_c_phi_outside: m.four_c_phi_outside,
        }
    }
}

/// The nearest f32 that is finite; 0 for NaN, which a kernel yields only where infinity meets an underflow.
#[inline]
pub(super) fn to_finite(value: f64) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32 }
}
