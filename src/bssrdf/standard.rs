//! The standard dipole.

use super::{Bssrdf, Entry, Exit};
use crate::math::Rgb;
use crate::optics::{FresnelMoments, Medium};
use std::f32::consts::PI;

/// The standard dipole [JMLH01]: a point source one transport mean free path below the entry and its image
/// above the surface, so that fluence vanishes on the extrapolated boundary. Assumes a flat, thick, high-albedo
/// medium; all orders of scattering; reciprocal (it knows the distance alone).
pub struct StandardDipole {
    channels: [Channel; 3],
    grey: bool,
    decay: f32,
}

/// One channel, lengths in transport mean free paths 1/σ_t′.
#[derive(Clone, Copy)]
struct Channel {
    /// σ_t′ [1/unit].
    sigma_t_prime: f32,
    /// σ_tr / σ_t′.
    decay: f32,
    /// Height of the image source; the real one is at depth 1.
    z_virtual: f32,
    /// α′ σ_t′² / 4π, over π and the exit normalisation [1/(unit² sr)].
    scale: f32,
    /// α′ / 2.
    half_albedo: f32,
}

impl StandardDipole {
    /// See [`super::Model::new`].
    pub fn new(medium: &Medium, exit_normalisation: bool) -> Self {
        let moments = FresnelMoments::new(f64::from(medium.eta));
        let exit = if exit_normalisation { moments.four_c_phi_outside } else { 1.0 };
        let z_virtual = 1.0 + 4.0 / 3.0 * moments.a_groenhuis();
        let (sigma_t_prime, alpha_prime) = (medium.sigma_t_prime(), medium.alpha_prime());
        let channels = std::array::from_fn(|c| {
            let sigma = sigma_t_prime[c];
            let absorbed = if sigma > 0.0 { medium.sigma_a[c] / sigma } else { 1.0 };
            Channel {
                sigma_t_prime: sigma,
                decay: (3.0 * absorbed).sqrt(),
                z_virtual: z_virtual as f32,
                scale: alpha_prime[c] * sigma * sigma / (4.0 * PI * PI * exit as f32),
                half_albedo: 0.5 * alpha_prime[c],
            }
        });
        let decay = channels.iter().map(|k| k.decay * k.sigma_t_prime).fold(f32::INFINITY, f32::min);
        Self { channels, grey: medium.is_grey(), decay }
    }
}

impl Channel {
    /// S_d e^{rate r} from r [unit] and rate [1/unit]:
    ///
    ///   S_d = α′/4π² · Σ z (1 + σ_tr d) exp(-σ_tr d) / d³  over z in {z_r, z_v},  d² = r² + z²
    #[inline]
    fn eval(&self, r: f32, rate: f32) -> f32 {
        let gain = rate * r;
        let r = r * self.sigma_t_prime;
        let pole = |z: f32| {
            let d2 = r * r + z * z;
            let d = d2.sqrt();
            z * (1.0 + self.decay * d) * (gain - self.decay * d).exp() / (d2 * d)
        };
        self.scale * (pole(1.0) + pole(self.z_virtual))
    }
}

impl Bssrdf for StandardDipole {
    #[inline]
    fn eval_compensated(&self, entry: &Entry, exit: &Exit, rate: f32) -> Rgb {
        let r = entry.x.distance(exit.x);
        if self.grey {
            return Rgb::splat(self.channels[0].eval(r, rate));
        }
        Rgb::from_fn(|c| self.channels[c].eval(r, rate))
    }

    fn decay(&self) -> f32 {
        self.decay
    }

    fn total(&self) -> Rgb {
        Rgb::from_fn(|c| {
            let k = &self.channels[c];
            k.half_albedo * ((-k.decay).exp() + (-k.decay * k.z_virtual).exp())
        })
    }
}
