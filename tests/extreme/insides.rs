//! What is inside what: media, lamps and cameras in one another, surfaces that touch, meshes without an inside.

use super::harness::{backends, load_with, refused, render};
use super::rendering::mean_of;
use marmor::integrator::{VolumePath, VolumePathOptions, traceable};
use marmor::scene::{ObstacleKind, Orders, Scene};
use marmor::tally::Tally;

/// A box as OBJ text, its corners numbered from `first`; `inwards` turns its faces.
fn cuboid(centre: [f64; 3], half: [f64; 3], first: u32, inwards: bool) -> String {
    let mut text = String::new();
    for i in 0..8 {
        let at = |axis: usize| centre[axis] + if i >> axis & 1 == 0 { -half[axis] } else { half[axis] };
        text += &format!("v {} {} {}\n", at(0), at(1), at(2));
    }
    for face in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        let mut face = face.map(|k| (k + first).to_string());
        if inwards {
            face.reverse();
        }
        text += &format!("f {}\n", face.join(" "));
    }
    text
}

fn cube(x: f64) -> String {
    cuboid([x, 0.0, 0.0], [1.0; 3], 0, false)
}

/// A scene of the OBJ texts `bodies`, "a", "b" ..., all of one medium; seen from z = 9.
fn scene_of(bodies: &[String], medium: &str, more: &str) -> marmor::Result<Scene> {
    let names = ["a", "b", "c"];
    let mut text =
        "unit = \"mm\"\n[camera]\nposition = [0.3, 0.2, 9]\nlook_at = [0, 0, 0]\nfov = 20\nresolution = [8, 8]\n"
            .to_string();
    let mut files = Vec::new();
    for (name, body) in names.iter().zip(bodies) {
        text += &format!("[[object]]\nname = \"{name}\"\nmesh = \"{name}.obj\"\nmaterial = \"wax\"\n");
        files.push((format!("{name}.obj"), body.as_str()));
    }
    text += &format!("[environment]\nradiance = 1\n[material.wax]\ntype = \"translucent\"\n{medium}\n{more}");
    let files: Vec<(&str, &str)> = files.iter().map(|(name, body)| (name.as_str(), *body)).collect();
    load_with(&text, &files, false)
}

const WHITE: &str = "sigma_s = 2\nsigma_a = 0\ng = 0.3\neta = 1.3";
const CLEAR: &str = "sigma_s = 0\nsigma_a = 0.5\ng = 0\neta = 1";

const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 200, specular: true, seed: 1 };

/// Mean of every pixel over the channels, by paths, on each backend.
fn traced(scene: &Scene, spp: u32) -> Vec<(Vec<f64>, Tally)> {
    let one = |backend| {
        let (film, tally) = render(&VolumePath::new(scene, OPTIONS).unwrap(), scene, backend, 1, spp);
        (film.image().pixels.iter().map(|p| f64::from(p.mean())).collect(), tally)
    };
    backends().map(one).collect()
}

/// A white furnace is white, to 5 standard errors, and nothing is lost.
fn white(scene: &Scene) {
    assert_eq!(traceable(scene), []);
    for (pixels, tally) in traced(scene, 16) {
        let (mean, error) = mean_of(pixels);
        assert!(tally.walk.walks > 200 && tally.walk.losses.total() == 0, "{:?}", tally.walk);
        assert!(error < 0.03 && (mean - 1.0).abs() < 5.0 * error + 1e-4, "{mean} +- {error}");
    }
}

/// The mean of the picture is `expected`, to 5 standard errors, and nothing is lost.
fn is(scene: &Scene, expected: f64) {
    for (pixels, tally) in traced(scene, 1024) {
        let (mean, error) = mean_of(pixels);
        assert!(error < 0.01 * expected && (mean - expected).abs() < 5.0 * error, "{mean} +- {error}, {expected}");
        assert_eq!(tally.walk.losses.total(), 0);
    }
}

/// Refused before the render, naming all of `words`; `subsurface`, the method of the file, has warned with them.
fn refuses(scene: &Scene, kind: ObstacleKind, words: &[&str]) {
    assert!(traceable(scene).iter().any(|o| o.kind == kind), "{:?}", scene.obstacles());
    let mut all = vec!["volume_path"];
    all.extend(words);
    refused(VolumePath::new(scene, OPTIONS).map(|_| unreachable!()), &all);
    let said = scene.warnings.join("\n");
    for word in words {
        assert!(said.contains(word), "`{word}` in {said}");
    }
}

/// Told of `subsurface`, the method of the file, with all of `words`; by paths a white furnace is white.
fn meets(scene: &Scene, kind: ObstacleKind, words: &[&str]) {
    assert!(scene.obstacles().iter().any(|o| o.kind == kind), "{:?}", scene.obstacles());
    let said = scene.warnings.join("\n");
    for word in words {
        assert!(said.contains(word), "`{word}` in {said}");
    }
    white(scene);
}

/// Closed parts of one body are their union to every method: no warning; by paths a white furnace is white.
fn unites(scene: &Scene, kind: ObstacleKind) {
    assert!(scene.obstacles().iter().any(|o| o.kind == kind), "{:?}", scene.obstacles());
    assert!(scene.union(0).is_some());
    assert!(!scene.warnings.iter().any(|w| w.contains("parts")), "{:?}", scene.warnings);
    white(scene);
}

fn two(a: String, b: String) -> Scene {
    scene_of(&[a, b], WHITE, "").unwrap()
}

#[test]
fn two_bodies_apart_ok() {
    white(&two(cube(-1.1), cube(1.1)));
}

#[test]
fn two_crossed_bars_ok() {
    let bar = |half| cuboid([0.0; 3], half, 0, false);
    let scene = two(bar([3.0, 0.5, 0.5]), bar([0.4, 3.0, 0.4]));
    meets(&scene, ObstacleKind::Crossing, &["\"a\"", "\"b\"", "overlap", "a union"]);
    // With faces in one plane.
    let scene = two(bar([3.0, 0.5, 0.5]), bar([0.5, 3.0, 0.5]));
    meets(&scene, ObstacleKind::Crossing, &["\"a\"", "\"b\"", "overlap"]);
}

#[test]
fn two_halves_that_touch_ok() {
    meets(&two(cube(-1.0), cube(1.0)), ObstacleKind::Touching, &["\"a\"", "\"b\"", "touch", "a gap of at least"]);
    let smaller = cuboid([1.0, 0.2, 0.1], [1.0, 0.3, 0.4], 0, false);
    meets(&two(cube(-1.0), smaller), ObstacleKind::Touching, &["\"a\"", "\"b\"", "touch", "join them"]);
}

/// The gap that the message asks for is enough.
#[test]
fn two_halves_with_the_gap_that_is_asked_for_ok() {
    let refusal = two(cube(-1.0), cube(1.0)).warnings.join("\n");
    let gap: f64 = refusal.split("at least ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(gap < 1e-4, "{refusal}");
    white(&two(cube(-1.0), cube(1.0 + 1.05 * gap)));
}

#[test]
fn equal_bodies_in_one_place_ok() {
    meets(&two(cube(0.0), cube(0.0)), ObstacleKind::Crossing, &["\"a\"", "\"b\"", "overlap"]);
}

#[test]
fn one_body_in_another_ok() {
    let core = cuboid([0.1, 0.0, 0.0], [0.3; 3], 0, false);
    meets(&two(cube(0.0), core), ObstacleKind::Nested, &["\"b\" lies inside \"a\"", "cut one out of the other"]);
}

#[test]
fn bodies_that_touch_along_an_edge_ok() {
    white(&two(cuboid([-1.0, -1.0, 0.0], [1.0; 3], 0, false), cuboid([1.0, 1.0, 0.0], [1.0; 3], 0, false)));
    white(&two(cuboid([-1.0; 3], [1.0; 3], 0, false), cuboid([1.0; 3], [1.0; 3], 0, false)));
}

fn one(mesh: String, medium: &str) -> Scene {
    scene_of(&[mesh], medium, "").unwrap()
}

#[test]
fn overlapping_parts_of_a_mesh_ok() {
    let second = cuboid([0.5, 0.3, 0.2], [1.0; 3], 8, false);
    unites(&one(cube(0.0) + &second, WHITE), ObstacleKind::Crossing);
}

#[test]
fn parts_of_a_mesh_that_touch_ok() {
    let second = cuboid([2.0, 0.3, 0.2], [1.0, 0.5, 0.5], 8, false);
    unites(&one(cube(0.0) + &second, WHITE), ObstacleKind::Touching);
}

#[test]
fn nested_parts_that_look_outwards_ok() {
    let core = cuboid([0.0; 3], [0.5; 3], 8, false);
    let scene = one(cube(0.0) + &core, WHITE);
    unites(&scene, ObstacleKind::Nested);
}

/// White, and exp(-σ_a d) through what is solid of a box with a cavity.
#[test]
fn a_cavity_ok() {
    let hollow = cube(0.0) + &cuboid([0.0; 3], [0.6; 3], 8, true);
    white(&one(hollow.clone(), WHITE));
    let mut scene = one(hollow, CLEAR);
    scene.camera = straight_down(&scene);
    is(&scene, (-0.5_f64 * 0.8).exp());
}

/// The same scene seen along -z in a cone of a thousandth of a degree.
fn straight_down(scene: &Scene) -> marmor::scene::Camera {
    let text = "unit = \"mm\"\n[camera]\nposition = [0.05, 0.03, 9]\nlook_at = [0.05, 0.03, 0]\nfov = 1e-3\nresolution = [4, 4]\n\
                [[object]]\nmesh = \"a.obj\"\nmaterial = \"wax\"\n[material.wax]\ntype = \"translucent\"\npreset = \"marble\"\n";
    let other = load_with(text, &[("a.obj", &cube(0.0))], false).unwrap();
    assert_eq!(other.centre, scene.centre);
    other.camera
}

#[test]
fn an_open_part_that_pokes_into_a_closed_one_refused() {
    let mut lens = cuboid([0.0, 0.0, 1.0], [0.3, 0.3, 0.4], 8, false);
    lens = lens.lines().filter(|l| *l != "f 9 11 12 10").map(|l| format!("{l}\n")).collect();
    refuses(&one(cube(0.0) + &lens, WHITE), ObstacleKind::Uncounted, &["\"a\"", "two of its 2 parts overlap"]);
}

#[test]
fn a_sheet_without_thickness_refused() {
    let sheet = "v -1 -1 0\nv 1 -1 0\nv 1 1 0.3\nv -1 1 0.3\nf 1 2 3 4\n";
    let words = ["\"a\"", "an open sheet has no inside", "give it a thickness"];
    refuses(&one(sheet.into(), WHITE), ObstacleKind::Sheet, &words);
    // Both sides of it, as one closed surface around nothing.
    let flat = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\nf 4 2 1\nf 4 3 2\n";
    refuses(&one(flat.into(), WHITE), ObstacleKind::Sheet, &["\"a\"", "encloses nothing", "give it a thickness"]);
}

/// A shell with a thickness is a body, and white.
#[test]
fn a_hollow_shell_ok() {
    white(&one(cube(0.0) + &cuboid([0.0; 3], [0.95; 3], 8, true), WHITE));
}

/// One small triangle is missing: said before, counted at the object and by its cause after.
#[test]
fn a_small_hole_warns() {
    let mut mesh = String::new();
    let n = 10;
    for i in 0..=n {
        for j in 0..=n {
            mesh += &format!("v {} {} 1\n", 0.2 * f64::from(j) - 1.0, 0.2 * f64::from(i) - 1.0);
        }
    }
    let at = |i: u32, j: u32| i * (n + 1) + j + 1;
    for i in 0..n {
        for j in 0..n {
            mesh += &format!("f {} {} {}\n", at(i, j), at(i, j + 1), at(i + 1, j + 1));
            if (i, j) != (5, 5) {
                mesh += &format!("f {} {} {}\n", at(i, j), at(i + 1, j + 1), at(i + 1, j));
            }
        }
    }
    // The other five sides of the box, with the corners of the grid.
    let first = (n + 1) * (n + 1) + 1;
    mesh += "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\n";
    let below = [0, 1, 2, 3].map(|k| first + k);
    mesh += &format!("f {} {} {} {}\n", below[3], below[2], below[1], below[0]);
    let side = |rim: Vec<u32>, a: u32, b: u32| {
        let rim: Vec<String> = rim.iter().rev().map(u32::to_string).collect();
        format!("f {} {} {}\n", a, b, rim.join(" "))
    };
    mesh += &side((0..=n).map(|k| at(0, k)).collect(), below[0], below[1]);
    mesh += &side((0..=n).map(|k| at(k, n)).collect(), below[1], below[2]);
    mesh += &side((0..=n).map(|k| at(n, n - k)).collect(), below[2], below[3]);
    mesh += &side((0..=n).map(|k| at(n - k, 0)).collect(), below[3], below[0]);
    let scene = one(mesh, WHITE);
    assert_eq!(traceable(&scene), []);
    let said = |word: &str| scene.obstacles().iter().any(|o| o.kind == ObstacleKind::Holes && o.what.contains(word));
    assert!(said("3 edges are rims of holes, 0.08 %"), "{:?}", scene.obstacles());
    for (_, tally) in traced(&scene, 64) {
        let lost = marmor::integrator::lost(&tally.walk, &scene);
        assert!(
            lost.len() == 1 && lost[0].contains("object \"a\": they came through holes of its mesh (3 edges"),
            "{lost:?}"
        );
    }
}

#[test]
fn a_wall_inside_a_body_refused() {
    refuses(
        &one(cube(0.0) + "f 1 2 8 7\n", WHITE),
        ObstacleKind::Walls,
        &["\"a\"", "three triangles or more", "remove the faces"],
    );
}

const BULB: &str = "[[object]]\nname = \"bulb\"\nshape = \"sphere\"\ncentre = [0.1, 0, 0]\nradius = 0.4\nrings = 8\nsegments = 16\n\
                    material = \"bulb\"\n";

/// In a medium of index η a lamp of radiance η² keeps a white furnace white.
#[test]
fn a_lamp_inside_a_body_ok() {
    let lamp = format!("{BULB}[material.bulb]\ntype = \"emissive\"\nradiance = 1.69\n");
    let scene = scene_of(&[cube(0.0)], WHITE, &lamp).unwrap();
    white(&scene);
    let said = scene.warnings.join("\n");
    assert!(said.contains("lamp \"bulb\" lies inside object \"a\"") && said.contains("volume_path"), "{said}");
    // Seen through a clear medium: L exp(-σ_a d) / η².
    let mut scene = scene_of(
        &[cube(0.0)],
        CLEAR,
        "[[object]]\nname = \"bulb\"\nshape = \"rectangle\"\ncentre = [0, 0, 0.2]\nedge_u = [0.5, 0, 0]\nedge_v = [0, 0.5, 0]\n\
         material = \"bulb\"\n[material.bulb]\ntype = \"emissive\"\nradiance = 3\n",
    )
    .unwrap();
    scene.camera = straight_down(&scene);
    is(&scene, 3.0 * (-0.5_f64 * 0.8).exp());
}

#[test]
fn a_lamp_partly_inside_a_body_ok() {
    let medium = "sigma_s = 2\nsigma_a = 0\ng = 0\neta = 1";
    let lamp = BULB.replace("0.1, 0, 0", "1, 0.1, 0.2");
    let scene =
        scene_of(&[cube(0.0)], medium, &format!("{lamp}[material.bulb]\ntype = \"emissive\"\nradiance = 1\n")).unwrap();
    white(&scene);
    assert!(
        scene.warnings.iter().any(|w| w.contains("lamp \"bulb\" lies partly inside object \"a\"")),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn a_lamp_in_a_face_of_a_body_refused() {
    let lamp = "[[object]]\nname = \"bulb\"\nshape = \"rectangle\"\ncentre = [0, 0, 1]\nedge_u = [0.5, 0, 0]\nedge_v = [0, 0.5, 0]\n\
                material = \"bulb\"\n[material.bulb]\ntype = \"emissive\"\nradiance = 1\n";
    let scene = scene_of(&[cube(0.0)], WHITE, lamp).unwrap();
    refuses(&scene, ObstacleKind::LampTouching, &["\"bulb\"", "\"a\"", "a gap of at least"]);
}

const STONE: &str =
    "[material.stone]\ntype = \"diffuse\"\nalbedo = 1\n[[object]]\nname = \"stone\"\nmaterial = \"stone\"\n";

/// White stones in white wax: wholly inside, half inside, and a sheet through it.
#[test]
fn opaque_objects_inside_a_body_ok() {
    for shape in [
        "shape = \"sphere\"\ncentre = [0.2, 0, 0]\nradius = 0.5\nrings = 8\nsegments = 16\n",
        "shape = \"sphere\"\ncentre = [1, 0, 0]\nradius = 0.5\nrings = 8\nsegments = 16\n",
        "shape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 1]\n",
    ] {
        white(&scene_of(&[cube(0.0)], WHITE, &(STONE.to_string() + shape)).unwrap());
    }
}

#[test]
fn a_body_whose_face_lies_in_the_floor_warns() {
    let floor = |y: f64| {
        let shape = format!("shape = \"rectangle\"\ncentre = [0, {y}, 0]\nedge_u = [0, 0, 4]\nedge_v = [4, 0, 0]\n");
        scene_of(&[cube(0.0)], WHITE, &(STONE.to_string() + &shape)).unwrap()
    };
    let scene = floor(-1.0);
    assert_eq!(traceable(&scene), []);
    let said = scene.warnings.join("\n");
    assert!(said.contains("a face of object \"stone\" lies in one of the translucent object \"a\""), "{said}");
    let gap: f64 = said.split("at least ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let apart = floor(-1.0 - 1.05 * gap);
    assert_eq!((apart.warnings.len(), apart.obstacles().len()), (0, 0), "{:?}", apart.warnings);
    white(&apart);
}

fn from(position: &str, medium: &str) -> Scene {
    let text = format!(
        "unit = \"m\"\n[camera]\nposition = {position}\nlook_at = [0, 0.1, 2]\nfov = 60\nresolution = [8, 8]\n[[object]]\nname = \"fog\"\n\
         shape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nmaterial = \"fog\"\n[material.fog]\ntype = \"translucent\"\n{medium}\n\
         [environment]\nradiance = 1\n"
    );
    load_with(&text, &[], false).unwrap()
}

/// exp(-σ_a R) from the middle of a ball; 1 where nothing absorbs, whatever the index.
#[test]
fn a_camera_inside_a_body_ok() {
    let scene = from("[0, 0, 0]", "sigma_s = 0\nsigma_a = 1\ng = 0\neta = 1");
    assert_eq!((traceable(&scene), scene.camera_in()), (vec![], &[(0, 1)][..]));
    // The triangles lie up to 1.2e-3 inside the ball.
    is(&scene, (-0.9994_f64).exp());
    white(&from("[0, 0, 0]", "sigma_s = 1\nsigma_a = 0\ng = 0\neta = 1"));
    white(&from("[0.2, 0, 0.5]", "sigma_s = 3\nsigma_a = 0\ng = 0.5\neta = 1.33"));
    let said = scene.warnings.join("\n");
    assert!(
        said.contains("the camera stands inside object \"fog\"") && said.contains("--method volume_path"),
        "{said}"
    );
}

#[test]
fn a_camera_in_the_surface_of_a_body_refused() {
    let scene = from("[0, 1, 0]", WHITE);
    refuses(&scene, ObstacleKind::CameraTouching, &["the camera stands in the surface of object \"fog\"", "move it"]);
}

/// Each of them is named, but not each of twenty thousand pairs.
#[test]
fn hundreds_of_bodies_in_one_place_ok() {
    let mut text =
        "unit = \"mm\"\n[camera]\nposition = [0.3, 0.2, 9]\nlook_at = [0, 0, 0]\nfov = 20\nresolution = [8, 8]\n[environment]\nradiance = 1\n\
                    [material.wax]\ntype = \"translucent\"\nsigma_s = 1\nsigma_a = 0\ng = 0\neta = 1.3\n"
            .to_string();
    let all = 60;
    for i in 0..all {
        text += &format!("[[object]]\nname = \"{i}\"\nmesh = \"a.obj\"\nmaterial = \"wax\"\n");
    }
    let scene = load_with(&text, &[("a.obj", &cube(0.0))], false).unwrap();
    let found = scene.obstacles();
    assert!(found.len() < 1000 + all + 2, "{}", found.len());
    for i in 0..all {
        assert!(found.iter().any(|o| o.objects.contains(&i.to_string())), "{i}");
    }
    white(&scene);
}
