//! The diffuse reflectance of a half space in closed form, and its inverse: from a colour and a length to a medium.

use super::{FresnelMoments, Medium, Reduced, split};
use crate::error::{Error, Result};
use crate::math::{GaussLegendre, Rgb};

/// Which closed form stands for the reflectance of a half space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlbedoLaw {
    /// The standard dipole \[JMLH01\]; all orders of scattering. Nearest to transport for α′ above 0.9.
    Standard,
    /// The better dipole \[dEo12\] alone: orders from two upwards.
    Better,
    /// The better dipole and exact single scattering at normal incidence, isotropic by similarity. Passes 1 for α′
    /// above some 0.999.
    BetterWithSingle,
}

/// Reflectance per entered flux as a function of the albedo, for one boundary.
#[derive(Clone, Copy, Debug)]
pub struct AlbedoCurve {
    law: AlbedoLaw,
    moments: FresnelMoments,
    /// Reflectance by single scattering over the albedo.
    single: f64,
}

impl AlbedoCurve {
    /// The curve of `law` at a boundary with `eta` = n_inside / n_outside.
    pub fn new(law: AlbedoLaw, eta: f64) -> Self {
        let single = if law == AlbedoLaw::BetterWithSingle { single_scattering(eta) } else { 0.0 };
        Self { law, moments: FresnelMoments::new(eta), single }
    }

    /// Diffuse reflectance of a half space of `medium` per entered flux; 0 for α′ = 0, rising with α′.
    pub fn total(&self, medium: &Reduced) -> f64 {
        match self.law {
            AlbedoLaw::Standard => standard_total(medium, &self.moments),
            AlbedoLaw::Better | AlbedoLaw::BetterWithSingle => {
                better_total(medium, &self.moments) + self.single * medium.alpha_prime
            }
        }
    }

    /// The medium with reduced extinction 1 whose reflectance is `colour`; [`Self::total`] of it gives `colour`
    /// again to 1e-12.
    ///
    /// # Errors
    /// `colour` outside [0, 1]. The end 1 is a medium without absorption for the dipoles, and a slightly absorbing
    /// one with [`AlbedoLaw::BetterWithSingle`].
    pub fn invert(&self, colour: f64) -> Result<Reduced> {
        if !(0.0..=1.0).contains(&colour) {
            return Err(Error::scene(format!("a diffuse reflectance of {colour} has no medium: it lies in 0..1")));
        }
        // Bisection: the curve rises strictly. Over α′ where that is small, over the square root of 1 - α′ where α′ is
        // near 1 (there the curve falls linearly in it): each keeps its digits.
        let half = Reduced::new(0.5, 0.5);
        Ok(if colour <= self.total(&half) {
            let alpha = bisect(0.0, 0.5, |alpha| self.total(&Reduced::new(alpha, 1.0 - alpha)) < colour);
            Reduced::new(alpha, 1.0 - alpha)
        } else {
            let root = bisect(0.0, 0.5_f64.sqrt(), |y| self.total(&Reduced::new(1.0 - y * y, y * y)) > colour);
            Reduced::new(1.0 - root * root, root * root)
        })
    }
}

/// The point of [lo, hi] up to which `below` holds, to the last digit.
fn bisect(mut lo: f64, mut hi: f64, below: impl Fn(f64) -> bool) -> f64 {
    if !below(lo) {
        return lo;
    }
    for _ in 0..1100 {
        let middle = 0.5 * (lo + hi);
        if middle <= lo || middle >= hi {
            break;
        }
        if below(middle) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    lo
}

/// Total of the standard dipole, (α′/2) (exp(-s) + exp(-s z_v)), lengths in transport mean free paths.
pub fn standard_total(medium: &Reduced, moments: &FresnelMoments) -> f64 {
    let s = medium.relative_decay();
    let z_virtual = 1.0 + 4.0 / 3.0 * moments.a_groenhuis();
    0.5 * medium.alpha_prime * ((-s).exp() + (-s * z_virtual).exp())
}

/// Total of the better dipole, (α′²/2) { C_phi/D (exp(-s) - exp(-s z_v))/s + C_e (exp(-s) + exp(-s z_v)) }.
pub fn better_total(medium: &Reduced, moments: &FresnelMoments) -> f64 {
    let d = (1.0 + medium.absorbed) / 3.0;
    let s = (medium.absorbed / d).sqrt();
    let lift = 4.0 * moments.a_mixed() * d;
    let between = if s * lift > 1e-300 { -(-s * lift).exp_m1() / s } else { lift };
    let pair = moments.c_phi / d * between + moments.c_e * (1.0 + (-s * lift).exp());
    0.5 * medium.alpha_prime * medium.alpha_prime * (-s).exp() * pair
}

/// Reflectance of a half space by isotropic single scattering at normal incidence, over the albedo:
/// ½ ∫ T(μ) μ / (1 + μ) dμ over the inner cosine μ [HK93].
fn single_scattering(eta: f64) -> f64 {
    // Over the outer cosine m, where T is smooth up to a square root at grazing: m = t².
    let (lo, hi) = if eta >= 1.0 { (0.0, 1.0) } else { ((1.0 - eta * eta).sqrt(), 1.0) };
    GaussLegendre::new(32).integrate_panels(0.0, 1.0, 8, |t| {
        let m = lo + (hi - lo) * t * t;
        let boundary = split(eta, m);
        let mu = boundary.cosine;
        // μ dμ = m dm / η²
        0.5 * boundary.transmittance * m / (eta * eta) / (1.0 + mu) * 2.0 * t * (hi - lo)
    })
}

/// The medium that reflects `colour` under white diffuse light by `law`, with transport mean free path `length`
/// \[unit\], mean cosine `g` and relative index `eta`.
///
/// # Errors
/// A colour outside [0, 1], a length that is not positive and finite, and all that [`Medium::checked`] refuses.
pub fn medium_from_colour(law: AlbedoLaw, colour: Rgb, length: Rgb, g: f64, eta: f32) -> Result<Medium> {
    // Checks g and eta before they are used.
    Medium::unreduced(Rgb::BLACK, Rgb::BLACK, g, eta)?;
    let curve = AlbedoCurve::new(law, f64::from(eta));
    let (mut sigma_a, mut sigma_s) = (Rgb::BLACK, Rgb::BLACK);
    for c in 0..3 {
        let l = f64::from(length[c]);
        if !(l > 0.0 && l.is_finite()) {
            return Err(Error::scene(format!("a mean free path of {l} units: it must be positive and finite")));
        }
        let medium = curve.invert(f64::from(colour[c]))?;
        sigma_a[c] = (medium.absorbed / l) as f32;
        sigma_s[c] = (medium.alpha_prime / (l * (1.0 - g))) as f32;
    }
    Medium::unreduced(sigma_s, sigma_a, g, eta)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAWS: [AlbedoLaw; 3] = [AlbedoLaw::Standard, AlbedoLaw::Better, AlbedoLaw::BetterWithSingle];

    #[test]
    fn colours_come_back() {
        for law in LAWS {
            for eta in [0.75_f32, 1.0, 1.3, 1.5, 2.5] {
                let curve = AlbedoCurve::new(law, f64::from(eta));
                for i in 0..=1000 {
                    let colour = f64::from(i) / 1000.0;
                    let medium = curve.invert(colour).unwrap();
                    assert!((curve.total(&medium) - colour).abs() < 1e-12, "{law:?} {eta} {colour}: {medium:?}");
                }
                for colour in [1e-12, 1e-6, 1.0 - 1e-6, 1.0 - 1e-9] {
                    let medium = curve.invert(colour).unwrap();
                    assert!((curve.total(&medium) / colour - 1.0).abs() < 1e-9, "{law:?} {eta} {colour}");
                }
            }
        }
    }

    #[test]
    fn colours_come_back_through_the_coefficients_of_a_medium() {
        for law in LAWS {
            let curve = AlbedoCurve::new(law, f64::from(1.3_f32));
            for i in 0..100 {
                let colour = i as f32 / 100.0;
                let medium = medium_from_colour(law, Rgb::splat(colour), Rgb([1e-3, 1.0, 50.0]), 0.8, 1.3).unwrap();
                for c in 0..3 {
                    let k = medium.channel(c);
                    assert!((curve.total(&k) - f64::from(colour)).abs() < 1e-6, "{law:?} {colour}");
                    let length = [1e-3, 1.0, 50.0][c];
                    assert!((1.0 / k.sigma_t_prime / length - 1.0).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn the_ends_and_what_lies_beyond() {
        let curve = AlbedoCurve::new(AlbedoLaw::Standard, 1.3);
        assert_eq!(curve.invert(1.0).unwrap().absorbed, 0.0);
        assert_eq!(curve.invert(0.0).unwrap().alpha_prime, 0.0);
        for colour in [-1e-9, 1.000_001, f64::NAN, f64::INFINITY] {
            assert!(curve.invert(colour).is_err(), "{colour}");
        }
        let one = Rgb::splat(1.0);
        assert!(medium_from_colour(AlbedoLaw::Standard, one, Rgb::BLACK, 0.0, 1.3).is_err());
        assert!(medium_from_colour(AlbedoLaw::Standard, one * 0.5, one, 1.0, 1.3).is_err());
    }

    #[test]
    fn single_scattering_has_its_known_energy() {
        // ½ (1 - ln 2) without a boundary; the others by quadrature elsewhere and by a Monte Carlo program.
        for (eta, energy) in [(1.0, 0.5 - 0.5 * 2.0_f64.ln()), (1.3, 0.075_72), (1.5, 0.053_62)] {
            assert!((single_scattering(eta) - energy).abs() < 6e-6, "{eta}: {}", single_scattering(eta));
        }
    }

    #[test]
    fn white_media_reflect_all() {
        let white = Reduced::new(1.0, 0.0);
        for eta in [0.4, 0.75, 1.0, 1.3, 4.0] {
            assert_eq!(AlbedoCurve::new(AlbedoLaw::Standard, eta).total(&white), 1.0);
            assert!((AlbedoCurve::new(AlbedoLaw::Better, eta).total(&white) - 1.0).abs() < 1e-12, "{eta}");
        }
    }
}
