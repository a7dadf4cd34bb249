//! A homogeneous scattering medium behind a smooth boundary.

use crate::math::Rgb;

/// Coefficients per scene unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Absorption coefficient [1/unit].
    pub sigma_a: Rgb,
    /// Scattering coefficient, not reduced [1/unit].
    pub sigma_s: Rgb,
    /// Mean cosine of the Henyey-Greenstein phase function, in (-1, 1).
    pub g: f32,
    /// n_inside / n_outside.
    pub eta: f32,
}

impl Medium {
    /// Reduced scattering coefficient σ_s (1 - g) [1/unit].
    pub fn sigma_s_prime(&self) -> Rgb {
        self.sigma_s * (1.0 - self.g)
    }

    /// Reduced extinction coefficient σ_s′ + σ_a [1/unit]; its inverse is the transport mean free path.
    pub fn sigma_t_prime(&self) -> Rgb {
        self.sigma_s_prime() + self.sigma_a
    }

    /// Reduced albedo σ_s′ / σ_t′; 0 where there is no medium.
    pub fn alpha_prime(&self) -> Rgb {
        let (s, t) = (self.sigma_s_prime(), self.sigma_t_prime());
        Rgb::from_fn(|c| if t[c] > 0.0 { s[c] / t[c] } else { 0.0 })
    }

    /// True where the three channels do not differ, so that one is enough.
    pub fn is_grey(&self) -> bool {
        self.sigma_a.is_grey() && self.sigma_s.is_grey()
    }
}
