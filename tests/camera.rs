//! Cameras and pixel filters: rays against geometry on paper, and pictures of edges against the areas that they cut off.
#![allow(clippy::unwrap_used)] // a scene of a test that does not load has failed

mod refusals;
mod rendering;

use marmor::film::{Image, Window};
use marmor::integrator::{Direct, View};
use marmor::math::{DVec3, Vec3};
use marmor::query::{self, Backend, Ray};
use marmor::render::{nothing_in_view, shares};
use marmor::sampling::PixelStream;
use marmor::scene::{Camera, Scene, SceneFile};
use refusals::failure;
use rendering::load;
use std::path::Path;

/// A camera 10 above the origin, 8 x 4 pixels, with `keys`, above a shining rectangle whose edge is the plane x = 0.
fn scene(keys: &str) -> Scene {
    load(&text(keys, 0.0, ""))
}

fn text(keys: &str, z: f64, render: &str) -> String {
    format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nresolution = [8, 4]\n{keys}\n[[object]]\nname = \"lamp\"\n\
         shape = \"rectangle\"\ncentre = [50, 0, {z}]\nedge_u = [50, 0, 0]\nedge_v = [0, 50, 0]\nmaterial = \"lamp\"\n[material.lamp]\n\
         type = \"emissive\"\nradiance = 1\ntwo_sided = true\n[render]\n{render}"
    )
}

fn camera(keys: &str) -> Camera {
    scene(keys).camera
}

/// Where a ray meets the plane z [unit].
fn at(scene_centre: DVec3, ray: &Ray, z: f64) -> DVec3 {
    let from = ray.origin + scene_centre;
    from + ray.direction.as_dvec3() * ((z - from.z) / f64::from(ray.direction.z))
}

#[test]
fn a_pinhole_has_the_rays_that_it_always_had() {
    let plain = camera("fov = 40");
    let (up, forward) = (Vec3::Y, Vec3::NEG_Z);
    let tangent = 20.0_f64.to_radians().tan();
    let right = forward.cross(up).normalize() * (tangent * 2.0) as f32;
    let up = forward.cross(up).normalize().cross(forward) * tangent as f32;
    let same =
        ["fov = 40", "fov = 40\naperture = 0\nfocus = 3\nblades = 5\nshift = [0, 0]\nprojection = \"perspective\""];
    for camera in same.map(camera) {
        for k in 0..64_u32 {
            let (pixel, offset) = ([k % 8, k / 16], [k as f32 / 64.0, 0.3]);
            let [x, y] = [0, 1].map(|a| (pixel[a] as f32 + offset[a]) / [8.0, 4.0][a] * 2.0 - 1.0);
            let expected = Ray::new(plain.origin, (forward + right * x - up * y).normalize());
            let mut stream = PixelStream::new(1, k.into(), 2);
            for ray in [
                camera.ray(pixel, offset),
                camera.sample(pixel, offset, &mut stream),
                camera.grid_ray(pixel, offset, k),
            ] {
                assert_eq!((ray.origin, ray.direction), (expected.origin, expected.direction));
            }
            assert_eq!(stream.next_2d(), PixelStream::new(1, k.into(), 2).next_2d(), "no number is taken");
        }
    }
}

#[test]
fn orthographic_rays_are_parallel_and_evenly_spaced() {
    let scene = scene("projection = \"orthographic\"\nheight = 6");
    let ray = |x: u32, y: u32| scene.camera.ray([x, y], [0.5, 0.5]);
    for y in 0..4 {
        for x in 0..8 {
            let ray = ray(x, y);
            assert_eq!(ray.direction, Vec3::NEG_Z);
            let expected = DVec3::new(-5.25 + 1.5 * f64::from(x), 2.25 - 1.5 * f64::from(y), 10.0);
            assert!((ray.origin + scene.centre - expected).length() < 1e-6, "{x} {y}: {}", ray.origin);
        }
    }
}

#[test]
fn a_shift_moves_the_picture_over_the_film() {
    // The middle of the picture comes to the left edge and a quarter of the height downwards.
    for keys in ["fov = 40", "projection = \"orthographic\"\nheight = 6", "fov = 40\naperture = 2"] {
        let shifted = camera(&format!("{keys}\nshift = [0.5, 0.25]"));
        let ray = shifted.ray([0, 3], [0.0, 0.0]);
        let middle = camera(keys).ray([4, 2], [0.0, 0.0]);
        assert!((ray.direction - middle.direction).length() < 1e-6, "{keys}: {}", ray.direction);
        assert!((ray.origin - middle.origin).length() < 1e-5, "{keys}: {}", ray.origin);
    }
}

/// The largest and the root of the mean squared distance between where rays of samples through one place of a pixel meet the plane z,
/// and where the one through the lens's middle does.
fn spot(camera: &Camera, centre: DVec3, pixel: [u32; 2], z: f64) -> (f64, f64) {
    let place = [0.3, 0.6];
    let middle = at(centre, &camera.ray(pixel, place), z);
    let distances: Vec<f64> = (0..4096)
        .map(|i| at(centre, &camera.sample(pixel, place, &mut started(7, 3, i)), z).distance(middle))
        .collect();
    let square = distances.iter().map(|d| d * d).sum::<f64>() / distances.len() as f64;
    (distances.iter().copied().fold(0.0, f64::max), square.sqrt())
}

#[test]
fn what_is_out_of_focus_is_a_circle_of_confusion() {
    for view in ["fov = 40", "fov = 40\nshift = [1, -0.5]", "projection = \"orthographic\"\nheight = 6"] {
        for (focus, distance) in [("focus = 8", 8.0), ("focus = [3, 1, 2]", 8.0), ("", 10.0)] {
            let scene = scene(&format!("{view}\naperture = 3\n{focus}"));
            for z in [9.0, 5.0, 2.0, 0.0, -20.0] {
                let depth = 10.0 - z;
                let radius = 1.5 * f64::abs(1.0 - depth / distance);
                let (largest, mean) = spot(&scene.camera, scene.centre, [6, 1], z);
                if radius == 0.0 {
                    // Of a spot as wide as the lens a few millionths are left: single precision.
                    assert!(largest < 1.5 * 4e-6, "{view} {focus}: {largest}");
                } else {
                    assert!(
                        largest <= radius * 1.00001 && largest > radius * 0.995,
                        "{view} {focus} {z}: {largest} {radius}"
                    );
                    // Evenly over the disc: the mean square is half of the radius's.
                    let even = radius * 0.5_f64.sqrt();
                    assert!((mean / even - 1.0).abs() < 2e-3, "{view} {focus} {z}: {mean} against {even}");
                }
            }
        }
    }
}

/// A stream whose place in the pixel is taken.
fn started(seed: u64, pixel: u64, sample: u32) -> PixelStream {
    let mut stream = PixelStream::new(seed, pixel, sample);
    stream.next_2d();
    stream
}

#[test]
fn numbers_of_the_lens_are_used_once_and_stratified() {
    let camera = camera("fov = 40\naperture = 2");
    let (mut stream, mut other) = (started(1, 2, 3), started(1, 2, 3));
    camera.sample([1, 1], [0.5; 2], &mut stream);
    other.next_2d();
    assert_eq!(stream.next_2d(), other.next_2d());
    // A sixteenth of the samples in each sixteenth of the lens: independent ones would have a chi-square of 15.
    let mut counts = [0_i32; 16];
    for sample in 0..256 {
        let ray = camera.sample([1, 1], [0.5; 2], &mut started(1, 9, sample));
        let eye = (ray.origin - camera.origin).as_vec3();
        let ring = ((eye.x.powi(2) + eye.y.powi(2)).sqrt() >= 0.5_f32.sqrt()) as usize;
        let turn = ((eye.y.atan2(eye.x) / std::f32::consts::TAU + 0.5) * 8.0) as usize;
        counts[ring * 8 + turn.min(7)] += 1;
    }
    assert!(counts.iter().map(|n| (n - 16).pow(2)).sum::<i32>() < 5 * 16, "{counts:?}");
}

/// The picture of the lamp's edge after 1024 samples a pixel.
fn edge(keys: &str, z: f64, render: &str) -> Image {
    let scene = load(&text(keys, z, render));
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let direct = Direct::new(&scene, 1).unwrap();
    rendering::run(&direct, View { scene: &scene, rays: &*rays }, 5, 0..1024, &mut []).0.image()
}

/// Each column of `image` against the share of the lamp in it; 4096 stratified samples are nearer than 0.003.
fn columns(image: &Image, share: impl Fn(f64) -> f64, what: &str) {
    for x in 0..8 {
        let value = (0..4).map(|y| f64::from(image.get(x, y).unwrap()[0])).sum::<f64>() / 4.0;
        let expected = share(f64::from(x) + 0.5);
        assert!((value - expected).abs() < 3e-3, "{what}: column {x}: {value} against {expected}");
    }
}

const PIXELS: &str = "projection = \"orthographic\"\nheight = 4";

/// Integral of a filter over -1 to `x`, in radii.
fn integral(density: impl Fn(f64) -> f64, x: f64) -> f64 {
    let sum = |to: f64| {
        (0..20_000).map(|i| density(-1.0 + (f64::from(i) + 0.5) * (to + 1.0) / 2e4)).sum::<f64>() * (to + 1.0)
    };
    sum(x.clamp(-1.0, 1.0)) / sum(1.0)
}

#[test]
fn an_edge_has_the_shares_of_the_filter() {
    // Pixels of 1 unit, the edge between the fourth and the fifth.
    let step = |x: f64| if x > 4.0 { 1.0 } else { 0.0 };
    columns(&edge(PIXELS, 0.0, ""), step, "box by default");
    columns(&edge(PIXELS, 0.0, "filter = \"box\""), step, "box");
    let gaussian = |radius: f64| move |x: f64| integral(|t| (-8.0 * t * t).exp(), (x - 4.0) / radius);
    columns(&edge(PIXELS, 0.0, "filter = \"gaussian\""), gaussian(2.0), "Gaussian");
    columns(&edge(PIXELS, 0.0, "filter = \"gaussian\"\nfilter_radius = 3.5"), gaussian(3.5), "wide Gaussian");
    let window = |t: f64| {
        let term = |k: f64| (std::f64::consts::PI * k * t).cos();
        0.35875 + 0.48829 * term(1.0) + 0.14128 * term(2.0) + 0.01168 * term(3.0)
    };
    let blackman_harris = |x: f64| integral(window, (x - 4.0) / 1.5);
    columns(&edge(PIXELS, 0.0, "filter = \"blackman-harris\""), blackman_harris, "Blackman-Harris");
}

#[test]
fn an_edge_out_of_focus_has_the_shares_of_the_lens() {
    // Parallel rays meet 10 units away; 15 away the lens of radius 4 has a spot of radius 2. Integrated over pixels of 1 unit.
    let disc = |x: f64| {
        let x = (x / 2.0).clamp(-1.0, 1.0);
        0.5 + (x * (1.0 - x * x).sqrt() + x.asin()) / std::f64::consts::PI
    };
    let mean = |x: f64| (0..1000).map(|i| disc(x - 4.5 + (f64::from(i) + 0.5) / 1000.0)).sum::<f64>() / 1000.0;
    columns(&edge(&format!("{PIXELS}\naperture = 8\nfocus = 10"), -5.0, ""), mean, "round");
    // A square with sides upright: a spot of half the side 2 / √2.
    let half = 2.0 / 2.0_f64.sqrt();
    let square = |x: f64| ((x / half).clamp(-1.0, 1.0) + 1.0) / 2.0;
    let mean = |x: f64| (0..1000).map(|i| square(x - 4.5 + (f64::from(i) + 0.5) / 1000.0)).sum::<f64>() / 1000.0;
    let keys = format!("{PIXELS}\naperture = 8\nfocus = 10\nblades = 4\nblade_turn = 45");
    columns(&edge(&keys, -5.0, ""), mean, "four blades");
}

#[test]
fn what_only_the_lens_sees_is_in_view() {
    let empty = |keys: &str| {
        let scene = load(&text(keys, 0.0, ""));
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let (view, window) = (View { scene: &scene, rays: &*rays }, Window::full([8, 4]));
        nothing_in_view(view, window, &shares(view, window)).is_some()
    };
    // The lamp begins at x = 0; these look to its left, by 1 unit in the plane of the lamp.
    let aside = "projection = \"orthographic\"\nheight = 4\nshift = [-0.625, 0]";
    assert!(empty(aside) && !empty("projection = \"orthographic\"\nheight = 4\nshift = [-0.375, 0]"));
    assert!(!empty(&format!("{aside}\naperture = 6\nfocus = 5")), "a spot of radius 3");
    assert!(empty(&format!("{aside}\naperture = 6\nfocus = 10")), "sharp");
    assert!(empty(&format!("{aside}\naperture = 1.6\nfocus = 5")), "a spot of radius 0.8");
    let aside = "fov = 40\nshift = [-0.6, 0]";
    assert!(empty(aside) && !empty(&format!("{aside}\naperture = 8\nfocus = 5")));
}

#[test]
fn rays_start_on_one_side_of_every_body() {
    let of = |keys: &str| {
        let ball = "[[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 3, 9]\nradius = 2\nmaterial = \"glass\"\n\
                    [material.glass]\ntype = \"dielectric\"\neta = 1.5\n";
        let text = text(keys, 0.0, "").replacen("[[object]]", &format!("{ball}[[object]]"), 1);
        let file = SceneFile::parse(&text, Path::new("x.toml"))?;
        Scene::load(&file)
    };
    // The ball begins 1.27 units above the camera's middle in the plane through it.
    assert!(of("fov = 40").is_ok() && of("fov = 40\naperture = 2.4").is_ok());
    let (said, _) = failure(of("fov = 40\naperture = 2.7"), "a lens in the ball");
    assert!(said.starts_with("x.toml:7: `camera.aperture` is 2.7") && said.contains("\"ball\""), "{said}");
    let (said, _) = failure(of("projection = \"orthographic\"\nheight = 4"), "a plane through the ball");
    assert!(said.starts_with("x.toml:6: the plane through `camera.position`") && said.contains("move"), "{said}");
    assert!(of("projection = \"orthographic\"\nheight = 2").is_ok());
    let (said, _) = failure(of("projection = \"orthographic\"\nheight = 2\naperture = 1"), "plane and lens");
    assert!(said.starts_with("x.toml:8: the plane through `camera.position`"), "{said}");
}

#[test]
fn wrong_keys_are_refused_with_a_remedy() {
    for (keys, parts) in [
        ("fov = 40\nheight = 3", &["x.toml:7: `camera.height` is of an orthographic camera", "`fov`"][..]),
        ("fov = 40\nprojection = \"orthographic\"", &["x.toml:6: `camera.fov`", "`height`"]),
        ("projection = \"orthographic\"", &["x.toml:2: `camera.height` is missing"]),
        ("projection = \"orthographic\"\nheight = 0", &["x.toml:7: `camera.height` is 0", "above 0"]),
        ("projection = \"orthographic\"\nheight = 1e30", &["`camera` cannot be held in single precision"]),
        ("projection = \"fisheye\"", &["x.toml:6: `camera.projection`", "perspective, orthographic"]),
        ("projection = \"orthografic\"", &["did you mean `orthographic`?"]),
        ("fov = 40\naperture = -1", &["x.toml:7: `camera.aperture` is -1", "0 for a pinhole"]),
        ("fov = 40\naperture = 1e-60", &["`camera.aperture` is 1e-60"]),
        ("fov = 40\naperture = 30000", &["x.toml:7: `camera.aperture` is 30000, more than 2000 times", "focus"]),
        ("fov = 40\nfocus = 3", &["x.toml:7: `camera.focus`", "add `aperture`"]),
        ("fov = 40\naperture = 1\nfocus = 0", &["x.toml:8: `camera.focus` is 0", "above 0"]),
        ("fov = 40\naperture = 1\nfocus = [0, 0, 11]", &["`camera.focus` is a point that is not in front", "-1 units"]),
        ("fov = 40\naperture = 1\nblades = 2", &["x.toml:8: `camera.blades` is 2", "3 to 64"]),
        ("fov = 40\naperture = 1\nblade_turn = 361", &["`camera.blade_turn` is 361", "-360 to 360"]),
        ("fov = 40\nshift = [0, 11]", &["x.toml:7: `camera.shift` is [0, 11]", "-10 to 10"]),
        ("fov = 40\nshift = 1", &["`camera.shift` is 1"]),
    ] {
        let load = |file: SceneFile| Scene::load(&file);
        let (said, _) = failure(SceneFile::parse(&text(keys, 0.0, ""), Path::new("x.toml")).and_then(load), keys);
        assert!(parts.iter().all(|part| said.contains(part)), "{keys}: {said}");
    }
    for (render, parts) in [
        ("filter = \"mitchell\"", &["`render.filter`", "box, gaussian, blackman-harris"][..]),
        ("filter = \"gausian\"", &["did you mean `gaussian`?"]),
        ("filter_radius = 2", &["`render.filter_radius` stands without a filter", "\"gaussian\""]),
        ("filter = \"box\"\nfilter_radius = 2", &["`render.filter_radius` stands without a filter"]),
        ("filter = \"gaussian\"\nfilter_radius = 0", &["`render.filter_radius` is 0", "0.25 to 8"]),
        ("filter = \"gaussian\"\nfilter_radius = 9", &["`render.filter_radius` is 9"]),
    ] {
        let (said, _) = failure(SceneFile::parse(&text("fov = 40", 0.0, render), Path::new("x.toml")), render);
        assert!(parts.iter().all(|part| said.contains(part)), "{render}: {said}");
    }
}

#[test]
fn the_filter_decides_what_a_film_is() {
    let decisive =
        |render: &str| SceneFile::parse(&text("fov = 40", 0.0, render), Path::new("x.toml")).unwrap().decisive();
    assert_ne!(decisive("filter = \"gaussian\""), decisive(""));
    assert_ne!(decisive("filter = \"gaussian\""), decisive("filter = \"gaussian\"\nfilter_radius = 1"));
    assert_eq!(decisive("spp = 3"), decisive("spp = 4"));
}
