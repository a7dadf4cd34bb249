//! Suns in pictures of the environment: `volume_path` and single scattering ask for them as they ask for lamps, and they are
//! worth what they should be.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod parts;
mod rendering;

use marmor::film::Image;
use marmor::integrator::{FirstOrder, Integrator, VolumePath, VolumePathOptions};
use marmor::light::Lights;
use marmor::math::{DVec3, Rgb};
use marmor::optics::{HenyeyGreenstein, transmittance};
use marmor::query::Backend;
use marmor::scene::{Environment, Orders, Scene};
use parts::cuboid;
use rendering::{Within, average, film, load, load_beside, mean_of, on};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 1024, specular: false, seed: 1 };

/// The scene under a picture of all directions; `value` is asked for the middle of each pixel.
fn under(mut scene: Scene, resolution: [u32; 2], value: impl Fn(DVec3) -> f64) -> Scene {
    let [width, height] = resolution.map(f64::from);
    let pixel = |x: u32, y: u32| {
        let (theta, phi) = ((f64::from(y) + 0.5) / height * PI, (f64::from(x) + 0.5) / width * TAU);
        Rgb::splat(value(DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())) as f32)
    };
    let image = Some(Arc::new(Image::from_fn(resolution, pixel)));
    scene.environment = Environment { radiance: Rgb::WHITE, image, turn: 0.0 };
    scene
}

fn image(scene: &Scene, method: &impl Integrator, seed: u64, passes: u32) -> Image {
    film(method, scene, passes, seed, &mut []).image()
}

/// Mean over sixteen independent runs, and its standard error.
fn over_runs(run: impl Fn(u64) -> f64) -> (f64, f64) {
    mean_of((1..=16).map(run))
}

fn mean(scene: &Scene, options: VolumePathOptions, passes: u32) -> (f64, f64) {
    let of = |seed| VolumePath::new(scene, VolumePathOptions { seed, ..options }).unwrap();
    over_runs(|seed| average(&image(scene, &of(seed), seed, passes)))
}

/// Of 16 runs Student's law passes a fair pair with a chance of 99.9 %, and the seeds are always the same.
fn agree(a: (f64, f64), b: (f64, f64), noise: f64, what: &str) {
    rendering::agree(a, b, Within { errors: 4.0, noise }, what);
}

/// A ball of radius 1 at the origin, seen from z = 5; eight pixels a side, all of them on the ball.
fn ball_text(medium: &str, rest: &str) -> String {
    format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [8, 8]\n\
         [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nrings = 24\nsegments = 48\n\
         material = \"body\"\n[material.body]\ntype = \"translucent\"\n{medium}\n{rest}"
    )
}

fn ball(medium: &str, rest: &str) -> Scene {
    load(&ball_text(medium, rest))
}

/// A sun of two by two pixels in an otherwise even picture of these.
const PIXELS: [u32; 2] = [512, 256];
/// Its radiance.
const BRIGHT: f64 = 4000.0;

/// The middle of the sun and its solid angle [sr].
fn sun() -> (DVec3, f64) {
    let [width, height] = PIXELS.map(f64::from);
    let (theta, phi) = (61.0 / height * PI, 201.0 / width * TAU);
    let w = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
    (w, 4.0 * (TAU / width) * (PI / height) * theta.sin())
}

/// That sun over `scene`, all else being `rest`.
fn sunny(scene: Scene, rest: f64) -> Scene {
    let (w, solid) = sun();
    // The four pixels whose middles are nearest: half a pixel's diagonal away.
    let near = 1.1 * (solid / 8.0).sqrt();
    let scene = under(scene, PIXELS, |at| if at.distance(w) < near { BRIGHT } else { rest });
    let count = scene.environment.image.as_ref().unwrap().pixels.iter().filter(|p| p[0] == BRIGHT as f32).count();
    assert_eq!(count, 4, "pixels of the sun");
    scene
}

/// Of the rectangle from the ball: in a hundred radii the lit side would be 1 % brighter than under a sun.
const FAR: f64 = 1e4;

/// The same sun as a rectangle far away.
fn lamp() -> String {
    let (w, solid) = sun();
    let u = w.any_orthonormal_vector();
    let half = 0.5 * FAR * solid.sqrt();
    let text = |v: DVec3| format!("[{}, {}, {}]", v.x, v.y, v.z);
    format!(
        "[[object]]\nname = \"sun\"\nshape = \"rectangle\"\ncentre = {}\nedge_u = {}\nedge_v = {}\nmaterial = \"sun\"\n\
         [material.sun]\ntype = \"emissive\"\nradiance = {BRIGHT}\ntwo_sided = true\n",
        text(w * FAR),
        text(u * half),
        text(w.cross(u) * half)
    )
}

/// A ball of a medium under the sun in a picture and under the lamp.
fn two_suns(eta: f64, g: f64) -> [Scene; 2] {
    let medium = format!("sigma_s = [3.0, 4.0, 5.0]\nsigma_a = [0.2, 0.3, 0.5]\ng = {g}\neta = {eta}");
    let pictured = sunny(ball(&medium, ""), 0.0);
    assert!(Lights::new(&pictured).has_suns());
    [pictured, ball(&medium, &lamp())]
}

/// A sun in a picture is the rectangle far away that sends as much, order by order, and as quiet. Where media scatter forward, many
/// orders are left to the test below.
#[test]
fn a_sun_in_a_picture_is_a_lamp_far_away() {
    for (eta, g) in [(1.0, 0.0), (1.0, 0.8), (1.3, 0.0), (1.3, 0.8)] {
        for (orders, passes, most) in [(Orders::Single, 16, 0.01), (Orders::Multiple, 12, 0.04)] {
            // Of forward scattering that is too noisy to say anything, but path by path, as below.
            if orders == Orders::Multiple && g > 0.0 {
                continue;
            }
            let [pictured, far] = two_suns(eta, g);
            let options = VolumePathOptions { orders, ..OPTIONS };
            let (a, b) = (mean(&pictured, options, passes), mean(&far, options, passes));
            agree(a, b, most, &format!("eta {eta}, g {g}, {orders:?}"));
            // Standard errors of 16 runs are known to some 20 %.
            assert!(a.1 < 2.0 * b.1, "eta {eta}, g {g}, {orders:?}: more noise than a lamp's: {a:?} {b:?}");
        }
    }
}

/// Without photons the paths are the same under both: their noise is in both pictures and not in the difference, in a dense
/// medium that scatters forward as well.
#[test]
fn many_orders_under_a_sun_are_those_under_a_lamp_path_by_path() {
    for eta in [1.0, 1.3] {
        let [pictured, far] = two_suns(eta, 0.8);
        let options = VolumePathOptions { orders: Orders::Multiple, photons: 0, ..OPTIONS };
        let one = |scene: &Scene, seed| {
            let method = VolumePath::new(scene, VolumePathOptions { seed, ..options }).unwrap();
            average(&image(scene, &method, seed, 12))
        };
        let ratio = |seed| one(&pictured, seed) / one(&far, seed);
        agree(over_runs(ratio), (1.0, 0.0), 0.01, &format!("eta {eta}, g 0.8, picture over lamp"));
    }
}

/// Light of a sun scattered once in a half space, in closed form: with cosines μ inside,
/// T T E μ_s σ_s/σ_t p / (η² (μ_s' + μ_o')). To a third of a per cent.
#[test]
fn first_order_of_a_half_space_under_a_sun() {
    for (eta, g) in [(1.0_f64, 0.0), (1.3, 0.7), (0.8, -0.3)] {
        let text = format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 20, 0]\nlook_at = [0, 0, 0]\nup = [0, 0, 1]\nfov = 1\nresolution = [8, 8]\n\
             [[object]]\nmesh = \"slab.obj\"\nmaterial = \"m\"\n[material.m]\ntype = \"translucent\"\nsigma_s = 0.8\nsigma_a = 0.2\n\
             g = {g}\neta = {eta}\n"
        );
        let slab = cuboid([-30.0, -30.0, -30.0], [30.0, 0.0, 30.0]);
        let scene = sunny(load_beside("slab.obj", &slab, &text), 0.0);
        let (w, solid) = sun();
        let inside = (1.0 - (1.0 - w.y * w.y) / (eta * eta)).sqrt();
        let passed = f64::from(transmittance(eta as f32, w.y as f32) * transmittance(eta as f32, 1.0));
        let phase = HenyeyGreenstein { g }.value(-inside);
        let expected = passed * BRIGHT * solid * w.y * 0.8 * phase / (eta * eta * (1.0 + inside));
        let found = mean(&scene, VolumePathOptions { orders: Orders::Single, ..OPTIONS }, 200);
        // The sun is 1.4 degrees wide, the camera half a degree.
        agree(found, (expected, 3e-4 * expected), 0.003, &format!("eta {eta}, g {g}"));
    }
}

/// A bright patch of the sky, so wide that chance finds it: asked for and by photons against paths that wait for it. A
/// picture with no suns is never asked for; so the patch on top of an even sky so bright that it is none, less that sky by the
/// same paths, is the patch by chance alone.
#[test]
fn suns_change_the_noise_alone_among_all_kinds_of_surfaces() {
    let rest = "[[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, -1.05, 0]\nedge_u = [0, 0, 3]\nedge_v = [3, 0, 0]\n\
        material = \"grey\"\n[material.grey]\ntype = \"diffuse\"\nalbedo = 0.7\n\
        [[object]]\nname = \"other\"\nshape = \"sphere\"\ncentre = [1.4, -0.4, 0.8]\nradius = 0.5\nrings = 12\nsegments = 24\n\
        material = \"body\"\n[[object]]\nname = \"stone\"\nshape = \"sphere\"\ncentre = [0, 0.3, 0.2]\nradius = 0.4\nrings = 8\n\
        segments = 16\nmaterial = \"grey\"\n";
    let (w, _) = sun();
    let patch = |at: DVec3| if at.dot(w) > 0.9 { 12.0 } else { 0.3 };
    for medium in ["sigma_s = 3\nsigma_a = 0.2\ng = 0.7\neta = 1.3", "sigma_s = 6\nsigma_a = 0.1\ng = 0\neta = 1.5"] {
        let scene = || {
            let text = ball_text(medium, rest).replace("fov = 15", "fov = 36");
            load(&text.replace("look_at = [0, 0, 0]", "look_at = [0.3, -0.3, 0]"))
        };
        let on_purpose = under(scene(), [64, 32], patch);
        let (high, even) = (under(scene(), [64, 32], |at| patch(at) + 5.0), under(scene(), [64, 32], |_| 5.0));
        assert!(Lights::new(&on_purpose).has_suns());
        assert!(!Lights::new(&high).has_suns() && !Lights::new(&even).has_suns());
        let chance = |orders| {
            over_runs(|seed| {
                let of = |scene: &Scene| {
                    let method = VolumePath::new(scene, VolumePathOptions { orders, seed, ..OPTIONS }).unwrap();
                    average(&image(scene, &method, seed, 120))
                };
                of(&high) - of(&even)
            })
        };
        let all = mean(&on_purpose, OPTIONS, 20);
        agree(all, chance(Orders::All), 0.012, medium);
        let none = mean(&on_purpose, VolumePathOptions { photons: 0, ..OPTIONS }, 40);
        agree(none, all, 0.012, &format!("{medium}: no photons"));
    }
}

/// Through a clear ball a sun is met by chance alone: until that has happened often the render says so. In a cloudy one
/// it is found at once.
#[test]
fn a_sun_that_is_not_met_is_named() {
    let not_met = |medium: &str| {
        let scene = sunny(ball(medium, ""), 0.1);
        let method = VolumePath::new(&scene, OPTIONS).unwrap();
        let (film, outcome) = on(Backend::preferred(), &scene, &method, 1, 0..8);
        method.lights(&scene).not_met(&outcome.tally, film.counts().samples)
    };
    assert_eq!(
        not_met("sigma_s = 0\nsigma_a = 0.1\ng = 0\neta = 1.5"),
        ["the bright part of the environment's picture"]
    );
    assert_eq!(not_met("sigma_s = 3\nsigma_a = 0.1\ng = 0\neta = 1.5"), Vec::<String>::new());
}

/// A picture of one value is a furnace, and no sun.
#[test]
fn a_white_medium_vanishes_under_a_white_picture() {
    let scene = under(ball("sigma_s = 8\nsigma_a = 0\ng = 0.5\neta = 1.4", ""), [64, 32], |_| 1.0);
    let method = VolumePath::new(&scene, VolumePathOptions { specular: true, ..OPTIONS }).unwrap();
    for pixel in image(&scene, &method, 1, 8).pixels {
        assert!((pixel[0] - 1.0).abs() < 1e-5 && pixel.is_grey(), "{pixel:?}");
    }
}

/// The first order beside `beam` is the path tracer's under a sun as well. Forward scattering: of a sun this wide nothing is
/// left out then. Of one that is left to its directions what is reflected inside is: less, but little.
#[test]
fn single_scattering_beside_models_finds_suns() {
    let (w, _) = sun();
    let wide = |at: DVec3| if at.dot(w) > 0.9 { 12.0 } else { 0.3 };
    let medium = "sigma_s = [6, 8, 9]\nsigma_a = [0.2, 0.3, 0.5]\ng = 0.5\neta = 1.3\nmodel = \"beam\"";
    let once = VolumePathOptions { orders: Orders::Single, ..OPTIONS };
    let scene = under(ball(medium, ""), [64, 32], wide);
    let beside =
        |scene: &Scene| over_runs(|seed| average(&image(scene, &FirstOrder::new(scene, seed).unwrap(), seed, 64)));
    agree(beside(&scene), mean(&scene, once, 64), 0.02, "wide");
    let small = sunny(ball(medium, ""), 0.02);
    let (found, lamp) =
        (beside(&small), beside(&ball(medium, &format!("{}[environment]\nradiance = 0.02\n", self::lamp()))));
    agree(found, lamp, 0.02, "small");
    // Isotropic: the patch is left to its table, and of its light what the boundary reflects inside is missing.
    let isotropic = under(ball(&medium.replace("g = 0.5", "g = 0"), ""), [64, 32], wide);
    let (some, all) = (beside(&isotropic), mean(&isotropic, once, 64));
    let missing = 1.0 - some.0 / all.0;
    println!("left out: {missing:.4} +- {:.4}", some.1.hypot(all.1) / all.0);
    assert!((-0.02..0.15).contains(&missing), "{some:?} of {all:?}");
}

/// What no shadow ray finds is said before a render, and nothing of what is found.
#[test]
fn small_lights_behind_clear_bodies_are_said() {
    let floor = "[[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, -1.5, 0]\nedge_u = [0, 0, 4]\nedge_v = [4, 0, 0]\n\
                 material = \"grey\"\n[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n";
    let lamp = |half: f64| {
        format!(
            "{floor}[[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0, 5, 0]\nedge_u = [{half}, 0, 0]\n\
             edge_v = [0, 0, {half}]\nmaterial = \"lamp\"\n[material.lamp]\ntype = \"emissive\"\nradiance = 1\n"
        )
    };
    let said = |scene: &Scene| VolumePath::new(scene, OPTIONS).unwrap().warnings(scene).join("\n");
    let (glass, milk) = ("sigma_s = 0\nsigma_a = 0\ng = 0\neta = 1.5", "sigma_s = 20\nsigma_a = 0\ng = 0\neta = 1.3");
    let words = said(&ball(glass, &lamp(0.1)));
    for word in ["light of \"lamp\" that comes through \"ball\"", "by chance alone", "larger or softer lights"] {
        assert!(words.contains(word), "{word}: {words}");
    }
    assert!(said(&sunny(ball(glass, floor), 0.5)).contains("the bright part of the environment's picture"));
    // Wide from where the ball is nearest, small from behind it.
    let near = lamp(0.15).replace("centre = [0, 5, 0]", "centre = [0, 1.05, 0]");
    assert!(said(&ball(glass, &near)).contains("light of \"lamp\" that comes through \"ball\""));
    // A wide lamp, a dense body, nothing to show the light, an even sky.
    for scene in [
        ball(glass, &lamp(2.0)),
        ball(milk, &lamp(0.1)),
        ball(glass, lamp(0.1).strip_prefix(floor).unwrap()),
        under(ball(glass, floor), [16, 8], |_| 1.0),
        sunny(ball(milk, floor), 0.5),
    ] {
        assert_eq!(said(&scene), "");
    }
}
