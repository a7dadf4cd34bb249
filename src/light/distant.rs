//! Parallel light.

use super::{Light, LightBounds, LightEnd, LightSample, Reference};
use crate::math::{Rgb, Vec3};
use crate::scene::{LightKind, LightSource, Scene};
use std::f32::consts::PI;

/// Light from one direction.
pub struct Distant {
    name: String,
    towards: Vec3,
    irradiance: Rgb,
}

impl Distant {
    /// `None` of another kind of light, or of none.
    pub fn boxed(source: &LightSource) -> Option<Box<dyn Light>> {
        let LightKind::Distant { towards, irradiance } = source.kind else { return None };
        let light = Self { name: source.name.clone(), towards: towards.as_vec3(), irradiance };
        (!irradiance.is_black()).then(|| Box::new(light) as _)
    }
}

impl Light for Distant {
    fn name(&self, _: &Scene) -> String {
        self.name.clone()
    }

    fn power(&self) -> f64 {
        self.irradiance.mean_f64()
    }

    /// That of a half of the sky.
    fn mean_radiance(&self) -> f32 {
        self.irradiance.mean() / PI
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    fn is_delta(&self) -> bool {
        true
    }

    fn sample(&self, _: &Scene, _: &Reference, _: f64, _: [f32; 2]) -> Option<LightSample> {
        let end = LightEnd::Direction(self.towards);
        Some(LightSample { end, radiance: self.irradiance, pdf: 1.0, is_delta: true, object: None, light: 0 })
    }

    fn pdf(&self, _: &Reference, _: Vec3) -> f64 {
        0.0
    }
}
