//! Exact single scattering against quadrature of high precision, and its two forms against each other.
#![allow(clippy::unwrap_used)] // a test that cannot read its data has failed

mod support;

use marmor::bssrdf::{ChannelMedium, LightPath, SingleChannel, SingleScattering};
use marmor::math::{DVec3, Rgb, Vec3};
use marmor::optics::{Medium, refract, transmittance};
use proptest::prelude::*;
use std::f64::consts::PI;
use support::{Row, Score, both, channel};

fn score(rows: &[Row]) -> Score {
    let mut score = Score::default();
    for row in rows {
        let m = SingleChannel::new(&channel(row)).exitance(DVec3::X * row.number("r"), DVec3::Z, -DVec3::Z);
        score.add(row, m as f32, row.number("M1"));
    }
    score
}

#[test]
fn rows_of_the_table_are_met() {
    both("single_scatter_plane.csv", |name, rows| score(rows).hold(name));
}

fn of_albedo(albedo: f64, g: f64, eta: f64) -> ChannelMedium {
    ChannelMedium { sigma_s: albedo, sigma_a: 1.0 - albedo, g, eta }
}

fn grey(albedo: f32, g: f64, eta: f32) -> Medium {
    Medium { sigma_s: Rgb::splat(albedo), sigma_a: Rgb::splat(1.0 - albedo), g, eta }
}

#[test]
fn energies_of_a_half_space_are_the_known_ones() {
    for (eta, energy) in [(1.0, 0.15343), (1.3, 0.07572), (1.5, 0.05362)] {
        let total = SingleChannel::new(&of_albedo(1.0, 0.0, eta)).total();
        assert!((total - energy).abs() < 5.1e-6, "{eta}: {total}");
    }
}

/// ∫ M_1 over the plane, polar midpoints about the entry.
fn over_the_plane(medium: &ChannelMedium, w: DVec3) -> f64 {
    let single = SingleChannel::new(medium);
    let (radii, angles) = (400, if w.z < -0.999 { 1 } else { 96 });
    let (first, last) = (-14.0, 5.0);
    let dy = (last - first) / f64::from(radii);
    let mut sum = 0.0;
    for i in 0..radii {
        let r = (first + dy * (f64::from(i) + 0.5)).exp();
        for k in 0..angles {
            let phi = PI * (f64::from(k) + 0.5) / f64::from(angles);
            let x = DVec3::new(r * phi.cos(), r * phi.sin(), 0.0);
            sum += 2.0 * PI / f64::from(angles) * r * r * dy * single.exitance(x, DVec3::Z, w);
        }
    }
    sum
}

#[test]
fn the_profile_integrates_to_the_total() {
    for (albedo, g, eta) in [(1.0, 0.0, 1.0), (1.0, 0.0, 1.3), (0.7, 0.8, 1.5), (0.7, -0.9, 1.3), (0.9, 0.3, 0.75)] {
        let medium = of_albedo(albedo, g, eta);
        let (sum, total) = (over_the_plane(&medium, -DVec3::Z), SingleChannel::new(&medium).total());
        assert!((sum / total - 1.0).abs() < 1e-4, "{albedo} {g} {eta}: {sum} against {total}");
    }
}

/// An oblique pencil beam against the BRDF of distant light: the same energy, by two routes.
#[test]
fn the_oblique_profile_integrates_to_the_energy_of_the_brdf() {
    for (g, eta, mu) in [(0.0, 1.3, 0.5_f32), (0.6, 1.5, 0.25), (-0.3, 1.0, 0.7)] {
        let w_i = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        let inside = refract(w_i, Vec3::Z, eta).unwrap();
        let single = SingleScattering::new(&grey(0.8, g, eta));
        let mut energy = 0.0;
        let (rings, sectors) = (300, 96);
        for i in 0..rings {
            // cos² in equal steps: dw cos = π d(cos²) dφ / 2π.
            let cos = ((i as f32 + 0.5) / rings as f32).sqrt();
            let sin = (1.0 - cos * cos).sqrt();
            for k in 0..sectors {
                let phi = std::f32::consts::TAU * (k as f32 + 0.5) / sectors as f32;
                let w_o = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                energy += f64::from(single.plane_brdf(w_i, w_o, Vec3::Z)[0]);
            }
        }
        energy *= PI / f64::from(rings * sectors) / f64::from(transmittance(eta, mu));
        let medium = ChannelMedium { sigma_s: f64::from(0.8_f32), sigma_a: 0.2, g, eta: f64::from(eta) };
        let sum = over_the_plane(&medium, inside.as_dvec3());
        assert!((sum / energy - 1.0).abs() < 2e-3, "{g} {eta} {mu}: {sum} against {energy}");
    }
}

/// The shadow ray of distant light from depth `s` along the camera's ray, on a plane.
fn path(w_i: Vec3, w_inside: Vec3, s: f32) -> LightPath {
    LightPath { w_i, n_i: Vec3::Z, distance: -w_inside.z * s / w_i.z }
}

#[test]
fn along_the_camera_ray_a_plane_gives_the_brdf_of_distant_light() {
    let medium = Medium { sigma_s: Rgb([0.5, 1.0, 3.0]), sigma_a: Rgb([0.1, 0.0, 0.7]), g: 0.4, eta: 1.4 };
    let single = SingleScattering::new(&medium);
    let (w_i, w_o) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.64, 0.6));
    let inside = refract(w_o, Vec3::Z, medium.eta).unwrap();
    let closed = single.plane_brdf(w_i, w_o, Vec3::Z) * w_i.z;
    let t21 = transmittance(medium.eta, w_o.z);
    let (mut plain, mut sampled) = ([0.0; 3], [0.0; 3]);
    let count = 20_000;
    for i in 0..count {
        let u = (i as f32 + 0.5) / count as f32;
        let s = single.sample_distance(u, f32::INFINITY).unwrap();
        let light = path(w_i, inside, s.distance);
        let a = single.along_camera_ray(s.distance, inside, &light);
        let b = single.along_camera_ray_sampled(s.distance, f32::INFINITY, inside, &light);
        for c in 0..3 {
            plain[c] += f64::from(a[c] / s.pdf * t21) / f64::from(count);
            sampled[c] += f64::from(b[c] * t21) / f64::from(count);
        }
    }
    for c in 0..3 {
        assert!((plain[c] / f64::from(closed[c]) - 1.0).abs() < 1e-3, "{plain:?} against {closed:?}");
        assert!((sampled[c] / f64::from(closed[c]) - 1.0).abs() < 1e-3, "{sampled:?} against {closed:?}");
    }
}

#[test]
fn a_ray_that_leaves_the_medium_samples_only_what_is_inside() {
    let medium = Medium { sigma_s: Rgb([0.5, 1.0, 3.0]), sigma_a: Rgb::splat(0.1), g: 0.0, eta: 1.4 };
    let single = SingleScattering::new(&medium);
    let longest = 0.3_f32;
    let mut sum = 0.0;
    for i in 0..1000 {
        let s = single.sample_distance((i as f32 + 0.5) / 1000.0, longest).unwrap();
        assert!((0.0..=longest).contains(&s.distance));
        sum += f64::from((-s.distance).exp() / s.pdf) / 1000.0;
        let light = LightPath { w_i: Vec3::Z, n_i: Vec3::Z, distance: s.distance };
        let plain = single.along_camera_ray(s.distance, -Vec3::Z, &light);
        let sampled = single.along_camera_ray_sampled(s.distance, longest, -Vec3::Z, &light);
        for c in 0..3 {
            assert!((plain[c] / s.pdf / sampled[c] - 1.0).abs() < 1e-5);
        }
    }
    assert!((sum - (1.0 - f64::from(-longest).exp())).abs() < 1e-5);
}

#[test]
fn single_scattering_is_reciprocal_and_without_scattering_nothing() {
    let single = SingleScattering::new(&grey(0.8, 0.5, 1.3));
    let (a, b) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.64, 0.6));
    let (there, back) = (single.plane_brdf(a, b, Vec3::Z)[0], single.plane_brdf(b, a, Vec3::Z)[0]);
    assert!(there > 0.0 && (there - back).abs() < 1e-6 * there);
    let clear = SingleScattering::new(&grey(0.0, 0.0, 1.3));
    assert!(clear.sample_distance(0.5, 1.0).is_none());
    assert!(clear.plane_brdf(a, b, Vec3::Z).is_black() && clear.total().is_black());
}

fn direction() -> impl Strategy<Value = Vec3> {
    (-1.0_f32..=1.0, 0.0_f32..6.3).prop_map(|(z, phi)| {
        let s = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(s * phi.cos(), s * phi.sin(), z)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn it_is_finite_and_not_negative_for_any_input(
        phi in 0.0_f64..6.3, log_r in -40.0_f64..30.0, w in direction(), w_i in direction(), n_i in direction(),
        log_s in -14.0_f64..14.0, log_a in -14.0_f64..14.0, g in -0.99_f64..0.999_999_9, eta in 0.4_f64..4.0,
        u in 0.0_f32..0.999_999, grazing in any::<bool>(),
    ) {
        let medium = ChannelMedium { sigma_s: log_s.exp(), sigma_a: log_a.exp(), g, eta };
        let mut w = w;
        if grazing {
            w.z = -1e-7;
            w = w.normalize();
        }
        let x = DVec3::new(phi.cos(), phi.sin(), 0.0) * log_r.exp();
        let m = SingleChannel::new(&medium).exitance(x, DVec3::Z, w.as_dvec3());
        prop_assert!(m.is_finite() && m >= 0.0, "{m}");
        let rgb = Rgb::splat(medium.sigma_s as f32);
        let single = SingleScattering::new(&Medium {
            sigma_s: rgb, sigma_a: Rgb([medium.sigma_a as f32, 0.0, 1.0]), g, eta: eta as f32,
        });
        let s = single.sample_distance(u, log_r.exp() as f32).unwrap();
        prop_assert!(s.pdf > 0.0 && s.pdf.is_finite() && s.distance >= 0.0, "{s:?}");
        let light = LightPath { w_i, n_i, distance: s.distance };
        let value = single.along_camera_ray_sampled(s.distance, log_r.exp() as f32, w, &light);
        prop_assert!(value.is_finite() && value.min() >= 0.0, "{value:?}");
    }
}
