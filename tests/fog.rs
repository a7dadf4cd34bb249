//! Lights behind boundaries that do not refract: `volume_path` asks for them over straight lines, and paths that meet them by chance do not
//! count them again. Against closed forms and quadrature; then against the same bodies with an index so near 1 that nothing is refracted, but
//! lines end at them.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod parts;
mod rendering;

use marmor::film::Image;
use marmor::integrator::{VolumePath, VolumePathOptions};
use marmor::math::{DVec3, GaussLegendre, Rgb};
use marmor::optics::HenyeyGreenstein;
use marmor::scene::{Environment, Orders, Scene};
use parts::{camera, cuboid, diffuse, emissive, mesh, rectangle, sphere, translucent};
use rendering::{Within, agree, channels, film, load_in, means_of};
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 256, specular: true, seed: 1 };

/// What `text` says, with these boxes as files.
fn scene(text: &str, boxes: &[(&str, [f64; 3], [f64; 3])]) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    for (name, low, high) in boxes {
        std::fs::write(folder.path().join(name), cuboid(*low, *high)).unwrap();
    }
    load_in(folder.path(), text)
}

/// Mean over the picture of twelve independent renders, and its standard error.
fn mean(scene: &Scene, orders: Orders, passes: u32) -> [(f64, f64); 3] {
    let of = |seed| {
        let options = VolumePathOptions { orders, seed, ..OPTIONS };
        channels(&film(&VolumePath::new(scene, options).unwrap(), scene, passes, seed, &mut []).image())
    };
    means_of(&(1..=12).map(of).collect::<Vec<_>>())
}

fn within(noise: f64) -> Within {
    Within { errors: 6.0, noise }
}

/// The floor about the origin, seen from beside and below what hangs over it; albedo 0.5.
fn over_a_floor(rest: &str) -> String {
    camera([0.0, 0.4, 5.0], [0.0, 0.0, 0.0], 0.05, [2, 2])
        + &rectangle("floor", [0.0; 3], [0.0, 0.0, 9.0], [9.0, 0.0, 0.0], "grey")
        + &diffuse("grey", 0.5)
        + rest
}

/// A lamp at height `h` with half edges `half` over the floor, which looks down.
fn lamp_above(h: f64, half: f64, centre: f64) -> String {
    rectangle("lamp", [centre, h, 0.0], [half, 0.0, 0.0], [0.0, 0.0, half], "lamp") + &emissive("lamp", [3.0, 2.0, 1.0])
}

/// Radiance that the floor at the origin reflects from such a lamp through matter of this depth at right angles, by quadrature.
fn from_above(h: f64, half: f64, centre: f64, depth: f64) -> f64 {
    let rule = GaussLegendre::new(20);
    let along = |x: f64| {
        let at = |z: f64| {
            let r2 = x * x + z * z + h * h;
            let cosine = h / r2.sqrt();
            cosine * cosine / r2 * (-depth / cosine).exp()
        };
        rule.integrate_panels(-half, half, 8, at)
    };
    0.5 * FRAC_1_PI * rule.integrate_panels(centre - half, centre + half, 8, along)
}

/// Behind slabs that only absorb: of small and of large lamps, behind one slab, two, a body in one and a clear one.
#[test]
fn light_behind_what_absorbs_is_what_the_closed_form_says() {
    let slab = |low: f64, high: f64| ([-20.0, low, -20.0], [20.0, high, 20.0]);
    let absorbs = |name: &str, sigma_a: [f64; 3]| {
        translucent(name, &format!("sigma_s = 0\nsigma_a = {sigma_a:?}\ng = 0\neta = 1"))
    };
    let clear = "[material.clear]\ntype = \"dielectric\"\nsigma_a = [0.3, 0.2, 0.1]\neta = 1\n";
    let all = absorbs("a", [0.2, 0.5, 1.0]) + &absorbs("b", [1.0, 0.3, 0.0]) + clear;
    let (one, two, inner) = (slab(1.0, 1.5), slab(1.7, 2.0), slab(1.2, 1.4));
    type Layer = (&'static str, ([f64; 3], [f64; 3]), &'static str);
    let cases: [(&str, Vec<Layer>, [f64; 3]); 5] = [
        ("one", vec![("one.obj", one, "a")], [0.1, 0.25, 0.5]),
        ("clear", vec![("one.obj", one, "clear")], [0.15, 0.1, 0.05]),
        ("two", vec![("one.obj", one, "a"), ("two.obj", two, "b")], [0.4, 0.34, 0.5]),
        ("one in one", vec![("one.obj", one, "a"), ("inner.obj", inner, "b")], [0.26, 0.21, 0.3]),
        ("in contact", vec![("one.obj", one, "clear"), ("two.obj", slab(1.5, 1.9), "a")], [0.23, 0.3, 0.45]),
    ];
    for (h, half, centre) in [(3.0, 0.2, 1.0), (2.3, 4.0, 0.5)] {
        let lamp = lamp_above(h, half, centre);
        for (what, layers, depth) in &cases {
            let bodies: String = layers.iter().map(|(file, _, material)| mesh(file, file, material)).collect();
            let boxes: Vec<_> = layers.iter().map(|(file, (low, high), _)| (*file, *low, *high)).collect();
            let scene = scene(&over_a_floor(&format!("{bodies}{lamp}{all}")), &boxes);
            let found = mean(&scene, Orders::All, 256);
            for c in 0..3 {
                let expected = [3.0, 2.0, 1.0][c] * from_above(h, half, centre, depth[c]);
                agree(found[c], (expected, 0.0), within(0.02), &format!("{what}, lamp of {half}, channel {c}"));
            }
        }
    }
}

/// What is opaque or refracts ends a line, before the fog, in it and behind it.
#[test]
fn what_is_opaque_in_fog_shades() {
    let fog = translucent("fog", "sigma_s = 0\nsigma_a = 0.2\ng = 0\neta = 1");
    for (low, high) in [(0.7, 0.8), (1.2, 1.3), (1.7, 1.8)] {
        let text = over_a_floor(
            &(mesh("fog", "fog.obj", "fog") + &mesh("plate", "plate.obj", "black") + &lamp_above(3.0, 0.5, 0.0)),
        ) + &fog
            + &diffuse("black", 0.0);
        let fog = ("fog.obj", [-9.0, 1.0, -9.0], [9.0, 1.5, 9.0]);
        let scene = scene(&text, &[fog, ("plate.obj", [-4.0, low, -4.0], [4.0, high, 4.0])]);
        let found = mean(&scene, Orders::All, 32);
        assert!(found.iter().all(|(mean, _)| *mean == 0.0), "plate at {low}: {found:?}");
    }
}

/// Under a sun, which is a few pixels of a picture: exp(-d / cos) of what there is without the slab.
#[test]
fn a_sun_behind_fog_lights_the_floor() {
    let (theta, phi) = (37.0 / 128.0 * PI, 23.0 / 256.0 * TAU);
    let lit = |slab: bool| {
        let body = if slab { mesh("fog", "fog.obj", "fog") } else { String::new() };
        let text = over_a_floor(&body) + &translucent("fog", "sigma_s = 0\nsigma_a = [0.4, 1, 2]\ng = 0\neta = 1");
        let mut scene = scene(&text, &[("fog.obj", [-20.0, 1.0, -20.0], [20.0, 1.5, 20.0])]);
        let pixel = |x, y| Rgb::splat(if (22..24).contains(&x) && (36..38).contains(&y) { 1e4 } else { 0.0 });
        let image = Some(Arc::new(Image::from_fn([256, 128], pixel)));
        scene.environment = Environment { radiance: Rgb::WHITE, image, turn: 0.0 };
        mean(&scene, Orders::All, 64)
    };
    let (without, behind) = (lit(false), lit(true));
    let w = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
    for c in 0..3 {
        // Across the sun the cosine differs by a hundredth.
        let share = (-[0.2, 0.5, 1.0][c] / w.y).exp();
        let expected = (without[c].0 * share, without[c].1 * share + 1e-3 * without[c].0 * share);
        agree(behind[c], expected, within(0.02), &format!("channel {c}"));
    }
}

/// Light scattered once in a box of thin fog, along one ray, by quadrature: of a lamp outside, and of one in the fog that the camera is in too.
#[test]
fn thin_fog_scatters_once_what_quadrature_says() {
    let (sigma_s, sigma_a, g) = ([0.1, 0.2, 0.3], [0.02, 0.01, 0.05], 0.5);
    let medium = translucent("fog", &format!("sigma_s = {sigma_s:?}\nsigma_a = {sigma_a:?}\ng = {g}\neta = 1"));
    let (phase, rule) = (HenyeyGreenstein { g }, GaussLegendre::new(12));
    for (what, half, height, eye, size) in [
        ("a lamp outside", [1.0, 1.0, 1.0], 1.6, 5.0, 0.4),
        ("a large lamp at the boundary", [1.0, 1.0, 1.0], 1.05, 5.0, 1.5),
        ("all in fog", [3.0, 3.0, 3.0], 1.6, 2.5, 0.7),
    ] {
        let text = camera([0.0, 0.0, eye], [0.0; 3], 0.1, [1, 1])
            + &mesh("fog", "fog.obj", "fog")
            + &lamp_above(height, size, 0.3)
            + &medium;
        let scene = scene(&text, &[("fog.obj", half.map(|h: f64| -h), half)]);
        let found = mean(&scene, Orders::Single, 4096);
        for c in 0..3 {
            let sigma_t = sigma_s[c] + sigma_a[c];
            // At the place (0, 0, z), from the point (x, height, y) of the lamp.
            let from = |z: f64, x: f64, y: f64| {
                let to = DVec3::new(x, height, y - z);
                let r = to.length();
                // Up to the face that it comes to first.
                let to_face = |way: f64, half: f64, from: f64| (half - from * way.signum()) / way.abs();
                let faces = [to_face(to.x, half[0], 0.0), to_face(to.y, half[1], 0.0), to_face(to.z, half[2], z)];
                let inside = faces.into_iter().fold(1.0, f64::min) * r;
                phase.value(-to.z / r) * (height / r) / (r * r) * (-sigma_t * inside).exp()
            };
            let over = |z: f64| {
                let row = |x: f64| rule.integrate_panels(-size, size, 6, |y| from(z, x, y));
                rule.integrate_panels(0.3 - size, 0.3 + size, 6, row) * (-sigma_t * (eye.min(half[2]) - z)).exp()
            };
            let expected = [3.0, 2.0, 1.0][c] * sigma_s[c] * rule.integrate_panels(-half[2], eye.min(half[2]), 8, over);
            agree(found[c], (expected, 0.0), within(0.02), &format!("{what}, channel {c}"));
        }
    }
}

/// All that fog can be among: beside and in front of milk, on a floor, bodies in it that are stronger and weaker, that stick out of it, opaque
/// ones and lamps in it, glass in it.
fn crowd(eta: f64, rest: &str) -> Scene {
    let fog =
        translucent("fog", &format!("sigma_s = [0.6, 0.9, 1.5]\nsigma_a = [0.1, 0.05, 0.02]\ng = 0.4\neta = {eta}"));
    let haze = translucent("haze", &format!("sigma_s = [2, 1, 0.5]\nsigma_a = [0.1, 0.2, 0.3]\ng = 0\neta = {eta}"));
    let clear = format!("[material.clear]\ntype = \"dielectric\"\nsigma_a = [0.4, 0.8, 1.2]\neta = {eta}\n");
    let milk = translucent("milk", "sigma_s = [2, 4, 7]\nsigma_a = [0.02, 0.05, 0.3]\ng = 0\neta = 1.3");
    let text = camera([0.5, 2.5, 8.0], [0.2, 0.8, 0.0], 26.0, [8, 8])
        + &rectangle("floor", [0.0; 3], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0], "grey")
        + &rectangle("lamp", [0.3, 3.2, -0.4], [2.4, 0.0, 0.0], [0.0, 0.0, 2.0], "lamp")
        + &mesh("block", "fog.obj", "fog")
        + &diffuse("grey", 0.6)
        + &emissive("lamp", [6.0, 5.0, 4.0])
        + &fog
        + &haze
        + &clear
        + &milk
        + rest;
    scene(&text, &[("fog.obj", [-1.1, 0.05, -0.8], [1.0, 1.6, 0.9])])
}

/// The same light as where lines end at boundaries, order by order.
#[test]
fn fog_is_what_an_index_beside_1_gives() {
    let ball = |name: &str, centre, radius, material: &str| sphere(name, centre, radius, 12, material);
    let cases = [
        ("alone", String::new(), 96),
        ("milk behind", ball("milk", [0.3, 0.9, -1.9], 0.8, "milk"), 96),
        (
            "haze in it and out of it",
            ball("in", [-0.2, 0.7, 0.1], 0.4, "haze") + &ball("out", [0.9, 1.4, 0.5], 0.5, "haze"),
            128,
        ),
        ("clear", ball("in", [-0.2, 0.7, 0.1], 0.4, "clear") + &ball("beside", [1.6, 0.5, 0.9], 0.45, "clear"), 128),
        (
            "a stone and glass in it",
            ball("stone", [0.4, 1.0, 0.2], 0.3, "grey") + &ball("glass", [-0.5, 0.6, 0.3], 0.35, "milk"),
            192,
        ),
        ("a lamp in it", ball("small", [0.3, 0.9, 0.0], 0.4, "lamp"), 96),
    ];
    for (what, rest, passes) in cases {
        let [matched, beside] = [1.0, 1.0001].map(|eta| crowd(eta, &rest));
        for orders in [Orders::All, Orders::None, Orders::Single] {
            // Where lines end, light is met by chance, and seldom.
            let [a, b] = [(&matched, 1), (&beside, 6)].map(|(scene, more)| mean(scene, orders, passes * more));
            for c in 0..3 {
                agree(a[c], b[c], within(0.03), &format!("{what}, {orders:?}, channel {c}"));
            }
        }
    }
}

/// Nor is it a function of the number of threads, or of how passes are cut into parts.
#[test]
fn threads_change_no_byte_of_fog() {
    let scene = crowd(1.0, &sphere("in", [-0.2, 0.7, 0.1], 0.4, 12, "haze"));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let method = VolumePath::new(&scene, OPTIONS).unwrap();
        pool.install(|| film(&method, &scene, 3, 1, &mut []).image().pixels)
    };
    assert_eq!(with(1), with(3));
}
