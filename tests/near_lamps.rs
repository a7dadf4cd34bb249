//! `volume_path` beside lamps that nearly touch a body.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

mod parts;
mod rendering;

use marmor::integrator::{VolumePath, VolumePathOptions};
use marmor::scene::{Orders, Scene};
use parts::{camera, centred, diffuse, emissive, mesh, rectangle, sky, translucent};
use rendering::{Within, agree, average, film, load_beside, mean_of};

const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 1024, specular: true, seed: 1 };

/// Mean over the picture and the channels of independent runs, and its standard error.
fn mean(scene: &Scene, options: VolumePathOptions, passes: u32) -> (f64, f64) {
    let of = |seed| VolumePath::new(scene, VolumePathOptions { seed, ..options }).unwrap();
    mean_of((1..=16).map(|seed| average(&film(&of(seed), scene, passes, seed, &mut []).image())))
}

/// Of 16 runs Student's law passes a fair pair with a chance of 99.98 %.
fn within(noise: f64) -> Within {
    Within { errors: 5.0, noise }
}

/// A rectangle of the material `lamp`.
fn lamp(name: &str, centre: [f64; 3], u: [f64; 3], v: [f64; 3]) -> String {
    rectangle(name, centre, u, v, "lamp")
}

/// A white cube, seen from above; `lights` beside it.
fn cube(lights: &str) -> Scene {
    let text = camera([0.0, 4.5, 0.01], [0.0; 3], 25.0, [8, 8])
        + &mesh("cube", "box.obj", "white")
        + &translucent("white", "sigma_s = 3\nsigma_a = 0\ng = 0\neta = 1.3")
        + lights;
    load_beside("box.obj", &centred([1.0; 3]), &text)
}

/// A closed box of lamps around it, `gap` away on all sides but the camera's.
fn lamps_around(gap: f64, two_sided: bool) -> String {
    let (r, top) = (1.0 + gap, 5.0);
    let (middle, half) = (0.5 * (top - r), 0.5 * (top + r));
    let walls = lamp("floor", [0.0, -r, 0.0], [0.0, 0.0, r], [r, 0.0, 0.0])
        + &lamp("ceiling", [0.0, top, 0.0], [r, 0.0, 0.0], [0.0, 0.0, r])
        + &lamp("left", [-r, middle, 0.0], [0.0, half, 0.0], [0.0, 0.0, r])
        + &lamp("right", [r, middle, 0.0], [0.0, 0.0, r], [0.0, half, 0.0])
        + &lamp("back", [0.0, middle, -r], [r, 0.0, 0.0], [0.0, half, 0.0])
        + &lamp("front", [0.0, middle, r], [0.0, half, 0.0], [r, 0.0, 0.0]);
    format!("{walls}{}two_sided = {two_sided}\n", emissive("lamp", 1))
}

/// A white furnace: all that is seen is 1.
#[test]
fn lamps_all_around_at_any_gap_are_a_furnace() {
    for (gap, two_sided) in [(1.0, false), (0.1, true), (1e-2, false), (1e-3, true), (1e-4, false)] {
        let found = mean(&cube(&lamps_around(gap, two_sided)), OPTIONS, 32);
        agree(found, (1.0, 0.0), within(0.006), &format!("gap {gap}, two-sided {two_sided}"));
    }
}

/// Light scattered once, for which points of the lamps are asked, is that of an even sky, which is met by chance.
#[test]
fn light_scattered_once_beside_lamps_is_that_of_a_sky() {
    let once = VolumePathOptions { orders: Orders::Single, specular: false, ..OPTIONS };
    let sky = mean(&cube(&sky(1)), once, 128);
    for gap in [0.1, 1e-2, 1e-3, 1e-4] {
        let lamps = mean(&cube(&lamps_around(gap, false)), once, 128);
        agree(lamps, sky, within(0.01), &format!("once, gap {gap}"));
    }
}

/// A slab over a panel, seen from above, with photons and without.
#[test]
fn a_panel_under_a_slab_shines_through_as_without_photons() {
    for gap in [0.1, 1e-3] {
        let text = camera([0.0, 6.0, 0.01], [0.0; 3], 40.0, [8, 8])
            + &mesh("slab", "box.obj", "a")
            + &translucent("a", "sigma_s = 5\nsigma_a = 0.01\ng = 0\neta = 1.3")
            + &lamp("panel", [0.0, -0.5 - gap, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0])
            + &emissive("lamp", 1)
            + "two_sided = true\n";
        let scene = load_beside("box.obj", &centred([5.0, 0.5, 5.0]), &text);
        let [with, without] = [1024, 0].map(|photons| mean(&scene, VolumePathOptions { photons, ..OPTIONS }, 128));
        agree(with, without, within(0.01), &format!("gap {gap}"));
    }
}

/// A grey floor under a lamp of the same size at a gap of an eightieth of it, seen from between: the albedo, less what comes in at the
/// rims, at most (gap / distance to the rim)² = 0.06 % of it.
#[test]
fn a_floor_close_under_a_lamp_has_its_albedo() {
    let text = camera([0.0, 0.09, 0.0], [0.01, 0.0, 0.0], 30.0, [8, 8])
        + &rectangle("floor", [0.0; 3], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0], "grey")
        + &lamp("ceiling", [0.0, 0.1, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0])
        + &mesh("far", "box.obj", "wax")
        + "transform = { translate = [0, 9, 0] }\n"
        + &translucent("wax", "sigma_s = 900\nsigma_a = 0\ng = 0\neta = 1.3")
        + &diffuse("grey", 0.5)
        + &emissive("lamp", 1);
    let scene = load_beside("box.obj", &centred([0.01; 3]), &text);
    let found = mean(&scene, VolumePathOptions { photons: 0, ..OPTIONS }, 64);
    agree(found, (0.5, 0.0), within(0.01), "floor");
}
