//! Pigment on the boundaries of bodies, by every method: light passes it on its way in and on its way out, and nowhere else.
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

mod parts;
mod rendering;

use marmor::film::{Image, Metadata, save};
use marmor::integrator::{Direct, SubsurfaceOptions, VolumePath, VolumePathOptions};
use marmor::math::Rgb;
use marmor::scene::{Estimator, Scene, SceneFile, Shape};
use parts::{camera, emissive, rectangle, sky, sphere, translucent};
use rendering::{Within, agree, average, channels, film, load, load_in, means_of, options, subsurface};

/// The picture by `volume_path`, or by `subsurface` of a shape with so many samples a pass.
fn picture(scene: &Scene, shape: Option<(Shape, u32)>, bounces: u32, passes: u32, seed: u64) -> Image {
    match shape {
        None => {
            let method =
                VolumePath::new(scene, VolumePathOptions { seed, photons: 2000, ..Default::default() }).unwrap();
            film(&method, scene, passes, seed, &mut []).image()
        }
        Some((shape, samples)) => {
            let options = SubsurfaceOptions { shape, single: true, bounces, ..options(Estimator::Cut, samples, seed) };
            film(&subsurface(scene, options), scene, passes, seed, &mut []).image()
        }
    }
}

/// A ball in even light from all sides, of a lamp that closes it in or of the sky, seen in its middle.
fn ball_within(lamp: bool, medium: &str) -> Scene {
    let around = if lamp {
        sphere("lamp", [0.0; 3], 9.0, 12, "lamp").replace("material", "flip = true\nmaterial") + &emissive("lamp", 1)
    } else {
        sky(1)
    };
    let eye = camera([0.0, 2.0, 6.0], [0.0; 3], 12.0, [6, 6]);
    load(&(eye + &around + &sphere("ball", [0.0; 3], 1.0, 24, "wax") + &translucent("wax", medium)))
}

/// What leaves a convex body has passed twice, whatever else befell it: pigment of 1, 0.5 and 0 tells the mirror image and a quarter of the rest from all of it.
#[test]
fn light_passes_pigment_twice() {
    let (thick, thin, clear) = (
        "sigma_s = 4\nsigma_a = 0.3\ng = 0.3\neta = 1.4",
        "sigma_s = 0.5\nsigma_a = 0.3\ng = 0\neta = 1.4\nmodel = \"better\"",
        "sigma_s = 1\nsigma_a = 0.2\ng = 0\neta = 1",
    );
    let rough = format!("{thick}\nroughness = 0.6");
    let near = "sigma_s = 4000\nsigma_a = 30\ng = 0\neta = 1.4";
    let half = |samples| Some((Shape::HalfSpace, samples));
    for (medium, lamp, shape, bounces, passes) in [
        (thick, false, None, 1, 8),
        (thick, true, None, 1, 8),
        (clear, false, None, 1, 8),
        (clear, true, None, 1, 8),
        (&rough, true, None, 1, 16),
        (thick, false, half(1000), 0, 2),
        (thick, true, half(1000), 8, 2),
        (near, false, half(1000), 8, 2),
        (thin, true, half(500), 8, 8),
        (thin, false, half(500), 0, 8),
        (&rough, false, half(1000), 8, 8),
        (thick, false, Some((Shape::Walked, 2000)), 8, 2),
    ] {
        let scene = ball_within(lamp, &format!("{medium}\ntint = [1, 0.5, 0]"));
        // Of the same paths in all three channels: without noise.
        let [all, half, none] = channels(&picture(&scene, shape, bounces, passes, 1));
        let share = (half - none) / (all - none);
        assert!((share - 0.25).abs() < 1e-4, "{medium:?} lamp {lamp} {shape:?} {bounces}: {share}");
    }
}

/// One ball is lit by a lamp, another by the first alone, and seen: pigment on either of them is passed twice.
#[test]
fn light_from_body_to_body_passes_the_pigment_of_both() {
    for (first, second) in [("tint = [1, 0.5, 0]", ""), ("", "tint = [1, 0.5, 0]")] {
        let scene = load(
            &(camera([1.5, 0.4, 9.0], [1.1, 0.4, 0.0], 6.0, [6, 6])
                + &rectangle("lamp", [-1.6, 4.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5], "lamp")
                + &emissive("lamp", 50)
                + &rectangle("screen", [0.0, 3.7, 0.0], [0.0, 2.5, 0.0], [0.0, 0.0, 9.0], "black")
                + &parts::diffuse("black", 0)
                + &sphere("first", [-1.4, 0.0, 0.0], 1.0, 24, "one")
                + &sphere("second", [1.4, 0.0, 0.0], 1.0, 24, "two")
                + &translucent("one", &format!("sigma_s = 4\nsigma_a = 0.1\ng = 0\neta = 1.4\n{first}"))
                + &translucent("two", &format!("sigma_s = 4\nsigma_a = 3\ng = 0\neta = 1.4\n{second}"))),
        );
        for shape in [None, Some((Shape::HalfSpace, 4000)), Some((Shape::Walked, 8000))] {
            let [all, half, none] = channels(&picture(&scene, shape, 8, 16, 1));
            let share = (half - none) / (all - none);
            println!("{first:?} {second:?} {shape:?}: {share} of {all}");
            // What goes to and fro more often has passed more; patches of walks are not linear in the light.
            let within = if matches!(shape, Some((Shape::Walked, _))) { 0.04 } else { 0.01 };
            assert!((share - 0.25).abs() < within, "{first:?} {second:?} {shape:?}: {share} of {all}");
        }
    }
}

/// Squares of 0.2, 0.5 and 0.8, along u and v.
fn checker() -> Image {
    let shares = [0.2, 0.5, 0.8];
    let at = |x: u32, y: u32| {
        Rgb([shares[(x / 8 % 3) as usize], shares[(y / 8 % 3) as usize], shares[((x / 8 + y / 8) % 3) as usize]])
    };
    Image::from_fn([48, 24], at)
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    save(&checker(), &folder.path().join("checker.exr"), &Metadata::default(), Default::default()).unwrap();
    folder
}

const CHECKER: &str = "tint = { image = \"checker.exr\" }";

/// Two balls that light each other and a lamp near them, a picture on each: light goes in at one colour and out at another.
#[test]
fn walks_and_paths_show_one_picture() {
    let folder = folder();
    let medium =
        format!("sigma_s = [3, 4, 5]\nsigma_a = [0.02, 0.1, 0.3]\ng = 0\neta = 1.3\nmodel = \"auto\"\n{CHECKER}");
    let scene = load_in(
        folder.path(),
        &(camera([0.0, 1.0, 9.0], [0.0; 3], 14.0, [24, 12])
            + &sky(0.2)
            + &rectangle("lamp", [0.0, 4.0, 2.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], "lamp")
                .replace("material", "flip = true\nmaterial")
            + &emissive("lamp", 9)
            + &sphere("left", [-1.1, 0.0, 0.0], 1.0, 24, "wax")
            + &sphere("right", [1.1, 0.0, 0.0], 1.0, 24, "wax")
            + &translucent("wax", &medium)),
    );
    // Halves of each ball.
    let blocks = |image: &Image| -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; 8];
        for (i, p) in image.pixels.iter().enumerate() {
            let (x, y) = (i % 24, i / 24);
            (0..3).for_each(|c| sums[x / 6 + 4 * (y / 6)][c] += f64::from(p[c]) / 36.0);
        }
        sums
    };
    let runs = |shape, passes| -> Vec<Vec<[f64; 3]>> {
        (1..=6).map(|seed| blocks(&picture(&scene, shape, 8, passes, seed))).collect()
    };
    let (paths, walks) = (runs(None, 64), runs(Some((Shape::Walked, 4000)), 12));
    for block in 0..8 {
        let of = |runs: &[Vec<[f64; 3]>]| means_of(&runs.iter().map(|run| run[block]).collect::<Vec<_>>());
        for (c, (a, b)) in of(&walks).into_iter().zip(of(&paths)).enumerate() {
            // Walks have a floor of some percent where patches are coarse.
            let b = (b.0, b.1.hypot(0.012 * b.0));
            agree(a, b, Within { errors: 4.0, noise: 0.06 }, &format!("block {block} channel {c}"));
        }
    }
}

/// A picture for a colour: a body so dense that light leaves where it entered has in each square that square's share of the brightest colour.
#[test]
fn pictures_of_colours_come_out() {
    let folder = folder();
    let render = |colour: &str| {
        let eye = "unit = \"mm\"\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nprojection = \"orthographic\"\nheight = 6\nresolution = [24, 12]\n";
        let medium = format!("mean_free_path = 1e-4\neta = 1.4\n{colour}");
        let wall = rectangle("wall", [0.0; 3], [6.0, 0.0, 0.0], [0.0, 3.0, 0.0], "wax")
            .replace("material", "thickness = 0.5\nmaterial");
        let scene = load_in(folder.path(), &(eye.to_string() + &sky(1) + &wall + &translucent("wax", &medium)));
        let options = SubsurfaceOptions { specular: false, bounces: 0, ..options(Estimator::Cut, 2000, 1) };
        film(&subsurface(&scene, options), &scene, 64, 1, &mut []).image()
    };
    let found = render("colour = { image = \"checker.exr\" }");
    let brightest = average(&render("colour = 0.8"));
    // Squares are four pixels wide.
    for (x, y) in (0..6).flat_map(|x| (0..3).map(move |y| (x, y))) {
        let colour = checker().get(8 * x + 4, 8 * y + 4).unwrap();
        let pixel = |i: u32| found.get(4 * x + 1 + i % 2, 4 * y + 1 + i / 2).unwrap();
        let mean = (0..4).map(pixel).fold(Rgb::BLACK, |a, b| a + b) * 0.25;
        for c in 0..3 {
            let (share, right) = (f64::from(mean[c]) / brightest, f64::from(colour[c]) / 0.8);
            assert!((share / right - 1.0).abs() < 0.02, "square {x},{y} channel {c}: {share} for {right}");
        }
    }
}

/// Both faces of a sheet have the picture, and what stands for a body in a preview.
#[test]
fn sheets_and_previews_have_the_picture() {
    let folder = folder();
    let scene = |z: i32| {
        let eye = camera([0.0, 0.0, 10.0 * f64::from(z)], [0.0; 3], 30.0, [24, 12]);
        let leaf = rectangle("leaf", [0.0; 3], [5.0, 0.0, 0.0], [0.0, 2.5, 0.0], "leaf")
            .replace("material", "thickness = 0.1\nmaterial");
        let medium = format!("sigma_s = 20\nsigma_a = 0\ng = 0\neta = 1\n{CHECKER}");
        load_in(folder.path(), &(eye + &sky(1) + &leaf + &translucent("leaf", &medium)))
    };
    // From behind left is right.
    for (z, mirrored) in [(1, false), (-1, true)] {
        let scene = scene(z);
        let direct = film(&Direct::new(&scene, 1).unwrap(), &scene, 64, 1, &mut []).image();
        let paths = picture(&scene, None, 8, 256, 1);
        for x in 0..6 {
            let at = |image: &Image| {
                let column = 4 * x + 1;
                (0..2).map(|i| image.get(column + i, 6).unwrap()[0]).sum::<f32>() / 2.0
            };
            let share = [0.2, 0.5, 0.8][if mirrored { 5 - x } else { x } as usize % 3];
            // All that enters leaves: mostly where it entered.
            let (found, preview) = (at(&paths), at(&direct));
            println!("{z} {x}: {found} {preview} for {}", share * share);
            assert!((found / (share * share) - 1.0).abs() < 0.35, "{z} {x}: {found}");
            assert!((preview / at_total(&scene) / (share * share) - 1.0).abs() < 0.1, "{z} {x}: {preview}");
        }
    }
}

/// Albedo of a body without pigment in a preview.
fn at_total(scene: &Scene) -> f32 {
    scene.surface(0).inside.as_ref().unwrap().build().unwrap().total()[0].min(1.0)
}

#[test]
fn what_cannot_be_right_is_refused() {
    let folder = folder();
    let ball = sphere("ball", [0.0; 3], 1.0, 8, "wax");
    let say = |keys: &str| {
        let text = camera([0.0, 2.0, 6.0], [0.0; 3], 16.0, [2, 2]) + &ball + &translucent("wax", keys);
        let file = SceneFile::parse(&text, &folder.path().join("scene.toml")).map_err(|e| e.to_string());
        match file {
            Ok(file) => Scene::load(&file).err().unwrap().to_string(),
            Err(said) => said,
        }
    };
    let numbers = "sigma_s_prime = 1\nsigma_a = 0.1\neta = 1.3";
    let colour = "mean_free_path = 1\neta = 1.3\ncolour = { image = \"checker.exr\"";
    for (keys, words) in [
        (format!("{numbers}\ntint = 1.5"), "expected one number or three from 0 to 1, or { image"),
        (format!("{colour} }}\ntint = 0.5"), "stands beside a picture for `colour`"),
        (format!("{colour}, scale = 1.25 }}"), "the largest red of checker.exr is 1"),
        (
            format!("{numbers}\neta = 1.3\nroughness = {{ image = \"checker.exr\" }}").replacen("\neta = 1.3", "", 1),
            "pictures are for",
        ),
    ] {
        let said = say(&keys);
        assert!(said.contains(words), "{keys}: {said}");
    }
    let inside = sphere("stone", [0.0; 3], 1.2, 8, "wax");
    let text = camera([0.0, 2.0, 6.0], [0.0; 3], 16.0, [2, 2])
        + &ball
        + &inside
        + &translucent("wax", &format!("{numbers}\ntint = 0.5"));
    let said = VolumePath::new(&load(&text), VolumePathOptions::default()).err().unwrap().to_string();
    assert!(said.contains("is tinted and meets another body"), "{said}");
    // A mesh needs coordinates.
    std::fs::write(folder.path().join("bare.obj"), parts::centred([1.0; 3])).unwrap();
    let text = camera([0.0, 2.0, 6.0], [0.0; 3], 16.0, [2, 2])
        + &parts::mesh("bare", "bare.obj", "wax")
        + &translucent("wax", &format!("{numbers}\n{CHECKER}"));
    let said =
        Scene::load(&SceneFile::parse(&text, &folder.path().join("scene.toml")).unwrap()).err().unwrap().to_string();
    assert!(said.contains("has a picture, but 12 of 12 triangles"), "{said}");
}
