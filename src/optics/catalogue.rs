//! Measured media as their papers print them, each with its source, and the one function that turns a row into a
//! medium of a scene. The numbers are in `catalogue/rows.rs`.

mod rows;

use super::validity::{ChannelOptics, Trust};
use super::{Medium, half_space};
use crate::math::Rgb;
pub use rows::CATALOGUE;

/// One medium as its paper prints it. Arrays are red, green, blue.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Name in scene files and on the command line.
    pub name: &'static str,
    /// Key into docs/references.md of the paper that measured it.
    pub source: &'static str,
    /// Table or figure of that paper.
    pub table: &'static str,
    /// Scattering and absorption, in the paper's unit.
    pub coefficients: Coefficients,
    /// n_inside / n_outside.
    pub eta: f64,
    /// Diffuse reflectance listed for these coefficients, where there is one.
    pub reflectance: Option<ListedReflectance>,
    /// Where the numbers were read and what they were checked against; keys into docs/references.md.
    pub provenance: &'static str,
}

/// What a paper prints, unit in the name.
#[derive(Clone, Copy, Debug)]
pub enum Coefficients {
    /// Reduced scattering; the phase function was not measured.
    Reduced {
        /// σ_s′ [1/mm].
        sigma_s_prime_per_mm: [f64; 3],
        /// σ_a [1/mm].
        sigma_a_per_mm: [f64; 3],
    },
    /// A liquid diluted in a tank of [`TANK_ML`] of water, or a powder dissolved in it. The paper prints units of
    /// 10⁻² per mm, which is per 100 mm.
    Tank {
        /// Extinction σ_t of what was in the tank [1/(100 mm)].
        sigma_t_per_100_mm: [f64; 3],
        /// Scattering σ_s of the same, not reduced [1/(100 mm)].
        sigma_s_per_100_mm: [f64; 3],
        /// Mean cosine of the phase function; 0 where nothing scatters.
        g: [f64; 3],
        /// Millilitres of the liquid in the tank. Coefficients are proportional to concentration, so the undiluted
        /// liquid has [`TANK_ML`] / `volume_ml` times as much. `None`: as measured, for powders (there is no
        /// undiluted solution) and sea water.
        volume_ml: Option<f64>,
    },
}

/// Volume of the measuring tank of \[NGD06\] \[ml\].
pub const TANK_ML: f64 = 23_000.0;

/// Diffuse reflectance of a half space listed beside a row's coefficients.
#[derive(Clone, Copy, Debug)]
pub struct ListedReflectance {
    /// As listed.
    pub value: [f64; 3],
    /// Digits after the point that the list prints.
    pub digits: usize,
    /// Key into docs/references.md of the list.
    pub source: &'static str,
}

/// The medium called `name`, compared without case, blanks and punctuation: `Lowfat Milk` is `lowfat_milk`.
pub fn find(name: &str) -> Option<&'static Measured> {
    let wanted = plain(name);
    CATALOGUE.iter().find(|m| plain(m.name) == wanted)
}

/// A name without case, blanks and punctuation.
pub(super) fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

impl Measured {
    /// σ_s′ [1/mm] of the undiluted medium.
    pub fn sigma_s_prime_per_mm(&self) -> [f64; 3] {
        match self.coefficients {
            Coefficients::Reduced { sigma_s_prime_per_mm, .. } => sigma_s_prime_per_mm,
            Coefficients::Tank { sigma_s_per_100_mm, g, .. } => {
                let k = self.concentration() / 100.0;
                std::array::from_fn(|c| sigma_s_per_100_mm[c] * (1.0 - g[c]) * k)
            }
        }
    }

    /// σ_a [1/mm] of the undiluted medium.
    pub fn sigma_a_per_mm(&self) -> [f64; 3] {
        match self.coefficients {
            Coefficients::Reduced { sigma_a_per_mm, .. } => sigma_a_per_mm,
            Coefficients::Tank { sigma_t_per_100_mm, sigma_s_per_100_mm, .. } => {
                let k = self.concentration() / 100.0;
                std::array::from_fn(|c| (sigma_t_per_100_mm[c] - sigma_s_per_100_mm[c]) * k)
            }
        }
    }

    /// Mean cosine per channel; 0 where the paper lists reduced scattering.
    pub fn g(&self) -> [f64; 3] {
        match self.coefficients {
            Coefficients::Reduced { .. } => [0.0; 3],
            Coefficients::Tank { g, .. } => g,
        }
    }

    /// Concentration of the medium over that of what was measured.
    fn concentration(&self) -> f64 {
        match self.coefficients {
            Coefficients::Tank { volume_ml: Some(volume), .. } => TANK_ML / volume,
            _ => 1.0,
        }
    }

    /// The medium in a scene whose unit is `unit_in_mm` millimetres. Nothing else scales coefficients.
    ///
    /// Rows that list reduced scattering get g = 0, not forgotten. A medium has one g for its three channels: rows
    /// that list one per channel get the mean over the channels that scatter, and a scattering coefficient that keeps
    /// σ_s′ of each channel, which is what the diffusion models see.
    pub fn medium(&self, unit_in_mm: f64) -> Medium {
        let (sigma_s_prime, sigma_a, g) = (self.sigma_s_prime_per_mm(), self.sigma_a_per_mm(), self.g());
        let scattering = sigma_s_prime.iter().zip(g).filter(|&(&s, _)| s > 0.0).map(|(_, g)| g);
        let mean_g = scattering.clone().sum::<f64>() / (scattering.count() as f64).max(1.0);
        let sigma_s = |c: usize| (sigma_s_prime[c] * unit_in_mm / (1.0 - mean_g)) as f32;
        Medium {
            sigma_a: Rgb::from_fn(|c| (sigma_a[c] * unit_in_mm) as f32),
            sigma_s: Rgb::from_fn(sigma_s),
            g: mean_g,
            eta: self.eta as f32,
        }
    }

    /// What decides which models may be trusted, per channel, lengths in mm.
    pub fn optics(&self) -> [ChannelOptics; 3] {
        let (sigma_s_prime, sigma_a, g) = (self.sigma_s_prime_per_mm(), self.sigma_a_per_mm(), self.g());
        std::array::from_fn(|c| ChannelOptics::new(sigma_s_prime[c], sigma_a[c], g[c]))
    }

    /// The models that may be trusted in every channel.
    pub fn trust(&self) -> Trust {
        Trust::of(&self.optics())
    }

    /// Diffuse reflectance of a half space at normal incidence per entered flux, from the transfer equation for
    /// isotropic scattering with this row's reduced coefficients. Exact for rows that list reduced scattering; for
    /// others the error of that similarity.
    pub fn reflectance_isotropic(&self) -> [f64; 3] {
        let boundary = half_space::HalfSpace::new(self.eta);
        self.optics().map(|channel| boundary.reflectance(channel.absorbed_prime))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_forgiving() {
        for (i, row) in CATALOGUE.iter().enumerate() {
            assert!(std::ptr::eq(find(row.name).unwrap(), row), "{} is not found by its name", row.name);
            assert!(CATALOGUE[..i].iter().all(|other| other.name != row.name));
        }
        assert_eq!(find("Lowfat Milk").unwrap().name, "lowfat_milk");
        assert!(find("unobtainium").is_none());
    }

    #[test]
    fn a_medium_scales_with_the_unit_and_keeps_the_reduced_scattering() {
        for row in CATALOGUE {
            let (mm, metre) = (row.medium(1.0), row.medium(1000.0));
            for c in 0..3 {
                let (s, a) = (row.sigma_s_prime_per_mm()[c], row.sigma_a_per_mm()[c]);
                assert!((f64::from(mm.sigma_s_prime()[c]) - s).abs() <= 3e-7 * s, "{}", row.name);
                assert!((f64::from(metre.sigma_a[c]) - 1000.0 * a).abs() <= 1e-6 * 1000.0 * a, "{}", row.name);
            }
            assert!((-1.0..1.0).contains(&mm.g));
        }
    }
}
