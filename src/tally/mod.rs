//! What work cost: counts and seconds, added up over tasks and passes. Not for: what is said of them.

/// Sums of a struct are the sums of its fields, all of which are named.
macro_rules! adds_up {
    ($name:ident { $($field:ident),+ $(,)? }) => {
        impl std::ops::AddAssign for $name {
            fn add_assign(&mut self, other: Self) {
                let Self { $($field),+ } = other;
                $(self.$field += $field;)+
            }
        }
    };
}

mod clock;
mod gather;
mod losses;
mod rays;

pub use clock::Clock;
pub use gather::GatherTally;
pub use losses::{Cause, Loss, Losses, TOLERATED};
pub use rays::{LIGHTS, LightTally, RayTally};

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
    /// Balls that were passed at once, with all collisions in them.
    pub jumps: u64,
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
    /// Paths that came where no light can be, by object and cause: they carry nothing.
    pub losses: Losses,
}

impl WalkTally {
    /// Whether more paths were lost than [`TOLERATED`].
    pub fn lost_many(&self) -> bool {
        self.losses.are_many(self.walks)
    }
}

adds_up!(WalkTally { walks, collisions, jumps, clear, rays, photons, vertices, connections, losses });

adds_up!(Tally { rays, gather, walk, clock });
