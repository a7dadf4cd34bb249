//! Light entering at one surface point and leaving at another: one file per model.
//! Not for: Fresnel factors of entry and exit (the cache applies each once), light sources, geometry queries.
//! Read first: [`Bssrdf`], the contract of every model; then `standard.rs`. A new model is a file like `standard.rs` and its
//! line below.

mod beam_gather;
mod channel;
mod depth;
mod directional_gather;
mod expected;
mod exponential;
mod gather;
mod model;
mod multipole;
mod partition;
mod radial;
mod single;

model::registry! {
    standard,
    better,
    directional,
    beam,
    normalised,
    slab,
    auto,
}

use crate::math::{Level, Rgb, Vec3};
pub use auto::{Choice, choose, choose_behind};
pub use beam::{BeamChannel, PhotonBeamDiffusion};
pub use better::BetterDipole;
pub use channel::ChannelMedium;
pub use depth::DepthLaw;
pub use directional::{DirectionalChannel, DirectionalDipole};
pub use expected::{Conditions, ExpectedError, Unmeasured, expected_error, measured_albedos};
#[doc(hidden)]
pub use gather::{EntryColumns, LEAST_COLUMNS, Layout, MOST_COLUMNS, Row};
#[doc(hidden)]
pub use model::all_models;
pub use model::{KappaExtinction, ModelKind, ModelName, ModelOption, ModelOptions};
pub use normalised::{NormalisedDiffusion, WidthFit};
#[doc(hidden)]
pub use partition::Partition;
pub use radial::Radial;
pub use single::{DistanceSample, LightPath, SingleChannel, SingleScattering};
pub use slab::Slab;
pub use standard::StandardDipole;

/// Those that the program itself or its tests speak of.
impl ModelName {
    /// [`StandardDipole`].
    pub const STANDARD: Self = Self(&standard::MODEL);
    /// [`BetterDipole`].
    pub const BETTER: Self = Self(&better::MODEL);
    /// [`DirectionalDipole`].
    pub const DIRECTIONAL: Self = Self(&directional::MODEL);
    /// [`PhotonBeamDiffusion`].
    pub const BEAM: Self = Self(&beam::MODEL);
    /// [`NormalisedDiffusion`].
    pub const NORMALISED: Self = Self(&normalised::MODEL);
    /// [`Slab`]; needs a thickness.
    pub const SLAB: Self = Self(&slab::MODEL);
    /// Whichever [`choose`] finds best for the medium.
    pub const AUTO: Self = Self(&auto::MODEL);
}

/// Where and how light goes in.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Point of entry \[unit\].
    pub x: Vec3,
    /// Outward unit normal there.
    pub n: Vec3,
    /// Refracted unit direction of propagation, pointing into the medium (w·n < 0).
    pub w: Vec3,
}

/// Where and how light comes out.
#[derive(Clone, Copy, Debug)]
pub struct Exit {
    /// Point of exit \[unit\].
    pub x: Vec3,
    /// Outward unit normal there.
    pub n: Vec3,
    /// Unit direction towards the viewer, outside.
    pub w: Vec3,
}

/// Light entering at one surface point and leaving at another, scattered by the medium between.
pub trait Bssrdf: Send + Sync {
    /// What it is called; never `auto`.
    fn name(&self) -> ModelName;

    /// S_d [1/(unit² sr)]: radiance out per flux in, with the model's own normaliser. Leaves out both Fresnel
    /// transmittances and the cosine at the entry: the cache applies each once.
    fn eval(&self, entry: &Entry, exit: &Exit) -> Rgb {
        self.eval_compensated(entry, exit, 0.0)
    }

    /// S_d · exp(`rate` · |x_o - x_i|), the weight of a sample that was kept with probability exp(-rate |x_o - x_i|).
    /// Formed inside the exponent, so that it neither overflows nor loses digits; `rate` [1/unit] is at most
    /// [`Self::decay`].
    fn eval_compensated(&self, entry: &Entry, exit: &Exit, rate: f32) -> Rgb;

    /// S_d as the formula gives it [1/(unit² sr)], below zero in places where [`Self::clamps`]: what tables are compared with.
    fn eval_signed(&self, entry: &Entry, exit: &Exit) -> Rgb {
        self.eval(entry, exit)
    }

    /// Depth along the refracted ray \[unit\] that a cached sample stands for, from `u` in [0, 1); 0 for models without
    /// sources inside.
    #[doc(hidden)]
    fn sample_depth(&self, _u: f32) -> f32 {
        0.0
    }

    /// What a cached sample of `depth` gives: its mean over depths from [`Self::sample_depth`] is
    /// [`Self::eval_compensated`]. Models whose S_d is an integral over depth evaluate one depth only.
    #[doc(hidden)]
    fn eval_cached(&self, entry: &Entry, _depth: f32, exit: &Exit, rate: f32) -> Rgb {
        self.eval_compensated(entry, exit, rate)
    }

    /// Slowest decay of the three channels [1/unit]: rejection control keeps a sample at distance r with
    /// probability exp(-decay r).
    fn decay(&self) -> f32;

    /// Diffuse reflectance of a half space per entered flux, uniform illumination, in [0, 1] where the model
    /// conserves energy.
    fn total(&self) -> Rgb;

    /// What leaves through all faces of what it is a model of, per entered flux: of a sheet the other face too.
    fn total_of_all_faces(&self) -> Rgb {
        self.total()
    }

    /// Whether the formula is below zero in places, where [`Self::eval`] has 0.
    fn clamps(&self) -> bool {
        false
    }

    /// What the model promises; tests hold it to that.
    fn claims(&self) -> Claims {
        Claims::default()
    }

    /// The model as a function of the distance on a plane, where it is one.
    fn radial(&self) -> Option<&dyn Radial> {
        None
    }

    /// What decides how far an entry is from an exit [unit²], see [`Partition`]: the distance between them, or for models
    /// with interior sources the way along the refracted ray and from its end to the exit.
    #[doc(hidden)]
    fn apart2(&self, entry: &Entry, _depth: f32, exit: &Exit) -> f32 {
        entry.x.distance_squared(exit.x)
    }

    /// Relative variation of S_d over cached samples at about one distance, which comes from directions or depths. Only the noise
    /// of an estimate depends on it.
    #[doc(hidden)]
    fn variation(&self) -> f32 {
        0.0
    }

    /// What the columns of its cached samples hold.
    #[doc(hidden)]
    fn layout(&self) -> Layout {
        Layout::DIRECTIONS
    }

    /// A cached sample as a row of columns: point, weights, normal, refracted direction, of which as many count as the
    /// layout has.
    #[doc(hidden)]
    fn row(&self, entry: &Entry, _depth: f32, flux: Rgb) -> Row {
        let (Entry { x, n, w }, [r, g, b]) = (entry, flux.0);
        [x.x, x.y, x.z, r, g, b, n.x, n.y, n.z, w.x, w.y, w.z]
    }

    /// Σ S_d weight per channel over all `entries`, columns of this model's [`Self::row`], to each of `exits`, into `sums`. The bits
    /// do not depend on `level`. Values of S_d below zero count as 0; returns how many there were.
    #[doc(hidden)]
    fn gather_at(&self, _level: Level, exits: &[Exit], entries: &EntryColumns<'_>, sums: &mut [[f64; 3]]) -> u64 {
        gather::one_by_one(|entry, exit| self.eval_signed(entry, exit), exits, entries, sums)
    }

    /// [`Self::gather_at`] with the widest instruction set of this machine.
    #[doc(hidden)]
    fn gather(&self, exits: &[Exit], entries: &EntryColumns<'_>, sums: &mut [[f64; 3]]) -> u64 {
        self.gather_at(Level::best(), exits, entries, sums)
    }
}

/// What a model promises. Which orders of scattering S_d has: two and more always.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Claims {
    /// All light that enters counts as scattered, as it is in the half space that the model is of: the total has what a thin body lets
    /// through unscattered too. Where that comes through straight, beside the model, both together are held to what has entered.
    pub unscattered: bool,
    /// Light scattered once is in S_d; adding single scattering would count it twice.
    pub first_order: bool,
    /// Exchanging entry and exit changes nothing.
    pub reciprocal: bool,
    /// No more leaves than has entered: totals lie in [0, 1].
    pub bounded_energy: bool,
}
