//! Many lamps: what asks for one of them finds the light of all.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod rendering;

use marmor::geometry::SurfacePoint;
use marmor::integrator::{Direct, Integrator, Subsurface, SubsurfaceOptions, View, VolumePath, VolumePathOptions};
use marmor::light::Lights;
use marmor::math::{DVec3, Vec3, hash, unit_f32};
use marmor::query::{self, Backend};
use marmor::scene::{Orders, Scene, SceneFile};
use rendering::film;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::Path;

const LAMPS: u64 = 150;
const RADIANCE: f64 = 40.0;

fn number(i: u64) -> f32 {
    unit_f32((hash(i + 1) >> 32) as u32)
}

/// A square lamp: its middle and half its edges.
struct Lamp {
    middle: DVec3,
    edges: [DVec3; 2],
}

impl Lamp {
    /// Corners, counter-clockwise seen from where it shines to.
    fn corners(&self) -> [DVec3; 4] {
        let [u, v] = self.edges;
        [-u - v, u - v, u + v, v - u].map(|edge| self.middle + edge)
    }

    /// Irradiance on a surface at the origin that looks up, of radiance 1: Lambert's sum over the edges of a polygon that is above it.
    fn irradiance(&self) -> f64 {
        let [u, v] = self.edges;
        if u.cross(v).dot(-self.middle) <= 0.0 {
            return 0.0;
        }
        let corners = self.corners();
        let edge = |i: usize| {
            let (a, b) = (corners[i].normalize(), corners[(i + 1) % 4].normalize());
            let across = a.cross(b);
            across.length().atan2(a.dot(b)) * across.normalize().y
        };
        (0..4).map(edge).sum::<f64>().abs() / 2.0
    }
}

/// Lamps at distances of 1 to 4 into evenly spread directions, so that none hides another: over the upper half, or all around. Most look
/// some way past the middle, a third away from it.
fn lamps(all_around: bool) -> Vec<Lamp> {
    let lamp = |i: u64| {
        let height = (i as f64 + 0.5) / LAMPS as f64;
        let y = if all_around { 1.0 - 2.0 * height } else { 0.1 + 0.9 * height };
        let (angle, side) = (TAU * i as f64 * 0.618_033_988_75, (1.0 - y * y).max(0.0).sqrt());
        let to = DVec3::new(side * angle.cos(), y, side * angle.sin());
        let distance = 1.0 + 3.0 * f64::from(number(3 * i)).powi(2);
        let aside = to.any_orthonormal_vector() * f64::from(number(3 * i + 1));
        let n = (if i.is_multiple_of(3) { to } else { -to } + aside).normalize();
        let u = n.any_orthonormal_vector();
        Lamp { middle: to * distance, edges: [u, n.cross(u)].map(|edge| edge * 0.04 * distance) }
    };
    (0..LAMPS).map(lamp).collect()
}

/// `text` and the lamps, as an object each, or all as one mesh; what an emission is said by in `more`.
fn scene(text: &str, lamps: &[Lamp], as_one: bool, more: &str, folder: &Path) -> Scene {
    let mut text = format!("unit = \"mm\"\n{text}[material.lamp]\ntype = \"emissive\"\nradiance = {RADIANCE}\n{more}");
    if as_one {
        let mut mesh = String::new();
        for (k, lamp) in lamps.iter().enumerate() {
            lamp.corners().iter().for_each(|c| writeln!(mesh, "v {} {} {}", c.x, c.y, c.z).unwrap());
            writeln!(mesh, "f {} {} {} {}", 4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * k + 4).unwrap();
        }
        std::fs::write(folder.join("lamps.obj"), mesh).unwrap();
        text += "[[object]]\nname = \"lamps\"\nmesh = \"lamps.obj\"\nmaterial = \"lamp\"\n";
    } else {
        for Lamp { middle, edges: [u, v] } in lamps {
            let [middle, u, v] = [middle, u, v].map(DVec3::to_array);
            writeln!(
                text,
                "[[object]]\nshape = \"rectangle\"\ncentre = {middle:?}\nedge_u = {u:?}\nedge_v = {v:?}\nmaterial = \"lamp\""
            )
            .unwrap();
        }
    }
    Scene::load(&SceneFile::parse(&text, &folder.join("scene.toml")).unwrap()).unwrap()
}

/// A camera straight above the origin that sees a small spot of a floor there.
const FLOOR: &str = "[camera]\nposition = [0, 0.5, 0]\nlook_at = [0, 0, 0]\nup = [0, 0, 1]\nfov = 0.2\nresolution = [8, 8]\n\
    [[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [0, 0, 0.1]\nedge_v = [0.1, 0, 0]\n\
    material = \"grey\"\n[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n";

const RUNS: u64 = 16;

/// Mean over the picture and the channels of independent runs, and its standard error.
fn mean<I: Integrator>(scene: &Scene, of: impl Fn(u64) -> I, passes: u32) -> (f64, f64) {
    mean_of(&(1..=RUNS).map(|seed| mean_of_picture(scene, &of(seed), passes, seed)).collect::<Vec<_>>())
}

fn mean_of_picture(scene: &Scene, method: &impl Integrator, passes: u32, seed: u64) -> f64 {
    let pixels = film(method, scene, passes, seed, &mut []).image().pixels;
    pixels.iter().map(|p| f64::from(p.mean())).sum::<f64>() / pixels.len() as f64
}

fn mean_of(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Within 5 standard errors, which are below the share `most` of the value: of 16 runs Student's law passes a fair pair with
/// a chance of 99.98 %.
fn agree(a: (f64, f64), b: (f64, f64), most: f64, what: &str) {
    let error = a.1.hypot(b.1);
    println!("{what}: {:.5} +- {:.5} against {:.5} +- {:.5}, z {:.2}", a.0, a.1, b.0, b.1, (a.0 - b.0) / error);
    assert!(error < most * b.0, "{what}: too noisy to say anything: {a:?} {b:?}");
    assert!((a.0 - b.0).abs() < 5.0 * error, "{what}: {a:?} against {b:?}");
}

fn paths(photons: u32, orders: Orders, seed: u64) -> VolumePathOptions {
    VolumePathOptions { orders, photons, specular: false, seed }
}

/// On a floor, by asking alone, by paths that also meet lamps, and by any share of directions of the floor: the sum of what all lamps send,
/// on paper.
#[test]
fn a_floor_has_the_light_of_all_lamps() {
    let folder = tempfile::tempdir().unwrap();
    let lamps = lamps(false);
    let expected = RADIANCE * lamps.iter().map(Lamp::irradiance).sum::<f64>();
    let scene = scene(FLOOR, &lamps, false, "", folder.path());
    let radiance = (0.5 / PI * expected, 0.0);
    agree(mean(&scene, |_| Direct::new(&scene, 1).unwrap(), 64), radiance, 0.01, "direct");
    let path = |seed| VolumePath::new(&scene, paths(0, Orders::All, seed)).unwrap();
    agree(mean(&scene, path, 64), radiance, 0.01, "volume_path");
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let (view, lights) = (View { scene: &scene, rays: &*rays }, Lights::new(&scene));
    let point = |(u, v)| scene.objects[0].mesh.point(0, u, v).facing(Vec3::Y);
    let middles = [(0.5, 0.5), (0.5, 0.0), (0.0, 0.5)].map(point);
    let at = middles.into_iter().find(|at| (at.x + scene.centre).length() < 1e-9).unwrap();
    let at = SurfacePoint { n: at.n_geometric, ..at };
    for share in [0.0, 0.4, 1.0] {
        let run = |run: u64| {
            let n = 4000;
            let each = (0..n).filter_map(|i| {
                let u = [0, 1, 2, 3].map(|k| number(4 * (n * run + i) + k));
                let (arrival, open) = lights.arrival_of_all(view, &at, share, u)?;
                let open = open || !rays.occluded(&arrival.shadow);
                open.then(|| f64::from(arrival.irradiance.mean()))
            });
            each.sum::<f64>() / n as f64
        };
        let found = mean_of(&(0..RUNS).map(run).collect::<Vec<_>>());
        agree(found, (expected, 0.0), if share < 1.0 { 0.01 } else { 0.03 }, &format!("share {share} by the floor"));
    }
}

/// A ball within the lamps, seen from between them.
const BALL: &str = "[camera]\nposition = [0, 0.3, 9]\nlook_at = [0, 0, 0]\nfov = 8\nresolution = [8, 8]\n\
    [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 0.8\nrings = 16\nsegments = 32\n\
    material = \"wax\"\n[material.wax]\ntype = \"translucent\"\nsigma_s = 6\nsigma_a = 0.1\ng = 0\neta = 1.3\n";

/// The same lamps as one mesh, of which points are drawn by area, are the same light to every method.
#[test]
fn a_ball_amid_many_lamps_is_that_amid_one_mesh_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let lamps = lamps(true);
    for more in ["", "two_sided = true\n"] {
        let [many, one] = [false, true].map(|as_one| scene(BALL, &lamps, as_one, more, folder.path()));
        assert_eq!([&many, &one].map(|scene| Lights::new(scene).emitters()), [LAMPS as usize, 1]);
        for (orders, photons, passes) in
            [(Orders::Single, 0, 32), (Orders::Multiple, 0, 64), (Orders::Multiple, 1024, 32)]
        {
            // Points of the one mesh are noisier.
            let [a, b] = [(&many, passes), (&one, 3 * passes)].map(|(scene, passes)| {
                mean(scene, |seed| VolumePath::new(scene, paths(photons, orders, seed)).unwrap(), passes)
            });
            agree(a, b, 0.03, &format!("{more}volume_path, {orders:?}, {photons} photons"));
        }
        // The points of the ball are the same in both, and so is most of the noise.
        let one_run = |scene: &Scene, seed| {
            let options = SubsurfaceOptions { cache_samples: 16384, specular: false, seed, ..Default::default() };
            mean_of_picture(scene, &Subsurface::new(scene, options).unwrap(), 4, seed)
        };
        let ratios: Vec<f64> = (1..=RUNS).map(|seed| one_run(&many, seed) / one_run(&one, seed)).collect();
        agree(mean_of(&ratios), (1.0, 0.0), 0.02, &format!("{more}subsurface, ratio"));
    }
}

/// With photons and without, to each other.
#[test]
fn photons_of_many_lamps_are_the_light_of_paths() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(BALL, &lamps(true), false, "", folder.path());
    let of = |photons| mean(&scene, |seed| VolumePath::new(&scene, paths(photons, Orders::All, seed)).unwrap(), 64);
    agree(of(1024), of(0), 0.02, "photons");
}

/// All lamps are counted, in no more numbers than there are, and each by a number that has its name.
#[test]
fn many_lamps_share_the_numbers_of_the_tally() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(FLOOR, &lamps(false), false, "", folder.path());
    let lights = Lights::new(&scene);
    let counted = lights.counted(&scene);
    assert_eq!(counted.len(), marmor::tally::LIGHTS - 1, "one number is left for suns");
    let all: f64 = counted.iter().map(|light| light.chance).sum();
    assert!((all - 1.0).abs() < 1e-9, "{all}");
    let numbers: Vec<usize> = counted.iter().map(|light| light.number).collect();
    assert_eq!(numbers, (1..marmor::tally::LIGHTS).collect::<Vec<_>>());
    assert!(counted[0].name.ends_with(" and 4 more"), "{}", counted[0].name);
    for object in 1..=LAMPS as u32 {
        assert!(numbers.contains(&lights.number(object).unwrap()));
    }
    assert_eq!(lights.number(0), None);
}
