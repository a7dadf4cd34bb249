//! Texture coordinates of meshes: read, written, and kept whatever is done to a mesh.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

use marmor::geometry::{RawMesh, load_mesh_with_uv, mended, sphere, write_obj};
use marmor::math::{DAffine3, DVec3};

/// Whatever is done to a mesh, a corner keeps its coordinates: here they are its place.
#[test]
fn corners_keep_their_coordinates() {
    let ball = |x: f64| {
        let mut mesh = sphere(DVec3::new(x, 0.0, 0.0), 1.0, 6, 8);
        let of = |i: u32| [mesh.positions[i as usize].x as f32, mesh.positions[i as usize].y as f32];
        mesh.uv = Some(mesh.triangles.iter().map(|t| Some(t.map(of))).collect());
        mesh
    };
    let holds = |mesh: &RawMesh, what: &str| {
        assert_eq!((mesh.uv.as_ref().unwrap().len(), mesh.without_uv()), (mesh.triangles.len(), 0), "{what}");
        let mesh = mesh.recentred(DVec3::ZERO);
        for t in 0..mesh.triangles.len() as u32 {
            let at = mesh.point(t, 0.2, 0.5);
            let off = (f64::from(at.uv[0]) - at.x.x).abs().max((f64::from(at.uv[1]) - at.x.y).abs());
            assert!(off < 1e-5, "{what}: {:?} at {}", at.uv, at.x);
        }
    };
    holds(&ball(0.0), "as made");
    holds(&ball(0.0).flipped(), "flipped");
    holds(&ball(0.0).with_smooth_normals(), "smooth");
    holds(&ball(0.0).placed(DAffine3::from_scale(DVec3::new(1.0, 1.0, -3.0))), "mirrored");
    holds(&RawMesh::joined(vec![(ball(0.0), true), (ball(5.0), false)]), "joined");
    // Some faces turned, one twice, one without area.
    let mut odd = ball(0.0);
    for t in [3, 17, 40] {
        odd.triangles[t].swap(1, 2);
        odd.normals.as_mut().unwrap().triangles[t].as_mut().unwrap().swap(1, 2);
        odd.uv.as_mut().unwrap()[t].as_mut().unwrap().swap(1, 2);
    }
    let push = |mesh: &mut RawMesh, t: usize, corners: [usize; 3]| {
        let (triangle, normals) = (mesh.triangles[t], mesh.normals.as_ref().unwrap().triangles[t]);
        let uv = mesh.uv.as_ref().unwrap()[t];
        mesh.triangles.insert(2, corners.map(|k| triangle[k]));
        mesh.normals.as_mut().unwrap().triangles.insert(2, normals.map(|n| corners.map(|k| n[k])));
        mesh.uv.as_mut().unwrap().insert(2, uv.map(|uv| corners.map(|k| uv[k])));
    };
    push(&mut odd, 9, [0, 1, 2]);
    push(&mut odd, 9, [0, 0, 2]);
    let (whole, done) = mended(odd);
    assert_eq!((done.turned, done.duplicates, done.zero_area), (3, 1, 1));
    holds(&whole, "mended");
    // Joined with one that has none.
    let bare = RawMesh { uv: None, ..ball(5.0) };
    for parts in [[ball(0.0), bare.clone()], [bare.clone(), ball(0.0)]] {
        let first = parts[0].uv.is_some();
        let n = bare.triangles.len();
        let joined = RawMesh::joined(parts.map(|mesh| (mesh, true)).to_vec());
        assert_eq!((joined.without_uv(), joined.uv.as_ref().unwrap()[0].is_some()), (n, first));
        assert_eq!(joined.uv.unwrap().len(), 2 * n);
    }
    // Written and read again.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let mut mesh = ball(0.0);
    mesh.uv.as_mut().unwrap()[7] = None;
    mesh.normals.as_mut().unwrap().triangles[9] = None;
    write_obj(&mesh, &mut std::fs::File::create(&path).unwrap()).unwrap();
    let read = load_mesh_with_uv(&path).unwrap();
    // Corners have other numbers there.
    let places =
        |mesh: &RawMesh| mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]).collect::<Vec<_>>();
    assert!(read.uv == mesh.uv && places(&read) == places(&mesh));
}

/// Polygons, numbers that count back, coordinates after their faces, and such that are none.
#[test]
fn coordinates_of_obj_files() {
    let read = |text: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.obj");
        std::fs::write(&path, format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{text}")).unwrap();
        load_mesh_with_uv(&path).unwrap()
    };
    let square = "vt 0 0\nvt 0.5 0 # half\nvt 0.5 1 7\nvt 0 1\n";
    let half = Some(vec![Some([[0.0, 0.0], [0.5, 0.0], [0.5, 1.0]]), Some([[0.0, 0.0], [0.5, 1.0], [0.0, 1.0]])]);
    for faces in ["f 1/1 2/2 3/3 4/4", "f 1/-4 2/-3 3/-2 4/-1", "f 1/1 2/2 3/3\nf 1/1 3/3 4/4"] {
        assert_eq!(read(&format!("{square}{faces}\n")).uv, half, "{faces}");
    }
    assert_eq!(read(&format!("f 1/1 2/2 3/3 4/4\n{square}")).uv, half);
    let normals = "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";
    assert_eq!(read(&format!("{square}{normals}")).uv, half);
    assert_eq!(read("vt 0.25\nf 1/1 2/1 3/1\n").uv, Some(vec![Some([[0.25, 0.0]; 3])]));
    assert_eq!(read(&format!("{square}f 1 2 3\n")).uv, None);
    for none in [
        "f 1/1 2/2 3/9",
        "f 1/1 2/2 3/-9",
        "f 1/1 2/2 3/0",
        "f 1/1 2/2 3",
        "vt nan 0\nf 1/1 2/2 3/5",
        "vt x 0\nf 1/1 2/2 3/5",
    ] {
        let mesh = read(&format!("{square}{none}\nf 1/1 3/3 4/4\n"));
        assert_eq!((mesh.without_uv(), mesh.uv.unwrap()[0]), (1, None), "{none}");
    }
}
