//! Path tracing over opaque surfaces and through clear bodies: light from lamps and environment by any number of reflections.

use super::direct::stand_ins;
use super::parts::clear_bodies;
use super::shade::DirectLight;
use super::volume_path::{Scratch, VolumePath};
use super::{CameraRay, Integrator, KnownLights, MOST_SURFACES, Part, View, camera_hits};
use crate::error::Result;
use crate::light::Lights;
use crate::math::Rgb;
use crate::scene::Scene;
use crate::tally::Tally;
use crate::words::counted;

/// Next-event estimation at each surface, multiple importance sampling with the direction in which the path goes on, Russian roulette.
/// A translucent surface is shown as a Lambertian one with its model's diffuse reflectance: a preview.
pub struct Path {
    paths: VolumePath,
    light: DirectLight,
    bounces: Option<u32>,
}

impl Path {
    /// What to say of `scene` before it is rendered: light that may not be found.
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        self.paths.warnings(scene)
    }

    /// Over at most `bounces` surfaces after the first; as many as it takes if absent.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(scene: &Scene, bounces: Option<u32>, seed: u64) -> Result<Self> {
        let most = bounces.unwrap_or(MOST_SURFACES).min(MOST_SURFACES);
        let light = DirectLight { lights: Lights::new(scene), samples: 1 };
        Ok(Self { paths: VolumePath::over_surfaces(scene, stand_ins(scene)?, most, seed), light, bounces })
    }
}

impl Integrator for Path {
    type Pass = ();

    fn begin_pass(&self, _: View<'_>, _: u32, _: &mut Tally) {}

    fn radiance(&self, view: View<'_>, (): &(), rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let hits = camera_hits(view, rays, tally);
        let mut scratch = Scratch::default();
        let inside = self.paths.camera_is_inside();
        for ((ray, hit), out) in rays.iter().zip(&hits).zip(out) {
            *out = match hit {
                _ if inside => self.paths.seen_from_inside(view, ray, &mut scratch, tally),
                None => self.light.lights.environment(ray.ray.direction),
                Some(hit) => self.paths.shade(view, &[], ray, &mut scratch, tally, hit),
            };
        }
    }

    fn lights(&self, scene: &Scene) -> KnownLights {
        KnownLights::asked(scene, &self.light.lights)
    }

    fn parts(&self, scene: &Scene) -> Vec<Part> {
        let mut parts = self.light.parts(scene);
        let over = match self.bounces {
            Some(most) => format!("over at most {} after the first", counted(most, "surface", "surfaces")),
            None => "over as many surfaces as it takes, by Russian roulette".into(),
        };
        parts.push(Part::built("paths", over));
        parts.extend(clear_bodies(scene));
        parts.push(Part::no_cache(scene, "path"));
        parts
    }
}
