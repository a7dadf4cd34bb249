//! A disk far away: the sun, or any light that is as far and wider.

use super::{Light, LightBounds, LightEnd, LightSample, Reference};
use crate::math::{DVec3, Rgb, Vec3};
use crate::scene::{LightKind, LightSource, Scene};
use std::f64::consts::{PI, TAU};

/// A disk of even radiance around a direction.
pub struct Sun {
    name: String,
    /// Unit vectors: to its middle, and two across.
    frame: [DVec3; 3],
    irradiance: Rgb,
    radiance: Rgb,
    /// 1 - cos of half its angle.
    height: f64,
}

impl Sun {
    /// `None` of another kind of light, or of none.
    pub fn boxed(source: &LightSource) -> Option<Box<dyn Light>> {
        let LightKind::Sun { towards, irradiance, half_angle } = source.kind else { return None };
        let (u, v) = towards.any_orthonormal_pair();
        // Irradiance is ∫ L cosθ dω.
        let per_radiance = PI * half_angle.sin().powi(2);
        let radiance = irradiance.map(|e| (f64::from(e) / per_radiance) as f32);
        let height = 2.0 * (0.5 * half_angle).sin().powi(2);
        let name = source.name.clone();
        (!irradiance.is_black())
            .then(|| Box::new(Self { name, frame: [towards, u, v], irradiance, radiance, height }) as _)
    }

    /// Whether the unit vector `w` leads to it. Of small angles the cosine would say little.
    fn holds(&self, w: Vec3) -> bool {
        (w.as_dvec3() - self.frame[0]).length_squared() <= 2.0 * self.height
    }
}

impl Light for Sun {
    fn name(&self, _: &Scene) -> String {
        self.name.clone()
    }

    fn power(&self) -> f64 {
        self.irradiance.mean_f64()
    }

    fn mean_radiance(&self) -> f32 {
        self.radiance.mean()
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    fn solid_angle(&self) -> f64 {
        TAU * self.height
    }

    fn sample(&self, _: &Scene, _: &Reference, pick: f64, [u, _]: [f32; 2]) -> Option<LightSample> {
        let (down, angle) = (pick * self.height, TAU * f64::from(u));
        let across = (down * (2.0 - down)).max(0.0).sqrt();
        let [z, x, y] = self.frame;
        let w = (z * (1.0 - down) + (x * angle.cos() + y * angle.sin()) * across).as_vec3().normalize();
        let (end, pdf) = (LightEnd::Direction(w), self.pdf(&Reference::place(DVec3::ZERO), w));
        // At its rim rounding may lead beside it.
        (pdf > 0.0).then_some(LightSample {
            end,
            radiance: self.radiance,
            pdf,
            is_delta: false,
            object: None,
            light: 0,
        })
    }

    fn pdf(&self, _: &Reference, w: Vec3) -> f64 {
        if self.holds(w) { self.solid_angle().recip() } else { 0.0 }
    }

    fn radiance(&self, w: Vec3) -> Rgb {
        if self.holds(w) { self.radiance } else { Rgb::BLACK }
    }
}
