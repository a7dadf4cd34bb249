//! Very large, very small, very far, very thin.

use super::harness::{BALL, load, load_with, medium, ok, sound_in_all_models, warns, with};
use super::parts::centred;

#[test]
fn an_object_smaller_than_a_pixel_ok() {
    let small = BALL.replace("radius = 1", "radius = 0.001");
    let grown = with(&[(BALL, &small), ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = [2e3, 3e3, 4e3]")]);
    ok(&load(&grown).unwrap());
}

#[test]
fn an_object_smaller_than_a_mean_free_path_warns() {
    let text = medium("[0.01, 0.02, 0.03]", "[1e-4, 1e-4, 1e-4]", "eta = 1.3");
    sound_in_all_models(&text);
    warns(&load(&text).unwrap(), &["longer than the object's diagonal", "check `unit`"]);
}

/// A closed box, a thousand times as wide as it is thick.
#[test]
fn a_thin_sheet_warns() {
    let scene = load_with(
        &with(&[(BALL, "mesh = \"box.obj\"\nmaterial = \"wax\"")]),
        &[("box.obj", &centred([1.0, 0.001, 1.0]))],
        false,
    );
    let scene = scene.unwrap();
    assert!(scene.objects[0].findings.volume.unwrap() > 0.0);
    warns(&scene, &["`standard` is a model of a half space", "0.002 units thick", "0.0041 transport mean free paths"]);
}

/// Thinner than the steps of single precision near its corners: rays are traced in f64.
#[test]
fn a_sheet_thinner_than_rounding_warns() {
    let text = with(&[(BALL, "mesh = \"box.obj\"\nmaterial = \"wax\"")]);
    let scene = load_with(&text, &[("box.obj", &centred([1.0, 1e-7, 1.0]))], false).unwrap();
    assert!(scene.why_double.as_ref().is_some_and(|why| why.contains("2e-7 units thick")), "{:?}", scene.why_double);
    warns(&scene, &["`standard` is a model of a half space", "method `volume_path`"]);
}

/// The whole scene by a factor, coefficients with it.
fn scaled(k: f64) -> String {
    let lengths =
        ["position = [0, 1, 6]", "centre = [0, 0, 0]\nradius = 1", "centre = [0, -1.5, 0]", "centre = [0, 4, 0]"];
    let times = |v: f64| format!("{:e}", v * k);
    let mut text = with(&[
        (lengths[0], &format!("position = [0, {}, {}]", times(1.0), times(6.0))),
        (lengths[1], &format!("centre = [0, 0, 0]\nradius = {}", times(1.0))),
        (lengths[2], &format!("centre = [0, {}, 0]", times(-1.5))),
        (lengths[3], &format!("centre = [0, {}, 0]", times(4.0))),
        ("edge_u = [0, 0, 4]\nedge_v = [4, 0, 0]", &format!("edge_u = [0, 0, {0}]\nedge_v = [{0}, 0, 0]", times(4.0))),
        ("edge_u = [1, 0, 0]\nedge_v = [0, 0, 1]", &format!("edge_u = [{0}, 0, 0]\nedge_v = [0, 0, {0}]", times(1.0))),
    ]);
    let over = |v: f64| format!("{:e}", v / k);
    text = text.replace("[2, 3, 4]", &format!("[{}, {}, {}]", over(2.0), over(3.0), over(4.0)));
    text.replace("[0.05, 0.1, 0.2]", &format!("[{}, {}, {}]", over(0.05), over(0.1), over(0.2)))
}

fn alike(k: f64) {
    let (scaled, plain) = (ok(&load(&scaled(k)).unwrap()), ok(&load(&scaled(1.0)).unwrap()));
    for (a, b) in scaled.iter().zip(&plain) {
        let mean = |s: &super::harness::Shot| s.image.pixels.iter().map(|p| f64::from(p.mean())).sum::<f64>();
        assert!((mean(a) / mean(b) - 1.0).abs() < 0.05, "{}: {} against {}", a.what, mean(a), mean(b));
    }
}

#[test]
fn a_scene_of_1e_minus_9_units_ok() {
    alike(1e-9);
}

#[test]
fn a_scene_of_1e9_units_ok() {
    alike(1e9);
}

#[test]
fn two_objects_1e9_apart_ok() {
    let text = with(&[("centre = [0, 4, 0]", "centre = [0, 1e9, 0]")]);
    let scene = load(&text).unwrap();
    assert!(scene.why_double.as_ref().is_some_and(|why| why.contains("object \"lamp\"")), "{:?}", scene.why_double);
    ok(&scene);
    let text = with(&[("centre = [0, 4, 0]", "centre = [0, 1e18, 0]")]);
    warns(&load(&text).unwrap(), &["double precision puts its vertices on steps of", "bring it nearer"]);
}

#[test]
fn beyond_single_precision_refused() {
    let text = with(&[("centre = [0, 4, 0]", "centre = [0, 1e39, 0]")]);
    super::harness::refused(load(&text), &["single precision"]);
}
