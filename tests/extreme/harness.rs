//! One small scene, changed in one place by each case, and what its pictures must be.

pub use super::rendering::backends;
use super::rendering::{on, options};
use marmor::ErrorKind;
use marmor::bssrdf::ModelName;
use marmor::film::{Counts, Film, Image};
use marmor::integrator::{
    AmbientOcclusion, Direct, Integrator, Subsurface, SubsurfaceOptions, VolumePath, VolumePathOptions,
};
use marmor::query::Backend;
use marmor::scene::{Estimator, Orders, Scene, SceneFile, Shape};
use marmor::tally::Tally;
use std::path::Path;

/// A ball of wax under a lamp, in a faint environment, over a grey floor.
pub const BASE: &str = r#"unit = "mm"
[camera]
position = [0, 1, 6]
look_at = [0, 0, 0]
fov = 30
resolution = [8, 6]
[[object]]
name = "body"
shape = "sphere"
centre = [0, 0, 0]
radius = 1
rings = 8
segments = 16
material = "wax"
[[object]]
name = "floor"
shape = "rectangle"
centre = [0, -1.5, 0]
edge_u = [0, 0, 4]
edge_v = [4, 0, 0]
material = "grey"
[[object]]
name = "lamp"
shape = "rectangle"
centre = [0, 4, 0]
edge_u = [1, 0, 0]
edge_v = [0, 0, 1]
material = "lamp"
[environment]
radiance = 0.1
[material.wax]
type = "translucent"
sigma_s_prime = [2, 3, 4]
sigma_a = [0.05, 0.1, 0.2]
eta = 1.3
[material.grey]
type = "diffuse"
albedo = 0.5
[material.lamp]
type = "emissive"
radiance = 5
"#;

/// [`BASE`] with each second text in the place of the first.
pub fn with(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(BASE.to_string(), |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the scene");
        text.replacen(from, to, 1)
    })
}

/// [`BASE`] with this medium.
pub fn medium(sigma_s_prime: &str, sigma_a: &str, more: &str) -> String {
    with(&[
        ("sigma_s_prime = [2, 3, 4]", &format!("sigma_s_prime = {sigma_s_prime}")),
        ("sigma_a = [0.05, 0.1, 0.2]\neta = 1.3", &format!("sigma_a = {sigma_a}\n{more}")),
    ])
}

/// The ball of [`BASE`] as TOML, for replacing it.
pub const BALL: &str =
    "shape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nrings = 8\nsegments = 16\nmaterial = \"wax\"";

/// Loads a scene whose mesh files are `files`.
pub fn load_with(text: &str, files: &[(&str, &str)], repair: bool) -> marmor::Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    let file = SceneFile::parse(text, &folder.path().join("scene.toml"))?;
    // What is told of a model is told of that model.
    let file = if text.contains("model =") { file } else { file.with(&["method.model=standard"])? };
    Scene::load_with(&file, repair)
}

pub fn load(text: &str) -> marmor::Result<Scene> {
    load_with(text, &[], false)
}

/// What one render gave.
pub struct Shot {
    pub image: Image,
    pub counts: Counts,
    pub tally: Tally,
    pub what: String,
}

impl Shot {
    pub fn brightest(&self) -> f32 {
        self.image.pixels.iter().map(|p| p.max()).fold(0.0, f32::max)
    }

    /// Nothing odd in the picture, nothing odd counted.
    pub fn assert_sound(&self) {
        let what = &self.what;
        assert!(self.image.pixels.iter().all(|p| p.is_finite() && p.min() >= 0.0), "{what}: {:?}", self.image.pixels);
        assert_eq!((self.counts.non_finite, self.counts.negative, self.tally.gather.non_finite), (0, 0, 0), "{what}");
    }
}

/// Options of the case's subsurface renders.
pub fn subsurface(estimator: Estimator, cache_samples: u32) -> SubsurfaceOptions {
    SubsurfaceOptions { single: true, cut_error: Some(0.1), ..options(estimator, cache_samples, 1) }
}

/// The film of some passes, and what they cost.
pub fn render<I: Integrator>(integrator: &I, scene: &Scene, backend: Backend, seed: u64, passes: u32) -> (Film, Tally) {
    let (film, outcome) = on(backend, scene, integrator, seed, 0..passes);
    (film, outcome.tally)
}

fn shot<I: Integrator>(integrator: &I, scene: &Scene, backend: Backend, what: String) -> Shot {
    let (film, tally) = render(integrator, scene, backend, 1, 2);
    Shot { image: film.image(), counts: film.counts(), tally, what: format!("{what} on {}", backend.name()) }
}

/// Every method on every backend.
pub fn shots(scene: &Scene) -> Vec<Shot> {
    let mut all = Vec::new();
    for backend in backends() {
        let occlusion = AmbientOcclusion { radius: f32::INFINITY, rays: 2 };
        all.push(shot(&occlusion, scene, backend, "ambient_occlusion".into()));
        all.push(shot(&Direct::new(scene, 1).unwrap(), scene, backend, "direct".into()));
        // 2000 is above what is summed without a tree.
        for (estimator, samples) in
            [(Estimator::Cut, 2000), (Estimator::All, 200), (Estimator::Notes, 200), (Estimator::Thinned, 2000)]
        {
            all.push(subsurface_shot(scene, estimator, samples, backend));
        }
        if can_be_walked(scene) {
            let walked = SubsurfaceOptions { shape: Shape::Walked, ..subsurface(Estimator::Cut, 8000) };
            all.push(shot(&Subsurface::new(scene, walked).unwrap(), scene, backend, "subsurface, walked".into()));
        }
        // Media in one another have no paths.
        let traced = VolumePathOptions { orders: Orders::All, photons: 50, specular: true, seed: 1 };
        if let Ok(method) = VolumePath::new(scene, traced) {
            all.push(shot(&method, scene, backend, "volume_path".into()));
        }
    }
    all
}

/// Whether paths walk through all bodies, and come out in less than a day.
fn can_be_walked(scene: &Scene) -> bool {
    let bodies = (0..scene.objects.len() as u32).filter(|o| scene.surface(*o).is_translucent());
    bodies.into_iter().all(|o| scene.not_walkable(o).is_empty() && scene.long_walks(o).is_none())
}

pub fn subsurface_shot(scene: &Scene, estimator: Estimator, samples: u32, backend: Backend) -> Shot {
    let method = Subsurface::new(scene, subsurface(estimator, samples)).unwrap();
    shot(&method, scene, backend, format!("subsurface, {}", estimator.name()))
}

/// Renders without a warning and soundly; the pictures are returned.
pub fn ok(scene: &Scene) -> Vec<Shot> {
    assert_eq!(scene.warnings, Vec::<String>::new());
    let all = shots(scene);
    all.iter().for_each(Shot::assert_sound);
    all
}

/// Says every one of `words` in its warnings, and renders soundly.
pub fn warns(scene: &Scene, words: &[&str]) -> Vec<Shot> {
    let said = scene.warnings.join("\n");
    for word in words {
        assert!(said.contains(word), "`{word}` in {said}");
    }
    let all = shots(scene);
    all.iter().for_each(Shot::assert_sound);
    all
}

/// Is a scene error that says every one of `words`.
pub fn refused(loaded: marmor::Result<Scene>, words: &[&str]) {
    let error = loaded.err().expect("accepted");
    assert_eq!(error.kind(), ErrorKind::Scene, "{error}");
    for word in words {
        assert!(error.to_string().contains(word), "`{word}` in {error}");
    }
}

/// With every model that exists for the medium of `text`: sound pictures on the preferred backend.
pub fn sound_in_all_models(text: &str) {
    for model in ModelName::ALL.iter().copied() {
        let path = Path::new("scene.toml");
        let file = SceneFile::parse(text, path).unwrap().with(&[format!("method.model={}", model.name())]).unwrap();
        // A slab needs a thickness that suits the medium; its own cases have one.
        let Ok(scene) = Scene::load(&file) else { continue };
        if scene.materials.iter().any(|m| m.surface.inside.as_ref().is_some_and(|t| t.build().is_err())) {
            continue;
        }
        for (estimator, samples) in [(Estimator::Cut, 2000), (Estimator::Notes, 100)] {
            let mut shot = subsurface_shot(&scene, estimator, samples, Backend::preferred());
            shot.what = format!("{}, {}", model.name(), shot.what);
            shot.assert_sound();
        }
    }
}
