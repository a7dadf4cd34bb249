//! Gauss-Legendre rules.

/// `N` nodes and weights on [-1, 1], by Newton's method on the Legendre polynomial.
pub(super) fn gauss_legendre<const N: usize>() -> [(f64, f64); N] {
    let n = N as f64;
    std::array::from_fn(|i| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut before, mut here) = (1.0, x);
            for k in 2..=N {
                let k = k as f64;
                (before, here) = (here, ((2.0 * k - 1.0) * x * here - (k - 1.0) * before) / k);
            }
            slope = n * (x * here - before) / (x * x - 1.0);
            let step = here / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// ∫ f over [`a`, `b`] with `rule`.
#[inline]
pub(super) fn integrate(rule: &[(f64, f64)], a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    half * rule.iter().map(|&(x, w)| w * f(middle + half * x)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_exact_for_polynomials_of_degree_2n_minus_1_and_no_more() {
        let rule = gauss_legendre::<5>();
        let moment = |k: i32| integrate(&rule, 0.0, 1.0, |x| x.powi(k)) * f64::from(k + 1);
        for k in 0..10 {
            assert!((moment(k) - 1.0).abs() < 1e-14, "{k}: {}", moment(k));
        }
        assert!((moment(10) - 1.0).abs() > 1e-7);
    }

    #[test]
    fn a_large_rule_keeps_its_digits() {
        let rule = gauss_legendre::<64>();
        assert!((rule.iter().map(|r| r.1).sum::<f64>() - 2.0).abs() < 1e-13);
        assert!((integrate(&rule, 0.0, 20.0, |t| (-t).exp()) - 1.0 + (-20.0_f64).exp()).abs() < 1e-13);
    }
}
