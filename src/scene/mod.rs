//! The file as typed, and the checked world made from it: camera, materials, meshes, units.
//! Not for: rays, light transport. Read first: `file.rs`, `objects.rs`, `materials.rs`, `options.rs` (what can be typed;
//! `tree.rs` remembers the lines, `difference.rs` names them), `world.rs` (what the renderer sees),
//! `load.rs` (the way from one to the other).

mod camera;
mod difference;
mod doctor;
mod energy;
mod environment;
mod file;
mod load;
mod materials;
mod objects;
mod obstacle;
mod obstacles;
mod options;
mod precision;
mod tree;
mod untraceable;
mod view;
mod warnings;
mod world;

pub use camera::Camera;
pub use difference::difference;
pub use doctor::Remark;
pub use environment::{Environment, EnvironmentEntry};
pub use file::{CameraEntry, FovAxis, SceneFile};
pub use materials::MaterialEntry;
pub use objects::{Geometry, NormalsChoice, ObjectEntry};
pub use obstacle::{Obstacle, ObstacleKind};
pub use obstacles::Insides;
pub use options::{
    EntrySampling, Estimator, MethodName, MethodOptions, Orders, RenderOptions, Spread, default_photons,
};
pub use view::View;
pub use world::{Material, Object, Scene, Surface, Translucent};
