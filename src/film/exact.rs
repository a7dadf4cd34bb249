//! Sums that do not depend on the order of what is added, nor on how it was split: a number is cut into digits at fixed
//! places, digits of a place are added as integers, and the two highest places are kept [Demmel, Nguyen 2013].

/// Bits of a digit. An i64 then holds the sum of 2^27 digits.
const DIGIT: u32 = 36;
/// Numbers that may be added to one sum.
pub(super) const MOST: u32 = 1 << 26;
/// Places of digits, above the smallest f32 for sums and above its square for sums of squares.
pub(super) const PLACES: u8 = 17;

/// Digits at the highest place so far and at the one below; `top` counts places from 1, 0 is an empty sum.
///
/// Whatever was added first, the pair ends as the sums of the digits at the highest place of any number and at the
/// place below it. Digits lie in -2^35 ..= 2^35, so what is left out of each number, all lower digits, is at most half a
/// unit of the lower place: 2^-37 of the largest number added, in the worst case, and nothing at all for numbers down
/// to 2^-12 of it, whose 24 bits all lie in the two places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ExactSum {
    pub top: u8,
    pub digits: [i64; 2],
}

/// A finite f32 as whole · 2^(place - 149).
#[inline]
fn parts(value: f32) -> (i64, u32) {
    let bits = value.to_bits();
    let (exponent, fraction) = ((bits >> 23) & 0xff, i64::from(bits & 0x007f_ffff));
    let (whole, place) = if exponent == 0 { (fraction, 0) } else { (fraction | 0x0080_0000, exponent - 1) };
    (if bits >> 31 == 0 { whole } else { -whole }, place)
}

impl ExactSum {
    /// Adds a finite number.
    #[inline]
    pub fn add(&mut self, value: f32) {
        debug_assert!(value.is_finite());
        let (whole, place) = parts(value);
        // 24 bits moved by less than 36: fits, and ends in two digits.
        let moved = whole << (place % DIGIT);
        let low = low_digit(moved);
        self.digit_pair((place / DIGIT) as u8 + 1, low, (moved - low) >> DIGIT);
    }

    /// Adds the square of a finite number, to a sum that holds squares alone.
    #[inline]
    pub fn add_square(&mut self, value: f32) {
        let (whole, place) = parts(value);
        let (square, place) = (i128::from(whole * whole), 2 * place);
        let moved = square << (place % DIGIT);
        // 48 bits moved by less than 36: three digits.
        let low = low_digit(moved as i64);
        let rest = (moved - i128::from(low)) >> DIGIT;
        let middle = low_digit(rest as i64);
        let high = ((rest - i128::from(middle)) >> DIGIT) as i64;
        let at = (place / DIGIT) as u8 + 1;
        if high != 0 {
            self.digit_pair(at + 1, middle, high);
        } else {
            self.digit_pair(at, low, middle);
        }
    }

    /// Adds a number with the digits `low` at place `at` and `high` above it; lower ones, if any, are left out by whoever
    /// calls only where `high` is not 0.
    #[inline]
    fn digit_pair(&mut self, at: u8, low: i64, high: i64) {
        let top = if high != 0 {
            at + 1
        } else if low != 0 {
            at
        } else {
            return;
        };
        self.raise(top);
        // Digits of this number at our two places.
        let digit = |place: u8| {
            if place == at {
                low
            } else if place == at + 1 {
                high
            } else {
                0
            }
        };
        self.digits[1] += digit(self.top);
        self.digits[0] += digit(self.top - 1);
    }

    /// Makes `top` the highest place if it is higher; what lies below the two places goes.
    #[inline]
    fn raise(&mut self, top: u8) {
        match top.saturating_sub(self.top) {
            0 => return,
            1 => self.digits = [self.digits[1], 0],
            _ => self.digits = [0, 0],
        }
        self.top = top;
    }

    /// Adds all that `other` has had added.
    pub fn join(&mut self, other: &Self) {
        self.raise(other.top);
        match self.top - other.top {
            0 => {
                self.digits[0] += other.digits[0];
                self.digits[1] += other.digits[1];
            }
            1 => self.digits[0] += other.digits[1],
            _ => {}
        }
    }

    /// The sum in units of 2^`unit`, rounded to f64: -149 for numbers, -298 for squares.
    pub fn value(&self, unit: i32) -> f64 {
        if self.top == 0 {
            return 0.0;
        }
        let whole = (i128::from(self.digits[1]) << DIGIT) + i128::from(self.digits[0]);
        // The lower place starts DIGIT · (top - 2) above the unit; below it for a sum of the lowest place alone.
        times_power(whole as f64, unit + DIGIT as i32 * (i32::from(self.top) - 2))
    }
}

/// value · 2^exponent, exact wherever the result is a normal f64.
fn times_power(value: f64, exponent: i32) -> f64 {
    let half = exponent / 2;
    let power = |e: i32| f64::from_bits(((1023 + e) as u64) << 52);
    value * power(half) * power(exponent - half)
}

/// The remainder modulo 2^36 that is nearest to 0.
#[inline]
fn low_digit(value: i64) -> i64 {
    (value << (64 - DIGIT)) >> (64 - DIGIT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{hash, hash_combine};
    use proptest::prelude::*;

    fn of(values: &[f32]) -> ExactSum {
        let mut sum = ExactSum::default();
        values.iter().for_each(|&v| sum.add(v));
        sum
    }

    fn squares(values: &[f32]) -> ExactSum {
        let mut sum = ExactSum::default();
        values.iter().for_each(|&v| sum.add_square(v));
        sum
    }

    fn any_finite() -> impl Strategy<Value = f32> {
        prop_oneof![
            any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |v| v.is_finite()),
            -1.0_f32..1.0,
            Just(0.0),
            Just(-0.0),
            Just(f32::MAX),
            Just(-f32::from_bits(1)),
        ]
    }

    #[test]
    fn one_number_comes_back_exactly() {
        for i in 0..200_000 {
            let value = f32::from_bits(hash(i) as u32);
            if value.is_finite() {
                assert_eq!(of(&[value]).value(-149), f64::from(value), "{value:e}");
                let square = f64::from(value) * f64::from(value);
                let found = squares(&[value]).value(-298);
                assert!((found - square).abs() <= 2_f64.powi(-36) * square, "{value:e}: {found:e}");
            }
        }
        assert_eq!(of(&[f32::from_bits(1)]).value(-149), f64::from(f32::from_bits(1)));
    }

    #[test]
    fn numbers_of_like_size_add_up_without_any_error() {
        // Quarters: exact in f64 too.
        let values: Vec<f32> = (0..100_000).map(|i| (hash(i) % 4096) as f32 * 0.25 - 300.0).collect();
        let expected: f64 = values.iter().map(|&v| f64::from(v)).sum();
        assert_eq!(of(&values).value(-149), expected);
        let expected: f64 = values.iter().map(|&v| f64::from(v) * f64::from(v)).sum();
        assert_eq!(squares(&values).value(-298), expected);
    }

    #[test]
    fn sums_are_as_good_as_f64_for_samples_of_a_render() {
        // Over six decades, as bright paths among dim ones.
        let values: Vec<f32> =
            (0..65536).map(|i| 10_f32.powf((hash_combine(7, i) >> 40) as f32 / 2.8e6 - 4.0)).collect();
        let expected: f64 = values.iter().map(|&v| f64::from(v)).sum();
        assert!((of(&values).value(-149) / expected - 1.0).abs() < 1e-12);
        let expected: f64 = values.iter().map(|&v| f64::from(v) * f64::from(v)).sum();
        assert!((squares(&values).value(-298) / expected - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_most_numbers_fit() {
        // Each digit at most 2^35 (one more bit at the top place): MOST of them stay below 2^63.
        assert!(u64::from(MOST).ilog2() + DIGIT < 63);
        let highest = parts(f32::MAX).1;
        assert!(highest / DIGIT + 2 <= u32::from(PLACES) && 2 * highest / DIGIT + 3 <= u32::from(PLACES));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn neither_order_nor_split_matters(
            mut values in proptest::collection::vec(any_finite(), 0..40), cut in 0_usize..40, key in any::<u64>()
        ) {
            let (all, all_squares) = (of(&values), squares(&values));
            let cut = cut.min(values.len());
            let mut joined = of(&values[cut..]);
            joined.join(&of(&values[..cut]));
            prop_assert_eq!(joined, all);
            let mut joined = squares(&values[cut..]);
            joined.join(&squares(&values[..cut]));
            prop_assert_eq!(joined, all_squares);
            values.sort_by_key(|v| hash_combine(key, u64::from(v.to_bits())));
            prop_assert_eq!(of(&values), all);
            prop_assert_eq!(squares(&values), all_squares);
        }

        #[test]
        fn the_error_is_below_what_the_text_says(values in proptest::collection::vec(any_finite(), 1..40)) {
            // Against digits of 2^-149 in wide integers: exact for numbers below 2^-30, so scale them there.
            let largest = values.iter().fold(0.0_f64, |m, v| m.max(f64::from(*v).abs()));
            let mut exact: Vec<f64> = values.iter().map(|v| f64::from(*v)).collect();
            exact.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
            let expected: f64 = exact.iter().sum();
            let bound = values.len() as f64 * (2_f64.powi(-37) + 2_f64.powi(-50)) * largest;
            prop_assert!((of(&values).value(-149) - expected).abs() <= bound);
        }
    }
}
