//! Matt surfaces.

use super::{Bsdf, BsdfSample};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use crate::sampling::cosine_hemisphere;
use std::f32::consts::FRAC_1_PI;

/// Reflects evenly into all directions of the side that light comes from: f = albedo/π. Points face the viewer.
#[derive(Clone, Copy, Debug)]
pub struct Lambertian {
    /// Reflected over incident flux, in [0, 1].
    pub albedo: Rgb,
}

impl Lambertian {
    /// What reflects nothing.
    pub const BLACK: Self = Self { albedo: Rgb::BLACK };
}

impl Bsdf for Lambertian {
    fn eval(&self, at: &SurfacePoint, _: Vec3, wi: Vec3) -> Rgb {
        if at.n.dot(wi) > 0.0 { self.albedo * FRAC_1_PI } else { Rgb::BLACK }
    }

    fn sample(&self, at: &SurfacePoint, _: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(at.n, [u[0], u[1]]);
        Some(BsdfSample { wi, weight: self.albedo, pdf: self.pdf(at, wi, wi) })
    }

    fn pdf(&self, at: &SurfacePoint, _: Vec3, wi: Vec3) -> f32 {
        at.n.dot(wi).max(0.0) * FRAC_1_PI
    }

    fn is_lambertian(&self) -> bool {
        true
    }

    fn albedo(&self) -> Rgb {
        self.albedo
    }

    fn text(&self) -> String {
        format!("diffuse, albedo {:?}", self.albedo.0)
    }
}
