//! The Sobol sequence and its scrambling, for all streams.

use sobol_burley::parts::{hash, owen_scramble_rev, u32_to_f32_norm};

/// Dimensions of the sequence.
pub const DIMENSIONS: usize = 8;

/// Primitive polynomial (degree, inner coefficients) and first direction numbers of dimensions 3.. [Joe, Kuo 2008].
const JOE_KUO: [(usize, u32, [u32; 5]); DIMENSIONS - 2] = [
    (2, 1, [1, 3, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0]),
    (4, 4, [1, 3, 5, 13, 0]),
    (5, 2, [1, 1, 5, 5, 17]),
];

/// What each four bits of an index bring, bits reversed: \[dimension - 2\]\[which four\]\[their value\].
static BROUGHT: [[[u32; 16]; 8]; DIMENSIONS - 2] = {
    let mut all = [[[0; 16]; 8]; DIMENSIONS - 2];
    let mut d = 0;
    while d < all.len() {
        let vectors = directions(JOE_KUO[d]);
        let mut bit = 0;
        while bit < 32 {
            let mut value = 0;
            while value < 16 {
                if value >> (bit % 4) & 1 == 1 {
                    all[d][bit / 4][value] ^= vectors[bit].reverse_bits();
                }
                value += 1;
            }
            bit += 1;
        }
        d += 1;
    }
    all
};

/// Direction numbers by the recurrence of the polynomial.
const fn directions((degree, inner, first): (usize, u32, [u32; 5])) -> [u32; 32] {
    let mut v = [0; 32];
    let mut bit = 0;
    while bit < 32 {
        if bit < degree {
            v[bit] = first[bit] << (31 - bit);
        } else {
            v[bit] = v[bit - degree] ^ (v[bit - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if inner >> (degree - 1 - k) & 1 == 1 {
                    v[bit] ^= v[bit - k];
                }
                k += 1;
            }
        }
        bit += 1;
    }
    v
}

/// The first two dimensions of point `index`, bits reversed: the index itself, and its product with Pascal's triangle
/// modulo 2, which needs neither table nor branch.
#[inline(always)]
fn first_two(index: u32) -> [u32; 2] {
    let mut second = index;
    second ^= (second & 0xaaaa_aaaa) >> 1;
    second ^= (second & 0xcccc_cccc) >> 2;
    second ^= (second & 0xf0f0_f0f0) >> 4;
    second ^= (second & 0xff00_ff00) >> 8;
    second ^= (second & 0xffff_0000) >> 16;
    [index, second]
}

/// Dimension `dimension`, below [`DIMENSIONS`], of point `index`, bits reversed.
#[inline]
pub fn reversed(index: u32, dimension: usize) -> u32 {
    match dimension {
        0 | 1 => first_two(index)[dimension],
        _ => {
            BROUGHT[dimension - 2].iter().enumerate().fold(0, |sum, (k, of)| sum ^ of[(index >> (4 * k) & 15) as usize])
        }
    }
}

/// Owen's scrambling of a number of reversed bits [Burley 2020], with the hash of Vegdahl (2021): the number, 32 bits.
#[inline(always)]
pub fn scrambled(reversed: u32, scramble: u32) -> u32 {
    owen_scramble_rev(reversed, scramble).reverse_bits()
}

/// The number of the point that stands at `index` in the sequence shuffled by `seed`, each 2^16 among themselves.
#[inline(always)]
fn shuffled(index: u32, seed: u32) -> u32 {
    const BLOCK: u32 = 0xffff;
    index & !BLOCK | scrambled(index.reverse_bits(), hash(seed ^ 0x79c6_8e4a)) & BLOCK
}

/// Number of a set of four, in [0, 1), from its reversed bits.
#[inline(always)]
fn number(reversed: u32, dimension: usize, seed: u32) -> f32 {
    let of = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];
    u32_to_f32_norm(scrambled(reversed, hash(seed.wrapping_mul(0x9c8f_2d3b) ^ of[dimension])))
}

/// Dimension `dimension`, of four, of point `index` of the shuffled and scrambled sequence of `seed`, in [0, 1).
#[inline]
pub fn one(index: u32, dimension: usize, seed: u32) -> f32 {
    number(reversed(shuffled(index, seed), dimension), dimension, seed)
}

/// The first two of [`four`].
#[inline(always)]
pub fn two(index: u32, seed: u32) -> [f32; 2] {
    let [a, b] = first_two(shuffled(index, seed));
    [number(a, 0, seed), number(b, 1, seed)]
}

/// Point `index` of the shuffled and scrambled sequence of `seed`: four dimensions stratified together, in [0, 1).
#[inline]
pub fn four(index: u32, seed: u32) -> [f32; 4] {
    let index = shuffled(index, seed);
    let [a, b] = first_two(index);
    let reversed = [a, b, reversed(index, 2), reversed(index, 3)];
    std::array::from_fn(|d| number(reversed[d], d, seed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash_combine;

    /// In the upper 16 bits, which is all that the crate tabulates.
    #[test]
    fn points_are_those_of_the_published_table() {
        let published = |i: u32, d: u32| sobol_burley::parts::sobol_rev(i.reverse_bits(), d);
        for d in 0..DIMENSIONS {
            for i in (0..2000).chain([32_767, 40_000, 65_535]) {
                assert_eq!(reversed(i, d) & 0xffff, published(i, d as u32) & 0xffff, "dimension {d}, point {i}");
            }
        }
    }

    /// The lower bits too: a sequence of base 2 fills each interval of length 2^-32 once, so its matrix has full rank.
    #[test]
    fn every_dimension_is_a_permutation_of_all_32_bits() {
        for d in 0..DIMENSIONS {
            let mut rows: Vec<u32> = (0..32).map(|bit| reversed(1 << bit, d)).collect();
            for bit in 0..32 {
                let pivot = rows.iter().position(|r| r >> bit & 1 == 1).map(|i| rows.swap_remove(i));
                let pivot = pivot.unwrap_or_else(|| panic!("dimension {d}, bit {bit}"));
                rows.iter_mut().filter(|r| **r >> bit & 1 == 1).for_each(|r| *r ^= pivot);
            }
            let sum = |i: u64| reversed(hash_combine(1, i) as u32, d);
            assert!(
                (0..99)
                    .all(|i| reversed((hash_combine(1, i) ^ hash_combine(1, i + 1)) as u32, d) == sum(i) ^ sum(i + 1))
            );
        }
    }

    #[test]
    fn one_two_and_four_are_the_same_numbers_and_those_of_the_crate_as_far_as_it_goes() {
        for i in [0, 1, 2, 77, 1000, 65_535, 65_536, 1 << 31] {
            for seed in [0, 1, 0xdead_beef] {
                let [a, b, c, d] = four(i, seed);
                assert_eq!([a, b], two(i, seed));
                assert_eq!([a, b, c, d], std::array::from_fn(|d| one(i, d, seed)));
                if i < 65_536 {
                    assert_eq!([a, b, c, d], sobol_burley::sample_4d(i, 0, seed));
                }
            }
        }
    }
}
