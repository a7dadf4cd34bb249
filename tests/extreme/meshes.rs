//! Broken meshes, and meshes that only look broken.

use super::harness::{BALL, Shot, load, load_with, ok, refused, warns, with};
use super::parts::centred;
use marmor::scene::Scene;

/// [`super::harness::BASE`] with this OBJ file for its body.
fn body(obj: &str) -> marmor::Result<Scene> {
    load_with(&with(&[(BALL, "mesh = \"body.obj\"\nmaterial = \"wax\"")]), &[("body.obj", obj)], false)
}

/// The same of a medium in which the plates of these tests are thick.
fn dense(obj: &str) -> marmor::Result<Scene> {
    let thick = ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = [40, 50, 60]");
    load_with(&with(&[(BALL, "mesh = \"body.obj\"\nmaterial = \"wax\""), thick]), &[("body.obj", obj)], false)
}

fn mended(obj: &str) -> Scene {
    load_with(&with(&[(BALL, "mesh = \"body.obj\"\nmaterial = \"wax\"")]), &[("body.obj", obj)], true).unwrap()
}

fn cube() -> String {
    centred([0.8; 3])
}

fn same_pictures(a: &[Shot], b: &[Shot]) {
    for (a, b) in a.iter().zip(b) {
        assert!(a.image == b.image, "{}", a.what);
    }
}

#[test]
fn a_closed_cube_ok() {
    ok(&body(&cube()).unwrap());
}

#[test]
fn a_triangle_without_area_warns() {
    let broken = cube() + "v 0 0.8 0\nf 1 2 9\nf 3 9 9\nv -0.8 0 -0.8\nv -0.8 0.4 -0.8\nf 1 10 11\n";
    let shots = warns(&body(&broken).unwrap(), &["2 of 15 triangles have no area; rays and samples pass them by"]);
    assert!(shots.iter().all(|s| s.brightest() > 0.0));
}

#[test]
fn repeated_vertices_in_a_face_warns() {
    let broken = cube() + "f 1 1 2\nf 5 5 5\n";
    let sound = ok(&body(&cube()).unwrap());
    same_pictures(&warns(&body(&broken).unwrap(), &["2 of 14 triangles have no area"]), &sound);
    same_pictures(&shots_of(&mended(&broken)), &sound);
}

fn shots_of(scene: &Scene) -> Vec<Shot> {
    let shots = super::harness::shots(scene);
    shots.iter().for_each(Shot::assert_sound);
    shots
}

#[test]
fn only_triangles_without_area_warns() {
    warns(&body("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").unwrap(), &["1 of 1 triangle has no area"]);
}

/// Slivers a billion times as long as they are wide, between sound triangles.
#[test]
fn needles_ok() {
    let mut obj = String::new();
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        obj += &format!("v {x} {y} 0\n");
    }
    obj += "v 1.000000001 -1 0\nv 1.000000001 1 0\nf 1 2 3 4\nf 2 5 6 3\nf 4 3 2 1\nf 3 6 5 2\n";
    let scene = body(&obj).unwrap();
    shots_of(&scene);
    let closed = centred([1.0, 1.0, 1e-9 / 2.0]);
    shots_of(&body(&closed).unwrap());
}

/// Twice the outline of an X as one polygon each, and its sides.
fn extruded_x() -> String {
    #[rustfmt::skip]
    let outline = [
        (-5, 9), (-9, 9), (-9, 5), (-3, 0), (-9, -5), (-9, -9), (-5, -9), (0, -3), (5, -9), (9, -9), (9, -5), (3, 0), (9, 5),
        (9, 9), (5, 9), (0, 3),
    ];
    let mut obj = String::new();
    for z in [0.15, -0.15] {
        outline.iter().for_each(|(x, y)| obj += &format!("v {} {} {z}\n", f64::from(*x) / 10.0, f64::from(*y) / 10.0));
    }
    let ring = |corners: &mut dyn Iterator<Item = usize>| {
        format!("f {}\n", corners.map(|i| i.to_string()).collect::<Vec<_>>().join(" "))
    };
    obj += &ring(&mut (1..=16));
    obj += &ring(&mut (17..=32).rev());
    (0..16).for_each(|i| obj += &format!("f {} {} {} {}\n", i + 1, i + 17, (i + 1) % 16 + 17, (i + 1) % 16 + 1));
    obj
}

fn area(scene: &Scene) -> f64 {
    let mesh = &scene.objects[0].mesh;
    (0..mesh.triangles.len() as u32).map(|t| mesh.area(t)).sum()
}

#[test]
fn concave_polygons_ok() {
    let scene = dense(&extruded_x()).unwrap();
    // The outline's area is 2.04 and its length 9.44820, by its corners.
    assert!((area(&scene) / 6.914_459_9 - 1.0).abs() < 1e-5, "{}", area(&scene));
    let volume = scene.objects[0].findings.volume.unwrap();
    assert!((volume / 0.612 - 1.0).abs() < 1e-5, "{volume}");
    ok(&scene);
}

/// A plate with a square hole: caps with a bridge to the hole, as exporters write them.
#[test]
fn a_hole_bridged_by_a_repeated_edge_ok() {
    let mut obj = String::new();
    for (half, z) in [(0.8, 0.2), (0.3, 0.2), (0.8, -0.2), (0.3, -0.2)] {
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            obj += &format!("v {} {} {z}\n", half * x, half * y);
        }
    }
    obj += "f 1 2 3 4 1 5 8 7 6 5\nf 9 12 11 10 9 13 14 15 16 13\n";
    for i in 0..4 {
        let next = (i + 1) % 4;
        obj += &format!("f {} {} {} {}\n", i + 1, i + 9, next + 9, next + 1);
        obj += &format!("f {} {} {} {}\n", next + 5, next + 13, i + 13, i + 5);
    }
    let scene = dense(&obj).unwrap();
    // Two caps of 1.6^2 - 0.6^2, sides of 4 (1.6 + 0.6) by 0.4.
    assert!((area(&scene) / 7.92 - 1.0).abs() < 1e-6, "{}", area(&scene));
    assert_eq!(scene.objects[0].findings.open_edges, 0);
    ok(&scene);
}

#[test]
fn a_polygon_that_crosses_itself_warns() {
    let bow = cube().replace("f 5 6 8 7\n", "f 5 6 7 8\n");
    warns(&body(&bow).unwrap(), &["body.obj: 1 of 6 polygons crosses or covers itself (the first in line 10)"]);
}

#[test]
fn a_polygon_that_is_not_plane_warns() {
    let bent = cube().replace("v 0.8 0.8 0.8\n", "v 0.8 0.8 1.8\n");
    warns(&body(&bent).unwrap(), &["body.obj: 1 of 6 polygons is not plane", "cut them into triangles"]);
}

/// A cube whose faces have corners of their own, rounded apart by a few millionths of its size.
fn soup() -> String {
    let (mut corners, mut obj) = (Vec::new(), String::new());
    for line in cube().lines() {
        let numbers: Vec<f64> = line.split(' ').skip(1).map(|n| n.parse().unwrap()).collect();
        if line.starts_with('v') {
            corners.push(numbers);
            continue;
        }
        for (k, n) in numbers.iter().enumerate() {
            let p: Vec<f64> = corners[*n as usize - 1].iter().map(|x| x + 3e-6 * (k as f64 - 1.5)).collect();
            obj += &format!("v {} {} {}\n", p[0], p[1], p[2]);
        }
        obj += "f -4 -3 -2 -1\n";
    }
    obj
}

#[test]
fn corners_rounded_apart_warns() {
    let scene = body(&soup()).unwrap();
    warns(&scene, &["24 of 24 edges that belong to one triangle alone run along another", "--repair welds them"]);
    assert!(!scene.warnings.join("\n").contains("holes"));
    let whole = mended(&soup());
    let said = whole.warnings.join("\n");
    assert!(said.contains("corners welded to others within 2.8e-5 units (1e-5 of its size)"), "{said}");
    assert!(whole.objects[0].findings.volume.is_some_and(|v| (v / 4.096 - 1.0).abs() < 1e-4));
}

#[test]
fn smooth_normals_without_shared_corners_warns() {
    let apart: String = (0..6).map(|i| format!("v {i} 0 0\nv {i}.5 0 0\nv {i} 1 0\nf -3 -2 -1\n")).collect();
    let text = with(&[(BALL, "mesh = \"body.obj\"\nnormals = \"smooth\"\nmaterial = \"wax\"")]);
    let load = |obj: &str| load_with(&text, &[("body.obj", obj)], false).unwrap();
    warns(&load(&apart), &["smooths nothing on 6 of 6 triangles, which share no corner", "weld corners"]);
    ok(&load(&cube()));
}

#[test]
fn a_fourth_number_on_vertices_warns() {
    let grey: String =
        cube().lines().map(|l| if l.starts_with('v') { format!("{l} 0.8\n") } else { format!("{l}\n") }).collect();
    let said = "body.obj: 8 vertices have a fourth number other than 1 (the first, 0.8, in line 1)";
    let shots = warns(&body(&grey).unwrap(), &[said, "not divided"]);
    same_pictures(&shots, &ok(&body(&cube()).unwrap()));
}

#[test]
fn carriage_returns_alone_ok() {
    same_pictures(&ok(&body(&cube().replace('\n', "\r")).unwrap()), &ok(&body(&cube()).unwrap()));
}

#[test]
fn a_comment_after_a_face_ok() {
    let commented = cube().replace("f 5 6 8 7", "f 5 6 8 7 # the front");
    same_pictures(&ok(&body(&commented).unwrap()), &ok(&body(&cube()).unwrap()));
}

#[test]
fn utf_16_refused() {
    let wide: String = cube().chars().flat_map(|c| [c, '\0']).collect();
    refused(body(&wide), &["body.obj:1", "UTF-16", "UTF-8"]);
}

#[test]
fn duplicate_triangles_warns() {
    let broken = cube() + "f 1 3 4\nf 4 3 1\n";
    warns(&body(&broken).unwrap(), &["2 of 14 triangles repeat another", "counts twice", "--repair"]);
    same_pictures(&shots_of(&mended(&broken)), &ok(&body(&cube()).unwrap()));
}

#[test]
fn coincident_bodies_warns() {
    let copy = format!("[[object]]\nname = \"copy\"\n{BALL}\n[[object]]\nname = \"floor\"");
    let scene = load(&with(&[("[[object]]\nname = \"floor\"", &copy)])).unwrap();
    warns(&scene, &["\"body\" and \"copy\" overlap", "light does not pass from one to the other"]);
}

#[test]
fn intersecting_bodies_warns() {
    let second = BALL.replace("centre = [0, 0, 0]", "centre = [0.7, 0.3, 0]");
    let text = with(&[(
        "[[object]]\nname = \"floor\"",
        &format!("[[object]]\nname = \"second\"\n{second}\n[[object]]\nname = \"floor\""),
    )]);
    warns(&load(&text).unwrap(), &["\"body\" and \"second\" overlap", "light does not pass from one to the other"]);
}

#[test]
fn nan_vertex_refused() {
    refused(body("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"), &["body.obj:2", "not finite"]);
}

#[test]
fn infinite_vertex_refused() {
    refused(body("v 0 0 0\nv 0 -inf 0\nv 0 1 0\nf 1 2 3\n"), &["body.obj:2", "not finite"]);
}

#[test]
fn vertex_written_by_an_old_compiler_refused() {
    refused(body("v 0 0 0\nv 0 1 0\nv -1.#IND 1 0\nf 1 2 3\n"), &["body.obj:3", "not finite"]);
}

#[test]
fn vertex_beyond_f64_refused() {
    refused(body("v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n"), &["body.obj:2"]);
}

#[test]
fn index_0_refused() {
    refused(body("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"), &["body.obj:4", "0"]);
}

#[test]
fn index_out_of_range_refused() {
    refused(body("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), &["body.obj:4", "4"]);
}

#[test]
fn negative_index_out_of_range_refused() {
    refused(body("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n"), &["body.obj:4", "-4"]);
}

#[test]
fn negative_indices_ok() {
    let relative = cube().replace("f 1 3 4 2", "f -8 -6 -5 -7");
    assert_ne!(relative, cube());
    same_pictures(&ok(&body(&relative).unwrap()), &ok(&body(&cube()).unwrap()));
}

#[test]
fn no_faces_refused() {
    refused(body("v 0 0 0\n"), &["no faces"]);
}

#[test]
fn an_empty_file_refused() {
    refused(body(""), &["the file is empty"]);
}

#[test]
fn an_open_mesh_warns() {
    let open = cube().replace("f 5 6 8 7\n", "");
    warns(&body(&open).unwrap(), &["4 edges belong to one triangle alone"]);
}

#[test]
fn an_edge_of_three_faces_ok() {
    let fin = cube() + "v 0 2 0.8\nv 0 2 0.9\nf 7 9 8\nf 9 10 8\nf 10 7 8\nf 9 7 10\n";
    let scene = body(&fin).unwrap();
    assert_eq!(scene.objects[0].findings.non_manifold_edges, 1);
    assert!(scene.remarks(&scene.objects[0]).iter().any(|r| r.text.contains("more than two triangles")));
    ok(&scene);
}

#[test]
fn an_inside_out_mesh_warns() {
    let faces = |line: &str| line.split(' ').rev().take(4).collect::<Vec<_>>().join(" ");
    let turned: String = cube()
        .lines()
        .map(|line| if line.starts_with('f') { format!("f {}\n", faces(line)) } else { format!("{line}\n") })
        .collect();
    let scene = body(&turned).unwrap();
    assert!(scene.objects[0].findings.inside_out());
    warns(&scene, &["its faces look inwards", "flip = true", "--repair"]);
    let fixed = mended(&turned);
    assert!(!fixed.objects[0].findings.inside_out());
    let flipped = with(&[(BALL, "mesh = \"body.obj\"\nflip = true\nmaterial = \"wax\"")]);
    ok(&load_with(&flipped, &[("body.obj", &turned)], false).unwrap());
}

#[test]
fn mixed_winding_warns() {
    let mixed = cube().replace("f 5 6 8 7", "f 7 8 6 5");
    warns(&body(&mixed).unwrap(), &["faces disagree about the outside along 4 edges", "--repair"]);
    assert_eq!(mended(&mixed).objects[0].findings.mixed_edges, 0);
}

fn with_normal(n: &str) -> String {
    cube()
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => format!("f {}\n", face.split(' ').map(|v| format!("{v}//1")).collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect::<String>()
        + &format!("vn {n}\n")
}

#[test]
fn zero_normals_warns() {
    // No direction: those triangles are shaded flat, which is said.
    let shots = warns(&body(&with_normal("0 0 0")).unwrap(), &["12 of 12 triangles are shaded flat"]);
    same_pictures(&shots, &ok(&body(&cube()).unwrap()));
}

/// All normals the same way, along some faces and against others: they are turned to the side of the face.
#[test]
fn wrong_normals_ok() {
    for n in ["0 -1 0", "1e-30 0 0", "1e30 1e30 -1e30", "-0.3 0.2 1"] {
        ok(&body(&with_normal(n)).unwrap());
    }
}

#[test]
fn infinite_normals_refused() {
    refused(body(&with_normal("inf 0 0")), &["normal", "not finite"]);
}

#[test]
fn one_hundred_thousand_equal_triangles_warns() {
    let broken = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(100_000));
    let scene = body(&broken).unwrap();
    assert!(
        scene.warnings.iter().any(|w| w.contains("99999 of 100000 triangles repeat another")),
        "{:?}",
        scene.warnings
    );
    assert_eq!(mended(&broken).objects[0].mesh.triangles.len(), 1);
}
