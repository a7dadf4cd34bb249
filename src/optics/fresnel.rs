//! Unpolarised light at a smooth boundary between two dielectrics.

use crate::math::Vec3;

/// Cosine of the refracted ray for cosine `mu` of incidence and relative index `eta` = n_t / n_i; `None` where
/// light is totally reflected.
#[inline]
fn refracted_cosine(eta: f32, mu: f32) -> Option<f32> {
    let sin2 = (1.0 - mu) * (1.0 + mu) / (eta * eta);
    (sin2 < 1.0).then(|| (1.0 - sin2).sqrt())
}

/// Fresnel transmittance T [0, 1] for cosine of incidence `mu` in [0, 1] and `eta` = n_t / n_i > 0. Formed directly,
/// not as 1 - R, so that it keeps its digits near grazing and for `eta` near 1; 0 where light is totally reflected.
#[inline]
pub fn transmittance(eta: f32, mu: f32) -> f32 {
    debug_assert!(eta > 0.0);
    let mu = mu.clamp(0.0, 1.0);
    let Some(mu_t) = refracted_cosine(eta, mu) else { return 0.0 };
    let (s, p) = (mu + eta * mu_t, eta * mu + mu_t);
    if mu == 0.0 || mu_t == 0.0 {
        return 0.0;
    }
    2.0 * eta * mu * mu_t * (1.0 / (s * s) + 1.0 / (p * p))
}

/// Fresnel reflectance R [0, 1], arguments as for [`transmittance`]; 1 where light is totally reflected.
#[inline]
pub fn reflectance(eta: f32, mu: f32) -> f32 {
    let mu = mu.clamp(0.0, 1.0);
    let Some(mu_t) = refracted_cosine(eta, mu) else { return 1.0 };
    let (s, p) = ((mu - eta * mu_t) / (mu + eta * mu_t), (eta * mu - mu_t) / (eta * mu + mu_t));
    if s.is_finite() && p.is_finite() { (0.5 * (s * s + p * p)).min(1.0) } else { 1.0 }
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
    let mu_t = refracted_cosine(eta, mu)?;
    Some(((n * mu - w) / eta - n * mu_t).normalize())
}
