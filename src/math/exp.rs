//! exp and expm1 in f32 without branches or calls, so that loops over them vectorise; made of additions and
//! multiplications that every machine rounds alike, so that their bits depend neither on the vector width nor on
//! the C library.

/// exp is 0 below: the smallest normal number is exp(-87.34).
const UNDERFLOW: f32 = -87.3;
/// Arguments above are taken as this one: exp stays finite.
const OVERFLOW: f32 = 88.0;
/// ln 2 in two parts; the first has 9 bits, so that its product with the exponent is exact.
const LN2_HI: f32 = 0.693_359_375;
const LN2_LO: f32 = -2.121_944_4e-4;
/// 1.5 · 2²³: adding it rounds to an integer, which then stands in the lowest bits.
const ROUND: f32 = 12_582_912.0;

/// exp(x) = 2^n (1 + p) with |p| < 0.42, for x in [-87.3, 88]: (2^n, p).
///
/// p = r + r² q(r) on |r| ≤ ln 2 / 2; q is our own weighted minimax fit of degree 4, relative error of p 1.4e-8.
#[inline(always)]
fn parts(x: f32) -> (f32, f32) {
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN2_HI) - n * LN2_LO;
    let q = 1.394_649_6e-3;
    let q = q * r + 8.366_611e-3;
    let q = q * r + 4.166_628e-2;
    let q = q * r + 0.166_665_43;
    let q = q * r + 0.5;
    // n moves to the exponent; the bits of `ROUND` fall off the top.
    let two_n = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3f80_0000));
    (two_n, r + r * r * q)
}

#[inline(always)]
fn clamped(x: f32) -> f32 {
    let x = if x > UNDERFLOW { x } else { UNDERFLOW };
    if x < OVERFLOW { x } else { OVERFLOW }
}

/// e^x within 2 ulp; 0 below -87.3, e^88 above 88.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let (two_n, p) = parts(clamped(x));
    if x > UNDERFLOW { two_n + two_n * p } else { 0.0 }
}

/// v e^x with one rounding more than [`exp`], for x down to -174: a large `v` and a small e^x meet in range.
#[inline(always)]
pub fn times_exp(v: f32, x: f32) -> f32 {
    let half = 0.5 * x;
    let (two_n, p) = parts(clamped(half));
    let root = two_n + two_n * p;
    if half > UNDERFLOW { (v * root) * root } else { 0.0 }
}

/// e^x - 1 within 3 ulp, also where x is small; -1 below -87.3.
#[inline(always)]
pub fn exp_m1(x: f32) -> f32 {
    let (two_n, p) = parts(clamped(x));
    two_n * p + (two_n - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error in units of the last place of `exact`.
    fn ulps(got: f32, exact: f64) -> f64 {
        let ulp = f64::from(f32::EPSILON) * 2.0_f64.powi(exact.abs().log2().floor() as i32);
        (f64::from(got) - exact).abs() / ulp
    }

    #[test]
    fn both_stay_within_their_bounds() {
        let (mut worst_exp, mut worst_m1, mut worst_times) = (0.0_f64, 0.0_f64, 0.0_f64);
        for i in 0..400_000 {
            let x = -87.29 + i as f32 * (175.0 / 400_000.0);
            worst_exp = worst_exp.max(ulps(exp(x), f64::from(x).exp()));
            worst_m1 = worst_m1.max(ulps(exp_m1(x), f64::from(x).exp_m1()));
            let small = x.signum() * (0.5 * x.abs() - 40.0).exp();
            worst_m1 = worst_m1.max(ulps(exp_m1(small), f64::from(small).exp_m1()));
            let far = 1.9 * x.min(0.0);
            let exact = 1e32_f32 as f64 * f64::from(far).exp();
            if exact > 1e-37 {
                worst_times = worst_times.max(ulps(times_exp(1e32, far), exact));
            }
        }
        assert!(worst_exp < 2.0, "{worst_exp}");
        assert!(worst_m1 < 3.0, "{worst_m1}");
        assert!(worst_times < 8.0, "{worst_times}");
    }

    #[test]
    fn ends_of_the_range() {
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp_m1(0.0), 0.0);
        for x in [-88.0, -1e4, f32::MIN, f32::NEG_INFINITY] {
            assert_eq!((exp(x), exp_m1(x), times_exp(1e30, 3.0 * x)), (0.0, -1.0, 0.0), "{x}");
        }
        assert!(exp(f32::INFINITY).is_finite());
    }
}
