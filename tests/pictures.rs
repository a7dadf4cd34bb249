//! Pictures that other programs wrote: EXR files of many layouts and primaries, and Radiance HDR.
#![allow(clippy::unwrap_used)] // a fixture that cannot be made is a failed test

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, write::WritableImage as _};
use exr::math::Vec2;
use exr::meta::attribute::{Chromaticities, EnvironmentMap, IntegerBounds};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::f16;
use marmor::film::{FilePicture, Image};
use marmor::math::Rgb;
use marmor::scene::{Scene, SceneFile};
use std::path::{Path, PathBuf};

const SIZE: [usize; 2] = [8, 4];

/// Writes 8 x 4 pixels: the named channels have one value each.
fn write(path: &Path, channels: &[(&str, f32)], change: impl FnOnce(&mut ImageAttributes, &mut LayerAttributes)) {
    let plane = |v: f32| FlatSamples::F32(vec![v; SIZE[0] * SIZE[1]]);
    let list = channels.iter().map(|(name, v)| AnyChannel::new(*name, plane(*v)));
    layer(path, AnyChannels::sort(list.collect()), change);
}

fn layer(
    path: &Path,
    channels: AnyChannels<FlatSamples>,
    change: impl FnOnce(&mut ImageAttributes, &mut LayerAttributes),
) {
    let mut image = ImageAttributes::new(IntegerBounds::new((0, 0), (SIZE[0], SIZE[1])));
    let mut own = LayerAttributes::default();
    change(&mut image, &mut own);
    let layer = Layer::new((SIZE[0], SIZE[1]), own, Encoding::SMALL_LOSSLESS, channels);
    ExrImage::from_layers(image, vec![layer]).write().to_file(path).unwrap();
}

fn chromaticities([rx, ry, gx, gy, bx, by, wx, wy]: [f32; 8]) -> Option<Chromaticities> {
    Some(Chromaticities { red: Vec2(rx, ry), green: Vec2(gx, gy), blue: Vec2(bx, by), white: Vec2(wx, wy) })
}

fn near(found: Rgb, expected: [f32; 3], tolerance: f32) {
    for c in 0..3 {
        assert!((found[c] - expected[c]).abs() <= tolerance, "{found:?} for {expected:?}");
    }
}

/// A scene under the picture `name` in `folder`, with `more` in `[environment]`.
fn sky(folder: &Path, name: &str, more: &str) -> marmor::Result<Scene> {
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 30\nresolution = [4, 4]\n[[object]]\nshape = \
         \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n[material.white]\ntype = \"diffuse\"\nalbedo = 1\n\
         [environment]\nimage = \"{name}\"\n{more}"
    );
    Scene::load(&SceneFile::parse(&text, &folder.join("scene.toml"))?)
}

#[test]
fn primaries_of_others_are_converted_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let colours = [("R", 0.2), ("G", 0.5), ("B", 0.8)];
    // By the published matrices; white stays white.
    let cases = [
        ([0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767], "ACEScg (AP1)", [-0.0365, 0.5359, 0.8531]),
        ([0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767], "ACES AP0", [-0.3728, 0.5541, 0.8551]),
        ([0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329], "Rec. 2020", [-0.0199, 0.5349, 0.8410]),
    ];
    for (xy, name, expected) in cases {
        write(&path, &colours, |image, _| image.chromaticities = chromaticities(xy));
        let read = FilePicture::read(&path, None).unwrap();
        near(read.image.get(3, 2).unwrap(), expected, 5e-4);
        assert_eq!(read.remarks, [format!("its primaries are {name}; converted to those of Rec. 709")]);
        write(&path, &[("R", 0.7), ("G", 0.7), ("B", 0.7)], |image, _| image.chromaticities = chromaticities(xy));
        near(Image::read_exr(&path).unwrap().get(0, 0).unwrap(), [0.7; 3], 1e-5);
    }
    // Those of Rec. 709, told or not, change no bit.
    for xy in [None, chromaticities([0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329])] {
        write(&path, &colours, |image, _| image.chromaticities = xy);
        let read = FilePicture::read(&path, None).unwrap();
        assert_eq!((read.image.get(0, 0), read.remarks), (Some(Rgb([0.2, 0.5, 0.8])), Vec::new()));
    }
    write(&path, &colours, |image, _| image.chromaticities = chromaticities([0.0; 8]));
    assert!(Image::read_exr(&path).unwrap_err().to_string().contains("no primaries"));
    // An environment says it, and what came out below 0.
    write(&path, &colours, |image, _| image.chromaticities = chromaticities(cases[0].0));
    let said = sky(folder.path(), "a.exr", "").unwrap().warnings.join("\n");
    assert!(said.contains("a.exr: its primaries are ACEScg (AP1)") && said.contains("(32 negative, 0 not"), "{said}");
}

#[test]
fn layers_and_greys_are_read_where_the_meaning_is_plain() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let read = |layer| FilePicture::read(&path, layer);
    let plain = |_: &mut ImageAttributes, _: &mut LayerAttributes| {};

    write(&path, &[("Y", 0.25), ("A", 1.0)], plain);
    let grey = read(None).unwrap();
    assert_eq!((grey.image.get(1, 1), grey.remarks.len()), (Some(Rgb::splat(0.25)), 1));
    assert!(grey.remarks[0].contains("taken as grey"), "{:?}", grey.remarks);

    let combined = [("ViewLayer.Combined.R", 1.0), ("ViewLayer.Combined.G", 2.0), ("ViewLayer.Combined.B", 3.0)];
    write(&path, &[&combined[..], &[("ViewLayer.Combined.A", 1.0), ("ViewLayer.Depth.Z", 9.0)]].concat(), plain);
    let only = read(None).unwrap();
    assert_eq!(only.image.get(1, 1), Some(Rgb([1.0, 2.0, 3.0])));
    assert!(only.remarks[0].contains("its layer `ViewLayer.Combined` is taken"), "{:?}", only.remarks);

    let other = [("ViewLayer.Diffuse.R", 4.0), ("ViewLayer.Diffuse.G", 5.0), ("ViewLayer.Diffuse.B", 6.0)];
    write(&path, &[&combined[..], &other[..]].concat(), plain);
    let message = read(None).unwrap_err().to_string();
    for words in ["2 layers", "`ViewLayer.Combined`, `ViewLayer.Diffuse`", "layer = \"...\" in [environment]"] {
        assert!(message.contains(words), "{message}");
    }
    let chosen = read(Some("ViewLayer.Diffuse")).unwrap();
    assert_eq!((chosen.image.get(0, 0), chosen.remarks.len()), (Some(Rgb([4.0, 5.0, 6.0])), 0));
    let scene = sky(folder.path(), "a.exr", "layer = \"ViewLayer.Diffuse\"").unwrap();
    assert_eq!(scene.environment.image.unwrap().get(0, 0), Some(Rgb([4.0, 5.0, 6.0])));
    assert!(sky(folder.path(), "a.exr", "layer = \"ViewLayer.Glossy\"").is_err());

    // R, G, B without a layer come first; a direction is no picture.
    write(&path, &[&combined[..], &[("R", 7.0), ("G", 8.0), ("B", 9.0)]].concat(), plain);
    let top = read(None).unwrap();
    assert_eq!((top.image.get(0, 0), top.remarks.len()), (Some(Rgb([7.0, 8.0, 9.0])), 0));
    write(&path, &[("N.X", 0.0), ("N.Y", 0.0), ("N.Z", 1.0)], plain);
    assert!(read(None).unwrap_err().to_string().contains("only N.X, N.Y, N.Z"));
    write(&path, &[("Y", 0.5), ("RY", 0.0), ("BY", 0.0)], plain);
    assert!(read(None).unwrap_err().to_string().contains("luminance and chroma"));
}

#[test]
fn what_an_environment_cannot_take_as_it_is_is_said_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let colours = [("R", 1.0), ("G", 1.0), ("B", 1.0)];
    write(&path, &colours, |_, own| own.environment_map = Some(EnvironmentMap::Cube));
    let refused = sky(folder.path(), "a.exr", "").err().unwrap().to_string();
    assert!(refused.contains("six sides of a cube"), "{refused}");
    write(&path, &colours, |_, own| own.environment_map = Some(EnvironmentMap::LatitudeLongitude));
    assert_eq!(sky(folder.path(), "a.exr", "").unwrap().warnings, Vec::<String>::new());
    write(&path, &colours, |image, _| image.pixel_aspect = 2.0);
    assert!(sky(folder.path(), "a.exr", "").unwrap().warnings[0].contains("2 times as wide as high"));
    // A sun beyond what 16 bits hold.
    let plane = |k: f32| {
        let value = |i: usize| {
            f16::from_f32(if i == 5 {
                1e6
            } else if i == 6 {
                65504.0
            } else {
                k
            })
        };
        FlatSamples::F16((0..SIZE[0] * SIZE[1]).map(value).collect())
    };
    let list = ["R", "G", "B"].map(|name| AnyChannel::new(name, plane(0.5)));
    layer(&path, AnyChannels::sort(list.into_iter().collect()), |_, _| {});
    let said = sky(folder.path(), "a.exr", "").unwrap().warnings.join("\n");
    assert!(said.contains("6 values are 65504 or infinite") && said.contains("3 infinite) and count as 0"), "{said}");
}

/// A code that this program does not know is named, and is no damage.
#[test]
fn new_compressions_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write(&path, &[("R", 1.0), ("G", 1.0), ("B", 1.0)], |_, _| {});
    let sound = std::fs::read(&path).unwrap();
    let name = b"compression\0compression\0\x01\0\0\0";
    let at = sound.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    for (code, said) in [(10, "HTJ2K256"), (11, "HTJ2K32"), (12, "LJ2K"), (13, "ZSTD (code 13)"), (77, "code 77")] {
        let mut bytes = sound.clone();
        bytes[at] = code;
        std::fs::write(&path, bytes).unwrap();
        let message = Image::read_exr(&path).unwrap_err().to_string();
        assert!(message.contains(said) && message.contains("save it again with ZIP"), "{message}");
        assert!(code == 77 || !message.contains("damaged"), "{message}");
    }
}

// --- Radiance HDR ------------------------------------------------------------------------------------------

fn hdr(folder: &Path, header: &str, pixels: &[u8]) -> PathBuf {
    let path = folder.join("a.hdr");
    std::fs::write(&path, [format!("#?RADIANCE\n{header}").as_bytes(), pixels].concat()).unwrap();
    path
}

/// Codes of an uncompressed picture: the exponent 129 makes 64 a half.
fn codes(values: &[u8]) -> Vec<u8> {
    values.iter().flat_map(|&v| [v, 2 * v, 3 * v, 129]).collect()
}

#[test]
fn every_orientation_has_its_first_pixel_where_the_header_says() {
    let folder = tempfile::tempdir().unwrap();
    // The file's pixels 10, 20, ... in order; rows of the picture from the top.
    #[rustfmt::skip]
    let cases = [
        ("-Y 2 +X 3", [[10, 20, 30], [40, 50, 60]]),
        ("-Y 2 -X 3", [[30, 20, 10], [60, 50, 40]]),
        ("+Y 2 +X 3", [[40, 50, 60], [10, 20, 30]]),
        ("+Y 2 -X 3", [[60, 50, 40], [30, 20, 10]]),
        ("+X 3 -Y 2", [[10, 30, 50], [20, 40, 60]]),
        ("-X 3 -Y 2", [[50, 30, 10], [60, 40, 20]]),
        ("+X 3 +Y 2", [[20, 40, 60], [10, 30, 50]]),
        ("-X 3 +Y 2", [[60, 40, 20], [50, 30, 10]]),
    ];
    for (size, rows) in cases {
        let path =
            hdr(folder.path(), &format!("FORMAT=32-bit_rle_rgbe\n\n{size}\n"), &codes(&[10, 20, 30, 40, 50, 60]));
        let read = FilePicture::read(&path, None).unwrap();
        assert_eq!((read.image.resolution, read.remarks.len()), ([3, 2], 0), "{size}");
        for (y, row) in rows.iter().enumerate() {
            for (x, value) in row.iter().enumerate() {
                let v = *value as f32 / 128.0;
                assert_eq!(read.image.get(x as u32, y as u32), Some(Rgb([v, 2.0 * v, 3.0 * v])), "{size} {x} {y}");
            }
        }
    }
}

#[test]
fn both_run_length_codes_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let read = |width: usize, pixels: &[u8]| {
        let path = hdr(folder.path(), &format!("FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X {width}\n"), pixels);
        FilePicture::read(&path, None).map(|read| read.image.pixels)
    };
    // The old one: one code, twice again; then 258 = 2 + 256 times another.
    let old = read(262, &[&codes(&[20])[..], &[1, 1, 1, 2], &codes(&[40])[..], &[1, 1, 1, 2], &[1, 1, 1, 1]].concat());
    let old = old.unwrap();
    let [twenty, forty] = [20.0, 40.0].map(|v: f32| Rgb([v / 128.0, 2.0 * v / 128.0, 3.0 * v / 128.0]));
    assert!(old[..3].iter().all(|p| *p == twenty) && old[3..].iter().all(|p| *p == forty) && old.len() == 262);
    // The new one: each channel by itself.
    let new = [2, 2, 0, 9, 137, 20, 4, 40, 41, 42, 43, 133, 44, 137, 60, 137, 129];
    let new = read(9, &new).unwrap();
    assert_eq!(new[0], Rgb([20.0 / 128.0, 40.0 / 128.0, 60.0 / 128.0]));
    assert_eq!((new[3][1], new[4][1], new[8][1]), (43.0 / 128.0, 44.0 / 128.0, 44.0 / 128.0));
    // Damage: a run beyond the line, a run of nothing, another width, a repeat before anything, an end.
    for (pixels, said) in [
        (&[2, 2, 0, 9, 138, 20][..], "damaged"),
        (&[2, 2, 0, 9, 0, 20], "damaged"),
        (&[2, 2, 0, 10, 137, 20], "damaged"),
        (&[1, 1, 1, 9], "damaged"),
        (&[2, 2, 0, 9, 137], "cut short in line 0 of its 1"),
    ] {
        let message = read(9, pixels).unwrap_err().to_string();
        assert!(message.contains(said), "{pixels:?}: {message}");
    }
}

#[test]
fn exposures_and_primaries_of_a_header_count() {
    let folder = tempfile::tempdir().unwrap();
    let read = |header: &str| {
        let path = hdr(folder.path(), &format!("{header}\n-Y 1 +X 1\n"), &[128, 128, 128, 130]);
        FilePicture::read(&path, None)
    };
    let grey = |header: &str| read(header).unwrap().image.pixels[0];
    assert_eq!(grey("FORMAT=32-bit_rle_rgbe\n"), Rgb::splat(2.0));
    assert_eq!(grey("# made by hand\r\nEXPOSURE= 1.0\r\n"), Rgb::splat(2.0));
    // Exposures multiply, and what is indented belongs to another picture.
    let exposed = read("EXPOSURE=4\nEXPOSURE=0.5\n\tEXPOSURE=7\nCOLORCORR=1 2 0.5\n").unwrap();
    assert_eq!(exposed.image.pixels[0], Rgb([1.0, 0.5, 2.0]));
    assert_eq!(exposed.remarks, ["its values were divided by the exposure that it names (2, 4, 1)"]);
    let seen = read("GAMMA=2.2\nVIEW= -vtv -vp 0 0 0\n\tVIEW= -vtl\n").unwrap();
    assert_eq!(seen.image.pixels[0], Rgb::splat(2.0));
    assert_eq!(seen.remarks, ["its header has `GAMMA=2.2`, `VIEW=-vtv -vp 0 0 0`, which is not heeded"]);
    // Greys stay grey; XYZ of equal energy is white, 179 times brighter.
    near(grey("PRIMARIES=0.64 0.33 0.29 0.6 0.15 0.06 0.333 0.333\n"), [2.0; 3], 2e-3);
    near(grey("FORMAT=32-bit_rle_xyze\n"), [2.0 / 179.0; 3], 1e-6);
    for (header, said) in [
        ("EXPOSURE=0\n", "its header has `EXPOSURE=0`"),
        ("EXPOSURE=1e300\nEXPOSURE=1e300\n", "its header has"),
        ("COLORCORR=1 2\n", "its header has"),
        ("FORMAT=32-bit_rle_spec\n", "its header has `FORMAT=32-bit_rle_spec`"),
        ("PRIMARIES=0 0 0 0 0 0 0 0\n", "no primaries"),
    ] {
        let message = read(header).unwrap_err().to_string();
        assert!(message.contains(said), "{header}: {message}");
    }
    for size in ["-Y 0 +X 1", "-Y 1 +Y 1", "1 1", "-Y 1 +X 99999999999"] {
        let path = hdr(folder.path(), &format!("\n{size}\n"), &[128, 128, 128, 130]);
        let message = FilePicture::read(&path, None).unwrap_err().to_string();
        assert!(message.contains("its size is"), "{size}: {message}");
    }
    let path = hdr(folder.path(), "\n-Y 1048576 +X 1048576\n", &[128, 128, 128, 130]);
    assert_eq!(FilePicture::read(&path, None).unwrap_err().kind(), marmor::ErrorKind::Memory);
}

/// The same sky as EXR and as HDR is the same environment, by its content whatever its name.
#[test]
fn an_environment_takes_a_radiance_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = hdr(folder.path(), "FORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n", &codes(&[10, 20, 30, 40, 50, 60, 70, 80]));
    std::fs::rename(path, folder.path().join("sky.exr")).unwrap();
    let scene = sky(folder.path(), "sky.exr", "").unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert_eq!(scene.environment.image.unwrap().get(2, 1), Some(Rgb([70.0 / 128.0, 140.0 / 128.0, 210.0 / 128.0])));
    let refused = sky(folder.path(), "sky.exr", "layer = \"a\"").err().unwrap().to_string();
    assert!(refused.contains("no layers"), "{refused}");
}
