//! Clear bodies by `path` and `subsurface`: against `volume_path`, closed forms and white furnaces.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod parts;
mod rendering;

use marmor::geometry::sphere as ball;
use marmor::integrator::{Integrator, Path, SubsurfaceOptions, VolumePath, VolumePathOptions};
use marmor::math::DVec3;
use marmor::scene::{Estimator, Scene};
use parts::{camera, cuboid, diffuse, emissive, mesh, rectangle, sky, sphere, translucent};
use rendering::{Within, agree, average, film, load, load_beside, mean_of, options, subsurface};

const WITHIN: Within = Within { errors: 6.0, noise: 0.01 };

fn means<I: Integrator>(scene: &Scene, passes: u32, of: impl Fn(u64) -> I) -> (f64, f64) {
    mean_of((1..=10).map(|seed| average(&film(&of(seed), scene, passes, seed, &mut []).image())))
}

fn traced(scene: &Scene, passes: u32) -> (f64, f64) {
    means(scene, passes, |seed| {
        VolumePath::new(scene, VolumePathOptions { seed, photons: 2000, ..Default::default() }).unwrap()
    })
}

fn over_surfaces(scene: &Scene, passes: u32) -> (f64, f64) {
    means(scene, passes, |seed| Path::new(scene, None, seed).unwrap())
}

fn with(seed: u64) -> SubsurfaceOptions {
    options(Estimator::Cut, 8192, seed)
}

fn modelled(scene: &Scene, passes: u32) -> (f64, f64) {
    means(scene, passes, |seed| subsurface(scene, with(seed)))
}

fn dielectric(name: &str, eta: f64, sigma_a: f64) -> String {
    format!("[material.{name}]\ntype = \"dielectric\"\neta = {eta}\nsigma_a = {sigma_a}\n")
}

/// A glass ball on a Lambertian floor under a lamp and a sky, a bubble and an absorbing ball in it: as `volume_path` has them, caustics,
/// total reflection and bodies in one another included. The camera outside, and in the glass.
#[test]
fn glass_on_a_floor_is_the_same_by_path_subsurface_and_volume_path() {
    for (eye, passes) in [([1.0, 3.0, 7.0], 48), ([0.2, 0.5, 0.4], 48)] {
        let text = camera(eye, [0.0, -0.3, 0.0], 34.0, [12, 12])
            + &sphere("ball", [0.0; 3], 1.0, 24, "glass")
            + &sphere("bubble", [0.4, 0.3, 0.2], 0.3, 16, "air")
            + &sphere("ink", [-0.4, -0.2, 0.1], 0.35, 16, "ink")
            + &rectangle("floor", [0.0, -1.01, 0.0], [6.0, 0.0, 0.0], [0.0, 0.0, -6.0], "floor")
            + &rectangle("lamp", [1.5, 4.0, -0.5], [0.0, 0.0, 1.5], [-1.5, 0.0, 0.0], "glow")
                .replace("material", "flip = true\nmaterial")
            + &dielectric("glass", 1.5, 0.1)
            + &dielectric("air", 1.0, 0.0)
            + &dielectric("ink", 1.33, 2.0)
            + &diffuse("floor", 0.6)
            + &emissive("glow", 4.0)
            + &sky(0.4);
        let scene = load(&text);
        let truth = traced(&scene, 2 * passes);
        agree(over_surfaces(&scene, passes), truth, WITHIN, "path");
        agree(modelled(&scene, passes), truth, WITHIN, "subsurface");
        for name in ["path", "subsurface"] {
            let scene = load(&(text.clone() + &format!("[method]\nname = \"{name}\"\n")));
            assert_eq!(scene.warnings, Vec::<String>::new(), "{name}");
        }
    }
}

/// Light through a plate at a slant: Fresnel's factors of both faces, exp(-d) of the way inside, reflections to and fro.
#[test]
fn a_plate_lets_through_what_the_closed_form_says() {
    let (eta, sigma, sine) = (1.5_f64, 0.3, 0.8_f64);
    let scene = load_beside(
        "plate.obj",
        &cuboid([-30.0, -30.0, -1.0], [30.0, 30.0, 0.0]),
        &(camera([8.0, 0.0, 6.0], [0.0; 3], 0.001, [4, 4])
            + &mesh("plate", "plate.obj", "glass")
            + &rectangle("below", [0.0, 0.0, -9.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0], "glow")
            + &dielectric("glass", eta, sigma)
            + &emissive("glow", 1.0)),
    );
    let (outside, inside) = ((1.0 - sine * sine).sqrt(), (1.0 - (sine / eta).powi(2)).sqrt());
    let s = ((outside - eta * inside) / (outside + eta * inside)).powi(2);
    let p = ((eta * outside - inside) / (eta * outside + inside)).powi(2);
    // Unpolarised at each face, as the renderer takes it.
    let (f, passed) = (0.5 * (s + p), (-sigma / inside).exp());
    let through = (1.0 - f).powi(2) * passed / (1.0 - f * f * passed * passed);
    agree(over_surfaces(&scene, 256), (through, 0.0), WITHIN, "path");
    agree(modelled(&scene, 256), (through, 0.0), WITHIN, "subsurface");
}

const MILK: &str = "sigma_s = [5, 10, 20]\nsigma_a = 0\ng = 0\neta = 1.3";

/// What absorbs nothing is white in a white furnace, whatever glass stands before it, beside it and around it, and whatever comes over
/// the floor. Each light is counted once: with shadow rays through glass, or without the paths, it is not 1.
#[test]
fn white_bodies_and_clear_glass_are_white() {
    let shell = |text: &str| {
        let (outer, inner) = (ball(DVec3::ZERO, 1.3, 16, 32), ball(DVec3::ZERO, 1.1, 16, 32));
        let corners = outer.positions.iter().chain(&inner.positions);
        let mut obj: String = corners.map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
        outer.triangles.iter().for_each(|t| obj += &format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
        let base = outer.positions.len() as u32 + 1;
        inner.triangles.iter().for_each(|t| obj += &format!("f {} {} {}\n", t[0] + base, t[2] + base, t[1] + base));
        load_beside("shell.obj", &obj, text)
    };
    let head = camera([0.0, 3.0, 12.0], [0.0, -0.2, 0.0], 15.0, [12, 12]);
    let floor =
        rectangle("floor", [0.0, -1.32, 0.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0], "floor") + &diffuse("floor", 1.0);
    let rest = translucent("milk", MILK) + &dielectric("glass", 1.5, 0.0) + &floor + &sky(1.0);
    let beside = head.clone()
        + &sphere("milk", [0.0; 3], 1.0, 24, "milk")
        + &sphere("glass", [1.7, -0.2, 0.5], 0.65, 24, "glass")
        + &mesh("plate", "plate.obj", "glass")
        + &rest;
    let beside = load_beside("plate.obj", &cuboid([-2.0, -1.2, 1.4], [0.2, 1.4, 1.7]), &beside);
    let around =
        shell(&(head + &sphere("milk", [0.0; 3], 1.0, 24, "milk") + &mesh("shell", "shell.obj", "glass") + &rest));
    for (what, scene) in [("a ball and a plate beside milk", beside), ("a shell around milk", around)] {
        agree(modelled(&scene, 16), (1.0, 0.0), Within { noise: 0.006, ..WITHIN }, what);
    }
}

/// Light of a lamp that comes to a body through a plate alone, and light that the plate mirrors to it: two bodies of the same medium
/// whose models have all light right (a wide slab lit evenly), with the plate and without, are as bright as the plate's factors say.
#[test]
fn a_lamp_behind_glass_lights_a_body_as_volume_path_says() {
    // Five transport mean free paths with α' 0.999: `slab` has its totals right to 1 % (docs/models.md).
    let medium = "sigma_s_prime = 4.995\nsigma_a = 0.005\neta = 1.3\nmodel = \"slab\"\nthickness = 1";
    let text = |glass: bool| {
        camera([0.0, 0.0, 1.5], [0.0; 3], 1.0, [6, 6])
            + &mesh("wax", "wax.obj", "wax")
            + &rectangle("lamp", [0.0, 0.0, 3.0], [4.0, 0.0, 0.0], [0.0, -4.0, 0.0], "glow")
            + &if glass { mesh("plate", "plate.obj", "glass") + &dielectric("glass", 1.5, 0.2) } else { String::new() }
            + &translucent("wax", medium)
            + &emissive("glow", 1.0)
    };
    let scene = |glass| {
        let folder = tempfile::tempdir().unwrap();
        for (name, low, high) in
            [("wax.obj", [-4.0, -4.0, -1.0], [4.0, 4.0, 0.0]), ("plate.obj", [-4.5, -4.5, 2.0], [4.5, 4.5, 2.4])]
        {
            std::fs::write(folder.path().join(name), cuboid(low, high)).unwrap();
        }
        rendering::load_in(folder.path(), &text(glass))
    };
    let [bare, covered] = [scene(false), scene(true)];
    let [paths, models] = [[&bare, &covered].map(|s| traced(s, 256)), [&bare, &covered].map(|s| modelled(s, 64))];
    let ratio = |[bare, covered]: [(f64, f64); 2]| {
        let ratio = covered.0 / bare.0;
        (ratio, ratio * (covered.1 / covered.0).hypot(bare.1 / bare.0))
    };
    let (true_ratio, found) = (ratio(paths), ratio(models));
    assert!(true_ratio.0 > 0.5 && true_ratio.0 < 0.95, "{true_ratio:?}");
    agree(found, true_ratio, Within { errors: 6.0, noise: 0.02 }, "with glass over without");
}

/// Where paths cannot have it, it is said by name with the remedy: milk in contact with glass, glass without an inside, no other surfaces.
#[test]
fn what_cannot_be_shown_is_named() {
    let head = camera([0.0, 3.0, 12.0], [0.0; 3], 15.0, [4, 4]);
    let rest = |method: &str| {
        translucent("milk", MILK)
            + &dielectric("glass", 1.5, 0.0)
            + &sky(1.0)
            + &format!("[method]\nname = \"{method}\"\n")
    };
    let nested = sphere("milk", [0.0; 3], 1.0, 16, "milk") + &sphere("cup", [0.0; 3], 1.3, 16, "glass");
    let said = load(&(head.clone() + &nested + &rest("subsurface"))).warnings.join("\n");
    assert!(said.contains("\"milk\" lies inside \"cup\"") && said.contains("take --method volume_path"), "{said}");
    let pane = rectangle("pane", [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], "glass");
    for method in ["path", "subsurface"] {
        let said = load(&(head.clone() + &pane + &rest(method))).warnings.join("\n");
        assert!(said.contains("\"pane\": an open sheet") && said.contains("light that enters it is lost"), "{said}");
    }
    let lone = load(&(head + &sphere("ball", [0.0; 3], 1.0, 16, "glass") + &rest("subsurface")));
    let black = subsurface(&lone, SubsurfaceOptions { bounces: 0, ..with(1) }).warnings(&lone).join("\n");
    assert!(black.contains("`bounces = 0`") && black.contains("--method volume_path"), "{black}");
    assert_eq!(subsurface(&lone, with(1)).warnings(&lone), Vec::<String>::new());
}
