//! Transmitted-light points of one pass on one translucent mesh, and the estimators that gather over them.
//! Not for: what happens at the exit (`integrator/subsurface.rs`). Read first: `fill.rs`, `notes.rs`, then `cut.rs`.

mod balance;
mod columns;
mod cut;
mod density;
mod envelope;
mod estimate;
mod even;
mod fill;
mod near;
mod notes;
mod plan;
mod straight;
mod survey;
mod thinned;
mod tree;

use crate::bssrdf::Entry;
use crate::math::Rgb;
pub use balance::Balance;
pub use columns::Columns;
pub use cut::{Cut, Scratch, Tuning};
pub use density::Density;
pub use envelope::{Envelope, Fall};
pub use estimate::{Detail, Gatherer, PLAIN_SUM};
pub use even::balance;
pub use fill::{CacheBuilder, CachedBody, Directions, Shadow};
pub use near::{GatherPoint, NearField, Step};
pub use notes::notes;
pub use plan::{Plan, SubsurfaceOptions};
pub use survey::{Seen, Survey, seen};
pub use thinned::{Thinning, thinned};
pub use tree::{Node, Tree};

/// The cached samples of one object and one pass. Samples that met no light are not stored, but count.
#[derive(Clone)]
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
