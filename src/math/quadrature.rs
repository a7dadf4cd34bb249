//! Gauss-Legendre quadrature in f64, for constants that are computed once.

/// Nodes and weights of one Gauss-Legendre rule on [-1, 1]; exact for polynomials of degree 2n - 1.
pub struct GaussLegendre {
    points: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// The rule with `n` ≥ 1 nodes, by Newton's iteration on the Legendre polynomial.
    pub fn new(n: usize) -> Self {
        let n = n.max(1);
        let points = (0..n).map(|i| node(n, i)).collect();
        Self { points }
    }

    /// Nodes and weights on [a, b], for unknowns that live at the nodes.
    pub fn points_on(&self, a: f64, b: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        self.points.iter().map(move |&(x, w)| (middle + half * x, half * w))
    }

    /// Nodes on [-1, 1] with their weights.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// ∫ f over [a, b].
    pub fn integrate(&self, a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        half * self.points.iter().map(|&(x, w)| w * f(middle + half * x)).sum::<f64>()
    }

    /// ∫ f over [a, b], cut into `panels` ≥ 1 equal parts.
    pub fn integrate_panels(&self, a: f64, b: f64, panels: usize, mut f: impl FnMut(f64) -> f64) -> f64 {
        let width = (b - a) / panels.max(1) as f64;
        (0..panels.max(1)).map(|i| self.integrate(a + width * i as f64, a + width * (i + 1) as f64, &mut f)).sum()
    }
}

/// Node `i` of `n` with its weight.
fn node(n: usize, i: usize) -> (f64, f64) {
    let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
    let mut slope = 1.0;
    for _ in 0..100 {
        let (value, derivative) = legendre(n, x);
        slope = derivative;
        let step = value / derivative;
        x -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    (x, 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope))
}

/// P_n and its derivative at x, by the three-term recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (previous, current) = (current, ((2.0 * k - 1.0) * x * current - (k - 1.0) * previous) / k);
    }
    let n = n as f64;
    (current, n * (x * current - previous) / ((x - 1.0) * (x + 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_exact_up_to_its_degree_and_not_beyond() {
        for n in [1_usize, 2, 5, 20, 32] {
            let rule = GaussLegendre::new(n);
            let monomial = |degree: i32| rule.integrate(0.0, 2.0, |x| x.powi(degree));
            let exact = |degree: i32| 2.0_f64.powi(degree + 1) / f64::from(degree + 1);
            let top = 2 * n as i32 - 1;
            assert!((monomial(top) / exact(top) - 1.0).abs() < 1e-12, "{n} nodes");
            if n <= 5 {
                assert!((monomial(top + 1) / exact(top + 1) - 1.0).abs() > 1e-7, "{n} nodes");
            }
        }
    }

    #[test]
    fn panels_add_up() {
        let rule = GaussLegendre::new(12);
        let e = rule.integrate_panels(0.0, 30.0, 10, |x| (-x).exp());
        assert!((e - (1.0 - (-30.0_f64).exp())).abs() < 1e-14, "{e}");
    }
}
