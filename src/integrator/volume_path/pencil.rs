//! One beam into one body and where it comes out: the walk of the renderer alone, for profiles and totals.

use super::VolumePath;
use super::draws::PathSampler;
use super::interior::{Edge, WalkObserver};
use super::spectrum::Spectrum;
use crate::integrator::View;
use crate::math::{DVec3, Rgb, Vec3};
use crate::tally::WalkTally;

/// Light that has left a body.
#[derive(Clone, Copy, Debug)]
pub struct Left {
    /// Where [unit].
    pub x: DVec3,
    /// Unit direction outside.
    pub w: Vec3,
    /// Its share of the light that entered: the mean over paths is an average of outcomes, at most 3 a path.
    pub weight: Rgb,
    /// Times scattered.
    pub order: u32,
}

/// Counts collisions.
struct Count(u32);

impl WalkObserver for Count {
    fn collision(&mut self, _: DVec3, _: Vec3, _: Option<Edge>, _: &mut Spectrum, _: &mut PathSampler) -> bool {
        self.0 += 1;
        true
    }
}

impl VolumePath {
    /// Follows light that starts at `x`, inside the translucent object number `object`, along the unit vector `w` until
    /// it leaves for the first time; `None` where it is absorbed or lost. `key` decides on all random numbers, but for
    /// `u` in [0, 1), which picks the channel that distances are drawn for: spread it evenly over the paths.
    pub fn pencil(
        &self,
        view: View<'_>,
        object: u32,
        (x, w): (DVec3, Vec3),
        u: f32,
        key: u64,
        tally: &mut WalkTally,
    ) -> Option<Left> {
        let body = self.bodies.get(object as usize)?.as_ref()?;
        let mut draws = PathSampler::new(&[], key);
        let (mut spectrum, mut count) = (Spectrum::new(Rgb::WHITE, u), Count(0));
        let exit = body.walk(view, (x, w), &mut spectrum, &mut draws, &mut count, tally)?;
        Some(Left { x: exit.at.x, w: exit.w, weight: spectrum.value_outside(), order: count.0 })
    }
}
