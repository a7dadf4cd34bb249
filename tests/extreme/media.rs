//! Media at the ends of what there is.

use super::harness::{Shot, load, medium, ok, refused, sound_in_all_models, subsurface_shot, warns};
use marmor::query::Backend;
use marmor::scene::Estimator;

/// A medium of reduced albedo 0.99 in which the ball has the stiffness N = A σ_tr² / 2π.
fn stiff(n: f64) -> String {
    let sigma_tr = (n * 2.0 * std::f64::consts::PI / (4.0 * std::f64::consts::PI)).sqrt();
    let sigma_t_prime = sigma_tr / (3.0_f64 * 0.01).sqrt();
    medium(&format!("{}", 0.99 * sigma_t_prime), &format!("{}", 0.01 * sigma_t_prime), "eta = 1.3")
}

fn stiffness(n: f64) {
    sound_in_all_models(&stiff(n));
    let shots = ok(&load(&stiff(n)).unwrap());
    assert!(shots.iter().all(|shot| shot.brightest() > 0.01), "the ball is lit");
}

#[test]
fn stiffness_1e_minus_3_warns() {
    sound_in_all_models(&stiff(1e-3));
    warns(&load(&stiff(1e-3)).unwrap(), &["transport mean free path", "longer than the object's diagonal"]);
}

#[test]
fn stiffness_1_ok() {
    stiffness(1.0);
}

#[test]
fn stiffness_1e2_ok() {
    stiffness(1e2);
}

#[test]
fn stiffness_1e4_ok() {
    stiffness(1e4);
}

#[test]
fn stiffness_1e6_ok() {
    stiffness(1e6);
}

#[test]
fn stiffness_1e8_ok() {
    stiffness(1e8);
}

#[test]
fn channels_a_million_apart_in_absorption_ok() {
    let text = medium("[10, 10, 10]", "[1e-6, 1e-3, 1]", "eta = 1.3");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn channels_a_million_apart_in_scattering_warns() {
    let text = medium("[1e-3, 1, 1e3]", "[1e-5, 0.01, 10]", "eta = 1.3");
    sound_in_all_models(&text);
    warns(&load(&text).unwrap(), &["transport mean free path in red"]);
}

#[test]
fn no_absorption_ok() {
    let text = medium("[2, 3, 4]", "0", "eta = 1.3");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn no_scattering_warns() {
    let text = medium("0", "[2, 3, 4]", "eta = 1.3");
    sound_in_all_models(&text);
    warns(&load(&text).unwrap(), &["reduced albedo 0.000", "outside diffusion theory"]);
}

#[test]
fn one_empty_channel_warns() {
    let text = medium("[2, 0, 4]", "[0.1, 0, 0.1]", "eta = 1.3");
    sound_in_all_models(&text);
    warns(&load(&text).unwrap(), &["no scattering and no absorption in green"]);
}

#[test]
fn an_empty_medium_warns() {
    let text = medium("0", "0", "eta = 1.3");
    sound_in_all_models(&text);
    warns(&load(&text).unwrap(), &["no scattering and no absorption in red, green, blue"]);
}

/// A mean free path of 1e40 units: depths that single precision cannot hold are dropped and counted.
#[test]
fn coefficients_below_normal_numbers_warns() {
    let text = medium("1e-40", "1e-42", "eta = 1.3");
    let beam = load(&medium("1e-40", "1e-42", "eta = 1.3\nmodel = \"beam\"")).unwrap();
    let shot = subsurface_shot(&beam, Estimator::Cut, 2000, Backend::preferred());
    assert!(shot.image.pixels.iter().all(|p| p.is_finite()) && shot.tally.gather.non_finite > 0);
    warns(&load(&text).unwrap(), &["longer than the object's diagonal"]);
}

#[test]
fn the_largest_coefficients_ok() {
    let text = medium("9e14", "9e12", "eta = 1.3");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn coefficients_beyond_the_largest_refused() {
    refused(load(&medium("2e15", "1", "eta = 1.3")), &["per", "scale"]);
}

#[test]
fn forward_scattering_of_0_9999_ok() {
    // Reduced coefficients as before: what goes on straight is not scattered.
    let text = medium("[2, 3, 4]", "[0.0001, 0.0002, 0.0003]", "g = 0.9999\neta = 1.3");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn backward_scattering_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "g = -0.99\neta = 1.3");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn g_of_1_refused() {
    refused(load(&medium("2", "0.1", "g = 1\neta = 1.3")), &["`material.wax.g` is 1", "below 1"]);
}

#[test]
fn matched_boundary_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 1");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn a_bubble_in_glass_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 0.6667");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn eta_of_10_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 9.9");
    sound_in_all_models(&text);
    ok(&load(&text).unwrap());
}

#[test]
fn eta_beyond_10_refused() {
    refused(load(&medium("2", "0.1", "eta = 11")), &["eta"]);
}

#[test]
fn a_slab_of_one_mean_free_path_ok() {
    let text = medium("[2, 2, 2]", "[0.05, 0.1, 0.2]", "eta = 1.3\nmodel = \"slab\"\nthickness = 4");
    let shots = ok(&load(&text).unwrap());
    assert!(shots.iter().any(|s: &Shot| s.brightest() > 0.0));
}

#[test]
fn a_slab_too_thin_for_its_medium_refused() {
    let text = medium("[2, 2, 2]", "[0.05, 0.1, 0.2]", "eta = 1.3\nmodel = \"slab\"\nthickness = 1e-6");
    refused(load(&text), &["thick"]);
}

/// Negative lobes of a formula are taken as 0 in the picture, and counted.
#[test]
fn values_below_zero_are_clamped_and_counted_ok() {
    // Light that leaves close to where it went in, through the other side of a sheet.
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 1.3\nmodel = \"directional\"");
    let text = text.replace(super::harness::BALL, "mesh = \"box.obj\"\nmaterial = \"wax\"");
    let sheet = super::sizes::cuboid(1.0, 0.02, 1.0);
    let shots = ok(&super::harness::load_with(&text, &[("box.obj", &sheet)], false).unwrap());
    let clamped: Vec<u64> = shots.iter().map(|s| s.tally.gather.clamped).collect();
    assert!(clamped.iter().any(|&n| n > 0), "{clamped:?}");
    assert!(shots.iter().filter(|s| !s.what.starts_with("subsurface")).all(|s| s.tally.gather.clamped == 0));
}
