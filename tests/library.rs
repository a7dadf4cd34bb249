//! The crate's front door: `marmor::render` gives the pictures of the command line, and refuses what makes none.
#![allow(clippy::unwrap_used)] // a test that cannot render has failed

mod command;

use command::{ball, folder, marmor, text};
use marmor::film::{Image, Window};
use marmor::render::{Backend, Options};
use marmor::scene::SceneFile;
use marmor::{ErrorKind, film};
use std::time::Duration;

/// The ball, a lamp above it and a sky, with options of its own.
fn scene() -> String {
    ball([40, 30], "[environment]\nradiance = 0.5\n[method]\ncache_samples = 500\n[render]\nspp = 3\nseed = 5\n")
}

#[test]
fn the_library_gives_the_pictures_of_the_command_line() {
    let folder = folder(&scene());
    let file = SceneFile::read(&folder.path().join("scene.toml")).unwrap();
    let crop = Window { x0: 3, y0: 5, x1: 30, y1: 28 };
    let backend = Backend::preferred();
    let default = Options { backend: Some(backend), ..Options::default() };
    let cases = [
        ("", default),
        ("--seed 9 --spp 2", Options { seed: Some(9), spp: Some(2), ..default }),
        ("--as-notes", Options { as_notes: true, ..default }),
        ("--crop 3,5,30,28 --repair", Options { window: Some(crop), repair: true, ..default }),
        ("-D method.name=volume_path", default),
        ("-D method.name=direct", default),
        ("-D method.name=ambient_occlusion", default),
        ("-D method.estimator=all -D method.model=directional -D method.spread=area", default),
        ("-D method.photons=100 -D method.name=volume_path -D method.orders='2+'", default),
    ];
    for (words, options) in cases {
        let words: Vec<&str> = words.split_whitespace().collect();
        let call = ["render", "scene.toml", "--backend", backend.name(), "--layers", "variance", "-o", "picture.exr"];
        let ran = marmor(folder.path(), &[&call, &words[..]].concat());
        assert!(ran.status.success(), "{words:?}: {}", text(&ran.stderr));
        let defined: Vec<&str> = words.iter().copied().filter(|word| word.contains('=')).collect();
        let rendered = marmor::render(&file.with(&defined).unwrap(), &options).unwrap();
        let path = folder.path().join("picture.exr");
        // Not by `assert_eq`, which would print both.
        assert!(rendered.image == Image::read_exr(&path).unwrap(), "{words:?}");
        let variance = Image::read_exr_layer(&path, Some("Variance")).unwrap();
        assert!(rendered.variance.unwrap() == variance, "{words:?}: variance");
        assert_eq!(rendered.spp, options.spp.unwrap_or(3), "{words:?}");
    }
}

#[test]
fn what_is_to_know_of_a_picture_comes_with_it() {
    let options = Options { spp: Some(1), ..Options::default() };
    let render = |text: &str| marmor::render(&SceneFile::parse(text, "made.toml".as_ref()).unwrap(), &options).unwrap();
    let sound = render(&scene());
    assert!(sound.remarks.is_empty() && sound.variance.is_none(), "{:?}", sound.remarks);
    assert!(sound.tally.rays.camera == 40 * 30 && sound.seconds.total() > 0.0);
    // A lamp that shines away from the ball, and a scene that does not say its unit.
    let dark = render(&ball([4, 3], "").replace("edge_v = [0, 0, 2]", "edge_v = [0, 0, -2]"));
    assert!(dark.remarks.iter().any(|r| r.contains("met any light: do the lights face them?")), "{:?}", dark.remarks);
    let bare = render(&scene().replace("unit = \"mm\"", ""));
    assert!(bare.remarks.iter().any(|r| r.contains("no `unit`")), "{:?}", bare.remarks);
    // And it can be written as it is.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    film::save(&sound.image, &path, &Default::default(), Default::default()).unwrap();
    assert_eq!(Image::read_exr(&path).unwrap(), sound.image);
}

#[test]
fn the_lecture_has_its_own_model_and_estimator() {
    let file = SceneFile::parse(&scene(), "made.toml".as_ref()).unwrap();
    let asked = ["method.model=beam", "method.estimator=all", "method.spread=seen", "method.entry=light"];
    let notes = Options { as_notes: true, ..Options::default() };
    let image = |file: &SceneFile, options| marmor::render(file, options).unwrap().image;
    assert_eq!(image(&file.with(&asked).unwrap(), &notes), image(&file, &notes));
    assert_ne!(image(&file, &Options::default()), image(&file, &notes));
}

#[test]
fn what_makes_no_picture_is_refused() {
    let file = SceneFile::parse(&scene(), "made.toml".as_ref()).unwrap();
    let options = Options::default();
    let outside = Window { x0: 0, y0: 0, x1: 41, y1: 30 };
    let cases = [
        (Options { spp: Some(0), ..options }, "", "0 samples per pixel"),
        (Options { time: Some(Duration::ZERO), ..options }, "", "no time makes no picture"),
        (Options { window: Some(outside), ..options }, "", "40x30"),
        (Options { as_notes: true, ..options }, "method.name=direct", "about the method `subsurface`, not `direct`"),
    ];
    for (options, defined, message) in cases {
        let defined: Vec<&str> = Some(defined).filter(|d| !d.is_empty()).into_iter().collect();
        let error = marmor::render(&file.with(&defined).unwrap(), &options).unwrap_err();
        assert!(error.kind() == ErrorKind::Usage && error.to_string().contains(message), "{options:?}: {error}");
    }
    // Time is the only limit where it is asked for alone, whatever the scene says of passes.
    let timed = Options { time: Some(Duration::from_nanos(1)), ..options };
    assert_eq!(timed.passes(&file).unwrap(), None);
    assert_eq!(marmor::render(&file, &timed).unwrap().spp, 1);
    assert_eq!(options.passes(&file).unwrap(), Some(3));
}
