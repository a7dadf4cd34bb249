//! From camera rays to radiance: one file per method.
//! Not for: passes, tiles, files. Read first: [`Integrator`]; then `ambient_occlusion.rs`, the shortest.

mod ambient_occlusion;
mod direct;
mod first_order;
mod local;
mod losses;
mod met;
mod shade;
mod single;
mod subsurface;
mod trust;
mod volume_path;

use crate::cache::{Clock, GatherTally};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use crate::query::{Hit, Ray, RayQuery, RayTally};
use crate::sampling::PixelStream;
use crate::scene::{Obstacle, Scene};
pub use ambient_occlusion::AmbientOcclusion;
pub use direct::Direct;
pub use first_order::FirstOrder;
pub use local::{Candidate, Local, LocalShape};
pub use losses::{Cause, Loss, Losses, TOLERATED};
pub use met::KnownLights;
pub use subsurface::{Subsurface, SubsurfaceOptions};
pub use trust::{ModelOnBody, TOLERANCE, Trustworthiness, Verdict};
pub use volume_path::{Left, MOST_SURFACES, VolumePath, VolumePathOptions};

/// The scene and the backend that was built for it.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The checked world.
    pub scene: &'a Scene,
    /// Rays against its meshes.
    pub rays: &'a dyn RayQuery,
}

impl View<'_> {
    /// The nearest hit of each camera ray.
    fn camera_hits(&self, rays: &[CameraRay], tally: &mut Tally) -> Vec<Option<Hit>> {
        let rays: Vec<Ray> = rays.iter().map(|r| r.ray).collect();
        let mut hits = vec![None; rays.len()];
        Clock::time(&mut tally.clock.rays, || self.rays.closest_batch(&rays, &mut hits));
        tally.rays.camera += rays.len() as u64;
        hits
    }

    /// The point of `hit`, its normals towards where a ray into `direction` came from.
    #[inline]
    fn point(&self, hit: &Hit, direction: Vec3) -> SurfacePoint {
        self.scene.objects[hit.mesh as usize].mesh.point(hit.triangle, hit.u, hit.v).facing(-direction)
    }
}

/// One sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// The sample's numbers, those of the film position used up.
    pub stream: PixelStream,
}

/// What the work cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Tally {
    /// Rays by kind.
    pub rays: RayTally,
    /// Cached samples and pairs.
    pub gather: GatherTally,
    /// Paths inside media.
    pub walk: WalkTally,
    /// Where the time went.
    pub clock: Clock,
}

/// What paths inside media cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct WalkTally {
    /// Stays of a path in a body, those included that ended before they began.
    pub walks: u64,
    /// Collisions.
    pub collisions: u64,
    /// Flights that needed no ray.
    pub clear: u64,
    /// Rays inside bodies.
    pub rays: u64,
    /// Photons traced from lamps.
    pub photons: u64,
    /// Their collisions that were kept.
    pub vertices: u64,
    /// Kept collisions looked at from camera paths.
    pub connections: u64,
    /// Paths that came where no light can be or to no end, by object and cause: they carry nothing.
    pub losses: Losses,
}

impl WalkTally {
    /// What there is to say of lost paths, a sentence for each object and cause.
    pub fn lost(&self, scene: &Scene) -> Vec<String> {
        self.losses.sentences(scene, self.walks)
    }

    /// Whether more paths were lost than [`TOLERATED`].
    pub fn lost_many(&self) -> bool {
        self.losses.are_many(self.walks)
    }
}

/// What `volume_path` refuses to trace in a scene, each with the objects' names and a sentence ([`Obstacle::refusal`]); empty where it can
/// be recommended. Meshes with small holes are traced with a warning.
pub fn traceable(scene: &Scene) -> Vec<Obstacle> {
    scene.obstacles().iter().filter(|o| o.refusal().is_some()).cloned().collect()
}

impl std::ops::AddAssign for WalkTally {
    fn add_assign(&mut self, other: Self) {
        self.walks += other.walks;
        self.collisions += other.collisions;
        self.clear += other.clear;
        self.rays += other.rays;
        self.photons += other.photons;
        self.vertices += other.vertices;
        self.connections += other.connections;
        self.losses += other.losses;
    }
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.gather += other.gather;
        self.walk += other.walk;
        self.clock += other.clock;
    }
}

/// A part of a method that a scene may or may not need.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Part {
    /// What it is.
    pub name: String,
    /// Whether it is there.
    pub built: bool,
    /// Why, or how large.
    pub why: String,
}

impl Part {
    /// A part that is there.
    pub fn built(name: impl Into<String>, why: impl Into<String>) -> Self {
        Self { name: name.into(), built: true, why: why.into() }
    }

    /// Rays in f64, which take the place of the backend where f32 cannot hold a scene.
    pub fn double_precision(scene: &Scene) -> Self {
        let name = "rays in double precision";
        match &scene.why_double {
            Some(why) => Self::built(name, format!("in place of the backend: {why}")),
            None => Self::left_out(name, "single precision holds the scene"),
        }
    }

    /// A part that is left out.
    pub fn left_out(name: impl Into<String>, why: impl Into<String>) -> Self {
        Self { name: name.into(), built: false, why: why.into() }
    }
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

    /// Memory of what a pass shares, at its most while it is made [bytes]; may trace some rays to know.
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
