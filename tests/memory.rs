//! The memory that `check` announces is what a render takes: told is 0.9 to 1.3 times what is taken, 8 MB aside.
#![cfg(all(feature = "cli", target_os = "linux"))]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::{ball, marmor, text};
use marmor::film::{Image, Metadata, save};
use marmor::geometry::{RawMesh, sphere_uv, write_obj};
use marmor::math::{DVec3, Rgb};
use marmor::query::Backend;
use std::fs;

/// What a program and its libraries take anyway, more or less of it in memory.
const ASIDE: f64 = 8e6;
/// Told over taken, at the least and at the most.
const FACTORS: [f64; 2] = [0.9, 1.3];

/// Told and taken [bytes] for a ball with these changes.
fn told_and_taken(folder: &std::path::Path, scene: &str, backend: Backend, more: &[&str]) -> (f64, f64) {
    let options = [&["--backend", backend.name()], more].concat();
    let check = marmor(folder, &[&["check", scene, "--json"], &options[..]].concat());
    assert!(check.status.success(), "{more:?}: {}", text(&check.stderr));
    let check: serde_json::Value = serde_json::from_slice(&check.stdout).unwrap();
    let outputs = ["-q", "-o", "x.exr", "-o", "x.png", "-o", "x.film", "--stats", "s.json", "--spp", "6"];
    let render = marmor(folder, &[&["render", scene], &outputs[..], &options[..]].concat());
    assert!(render.status.success(), "{more:?}: {}", text(&render.stderr));
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("s.json")).unwrap()).unwrap();
    (check["memory"]["peak"].as_f64().unwrap(), stats["peak_bytes"].as_f64().unwrap())
}

#[test]
fn what_is_told_is_what_is_taken() {
    let folder = command::folder(&ball([64, 64], "[environment]\nradiance = 1\n[method]\ncache_samples = 1000\n"));
    let folder = folder.path();
    let image = Image::from_fn([2048, 1024], |x, y| Rgb::splat((x ^ y) as f32 * 1e-3));
    save(&image, &folder.join("sky.exr"), &Metadata::default(), Default::default()).unwrap();
    let grey = png::Encoder::new(fs::File::create(folder.join("grey.png")).unwrap(), 1, 1);
    grey.write_header().unwrap().write_image_data(&[128]).unwrap();
    let mut encoder = png::Encoder::new(fs::File::create(folder.join("picture.png")).unwrap(), 2048, 1024);
    encoder.set_color(png::ColorType::Rgb);
    let codes: Vec<u8> = (0..2048 * 1024 * 3_u32).map(|i| (marmor::math::hash(i.into()) >> 56) as u8).collect();
    encoder.write_header().unwrap().write_image_data(&codes).unwrap();
    let fine = ["-D", "object.0.rings=256", "-D", "object.0.segments=512"];
    // Read from files, with corners in common and without, with normals and without.
    let ball = marmor::geometry::sphere(DVec3::ZERO, 1.0, 300, 600);
    let with_uv = RawMesh { uv: Some(sphere_uv(300, 600)), ..ball.clone() };
    let bare = RawMesh { normals: None, ..ball.clone() };
    let corners = ball.triangles.iter().flatten().map(|&i| ball.positions[i as usize]).collect();
    let apart = (0..ball.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let soup = RawMesh { positions: corners, triangles: apart, ..RawMesh::default() };
    let text = fs::read_to_string(folder.join("scene.toml")).unwrap();
    for (name, mesh) in [("ball", &ball), ("bare", &bare), ("soup", &soup), ("with_uv", &with_uv)] {
        let mut file = fs::File::create(folder.join(format!("{name}.obj"))).unwrap();
        write_obj(mesh, &mut std::io::BufWriter::new(&mut file)).unwrap();
        let shape = "shape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nrings = 16\nsegments = 32";
        assert!(text.contains(shape));
        let scene = text.replacen(shape, &format!("mesh = \"{name}.obj\""), 1);
        fs::write(folder.join(format!("{name}.toml")), scene).unwrap();
    }
    let picture = |file: &str| {
        [
            "-D object.1.material=picture -D material.picture.type=diffuse -D material.picture.albedo.image=",
            file,
            " --method direct",
        ]
        .concat()
    };
    let on_ball = picture("grey.png").replace("object.1", "object.0");
    let on_ball: Vec<&str> = on_ball.split(' ').collect();
    let pictures = [picture("sky.exr"), picture("picture.png")];
    let [exr, png] = [0, 1].map(|i| pictures[i].split(' ').collect::<Vec<_>>());
    let cases: [(&str, &[&str]); 9] = [
        ("small", &["--method", "direct"]),
        ("pixels", &["--method", "direct", "-D", "camera.resolution=[700,700]"]),
        ("triangles, direct", &[&["--method", "direct"][..], &fine].concat()),
        ("triangles, subsurface", &fine),
        ("cache", &["-D", "method.cache_samples=400000", "-D", "camera.resolution=[16,16]"]),
        ("photons", &["--method", "volume_path", "-D", "method.photons=80000", "-D", "camera.resolution=[16,16]"]),
        ("picture, floats", &exr),
        ("picture, codes", &png),
        ("sky", &["--method", "direct", "-D", "environment.image=sky.exr"]),
    ];
    for backend in Backend::ALL.into_iter().filter(|b| b.is_built_in()) {
        let files = ["ball", "bare", "soup"].map(|name| (name, format!("{name}.toml"), &[][..]));
        let files = files.into_iter().chain([("with_uv", "with_uv.toml".to_string(), &on_ball[..])]);
        let changes = cases.iter().map(|(name, more)| (*name, "scene.toml".to_string(), *more));
        for (name, scene, more) in changes.chain(files) {
            let (told, taken) = told_and_taken(folder, &scene, backend, more);
            println!("{} {name}: told {:.0} MB, taken {:.0} MB", backend.name(), told / 1e6, taken / 1e6);
            let [least, most] = FACTORS.map(|factor| factor * taken);
            assert!(
                (least - ASIDE..most + ASIDE).contains(&told),
                "{} {name}: told {told}, taken {taken}",
                backend.name()
            );
        }
    }
}
