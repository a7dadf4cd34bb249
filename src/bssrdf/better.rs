//! The better dipole.

use super::radial::{Channel, Channels, Columns, DistanceOnly, Formula, columns, finite, in_mean_free_paths, left};
use super::standard::length_log2;
use super::{Claims, ModelKind, ModelName, ModelOption};
use crate::math::{Rgb, exp2_m1, times_exp2};
use crate::optics::{FresnelMoments, Medium, better_total};
use std::f64::consts::{LOG2_E, PI};

pub(super) static MODEL: ModelKind = ModelKind {
    takes: &[ModelOption::Boundary],
    evidence: |_| Some("better"),
    ..ModelKind::new("better", |medium, options| {
        Ok(Box::new(BetterDipole::behind(medium, &options.moments(medium), options.exit_normalisation)))
    })
};

/// The better dipole \[dEo12\]: Grosjean's diffusion coefficient, the boundary with both Fresnel moments, and an exitance
/// of fluence and flux. With lengths in l′ = 1/σ_t′, D = (2 - α′)/3, s = sqrt((1 - α′)/D), z_v = 1 + 4 A D and
/// A = (1 + 3 C_2) / (1 - 2 C_1):
///
///   M(r) = α′² σ_t′² / 4π · { C_phi/D [g0(d_r) - g0(d_v)] + C_e [g1(1, d_r) + g1(z_v, d_v)] }
///   g0(d) = exp(-s d) / d,   g1(z, d) = z (1 + s d) exp(-s d) / d³,   d_r² = r² + 1,  d_v² = r² + z_v²
///
/// S_d = M / π, over 4 C_phi(1/η) with exit normalisation [1/(unit² sr)]. Orders of scattering from two upwards (α′²):
/// light scattered once must be added, else the picture is some 10 % dark. Reciprocal. Trust it for α′ above 0.6.
///
/// The difference of the two g0 loses (r / z_v)² of its digits as printed; with t = d_v - d_r, formed without
/// cancellation, it is exp(-s d_r) [t / d_r - expm1(-s t)] / d_v.
pub struct BetterDipole {
    channels: Channels<BetterChannel>,
}

/// One channel, lengths in transport mean free paths.
#[derive(Clone, Copy, Debug)]
pub struct BetterChannel {
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
    /// z_v² - 1.
    lift: f32,
    /// C_phi / D.
    fluence: f32,
    /// C_e.
    flux: f32,
    /// α′² σ_t′² / 4π, over π and the exit normalisation [1/(unit² sr)].
    scale: f32,
}

impl BetterDipole {
    /// See [`super::ModelOptions`].
    pub fn new(medium: &Medium, exit_normalisation: bool) -> Self {
        Self::behind(medium, &FresnelMoments::new(f64::from(medium.eta)), exit_normalisation)
    }

    /// The same behind a boundary of these moments.
    pub fn behind(medium: &Medium, moments: &FresnelMoments, exit_normalisation: bool) -> Self {
        let exit = if exit_normalisation { moments.four_c_phi_outside } else { 1.0 };
        let mut decay = f64::INFINITY;
        let each = medium.channels().map(|k| {
            let diffusion = (1.0 + k.absorbed) / 3.0;
            let z_virtual = 1.0 + 4.0 * moments.a_mixed() * diffusion;
            let s = (k.absorbed / diffusion).sqrt();
            decay = decay.min(s * k.sigma_t_prime);
            BetterChannel {
                sigma_squared: finite(k.sigma_t_prime * k.sigma_t_prime),
                length_log2: length_log2(&k),
                decay: s as f32,
                decay_log2: (LOG2_E * s) as f32,
                z_virtual: z_virtual as f32,
                lift: ((z_virtual - 1.0) * (z_virtual + 1.0)) as f32,
                fluence: (moments.c_phi / diffusion) as f32,
                flux: moments.c_e as f32,
                scale: finite((k.alpha_prime * k.sigma_t_prime).powi(2) / (4.0 * PI * PI * exit)),
            }
        });
        Self {
            channels: Channels {
                each,
                columns: Pairs::of(each),
                grey: medium.is_grey(),
                decay: decay as f32,
                total: Rgb::from_fn(|c| better_total(&medium.channel(c), moments) as f32),
                exitance: (PI * exit) as f32,
            },
        }
    }
}

impl Formula for BetterChannel {
    #[inline(always)]
    fn eval<const COMPENSATED: bool>(self, r2: f32, rate: f32) -> f32 {
        let s = self.decay;
        let x2 = in_mean_free_paths(r2, self.sigma_squared);
        let (d_r, d_v) = ((x2 + 1.0).sqrt(), (x2 + self.z_virtual * self.z_virtual).sqrt());
        // One division for 1/d_r, 1/d_v and d_v - d_r = (z_v² - 1) / (d_v + d_r), which does not cancel.
        let (sum, product) = (d_r + d_v, d_r * d_v);
        let over = 1.0 / (sum * product);
        let (i_r, i_v, t) = (over * (d_v * sum), over * (d_r * sum), self.lift * (over * product));
        let mut exponent = self.decay_log2 * d_r;
        if COMPENSATED {
            let rate = rate * self.length_log2;
            exponent = left(self.decay_log2, rate) * d_r + rate / (d_r + x2.sqrt());
        }
        let m = exp2_m1(-self.decay_log2 * t);
        let fluence = (t * i_r - m) * i_v;
        let flux = (i_r + s) * (i_r * i_r) + self.z_virtual * (1.0 + m) * ((i_v + s) * (i_v * i_v));
        times_exp2(self.scale * (self.fluence * fluence + self.flux * flux), -exponent)
    }
}

columns!(BetterChannel, Pairs { sigma_squared, length_log2, decay, decay_log2, z_virtual, lift, fluence, flux, scale });

impl Channel for BetterChannel {
    type Columns = Pairs;
}

impl DistanceOnly for BetterDipole {
    type Channel = BetterChannel;
    const NAME: ModelName = ModelName::BETTER;
    const CLAIMS: Claims = Claims { unscattered: true, first_order: false, reciprocal: true, bounded_energy: true };

    fn channels(&self) -> &Channels<BetterChannel> {
        &self.channels
    }
}
