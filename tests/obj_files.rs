//! OBJ files, good and bad: what is made of them and what is said about them.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

mod refusals;

use marmor::geometry::{RawMesh, load_mesh};
use marmor::math::DVec3;
use marmor::{Error, ErrorKind};
use refusals::{damaged, failure};

fn obj(text: &[u8]) -> Result<RawMesh, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.obj");
    std::fs::write(&path, text).unwrap();
    load_mesh(&path)
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";

#[test]
fn obj_files_that_are_read() {
    #[rustfmt::skip]
    let cases: &[(&str, &[[u32; 3]], usize)] = &[
        ("f 1 2 3", &[[0, 1, 2]], 3),
        ("f 1 2 4 3", &[[0, 1, 2], [0, 2, 3]], 4),
        ("f -4 -3 -2\nf -3 -1 -2", &[[0, 1, 2], [1, 3, 2]], 4),
        ("vt 0 0\nf 1/1 2/1 3/1\nf 1/9 2/-9 3/", &[[0, 1, 2], [0, 1, 2]], 3),
        ("g a\nf 1 2 3\ng b\nusemtl red\nf 2 4 3\no c\n", &[[0, 1, 2], [1, 3, 2]], 4),
        ("mtllib nowhere.mtl\nusemtl x\ns off\nf 1 2 3", &[[0, 1, 2]], 3),
        ("f 1 2 \\\n 3\r\n", &[[0, 1, 2]], 3),
        ("g a\nf 1 2 5\ng b\nv 3 3 3", &[[0, 1, 2]], 3),
        ("v 1 2 3 0.5 0.5 0.5\nf 1 2 3", &[[0, 1, 2]], 3),
        ("p 1\nl 1 2\nf 1 2\nf 1 2 3", &[[0, 1, 2]], 3),
        // A comment after a face, in a face and one that ends in a backslash; the face of version 2; blanks at ends.
        ("f 1 2 3 # roof\nf 1 2 3# roof\n# C:\\roofs\\\nf 2 4 3", &[[0, 1, 2], [0, 1, 2], [1, 3, 2]], 4),
        ("v 5 5 5 # corner\nv 5 5 5# corner\nfo 1 2 3\t \n", &[[0, 1, 2]], 3),
        // Line ends of three kinds.
        ("f 1 2 3\rf 2 4 3\r", &[[0, 1, 2], [1, 3, 2]], 4),
        ("f 1 2 3\r\nf 2 4 \\\r\n3\r\r\nf 1 2 3", &[[0, 1, 2], [1, 3, 2], [0, 1, 2]], 4),
    ];
    for (text, triangles, vertices) in cases {
        let mesh = obj(format!("{TRIANGLE}{text}").as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!((&mesh.triangles[..], mesh.positions.len()), (*triangles, *vertices), "{text}");
        assert!(mesh.normals.is_none(), "{text}");
        let left_out = "3 points, lines or faces with fewer than three corners are left out".to_string();
        assert_eq!(mesh.remarks, if text.starts_with('p') { vec![left_out] } else { Vec::new() }, "{text}");
    }
    // A whole file of one line end, numbered right.
    let returns = format!("{TRIANGLE}f 1 2 3\nf 1 2 9").replace('\n', "\r");
    assert!(obj(returns.as_bytes()).unwrap_err().to_string().contains(":6: vertex number 9"));
    // Neither an accent in a comment nor one in a group's name stops a file.
    assert!(obj(&[b"# caf\xe9\ng \xe9\n", TRIANGLE.as_bytes(), b"f 1 2 3"].concat()).is_ok());
    assert_eq!(obj(&[b"\xef\xbb\xbf", TRIANGLE.as_bytes(), b"f 1 2 3"].concat()).unwrap().positions[0], DVec3::ZERO);
    // Digits beyond f32 survive.
    let far = obj(b"v 1000000.001 0 0\nv 1000000.002 0 0\nv 1000000 1 0\nf 1 2 3").unwrap().recentred(DVec3::X * 1e6);
    assert_eq!(far.positions[0].x, 1_000_000.001 - 1e6);
}

/// What is read in part or not at all is said once, with its number and first line.
#[test]
fn obj_files_with_more_than_is_read_say_so() {
    #[rustfmt::skip]
    let cases: &[(&str, &str)] = &[
        ("v 2 4 6 2\nv 1 1 1 1\nv 1 0 0 0\nf 1 2 3", "2 vertices have a fourth number other than 1 (the first, 2, in line 5)"),
        ("v 2 4 6 2\nf 1 2 3", "vertices were not divided by their fourth number"),
        ("v 1 2 3 1 1 0 1\nf 1 2 3", "1 vertex has further numbers (4 after x y z in line 5)"),
        ("v 1 2 3 1 0\nf 1 2 3", "1 vertex has further numbers (2 after x y z in line 5)"),
        ("cstype bezier\nsurf 0 1 0 1 1 2 3 4\nend\ncurv 0 1 1 2\nf 1 2 3", "2 free-form curves or surfaces are left out (the first, `surf`, in line 6)"),
        ("vertex 1 2 3\nf 1 2 3", "1 line begins with a word that OBJ does not have (the first, `vertex`, in line 5)"),
        ("call other.obj\ncsh make\nf 1 2 3", "2 lines call for other files or for commands (the first, `call`, in line 5)"),
        ("vn 0 0 1\nf 1//1 2//1 3", "1 face has normals at some corners only (the first in line 6)"),
        ("vn 0 0 1\nf 1 2 3", "no face refers to its one normal"),
        ("v 1 -1 0\nf 1 2 3 4\nf 1 4 2 3", "2 of 2 polygons cross or cover themselves (the first in line 6)"),
        ("v 1 1 9\nf 1 2 5 3\nf 1 2 4 3", "1 of 2 polygons is not plane (corners up to"),
    ];
    for (text, words) in cases {
        let mesh = obj(format!("{TRIANGLE}{text}").as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert!(mesh.remarks.len() == 1 && mesh.remarks[0].contains(words), "{text}: {:?}", mesh.remarks);
    }
    let weighted = obj(b"v 2 4 6 2\nv 1 0 0\nv 0 1 0\nf 1 2 3").unwrap();
    assert_eq!(weighted.positions[0], DVec3::new(2.0, 4.0, 6.0));
}

/// One line of more than a mebibyte: a comb that no corner sees whole, with normals.
#[test]
fn a_polygon_of_a_hundred_thousand_corners_is_read() {
    let n = 50_000;
    let mut text = String::from("vn 0 0 1\n");
    (0..n).for_each(|i| text += &format!("v {i} {} 0\n", if i % 2 == 0 { 1 } else { 90 }));
    (0..n).for_each(|i| text += &format!("v {} 0 0\n", n - 1 - i));
    text += "f";
    (1..=2 * n).for_each(|i| text += &format!(" {i}//1"));
    let mesh = obj(text.as_bytes()).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.without_normals(), &mesh.remarks[..]), (2 * n - 2, 0, &[][..]));
    let flat = mesh.recentred(DVec3::ZERO);
    let area: f64 = (0..mesh.triangles.len() as u32).map(|t| flat.area(t)).sum();
    // The mean height, 45.5, over a width of n - 1.
    assert!((area / (45.5 * (n - 1) as f64) - 1.0).abs() < 1e-9, "{area}");
}

#[test]
fn normals_keep_their_own_indices_and_may_be_missing_here_and_there() {
    let text =
        format!("{TRIANGLE}vn 0 0 2\nvn 0 1 1\nvn 0 0 0\nf 1//2 2//1 3//1\nf 2 4 3\nf 1//3 2//1 3//1\nf 1//1 2 3");
    let mesh = obj(text.as_bytes()).unwrap();
    let normals = mesh.normals.as_ref().unwrap();
    let [a, b, c] = normals.triangles[0].unwrap().map(|i| normals.vectors[i as usize]);
    assert!((a - DVec3::new(0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt())).length() < 1e-15);
    assert_eq!((b, c), (DVec3::Z, DVec3::Z));
    // No normals, one of length 0, one corner without.
    assert_eq!(normals.triangles[1..], [None, None, None]);
    assert_eq!(mesh.without_normals(), 3);
    let single = mesh.recentred(DVec3::ZERO);
    assert_eq!(single.point(1, 0.2, 0.2).n, single.geometric_normal(1));
    assert!(single.normals.as_ref().unwrap().vectors.iter().all(|n| (n.length() - 1.0).abs() < 1e-6));
}

#[test]
fn obj_files_that_are_refused_by_line() {
    #[rustfmt::skip]
    let cases: &[(&[u8], &str)] = &[
        (b"v 0 0 nan\nf 1 1 1", ":1: a vertex that is not finite in `v 0 0 nan`"),
        (b"v 0 0 1\nv 0 inf 0", ":2: a vertex that is not finite"),
        (b"v -1.#IND 0 0", ":1: a vertex that is not finite"),
        (b"v 1e999 0 0", ":1: a vertex that is not finite"),
        (b"vn 0 0 -inf", ":1: a normal that is not finite"),
        (b"v 0 0", ":1: no vertex in `v 0 0`; expected `v x y z`"),
        (b"# one\nv 1,5 0 0", ":2: no vertex"),
        (b"v 1 1 1 x", ":1: no vertex in `v 1 1 1 x`; expected numbers after `v`"),
        (b"\xff\xfev\x00 \x000\x00", ":1: the file is UTF-16 text; save it as UTF-8"),
        (b"\x00#\x00 \x00o", ":1: the file is UTF-16 text"),
        (b"vn 1 x 1", ":1: no normal"),
        (b"v 0 0 0\nf 1 1 0", ":2: vertex number 0 in a face; OBJ counts from 1"),
        (b"v 0 0 0\nf 1 1 1\nf 1 1 2", ":3: vertex number 2 in a face, but there is 1"),
        (b"v 0 0 0\nf 1 1 -2", ":2: vertex number -2 in a face, but there is 1"),
        (b"v 0 0 0\nf 1 1 9223372036854775807", ":2: vertex number 9223372036854775807"),
        (b"v 0 0 0\nf 1 1 99999999999999999999", ":2: no face"),
        (b"v 0 0 0\nf 1//1 1//1 1//1", ":2: normal number 1 in a face, but there are 0"),
        (b"v 0 0 0\nvn 0 0 1\nf 1//2 1//1 1//1", ":3: normal number 2 in a face, but there is 1"),
        (b"v 0 0 0\nf 1 one 1", ":2: no face in `f 1 one 1`"),
        (b"v 0 0 0\nf", ":2: no face"),
        (b"v 0 0 0\nf 1/1/1/1 1 1", ":2: no face"),
        (b"", ": no faces: the file is empty"),
        (b"hello\nworld", ": no faces: and no vertices"),
        (b"\x00\x01\xff\xfe\x00binary\n\x89PNG", ": no faces"),
        (b"v 0 0 0\nv 1 0 0\nl 1 2", ": no faces: 2 vertices, 1 point or line"),
    ];
    for (text, fragment) in cases {
        let case = String::from_utf8_lossy(text);
        let (message, kind) = failure(obj(text), &case);
        let expected = if fragment.starts_with(':') { format!("m.obj{fragment}") } else { fragment.to_string() };
        assert!(message.contains(&expected), "{case}: {message}");
        assert_eq!(kind, ErrorKind::Scene, "{case}");
    }
    let (message, _) = failure(obj(&vec![b'v'; (1 << 24) + 2]), "a line of 16 MiB");
    assert!(message.contains(":1: a line of more than 16 MiB"), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let (message, kind) = failure(load_mesh(folder.path()), "a folder");
    assert!(kind == ErrorKind::File && message.contains("it is a folder"), "{message}");
    let (message, kind) = failure(load_mesh(&folder.path().join("no.obj")), "missing");
    assert!(kind == ErrorKind::File && message.contains("no.obj: cannot read"), "{message}");
}

#[test]
fn damaged_meshes_never_panic_and_what_is_accepted_is_sound() {
    let text =
        format!("{TRIANGLE}vn 0 0 1\nvn 0 1 0\nvt 0 0\ng a\nf 1//1 2//2 -1//-1\nf 1/1 2/1 3/1 4/1\nf -1 -2 -3\n");
    let mut accepted = 0;
    for seed in 0..2000 {
        if let Ok(mesh) = obj(&damaged(text.as_bytes(), seed)) {
            accepted += 1;
            let n = mesh.positions.len() as u32;
            assert!(mesh.triangles.iter().flatten().all(|&i| i < n), "seed {seed}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "seed {seed}");
            if let Some(normals) = &mesh.normals {
                assert_eq!(normals.triangles.len(), mesh.triangles.len(), "seed {seed}");
                let n = normals.vectors.len() as u32;
                assert!(normals.triangles.iter().flatten().flatten().all(|&i| i < n), "seed {seed}");
            }
            mesh.with_smooth_normals().recentred(DVec3::ZERO);
        }
    }
    assert!((200..1800).contains(&accepted), "{accepted} of 2000: the damage is too great or too small");
}
