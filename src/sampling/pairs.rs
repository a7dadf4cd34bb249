//! Many first pairs of a stream's numbers at once, and directions from them: what [`PixelStream::split`], `next_2d` and
//! `cosine_hemisphere` give one by one, to the bit, in loops that the compiler vectorises.

use super::sobol::two;
use super::stream::PixelStream;
use super::warp::hemisphere;
use crate::math::{Kernel, Level, Vec3, dispatch_at};

/// Where pairs stand in their sequences.
#[derive(Clone, Debug, Default)]
pub struct Pairs {
    index: Vec<u32>,
    seed: Vec<u32>,
}

impl Pairs {
    /// None yet, with room for `count`.
    pub fn with_capacity(count: usize) -> Self {
        Self { index: Vec::with_capacity(count), seed: Vec::with_capacity(count) }
    }

    /// Adds the first pair of a new stream, which goes on behind it.
    pub fn push(&mut self, stream: &mut PixelStream) {
        let (index, seed) = stream.take_place();
        self.index.push(index);
        self.seed.push(seed);
    }

    /// Adds the first pair of every part of [`PixelStream::split`] into `parts`, in order.
    pub fn push_splits(&mut self, stream: &PixelStream, parts: u32) {
        for (index, seed) in stream.split_places(parts) {
            self.index.push(index);
            self.seed.push(seed);
        }
    }

    /// The pairs themselves, in [0, 1).
    pub fn numbers(&self) -> Vec<[f32; 2]> {
        self.numbers_at(Level::best())
    }

    fn numbers_at(&self, level: Level) -> Vec<[f32; 2]> {
        let mut out = vec![[0.0; 2]; self.index.len()];
        dispatch_at(level, Numbers { index: &self.index, seed: &self.seed, out: &mut out });
        out
    }

    /// A unit direction of density cosθ/π about z for each pair, z above 0.
    pub fn cosine_hemisphere(&self) -> Vec<Vec3> {
        self.cosine_hemisphere_at(Level::best())
    }

    fn cosine_hemisphere_at(&self, level: Level) -> Vec<Vec3> {
        let mut out = vec![Vec3::ZERO; self.index.len()];
        dispatch_at(level, Directions { index: &self.index, seed: &self.seed, out: &mut out });
        out
    }
}

struct Numbers<'a> {
    index: &'a [u32],
    seed: &'a [u32],
    out: &'a mut [[f32; 2]],
}

impl Kernel for Numbers<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        for ((index, seed), out) in self.index.iter().zip(self.seed).zip(self.out) {
            *out = two(*index, *seed);
        }
    }
}

struct Directions<'a> {
    index: &'a [u32],
    seed: &'a [u32],
    out: &'a mut [Vec3],
}

/// Pairs in one turn of the loop.
const TURN: usize = 16;

impl Kernel for Directions<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let all = self.index.chunks(TURN).zip(self.seed.chunks(TURN)).zip(self.out.chunks_mut(TURN));
        for ((index, seed), out) in all {
            let (mut i, mut s) = ([0; TURN], [0; TURN]);
            i[..index.len()].copy_from_slice(index);
            s[..seed.len()].copy_from_slice(seed);
            let (mut x, mut y, mut z) = ([0.0; TURN], [0.0; TURN], [0.0; TURN]);
            for k in 0..TURN {
                let [u, v] = two(i[k], s[k]);
                [x[k], y[k], z[k]] = hemisphere([u, v]);
            }
            for (k, out) in out.iter_mut().enumerate() {
                *out = Vec3::new(x[k], y[k], z[k]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cosine_hemisphere;
    use super::*;
    use crate::math::frame;

    #[test]
    fn pairs_are_the_numbers_of_the_streams() {
        let (mut pairs, mut expected) = (Pairs::default(), Vec::new());
        let n = Vec3::new(0.6, -0.64, 0.48);
        // Also where parts go on into the next sequence of 2^32.
        for (pixel, sample, parts) in
            [(0, 0, 1), (5, 17, 4), (1 << 20, u32::MAX, 3), (77, 613_566_756, 7), (8, 70_000, 33)]
        {
            let mut stream = PixelStream::new(3, pixel, sample);
            stream.next_2d();
            pairs.push_splits(&stream, parts);
            expected.extend((0..parts).map(|part| cosine_hemisphere(n, stream.split(part, parts).next_2d())));
        }
        let mut first = Pairs::default();
        let alone: Vec<[f32; 2]> = (0..100)
            .map(|pixel| {
                let mut stream = PixelStream::new(9, pixel, 3);
                let (mut pushed, pair) = (stream, stream.next_2d());
                first.push(&mut pushed);
                assert_eq!(pushed.next_2d(), stream.next_2d());
                pair
            })
            .collect();
        for level in Level::available() {
            assert_eq!(first.numbers_at(level), alone, "{level:?}");
            let got = pairs.cosine_hemisphere_at(level);
            assert_eq!(got.len(), expected.len());
            for (local, expected) in got.into_iter().zip(&expected) {
                assert_eq!(frame(n) * local, *expected, "{level:?}");
            }
        }
    }
}
