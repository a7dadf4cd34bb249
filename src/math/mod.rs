//! Numbers that know nothing of light: colours as triples, frames, hashes.
//! Not for: anything with a unit. Read first: `rgb.rs`.

mod frame;
mod hash;
mod quadrature;
mod rgb;

pub use frame::Frame;
pub use glam::{DVec2, DVec3, Vec2, Vec3};
pub use hash::{hash, hash_combine, unit_f32, unit_f64};
pub use quadrature::GaussLegendre;
pub use rgb::Rgb;
