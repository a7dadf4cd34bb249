//! Media by how they look: from a colour and a length to coefficients, and some such media by name. Nothing here was measured.

use super::{HalfSpace, Medium};
use crate::error::{Error, Result};
use crate::math::Rgb;

/// How a thick body of a medium looks. Arrays are red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Diffuse reflectance of a half space under even light, per entered flux, in [0, 1): see [`HalfSpace::even_reflectance`].
    pub colour: [f64; 3],
    /// Transport mean free path 1/(σ_s (1 - g) + σ_a), above 0: how far light goes before it is turned round, so how soft the body
    /// looks \[a length of the caller's\].
    pub mean_free_path: [f64; 3],
    /// Mean cosine of the phase function.
    pub g: f64,
    /// n_inside / n_outside.
    pub eta: f64,
}

impl Look {
    /// The medium, coefficients per unit of `mean_free_path`. Its colour is that of the transfer equation for isotropic scattering,
    /// good to 1e-4, so what paths through the medium show; BSSRDF models are off by their own error. With g ≠ 0 it is similarity:
    /// the true colour is darker, where g = 0.8 by 1 % for a bright one and by 5 % for a middling one.
    ///
    /// # Errors
    /// A colour outside [0, 1), a length that is not positive and finite, and all that [`Medium::checked`] refuses.
    pub fn medium(&self) -> Result<Medium> {
        let eta = self.eta as f32;
        // Checks g and eta before they are used.
        Medium::unreduced(Rgb::BLACK, Rgb::BLACK, self.g, eta)?;
        let half_space = HalfSpace::new(f64::from(eta));
        let (mut sigma_a, mut sigma_s) = (Rgb::BLACK, Rgb::BLACK);
        for c in 0..3 {
            let length = self.mean_free_path[c];
            if !(length > 0.0 && length.is_finite()) {
                return Err(Error::scene(format!(
                    "a mean free path of {length} units: it must be positive and finite"
                )));
            }
            let absorbed = half_space.absorbed_of(self.colour[c])?;
            sigma_a[c] = (absorbed / length) as f32;
            sigma_s[c] = ((1.0 - absorbed) / (length * (1.0 - self.g))) as f32;
        }
        Medium::unreduced(sigma_s, sigma_a, self.g, eta)
    }
}

/// A look by name.
#[derive(Clone, Copy, Debug)]
pub struct NamedLook {
    /// Name in scene files and on the command line.
    pub name: &'static str,
    /// What it is meant to look like.
    pub what: &'static str,
    /// The look, lengths in mm.
    pub look: Look,
}

impl NamedLook {
    /// The medium in a scene whose unit is `unit_in_mm` millimetres, with another index if `eta` says so; the colour stays.
    ///
    /// # Errors
    /// As [`Look::medium`], for an `eta` out of range.
    pub fn medium(&self, unit_in_mm: f64, eta: Option<f64>) -> Result<Medium> {
        let mean_free_path = self.look.mean_free_path.map(|l| l / unit_in_mm);
        Look { mean_free_path, eta: eta.unwrap_or(self.look.eta), ..self.look }.medium()
    }
}

/// A look that scatters alike in all directions, for which the colour is exact.
const fn look(
    name: &'static str,
    what: &'static str,
    colour: [f64; 3],
    mean_free_path_mm: [f64; 3],
    eta: f64,
) -> NamedLook {
    NamedLook { name, what, look: Look { colour, mean_free_path: mean_free_path_mm, g: 0.0, eta } }
}

/// All looks: made up for this program, by eye; no measurement stands behind any number but the indices, which are those of the
/// substance to two digits.
pub static LOOKS: &[NamedLook] = &[
    look("jade", "a green stone", [0.30, 0.55, 0.36], [0.8, 1.2, 0.9], 1.61),
    look("wax", "yellow beeswax", [0.93, 0.84, 0.62], [2.5, 1.8, 1.0], 1.44),
    look("soap", "a bar of hand soap", [0.85, 0.83, 0.74], [1.4, 1.2, 0.9], 1.46),
    look("candle", "pale paraffin, glowing", [0.96, 0.90, 0.76], [4.5, 3.2, 1.8], 1.43),
    look("grape", "flesh of a green grape", [0.36, 0.52, 0.20], [5.0, 6.5, 3.0], 1.36),
    look("leaf", "a green leaf", [0.22, 0.40, 0.14], [0.20, 0.35, 0.15], 1.42),
    look("milk_glass", "white opal glass", [0.93, 0.94, 0.95], [1.2, 1.1, 1.0], 1.52),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::ChannelOptics;

    #[test]
    fn colour_and_length_come_back_through_the_coefficients() {
        for (g, eta) in [(0.0, 1.3), (0.7, 1.5), (-0.3, 1.0)] {
            for colour in [[0.0, 0.2, 0.5], [0.8, 0.95, 0.999]] {
                let look = Look { colour, mean_free_path: [0.1, 2.0, 30.0], g, eta };
                let medium = look.medium().unwrap();
                let half_space = HalfSpace::new(f64::from(medium.eta));
                for (c, k) in ChannelOptics::of(&medium).iter().enumerate() {
                    let back = half_space.even_reflectance(k.absorbed_prime);
                    assert!((back - colour[c]).abs() < 1e-6, "g {g}: {} came back as {back}", colour[c]);
                    assert!((k.transport_mean_free_path / look.mean_free_path[c] - 1.0).abs() < 1e-6, "g {g}");
                }
            }
        }
    }

    #[test]
    fn looks_scale_with_the_unit_and_keep_their_colour_with_another_index() {
        for named in LOOKS {
            let (mm, cm) = (named.medium(1.0, None).unwrap(), named.medium(10.0, None).unwrap());
            for c in 0..3 {
                assert!((cm.sigma_a[c] / mm.sigma_a[c] - 10.0).abs() < 1e-5, "{}", named.name);
            }
            let other = named.medium(1.0, Some(1.2)).unwrap();
            let half_space = HalfSpace::new(f64::from(1.2_f32));
            let back = half_space.even_reflectance(ChannelOptics::of(&other)[1].absorbed_prime);
            assert!((back - named.look.colour[1]).abs() < 1e-6, "{}: {back}", named.name);
            assert!(ChannelOptics::of(&mm).iter().all(|k| !k.outside_diffusion()), "{}", named.name);
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let good = LOOKS[0].look;
        let wrong = [
            Look { colour: [1.0; 3], ..good },
            Look { colour: [-0.1; 3], ..good },
            Look { mean_free_path: [0.0; 3], ..good },
            Look { mean_free_path: [f64::INFINITY; 3], ..good },
            Look { mean_free_path: [1e-30; 3], ..good },
            Look { g: 1.0, ..good },
            Look { eta: 0.0, ..good },
        ];
        assert!(good.medium().is_ok() && wrong.iter().all(|look| look.medium().is_err()));
    }
}
