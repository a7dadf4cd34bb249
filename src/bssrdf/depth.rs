//! Depths along a refracted ray, one for three channels.

use super::exponential::exp;

/// The mean of the exponential densities of the channels, p(t) = mean over c of σ_c exp(-σ_c t): with the balance
/// heuristic no channel's weight exceeds their number. A mean free path averaged over channels would have weights
/// without bound.
#[derive(Clone, Debug)]
pub struct DepthLaw {
    /// [1/unit]; 0 for a channel that takes no part.
    sigma: [f64; 3],
    /// Channels that take part.
    count: f64,
    /// Least σ of those, or 0.
    least: f64,
}

impl DepthLaw {
    /// The law of three extinctions [1/unit]. A channel with 0 takes no part.
    pub fn new(sigma: [f64; 3]) -> Self {
        let live = || sigma.iter().copied().filter(|&s| s > 0.0);
        let least = live().fold(f64::INFINITY, f64::min);
        Self { sigma, count: live().count() as f64, least: if least.is_finite() { least } else { 0.0 } }
    }

    /// exp(-(σ_c - least) t) per channel, 0 where it takes no part.
    fn relative(&self, t: f64) -> [f64; 3] {
        self.sigma.map(|s| if s > 0.0 { exp(-(s - self.least) * t) } else { 0.0 })
    }

    /// The depth \[unit\] with cumulative probability `u` in [0, 1); 0 if no channel takes part. Monotone, so that
    /// stratified numbers give stratified depths.
    pub fn sample(&self, u: f64) -> f64 {
        if self.count == 0.0 {
            return 0.0;
        }
        // Solves φ(t) = -ln(mean of exp(-σ t)) = -ln(1 - u). φ is concave and increasing, so that Newton's method
        // from the left climbs to the root without a step beyond it.
        let goal = -(-u).ln_1p();
        let mut t = goal * self.count / self.sigma.iter().sum::<f64>();
        for _ in 0..100 {
            let kept = self.relative(t);
            let sum: f64 = kept.iter().sum();
            let slope: f64 = kept.iter().zip(self.sigma).map(|(k, s)| k * s).sum::<f64>() / sum;
            // ln of the mean of exp(-(σ - least) t), by expm1 so that the smallest depths keep their digits.
            let lost = |s: f64| if s > 0.0 { (-(s - self.least) * t).exp_m1() } else { 0.0 };
            let level = (self.sigma.iter().map(|&s| lost(s)).sum::<f64>() / self.count).ln_1p();
            let step = (goal - (self.least * t - level)) / slope;
            t += step;
            if step.abs() <= 1e-9 * t {
                break;
            }
        }
        t.max(0.0)
    }

    /// Probability of a depth below `t` \[unit\], which may be infinite.
    pub fn cumulative(&self, t: f64) -> f64 {
        let live = self.sigma.iter().filter(|&&s| s > 0.0);
        live.map(|s| -(-s * t).exp_m1()).sum::<f64>() / self.count.max(1.0)
    }

    /// Density of a depth `t` \[unit\] under [`Self::sample`] [1/unit].
    pub fn pdf(&self, t: f64) -> f64 {
        if self.count == 0.0 {
            return 0.0;
        }
        let sum: f64 = self.relative(t).iter().zip(self.sigma).map(|(k, s)| k * s).sum();
        sum / self.count * (-self.least * t).exp()
    }

    /// Each channel's own density σ_c exp(-σ_c t) over [`Self::pdf`]; at most 3, and 0 for one that takes no part.
    pub fn weights(&self, t: f64) -> [f64; 3] {
        let kept = self.relative(t);
        let own: [f64; 3] = std::array::from_fn(|c| kept[c] * self.sigma[c]);
        let sum: f64 = own.iter().sum();
        own.map(|v| if v > 0.0 { self.count * v / sum } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAWS: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [0.5, 2.0, 40.0], [1e-6, 1.0, 1e6], [3.0, 0.0, 0.2]];

    #[test]
    fn a_sample_has_its_cumulative_probability() {
        for sigma in LAWS {
            let law = DepthLaw::new(sigma);
            for u in [0.0, 1e-12, 1e-6, 0.1, 0.4, 0.7, 0.999, 0.999_999_94] {
                let below = law.cumulative(law.sample(u));
                assert!((below - u).abs() <= 1e-8 * u, "{sigma:?} {u}: {below}");
            }
        }
    }

    #[test]
    fn weights_are_the_ratio_of_densities_and_bounded() {
        for sigma in LAWS {
            let law = DepthLaw::new(sigma);
            for t in [0.0, 1e-7, 0.03, 1.0, 30.0, 1e4] {
                let weights = law.weights(t);
                for c in 0..3 {
                    assert!(weights[c].is_finite() && weights[c] <= 3.0);
                    let own = sigma[c] * (-sigma[c] * t).exp();
                    assert!((weights[c] * law.pdf(t) - own).abs() <= 1e-12 * own.max(1e-280), "{sigma:?} {t} {c}");
                }
            }
        }
    }

    #[test]
    fn without_a_medium_there_is_no_depth() {
        let law = DepthLaw::new([0.0; 3]);
        assert_eq!((law.sample(0.5), law.pdf(1.0), law.cumulative(1.0)), (0.0, 0.0, 0.0));
        assert_eq!(law.weights(1.0), [0.0; 3]);
    }
}
