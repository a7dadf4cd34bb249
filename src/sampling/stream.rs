//! The numbers of one sample of one pixel.

use super::sobol;
use crate::math::hash_combine;

/// Owen-scrambled Sobol numbers [Burley 2020] of one pixel sample, in sets of four dimensions; each set of
/// each pixel is scrambled on its own. A pure function of (seed, pixel, sample, dimension): copies and
/// threads cannot disturb it.
#[derive(Clone, Copy, Debug)]
pub struct PixelStream {
    key: u64,
    index: u32,
    dimension: u32,
}

impl PixelStream {
    /// The stream of sample number `sample` of pixel number `pixel`.
    pub fn new(seed: u64, pixel: u64, sample: u32) -> Self {
        // The zero keeps the numbers of earlier versions.
        Self { key: hash_combine(hash_combine(seed, pixel), 0), index: sample, dimension: 0 }
    }

    /// The next two dimensions, in [0, 1).
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        // A pair never straddles two sets of four, and a set costs little more than one of its dimensions.
        let first = self.dimension.next_multiple_of(2);
        self.dimension = first + 2;
        if first.is_multiple_of(4) {
            return sobol::two(self.index, self.set_seed(first));
        }
        let [_, _, c, d] = sobol::four(self.index, self.set_seed(first));
        [c, d]
    }

    /// The next whole set of four dimensions, in [0, 1): stratified together.
    #[inline]
    pub fn next_4d(&mut self) -> [f32; 4] {
        let first = self.dimension.next_multiple_of(4);
        self.dimension = first + 4;
        sobol::four(self.index, self.set_seed(first))
    }

    /// The next dimension, in [0, 1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let value = sobol::one(self.index, self.dimension as usize % 4, self.set_seed(self.dimension));
        self.dimension += 1;
        value
    }

    /// Each set of four dimensions is scrambled on its own.
    #[inline]
    fn set_seed(&self, dimension: u32) -> u32 {
        hash_combine(self.key, u64::from(dimension / 4)) as u32
    }

    /// Part `part` of `parts` when one sample needs several of the same kind (occlusion rays, light
    /// samples): all parts of all samples of a pixel form one Sobol sequence. It starts a new set of
    /// dimensions; the caller goes on with [`Self::skip_split`].
    #[inline]
    pub fn split(&self, part: u32, parts: u32) -> Self {
        let index = u64::from(self.index) * u64::from(parts) + u64::from(part);
        let key = hash_combine(self.key, u64::from(self.dimension / 4) | 1 << 40);
        // After 2^32 points a new sequence, scrambled on its own.
        Self { key: hash_combine(key, index >> 32), index: index as u32, dimension: 0 }
    }

    /// Index and scramble of the first dimensions of a stream of which none was used; the first two are then.
    pub(super) fn take_place(&mut self) -> (u32, u32) {
        debug_assert_eq!(self.dimension, 0);
        self.dimension = 2;
        (self.index, self.set_seed(0))
    }

    /// Index and scramble of the first dimensions of every part, as [`Self::split`] has them.
    pub(super) fn split_places(&self, parts: u32) -> impl Iterator<Item = (u32, u32)> {
        let first = u64::from(self.index) * u64::from(parts);
        let (mut sequence, mut seed) = (None, 0);
        let this = *self;
        (0..parts).map(move |part| {
            let index = first + u64::from(part);
            let of = index >> 32;
            if sequence != Some(of) {
                (sequence, seed) = (Some(of), this.split(part, parts).set_seed(0));
            }
            (index as u32, seed)
        })
    }

    /// The same sample's numbers for another purpose, scrambled on their own.
    #[inline]
    #[must_use]
    pub fn aside(&self, purpose: u64) -> Self {
        Self { key: hash_combine(self.key, purpose | 1 << 41), index: self.index, dimension: 0 }
    }

    /// Goes on to dimensions that no earlier [`Self::split`] of this stream has used.
    #[inline]
    pub fn skip_split(&mut self) {
        self.dimension = (self.dimension / 4 + 1) * 4;
    }

    /// A key for numbers that need no stratification, such as one decision for each cached sample.
    #[inline]
    pub fn key(&self) -> u64 {
        hash_combine(hash_combine(self.key, u64::from(self.index)), u64::from(self.dimension))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_a_pure_function_of_its_arguments() {
        let numbers = |seed, pixel, sample| {
            let mut s = PixelStream::new(seed, pixel, sample);
            [s.next_1d(), s.next_2d()[0], s.next_2d()[1]].map(f32::to_bits)
        };
        assert_eq!(numbers(1, 2, 3), numbers(1, 2, 3));
        for other in [numbers(2, 2, 3), numbers(1, 3, 3), numbers(1, 2, 4), numbers(1, 2, 3 + (1 << 31))] {
            assert_ne!(other, numbers(1, 2, 3));
        }
    }

    #[test]
    fn a_pair_is_the_next_two_numbers() {
        for start in 0..6 {
            let mut pair = PixelStream { dimension: start, ..PixelStream::new(5, 6, 7) };
            let mut single = PixelStream { dimension: start.next_multiple_of(2), ..pair };
            assert_eq!(pair.next_2d(), [single.next_1d(), single.next_1d()]);
            assert_eq!(pair.dimension, single.dimension);
        }
    }

    #[test]
    fn a_set_of_four_is_two_pairs_and_another_purpose_has_other_numbers() {
        for start in [0, 3, 4] {
            let mut four = PixelStream { dimension: start, ..PixelStream::new(5, 6, 7) };
            let mut pairs = PixelStream { dimension: start.next_multiple_of(4), ..four };
            let [a, b, c, d] = four.next_4d();
            assert_eq!([[a, b], [c, d]], [pairs.next_2d(), pairs.next_2d()]);
            assert_eq!(four.dimension, pairs.dimension);
        }
        let stream = PixelStream::new(5, 6, 7);
        let numbers = [stream, stream.aside(1), stream.aside(2), stream.split(0, 1)].map(|mut s| s.next_2d());
        assert!((1..4).all(|i| (0..i).all(|j| numbers[i] != numbers[j])), "{numbers:?}");
    }

    /// 256 samples of a pixel put one point into each of the 256 elementary boxes of a pair of dimensions.
    #[test]
    fn samples_of_a_pixel_are_stratified() {
        for splits in [1_u32, 4] {
            let mut boxes = [0; 256];
            for sample in 0..256 / splits {
                for part in 0..splits {
                    let mut s = PixelStream::new(7, 11, sample).split(part, splits);
                    let [u, v] = s.next_2d();
                    boxes[(u * 16.0) as usize * 16 + (v * 16.0) as usize] += 1;
                }
            }
            assert!(boxes.iter().all(|&n| n == 1), "{splits}: {boxes:?}");
        }
    }
}
