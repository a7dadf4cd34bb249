//! The same body gives the same light, however wide it is and whatever else stands in the scene.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // figures for docs/rays.md

use marmor::geometry::Precision;
use marmor::integrator::{View, VolumePath, VolumePathOptions};
use marmor::light::{Group, Lights};
use marmor::math::{Vec3, hash, unit_f32};
use marmor::query::{self, Backend, Ray};
use marmor::scene::{Orders, Scene};
use marmor::tally::WalkTally;
use parts::centred;
use rendering::{backends, channels, load, load_beside, mean_of, on};

mod parts;
mod rendering;

/// The slab of [van de Hulst 1980] that Monte Carlo programs are held against: light along the normal, 0.2 mm thick, n = 1.
const VAN_DE_HULST: &str = "sigma_a = 1\nsigma_s = 9\ng = 0.75\neta = 1";
const REFLECTED: f64 = 0.09739;
const TRANSMITTED: f64 = 0.66096;

/// A slab, and a black floor below it, far away.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Edges of the slab's faces [mm].
    width: f64,
    thickness: f64,
    /// Distance of the floor, which is as wide as far [mm]; none for 0.
    floor: f64,
    /// Angles by which the slab is turned.
    rotate: [f64; 3],
}

impl Place {
    fn scene(&self, medium: &str) -> Scene {
        let Self { width, thickness, floor, rotate: [x, y, z] } = *self;
        let half = [0.5 * width, 0.5 * thickness, 0.5 * width];
        let below = if floor > 0.0 {
            format!(
                "[[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, {:e}, 0]\nedge_u = [0, 0, {floor:e}]\n\
                 edge_v = [{floor:e}, 0, 0]\nmaterial = \"black\"\n[material.black]\ntype = \"diffuse\"\nalbedo = 0\n",
                -floor
            )
        } else {
            String::new()
        };
        let text = format!(
            "unit = \"mm\"\n[camera]\nposition = [0, {:e}, 0]\nlook_at = [0, 0, 0]\nup = [0, 0, 1]\nfov = 0.5\n\
             resolution = [32, 32]\n[environment]\nradiance = 1\n\
             [[object]]\nname = \"slab\"\nmesh = \"slab.obj\"\ntransform = {{ rotate = [{x}, {y}, {z}] }}\nmaterial = \"m\"\n\
             [material.m]\ntype = \"translucent\"\n{medium}\n{below}[method]\nname = \"volume_path\"\n",
            50.0 * thickness
        );
        load_beside("slab.obj", &centred(half), &text)
    }
}

fn options(orders: Orders) -> VolumePathOptions {
    VolumePathOptions { orders, photons: 0, specular: true, seed: 1 }
}

/// Light that is reflected and that is transmitted of a beam onto the upper face along its normal, each with its standard error.
fn slab(place: Place, medium: &str, backend: Backend, paths: u64) -> [(f64, f64); 2] {
    traced(&place.scene(medium), place, backend, paths)
}

fn traced(scene: &Scene, place: Place, backend: Backend, paths: u64) -> [(f64, f64); 2] {
    let rays = query::build(backend, &scene.meshes()).unwrap();
    let view = View { scene, rays: &*rays };
    let method = VolumePath::new(scene, options(Orders::All)).unwrap();
    let mesh = &scene.objects[0].mesh;
    let up = mesh.geometric_normal(6);
    let mut tally = WalkTally::default();
    let mut sums = [[0.0; 2]; 2];
    for i in 0..paths {
        let key = hash(i + 1);
        // As a camera does: a ray, the triangle that it meets, the point there. Anywhere in the middle of the face.
        let aside = |k: u64| place.width * ((hash(key ^ k) >> 40) as f64 / f64::from(1 << 24) - 0.5) * 0.5;
        let across = [Vec3::X, Vec3::Z].map(|e| (e - up * up.dot(e)).normalize().as_dvec3());
        let from = up.as_dvec3() * (50.0 * place.thickness) + across[0] * aside(1) + across[1] * aside(2);
        let hit = rays.closest(&Ray::new(from, -up)).unwrap();
        let at = mesh.point(hit.triangle, hit.u, hit.v);
        let Some(left) = method.pencil(view, 0, (at.leave(-up), -up), 0.5, key, &mut tally) else { continue };
        let side = usize::from(left.w.dot(up) < 0.0);
        let weight = f64::from(left.weight[0]);
        sums[side] = [sums[side][0] + weight, sums[side][1] + weight * weight];
    }
    let n = paths as f64;
    // Where f32 is taken by force they are.
    let meant = scene.why_double.is_none() || mesh.precision == Precision::Double;
    assert!(!meant || (tally.losses.total() as f64) < 1e-4 * n, "{place:?}: {} paths lost", tally.losses.total());
    sums.map(|[sum, squares]| (sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt()))
}

const FLAT: Place = Place { width: 20.0, thickness: 0.2, floor: 0.0, rotate: [0.0; 3] };

/// Off by more than this number of standard errors.
fn off((mean, error): (f64, f64), expected: f64) -> f64 {
    (mean - expected).abs() / error
}

#[test]
fn the_slab_of_van_de_hulst_has_its_light_however_wide_it_is_and_wherever_the_floor() {
    for (width, floor, rotate) in [
        (20.0, 0.0, [0.0; 3]),
        (40.0, 1e4, [0.0; 3]),
        (40.0, 1e7, [17.0, 0.0, 30.0]),
        (2e4, 0.0, [0.0; 3]),
        (2e5, 1e3, [5.0, 40.0, -20.0]),
        (2e6, 1e7, [20.0, 0.0, 45.0]),
    ] {
        let place = Place { width, floor, rotate, ..FLAT };
        for backend in backends() {
            let [r, t] = slab(place, VAN_DE_HULST, backend, 40_000);
            assert!(r.1 < 0.02 * REFLECTED && t.1 < 0.005 * TRANSMITTED, "{r:?} {t:?}");
            // Two numbers of twelve runs: 4 standard errors are met by chance once in 600 suites.
            assert!(off(r, REFLECTED) < 4.0 && off(t, TRANSMITTED) < 4.0, "{place:?} {}: {r:?} {t:?}", backend.name());
        }
    }
}

/// For the figures in docs/rays.md, to 0.3 % of the reflected light.
#[test]
#[ignore = "a measurement"]
fn the_slab_of_van_de_hulst_to_a_third_of_a_percent() {
    for rotate in [[0.0; 3], [17.0, 3.0, 30.0]] {
        for (width, floor) in [
            (20.0, 0.0),
            (2e2, 0.0),
            (2e3, 0.0),
            (2e4, 0.0),
            (2e5, 0.0),
            (2e6, 0.0),
            (40.0, 1e3),
            (40.0, 1e4),
            (40.0, 1e6),
            (40.0, 1e7),
            (2e6, 1e7),
        ] {
            let place = Place { width, floor, rotate, ..FLAT };
            for backend in backends() {
                let double = place.scene(VAN_DE_HULST).why_double.is_some();
                let [r, t] = slab(place, VAN_DE_HULST, backend, 1_000_000);
                println!(
                    "{width:.0e} mm, floor {floor:.0e}, {rotate:?}, {}, double {double}: {:.5} ± {:.5} ({:.1}), {:.5} ± {:.5} ({:.1})",
                    backend.name(),
                    r.0,
                    r.1,
                    off(r, REFLECTED),
                    t.0,
                    t.1,
                    off(t, TRANSMITTED)
                );
                assert!(off(r, REFLECTED) < 3.5 && off(t, TRANSMITTED) < 3.5);
                if double {
                    break; // no backend is asked
                }
            }
        }
    }
}

/// What f32 does to the light of slabs that it should not get, for the limits of `scene/precision.rs`.
#[test]
#[ignore = "a measurement"]
fn what_f32_would_do() {
    let both = |place: Place, medium: &str, paths: u64| {
        let mut scene = place.scene(medium);
        [Precision::Double, Precision::Single].map(|precision| {
            scene.objects.iter_mut().for_each(|o| o.mesh.precision = precision);
            traced(&scene, place, Backend::preferred(), paths)
        })
    };
    let tell = |what: String, [f64s, f32s]: [[(f64, f64); 2]; 2]| {
        let ratio = |k: usize| f32s[k].0 / f64s[k].0 - 1.0;
        let error = |k: usize| (f32s[k].1 / f32s[k].0).hypot(f64s[k].1 / f64s[k].0);
        println!("{what}: R {:+.4} ± {:.4}, T {:+.4} ± {:.4}", ratio(0), error(0), ratio(1), error(1));
    };
    for width in [20.0, 1e2, 4e2, 2e3, 1e4, 2e4] {
        let place = Place { width, ..FLAT };
        let offset = 32.0 * f64::from(f32::EPSILON) * 0.5 * width / place.thickness;
        tell(format!("offset {offset:.1e} of the thickness"), both(place, VAN_DE_HULST, 400_000));
    }
    for (albedo, offset) in [0.5, 0.9, 0.99].into_iter().flat_map(|a| [5e-3, 2e-2, 0.1, 0.5].map(|o| (a, o))) {
        let place = Place { width: 200.0, thickness: 40.0, ..FLAT };
        let sigma = offset / (32.0 * f64::from(f32::EPSILON) * 100.0);
        let medium =
            format!("sigma_a = {:e}\nsigma_s = {:e}\ng = 0\neta = 1.3", (1.0 - albedo) * sigma, albedo * sigma);
        tell(format!("albedo {albedo}, offset {offset:.0e} mean free paths"), both(place, &medium, 150_000));
    }
}

/// Extents of 1 to 1e6 times the thickness, against each other: the light of a slab whose rim is far.
#[test]
fn every_extent_that_is_wide_enough_gives_the_same_light() {
    let medium = "sigma_a = 2\nsigma_s = 60\ng = 0.5\neta = 1.3";
    let known = slab(Place { width: 10.0, ..FLAT }, medium, Backend::preferred(), 60_000);
    for width in [1e2, 1e3, 1e4, 2e5] {
        let found = slab(Place { width, ..FLAT }, medium, Backend::preferred(), 60_000);
        for (a, b) in known.iter().zip(&found) {
            assert!((a.0 - b.0).abs() < 4.0 * a.1.hypot(b.1), "{width}: {known:?} {found:?}");
        }
    }
}

/// What the camera of a render sees under an even environment: all that is reflected and transmitted of its rays.
#[test]
fn a_render_of_a_wide_slab_has_all_its_light() {
    for (width, rotate) in [(20.0, [0.0; 3]), (2e6, [0.0, 0.0, 20.0])] {
        let mut scene = Place { width, rotate, ..FLAT }.scene(VAN_DE_HULST);
        // Along the normal, which the camera of these scenes is not where the slab is turned.
        let up = scene.objects[0].mesh.geometric_normal(6);
        let camera = marmor::scene::Camera::new([32, 32], up.as_dvec3() * 10.0, -up, Vec3::Z, 0.004, 0.004).unwrap();
        scene.camera = camera;
        for backend in backends() {
            let method = VolumePath::new(&scene, options(Orders::All)).unwrap();
            let (film, _) = on(backend, &scene, &method, 1, 0..16);
            let (mean, error) = mean_of(film.image().pixels.iter().map(|p| f64::from(p[0])));
            let expected = REFLECTED + TRANSMITTED;
            assert!(error < 0.005 && (mean - expected).abs() < 4.0 * error, "{width}: {mean} ± {error}");
        }
    }
}

#[test]
fn f64_is_taken_where_it_is_needed_and_said_with_numbers() {
    let why = |place: Place, medium: &str| place.scene(medium).why_double;
    assert_eq!(why(FLAT, VAN_DE_HULST), None);
    // A floor far below moves no body of its own.
    assert_eq!(why(Place { floor: 1e2, ..FLAT }, VAN_DE_HULST), None);
    let wide = why(Place { width: 2e4, ..FLAT }, VAN_DE_HULST).unwrap();
    assert!(wide.contains("object \"slab\" is 0.2 units thick") && wide.contains("start 3.8e-2 units"), "{wide}");
    let floor = why(Place { floor: 1e7, ..FLAT }, VAN_DE_HULST).unwrap();
    assert!(floor.contains("away from object \"floor\""), "{floor}");
    let dense = why(FLAT, "sigma_a = 1\nsigma_s = 9e6\ng = 0\neta = 1.3").unwrap();
    assert!(dense.contains("transport mean free path in object \"slab\" is 1.111e-7 units"), "{dense}");
    // A thick body in a usual scene, on a floor a hundred times its size.
    let thick = Place { width: 100.0, thickness: 60.0, floor: 1e4, rotate: [0.0; 3] };
    assert_eq!(why(thick, "sigma_a = 0.003\nsigma_s = 2.2\ng = 0\neta = 1.5"), None);
}

#[test]
fn what_f64_cannot_hold_either_is_warned_of() {
    let beyond = Place { width: 1e12, ..FLAT }.scene(VAN_DE_HULST).warnings.join("\n");
    assert!(
        beyond.contains("object \"slab\": it is 0.2 units thick on") && beyond.contains("make it thicker"),
        "{beyond}"
    );
    assert_eq!(Place { width: 2e6, ..FLAT }.scene(VAN_DE_HULST).warnings, Vec::<String>::new());
}

/// A lamp a million units away leaves a ball of 2 units as it is: the same light as from one nearer and smaller.
#[test]
fn a_lamp_far_away_does_not_coarsen_a_body() {
    let mean = |distance: f64, backend: Backend| {
        let edge = 0.1 * distance;
        let text = format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [24, 24]\n\
             [[object]]\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 2\nrings = 24\nsegments = 32\nmaterial = \"a\"\n\
             [[object]]\nshape = \"rectangle\"\ncentre = [0, {distance:e}, 0]\nedge_u = [{edge:e}, 0, 0]\n\
             edge_v = [0, 0, {edge:e}]\nmaterial = \"lamp\"\n\
             [material.a]\ntype = \"translucent\"\nsigma_s_prime = [3, 5, 7]\nsigma_a = [0.001, 0.01, 0.1]\neta = 1.3\n\
             [material.lamp]\ntype = \"emissive\"\nradiance = 1\ntwo_sided = true\n"
        );
        let scene = load(&text);
        assert_eq!(scene.why_double, None);
        let method = VolumePath::new(&scene, VolumePathOptions { photons: 2000, ..options(Orders::All) }).unwrap();
        channels(&on(backend, &scene, &method, 1, 0..12).0.image())
    };
    for backend in backends() {
        let [near, far] = [1e3, 1e6].map(|distance| mean(distance, backend));
        for c in 0..3 {
            // The same random numbers meet the same lamp as seen from the ball: they differ by its parallax, 0.2 %.
            assert!((far[c] / near[c] - 1.0).abs() < 0.02, "{}: {near:?} {far:?}", backend.name());
        }
    }
}

/// A lamp whose coordinates are tiny where those of what it lights are not: no shadow ray may end in the lamp itself.
#[test]
fn a_small_lamp_in_the_middle_of_a_wide_scene_does_not_shade_itself() {
    let plane = |y: f64, edge: f64, material: &str| {
        format!(
            "[[object]]\nshape = \"rectangle\"\ncentre = [0, {y}, 0]\nedge_u = [0, {}, {edge}]\nedge_v = [{edge}, 0, 0]\n\
             material = \"{material}\"\n",
            if y == 0.0 { 0.3 * edge } else { 0.0 }
        )
    };
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 4, 9]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [8, 8]\n{}{}{}\
         [material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n[material.lamp]\ntype = \"emissive\"\nradiance = 1\ntwo_sided = true\n",
        plane(-5.0, 100.0, "grey"),
        plane(5.0, 100.0, "grey"),
        plane(0.0, 0.02, "lamp")
    );
    let mut scene = load(&text);
    assert_eq!(scene.why_double, None);
    for precision in [Precision::Single, Precision::Double] {
        scene.objects.iter_mut().for_each(|o| o.mesh.precision = precision);
        let lights = Lights::new(&scene);
        for backend in backends() {
            let rays = query::build(backend, &scene.meshes()).unwrap();
            let mut asked = 0;
            for i in 0..20_000_u64 {
                let u = |k: u64| unit_f32((hash(5 * i + k + 1) >> 32) as u32);
                let at = scene.objects[0].mesh.point((i % 2) as u32, u(0).into(), (u(1) * (1.0 - u(0))).into());
                let at = at.facing(Vec3::Y);
                let Some(arrival) = lights.arrival(&scene, Group::Near, &at, [u(2), u(3), u(4)]) else { continue };
                asked += 1;
                assert!(!rays.occluded(&arrival.shadow), "{precision:?} on {}: {:?}", backend.name(), arrival.shadow);
            }
            assert!(asked > 10_000);
        }
    }
}
