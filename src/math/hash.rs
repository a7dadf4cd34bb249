//! Integers from integers without pattern, and uniform numbers from those.

/// A bijective mix of 64 bits (the finaliser of SplitMix64 [Steele et al. 2014]).
#[inline]
pub fn hash(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A hash of `value` that depends on `state`; chain it to hash several numbers in order.
#[inline]
pub fn hash_combine(state: u64, value: u64) -> u64 {
    hash(state.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ hash(value.wrapping_add(0x9e37_79b9_7f4a_7c15)))
}

/// Uniform in [0, 1) from the upper 24 of 32 bits; never rounds to 1.
#[inline]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Uniform in [0, 1) from 32 bits, exactly.
#[inline]
pub fn unit_f64(bits: u32) -> f64 {
    f64::from(bits) * (1.0 / 4_294_967_296.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_bits_stay_below_one() {
        assert!(unit_f32(u32::MAX) < 1.0);
        assert!(unit_f64(u32::MAX) < 1.0);
    }
}
