//! The file as typed, and the checked world made from it: camera, materials, meshes, units.
//! Not for: rays, light transport. Read first: `file.rs` (what can be typed), `world.rs` (what the renderer sees),
//! `load.rs` (the way from one to the other).

mod camera;
mod world;

pub use camera::Camera;
pub use world::{Material, Object, Scene, Surface, Translucent};
