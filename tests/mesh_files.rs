//! Mesh files of every format, good and bad: what is made of them and what is said about them. `obj_files.rs` has OBJ alone.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

#[path = "support/meshes.rs"]
mod meshes;
mod parts;
mod refusals;
mod rendering;

use marmor::ErrorKind;
use marmor::geometry::{RawMesh, load_mesh, load_mesh_with_uv};
use marmor::scene::{Estimator, SceneFile};
use meshes::{Shape, base64, bits, glb, gzip, read, written};
use parts::{camera, mesh, sky, translucent};
use refusals::{damaged, failure};
use std::path::Path;

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
    // glTF has triangles alone; a fan of a quadrilateral is what others make of it.
    all.push(("m.glb", shape.glb(), shape.clone()));
    all.push(("packed.glb.gz", gzip(&bare.glb()), bare.clone()));
    let data = base64(&shape.gltf("").1);
    let text = shape.gltf(&format!("\"uri\":\"data:application/octet-stream;base64,{data}\",")).0;
    all.push(("data.gltf", text.into_bytes(), shape.clone()));
    // Line ends of the other kinds, blank lines and blanks at ends.
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let returns = text(shape.ply_ascii()).replace('\n', "\r").into_bytes();
    all.push(("returns.ply", returns, shape.clone()));
    let both = text(bare.stl_ascii()).replace('\n', " \r\n\r\n").replace("vertex", "VERTEX").into_bytes();
    all.push(("both.stl", both, bare));
    all
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
    let shown = ["BIG.PLY", "m.stl", "m.ply.gz", "m.glb"];
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

/// `shape` as glTF without its buffer, with a change.
fn gltf(shape: &Shape, from: &str, to: &str) -> Vec<u8> {
    let json = shape.gltf("").0;
    assert!(json.contains(from), "{from} in {json}");
    json.replacen(from, to, 1).into_bytes()
}

/// The same in one piece.
fn packed(shape: &Shape, from: &str, to: &str) -> Vec<u8> {
    glb(&String::from_utf8(gltf(shape, from, to)).unwrap(), &shape.gltf("").1)
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
        ("m.glb", b"".to_vec(), ": no faces: the file is empty"),
        ("m.glb", b"{".to_vec(), ": no glTF: EOF while parsing an object at line 1 column 1"),
        ("m.glb", cut(shape.glb(), 1), ": the file ends within a chunk"),
        ("m.glb", b"glTF\x01\0\0\0".to_vec(), ": it is of version 1 of GLB"),
        ("m.glb", b"glTF\x02\0\0\0\x0c\0\0\0".to_vec(), ": it has no JSON"),
        ("m.gltf", gltf(&bare, "2.0", "1.0"), ": it is glTF \"1.0\"; version 2 is read"),
        ("m.gltf", gltf(&bare, "\"scene\":0", "\"extensionsRequired\":[\"KHR_materials_unlit\",\"KHR_draco_mesh_compression\"]"), ": it requires the extension \"KHR_draco_mesh_compression\""),
        ("m.gltf", gltf(&bare, "\"scene\":0", "\"extensionsRequired\":[\"EXT_meshopt_compression\"]"), ": it requires the extension \"EXT_meshopt_compression\""),
        ("m.gltf", gltf(&bare, "{\"mesh\":0}", "{\"mesh\":9}"), ": node 0 has mesh 9: there are 1"),
        ("m.gltf", gltf(&bare, "{\"mesh\":0}", "{\"mesh\":0,\"children\":[0]},{\"children\":[0]}"), ": node 0 is a child twice"),
        ("m.gltf", gltf(&bare, "{\"mesh\":0}", "{\"mesh\":0,\"children\":[0]}"), ": node 0 is in the scene twice"),
        ("m.gltf", gltf(&bare, "{\"mesh\":0}", "{\"children\":[7]}"), ": no node 7: there are 1"),
        ("m.gltf", gltf(&bare, "{\"nodes\":[0]}", "{\"nodes\":[0,0]}"), ": node 0 is in the scene twice"),
        ("m.gltf", gltf(&bare, "{\"nodes\":[0]}", "{\"nodes\":[3]}"), ": no node 3: there are 1"),
        ("m.gltf", gltf(&bare, "{\"nodes\":[0]}", "{}"), ": no faces: no mesh with triangles in 1 node"),
        ("m.gltf", gltf(&bare, "{\"mesh\":0}", "{\"mesh\":0,\"matrix\":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}"), ": node 0 has a matrix that is not affine"),
        ("m.gltf", gltf(&bare, "\"scene\":0", "\"scene\":0"), ": buffer 0 is not in the file, and has no uri"),
        ("m.glb", packed(&bare, "{\"mesh\":0}", "{\"mesh\":0,\"scale\":[1e300,1e300,1e300],\"children\":[1]},{\"mesh\":0,\"scale\":[1e300,1,1]}"), ": mesh 0, primitive 0: vertex 0 is not finite"),
        ("m.gltf", gltf(&bare, "{\"mesh\":0}", "{\"mesh\":-1}"), ": no glTF: invalid value: integer `-1`, expected usize at line 1 column"),
        ("m.glb", packed(&bare, "\"indices\":1", "\"indices\":5"), ": no accessor 5: there are 2"),
        ("m.glb", packed(&bare, "\"indices\":1", "\"indices\":0"), ": accessor 0: it is VEC3 of component type 5126; expected SCALAR of a known type of indices"),
        ("m.gltf", gltf(&bare, "\"VEC3\"", "\"VEC4\""), ": accessor 0: it is VEC4 of component type 5126; expected VEC3"),
        ("m.gltf", gltf(&bare, "\"VEC3\"", "\"VEC3\",\"sparse\":{}"), ": accessor 0: it is sparse, which is not read"),
        ("m.gltf", gltf(&bare, "\"bufferView\":0,", ""), ": accessor 0: it has no buffer view"),
        ("m.gltf", gltf(&bare, "\"bufferView\":0,", "\"bufferView\":8,"), ": accessor 0: no buffer view 8"),
        ("m.gltf", gltf(&bare, "\"count\":26", "\"count\":18446744073709551615"), ": accessor 0: it ends 18446744073709551615 bytes into buffer view 0, which has 312"),
        ("m.gltf", gltf(&bare, "\"byteOffset\":0", "\"byteOffset\":0,\"byteStride\":4"), ": accessor 0: buffer view 0 has a stride of 4 bytes"),
        ("m.gltf", gltf(&bare, "\"buffers\":[{", "\"buffers\":[{\"uri\":\"data:;base64,AA*A\","), ": the data of buffer 0 are no base64"),
        ("m.gltf", gltf(&bare, "\"buffers\":[{", "\"buffers\":[{\"uri\":\"data:;base64,AAAA\","), ": accessor 0: buffer 0 ends before it, after 3 bytes"),
        ("m.gltf", gltf(&bare, "\"buffers\":[{", "\"buffers\":[{\"uri\":\"https://x/y.bin\","), ": buffer 0 is elsewhere (https://x/y.bin)"),
        ("m.glb", packed(&bare, "\"indices\"", "\"mode\":9,\"indices\""), ": mesh 0, primitive 0: mode 9 is not known"),
        ("m.glb", packed(&bare, "\"count\":144", "\"count\":143"), ": mesh 0, primitive 0: 143 corners of triangles, which is no multiple of 3"),
        ("m.glb", packed(&bare, "\"count\":26", "\"count\":20"), ": mesh 0, primitive 0: vertex number 2"),
        ("m.glb", glb(&bare.gltf("").0, &[0xff; 4000]), ": mesh 0, primitive 0: vertex 0 is not finite"),
        ("m.off", b"OFF".to_vec(), ": not a kind of mesh that is read; there are .obj, .ply, .stl, .gltf, .glb, each also with .gz"),
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

#[test]
fn buffers_of_gltf_may_be_files_beside_it() {
    let shape = Shape::bulged(2);
    let (json, bytes) = shape.gltf("\"uri\":\"my%20buffer.bin\",");
    let (folder, path) = written("m.gltf", json.as_bytes());
    let (message, kind) = failure(load_mesh(&path), "no buffer");
    assert!(
        kind == ErrorKind::File && message.contains("m.gltf: ") && message.contains("my buffer.bin: cannot read"),
        "{message}"
    );
    std::fs::write(folder.path().join("my buffer.bin"), &bytes[1..]).unwrap();
    let (message, kind) = failure(load_mesh(&path), "short buffer");
    let length = bytes.len();
    assert!(
        kind == ErrorKind::Scene && message.contains(&format!("has {} bytes of {length}", length - 1)),
        "{message}"
    );
    std::fs::write(folder.path().join("my buffer.bin"), &bytes).unwrap();
    assert_eq!(bits(&load_mesh_with_uv(&path).unwrap()), bits(&read("m.glb", &shape.glb()).unwrap()));
    // What a scene reads must not be written over.
    let text = "[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 30\nresolution = [2, 2]\n[[object]]\nmesh = \"m.gltf\"\nmaterial = \"m\"\n\
                [material.m]\ntype = \"diffuse\"\nalbedo = 1\n";
    let file = SceneFile::parse(text, &folder.path().join("scene.toml")).unwrap();
    assert!(file.inputs().iter().any(|(_, input)| *input == folder.path().join("my buffer.bin")));
    // Whole numbers that stand for shares of 1, as quantized files have them, four bytes apart.
    let bytes: Vec<u8> = [[0, 0, 0, 9], [127, 0, 0, 9], [0, 0x81, 0x80, 9]].concat();
    let json = "{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":[\"KHR_mesh_quantization\"],\"nodes\":[{\"mesh\":0}],\
                \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\
                \"accessors\":[{\"bufferView\":0,\"componentType\":5120,\"normalized\":true,\"count\":3,\"type\":\"VEC3\"}],\
                \"bufferViews\":[{\"buffer\":0,\"byteLength\":12,\"byteStride\":4}],\"buffers\":[{\"byteLength\":12}]}";
    let mesh = read("m.glb", &glb(json, &bytes)).unwrap();
    assert_eq!(
        mesh.positions.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, -1.0]]
    );
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
        (
            "m.obj",
            [b"o first part\nusemtl a\n", &shape.obj()[..], b"g b c\nf 1/1 2 3//1\nusemtl d\nf -1 -2 -3\n"].concat(),
        ),
        ("m.glb", shape.glb()),
        ("m.gltf", shape.gltf(&format!("\"uri\":\"data:;base64,{}\",", base64(&shape.gltf("").1))).0.into_bytes()),
    ];
    // In memory where there is such a place: thousands of files are written.
    let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap();
    for (number, (name, bytes)) in files.iter().enumerate() {
        let path = folder.path().join(name);
        let mut accepted = 0;
        for seed in 0..2000 {
            std::fs::write(&path, damaged(bytes, seed)).unwrap();
            let Ok(mesh) = load_mesh_with_uv(&path) else { continue };
            accepted += 1;
            let what = format!("{name} {number} seed {seed}");
            sound(&mesh, &what);
            for label in mesh.parts.labels() {
                sound(&mesh.portion(|l| l == label), &what);
            }
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

/// A few kilobytes that unpack to more than there is end in the error that says so, and not by the system's hand.
#[cfg(all(feature = "cli", target_os = "linux"))]
#[test]
fn what_gzip_blows_up_is_refused_before_memory_ends() {
    let many = PLY
        .replace("vertex 4", "vertex 4000000000")
        .replace("ascii", "binary_little_endian")
        .replace("double", "float");
    let mut triangles = vec![0; 84];
    triangles[80..].fill(0x7f);
    let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    glb.extend([0, 0, 0, 8]);
    glb.extend(b"JSON");
    type Piece = fn(usize) -> Vec<u8>;
    #[rustfmt::skip]
    let cases: [(&str, Vec<u8>, Piece, usize); 6] = [
        ("m.obj.gz", Vec::new(), |_| b"v 0 0 0\n".repeat(512), 1 << 13),
        ("names.obj.gz", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec(), |i| format!("g {i:016000}\nf 1 2 3\n").into_bytes(), 12_000),
        ("m.ply.gz", many.into_bytes(), |_| vec![0; 1 << 12], 1 << 14),
        ("m.stl.gz", triangles, |_| vec![0; 1 << 16], 1 << 11),
        ("m.gltf.gz", b"{\"asset\":{\"version\":\"2.0\"},\"nodes\":[".to_vec(), |_| b"{},".repeat(1 << 14), 1 << 8),
        ("m.glb.gz", glb, |_| vec![b' '; 1 << 16], 1 << 12),
    ];
    for (name, head, piece, times) in cases {
        let (folder, path) = written(name, &[]);
        let mut out = flate2::write::GzEncoder::new(std::fs::File::create(&path).unwrap(), flate2::Compression::fast());
        std::io::Write::write_all(&mut out, &head).unwrap();
        (0..times).for_each(|i| std::io::Write::write_all(&mut out, &piece(i)).unwrap());
        out.finish().unwrap();
        let scene =
            camera([0.0, 6.0, 30.0], [0.0; 3], 40.0, [8, 8]) + &mesh("body", name, "wax") + &parts::diffuse("wax", 0.5);
        std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let line = format!("ulimit -v 500000; exec {} check scene.toml", env!("CARGO_BIN_EXE_marmor"));
        let output = std::process::Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(6), "{name}: {said}");
        assert!(said.contains(name) && said.contains("GB") && said.contains("use a coarser mesh"), "{name}: {said}");
    }
}
