//! Measured media with their sources.

use super::Medium;
use crate::math::Rgb;

/// One medium as its paper prints it.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Name in scene files.
    pub name: &'static str,
    /// Reduced scattering coefficient [1/mm].
    pub sigma_s_prime_per_mm: Rgb,
    /// Absorption coefficient [1/mm].
    pub sigma_a_per_mm: Rgb,
    /// n_inside / n_outside.
    pub eta: f32,
    /// Key into docs/references.md.
    pub source: &'static str,
}

const fn jensen(name: &'static str, s: [f32; 3], a: [f32; 3], eta: f32) -> Measured {
    Measured { name, sigma_s_prime_per_mm: Rgb(s), sigma_a_per_mm: Rgb(a), eta, source: "JMLH01" }
}

/// All measured media.
pub const CATALOGUE: &[Measured] = &[
    jensen("apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046], 1.3),
    jensen("chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19], 1.3),
    jensen("chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20], 1.3),
    jensen("cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163], 1.3),
    jensen("ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45], 1.3),
    jensen("marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071], 1.5),
    jensen("potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12], 1.3),
    jensen("skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142], 1.3),
    jensen("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48], 1.3),
    jensen("skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145], 1.3),
    jensen("spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0], 1.3),
    jensen("wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014], 1.3),
];

/// The medium called `name`.
pub fn find(name: &str) -> Option<&'static Measured> {
    CATALOGUE.iter().find(|m| m.name == name)
}

impl Measured {
    /// The medium in a scene whose unit is `unit_in_mm` millimetres. The paper lists reduced scattering: `g` is 0,
    /// not forgotten.
    pub fn medium(&self, unit_in_mm: f64) -> Medium {
        let per_unit = |per_mm: Rgb| per_mm.map(|v| (f64::from(v) * unit_in_mm) as f32);
        Medium {
            sigma_a: per_unit(self.sigma_a_per_mm),
            sigma_s: per_unit(self.sigma_s_prime_per_mm),
            g: 0.0,
            eta: self.eta,
        }
    }
}
