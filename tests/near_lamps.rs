//! `volume_path` beside lamps that nearly touch a body.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

use marmor::film::{Film, Window};
use marmor::integrator::{View, VolumePath, VolumePathOptions};
use marmor::query::{self, Backend};
use marmor::render::{self, Job};
use marmor::scene::{Orders, Scene, SceneFile};
use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;

const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 1024, specular: true, seed: 1 };
const RUNS: u64 = 16;

/// Mean over the picture and the channels of independent runs, and its standard error.
fn mean(scene: &Scene, options: VolumePathOptions, passes: u32) -> (f64, f64) {
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let resolution = scene.camera.resolution;
    let of = |seed| {
        let method = VolumePath::new(scene, VolumePathOptions { seed, ..options }).unwrap();
        let mut film = Film::new(resolution, Window::full(resolution)).unwrap();
        let cancel = AtomicBool::new(false);
        let job = Job { seed, passes: Some(passes), time: None, cancel: &cancel };
        render::run(&method, View { scene, rays: &*rays }, &job, &mut film, &mut []).unwrap();
        let pixels = film.image().pixels;
        pixels.iter().map(|p| f64::from(p.mean())).sum::<f64>() / pixels.len() as f64
    };
    let values: Vec<f64> = (1..=RUNS).map(of).collect();
    let n = RUNS as f64;
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

fn load(text: &str, folder: &Path) -> Scene {
    Scene::load(&SceneFile::parse(text, &folder.join("scene.toml")).unwrap()).unwrap()
}

/// A cuboid of half sizes `half` about the origin, in a file.
fn cuboid(folder: &Path, [a, b, c]: [f64; 3]) {
    let mut text = String::new();
    for y in [b, -b] {
        for [x, z] in [[-a, -c], [-a, c], [a, c], [a, -c]] {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
    }
    text += "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    std::fs::write(folder.join("box.obj"), text).unwrap();
}

/// A rectangle of half sizes `u` and `v`, which shines where u x v looks, or to both sides.
fn lamp(name: &str, [x, y, z]: [f64; 3], u: [f64; 3], v: [f64; 3]) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nshape = \"rectangle\"\ncentre = [{x}, {y}, {z}]\nedge_u = {u:?}\nedge_v = {v:?}\n\
         material = \"lamp\"\n"
    )
}

/// A white cube, seen from above; `lights` beside it.
fn cube(folder: &Path, lights: &str) -> Scene {
    cuboid(folder, [1.0; 3]);
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 4.5, 0.01]\nlook_at = [0, 0, 0]\nfov = 25\nresolution = [8, 8]\n\
         [[object]]\nname = \"cube\"\nmesh = \"box.obj\"\nmaterial = \"white\"\n[material.white]\ntype = \"translucent\"\n\
         sigma_s = 3\nsigma_a = 0\ng = 0\neta = 1.3\n{lights}"
    );
    load(&text, folder)
}

/// A closed box of lamps around it, `gap` away on all sides but the camera's.
fn lamps_around(gap: f64, two_sided: bool) -> String {
    let (r, top) = (1.0 + gap, 5.0);
    let (middle, half) = (0.5 * (top - r), 0.5 * (top + r));
    let walls = lamp("floor", [0.0, -r, 0.0], [0.0, 0.0, r], [r, 0.0, 0.0])
        + &lamp("ceiling", [0.0, top, 0.0], [r, 0.0, 0.0], [0.0, 0.0, r])
        + &lamp("left", [-r, middle, 0.0], [0.0, half, 0.0], [0.0, 0.0, r])
        + &lamp("right", [r, middle, 0.0], [0.0, 0.0, r], [0.0, half, 0.0])
        + &lamp("back", [0.0, middle, -r], [r, 0.0, 0.0], [0.0, half, 0.0])
        + &lamp("front", [0.0, middle, r], [0.0, half, 0.0], [r, 0.0, 0.0]);
    format!("{walls}[material.lamp]\ntype = \"emissive\"\nradiance = 1\ntwo_sided = {two_sided}\n")
}

/// A white furnace: all that is seen is 1.
#[test]
fn lamps_all_around_at_any_gap_are_a_furnace() {
    let folder = tempfile::tempdir().unwrap();
    for (gap, two_sided) in [(1.0, false), (0.1, true), (1e-2, false), (1e-3, true), (1e-4, false)] {
        let found = mean(&cube(folder.path(), &lamps_around(gap, two_sided)), OPTIONS, 32);
        agree(found, (1.0, 0.0), 0.006, &format!("gap {gap}, two-sided {two_sided}"));
    }
}

/// Light scattered once, for which points of the lamps are asked, is that of an even sky, which is met by chance.
#[test]
fn light_scattered_once_beside_lamps_is_that_of_a_sky() {
    let folder = tempfile::tempdir().unwrap();
    let once = VolumePathOptions { orders: Orders::Single, specular: false, ..OPTIONS };
    let sky = mean(&cube(folder.path(), "[environment]\nradiance = 1\n"), once, 128);
    for gap in [0.1, 1e-2, 1e-3, 1e-4] {
        let lamps = mean(&cube(folder.path(), &lamps_around(gap, false)), once, 128);
        agree(lamps, sky, 0.01, &format!("once, gap {gap}"));
    }
}

/// A slab over a panel, seen from above, with photons and without.
#[test]
fn a_panel_under_a_slab_shines_through_as_without_photons() {
    let folder = tempfile::tempdir().unwrap();
    cuboid(folder.path(), [5.0, 0.5, 5.0]);
    for gap in [0.1, 1e-3] {
        let panel = lamp("panel", [0.0, -0.5 - gap, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
        let text = format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 6, 0.01]\nlook_at = [0, 0, 0]\nfov = 40\nresolution = [8, 8]\n\
             [[object]]\nname = \"slab\"\nmesh = \"box.obj\"\nmaterial = \"a\"\n[material.a]\ntype = \"translucent\"\n\
             sigma_s = 5\nsigma_a = 0.01\ng = 0\neta = 1.3\n{panel}[material.lamp]\ntype = \"emissive\"\nradiance = 1\n\
             two_sided = true\n"
        );
        let scene = load(&text, folder.path());
        let [with, without] = [1024, 0].map(|photons| mean(&scene, VolumePathOptions { photons, ..OPTIONS }, 128));
        agree(with, without, 0.01, &format!("gap {gap}"));
    }
}

/// A grey floor under a lamp of the same size at a gap of an eightieth of it, seen from between: the albedo, less what comes in at the
/// rims, at most (gap / distance to the rim)² = 0.06 % of it.
#[test]
fn a_floor_close_under_a_lamp_has_its_albedo() {
    let folder = tempfile::tempdir().unwrap();
    cuboid(folder.path(), [0.01; 3]);
    let floor = lamp("floor", [0.0; 3], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]).replace("\"lamp\"\n", "\"grey\"\n");
    let ceiling = lamp("ceiling", [0.0, 0.1, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0.09, 0]\nlook_at = [0.01, 0, 0]\nfov = 30\nresolution = [8, 8]\n{floor}{ceiling}\
         [material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n[material.lamp]\ntype = \"emissive\"\nradiance = 1\n\
         [[object]]\nname = \"far\"\nmesh = \"box.obj\"\ntransform = {{ translate = [0, 9, 0] }}\nmaterial = \"wax\"\n\
         [material.wax]\ntype = \"translucent\"\nsigma_s = 900\nsigma_a = 0\ng = 0\neta = 1.3\n"
    );
    let found = mean(&load(&text, folder.path()), VolumePathOptions { photons: 0, ..OPTIONS }, 64);
    agree(found, (0.5, 0.0), 0.01, "floor");
}
