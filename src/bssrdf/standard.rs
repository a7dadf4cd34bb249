//! The standard dipole.

use super::radial::{Channel, Channels, Columns, DistanceOnly, Formula, columns, finite, in_mean_free_paths, left};
use super::{Claims, ModelKind, ModelName, ModelOption};
use crate::math::{Rgb, exp2, times_exp2};
use crate::optics::{FresnelMoments, Medium, Reduced, standard_total};
use std::f64::consts::{LOG2_E, PI};

pub(super) static MODEL: ModelKind = ModelKind {
    takes: &[ModelOption::Boundary],
    evidence: |_| Some("standard"),
    ..ModelKind::new("standard", |medium, options| {
        Ok(Box::new(StandardDipole::behind(medium, &options.moments(medium), options.exit_normalisation)))
    })
};

/// The standard dipole \[JMLH01\]: a point source one transport mean free path l′ below the entry and its image above
/// the surface, so that fluence vanishes on the extrapolated boundary. With lengths in l′ = 1/σ_t′ and
/// s = sqrt(3 (1 - α′)):
///
///   R_d(r) = α′ σ_t′² / 4π · Σ z (1 + s d) exp(-s d) / d³   over z in {1, z_v},  d² = r² + z²,  z_v = 1 + 4/3 A
///   total  = (α′/2) (exp(-s) + exp(-s z_v)),   A = (1 + 2 C_1) / (1 - 2 C_1)
///
/// S_d = R_d / π, over 4 C_phi(1/η) with exit normalisation [1/(unit² sr)]; M(r) = R_d [1/unit²]. All orders of
/// scattering: α′ to the first power pays for the first one too. Reciprocal. Right in total within 2 % for α′ above
/// 0.9, too sharp below one l′; a flat, thick, homogeneous medium is assumed.
pub struct StandardDipole {
    channels: Channels<Pole>,
}

/// One channel, lengths in transport mean free paths.
#[derive(Clone, Copy, Debug)]
pub struct Pole {
    /// σ_t′² [1/unit²].
    sigma_squared: f32,
    /// log2 e / σ_t′ [unit]: of a rate, what it takes off `decay_log2`.
    length_log2: f32,
    /// s.
    decay: f32,
    /// s log2 e.
    decay_log2: f32,
    /// z_v.
    z_virtual: f32,
    /// α′ σ_t′² / 4π, over π and the exit normalisation [1/(unit² sr)].
    scale: f32,
}

impl StandardDipole {
    /// See [`super::ModelOptions`].
    pub fn new(medium: &Medium, exit_normalisation: bool) -> Self {
        Self::behind(medium, &FresnelMoments::new(f64::from(medium.eta)), exit_normalisation)
    }

    /// The same behind a boundary of these moments.
    pub fn behind(medium: &Medium, moments: &FresnelMoments, exit_normalisation: bool) -> Self {
        let exit = if exit_normalisation { moments.four_c_phi_outside } else { 1.0 };
        let z_virtual = 1.0 + 4.0 / 3.0 * moments.a_groenhuis();
        let each = medium.channels().map(|k| Pole {
            sigma_squared: finite(k.sigma_t_prime * k.sigma_t_prime),
            length_log2: length_log2(&k),
            decay: k.relative_decay() as f32,
            decay_log2: (LOG2_E * k.relative_decay()) as f32,
            z_virtual: z_virtual as f32,
            scale: finite(k.alpha_prime * k.sigma_t_prime * k.sigma_t_prime / (4.0 * PI * PI * exit)),
        });
        Self {
            channels: Channels {
                each,
                columns: Poles::of(each),
                grey: medium.is_grey(),
                decay: medium.sigma_tr().min(),
                total: Rgb::from_fn(|c| standard_total(&medium.channel(c), moments) as f32),
                exitance: (PI * exit) as f32,
            },
        }
    }
}

/// log2 e / σ_t′ [unit], 0 where there is no medium.
pub(super) fn length_log2(k: &Reduced) -> f32 {
    if k.sigma_t_prime > 0.0 { finite(LOG2_E / k.sigma_t_prime) } else { 0.0 }
}

impl Formula for Pole {
    #[inline(always)]
    fn eval<const COMPENSATED: bool>(self, r2: f32, rate: f32) -> f32 {
        let s = self.decay;
        let x2 = in_mean_free_paths(r2, self.sigma_squared);
        let (d_r, d_v) = ((x2 + 1.0).sqrt(), (x2 + self.z_virtual * self.z_virtual).sqrt());
        let product = 1.0 / (d_r * d_v);
        let (i_r, i_v) = (d_v * product, d_r * product);
        let mut exponent = self.decay_log2 * d_r;
        if COMPENSATED {
            // rate r - s d = -(s - rate) d - rate (d - r), and d - r = z² / (d + r): no cancellation far out.
            let rate = rate * self.length_log2;
            exponent = left(self.decay_log2, rate) * d_r + rate / (d_r + x2.sqrt());
        }
        // z (1 + s d) / d³ as z (1/d + s) / d².
        let (real, image) = ((i_r + s) * (i_r * i_r), self.z_virtual * ((i_v + s) * (i_v * i_v)));
        // exp(-s d_v) over exp(-s d_r); s (d_v - d_r) is no worse than s d_v itself.
        let image = image * exp2(self.decay_log2 * (d_r - d_v));
        times_exp2(self.scale * (real + image), -exponent)
    }
}

columns!(Pole, Poles { sigma_squared, length_log2, decay, decay_log2, z_virtual, scale });

impl Channel for Pole {
    type Columns = Poles;
}

impl DistanceOnly for StandardDipole {
    type Channel = Pole;
    const NAME: ModelName = ModelName::STANDARD;
    const CLAIMS: Claims = Claims { unscattered: true, first_order: true, reciprocal: true, bounded_energy: true };

    fn channels(&self) -> &Channels<Pole> {
        &self.channels
    }
}
