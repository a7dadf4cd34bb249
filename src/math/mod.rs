//! Numbers that know nothing of light: colours as triples, boxes, frames, hashes, quadrature, vectorised loops.
//! Not for: anything with a unit. Read first: `rgb.rs`.

mod aabb;
mod exp;
mod frame;
mod hash;
mod lanes;
mod quadrature;
mod rgb;
mod simd;

pub use aabb::{Aabb, Aabb32};
pub use exp::{exp2, exp2_m1, times_exp2};
pub use frame::frame;
pub use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec2, Vec3, Vec4};
pub use hash::{hash, hash_combine, unit_f32, unit_f64};
pub use lanes::{F8, LaneKernel, Lanes, Simd, splat3};
pub use quadrature::GaussLegendre;
pub use rgb::Rgb;
pub use simd::{Kernel, Level, dispatch, dispatch_at};
