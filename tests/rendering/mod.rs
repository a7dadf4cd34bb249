//! Scenes from text, renders of them by the library without the program, and means of renders with their standard errors.
#![allow(dead_code)] // each test file uses its part
#![allow(clippy::unwrap_used)] // a scene of a test that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

use marmor::film::{Film, Image, Window};
use marmor::integrator::{Integrator, Subsurface, SubsurfaceOptions, View};
use marmor::query::{self, Backend};
use marmor::render::{self, Job, Observer, Outcome};
use marmor::scene::{Estimator, Scene, SceneFile};
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The scene in `text`, which names no file.
pub fn load(text: &str) -> Scene {
    load_in(Path::new(""), text)
}

/// The scene in `text`, whose files are in `folder`.
pub fn load_in(folder: &Path, text: &str) -> Scene {
    Scene::load(&SceneFile::parse(text, &folder.join("scene.toml")).unwrap()).unwrap()
}

/// The scene in `text` with an OBJ file that it names.
pub fn load_beside(name: &str, obj: &str, text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), obj).unwrap();
    load_in(folder.path(), text)
}

/// The whole picture after some passes, and what they took.
pub fn run(
    method: &impl Integrator,
    view: View<'_>,
    seed: u64,
    passes: Range<u32>,
    observers: &mut [&mut dyn Observer],
) -> (Film, Outcome) {
    let resolution = view.scene.camera.resolution;
    let mut film = Film::new(resolution, Window::full(resolution)).unwrap().starting_at(passes.start);
    let job = Job { seed, passes: Some(passes.end), time: None, cancel: &AtomicBool::new(false) };
    let outcome = render::run(method, view, &job, &mut film, observers).unwrap();
    (film, outcome)
}

/// The same, unobserved, by rays of a backend.
pub fn on(backend: Backend, scene: &Scene, method: &impl Integrator, seed: u64, passes: Range<u32>) -> (Film, Outcome) {
    let rays = query::build(backend, &scene.meshes()).unwrap();
    run(method, View { scene, rays: &*rays }, seed, passes, &mut [])
}

/// The whole picture after `passes`, by rays of the preferred backend.
pub fn film(
    method: &impl Integrator,
    scene: &Scene,
    passes: u32,
    seed: u64,
    observers: &mut [&mut dyn Observer],
) -> Film {
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    run(method, View { scene, rays: &*rays }, seed, 0..passes, observers).0
}

/// Mean over a picture, channel by channel.
pub fn channels(image: &Image) -> [f64; 3] {
    let n = image.pixels.len() as f64;
    std::array::from_fn(|c| image.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
}

/// Mean over a picture and its channels.
pub fn average(image: &Image) -> f64 {
    image.pixels.iter().map(|p| f64::from(p.mean())).sum::<f64>() / image.pixels.len() as f64
}

/// Mean of independent numbers, and its standard error.
pub fn mean_of(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.into_iter().collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt())
}

/// The same, channel by channel.
pub fn means_of(runs: &[[f64; 3]]) -> [(f64, f64); 3] {
    std::array::from_fn(|c| mean_of(runs.iter().map(|run| run[c])))
}

/// How near two means have to be.
#[derive(Clone, Copy)]
pub struct Within {
    /// Standard errors of their difference. What few runs say of it is itself uncertain, to 1/√(2 (runs - 1)) of it.
    pub errors: f64,
    /// The largest share of the value that this error may be, lest the test say nothing.
    pub noise: f64,
}

/// Means with their standard errors; the second may be known, with an error of 0.
pub fn agree(a: (f64, f64), b: (f64, f64), within: Within, what: &str) {
    let error = a.1.hypot(b.1);
    println!("{what}: {:.5} +- {:.5} against {:.5} +- {:.5}, z {:.2}", a.0, a.1, b.0, b.1, (a.0 - b.0) / error);
    assert!(error < within.noise * b.0.abs(), "{what}: too noisy to say anything: {a:?} {b:?}");
    assert!((a.0 - b.0).abs() < within.errors * error, "{what}: {a:?} against {b:?}");
}

/// The backends that tests of this build are about: beside Embree not `bvh`, with which all tests run where it is alone.
pub fn backends() -> impl Iterator<Item = Backend> {
    let built = |backend: &Backend| backend.is_built_in();
    let beside = Backend::ALL.iter().filter(|b| built(b)).count() > 1;
    Backend::ALL.into_iter().filter(built).filter(move |b| !beside || *b != Backend::Bvh)
}

/// The default method with `cache_samples` a pass, without light scattered once.
pub fn options(estimator: Estimator, cache_samples: u32, seed: u64) -> SubsurfaceOptions {
    SubsurfaceOptions { single: false, cache_samples, estimator, seed, ..Default::default() }
}

/// The same for `scene`.
pub fn subsurface(scene: &Scene, options: SubsurfaceOptions) -> Subsurface {
    Subsurface::new(scene, options).unwrap()
}
