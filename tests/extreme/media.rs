//! Media at the ends of what there is.

use super::furnace::{self, ERRORS, Of, in_all_models, of_paths, translucent};
use super::harness::{
    BALL, backends, load, load_with, medium, ok, refused, sound_in_all_models, subsurface_shot, warns,
};
use super::parts::centred;
use marmor::bssrdf::{Bssrdf, Slab};
use marmor::integrator::{VolumePath, VolumePathOptions};
use marmor::math::Vec3;
use marmor::optics::transmittance;
use marmor::query::{self, Backend, Ray};
use marmor::scene::{Estimator, Orders};

/// A medium of reduced albedo 0.99 in which the ball has the stiffness N = A σ_tr² / 2π.
fn stiff(n: f64) -> String {
    let sigma_tr = (n * 2.0 * std::f64::consts::PI / (4.0 * std::f64::consts::PI)).sqrt();
    let sigma_t_prime = sigma_tr / (3.0_f64 * 0.01).sqrt();
    medium(&format!("{}", 0.99 * sigma_t_prime), &format!("{}", 0.01 * sigma_t_prime), "eta = 1.3")
}

fn stiffness(n: f64, of: Of) {
    sound_in_all_models(&stiff(n));
    in_all_models(&stiff(n), of);
    let shots = ok(&load(&stiff(n)).unwrap());
    assert!(shots.iter().all(|shot| shot.brightest() > 0.01), "the ball is lit");
}

#[test]
fn stiffness_1e_minus_3_warns() {
    sound_in_all_models(&stiff(1e-3));
    in_all_models(&stiff(1e-3), Of::Soft);
    of_paths(&stiff(1e-3), 16);
    warns(&load(&stiff(1e-3)).unwrap(), &["transport mean free path", "longer than the object's diagonal"]);
}

#[test]
fn stiffness_1_ok() {
    stiffness(1.0, Of::Soft);
    of_paths(&stiff(1.0), 16);
}

#[test]
fn stiffness_1e2_ok() {
    stiffness(1e2, Of::Stiff);
    of_paths(&stiff(1e2), 4);
}

#[test]
fn stiffness_1e4_ok() {
    stiffness(1e4, Of::Plane);
}

#[test]
fn stiffness_1e6_ok() {
    stiffness(1e6, Of::Plane);
}

#[test]
fn stiffness_1e8_ok() {
    stiffness(1e8, Of::Stiff);
}

/// Far below the rounding of a place in single precision.
#[test]
fn a_body_of_1e8_mean_free_paths_ok() {
    let text = medium("5e7", "1e3", "eta = 1.3");
    sound_in_all_models(&text);
    in_all_models(&text, Of::Stiff);
    ok(&load(&text).unwrap());
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
    in_all_models(&text, Of::Soft);
    of_paths(&text, 150);
    ok(&load(&text).unwrap());
}

#[test]
fn no_scattering_warns() {
    let text = medium("0", "[2, 3, 4]", "eta = 1.3");
    sound_in_all_models(&text);
    warns(&load(&text).unwrap(), &["reduced albedo 0 in red", "outside diffusion theory"]);
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
    in_all_models(&text, Of::Soft);
    ok(&load(&text).unwrap());
}

#[test]
fn backward_scattering_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "g = -0.99\neta = 1.3");
    sound_in_all_models(&text);
    in_all_models(&text, Of::Soft);
    of_paths(&text, 16);
    ok(&load(&text).unwrap());
}

/// Models that add exact single scattering to all other orders by diffusion have too much light; the number said is what comes
/// back.
#[test]
fn backward_scattering_in_models_of_later_orders_warns() {
    let text = medium("50", "0", "g = -0.999\neta = 1.3");
    for model in ["better", "beam"] {
        let scene = furnace::scene(&text, model).unwrap();
        let said = scene.warnings.join("\n");
        assert!(said.contains("does not conserve energy") && said.contains("at g = -0.999"), "{said}");
        let number = said.split("absorption ").nth(1).and_then(|rest| rest.split(' ').next());
        let number: f64 = number.and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{said}"));
        assert!((number - furnace::most(translucent(&scene))).abs() < 0.01, "{said}");
        let (mean, error) = furnace::by(&scene, Backend::preferred(), Estimator::Cut, true)[0];
        // T21 is 0.983, and the ball is a plane but for some percent.
        assert!((mean / number - 1.0).abs() < 0.06 + ERRORS * error, "{model}: {mean} +- {error}, said {number}");
        assert!(mean > 1.2, "{model}: {mean}");
    }
    for model in ["standard", "normalised"] {
        assert_eq!(furnace::scene(&text, model).unwrap().warnings, Vec::<String>::new());
    }
}

/// The kernel as published; calibrated it has no more than all of the light.
#[test]
fn directional_as_published_warns() {
    let text = medium("[20, 30, 40]", "[0.05, 0.1, 0.2]", "eta = 1.3\nmodel = \"directional\"");
    in_all_models(&text, Of::Stiff);
    warns(
        &load(&text).unwrap(),
        &["material \"wax\"", "`directional` as published", "1.24 times", "calibrated = true"],
    );
    let calibrated = text.replace("model = ", "calibrated = true\nmodel = ");
    assert_eq!(load(&calibrated).unwrap().warnings, Vec::<String>::new());
}

#[test]
fn g_of_1_refused() {
    refused(load(&medium("2", "0.1", "g = 1\neta = 1.3")), &["`material.wax.g` is 1", "below 1"]);
}

#[test]
fn matched_boundary_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 1");
    sound_in_all_models(&text);
    in_all_models(&text, Of::Soft);
    of_paths(&text, 16);
    ok(&load(&text).unwrap());
}

#[test]
fn a_bubble_in_glass_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 0.6667");
    sound_in_all_models(&text);
    in_all_models(&text, Of::Soft);
    of_paths(&text, 16);
    ok(&load(&text).unwrap());
}

#[test]
fn eta_of_10_ok() {
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 9.9");
    sound_in_all_models(&text);
    in_all_models(&text, Of::Soft);
    of_paths(&text, 16);
    ok(&load(&text).unwrap());
}

#[test]
fn eta_beyond_10_refused() {
    refused(load(&medium("2", "0.1", "eta = 11")), &["eta"]);
}

/// A wide box in light from all sides, seen from above.
fn sheet(depth: f64, wax: &str) -> marmor::scene::Scene {
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0.5, 9, 1]\nlook_at = [0.2, 0, 0.3]\nfov = 0.001\nresolution = [4, 3]\n\
         [environment]\nradiance = 1\n[[object]]\nname = \"body\"\nmesh = \"box.obj\"\nmaterial = \"wax\"\n\
         [material.wax]\ntype = \"translucent\"\n{wax}"
    );
    load_with(&text, &[("box.obj", &centred([20.0, 0.5 * depth, 20.0]))], false).unwrap()
}

/// Reflected and transmitted light together, as the model's totals say.
#[test]
fn a_slab_of_a_little_more_than_one_mean_free_path_ok() {
    let wax = "sigma_s_prime = 2\nsigma_a = [0.05, 0.1, 0.2]\neta = 1.3\nmodel = \"slab\"\nthickness = 0.6\n";
    let scene = sheet(0.6, wax);
    assert_eq!(scene.warnings, Vec::<String>::new());
    let slab = Slab::new(&translucent(&scene).medium, 0.6, true).unwrap();
    let both = slab.total() + slab.total_transmitted();
    let leaves = f64::from(transmittance(1.3, Vec3::new(0.3, 9.0, 0.7).normalize().y));
    for backend in backends() {
        for estimator in [Estimator::Cut, Estimator::All] {
            let found = furnace::by(&scene, backend, estimator, true);
            for (c, (mean, error)) in found.into_iter().enumerate() {
                let expected = 1.0 - leaves + leaves * f64::from(both[c]);
                let what = format!("{} on {}, channel {c}: {mean} +- {error}", estimator.name(), backend.name());
                assert!(error < 0.05 * expected, "too noisy to say anything: {what}");
                assert!((mean - expected).abs() < ERRORS * error + 2e-3, "{what}, expected {expected}");
                assert!(mean < 1.0 + ERRORS * error, "{what}");
            }
        }
    }
}

#[test]
fn a_slab_of_another_thickness_than_its_body_warns() {
    let text = medium("[2, 2, 2]", "[0.05, 0.1, 0.2]", "eta = 1.3\nmodel = \"slab\"\nthickness = 4");
    warns(&load(&text).unwrap(), &["told a thickness of 4 units", "set `thickness`"]);
}

/// μ_a 1/mm, μ_s 9/mm, g 0.75, n 1, 0.2 mm: R + T = 0.09739 + 0.66096 by van de Hulst's tables, along the normal.
#[test]
fn a_slab_of_van_de_hulst_ok() {
    let mut scene = sheet(0.2, "sigma_s = 9\ng = 0.75\nsigma_a = 1\neta = 1\n");
    let straight =
        marmor::scene::Camera::new([4, 3], marmor::math::DVec3::new(0.2, 9.0, 0.3), -Vec3::Y, Vec3::X, 1e-5, 1e-5);
    scene.camera = straight.unwrap();
    for backend in backends() {
        let of = |seed| {
            let options = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed };
            VolumePath::new(&scene, options).unwrap()
        };
        let (mean, error) = furnace::seen(&scene, backend, 400, of)[0];
        assert!(error < 0.02, "too noisy to say anything: {mean} +- {error}");
        assert!((mean - 0.75835).abs() < ERRORS * error, "{}: {mean} +- {error}", backend.name());
    }
}

/// exp(-σ_a d) along the chord, where nothing scatters and the boundary bends nothing.
#[test]
fn light_through_an_absorber_warns() {
    let text = medium("0", "[0.5, 1, 2]", "eta = 1");
    warns(&load(&text).unwrap(), &["reduced albedo 0 in red", "outside diffusion theory"]);
    let scene = furnace::scene(&text, "standard").unwrap();
    let (from, w) = (Vec3::new(0.3, 1.0, 6.0), -Vec3::new(0.3, 1.0, 6.0).normalize());
    for backend in backends() {
        let rays = query::build(backend, &scene.meshes()).unwrap();
        let near = rays.closest(&Ray::new(from.as_dvec3(), w)).unwrap().t;
        let far = rays.closest(&Ray { t_min: near + 0.5, ..Ray::new(from.as_dvec3(), w) }).unwrap().t;
        let options = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed: 1 };
        let found = furnace::seen(&scene, backend, 64, |seed| {
            VolumePath::new(&scene, VolumePathOptions { seed, ..options }).unwrap()
        });
        for (c, (mean, error)) in found.into_iter().enumerate() {
            let expected = (-[0.5, 1.0, 2.0][c] * f64::from(far - near)).exp();
            let what = format!("{}, channel {c}: {mean} +- {error}, expected {expected}", backend.name());
            assert!(error < 0.05 * expected && (mean - expected).abs() < ERRORS * error + 1e-4, "{what}");
        }
    }
}

#[test]
fn a_slab_too_thin_for_its_medium_refused() {
    let text = medium("[2, 2, 2]", "[0.05, 0.1, 0.2]", "eta = 1.3\nmodel = \"slab\"\nthickness = 1e-6");
    refused(load(&text), &["thick"]);
}

/// Negative lobes of a formula are taken as 0 in the picture, and counted.
#[test]
fn values_below_zero_are_clamped_and_counted_warns() {
    // Light that leaves close to where it went in, through the other side of a sheet.
    let text = medium("[2, 3, 4]", "[0.05, 0.1, 0.2]", "eta = 1.3\nmodel = \"directional\"");
    let text = text.replace(BALL, "mesh = \"box.obj\"\nmaterial = \"wax\"");
    let sheet = centred([1.0, 0.02, 1.0]);
    let words = ["`directional` is a model of a half space", "0.04 units thick", "method `volume_path`"];
    let shots = warns(&load_with(&text, &[("box.obj", &sheet)], false).unwrap(), &words);
    let clamped: Vec<u64> = shots.iter().map(|s| s.tally.gather.clamped).collect();
    assert!(clamped.iter().any(|&n| n > 0), "{clamped:?}");
    assert!(shots.iter().filter(|s| !s.what.starts_with("subsurface")).all(|s| s.tally.gather.clamped == 0));
}
