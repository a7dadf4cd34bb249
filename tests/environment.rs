//! Pictures of the environment: the light they send, and what is said of bad ones.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

mod rendering;

use marmor::ErrorKind;
use marmor::film::{Image, Metadata, PngOptions, Window, save};
use marmor::integrator::{Direct, Integrator, Subsurface, SubsurfaceOptions, VolumePath, VolumePathOptions};
use marmor::light::{Light, Sky};
use marmor::math::{DVec3, Rgb, Vec3};
use marmor::scene::{EntrySampling, Estimator, Orders, Scene, SceneFile, Spread};
use rendering::{Within, channels, film, load, load_in, mean_of};
use std::f64::consts::PI;
use std::path::Path;

const BODY: &str = "unit = \"mm\"\n[camera]\nposition = [0, 20, 0.5]\nlook_at = [0, 0, 0]\nfov = 3\nresolution = [4, 4]\n\
    [[object]]\nname = \"body\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 5\nmaterial = \"body\"\n";
const WHITE: &str = "[material.body]\ntype = \"diffuse\"\nalbedo = 1\n";
const WAX: &str = "[material.body]\ntype = \"translucent\"\nsigma_s_prime = [2, 3, 4]\nsigma_a = [0.8, 0.6, 0.4]\neta = 1.3\nmodel = \"standard\"\n";

/// A scene whose environment is `picture`.
fn scene(folder: &Path, picture: &Image, more: &str) -> Scene {
    save(picture, &folder.join("sky.exr"), &Metadata::default(), PngOptions::default()).unwrap();
    load_in(folder, &format!("{BODY}[environment]\nimage = \"sky.exr\"\n{more}"))
}

/// Mean over the picture in green, and its standard error from independent renders.
fn mean<I: Integrator>(of: impl Fn(u64) -> I, scene: &Scene, passes: u32) -> (f64, f64) {
    mean_of((1..=12).map(|seed| channels(&film(&of(seed), scene, passes, seed, &mut []).image())[1]))
}

/// With twelve runs a standard error is itself known to some 20 %: 8 of them stand for 6 of a known one.
fn agree(a: (f64, f64), b: (f64, f64), what: &str) {
    rendering::agree(a, b, Within { errors: 8.0, noise: 0.03 }, what);
}

fn subsurface(entry: EntrySampling, seed: u64) -> SubsurfaceOptions {
    SubsurfaceOptions {
        single: false,
        cache_samples: 2048,
        estimator: Estimator::All,
        spread: Spread::Area,
        entry,
        seed,
        ..Default::default()
    }
}

/// Grey, with a sun of a hundredth of the sphere high in the south.
fn sunny(sun: f32) -> Image {
    Image::from_fn([64, 32], |x, y| Rgb::splat(if (30..34).contains(&x) && (6..9).contains(&y) { sun } else { 0.2 }))
}

#[test]
fn a_picture_of_one_value_lights_as_a_constant_does() {
    let folder = tempfile::tempdir().unwrap();
    let even = Image::from_fn([16, 8], |_, _| Rgb([0.2, 0.5, 0.8]));
    let pictured = scene(folder.path(), &even, WAX);
    let constant = load(&format!("{BODY}[environment]\nradiance = [0.2, 0.5, 0.8]\n{WAX}"));
    let body =
        |scene: &Scene| mean(|seed| Subsurface::new(scene, subsurface(EntrySampling::Light, seed)).unwrap(), scene, 8);
    agree(body(&pictured), body(&constant), "subsurface");
    let options = |seed| VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed };
    let path = |scene: &Scene| mean(|seed| VolumePath::new(scene, options(seed)).unwrap(), scene, 32);
    agree(path(&pictured), path(&constant), "volume_path");
}

/// A white Lambertian ball seen from above sends back irradiance/π.
#[test]
fn a_sun_in_a_picture_lights_what_it_should() {
    let folder = tempfile::tempdir().unwrap();
    for turn in ["", "turn = 100\n"] {
        let scene = scene(folder.path(), &sunny(60.0), &format!("{turn}{WHITE}"));
        let sky = Sky::new(&scene.environment);
        let (mut expected, steps) = (0.0, 800);
        for i in 0..steps / 2 {
            for j in 0..steps {
                let [theta, phi] = [i, j].map(|k| (f64::from(k) + 0.5) * 2.0 * PI / f64::from(steps));
                let (sine, cosine) = theta.sin_cos();
                // The camera's rays meet the ball 1.4 degrees from its highest point.
                let w = DVec3::new(sine * phi.cos(), cosine, sine * phi.sin()).as_vec3();
                let towards = Vec3::new(0.0, 1.0, 0.025).normalize().dot(w).max(0.0);
                expected += f64::from(sky.radiance(w)[1] * towards) * sine / PI * (2.0 * PI / f64::from(steps)).powi(2);
            }
        }
        // A ball of triangles: normals are interpolated.
        let found = mean(|_| Direct::new(&scene, 8).unwrap(), &scene, 64);
        agree(found, (expected, 0.002 * expected), turn);
        let options = |seed| VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed };
        let paths = mean(|seed| VolumePath::new(&scene, options(seed)).unwrap(), &scene, 256);
        agree(paths, (expected, 0.002 * expected), &format!("paths, {turn}"));
        assert!(paths.1 < 0.01 * expected, "{paths:?} of {expected}");
    }
}

/// Directions by the picture and the cosine together, or by the cosine alone as in the lecture: one mean, less noise. So
/// too beside a lamp.
#[test]
fn directions_by_the_picture_change_the_noise_alone() {
    let folder = tempfile::tempdir().unwrap();
    let lamp = "[[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [7, 5, 0]\nedge_u = [0, 3, 0]\nedge_v = [0, 0, 3]\nmaterial = \"lamp\"\n\
        [material.lamp]\ntype = \"emissive\"\nradiance = 1\ntwo_sided = true\n";
    for more in [WAX.to_string(), WAX.to_string() + lamp] {
        let scene = scene(folder.path(), &sunny(6.0), &more);
        let by = |entry| mean(|seed| Subsurface::new(&scene, subsurface(entry, seed)).unwrap(), &scene, 80);
        let (light, cosine) = (by(EntrySampling::Light), by(EntrySampling::Cosine));
        agree(light, cosine, &more);
        if !more.contains("lamp") {
            assert!(light.1 < 0.7 * cosine.1, "{light:?} {cosine:?}");
        }
    }
}

#[test]
fn bad_pictures_are_refused_or_mended_aloud() {
    let folder = tempfile::tempdir().unwrap();
    let load = |more: &str| {
        let text = format!("{BODY}[environment]\n{more}\n{WHITE}");
        let file = SceneFile::parse(&text, &folder.path().join("scene.toml"));
        file.and_then(|file| Scene::load(&file))
    };
    let refused = |more: &str, kind: ErrorKind, words: &str| {
        let error = load(more).err().unwrap_or_else(|| panic!("{more} is taken"));
        assert!(error.kind() == kind && error.to_string().contains(words), "{more}: {error}");
    };
    std::fs::write(folder.path().join("text.exr"), "sky").unwrap();
    let part = sunny(60.0).cropped(Window { x0: 0, y0: 0, x1: 64, y1: 16 });
    save(&part, &folder.path().join("part.exr"), &Metadata::default(), PngOptions::default()).unwrap();
    refused("image = \"no.exr\"", ErrorKind::File, "no.exr: cannot read");
    refused("image = \"text.exr\"", ErrorKind::File, "not an EXR file");
    refused("image = \"part.exr\"", ErrorKind::File, "leaves out part of the picture");
    refused("image = 3", ErrorKind::Scene, "`environment.image` is 3");
    refused("turn = 3", ErrorKind::Scene, "`environment.radiance` is missing");
    refused("image = \"sky.exr\"\nturn = 361", ErrorKind::Scene, "-360 to 360");

    let odd = Image::from_fn([6, 2], |x, _| Rgb([-1.0, f32::NAN, if x == 0 { f32::INFINITY } else { 1.0 }]));
    save(&odd, &folder.path().join("odd.exr"), &Metadata::default(), PngOptions::default()).unwrap();
    let scene = load("image = \"odd.exr\"\nradiance = 2").unwrap();
    let said = scene.warnings.join("\n");
    assert!(said.contains("6 x 2 pixels") && said.contains("26 values are negative or not finite"), "{said}");
    let sky = Sky::new(&scene.environment);
    assert_eq!(sky.radiance(Vec3::Z), Rgb([0.0, 0.0, 2.0]));
}

/// The largest number of single precision in one pixel, as some programs write it for a missing value, hides no other; and a
/// factor that brings a pixel beyond it is refused by name.
#[test]
fn pixels_at_the_end_of_single_precision_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let picture = |bright: f32| {
        Image::from_fn([64, 32], |x, y| if [x, y] == [40, 20] { Rgb::splat(bright) } else { Rgb([0.3, 0.6, 0.9]) })
    };
    let largest = scene(folder.path(), &picture(f32::MAX), WHITE);
    assert!(largest.warnings.iter().any(|w| w.contains("pixel 40,20 is (3.4028235e38")), "{:?}", largest.warnings);
    let sky = Sky::new(&largest.environment);
    assert!(!sky.is_black());
    let up = sky.radiance(Vec3::Y);
    assert!((up[0] - 0.3).abs() < 1e-6 && (up[1] - 0.6).abs() < 1e-6 && (up[2] - 0.9).abs() < 1e-6, "{up:?}");
    assert_eq!(scene(folder.path(), &picture(1e6), WHITE).warnings, Vec::<String>::new());
    let text = format!("{BODY}[environment]\nimage = \"sky.exr\"\nradiance = 1e37\n{WHITE}");
    let error = Scene::load(&SceneFile::parse(&text, &folder.path().join("scene.toml")).unwrap()).err().unwrap();
    for words in [
        "[environment]",
        "sky.exr",
        "pixel 40,20 is (1e6, 1e6, 1e6)",
        "radiance = (1e37, 1e37, 1e37)",
        "smaller `radiance`",
    ] {
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}
