//! Scene files, good and bad: what is made of them and what is said about them.
#![allow(clippy::unwrap_used)] // a test that cannot write its files has failed

mod refusals;

use marmor::scene::{Projection, Scene, SceneFile};
use marmor::{Error, ErrorKind};
use refusals::{damaged, failure};
use std::path::Path;

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

#[test]
fn a_good_file_loads_without_a_word() {
    assert!(parse(&format!("\u{feff}{GOOD}")).is_ok());
    let scene = load(GOOD).unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert_eq!(scene.meshes().len(), 2);
    assert_eq!(scene.default_method().name(), "subsurface");
    assert_eq!(scene.unit_in_mm, Some(1.0));
    let Some(stone) = &scene.surface(0).inside else { panic!("not translucent") };
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
    ("type = \"translucent\"", "type = \"mirror\"", 21, &["conductor", "reflectance"]),
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
    ("sigma_s_prime = [2, 3, 4]", "preset = \"milk\"", 22, &["`material.stone.preset`", "`skimmilk`, `wholemilk`"]),
    ("sigma_s_prime = [2, 3, 4]", "colour = 0.5", 23, &["`material.stone.sigma_a` stands beside `colour`"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "colour = 0.5", 20, &["`material.stone.mean_free_path` is missing", "above 0"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "mean_free_path = 2", 20, &["`material.stone.colour` is missing"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "colour = [0.5, 1, 0]\nmean_free_path = 2", 22, &["[0.5, 1, 0]", "below 1", "`sigma_a` = 0"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "colour = 0.5\nmean_free_path = [1, 0, 1]", 23, &["`material.stone.mean_free_path` is [1, 0, 1]"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "colour = 0.5\nmean_free_path = 1e-20", 20, &["coefficients lie in", "`mean_free_path`"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01\neta = 1.5", "colour = 0.5\nmean_free_path = 1", 20, &["`material.stone.eta` is missing"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "preset = \"jade\"\ncolour = 0.5", 23, &["`material.stone.colour` stands beside `preset`"]),
    ("sigma_s_prime = [2, 3, 4]\nsigma_a = 0.01", "preset = \"jdae\"", 22, &["did you mean `jade`?"]),
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
    let fov = |file: &SceneFile| match file.camera.projection {
        Projection::Perspective { fov, .. } => fov,
        _ => f64::NAN,
    };
    assert_eq!((changed.objects[0].material, fov(&changed)), (1, 50.0));
    assert_eq!((fov(&file), file.method.name), (40.0, None));
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
    let medium = |text: &str| parse(text).unwrap().materials[0].surface.inside.as_ref().unwrap().medium;
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
        ("sigma_s_prime = [2, 3, 4]", "sigma_s_prime = [2, 3, 0.1]", &["mean free path in blue, 9.091 units", "3.46"]),
        (
            "sigma_a = 0.01",
            "sigma_a = [0.01, 4, 0.01]\nmodel = \"standard\"",
            &["reduced albedo 0.4286 in green", "outside diffusion"],
        ),
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

#[test]
fn damaged_scenes_never_panic() {
    let small = GOOD.replacen("radius = 1", "radius = 1\nrings = 3\nsegments = 4", 1);
    for seed in 0..2000 {
        if let Ok(file) = parse(&String::from_utf8_lossy(&damaged(small.as_bytes(), seed)))
            && file.objects.iter().all(|o| !format!("{:?}", o.geometry).contains("Mesh"))
        {
            let _ = Scene::load(&file);
        }
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
    let parts = text.split("```toml\n").skip(1).filter_map(|part| part.split("```").next());
    let scenes: Vec<&str> = parts.filter(|part| part.contains("[camera]")).collect();
    assert_eq!(scenes.len(), 6);
    for scene in scenes {
        let file = parse(scene).unwrap_or_else(|e| panic!("{e}\n{scene}"));
        if !scene.contains("mesh = ") {
            assert_eq!(Scene::load(&file).unwrap().warnings, Vec::<String>::new());
        }
    }
}
