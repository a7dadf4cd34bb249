//! Light entering at one surface point and leaving at another: one file per model.
//! Not for: Fresnel factors of entry and exit (the cache applies each once), light sources, geometry queries.
//! Read first: [`Bssrdf`], the contract of every model; then `standard.rs`.

mod auto;
mod beam;
mod beam_gather;
mod better;
mod channel;
mod depth;
mod directional;
mod directional_gather;
mod expected;
mod exponential;
mod multipole;
mod normalised;
mod partition;
mod radial;
mod single;
mod slab;
mod standard;

use crate::error::{Error, Result};
use crate::math::{Rgb, Vec3};
use crate::optics::Medium;
pub use auto::{Choice, choose};
pub use beam::{BeamChannel, KappaExtinction, PhotonBeamDiffusion};
pub use beam_gather::SourceColumns;
pub use better::BetterDipole;
pub use channel::ChannelMedium;
pub use depth::DepthLaw;
pub use directional::{DirectionalChannel, DirectionalDipole};
pub use directional_gather::DirectionColumns;
pub use expected::{ExpectedError, Place, Unmeasured, expected_error, measured_albedos};
pub use normalised::{NormalisedDiffusion, WidthFit};
pub use partition::Partition;
pub use radial::{EntryColumns, Gather, Radial};
pub use single::{DistanceSample, LightPath, SingleChannel, SingleScattering};
pub use slab::Slab;
pub use standard::StandardDipole;

/// Where and how light goes in.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Point of entry [unit].
    pub x: Vec3,
    /// Outward unit normal there.
    pub n: Vec3,
    /// Refracted unit direction of propagation, pointing into the medium (w·n < 0).
    pub w: Vec3,
}

/// Where and how light comes out.
#[derive(Clone, Copy, Debug)]
pub struct Exit {
    /// Point of exit [unit].
    pub x: Vec3,
    /// Outward unit normal there.
    pub n: Vec3,
    /// Unit direction towards the viewer, outside.
    pub w: Vec3,
}

/// Light entering at one surface point and leaving at another, scattered by the medium between.
pub trait Bssrdf: Sync {
    /// S_d [1/(unit² sr)]: radiance out per flux in, with the model's own normaliser. Leaves out both Fresnel
    /// transmittances and the cosine at the entry: the cache applies each once.
    fn eval(&self, entry: &Entry, exit: &Exit) -> Rgb {
        self.eval_compensated(entry, exit, 0.0)
    }

    /// S_d · exp(`rate` · |x_o - x_i|), the weight of a sample that was kept with probability exp(-rate |x_o - x_i|).
    /// Formed inside the exponent, so that it neither overflows nor loses digits; `rate` [1/unit] is at most
    /// [`Self::decay`].
    fn eval_compensated(&self, entry: &Entry, exit: &Exit, rate: f32) -> Rgb;

    /// Depth along the refracted ray [unit] that a cached sample stands for, from `u` in [0, 1); 0 for models without
    /// sources inside.
    fn sample_depth(&self, _u: f32) -> f32 {
        0.0
    }

    /// What a cached sample of `depth` gives: its mean over depths from [`Self::sample_depth`] is
    /// [`Self::eval_compensated`]. Models whose S_d is an integral over depth evaluate one depth only.
    fn eval_cached(&self, entry: &Entry, _depth: f32, exit: &Exit, rate: f32) -> Rgb {
        self.eval_compensated(entry, exit, rate)
    }

    /// Slowest decay of the three channels [1/unit]: rejection control keeps a sample at distance r with
    /// probability exp(-decay r).
    fn decay(&self) -> f32;

    /// Diffuse reflectance of a half space per entered flux, uniform illumination, in [0, 1] where the model
    /// conserves energy.
    fn total(&self) -> Rgb;

    /// Whether the formula is below zero in places, where [`Self::eval`] has 0.
    fn clamps(&self) -> bool {
        false
    }

    /// What the model promises; tests hold it to that.
    fn claims(&self) -> Claims {
        Claims::default()
    }
}

/// What a model promises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Claims {
    /// Light scattered once is in S_d; adding single scattering would count it twice.
    pub first_order: bool,
    /// Exchanging entry and exit changes nothing.
    pub reciprocal: bool,
    /// No more leaves than has entered: totals lie in [0, 1].
    pub bounded_energy: bool,
}

/// A model by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelName {
    /// [`StandardDipole`].
    Standard,
    /// [`BetterDipole`].
    Better,
    /// [`DirectionalDipole`].
    Directional,
    /// [`PhotonBeamDiffusion`].
    Beam,
    /// [`NormalisedDiffusion`].
    Normalised,
    /// [`Slab`]; needs a thickness.
    Slab,
    /// Whichever [`choose`] finds best for the medium.
    Auto,
}

impl ModelName {
    /// All models, and `auto`.
    pub const ALL: [Self; 7] =
        [Self::Standard, Self::Better, Self::Directional, Self::Beam, Self::Normalised, Self::Slab, Self::Auto];

    /// The name in scene files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::Better => "better",
            Self::Directional => "directional",
            Self::Beam => "beam",
            Self::Normalised => "normalised",
            Self::Slab => "slab",
            Self::Auto => "auto",
        }
    }
}

impl std::str::FromStr for ModelName {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| {
            let hint = crate::error::did_you_mean(name, Self::ALL.map(Self::name));
            Error::usage(format!("no BSSRDF model `{name}`{hint}"))
        })
    }
}

/// A model of a medium, chosen at run time and matched once, outside the loop over pairs of points.
pub enum Model {
    /// See [`StandardDipole`].
    Standard(StandardDipole),
    /// See [`BetterDipole`].
    Better(BetterDipole),
    /// See [`DirectionalDipole`].
    Directional(DirectionalDipole),
    /// See [`PhotonBeamDiffusion`].
    Beam(PhotonBeamDiffusion),
    /// See [`NormalisedDiffusion`].
    Normalised(NormalisedDiffusion),
    /// See [`Slab`].
    Slab(Box<Slab>),
}

/// Generic work over whichever model is there.
pub trait ModelVisitor {
    /// What the work yields.
    type Out;
    /// The work, compiled once for each model.
    fn visit<B: Bssrdf>(self, model: &B) -> Self::Out;
}

impl Model {
    /// The model called `name` of a half space of `medium`. `exit_normalisation` divides S_d by 4 C_phi(1/eta), so
    /// that the exit Fresnel factor loses no energy; off, dipoles give R_d / π as [JMLH01] prints it.
    ///
    /// `slab` without a thickness is its own limit, the standard dipole; see [`Self::with_thickness`]. `auto` is what
    /// [`choose`] finds.
    pub fn new(name: ModelName, medium: &Medium, exit_normalisation: bool) -> Self {
        match name {
            ModelName::Standard | ModelName::Slab => Self::Standard(StandardDipole::new(medium, exit_normalisation)),
            ModelName::Better => Self::Better(BetterDipole::new(medium, exit_normalisation)),
            ModelName::Directional => Self::Directional(DirectionalDipole::new(medium, false)),
            ModelName::Beam => {
                Self::Beam(PhotonBeamDiffusion::new(medium, exit_normalisation, KappaExtinction::default()))
            }
            ModelName::Normalised => Self::Normalised(NormalisedDiffusion::new(medium, exit_normalisation)),
            // `choose` never answers `Auto`.
            ModelName::Auto => Self::new(choose(medium, None).name, medium, exit_normalisation),
        }
    }

    /// As [`Self::new`] for an object of `thickness` [unit], which `slab` and `auto` heed; the others model a half
    /// space.
    ///
    /// # Errors
    /// A slab without a thickness, and all that [`Slab::new`] refuses.
    pub fn with_thickness(
        name: ModelName,
        medium: &Medium,
        thickness: Option<f32>,
        exit_normalisation: bool,
    ) -> Result<Self> {
        let name = if name == ModelName::Auto { choose(medium, thickness).name } else { name };
        match (name, thickness) {
            (ModelName::Slab, Some(thickness)) => {
                Ok(Self::Slab(Box::new(Slab::new(medium, thickness, exit_normalisation)?)))
            }
            (ModelName::Slab, None) => Err(Error::scene("the model `slab` needs a `thickness`")),
            _ => Ok(Self::new(name, medium, exit_normalisation)),
        }
    }

    /// One model of every kind that exists for `medium`, the slab five transport mean free paths thick: for tests
    /// and comparisons.
    ///
    /// # Errors
    /// A medium that no slab can be made of.
    pub fn all_for(medium: &Medium, exit_normalisation: bool) -> Result<Vec<Self>> {
        let thickness =
            5.0 * medium.transport_mean_free_path().0.into_iter().filter(|l| l.is_finite()).fold(0.0, f32::max);
        ModelName::ALL
            .into_iter()
            .filter(|name| *name != ModelName::Auto)
            .map(|name| Self::with_thickness(name, medium, Some(thickness), exit_normalisation))
            .collect()
    }

    /// What it is called.
    pub fn name(&self) -> ModelName {
        match self {
            Self::Standard(_) => ModelName::Standard,
            Self::Better(_) => ModelName::Better,
            Self::Directional(_) => ModelName::Directional,
            Self::Beam(_) => ModelName::Beam,
            Self::Normalised(_) => ModelName::Normalised,
            Self::Slab(_) => ModelName::Slab,
        }
    }

    /// The model as a function of the distance on a plane, where it is one.
    pub fn radial(&self) -> Option<&dyn Radial> {
        match self {
            Self::Standard(model) => Some(model),
            Self::Better(model) => Some(model),
            Self::Normalised(model) => Some(model),
            Self::Slab(model) => Some(&**model),
            Self::Directional(_) | Self::Beam(_) => None,
        }
    }

    /// The vectorised sum over many entries, where the distance alone decides.
    pub fn gather(&self) -> Option<&dyn Gather> {
        match self {
            Self::Standard(model) => Some(model),
            Self::Better(model) => Some(model),
            Self::Normalised(model) => Some(model),
            Self::Slab(_) | Self::Directional(_) | Self::Beam(_) => None,
        }
    }

    /// S_d as the formula gives it [1/(unit² sr)], before the clamp at 0 that [`Bssrdf::eval`] of `directional` and
    /// `slab` ends with: what tables are compared with. The other models are nowhere negative.
    pub fn eval_signed(&self, entry: &Entry, exit: &Exit) -> Rgb {
        match self {
            Self::Standard(model) => model.eval(entry, exit),
            Self::Better(model) => model.eval(entry, exit),
            Self::Directional(model) => model.eval_signed(entry, exit),
            Self::Beam(model) => model.eval(entry, exit),
            Self::Normalised(model) => model.eval(entry, exit),
            Self::Slab(model) => model.eval_signed(entry, exit),
        }
    }

    /// [`Bssrdf::sample_depth`] of whichever model it is.
    pub fn sample_depth(&self, u: f32) -> f32 {
        match self {
            Self::Beam(model) => model.sample_depth(u),
            _ => 0.0,
        }
    }

    /// What decides how far an entry is from an exit [unit²], see [`Partition`]: the distance between them, or for models
    /// with interior sources the way along the refracted ray and from its end to the exit.
    pub fn apart2(&self, entry: &Entry, depth: f32, exit: &Exit) -> f32 {
        match self {
            Self::Beam(_) => ((entry.x + entry.w * depth).distance(exit.x) + depth).powi(2),
            _ => entry.x.distance_squared(exit.x),
        }
    }

    /// Runs `visitor` with the model's own type.
    pub fn visit<V: ModelVisitor>(&self, visitor: V) -> V::Out {
        match self {
            Self::Standard(model) => visitor.visit(model),
            Self::Better(model) => visitor.visit(model),
            Self::Directional(model) => visitor.visit(model),
            Self::Beam(model) => visitor.visit(model),
            Self::Normalised(model) => visitor.visit(model),
            Self::Slab(model) => visitor.visit(&**model),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_a_slip_is_met_with_the_nearest() {
        for name in ModelName::ALL {
            assert_eq!(name.name().parse::<ModelName>().unwrap(), name);
        }
        let slip = "standart".parse::<ModelName>().unwrap_err().to_string();
        assert!(slip.contains("did you mean `standard`"), "{slip}");
    }

    #[test]
    fn a_slab_has_a_thickness_and_auto_becomes_a_model() {
        let medium = Medium::reduced(Rgb::splat(2.0), Rgb::splat(0.01), 1.3).unwrap();
        let make = |name, thickness| Model::with_thickness(name, &medium, thickness, true);
        assert!(make(ModelName::Slab, None).err().unwrap().to_string().contains("thickness"));
        assert!(make(ModelName::Slab, Some(0.4)).is_err());
        assert_eq!(make(ModelName::Slab, Some(3.0)).unwrap().name(), ModelName::Slab);
        assert_eq!(make(ModelName::Auto, Some(3.0)).unwrap().name(), ModelName::Slab);
        assert_eq!(make(ModelName::Auto, None).unwrap().name(), choose(&medium, None).name);
        assert_eq!(Model::new(ModelName::Better, &medium, true).name(), ModelName::Better);
    }

    #[test]
    fn exit_normalisation_divides_s_d_and_leaves_the_exitance() {
        let medium = Medium::reduced(Rgb::splat(2.0), Rgb::splat(0.01), 1.5).unwrap();
        for name in [ModelName::Standard, ModelName::Better, ModelName::Normalised] {
            let [on, off] = [true, false].map(|n| Model::new(name, &medium, n));
            let (on, off) = (on.radial().unwrap(), off.radial().unwrap());
            let (entry, exit) =
                (Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z }, Exit { x: Vec3::X, n: Vec3::Z, w: Vec3::Z });
            let ratio = off.eval(&entry, &exit)[0] / on.eval(&entry, &exit)[0];
            // 4 C_phi(1/1.5)
            assert!((ratio - 0.908_222).abs() < 1e-6, "{name:?}: {ratio}");
            assert!((on.exitance(1.0)[0] / off.exitance(1.0)[0] - 1.0).abs() < 1e-6, "{name:?}");
        }
    }
}
