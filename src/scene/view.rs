//! A scene and the rays that were built for it: what every method gets.

use super::Scene;
use crate::geometry::SurfacePoint;
use crate::math::Vec3;
use crate::query::{Hit, RayQuery};

/// The scene and the backend that was built for it.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The checked world.
    pub scene: &'a Scene,
    /// Rays against its meshes.
    pub rays: &'a dyn RayQuery,
}

impl View<'_> {
    /// The point of `hit`, its normals outwards.
    #[inline]
    pub fn outwards(&self, hit: &Hit) -> SurfacePoint {
        self.scene.objects[hit.mesh as usize].mesh.point(hit.triangle, hit.u, hit.v)
    }

    /// The point of `hit`, its normals towards where a ray into `direction` came from, that for shading bent by the surface's relief.
    #[inline]
    pub fn point(&self, hit: &Hit, direction: Vec3) -> SurfacePoint {
        let at = self.outwards(hit);
        let at = match &self.scene.surface(hit.mesh).relief {
            None => at,
            Some(relief) => relief.bend(at, self.scene.objects[hit.mesh as usize].mesh.tangents(hit.triangle)),
        };
        at.facing(-direction)
    }
}
