//! Small scenes whose radiance is known on paper, rendered through the whole library by every backend of the build.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

use marmor::film::Image;
use marmor::integrator::{AmbientOcclusion, Direct, Integrator, Subsurface, SubsurfaceOptions};
use marmor::math::Rgb;
use marmor::optics::{FresnelMoments, reflectance, transmittance};
use marmor::query::Backend;
use marmor::sampling::Points;
use marmor::scene::{EntrySampling, Estimator, Scene};
use rendering::{Within, agree, backends, channels, load, mean_of, on, options};

mod rendering;

fn render<I: Integrator>(integrator: &I, scene: &Scene, backend: Backend, passes: u32, seed: u64) -> Image {
    let film = on(backend, scene, integrator, seed, 0..passes).0;
    assert_eq!(film.counts().non_finite, 0);
    film.image()
}

/// Mean over the picture of one channel, and its standard error from independent renders with other seeds.
fn mean<I: Integrator>(
    of: impl Fn(u64) -> I,
    scene: &Scene,
    backend: Backend,
    passes: u32,
    channel: usize,
) -> (f64, f64) {
    mean_of((1..=12).map(|seed| channels(&render(&of(seed), scene, backend, passes, seed))[channel]))
}

/// With twelve runs the standard error itself is known to some 20 %: 8 of them stand for 6 of a known one.
fn assert_mean(found: (f64, f64), expected: f64, what: &str) {
    agree(found, (expected, 0.0), WITHIN, what);
}

const WITHIN: Within = Within { errors: 8.0, noise: 0.02 };

/// What tests of means rest on sees a mean that is off, and says where it could not.
#[test]
fn means_that_are_off_and_means_that_say_nothing_are_refused() {
    let (mean, error) = mean_of([9.0, 10.0, 11.0, 10.0]);
    assert!(mean == 10.0 && (error - (2.0_f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12, "{mean} +- {error}");
    let refused = |b: (f64, f64)| std::panic::catch_unwind(|| agree((1.0, 0.01), b, WITHIN, "planted")).is_err();
    assert!(!refused((1.07, 0.0)) && refused((1.09, 0.0)) && refused((0.91, 0.0)) && !refused((1.1, 0.01)));
    assert!(refused((1.0, 0.03)) && !refused((1.0, 0.01)));
}

/// A camera straight above the origin that sees a spot of some 0.002 units there.
const SPOT: &str = r#"
    unit = "mm"
    [camera]
    position = [0, 0, 0.5]
    look_at = [0, 0, 0]
    fov = 0.2
    resolution = [8, 8]
"#;

fn floor(half: f64, material: &str) -> String {
    format!(
        "[[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [{half}, 0, 0]\nedge_v = [0, {half}, 0]\nmaterial = \"{material}\"\n"
    )
}

/// A rectangle facing down at height 1, `half` wide to each side.
fn ceiling(half: f64, material: &str) -> String {
    format!(
        "[[object]]\nname = \"ceiling\"\nshape = \"rectangle\"\ncentre = [0, 0, 1]\nedge_u = [0, {half}, 0]\nedge_v = [{half}, 0, 0]\nmaterial = \"{material}\"\n"
    )
}

const GREY: &str = "[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n";
const LAMP: &str = "[material.lamp]\ntype = \"emissive\"\nradiance = [3, 2, 1]\n";

/// Form factor from a small horizontal area to a parallel rectangle above it, both centred: four corner
/// rectangles a x a at distance c [Howell, catalogue of configuration factors, B-3].
fn form_factor(a: f64, c: f64) -> f64 {
    let x = a / c;
    let root = (1.0 + x * x).sqrt();
    4.0 / (2.0 * std::f64::consts::PI) * 2.0 * (x / root) * (x / root).atan()
}

fn occlusion() -> AmbientOcclusion {
    AmbientOcclusion { radius: f32::INFINITY, rays: 4 }
}

#[test]
fn nothing_occludes_a_plane() {
    let scene = load(&(SPOT.to_string() + &floor(1.0, "grey") + GREY));
    for backend in backends() {
        let image = render(&occlusion(), &scene, backend, 4, 1);
        assert!(image.pixels.iter().all(|&p| p == Rgb::WHITE), "{}", backend.name());
    }
}

#[test]
fn everything_occludes_the_inside_of_a_box() {
    let mut text = SPOT.to_string() + GREY;
    for (i, axis) in [[1, 0, 0], [0, 1, 0], [0, 0, 1]].iter().enumerate() {
        for side in [-1, 1] {
            let at = axis.map(|a| a * side);
            let (u, v) = ([axis[2], axis[0], axis[1]], [axis[1], axis[2], axis[0]]);
            text += &format!(
                "[[object]]\nname = \"wall{i}{side}\"\nshape = \"rectangle\"\ncentre = {at:?}\nedge_u = {u:?}\nedge_v = {v:?}\nmaterial = \"grey\"\n"
            );
        }
    }
    let scene = load(&text);
    for backend in backends() {
        let image = render(&occlusion(), &scene, backend, 64, 1);
        assert!(image.pixels.iter().all(|&p| p == Rgb::BLACK), "{}: light leaks into a closed box", backend.name());
    }
}

#[test]
fn a_rectangle_occludes_its_form_factor_and_a_radius_ends_it() {
    let scene = load(&(SPOT.to_string() + &floor(1.0, "grey") + &ceiling(0.7, "grey") + GREY));
    for backend in backends() {
        let found = mean(|_| occlusion(), &scene, backend, 16, 0);
        assert_mean(found, 1.0 - form_factor(0.7, 1.0), &format!("{}: occlusion", backend.name()));
        let near = AmbientOcclusion { radius: 0.99, rays: 4 };
        assert!(render(&near, &scene, backend, 4, 1).pixels.iter().all(|&p| p == Rgb::WHITE));
    }
}

#[test]
fn a_rectangle_lights_by_its_form_factor() {
    let scene = load(&(SPOT.to_string() + &floor(1.0, "grey") + &ceiling(0.7, "lamp") + GREY + LAMP));
    for backend in backends() {
        for channel in 0..3 {
            let expected = 0.5 * [3.0, 2.0, 1.0][channel] * form_factor(0.7, 1.0);
            let found = mean(|_| Direct::new(&scene, 1).unwrap(), &scene, backend, 16, channel);
            assert_mean(found, expected, &format!("{}: channel {channel}", backend.name()));
        }
    }
}

#[test]
fn a_blocker_halves_the_light_of_a_rectangle_it_half_covers() {
    // Halfway up, a blocker of half the light's size over one half of it: seen from the floor's middle it covers
    // that half exactly.
    let blocker = "[[object]]\nname = \"blocker\"\nshape = \"rectangle\"\ncentre = [0.175, 0, 0.75]\nedge_u = [0.175, 0, 0]\nedge_v = [0, 1, 0]\nmaterial = \"grey\"\n";
    let above = "[[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0, 0, 1.5]\nedge_u = [0, 0.7, 0]\nedge_v = [0.7, 0, 0]\nmaterial = \"lamp\"\n";
    let scene = load(&(SPOT.to_string() + &floor(1.0, "grey") + blocker + above + GREY + LAMP));
    for backend in backends() {
        let found = mean(|_| Direct::new(&scene, 1).unwrap(), &scene, backend, 16, 0);
        assert_mean(found, 0.5 * 0.5 * 3.0 * form_factor(0.7, 1.5), &format!("{}: half shadow", backend.name()));
    }
}

#[test]
fn the_dark_side_of_a_light_lights_nothing() {
    let turned = ceiling(0.7, "lamp")
        .replace("edge_u = [0, 0.7, 0]\nedge_v = [0.7, 0, 0]", "edge_u = [0.7, 0, 0]\nedge_v = [0, 0.7, 0]");
    let scene = load(&(SPOT.to_string() + &floor(1.0, "grey") + &turned + GREY + LAMP));
    for backend in backends() {
        assert!(
            render(&Direct::new(&scene, 1).unwrap(), &scene, backend, 4, 1).pixels.iter().all(|&p| p == Rgb::BLACK)
        );
    }
}

#[test]
fn a_white_convex_body_vanishes_in_a_white_furnace() {
    let text = SPOT.replace("0.5]", "3]").replace("fov = 0.2", "fov = 60")
        + "[environment]\nradiance = 1\n[[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nnormals = \"geometric\"\nmaterial = \"white\"\n[material.white]\ntype = \"diffuse\"\nalbedo = 1\n";
    let scene = load(&text);
    for backend in backends() {
        for pixel in render(&Direct::new(&scene, 2).unwrap(), &scene, backend, 8, 1).pixels {
            assert!((pixel[0] - 1.0).abs() < 1e-5, "{}: {pixel:?}", backend.name());
        }
    }
}

const WAX: &str = "[material.wax]\ntype = \"translucent\"\nsigma_s_prime = [2, 3, 4]\nsigma_a = [0.8, 0.6, 0.4]\neta = 1.3\ng = 0\nmodel = \"standard\"\n";

fn subsurface(seed: u64) -> SubsurfaceOptions {
    SubsurfaceOptions { cut_error: Some(0.03), specular: false, ..options(Estimator::Notes, 4096, seed) }
}

/// Total of the standard dipole [JMLH01]: (α′/2)(e^{-σ_tr z_r} + e^{-σ_tr z_v}).
fn dipole_total(sigma_s_prime: f64, sigma_a: f64, eta: f64) -> f64 {
    let sigma_t = sigma_s_prime + sigma_a;
    let sigma_tr = (3.0 * sigma_a * sigma_t).sqrt();
    let (z_r, z_v) = (1.0 / sigma_t, (1.0 + 4.0 / 3.0 * FresnelMoments::new(eta).a_groenhuis()) / sigma_t);
    sigma_s_prime / sigma_t / 2.0 * ((-sigma_tr * z_r).exp() + (-sigma_tr * z_v).exp())
}

/// A wide slab of wax in a uniform environment: what enters leaves again times the model's total, spread by T21; with the mirror
/// reflection on top, light of radiance 1 comes back as T21 · total + R.
#[test]
fn a_translucent_plane_in_a_furnace_returns_its_total() {
    let scene = load(&(SPOT.to_string() + "[environment]\nradiance = 1\n" + &floor(8.0, "wax") + WAX));
    let (t21, mirror) = (f64::from(transmittance(1.3, 1.0)), f64::from(reflectance(1.3, 1.0)));
    let totals = [dipole_total(2.0, 0.8, 1.3), dipole_total(3.0, 0.6, 1.3), dipole_total(4.0, 0.4, 1.3)];
    for backend in backends() {
        for (channel, total) in totals.into_iter().enumerate() {
            for (specular, expected) in [(false, t21 * total), (true, t21 * total + mirror)] {
                let of = |seed| Subsurface::new(&scene, SubsurfaceOptions { specular, ..subsurface(seed) }).unwrap();
                let found = mean(of, &scene, backend, 12, channel);
                assert_mean(found, expected, &format!("{}: channel {channel}, specular {specular}", backend.name()));
            }
        }
    }
}

/// The lecture's form loses what the exit Fresnel factor takes: 4 C_phi(1/eta) of the light is left.
#[test]
fn without_exit_normalisation_the_exit_takes_its_share() {
    let wax = WAX.to_string() + "exit_normalisation = false\n";
    let scene = load(&(SPOT.to_string() + "[environment]\nradiance = 1\n" + &floor(8.0, "wax") + &wax));
    let share = FresnelMoments::new(1.3).four_c_phi_outside;
    let expected = share * f64::from(transmittance(1.3, 1.0)) * dipole_total(3.0, 0.6, 1.3);
    let backend = Backend::preferred();
    assert_mean(mean(|s| Subsurface::new(&scene, subsurface(s)).unwrap(), &scene, backend, 12, 1), expected, "R_d/π");
}

/// Light-sampled and cosine-sampled entry, Sobol and independent points estimate the same integral.
#[test]
fn every_way_to_fill_the_cache_has_the_same_mean() {
    let scene = load(
        &(SPOT.to_string()
            + "[environment]\nradiance = 0.5\n"
            + &floor(3.0, "wax")
            + &ceiling(2.0, "lamp")
            + WAX
            + LAMP),
    );
    let backend = Backend::preferred();
    let run = |entry, points| {
        mean(
            |s| Subsurface::new(&scene, SubsurfaceOptions { entry, points, ..subsurface(s) }).unwrap(),
            &scene,
            backend,
            16,
            0,
        )
    };
    let expected = run(EntrySampling::Light, Points::Sobol);
    for (entry, points) in [(EntrySampling::Cosine, Points::Sobol), (EntrySampling::Cosine, Points::Independent)] {
        agree(run(entry, points), expected, WITHIN, &format!("{entry:?}, {points:?}"));
    }
}

#[test]
fn the_same_bytes_come_out_for_any_number_of_threads() {
    let text = SPOT.replace("[8, 8]", "[70, 40]").replace("fov = 0.2", "fov = 60")
        + "[environment]\nradiance = 0.5\n"
        + &floor(0.5, "wax")
        + &ceiling(0.3, "lamp")
        + "[[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0.1, 0, 0.1]\nradius = 0.08\nmaterial = \"grey\"\n"
        + WAX
        + LAMP
        + GREY;
    let scene = load(&text);
    fn bytes<I: Integrator>(integrator: &I, scene: &Scene, backend: Backend, threads: usize) -> Vec<u32> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let image = pool.install(|| render(integrator, scene, backend, 3, 7));
        image.pixels.iter().flat_map(|p| p.0.map(f32::to_bits)).collect()
    }
    fn check<I: Integrator>(integrator: &I, scene: &Scene) {
        for backend in backends() {
            let one = bytes(integrator, scene, backend, 1);
            assert!(one.iter().any(|&b| b != one[0]), "a picture with something in it");
            for threads in [2, 5] {
                let other = bytes(integrator, scene, backend, threads);
                assert!(one == other, "{}: {threads} threads change the picture", backend.name());
            }
        }
    }
    check(&occlusion(), &scene);
    check(&Direct::new(&scene, 2).unwrap(), &scene);
    for (estimator, cache_samples) in [(Estimator::Notes, 700), (Estimator::All, 700), (Estimator::Cut, 4000)] {
        let options = SubsurfaceOptions { estimator, cache_samples, specular: true, ..subsurface(7) };
        check(&Subsurface::new(&scene, options).unwrap(), &scene);
    }
}

#[test]
fn a_grey_medium_in_one_channel_is_the_same_as_in_three() {
    let grey = "[material.wax]\ntype = \"translucent\"\nsigma_s_prime = 3\nsigma_a = 0.6\neta = 1.3\ng = 0\nmodel = \"standard\"\n";
    // The first channel of a coloured medium whose slowest decay is that channel's.
    let coloured = grey.replace("sigma_a = 0.6", "sigma_a = [0.6, 0.7, 0.8]");
    let image = |material: &str| {
        let scene = load(&(SPOT.to_string() + "[environment]\nradiance = 1\n" + &floor(1.0, "wax") + material));
        let straight = SubsurfaceOptions { bounces: 0, ..subsurface(3) };
        render(&Subsurface::new(&scene, straight).unwrap(), &scene, Backend::preferred(), 1, 3)
    };
    let (one, three) = (image(grey), image(&coloured));
    for (a, b) in one.pixels.iter().zip(&three.pixels) {
        assert_eq!(a[0].to_bits(), b[0].to_bits());
        assert_eq!(a[0], a[2]);
    }
}
