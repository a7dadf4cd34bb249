//! Rays past what a picture says is not there.

use super::Scene;
use crate::error::Result;
use crate::math::{hash_combine, unit_f32};
use crate::query::{self, Backend, Hit, Ray, RayQuery};

/// Rays that pass the points of surfaces with a mask by the chance of what it lets through: all that a method asks sees the same holes.
struct Masked<'a> {
    scene: &'a Scene,
    rays: Box<dyn RayQuery>,
}

impl Scene {
    /// What traces rays against the scene's meshes and masks.
    ///
    /// # Errors
    /// As [`query::build`].
    pub fn rays(&self, backend: Backend) -> Result<Box<dyn RayQuery + '_>> {
        let rays = query::build(backend, &self.meshes())?;
        let masked = self.objects.iter().any(|o| self.materials[o.material].surface.opacity.is_some());
        Ok(if masked { Box::new(Masked { scene: self, rays }) } else { rays })
    }
}

impl Masked<'_> {
    /// Whether the surface is there for this ray: a function of both, so that every question has one answer.
    fn is_there(&self, ray: &Ray, hit: &Hit) -> bool {
        let Some(mask) = &self.scene.surface(hit.mesh).opacity else { return true };
        let opacity = mask.at(self.scene.objects[hit.mesh as usize].mesh.point(hit.triangle, hit.u, hit.v).uv)[0];
        if opacity >= 1.0 || opacity <= 0.0 {
            return opacity >= 1.0;
        }
        let mut key = u64::from(hit.triangle);
        for v in ray.direction.to_array() {
            key = hash_combine(key, v.to_bits().into());
        }
        for v in ray.origin.to_array() {
            key = hash_combine(key, v.to_bits());
        }
        unit_f32((key >> 32) as u32) < opacity
    }

    /// The first one that is there, `hit` being the first of all.
    fn beyond(&self, ray: &Ray, mut hit: Option<Hit>) -> Option<Hit> {
        let mut rest = *ray;
        while let Some(found) = &hit {
            if self.is_there(ray, found) {
                break;
            }
            rest.t_min = found.t;
            hit = self.rays.closest(&rest);
        }
        hit
    }
}

impl RayQuery for Masked<'_> {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.beyond(ray, self.rays.closest(ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.rays.occluded(ray) && self.closest(ray).is_some()
    }

    fn closest_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.rays.closest_batch(rays, hits);
        rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.beyond(ray, *hit));
    }

    fn occluded_batch(&self, rays: &[Ray], out: &mut [bool]) {
        self.rays.occluded_batch(rays, out);
        rays.iter().zip(out).for_each(|(ray, out)| *out = *out && self.closest(ray).is_some());
    }

    fn description(&self) -> String {
        self.rays.description()
    }

    fn bytes(&self) -> Option<usize> {
        self.rays.bytes()
    }
}
