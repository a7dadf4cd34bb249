//! Parts of mesh files: objects of one part each, materials part by part, and what is said of files that have several.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

#[path = "support/meshes.rs"]
mod meshes;
mod parts;
mod refusals;

use marmor::scene::{Scene, SceneFile};
use marmor::{Error, ErrorKind};
use meshes::{Shape, bits, glb, read, written};
use parts::{camera, sky};
use refusals::failure;

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

/// What is wrong with later objects is told at their own place, though parts are more objects than the file has entries.
#[test]
fn objects_after_parts_keep_their_place() {
    let later = "[[object]]\nname = \"b\"\nmesh = \"m.obj\"\nmaterial = \"wood\"\n\
                 [[object]]\nmesh = \"m.obj\"\nmaterial = \"wax\"\nbody = \"b\"\n\
                 [[object]]\nmesh = \"m.obj\"\nmaterial = \"wax\"\nbody = \"b\"\n[material.wax]\ntype = \"dielectric\"\neta = 1.5\n";
    let keys = "materials = { Wire = \"stone\", \"Paper.001\" = \"jade\", Wood = \"wood\" }\n";
    let (message, _) = failure(scene("m.obj", ROOM.as_bytes(), &format!("{keys}{later}")), later);
    assert!(
        message.contains(":22: `object.3.body` \"b\" is the name of an object that is not part of it"),
        "{message}"
    );
    let taken = "[[object]]\nname = \"set/Wood\"\nmesh = \"m.obj\"\nmaterial = \"wood\"\n";
    let (message, _) = failure(scene("m.obj", ROOM.as_bytes(), &format!("{keys}{taken}")), taken);
    assert!(message.contains("`object.1.name` \"set/Wood\" is taken"), "{message}");
    let ball = "material = \"wood\"\n[[object]]\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nmaterials = { a = \"wood\" }\n";
    let (message, _) = failure(scene("m.obj", ROOM.as_bytes(), ball), ball);
    assert!(message.contains("`object.1.materials` is of mesh files, and a `shape` has no parts"), "{message}");
}

/// Two nodes of one mesh of a triangle, the first below another, the second mirrored; besides a strip, a fan and lines.
#[test]
fn nodes_of_gltf_place_their_meshes() {
    let shape = Shape {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.6, 0.8]; 4],
        uv: vec![],
        faces: vec![vec![0, 1, 2]],
    };
    let nodes = "{\"name\":\"top\",\"translation\":[0,0,5],\"children\":[1]},\
                 {\"name\":\"Left\",\"mesh\":0,\"rotation\":[0,0,0.7071067811865476,0.7071067811865476],\"scale\":[2,1,1]},\
                 {\"name\":\"Right\",\"mesh\":0,\"matrix\":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 10,0,0,1]}";
    let one = "\"attributes\":{\"POSITION\":0,\"NORMAL\":1}";
    let more = format!(
        "{one},\"indices\":2,\"material\":1}},{{{one},\"mode\":5,\"material\":0}},{{{one},\"mode\":6,\"material\":0}},{{{one},\"mode\":1}}],\
         \"name\":\"Part\"}}],\"materials\":[{{\"name\":\"Wax\"}},{{}}],\"cameras\":[{{}}],\
         \"extensions\":{{\"KHR_lights_punctual\":{{\"lights\":[{{}},{{}}]}}}},\"skins\":[{{}}],\"x\":[{{\"y\":[{{"
    );
    let json = shape.gltf("").0.replace("{\"mesh\":0}", nodes).replace("{\"nodes\":[0]}", "{\"nodes\":[2,0]}");
    let json = json.replace(&format!("{one},\"indices\":2"), &more);
    let mesh = read("m.glb", &glb(&json, &shape.gltf("").1)).unwrap();
    let corners =
        |t: usize| mesh.triangles[t].map(|i| (mesh.positions[i as usize] * 16.0).round().to_array().map(|x| x / 16.0));
    // Mirrored: the outside stays outside.
    assert_eq!(corners(0), [[10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [9.0, 0.0, 0.0]]);
    assert_eq!(corners(5), [[0.0, 0.0, 5.0], [0.0, 2.0, 5.0], [-1.0, 0.0, 5.0]]);
    // The strip, then the fan.
    assert_eq!(corners(7), [[-1.0, 0.0, 5.0], [0.0, 2.0, 5.0], [-1.0, 2.0, 5.0]]);
    assert_eq!(corners(9), [[0.0, 0.0, 5.0], [-1.0, 0.0, 5.0], [-1.0, 2.0, 5.0]]);
    let normals = mesh.normals.as_ref().unwrap();
    let n = normals.vectors[normals.triangles[5].unwrap()[0] as usize];
    assert!((n - marmor::math::DVec3::new(-0.6, 0.0, 0.8)).length() < 1e-7, "{n}");
    assert_eq!(
        mesh.remarks,
        [
            "only meshes are taken from it, and not its 2 materials, 1 camera, 2 lights: the scene file has its own",
            "its skins, animations and morph targets are not read: meshes are as they rest",
            "2 primitives of points or lines are left out",
        ]
    );
    let bytes = glb(&json, &shape.gltf("").1);
    for (part, count) in [("Left", 5), ("Right", 5), ("Part", 10), ("Wax", 8), ("material 1", 2)] {
        let scene = scene("m.glb", &bytes, &format!("part = \"{part}\"\nmaterial = \"wood\"")).unwrap();
        assert_eq!(scene.objects[0].mesh.triangles.len(), count, "{part}");
    }
    let both = scene("m.glb", &bytes, "materials = { Wax = \"wood\", \"material 1\" = \"jade\" }").unwrap();
    assert_eq!(
        objects(&both).iter().map(|o| (o.0.as_str(), o.2.len())).collect::<Vec<_>>(),
        [("set/Wax", 8), ("set/material 1", 2)]
    );
}
