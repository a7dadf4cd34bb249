//! Photons and their connections, each alone, against sums that do not know them.

use super::cells::{Cells, Photon};
use super::connect::{Scratch, connect, walked_mis_weight};
use super::draws::PathSampler;
use super::*;
use crate::math::{DVec3, GaussLegendre, Vec3};
use crate::optics::{HenyeyGreenstein, transmittance};
use crate::query::{self, Backend};
use crate::scene::{Environment, SceneFile};
use crate::tally::WalkTally;
use std::f64::consts::PI;
use std::sync::Arc;

/// A box of 4 x 3 x 2 about the origin.
pub(super) fn block(medium: &str, rest: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::new();
    for y in [1.5, -1.5] {
        for [x, z] in [[-2, -1], [-2, 1], [2, 1], [2, -1]] {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text += "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    std::fs::write(folder.path().join("box.obj"), text).unwrap();
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [8, 8]\n\
         [[object]]\nmesh = \"box.obj\"\nmaterial = \"m\"\n[material.m]\ntype = \"translucent\"\n{medium}\n{rest}"
    );
    Scene::load(&SceneFile::parse(&text, &folder.path().join("scene.toml")).unwrap()).unwrap()
}

/// Flux that light enters the box with: the sum over its faces. `at` gives its direction and irradiance at a place.
fn entering(eta: f32, at: impl Fn(Vec3) -> (Vec3, f64)) -> f64 {
    let faces = [(Vec3::X, 2.0, 6.0), (Vec3::Y, 1.5, 8.0), (Vec3::Z, 1.0, 12.0)];
    let both = faces.into_iter().flat_map(|(n, half, area)| [(n, n * half, area), (-n, -n * half, area)]);
    let flux = |(n, middle, area): (Vec3, Vec3, f64)| {
        let (w, irradiance) = at(middle);
        let cosine = w.dot(n).max(0.0);
        area * irradiance * f64::from(cosine * transmittance(eta, cosine))
    };
    both.map(flux).sum()
}

/// Photons of a sun, of a lamp far away and of both carry what enters, to 0.2 %: in so dense a medium all of it is scattered
/// at once, and then nearly all is absorbed.
#[test]
fn photons_carry_what_enters() {
    let medium = "sigma_s = 0.1\nsigma_a = 999.9\ng = 0.7\neta = 1.3";
    // A direction in the middle between four pixels.
    let (theta, phi) = (61.0 / 256.0 * PI, 201.0 / 512.0 * 2.0 * PI);
    let w = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()).as_vec3();
    let solid = 4.0 * (2.0 * PI / 512.0) * (PI / 256.0) * theta.sin();
    let far = 300.0 * Vec3::new(-0.48, 0.6, 0.64);
    let (u, v) = (Vec3::new(0.8, 0.0, 0.6), Vec3::new(0.36, 0.8, -0.48));
    let text = |v: Vec3| format!("[{}, {}, {}]", v.x, v.y, v.z);
    let lamp = format!(
        "[[object]]\nshape = \"rectangle\"\ncentre = {}\nedge_u = {}\nedge_v = {}\nmaterial = \"lamp\"\n[material.lamp]\n\
         type = \"emissive\"\nradiance = 500000\ntwo_sided = true\n",
        text(far),
        text(u),
        text(v)
    );
    for (with_sun, with_lamp) in [(true, false), (false, true), (true, true)] {
        let mut scene = block(medium, if with_lamp { &lamp } else { "" });
        if with_sun {
            let pixel = |x, y| Rgb::splat(if (200..202).contains(&x) && (60..62).contains(&y) { 1e4 } else { 0.0 });
            let image = Some(Arc::new(crate::film::Image::from_fn([512, 256], pixel)));
            scene.environment = Environment { radiance: Rgb::WHITE, image, turn: 0.0 };
        }
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let view = View { scene: &scene, rays: &*rays };
        let count = 100_000;
        let options = VolumePathOptions { orders: Orders::All, photons: count, specular: true, seed: 1 };
        let method = VolumePath::new(&scene, options).unwrap();
        let (source, body) = (method.sources[0].as_ref().unwrap(), method.bodies[0].as_ref().unwrap());
        let found: Vec<f64> = (0..8)
            .map(|pass| {
                let mut work = Tally::default();
                let cells = source.trace(view, body, &method.light.lights, pass, &mut work).unwrap();
                let all = (0..cells.len() as u32).map(|i| f64::from(cells.photons((i, i + 1))[0].flux[0]));
                all.sum::<f64>() / 1e-4
            })
            .collect();
        let mean = found.iter().sum::<f64>() / 8.0;
        let error = (found.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / 56.0).sqrt();
        let of_sun = entering(1.3, |_| (w, 1e4 * solid));
        let of_lamp = entering(1.3, |x| ((far - x).normalize(), 5e5 * 4.0 / f64::from((far - x).length_squared())));
        let expected = if with_sun { of_sun } else { 0.0 } + if with_lamp { of_lamp } else { 0.0 };
        // The part of a ten-thousandth that is scattered again adds at most as much.
        println!("{with_sun} {with_lamp}: {mean} +- {error}, {expected}");
        assert!(error < 4e-4 * expected, "{mean} +- {error}");
        assert!((mean - expected).abs() < 5.0 * error + 3e-4 * expected, "{mean} +- {error}, expected {expected}");
    }
}

/// Photons all around a point, all flying one way: what [`connect`] finds is the integral over their places of
/// p p exp(-σ r) (1 - walked share), to 0.2 %.
#[test]
fn connections_are_the_integral_over_photons() {
    for (g, eta) in [(0.7, 1.3), (0.0, 1.0), (-0.4, 1.5)] {
        let scene = block(&format!("sigma_s = 8\nsigma_a = 2\ng = {g}\neta = {eta}"), "");
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let view = View { scene: &scene, rays: &*rays };
        let options = VolumePathOptions { orders: Orders::All, photons: 1, specular: true, seed: 1 };
        let method = VolumePath::new(&scene, options).unwrap();
        let body = method.bodies[0].as_ref().unwrap();
        let (reach, yielding, x) = (0.3_f32, 0.02_f32, -scene.centre);
        let (w, w_p) = (Vec3::X, Vec3::new(0.6, 0.8, 0.0));
        // Photons even in distance and direction have a density of 1/r² in space; with flux r² it is even.
        let (each, rounds) = (900, 3000);
        let (mut sum, mut squares) = (0.0, 0.0);
        for round in 0..rounds {
            let mut draws = PathSampler::new(&[], round);
            let photon = |i: u32| {
                let r = reach * (i as f32 + draws.number()) / each as f32;
                Photon { x: x + (draws.direction() * r).as_dvec3(), w: w_p, flux: Rgb::splat(r * r) }
            };
            let cells = Cells::new((0..each).map(photon).collect(), reach, yielding);
            let (mut scratch, mut tally) = (Scratch::default(), WalkTally::default());
            let found = connect(view, body, &cells, (x, w), &mut scratch, &mut draws, &mut tally);
            let value = f64::from(found[0]) * f64::from(reach) / f64::from(each) * 4.0 * PI;
            (sum, squares) = (sum + value, squares + value * value);
        }
        let mean = sum / rounds as f64;
        let error = ((squares / rounds as f64 - mean * mean) / rounds as f64).sqrt();
        let (phase, rule) = (HenyeyGreenstein { g }, GaussLegendre::new(20));
        let none = Cells::new(Vec::new(), reach, yielding);
        let over = |z: f64| {
            let side = (1.0 - z * z).max(0.0).sqrt();
            let at = |angle: f64| {
                // `d` from the point to the photon, z along x.
                let cosine_p = -(0.6 * z + 0.8 * side * angle.cos());
                let (p_v, p_p) = (phase.value(z), phase.value(cosine_p));
                let along = |r: f64| {
                    let share = 1.0 - f64::from(walked_mis_weight(&none, r as f32, p_v as f32));
                    p_v * p_p * (-10.0 * r).exp() * share
                };
                rule.integrate_panels(0.0, f64::from(reach) * (1.0 - 1e-6), 4, along)
            };
            2.0 * rule.integrate_panels(0.0, PI, 2, at)
        };
        let expected = rule.integrate_panels(-1.0, 1.0, 4, over);
        println!("g {g}: {mean} +- {error}, {expected}");
        assert!(error < 1.5e-3 * expected, "{mean} +- {error}");
        assert!((mean - expected).abs() < 5.0 * error, "g {g}: {mean} +- {error}, expected {expected}");
    }
}
