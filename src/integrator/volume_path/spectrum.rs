//! Three channels on one path: distances are drawn for one of them, the weights hold for all.

use crate::math::Rgb;
use crate::optics::Medium;

/// Coefficients of a medium as a path needs them.
#[derive(Clone, Debug)]
pub struct Coefficients {
    /// Extinction [1/unit].
    pub sigma_t: Rgb,
    /// σ_s / σ_t; 0 where there is no medium.
    pub albedo: Rgb,
    /// ln σ_t, so that a product over collisions is a sum.
    ln_sigma_t: [f64; 3],
    ln_albedo: [f64; 3],
    /// One set of distances for all channels.
    grey: bool,
}

impl Coefficients {
    /// Of `medium`.
    pub fn new(medium: &Medium) -> Self {
        let sigma_t = medium.sigma_t();
        let albedo = |c: usize| {
            let (s, a) = (f64::from(medium.sigma_s[c]), f64::from(medium.sigma_a[c]));
            if s > 0.0 { s / (s + a) } else { 0.0 }
        };
        Self {
            sigma_t,
            albedo: Rgb::from_fn(|c| albedo(c) as f32),
            ln_sigma_t: std::array::from_fn(|c| f64::from(sigma_t[c]).ln()),
            ln_albedo: std::array::from_fn(|c| albedo(c).ln()),
            grey: sigma_t.is_grey(),
        }
    }
}

/// What a path carries in each channel: the weight a distance sampler of that channel alone would have given it, times
/// the channel's share of the density with which the path was made.
///
/// One channel, the hero, is drawn at the start with equal chances and makes all distances. A path could have been made
/// by each of the three; with densities p_c along it and a_c = f_c / p_c, the balance heuristic [VG95] over the whole
/// path is f_c / mean(p) = a_c · p_c / mean(p), at most 3 a_c: no channel has heavy tails. a_c is the product of albedos,
/// Fresnel factors and colours. Inside a medium only the number of collisions and the distance flown are counted; the
/// weights are formed from both when asked for.
#[derive(Clone, Copy, Debug)]
pub struct Spectrum {
    /// a_c up to the entry into the present medium.
    weight: Rgb,
    /// p_c / mean(p) up to there.
    share: Rgb,
    hero: usize,
    collisions: u32,
    /// Flown in the present medium [unit].
    length: f64,
}

impl Spectrum {
    /// A path of weight `weight`; `u` in [0, 1) picks the hero.
    pub fn new(weight: Rgb, u: f32) -> Self {
        Self { weight, share: Rgb::WHITE, hero: ((u * 3.0) as usize).min(2), collisions: 0, length: 0.0 }
    }

    /// A distance with density σ_t exp(-σ_t d) of the hero, from `u` in [0, 1); infinite in a void.
    #[inline]
    pub fn distance(&self, medium: &Coefficients, u: f32) -> f32 {
        let sigma_t = medium.sigma_t[self.hero];
        // Not by the quotient alone: u = 0 would make 0/0.
        if sigma_t > 0.0 { -(1.0 - u).ln() / sigma_t } else { f32::INFINITY }
    }

    /// Flown without collision.
    #[inline]
    pub fn fly(&mut self, distance: f32) {
        self.length += f64::from(distance);
    }

    /// Flown, and scattered there.
    #[inline]
    pub fn collide(&mut self, distance: f32) {
        self.length += f64::from(distance);
        self.collisions += 1;
    }

    /// Times a factor of every channel's own: a colour, a Fresnel factor, the inverse of a chance to go on.
    #[inline]
    pub fn scale(&mut self, factor: Rgb) {
        self.weight = self.weight * factor;
    }

    /// Passed by an event of which a path of each channel keeps the share `kept`, and that it takes with the chance `chance`.
    #[inline]
    pub fn pass(&mut self, kept: Rgb, chance: Rgb) {
        self.weight = self.weight * kept;
        let share = self.share * chance;
        self.share = share / share.mean();
    }

    /// The channel that is drawn.
    #[inline]
    pub fn hero(&self) -> usize {
        self.hero
    }

    /// a_c and p_c / mean(p) now.
    fn now(&self, medium: &Coefficients) -> (Rgb, Rgb) {
        let k = f64::from(self.collisions);
        let times = |ln: f64| if self.collisions > 0 { (k * ln).exp() as f32 } else { 1.0 };
        let weight = if medium.albedo.is_grey() {
            self.weight * times(medium.ln_albedo[0])
        } else {
            self.weight * Rgb::from_fn(|c| times(medium.ln_albedo[c]))
        };
        if medium.grey {
            return (weight, self.share);
        }
        let ln_density = |c: usize| {
            let collided = if self.collisions > 0 { k * medium.ln_sigma_t[c] } else { 0.0 };
            collided - f64::from(medium.sigma_t[c]) * self.length
        };
        let hero = ln_density(self.hero);
        let share = Rgb::from_fn(|c| {
            if c == self.hero { self.share[c] } else { self.share[c] * (ln_density(c) - hero).min(80.0).exp() as f32 }
        });
        (weight, share / share.mean())
    }

    /// The path's weight in each channel.
    #[inline]
    pub fn value(&self, medium: &Coefficients) -> Rgb {
        let (weight, share) = self.now(medium);
        weight * share
    }

    /// The same outside all media.
    #[inline]
    pub fn value_outside(&self) -> Rgb {
        self.weight * self.share
    }

    /// Closes the account of a medium that the path leaves.
    pub fn leave(&mut self, medium: &Coefficients) {
        (self.weight, self.share) = self.now(medium);
        (self.collisions, self.length) = (0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::volume_path::draws::PathSampler;

    fn medium() -> Coefficients {
        Coefficients::new(&Medium { sigma_s: Rgb([0.7, 2.0, 9.0]), sigma_a: Rgb([0.0, 0.5, 0.1]), g: 0.0, eta: 1.0 })
    }

    /// Transmittance over a length, and the mean of any function of the third collision, are right in all channels, and
    /// no weight is above 3 times its share of albedo.
    #[test]
    fn one_hero_serves_three_channels() {
        let medium = medium();
        let n = 400_000;
        let mut passed = [[0.0_f64; 2]; 3];
        for i in 0..n {
            let mut draws = PathSampler::new(&[i as f32 / n as f32], i);
            let mut path = Spectrum::new(Rgb::WHITE, draws.number());
            // Three flights, then up to the length 1.
            let (mut length, mut hits) = (0.0, 0);
            while hits < 3 {
                let d = path.distance(&medium, draws.number());
                if length + d > 1.0 {
                    path.fly(1.0 - length);
                    break;
                }
                path.collide(d);
                (length, hits) = (length + d, hits + 1);
            }
            let value = path.value(&medium);
            assert!(value.max() <= 3.000_1, "{value:?}");
            if hits == 2 {
                for c in 0..3 {
                    let v = f64::from(value[c]);
                    passed[c] = [passed[c][0] + v, passed[c][1] + v * v];
                }
            }
        }
        for (c, sums) in passed.into_iter().enumerate() {
            // Two collisions in a length of 1: (σ_s)²/2 exp(-σ_t).
            let (s, t) = (f64::from(medium.albedo[c] * medium.sigma_t[c]), f64::from(medium.sigma_t[c]));
            let expected = 0.5 * s * s * (-t).exp();
            let mean = sums[0] / n as f64;
            let error = ((sums[1] / n as f64 - mean * mean) / n as f64).sqrt();
            assert!(((mean - expected) / error).abs() < 6.0, "{c}: {mean} +- {error}, expected {expected}");
        }
    }

    /// One channel of three has no medium, and no number whatever makes a length that is none.
    #[test]
    fn a_void_is_crossed_whatever_the_number() {
        let medium = Coefficients::new(&Medium {
            sigma_s: Rgb([0.0, 2.0, 0.0]),
            sigma_a: Rgb([0.0, 0.5, 1.0]),
            g: 0.0,
            eta: 1.0,
        });
        for u in [0.0, f32::MIN_POSITIVE, 0.5, 1.0 - f32::EPSILON / 2.0] {
            let distance = |hero| Spectrum::new(Rgb::WHITE, (hero as f32 + 0.5) / 3.0).distance(&medium, u);
            assert_eq!(distance(0), f32::INFINITY, "{u}");
            for hero in [1, 2] {
                assert!(distance(hero).is_finite() && distance(hero) >= 0.0, "{u}");
            }
        }
        // Through the void and out: nothing is lost in the empty channel, exp(-1) in the absorbing one.
        let mut path = Spectrum::new(Rgb::WHITE, 0.1);
        path.fly(1.0);
        let value = path.value(&medium);
        assert!(value.is_finite() && value[0] > 0.0, "{value:?}");
    }
}
