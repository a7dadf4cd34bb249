//! Lights at the ends of what there is.

use super::furnace::{self, ERRORS};
use super::harness::{load, load_with, medium, ok, shots, warns, with};
use marmor::bssrdf::ModelName;
use marmor::integrator::{VolumePath, VolumePathOptions};
use marmor::query::Backend;
use marmor::scene::{Estimator, Orders};

#[test]
fn a_light_without_area_warns() {
    let text = with(&[("edge_u = [1, 0, 0]\nedge_v = [0, 0, 1]", "edge_u = [1, 0, 0]\nedge_v = [2, 0, 0]")]);
    warns(&load(&text).unwrap(), &["have no area: it sends out no light"]);
}

/// Powers of two scale every picture bit for bit.
fn radiance(factor: f32) {
    let text = with(&[
        ("radiance = 5", &format!("radiance = {:e}", 5.0 * f64::from(factor))),
        ("radiance = 0.1", &format!("radiance = {:e}", 0.125 * f64::from(factor))),
    ]);
    let plain = with(&[("radiance = 0.1", "radiance = 0.125")]);
    for (scaled, plain) in ok(&load(&text).unwrap()).iter().zip(&ok(&load(&plain).unwrap())) {
        if scaled.what.starts_with("ambient") {
            continue;
        }
        for (a, b) in scaled.image.pixels.iter().zip(&plain.image.pixels) {
            assert!(*a == *b * factor, "{}: {a:?}, {b:?}", scaled.what);
        }
    }
}

#[test]
fn radiance_1e_minus_9_ok() {
    radiance(2_f32.powi(-30));
}

#[test]
fn radiance_1e9_ok() {
    radiance(2_f32.powi(30));
}

/// Products beyond single precision: dropped, and every one counted.
#[test]
fn radiance_beyond_single_precision_is_counted_ok() {
    let text = with(&[
        ("radiance = 5", "radiance = 3e38"),
        ("edge_u = [1, 0, 0]\nedge_v = [0, 0, 1]", "edge_u = [9, 0, 0]\nedge_v = [0, 0, 9]"),
    ]);
    let scene = load(&text).unwrap();
    for shot in shots(&scene) {
        assert!(shot.image.pixels.iter().all(|p| p.is_finite()), "{}", shot.what);
        if !shot.what.starts_with("ambient") {
            assert!(shot.counts.non_finite > 0, "{}", shot.what);
            assert!(shot.counts.first_non_finite.is_some());
        }
        if shot.what.starts_with("subsurface") {
            assert!(shot.tally.gather.non_finite > 0, "{}", shot.what);
        }
    }
}

#[test]
fn a_light_inside_a_body_warns() {
    let text = with(&[(
        "centre = [0, 4, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0, 1]",
        "centre = [0, 0, 0]\nedge_u = [0.2, 0, 0]\nedge_v = [0, 0, 0.2]",
    )]);
    warns(&load(&text).unwrap(), &["lamp \"lamp\" lies inside object \"body\"", "take --method volume_path"]);
}

#[test]
fn a_light_through_a_body_warns() {
    let text = with(&[("centre = [0, 4, 0]", "centre = [0, 0.5, 0]")]);
    warns(&load(&text).unwrap(), &["lamp \"lamp\" lies partly inside object \"body\"", "take --method volume_path"]);
}

#[test]
fn a_light_on_the_floor_ok() {
    let text = with(&[("centre = [0, 4, 0]", "centre = [0, -1.5, 0]")]);
    ok(&load(&text).unwrap());
}

#[test]
fn no_light_warns() {
    let dark = with(&[("radiance = 0.1", "radiance = 0"), ("radiance = 5", "radiance = 0")]);
    for shot in warns(&load(&dark).unwrap(), &["no light", "all but ambient occlusion will be black"]) {
        assert_eq!(shot.brightest() > 0.0, shot.what.starts_with("ambient"), "{}", shot.what);
    }
}

#[test]
fn a_light_of_1e_minus_12_units_warns() {
    let text = with(&[("edge_u = [1, 0, 0]\nedge_v = [0, 0, 1]", "edge_u = [1e-12, 0, 0]\nedge_v = [0, 0, 1e-12]")]);
    // So far from the middle its corners fall together: said where they do.
    let scene = load(&text).unwrap();
    assert!(scene.warnings.iter().any(|w| w.contains("steps of") || w.contains("no area")), "{:?}", scene.warnings);
    shots(&scene).iter().for_each(super::harness::Shot::assert_sound);
}

/// A lamp and an environment of radiance 1 over a white floor: nothing is brighter, but by what a model claims.
#[test]
fn no_more_light_than_the_brightest_source_ok() {
    let text = medium("[20, 30, 40]", "[0.05, 0.1, 0.2]", "eta = 1.3");
    let text = [("radiance = 5", "radiance = 1"), ("radiance = 0.1", "radiance = 1"), ("albedo = 0.5", "albedo = 1")]
        .iter()
        .fold(text, |text, (from, to)| text.replacen(from, to, 1));
    let mut found = Vec::new();
    for name in [ModelName::STANDARD, ModelName::BETTER, ModelName::DIRECTIONAL, ModelName::BEAM, ModelName::NORMALISED]
    {
        let scene = load(&text.replace("eta = 1.3", &format!("eta = 1.3\nmodel = \"{}\"", name.name()))).unwrap();
        let mean = furnace::by(&scene, Backend::preferred(), Estimator::Cut, true);
        found.push((name.name(), mean, furnace::most(furnace::translucent(&scene))));
    }
    let scene = load(&text).unwrap();
    let of = |seed| {
        let options = VolumePathOptions { orders: Orders::All, photons: 200, specular: true, seed };
        VolumePath::new(&scene, options).unwrap()
    };
    found.push(("volume_path", furnace::seen(&scene, Backend::preferred(), 4, of), 1.0));
    for (what, mean, most) in found {
        for (mean, error) in mean {
            assert!(error < 0.05 && mean > 0.3, "{what}: {mean} +- {error}");
            assert!(mean < most + ERRORS * error + 1e-4, "{what}: {mean} +- {error} of {most}");
        }
    }
}

#[test]
fn a_flipped_lamp_that_shines_inwards_warns() {
    let faces = "v 0 3 0\nv 1 3 0\nv 0 4 0\nv 0 3 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let lamp = |flip: &str| {
        let mesh = format!("mesh = \"lamp.obj\"\n{flip}");
        with(&[("shape = \"rectangle\"\ncentre = [0, 4, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0, 1]", &mesh)])
    };
    let flipped = load_with(&lamp("flip = true"), &[("lamp.obj", faces)], false).unwrap();
    warns(&flipped, &["it shines inwards; leave out flip = true, or --repair turns it"]);
    ok(&load_with(&lamp(""), &[("lamp.obj", faces)], false).unwrap());
    // Around the camera it is meant.
    let wide = "v -99 -99 -99\nv 300 -99 -99\nv -99 300 -99\nv -99 -99 300\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    ok(&load_with(&lamp("flip = true"), &[("lamp.obj", wide)], false).unwrap());
}
