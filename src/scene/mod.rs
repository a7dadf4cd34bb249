//! The file as typed, and the checked world made from it: camera, materials, meshes, units.
//! Not for: rays, light transport. Read first: `file.rs`, `objects.rs`, `materials.rs`, `options.rs` (what can be typed;
//! `tree.rs` remembers the lines, `difference.rs` names them; `portion.rs` has parts of mesh files), `world.rs` (what the renderer sees),
//! `load.rs` (the way from one to the other).

mod body;
mod camera;
mod camera_entry;
mod difference;
mod doctor;
mod energy;
mod environment;
mod eye;
mod file;
mod insides;
mod lens;
mod lights;
mod load;
mod masks;
mod materials;
mod mesh_files;
mod objects;
mod obstacle;
mod obstacles;
mod opaque;
mod options;
mod portion;
mod precision;
mod seams;
mod sheets;
mod textures;
mod tree;
mod untraceable;
mod values;
mod view;
mod walkable;
mod warnings;
mod world;

pub use body::Body;
pub use camera_entry::{CameraEntry, FovAxis, LensEntry, Projection};
pub use environment::EnvironmentEntry;
pub use file::SceneFile;
pub use lights::{LightKind, LightSource};
pub use materials::MaterialEntry;
pub use objects::{Geometry, NormalsChoice, ObjectEntry};
pub use obstacle::{Obstacle, ObstacleKind};
pub use options::{
    EntrySampling, Estimator, FilterName, MethodName, MethodOptions, Orders, RenderOptions, Shape, Spread,
};
pub use portion::Portion;
pub use textures::TextureEntry;
pub use walkable::ExitanceBy;
pub use world::{Dielectric, Emission, Material, Object, Scene, Surface, Translucent};

// For what is above this room.
#[doc(hidden)]
pub use self::{
    camera::Camera,
    difference::difference,
    doctor::Remark,
    environment::Environment,
    insides::{Contacts, Insides, Nests},
    lens::Lens,
    options::default_photons,
    view::View,
};
