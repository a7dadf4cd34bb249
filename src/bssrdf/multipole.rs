//! The image sums of a slab, in f64 and to all their terms: what the slab model tabulates.

/// One channel of a slab, lengths in transport mean free paths, without the factor α′ σ_t′² / 4π.
pub(super) struct Multipole {
    /// s.
    decay: f64,
    /// H.
    thickness: f64,
    /// Distance from a source to the next one's image plane and back: P.
    period: f64,
    /// 1 + 2 z_bt: depth of the first image, from the lit face upwards.
    image: f64,
}

/// The share of T of the point source that T of an exponential one may be.
const MOST_TRANSMITTED: f64 = 2.0;
/// Images of each kind summed one by one on each side; the rest is an integral.
const PAIRS: i32 = 48;
/// The Fourier series stands in for the images beyond this part of a period.
const FAR: f64 = 0.25;

impl Multipole {
    pub(super) fn new(decay: f64, thickness: f64, z_bt: f64, z_bb: f64) -> Self {
        Self { decay, thickness, period: 2.0 * (thickness + z_bt + z_bb), image: 1.0 + 2.0 * z_bt }
    }

    pub(super) fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Decay of the slowest mode, sqrt(s² + (2π/P)²).
    pub(super) fn slowest(&self) -> f64 {
        self.decay.hypot(2.0 * std::f64::consts::PI / self.period)
    }

    /// Σ_i [g1(z_ri) - g1(z_vi)] at squared distance `x2`.
    pub(super) fn reflected(&self, x2: f64) -> f64 {
        self.sum(x2, 1.0, -self.image)
    }

    /// Σ_i [g1(H - z_ri) - g1(H - z_vi)] at squared distance `x2`.
    pub(super) fn transmitted(&self, x2: f64) -> f64 {
        self.sum(x2, self.thickness - 1.0, self.thickness + self.image)
    }

    /// Total reflectance over α′.
    pub(super) fn total_reflected(&self) -> f64 {
        // h is odd: -h(-image) = h(image).
        0.5 * (self.plane(1.0) + self.plane(self.image))
    }

    /// Total transmittance over α′.
    pub(super) fn total_transmitted(&self) -> f64 {
        self.transmitted_from(1.0)
    }

    /// Total transmittance over α′ of a source at another depth `z` than 1.
    pub(super) fn transmitted_from(&self, z: f64) -> f64 {
        0.5 * (self.plane(self.thickness - z) - self.plane(self.thickness + self.image + z - 1.0))
    }

    /// What is left of R and of T of light that is scattered at all: the exponential source ends at the far face, where the point
    /// source at depth 1 stands for one without end. `unscattered` is the share that comes through, exp(-σ_t H).
    ///
    /// Without absorption R and T of a source are linear in its depth. Beyond the slab lies the share exp(-H), at H + 1 in the mean, which R
    /// and T of the point source have; what of it is scattered all the same, forwards, leaves by the far face. With absorption R keeps that
    /// ratio, and T is that of a source at the mean depth of the rest; both together never more than R + T, whose source has all light.
    pub(super) fn scattered(&self, z_bb: f64, unscattered: f64) -> [f64; 2] {
        let (h, beyond) = (self.thickness, (-self.thickness).exp());
        let depth = (1.0 - (1.0 + h) * beyond) / (1.0 - beyond);
        let through = (1.0 - beyond) * self.transmitted_from(depth) + beyond - unscattered;
        let reflected = 1.0 - beyond * (z_bb - 1.0) / (h + z_bb - 1.0);
        let all = self.total_transmitted();
        // Far out of what diffusion knows, in thick slabs that absorb nearly all, T and its correction are nothing both.
        let most = (1.0 + (1.0 - reflected) * self.total_reflected() / all).min(MOST_TRANSMITTED);
        [reflected, if all > 0.0 && most > 0.0 { (through / all).clamp(0.0, most) } else { 1.0 }]
    }

    /// h(z) = Σ_i sign(z + iP) exp(-s |z + iP|) for 0 < z < P.
    fn plane(&self, z: f64) -> f64 {
        let (s, p) = (self.decay, self.period);
        if z > 0.5 * p {
            return -self.plane(p - z);
        }
        if s * p < 1e-8 {
            return 1.0 - 2.0 * z / p;
        }
        // exp(-s z) - exp(-s (P - z)) without cancellation for small s.
        -(-s * z).exp() * (-s * (p - 2.0 * z)).exp_m1() / -(-s * p).exp_m1()
    }

    /// Σ_i [g1(a + iP) - g1(b + iP)].
    fn sum(&self, x2: f64, a: f64, b: f64) -> f64 {
        if x2 > (FAR * self.period).powi(2) { self.series(x2.sqrt(), a, b) } else { self.images(x2, a, b) }
    }

    fn images(&self, x2: f64, a: f64, b: f64) -> f64 {
        let (s, p) = (self.decay, self.period);
        let g1 = |z: f64| {
            let d2 = x2 + z * z;
            let d = d2.sqrt();
            z * (1.0 + s * d) * (-s * d).exp() / (d2 * d)
        };
        let g0 = |z: f64| {
            let d = (x2 + z * z).sqrt();
            (-s * d).exp() / d
        };
        // Far images first: small numbers before large ones.
        let sum: f64 = (1..=PAIRS)
            .rev()
            .map(|i| f64::from(i) * p)
            .map(|shift| (g1(a + shift) - g1(b + shift)) + (g1(a - shift) - g1(b - shift)))
            .sum();
        // Beyond, one image per period is an integral: ∫ g1 dz = -g0.
        let end = (f64::from(PAIRS) + 0.5) * p;
        let rest = ((g0(end + a) - g0(end + b)) - (g0(end - a) - g0(end - b))) / p;
        sum + rest + (g1(a) - g1(b))
    }

    /// The same sum by Poisson's formula: (4/P) Σ_m k_m [sin(k_m a) - sin(k_m b)] K_0(r sqrt(s² + k_m²)).
    fn series(&self, x: f64, a: f64, b: f64) -> f64 {
        let mut sum = 0.0;
        let slowest = self.slowest() * x;
        for m in 1..=60 {
            let k = 2.0 * std::f64::consts::PI * f64::from(m) / self.period;
            let argument = x * self.decay.hypot(k);
            if argument - slowest > 46.0 {
                break;
            }
            // sin A - sin B = 2 cos((A + B)/2) sin((A - B)/2)
            let both = 2.0 * (0.5 * k * (a + b)).cos() * (0.5 * k * (a - b)).sin();
            sum += k * both * bessel_k0(argument);
        }
        4.0 / self.period * sum
    }
}

/// K_0(x) for x above some 0.5, to 1e-13: the trapezoidal rule for ∫ exp(-x cosh t) dt over 0..∞, which converges
/// faster than any power of the step.
fn bessel_k0(x: f64) -> f64 {
    let step = (0.6 / x.sqrt()).min(0.25);
    let mut sum = 0.5;
    for i in 1..200 {
        // cosh t - 1 = 2 sinh²(t/2)
        let half = (0.5 * step * f64::from(i)).sinh();
        let fall = 2.0 * x * half * half;
        if fall > 42.0 {
            break;
        }
        sum += (-fall).exp();
    }
    step * sum * (-x).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_has_its_tabulated_values() {
        for (x, value) in [
            (0.5, 0.924_419_071_227_665_9),
            (1.0, 0.421_024_438_240_708_3),
            (2.0, 0.113_893_872_749_533_4),
            (5.0, 3.691_098_334_042_594e-3),
            (10.0, 1.778_006_231_616_765e-5),
            (50.0, 3.410_167_749_789_496e-23),
        ] {
            assert!((bessel_k0(x) / value - 1.0).abs() < 1e-12, "{x}: {}", bessel_k0(x));
        }
    }

    #[test]
    fn images_and_series_agree_where_both_converge() {
        for decay in [0.0, 1e-4, 0.03, 0.5, 1.7] {
            for thickness in [1.5, 4.0, 50.0] {
                let slab = Multipole::new(decay, thickness, 1.7, 0.7);
                for part in [0.2, 0.25, 0.3, 0.4] {
                    let x = part * slab.period;
                    for (a, b) in [(1.0, -slab.image), (thickness - 1.0, thickness + slab.image)] {
                        let (direct, dual) = (slab.images(x * x, a, b), slab.series(x, a, b));
                        // What the images cancel is lost: they are of the size of the nearest.
                        let size = (-decay * x).exp() * (1.0 + decay * x) / (x * x * x);
                        assert!((direct - dual).abs() < 1e-7 * size, "{decay} {thickness} {part}: {direct} {dual}");
                    }
                }
            }
        }
    }

    #[test]
    fn totals_are_the_integrals() {
        let rule = crate::math::GaussLegendre::new(20);
        for (decay, thickness) in [(0.0, 3.0), (0.1, 3.0), (0.3, 20.0), (1.2, 2.0)] {
            let slab = Multipole::new(decay, thickness, 1.7, 0.7);
            let end = 60.0 / slab.slowest();
            // ∫ 2π r f dr / 4π, r = exp(v)
            let integral = |f: &dyn Fn(f64) -> f64| {
                rule.integrate_panels(-16.0, end.ln(), 40, |v| 0.5 * (2.0 * v).exp() * f((2.0 * v).exp()))
            };
            let (r, t) = (integral(&|x2| slab.reflected(x2)), integral(&|x2| slab.transmitted(x2)));
            assert!((r / slab.total_reflected() - 1.0).abs() < 1e-7, "{decay} {thickness}: {r}");
            assert!((t / slab.total_transmitted() - 1.0).abs() < 1e-7, "{decay} {thickness}: {t}");
        }
    }
}
