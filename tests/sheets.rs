//! Open meshes with a `thickness`: the light of the sheet that they are the middle of, and what is refused by name.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod parts;
mod rendering;

use marmor::bssrdf::{Bssrdf, ModelName, Slab};
use marmor::geometry::Solid;
use marmor::integrator::{LocalShape, Trustworthiness, VolumePath, VolumePathOptions};
use marmor::optics::{reflectance, transmittance};
use marmor::query::{self, Backend};
use marmor::scene::{Scene, SceneFile, View};
use parts::{camera, cuboid, diffuse, emissive, mesh, rectangle, sky, translucent};
use rendering::{
    Within, agree, average, channels, film, load, load_beside, load_in, mean_of, means_of, options, subsurface,
};
use std::f64::consts::PI;

const PATHS: &str = "[method]\nname = \"volume_path\"\n";
const WITHIN: Within = Within { errors: 6.0, noise: 0.01 };

fn traced(scene: &Scene, passes: u32) -> (f64, f64) {
    let of = |seed| VolumePath::new(scene, VolumePathOptions { seed, photons: 2000, ..Default::default() }).unwrap();
    mean_of((1..=10).map(|seed| average(&film(&of(seed), scene, passes, seed, &mut []).image())))
}

fn modelled(scene: &Scene, passes: u32) -> (f64, f64) {
    let of = |seed| subsurface(scene, options(marmor::scene::Estimator::Cut, 16384, seed));
    mean_of((1..=10).map(|seed| average(&film(&of(seed), scene, passes, seed, &mut []).image())))
}

/// An object of `thickness`.
fn thick(object: &str, thickness: f64) -> String {
    format!("{object}thickness = {thickness:?}\n")
}

/// Looks down at the middle of a sheet in the plane z = 0.
fn above() -> String {
    camera([0.0, 0.0, 9.0], [0.0; 3], 0.01, [4, 4])
}

/// A wide square sheet in the plane z = 0.
fn wide(half: f64, material: &str) -> String {
    rectangle("sheet", [0.0; 3], [half, 0.0, 0.0], [0.0, half, 0.0], material)
}

/// As wide, at the height `z`.
fn below(half: f64, z: f64, material: &str) -> String {
    rectangle("below", [0.0, 0.0, z], [half, 0.0, 0.0], [0.0, half, 0.0], material)
}

/// The slab of [vdH80] that Monte Carlo programs are held to, 0.2 mm thick and n = 1: light along its normal, or by reciprocity even
/// light that leaves along it. A back that is not lit glows.
#[test]
fn a_sheet_reflects_and_transmits_what_van_de_hulst_says() {
    let medium = translucent("m", "sigma_a = 1\nsigma_s = 9\ng = 0.75\neta = 1");
    let sheet = thick(&wide(10.0, "m"), 0.2);
    let behind = load(&(above() + &sheet + &below(10.0, -0.2, "lamp") + &medium + &emissive("lamp", 1.0) + PATHS));
    assert_eq!(behind.warnings, Vec::<String>::new());
    agree(traced(&behind, 256), (0.66096, 0.0), WITHIN, "transmitted");
    let front = load(&(above() + &sheet + &below(10.0, -0.2, "black") + &medium + &diffuse("black", 0.0) + &sky(1.0)));
    agree(traced(&front, 256), (0.09739, 0.0), Within { noise: 0.02, ..WITHIN }, "reflected");
}

/// Five transport mean free paths of α′ = 0.999 and η = 1.3: the R and T of `mc_totals_slab.csv`, another program's, by
/// `volume_path`; by the model `slab`, which is told no thickness but the object's, its own totals, 2 % from the truth at the most, beside what
/// is not scattered at all, 0.7 %.
#[test]
fn a_sheet_has_the_light_of_a_slab_by_paths_and_by_its_model() {
    let (reflected, transmitted) = (0.668_812, 0.313_247);
    let (passed, mirrored) = (f64::from(transmittance(1.3, 1.0)), f64::from(reflectance(1.3, 1.0)));
    let medium = translucent("m", "sigma_s_prime = 0.999\nsigma_a = 0.001\neta = 1.3\nmodel = \"slab\"");
    let sheet = thick(&wide(24.0, "m"), 5.0);
    let behind = load(&(above() + &sheet + &below(24.0, -2.6, "lamp") + &medium + &emissive("lamp", 1.0)));
    let front = load(&(above() + &sheet + &below(24.0, -2.6, "black") + &medium + &diffuse("black", 0.0) + &sky(1.0)));
    // The lamp and the sheet do not mirror each other: the lamp reflects nothing.
    agree(traced(&behind, 256), (passed * transmitted, 0.0), WITHIN, "transmitted, paths");
    agree(traced(&front, 160), (passed * reflected + mirrored, 0.0), WITHIN, "reflected, paths");
    let model = Slab::new(&behind.materials[0].surface.medium().unwrap(), 5.0, true).unwrap();
    let [r, t] = [model.total()[0], model.total_transmitted()[0]].map(f64::from);
    let straight = passed * (-5.0_f64).exp();
    let through = t + straight;
    assert!((r / reflected - 1.0).abs() < 0.02 && (through / transmitted - 1.0).abs() < 0.02, "{r} {through}");
    agree(modelled(&behind, 24), (passed * through, 0.0), WITHIN, "transmitted, slab");
    agree(modelled(&front, 24), (passed * r + mirrored, 0.0), WITHIN, "reflected, slab");
}

/// A leaf of two transport mean free paths beside a lamp that is not seen through it, on the lit side and on the other: what the model has of
/// light that is not scattered would be the half or more of what is seen against the light.
#[test]
fn a_thin_leaf_is_as_bright_as_paths_say_from_both_sides() {
    let medium = translucent(
        "m",
        "sigma_s_prime = [1.8, 1.94, 1.998]\nsigma_a = [0.2, 0.06, 0.002]\neta = 1.3\nmodel = \"slab\"",
    );
    for (side, z) in [("against the light", -6.0), ("lit", 6.0)] {
        let lamp = rectangle("lamp", [2.0, 1.0, z], [0.7, 0.0, 0.0], [0.0, 0.7, 0.0], "glow")
            + &emissive("glow", 100.0).replace("radiance", "two_sided = true\nradiance");
        let scene = load(&(above() + &thick(&wide(16.0, "m"), 1.0) + &lamp + &medium));
        let of = |seed| VolumePath::new(&scene, VolumePathOptions { seed, photons: 0, ..Default::default() }).unwrap();
        let paths = |seed| channels(&film(&of(seed), &scene, 384, seed, &mut []).image());
        let truth = means_of(&(1..=10).map(paths).collect::<Vec<_>>());
        let of = |seed| subsurface(&scene, options(marmor::scene::Estimator::Cut, 16384, seed));
        let sums = |seed| channels(&film(&of(seed), &scene, 8, seed, &mut []).image());
        let found = means_of(&(1..=10).map(sums).collect::<Vec<_>>());
        for ((found, truth), most) in found.into_iter().zip(truth).zip([0.17, 0.12, 0.1]) {
            let (ratio, error) = (found.0 / truth.0, (found.1 / found.0).hypot(truth.1 / truth.0));
            println!("{side}: {found:?} against {truth:?}, {ratio:.3} +- {error:.3}");
            assert!(error < 0.02, "too noisy to say anything: {found:?} {truth:?}");
            assert!((ratio - 1.0).abs() < most + 6.0 * error, "{side}: {ratio} +- {error}");
        }
    }
}

/// Under even light all that enters a sheet without absorption leaves it, scattered or not. What comes straight along the normal is known, and
/// its mean over directions too: the rest is all that a half space's model may bring, which has all of the light.
#[test]
fn what_comes_straight_through_a_thin_sheet_is_not_in_its_model_too() {
    let (thickness, eta) = (1.5_f64, 1.3_f32);
    let straight = |inside: f64, mirrored: f64| {
        let left = (-thickness / inside).exp();
        (1.0 - mirrored) * left / (1.0 - mirrored * left)
    };
    let seen = straight(1.0, f64::from(reflectance(eta, 1.0)));
    // The cosine of a direction that is even light's: its square is even in 0..1.
    let [mut all, mut passed] = [0.0; 2];
    for i in 0..10_000 {
        let square = (f64::from(i) + 0.5) / 1e4;
        let mirrored = f64::from(reflectance(eta, square.sqrt() as f32));
        passed += 1.0 - mirrored;
        all += (1.0 - mirrored) * straight((1.0 - (1.0 - square) / f64::from(eta * eta)).sqrt(), mirrored);
    }
    let enters = f64::from(transmittance(eta, 1.0));
    let expected = 1.0 + enters * (seen - all / passed);
    for name in ModelName::models() {
        let model = format!("sigma_s = 1\nsigma_a = 0\ng = 0\neta = 1.3\nmodel = {:?}", name.name());
        let scene = load(&(above() + &thick(&wide(40.0, "m"), thickness) + &translucent("m", &model) + &sky(1.0)));
        let (mean, error) = modelled(&scene, if name == ModelName::SLAB { 16 } else { 2 });
        println!("{}: {mean:.4} +- {error:.4}, expected {expected:.4}", name.name());
        let inside = scene.materials.iter().find_map(|m| m.surface.inside.as_ref()).unwrap();
        let total = f64::from(inside.build().unwrap().total()[0]);
        assert!(error < if total > 1.0 + 1e-3 { 0.1 } else { 0.02 }, "{name:?}: {mean} +- {error}");
        if name == ModelName::SLAB {
            // Its own totals and what comes straight, and no more.
            assert!((0.96..1.0 + 6.0 * error).contains(&mean), "{mean} +- {error}");
        } else if total > 1.0 + 1e-3 {
            // As published it makes light, and is held to that.
            assert!(mean < expected * total + 6.0 * error, "{name:?}: {mean} +- {error} of {total}");
        } else if !inside.build().unwrap().claims().first_order {
            // Less what is scattered once, which is left out here.
            assert!((0.85..expected + 6.0 * error).contains(&mean), "{name:?}: {mean} +- {error}");
        } else {
            assert!((mean - expected).abs() < 0.01 + 6.0 * error, "{name:?}: {mean} +- {error}");
        }
    }
}

/// The closed box of the same size is the same body, to paths and to every model.
#[test]
fn a_sheet_is_the_box_of_its_size() {
    let head = camera([3.0, 5.0, 9.0], [0.2, 0.0, 0.0], 20.0, [12, 12]);
    let lamp = rectangle("lamp", [0.5, -1.0, -4.0], [1.5, 0.0, 0.0], [0.0, 1.5, 0.0], "glow") + &emissive("glow", 5.0);
    let medium = |model: &str| {
        translucent("m", &format!("sigma_s_prime = 6\nsigma_a = 0.05\neta = 1.3\nmodel = \"{model}\"")) + &sky(0.3)
    };
    let sheet = |model: &str| {
        let sheet = rectangle("sheet", [0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0], "m");
        load(&(head.clone() + &thick(&sheet, 0.5) + &lamp + &medium(model)))
    };
    let closed = |model: &str, more: &str| {
        let text = head.clone()
            + &mesh("box", "box.obj", "m")
            + &lamp
            + &medium(model).replace("model =", &format!("{more}model ="));
        load_beside("box.obj", &cuboid([-2.0, -1.5, -0.25], [2.0, 1.5, 0.25]), &text)
    };
    agree(traced(&sheet("standard"), 24), traced(&closed("standard", ""), 24), WITHIN, "paths");
    for (model, more) in [("slab", "thickness = 0.5\n"), ("beam", "")] {
        agree(modelled(&sheet(model), 8), modelled(&closed(model, more), 8), Within { noise: 0.02, ..WITHIN }, model);
    }
}

/// An OBJ file of quadrilaterals over a grid of `[m, n]` steps; `at` is of shares from 0 to 1.
fn grid([m, n]: [u32; 2], at: impl Fn(f64, f64) -> [f64; 3]) -> String {
    let mut text = String::new();
    for i in 0..=m {
        for j in 0..=n {
            let [x, y, z] = at(f64::from(i) / f64::from(m), f64::from(j) / f64::from(n));
            text += &format!("v {x} {y} {z}\n");
        }
    }
    for i in 0..m {
        for j in 0..n {
            let k = 1 + i * (n + 1) + j;
            text += &format!("f {} {} {} {}\n", k, k + n + 1, k + n + 2, k + 1);
        }
    }
    text
}

/// Part of a cylinder about z, of radius 1.
fn gutter(u: f64, v: f64) -> [f64; 3] {
    let (sin, cos) = (PI * (u - 0.5)).sin_cos();
    [sin, cos, 2.0 * (v - 0.5)]
}

/// Part of a sphere of radius 1, 100 degrees wide each way.
fn dish(u: f64, v: f64) -> [f64; 3] {
    let [x, z] = [u, v].map(|s| (50_f64.to_radians() * (2.0 * s - 1.0)).tan());
    let length = (1.0 + x * x + z * z).sqrt();
    [x / length, 1.0 / length, z / length]
}

fn open(obj: &str, thickness: f64, material: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("leaf.obj"), obj).unwrap();
    let text = camera([2.0, 4.0, 5.0], [0.0, 0.4, 0.0], 30.0, [16, 16])
        + &thick(&mesh("leaf", "leaf.obj", material), thickness)
        + &translucent("leaf", "sigma_s_prime = 30\nsigma_a = 0\neta = 1.4")
        + &if material == "paint" { diffuse("paint", 0.5) } else { String::new() }
        + &sky(1.0)
        + PATHS;
    let file = SceneFile::parse(&text, &folder.path().join("scene.toml")).map_err(|e| e.to_string())?;
    Scene::load(&file).map_err(|e| e.to_string())
}

/// Whatever enters a curved sheet that absorbs nothing leaves it: each sample is 1, and no path is lost through its rim. It is as
/// thick as it should be: its volume is that between the two faces.
#[test]
fn curved_sheets_are_white_in_a_white_furnace() {
    let t = 0.1;
    let shell = |area: f64, second: f64| area * (t + second * t * t * t / 12.0);
    // Of a part of a sphere of radius 1 (r² dr), and of one of a cylinder (r dr, which is linear).
    let solid_angle = 4.0 * (50_f64.to_radians().sin().powi(2)).asin();
    for (what, obj, volume) in [
        ("dish", grid([24, 24], dish), shell(solid_angle, 1.0)),
        ("gutter", grid([48, 6], gutter), shell(2.0 * PI, 0.0)),
    ] {
        let scene = open(&obj, t, "leaf").unwrap();
        assert_eq!(scene.warnings, Vec::<String>::new(), "{what}");
        assert!(Solid::new(&scene.objects[0].mesh).is_closed(), "{what}");
        let found = scene.objects[0].mesh.volume();
        println!("{what}: volume {found} against {volume}");
        assert!((found / volume - 1.0).abs() < 3e-3, "{what}: {found} against {volume}");
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let method = VolumePath::new(&scene, VolumePathOptions::default()).unwrap();
        let view = View { scene: &scene, rays: &*rays };
        let (film, outcome) = rendering::run(&method, view, 1, 0..16, &mut []);
        let walk = &outcome.tally.walk;
        assert!(walk.walks > 400 && walk.losses.total() == 0, "{what}: {walk:?}");
        let off = film.image().pixels.iter().map(|p| (p.mean() - 1.0).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{what}: {off}");
    }
}

/// A sheet that is crossed by itself, bends too sharply, or is none, is refused with its name, the reason and the remedy.
/// Faces around one corner of a gently bent sheet lie in each other's planes up to the gap of rays in f32, and meet nowhere else.
#[test]
fn a_gently_bent_sheet_of_long_faces_does_not_meet_itself() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/leaf");
    let text = camera([0.0, 40.0, 300.0], [0.0, 40.0, 0.0], 30.0, [4, 4])
        + &thick(&mesh("leaf", "leaf.obj", "leaf"), 1.0)
        + &translucent("leaf", "sigma_s_prime = 3\nsigma_a = 0\neta = 1.4")
        + &sky(1.0);
    let scene = load_in(&folder, &text);
    assert!(scene.why_double.is_none(), "{:?}", scene.why_double);
}

#[test]
fn what_makes_no_sheet_is_refused_by_name() {
    // Two leaves of a hairpin 0.1 apart, around a bend of radius 0.05; in steps of 15 degrees.
    let hairpin = grid([14, 2], |u, v| {
        let turn = (14.0 * u - 1.0).clamp(0.0, 12.0) / 12.0 * PI;
        let out = if (0.05..=0.95).contains(&u) { 0.0 } else { 1.0 };
        [0.05 * turn.sin() - out, -0.05 * turn.cos(), v]
    });
    // The same with a wide bend, its leaves brought together above it.
    let scroll = grid([60, 2], |u, v| {
        let (sin, cos) = (4.0 * PI * u).sin_cos();
        [(0.5 + 0.1 * u) * cos, (0.5 + 0.1 * u) * sin, v]
    });
    let moebius = grid([24, 2], |u, v| {
        let (s, c) = (2.0 * PI * u).sin_cos();
        let (across, up) = ((PI * u).cos() * 0.6 * (v - 0.5), (PI * u).sin() * 0.6 * (v - 0.5));
        // The last row is the first one, turned over.
        let snap = |x: f64| (x * 1e9).round() / 1e9 + 0.0;
        [snap((1.0 + across) * c), snap((1.0 + across) * s), snap(up)]
    });
    let fin = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n";
    let twice = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 1 2\n";
    let cases = [
        ("a bend", hairpin.as_str(), 0.2, ["radius below half its thickness", "smaller `thickness`"]),
        ("leaves that meet", scroll.as_str(), 0.06, ["meets itself", "smaller `thickness`"]),
        ("a fin", fin, 0.1, ["1 edge belongs to three triangles", "objects of their own"]),
        ("Möbius", moebius.as_str(), 0.05, ["one side only", "cut it open"]),
        ("repeated", twice, 0.1, ["1 triangle repeats another", "--repair"]),
        ("closed", &cuboid([-1.0; 3], [1.0; 3]), 0.1, ["its mesh is closed", "leave out `thickness`"]),
    ];
    for (what, obj, thickness, words) in cases {
        let error = open(obj, thickness, "leaf").err().unwrap_or_else(|| panic!("{what} is taken"));
        for word in ["\"leaf\"", words[0], words[1]] {
            assert!(error.contains(word), "{what}: `{word}` in {error}");
        }
    }
    // Thin enough, the hairpin and the scroll are sheets.
    for (obj, thickness) in [(&hairpin, 0.04), (&scroll, 0.02)] {
        assert_eq!(open(obj, thickness, "leaf").unwrap().warnings, Vec::<String>::new());
    }
    let flat = grid([2, 2], |u, v| [u, 0.0, v]);
    assert!(open(&flat, 0.1, "paint").err().unwrap().contains("`object.0.thickness` is that of a sheet"));
    for wrong in [0.0, -1.0, 1e-60] {
        let error = open(&flat, wrong, "leaf").err().unwrap();
        assert!(error.contains("`object.0.thickness` is") && error.contains("above 0"), "{error}");
    }
    let text = above() + &thick(&wide(1.0, "m"), 0.1) + &translucent("m", parts::WAX);
    for wrong in ["nan", "inf"] {
        let file = SceneFile::parse(
            &text.replace("thickness = 0.1", &format!("thickness = {wrong}")),
            std::path::Path::new("s"),
        );
        let error = file.err().unwrap().to_string();
        assert!(error.contains("`object.0.thickness` is") && error.contains("above 0"), "{error}");
    }
}

/// A crease keeps the thickness on both of its sides; one beyond the limit of the miter is told with its place.
#[test]
fn creases_are_as_thick_as_the_rest_or_said() {
    let t = 0.1;
    let fold = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        grid([2, 3], move |u, v| {
            let w = 2.0 * u - 1.0;
            if w < 0.0 { [w, 0.0, 2.0 * v] } else { [w * c, w * s, 2.0 * v] }
        })
    };
    for degrees in [5.0, 60.0, 100.0] {
        let scene = open(&fold(degrees), t, "leaf").unwrap();
        assert_eq!(scene.warnings, Vec::<String>::new());
        // Two flat sheets, mitred where they meet: the middle halves them, so that neither gains.
        let volume = scene.objects[0].mesh.volume();
        assert!((volume / (4.0 * t) - 1.0).abs() < 1e-6, "{degrees}: {volume}");
    }
    let said = open(&fold(150.0), t, "leaf").unwrap().warnings.join("\n");
    for word in ["\"leaf\"", "4 corners", "120 degrees", "thinner", "near (0, 0, "] {
        assert!(said.contains(word), "`{word}` in {said}");
    }
}

/// Sheets of one material and several thicknesses are slabs of their own; a closed body of it keeps the material's thickness.
#[test]
fn each_sheet_is_a_slab_of_its_own_thickness() {
    let sheet = |name: &str, z: f64, thickness: f64| {
        thick(&rectangle(name, [0.0, 0.0, z], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], "m"), thickness)
    };
    let medium = "sigma_s_prime = 20\nsigma_a = 0.02\neta = 1.3\nmodel = \"slab\"";
    let text = above() + &sheet("a", 0.0, 0.2) + &sheet("b", 1.0, 0.4) + &sheet("c", 2.0, 0.2) + &sky(1.0);
    let scene = load(&(text.clone() + &translucent("m", medium)));
    let told = |o: u32| scene.surface(o).inside.as_ref().unwrap().thickness;
    assert_eq!([told(0), told(1), told(2)], [Some(0.2), Some(0.4), Some(0.2)]);
    assert_eq!(scene.warnings, Vec::<String>::new());
    // Flat or not, it is a slab that `check` knows, and not endless.
    let beam = load(&(text.clone() + &translucent("m", &medium.replace("slab", "beam"))));
    let rays = query::build(Backend::preferred(), &beam.meshes()).unwrap();
    let shape = LocalShape::new(&beam, 1).unwrap();
    let trust = Trustworthiness::new(View { scene: &beam, rays: &*rays }, &shape, 0.1).unwrap();
    assert!(
        (trust.models[0].model, trust.models[0].thickness) == ("slab", Some(0.4)) && trust.open == 0.0,
        "{trust:?}"
    );
    assert!((trust.thickness[1].unwrap() / (0.4 * 20.02) - 1.0).abs() < 1e-3, "{:?}", trust.thickness);
    // A material's own thickness is of bodies that are none.
    let other = load(&(text.clone() + &translucent("m", &format!("thickness = 3\n{medium}"))));
    let said = other.warnings.join("\n");
    assert!(said.contains("the thickness 3 of its material \"m\" is not used"), "{said}");
    assert_eq!(other.materials[0].surface.inside.as_ref().unwrap().model, ModelName::SLAB);
    // Without any, or too thin for the model.
    let refused = |text: &str| {
        let file = SceneFile::parse(text, std::path::Path::new("scene.toml")).map_err(|e| e.to_string())?;
        Scene::load(&file).map(drop).map_err(|e| e.to_string())
    };
    let bare = refused(&(above() + &wide(4.0, "m") + &sky(1.0) + &translucent("m", medium))).unwrap_err();
    assert!(bare.contains("needs a `thickness`") && bare.contains("of each open mesh"), "{bare}");
    let thin = refused(&(above() + &sheet("a", 0.0, 0.03) + &sky(1.0) + &translucent("m", medium))).unwrap_err();
    assert!(thin.contains("\"a\"") && thin.contains("take another model"), "{thin}");
}
