//! The phase function: where light goes when it is scattered once.

use crate::math::Vec3;
use std::f64::consts::PI;

/// Henyey-Greenstein \[HG41\] with mean cosine g in (-1, 1). Cosines are between directions of propagation: 1 is
/// straight on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    /// Mean cosine.
    pub g: f64,
}

impl HenyeyGreenstein {
    /// p(cos θ) [1/sr] = (1 - g²) / (4π (1 + g² - 2 g cos θ)^{3/2}), integral 1 over the sphere.
    pub fn value(self, cosine: f64) -> f64 {
        let g = self.g;
        // 1 + g² - 2 g cos θ without cancellation for forward scattering near g = 1 and backward near -1.
        let bend = if g >= 0.0 { 1.0 - cosine } else { 1.0 + cosine }.max(0.0);
        let (narrow, wide) = (1.0 - g.abs(), 1.0 + g.abs());
        let q = narrow * narrow + 2.0 * g.abs() * bend;
        narrow * wide / (4.0 * PI * q * q.sqrt())
    }

    /// A cosine with density 2π p from `u` in [0, 1]; increasing in u. Exact for all g, 0 and ±(1 - 1e-9) included.
    pub fn sample_cosine(self, u: f64) -> f64 {
        let g = self.g.abs();
        let u = if self.g >= 0.0 { u } else { 1.0 - u };
        let (narrow, reach) = (1.0 - g, 2.0 * g * u);
        let ratio = narrow / (narrow + reach);
        let bend = ratio * ratio * (1.0 - u) * (2.0 + reach); // 1 - cos θ
        let cosine = 1.0 - bend.clamp(0.0, 2.0);
        if self.g >= 0.0 { cosine } else { -cosine }
    }

    /// A direction of propagation after `w` (unit) with density p [1/sr].
    pub fn sample(self, w: Vec3, u: [f32; 2]) -> Vec3 {
        let cosine = self.sample_cosine(f64::from(u[0])) as f32;
        let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
        let (sin, cos) = (std::f32::consts::TAU * u[1]).sin_cos();
        crate::math::frame(w) * Vec3::new(sine * cos, sine * sin, cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::GaussLegendre;

    const G: [f64; 8] = [-0.9, -0.5, 0.0, 1e-12, 0.3, 0.8, 0.95, 1.0 - 1e-9];

    /// ∫ f(cos θ) 2π p dcos θ by parts in a variable that resolves the peak.
    fn mean(phase: HenyeyGreenstein, f: impl Fn(f64) -> f64) -> f64 {
        let rule = GaussLegendre::new(20);
        let side = if phase.g >= 0.0 { 1.0 } else { -1.0 };
        // 1 ∓ cos = exp(v)
        rule.integrate_panels(-60.0, 2.0_f64.ln(), 120, |v| {
            let cosine = side * (1.0 - v.exp());
            v.exp() * 2.0 * PI * phase.value(cosine) * f(cosine)
        })
    }

    #[test]
    fn it_integrates_to_one_with_mean_cosine_g() {
        // Beside g = 1 a cosine in f64 cannot resolve the peak: 1 - cos is 1e-18 there.
        for g in G.into_iter().filter(|g| *g < 0.999) {
            let phase = HenyeyGreenstein { g };
            assert!((mean(phase, |_| 1.0) - 1.0).abs() < 1e-9, "{g}: {}", mean(phase, |_| 1.0));
            assert!((mean(phase, |c| c) - g).abs() < 1e-9, "{g}");
        }
    }

    #[test]
    fn samples_invert_the_distribution() {
        for g in G.into_iter().filter(|g| *g < 0.999) {
            let phase = HenyeyGreenstein { g };
            let rule = GaussLegendre::new(20);
            for u in [0.01, 0.2, 0.5, 0.77, 0.99] {
                let cosine = phase.sample_cosine(u);
                let below = rule.integrate_panels(-1.0, cosine, 200, |c| 2.0 * PI * phase.value(c));
                assert!((below - u).abs() < 1e-8, "{g} {u}: {below}");
            }
        }
    }

    #[test]
    fn ends_are_cosines() {
        for g in G {
            let phase = HenyeyGreenstein { g };
            assert!((phase.sample_cosine(0.0) + 1.0).abs() < 1e-12, "{g}");
            assert!((phase.sample_cosine(1.0) - 1.0).abs() < 1e-12, "{g}");
            for u in [[0.0, 0.0], [0.999_999_94, 0.3], [0.5, 0.999_999_94]] {
                let w = phase.sample(Vec3::new(0.6, 0.0, -0.8), u);
                assert!((w.length() - 1.0).abs() < 1e-5, "{g} {u:?}");
            }
            assert!(phase.value(1.0).is_finite() && phase.value(-1.0) > 0.0);
        }
    }
}
