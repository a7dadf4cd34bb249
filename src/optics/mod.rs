//! What a boundary and a medium do to light, before any model of scattering. Not for: BSSRDFs.
//! Read first: `fresnel.rs`, `medium.rs`; `catalogue.rs` lists measured media with their sources,
//! `looks.rs` has media by how they look.

mod ball;
mod catalogue;
mod fresnel;
mod half_space;
mod inversion;
mod looks;
mod medium;
mod moments;
mod phase;
mod presets;
mod validity;
mod way_out;

pub use ball::{ANGLES, Ball};
pub use catalogue::{CATALOGUE, Coefficients, ListedReflectance, Measured, TANK_ML, find};
pub use fresnel::{Split, reflect, reflectance, refract, split, transmittance};
pub use half_space::HalfSpace;
pub use inversion::{AlbedoCurve, AlbedoLaw, better_total, medium_from_colour, standard_total};
pub use looks::{LOOKS, Look, NamedLook};
pub use medium::{Medium, Reduced};
pub use moments::FresnelMoments;
pub use phase::HenyeyGreenstein;
pub use presets::{Preset, find_or_explain};
pub use validity::{ChannelOptics, Trust};
pub use way_out::{Moments, WayOut};
