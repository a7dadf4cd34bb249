//! A ball alone in light of radiance 1 from all sides, seen in one spot, where it is known what leaves it: of models that know
//! the distance alone the integral over the mesh, of the others no more than they claim, of `volume_path` 1 without
//! absorption.

use super::harness::{BALL, backends, render};
use super::rendering::{channels, means_of};
use marmor::bssrdf::{ModelName, ModelOption, Radial, SingleScattering};
use marmor::integrator::{Subsurface, SubsurfaceOptions, VolumePath, VolumePathOptions};
use marmor::math::{DVec3, GaussLegendre, Rgb, Vec3};
use marmor::optics::{Medium, transmittance};
use marmor::query::{self, Backend, Hit, Ray};
use marmor::scene::{Estimator, Orders, Scene, SceneFile, Spread, Translucent};
use std::path::Path;

/// The ball with the medium of `text`, a scene of this folder, and a model.
pub fn scene(text: &str, model: &str) -> Option<Scene> {
    let from = text.find("[material.wax]")?;
    let wax = &text[from..from + text[from..].find("[material.grey]")?];
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0.3, 1, 6]\nlook_at = [0, 0, 0]\nfov = 0.001\nresolution = [4, 3]\n\
         [environment]\nradiance = 1\n[[object]]\nname = \"body\"\n{BALL}\n{wax}"
    );
    let file = SceneFile::parse(&text, Path::new("scene.toml")).unwrap();
    let scene = Scene::load(&file.with(&[format!("method.model={model}")]).unwrap()).ok()?;
    translucent(&scene).build().is_ok().then_some(scene)
}

pub fn translucent(scene: &Scene) -> &Translucent {
    scene.objects.iter().find_map(|o| scene.materials[o.material].surface.inside.as_ref()).unwrap()
}

/// A mean per channel and its standard error.
pub type Mean = [(f64, f64); 3];

/// With eight runs the standard error itself is known to some 25 %: 8 of them stand for 5 and more of a known one.
pub const RUNS: u64 = 8;
pub const ERRORS: f64 = 8.0;

/// Means over the whole picture of runs with other seeds.
pub fn seen<I: marmor::integrator::Integrator>(
    scene: &Scene,
    backend: Backend,
    passes: u32,
    of: impl Fn(u64) -> I,
) -> Mean {
    let run = |seed| channels(&render(&of(seed), scene, backend, seed, passes).0.image());
    means_of(&(1..=RUNS).map(run).collect::<Vec<_>>())
}

pub fn options(estimator: Estimator, single: bool) -> SubsurfaceOptions {
    // Above what is summed without a tree.
    let cache_samples = if estimator == Estimator::Notes { 1500 } else { 4000 };
    SubsurfaceOptions {
        single,
        spread: Spread::Area,
        bounces: 0,
        ..super::harness::subsurface(estimator, cache_samples)
    }
}

pub fn by(scene: &Scene, backend: Backend, estimator: Estimator, single: bool) -> Mean {
    let method = |seed| Subsurface::new(scene, SubsurfaceOptions { seed, ..options(estimator, single) }).unwrap();
    seen(scene, backend, 8, method)
}

/// What is seen of the ball: a point, and the share of its light that leaves towards the camera.
struct Spot {
    x: DVec3,
    n: Vec3,
    w: Vec3,
    /// T21 there.
    leaves: f64,
}

fn spot(scene: &Scene) -> Spot {
    let origin = Vec3::new(0.3, 1.0, 6.0);
    let w = origin.normalize();
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let Hit { triangle, u, v, .. } = rays.closest(&Ray::new(origin.as_dvec3(), -w)).unwrap();
    let mesh = &scene.objects[0].mesh;
    let at = mesh.point(triangle, u, v);
    let n = at.normal_seen_from(w);
    let leaves = transmittance(translucent(scene).medium.eta, n.dot(w)).into();
    Spot { x: at.x, n, w, leaves }
}

/// ∫ M(|x - y|) dy over a triangle: it is cut into four until it is small beside its distance, by midpoints of edges.
fn over(model: &dyn Radial, [a, b, c]: [DVec3; 3], x: DVec3, least: f64, sum: &mut [f64; 3]) {
    let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
    let size = a.distance(b).max(b.distance(c)).max(c.distance(a));
    if size > least && size > 0.2 * ((a + b + c) / 3.0).distance(x) {
        for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            over(model, part, x, least, sum);
        }
        return;
    }
    let area = 0.5 * (b - a).cross(c - a).length();
    for y in [ab, bc, ca] {
        let value = model.exitance(y.distance(x) as f32);
        (0..3).for_each(|k| sum[k] += f64::from(value[k]) * area / 3.0);
    }
}

/// What leaves the spot per radiance around, both Fresnel factors and the mirror image in it, of a model of the distance.
fn of_distance(scene: &Scene, model: &dyn Radial) -> [f64; 3] {
    let (spot, mesh, sigma) = (spot(scene), &scene.objects[0].mesh, translucent(scene).medium.sigma_t_prime());
    let (mut sum, least) = ([0.0; 3], 1e-4 / f64::from(sigma.max()));
    for t in 0..mesh.triangles.len() as u32 {
        over(model, mesh.corners(t), spot.x, least, &mut sum);
    }
    sum.map(|inside| 1.0 - spot.leaves + spot.leaves * inside)
}

/// Of light scattered once in a plane at the spot.
fn single_on_a_plane(scene: &Scene) -> [f64; 3] {
    let (spot, single) = (spot(scene), SingleScattering::new(&translucent(scene).medium));
    let frame = marmor::math::frame(spot.n);
    let mut sum = [0.0; 3];
    for (mu, weight) in GaussLegendre::new(24).points_on(0.0, 1.0) {
        for k in 0..32 {
            let (sin, cos) = (std::f64::consts::TAU / 32.0 * f64::from(k)).sin_cos();
            let r = (1.0 - mu * mu).sqrt();
            let w = frame * Vec3::new((r * cos) as f32, (r * sin) as f32, mu as f32);
            let f = single.plane_brdf(w, spot.w, spot.n);
            (0..3).for_each(|c| sum[c] += f64::from(f[c]) * mu * weight * std::f64::consts::TAU / 32.0);
        }
    }
    sum
}

/// The most that a model says comes back of what has entered, without absorption; at least 1.
pub fn most(t: &Translucent) -> f64 {
    let name = t.build().unwrap().name();
    let clear = Translucent { model: name, medium: Medium { sigma_a: Rgb::BLACK, ..t.medium }, ..t.clone() };
    let model = clear.build().unwrap();
    let total = model.total();
    let single = if model.claims().first_order { Rgb::BLACK } else { SingleScattering::new(&clear.medium).total() };
    f64::from((total + single).max()).max(1.0)
}

/// Numerical integrals over the mesh in f32 values of a model.
const QUADRATURE: f64 = 3e-3;
/// Of a curved, faceted ball taken as a plane, for single scattering.
const PLANE: f64 = 2e-2;

fn assert_is(found: Mean, expected: [f64; 3], tolerance: f64, what: &str) {
    for c in 0..3 {
        let (mean, error) = found[c];
        assert!(error < 0.05 * expected[c], "{what}, channel {c}: too noisy to say anything: {mean} +- {error}");
        assert!(
            (mean - expected[c]).abs() < ERRORS * error + tolerance * expected[c],
            "{what}, channel {c}: {mean} +- {error}, expected {}",
            expected[c]
        );
    }
}

/// With what the stiffness of the medium allows to ask.
#[derive(Clone, Copy, PartialEq)]
pub enum Of {
    /// The estimators that sum over the cache alone have little noise too.
    Soft,
    /// A near field.
    Stiff,
    /// The same, and the body is a plane to light scattered once.
    Plane,
}

/// Every model and its estimators.
pub fn in_all_models(text: &str, of: Of) {
    for name in ModelName::models() {
        let Some(scene) = scene(text, name.name()) else { continue };
        let t = translucent(&scene);
        let model = t.build().unwrap();
        let most = most(t);
        // The curvature of a ball brings no more light than a plane, but for edges between facets.
        let known = if name.takes(ModelOption::Thickness) { None } else { model.radial() };
        let expected = known.map(|radial| of_distance(&scene, radial));
        let first_order = model.claims().first_order;
        let lecture = [Estimator::All, Estimator::Notes, Estimator::Thinned];
        let estimators = [Estimator::Cut].into_iter().chain(lecture.into_iter().filter(|_| of == Of::Soft));
        let mut found = Vec::new();
        for estimator in estimators {
            for backend in backends().take(if of == Of::Soft { 1 } else { 2 }) {
                let what = format!("{}, {} on {}", name.name(), estimator.name(), backend.name());
                let mean = by(&scene, backend, estimator, false);
                if let Some(expected) = expected {
                    assert_is(mean, expected, QUADRATURE, &what);
                }
                let leaves = spot(&scene).leaves;
                for (mean, error) in mean {
                    assert!(
                        mean < 1.0 - leaves + leaves * most + ERRORS * error,
                        "{what}: {mean} +- {error} of {most}"
                    );
                }
                found.push((what, mean));
            }
        }
        for (what, mean) in &found[1..] {
            for (&(a, da), &(b, db)) in found[0].1.iter().zip(mean) {
                assert!(
                    (a - b).abs() < ERRORS * da.hypot(db) + 1e-4,
                    "{}: {a} +- {da}; {what}: {b} +- {db}",
                    found[0].0
                );
            }
        }
        if !first_order {
            let what = format!("{} and single scattering", name.name());
            let mean = by(&scene, Backend::preferred(), Estimator::Cut, true);
            let once = single_on_a_plane(&scene);
            for ((&(with, error), &(without, e)), once) in mean.iter().zip(&found[0].1).zip(once) {
                assert!(with < most + ERRORS * error, "{what}: {with} +- {error} of {most}");
                // Counted once, and all of it.
                let off = with - without - once;
                let allowed = ERRORS * error.hypot(e) + PLANE * once;
                assert!(of != Of::Plane || off.abs() < allowed, "{what}: {off} of {} more than that, {allowed}", once);
            }
        }
    }
}

/// The paths of the ball: all of the light without absorption, no more with it.
pub fn of_paths(text: &str, passes: u32) {
    let Some(mut scene) = scene(text, "standard") else { return };
    for clear in [false, true] {
        if clear {
            for material in &mut scene.materials {
                if let Some(t) = &mut material.surface.inside {
                    t.medium.sigma_a = Rgb::BLACK;
                }
            }
        }
        for backend in backends().skip(usize::from(backends().count() > 1 && !clear)) {
            let of = |seed| {
                let options = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed };
                VolumePath::new(&scene, options).unwrap()
            };
            let found = seen(&scene, backend, passes, of);
            for (c, (mean, error)) in found.into_iter().enumerate() {
                let what = format!("volume_path on {}, channel {c}: {mean} +- {error}", backend.name());
                assert!(mean < 1.0 + ERRORS * error + 1e-4, "more than all of the light: {what}");
                if clear {
                    assert!(
                        error < 0.8 / f64::from(passes).sqrt() / 4.0 && (mean - 1.0).abs() < ERRORS * error + 1e-4,
                        "not all of the light: {what}"
                    );
                }
            }
        }
    }
}
