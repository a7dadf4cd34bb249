//! From camera rays to radiance: one file per method.
//! Not for: passes, tiles, files. Read first: [`Integrator`]; then `ambient_occlusion.rs`, the shortest.

mod ambient_occlusion;
mod direct;
mod first_order;
mod followed;
mod glossy;
mod indirect;
mod local;
mod lost;
mod met;
mod parts;
mod path;
mod shade;
mod single;
mod subsurface;
mod trust;
mod volume_path;
mod walked;

pub use crate::cache::SubsurfaceOptions;
use crate::math::Rgb;
use crate::query::{Hit, Ray};
use crate::sampling::PixelStream;
pub use crate::scene::View;
use crate::scene::{Obstacle, Scene};
use crate::tally::{Clock, Tally};
pub use ambient_occlusion::AmbientOcclusion;
pub use direct::Direct;
pub use first_order::FirstOrder;
pub use local::{Candidate, Local, LocalShape};
pub use lost::lost;
pub use met::KnownLights;
pub use parts::Part;
pub use path::Path;
pub use subsurface::Subsurface;
pub use trust::{ModelOnBody, TOLERANCE, Trustworthiness, Verdict};
pub use volume_path::{Left, MOST_SURFACES, VolumePath, VolumePathOptions};

/// One sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// The sample's numbers, those of the film position and of the lens, if there is one, used up.
    pub stream: PixelStream,
}

/// What `volume_path` refuses to trace in a scene, each with the objects' names and a sentence ([`Obstacle::refusal`]); empty where it can
/// be recommended. Meshes with small holes are traced with a warning.
pub fn traceable(scene: &Scene) -> Vec<Obstacle> {
    scene.obstacles().iter().filter(|o| o.refusal().is_some()).cloned().collect()
}

/// The nearest hit of each camera ray.
fn camera_hits(view: View<'_>, rays: &[CameraRay], tally: &mut Tally) -> Vec<Option<Hit>> {
    let rays: Vec<Ray> = rays.iter().map(|r| r.ray).collect();
    let mut hits = vec![None; rays.len()];
    Clock::time(&mut tally.clock.rays, || view.rays.closest_batch(&rays, &mut hits));
    tally.rays.camera += rays.len() as u64;
    hits
}

/// A method: radiance for the camera rays of a tile.
pub trait Integrator: Sync {
    /// What all pixels of a pass share; `()` for most.
    type Pass: Sync;

    /// Prepares pass number `pass`.
    fn begin_pass(&self, view: View<'_>, pass: u32, tally: &mut Tally) -> Self::Pass;

    /// Radiance along each ray of a tile. Pure: the same arguments give the same bytes on any thread.
    fn radiance(&self, view: View<'_>, pass: &Self::Pass, rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally);

    /// True if the rays of one call share work, so that a pixel's bytes depend on which others come with it: the
    /// renderer then always hands over whole tiles.
    fn shares_tiles(&self) -> bool {
        false
    }

    /// Memory of what a pass shares, at its most while it is made \[bytes\]; may trace some rays to know.
    fn pass_bytes(&self, _view: View<'_>) -> u64 {
        0
    }

    /// What was built for this scene, and what was left out.
    fn parts(&self, scene: &Scene) -> Vec<Part>;

    /// The lights that a render must have found before it can tell its own error; none for methods without lights.
    fn lights(&self, _: &Scene) -> KnownLights {
        KnownLights::default()
    }
}
