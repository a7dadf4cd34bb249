//! Where a scene file puts a mesh, and what becomes of its normals.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

use marmor::math::{DVec3, Vec3};
use marmor::scene::{Scene, SceneFile};
use std::path::PathBuf;

/// A scene of one OBJ file with a transform.
fn placed(obj: &str, keys: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), obj).unwrap();
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 1e4]\nlook_at = [0, 0, 0]\nfov = 40\nresolution = [8, 4]\n\
         [[object]]\nmesh = \"m.obj\"\nmaterial = \"m\"\n{keys}\n[material.m]\ntype = \"diffuse\"\nalbedo = 0.5\n"
    );
    let path: PathBuf = folder.path().join("scene.toml");
    Scene::load(&SceneFile::parse(&text, &path).unwrap()).unwrap()
}

/// A corner of a tetrahedron with outward normals, as OBJ.
const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fn volume(scene: &Scene) -> f64 {
    let mesh = &scene.objects[0].mesh;
    let corners = (0..mesh.triangles.len() as u32).map(|t| mesh.corners(t));
    corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

#[test]
fn transforms_place_and_keep_the_outside_outside() {
    let corner = |keys: &str, i: usize| {
        let scene = placed(TETRAHEDRON, keys);
        scene.objects[0].mesh.positions.iter().map(|p| *p + scene.centre).collect::<Vec<_>>()[i]
    };
    // Vertices come in the order of the faces: origin, y, x, z.
    assert_eq!(
        corner("transform = { scale = 2, rotate = [0, 0, 90], translate = [5, 0, 0] }", 2),
        DVec3::new(5.0, 2.0, 0.0)
    );
    // x first: y -> z, then about z it stays.
    assert_eq!(corner("transform = { rotate = [90, 0, 90] }", 1), DVec3::Z);
    assert_eq!(corner("transform = { rotate = [0, 90, 0] }", 3), DVec3::X);
    assert_eq!(
        corner("transform = { matrix = [[0,0,1,7],[1,0,0,8],[0,1,0,9],[0,0,0,1]] }", 1),
        DVec3::new(7.0, 8.0, 10.0)
    );
    for (keys, expected) in [
        ("", 1.0 / 6.0),
        ("transform = { scale = [2, 3, 4] }", 4.0),
        ("transform = { scale = [-2, 3, 4] }", 4.0),
        ("transform = { scale = -1 }", 1.0 / 6.0),
        ("transform = { matrix = [[0, 1, 0], [1, 0, 0], [0, 0, 1]] }", 1.0 / 6.0),
        ("transform = { scale = 2, rotate = [10, 20, 30], translate = [1e6, 0, 0] }", 8.0 / 6.0),
        ("flip = true", -1.0 / 6.0),
        ("flip = true\ntransform = { scale = [1, 1, -1] }", -1.0 / 6.0),
    ] {
        let found = volume(&placed(TETRAHEDRON, keys));
        assert!((found - expected).abs() < 1e-5 * expected.abs(), "{keys}: {found} for {expected}");
    }
}

#[test]
fn normals_follow_a_stretch_by_the_inverse_transpose() {
    // A slanted square with its own normal, typed as normals.
    let square = "v -1 0 1\nv 1 0 1\nv 1 1 0\nv -1 1 0\nvn 0 1 1\nf 1//1 2//1 3//1 4//1\n";
    for keys in [
        "",
        "transform = { scale = [1, 5, 0.5], rotate = [20, 30, 40] }",
        "transform = { scale = [1, -5, 1] }",
        "flip = true",
    ] {
        let scene = placed(square, keys);
        let mesh = &scene.objects[0].mesh;
        let normals = mesh.normals.as_ref().unwrap();
        for t in 0..2 {
            for i in normals.triangles[t as usize] {
                assert!((normals.vectors[i as usize] - mesh.geometric_normal(t)).length() < 1e-6, "{keys}");
            }
        }
    }
}

#[test]
fn smooth_normals_are_weighted_by_angle_and_weld_equal_positions() {
    // A cube's corner whose three faces are cut unevenly and share no vertex numbers: the mean is the diagonal.
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 -0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nv 0 0 0\nv 0 1 0\nv 0 1 1\nv 0 0 1\n\
                f 4 3 1\nf 3 2 1\nf 8 7 6 5\nf 9 12 11 10\n";
    let scene = placed(cube, "normals = \"smooth\"");
    let mesh = &scene.objects[0].mesh;
    let normals = mesh.normals.as_ref().unwrap();
    let (t, corner) = (1, 2);
    assert_eq!(mesh.positions[mesh.triangles[t][corner] as usize] + scene.centre, DVec3::ZERO);
    let n = normals.vectors[normals.triangles[t][corner] as usize];
    assert!((n - Vec3::splat(-1.0).normalize()).length() < 1e-6, "{n}");
    assert!(placed(cube, "normals = \"geometric\"").objects[0].mesh.normals.is_none());
}

#[test]
fn far_scenes_keep_their_digits_and_powers_of_two_scale_exactly() {
    let near = placed(TETRAHEDRON, "transform = { scale = 0.37, rotate = [10, 20, 30] }\nnormals = \"smooth\"");
    let far = placed(TETRAHEDRON, "transform = { scale = 0.37, rotate = [10, 20, 30], translate = [1e7, -1e7, 1e7] }");
    for (a, b) in near.objects[0].mesh.positions.iter().zip(&far.objects[0].mesh.positions) {
        assert!((*a - *b).length() < 1e-7, "{a} {b}");
    }
    for k in [-40, -7, 1, 30] {
        let s = 2_f64.powi(k);
        let keys = format!("transform = {{ scale = {:?}, rotate = [10, 20, 30] }}\nnormals = \"smooth\"", 0.37 * s);
        let scaled = placed(TETRAHEDRON, &keys);
        let (a, b) = (&near.objects[0].mesh, &scaled.objects[0].mesh);
        let exact: Vec<DVec3> = a.positions.iter().map(|p| *p * s).collect();
        assert_eq!((&exact, &a.triangles), (&b.positions, &b.triangles), "2^{k}");
        assert_eq!(a.normals.as_ref().unwrap().vectors, b.normals.as_ref().unwrap().vectors, "2^{k}");
    }
}
