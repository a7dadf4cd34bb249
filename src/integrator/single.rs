//! Light scattered once, beside models that begin with light scattered twice.

use super::volume_path::VolumePath;
use super::{CameraRay, View};
use crate::error::Result;
use crate::math::Rgb;
use crate::query::Hit;
use crate::scene::Scene;
use crate::tally::Tally;

/// The first order of the objects whose models leave it out: a distance along the refracted ray of the camera, then light
/// through the boundary, as `volume_path` does both. No formula of a plane is in it, and no model: it is exact on any shape,
/// for light that comes straight from lamps and environment. Light of small lamps and suns that the boundary reflects inside
/// before it is scattered is left out: docs/volume-path.md says how much that is.
pub struct Single(VolumePath);

impl Single {
    /// `None` where every model has the first order already.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(scene: &Scene, seed: u64) -> Result<Option<Self>> {
        let wanted = |object: &crate::scene::Object| match &scene.materials[object.material].surface.inside {
            Some(t) => t.build().map(|model| !model.claims().first_order),
            _ => Ok(false),
        };
        let wanted: Vec<bool> = scene.objects.iter().map(wanted).collect::<Result<_>>()?;
        Ok(wanted.contains(&true).then(|| Self(VolumePath::once(scene, |i| wanted[i], seed))))
    }

    /// Its radiance towards the camera, with both Fresnel factors; 0 on other objects.
    pub fn radiance(&self, view: View<'_>, ray: &CameraRay, hit: &Hit, tally: &mut Tally) -> Rgb {
        self.0.scattered_once(view, ray, hit, tally)
    }
}
