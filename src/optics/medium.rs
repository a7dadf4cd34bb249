//! A homogeneous scattering medium behind a smooth boundary.

use crate::error::{Error, Result};
use crate::math::Rgb;

/// Coefficients per scene unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Absorption coefficient [1/unit].
    pub sigma_a: Rgb,
    /// Scattering coefficient, not reduced [1/unit].
    pub sigma_s: Rgb,
    /// Mean cosine of the Henyey-Greenstein phase function, in (-1, 1). In f64, because 1 - g scales every reduced
    /// coefficient and f32 has no digits of it left near 1.
    pub g: f64,
    /// n_inside / n_outside.
    pub eta: f32,
}

/// What diffusion sees of one channel, in f64: the source of every model's constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reduced {
    /// Absorption coefficient [1/unit].
    pub sigma_a: f64,
    /// Reduced scattering coefficient σ_s (1 - g) [1/unit].
    pub sigma_s_prime: f64,
    /// Reduced extinction coefficient σ_s′ + σ_a [1/unit]; its inverse is the transport mean free path.
    pub sigma_t_prime: f64,
    /// σ_s′ / σ_t′; 0 where there is no medium.
    pub alpha_prime: f64,
    /// 1 - α′ = σ_a / σ_t′, not by subtraction; 1 where there is no medium.
    pub absorbed: f64,
}

impl Reduced {
    /// From the two coefficients [1/unit], both ≥ 0.
    pub fn new(sigma_s_prime: f64, sigma_a: f64) -> Self {
        let sigma_t_prime = sigma_s_prime + sigma_a;
        let over = |part: f64, none: f64| if sigma_t_prime > 0.0 { part / sigma_t_prime } else { none };
        Self {
            sigma_a,
            sigma_s_prime,
            sigma_t_prime,
            alpha_prime: over(sigma_s_prime, 0.0),
            absorbed: over(sigma_a, 1.0),
        }
    }

    /// σ_tr / σ_t′ = sqrt(3 (1 - α′)), the decay of classical diffusion per transport mean free path.
    pub fn relative_decay(&self) -> f64 {
        (3.0 * self.absorbed).sqrt()
    }
}

/// Largest coefficient that is taken [1/unit]; its square still has room in f32.
const LARGEST: f32 = 1e15;
/// Smallest relative index that is taken, and the inverse of the largest.
const SMALLEST_ETA: f32 = 0.1;

impl Medium {
    /// A medium from its scattering coefficient, the mean cosine `g` of its phase function and its absorption.
    /// [1/unit]
    ///
    /// # Errors
    /// A coefficient that is negative, not finite or above 1e15; `g` outside (-1, 1); `eta` outside 0.1..10.
    pub fn unreduced(sigma_s: Rgb, sigma_a: Rgb, g: f64, eta: f32) -> Result<Self> {
        Self { sigma_a, sigma_s, g, eta }.checked()
    }

    /// A medium from its reduced scattering coefficient, as most tables print it; `g` is 0, so that it scatters
    /// alike to diffusion, and single scattering is isotropic. [1/unit]
    ///
    /// # Errors
    /// As [`Self::unreduced`].
    pub fn reduced(sigma_s_prime: Rgb, sigma_a: Rgb, eta: f32) -> Result<Self> {
        Self { sigma_a, sigma_s: sigma_s_prime, g: 0.0, eta }.checked()
    }

    /// The medium itself if every number is in range.
    ///
    /// # Errors
    /// As [`Self::unreduced`]; for media that were not made by a constructor.
    pub fn checked(self) -> Result<Self> {
        for (what, value) in [("sigma_a", self.sigma_a), ("sigma_s", self.sigma_s)] {
            if value.0.iter().any(|v| !(0.0..=LARGEST).contains(v)) {
                let [r, g, b] = value.0;
                return Err(Error::scene(format!(
                    "{what} = [{r}, {g}, {b}]: coefficients lie in 0..{LARGEST:e} per unit"
                )));
            }
        }
        if !(self.g > -1.0 && self.g < 1.0) {
            return Err(Error::scene(format!("g = {}: the mean cosine lies between -1 and 1, both excluded", self.g)));
        }
        if !(SMALLEST_ETA..=1.0 / SMALLEST_ETA).contains(&self.eta) {
            return Err(Error::scene(format!("eta = {}: n_inside / n_outside lies in 0.1..10", self.eta)));
        }
        Ok(self)
    }

    /// What diffusion sees of `channel` (0, 1 or 2).
    pub fn channel(&self, channel: usize) -> Reduced {
        let sigma_s_prime = f64::from(self.sigma_s[channel]) * (1.0 - self.g);
        Reduced::new(sigma_s_prime, f64::from(self.sigma_a[channel]))
    }

    /// The three channels of [`Self::channel`].
    pub fn channels(&self) -> [Reduced; 3] {
        std::array::from_fn(|c| self.channel(c))
    }

    fn each(&self, f: impl Fn(Reduced) -> f64) -> Rgb {
        Rgb::from_fn(|c| f(self.channel(c)) as f32)
    }

    /// Extinction coefficient σ_s + σ_a [1/unit].
    pub fn sigma_t(&self) -> Rgb {
        self.sigma_s + self.sigma_a
    }

    /// Reduced scattering coefficient σ_s (1 - g) [1/unit].
    pub fn sigma_s_prime(&self) -> Rgb {
        self.each(|k| k.sigma_s_prime)
    }

    /// Reduced extinction coefficient σ_s′ + σ_a [1/unit]; its inverse is the transport mean free path.
    pub fn sigma_t_prime(&self) -> Rgb {
        self.each(|k| k.sigma_t_prime)
    }

    /// Effective transport coefficient sqrt(3 σ_a σ_t′) of classical diffusion [1/unit].
    pub fn sigma_tr(&self) -> Rgb {
        self.each(|k| k.relative_decay() * k.sigma_t_prime)
    }

    /// Reduced albedo σ_s′ / σ_t′; 0 where there is no medium.
    pub fn alpha_prime(&self) -> Rgb {
        self.each(|k| k.alpha_prime)
    }

    /// Mean free path 1 / σ_t \[unit\]; infinite where there is no medium.
    pub fn mean_free_path(&self) -> Rgb {
        self.sigma_t().map(|s| 1.0 / s)
    }

    /// Transport mean free path 1 / σ_t′ \[unit\]; infinite where there is no medium.
    pub fn transport_mean_free_path(&self) -> Rgb {
        self.each(|k| 1.0 / k.sigma_t_prime)
    }

    /// The same medium in an object `k` > 0 times as large: lengths times `k`, coefficients over `k`.
    #[must_use]
    pub fn scaled_by(&self, k: f32) -> Self {
        Self { sigma_a: self.sigma_a / k, sigma_s: self.sigma_s / k, ..*self }
    }

    /// True where the three channels do not differ, so that one is enough.
    pub fn is_grey(&self) -> bool {
        self.sigma_a.is_grey() && self.sigma_s.is_grey()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_no_medium_are_refused_by_name() {
        let one = Rgb::splat(1.0);
        let refused = |r: Result<Medium>, word: &str| {
            let text = r.expect_err("no medium").to_string();
            assert!(text.contains(word), "{text}");
        };
        refused(Medium::unreduced(Rgb([1.0, -1.0, 1.0]), one, 0.0, 1.3), "sigma_s");
        refused(Medium::unreduced(one, Rgb([f32::NAN, 1.0, 1.0]), 0.0, 1.3), "sigma_a");
        refused(Medium::unreduced(one, Rgb([1.0, f32::INFINITY, 1.0]), 0.0, 1.3), "sigma_a");
        refused(Medium::unreduced(one, one, 1.0, 1.3), "mean cosine");
        refused(Medium::unreduced(one, one, f64::NAN, 1.3), "mean cosine");
        refused(Medium::reduced(one, one, 0.0), "eta");
    }

    #[test]
    fn edges_of_the_range_have_values() {
        let medium = Medium::unreduced(Rgb([1.0, 0.0, 0.0]), Rgb([0.0, 1.0, 0.0]), 1.0 - 1e-9, 1.3).unwrap();
        assert_eq!(medium.alpha_prime(), Rgb([1.0, 0.0, 0.0]));
        assert_eq!(medium.channel(0).absorbed, 0.0);
        assert!((medium.channel(0).sigma_s_prime / 1e-9 - 1.0).abs() < 1e-6);
        assert_eq!(medium.channel(2).sigma_t_prime, 0.0);
        assert_eq!(medium.channel(2).absorbed, 1.0);
    }

    #[test]
    fn absorption_far_below_scattering_keeps_its_digits() {
        let medium = Medium::reduced(Rgb::splat(1e6), Rgb::splat(1e-6), 1.3).unwrap();
        assert!((medium.channel(0).absorbed / 1e-12 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_larger_object_has_smaller_coefficients() {
        let medium = Medium::unreduced(Rgb([1.0, 2.0, 3.0]), Rgb([0.1, 0.2, 0.3]), 0.5, 1.3).unwrap();
        let large = medium.scaled_by(4.0);
        for c in 0..3 {
            assert_eq!(large.sigma_t_prime()[c], medium.sigma_t_prime()[c] / 4.0);
            assert_eq!(large.alpha_prime()[c], medium.alpha_prime()[c]);
            assert_eq!(large.transport_mean_free_path()[c], 4.0 * medium.transport_mean_free_path()[c]);
        }
    }
}
