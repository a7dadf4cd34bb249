//! Lights at the ends of what there is.

use super::harness::{load, ok, shots, warns, with};

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
