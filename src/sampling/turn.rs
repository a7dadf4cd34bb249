//! Which numbers a pass draws: two streams take turns.

use crate::math::hash_combine;

/// The stream of a pass, and the pass's place in it.
///
/// Even passes continue one low-discrepancy stream, odd passes another one that is scrambled on its own. The means of
/// the two halves are therefore independent, and their difference is an honest measure of the error of the whole
/// (`film/self_error.rs`). Passes of a single stream repel each other by an amount that nothing in the picture tells.
/// The price is the repulsion between the halves; docs/convergence.md has it measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// 0 for even passes, 1 for odd ones.
    pub stream: usize,
    /// Seed of the stream.
    pub seed: u64,
    /// Passes of this stream before this one.
    pub number: u32,
}

impl Turn {
    /// Streams that take turns.
    pub const STREAMS: usize = 2;

    /// Seeds of the streams of a render with seed `seed`.
    pub fn seeds(seed: u64) -> [u64; Self::STREAMS] {
        [seed, hash_combine(seed, 0x6f64_6420)]
    }

    /// The turn of pass number `pass` of a render with seed `seed`.
    #[inline]
    pub fn of(seed: u64, pass: u32) -> Self {
        let stream = (pass & 1) as usize;
        Self { stream, seed: Self::seeds(seed)[stream], number: pass >> 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_streams_have_their_own_seeds_and_use_every_number_once() {
        let seen: Vec<Turn> = (0..8).map(|pass| Turn::of(5, pass)).collect();
        for stream in 0..2 {
            let own: Vec<&Turn> = seen.iter().filter(|t| t.stream == stream).collect();
            assert!(own.iter().all(|t| t.seed == own[0].seed));
            assert_eq!(own.iter().map(|t| t.number).collect::<Vec<_>>(), [0, 1, 2, 3]);
        }
        assert_ne!(seen[0].seed, seen[1].seed);
        assert_ne!(Turn::of(5, 1).seed, Turn::of(6, 1).seed);
    }
}
