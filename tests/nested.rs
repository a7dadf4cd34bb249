//! Bodies in one another, by `volume_path`, against closed forms, an independent Monte Carlo program, and the same bodies made
//! otherwise.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

#[path = "support/layers.rs"]
mod layers;

use layers::{Layer, reflected};
use marmor::film::{Film, Image, Window};
use marmor::geometry::sphere;
use marmor::integrator::{View, VolumePath, VolumePathOptions, traceable};
use marmor::math::DVec3;
use marmor::optics::reflectance;
use marmor::query::{self, Backend};
use marmor::render::{self, Job};
use marmor::scene::{ObstacleKind, Orders, Scene, SceneFile};
use marmor::tally::Tally;
use std::sync::atomic::AtomicBool;

/// A box between two corners as OBJ text, its corners numbered from `first`.
fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> String {
    let mut text = String::new();
    for i in 0..8 {
        let at = |axis: usize| if i >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
        text += &format!("v {} {} {}\n", at(0), at(1), at(2));
    }
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

/// A layer between two heights, far wider than deep.
fn layer(low: f64, high: f64) -> String {
    cuboid([-50.0, -50.0, low], [50.0, 50.0, high])
}

/// An object as OBJ text, its material, more keys.
type Thing<'a> = (String, &'a str, &'a str);

/// A scene of `things`; `head` has camera and light, `media` the materials.
fn scene(head: &str, things: &[Thing<'_>], media: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let mut text = format!("unit = \"mm\"\n{head}\n");
    for (i, (mesh, material, more)) in things.iter().enumerate() {
        std::fs::write(folder.path().join(format!("{i}.obj")), mesh).unwrap();
        text += &format!("[[object]]\nname = \"thing {i}\"\nmesh = \"{i}.obj\"\nmaterial = \"{material}\"\n{more}\n");
    }
    text += media;
    Scene::load(&SceneFile::parse(&text, &folder.path().join("scene.toml")).unwrap()).unwrap()
}

const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 500, specular: true, seed: 1 };

fn render(scene: &Scene, options: VolumePathOptions, passes: u32) -> (Image, Tally) {
    assert_eq!(traceable(scene), []);
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let method = VolumePath::new(scene, options).unwrap();
    let resolution = scene.camera.resolution;
    let mut film = Film::new(resolution, Window::full(resolution)).unwrap();
    let cancel = AtomicBool::new(false);
    let job = Job { seed: options.seed, passes: Some(passes), time: None, cancel: &cancel };
    let outcome = render::run(&method, View { scene, rays: &*rays }, &job, &mut film, &mut []).unwrap();
    assert_eq!(film.counts().non_finite, 0);
    let walk = &outcome.tally.walk;
    assert!(walk.losses.total() as f64 <= 2e-4 * walk.walks as f64, "{walk:?}");
    (film.image(), outcome.tally)
}

/// Mean over the picture and its standard error, from ten renders.
fn mean(scene: &Scene, passes: u32) -> (f64, f64) {
    let of = |seed| {
        let image = render(scene, VolumePathOptions { seed, ..OPTIONS }, passes).0;
        image.pixels.iter().map(|p| f64::from(p.mean())).sum::<f64>() / image.pixels.len() as f64
    };
    let values: Vec<f64> = (1..=10).map(of).collect();
    let mean = values.iter().sum::<f64>() / 10.0;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 90.0).sqrt())
}

/// A standard error from ten values is known to some 25 %: 8 of them stand for 6 of a known one.
fn same(a: (f64, f64), b: (f64, f64), what: &str) {
    let error = a.1.hypot(b.1);
    println!("{what}: {} +- {} against {} +- {}", a.0, a.1, b.0, b.1);
    assert!(error < 0.02 * b.0.abs(), "{what}: too noisy to say anything: {a:?} {b:?}");
    assert!((a.0 - b.0).abs() < 8.0 * error + 1e-5 * b.0.abs(), "{what}: {a:?} against {b:?}");
}

/// Looks at the origin from `at`, through a cone of a thousandth of a degree.
fn eye(at: [f64; 3]) -> String {
    format!("[camera]\nposition = {at:?}\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 1e-3\nresolution = [4, 4]")
}

const WHITE: &str = "[environment]\nradiance = 1\n";
const MEDIA: &str = "[material.glass]\ntype = \"dielectric\"\neta = 1.5\n[material.air]\ntype = \"dielectric\"\neta = 1\n\
                     [material.milk]\ntype = \"translucent\"\nsigma_s = 4\nsigma_a = 0\ng = 0.5\neta = 1.33\n\
                     [material.wax]\ntype = \"translucent\"\nsigma_s = 2\nsigma_a = 0\ng = 0\neta = 1.4\n";

fn ball(centre: [f64; 3], radius: f64) -> String {
    shell(centre, radius, false, 0)
}

/// A sphere as OBJ text, its faces turned inwards or not; `before` corners are there already.
fn shell(centre: [f64; 3], radius: f64, inwards: bool, before: u32) -> String {
    let mesh = sphere(DVec3::from_array(centre), radius, 16, 32);
    let mut text: String = mesh.positions.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| i + 1 + before);
        text += &if inwards { format!("f {c} {b} {a}\n") } else { format!("f {a} {b} {c}\n") };
    }
    text
}

/// Whatever goes in comes out: each sample of bodies that do not absorb is 1 in a white furnace, and hardly a path is lost.
#[test]
fn bodies_in_one_another_vanish_in_a_white_furnace() {
    let head = "[camera]\nposition = [0.4, 1.5, 9]\nlook_at = [0, 0, 0]\nfov = 16\nresolution = [8, 8]\n[environment]\nradiance = 1";
    let cup = |inner: &str| cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]) + inner;
    let milk = |half: f64| cuboid([-half, -half, -half], [half, half, half]);
    let hollow: String = {
        // The box again, smaller, its faces turned inwards.
        let inner = cuboid([-0.7; 3], [0.7; 3]);
        let turn = |line: &str| match line.strip_prefix("f ") {
            Some(face) => {
                let corners: Vec<u32> = face.split(' ').rev().map(|k| k.parse::<u32>().unwrap() + 8).collect();
                format!("f {} {} {} {}\n", corners[0], corners[1], corners[2], corners[3])
            }
            None => format!("{line}\n"),
        };
        inner.lines().map(turn).collect()
    };
    let bubbles = [[0.3, 0.2, 0.1], [-0.4, 0.1, 0.3], [0.0, -0.4, -0.2]].map(|c| (ball(c, 0.25), "air", ""));
    let cases: Vec<(&str, Vec<Thing<'_>>)> = vec![
        ("milk in a cup, gap", vec![(cup(&hollow), "glass", ""), (milk(0.69), "milk", "")]),
        ("milk in a cup, overlap of a hair", vec![(cup(&hollow), "glass", ""), (milk(0.7001), "milk", "")]),
        ("milk in a cup, contact", vec![(cup(&hollow), "glass", ""), (milk(0.7), "milk", "")]),
        ("milk in solid glass", vec![(cup(""), "glass", ""), (milk(0.7), "milk", "")]),
        (
            "as deep as the glass",
            vec![(cup(""), "glass", ""), (cuboid([-0.5, -0.6, -1.0], [0.5, 0.6, 1.0]), "milk", "")],
        ),
        ("bubbles in wax", [vec![(ball([0.0; 3], 1.0), "wax", "")], bubbles.to_vec()].concat()),
        ("glass in glass", vec![(ball([0.0; 3], 1.0), "glass", ""), (ball([0.2, 0.1, 0.0], 0.5), "glass", "")]),
        ("one ball twice", vec![(ball([0.0; 3], 1.0), "milk", ""), (ball([0.0; 3], 1.0), "glass", "")]),
        ("a ball that pokes out", vec![(ball([0.0; 3], 1.0), "milk", ""), (ball([0.8, 0.1, 0.0], 0.5), "glass", "")]),
        ("an air ball that pokes out", vec![(ball([0.0; 3], 1.0), "wax", ""), (ball([0.8, 0.1, 0.0], 0.5), "air", "")]),
        ("a ball of parts", vec![(ball([0.0; 3], 1.0) + &shell([0.8, 0.1, 0.0], 0.5, false, 482), "milk", "")]),
    ];
    for (what, things) in cases {
        let scene = scene(head, &things, MEDIA);
        let (image, tally) = render(&scene, OPTIONS, 64);
        let off = image.pixels.iter().map(|p| (p.mean() - 1.0).abs()).fold(0.0, f32::max);
        println!("{what}: {off:e}, {} of {} lost", tally.walk.losses.total(), tally.walk.walks);
        assert!(tally.walk.walks > 1000, "{what}: {:?}", tally.walk);
        let lost = tally.walk.losses.total() as f32 / 64.0;
        assert!(off < 1e-5 + 2.0 * lost, "{what}: {off}");
    }
}

/// Clear media in layers from above, each an index, an absorption and a thickness; what light at `sine` in air does.
fn clear(layers: &[[f64; 3]], sine: f64) -> [f64; 2] {
    // Reflected and transmitted of the interfaces so far, from above and from below: without coherence.
    let cosine = |eta: f64| (1.0 - (sine / eta).powi(2)).sqrt();
    let (mut r, mut t, mut back, mut above) = (0.0, 1.0, 0.0, 1.0);
    for &[eta, sigma, depth] in layers.iter().chain(&[[1.0, 0.0, 0.0]]) {
        let f = f64::from(reflectance((eta / above) as f32, cosine(above) as f32));
        let round = 1.0 - back * f;
        (r, back) = (r + t * t * f / round, f + (1.0 - f).powi(2) * back / round);
        t *= (1.0 - f) / round;
        let passed = (-sigma * depth / cosine(eta)).exp();
        (t, back, above) = (t * passed, back * passed * passed, eta);
    }
    [r, t]
}

const SHEET: &str = "[[object]]\nname = \"below\"\nshape = \"rectangle\"\ncentre = [0, 0, -9]\nedge_u = [40, 0, 0]\n\
                     edge_v = [0, 40, 0]\nmaterial = \"lamp\"\n[material.lamp]\ntype = \"emissive\"\nradiance = 1\n";
const SLABS: &str = "[material.water]\ntype = \"dielectric\"\neta = 1.33\nsigma_a = 0.3\n\
                     [material.flint]\ntype = \"dielectric\"\neta = 1.8\nsigma_a = 0.1\n";

/// Light through two absorbing slabs in all ways that they can lie: Fresnel's factors of the media that are really beside
/// each interface, exp(-d) of what is really there, reflections to and fro.
#[test]
fn two_absorbing_slabs_let_through_what_the_closed_form_says() {
    let (water, flint, air) = ([1.33, 0.3], [1.8, 0.1], [1.0, 0.0]);
    let of = |[eta, sigma]: [f64; 2], depth: f64| [eta, sigma, depth];
    let (first, second) = ("priority = 1", "priority = -3");
    type Case<'a> = (&'a str, [(f64, f64); 2], [&'a str; 2], Vec<[f64; 3]>);
    let cases: Vec<Case<'_>> = vec![
        ("gap", [(0.1, 1.0), (-1.0, 0.0)], ["", ""], vec![of(water, 0.9), of(air, 0.1), of(flint, 1.0)]),
        ("contact", [(0.0, 1.0), (-1.0, 0.0)], ["", ""], vec![of(water, 1.0), of(flint, 1.0)]),
        ("overlap, the smaller is there", [(0.0, 1.0), (-1.0, 0.5)], ["", ""], vec![of(water, 1.0), of(flint, 1.0)]),
        ("overlap, water first", [(0.0, 1.0), (-1.0, 0.5)], [first, ""], vec![of(water, 1.0), of(flint, 1.0)]),
        ("overlap, flint first", [(0.0, 1.0), (-1.0, 0.5)], [second, ""], vec![of(water, 0.5), of(flint, 1.5)]),
        ("flint inside", [(-1.0, 1.0), (-0.5, 0.5)], ["", ""], vec![of(water, 0.5), of(flint, 1.0), of(water, 0.5)]),
        ("water inside", [(-0.5, 0.5), (-1.0, 1.0)], ["", ""], vec![of(flint, 0.5), of(water, 1.0), of(flint, 0.5)]),
        ("water inside and weaker", [(-0.5, 0.5), (-1.0, 1.0)], [second, ""], vec![of(flint, 2.0)]),
        ("flint in its upper half", [(-1.0, 1.0), (0.0, 1.0)], ["", ""], vec![of(flint, 1.0), of(water, 1.0)]),
        ("in one place", [(-1.0, 1.0), (-1.0, 1.0)], ["", ""], vec![of(flint, 2.0)]),
    ];
    for (what, [a, b], [more, other], layers) in cases {
        let things = [(layer(a.0, a.1), "water", more), (layer(b.0, b.1), "flint", other)];
        for (at, sine) in [([0.0, 0.0, 9.0], 0.0), ([8.0, 0.0, 6.0], 0.8)] {
            // The camera's line meets the lamp, which is as wide.
            let scene = scene(&eye(at), &things, &format!("{SLABS}{SHEET}"));
            let [_, through] = clear(&layers, sine);
            same(mean(&scene, 256), (through, 0.0), &format!("{what}, sine {sine}"));
        }
    }
}

/// A camera and a lamp inside what is inside: radiance over the square of the index where the camera is, which Fresnel's
/// factors alone change.
#[test]
fn a_camera_and_a_lamp_inside_inner_bodies() {
    let slabs = || vec![(layer(-1.0, 1.0), "water", ""), (layer(-0.5, 0.5), "flint", "")];
    let halves = [[1.8, 0.1, 0.5], [1.33, 0.3, 0.5]];
    let lamp = SHEET.replace("-9]", "0]").replace("radiance = 1", "radiance = 1\ntwo_sided = true");
    // Two interfaces on the way out: from flint to water, from water to air.
    let f = |eta: f64| f64::from(reflectance(eta as f32, 1.0));
    let (inner, outer) = (f(1.8 / 1.33), f(1.33));
    let passed = halves.map(|[_, sigma, depth]: [f64; 3]| (-sigma * depth).exp());
    let forth = passed[0] * (1.0 - inner) * passed[1] * (1.0 - outer) / (1.0 - passed[1].powi(2) * inner * outer);
    let seen = scene(&eye([0.0, 0.0, 9.0]), &slabs(), &format!("{SLABS}{lamp}"));
    same(mean(&seen, 256), (forth / (1.8 * 1.8), 0.0), "a lamp in flint in water");
    // From the lamp's place up to a lamp that fills the sky there; what is mirrored back meets a black floor in flint.
    let head =
        "[camera]\nposition = [0, 0, 0.001]\nlook_at = [0, 0, 1]\nup = [0, 1, 0]\nfov = 1e-3\nresolution = [4, 4]";
    let floor = "[[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [40, 0, 0]\nedge_v = [0, 40, 0]\n\
                 material = \"black\"\n[material.black]\ntype = \"diffuse\"\nalbedo = 0\n";
    let inside = scene(head, &slabs(), &format!("{SLABS}{floor}{WHITE}"));
    assert_eq!(inside.camera_in(), [(0, 1), (1, 1)]);
    let [.., depth] = halves[0];
    let first = (-0.1_f64 * (depth - 0.001)).exp() / passed[0];
    same(mean(&inside, 256), (forth * first, 0.0), "a camera in flint in water");
}

const LAYERED: &str = "[material.a]\ntype = \"translucent\"\nsigma_s = 1.6\nsigma_a = 0.4\ng = 0.3\neta = 1.3\n\
                       [material.b]\ntype = \"translucent\"\nsigma_s = 3\nsigma_a = 0.1\ng = 0\neta = 1.6\n\
                       [material.black]\ntype = \"diffuse\"\nalbedo = 0\n[[object]]\nname = \"floor\"\nshape = \"rectangle\"\n\
                       centre = [0, 0, -9]\nedge_u = [900, 0, 0]\nedge_v = [0, 900, 0]\nmaterial = \"black\"\n";

/// Two scattering layers reflect what a Monte Carlo program of plane layers says that shares nothing with ours; two of one
/// medium what a single one does.
#[test]
fn scattering_layers_reflect_what_they_should() {
    let head = format!("{}\n{WHITE}", eye([0.0, 0.0, 9.0]));
    let (a, b) = ([1.6, 0.4, 0.3, 1.3], [3.0, 0.1, 0.0, 1.6]);
    let of = |[sigma_s, sigma_a, g, eta]: [f64; 4], depth| Layer { sigma_s, sigma_a, g, eta, depth };
    let one = [of(a, 1.0)];
    let cases = [
        ("one layer", vec![(layer(0.0, 1.0), "a", "")], one.to_vec()),
        ("contact", vec![(layer(0.0, 1.0), "a", ""), (layer(-2.0, 0.0), "b", "")], vec![of(a, 1.0), of(b, 2.0)]),
        ("overlap", vec![(layer(0.0, 1.0), "a", ""), (layer(-2.0, 0.2), "b", "")], vec![of(a, 1.0), of(b, 2.0)]),
        (
            "inside",
            vec![(layer(-1.0, 1.0), "a", ""), (layer(-0.4, 0.6), "b", "")],
            vec![of(a, 0.4), of(b, 1.0), of(a, 0.6)],
        ),
        ("halves that touch", vec![(layer(0.4, 1.0), "a", ""), (layer(0.0, 0.4), "a", "")], one.to_vec()),
        ("halves that overlap", vec![(layer(0.3, 1.0), "a", ""), (layer(0.0, 0.5), "a", "")], one.to_vec()),
    ];
    for (what, things, layers) in cases {
        let scene = scene(&head, &things, LAYERED);
        same(mean(&scene, 512), reflected(&layers, 400_000), what);
    }
}

const LAMPS: &str = "[[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0.5, 4, 3]\nedge_u = [1.5, 0, 0]\n\
                     edge_v = [0, 0.9, -1.2]\nmaterial = \"lamp\"\n[material.lamp]\ntype = \"emissive\"\nradiance = 20\n\
                     two_sided = true\n";

/// Under a lamp, which collisions ask for where there is one body around them alone: a bubble is a cavity of the mesh, two halves
/// that touch are one block.
#[test]
fn lamps_are_asked_for_neither_twice_nor_never() {
    let head = "[camera]\nposition = [0.4, 1.5, 9]\nlook_at = [0, 0, 0]\nfov = 11\nresolution = [8, 8]";
    let media = MEDIA.replace("sigma_s = 2\nsigma_a = 0", "sigma_s = 2\nsigma_a = 0.1");
    let media = format!("{media}{LAMPS}");
    let bubble = vec![(ball([0.0; 3], 1.0), "wax", ""), (ball([0.2, 0.2, 0.3], 0.4), "air", "")];
    let cavity = vec![(ball([0.0; 3], 1.0) + &shell([0.2, 0.2, 0.3], 0.4, true, 482), "wax", "")];
    let half = |from, to| (cuboid([from, -1.0, -1.0], [to, 1.0, 1.0]), "wax", "");
    for (what, nested, alone) in [
        ("a bubble", bubble, cavity),
        ("halves that touch", vec![half(-1.0, 0.1), half(0.1, 1.0)], vec![half(-1.0, 1.0)]),
        ("halves that overlap", vec![half(-1.0, 0.3), half(-0.2, 1.0)], vec![half(-1.0, 1.0)]),
        // The lamp is in the air around the ball, which is a body.
        (
            "a lamp in the outer body",
            vec![(cuboid([-7.0; 3], [7.0; 3]), "air", ""), (ball([0.0; 3], 1.0), "wax", "")],
            vec![(ball([0.0; 3], 1.0), "wax", "")],
        ),
        ("a block twice", vec![half(-1.0, 1.0), half(-1.0, 1.0)], vec![half(-1.0, 1.0)]),
    ] {
        let [nested, alone] = [nested, alone].map(|things| mean(&scene(head, &things, &media), 256));
        same(nested, alone, what);
    }
}

/// A stronger body hides what is inside it: that is said before the render.
#[test]
fn a_body_inside_a_stronger_one_is_named() {
    let things = [(ball([0.0; 3], 1.0), "glass", "priority = 2"), (ball([0.1; 3], 0.3), "milk", "priority = 1")];
    let head = format!("{}\n{WHITE}[method]\nname = \"volume_path\"", eye([0.0, 0.0, 9.0]));
    let scene = scene(&head, &things, MEDIA);
    assert!(scene.obstacles().iter().any(|o| o.kind == ObstacleKind::Hidden));
    let said = scene.warnings.join("\n");
    for word in ["\"thing 1\" lies inside \"thing 0\"", "nothing of it is seen", "a priority above 2"] {
        assert!(said.contains(word), "`{word}` in {said}");
    }
}

/// What does not show clear bodies says so; a scene of clear bodies alone is traced unless another method is asked for.
#[test]
fn methods_without_clear_bodies_say_so() {
    for (method, told) in [
        ("", false),
        ("volume_path", false),
        ("path", false),
        ("subsurface", false),
        ("direct", true),
        ("ambient_occlusion", false),
    ] {
        let asked = if method.is_empty() { String::new() } else { format!("[method]\nname = \"{method}\"") };
        let head = format!("{}\n{WHITE}{asked}", eye([0.0, 0.0, 9.0]));
        let scene = scene(&head, &[(ball([0.0; 3], 1.0), "glass", "")], MEDIA);
        let said = scene
            .warnings
            .iter()
            .any(|w| w.contains("\"glass\"") && w.contains("take --method path, or --method volume_path"));
        assert_eq!(said, told, "{method}: {:?}", scene.warnings);
        assert_eq!(scene.default_method().name(), "volume_path");
    }
}
