//! Hostile input: text and bytes made from good ones by random changes. Nothing may panic, hang, or take memory without
//! a check. A second for each kind of input in the suite; for as long as one likes:
//!
//!     (ulimit -v 2000000; MARMOR_FUZZ_SECONDS=600 nice cargo test --release --test fuzz -- --nocapture obj)
//!
//! With `ulimit -v` a request for more memory than that ends the program. `MARMOR_FUZZ_SEED` starts elsewhere. An input
//! that panics is printed and left in the folder for temporary files, with its number.
#![allow(clippy::unwrap_used)] // a fixture that cannot be made is a failed test
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

use marmor::bssrdf::{ModelName, ModelOptions, WidthFit};
use marmor::film::{
    Checkpoint, FilePicture, Film, Identity, Image, Metadata, PngOptions, Window, read_attributes, save,
};
use marmor::geometry::{examine, load_mesh_with_uv, mended};
use marmor::integrator::{Direct, Subsurface, SubsurfaceOptions};
use marmor::math::{DVec3, Rgb, hash};
use marmor::report::{Batch, BatchOptions};
use marmor::scene::{Estimator, Scene, SceneFile};
use meshes::{Shape, base64};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

#[path = "support/meshes.rs"]
mod meshes;
mod rendering;

/// No input of a few kilobytes may take longer, in the suite's build too.
const LONGEST: Duration = Duration::from_secs(20);

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(1);
        hash(self.0)
    }

    /// A number below `n`, which is at least 1.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Things that break readers of numbers and texts.
const TOKENS: &[&str] = &[
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "65536",
    "65537",
    "4294967295",
    "4294967296",
    "2147483648",
    "9223372036854775807",
    "18446744073709551616",
    "1e-45",
    "1e-300",
    "1e38",
    "1e39",
    "1e308",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "-1.#IND",
    "0.5",
    "[",
    "]",
    "{",
    "}",
    "\"",
    "'",
    "=",
    ",",
    ".",
    "/",
    "//",
    "\\",
    "\n",
    "\r\n",
    "\t",
    "#",
    "\u{feff}",
    "\u{0}",
    "é",
    "[0, 0, 0]",
    "[1, 1, 1]",
    "true",
    "f 1 2 3",
    "f -1 -1 -1",
    "v 0 0 0",
    "vn 0 0 0",
    "\\\n",
];

fn mutate(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..1 + random.below(8) {
        let at = random.below(bytes.len() + 1);
        match random.below(9) {
            0 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
            1 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = random.next() as u8;
                }
            }
            2 => bytes.truncate(at),
            3 => {
                let end = (at + 1 + random.below(20)).min(bytes.len());
                bytes.drain(at.min(end)..end);
            }
            4 => {
                let end = (at + random.below(200)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                let to = random.below(bytes.len() + 1);
                bytes.splice(to..to, piece);
            }
            5 => {
                let other = &seeds[random.below(seeds.len())];
                let from = random.below(other.len() + 1);
                let end = (from + random.below(300)).min(other.len());
                bytes.splice(at..at, other[from..end].iter().copied());
            }
            6 => {
                // Eight bytes of a size or an offset.
                let value = [0, 1, 255, 1 << 16, (1 << 31) - 1, 1 << 32, u64::MAX, u64::MAX / 2][random.below(8)];
                let width = [1, 2, 4, 8][random.below(4)];
                for (byte, new) in bytes.iter_mut().skip(at).zip(value.to_le_bytes()).take(width) {
                    *byte = new;
                }
            }
            _ => {
                // A token in the place of a word.
                let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"+-.".contains(b);
                let token = TOKENS[random.below(TOKENS.len())].as_bytes();
                let start = bytes[at..].iter().position(is_word).map_or(at, |i| at + i);
                let length = bytes[start..].iter().take_while(|b| is_word(b)).count();
                bytes.splice(start..start + length, token.iter().copied());
            }
        }
    }
    bytes.truncate(1 << 16);
    bytes
}

/// Feeds changed `seeds` to `read` until time is up; `read` says whether the input was accepted.
fn fuzz(name: &str, seeds: &[Vec<u8>], mut read: impl FnMut(&[u8], &Path) -> bool) {
    let variable = |name: &str| std::env::var(name).ok().and_then(|v| v.parse::<u64>().ok());
    let time = Duration::from_secs(variable("MARMOR_FUZZ_SECONDS").unwrap_or(1));
    let mut random = Random(hash(variable("MARMOR_FUZZ_SEED").unwrap_or(1)));
    let folder = tempfile::tempdir().unwrap();
    let (begin, mut longest) = (Instant::now(), Duration::ZERO);
    let (mut inputs, mut accepted) = (0_u64, 0_u64);
    for seed in seeds {
        assert!(read(seed, folder.path()), "{name}: a good input is refused: {}", String::from_utf8_lossy(seed));
    }
    while begin.elapsed() < time {
        let input = mutate(&mut random, seeds);
        let start = Instant::now();
        match catch_unwind(AssertUnwindSafe(|| read(&input, folder.path()))) {
            Ok(good) => accepted += u64::from(good),
            Err(_) => {
                let kept = std::env::temp_dir().join(format!("marmor-fuzz-{name}-{inputs}"));
                std::fs::write(&kept, &input).unwrap();
                panic!(
                    "{name}: input {inputs} panics; it is in {}:\n{}",
                    kept.display(),
                    String::from_utf8_lossy(&input)
                );
            }
        }
        let took = start.elapsed();
        assert!(took < LONGEST, "{name}: {took:?} for {}", String::from_utf8_lossy(&input));
        longest = longest.max(took);
        inputs += 1;
    }
    println!("{name}: {inputs} inputs, {accepted} accepted, the longest {longest:?}, {:?} in all", begin.elapsed());
    assert!(inputs > 10, "{name}: only {inputs} inputs");
}

fn lines(texts: &[&str]) -> Vec<Vec<u8>> {
    texts.iter().map(|t| t.as_bytes().to_vec()).collect()
}

const SCENE: &str = r#"unit = "mm"
[camera]
position = [0, 1, 6]
look_at = [0, 0, 0]
up = [0, 1, 0]
fov = 30
fov_axis = "smaller"
resolution = [8, 6]
[[object]]
name = "body"
shape = "sphere"
centre = [0, 0, 0]
radius = 1
rings = 8
segments = 16
normals = "smooth"
flip = false
material = "wax"
transform = { scale = [1, 2, 3], rotate = [0, 45, 0], translate = [1, 0, 0] }
[[object]]
name = "lamp"
shape = "rectangle"
centre = [0, 4, 0]
edge_u = [1, 0, 0]
edge_v = [0, 0, 1]
material = "lamp"
transform = { matrix = [[1,0,0],[0,1,0],[0,0,1]] }
[environment]
radiance = 0.1
[material.wax]
type = "translucent"
sigma_s_prime = [2, 3, 4]
sigma_a = [0.05, 0.1, 0.2]
g = 0.5
eta = 1.3
per = "cm"
scale = 2
model = "better"
thickness = 40
[material.stone]
type = "translucent"
preset = "marble"
[material.lamp]
type = "emissive"
radiance = [5, 4, 3]
two_sided = true
[method]
name = "subsurface"
cache_samples = 100
estimator = "cut"
[render]
spp = 4
seed = 7
exposure = 0.5
"#;

#[test]
fn scene() {
    let seeds = lines(&[
        SCENE,
        &SCENE.replace("model = \"better\"", "model = \"slab\""),
        &SCENE.replace("\"cut\"", "\"notes\""),
    ]);
    fuzz("scene", &seeds, |bytes, folder| {
        let Ok(text) = std::str::from_utf8(bytes) else { return false };
        let Ok(file) = SceneFile::parse(text, &folder.join("scene.toml")) else { return false };
        let _ = file.with(&["material.wax.eta=1.4", "object.0.name=x"]).map(|f| f.effective());
        let Ok(scene) = Scene::load(&file) else { return false };
        // Tables of both methods with light, as a render would make them.
        let _ = Direct::new(&scene, 1);
        let options = SubsurfaceOptions { cut_error: Some(0.1), ..rendering::options(Estimator::Cut, 100, 1) };
        let _ = Subsurface::new(&scene, options);
        scene.objects.iter().for_each(|o| drop(scene.remarks(o)));
        true
    });
}

#[test]
fn obj() {
    let cube = "# a cube\nmtllib x.mtl\no cube\nv -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\nvn 0 0 1\nvn 0 1 0\nvt 0 0\ng a\nusemtl m\nf 1/1/1 3/1/1 4/1/2 2/1/2\nf 5//1 6//1 8//2 7//2\nf -8 -7 -3 -4\ns off\nf 3 7 8 \\\n 4\nl 1 2\np 1\n";
    let colours = "v 0 0 0 0.1 0.2 0.3\nv 1 0 0 1 1 1\nv 0 1 0 0 0 0\nf 1 2 3\nv 1 1 1 2\nf 2 3 4\n";
    // A plate with a bridged hole, and a soup of triangles whose corners lie a little apart.
    let plate = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1 1//1 5//1 6//1 7//1 8//1 5//1\rf 4 6 7 8 3\n";
    let soup = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 1.00001 0 0\nv 1 1 0\nv 0 0.99999 0\nf -3 -2 -1\nv 0 0 0\nv 0 1 1e-5\nv -1 0 0\nf -3 -2 -1\n";
    let seeds = lines(&[cube, colours, plate, soup]);
    fuzz("obj", &seeds, |bytes, folder| mesh(&folder.join("m.obj"), bytes));
}

fn mesh(path: &Path, bytes: &[u8]) -> bool {
    std::fs::write(path, bytes).unwrap();
    let Ok(mesh) = load_mesh_with_uv(path) else { return false };
    let _ = mesh.without_uv();
    examine(&mesh.recentred(DVec3::ZERO));
    mesh.parts.labels().iter().for_each(|label| drop(mesh.portion(|l| l == label)));
    let (mesh, _) = mended(mesh);
    examine(&mesh.with_smooth_normals().recentred(DVec3::ONE));
    true
}

#[test]
fn ply() {
    let shape = Shape::bulged(1);
    let seeds = [shape.ply_ascii(), shape.ply_binary(false), shape.ply_binary(true)];
    fuzz("ply", &seeds, |bytes, folder| mesh(&folder.join("m.ply"), bytes));
}

#[test]
fn stl() {
    let bare = Shape::bulged(1).bare();
    fuzz("stl", &[bare.stl_ascii(), bare.stl_binary()], |bytes, folder| mesh(&folder.join("m.stl"), bytes));
}

#[test]
fn gltf() {
    let shape = Shape::bulged(1);
    let data = format!("\"uri\":\"data:;base64,{}\",", base64(&shape.gltf("").1));
    let seeds = [shape.glb(), shape.gltf(&data).0.into_bytes()];
    fuzz("gltf", &seeds, |bytes, folder| mesh(&folder.join("m.glb"), bytes));
}

#[test]
fn exr() {
    let folder = tempfile::tempdir().unwrap();
    let seeds: Vec<Vec<u8>> = [[3, 2], [40, 33]]
        .into_iter()
        .map(|size| {
            let path = folder.path().join("a.exr");
            let image = Image::from_fn(size, |x, y| Rgb([x as f32, 0.1 * y as f32, hash(u64::from(x * y)) as f32]));
            save(&image, &path, &Metadata::default(), PngOptions::default()).unwrap();
            std::fs::read(&path).unwrap()
        })
        .collect();
    fuzz("exr", &seeds, |bytes, folder| {
        let path = folder.join("a.exr");
        std::fs::write(&path, bytes).unwrap();
        let _ = read_attributes(&path);
        let _ = Image::read_exr_layer(&path, Some("sss"));
        Image::read_exr(&path).is_ok()
    });
}

#[test]
fn hdr() {
    let flat = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nPRIMARIES=0.64 0.33 0.29 0.6 0.15 0.06 0.333 0.333\n\n-Y 2 +X 3\n\
        0123456789abz123\x01\x01\x01\x02";
    let runs = b"#?RGBE\nFORMAT=32-bit_rle_xyze\n\n+X 2 -Y 9\n\x02\x02\x00\x09\x89a\x04bcde\x85f\x89g\x89\x80\x02\x02\x00\x09\x89a\x04bcde\x85f\x89g\x89\x80";
    fuzz("hdr", &[flat.to_vec(), runs.to_vec()], |bytes, folder| {
        let path = folder.join("a.hdr");
        std::fs::write(&path, bytes).unwrap();
        Image::read_exr(&path).is_ok()
    });
}

/// A JPEG of 8 x 8 pixels of each component, all of one value: tables of one code each.
fn jpeg(frame: u8, components: &[u8], data: &[u8]) -> Vec<u8> {
    let codes = |class: u8| [&[0xff, 0xc4, 0, 20, class, 1][..], &[0; 16]].concat();
    let n = components.len() as u8;
    let of_frame = components.iter().zip(1..).flat_map(|(&sampling, id)| [id, sampling, 0]);
    let of_scan = (1..=n).flat_map(|id| [id, 0]);
    let last = if frame == 0xc2 { 0 } else { 63 };
    let parts = [
        vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0],
        vec![1; 64],
        [0xff, frame, 0, 8 + 3 * n, 8, 0, 8, 0, 8, n].into_iter().chain(of_frame).collect(),
        codes(0x00),
        codes(0x10),
        [0xff, 0xda, 0, 6 + 2 * n, n].into_iter().chain(of_scan).chain([0, last, 0]).collect(),
        data.to_vec(),
        vec![0xff, 0xd9],
    ];
    parts.concat()
}

/// A PNG with checksums of its own, so that changes reach what is behind them.
fn with_checksums(mut bytes: Vec<u8>) -> Vec<u8> {
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let end = at + 8 + length;
        let Some(chunk) = bytes.get(at + 4..end) else { break };
        let bit = |crc: u32| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        let byte = |crc: u32, &byte: &u8| (0..8).fold(crc ^ u32::from(byte), |crc, _| bit(crc));
        let crc = !chunk.iter().fold(u32::MAX, byte);
        let Some(old) = bytes.get_mut(end..end + 4) else { break };
        old.copy_from_slice(&crc.to_be_bytes());
        at = end + 4;
    }
    bytes
}

#[test]
fn picture() {
    let png = |colour: png::ColorType, depth: png::BitDepth, codes: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 4, 4);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == png::ColorType::Indexed {
            encoder.set_palette(vec![0, 0, 0, 255, 128, 0, 1, 2, 3]);
        }
        encoder.write_header().unwrap().write_image_data(codes).unwrap();
        bytes
    };
    let codes: Vec<u8> = (0..128).map(|i| (hash(i) >> 9) as u8).collect();
    let seeds = [
        png(png::ColorType::Rgba, png::BitDepth::Sixteen, &codes),
        png(png::ColorType::Rgb, png::BitDepth::Eight, &codes[..48]),
        png(png::ColorType::Indexed, png::BitDepth::Two, &[0b0001_1000; 4]),
        jpeg(0xc0, &[0x11], &[0b0011_1111]),
        jpeg(0xc0, &[0x22, 0x11, 0x11], &[0, 0b0000_1111]),
        jpeg(0xc2, &[0x11, 0x11, 0x11], &[0b0001_1111]),
    ];
    for seed in &seeds {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, seed).unwrap();
        FilePicture::read_texture(&path, None, false).unwrap();
    }
    fuzz("picture", &seeds, |bytes, folder| {
        let path = folder.join("a");
        std::fs::write(&path, with_checksums(bytes.to_vec())).unwrap();
        FilePicture::read_texture(&path, None, false).is_ok()
    });
}

#[test]
fn film() {
    let folder = tempfile::tempdir().unwrap();
    let seeds: Vec<Vec<u8>> = [1, 3]
        .into_iter()
        .map(|passes| {
            let window = Window { x0: 1, y0: 1, x1: 6, y1: 5 };
            let mut film = Film::new([7, 6], window).unwrap();
            for pass in 0..passes {
                let sample = |i: usize| Rgb::splat(hash((i + pass) as u64) as f32 * 1e-18);
                film.add(window, &(0..window.area()).map(sample).collect::<Vec<_>>());
                film.end_pass();
            }
            let path = folder.path().join("a.film");
            let identity = Identity(vec![("seed".into(), "1".into()), ("scene".into(), "a\nb\n".into())]);
            Checkpoint::write(&path, &film, &identity, &[], serde_json::json!({})).unwrap();
            std::fs::read(&path).unwrap()
        })
        .collect();
    fuzz("film", &seeds, |bytes, folder| {
        let path = folder.join("a.film");
        // With its own checksum, so that changes reach what is behind it.
        let body = &bytes[..bytes.len().saturating_sub(8)];
        let sum = marmor::film::checksum(body);
        std::fs::write(&path, [body, &sum.to_le_bytes()].concat()).unwrap();
        let Ok(read) = Checkpoint::read(&path) else { return false };
        let mut film = read.film.clone();
        let _ = film.join(&read.film);
        let _ = (film.image(), film.half_images(), film.variance(), film.ranges_text());
        true
    });
}

#[test]
fn eval() {
    let plane = "sigma_s,sigma_a,g,eta,r\n1,0.1,0,1.3,0.5\n2.5,0.01,0.9,1.5,1e-3\n";
    let space = "x,y,z,nix,niy,niz,nox,noy,noz,wx,wy,wz,sigma_s,sigma_a,g,eta,label\n1,0,0,0,0,1,0,0,1,0,0,-1,2,0.1,0.5,1.3,a\n# c\n\n0,0,0,0,0,1,0,0,1,0.1,0,-0.9,2,0.1,0.5,1.3,b\n";
    let slab = "sigma_s,sigma_a,g,eta,r,thickness,eta_far\n1,0.1,0,1.3,0.5,8,1.3\n1,0.1,0,1.3,0.5,3,1\n";
    let mut turn = 0;
    fuzz("eval", &lines(&[plane, space, slab]), |bytes, _| {
        let text = String::from_utf8_lossy(bytes);
        let (mut good, mut out) = (false, String::new());
        turn += 1;
        let models = [ModelName::ALL[turn % ModelName::ALL.len()], ModelName::STANDARD];
        for model in models {
            let options = BatchOptions {
                model,
                made: ModelOptions { exit_normalisation: turn % 3 > 0, ..ModelOptions::DEFAULT },
                width: WidthFit::DiffusionLength,
                transmitted: false,
                clamped: turn % 2 > 0,
                single: turn % 5 == 0,
            };
            let mut rows = text.lines();
            let Some(Ok(mut batch)) = rows.next().map(|header| Batch::new(header, options)) else { continue };
            good = true;
            for row in rows.filter(|r| !r.trim().is_empty() && !r.starts_with('#')).take(20) {
                out.clear();
                let _ = batch.row(row, &mut out);
            }
        }
        good
    });
}
