//! Direct light on opaque surfaces: soft shadows of area lights.

use super::glossy::Glossy;
use super::shade::DirectLight;
use super::{CameraRay, Integrator, KnownLights, Part, View, camera_hits};
use crate::error::Result;
use crate::geometry::SurfacePoint;
use crate::light::{Lights, emitted};
use crate::math::Rgb;
use crate::scene::{Scene, Surface};
use crate::surface::{Bsdf, Colour, Lambertian, Textured};
use crate::tally::Tally;
use std::sync::Arc;

/// Opaque surfaces under the scene's lights, without interreflection. A translucent surface is shown as
/// a Lambertian one with its model's diffuse reflectance: a preview.
pub struct Direct {
    light: DirectLight,
    albedo: Albedos,
    glossy: Option<Glossy>,
}

impl Direct {
    /// `light_samples`: samples of each kind of light per camera ray, at least 1.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(scene: &Scene, light_samples: u32) -> Result<Self> {
        let light = DirectLight { lights: Lights::new(scene), samples: light_samples };
        Ok(Self { light, albedo: Albedos::new(scene)?, glossy: Glossy::new(scene, light_samples) })
    }
}

/// Lambertian surfaces that stand for translucent ones, of the reflectance of their models; one for each object, `None` of others.
pub(super) fn stand_ins(scene: &Scene) -> Result<Vec<Option<Arc<dyn Bsdf>>>> {
    let of = |surface: &Surface| {
        let Some(inside) = &surface.inside else { return Ok(None) };
        let total = inside.build()?.total();
        // Light goes in and out by pigment of about the same place.
        let tinted = inside.tint.as_ref().map(|tint| tint.map(|t| total.map(|v| v.min(1.0)) * t * t));
        let stand_in: Arc<dyn Bsdf> = match tinted {
            Some(Colour::Picture(albedo)) => Arc::new(Textured { albedo, roughness: 0.0 }),
            Some(Colour::Even(albedo)) => Arc::new(Lambertian { albedo }),
            None => Arc::new(Lambertian { albedo: total }),
        };
        Ok(Some(stand_in))
    };
    scene.objects.iter().map(|o| of(&scene.materials[o.material].surface)).collect()
}

/// The Lambertian albedo of all surfaces, or of what stands for them.
pub(super) struct Albedos(Vec<Option<Arc<dyn Bsdf>>>);

impl Albedos {
    /// # Errors
    /// As [`stand_ins`].
    pub(super) fn new(scene: &Scene) -> Result<Self> {
        stand_ins(scene).map(Self)
    }

    /// At a point of the surface of `object`.
    pub(super) fn at(&self, scene: &Scene, object: u32, at: &SurfacePoint) -> Rgb {
        match &self.0[object as usize] {
            Some(stand_in) => stand_in.albedo_at(at),
            None => scene.surface(object).bsdf.albedo_at(at),
        }
    }
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
                    + self.light.reflected(view, &at, self.albedo.at(view.scene, hit.mesh, &at), &mut stream, tally)
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
