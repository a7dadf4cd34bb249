//! Scenes from text and renders of them by the library, without files.
#![allow(dead_code)] // each test file uses its part
#![allow(clippy::unwrap_used)] // a scene of a test that does not load has failed

use marmor::film::{Film, Window};
use marmor::integrator::{Integrator, Subsurface, SubsurfaceOptions, View};
use marmor::query::{self, Backend};
use marmor::render::{self, Job, Observer};
use marmor::scene::{Estimator, Scene, SceneFile};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The scene in `text`, which names no file.
pub fn load(text: &str) -> Scene {
    Scene::load(&SceneFile::parse(text, Path::new("test.toml")).unwrap()).unwrap()
}

/// The whole picture after `passes`.
pub fn film(
    method: &impl Integrator,
    scene: &Scene,
    passes: u32,
    seed: u64,
    observers: &mut [&mut dyn Observer],
) -> Film {
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let resolution = scene.camera.resolution;
    let mut film = Film::new(resolution, Window::full(resolution)).unwrap();
    let cancel = AtomicBool::new(false);
    let job = Job { seed, passes: Some(passes), time: None, cancel: &cancel };
    render::run(method, View { scene, rays: &*rays }, &job, &mut film, observers).unwrap();
    film
}

/// Every backend of this build.
pub fn backends() -> impl Iterator<Item = Backend> {
    Backend::ALL.into_iter().filter(|b| b.is_built_in())
}

/// The default method with `cache_samples` a pass, without light scattered once.
pub fn options(estimator: Estimator, cache_samples: u32, seed: u64) -> SubsurfaceOptions {
    SubsurfaceOptions { single: false, cache_samples, estimator, seed, ..Default::default() }
}

/// The same for `scene`.
pub fn subsurface(scene: &Scene, options: SubsurfaceOptions) -> Subsurface {
    Subsurface::new(scene, options).unwrap()
}
