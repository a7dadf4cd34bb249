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
}

impl Glossy {
    /// `None` where a scene has no such surface.
    pub fn new(scene: &Scene) -> Option<Self> {
        let is_glossy: Vec<bool> = (0..scene.objects.len() as u32)
            .map(|object| scene.surface(object).is_opaque() && !scene.surface(object).is_lambertian())
            .collect();
        let none = vec![None; is_glossy.len()];
        // The seed is of photons, which these paths do without.
        is_glossy.contains(&true).then(|| Self { paths: VolumePath::over_surfaces(scene, none, 0, 0), is_glossy })
    }

    /// What the surface at `hit` sends back along `ray`; `None` if it is Lambertian, or not opaque.
    pub fn radiance(&self, view: View<'_>, ray: &CameraRay, hit: &Hit, tally: &mut Tally) -> Option<Rgb> {
        let glossy = self.is_glossy[hit.mesh as usize];
        glossy.then(|| self.paths.shade(view, &[], ray, &mut Scratch::default(), tally, hit))
    }
}
