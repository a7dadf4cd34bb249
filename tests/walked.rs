//! `shape = "walked"`: paths through the bodies themselves say how much leaves where. Closed forms, and `volume_path`, where a model alone is
//! wrong by tens of percent.
#![allow(clippy::unwrap_used)] // a scene of a test that does not load has failed

mod parts;
mod rendering;

use marmor::film::Image;
use marmor::integrator::{Integrator, Subsurface, SubsurfaceOptions, VolumePath, VolumePathOptions};
use marmor::scene::{Scene, SceneFile, Shape};
use parts::{camera, centred, diffuse, emissive, mesh, rectangle, sky, sphere, translucent};
use rendering::{Within, agree, channels, film, load, load_beside, means_of, run};
use std::f64::consts::{PI, TAU};
use std::path::Path;

fn walked(seed: u64) -> SubsurfaceOptions {
    SubsurfaceOptions { cache_samples: 32768, shape: Shape::Walked, seed, ..SubsurfaceOptions::default() }
}

fn picture(scene: &Scene, options: SubsurfaceOptions, passes: u32) -> Image {
    film(&Subsurface::new(scene, options).unwrap(), scene, passes, options.seed, &mut []).image()
}

/// Means over the picture, from independent renders.
fn means(runs: u64, of: impl Fn(u64) -> Image) -> [(f64, f64); 3] {
    means_of(&(1..=runs).map(|seed| channels(&of(seed))).collect::<Vec<_>>())
}

fn truth(scene: &Scene, runs: u64, passes: u32) -> [(f64, f64); 3] {
    let of = |seed| {
        let method =
            VolumePath::new(scene, VolumePathOptions { photons: 1 << 10, specular: false, seed, ..Default::default() })
                .unwrap();
        film(&method, scene, passes, seed, &mut []).image()
    };
    means(runs, |seed| of(100 + seed))
}

/// Two balls that touch nearly, of the materials `large` and `small`, above a white floor under a white sky.
fn under_a_white_sky(large: &str, small: &str, media: &str) -> Scene {
    let text = camera([0.0, 3.0, 12.0], [0.5, -0.2, 0.0], 14.0, [16, 12])
        + &sphere("large", [0.0; 3], 1.0, 24, large)
        + &sphere("small", [1.6, -0.35, 0.4], 0.6, 24, small)
        + &rectangle("floor", [0.0, -1.02, 0.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0], "floor")
        + media
        + &diffuse("floor", 1.0)
        + &sky(1.0);
    load(&text)
}

/// That nothing is lost there or counted twice: light from sky, floor, body and body again, mirrored and not.
fn is_white(scene: &Scene, shape: Shape, what: &str) {
    let with = |seed| SubsurfaceOptions { cache_samples: 65536, shape, ..walked(seed) };
    for c in means(5, |seed| picture(scene, with(seed), 6)) {
        agree(c, (1.0, 0.0), Within { errors: 5.0, noise: 0.012 }, what);
    }
}

#[test]
fn white_bodies_over_a_white_floor_are_white() {
    let milk = translucent("milk", "sigma_s = [4, 8, 16]\nsigma_a = [0, 0, 0]\ng = 0\neta = 1.3");
    is_white(&under_a_white_sky("milk", "milk", &milk), Shape::Walked, "white");
}

/// One body that is walked through and one by its model alone, which is asked for by name.
#[test]
fn walked_bodies_and_others_are_white_together() {
    let medium = "sigma_s = [40, 80, 160]\nsigma_a = [0, 0, 0]\ng = 0\neta = 1.3\nmodel = ";
    let of = |name: &str, model: &str| translucent(name, &format!("{medium}{model:?}"));
    let scene = under_a_white_sky("walked", "named", &(of("walked", "auto") + &of("named", "standard")));
    let method = Subsurface::new(&scene, SubsurfaceOptions { shape: Shape::Auto, ..walked(1) }).unwrap();
    assert_eq!([0, 1, 2].map(|o| method.walks(o)), [true, false, false]);
    is_white(&scene, Shape::Auto, "white together");
}

/// A ball lit from behind, where models are dark by 20 to 40 %, and a thin sheet seen from either side, where they are too bright by half: the
/// mean of the picture is that of paths, within 2 % and the noise. In a medium of little and of much absorption, and of none in one channel.
#[test]
fn it_is_the_truth_where_models_are_not() {
    let lamp = |z: f64| {
        rectangle("lamp", [2.0, 4.0, z], [1.5, 0.0, 0.0], [0.0, -z.signum(), 1.0], "glow") + &emissive("glow", 10.0)
    };
    let eye = camera([0.0, 0.0, 8.0], [0.0; 3], 13.0, [12, 12]);
    let medium = |s: [f64; 3], a: [f64; 3], g: f64| {
        translucent("m", &format!("sigma_s_prime = {s:?}\nsigma_a = {a:?}\ng = {g}\neta = 1.3"))
    };
    let ball = sphere("body", [0.0; 3], 1.0, 24, "m");
    let sheet = mesh("body", "sheet.obj", "m");
    let much = medium([0.6, 2.0, 5.0], [1.4, 0.2, 0.05], 0.0);
    let cases = [
        ("ball, lamp behind", ball.clone() + &lamp(-4.0) + &medium([7.0, 9.0, 12.0], [0.01, 0.05, 0.1], 0.0), 0.1),
        ("ball of little and of much absorption", ball + &lamp(4.0) + &much, 0.0),
        ("sheet, lamp behind", sheet.clone() + &lamp(-4.0) + &medium([5.0, 7.0, 10.0], [0.01, 0.05, 0.1], 0.0), 0.1),
        ("sheet, lamp in front", sheet + &lamp(4.0) + &medium([5.0, 7.0, 0.0], [0.01, 0.05, 0.1], 0.0), 0.0),
    ];
    for (name, bodies, wrong) in cases {
        let scene = load_beside("sheet.obj", &centred([1.0, 1.0, 0.15]), &(eye.clone() + &bodies));
        let right = truth(&scene, 6, 64);
        let with = |shape, seed| SubsurfaceOptions { shape, specular: false, ..walked(seed) };
        let ours = means(6, |seed| picture(&scene, with(Shape::Walked, seed), 16));
        for (ours, right) in ours.into_iter().zip(right) {
            // A channel in which nothing scatters.
            if right.0 == 0.0 {
                assert!(ours.0 == 0.0, "{name}: {ours:?}");
                continue;
            }
            // What coarse patches may leave of a model.
            let allowed = (right.0, (0.02 * right.0 / 6.0).hypot(right.1));
            agree(ours, allowed, Within { errors: 5.0, noise: 0.03 }, name);
        }
        let model = means(2, |seed| picture(&scene, with(Shape::HalfSpace, seed), 8));
        let off = (model[0].0 / right[0].0 - 1.0).abs();
        println!("{name}: the model alone is off by {off:.3}");
        assert!(off >= wrong, "{name}: {off}");
    }
}

/// Same bits for any number of threads, and for any split into ranges of passes.
#[test]
fn threads_and_ranges_change_no_bit() {
    let text = camera([0.0, 3.0, 12.0], [0.0; 3], 12.0, [16, 12])
        + &sphere("a", [-1.1, 0.0, 0.0], 1.0, 16, "milk")
        + &sphere("b", [1.1, 0.0, 0.0], 1.0, 16, "milk")
        + &rectangle("lamp", [0.0, 4.0, -3.0], [1.0, 0.0, 0.0], [0.0, 0.5, 1.0], "glow")
        + &emissive("glow", 5.0)
        + &translucent("milk", "sigma_s = [5, 8, 12]\nsigma_a = [0.01, 0.1, 0.5]\ng = 0\neta = 1.3");
    // One of them by its model, beside one that is walked through.
    let text = text
        + &sphere("c", [0.0, 2.2, 0.0], 0.8, 16, "named")
        + &translucent("named", "preset = \"marble\"\nmodel = \"beam\"");
    let text = text.replace("eta = 1.3", "eta = 1.3\nmodel = \"auto\"").replace("model = \"standard\"\n", "");
    let scene = load(&text);
    let rays = marmor::query::build(marmor::query::Backend::preferred(), &scene.meshes()).unwrap();
    let view = marmor::integrator::View { scene: &scene, rays: &*rays };
    let passes = |threads: usize, ends: &[u32]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let part = |ends: &[u32]| {
                let method = Subsurface::new(&scene, SubsurfaceOptions { shape: Shape::Auto, ..walked(3) }).unwrap();
                assert_eq!([0, 1, 2, 3].map(|o| method.walks(o)), [true, true, false, false]);
                run(&method, view, 3, ends[0]..ends[1], &mut []).0
            };
            let mut films = ends.windows(2).map(part);
            let first = films.next().unwrap();
            films.fold(first, |mut all, film| {
                all.join(&film).unwrap();
                all
            })
        })
        .image()
        .pixels
    };
    let one = passes(1, &[0, 5]);
    assert!(one.iter().any(|p| p.max() > 0.0));
    assert!(one == passes(3, &[0, 5]), "threads");
    assert!(one == passes(2, &[0, 1, 3, 5]), "ranges");
}

/// No blotches: what two pictures of a ball lit from behind differ by, relative to them, octave by octave of wavelength. Eyes see some percent of
/// octaves of 8 pixels and more; patches would leave them there.
#[test]
fn noise_has_no_blotches() {
    let lamp = rectangle("lamp", [2.0, 4.0, -4.0], [1.5, 0.0, 0.0], [0.0, 1.0, 1.0], "glow") + &emissive("glow", 10.0);
    let milk = translucent("m", "sigma_s_prime = [7, 12, 19]\nsigma_a = [0.014, 0.025, 0.142]\neta = 1.3");
    let n = 64;
    let text =
        camera([0.0, 0.0, 8.0], [0.0; 3], 9.0, [n as u32; 2]) + &sphere("ball", [0.0; 3], 1.0, 48, "m") + &lamp + &milk;
    let scene = load(&text);
    let with = |seed| SubsurfaceOptions { specular: false, cache_samples: 131_072, ..walked(seed) };
    let pictures = [1, 2].map(|seed| picture(&scene, with(seed), 16).pixels);
    for c in [0, 1, 2] {
        let pair = |i: usize| [f64::from(pictures[0][i][c]), f64::from(pictures[1][i][c])];
        let mut level: Vec<f64> =
            (0..n * n).map(|i| 2.0_f64.sqrt() * (pair(i)[0] - pair(i)[1]) / (pair(i)[0] + pair(i)[1])).collect();
        let (mut size, mut octaves) = (n, Vec::new());
        while size > 4 {
            let half = size / 2;
            let corner = |i: usize| (i / half * 2) * size + i % half * 2;
            let four = |at: usize| [level[at], level[at + 1], level[at + size], level[at + size + 1]];
            let means: Vec<f64> = (0..half * half).map(|i| four(corner(i)).iter().sum::<f64>() / 4.0).collect();
            let within =
                |(i, mean): (usize, &f64)| four(corner(i)).iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4.0;
            let power = means.iter().enumerate().map(within).sum::<f64>() / means.len() as f64;
            octaves.push(power.sqrt());
            (level, size) = (means, half);
        }
        println!("channel {c}: octaves of 2, 4, 8, 16 pixels {octaves:.4?}");
        assert!(octaves[2] < 0.07 && octaves[3] < 0.05, "channel {c}: {octaves:?}");
    }
}

/// A ball without one of its triangles, out of which no walk would come back.
fn ball_with_a_hole() -> String {
    let (rings, segments) = (16, 32);
    let mut text = String::new();
    for i in 0..=rings {
        for j in 0..segments {
            let (a, b) = (PI * f64::from(i) / f64::from(rings), TAU * f64::from(j) / f64::from(segments));
            text += &format!("v {:.9} {:.9} {:.9}\n", a.sin() * b.cos(), a.cos(), a.sin() * b.sin());
        }
    }
    let at = |i: i32, j: i32| i * segments + j % segments + 1;
    for i in 0..rings {
        for j in (0..segments).filter(|j| (i, *j) != (8, 3)) {
            text += &format!("f {} {} {} {}\n", at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
        }
    }
    text
}

/// What it cannot walk through is refused by name; with `bounces = 0` there is nothing to walk.
#[test]
fn what_has_no_inside_is_refused() {
    let ball = camera([0.0, 0.0, 8.0], [0.0; 3], 20.0, [4, 4])
        + &translucent("m", "sigma_s = [1, 1, 1]\nsigma_a = [0, 0, 0]\ng = 0\neta = 1.3")
        + &sky(1.0);
    let refused = |text: &str, options, words: &[&str]| {
        let scene = load_beside("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", text);
        let told = Subsurface::new(&scene, options).err().unwrap().to_string();
        for word in words {
            assert!(told.contains(word), "`{word}` in {told}");
        }
    };
    let open = ball.clone() + &mesh("leaf", "open.obj", "m");
    refused(&open, walked(1), &["leaf", "shape = \"walked\""]);
    let scene = load_beside("holed.obj", &ball_with_a_hole(), &(ball.clone() + &mesh("sieve", "holed.obj", "m")));
    let told = Subsurface::new(&scene, walked(1)).err().unwrap().to_string();
    assert!(told.contains("\"sieve\" has holes") && told.contains("shape = \"walked\""), "{told}");
    let closed = ball.clone() + &sphere("body", [0.0; 3], 1.0, 16, "m");
    refused(&closed, SubsurfaceOptions { bounces: 0, ..walked(1) }, &["bounces = 0", "shape = \"walked\""]);
    let other = "[material.oil]\ntype = \"translucent\"\nsigma_s = [2, 2, 2]\nsigma_a = [0, 0, 0]\ng = 0\neta = 1.3\n";
    let inside = closed + &sphere("core", [0.0; 3], 0.5, 16, "oil") + other;
    refused(&inside, walked(1), &["body", "core", "volume_path"]);
}

/// The key of the scene file and its misspelling.
#[test]
fn the_key_is_read() {
    let text =
        camera([0.0, 0.0, 8.0], [0.0; 3], 20.0, [4, 4]) + &sphere("o", [0.0; 3], 1.0, 8, "d") + &diffuse("d", 0.5);
    let parse = |value: &str| SceneFile::parse(&format!("{text}[method]\nshape = \"{value}\"\n"), Path::new("a.toml"));
    assert_eq!(parse("walked").unwrap().method.shape, Some(Shape::Walked));
    let told = parse("walkd").err().unwrap().to_string();
    assert!(told.contains("did you mean `walked`"), "{told}");
}

/// Parts of the method say so.
#[test]
fn it_says_what_it_built() {
    let text = camera([0.0, 0.0, 8.0], [0.0; 3], 20.0, [4, 4])
        + &sphere("body", [0.0; 3], 1.0, 16, "m")
        + &translucent("m", "sigma_s = [1, 1, 1]\nsigma_a = [0, 0, 0]\ng = 0\neta = 1.3")
        + &sky(1.0);
    let scene = load(&text);
    let parts = Subsurface::new(&scene, walked(1)).unwrap().parts(&scene);
    assert!(parts.iter().any(|part| part.built && part.why.contains("patches")), "{parts:?}");
    let plain = SubsurfaceOptions { shape: Shape::HalfSpace, ..walked(1) };
    let parts = Subsurface::new(&scene, plain).unwrap().parts(&scene);
    assert!(!parts.iter().any(|part| part.built && part.why.contains("patches")), "{parts:?}");
}
