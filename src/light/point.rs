//! Places that shine: into all directions, or into a cone.

use super::{Cone, Light, LightBounds, LightEnd, LightSample, Reference, Shines};
use crate::geometry::SurfacePoint;
use crate::math::{Aabb, DVec3, Rgb, Vec3};
use crate::scene::{LightKind, LightSource, Scene};
use std::f64::consts::PI;

/// A light at a place, without a surface.
pub struct PointLight {
    name: String,
    at: SurfacePoint,
    shines: Shines,
    intensity: Rgb,
    /// Of an even light that sends as much to the nearest body.
    mean_radiance: f32,
}

impl PointLight {
    /// `None` of another kind of light, or of none.
    pub fn boxed(scene: &Scene, source: &LightSource) -> Option<Box<dyn Light>> {
        let (x, axis, shines, intensity) = match source.kind {
            LightKind::Point { position, intensity } => (position, DVec3::Z, Shines::Everywhere, intensity),
            LightKind::Spot { position, axis, intensity, cosines } => {
                (position, axis, Shines::Cone(cosines.map(|c| c as f32)), intensity)
            }
            _ => return None,
        };
        let n = axis.as_vec3();
        let at = SurfacePoint { x, n_geometric: n, n, uv: [0.0; 2], error: 0.0 };
        let bodies = scene.bodies.iter().flatten().map(|body| body.bounds);
        let square = |bounds: Aabb| bounds.centre().distance_squared(x);
        let nearest = bodies.map(square).fold(f64::INFINITY, f64::min);
        let mean_radiance = if nearest.is_finite() { (intensity.mean_f64() / PI / nearest) as f32 } else { 0.0 };
        let light = Self { name: source.name.clone(), at, shines, intensity, mean_radiance };
        (!intensity.is_black()).then(|| Box::new(light) as _)
    }
}

impl Light for PointLight {
    fn name(&self, _: &Scene) -> String {
        self.name.clone()
    }

    fn power(&self) -> f64 {
        let solid_angle = match self.shines {
            Shines::Cone([from, to]) => 2.0 * PI * (1.0 - 0.5 * f64::from(from + to)),
            _ => 4.0 * PI,
        };
        self.intensity.mean_f64() * solid_angle
    }

    fn mean_radiance(&self) -> f32 {
        self.mean_radiance
    }

    fn bounds(&self) -> Option<LightBounds> {
        let axis = self.at.n.as_dvec3();
        let half = match self.shines {
            // Nothing fades within it.
            Shines::Cone([_, to]) => f64::from(to).acos(),
            _ => PI,
        };
        Some(LightBounds {
            bounds: Aabb::around([self.at.x]),
            intensity: self.intensity.mean_f64(),
            normals: Cone { axis, half },
            falloff: 0.0,
            two_sided: false,
        })
    }

    fn is_delta(&self) -> bool {
        true
    }

    fn sample(&self, _: &Scene, _: &Reference, _: f64, _: [f32; 2]) -> Option<LightSample> {
        let end = LightEnd::Point { at: self.at, shines: self.shines };
        Some(LightSample { end, radiance: self.intensity, pdf: 1.0, is_delta: true, object: None, light: 0 })
    }

    fn pdf(&self, _: &Reference, _: Vec3) -> f64 {
        0.0
    }
}
