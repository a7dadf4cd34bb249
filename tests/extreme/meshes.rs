//! Broken meshes, and meshes that only look broken.

use super::harness::{BALL, Shot, load, load_with, ok, refused, warns, with};
use super::sizes::cuboid;
use marmor::scene::Scene;

/// [`super::harness::BASE`] with this OBJ file for its body.
fn body(obj: &str) -> marmor::Result<Scene> {
    load_with(&with(&[(BALL, "mesh = \"body.obj\"\nmaterial = \"wax\"")]), &[("body.obj", obj)], false)
}

fn mended(obj: &str) -> Scene {
    load_with(&with(&[(BALL, "mesh = \"body.obj\"\nmaterial = \"wax\"")]), &[("body.obj", obj)], true).unwrap()
}

fn cube() -> String {
    cuboid(0.8, 0.8, 0.8)
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
    warns(&body("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").unwrap(), &["1 of 1 triangles have no area"]);
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
    let closed = cuboid(1.0, 1.0, 1e-9 / 2.0);
    shots_of(&body(&closed).unwrap());
}

#[test]
fn duplicate_triangles_warns() {
    let broken = cube() + "f 1 3 4\nf 4 3 1\n";
    warns(&body(&broken).unwrap(), &["2 of 14 triangles repeat another", "counts twice", "--repair"]);
    same_pictures(&shots_of(&mended(&broken)), &ok(&body(&cube()).unwrap()));
}

#[test]
fn coincident_bodies_ok() {
    let copy = format!("[[object]]\nname = \"copy\"\n{BALL}\n[[object]]\nname = \"floor\"");
    ok(&load(&with(&[("[[object]]\nname = \"floor\"", &copy)])).unwrap());
}

#[test]
fn intersecting_bodies_ok() {
    let second = BALL.replace("centre = [0, 0, 0]", "centre = [0.7, 0.3, 0]");
    let text = with(&[(
        "[[object]]\nname = \"floor\"",
        &format!("[[object]]\nname = \"second\"\n{second}\n[[object]]\nname = \"floor\""),
    )]);
    ok(&load(&text).unwrap());
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
    warns(&body(&open).unwrap(), &["4 edges belong to one triangle alone, the rims of holes"]);
}

#[test]
fn an_edge_of_three_faces_ok() {
    let fin = cube() + "v 0 2 0.8\nv 0 2 0.9\nf 7 8 9\nf 9 8 10\nf 10 8 7\nf 9 10 7\n";
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
    let shots = warns(&body(&with_normal("0 0 0")).unwrap(), &["12 of 12 triangles have no normals"]);
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
