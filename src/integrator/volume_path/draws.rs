//! The numbers of one path: well spread at first, then as many as it takes.

use crate::math::{Vec3, hash, hash_combine, unit_f32};

/// Most numbers that are stratified over the samples of a pixel or over photons; those after them are hashes.
const SPREAD: usize = 4;

/// A pure function of (key, count): two paths with other keys share nothing.
#[derive(Clone, Debug)]
pub struct PathSampler {
    spread: [f32; SPREAD],
    given: u64,
    key: u64,
    drawn: u64,
}

impl PathSampler {
    /// Up to four `spread` numbers come first; the others follow from `key`.
    pub fn new(spread: &[f32], key: u64) -> Self {
        let mut first = [0.0; SPREAD];
        first[..spread.len()].copy_from_slice(spread);
        Self { spread: first, given: spread.len() as u64, key: hash_combine(key, 0x7061_7468), drawn: 0 }
    }

    /// Numbers of another key, for work that must not disturb these.
    pub fn fork(&self, tag: u64) -> Self {
        self.fork_with(&[], tag)
    }

    /// The same, with up to four `spread` numbers first.
    pub fn fork_with(&self, spread: &[f32], tag: u64) -> Self {
        Self::new(spread, hash_combine(self.key, tag))
    }

    #[inline]
    fn bits(&mut self) -> u64 {
        self.drawn += 1;
        hash(self.key.wrapping_add(self.drawn.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
    }

    /// In [0, 1).
    #[inline]
    pub fn number(&mut self) -> f32 {
        if self.drawn < self.given {
            self.drawn += 1;
            return self.spread[self.drawn as usize - 1];
        }
        unit_f32(self.bits() as u32)
    }

    /// Two of them.
    #[inline]
    pub fn pair(&mut self) -> [f32; 2] {
        if self.drawn < self.given {
            return [self.number(), self.number()];
        }
        let bits = self.bits();
        [unit_f32(bits as u32), unit_f32((bits >> 32) as u32)]
    }

    /// A direction, all alike; beyond the spread numbers by rejection [Marsaglia 1972].
    #[inline]
    pub fn direction(&mut self) -> Vec3 {
        if self.drawn < self.given {
            let [u, v] = self.pair();
            let (z, (sin, cos)) = (1.0 - 2.0 * u, (std::f32::consts::TAU * v).sin_cos());
            let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
            return Vec3::new(r * cos, r * sin, z);
        }
        loop {
            let [u, v] = self.pair().map(|u| 2.0 * u - 1.0);
            let s = u * u + v * v;
            if s < 1.0 {
                let root = 2.0 * (1.0 - s).sqrt();
                return Vec3::new(u * root, v * root, 1.0 - 2.0 * s);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_numbers_come_first_and_keys_differ() {
        let take = |key| {
            let mut draws = PathSampler::new(&[0.1, 0.2, 0.3, 0.4], key);
            (0..8).map(|_| draws.number()).collect::<Vec<_>>()
        };
        assert_eq!(take(1)[..4], [0.1, 0.2, 0.3, 0.4]);
        assert_eq!(take(1), take(1));
        assert_ne!(take(1)[4..], take(2)[4..]);
    }

    /// First and second moments of 10^5 directions, to 6 standard errors.
    #[test]
    fn directions_are_unit_and_lean_nowhere() {
        let mut draws = PathSampler::new(&[], 3);
        let n = 100_000;
        let (mut mean, mut square) = (Vec3::ZERO, Vec3::ZERO);
        for _ in 0..n {
            let w = draws.direction();
            assert!((w.length() - 1.0).abs() < 1e-5);
            (mean, square) = (mean + w / n as f32, square + w * w / n as f32);
        }
        let error = 6.0 / (n as f32).sqrt();
        assert!(mean.abs().max_element() < error * 0.578, "{mean}");
        assert!((square - 1.0 / 3.0).abs().max_element() < error * 0.299, "{square}");
    }
}
