//! Direct light on opaque surfaces: soft shadows of area lights.

use super::glossy::Glossy;
use super::shade::DirectLight;
use super::{CameraRay, Integrator, KnownLights, Part, View, camera_hits};
use crate::error::Result;
use crate::light::{Lights, emitted};
use crate::math::Rgb;
use crate::scene::{Scene, Surface};
use crate::tally::Tally;

/// Opaque surfaces under the scene's lights, without interreflection. A translucent surface is shown as
/// a Lambertian one with its model's diffuse reflectance: a preview.
pub struct Direct {
    light: DirectLight,
    /// Albedo of each object's surface.
    albedo: Vec<Rgb>,
    glossy: Option<Glossy>,
}

impl Direct {
    /// `light_samples`: samples of each kind of light per camera ray, at least 1.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(scene: &Scene, light_samples: u32) -> Result<Self> {
        let light = DirectLight { lights: Lights::new(scene), samples: light_samples };
        Ok(Self { light, albedo: lambertian_albedos(scene)?, glossy: Glossy::new(scene) })
    }
}

/// The Lambertian albedo that stands for each object's surface.
pub(super) fn lambertian_albedos(scene: &Scene) -> Result<Vec<Rgb>> {
    let albedo = |surface: &Surface| {
        Ok(match &surface.inside {
            Some(t) => t.build()?.total(),
            None => surface.bsdf.albedo(),
        })
    };
    scene.objects.iter().map(|o| albedo(&scene.materials[o.material].surface)).collect()
}

impl Integrator for Direct {
    type Pass = ();

    fn begin_pass(&self, _: View<'_>, _: u32, _: &mut Tally) {}

    fn radiance(&self, view: View<'_>, (): &(), rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let hits = camera_hits(view, rays, tally);
        for ((ray, hit), out) in rays.iter().zip(&hits).zip(out) {
            let Some(hit) = hit else {
                *out = self.light.lights.environment(ray.ray.direction);
                continue;
            };
            let glossy = self.glossy.as_ref().and_then(|glossy| glossy.radiance(view, ray, hit, tally));
            *out = glossy.unwrap_or_else(|| {
                let at = view.point(hit, ray.ray.direction);
                let mut stream = ray.stream;
                emitted(view.scene, hit, ray.ray.direction)
                    + self.light.reflected(view, &at, self.albedo[hit.mesh as usize], &mut stream, tally)
            });
        }
    }

    fn lights(&self, scene: &Scene) -> KnownLights {
        KnownLights::asked(scene, &self.light.lights)
    }

    fn parts(&self, scene: &Scene) -> Vec<Part> {
        let mut parts = self.light.parts(scene);
        parts.push(Part::built(
            "any-hit shadow rays",
            format!("{} per camera ray and kind of light", self.light.samples),
        ));
        parts.push(Part::no_cache(scene, "direct"));
        parts
    }
}
