//! An emissive mesh.

use super::{Cone, Light, LightBounds, LightEnd, LightSample, Reference, Shines};
use crate::geometry::{AreaTable, Mesh};
use crate::math::{Aabb, DVec3, Vec3};
use crate::scene::{Emission, Scene};
use std::f64::consts::PI;

/// A mesh that shines, every point of it alike.
pub struct AreaLight {
    object: u32,
    table: AreaTable,
    emission: Emission,
    bounds: Aabb,
    normals: Cone,
    /// Area as it is seen from afar where it is seen best [unit²].
    projected: f64,
}

impl AreaLight {
    /// Those of a scene; an emissive mesh without area or radiance is none.
    pub fn all(scene: &Scene) -> impl Iterator<Item = Self> + '_ {
        (0_u32..).zip(&scene.objects).filter_map(|(object, o)| {
            let emission = scene.materials[o.material].surface.emission.filter(|e| !e.radiance.is_black())?;
            Self::new(object, &o.mesh, emission)
        })
    }

    fn new(object: u32, mesh: &Mesh, emission: Emission) -> Option<Self> {
        let (table, bounds) = (AreaTable::new(mesh)?, mesh.bounds()?);
        let scaled = || (0..mesh.triangles.len() as u32).map(|t| mesh.scaled_normal(t));
        let sum: DVec3 = scaled().sum();
        let normals = Cone::around(sum, scaled());
        // Of a closed convex surface the mean is a quarter of its area.
        let projected = (0.5 * sum.length()).max(0.25 * table.area());
        Some(Self { object, table, emission, bounds, normals, projected })
    }

    /// Triangles with area.
    pub fn triangles(&self) -> usize {
        self.table.len()
    }
}

impl Light for AreaLight {
    fn name(&self, scene: &Scene) -> String {
        scene.objects[self.object as usize].name.clone()
    }

    fn power(&self) -> f64 {
        let sides = if self.emission.two_sided { 2.0 } else { 1.0 };
        PI * self.table.area() * self.emission.radiance.mean_f64() * sides
    }

    fn mean_radiance(&self) -> f32 {
        self.emission.radiance.mean()
    }

    fn bounds(&self) -> Option<LightBounds> {
        Some(LightBounds {
            bounds: self.bounds,
            intensity: self.projected * self.emission.radiance.mean_f64(),
            normals: self.normals,
            falloff: 0.5 * PI,
            two_sided: self.emission.two_sided,
        })
    }

    fn object(&self) -> Option<u32> {
        Some(self.object)
    }

    fn area(&self) -> f64 {
        self.table.area()
    }

    fn sample(&self, scene: &Scene, _: &Reference, pick: f64, u: [f32; 2]) -> Option<LightSample> {
        let sample = self.table.sample(pick, u);
        let at = scene.objects[self.object as usize].mesh.point(sample.triangle, sample.u, sample.v);
        let Emission { radiance, two_sided } = self.emission;
        let shines = if two_sided { Shines::BothSides } else { Shines::Front };
        let end = LightEnd::Point { at, shines };
        Some(LightSample {
            end,
            radiance,
            pdf: 1.0 / self.area(),
            is_delta: false,
            object: Some(self.object),
            light: 0,
        })
    }

    fn pdf(&self, _: &Reference, _: Vec3) -> f64 {
        1.0 / self.area()
    }
}
