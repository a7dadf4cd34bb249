//! Matt surfaces with a picture on them.

use super::{Bsdf, BsdfSample, Lambertian, OrenNayar, Texture};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use std::sync::Arc;

/// Lambertian, or rough, with the albedo of a texture at each point. Points face the viewer.
#[derive(Clone, Debug)]
pub struct Textured {
    /// Reflected over incident flux.
    pub albedo: Arc<Texture>,
    /// As of [`OrenNayar`]; 0 of a Lambertian one.
    pub roughness: f32,
}

impl Textured {
    fn there(&self, at: &SurfacePoint) -> Lambertian {
        Lambertian { albedo: self.albedo.at(at.uv) }
    }

    fn rough(&self, at: &SurfacePoint) -> Option<OrenNayar> {
        (self.roughness > 0.0).then(|| OrenNayar::new(self.albedo.at(at.uv), self.roughness))
    }
}

impl Bsdf for Textured {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        self.rough(at).map_or_else(|| self.there(at).eval(at, wo, wi), |rough| rough.eval(at, wo, wi))
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        self.rough(at).map_or_else(|| self.there(at).sample(at, wo, u), |rough| rough.sample(at, wo, u))
    }

    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32 {
        self.rough(at).map_or_else(|| Lambertian::BLACK.pdf(at, wo, wi), |rough| rough.pdf(at, wo, wi))
    }

    fn is_lambertian(&self) -> bool {
        self.roughness == 0.0
    }

    /// By the mean of the picture.
    fn albedo(&self) -> Rgb {
        OrenNayar::new(self.albedo.mean(), self.roughness).albedo()
    }

    fn albedo_at(&self, at: &SurfacePoint) -> Rgb {
        self.rough(at).map_or_else(|| self.albedo.at(at.uv), |rough| rough.albedo())
    }

    fn textures(&self) -> Vec<&Arc<Texture>> {
        vec![&self.albedo]
    }

    fn text(&self) -> String {
        if self.roughness == 0.0 {
            return format!("diffuse, albedo by {}", self.albedo.text());
        }
        format!("rough diffuse, albedo by {}, roughness {}", self.albedo.text(), self.roughness)
    }
}
