//! One body of several parts: cut, overlapping, nested, as open shells, it is the body that it makes together, by every method.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod rendering;
#[path = "../src/geometry/test_shapes.rs"]
#[allow(dead_code)] // this file uses its part
mod test_shapes;

use marmor::geometry::{RawMesh, sphere};
use marmor::integrator::{AmbientOcclusion, Integrator, Subsurface, SubsurfaceOptions, VolumePath, VolumePathOptions};
use marmor::math::DVec3;
use marmor::scene::{MethodName, Scene, SceneFile};
use rendering::{Within, agree, average, film, load_in, mean_of};
use test_shapes::{cuboid, joined};

/// OBJ text without normals.
fn obj(mesh: &RawMesh) -> String {
    let mut text: String = mesh.positions.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    for [a, b, c] in &mesh.triangles {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    text
}

/// Half of a ball of radius 1, above or below; closed by a disk or open. The disks of the two have other triangles.
fn half_ball(above: bool, closed: bool) -> RawMesh {
    let whole = sphere(DVec3::ZERO, 1.0, 24, 48);
    let is_half = |t: &&[u32; 3]| {
        let y: f64 = t.iter().map(|&i| whole.positions[i as usize].y).sum();
        (y > 0.0) == above
    };
    let mut triangles: Vec<[u32; 3]> = whole.triangles.iter().filter(is_half).copied().collect();
    let mut positions = whole.positions.clone();
    let mut rim: Vec<u32> = (0..positions.len() as u32).filter(|&i| positions[i as usize].y.abs() < 1e-9).collect();
    // The equator is plane to the last bit, for both halves alike.
    rim.iter().for_each(|&i| positions[i as usize].y = 0.0);
    rim.sort_by(|&a, &b| {
        let angle = |i: u32| positions[i as usize].z.atan2(positions[i as usize].x);
        angle(a).total_cmp(&angle(b))
    });
    rim.dedup_by(|a, b| positions[*a as usize].distance(positions[*b as usize]) < 1e-9);
    if closed {
        // Seen from below the angle turns clockwise, from above counter-clockwise.
        let wound = |t: [u32; 3]| if above { t } else { [t[0], t[2], t[1]] };
        if above {
            positions.push(DVec3::ZERO);
            let centre = positions.len() as u32 - 1;
            triangles.extend((0..rim.len()).map(|k| wound([centre, rim[k], rim[(k + 1) % rim.len()]])));
        } else {
            triangles.extend((1..rim.len() - 1).map(|k| wound([rim[0], rim[k], rim[k + 1]])));
        }
    }
    RawMesh { positions, triangles, ..RawMesh::default() }
}

/// The whole, with the same equator.
fn ball() -> RawMesh {
    joined(half_ball(true, false), &half_ball(false, false))
}

fn cube(x: f64, half: f64, n: u32) -> RawMesh {
    cuboid(DVec3::new(x, 0.0, 0.0), DVec3::splat(half), n, n.is_multiple_of(2))
}

/// Of milky stuff: light goes as far as the bodies are large, but not through them.
const MILK: &str =
    "[material.milk]\ntype = \"translucent\"\nsigma_s_prime = 5\nsigma_a = 0.03\neta = 1.3\nmodel = \"standard\"\n";
/// A lamp above alone, so that what is below glows by what comes from above.
const LAMP: &str = "[[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0.3, 4, 0.5]\nedge_u = [1.5, 0, 0]\nedge_v = [0, 0, 1.5]\n\
                    material = \"lamp\"\n[material.lamp]\ntype = \"emissive\"\nradiance = 10\ntwo_sided = true\n";
/// Looks at what is below, and a little of what is above.
const BELOW: &str = "[camera]\nposition = [0.5, -3, 8]\nlook_at = [0.4, -0.3, 0]\nfov = 17\nresolution = [12, 12]\n";

/// A scene of these parts, each with more keys.
fn text(meshes: &[RawMesh], keys: &str, rest: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let mut text = format!("unit = \"mm\"\n{rest}\n");
    for (i, mesh) in meshes.iter().enumerate() {
        std::fs::write(folder.path().join(format!("{i}.obj")), obj(mesh)).unwrap();
        text += &format!("[[object]]\nname = \"part {i}\"\nmesh = \"{i}.obj\"\nmaterial = \"milk\"\n{keys}\n");
    }
    (folder, text)
}

fn scene(meshes: &[RawMesh], keys: &str, rest: &str) -> Scene {
    let (folder, text) = text(meshes, keys, rest);
    load_in(folder.path(), &text)
}

const ONE: &str = "body = \"hand\"";

/// Means of the pictures of two scenes, from renders with the same numbers each.
type Pairs = Vec<[f64; 2]>;

const RUNS: u64 = 10;

fn pairs<I: Integrator>(scenes: [&Scene; 2], passes: u32, method: impl Fn(&Scene, u64) -> I) -> Pairs {
    let of = |scene, seed| average(&film(&method(scene, seed), scene, passes, seed, &mut []).image());
    (1..=RUNS).map(|seed| scenes.map(|scene| of(scene, seed))).collect()
}

fn traced(scenes: [&Scene; 2], passes: u32) -> Pairs {
    let options = |seed| VolumePathOptions { photons: 500, seed, ..VolumePathOptions::default() };
    pairs(scenes, passes, |scene, seed| VolumePath::new(scene, options(seed)).unwrap())
}

fn cached(scenes: [&Scene; 2], passes: u32, options: SubsurfaceOptions) -> Pairs {
    let options = |seed| SubsurfaceOptions { cache_samples: 8192, seed, ..options };
    pairs(scenes, passes, |scene, seed| Subsurface::new(scene, options(seed)).unwrap())
}

/// The parts have the light of the whole: the ratio is 1, to 6 of its standard errors, where the noise that both have alike has gone.
fn same(pairs: &Pairs, what: &str) {
    if pairs.iter().all(|[parts, whole]| parts == whole) {
        println!("{what}: the same bits");
        return;
    }
    agree(mean_of(pairs.iter().map(|[parts, whole]| parts / whole)), (1.0, 0.0), CLOSE, what);
}

/// Light straight from the lights, as on a convex body alone: what goes on is held to the model's total, which is another picture.
fn straight() -> SubsurfaceOptions {
    SubsurfaceOptions { bounces: 0, ..SubsurfaceOptions::default() }
}

/// A standard error from ten values is known to some 25 %: 8 of them stand for 6 of a known one.
const CLOSE: Within = Within { errors: 8.0, noise: 0.01 };

fn lit(more: &str) -> String {
    let milk = if more.contains("model =") { MILK.replace("model = \"standard\"\n", "") } else { MILK.into() };
    format!("{BELOW}{LAMP}{milk}{more}")
}

/// Sets of parts, and the one mesh that they are together.
fn cases() -> Vec<(&'static str, Vec<RawMesh>, RawMesh)> {
    let halves = |closed| vec![half_ball(true, closed), half_ball(false, closed)];
    let long = cuboid(DVec3::new(0.5, 0.0, 0.0), DVec3::new(1.5, 1.0, 1.0), 1, false);
    vec![
        ("two half balls that touch", halves(true), ball()),
        ("two half shells", halves(false), ball()),
        ("two boxes that overlap, flush", vec![cube(0.0, 1.0, 1), cube(1.0, 1.0, 2)], long.clone()),
        ("a box in a box", vec![long.clone(), cube(0.2, 0.5, 1)], long),
    ]
}

#[test]
fn parts_are_one_body_to_paths() {
    let rest = format!("{BELOW}[environment]\nradiance = 1\n{}", MILK.replace("sigma_a = 0.03", "sigma_a = 0.3"));
    for (what, parts, whole) in cases() {
        let (parts, whole) = (scene(&parts, ONE, &rest), scene(&[whole], "", &rest));
        same(&traced([&parts, &whole], 6), what);
    }
}

#[test]
fn parts_share_cache_and_kernel() {
    for model in ["standard", "beam"] {
        let rest = lit(&format!("model = \"{model}\"\n"));
        for (what, parts, whole) in cases() {
            let (parts, whole) = (scene(&parts, ONE, &rest), scene(&[whole], "", &rest));
            same(&cached([&parts, &whole], 3, straight()), &format!("{model}, {what}"));
        }
    }
}

/// Over a floor, where light goes over other surfaces, by the balance of the body's own surface.
#[test]
fn parts_share_light_over_other_surfaces() {
    let floor = "[[object]]\nshape = \"rectangle\"\ncentre = [0, -1.5, 0]\nedge_u = [0, 0, 6]\nedge_v = [6, 0, 0]\nmaterial = \"grey\"\n\
                 [material.grey]\ntype = \"diffuse\"\nalbedo = 0.7\n";
    let rest = format!("{floor}{}", lit("").replace("position = [0.5, -3, 8]", "position = [0.5, 1, 8]"));
    for (what, parts, whole) in cases() {
        let (parts, whole) = (scene(&parts, ONE, &rest), scene(&[whole], "", &rest));
        let all = SubsurfaceOptions::default();
        same(&cached([&parts, &whole], 3, all), what);
    }
}

/// Through a thin medium, where most of the light that the camera sees is not scattered, or once.
#[test]
fn light_passes_what_lies_inside() {
    let thin = lit("model = \"beam\"\n")
        .replace("sigma_s_prime = 5", "sigma_s_prime = 0.4")
        .replace("sigma_a = 0.03", "sigma_a = 0.1");
    let rest = format!("{thin}[environment]\nradiance = 1\n");
    for (what, parts, whole) in cases() {
        let (parts, whole) = (scene(&parts, ONE, &rest), scene(&[whole], "", &rest));
        for (how, options) in [("all", SubsurfaceOptions::default()), ("straight", straight())] {
            same(&cached([&parts, &whole], 3, options), &format!("{what}, {how}"));
        }
    }
}

/// A medium of so many mean free paths that light near each exit is sampled for it.
#[test]
fn parts_share_the_near_field() {
    let dense = lit("").replace("sigma_s_prime = 5", "sigma_s_prime = 300").replace("sigma_a = 0.03", "sigma_a = 1");
    let rest = dense.replace("position = [0.5, -3, 8]", "position = [0.5, 3, 8]");
    for (what, parts, whole) in cases() {
        let (parts, whole) = (scene(&parts, ONE, &rest), scene(&[whole], "", &rest));
        let method = Subsurface::new(&parts, SubsurfaceOptions { cache_samples: 8192, ..straight() }).unwrap();
        assert_eq!(method.near_fields(), 1, "{what}");
        same(&cached([&parts, &whole], 3, straight()), what);
    }
}

/// Without the key light does not pass from one to the other: `subsurface` is darker by far, and shells are no bodies.
#[test]
fn without_the_key_they_are_two() {
    for (what, parts, whole) in
        cases().into_iter().filter(|(what, ..)| what.contains("touch") || what.contains("flush"))
    {
        let (parts, whole) = (scene(&parts, "", &lit("")), scene(&[whole], "", &lit("")));
        let pairs = cached([&parts, &whole], 3, straight());
        let (ratio, error) = mean_of(pairs.iter().map(|[apart, one]| apart / one));
        println!("{what}, apart: {ratio:.4} +- {error:.4} of the light");
        assert!(ratio + 20.0 * error < 0.95, "{what}: {ratio} +- {error}");
    }
    let shells = [half_ball(true, false), half_ball(false, false)];
    let refused = VolumePath::new(&scene(&shells, "", &lit("")), VolumePathOptions::default()).err().unwrap();
    assert!(refused.to_string().contains("an open sheet has no inside"), "{refused}");
}

/// Whatever goes in comes out, at each point.
#[test]
fn a_union_vanishes_in_a_white_furnace() {
    let white = MILK.replace("sigma_a = 0.03", "sigma_a = 0");
    let rest = format!("{}[environment]\nradiance = 1\n{white}", BELOW.replace("fov = 17", "fov = 12"));
    for (what, parts, _) in cases() {
        let scene = scene(&parts, ONE, &rest);
        let paths = VolumePath::new(&scene, VolumePathOptions::default()).unwrap();
        let picture = film(&paths, &scene, 8, 1, &mut []).image();
        let worst = picture.pixels.iter().flat_map(|p| p.0).map(|v| (v - 1.0).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-4, "{what}: {worst}");
        let options = SubsurfaceOptions { cache_samples: 32768, ..SubsurfaceOptions::default() };
        let gathered = average(&film(&Subsurface::new(&scene, options).unwrap(), &scene, 16, 1, &mut []).image());
        println!("{what}: {gathered}");
        assert!((gathered - 1.0).abs() < 0.02, "{what}: {gathered}");
    }
}

/// A body of three: what several pairs hide from each other, with one surface of each part through two others.
#[test]
fn three_parts_through_each_other_keep_all_light() {
    let bar = |half: [f64; 3]| cuboid(DVec3::ZERO, DVec3::from_array(half), 2, false);
    let bars = [bar([1.6, 0.5, 0.5]), bar([0.5, 1.6, 0.5]), bar([0.5, 0.5, 1.6])];
    let white = MILK.replace("sigma_a = 0.03", "sigma_a = 0");
    let rest = format!("{BELOW}[environment]\nradiance = 1\n{white}");
    let scene = scene(&bars, ONE, &rest);
    let paths = VolumePath::new(&scene, VolumePathOptions::default()).unwrap();
    let picture = film(&paths, &scene, 8, 1, &mut []).image();
    assert!(picture.pixels.iter().flat_map(|p| p.0).all(|v| (v - 1.0).abs() < 1e-4));
}

/// The world has one body of two parts, whose facts are those of both together.
#[test]
fn the_world_has_one_body() {
    let parts = scene(&[cube(0.0, 1.0, 1), cube(1.0, 1.0, 2)], ONE, &lit(""));
    assert_eq!(parts.bodies.iter().flatten().count(), 1);
    let body = parts.bodies.iter().flatten().next().unwrap();
    assert_eq!((&body.parts[..], body.closed), (&["part 0".to_string(), "part 1".into()][..], true));
    assert!((body.bounds.extent() - DVec3::new(3.0, 2.0, 2.0)).length() < 1e-12);
    assert_eq!(parts.objects[body.object as usize].name, "hand");
    assert!(!parts.warnings.iter().any(|w| w.contains("overlap")), "{:?}", parts.warnings);
    // A name that is used once changes nothing.
    let alone = scene(&[cube(0.0, 1.0, 1)], ONE, &lit(""));
    assert_eq!(alone.objects[1].name.as_str(), "part 0");
}

/// What cannot be one body is refused, with both names and the remedy.
#[test]
fn what_is_no_body_is_refused_by_name() {
    let refusal = |change: &dyn Fn(String) -> String| {
        let (folder, text) = text(&[cube(0.0, 1.0, 1), cube(1.0, 1.0, 2)], ONE, &lit(""));
        let file = SceneFile::parse(&change(text), &folder.path().join("scene.toml"));
        file.err().unwrap().to_string()
    };
    let wax = MILK.replace("milk", "wax");
    let other = refusal(&|text| {
        let at = text.rfind("material = \"milk\"").unwrap();
        format!("{}material = \"wax\"{}\n{wax}", &text[..at], &text[at + "material = \"milk\"".len()..])
    });
    for word in ["\"hand\"", "\"part 0\"", "\"part 1\"", "\"milk\"", "\"wax\"", "give both the same material"] {
        assert!(other.contains(word), "{word}: {other}");
    }
    let opaque = refusal(&|text| text.replace("name = \"lamp\"", "name = \"lamp\"\nbody = \"light\""));
    assert!(
        opaque.contains("\"lamp\"") && opaque.contains("no medium") && opaque.contains("leave the key out"),
        "{opaque}"
    );
    let taken = refusal(&|text| text.replace("name = \"lamp\"", "name = \"hand\""));
    assert!(taken.contains("another name"), "{taken}");
    let priority = refusal(&|text| format!("{text}\npriority = 3"));
    assert!(priority.contains("part 0") && priority.contains("is 3"), "{priority}");
    let sheet = refusal(&|text| format!("{text}\nthickness = 0.1"));
    assert!(sheet.contains("\"part 1\"") && sheet.contains("a sheet is a body by itself"), "{sheet}");
    let empty = refusal(&|text| text.replace("body = \"hand\"", "body = \"\""));
    assert!(empty.contains("a name in quotes"), "{empty}");
}

/// Ambient occlusion knows surfaces alone.
#[test]
fn ambient_occlusion_does_not_change() {
    let picture = |keys| {
        let scene = scene(&[cube(0.0, 1.0, 1), cube(1.0, 1.0, 2)], keys, &lit(""));
        assert_eq!(scene.default_method(), MethodName::Subsurface);
        film(&AmbientOcclusion { radius: f32::INFINITY, rays: 4 }, &scene, 8, 1, &mut []).image()
    };
    let (one, two) = (picture(ONE), picture(""));
    let apart = one.pixels.iter().zip(&two.pixels).map(|(a, b)| (a.mean() - b.mean()).abs()).fold(0.0, f32::max);
    assert!(apart < 1e-3, "{apart}");
}
