//! Light scattered exactly once: on a plane in closed integrals, and along the refracted ray of the camera.

use super::channel::{ChannelMedium, to_finite};
use super::depth::DepthLaw;
use crate::math::{DVec3, GaussLegendre, Rgb, Vec3};
use crate::optics::{HenyeyGreenstein, Medium, refract, transmittance};
use std::f64::consts::PI;
use std::sync::LazyLock;

static COARSE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(16));
static FINE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(32));

/// Fresnel transmittance from inside to outside at inner cosine `mu`, in f64.
fn transmitted_out(eta: f64, mu: f64) -> f64 {
    let cos2 = 1.0 - (1.0 - mu) * (1.0 + mu) * eta * eta;
    if cos2 <= 0.0 || mu <= 0.0 {
        return 0.0;
    }
    let out = cos2.sqrt();
    let (s, p) = (eta * mu + out, mu + eta * out);
    2.0 * eta * mu * out * (1.0 / (s * s) + 1.0 / (p * p))
}

/// Cosine inside beyond which light is not totally reflected; 0 for η ≤ 1.
fn critical_cosine(eta: f64) -> f64 {
    if eta > 1.0 { ((eta - 1.0) * (eta + 1.0)).sqrt() / eta } else { 0.0 }
}

/// One channel of a half space z < 0, single scattering alone, exact, in f64: what tables are compared with, and
/// what completes the profile of a model of orders 2 and higher.
#[derive(Clone, Copy, Debug)]
pub struct SingleChannel {
    medium: ChannelMedium,
}

impl SingleChannel {
    /// One channel.
    pub fn new(medium: &ChannelMedium) -> Self {
        Self { medium: *medium }
    }

    /// Exitance M_1 [1/unit²] of a pencil beam per entered flux, from x = x_o - x_i \[unit\] in the plane with outward
    /// normal `n`, and the refracted direction `w` inside:
    ///
    ///   M_1 = ∫ σ_s exp(-σ_t (t + d)) p(cos) T(η, z/d) (z/d)/d² dt,   d = |x - t w|,  z = -t w·n
    ///
    /// Light reflected inside cannot take part at this order. With t = x·w + ρ sinh v, ρ the distance of the exit
    /// from the ray, d = ρ cosh v and t + d = x·w + ρ e^v; the cosine of scattering is -tanh v. The integral starts
    /// where z/d is the critical cosine, in v = v_c + y², because T has a root there. Error below 1e-9; grows as 1/r
    /// towards r = 0 and is held below 1e-9 mean free paths.
    pub fn exitance(&self, x: DVec3, n: DVec3, w: DVec3) -> f64 {
        let ChannelMedium { sigma_s, g, eta, .. } = self.medium;
        let sigma_t = self.medium.sigma_t();
        let mu_in = -w.dot(n);
        if sigma_s <= 0.0 || mu_in <= 0.0 {
            return 0.0;
        }
        // Lengths in mean free paths.
        let (r2, near) = (x.length_squared() * sigma_t * sigma_t, x.dot(w) * sigma_t);
        let rho = (x.cross(w).length() * sigma_t).max(1e-9);
        let critical = critical_cosine(eta);
        // (μ² - μ_c²) t² + 2 μ_c² (x·w) t - μ_c² r² = 0
        let start = if critical > 0.0 {
            let steep = ((mu_in - critical) * (mu_in + critical)).max(0.0);
            let root = (critical * critical * near * near + steep * r2).sqrt();
            // The form without cancellation for either sign of x·w; infinite where no depth is steep enough.
            if near > 0.0 {
                critical * r2 / (critical * near + root)
            } else {
                critical * (root - critical * near) / steep
            }
        } else {
            0.0
        };
        if !start.is_finite() {
            return 0.0;
        }
        let first = ((start - near) / rho).asinh();
        let least = near + rho * first.exp();
        let phase = HenyeyGreenstein { g };
        if least > 700.0 {
            return 0.0;
        }
        let along = |v: f64| {
            let (e, e_inverse) = (v.exp(), (-v).exp());
            let cosh = 0.5 * (e + e_inverse);
            let mu = (mu_in * (near / rho + 0.5 * (e - e_inverse)) / cosh).min(1.0);
            let (more, less) = (e_inverse / cosh, e / cosh);
            (least - near - rho * e).exp() * phase.value(0.5 * (more - less)) * mu * transmitted_out(eta, mu) / cosh
        };
        // 40 powers of e below the start nothing counts, nor where 1/cosh has fallen by as much.
        let last = (first + (40.0 / (rho * first.exp())).ln_1p()).min(first.max(0.0) + 40.0);
        let bend = last.min(first + 1.0);
        let mut sum = FINE.integrate(0.0, (bend - first).sqrt(), |y| 2.0 * y * along(first + y * y));
        let panels = ((last - bend) / 2.0).ceil();
        let width = (last - bend) / panels.max(1.0);
        for i in 0..panels as u32 {
            let a = bend + width * f64::from(i);
            sum += COARSE.integrate(a, a + width, along);
        }
        sigma_s * sigma_t * sum * (-least).exp() / rho
    }

    /// What leaves the plane after one scattering, per entered flux at normal incidence [Cha60, HK93]:
    /// 2π α ∫ p(-μ) T(η, μ) μ/(1 + μ) dμ. What p has at its peak towards μ = 1, which is narrow for g near -1, is known in
    /// closed form: f(1) ∫ p is taken out, and the rest is summed over panels that get smaller towards 1.
    pub fn total(&self) -> f64 {
        let ChannelMedium { sigma_s, g, eta, .. } = self.medium;
        if sigma_s <= 0.0 {
            return 0.0;
        }
        let critical = critical_cosine(eta);
        let (phase, escaped) = (HenyeyGreenstein { g }, |mu: f64| transmitted_out(eta, mu) * mu / (1.0 + mu));
        let backwards = g < -0.5;
        let peak = if backwards { escaped(1.0) } else { 0.0 };
        // 2π ∫ p(-μ) dμ from the critical cosine to 1.
        let mass = (1.0 - g) / (2.0 * g) * ((1.0 + g) / (1.0 + g * g + 2.0 * g * critical).sqrt() - 1.0);
        let around = |mu: f64| phase.value(-mu) * (escaped(mu) - peak);
        // 1 - μ falls to a quarter from panel to panel; the first one has the root of T at the critical cosine.
        let width = 1.0 - critical;
        let panels = if backwards { 24 } else { 1 };
        let edge = |k: i32| if k == panels { 1.0 } else { 1.0 - width * 0.25_f64.powi(k) };
        let mut sum = FINE.integrate(0.0, (edge(1) - critical).sqrt(), |y| 2.0 * y * around(critical + y * y));
        for k in 1..panels {
            sum += FINE.integrate(edge(k), edge(k + 1), around);
        }
        let scattered = 2.0 * PI * sum + if backwards { peak * mass } else { 0.0 };
        sigma_s / self.medium.sigma_t() * scattered
    }
}

/// Exact single scattering of a medium, for an integrator that follows the refracted ray of the camera \[JMLH01\]:
///
///   L_1 = T21/η² ∫∫ σ_s exp(-σ_t (s + s_i′)) p(w_i′, w_o′) T12 L_i |w_i·n_i| / |w_i′·n_i| dw_i ds
///
/// s is the distance along that ray, s_i′ the refracted path to the surface, estimated from the straight distance s_i
/// along the shadow ray: s_i′ = s_i |w_i·n_i| / |w_i′·n_i|. Exact on a plane. The published form for one sample has
/// neither 1/η² (radiance leaving the medium) nor the ratio of cosines (the refracted beam is squeezed); without
/// them a plane does not give the result of \[HK93\].
///
/// Belongs to models of orders 2 and higher. Dipoles of all orders contain it already.
#[derive(Clone, Debug)]
pub struct SingleScattering {
    media: [ChannelMedium; 3],
    distances: DepthLaw,
}

/// A distance along the camera's ray and its density.
#[derive(Clone, Copy, Debug)]
pub struct DistanceSample {
    /// Distance from the point where the ray entered \[unit\].
    pub distance: f32,
    /// Density of `distance` [1/unit].
    pub pdf: f32,
}

/// How light reaches a point inside, as a shadow ray sees it.
#[derive(Clone, Copy, Debug)]
pub struct LightPath {
    /// Unit direction from the point towards the light: straight through the boundary.
    pub w_i: Vec3,
    /// Outward unit normal where the straight line leaves the medium.
    pub n_i: Vec3,
    /// Distance to there along the straight line \[unit\].
    pub distance: f32,
}

impl SingleScattering {
    /// Single scattering in `medium`.
    pub fn new(medium: &Medium) -> Self {
        let media: [ChannelMedium; 3] = std::array::from_fn(|c| ChannelMedium::of(medium, c));
        let distances = DepthLaw::new(media.map(|m| if m.sigma_s > 0.0 { m.sigma_t() } else { 0.0 }));
        Self { media, distances }
    }

    /// A distance in proportion to exp(-σ_t s), up to `longest` \[unit\], where the camera's ray leaves the medium
    /// (infinite if it does not); one for the three channels, see [`DepthLaw`]. `None` without scattering. `u` in
    /// [0, 1). Do not sample the surface instead: the integrand has a pole 1/d² at each of its points.
    pub fn sample_distance(&self, u: f32, longest: f32) -> Option<DistanceSample> {
        let within = self.distances.cumulative(f64::from(longest));
        if within <= 0.0 {
            return None;
        }
        let distance = self.distances.sample(f64::from(u) * within).min(f64::from(longest));
        Some(DistanceSample { distance: distance as f32, pdf: (self.distances.pdf(distance) / within) as f32 })
    }

    /// The integrand [1/(unit sr)] at `distance` along the ray of unit direction `w_inside`, which runs from the
    /// camera into the medium: everything but T21 at the camera's end and L_i. The mean over directions w_i and
    /// distances, each over its density, times T21 L_i, is L_1. 0 where the light is totally reflected.
    pub fn along_camera_ray(&self, distance: f32, w_inside: Vec3, light: &LightPath) -> Rgb {
        self.factor(w_inside, light, |m, refracted| {
            m.sigma_s * (-m.sigma_t() * (f64::from(distance) + refracted)).exp()
        })
    }

    /// [`Self::along_camera_ray`] over the density of [`Self::sample_distance`] with the same `longest`, without a
    /// quotient of two small numbers.
    pub fn along_camera_ray_sampled(&self, distance: f32, longest: f32, w_inside: Vec3, light: &LightPath) -> Rgb {
        let weights = self.distances.weights(f64::from(distance));
        let within = self.distances.cumulative(f64::from(longest));
        let mut channel = 0;
        self.factor(w_inside, light, |m, refracted| {
            channel += 1;
            let sigma_t = m.sigma_t();
            if sigma_t <= 0.0 {
                return 0.0;
            }
            m.sigma_s / sigma_t * weights[channel - 1] * within * (-sigma_t * refracted).exp()
        })
    }

    /// p T12 |w_i·n_i| / (|w_i′·n_i| η²) times `attenuated`(medium, s_i′) in each channel, in order.
    fn factor(&self, w_inside: Vec3, light: &LightPath, mut attenuated: impl FnMut(&ChannelMedium, f64) -> f64) -> Rgb {
        let ChannelMedium { g, eta, .. } = self.media[0];
        let mu = light.w_i.dot(light.n_i);
        if mu <= 0.0 {
            return Rgb::BLACK;
        }
        let Some(inside) = refract(light.w_i, light.n_i, eta as f32) else { return Rgb::BLACK };
        let mu_inside = -f64::from(inside.dot(light.n_i));
        if mu_inside <= 0.0 {
            return Rgb::BLACK;
        }
        // Light travels along `inside`, then back along -w_inside.
        let cos = f64::from(-inside.dot(w_inside)).clamp(-1.0, 1.0);
        let ratio = f64::from(mu) / mu_inside;
        let refracted = f64::from(light.distance) * ratio;
        let common = HenyeyGreenstein { g }.value(cos) * f64::from(transmittance(eta as f32, mu)) * ratio / (eta * eta);
        Rgb::from_fn(|c| to_finite(common * attenuated(&self.media[c], refracted)))
    }

    /// BRDF [1/sr] of a half space with a distant light, single scattering alone \[HK93\], T12 and T21 included; `w_i`
    /// and `w_o` point away from the surface with normal `n`:
    ///
    ///   f_1 = α/η² T12 T21 p(w_i′, w_o′) / (μ_i′ + μ_o′)
    pub fn plane_brdf(&self, w_i: Vec3, w_o: Vec3, n: Vec3) -> Rgb {
        let ChannelMedium { g, eta, .. } = self.media[0];
        let eta_f32 = eta as f32;
        let (mu_i, mu_o) = (w_i.dot(n), w_o.dot(n));
        if mu_i <= 0.0 || mu_o <= 0.0 {
            return Rgb::BLACK;
        }
        let (Some(a), Some(b)) = (refract(w_i, n, eta_f32), refract(w_o, n, eta_f32)) else { return Rgb::BLACK };
        let cos = f64::from(-a.dot(b)).clamp(-1.0, 1.0);
        let depth = -f64::from(a.dot(n) + b.dot(n));
        let boundary = f64::from(transmittance(eta_f32, mu_i) * transmittance(eta_f32, mu_o)) / (eta * eta);
        let common = boundary * HenyeyGreenstein { g }.value(cos) / depth;
        Rgb::from_fn(|c| {
            let m = &self.media[c];
            if m.sigma_s > 0.0 { to_finite(m.sigma_s / m.sigma_t() * common) } else { 0.0 }
        })
    }

    /// What leaves a plane after one scattering, per entered flux at normal incidence, in [0, 1].
    pub fn total(&self) -> Rgb {
        Rgb::from_fn(|c| SingleChannel::new(&self.media[c]).total() as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All light turned straight back at an exponential depth meets half of the way again: T(1)/2 of the albedo. And for peaks
    /// of any width, against a plain sum over so many points that it sees them.
    #[test]
    fn totals_are_right_for_narrow_backward_peaks() {
        let total =
            |g: f64, eta: f64| SingleChannel::new(&ChannelMedium { sigma_s: 3.0, sigma_a: 1.0, g, eta }).total();
        for eta in [1.0, 1.3, 1.5] {
            let limit = 0.75 * 0.5 * transmitted_out(eta, 1.0);
            assert!((total(-1.0 + 1e-9, eta) / limit - 1.0).abs() < 1e-6, "{eta}");
            for g in [-0.999, -0.99, -0.9, -0.51, -0.49, 0.0, 0.9] {
                let critical = critical_cosine(eta);
                // μ = 1 - c² with c evenly spread.
                let (n, width) = (400_000, (1.0 - critical).sqrt());
                let plain: f64 = (0..n)
                    .map(|i| {
                        let c = width * (f64::from(i) + 0.5) / f64::from(n);
                        let mu = 1.0 - c * c;
                        let p = HenyeyGreenstein { g }.value(-mu);
                        2.0 * c * width / f64::from(n) * p * transmitted_out(eta, mu) * mu / (1.0 + mu)
                    })
                    .sum();
                let plain = 2.0 * PI * 0.75 * plain;
                assert!((total(g, eta) / plain - 1.0).abs() < 2e-5, "{g} {eta}: {} {plain}", total(g, eta));
            }
        }
    }
}
