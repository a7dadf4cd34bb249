//! The reference against which coefficients are checked: reflectance of a half space from the transfer equation itself.
//!
//! Isotropic scattering, smooth boundary, normal incidence. Without the boundary the reflected radiance is known in
//! closed form through Chandrasekhar's H function [Cha60]; the boundary sends part of it back, which makes one linear
//! equation for the radiance that arrives from inside. No diffusion theory anywhere.

use super::fresnel;
use crate::error::{Error, Result};
use crate::math::GaussLegendre;

/// Gauss points on each side of the critical angle.
const POINTS: usize = 24;

/// A half space behind a boundary of given index, and the angles at which the equation is solved.
pub struct HalfSpace {
    /// Cosine inside, weight, Fresnel reflectance met from inside.
    nodes: Vec<Node>,
}

struct Node {
    mu: f64,
    weight: f64,
    reflectance: f64,
}

impl HalfSpace {
    /// Behind a boundary with `eta` = n_inside / n_outside > 0.
    pub fn new(eta: f64) -> Self {
        // The reflectance has a kink at the critical angle: one panel on each side of it, and a square-root
        // substitution mu = mu_c + (1 - mu_c) u² that resolves the boundary layer above.
        let mu_c = if eta > 1.0 { (1.0 - 1.0 / (eta * eta)).sqrt() } else { 0.0 };
        let mut nodes = Vec::with_capacity(2 * POINTS);
        for (u, w) in GaussLegendre::new(POINTS).points_on(0.0, 1.0) {
            if mu_c > 0.0 {
                nodes.push(Node { mu: mu_c * u, weight: mu_c * w, reflectance: 1.0 });
            }
            let mu = mu_c + (1.0 - mu_c) * u * u;
            nodes.push(Node { mu, weight: (1.0 - mu_c) * 2.0 * u * w, reflectance: reflectance_inside(eta, mu) });
        }
        Self { nodes }
    }

    /// Diffuse reflectance in [0, 1] per entered flux of light that enters along the normal, all orders, for 1 - α′ =
    /// `absorbed` in [0, 1]. Good to 1e-4 for isotropic scattering. With g ≠ 0 it is similarity: at g = 0.8 1 % high
    /// for α′ = 0.995, 5 % for 0.95 and 30 % for 0.64.
    pub fn reflectance(&self, absorbed: f64) -> f64 {
        let albedo = 1.0 - absorbed;
        if albedo <= 0.0 {
            return 0.0;
        }
        let h = self.h_function(absorbed);
        // Radiance that arrives at the boundary from inside, of a beam of unit flux straight down:
        //   U_0(mu) = α/4π H(mu) H(1) / (mu + 1)
        let h_one = self.h_at(1.0, absorbed, &h);
        let first: Vec<f64> = std::iter::zip(&self.nodes, &h)
            .map(|(n, h)| albedo / (4.0 * std::f64::consts::PI) * h * h_one / (n.mu + 1.0))
            .collect();
        self.leaving(albedo, &h, first)
    }

    /// The same under even light, which comes from all directions of the outside with one radiance: the colour of a thick body on a
    /// cloudy day, without what the surface mirrors.
    pub fn even_reflectance(&self, absorbed: f64) -> f64 {
        let albedo = 1.0 - absorbed;
        if albedo <= 0.0 {
            return 0.0;
        }
        let h = self.h_function(absorbed);
        // Inside, even light of radiance 1 (over η²) is T(mu), and its flux 2π ∫ mu T(mu) dmu.
        let entered: Vec<f64> = self.nodes.iter().map(|n| n.weight * n.mu * (1.0 - n.reflectance)).collect();
        let flux = 2.0 * std::f64::consts::PI * entered.iter().sum::<f64>();
        //   U_0(mu) = α/2 ∫ H(mu) H(mu') / (mu + mu') mu' T(mu') dmu'
        let first: Vec<f64> = std::iter::zip(&self.nodes, &h)
            .map(|(n, at)| {
                let sum: f64 = (0..h.len()).map(|j| h[j] * entered[j] / (n.mu + self.nodes[j].mu)).sum();
                0.5 * albedo * at * sum / flux
            })
            .collect();
        self.leaving(albedo, &h, first)
    }

    /// The medium's 1 - α′ whose [`Self::even_reflectance`] is `colour`: good to some 1e-4 of it, as that is.
    ///
    /// # Errors
    /// A colour outside [0, 1).
    pub fn absorbed_of(&self, colour: f64) -> Result<f64> {
        if !(0.0..1.0).contains(&colour) {
            return Err(Error::scene(format!(
                "a colour of {colour} is of no medium that absorbs: below 1 and not negative"
            )));
        }
        if colour == 0.0 {
            return Ok(1.0);
        }
        // Over the root of what is absorbed the curve is nearly straight where it is bright. False position (Illinois).
        let over = |root: f64| self.even_reflectance(root * root) - colour;
        let (mut low, mut high) = ([0.0, over(0.0)], [1.0, -colour]);
        if low[1] <= 0.0 {
            return Ok(0.0);
        }
        let mut last = 0.0;
        for _ in 0..60 {
            let root = (low[0] * high[1] - high[0] * low[1]) / (high[1] - low[1]);
            let value = over(root);
            if value.abs() < 1e-9 * colour {
                return Ok(root * root);
            }
            // A side that stays twice has its value halved.
            if value > 0.0 {
                high[1] *= if last > 0.0 { 0.5 } else { 1.0 };
                low = [root, value];
            } else {
                low[1] *= if last < 0.0 { 0.5 } else { 1.0 };
                high = [root, value];
            }
            last = value;
        }
        Ok((0.5 * (low[0] + high[0])).powi(2))
    }

    /// Flux that leaves, where radiance `first` arrives at the boundary before that sends any back:
    ///   U(mu) = U_0(mu) + α/2 ∫ H(mu) H(mu') / (mu + mu') mu' R(mu') U(mu') dmu'.
    fn leaving(&self, albedo: f64, h: &[f64], first: Vec<f64>) -> f64 {
        let mut arriving = first.clone();
        for _ in 0..MAX_ROUNDS {
            let back: Vec<f64> =
                std::iter::zip(&self.nodes, &arriving).map(|(n, u)| n.weight * n.mu * n.reflectance * u).collect();
            let next: Vec<f64> = (0..self.nodes.len())
                .map(|i| {
                    let again: f64 =
                        (0..self.nodes.len()).map(|j| h[j] * back[j] / (self.nodes[i].mu + self.nodes[j].mu)).sum();
                    first[i] + 0.5 * albedo * h[i] * again
                })
                .collect();
            let change = std::iter::zip(&next, &arriving).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            arriving = next;
            if change < TOLERANCE {
                break;
            }
        }
        let leaving: f64 =
            std::iter::zip(&self.nodes, &arriving).map(|(n, u)| n.weight * n.mu * (1.0 - n.reflectance) * u).sum();
        (2.0 * std::f64::consts::PI * leaving).min(1.0)
    }

    /// H at the nodes, from 1/H(mu) = sqrt(1 - α) + α/2 ∫ mu' H(mu') / (mu + mu') dmu', which converges for α = 1 too.
    fn h_function(&self, absorbed: f64) -> Vec<f64> {
        let mut h = vec![1.0; self.nodes.len()];
        for _ in 0..MAX_ROUNDS {
            let next: Vec<f64> = self.nodes.iter().map(|n| self.h_at(n.mu, absorbed, &h)).collect();
            let change = std::iter::zip(&next, &h).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The mean of old and new damps the alternation of this iteration.
            for (h, next) in std::iter::zip(&mut h, &next) {
                *h = 0.5 * (*h + next);
            }
            if change < TOLERANCE {
                break;
            }
        }
        h
    }

    fn h_at(&self, mu: f64, absorbed: f64, h: &[f64]) -> f64 {
        let sum: f64 = std::iter::zip(&self.nodes, h).map(|(n, h)| n.weight * n.mu * h / (mu + n.mu)).sum();
        1.0 / (absorbed.sqrt() + 0.5 * (1.0 - absorbed) * sum)
    }
}

const MAX_ROUNDS: usize = 500;
const TOLERANCE: f64 = 1e-12;

fn reflectance_inside(eta: f64, mu: f64) -> f64 {
    fresnel::split(1.0 / eta, mu).reflectance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_lost_without_absorption() {
        for eta in [0.75, 1.0, 1.05, 1.3, 1.5, 2.5, 4.0] {
            let total = HalfSpace::new(eta).reflectance(0.0);
            assert!((total - 1.0).abs() < 2e-5, "eta {eta}: {total}");
        }
    }

    /// Photons of even light, walked here: from a cosine direction through the boundary, mirrored there inside, until they leave or are
    /// absorbed.
    #[test]
    fn even_light_is_walked() {
        use crate::math::{hash, unit_f32};
        let mut count = 0_u64;
        let mut number = || {
            count += 1;
            f64::from(unit_f32((hash(count) >> 32) as u32))
        };
        for (eta, absorbed) in [(1.3, 0.01), (1.3, 0.2), (1.5, 0.003), (1.0, 0.05)] {
            let (half_space, photons) = (HalfSpace::new(eta), 60_000);
            let (mut entered, mut left) = (0.0, 0.0);
            for _ in 0..photons {
                let outside = fresnel::split(eta, number().sqrt());
                let (mut mu, mut depth, mut weight) = (-outside.cosine, 0.0, outside.transmittance);
                entered += weight;
                while weight > 1e-4 {
                    depth += mu * (1.0 - number()).ln();
                    while depth < 0.0 {
                        let back = reflectance_inside(eta, mu);
                        left += weight * (1.0 - back);
                        weight *= back;
                        (depth, mu) = (-depth, -mu);
                    }
                    (weight, mu) = (weight * (1.0 - absorbed), 2.0 * number() - 1.0);
                }
            }
            let (walked, ours) = (left / entered, half_space.even_reflectance(absorbed));
            // A photon's share varies by less than 0.5.
            let error = 0.5 / f64::from(photons).sqrt();
            assert!((walked - ours).abs() < 4.0 * error, "eta {eta}, 1 - α {absorbed}: {ours}, walked {walked}");
            let straight = half_space.reflectance(absorbed);
            assert!(ours > straight, "slanted light turns round sooner: {ours}, straight {straight}");
        }
    }

    #[test]
    fn colours_come_back() {
        for eta in [0.75, 1.0, 1.3, 1.5, 2.5] {
            let half_space = HalfSpace::new(eta);
            assert!((half_space.even_reflectance(0.0) - 1.0).abs() < 5e-5, "{eta}");
            for colour in [0.0, 1e-4, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999] {
                let back = half_space.even_reflectance(half_space.absorbed_of(colour).unwrap());
                assert!((back - colour).abs() <= 1e-8 * colour, "eta {eta}: {colour} came back as {back}");
            }
            for wrong in [-0.1, 1.0, f64::NAN] {
                assert!(half_space.absorbed_of(wrong).is_err());
            }
        }
    }

    /// Own Monte Carlo of the transfer equation (see tests/data/README.md), 1e7 to 2e7 photons, total per entered flux and standard error.
    #[test]
    fn monte_carlo_agrees() {
        let runs = [
            (1.3, 0.001, 0.871_556_974, 8.1e-5),
            (1.3, 0.001_420_573_243, 0.849_354_605, 6.1e-5),
            (1.3, 0.01, 0.656_723_416, 1.13e-4),
            (1.3, 0.022_817_460_32, 0.536_825_976, 8.3e-5),
            (1.3, 0.090_909_090_91, 0.306_586_081, 7.4e-5),
            (1.3, 0.1, 0.290_936_304, 1.03e-4),
            (1.3, 0.5, 0.063_587_941, 4.5e-5),
            (1.5, 0.000_957_985_5, 0.837_940_170, 6.3e-5),
            (1.5, 0.1, 0.229_135_203, 9.6e-5),
            (1.0, 0.01, 0.752_726_962, 1.03e-4),
            (1.0, 0.1, 0.414_712_944, 1.11e-4),
            (0.75, 0.01, 0.744_046_607, 1.04e-4),
            (0.75, 0.1, 0.401_116_651, 1.11e-4),
        ];
        for (eta, absorbed, total, error) in runs {
            let ours = HalfSpace::new(eta).reflectance(absorbed);
            assert!((ours - total).abs() < 6.0 * error, "eta {eta}, 1 - α {absorbed}: {ours} against {total}");
        }
    }
}
