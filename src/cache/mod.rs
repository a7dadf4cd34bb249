//! Transmitted-light points of one pass on one translucent mesh, and the estimators that gather over them.
//! Not for: what happens at the exit (`integrator/subsurface.rs`). Read first: `fill.rs`, then `notes.rs`.

mod fill;
mod notes;

use crate::bssrdf::Entry;
use crate::error::{Error, Result, did_you_mean};
use crate::math::Rgb;
pub use fill::{EntrySampling, Filler};
pub use notes::notes;

/// The cached samples of one object and one pass. Samples that met no light are not stored, but count.
pub struct Cache {
    /// Samples that carry light.
    pub lit: Vec<CachedSample>,
    /// Samples attempted: the M of every mean.
    pub attempted: u32,
}

/// Light that has entered the medium at one point. 48 bytes.
#[derive(Clone, Copy, Debug)]
pub struct CachedSample {
    /// Where and in which refracted direction.
    pub entry: Entry,
    /// L_t = T12 L_i cosθ_i / pdf · A: the flux through the whole surface that this sample stands for
    /// [radiance unit x sr x unit²]. The lecture's T12 L_i π A for a cosine-sampled direction.
    pub flux: Rgb,
}

/// What gathering cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct GatherTally {
    /// Samples attempted by all fills.
    pub samples: u64,
    /// Of these, samples that carry light.
    pub lit: u64,
    /// Exit points gathered at.
    pub exits: u64,
    /// Pairs of exit point and cached sample looked at.
    pub pairs: u64,
    /// Pairs kept by rejection control, where S_d was evaluated.
    pub evaluated: u64,
}

impl std::ops::AddAssign for GatherTally {
    fn add_assign(&mut self, other: Self) {
        self.samples += other.samples;
        self.lit += other.lit;
        self.exits += other.exits;
        self.pairs += other.pairs;
        self.evaluated += other.evaluated;
    }
}

/// How the sum over the cache is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// The lecture's loop over all samples with rejection control.
    Notes,
}

impl Estimator {
    /// All estimators.
    pub const ALL: [Self; 1] = [Self::Notes];

    /// The name in scene files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Notes => "notes",
        }
    }
}

impl std::str::FromStr for Estimator {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name).ok_or_else(|| {
            let hint = did_you_mean(name, Self::ALL.map(Self::name));
            let known = Self::ALL.map(|e| format!("`{}`", e.name())).join(", ");
            Error::usage(format!("no estimator `{name}`{hint}; there are {known}"))
        })
    }
}
