//! Rough matt surfaces: clay, plaster, cloth, the moon.

use super::{Bsdf, BsdfSample};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use crate::sampling::cosine_hemisphere;
use std::f32::consts::{FRAC_1_PI, PI};

/// Oren and Nayar's model in Fujii's form with the light that is reflected more than once, so that a white one loses none \[PKH24\].
/// Points face the viewer.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    albedo: Rgb,
    roughness: f32,
}

/// 1/2 - 2/(3π) and 2/3 - 28/(15π).
const FACETS: [f32; 2] = [0.287_793_4, 0.072_488_21];

impl OrenNayar {
    /// `albedo` of the facets and `roughness`, both in [0, 1]; with roughness 0 it is Lambertian.
    pub fn new(albedo: Rgb, roughness: f32) -> Self {
        Self { albedo, roughness }
    }

    fn level(&self) -> f32 {
        1.0 / (1.0 + FACETS[0] * self.roughness)
    }

    /// Share of light along a direction of this cosine that leaves white facets by one reflection.
    fn once(&self, cosine: f32) -> f32 {
        let mu = cosine.clamp(1e-4, 1.0);
        let sine = (1.0 - mu * mu).max(0.0).sqrt();
        let g = sine * (mu.acos() - sine * mu) + 2.0 / 3.0 * (sine / mu * (1.0 - sine * sine * sine) - sine);
        self.level() * (1.0 + self.roughness * FRAC_1_PI * g)
    }

    fn mean(&self) -> f32 {
        self.level() * (1.0 + FACETS[1] * self.roughness)
    }

    /// Albedo of what is reflected more than once.
    fn again(&self) -> Rgb {
        let mean = self.mean();
        self.albedo.map(|a| a * a * mean / (1.0 - a * (1.0 - mean)))
    }
}

impl Bsdf for OrenNayar {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        let (o, i) = (at.n.dot(wo), at.n.dot(wi));
        if o <= 0.0 || i <= 0.0 {
            return Rgb::BLACK;
        }
        let s = wi.dot(wo) - i * o;
        let s = if s > 0.0 { s / i.max(o) } else { s };
        let once = self.albedo * (FRAC_1_PI * self.level() * (1.0 + self.roughness * s));
        let lost = (1.0 - self.once(o)).max(0.0) * (1.0 - self.once(i)).max(0.0) / (1.0 - self.mean()).max(1e-7);
        once + self.again() * (FRAC_1_PI * lost)
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(at.n, [u[0], u[1]]);
        Some(BsdfSample { wi, weight: self.eval(at, wo, wi) * PI, pdf: self.pdf(at, wo, wi) })
    }

    fn pdf(&self, at: &SurfacePoint, _: Vec3, wi: Vec3) -> f32 {
        at.n.dot(wi).max(0.0) * FRAC_1_PI
    }

    fn albedo(&self) -> Rgb {
        let mean = self.mean();
        self.albedo * mean + self.again() * (1.0 - mean)
    }

    fn text(&self) -> String {
        format!("rough diffuse, albedo {:?}, roughness {}", self.albedo.0, self.roughness)
    }
}
