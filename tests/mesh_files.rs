//! Mesh files of every format, good and bad: what is made of them and what is said about them. `obj_files.rs` has OBJ alone.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

#[path = "support/meshes.rs"]
mod meshes;
mod parts;
mod refusals;
mod rendering;

use marmor::geometry::{RawMesh, load_mesh, load_mesh_with_uv};
use marmor::scene::{Estimator, Scene, SceneFile};
use marmor::{Error, ErrorKind};
use meshes::{Shape, gzip};
use parts::{camera, mesh, sky, translucent};
use refusals::{damaged, failure};
use std::path::Path;

/// A folder with a file of this name, and its path.
fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn read(name: &str, bytes: &[u8]) -> Result<RawMesh, Error> {
    load_mesh_with_uv(&written(name, bytes).1)
}

/// The same in every format: with what PLY has, and bare triangles as STL has them.
fn in_all_formats() -> Vec<(&'static str, Vec<u8>, Shape)> {
    let shape = Shape::bulged(4);
    let bare = shape.bare();
    let mut all = vec![
        ("m.ply", shape.ply_ascii(), shape.clone()),
        ("little.ply", shape.ply_binary(false), shape.clone()),
        ("BIG.PLY", shape.ply_binary(true), shape.clone()),
        ("bare.ply", bare.ply_binary(false), bare.clone()),
        ("m.stl", bare.stl_ascii(), bare.clone()),
        ("binary.stl", bare.stl_binary(), bare.clone()),
        ("m.ply.gz", gzip(&shape.ply_binary(true)), shape.clone()),
        ("m.stl.GZ", gzip(&bare.stl_binary()), bare.clone()),
        ("m.obj.gz", gzip(&shape.obj()), shape.clone()),
    ];
    // Line ends of the other kinds, blank lines and blanks at ends.
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let returns = text(shape.ply_ascii()).replace('\n', "\r").into_bytes();
    all.push(("returns.ply", returns, shape.clone()));
    let both = text(bare.stl_ascii()).replace('\n', " \r\n\r\n").replace("vertex", "VERTEX").into_bytes();
    all.push(("both.stl", both, bare));
    all
}

/// Positions, triangles, normals and texture coordinates, to the bit.
fn bits(mesh: &RawMesh) -> String {
    let normals = mesh.normals.as_ref().map(|n| (&n.vectors, &n.triangles));
    format!("{:?}", (&mesh.positions, &mesh.triangles, normals, &mesh.uv))
}

#[test]
fn a_mesh_is_the_same_from_every_format() {
    for (name, bytes, shape) in in_all_formats() {
        let mesh = read(name, &bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        let obj = read("m.obj", &shape.obj()).unwrap();
        assert_eq!(bits(&mesh), bits(&obj), "{name}");
        assert_eq!(mesh.remarks, Vec::<String>::new(), "{name}");
        assert_eq!((mesh.triangles.len(), mesh.without_normals()), (192, 0), "{name}");
        assert_eq!(mesh.without_uv(), if shape.uv.is_empty() { 192 } else { 0 }, "{name}");
    }
    assert!(load_mesh(&written("m.ply", &Shape::bulged(2).ply_ascii()).1).unwrap().uv.is_none(), "nobody asked");
}

fn picture(name: &str, bytes: &[u8]) -> Vec<[u32; 3]> {
    let (folder, _) = written(name, bytes);
    let text = camera([0.0, 6.0, 30.0], [0.0; 3], 40.0, [8, 8])
        + &mesh("body", name, "wax")
        + &translucent("wax", parts::WAX)
        + &sky([1.0, 0.9, 0.8]);
    let scene = rendering::load_in(folder.path(), &text);
    assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
    let method = rendering::subsurface(&scene, rendering::options(Estimator::Cut, 128, 1));
    let image = rendering::film(&method, &scene, 1, 1, &mut []).image();
    assert!(rendering::average(&image) > 0.1);
    image.pixels.iter().map(|p| [p[0], p[1], p[2]].map(f32::to_bits)).collect()
}

#[test]
fn a_mesh_gives_one_picture_from_every_format() {
    let shape = Shape::bulged(4);
    let of_obj = [shape.clone(), shape.bare()].map(|shape| picture("m.obj", &shape.obj()));
    assert_ne!(of_obj[0], of_obj[1], "normals show");
    let shown = ["BIG.PLY", "m.stl", "m.ply.gz"];
    for (name, bytes, shape) in in_all_formats().into_iter().filter(|(name, ..)| shown.contains(name)) {
        assert!(picture(name, &bytes) == of_obj[usize::from(shape.normals.is_empty())], "{name}: another picture");
    }
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_index\nend_header\n";
const FOUR: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

/// The header of [`PLY`] with a change.
fn ply(from: &str, to: &str, rest: &str) -> Vec<u8> {
    assert!(PLY.contains(from), "{from}");
    (PLY.replacen(from, to, 1) + FOUR + rest).into_bytes()
}

/// [`PLY`] in bytes of the lower end first, its last property another.
fn binary_ply(property: &str, face: &[u8]) -> Vec<u8> {
    let header = PLY.replace("ascii", "binary_little_endian").replace("list uchar int vertex_index", property);
    let mut out = header.replace("double", "float").into_bytes();
    for p in FOUR.split_ascii_whitespace() {
        out.extend(p.parse::<f32>().unwrap().to_le_bytes());
    }
    out.extend(face);
    out
}

fn stl(facets: &str) -> Vec<u8> {
    format!("solid x\n{facets}endsolid\n").into_bytes()
}

fn facet(normal: &str, corners: [&str; 3]) -> String {
    let corners: String = corners.map(|c| format!("vertex {c}\n")).concat();
    format!("facet normal {normal}\nouter loop\n{corners}endloop\nendfacet\n")
}

#[test]
fn files_that_are_read() {
    let fan = vec![[0, 1, 2], [0, 2, 3]];
    let quad = [4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0];
    type Case = (&'static str, Vec<u8>, Vec<[u32; 3]>, &'static str);
    #[rustfmt::skip]
    let cases: Vec<Case> = vec![
        ("m.ply", ply("x", "x", "4 0 1 2 3\n"), fan.clone(), ""),
        ("m.ply", ply("ply\n", "ply\ncomment caf\u{e9}\nobj_info  2\n", "4 0 1 2 3"), fan.clone(), ""),
        ("m.ply", ply("face 1", "face 2", "2 0 1\n\n3 3 1 0\n\n"), vec![[0, 1, 2]], "1 face with fewer than three corners is left out"),
        ("m.ply", ply("face 1", "face 3", "0\n1 3\n3 3 1 0\n"), vec![[0, 1, 2]], "2 faces with fewer than three corners are left out"),
        ("m.ply", ply("face 1", "face 1", "3 3 1 0\n3 0 1 2\n"), vec![[0, 1, 2]], "what follows the last element"),
        ("m.ply", ply("property list", "property uchar red\nproperty list", "9 3 3 1 0\n"), vec![[0, 1, 2]], "red of each face is not read: colours come from the materials"),
        ("m.ply", ply("end_header", "element edge 1\nproperty int a\nend_header", "3 3 1 0\n7\n"), vec![[0, 1, 2]], "its 1 element of the kind \"edge\" are not read"),
        ("m.ply", binary_ply("list uchar int vertex_indices", &quad), fan.clone(), ""),
        ("m.ply", binary_ply("list char uint8 vertex_index", &[4, 0, 1, 2, 3]), fan.clone(), ""),
        ("m.ply", binary_ply("list int32 ushort vertex_index", &[3, 0, 0, 0, 3, 0, 1, 0, 0, 0]), vec![[0, 1, 2]], ""),
        ("m.ply", binary_ply("list uchar uchar vertex_index", &[3, 3, 1, 0, 77]), vec![[0, 1, 2]], "what follows the last element (from byte "),
        ("m.stl", stl(&(facet("0 0 1", ["0 0 0", "1 0 0", "1. .1e1 -0"]) + &facet("0 0 0", ["1 1 0", "0 1 0", "0 0 0"]))), vec![[0, 1, 2], [2, 3, 0]], ""),
        ("m.stl", stl(&facet("0 0 -1", ["0 0 0", "1 0 0", "1 1 0"])), vec![[0, 1, 2]], "1 triangle runs round against its own normal (the first in line 8)"),
        ("m.stl", b"solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet".to_vec(), vec![[0, 1, 2]], "it ends without `endsolid`"),
        ("m.stl", [stl(&facet("nan nan nan", ["0 0 0", "1 0 0", "1 1 0"])), stl(&facet("", ["1 1 0", "1 0 0", "1 1 1"]))].concat(), vec![[0, 1, 2], [2, 1, 3]], ""),
        ("m.stl", [Shape::bulged(1).bare().stl_binary(), b"more".to_vec()].concat(), vec![], "what follows the last triangle (from byte 684 on)"),
    ];
    for (name, bytes, triangles, remark) in cases {
        let case = String::from_utf8_lossy(&bytes);
        let mesh = read(name, &bytes).unwrap_or_else(|e| panic!("{case}: {e}"));
        assert!(triangles.is_empty() || mesh.triangles == triangles, "{case}: {:?}", mesh.triangles);
        let expected = usize::from(!remark.is_empty());
        assert!(
            mesh.remarks.len() == expected && mesh.remarks.iter().all(|r| r.contains(remark)),
            "{case}: {:?}",
            mesh.remarks
        );
    }
    // Digits beyond f32 survive in text, as in OBJ, whatever type the header says.
    let far = ply("x", "x", "3 1 2 3\n");
    let far = String::from_utf8(far).unwrap().replacen("1 0 0", "1 1000000.001 0", 1);
    assert_eq!(read("m.ply", far.as_bytes()).unwrap().positions[0].y, 1_000_000.001);
    // Texture coordinates of faces, corner by corner, as MeshLab writes them; of vertices alone if both are there.
    let of_faces =
        ply("vertex_index", "vertex_index\nproperty list uchar float texcoord", "3 0 1 2 6 0 0 0.5 0 0.5 1\n");
    let uv = read("m.ply", &of_faces).unwrap().uv.unwrap();
    assert_eq!(uv, [Some([[0.0, 0.0], [0.5, 0.0], [0.5, 1.0]])]);
    let too_few = ply("vertex_index", "vertex_index\nproperty list uchar float texcoord", "3 0 1 2 4 0 0 0.5 0\n");
    assert!(read("m.ply", &too_few).unwrap().uv.is_none());
}

#[test]
fn files_that_are_refused_by_place() {
    let long = |n: usize| vec![b'v'; n];
    let cut = |bytes: Vec<u8>, by: usize| bytes[..bytes.len() - by].to_vec();
    let shape = Shape::bulged(2);
    let bare = shape.bare();
    let mut infinite = bare.stl_binary();
    infinite[84 + 50 + 12..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let mut many = bare.stl_binary();
    many[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    #[rustfmt::skip]
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("m.ply", b"".to_vec(), ": no faces: the file is empty"),
        ("m.ply", b"plyx\n".to_vec(), ":1: no PLY file: it does not begin with `ply`"),
        ("m.ply", long(20_000_000), ":1: a line of more than 16 MiB"),
        ("m.ply", b"ply\nformat ascii 1.0\n".to_vec(), ":2: the header ends without `end_header`"),
        ("m.ply", ply("ascii 1.0", "ascii 2.0", ""), ":2: the format \"ascii\" \"2.0\" is not known"),
        ("m.ply", ply("format ascii 1.0\n", "", ""), ":8: the header has no `format`"),
        ("m.ply", ply("1.0\n", "1.0\nformat binary_big_endian 1.0\n", ""), ":3: a second `format`"),
        ("m.ply", ply("float y", "flot y", ""), ":5: no type \"flot\" (did you mean `float`?)"),
        ("m.ply", ply("float y", "float x", ""), ":5: a second property \"x\" of element \"vertex\""),
        ("m.ply", ply("element face", "element vertex", ""), ":7: a second element \"vertex\""),
        ("m.ply", ply("vertex 4", "vertex -4", ""), ":3: \"-4\" is no number of elements"),
        ("m.ply", ply("vertex 4", "vertex 99999999999999999999", ""), ":3: \"99999999999999999999\" is no number"),
        ("m.ply", ply("element vertex 4", "elements 4", ""), ":3: `elements 4` is no line of a PLY header"),
        ("m.ply", ply("element vertex 4\n", "", ""), ":3: a property before any element"),
        ("m.ply", ply("end_header", "element x 18446744073709551615\nend_header", ""), ":10: element \"x\" has no properties"),
        ("m.ply", ply("uchar int", "float int", ""), ":8: the length of a list must be a whole number"),
        ("m.ply", ply("float z", "list uchar float z", ""), ": element `vertex` has no x, y and z"),
        ("m.ply", ply("list uchar int", "int", "0\n"), ": element `face` has no list `vertex_indices`"),
        ("m.ply", ply("element vertex", "element point", ""), ": no element `vertex` in the header"),
        ("m.ply", b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nelement vertex 3\nproperty float x\nend_header\n".to_vec(), ": its faces come before its vertices"),
        ("m.ply", PLY.replace("element face 1", "element tristrips 1").into_bytes(), ": element \"tristrips\": strips of triangles are not read"),
        ("m.ply", ply("face 1", "face 0", ""), ": no faces: 4 vertices; a cloud of points"),
        ("m.ply", ply("face 1", "face 1", "2 0 1\n"), ": no faces: 4 vertices"),
        ("m.ply", ply("vertex 4", "vertex 18446744073709551615", ""), ": the file ends after 4 of 18446744073709551615 elements \"vertex\""),
        ("m.ply", ply("x", "x", ""), ": the file ends after 0 of 1 elements \"face\""),
        ("m.ply", ply("face 1", "face 9", "3 0 1 2\n"), ": the file ends after 1 of 9 elements \"face\""),
        ("m.ply", ply("x", "x", "3 0 1 4\n"), ":14: face 0: vertex number 4, but there are 4, counted from 0"),
        ("m.ply", ply("x", "x", "3 0 1 -1\n"), ":14: face 0: vertex number -1"),
        ("m.ply", ply("x", "x", "3 0 1 1.5\n"), ":14: face 0: vertex number 1.5"),
        ("m.ply", ply("x", "x", "3 0 1 nan\n"), ":14: face 0: vertex number NaN"),
        ("m.ply", ply("x", "x", "-3 0 1 2\n"), ":14: face 0: a list of -3: its length is damaged"),
        ("m.ply", ply("x", "x", "3 0 1\n"), ":14: face 0: fewer numbers than the header says"),
        ("m.ply", ply("x", "x", "3 0 1 2 3\n"), ":14: face 0: more numbers than the header says"),
        ("m.ply", ply("x", "x", "3 0 one 2\n"), ":14: face 0: `one` is no number"),
        ("m.ply", [PLY, "0 0 0\n0 inf 0\n"].concat().into_bytes(), ":11: vertex 1: a position that is not finite"),
        ("m.ply", ply("float z\n", "float z\nproperty float nx\n", ""), ":11: vertex 0: fewer numbers"),
        ("m.ply", binary_ply("list uchar uchar vertex_index", &[3, 0, 1]), ": the file ends after 0 of 1 elements \"face\" (byte "),
        ("m.ply", binary_ply("list uchar uchar vertex_index", &[3, 0, 1, 200]), ": face 0 (before byte "),
        ("m.ply", binary_ply("list uchar char vertex_index", &[3, 0, 1, 255]), "vertex number -1, but there are 4"),
        ("m.ply", binary_ply("list char char vertex_index", &[255, 0, 1, 2]), "a list of -1: its length is damaged"),
        ("m.ply", binary_ply("list uint char vertex_index", &[255, 255, 255, 255, 1, 2]), "a list of 4294967295: its length is damaged"),
        ("m.ply", binary_ply("list uint int vertex_index", &[255, 255, 255, 0, 1, 2]), ": the file ends after 0 of 1 elements \"face\""),
        ("m.ply", cut(shape.ply_binary(true), 3), ": the file ends after 23 of 24 elements \"face\""),
        ("m.stl", b"".to_vec(), ": no faces: the file is empty"),
        ("m.stl", long(83), ": the file is shorter than the 84 bytes"),
        ("m.stl", cut(bare.stl_binary(), 1), ": the file ends after 47 of 48 triangles (byte 2434)"),
        ("m.stl", many, ": the file ends after 48 of 4294967295 triangles"),
        ("m.stl", infinite, ": triangle 1 (before byte 184) has a corner that is not finite"),
        ("m.stl", vec![0; 84], ": no faces: there is no triangle"),
        ("m.stl", stl(""), ": no faces: there is no triangle"),
        ("m.stl", stl("facet normal 0 0 1\nouter loop\nvertex 0 0 x\n"), ":4: no vertex in `vertex 0 0 x`; expected `vertex x y z`"),
        ("m.stl", stl("facet normal 0 0 1\nouter loop\nvertex 0 0 0 1\n"), ":4: no vertex in"),
        ("m.stl", stl("facet normal 0 0 1\nvertex 0 nan 0\n"), ":3: a vertex that is not finite in `vertex 0 nan 0`"),
        ("m.stl", stl("facet normal 0 0 1\nvertex 0 0 0\nvertex 0 0 0\nendfacet\n"), ":5: a facet of 2 corners"),
        ("m.stl", stl(&facet("0 0 1", ["0 0 0", "1 0 0", "1 1 0\nvertex 0 1 0"])), ":7: a facet of more than three corners"),
        ("m.stl", stl("vertex 0 0 0\n"), ":2: `vertex 0 0 0` is out of place in an STL file"),
        ("m.stl", b"solid\nfacet normal 0 0 1\nvertex 1 1 1\n".to_vec(), ":3: the file ends within a facet"),
        ("m.off", b"OFF".to_vec(), ": not a kind of mesh that is read; there are .obj, .ply, .stl"),
        ("m", b"v 0 0 0".to_vec(), ": not a kind of mesh that is read"),
        ("m.zip.gz", gzip(b"v 0 0 0"), ": not a kind of mesh that is read"),
    ];
    let mut wrong = Vec::new();
    for (name, bytes, fragment) in cases {
        let case = String::from_utf8_lossy(&bytes[..bytes.len().min(1000)]).into_owned();
        let (message, kind) = failure(read(name, &bytes), &case);
        let expected = if fragment.starts_with(':') { format!("{name}{fragment}") } else { fragment.to_string() };
        if !message.contains(&expected) || kind != ErrorKind::Scene {
            wrong.push(format!("{case:?}: {message}, in place of {fragment}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let (message, kind) = failure(load_mesh(Path::new("no.ply")), "missing");
    assert!(kind == ErrorKind::File && message.contains("no.ply: cannot read"), "{message}");
    let packed = gzip(&shape.ply_ascii());
    for bytes in [cut(packed.clone(), 20), cut(packed, 4), shape.ply_ascii()] {
        let (message, kind) = failure(read("m.ply.gz", &bytes), "damaged gzip");
        assert!(
            kind == ErrorKind::File && message.contains("m.ply.gz: cannot read: its gzip data are damaged"),
            "{message}"
        );
    }
}

/// What is accepted of damaged files is sound, and most damage is told.
#[test]
fn damaged_files_never_panic() {
    let shape = Shape::bulged(1);
    let bare = shape.bare();
    let files = [
        ("m.ply", shape.ply_ascii()),
        ("m.ply", shape.ply_binary(false)),
        ("m.ply", shape.ply_binary(true)),
        ("m.stl", bare.stl_ascii()),
        ("m.stl", bare.stl_binary()),
        ("m.ply.gz", gzip(&shape.ply_binary(false))),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (number, (name, bytes)) in files.iter().enumerate() {
        let path = folder.path().join(name);
        let mut accepted = 0;
        for seed in 0..2000 {
            std::fs::write(&path, damaged(bytes, seed)).unwrap();
            let Ok(mesh) = load_mesh_with_uv(&path) else { continue };
            accepted += 1;
            sound(&mesh, &format!("{name} {number} seed {seed}"));
        }
        assert!((1..1900).contains(&accepted), "{name} {number}: {accepted} of 2000 accepted");
    }
}

fn sound(mesh: &RawMesh, what: &str) {
    let n = mesh.positions.len() as u32;
    assert!(!mesh.triangles.is_empty() && mesh.triangles.iter().flatten().all(|&i| i < n), "{what}");
    assert!(mesh.positions.iter().all(|p| p.is_finite()), "{what}");
    assert!(mesh.uv.as_ref().is_none_or(|uv| uv.len() == mesh.triangles.len()), "{what}");
    if let Some(normals) = &mesh.normals {
        assert_eq!(normals.triangles.len(), mesh.triangles.len(), "{what}");
        let n = normals.vectors.len() as u32;
        assert!(normals.triangles.iter().flatten().flatten().all(|&i| i < n), "{what}");
    }
    assert_eq!(mesh.clone().with_smooth_normals().triangles, mesh.triangles, "{what}");
}

/// Two boxes of two materials each, as a modelling program exports them; a corner of the second is one of the first.
const ROOM: &str = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0.1\no Lamp Shade\ng Cloth wide\nusemtl Paper.001\nf 1 2 3\nusemtl Wire\nf 1 3 4\n\
                    o Table\nv 3 0 0\nv 0 3 0\nusemtl Wood\ng Top\nf 1 5 6\nf 1 6 4\nusemtl Wire\ng Legs\nf 4 5 6\nf 2 1 5\n";

/// A scene of the mesh file `name` in an object of these `keys`.
fn scene(name: &str, bytes: &[u8], keys: &str) -> Result<Scene, Error> {
    let (folder, _) = written(name, bytes);
    let text = camera([0.0, 0.0, 30.0], [0.0; 3], 40.0, [8, 8])
        + &format!("[[object]]\nname = \"set\"\nmesh = \"{name}\"\n{keys}\n")
        + &["jade", "stone", "wood"].map(|name| parts::diffuse(name, 0.5)).concat()
        + &sky(1.0);
    Scene::load(&SceneFile::parse(&text, &folder.path().join("scene.toml"))?)
}

/// Triangles as the places of their corners.
type Corners = Vec<[[f64; 3]; 3]>;

/// For each object its name, its material and its triangles.
fn objects(scene: &Scene) -> Vec<(String, String, Corners)> {
    let of = |o: &marmor::scene::Object| {
        let corner = |i: u32| (o.mesh.positions[i as usize] + scene.centre).to_array();
        let triangles = o.mesh.triangles.iter().map(|t| t.map(corner)).collect();
        (o.name.clone(), scene.materials[o.material].name.clone(), triangles)
    };
    scene.objects.iter().map(of).collect()
}

fn triangles(of: &[[usize; 3]]) -> Corners {
    const AT: [[f64; 3]; 6] =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.1], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
    of.iter().map(|t| t.map(|i| AT[i - 1])).collect()
}

#[test]
fn an_object_may_be_one_part_of_a_file() {
    #[rustfmt::skip]
    let cases: [(&str, &[[usize; 3]]); 7] = [
        ("Lamp Shade", &[[1, 2, 3], [1, 3, 4]]),
        ("Table", &[[1, 5, 6], [1, 6, 4], [4, 5, 6], [2, 1, 5]]),
        ("Wire", &[[1, 3, 4], [4, 5, 6], [2, 1, 5]]),
        ("Paper.001", &[[1, 2, 3]]),
        ("Cloth", &[[1, 2, 3], [1, 3, 4]]),
        ("wide", &[[1, 2, 3], [1, 3, 4]]),
        ("Legs", &[[4, 5, 6], [2, 1, 5]]),
    ];
    for (part, expected) in cases {
        let scene = scene("m.obj", ROOM.as_bytes(), &format!("part = \"{part}\"\nmaterial = \"wood\"")).unwrap();
        // The world is about the middle of its box, in which positions are: those of the parts differ by rounding there alone.
        let found = objects(&scene).remove(0);
        assert_eq!((found.0.as_str(), found.1.as_str()), ("set", "wood"), "{part}");
        assert_eq!(found.2, triangles(expected), "{part}");
        assert!(!scene.warnings.iter().any(|w| w.contains("one object")), "{:?}", scene.warnings);
    }
}

#[test]
fn parts_of_a_file_may_have_materials_of_their_own() {
    let keys = "materials = { Wire = \"stone\", \"Paper.001\" = \"jade\", Wood = \"wood\" }";
    let all = scene("m.obj", ROOM.as_bytes(), keys).unwrap();
    let expected: [(&str, &str, &[[usize; 3]]); 3] = [
        ("set/Wire", "stone", &[[1, 3, 4], [4, 5, 6], [2, 1, 5]]),
        ("set/Paper.001", "jade", &[[1, 2, 3]]),
        ("set/Wood", "wood", &[[1, 5, 6], [1, 6, 4]]),
    ];
    let expected = expected.map(|(name, material, of)| (name.to_string(), material.to_string(), triangles(of)));
    assert_eq!(objects(&all), expected);
    // Corners that parts share are at one place, to the bit.
    let one = |i: usize| all.objects[i].mesh.positions.iter().find(|p| (**p + all.centre).length() < 1e-9).unwrap();
    assert_eq!([one(0), one(1)], [one(2); 2]);
    let rest = scene("m.obj", ROOM.as_bytes(), "materials = { Wood = \"wood\", \"*\" = \"stone\" }").unwrap();
    let names: Vec<_> = objects(&rest).into_iter().map(|(name, material, of)| (name, material, of.len())).collect();
    assert_eq!(names, [("set/Wood".to_string(), "wood".to_string(), 2), ("set/*".to_string(), "stone".to_string(), 4)]);
    // Without materials in the file, its objects and groups; faces before all names are of the rest.
    let bare = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no A\nf 1 3 2\no B\ng B\nf 2 3 1\n";
    let of_objects = scene("m.obj", bare.as_bytes(), "materials = { B = \"wood\", \"*\" = \"jade\" }").unwrap();
    let counts: Vec<_> = of_objects.objects.iter().map(|o| o.mesh.triangles.len()).collect();
    assert_eq!(counts, [1, 2]);
    assert!(all.warnings.iter().chain(&rest.warnings).all(|w| !w.contains("one object")));
}

/// A part is the same as a file of it alone: normals and texture coordinates too.
#[test]
fn a_part_is_as_a_file_of_its_own() {
    let shape = Shape::bulged(3);
    let cut = shape.faces.len() / 2;
    let half = |faces: &[Vec<u32>]| Shape { faces: faces.to_vec(), ..shape.clone() };
    let text = String::from_utf8(shape.obj()).unwrap();
    let at = text.match_indices("\nf ").nth(cut).unwrap().0;
    let both = text[..at].replacen("\nf ", "\nusemtl a\nf ", 1) + "\nusemtl b" + &text[at..];
    let mesh = read("m.obj", both.as_bytes()).unwrap();
    for (name, faces) in [("a", &shape.faces[..cut]), ("b", &shape.faces[cut..])] {
        let part = mesh.portion(|label| label.material.as_deref() == Some(name));
        assert_eq!(bits(&part), bits(&read("m.obj", &half(faces).obj()).unwrap()), "{name}");
    }
}

#[test]
fn several_parts_as_one_object_are_told_of_once() {
    let said = |text: &str| {
        let all = scene("m.obj", text.as_bytes(), "material = \"wood\"").unwrap().warnings;
        all.into_iter().filter(|w| w.contains("are one object")).collect::<Vec<_>>()
    };
    let room = said(ROOM);
    let words = "m.obj: its 3 materials (\"Paper.001\", \"Wire\", \"Wood\") are one object of the material \"wood\"; to take them apart, give \
                 `materials = { \"Paper.001\" = \"wood\", \"*\" = \"wood\" }`, or `part = \"Paper.001\"`";
    assert!(room.len() == 1 && room[0].contains(words), "{room:?}");
    let objects = said(&ROOM.replace("usemtl Wire\n", "").replace("usemtl Wood\n", ""));
    assert!(objects.len() == 1 && objects[0].contains("its 2 objects (\"Lamp Shade\", \"Table\") are"), "{objects:?}");
    assert_eq!(
        said("o a\ng b\nusemtl c\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\ng b\no d\nusemtl e\n"),
        Vec::<String>::new()
    );
}

#[test]
fn parts_that_are_not_there_are_refused_by_name() {
    let twice = ROOM.replace("g Legs", "g Wood");
    let room = ROOM.as_bytes();
    #[rustfmt::skip]
    let cases: &[(&str, &[u8], &str, &str)] = &[
        ("m.obj", room, "part = \"Tabel\"\nmaterial = \"wood\"", "m.obj: no part \"Tabel\" (did you mean `Table`?); there are the materials \"Paper.001\", \"Wire\", \"Wood\", the objects \"Lamp Shade\", \"Table\", the groups \"Cloth\", \"wide\", \"Top\", \"Legs\""),
        ("m.obj", twice.as_bytes(), "part = \"Wood\"\nmaterial = \"wood\"", "\"Wood\" is the name of a material and of a group of other faces"),
        ("m.obj", room, "materials = { Table = \"wood\", \"*\" = \"jade\" }", "no part \"Table\"; there are the materials \"Paper.001\", \"Wire\", \"Wood\""),
        ("m.obj", room, "materials = { Wood = \"wood\" }", "`materials` has none for \"Paper.001\", \"Wire\"; name them, or give \"*\" one"),
        ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl a\nf 1 3 2\n", "materials = { a = \"wood\" }", "`materials` has none for 1 triangle without a name"),
        ("m.obj", room, "materials = { Wood = \"wood\", Wire = \"wood\", \"Paper.001\" = \"wood\", \"*\" = \"jade\" }", "leaves none for \"*\"; remove it"),
        ("m.obj", b"o a\ng b\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "materials = { a = \"wood\", b = \"wood\" }", "names some faces twice"),
        ("m.obj", room, "materials = {}", "`object.0.materials` names no part"),
        ("m.obj", room, "materials = { Wood = \"would\", \"*\" = \"jade\" }", "`object.0.materials` \"would\" does not exist (did you mean `wood`?)"),
        ("m.obj", room, "materials = { Wood = 3 }", "`object.0.materials.Wood` is 3; expected the name of a [material.NAME]"),
        ("m.obj", room, "material = \"jade\"\nmaterials = { Wood = \"wood\" }", "`object.0.material` stands beside `materials`"),
        ("m.obj", room, "part = \"Wood\"\nmaterials = { Wood = \"wood\" }", "`object.0.part` stands beside `materials`"),
        ("m.obj", room, "part = \"Wood\"", "`object.0.material` is missing"),
        ("m.stl", &Shape::bulged(1).bare().stl_binary(), "part = \"Wood\"\nmaterial = \"wood\"", "m.stl: no part \"Wood\": the file has no parts; leave out the key"),
        ("m.stl", &Shape::bulged(1).bare().stl_binary(), "materials = { Wood = \"wood\" }", "m.stl: no part \"Wood\": the file has no parts"),
    ];
    for (name, bytes, keys, words) in cases {
        let (message, kind) = failure(scene(name, bytes, keys), keys);
        assert!(message.contains(words) && kind == ErrorKind::Scene, "{keys}: {message}");
    }
}
