//! The directional dipole.

use super::channel::{Boundary, ChannelMedium, to_finite};
use super::exponential::{exp, exp_m1};
use super::{Entry, Exit, ModelKind, ModelOption};
use crate::math::{DVec3, GaussLegendre, Rgb};
use crate::optics::{HalfSpace, Medium};
use std::f64::consts::PI;

pub(super) static MODEL: ModelKind = ModelKind {
    takes: &[ModelOption::Calibrated],
    own_exit_factor: true,
    evidence: |options| Some(if options.calibrated { "calibrated" } else { "directional" }),
    ..ModelKind::new("directional", |medium, options| Ok(Box::new(DirectionalDipole::new(medium, options.calibrated))))
};

/// The directional dipole \[FHK14\]: a ray source along the refracted direction and its mirror image in a plane
/// through the two points, modified so that it contains the line between them.
///
/// With D = 1/(3 σ_t′), s = √(σ_a/D), d_e = 2.131 D/√α′, A with both Fresnel moments, x = x_o - x_i:
///
///   S_d = max(0, S′(x, w, d_r; n_o) - S′(x - 2 A d_e n*, w_v, d_v; n_o))
///   S′(x, w, d; n) = 1/(4 C_phi(1/η)) · 1/(4π²) · exp(-s d)/d³ · { C_phi (d²/D + 3 (1 + s d) x·w)
///                    - C_E [3D (1 + s d) w·n - ((1 + s d) + 3D (3 (1 + s d) + (s d)²)/d² x·w) x·n] }
///
/// n* is n_i made orthogonal to x, w_v the mirror image of w in the plane of n*, and d_r the distance to the
/// source, displaced as the paper says for exits that face the ray and for those that do not.
///
/// * Orders: all, single scattering included; adding exact single scattering counts it twice. Not included: light
///   that goes straight through, see [`Self::reduced_intensity_extinction`].
/// * Energy is **not** conserved. The kernel has no factor α′, so the total over a plane exceeds the true albedo:
///   1.24 for α′ = 1, 1.10 for 0.999 (truth 0.87), 0.87 for 0.99 (0.66), 0.48 for 0.9 (0.29) at η = 1.3; nearly
///   independent of the angle of incidence. The far field is right, the near field some 30 % too bright.
///   `calibrated` scales the whole to the true albedo; see [`Self::new`].
/// * Not reciprocal: exchanging the ends changes S_d by a median 20 % on a plane at 0.1 to 10 mean free paths.
/// * Domain: α′ above 0.9 or so. Below, the published formula is followed down to the smallest σ_s′ that f32 holds;
///   its total does not tend to 0 with α′ but to 0.14 at η = 1.3, while the truth does. Without any scattering it
///   is 0. A line can appear where n_o·w changes sign, because d_r jumps there.
/// * Sign: the image outweighs the source at some exits. Rendering takes 0 there, as published;
///   [`super::Bssrdf::eval_signed`] is the difference itself.
/// * Always has the exit factor 1/(4 C_phi(1/η)), as published.
///
/// Computed in f64 from f32 inputs, in units of the transport mean free path, in a form without cancellation: real
/// and virtual source are subtracted before the common exponential. The dot products, which the channels share, need
/// f64 where x is nearly parallel to n_i; the rest has it so that no power of a length leaves the range.
pub struct DirectionalDipole {
    pub(super) channels: [DirectionalChannel; 3],
    pub(super) totals: [f64; 3],
    extinction: Rgb,
    pub(super) grey: bool,
    pub(super) decay: f32,
}

/// One channel of the [`DirectionalDipole`], in f64 and not clamped: what tables are compared with.
#[derive(Clone, Copy, Debug)]
pub struct DirectionalChannel {
    /// σ_t′ [1/unit].
    sigma_t_prime: f64,
    /// s / σ_t′.
    s: f64,
    /// d_e σ_t′.
    d_e: f64,
    /// 2 A d_e σ_t′: how far the image of the entry lies outside.
    h: f64,
    /// (1/(3 σ_t) σ_t′)²: the displacement of the source for exits that face away from the ray.
    back2: f64,
    c_phi: f64,
    c_e: f64,
    /// σ_t′² / (4 C_phi(1/η) 4π²) [1/(unit² sr)], times the calibration; 0 where the model is.
    scale: f64,
}

/// The scalars by which a pair of points enters the kernel, shared by the channels. Lengths in scene units.
#[derive(Clone, Copy)]
pub(super) struct DirectionalGeometry {
    r: f64,
    /// |x × w|.
    rho: f64,
    x_w: f64,
    x_n: f64,
    /// -n_o·w.
    mu_0: f64,
    /// w·n*.
    w_star: f64,
    /// n*·n_o.
    n_star: f64,
}

impl DirectionalGeometry {
    /// From x = x_o - x_i, the outward normal of the entry, the refracted direction and the outward normal of the
    /// exit. Normals need not be of unit length.
    #[inline(always)]
    pub(super) fn new(x: DVec3, n_i: DVec3, w: DVec3, n_o: DVec3) -> Self {
        let r = x.length();
        let star = modified_normal(x, r, n_i);
        Self {
            r,
            rho: x.cross(w).length(),
            x_w: x.dot(w),
            x_n: x.dot(n_o),
            mu_0: -n_o.dot(w),
            w_star: w.dot(star),
            n_star: star.dot(n_o),
        }
    }

    /// The scalars in order, for vectorised loops.
    #[inline(always)]
    pub(super) fn columns(&self) -> [f64; 7] {
        [self.r, self.rho, self.x_w, self.x_n, self.mu_0, self.w_star, self.n_star]
    }

    /// The inverse of [`Self::columns`].
    #[inline(always)]
    pub(super) fn from_columns([r, rho, x_w, x_n, mu_0, w_star, n_star]: [f64; 7]) -> Self {
        Self { r, rho, x_w, x_n, mu_0, w_star, n_star }
    }
}

/// n*: `n` made orthogonal to `x`, normalised; `n` itself where `x` is 0. From the double cross product, because
/// subtracting the component along `x` loses all digits where the two are nearly parallel. Where they are parallel
/// every orthogonal direction is as good, and one is taken that depends on `x` alone.
///
/// Straight-line code with choices by value, as all of the kernel, so that loops over pairs vectorise.
#[inline(always)]
fn modified_normal(x: DVec3, r: f64, n: DVec3) -> DVec3 {
    let along = x * if r > 0.0 { 1.0 / r } else { 0.0 };
    let side = n.cross(along);
    let axis = if along.x.abs() < 0.8 { DVec3::X } else { DVec3::Y };
    let other = along.cross(axis);
    let parallel = side.length_squared() <= 1e-28;
    let side = if parallel { other } else { side };
    let star = along.cross(side) * (1.0 / side.length());
    if r > 0.0 { star } else { n }
}

/// The clamp of [FHK14]: no radiance where the image outweighs the source. Lets no NaN through.
#[inline(always)]
pub(super) fn clamped(value: f64) -> f64 {
    if value > 0.0 { value } else { 0.0 }
}

impl DirectionalChannel {
    /// One channel as published, for any α′ above 0; 0 without scattering.
    pub fn new(medium: &ChannelMedium) -> Self {
        let boundary = Boundary::new(medium.eta);
        let (sigma_t_prime, alpha_prime) = (medium.sigma_t_prime(), medium.alpha_prime());
        let alive = alpha_prime > 0.0;
        let d_e = 2.131 / 3.0 / if alive { alpha_prime.sqrt() } else { 1.0 };
        let back = sigma_t_prime / (3.0 * medium.sigma_t());
        Self {
            sigma_t_prime,
            s: (3.0 * medium.absorbed()).sqrt(),
            d_e,
            h: 2.0 * boundary.a * d_e,
            back2: if alive { back * back } else { 1.0 },
            c_phi: boundary.c_phi,
            c_e: boundary.c_e,
            scale: if alive {
                sigma_t_prime * sigma_t_prime / (4.0 * PI * PI * boundary.four_c_phi_outside)
            } else {
                0.0
            },
        }
    }

    /// S_d [1/(unit² sr)] before the clamp at 0, from x = x_o - x_i \[unit\], the outward normal of the entry, the
    /// refracted direction inside and the outward normal of the exit.
    pub fn unclamped(&self, x: DVec3, n_i: DVec3, w: DVec3, n_o: DVec3) -> f64 {
        self.kernel(&DirectionalGeometry::new(x, n_i, w, n_o), 0.0)
    }

    /// S_d e^{gain}, not clamped; `gain` is at most s r, so that the exponent is never above 0.
    ///
    /// With x·n* = 0: d_v² = r² + h², and the scalars of the image follow from those of the source. d_r is at most
    /// d_v: facing the ray d_r² - r² is at most D² + 2 D d_e < (2 A d_e)² as A is at least 1, facing away it is
    /// 1/(3 σ_t)² with σ_t′ ≤ 2 σ_t. And d_r is at least r. So with t = d_v - d_r ≥ 0, m = expm1(-s t), q = 1 + m,
    /// u = t / d_r and v = d_v / d_r the three differences of the two sources are
    ///
    ///   1/d_r - q/d_v             = (u - m) / d_v
    ///   k_r/d_r³ - q k_v/d_v³     = [k_r (u (1 + v + v²) - m) - q s t] / d_v³,                 k = 1 + s d
    ///   j_r/d_r⁵ - q j_v/d_v⁵     = [j_r (u (1 + v + v² + v³ + v⁴) - m) - q (j_v - j_r)] / d_v⁵,  j = 3 k + (s d)²
    #[inline(always)]
    pub(super) fn kernel(&self, pair: &DirectionalGeometry, gain: f64) -> f64 {
        let (s, h, length) = (self.s, self.h, self.sigma_t_prime);
        let (r, rho, x_w, x_n) = (pair.r * length, pair.rho * length, pair.x_w * length, pair.x_n * length);
        let r2 = r * r;
        // D = 1/3; rho / sqrt(r² + d_e²) is -cos b.
        let lift = pair.mu_0 / 3.0;
        let facing = lift * (lift + 2.0 * self.d_e * rho / (r2 + self.d_e * self.d_e).sqrt());
        // An exit at right angles to the ray at r = 0 would be at no distance.
        let beyond = if pair.mu_0 > 0.0 { facing } else { self.back2 }.max(1e-80);
        let (d_r, d_v) = ((r2 + beyond).sqrt(), (r2 + h * h).sqrt());
        let t = (h * h - beyond) / (d_v + d_r);
        let m = exp_m1(-s * t);
        let q = 1.0 + m;
        let (u, v, over) = (t / d_r, d_v / d_r, 1.0 / d_v);
        let v2 = v * v;
        let (k_r, k_v) = (1.0 + s * d_r, 1.0 + s * d_v);
        let (j_r, j_v) = (3.0 * k_r + s * d_r * (s * d_r), 3.0 * k_v + s * d_v * (s * d_v));
        let first = (u - m) * over;
        let third = (k_r * (u * (1.0 + v + v2) - m) - q * s * t) * over * over * over;
        let rise = s * t * (3.0 + s * (d_r + d_v));
        let fifth = (j_r * (u * (1.0 + v + v2 * (1.0 + v + v2)) - m) - q * rise) * over * over * over * over * over;
        // Factors of k/d³ and j/d⁵ for the source, and what the image has more.
        let (c_phi, c_e) = (self.c_phi, self.c_e);
        let p = 3.0 * c_phi * x_w + c_e * (x_n + pair.mu_0);
        let p_more = h * (3.0 * c_phi * pair.w_star - c_e * pair.n_star) + 2.0 * c_e * pair.w_star * pair.n_star;
        let o = c_e * x_w * x_n;
        let o_more = c_e * h * (pair.w_star * x_n - pair.n_star * (x_w + h * pair.w_star));
        let over3 = over * over * over;
        let sum = 3.0 * c_phi * first
            + (p * third - p_more * q * k_v * over3)
            + (o * fifth - o_more * q * j_v * over3 * over * over);
        self.scale * sum * exp(gain - s * d_r)
    }

    /// Exitance over the plane, normal incidence, per entered flux, of the clamped model.
    fn total(&self, boundary: &Boundary) -> f64 {
        if self.scale == 0.0 {
            return 0.0;
        }
        let rule = GaussLegendre::new(16);
        let unit = 1.0 / self.sigma_t_prime;
        // r = e^y in units of the mean free path; beyond r = 1e8 or 50/s nothing is left. The end of the
        // logarithmic axis at 1e-5 drops r²: 1e-10.
        let (first, last) = (1e-5_f64.ln(), 1e8_f64.min(50.0 / self.s.max(1e-7)).ln());
        let panels = 30;
        let width = (last - first) / f64::from(panels);
        let sum: f64 = (0..panels)
            .map(|i| {
                let a = first + width * f64::from(i);
                rule.integrate(a, a + width, |y| {
                    let r = unit * y.exp();
                    let pair =
                        DirectionalGeometry { r, rho: r, x_w: 0.0, x_n: 0.0, mu_0: 1.0, w_star: -1.0, n_star: 1.0 };
                    2.0 * PI * r * r * clamped(self.kernel(&pair, 0.0))
                })
            })
            .sum();
        PI * boundary.four_c_phi_outside * sum
    }
}

impl DirectionalDipole {
    /// The model of `medium`, as published; `calibrated` scales each channel so that its total over a plane at
    /// normal incidence is the true albedo of a half space with the same α′ and η: the equation of transfer solved
    /// for isotropic scattering, good to 1e-4 for g = 0 and to similarity for g ≠ 0 (1 % high at g = 0.8,
    /// α′ = 0.995; 30 % at α′ = 0.64, where the model should not be used).
    pub fn new(medium: &Medium, calibrated: bool) -> Self {
        let boundary = Boundary::new(f64::from(medium.eta));
        let media: [ChannelMedium; 3] = std::array::from_fn(|c| ChannelMedium::of(medium, c));
        let half_space = HalfSpace::new(f64::from(medium.eta));
        let grey = medium.is_grey();
        let mut channels = media.map(|m| DirectionalChannel::new(&m));
        let mut totals = [0.0; 3];
        for c in 0..3 {
            if grey && c > 0 {
                (channels[c], totals[c]) = (channels[0], totals[0]);
                continue;
            }
            totals[c] = channels[c].total(&boundary);
            if calibrated && totals[c] > 0.0 {
                let truth = half_space.reflectance(media[c].absorbed());
                channels[c].scale *= truth / totals[c];
                totals[c] = truth;
            }
        }
        let decay = channels.iter().map(|k| k.s * k.sigma_t_prime).fold(f64::INFINITY, f64::min);
        let extinction = Rgb::from_fn(|c| {
            let g = media[c].g;
            (media[c].sigma_s * (1.0 - g * g) + media[c].sigma_a) as f32
        });
        Self { channels, totals, extinction, grey, decay: decay as f32 }
    }

    pub(super) fn each_channel(&self, entry: &Entry, exit: &Exit, rate: f32, finish: impl Fn(f64) -> f64) -> Rgb {
        let x = exit.x.as_dvec3() - entry.x.as_dvec3();
        let pair = DirectionalGeometry::new(x, entry.n.as_dvec3(), entry.w.as_dvec3(), exit.n.as_dvec3());
        let gain = f64::from(rate) * pair.r;
        let value = |k: &DirectionalChannel| to_finite(finish(k.kernel(&pair, gain)));
        if self.grey {
            return Rgb::splat(value(&self.channels[0]));
        }
        Rgb::from_fn(|c| value(&self.channels[c]))
    }

    /// Delta-Eddington extinction σ_s (1 - g²) + σ_a [1/unit] of the reduced-intensity part S_dE of \[FHK14\]: the
    /// light that is refracted in, attenuated by exp(-extinction · length) along a straight path, and refracted
    /// out. It is a specular path of the renderer, multiplied by that factor, and no part of [`super::Bssrdf::eval`].
    pub fn reduced_intensity_extinction(&self) -> Rgb {
        self.extinction
    }
}
