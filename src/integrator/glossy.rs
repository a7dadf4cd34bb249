//! Opaque surfaces that are not Lambertian, for methods of direct light alone.

use super::volume_path::{Scratch, VolumePath};
use super::{CameraRay, View};
use crate::math::Rgb;
use crate::query::Hit;
use crate::scene::Scene;
use crate::tally::Tally;

/// Light straight from lights, by points of lights and by directions of the surface: multiple importance sampling [VG95].
pub struct Glossy {
    paths: VolumePath,
    /// For each object whether it is such a surface.
    is_glossy: Vec<bool>,
    /// Samples for each camera ray, at least 1.
    samples: u32,
}

impl Glossy {
    /// `None` where a scene has no such surface; `samples` for each camera ray, at least 1.
    pub fn new(scene: &Scene, samples: u32) -> Option<Self> {
        let is_glossy: Vec<bool> = (0..scene.objects.len() as u32)
            .map(|object| scene.surface(object).is_opaque() && !scene.surface(object).is_lambertian())
            .collect();
        let none = vec![None; is_glossy.len()];
        // The seed is of photons, which these paths do without.
        let paths = || VolumePath::over_surfaces(scene, none, 0, 0);
        is_glossy.contains(&true).then(|| Self { paths: paths(), is_glossy, samples })
    }

    /// What the surface at `hit` sends back along `ray`; `None` if it is Lambertian, or not opaque.
    pub fn radiance(&self, view: View<'_>, ray: &CameraRay, hit: &Hit, tally: &mut Tally) -> Option<Rgb> {
        if !self.is_glossy[hit.mesh as usize] {
            return None;
        }
        let mut sample = |part| {
            let ray = CameraRay { stream: ray.stream.split(part, self.samples), ..*ray };
            self.paths.shade(view, &[], &ray, &mut Scratch::default(), tally, hit)
        };
        let sum = (0..self.samples).fold(Rgb::BLACK, |sum, part| sum + sample(part));
        Some(sum * (1.0 / self.samples as f32))
    }
}
