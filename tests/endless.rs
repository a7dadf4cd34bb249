//! Light that nothing absorbs for hundreds of surfaces: guides of light, white rooms, thin sheets.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod parts;
mod rendering;

use marmor::film::Image;
use marmor::integrator::{VolumePath, VolumePathOptions};
use marmor::math::hash;
use marmor::query::Backend;
use marmor::scene::{Orders, Scene};
use marmor::tally::{Cause, Tally};
use parts::centred;
use rendering::{average, load, load_beside, on};
use std::f64::consts::TAU;

const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed: 1 };

fn render(scene: &Scene, passes: u32) -> (Image, Tally) {
    let method = VolumePath::new(scene, OPTIONS).unwrap();
    let (film, outcome) = on(Backend::preferred(), scene, &method, 1, 0..passes);
    assert_eq!(film.counts().non_finite, 0);
    (film.image(), outcome.tally)
}

/// A cuboid as a body of this medium, in a white furnace; the camera as in the text.
fn body(half: [f64; 3], medium: &str, camera: &str) -> Scene {
    let text = format!(
        "unit = \"mm\"\n[camera]\n{camera}\nresolution = [8, 8]\n[[object]]\nname = \"body\"\nmesh = \"box.obj\"\n\
         material = \"m\"\n[material.m]\ntype = \"translucent\"\n{medium}\n[environment]\nradiance = 1\n"
    );
    load_beside("box.obj", &centred(half), &text)
}

/// Each pixel within `most` of `expected`.
fn even(image: &Image, expected: f32, most: f32, what: &str) {
    println!("{what}: {}, expected {expected}", average(image));
    for pixel in &image.pixels {
        assert!((pixel.mean() - expected).abs() < most, "{what}: {pixel:?}, expected {expected}");
    }
}

/// Light that enters an end of a rod meets its sides hundreds of times, totally reflected, on its way to the other end. Without
/// absorption that is a white furnace. With some, each path of the length l in the rod keeps exp(-σ_a l): what leaves is
/// a share R of what comes from outside, in closed form. Sides are parallel to the axis and ends across it, so that all
/// lengths are known: 1/cosine' of the refracted direction along the rod, the angle at both ends the same, Fresnel's R there.
#[test]
fn a_rod_leads_light_to_its_other_end() {
    let (length, eta, degrees) = (20.0, 1.5_f64, 40.0_f64);
    for half in [0.05, 0.01] {
        // The end at +z from so far away that the angle is the same all over it, and the end fills the view.
        let (far, angle) = (1000.0, degrees.to_radians());
        let [x, z] = [far * angle.sin(), 0.5 * length + far * angle.cos()];
        let fov = (0.5 * half / far).atan().to_degrees();
        let camera = format!("position = [{x}, 0, {z}]\nlook_at = [0, 0, {}]\nfov = {fov:e}", 0.5 * length);
        for sigma_a in [0.0, 1e-2] {
            let medium = format!("sigma_s = 0\nsigma_a = {sigma_a}\ng = 0\neta = {eta}");
            let scene = body([half, half, 0.5 * length], &medium, &camera);
            let passes = if sigma_a == 0.0 { 4 } else { 64 };
            let (image, tally) = render(&scene, passes);
            let inside = (1.0 - (angle.sin() / eta).powi(2)).sqrt();
            let r = f64::from(marmor::optics::reflectance(eta as f32, angle.cos() as f32));
            let kept = (-sigma_a * length / inside).exp();
            // (1 - R)² of the light comes through after one length, and R of the rest goes back for another.
            let expected = r + (1.0 - r).powi(2) * kept / (1.0 - r * kept);
            assert_eq!(tally.walk.losses.total(), 0);
            let what = format!("half {half}, sigma_a {sigma_a}");
            if sigma_a == 0.0 {
                even(&image, 1.0, 1e-5, &what);
                continue;
            }
            // Beside the mirror image each sample is 1 - R or nothing.
            let (mean, samples) = (average(&image), 64.0 * f64::from(passes));
            let share = (expected - r) / (1.0 - r);
            let error = (1.0 - r) * (share * (1.0 - share) / samples).sqrt();
            println!("{what}: {mean} +- {error}, expected {expected}");
            assert!((mean - expected).abs() < 5.0 * error, "{what}: {mean} +- {error}, expected {expected}");
        }
    }
}

/// A sheet of a thousandth of a mean free path: what is scattered in it is caught between its faces for hundreds of them.
#[test]
fn a_thin_sheet_in_a_white_furnace_loses_nothing() {
    let camera = "position = [0, 9, 0.01]\nlook_at = [0, 0, 0]\nfov = 10";
    for sigma_s in [4.0, 1.0] {
        let medium = format!("sigma_s = {sigma_s}\nsigma_a = 0\ng = 0\neta = 1.5");
        let (image, tally) = render(&body([20.0, 0.0005, 20.0], &medium, camera), 1024);
        assert!(tally.walk.collisions > 100, "{:?}", tally.walk);
        assert_eq!(tally.walk.losses.total(), 0, "{:?}", tally.walk);
        even(&image, 1.0, 1e-5, &format!("sigma_s {sigma_s}"));
    }
}

/// A room with walls of this albedo and a window of half size `window` in its ceiling, in even light; the camera looks at the
/// floor. The ball outside is there because the method wants a body.
fn room(albedo: f64, window: f64) -> Scene {
    let mut obj = centred([1.0; 3]);
    if window > 0.0 {
        let ceiling = "f 3 7 8 4\n";
        assert!(obj.contains(ceiling));
        obj = obj.replace(ceiling, "");
        for [x, z] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]] {
            obj += &format!("v {} 1 {}\n", x * window, z * window);
        }
        obj += "f 3 7 10 9\nf 7 8 11 10\nf 8 4 12 11\nf 4 3 9 12\n";
    }
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0.9, 0]\nlook_at = [0.01, -1, 0]\nfov = 0.5\nresolution = [8, 8]\n\
         [[object]]\nname = \"room\"\nmesh = \"room.obj\"\nmaterial = \"wall\"\n[material.wall]\ntype = \"diffuse\"\nalbedo = {albedo}\n\
         [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, -3, 0]\nradius = 0.5\nmaterial = \"m\"\n\
         [material.m]\ntype = \"translucent\"\nsigma_s = 1\nsigma_a = 0\ng = 0\neta = 1\n[environment]\nradiance = 1\n"
    );
    load_beside("room.obj", &obj, &text)
}

#[test]
fn a_white_room_with_a_small_window_is_a_white_furnace() {
    for window in [0.1, 0.05] {
        let (image, tally) = render(&room(1.0, window), 4);
        assert_eq!(tally.walk.losses.total(), 0, "{:?}", tally.walk);
        even(&image, 1.0, 1e-6, &format!("window {window}"));
    }
}

/// Share of the paths from the middle of the floor that come to the window, by a walk that knows the room as numbers alone.
fn by_walk(albedo: f64, window: f64, paths: u64) -> f64 {
    let mut drawn = 0;
    let mut number = || {
        drawn += 1;
        (hash(drawn) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut found = 0;
    for _ in 0..paths {
        // The wall that the path is at: its axis and side.
        let (mut x, mut axis, mut side) = ([0.01, -1.0, 0.0], 1, -1.0);
        while number() < albedo {
            let (r, angle) = (number().sqrt(), TAU * number());
            let mut w = [0.0; 3];
            (w[axis], w[(axis + 1) % 3], w[(axis + 2) % 3]) =
                (-side * (1.0 - r * r).sqrt(), r * angle.cos(), r * angle.sin());
            let to = |i: usize| if w[i] == 0.0 { f64::INFINITY } else { (w[i].signum() - x[i]) / w[i] };
            let (next, t) = (0..3).map(|i| (i, to(i))).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            for i in 0..3 {
                x[i] = (x[i] + t * w[i]).clamp(-1.0, 1.0);
            }
            (axis, side) = (next, w[next].signum());
            x[axis] = side;
            if axis == 1 && side > 0.0 && x[0].abs() < window && x[2].abs() < window {
                found += 1;
                break;
            }
        }
    }
    found as f64 / paths as f64
}

/// A room that absorbs a little, against a walk of its own; the sphere's formula f / (1 - ρ (1 - f)) says 0.08 for f = 1/600 of the
/// surface. By roulette after 16 walls in a row it was 0.035.
#[test]
fn a_bright_room_is_as_bright_as_a_walk_in_it_says() {
    let text = room(0.98, 0.1);
    let (passes, paths) = (2048, 400_000);
    let (image, _) = render(&text, passes);
    let mean = average(&image);
    let expected = by_walk(0.98, 0.1, paths);
    // Each path brings 1 or nothing.
    let error = (expected * (1.0 - expected) * (1.0 / (64.0 * f64::from(passes)) + 1.0 / paths as f64)).sqrt();
    println!("{mean}, by a walk {expected} +- {error}");
    assert!((mean - expected).abs() < 5.0 * error, "{mean}, by a walk {expected} +- {error}");
    let f = 0.04 / 24.0;
    assert!((expected / (f / (1.0 - 0.98 * (1.0 - f))) - 1.0).abs() < 0.1, "{expected}");
}

/// What no light can leave ends, and is counted at the walls.
#[test]
fn a_closed_white_room_ends_and_is_counted() {
    let scene = room(1.0, 0.0);
    let (image, tally) = render(&scene, 1);
    assert!(image.pixels.iter().all(|p| p.is_black()));
    let found: Vec<_> = tally.walk.losses.each().collect();
    assert!(found.len() == 1 && found[0].cause == Cause::Endless && found[0].object == 0 && found[0].paths == 64);
    assert!(tally.walk.lost_many());
    let said = marmor::integrator::lost(&tally.walk, &scene).join("\n");
    assert!(said.contains("\"room\"") && said.contains("thousands of surfaces in a row"), "{said}");
}

/// A direction with no component beyond the cosine of total reflection goes round in a clear cube of glass for ever. No light that
/// comes in does; a camera inside can look that way.
#[test]
fn total_reflection_for_ever_ends_and_is_counted() {
    let camera = "position = [0.1, 0.2, 0.05]\nlook_at = [1.1, 1.2, 1.05]\nfov = 1";
    let scene = body([1.0; 3], "sigma_s = 0\nsigma_a = 0\ng = 0\neta = 1.5", camera);
    let (image, tally) = render(&scene, 1);
    assert!(image.pixels.iter().all(|p| p.is_black()));
    let found: Vec<_> = tally.walk.losses.each().collect();
    assert!(found.len() == 1 && found[0].cause == Cause::Endless && found[0].paths == 64, "{found:?}");
    assert!(tally.walk.lost_many());
}

/// A coarse body with smooth normals and η below 1, as a bubble in water: what does not pass the surface is mirrored.
#[test]
fn a_coarse_bubble_is_a_white_furnace() {
    for (rings, segments, eta) in [(3, 4, 0.7), (8, 12, 0.9), (3, 4, 1.4)] {
        let text = format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 25\nresolution = [32, 32]\n\
             [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nrings = {rings}\nsegments = {segments}\n\
             material = \"m\"\n[material.m]\ntype = \"translucent\"\nsigma_s = 2\nsigma_a = 0\ng = 0\neta = {eta}\n\
             [environment]\nradiance = 1\n"
        );
        let (image, tally) = render(&load(&text), 32);
        assert_eq!(tally.walk.losses.total(), 0);
        even(&image, 1.0, 1e-4, &format!("{rings} x {segments}, eta {eta}"));
    }
}
