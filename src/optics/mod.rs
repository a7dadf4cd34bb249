//! What a boundary and a medium do to light, before any model of scattering. Not for: BSSRDFs.
//! Read first: `fresnel.rs`, `medium.rs`; `catalogue.rs` lists measured media with their sources.

mod catalogue;
mod fresnel;
mod half_space;
mod medium;
mod moments;
mod validity;

pub use catalogue::{CATALOGUE, Coefficients, ListedReflectance, Measured, TANK_ML, find, find_or_explain};
pub use fresnel::{reflect, reflectance, refract, transmittance};
pub use medium::Medium;
pub use half_space::Boundary;
pub use moments::FresnelMoments;
pub use validity::{ChannelOptics, Trust};
