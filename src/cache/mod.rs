//! Transmitted-light points of one pass on one translucent mesh, and the estimators that gather over them.
//! Not for: what happens at the exit (`integrator/subsurface.rs`). Read first: `fill.rs`, `notes.rs`, then `cut.rs`.

mod clock;
mod columns;
mod cut;
mod density;
mod envelope;
mod estimate;
mod fill;
mod near;
mod notes;
mod thinned;
mod tree;

use crate::bssrdf::Entry;
use crate::math::Rgb;
pub use clock::Clock;
pub use columns::Columns;
pub use cut::{Cut, Scratch};
pub use density::{Density, Seen, Survey, seen};
pub use envelope::{Envelope, Fall};
pub use estimate::{Gatherer, PLAIN_SUM, Tuning};
pub use fill::{Filler, Shadow};
pub use near::NearField;
pub use notes::notes;
pub use thinned::{Thinning, thinned};
pub use tree::{Node, Tree};

/// The cached samples of one object and one pass. Samples that met no light are not stored, but count.
pub struct Cache {
    /// Samples that carry light.
    pub lit: Vec<CachedSample>,
    /// Samples attempted: the M of every mean.
    pub attempted: u32,
}

/// Light that has entered the medium at one point. 52 bytes.
#[derive(Clone, Copy, Debug)]
pub struct CachedSample {
    /// Where and in which refracted direction.
    pub entry: Entry,
    /// Depth along the refracted ray that the sample stands for [unit], for models with interior sources; see
    /// [`crate::bssrdf::Bssrdf::sample_depth`].
    pub depth: f32,
    /// L_t = T12 L_i cosθ_i / pdf · A: the flux through the whole surface that this sample stands for
    /// [radiance unit x sr x unit²]. The lecture's T12 L_i π A for a cosine-sampled direction.
    pub flux: Rgb,
}

impl CachedSample {
    /// True where no number is NaN or infinite: one that is would spoil the gathering at every exit of the pass.
    pub fn is_finite(&self) -> bool {
        let Entry { x, n, w } = self.entry;
        x.is_finite() && n.is_finite() && w.is_finite() && self.depth.is_finite() && self.flux.is_finite()
    }
}

/// What gathering cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct GatherTally {
    /// Samples attempted by all fills.
    pub samples: u64,
    /// Of these, samples that carry light.
    pub lit: u64,
    /// Exit points gathered at.
    pub exits: u64,
    /// Nodes of trees visited.
    pub nodes: u64,
    /// Pairs of exit point and cached sample looked at.
    pub pairs: u64,
    /// Points of the near field found along the lines of some exits.
    pub near_points: u64,
    /// Pairs of an exit and a point of the near field, where S_d was evaluated.
    pub near: u64,
    /// Pairs where S_d was evaluated: those kept by rejection control, all of a plain sum, or those in a cut.
    pub evaluated: u64,
    /// Samples left out because a number of theirs is NaN or infinite.
    pub non_finite: u64,
    /// Values of S_d below zero that were taken as 0, one for each pair and channel.
    pub clamped: u64,
}

impl std::ops::AddAssign for GatherTally {
    fn add_assign(&mut self, other: Self) {
        self.samples += other.samples;
        self.lit += other.lit;
        self.exits += other.exits;
        self.nodes += other.nodes;
        self.pairs += other.pairs;
        self.evaluated += other.evaluated;
        self.near_points += other.near_points;
        self.near += other.near;
        self.non_finite += other.non_finite;
        self.clamped += other.clamped;
    }
}
