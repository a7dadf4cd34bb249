//! Scene files and OBJ files, good and bad: what is made of them and what is said about them.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

use marmor::geometry::{ObjMesh, load_obj};
use marmor::math::{DVec3, Vec3, hash};
use marmor::scene::{Scene, SceneFile, Surface};
use marmor::{Error, ErrorKind};
use std::path::{Path, PathBuf};

const GOOD: &str = r#"unit = "mm"
[camera]
position = [0, 0, 5]
look_at = [0, 0, 0]
fov = 40
resolution = [8, 4]
[[object]]
name = "ball"
shape = "sphere"
centre = [0, 0, 0]
radius = 1
material = "stone"
[[object]]
name = "lamp"
shape = "rectangle"
centre = [0, 9, 0]
edge_u = [1, 0, 0]
edge_v = [0, 0, 1]
material = "lamp"
[material.stone]
type = "translucent"
sigma_s_prime = [2, 3, 4]
sigma_a = 0.01
eta = 1.5
[material.lamp]
type = "emissive"
radiance = 5
"#;

fn parse(text: &str) -> Result<SceneFile, Error> {
    SceneFile::parse(text, Path::new("x.toml"))
}

fn load(text: &str) -> Result<Scene, Error> {
    Scene::load(&parse(text)?)
}

fn obj(text: &[u8]) -> Result<ObjMesh, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.obj");
    std::fs::write(&path, text).unwrap();
    load_obj(&path)
}

/// The message and kind of what should have failed.
fn failure<T>(result: Result<T, Error>, case: &str) -> (String, ErrorKind) {
    match result {
        Ok(_) => panic!("accepted: {case}"),
        Err(e) => (e.to_string(), e.kind()),
    }
}

#[test]
fn a_good_file_loads_without_a_word() {
    let scene = load(GOOD).unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert_eq!(scene.meshes().len(), 2);
    assert_eq!(scene.default_method().name(), "subsurface");
    assert_eq!(scene.unit_in_mm, Some(1.0));
    let Surface::Translucent(stone) = scene.surface(0) else { panic!("not translucent") };
    assert_eq!((stone.medium.sigma_s.0, stone.medium.g, stone.medium.eta), ([2.0, 3.0, 4.0], 0.0, 1.5));
}

/// What is typed in the place of what, the line the complaint names, and parts of it.
#[rustfmt::skip]
const MALFORMED: &[(&str, &str, u32, &[&str])] = &[
    ("unit = \"mm\"", "unit = \"furlong\"", 1, &["`unit` is the text \"furlong\"", "\"mm\""]),
    ("unit = \"mm\"", "unit = 0", 1, &["`unit` is 0", "above 0"]),
    ("unit = \"mm\"", "units = \"mm\"", 1, &["`units`", "did you mean `unit`?"]),
    ("[camera]", "[camera", 2, &["not TOML"]),
    ("[camera]", "[kamera]", 2, &["`kamera`", "did you mean `camera`?"]),
    ("position = [0, 0, 5]", "positon = [0, 0, 5]", 3, &["`positon`", "did you mean `position`?"]),
    ("position = [0, 0, 5]", "", 2, &["`camera.position` is missing", "three numbers"]),
    ("position = [0, 0, 5]", "position = [0, 0]", 3, &["`camera.position` is [0, 0]", "three numbers"]),
    ("position = [0, 0, 5]", "position = [0, 0, nan]", 3, &["`camera.position`", "NaN"]),
    ("position = [0, 0, 5]", "position = [0, 0, 0]", 4, &["the same point"]),
    ("position = [0, 0, 5]", "position = [0, 5, 0]", 4, &["parallel to up", "set `up`"]),
    ("fov = 40", "fov = 180", 5, &["`camera.fov` is 180", "below 180"]),
    ("fov = 40", "fov = -1", 5, &["`camera.fov` is -1", "degrees"]),
    ("fov = 40", "fov = 40\nfov = 41", 6, &["not TOML", "duplicate"]),
    ("fov = 40", "fov = 40\nfov_axis = \"vertica\"", 6, &["did you mean `vertical`?"]),
    ("resolution = [8, 4]", "resolution = [0, 4]", 6, &["`camera.resolution` is [0, 4]", "1 to 65536"]),
    ("resolution = [8, 4]", "resolution = [65537, 4]", 6, &["65537"]),
    ("resolution = [8, 4]", "resolution = [8.5, 4]", 6, &["whole number"]),
    ("shape = \"sphere\"", "shape = \"spere\"", 9, &["\"spere\" does not exist", "did you mean `sphere`?"]),
    ("shape = \"sphere\"", "shape = \"sphere\"\nmesh = \"a.obj\"", 9, &["beside `mesh`"]),
    ("radius = 1", "radius = 0", 11, &["`object.0.radius` is 0", "above 0"]),
    ("radius = 1", "radius = 1\nrings = 1", 12, &["`object.0.rings` is 1", "2 to 4096"]),
    ("radius = 1", "radius = 1\nnormals = \"smoth\"", 12, &["did you mean `smooth`?"]),
    ("radius = 1", "radius = 1\nflip = 1", 12, &["`object.0.flip` is 1", "true or false"]),
    ("radius = 1", "radius = 1\ntransform = { scale = 0 }", 12, &["`object.0.transform.scale` is 0", "none 0"]),
    ("radius = 1", "radius = 1\ntransform = { matrix = [[1,0,0],[2,0,0],[0,0,1]] }", 12, &["has no inverse"]),
    ("radius = 1", "radius = 1\ntransform = { matrix = [[1,0],[0,1]] }", 12, &["3 rows of 3"]),
    ("radius = 1", "radius = 1\ntransform = { matrix = [[1,0,0],[0,1,0],[0,0,1]], scale = 2 }", 12, &["beside `matrix`"]),
    ("radius = 1", "radius = 1\ntransform = { rotat = [0,0,9] }", 12, &["did you mean `rotate`?"]),
    ("material = \"stone\"", "material = \"ston\"", 12, &["`object.0.material`", "did you mean `stone`?"]),
    ("material = \"stone\"", "", 7, &["`object.0.material` is missing"]),
    ("name = \"lamp\"", "name = \"ball\"", 14, &["\"ball\" is taken (x.toml:7)"]),
    ("edge_u = [1, 0, 0]", "", 13, &["`object.1.edge_u` is missing"]),
    ("type = \"translucent\"", "", 20, &["`material.stone.type` is missing"]),
    ("type = \"translucent\"", "type = \"mirror\"", 21, &["not built yet", "translucent"]),
    ("type = \"translucent\"", "type = \"difuse\"", 21, &["did you mean `diffuse`?"]),
    ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = [2, -3, 4]", 22, &["[2, -3, 4]", "none negative"]),
    ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = [2, nan, 4]", 22, &["NaN"]),
    ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = 1e39", 22, &["1e39"]),
    ("sigma_s_prime = [2, 3, 4]", "", 20, &["`material.stone.sigma_s_prime` is missing", "preset"]),
    ("sigma_s_prime = [2, 3, 4]", "sigma_s = 3", 20, &["`material.stone.g` is missing"]),
    ("sigma_s_prime = [2, 3, 4]", "sigma_s = 3\ng = 1", 23, &["`material.stone.g` is 1", "below 1"]),
    ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = 3\nsigma_s = 3", 23, &["remove one"]),
    ("sigma_s_prime = [2, 3, 4]", "preset = \"marbel\"", 22, &["did you mean `marble`?"]),
    ("sigma_s_prime = [2, 3, 4]", "preset = \"marble\"", 23, &["`material.stone.sigma_a` stands beside `preset`"]),
    ("sigma_a = 0.01", "", 20, &["`material.stone.sigma_a` is missing"]),
    ("sigma_a = 0.01", "sigma_a = 0.01\nmodel = \"dirctional\"", 24, &["`material.stone.model`", "dirctional"]),
    ("sigma_a = 0.01", "sigma_a = 0.01\nper = \"parsec\"", 24, &["parsec"]),
    ("sigma_a = 0.01", "sigma_a = 0.01\nalbedo = 1", 24, &["`albedo` is not a key of a translucent material"]),
    ("eta = 1.5", "", 20, &["`material.stone.eta` is missing", "n_inside"]),
    ("eta = 1.5", "eta = 0", 24, &["`material.stone.eta` is 0"]),
    ("radiance = 5", "radiance = [1, -1, 0]", 27, &["none negative"]),
    ("radiance = 5", "radiance = \"bright\"", 27, &["the text \"bright\""]),
    ("type = \"emissive\"\nradiance = 5", "type = \"diffuse\"\nalbedo = 1.01", 27, &["1.01", "0 to 1"]),
    ("radiance = 5", "radiance = 5\n[method]\nname = \"subsurfac\"", 29, &["did you mean `subsurface`?"]),
    ("radiance = 5", "radiance = 5\n[method]\nrays = 0", 29, &["`method.rays` is 0"]),
    ("radiance = 5", "radiance = 5\n[render]\nspp = 1e3", 29, &["whole number"]),
    ("radiance = 5", "radiance = 5\n[environment]", 28, &["`environment.radiance` is missing"]),
];

#[test]
fn malformed_files_are_refused_by_line_key_and_remedy() {
    let mut wrongly = Vec::new();
    for (typed, wrong, line, fragments) in MALFORMED {
        assert!(GOOD.contains(typed), "{typed}");
        let (message, kind) = failure(parse(&GOOD.replacen(typed, wrong, 1)), wrong);
        let at = format!("x.toml:{line}: ");
        if kind != ErrorKind::Scene || !message.starts_with(&at) || !fragments.iter().all(|f| message.contains(f)) {
            wrongly.push(format!("{wrong:?}, expected {at}{fragments:?}:\n    {message}"));
        }
    }
    assert!(wrongly.is_empty(), "{}", wrongly.join("\n"));
}

#[test]
fn files_that_cannot_be_read_are_file_errors() {
    let folder = tempfile::tempdir().unwrap();
    let (message, kind) = failure(SceneFile::read(&folder.path().join("no.toml")), "missing");
    assert!(kind == ErrorKind::File && message.contains("no.toml: cannot read"), "{message}");
    assert_eq!(failure(SceneFile::read(folder.path()), "folder").1, ErrorKind::File);
    let latin = folder.path().join("latin.toml");
    std::fs::write(&latin, b"unit = 1\n# \xe9").unwrap();
    let (message, kind) = failure(SceneFile::read(&latin), "not UTF-8");
    assert!(kind == ErrorKind::Scene && message.contains("latin.toml:2: not UTF-8"), "{message}");
    let (message, kind) = failure(parse(""), "empty");
    assert!(kind == ErrorKind::Scene && message.contains("`camera` is missing"), "{message}");

    // A mesh that is not there names the object as well.
    let scene = GOOD.replacen("shape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1", "mesh = \"no.obj\"", 1);
    let (message, kind) = failure(load(&scene), "missing mesh");
    assert_eq!(kind, ErrorKind::File);
    assert!(message.starts_with("x.toml:7: object \"ball\": no.obj: cannot read"), "{message}");
}

#[test]
fn overrides_replace_add_and_complain_as_themselves() {
    let file = parse(GOOD).unwrap();
    let changed = file
        .with(&["method.name=direct", "object.0.material=lamp", "camera.fov = 50", "material.lamp.radiance=[1,2,3]"])
        .unwrap();
    assert_eq!(changed.method.name.unwrap().name(), "direct");
    assert_eq!((changed.objects[0].material, changed.camera.fov), (1, 50.0));
    assert_eq!((file.camera.fov, file.method.name), (40.0, None));
    assert!(changed.effective().contains("fov = 50"), "{}", changed.effective());
    assert_eq!(parse(&changed.effective()).unwrap().method, changed.method);
    for (typed, kind, fragment) in [
        ("camera.fov", ErrorKind::Usage, "expected path.to.key=value"),
        ("=3", ErrorKind::Usage, "expected path.to.key=value"),
        ("object.7.material=lamp", ErrorKind::Usage, "is a list of 2"),
        ("camera.fov.x=3", ErrorKind::Usage, "`camera.fov` is 40, and has no `x`"),
        ("camera.fov=200", ErrorKind::Scene, "with -D camera.fov=200: `camera.fov` is 200"),
        ("camera.fovv=20", ErrorKind::Scene, "did you mean `fov`?"),
        ("render.spp=1\nseed=2", ErrorKind::Scene, "`render.spp` is the text"),
    ] {
        let (message, found) = failure(file.with(&[typed]), typed);
        assert!(found == kind && message.contains(fragment), "{typed}: {message}");
    }
}

#[test]
fn coefficients_come_out_per_scene_unit() {
    let medium = |text: &str| match parse(text).unwrap().materials[0].surface.clone() {
        Surface::Translucent(t) => t.medium,
        _ => panic!("not translucent"),
    };
    let per_mm = medium(&GOOD.replacen("eta = 1.5", "eta = 1.5\nper = \"mm\"", 1).replacen("\"mm\"", "\"cm\"", 1));
    assert_eq!(per_mm.sigma_s.0, [20.0, 30.0, 40.0]);
    let preset = GOOD.replacen("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01\neta = 1.5", "preset = \"marble\"", 1);
    assert_eq!(medium(&preset).sigma_s.0, [2.19, 2.62, 3.00]);
    assert_eq!(medium(&preset.replacen("\"mm\"", "\"m\"", 1)).sigma_s.0, [2190.0, 2620.0, 3000.0]);
    assert_eq!(medium(&preset.replacen("preset", "scale = 0.5\npreset", 1)).sigma_s.0, [1.095, 1.31, 1.5]);
    let full = medium(&GOOD.replacen("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = 2\ng = 0.5", 1));
    assert_eq!((full.sigma_s.0, full.g, full.sigma_s_prime().0), ([4.0; 3], 0.5, [2.0; 3]));
}

#[test]
fn oddities_are_warned_of_with_their_numbers() {
    for (typed, odd, fragments) in [
        ("unit = \"mm\"", "", &["no `unit`", "millimetres are assumed"][..]),
        ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = [2, 3, 0.1]", &["mean free path in blue, 9.0909", "3.46"]),
        ("sigma_a = 0.01", "sigma_a = [0.01, 4, 0.01]", &["reduced albedo 0.429 in green", "outside diffusion"]),
        ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "sigma_s_prime = [2, 3, 0]\nsigma_a = [1, 1, 0]", &["in blue"]),
        ("radiance = 5", "radiance = 0", &["no light"]),
        ("edge_u = [1, 0, 0]", "edge_u = [0, 0, 0]", &["all 2 triangles have no area", "no light"]),
        ("material = \"lamp\"", "material = \"stone\"", &["\"lamp\" is used by no object"]),
    ] {
        let scene = load(&GOOD.replacen(typed, odd, 1)).unwrap();
        let said = scene.warnings.join("\n");
        assert!(fragments.iter().all(|f| said.contains(f)), "{odd}: {said}");
    }
    let silent = load(&GOOD.replacen("radiance = 5", "radiance = 0\n[method]\nname = \"ambient_occlusion\"", 1));
    assert_eq!(silent.unwrap().warnings, Vec::<String>::new());
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
    assert!(parse(&format!("\u{feff}{GOOD}")).is_ok());
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
        ("v 1 2 3 1 1 0 1\nf 1 2 3", "1 vertices have further numbers (4 after x y z in line 5)"),
        ("v 1 2 3 1 0\nf 1 2 3", "1 vertices have further numbers (2 after x y z in line 5)"),
        ("cstype bezier\nsurf 0 1 0 1 1 2 3 4\nend\ncurv 0 1 1 2\nf 1 2 3", "2 free-form curves or surfaces are left out (the first, `surf`, in line 6)"),
        ("vertex 1 2 3\nf 1 2 3", "1 lines begin with a word that OBJ does not have (the first, `vertex`, in line 5)"),
        ("call other.obj\ncsh make\nf 1 2 3", "2 lines call for other files or for commands (the first, `call`, in line 5)"),
        ("vn 0 0 1\nf 1//1 2//1 3", "1 faces have normals at some corners only (the first in line 6)"),
        ("vn 0 0 1\nf 1 2 3", "no face refers to any of its 1 normals"),
        ("v 1 -1 0\nf 1 2 3 4\nf 1 4 2 3", "2 of 2 polygons cross or cover themselves (the first in line 6)"),
        ("v 1 1 9\nf 1 2 5 3\nf 1 2 4 3", "1 of 2 polygons are not plane (corners up to"),
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
        (b"v 0 0 0\nf 1 1 1\nf 1 1 2", ":3: vertex number 2 in a face, but there are 1"),
        (b"v 0 0 0\nf 1 1 -2", ":2: vertex number -2 in a face, but there are 1"),
        (b"v 0 0 0\nf 1 1 9223372036854775807", ":2: vertex number 9223372036854775807"),
        (b"v 0 0 0\nf 1 1 99999999999999999999", ":2: no face"),
        (b"v 0 0 0\nf 1//1 1//1 1//1", ":2: normal number 1 in a face, but there are 0"),
        (b"v 0 0 0\nvn 0 0 1\nf 1//2 1//1 1//1", ":3: normal number 2 in a face, but there are 1"),
        (b"v 0 0 0\nf 1 one 1", ":2: no face in `f 1 one 1`"),
        (b"v 0 0 0\nf", ":2: no face"),
        (b"v 0 0 0\nf 1/1/1/1 1 1", ":2: no face"),
        (b"", ": no faces: the file is empty"),
        (b"hello\nworld", ": no faces: and no vertices"),
        (b"\x00\x01\xff\xfe\x00binary\n\x89PNG", ": no faces"),
        (b"v 0 0 0\nv 1 0 0\nl 1 2", ": no faces: 2 vertices, 1 points and lines"),
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
    let (message, kind) = failure(load_obj(folder.path()), "a folder");
    assert!(kind == ErrorKind::File && message.contains("it is a folder"), "{message}");
    let (message, kind) = failure(load_obj(&folder.path().join("no.obj")), "missing");
    assert!(kind == ErrorKind::File && message.contains("no.obj: cannot read"), "{message}");
}

/// Deterministic damage: bytes replaced, cut out, doubled.
fn damaged(text: &[u8], seed: u64) -> Vec<u8> {
    const SPICE: &[u8] = b"0123456789-+./\\ \n\teEnvftlgo#[]{}=\"',\xff\x00";
    let mut bytes = text.to_vec();
    for i in 0..1 + seed % 6 {
        let h = hash(seed * 16 + i + 1);
        let at = (h >> 8) as usize % bytes.len();
        match h % 4 {
            0 | 1 => bytes[at] = SPICE[(h >> 40) as usize % SPICE.len()],
            2 => drop(bytes.remove(at)),
            _ => bytes.extend_from_within(at..bytes.len().min(at + (h >> 40) as usize % 40)),
        }
    }
    bytes
}

#[test]
fn damaged_files_never_panic_and_what_is_accepted_is_sound() {
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
    let small = GOOD.replacen("radius = 1", "radius = 1\nrings = 3\nsegments = 4", 1);
    for seed in 0..2000 {
        if let Ok(file) = parse(&String::from_utf8_lossy(&damaged(small.as_bytes(), seed)))
            && file.objects.iter().all(|o| !format!("{:?}", o.geometry).contains("Mesh"))
        {
            let _ = Scene::load(&file);
        }
    }
}

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

#[test]
fn a_field_of_view_spans_the_side_it_says() {
    let tangent = |axis: &str, pixel: [u32; 2], offset: [f32; 2]| {
        let scene = load(&GOOD.replacen("fov = 40", &format!("fov = 90\nfov_axis = \"{axis}\""), 1)).unwrap();
        let d = scene.camera.ray(pixel, offset).direction;
        [d.x / -d.z, d.y / -d.z]
    };
    // 8 x 4 pixels: the right edge and the top edge.
    for (axis, right, top) in [("vertical", 2.0, 1.0), ("horizontal", 1.0, 0.5), ("smaller", 2.0, 1.0)] {
        assert!((tangent(axis, [7, 2], [1.0, 0.0])[0] - right).abs() < 1e-5, "{axis}");
        assert!((tangent(axis, [4, 0], [0.0, 0.0])[1] - top).abs() < 1e-5, "{axis}");
    }
}

#[test]
fn the_scenes_of_the_documentation_are_read() {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene-format.md")).unwrap();
    let scenes: Vec<&str> = text.split("```toml\n").skip(1).filter_map(|part| part.split("```").next()).collect();
    assert_eq!(scenes.len(), 3);
    for scene in scenes {
        let file = parse(scene).unwrap_or_else(|e| panic!("{e}\n{scene}"));
        if !scene.contains("mesh = ") {
            assert_eq!(Scene::load(&file).unwrap().warnings, Vec::<String>::new());
        }
    }
}
