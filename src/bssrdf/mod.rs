//! Light entering at one surface point and leaving at another: one file per model.
//! Not for: Fresnel factors of entry and exit (the cache applies each once), light sources, geometry queries.
//! Read first: [`Bssrdf`], the contract of every model; then `standard.rs`.

mod beam;
mod channel;
mod depth;
mod directional;
mod exponential;
mod quadrature;
mod single;
mod standard;
mod true_albedo;

use crate::math::{Rgb, Vec3};
use crate::optics::Medium;
pub use beam::{BeamChannel, KappaExtinction, PhotonBeamDiffusion};
pub use channel::ChannelMedium;
pub use depth::DepthLaw;
pub use directional::{DirectionalChannel, DirectionalDipole};
pub use single::{DistanceSample, LightPath, SingleChannel, SingleScattering};
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

    /// Slowest decay of the three channels [1/unit]: rejection control keeps a sample at distance r with
    /// probability exp(-decay r).
    fn decay(&self) -> f32;

    /// Diffuse reflectance of a half space per entered flux, uniform illumination, in [0, 1] where the model
    /// conserves energy.
    fn total(&self) -> Rgb;
}

/// A model by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelName {
    /// [`StandardDipole`].
    Standard,
    /// [`DirectionalDipole`].
    Directional,
    /// [`PhotonBeamDiffusion`].
    Beam,
}

impl ModelName {
    /// All models.
    pub const ALL: [Self; 3] = [Self::Standard, Self::Directional, Self::Beam];

    /// The name in scene files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::Directional => "directional",
            Self::Beam => "beam",
        }
    }
}

impl std::str::FromStr for ModelName {
    type Err = crate::Error;

    fn from_str(name: &str) -> crate::Result<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| {
            let hint = crate::error::did_you_mean(name, Self::ALL.map(Self::name));
            crate::Error::usage(format!("no BSSRDF model `{name}`{hint}"))
        })
    }
}

/// A model of a medium, chosen at run time and matched once, outside the loop over pairs of points.
pub enum Model {
    /// See [`StandardDipole`].
    Standard(StandardDipole),
    /// See [`DirectionalDipole`].
    Directional(DirectionalDipole),
    /// See [`PhotonBeamDiffusion`].
    Beam(PhotonBeamDiffusion),
}

/// Generic work over whichever model is there.
pub trait ModelVisitor {
    /// What the work yields.
    type Out;
    /// The work, compiled once for each model.
    fn visit<B: Bssrdf>(self, model: &B) -> Self::Out;
}

impl Model {
    /// The model called `name` of `medium`. `exit_normalisation` divides S_d by 4 C_phi(1/eta), so that the exit
    /// Fresnel factor loses no energy; off, dipoles give R_d / π as [JMLH01] prints it.
    pub fn new(name: ModelName, medium: &Medium, exit_normalisation: bool) -> Self {
        match name {
            ModelName::Standard => Self::Standard(StandardDipole::new(medium, exit_normalisation)),
            ModelName::Directional => Self::Directional(DirectionalDipole::new(medium, false)),
            ModelName::Beam => {
                Self::Beam(PhotonBeamDiffusion::new(medium, exit_normalisation, KappaExtinction::default()))
            }
        }
    }

    /// Runs `visitor` with the model's own type.
    pub fn visit<V: ModelVisitor>(&self, visitor: V) -> V::Out {
        match self {
            Self::Standard(model) => visitor.visit(model),
            Self::Directional(model) => visitor.visit(model),
            Self::Beam(model) => visitor.visit(model),
        }
    }
}
