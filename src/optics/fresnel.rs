//! Unpolarised light at a smooth boundary between two dielectrics.

use crate::math::Vec3;

/// What a smooth boundary does to unpolarised light of one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// Fresnel reflectance R [0, 1].
    pub reflectance: f64,
    /// Fresnel transmittance T [0, 1].
    pub transmittance: f64,
    /// Cosine of the refracted direction; 0 where light is totally reflected.
    pub cosine: f64,
}

/// Reflected and transmitted part for cosine of incidence `mu` (clamped to [0, 1]) and `eta` = n_t / n_i > 0.
///
/// With k = η μ_t = sqrt(η² - 1 + μ²) both parts are formed directly, so that each keeps its digits where it is
/// small (T near grazing and the critical angle, R for η beside 1):
///
///   r_s = (1 - η²) / (μ + k)²,   r_p = (η² - 1) ((η² + 1) μ² - 1) / (η² μ + k)²
///   T = 2 μ k [ 1 / (μ + k)² + η² / (η² μ + k)² ]
pub fn split(eta: f64, mu: f64) -> Split {
    debug_assert!(eta > 0.0);
    let mu = mu.clamp(0.0, 1.0);
    let k2 = k_squared(eta, mu);
    if mu == 0.0 || k2 <= 0.0 {
        let cosine = if k2 > 0.0 { k2.sqrt() / eta } else { 0.0 };
        return Split { reflectance: 1.0, transmittance: 0.0, cosine };
    }
    let k = k2.sqrt();
    let eta2 = eta * eta;
    let excess = (eta - 1.0) * (eta + 1.0);
    let (s, p) = (1.0 / (mu + k), 1.0 / (eta2 * mu + k));
    let (s2, p2) = (s * s, p * p);
    let (r_s, r_p) = (excess * s2, excess * ((eta2 + 1.0) * mu * mu - 1.0) * p2);
    Split {
        reflectance: (0.5 * (r_s * r_s + r_p * r_p)).min(1.0),
        transmittance: (2.0 * mu * k * (s2 + eta2 * p2)).min(1.0),
        cosine: (k / eta).min(1.0),
    }
}

/// η² - 1 + μ², of which the sign decides on total reflection.
fn k_squared(eta: f64, mu: f64) -> f64 {
    let excess = (eta - 1.0) * (eta + 1.0);
    let k2 = excess + mu * mu;
    if eta >= 1.0 || k2.abs() > 1e-3 * mu * mu {
        return k2;
    }
    // Beside the critical angle the two squares cancel: take them with their rounding errors.
    let (eta_square, eta_rest) = exact_square(eta);
    let (mu_square, mu_rest) = exact_square(mu);
    // Both differences are exact: η² + μ² is within a factor of two of 1.
    let (large, small) = if eta_square > mu_square { (eta_square, mu_square) } else { (mu_square, eta_square) };
    ((large - 1.0) + small) + (eta_rest + mu_rest)
}

/// x² as a sum of two numbers without error, by splitting x into halves [Dekker 1971].
fn exact_square(x: f64) -> (f64, f64) {
    let c = 134_217_729.0 * x;
    let hi = c - (c - x);
    let lo = x - hi;
    let square = x * x;
    (square, ((hi * hi - square) + 2.0 * hi * lo) + lo * lo)
}

/// Fresnel transmittance T [0, 1] for cosine of incidence `mu` in [0, 1] and `eta` = n_t / n_i > 0; 0 where light is
/// totally reflected and at grazing.
#[inline]
pub fn transmittance(eta: f32, mu: f32) -> f32 {
    split(f64::from(eta), f64::from(mu)).transmittance as f32
}

/// Fresnel reflectance R [0, 1], arguments as for [`transmittance`]; 1 where light is totally reflected.
#[inline]
pub fn reflectance(eta: f32, mu: f32) -> f32 {
    split(f64::from(eta), f64::from(mu)).reflectance as f32
}

/// The mirror image of the unit vector `w`, both pointing away from the surface with unit normal `n`.
#[inline]
pub fn reflect(w: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * w.dot(n)) - w
}

/// Direction of propagation behind the boundary for light that comes from the unit direction `w` (pointing away
/// from the surface, on the side of the unit normal `n`), `eta` = n_t / n_i; `None` where it is totally reflected.
#[inline]
pub fn refract(w: Vec3, n: Vec3, eta: f32) -> Option<Vec3> {
    let mu = w.dot(n).clamp(0.0, 1.0);
    let k2 = k_squared(f64::from(eta), f64::from(mu));
    (k2 >= 0.0).then(|| {
        let mu_t = (k2.sqrt() / f64::from(eta)).min(1.0) as f32;
        ((n * mu - w) / eta - n * mu_t).normalize()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_is_the_schoolbook_value() {
        for eta in [0.4_f64, 0.75, 1.0, 1.3, 1.5, 4.0] {
            let r = ((eta - 1.0) / (eta + 1.0)).powi(2);
            let got = split(eta, 1.0);
            assert!((got.reflectance - r).abs() < 1e-15 && (got.transmittance - (1.0 - r)).abs() < 1e-15, "{eta}");
            assert_eq!(got.cosine, 1.0);
        }
    }

    #[test]
    fn what_is_not_reflected_is_transmitted() {
        for eta in [0.4, 0.999, 1.0, 1.000_000_001, 1.5, 4.0] {
            for i in 1..=1000 {
                let got = split(eta, f64::from(i) / 1000.0);
                assert!((got.reflectance + got.transmittance - 1.0).abs() < 1e-14, "{eta} {i}: {got:?}");
            }
        }
    }

    #[test]
    fn both_directions_through_a_boundary_transmit_the_same() {
        for eta in [1.05, 1.3, 2.5] {
            for i in 1..=100 {
                let into = split(eta, f64::from(i) / 100.0);
                let out = split(1.0 / eta, into.cosine);
                assert!((into.transmittance - out.transmittance).abs() < 1e-12, "{eta} {i}");
            }
        }
    }

    #[test]
    fn small_parts_keep_their_digits() {
        // Index match: R falls with the fourth power of the mismatch at 45 degrees (Brewster), T stays 1.
        let got = split(1.0 + 1e-9, 1.0);
        assert!((got.reflectance / 2.5e-19 - 1.0).abs() < 1e-6, "{got:?}");
        // Grazing: T = 2 μ k (1/k² + η²/k²) to first order in μ.
        let (eta, mu) = (1.5_f64, 1e-12);
        let k = (eta * eta - 1.0).sqrt();
        assert!((split(eta, mu).transmittance / (2.0 * mu * (1.0 + eta * eta) / k) - 1.0).abs() < 1e-10);
        assert_eq!(split(eta, 0.0).transmittance, 0.0);
        let none = split(1.0, 1e-12);
        assert!(none.reflectance == 0.0 && (none.transmittance - 1.0).abs() < 1e-15 && none.cosine == 1e-12);
    }

    #[test]
    fn one_ulp_decides_at_the_critical_angle() {
        for eta in [1.0_f64 / 1.5, 0.75, 1.0 / 1.3] {
            let critical = (1.0 - eta * eta).sqrt();
            let (below, above) = (critical * (1.0 - 4e-16), critical * (1.0 + 4e-16));
            assert_eq!(split(eta, below).transmittance, 0.0, "{eta}");
            let t = split(eta, above).transmittance;
            assert!(t > 0.0 && t < 1e-6, "{eta}: {t}");
        }
    }

    #[test]
    fn refraction_is_a_unit_vector_or_nothing_and_never_nan() {
        let n = Vec3::Z;
        for eta in [0.4_f32, 0.75, 1.0, 1.5] {
            for i in 0..=2000 {
                let mu = i as f32 / 2000.0;
                let w = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
                if let Some(t) = refract(w, n, eta) {
                    assert!((t.length() - 1.0).abs() < 1e-6 && t.z <= 0.0, "{eta} {mu}: {t}");
                    assert!((t.x * eta + w.x).abs() < 2e-6, "Snell at {eta} {mu}: {t}");
                } else {
                    assert!(eta < 1.0 && mu * mu < 1.0 - eta * eta + 1e-6, "{eta} {mu}");
                }
            }
        }
    }
}
