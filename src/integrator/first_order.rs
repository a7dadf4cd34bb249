//! The part of a `subsurface` picture that is light scattered once, alone.

use super::single::Single;
use super::{CameraRay, Integrator, Part, View, camera_hits};
use crate::error::Result;
use crate::math::Rgb;
use crate::scene::Scene;
use crate::tally::Tally;

/// What `single` adds to the picture of [`super::Subsurface`]: the same samples by the same numbers, and nothing else.
pub struct FirstOrder(Option<Single>);

impl FirstOrder {
    /// Black where every model has the first order already.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(scene: &Scene, seed: u64) -> Result<Self> {
        Ok(Self(Single::new(scene, seed)?))
    }
}

impl Integrator for FirstOrder {
    type Pass = ();

    fn begin_pass(&self, _: View<'_>, _: u32, _: &mut Tally) {}

    fn radiance(&self, view: View<'_>, (): &(), rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let Some(single) = &self.0 else { return };
        let hits = camera_hits(view, rays, tally);
        for ((ray, hit), out) in rays.iter().zip(&hits).zip(out) {
            *out = hit.as_ref().map_or(Rgb::BLACK, |hit| single.radiance(view, ray, hit, tally));
        }
    }

    fn parts(&self, _: &Scene) -> Vec<Part> {
        vec![match self.0 {
            Some(_) => Part::built("single scattering", "a picture of its own"),
            None => Part::left_out("single scattering", "the models have it"),
        }]
    }
}
