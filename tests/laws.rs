//! Five laws over several scenes, every method and model, on every backend of the build. 1: scale. 2: place. 3: energy.
//! 4: order (files and signals: tests/interrupted.rs). 5: honesty (see also tests/extreme/).
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

use marmor::bssrdf::{Bssrdf, Entry, Exit, ModelName, ModelOption, SingleScattering};
use marmor::film::{Counts, Film, Image};
use marmor::integrator::{
    AmbientOcclusion, Direct, Integrator, Subsurface, SubsurfaceOptions, VolumePath, VolumePathOptions,
};
use marmor::math::{Rgb, Vec3};
use marmor::optics::{reflectance, transmittance};
use marmor::query::Backend;
use marmor::scene::{Estimator, Orders, Scene};
use marmor::tally::Tally;
use rendering::{average, backends, channels, load_beside, mean_of, means_of, on};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::ops::Range;

mod rendering;

/// A scene by numbers: lengths times `scale`, coefficients over it, places plus `shift`.
struct Built {
    scale: f64,
    shift: [f64; 3],
    text: String,
    obj: String,
}

impl Built {
    fn new(scale: f64, shift: [f64; 3]) -> Self {
        Self { scale, shift, text: "unit = \"mm\"\n".into(), obj: String::new() }
    }

    fn length(&self, v: f64) -> String {
        format!("{:e}", v * self.scale)
    }

    fn vector(&self, v: [f64; 3]) -> String {
        format!("[{}]", v.map(|x| self.length(x)).join(", "))
    }

    fn point(&self, v: [f64; 3]) -> String {
        let at: [String; 3] = std::array::from_fn(|i| format!("{:e}", v[i] * self.scale + self.shift[i]));
        format!("[{}]", at.join(", "))
    }

    fn coefficient(&self, v: [f64; 3]) -> String {
        format!("[{}]", v.map(|x| format!("{:e}", x / self.scale)).join(", "))
    }

    fn camera(&mut self, position: [f64; 3], look_at: [f64; 3], fov: f64) {
        let (p, l) = (self.point(position), self.point(look_at));
        let _ = write!(self.text, "[camera]\nposition = {p}\nlook_at = {l}\nfov = {fov}\nresolution = [12, 9]\n");
    }

    fn rectangle(&mut self, name: &str, centre: [f64; 3], u: [f64; 3], v: [f64; 3], material: &str) {
        let (c, u, v) = (self.point(centre), self.vector(u), self.vector(v));
        let _ = write!(
            self.text,
            "[[object]]\nname = \"{name}\"\nshape = \"rectangle\"\ncentre = {c}\nedge_u = {u}\nedge_v = {v}\nmaterial = \"{material}\"\n"
        );
    }

    fn wax(&mut self, name: &str, s: [f64; 3], a: [f64; 3], more: &str) {
        let (s, a) = (self.coefficient(s), self.coefficient(a));
        let _ = write!(
            self.text,
            "[material.{name}]\ntype = \"translucent\"\nsigma_s_prime = {s}\nsigma_a = {a}\neta = 1.3\n{more}\n"
        );
    }

    fn load(&self) -> Scene {
        load_beside("mesh.obj", &self.obj, &self.text)
    }
}

/// Half of a twisted bar of sound triangles, its coordinates in sixteenths: sums with powers of two are exact.
fn bar(built: &mut Built) {
    let ring = |i: i32| {
        let twist = [[4, 0], [3, 3], [0, 4], [-3, 3], [-4, 0], [-3, -3], [0, -4], [3, -3]];
        (0..4).map(move |k| {
            let [x, z] = twist[((2 * k + i) % 8) as usize];
            [f64::from(x) / 8.0, f64::from(i) / 4.0 - 1.0, f64::from(z) / 8.0]
        })
    };
    let (shift, scale) = (built.shift, built.scale);
    for [x, y, z] in (0..8).flat_map(ring) {
        let at = |v: f64, i: usize| format!("{:e}", v * scale + shift[i]);
        let _ = writeln!(built.obj, "v {} {} {}", at(x, 0), at(y, 1), at(z, 2));
    }
    for i in 0..7 {
        for k in 0..4 {
            let (a, b) = (4 * i + k + 1, 4 * i + (k + 1) % 4 + 1);
            let _ = writeln!(built.obj, "f {} {} {}\nf {} {} {}", a, a + 4, b, b, a + 4, b + 4);
        }
    }
    let _ = write!(built.obj, "f 1 2 3 4\nf 29 32 31 30\n");
    built.text += "[[object]]\nname = \"bar\"\nmesh = \"mesh.obj\"\nnormals = \"smooth\"\nmaterial = \"wax\"\n";
}

/// Three scenes: a bar under a lamp on a floor; a slab in an environment; two bodies with a lamp between them.
fn scenes(scale: f64, shift: [f64; 3]) -> Vec<(&'static str, Scene)> {
    let new = || Built::new(scale, shift);
    let lamp = "[material.lamp]\ntype = \"emissive\"\nradiance = [3, 2, 1]\n";
    let grey = "[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n";
    let mut all = Vec::new();

    let mut s = new();
    s.camera([1.0, 2.0, 5.0], [0.0, 0.0, 0.0], 35.0);
    bar(&mut s);
    s.rectangle("floor", [0.0, -1.0, 0.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0], "grey");
    s.rectangle("lamp", [1.0, 3.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.5], "lamp");
    s.wax("wax", [2.0, 3.0, 4.0], [0.05, 0.1, 0.2], "");
    s.text += lamp;
    s.text += grey;
    all.push(("bar", s.load()));

    let mut s = new();
    s.camera([0.0, 0.5, 2.0], [0.0, 0.0, 0.0], 60.0);
    s.rectangle("slab", [0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], "wax");
    s.wax("wax", [1.0, 1.0, 1.0], [0.01, 0.01, 0.01], "");
    s.text += "[environment]\nradiance = [1, 0.5, 0.25]\n";
    all.push(("slab", s.load()));

    let mut s = new();
    s.camera([0.0, 1.0, 4.0], [0.0, 0.0, 0.0], 50.0);
    s.rectangle("left", [-1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5], "wax");
    s.rectangle("right", [1.0, 0.0, 0.0], [0.0, 0.0, 0.5], [0.0, 0.5, 0.0], "milk");
    s.rectangle("lamp", [0.0, 0.0, 0.0], [0.0, 0.25, 0.0], [0.25, 0.0, 0.0], "lamp");
    s.wax("wax", [40.0, 30.0, 20.0], [0.5, 0.1, 3.0], "");
    s.wax("milk", [0.5, 0.25, 1.0], [0.001, 0.0, 0.002], "g = 0.9");
    s.text += "[environment]\nradiance = 0.25\n[material.lamp]\ntype = \"emissive\"\nradiance = [3, 2, 1]\ntwo_sided = true\n";
    all.push(("two bodies", s.load()));
    all
}

fn options(estimator: Estimator, cache_samples: u32) -> SubsurfaceOptions {
    SubsurfaceOptions { single: true, cut_error: Some(0.1), ..rendering::options(estimator, cache_samples, 3) }
}

fn film<I: Integrator>(method: &I, scene: &Scene, backend: Backend, passes: Range<u32>) -> (Film, Tally) {
    let (film, outcome) = on(backend, scene, method, 3, passes);
    (film, outcome.tally)
}

/// With more samples than are summed without a tree, where there is one.
const ESTIMATORS: [(Estimator, u32); 5] = [
    (Estimator::Cut, 1500),
    (Estimator::All, 100),
    (Estimator::Notes, 100),
    (Estimator::Thinned, 1500),
    (Estimator::Cluster, 1500),
];

fn set_model(scene: &mut Scene, model: ModelName) {
    for material in &mut scene.materials {
        if let Some(t) = &mut material.surface.inside {
            t.model = model;
            // Some four mean free paths of the thinnest channel: a slab that every medium here allows.
            let longest = t.medium.sigma_t_prime().0.into_iter().map(|s| 1.0 / s).fold(0.0, f32::max);
            t.thickness = model.takes(ModelOption::Thickness).then_some(4.0 * longest);
        }
    }
}

/// The film of every method, model and estimator by name.
fn films(scene: &mut Scene, backend: Backend, passes: Range<u32>, radius: f64) -> Vec<(String, Film)> {
    let mut all = Vec::new();
    set_model(scene, ModelName::STANDARD);
    for (name, radius) in [("ambient_occlusion", f32::INFINITY), ("ambient_occlusion, radius", radius as f32)] {
        let method = AmbientOcclusion { radius, rays: 2 };
        all.push((name.to_string(), film(&method, scene, backend, passes.clone()).0));
    }
    all.push(("direct".into(), film(&Direct::new(scene, 2).unwrap(), scene, backend, passes.clone()).0));
    // Bodies that are closed are traced too.
    let traced = VolumePathOptions { orders: Orders::All, photons: 200, specular: true, seed: 3 };
    if let Ok(method) = VolumePath::new(scene, traced) {
        all.push(("volume_path".into(), film(&method, scene, backend, passes.clone()).0));
    }
    // Every model with one estimator, every estimator with one model.
    let pairs = ModelName::ALL.iter().copied().enumerate().map(|(i, model)| (model, ESTIMATORS[i % ESTIMATORS.len()]));
    for (model, (estimator, samples)) in pairs.chain(ESTIMATORS.map(|e| (ModelName::BETTER, e))) {
        set_model(scene, model);
        let Ok(method) = Subsurface::new(scene, options(estimator, samples)) else { continue };
        let name = format!("{}, {}", model.name(), estimator.name());
        all.push((name, film(&method, scene, backend, passes.clone()).0));
    }
    all
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|p| p.0.map(f32::to_bits)).collect()
}

fn assert_same(what: &str, a: &[(String, Film)], b: &[(String, Film)]) {
    assert_eq!(a.len(), b.len());
    for ((name, a), (_, b)) in a.iter().zip(b) {
        let (a, b) = (a.image(), b.image());
        let different = bits(&a).iter().zip(&bits(&b)).filter(|(a, b)| a != b).count();
        let first = a.pixels.iter().zip(&b.pixels).find(|(a, b)| a != b);
        assert_eq!(
            different,
            0,
            "{what}: {name}: {different} of {} pixels differ, the first {first:?}",
            a.pixels.len()
        );
    }
}

#[test]
fn law_1_scale_powers_of_two_change_no_bit() {
    for backend in backends() {
        let plain = scenes(1.0, [0.0; 3]);
        let plain: Vec<_> = plain.into_iter().map(|(name, mut s)| (name, films(&mut s, backend, 0..1, 0.5))).collect();
        for exponent in [-20, 20] {
            let k = 2_f64.powi(exponent);
            for ((name, mut scene), (_, expected)) in scenes(k, [0.0; 3]).into_iter().zip(&plain) {
                let found = films(&mut scene, backend, 0..1, 0.5 * k);
                assert_same(&format!("{} on {}, scale 2^{exponent}", name, backend.name()), &found, expected);
            }
        }
    }
}

/// Coordinates of the scenes are sixteenths; a million and those have room in f64, so that nothing is rounded.
#[test]
fn law_2_place_a_million_units_away_is_the_same_place() {
    for backend in backends() {
        for shift in [[1e6, 0.0, 0.0], [-1e6, 1e6, 3e6]] {
            for ((name, mut here), (_, mut there)) in scenes(1.0, [0.0; 3]).into_iter().zip(scenes(1.0, shift)) {
                let (here, there) = (films(&mut here, backend, 0..1, 0.5), films(&mut there, backend, 0..1, 0.5));
                assert_same(&format!("{name} on {}, moved by {shift:?}", backend.name()), &there, &here);
            }
        }
    }
}

/// Light that a half space sends out along its normal in a white furnace, over T21, by quadrature: ∫ T12 cosθ ∫ S_d dA dω, midpoints in
/// the cosine at the entry, in the logarithm of the distance and about the normal.
fn furnace_by_quadrature(model: &dyn Bssrdf, eta: f32) -> [f64; 3] {
    const COSINES: u32 = 16;
    const DISTANCES: u32 = 120;
    const TURNS: u32 = 12;
    let middle = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let exit_at = |x: Vec3| Exit { x, n: Vec3::Z, w: Vec3::Z };
    let mut sum = [0.0; 3];
    for cos in (0..COSINES).map(|i| middle(i, COSINES)) {
        let sin = (1.0 - cos * cos).sqrt() / f64::from(eta);
        let w = Vec3::new(sin as f32, 0.0, -(1.0 - sin * sin).sqrt() as f32);
        let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w };
        let from_here = f64::from(transmittance(eta, cos as f32)) * cos * TAU / f64::from(COSINES);
        // 1e-5 to 10.
        let logs = 1e6_f64.ln();
        for r in (0..DISTANCES).map(|i| 1e-5 * (middle(i, DISTANCES) * logs).exp()) {
            let area = r * r * (logs / f64::from(DISTANCES)) * (TAU / f64::from(TURNS));
            for turn in (0..TURNS).map(|i| PI * middle(i, TURNS)) {
                let s = model.eval(&entry, &exit_at(Vec3::new((r * turn.cos()) as f32, (r * turn.sin()) as f32, 0.0)));
                (0..3).for_each(|c| sum[c] += from_here * area * f64::from(s[c]));
            }
        }
    }
    sum
}

/// A wide plane of each model in a white furnace: what enters comes back times the model's total, with single scattering where
/// the model leaves it out, and the mirror adds the rest; where that depends on the direction at the entry, times what a quadrature of
/// the model says. White and convex surfaces vanish, and so does a body that absorbs nothing for its paths.
/// Relative error of the quadrature at the most, held by the models whose total is known.
const QUADRATURE: f64 = 2e-3;

#[test]
fn law_3_energy_furnaces_are_one() {
    let (t21, mirror) = (f64::from(transmittance(1.3, 1.0)), f64::from(reflectance(1.3, 1.0)));
    for backend in backends() {
        for model in ModelName::models() {
            let mut s = Built::new(1.0, [0.0; 3]);
            s.camera([0.0, 0.0, 0.5], [0.0, 0.0, 0.0], 0.2);
            s.rectangle("plane", [0.0, 0.0, 0.0], [2.5, 0.0, 0.0], [0.0, 2.5, 0.0], "wax");
            s.wax("wax", [4.0, 3.0, 2.0], [0.75, 1.0, 1.25], &format!("model = \"{}\"\nthickness = 0.6", model.name()));
            s.text += "[environment]\nradiance = 1\n";
            let scene = s.load();
            let Some(t) = &scene.materials[0].surface.inside else { panic!("not wax") };
            let built = t.build().unwrap();
            let (mut total, claims) = (built.total(), built.claims());
            let mut found_by_quadrature = furnace_by_quadrature(&*built, 1.3);
            assert!(!claims.bounded_energy || total.max() <= 1.0 && total.min() > 0.0, "{}: {total:?}", model.name());
            let by_direction = [ModelName::BEAM, ModelName::DIRECTIONAL].contains(&model);
            for (c, q) in found_by_quadrature.iter().enumerate() {
                let t = f64::from(total[c]);
                assert!(by_direction || (q / t - 1.0).abs() < QUADRATURE, "{}, channel {c}: {q} {t}", model.name());
            }
            if !claims.first_order {
                let once = SingleScattering::new(&t.medium).total();
                total += once;
                (0..3).for_each(|c| found_by_quadrature[c] += f64::from(once[c]));
            }
            let run = |seed| {
                let method = Subsurface::new(&scene, SubsurfaceOptions { seed, ..options(Estimator::Cut, 4096) });
                channels(&on(backend, &scene, &method.unwrap(), seed, 0..24).0.image())
            };
            let found = means_of(&(1..=10).map(run).collect::<Vec<_>>());
            for (c, (mean, error)) in found.into_iter().enumerate() {
                let expected = t21 * if by_direction { found_by_quadrature[c] } else { f64::from(total[c]) } + mirror;
                let what = format!("{} on {}, channel {c}", model.name(), backend.name());
                assert!(error < 0.02 * expected, "{what}: too noisy to say anything: {mean} +- {error}");
                let found = format!("{what}: {mean} +- {error}, expected {expected}");
                let by_rule = if by_direction { QUADRATURE * expected } else { 1e-4 };
                assert!((mean - expected).abs() < 5.0 * error + by_rule, "{found}");
                assert!(mean < 1.0 + 8.0 * error, "more than enters: {found}");
            }
        }
        let mut s = Built::new(1.0, [0.0; 3]);
        s.camera([0.0, 0.0, 3.0], [0.0, 0.0, 0.0], 60.0);
        s.text += "[environment]\nradiance = 1\n[[object]]\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n[material.white]\ntype = \"diffuse\"\nalbedo = 1\n";
        let scene = s.load();
        for pixel in film(&Direct::new(&scene, 1).unwrap(), &scene, backend, 0..4).0.image().pixels {
            assert!((pixel[0] - 1.0).abs() < 1e-5, "direct on {}: {pixel:?}", backend.name());
        }
        let white = "shape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n[material.white]\ntype = \"translucent\"\nsigma_s_prime = 1\nsigma_a = 0\neta = 1.3\n";
        let mut s = Built::new(1.0, [0.0; 3]);
        s.camera([0.0, 0.0, 6.0], [0.0, 0.0, 0.0], 10.0);
        let _ = write!(s.text, "[environment]\nradiance = 1\n[[object]]\n{white}");
        let body = s.load();
        let (mean, error) = mean_of((1..=10).map(|seed| {
            let options = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed };
            average(&on(backend, &body, &VolumePath::new(&body, options).unwrap(), seed, 0..48).0.image())
        }));
        // 2 % would be noticed.
        assert!(error < 2e-3 && (mean - 1.0).abs() < 8.0 * error + 1e-4, "volume_path: {mean} +- {error}");
        let image = film(&AmbientOcclusion { radius: f32::INFINITY, rays: 4 }, &scene, backend, 0..4).0.image();
        assert!(image.pixels.iter().all(|&p| p == Rgb::WHITE), "a convex body occludes nothing of itself");
    }
}

#[test]
fn law_4_order_threads_and_splits_change_no_bit() {
    let pool = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    for backend in backends() {
        for (name, mut scene) in scenes(1.0, [0.0; 3]) {
            let whole = pool(1).install(|| films(&mut scene, backend, 0..5, 0.5));
            let first = pool(3).install(|| films(&mut scene, backend, 0..1, 0.5));
            let last = pool(2).install(|| films(&mut scene, backend, 2..5, 0.5));
            let middle = pool(5).install(|| films(&mut scene, backend, 1..2, 0.5));
            for (((whole, first), last), middle) in whole.iter().zip(&first).zip(&last).zip(&middle) {
                let mut joined = last.1.clone();
                joined.join(&first.1).unwrap();
                joined.join(&middle.1).unwrap();
                assert!(
                    joined == whole.1,
                    "{name} on {}: {} of parts is not that of all passes",
                    backend.name(),
                    whole.0
                );
            }
        }
    }
}

/// Every sample of every pixel is in the picture or in a count.
#[test]
fn law_5_honesty_every_sample_is_kept_or_counted() {
    for backend in backends() {
        for (name, mut scene) in scenes(1.0, [0.0; 3]) {
            // Enough light for some products to leave single precision, and some not.
            for material in &mut scene.materials {
                if let Some(emission) = &mut material.surface.emission {
                    emission.radiance = Rgb::splat(2e38);
                }
            }
            for (method, film) in films(&mut scene, backend, 0..2, 0.5) {
                let Counts { samples, non_finite, first_non_finite, .. } = film.counts();
                let what = format!("{name} on {}: {method}", backend.name());
                assert_eq!(samples + non_finite, 2 * 12 * 9, "{what}");
                assert_eq!(first_non_finite.is_some(), non_finite > 0, "{what}");
                assert!(film.image().pixels.iter().all(|p| p.is_finite() && p.min() >= 0.0), "{what}");
            }
        }
    }
}
