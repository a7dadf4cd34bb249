//! Smooth boundaries between two media.

use super::{Bsdf, BsdfSample};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use crate::optics::{reflect, reflectance, refract};

/// A smooth dielectric boundary: mirrors, and refracts what it does not mirror.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    /// n_inside / n_outside, inside being where the outward normal does not point.
    pub eta: f32,
}

impl Bsdf for Boundary {
    fn eval(&self, _: &SurfacePoint, _: Vec3, _: Vec3) -> Rgb {
        Rgb::BLACK
    }

    /// By the Fresnel factor, on the triangle itself: interpolated normals would not conserve flux. The weight is 1 either way, but for
    /// the η² of radiance, which cancels along a path that comes in and goes out.
    fn sample(&self, at: &SurfacePoint, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let outside = at.n_geometric.dot(wo) >= 0.0;
        let (n, eta) = if outside { (at.n_geometric, self.eta) } else { (-at.n_geometric, 1.0 / self.eta) };
        let mirrored = u[0] < reflectance(eta, n.dot(wo));
        let refracted = if mirrored { None } else { refract(wo, n, eta) };
        Some(BsdfSample { wi: refracted.unwrap_or_else(|| reflect(wo, n)), weight: Rgb::WHITE, pdf: 0.0 })
    }

    fn pdf(&self, _: &SurfacePoint, _: Vec3, _: Vec3) -> f32 {
        0.0
    }

    fn is_delta(&self) -> bool {
        true
    }

    /// Of what comes from outside and is mirrored at once, at normal incidence.
    fn albedo(&self) -> Rgb {
        Rgb::splat(reflectance(self.eta, 1.0))
    }

    fn text(&self) -> String {
        format!("smooth boundary, eta {}", self.eta)
    }
}
