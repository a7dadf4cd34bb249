//! Pictures that are numbers on surfaces: roughness, normals, heights, and what is not there.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

mod rendering;

use marmor::film::{Image, Metadata, save};
use marmor::integrator::{Integrator, Path as Paths, VolumePath, VolumePathOptions};
use marmor::math::{DVec3, Rgb};
use marmor::scene::{Scene, SceneFile, View};
use rendering::{average, backends, load_in, run};
use std::f32::consts::PI;
use std::path::Path;

const EYE: &str = "unit = \"mm\"\n[camera]\nposition = [0, 0, 100]\nlook_at = [0, 0, 0]\nprojection = \"orthographic\"\nheight = 8\nresolution = [16, 16]\n";
/// Seen from the front, u to the right and v upwards.
const WALL: &str = "[[object]]\nname = \"wall\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [4, 0, 0]\nedge_v = [0, 4, 0]\nmaterial = \"wall\"\n";
const SKY: &str = "[environment]\nradiance = 1\n";

fn sun([x, y, z]: [f32; 3]) -> String {
    format!("[[light]]\ntype = \"distant\"\ndirection = [{}, {}, {}]\nirradiance = 2\n", -x, -y, -z)
}

fn picture(folder: &Path, name: &str, of: impl Fn(u32, u32) -> Rgb) {
    save(&Image::from_fn([64, 64], of), &folder.join(name), &Metadata::default(), Default::default()).unwrap();
}

fn paths(scene: &Scene) -> Paths {
    Paths::new(scene, None, 1).unwrap()
}

/// By rays that know of masks.
fn render(scene: &Scene, method: &impl Integrator, passes: u32) -> Image {
    let rays = scene.rays(backends().next().unwrap()).unwrap();
    run(method, View { scene, rays: &*rays }, 1, 0..passes, &mut []).0.image()
}

/// A picture of one roughness is that roughness, sample by sample; plastic by a picture of one albedo has it too.
#[test]
fn an_even_picture_is_a_number() {
    let folder = tempfile::tempdir().unwrap();
    picture(folder.path(), "half.exr", |_, _| Rgb::splat(0.5));
    let kinds = [
        "type = \"plastic\"\nalbedo = [0.2, 0.5, 0.8]",
        "type = \"conductor\"\nmetal = \"gold\"",
        "type = \"diffuse\"\nalbedo = [0.2, 0.5, 0.8]",
    ];
    for kind in kinds {
        let [by_picture, by_number] = ["{ image = \"half.exr\" }", "0.5"].map(|roughness| {
            let text =
                format!("{EYE}{WALL}{SKY}{}[material.wall]\n{kind}\nroughness = {roughness}\n", sun([0.3, 0.4, 0.9]));
            let scene = load_in(folder.path(), &text);
            render(&scene, &paths(&scene), 4)
        });
        for (a, b) in by_picture.pixels.iter().zip(&by_number.pixels) {
            assert!((0..3).all(|c| (a[c] / b[c] - 1.0).abs() < 1e-4), "{kind}: {a:?} {b:?}");
        }
    }
    let [by_picture, by_number] = ["{ image = \"half.exr\" }", "0.5"].map(|albedo| {
        let text = format!("{EYE}{WALL}{SKY}[material.wall]\ntype = \"plastic\"\nalbedo = {albedo}\nroughness = 0.3\n");
        let scene = load_in(folder.path(), &text);
        render(&scene, &paths(&scene), 4)
    });
    assert!((average(&by_picture) / average(&by_number) - 1.0).abs() < 1e-5);
}

/// A picture of two halves is two walls.
#[test]
fn each_half_is_as_rough_as_the_picture_says() {
    let folder = tempfile::tempdir().unwrap();
    picture(folder.path(), "halves.exr", |x, _| Rgb::splat(if x < 32 { 0.25 } else { 0.75 }));
    let render = |roughness: &str| {
        let text = format!(
            "{EYE}{WALL}{}[material.wall]\ntype = \"conductor\"\nreflectance = 1\nroughness = {roughness}\n",
            sun([0.05, 0.0, 1.0])
        );
        let scene = load_in(folder.path(), &text);
        render(&scene, &paths(&scene), 1)
    };
    let (both, smooth, rough) =
        (render("{ image = \"halves.exr\", wrap = \"clamp\" }"), render("0.25"), render("0.75"));
    let at = |image: &Image, x: u32| image.get(x, 8).unwrap()[0];
    // Between two steps, a quarter of the way from one to the next: the highlight hangs on the fourth power, of which the mixture has the mean.
    let between = 0.25 + 0.25 / 32.0;
    picture(folder.path(), "between.exr", |_, _| Rgb::splat(between));
    let (mixed, right) = (render("{ image = \"between.exr\" }"), render(&between.to_string()));
    assert!((at(&mixed, 8) / at(&right, 8) - 1.0).abs() < 0.04, "{} {}", at(&mixed, 8), at(&right, 8));
    assert!(at(&smooth, 3) > 5.0 * at(&rough, 3));
    for (x, right) in [(3, &smooth), (12, &rough)] {
        assert!((at(&both, x) / at(right, x) - 1.0).abs() < 1e-4);
    }
}

/// Normals of a map and slopes of heights: a matt wall under a distant light has albedo/π E cosθ of them.
#[test]
fn reliefs_turn_normals() {
    let folder = tempfile::tempdir().unwrap();
    let towards = DVec3::new(0.48, 0.36, 0.8);
    // Leaning by 20 degrees to u and 10 to v.
    let n = DVec3::new(20.0_f64.to_radians().sin(), 10.0_f64.to_radians().sin(), 0.0);
    let n = DVec3::new(n.x, n.y, (1.0 - n.length_squared()).sqrt());
    picture(folder.path(), "map.exr", |_, _| Rgb::from_fn(|c| (0.5 + 0.5 * n[c]) as f32));
    picture(folder.path(), "flat.exr", |_, _| Rgb([0.5, 0.5, 1.0]));
    // Higher to the right and downwards, over 8 units.
    picture(folder.path(), "ramp.exr", |x, y| Rgb::splat((x as f32 + 0.5) / 128.0 + (y as f32 + 0.5) / 256.0));
    let ramp = DVec3::new(-0.5 * 3.0 / 8.0, 0.25 * 3.0 / 8.0, 1.0).normalize();
    for (key, n) in [
        ("normal = { image = \"map.exr\" }", n),
        ("normal = { image = \"map.exr\", strength = 0.5 }", DVec3::new(0.5 * n.x, 0.5 * n.y, n.z).normalize()),
        ("normal = { image = \"flat.exr\" }", DVec3::Z),
        ("bump = { image = \"ramp.exr\", height = 3, wrap = \"clamp\" }", ramp),
        ("bump = { image = \"ramp.exr\", height = -3, wrap = \"clamp\" }", DVec3::new(-ramp.x, -ramp.y, ramp.z)),
    ] {
        let text = format!(
            "{EYE}{WALL}{}[material.wall]\ntype = \"diffuse\"\nalbedo = 0.6\n{key}\n",
            sun(towards.as_vec3().to_array())
        );
        let scene = load_in(folder.path(), &text);
        let found = render(&scene, &paths(&scene), 1).get(8, 7).unwrap()[0];
        let right = 0.6 / PI * 2.0 * n.dot(towards) as f32;
        assert!((found / right - 1.0).abs() < 2e-3, "{key}: {found} for {right}");
    }
}

/// Bodies mirror by their relief too.
#[test]
fn bodies_have_a_relief() {
    let folder = tempfile::tempdir().unwrap();
    // The sky above is bright: a normal that leans upwards mirrors it.
    picture(folder.path(), "up.exr", |_, _| Rgb([0.5, 0.5 + 0.5 * 0.6, 0.5 + 0.5 * 0.8]));
    let render = |key: &str| {
        let body = WALL.replace("material", "thickness = 1\nmaterial");
        let lamp = "[[object]]\nshape = \"rectangle\"\ncentre = [0, 40, 12]\nedge_u = [40, 0, 0]\nedge_v = [0, 0, 40]\nmaterial = \"lamp\"\n[material.lamp]\ntype = \"emissive\"\nradiance = 1\n";
        let text = format!(
            "{EYE}{body}{lamp}[material.wall]\ntype = \"translucent\"\nsigma_s = 0\nsigma_a = 50\ng = 0\neta = 1.5\n{key}\n"
        );
        let scene = load_in(folder.path(), &text);
        average(&render(
            &scene,
            &VolumePath::new(&scene, VolumePathOptions { photons: 0, ..Default::default() }).unwrap(),
            1,
        ))
    };
    let (flat, leaning) = (render(""), render("normal = { image = \"up.exr\" }"));
    assert!(flat < 1e-6 && (0.035..0.06).contains(&leaning), "{flat} {leaning}");
}

/// What a mask takes away is seen through, lights through it and mirrors nothing; where it is half there half of the rays pass.
#[test]
fn masks_make_holes() {
    let folder = tempfile::tempdir().unwrap();
    picture(folder.path(), "mask.exr", |x, _| {
        Rgb::splat(match x / 16 {
            0 => 0.0,
            1 => 1.0,
            2 => 0.25,
            _ => 0.75,
        })
    });
    // A black screen before a white wall; light comes from the camera's side, slightly from aside.
    let screen = "[[object]]\nname = \"screen\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [4, 0, 0]\nedge_v = [0, 4, 0]\nmaterial = \"screen\"\n";
    let wall = WALL.replace("[0, 0, 0]", "[0, 0, -1]");
    let text = |light: &str| {
        format!(
            "{EYE}{screen}{wall}{light}[material.wall]\ntype = \"diffuse\"\nalbedo = 1\n[material.screen]\ntype = \"diffuse\"\nalbedo = 0\n\
             opacity = {{ image = \"mask.exr\", wrap = \"clamp\" }}\n"
        )
    };
    let scene = load_in(folder.path(), &text(&sun([1e-7, 0.0, 1.0])));
    let column = |image: &Image, x: u32| (0..16).map(|y| image.get(x, y).unwrap()[0]).sum::<f32>() / 16.0 * PI / 2.0;
    let image = render(&scene, &paths(&scene), 256);
    // Where a ray of the camera passes, the light has to pass too.
    for (x, right) in [(1, 1.0), (5, 0.0), (10, 0.75 * 0.75), (14, 0.25 * 0.25)] {
        let found = column(&image, x);
        assert!((found - right).abs() < 0.03, "column {x}: {found} for {right}");
    }
    // Every backend sees the same holes.
    for backend in backends() {
        let rays = scene.rays(backend).unwrap();
        let other = run(&paths(&scene), View { scene: &scene, rays: &*rays }, 1, 0..16, &mut []).0.image();
        assert!((column(&other, 1) - 1.0).abs() < 1e-5 && column(&other, 5) == 0.0);
    }
}

#[test]
fn what_is_refused_says_why() {
    let folder = tempfile::tempdir().unwrap();
    picture(folder.path(), "half.exr", |_, _| Rgb::splat(0.5));
    let matt = "type = \"diffuse\"\nalbedo = 0.5";
    for (keys, words) in [
        (format!("{matt}\nbump = {{ image = \"half.exr\" }}"), "has no `height`"),
        (
            format!("{matt}\nbump = {{ image = \"half.exr\", height = 1 }}\nnormal = {{ image = \"half.exr\" }}"),
            "stands beside `normal`",
        ),
        (format!("{matt}\nopacity = 0.5"), "is a picture: { image"),
        (format!("{matt}\nopacity = {{ image = \"none.exr\" }}"), "none.exr"),
        (
            "type = \"emissive\"\nradiance = 1\nopacity = { image = \"half.exr\" }".into(),
            "is a table: pictures are for",
        ),
        (
            "type = \"translucent\"\nsigma_s_prime = 1\nsigma_a = 1\neta = 1.3\nopacity = { image = \"half.exr\" }"
                .into(),
            "is a table: pictures are for",
        ),
    ] {
        let text = format!("{EYE}{WALL}{SKY}[material.wall]\n{keys}\n");
        let said = match SceneFile::parse(&text, &folder.path().join("scene.toml")) {
            Ok(file) => Scene::load(&file).err().unwrap().to_string(),
            Err(said) => said.to_string(),
        };
        assert!(said.contains(words), "{keys}: {said}");
    }
}
