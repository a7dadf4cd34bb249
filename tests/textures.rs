//! Pictures on surfaces: what every method shows of them, what files are read, what is refused.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

mod refusals;
mod rendering;

use marmor::ErrorKind;
use marmor::film::{FilePicture, Image, Metadata, Window, save};
use marmor::geometry::{examine, load_mesh, load_mesh_with_uv};
use marmor::integrator::{
    Direct, Integrator, Path as Paths, Subsurface, SubsurfaceOptions, View, VolumePath, VolumePathOptions,
};
use marmor::math::{DVec3, Rgb};
use marmor::query::{self, Backend};
use marmor::render::{Aov, first_hit};
use marmor::scene::{Orders, Scene, SceneFile};
use refusals::failure;
use rendering::{film, load_in};
use std::f32::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

/// Albedos of a checker of 4 x 4 squares, no two rows or columns alike, from the top left.
fn square(x: u32, y: u32) -> Rgb {
    let v = 0.05 + 0.05 * (4 * y + x) as f32;
    Rgb([v, 0.9 - v, 0.5])
}

/// So fine that the middle of a square is far from all others.
fn checker() -> Image {
    Image::from_fn([32, 32], |x, y| square(x / 8, y / 8))
}

fn save_exr(image: &Image, folder: &Path, name: &str) {
    save(image, &folder.join(name), &Metadata::default(), Default::default()).unwrap();
}

/// An 8-bit PNG.
fn save_png(path: &Path, [width, height]: [u32; 2], colour: png::ColorType, codes: &[u8]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), width, height);
    encoder.set_color(colour);
    encoder.write_header().unwrap().write_image_data(codes).unwrap();
}

const EYE: &str = "unit = \"mm\"\n[camera]\nposition = [0, 0, 100]\nlook_at = [0, 0, 0]\nprojection = \"orthographic\"\nheight = 8\nresolution = [40, 40]\n";
const BALL: &str = "[[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [50, 0, 300]\nradius = 1\nmaterial = \"wax\"\n\
    [material.wax]\ntype = \"translucent\"\nsigma_s_prime = 1\nsigma_a = 0.1\neta = 1.3\nmodel = \"standard\"\n";
const WALL: &str = "[[object]]\nname = \"wall\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [4, 0, 0]\nedge_v = [0, 4, 0]\nmaterial = \"wall\"\n";
/// From behind the camera, along the view: the irradiance of the wall is 2.
const SUN: &str = "[[light]]\ntype = \"distant\"\ndirection = [0, 0, -1]\nirradiance = 2\n";

fn wall(texture: &str) -> String {
    format!("{EYE}{WALL}{SUN}{BALL}[material.wall]\ntype = \"diffuse\"\nalbedo = {texture}\n")
}

/// The pixel in the middle of each square, of 10 x 10 pixels.
fn middle(image: &Image, x: u32, y: u32) -> Rgb {
    image.get(10 * x + 5, 10 * y + 5).unwrap()
}

/// Every square has albedo/π times the irradiance.
fn shows(image: &Image, irradiance: f32, what: &str) {
    for (x, y) in (0..16).map(|i| (i % 4, i / 4)) {
        let (found, right) = (middle(image, x, y), square(x, y) * (irradiance / PI));
        for c in 0..3 {
            assert!((found[c] / right[c] - 1.0).abs() < 1e-3, "{what}: square {x},{y}: {found:?} for {right:?}");
        }
    }
}

fn volume_path(scene: &Scene) -> VolumePath {
    let options = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed: 1 };
    VolumePath::new(scene, options).unwrap()
}

fn subsurface(scene: &Scene, bounces: u32) -> Subsurface {
    Subsurface::new(scene, SubsurfaceOptions { cache_samples: 256, bounces, ..Default::default() }).unwrap()
}

#[test]
fn every_method_shows_each_square_by_its_albedo() {
    let folder = tempfile::tempdir().unwrap();
    save_exr(&checker(), folder.path(), "checker.exr");
    let scene = load_in(folder.path(), &wall("{ image = \"checker.exr\" }"));
    fn one(scene: &Scene, method: &impl Integrator, what: &str) {
        shows(&film(method, scene, 1, 1, &mut []).image(), 2.0, what);
    }
    one(&scene, &Direct::new(&scene, 1).unwrap(), "direct");
    one(&scene, &Paths::new(&scene, None, 1).unwrap(), "path");
    one(&scene, &volume_path(&scene), "volume_path");
    one(&scene, &subsurface(&scene, 0), "subsurface, straight from the lights");
    one(&scene, &subsurface(&scene, 8), "subsurface");
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let layer = first_hit(View { scene: &scene, rays: &*rays }, Window::full([40, 40]), Aov::Albedo);
    shows(&layer, PI, "the layer of albedos");
}

/// In the mirror image of a smooth ball too, where `subsurface` has no paths.
#[test]
fn a_mirror_image_has_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    save_exr(&Image::from_fn([2, 1], |x, _| Rgb::splat(x as f32)), folder.path(), "halves.exr");
    // A slab that looks up, seen from aside; the wall stands behind it.
    let text = |albedo: &str| {
        format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 10, 10]\nlook_at = [0, 0, 0]\nfov = 1\nresolution = [2, 1]\n{SUN}\
             [[object]]\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [0, 0, 5]\nedge_v = [5, 0, 0]\nthickness = 1\nmaterial = \"wax\"\n\
             [[object]]\nshape = \"rectangle\"\ncentre = [0, 10, -10]\nedge_u = [20, 0, 0]\nedge_v = [0, 20, 0]\nmaterial = \"wall\"\n\
             [material.wax]\ntype = \"translucent\"\nsigma_s = 0.001\nsigma_a = 9\ng = 0\neta = 1.5\nmodel = \"standard\"\n\
             [material.wall]\ntype = \"diffuse\"\nalbedo = {albedo}\n"
        )
    };
    let render = |albedo: &str| {
        let scene = load_in(folder.path(), &text(albedo));
        film(&subsurface(&scene, 0), &scene, 1, 1, &mut []).image()
    };
    let (picture, white, black) = (render("{ image = \"halves.exr\", wrap = \"clamp\" }"), render("1"), render("0"));
    assert!(white.pixels[1][0] > 1.5 * black.pixels[1][0]);
    let share = |x: usize| (picture.pixels[x][0] - black.pixels[x][0]) / (white.pixels[x][0] - black.pixels[x][0]);
    assert!((share(0) - 0.5).abs() < 0.1 && share(0) < 0.5 && share(1) > 0.5, "{} {}", share(0), share(1));
}

/// What a path samples and what it asks of lights are both of the point: under an even sky each is half of it.
#[test]
fn paths_go_on_by_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    save_exr(&checker(), folder.path(), "checker.exr");
    let text = wall("{ image = \"checker.exr\" }").replace(SUN, "[environment]\nradiance = 1\n");
    let scene = load_in(folder.path(), &text);
    let render = |method: &dyn Fn() -> Image, what: &str| {
        let image = method();
        for (x, y) in (0..16).map(|i| (i % 4, i / 4)) {
            let (found, right) = (middle(&image, x, y), square(x, y));
            let off = (0..3).map(|c| (found[c] / right[c] - 1.0).abs()).fold(0.0, f32::max);
            assert!(off < 0.05, "{what}: square {x},{y}: {found:?} for {right:?}");
        }
    };
    render(&|| film(&Paths::new(&scene, None, 1).unwrap(), &scene, 256, 1, &mut []).image(), "path");
    render(&|| film(&volume_path(&scene), &scene, 256, 1, &mut []).image(), "volume_path");
    render(&|| film(&subsurface(&scene, 8), &scene, 256, 1, &mut []).image(), "subsurface");
}

/// Roulette is by the albedo there: under an even sky a white spot of a black picture is without noise.
#[test]
fn a_spot_of_a_dark_picture_is_without_noise() {
    let folder = tempfile::tempdir().unwrap();
    let spot = |x: u32, y: u32| Rgb::splat(if (12..20).contains(&x) && (12..20).contains(&y) { 1.0 } else { 0.0 });
    save_exr(&Image::from_fn([32, 32], spot), folder.path(), "spot.exr");
    let text = wall("{ image = \"spot.exr\" }").replace(SUN, "[environment]\nradiance = 1\n");
    let scene = load_in(folder.path(), &text.replace("height = 8", "height = 1"));
    for image in [
        film(&Paths::new(&scene, None, 1).unwrap(), &scene, 2, 1, &mut []).image(),
        film(&volume_path(&scene), &scene, 2, 1, &mut []).image(),
    ] {
        let (least, most) = image.pixels.iter().fold((f32::MAX, 0.0_f32), |(a, b), p| (a.min(p[0]), b.max(p[0])));
        assert!(least > 0.98 && most < 1.02, "{least} {most}");
    }
}

/// A floor along the sun, which sees nothing but a wall, black to the left and white to the right.
#[test]
fn light_between_surfaces_has_the_picture_at_its_points() {
    let folder = tempfile::tempdir().unwrap();
    save_exr(&Image::from_fn([64, 1], |x, _| Rgb::splat((x / 32) as f32)), folder.path(), "halves.exr");
    let text = |albedo: &str| {
        format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 20, 0.5]\nlook_at = [0, 0, 0.5]\nup = [0, 0, -1]\nfov = 4\nresolution = [2, 1]\n{SUN}\
             [[object]]\nname = \"wall\"\nshape = \"rectangle\"\ncentre = [0, 0, -1]\nedge_u = [4, 0, 0]\nedge_v = [0, 4, 0]\nmaterial = \"wall\"\n\
             [[object]]\nshape = \"rectangle\"\ncentre = [0, 0, 0.3]\nedge_u = [0, 0, 1.2]\nedge_v = [2, 0, 0]\nmaterial = \"floor\"\n\
             [material.floor]\ntype = \"diffuse\"\nalbedo = 0.1\n\
             [material.wall]\ntype = \"diffuse\"\nalbedo = {albedo}\n"
        )
    };
    let sides = |albedo: &str| {
        let scene = load_in(folder.path(), &text(albedo));
        let image = film(&Paths::new(&scene, Some(2), 1).unwrap(), &scene, 16384, 1, &mut []).image();
        [image.pixels[0][0], image.pixels[1][0]]
    };
    let ([left, right], white, black) = (sides("{ image = \"halves.exr\" }"), sides("1"), sides("0"));
    assert_eq!(black, [0.0; 2]);
    assert!((white[0] / white[1] - 1.0).abs() < 0.1, "{white:?}");
    assert!(right > 1.5 * left && left > 0.0, "{left} {right}");
    let share = (left + right) / (white[0] + white[1]);
    assert!((share - 0.5).abs() < 0.05, "{share}");
}

#[test]
fn the_top_row_is_at_v_1_and_edges_are_as_asked() {
    let folder = tempfile::tempdir().unwrap();
    save_exr(&Image::from_fn([1, 2], |_, y| Rgb::splat(1.0 - y as f32)), folder.path(), "up.exr");
    // Twice as large as the picture's own square, moved: u and v from -0.5 to 1.5.
    let obj = "v -4 -4 0\nv 4 -4 0\nv 4 4 0\nv -4 4 0\nvt -0.5 -0.5\nvt 1.5 -0.5\nvt 1.5 1.5\nvt -0.5 1.5\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.path().join("wall.obj"), obj).unwrap();
    let text = |wrap: &str| {
        wall(&format!("{{ image = \"up.exr\", scale = 0.5, wrap = \"{wrap}\" }}")).replace(
            "shape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [4, 0, 0]\nedge_v = [0, 4, 0]",
            "mesh = \"wall.obj\"",
        )
    };
    let column = |wrap: &str| {
        let scene = load_in(folder.path(), &text(wrap));
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let image = film(&Direct::new(&scene, 1).unwrap(), &scene, 1, 1, &mut []).image();
        // v at rows 4, 14, ...: 1.275, 0.775, 0.275, -0.225, give or take half a pixel.
        [5, 15, 25, 35].map(|y| image.get(20, y).unwrap()[0] * PI)
    };
    let is = |found: [f32; 4], right: [f32; 4]| {
        assert!(found.iter().zip(right).all(|(a, b)| (a - b).abs() < 0.12), "{found:?} for {right:?}");
    };
    is(column("clamp"), [1.0, 1.0, 0.0, 0.0]);
    is(column("repeat"), [0.0, 1.0, 0.0, 1.0]);
}

#[test]
fn codes_are_srgb_and_floats_linear() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    save_png(&at("rgb.png"), [2, 1], png::ColorType::Rgb, &[128, 0, 255, 1, 2, 3]);
    save_png(&at("grey.png"), [1, 1], png::ColorType::Grayscale, &[128]);
    save_png(&at("alpha.png"), [1, 1], png::ColorType::Rgba, &[128, 64, 32, 7]);
    let read = |name: &str| FilePicture::read_texture(&at(name), None, false).unwrap();
    let near = |found: Rgb, right: [f32; 3]| {
        assert!((0..3).all(|c| (found[c] - right[c]).abs() < 1e-5), "{found:?} for {right:?}");
    };
    near(read("rgb.png").image.pixels[0], [0.215_860_5, 0.0, 1.0]);
    near(read("rgb.png").image.pixels[1], [1.0 / 255.0 / 12.92, 2.0 / 255.0 / 12.92, 3.0 / 255.0 / 12.92]);
    near(read("grey.png").image.pixels[0], [0.215_860_5; 3]);
    near(read("alpha.png").image.pixels[0], [0.215_860_5, 0.051_269_5, 0.014_443_84]);
    assert_eq!(read("alpha.png").remarks, ["its alpha is ignored"]);
    // 16 bits, and a palette.
    let mut encoder = png::Encoder::new(std::fs::File::create(at("deep.png")).unwrap(), 1, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&[0x80, 0x80]).unwrap();
    near(read("deep.png").image.pixels[0], [0.215_860_5; 3]);
    let mut encoder = png::Encoder::new(std::fs::File::create(at("few.png")).unwrap(), 3, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Two);
    encoder.set_palette(vec![0, 0, 0, 255, 128, 0]);
    encoder.write_header().unwrap().write_image_data(&[0b0100_0100]).unwrap();
    let few = read("few.png").image.pixels;
    near(few[0], [1.0, 0.215_860_5, 0.0]);
    near(few[1], [0.0; 3]);
    // A grey JPEG of one block, made by hand.
    std::fs::write(at("a.jpg"), jpeg()).unwrap();
    let grey = read("a.jpg").image;
    assert_eq!(grey.resolution, [8, 8]);
    grey.pixels.iter().for_each(|p| near(*p, [0.215_860_5; 3]));
    // What holds floats is linear.
    save_exr(&Image::from_fn([1, 1], |_, _| Rgb([0.25, 0.5, 0.75])), folder.path(), "a.exr");
    near(read("a.exr").image.pixels[0], [0.25, 0.5, 0.75]);
    std::fs::write(
        at("a.hdr"),
        [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n".as_slice(), &[64, 128, 192, 128]].concat(),
    )
    .unwrap();
    near(read("a.hdr").image.pixels[0], [0.25, 0.5, 0.75]);
}

/// Baseline, 8 x 8, one component: a table of quantisation of ones, one code each for DC (0) and AC (0, the end of the block).
fn jpeg() -> Vec<u8> {
    let codes = |class: u8| [&[0xff, 0xc4, 0, 20, class, 1][..], &[0; 16]].concat();
    let parts = [
        vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0],
        vec![1; 64],
        vec![0xff, 0xc0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0],
        codes(0x00),
        codes(0x10),
        vec![0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 0b0011_1111, 0xff, 0xd9],
    ];
    parts.concat()
}

#[test]
fn values_that_are_no_albedo_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let odd = Image::from_fn([2, 2], |x, y| match (x, y) {
        (0, 0) => Rgb([-0.5, f32::NAN, 0.5]),
        (1, 1) => Rgb([1.5, 3.0, f32::INFINITY]),
        _ => Rgb::splat(0.5),
    });
    save_exr(&odd, folder.path(), "odd.exr");
    let scene = load_in(folder.path(), &wall("{ image = \"odd.exr\" }"));
    let said = scene.warnings.join("\n");
    for part in ["scene.toml:", "odd.exr", "5 of 12 values", "1 below 0", "3 above 1", "1 not a number", "`scale`"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let mean = scene.surface(0).bsdf.albedo();
    assert!((mean[0] - (0.0 + 1.0 + 0.5 + 0.5) / 4.0).abs() < 1e-6 && mean.max() <= 1.0, "{mean:?}");
    // A factor that makes it right.
    let scene = load_in(folder.path(), &wall("{ image = \"odd.exr\", scale = [0.1, 0.2, 0] }"));
    assert!(!scene.warnings.join("\n").contains("3 above 1"), "{:?}", scene.warnings);
}

/// Meshes have coordinates only where their material has a picture, and pictures alike are one.
#[test]
fn nothing_is_kept_that_nobody_needs() {
    let folder = tempfile::tempdir().unwrap();
    save_exr(&checker(), folder.path(), "a.exr");
    std::fs::write(folder.path().join("cube.obj"), cube(true)).unwrap();
    let object = |geometry: &str, material: &str| format!("[[object]]\n{geometry}\nmaterial = \"{material}\"\n");
    let (mesh, ball) = ("mesh = \"cube.obj\"", "shape = \"sphere\"\ncentre = [9, 0, 0]\nradius = 1");
    let wall = "shape = \"rectangle\"\ncentre = [0, 9, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0, 1]";
    let all = [(mesh, "one"), (mesh, "grey"), (ball, "two"), (ball, "grey"), (wall, "other"), (wall, "grey")];
    let objects: String = all.map(|(geometry, material)| object(geometry, material)).concat();
    let text = format!(
        "{EYE}{objects}{SUN}[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n\
         [material.one]\ntype = \"diffuse\"\nalbedo = {{ image = \"a.exr\" }}\n\
         [material.two]\ntype = \"diffuse\"\nalbedo = {{ image = \"a.exr\" }}\n\
         [material.other]\ntype = \"diffuse\"\nalbedo = {{ image = \"a.exr\", wrap = \"clamp\" }}\n"
    );
    let scene = load_in(folder.path(), &text);
    let has: Vec<bool> = scene.objects.iter().map(|o| o.mesh.uv.is_some()).collect();
    assert_eq!(has, [true, false, true, false, true, false]);
    let texture = |object: u32| scene.surface(object).pictures().next().unwrap();
    assert!(std::ptr::eq(&**texture(0), &**texture(2)) && !std::ptr::eq(&**texture(0), &**texture(4)));
    assert_eq!(texture(0).resolution(), [32, 32]);
}

/// A cube of six faces with corners of their own in the picture: each position has three of them.
fn cube(with_uv: bool) -> String {
    let mut text = String::new();
    for i in 0..8 {
        writeln!(text, "v {} {} {}", 2 * (i & 1) - 1, (i & 2) - 1, (i & 4) / 2 - 1).unwrap();
    }
    for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
        writeln!(text, "vt {u} {v}").unwrap();
    }
    for face in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        let corner = |(k, i): (usize, &u32)| if with_uv { format!(" {i}/{}", k + 1) } else { format!(" {i}") };
        writeln!(text, "f{}", face.iter().enumerate().map(corner).collect::<String>()).unwrap();
    }
    text
}

#[test]
fn coordinates_break_no_body() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let scene = |name: &str, with_uv: bool| {
        std::fs::write(path(name), cube(with_uv)).unwrap();
        let text = format!(
            "{}[[object]]\nmesh = \"{name}\"\nmaterial = \"wax\"\nnormals = \"smooth\"\n{}[environment]\nradiance = 1\n",
            EYE.replace("[40, 40]", "[6, 6]"),
            &BALL[BALL.find("[material").unwrap()..]
        );
        load_in(folder.path(), &text)
    };
    let (bare, with) = (scene("bare.obj", false), scene("with.obj", true));
    assert_eq!(with.warnings, bare.warnings);
    let (a, b) = (&bare.objects[0], &with.objects[0]);
    assert_eq!((a.mesh.fingerprint(), &a.findings), (b.mesh.fingerprint(), &b.findings));
    assert!(b.mesh.uv.is_none(), "nobody asks for them");
    let render = |scene: &Scene| film(&subsurface(scene, 2), scene, 2, 1, &mut []).image();
    assert_eq!(render(&bare), render(&with));
    // With them it is as closed.
    let mesh = load_mesh_with_uv(&path("with.obj")).unwrap();
    assert_eq!(mesh.without_uv(), 0);
    let found = examine(&mesh.recentred(DVec3::ZERO));
    assert!(found.open_edges == 0 && (found.volume.unwrap() - 8.0).abs() < 1e-9, "{found:?}");
    assert!(load_mesh(&path("with.obj")).unwrap().uv.is_none());
}

/// What a scene with a picture is refused for: what is typed for the albedo, or in place of what.
#[test]
fn what_is_refused_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    save_exr(&checker(), folder.path(), "a.exr");
    save_png(&at("a.png"), [1, 1], png::ColorType::Grayscale, &[128]);
    std::fs::write(at("a.tif"), b"II*\0").unwrap();
    std::fs::write(at("empty.png"), b"").unwrap();
    let whole = std::fs::read(at("a.png")).unwrap();
    std::fs::write(at("cut.png"), &whole[..45]).unwrap();
    std::fs::write(at("cut.jpg"), &jpeg()[..80]).unwrap();
    // A picture of 60000 x 60000 in a few bytes.
    let mut wide = Vec::new();
    drop(png::Encoder::new(&mut wide, 60000, 60000).write_header().unwrap());
    let wide = [&wide[..33], &whole[33..]].concat();
    std::fs::write(at("wide.png"), wide).unwrap();
    std::fs::write(at("bare.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1 3 4\n").unwrap();
    let load = |text: &str| {
        let file = SceneFile::parse(text, &at("scene.toml"))?;
        Scene::load(&file)
    };
    let (scene, file) = (ErrorKind::Scene, ErrorKind::File);
    let albedo = |text: &str| wall(text);
    let shape = "shape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [4, 0, 0]\nedge_v = [0, 4, 0]";
    let good = albedo("{ image = \"a.exr\" }");
    assert!(load(&good).is_ok());
    let cases = [
        (albedo("{ picture = \"a.exr\" }"), scene, &["`picture` is not a key", "image, layer, scale, wrap"][..]),
        (albedo("{ scale = 1 }"), scene, &["`material.wall.albedo.image` is missing", "PNG, JPEG, EXR or HDR"]),
        (albedo("{ image = \"a.exr\", scale = -1 }"), scene, &["scale` is -1", "none negative"]),
        (albedo("{ image = \"a.exr\", wrap = \"mirror\" }"), scene, &["wrap` is the text \"mirror\"", "\"clamp\""]),
        (albedo("\"a.exr\""), scene, &["albedo` is the text", "{ image = "]),
        (albedo("{ image = \"gone.png\" }"), file, &["scene.toml:", "gone.png"]),
        (albedo("{ image = \"a.tif\" }"), file, &["a.tif", "none of PNG, JPEG, EXR and Radiance HDR"]),
        (albedo("{ image = \"empty.png\" }"), file, &["empty.png", "the file is empty"]),
        (albedo("{ image = \"cut.png\" }"), file, &["cut.png", "the file is"]),
        (albedo("{ image = \"cut.jpg\" }"), file, &["cut.jpg", "the file is"]),
        (albedo("{ image = \"wide.png\" }"), file, &["wide.png", "too small for its picture"]),
        (albedo("{ image = \"a.png\", layer = \"x\" }"), file, &["a PNG file, which has no layers", "`x`"]),
        (
            good.replace(shape, "mesh = \"bare.obj\""),
            scene,
            &[
                "object \"wall\"",
                "\"wall\" has a picture",
                "1 of 2 triangles of bare.obj has no texture coordinates",
                "`vt`",
            ],
        ),
        (
            good.replace("sigma_s_prime = 1", "sigma_s_prime = { image = \"a.exr\" }"),
            scene,
            &["`material.wax.sigma_s_prime` is a table", "pictures are for `albedo`"],
        ),
    ];
    for (text, kind, parts) in cases {
        let (message, found) = failure(load(&text), &text);
        assert_eq!(found, kind, "{message}");
        parts.iter().for_each(|part| assert!(message.contains(part), "{part}: {message}"));
    }
    #[cfg(unix)]
    {
        let (message, _) = failure(load(&albedo("{ image = \"/dev/zero\" }")), "endless");
        assert!(message.contains("a pipe or a device"), "{message}");
    }
    // The picture is among what is read, so that no output is written over it.
    let inputs = SceneFile::parse(&good, &at("scene.toml")).unwrap().inputs();
    assert!(inputs.contains(&("the picture of material \"wall\"".to_string(), at("a.exr"))), "{inputs:?}");
}
