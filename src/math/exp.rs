//! Powers of two in f32 without branches or calls, so that loops over them vectorise; made of additions and
//! multiplications that every machine rounds alike, so that their bits depend neither on the vector width nor on the
//! C library. Decays are kept times log2 e, which saves the reduction by ln 2.

/// 2^y is 0 below.
const UNDERFLOW: f32 = -126.0;
/// 1.5 · 2²³: adding it rounds to an integer, which then stands in the lowest bits.
const ROUND: f32 = 12_582_912.0;

/// 2^y = 2^n (1 + p) with |p| < 0.42, for y in [-126, 127]: (2^n, p).
///
/// 1 + p = 2^f on |f| ≤ 1/2 by our own minimax fit of degree 6, relative error 2e-9.
#[inline(always)]
fn parts(y: f32) -> (f32, f32) {
    let y = if y > UNDERFLOW { y } else { UNDERFLOW };
    let shifted = y + ROUND;
    let f = y - (shifted - ROUND);
    let q = 1.534_573_8e-4;
    let q = q * f + 1.340_001e-3;
    let q = q * f + 9.618_49e-3;
    let q = q * f + 5.550_328_6e-2;
    let q = q * f + 0.240_226_46;
    let q = q * f + std::f32::consts::LN_2; // the fit's own coefficient, too
    // n moves to the exponent; the bits of `ROUND` fall off the top.
    let two_n = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3f80_0000));
    (two_n, q * f)
}

/// 2^y within 2 ulp for y ≤ 127; 0 below -126.
#[inline(always)]
pub fn exp2(y: f32) -> f32 {
    let (two_n, p) = parts(y);
    let power = two_n * (1.0 + p);
    if y > UNDERFLOW { power } else { 0.0 }
}

/// v 2^y for y ≤ 254, within 5 ulp down to -252 and 0 below: a large `v` and a small power meet in range.
#[inline(always)]
pub fn times_exp2(v: f32, y: f32) -> f32 {
    let root = exp2(0.5 * y);
    (v * root) * root
}

/// 2^y - 1 within 3 ulp for y ≤ 127, also where y is small; -1 below -126.
#[inline(always)]
pub fn exp2_m1(y: f32) -> f32 {
    let (two_n, p) = parts(y);
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
    fn all_stay_within_their_bounds() {
        let (mut worst, mut worst_m1, mut worst_times) = (0.0_f64, 0.0_f64, 0.0_f64);
        let m1 = |y: f32| ulps(exp2_m1(y), (f64::from(y) * std::f64::consts::LN_2).exp_m1());
        for i in 0..400_000 {
            let y = -125.99 + i as f32 * (252.0 / 400_000.0);
            worst = worst.max(ulps(exp2(y), f64::from(y).exp2()));
            worst_m1 = worst_m1.max(m1(y)).max(m1(y.signum() * (0.3 * y.abs() - 40.0).exp2()));
            let (v, far) = (1e37_f32, 1.9 * y.min(0.0));
            let exact = f64::from(v) * f64::from(far).exp2();
            if exact > 1.2e-38 {
                worst_times = worst_times.max(ulps(times_exp2(v, far), exact));
            }
        }
        assert!(worst < 2.0, "{worst}");
        assert!(worst_m1 < 3.0, "{worst_m1}");
        assert!(worst_times < 5.0, "{worst_times}");
    }

    #[test]
    fn ends_of_the_range() {
        assert_eq!((exp2(0.0), exp2_m1(0.0), times_exp2(3.0, 0.0)), (1.0, 0.0, 3.0));
        for y in [-127.0, -1e4, f32::MIN, f32::NEG_INFINITY] {
            assert_eq!((exp2(y), exp2_m1(y), times_exp2(1e30, 3.0 * y)), (0.0, -1.0, 0.0), "{y}");
        }
    }
}
