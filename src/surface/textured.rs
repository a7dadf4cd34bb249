//! Matt surfaces with a picture on them.

use super::{Bsdf, BsdfSample, Lambertian, Texture};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use std::sync::Arc;

/// Lambertian, with the albedo of a texture at each point: f = albedo/π. Points face the viewer.
#[derive(Clone, Debug)]
pub struct Textured {
    /// Reflected over incident flux.
    pub albedo: Arc<Texture>,
}

impl Textured {
    fn there(&self, at: &SurfacePoint) -> Lambertian {
        Lambertian { albedo: self.albedo.at(at.uv) }
    }
}

impl Bsdf for Textured {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        self.there(at).eval(at, wo, wi)
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        self.there(at).sample(at, wo, u)
    }

    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32 {
        Lambertian::BLACK.pdf(at, wo, wi)
    }

    fn is_lambertian(&self) -> bool {
        true
    }

    /// The mean of the picture.
    fn albedo(&self) -> Rgb {
        self.albedo.mean()
    }

    fn albedo_at(&self, at: &SurfacePoint) -> Rgb {
        self.albedo.at(at.uv)
    }

    fn texture(&self) -> Option<&Arc<Texture>> {
        Some(&self.albedo)
    }

    fn text(&self) -> String {
        let [width, height] = self.albedo.resolution();
        format!("diffuse, albedo by {}, {width} x {height} pixels, mean {:?}", self.albedo.name(), self.albedo.mean().0)
    }
}
