//! What a boundary and a medium do to light, before any model of scattering. Not for: BSSRDFs.
//! Read first: `fresnel.rs`, `medium.rs`; `catalogue.rs` lists measured media with their sources.

mod catalogue;
mod fresnel;
mod medium;
mod moments;

pub use catalogue::{CATALOGUE, Measured, find};
pub use fresnel::{reflect, reflectance, refract, transmittance};
pub use medium::Medium;
pub use moments::FresnelMoments;
