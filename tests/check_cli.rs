//! What `check` and `render` say of a scene before it is rendered: the model's expected error and what to type for a better
//! one, where the objects are, and whether the camera sees any. Each piece of advice is taken, by the real program.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a command that does not start or a file that is not there has failed the test

mod command;

use command::text;
use std::fs;
use std::path::Path;

/// A camera 12 above the origin on z, a sky, and `objects`; `wax` has a transport mean free path of 0.5.
fn scene(objects: &str) -> String {
    format!(
        r#"unit = "mm"
[camera]
position = [0, 0, 12]
look_at = [0, 0, 0]
fov = 30
resolution = [16, 16]
[environment]
radiance = 1
[material.wax]
type = "translucent"
sigma_s_prime = 1.998
sigma_a = 0.002
eta = 1.3
model = "standard"
[method]
cache_samples = 100
[render]
spp = 2
{objects}"#
    )
}

fn ball(name: &str, x: f64, radius: f64, material: &str, more: &str) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nshape = \"sphere\"\ncentre = [{x}, 0, 0]\nradius = {radius}\nrings = 64\nsegments = 128\n\
         material = \"{material}\"\n{more}\n"
    )
}

fn mesh(name: &str) -> String {
    format!("[[object]]\nname = \"body\"\nmesh = \"{name}.obj\"\nmaterial = \"wax\"\n")
}

/// A box of 100 x 100 x `thickness`; without its lid, the face at z = `thickness`, if `open`.
fn block(thickness: f64, open: bool) -> String {
    let corners = (0..8).map(|i| {
        let at = |bit: i32, low: f64, high: f64| if i & bit == 0 { low } else { high };
        format!("v {} {} {}\n", at(1, -50.0, 50.0), at(2, -50.0, 50.0), at(4, 0.0, thickness))
    });
    let faces = ["1 3 4 2", "1 2 6 5", "2 4 8 6", "4 3 7 8", "3 1 5 7", "5 6 8 7"];
    let faces = faces[..if open { 5 } else { 6 }].iter().map(|f| format!("f {f}\n"));
    corners.chain(faces).collect()
}

/// Standard output and error of a call that must succeed.
fn said(folder: &Path, arguments: &str) -> String {
    let output = command::marmor(folder, &words(arguments));
    let all = text(&output.stderr) + &text(&output.stdout);
    assert!(output.status.success(), "{arguments}: {all}");
    all
}

/// Words as a shell parts them: `'` holds together.
fn words(line: &str) -> Vec<&str> {
    line.split('\'')
        .enumerate()
        .flat_map(|(i, part)| if i % 2 == 1 { vec![part] } else { part.split_whitespace().collect() })
        .collect()
}

fn json(folder: &Path, arguments: &str) -> serde_json::Value {
    let output = command::marmor(folder, &words(&format!("check scene.toml --json {arguments}")));
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output.stderr)))
}

/// The line that a render says of an object.
fn line(folder: &Path, object: &str, arguments: &str) -> String {
    let all = said(folder, &format!("render scene.toml -o x.exr --spp 1 {arguments}"));
    let head = format!("{object}: model ");
    all.lines().find(|l| l.starts_with(&head)).unwrap_or_else(|| panic!("no `{head}` in {all}")).to_string()
}

fn error(folder: &Path, arguments: &str) -> (String, f64) {
    let checked = json(folder, arguments);
    let own =
        checked["validity"][0]["models"].as_array().unwrap().iter().find(|m| m["chosen"] == true).unwrap().clone();
    (own["model"].as_str().unwrap().into(), own["distribution"].as_f64().unwrap())
}

#[test]
fn a_render_says_the_error_of_its_model_and_a_better_one_and_the_words_bring_it() {
    // A ball of 8 transport mean free paths: the table between the balls of radius 2 and 5.
    let folder = command::folder(&scene(&ball("ball", 0.0, 2.0, "wax", "")));
    let told = line(folder.path(), "ball", "");
    assert!(told.starts_with("ball: model `standard`, expected error 34 %; --model beam: 8 %"), "{told}");
    let words = told.split("; ").nth(1).unwrap().split(": ").next().unwrap();
    let better = line(folder.path(), "ball", words);
    assert_eq!(better, "ball: model `beam`, expected error 8 %");
    let all = said(folder.path(), "check scene.toml");
    assert!(all.contains("-> `beam` is better: --model beam") && !all.contains("volume_path"), "{all}");
    assert!(said(folder.path(), "check scene.toml --model beam").contains("-> trust the chosen model"));
    assert_eq!(said(folder.path(), "render scene.toml -o x.exr -q"), "");
    // Without exit normalisation the model is darker by 4 C_phi(1 / 1.3).
    let notes = line(folder.path(), "ball", "--as-notes");
    assert!(notes.contains("expected error 34 % (and 6 % darker, without exit normalisation)"), "{notes}");
    assert!(notes.contains("--model beam in place of --as-notes"), "{notes}");
}

#[test]
fn statistics_hold_what_was_said() {
    let folder = command::folder(&scene(&ball("ball", 0.0, 2.0, "wax", "")));
    said(folder.path(), "render scene.toml -o x.exr -q --stats s.json");
    let stats: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("s.json")).unwrap()).unwrap();
    let body = &stats["validity"][0];
    assert_eq!(
        (&body["object"], &body["take"], &body["verdict"]),
        (&"ball".into(), &"--model beam".into(), &"trust".into())
    );
    assert!(body["sentence"] == stats["says"][0] && body["sentence"].as_str().unwrap().contains("34 %"), "{stats:#}");
    // The ball: (2 / 12)² π over the picture's side of 2 tan 15° squared, bent a little by perspective.
    let share = stats["in_picture"][0].as_f64().unwrap();
    assert!((share - 0.31).abs() < 0.03, "{share}");
}

/// Each model that is ever recommended, on a body and in a medium where it is the best: the words give it, and its error falls.
#[test]
fn every_remedy_does_what_it_says() {
    let grey = "-D material.wax.sigma_s_prime=1.8 -D material.wax.sigma_a=0.2";
    for (thickness, medium, model) in [(2.5, "", "slab"), (8.0, "", "beam"), (8.0, grey, "beam")] {
        let folder = command::folder(&scene(&mesh("block")));
        fs::write(folder.path().join("block.obj"), block(thickness, false)).unwrap();
        let before = error(folder.path(), medium);
        let checked = json(folder.path(), medium);
        let sentence = checked["validity"][0]["sentence"].as_str().unwrap();
        let words = sentence.split("; ").nth(1).unwrap().split(": ").next().unwrap();
        let after = error(folder.path(), &format!("{medium} {words}"));
        assert!(after.0 == model && after.1 < before.1 - 0.02, "{thickness}: {sentence}: {before:?} {after:?}");
        line(folder.path(), "body", &format!("{medium} {words}"));
        // What it takes to be right.
        let take = checked["validity"][0]["take"].as_str().unwrap().to_string();
        said(folder.path(), &format!("render scene.toml -o x.exr --spp 1 {medium} {take}"));
    }
}

#[test]
fn words_fit_scenes_of_several_materials_and_scenes_that_name_a_model() {
    let other = "[material.\"my wax\"]\ntype = \"translucent\"\npreset = \"marble\"\nmodel = \"standard\"\n";
    let objects = ball("one", -2.5, 2.0, "wax", "") + &ball("two", 2.5, 2.0, "my wax", "") + other;
    let folder = command::folder(&scene(&objects));
    let told = line(folder.path(), "two", "");
    assert!(told.contains("; -D 'material.my wax.model=beam': "), "{told}");
    let words = told.split("; ").nth(1).unwrap().split(": ").next().unwrap();
    assert!(line(folder.path(), "two", words).contains("model `beam`"));
    assert!(line(folder.path(), "one", words).contains("model `standard`"), "that of the other stays");
    // Where `[method]` has a model for all, a material's own would be overruled.
    fs::write(folder.path().join("scene.toml"), scene(&objects).replace("[method]", "[method]\nmodel = \"better\""))
        .unwrap();
    let told = line(folder.path(), "two", "");
    assert!(told.contains("model `better`") && told.contains("; --model beam: "), "{told}");
    assert!(line(folder.path(), "two", "--model beam").contains("model `beam`"));
}

/// A body whose model is not named is walked through, and that is said; one that paths cannot walk through says why, and keeps its model.
#[test]
fn a_body_without_a_model_is_walked_through_where_that_can_be() {
    let unnamed = |text: &str| scene(text).replace("model = \"standard\"\n", "");
    let folder = command::folder(&unnamed(&ball("one", 0.0, 2.0, "wax", "")));
    let told = said(folder.path(), "render scene.toml -o x.exr --spp 1");
    assert!(
        told.contains("one: paths walked through it say how much leaves where, `standard` what is finer"),
        "{told}"
    );
    let named = said(folder.path(), "render scene.toml -o x.exr --spp 1 --model beam");
    assert!(named.contains("one: model `beam`, expected error") && !named.contains("walked"), "{named}");
    let touching =
        ball("one", -1.0, 2.0, "wax", "") + &ball("two", 1.5, 2.0, "wax", "") + &ball("apart", 9.0, 2.0, "wax", "");
    fs::write(folder.path().join("scene.toml"), unnamed(&touching)).unwrap();
    let checked = said(folder.path(), "check scene.toml");
    assert_eq!(checked.matches("paths do not walk through it: ").count(), 2, "{checked}");
    assert_eq!(checked.matches("paths walked through it").count(), 1, "{checked}");
    // To what is thousands of mean free paths thick a plane is near; it says why, and walks that would take for ever are not advised.
    let thick = unnamed(&ball("one", 0.0, 2.0, "wax", "")).replace("= 1.998", "= 1e6").replace("= 0.002", "= 1");
    fs::write(folder.path().join("thick.toml"), thick).unwrap();
    let told = said(folder.path(), "render thick.toml -o x.exr --spp 1");
    assert!(
        told.contains("collisions: to a body so thick a plane is near") && !told.contains("--shape walked"),
        "{told}"
    );
    for shape in ["half-space", "auto"] {
        said(folder.path(), &format!("render scene.toml -o {shape}.exr --spp 2 --shape {shape}"));
    }
}

#[test]
fn many_bodies_take_few_lines() {
    let objects: String = (0..5).map(|i| ball(&format!("b{i}"), f64::from(i) * 1.2 - 2.4, 0.5, "wax", "")).collect();
    let folder = command::folder(&scene(&objects));
    let all = said(folder.path(), "render scene.toml -o x.exr --spp 1");
    let lines = all.lines().filter(|l| l.contains("expected error")).count();
    assert!(lines == 3 && all.contains("and 2 more translucent bodies: marmor check scene.toml"), "{all}");
    assert_eq!(json(folder.path(), "")["validity"].as_array().unwrap().len(), 5);
}

#[test]
fn methods_without_models_say_what_they_make_of_a_body() {
    let folder = command::folder(&scene(&ball("ball", 0.0, 2.0, "wax", "")));
    for (method, part) in [
        (
            "direct",
            "translucent \"ball\": `direct` paints it matt (Lambertian), no light goes through: --method subsurface",
        ),
        ("ambient_occlusion", "`ambient_occlusion` shows shapes alone, no material: --method subsurface"),
        ("volume_path", "light is traced through, no model: what is wrong is noise"),
    ] {
        for call in ["check scene.toml", "render scene.toml -o x.exr --spp 1"] {
            let all = said(folder.path(), &format!("{call} --method {method}"));
            assert!(all.contains(part) && !all.contains("expected error"), "{all}");
        }
    }
    // Opaque scenes hear nothing of it.
    let opaque = scene(&(ball("ball", 0.0, 2.0, "grey", "") + "[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n"));
    fs::write(folder.path().join("scene.toml"), opaque).unwrap();
    assert!(!said(folder.path(), "render scene.toml -o x.exr --spp 1").contains("translucent"));
}

#[test]
fn an_open_sheet_is_not_thick_and_nothing_that_needs_an_inside_is_advised() {
    let sheet = "[[object]]\nname = \"body\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 0]\n\
                 material = \"wax\"\n";
    // Behind it another object, which is not its other side.
    let wall = "[[object]]\nname = \"wall\"\nshape = \"rectangle\"\ncentre = [0, 0, -3]\nedge_u = [4, 0, 0]\nedge_v = [0, 4, 0]\n\
                material = \"grey\"\n[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n";
    for objects in [sheet.to_string(), sheet.to_string() + wall] {
        let folder = command::folder(&scene(&objects));
        let all = said(folder.path(), "check scene.toml");
        assert!(all.contains("give it a thickness") && all.contains("error not known, of no model"), "{all}");
        assert!(!all.contains("endless") && !all.contains("--m") && !all.contains("%, "), "{all}");
        let told = line(folder.path(), "body", "");
        // The remedy is in the warning, once.
        assert!(told.ends_with("its error is not known: its mesh has no inside"), "{told}");
        let rendered = said(folder.path(), "render scene.toml -o x.exr --spp 1");
        assert_eq!(rendered.matches("give it a thickness").count(), 1, "{rendered}");
        let body = json(folder.path(), "")["validity"][0].clone();
        assert_eq!((&body["open"], &body["take"], &body["verdict"]), (&1.0.into(), &().into(), &"open".into()));
        assert!(body["thickness"][1].is_null() && body["models"][0]["distribution"].is_null(), "{body:#}");
    }
    // The same with a thickness has a figure, as the message says: 4 transport mean free paths.
    let folder = command::folder(&scene(&mesh("block")));
    fs::write(folder.path().join("block.obj"), block(2.0, false)).unwrap();
    let all = said(folder.path(), "check scene.toml");
    assert!(all.contains("4 to 4 transport mean free paths thick") && all.contains("--method volume_path"), "{all}");
}

#[test]
fn path_tracing_is_advised_where_it_can_trace() {
    let advised = |objects: &str, file: &str, more: &str| {
        let folder = command::folder(&scene(objects));
        fs::write(folder.path().join("block.obj"), file).unwrap();
        let all = said(folder.path(), &format!("check scene.toml {more}")) + &line(folder.path(), "body", more);
        all.contains("--method volume_path")
    };
    assert!(advised(&mesh("block"), &block(2.0, false), ""));
    assert!(!advised(&mesh("block"), &block(2.0, true), ""), "open");
    let other = ball("other", 0.0, 1.0, "wax", "");
    assert!(advised(&(mesh("block") + &other), &block(2.0, false), ""), "overlapping");
    // Two overlapping parts of one mesh.
    let two = block(2.0, false) + &block(2.0, false).replace("v -50", "v -20").replace("v 50", "v 80");
    let second = |line: &str| match line.strip_prefix("f ") {
        Some(face) => face.split(' ').map(|i| format!(" {}", i.parse::<i32>().unwrap() + 8)).collect::<String>(),
        None => String::new(),
    };
    let lines: Vec<&str> = two.lines().collect();
    let parts: String = lines
        .iter()
        .enumerate()
        .map(|(i, l)| if i >= 14 && l.starts_with('f') { format!("f{}\n", second(l)) } else { format!("{l}\n") })
        .collect();
    assert!(advised(&mesh("block"), &parts, ""), "parts that overlap");
    assert!(!advised(&(mesh("block") + "flip = true\n"), &block(2.0, false), ""), "inside out");
}

#[test]
fn faces_that_look_inwards_have_no_figure_until_they_are_turned() {
    let folder = command::folder(&scene(&ball("ball", 0.0, 2.0, "wax", "flip = true")));
    let told = line(folder.path(), "ball", "");
    assert_eq!(told, "ball: model `standard`, its error is not known: its faces look inwards");
    assert!(line(folder.path(), "ball", "--repair").contains("expected error 34 %"));
    assert_eq!(json(folder.path(), "")["validity"][0]["take"], "--repair");
}

#[test]
fn what_has_not_been_measured_has_no_figure_anywhere() {
    let folder = command::folder(&scene(&ball("ball", 0.0, 2.0, "wax", "")));
    for (medium, part) in [
        ("-D material.wax.sigma_a=0", "measured for reduced albedos of 0.3 to 0.9999, here 1"),
        ("-D material.wax.sigma_a=10", "measured for reduced albedos of 0.3 to 0.9999, here 0.1665"),
        ("-D material.wax.g=-0.5", "measured for g 0 to 0.8, here -0.5"),
        ("-D material.wax.g=0.9", "measured for g 0 to 0.8, here 0.9"),
        ("-D material.wax.eta=1.6", "measured for eta 1 to 1.5, here 1.6"),
        ("-D material.wax.sigma_s_prime=0.1", "thinner than 1 transport mean free path, where no model holds"),
        ("--model slab -D material.wax.thickness=1", "most of the body is no slab of 1 units"),
    ] {
        let told = line(folder.path(), "ball", medium);
        assert!(
            told.contains(&format!("its error is not known: {part}")) && !told.contains("expected error"),
            "{told}"
        );
        let body = json(folder.path(), medium)["validity"][0].clone();
        let own = body["models"].as_array().unwrap().iter().find(|m| m["chosen"] == true).unwrap().clone();
        assert!(["total", "distribution", "far", "beyond"].iter().all(|key| own[key].is_null()), "{body:#}");
        assert_eq!(own["measured"], 0.0);
    }
}

#[test]
fn an_empty_picture_is_said_with_where_to_look() {
    let folder = command::folder(&scene(&ball("ball", 0.0, 2.0, "wax", "")));
    let away = "-D camera.look_at=[30,0,12]";
    let all = said(folder.path(), &format!("render scene.toml -o x.exr {away}"));
    assert!(
        all.contains(
            "the camera sees nothing of the one object, the background alone: \"ball\" lies behind the camera"
        ) || all.contains("\"ball\" lies 90 degrees away from the direction of view"),
        "{all}"
    );
    assert!(all.contains("estimated relMSE: nothing to measure") && !all.contains("relMSE 0"), "{all}");
    let words = all.lines().find(|l| l.contains("sees nothing")).unwrap().rsplit("to look at it: ").next().unwrap();
    let seen = said(folder.path(), &format!("render scene.toml -o x.exr {words}"));
    assert!(!seen.contains("sees nothing") && seen.contains("estimated relMSE "), "{seen}");
    let checked = json(folder.path(), away);
    assert_eq!(checked["objects"][0]["in_picture"], 0.0);
    assert!(
        checked["warnings"][0].as_str().unwrap().contains("sees nothing") && checked["look_at"].is_array(),
        "{checked:#}"
    );
    let told = |more: &str| said(folder.path(), &format!("check scene.toml {more}")).contains("sees nothing");
    assert!(!told("") && told(away) && told("-D camera.look_at=[0,0,30]"), "straight away from it");
    // Seen in part, by a corner, or by less than a pixel, it is seen.
    assert!(!told("-D camera.look_at=[4.5,0,0]"));
    assert!(told("-D camera.look_at=[9,0,0]"));
    assert!(!told("-D object.0.radius=1e-4 -D camera.look_at=[0.3,0.2,0]"));
    // A part of the picture.
    let cropped = said(folder.path(), "render scene.toml -o x.exr --crop 0,0,2,2");
    assert!(
        cropped.contains("the crop shows nothing of the one object") && cropped.contains("render without --crop"),
        "{cropped}"
    );
}

#[test]
fn check_tells_where_objects_are_how_large_and_how_much_of_the_picture_they_fill() {
    let folder = command::folder(&scene(&ball("ball", 3.0, 2.0, "wax", "")));
    let object = json(folder.path(), "")["objects"][0].clone();
    let close = |value: &serde_json::Value, expected: [f64; 3]| {
        (0..3).all(|k| (value[k].as_f64().unwrap() - expected[k]).abs() < 5e-3)
    };
    assert!(close(&object["from"], [1.0, -2.0, -2.0]) && close(&object["to"], [5.0, 2.0, 2.0]), "{object:#}");
    assert!(close(&object["size"], [4.0; 3]));
    let all = said(folder.path(), "check scene.toml -D unit=10");
    for part in ["ball: 16128 triangles, 4 x 4 x 4 units (40 x 40 x 40 mm)", "to (5, 2, 2); ", " % of the picture"] {
        assert!(all.contains(part), "`{part}` in {all}");
    }
    // A body of 40 000 free paths: is the unit right?
    let odd = said(folder.path(), "check scene.toml -D material.wax.sigma_s_prime=1e4");
    assert!(odd.contains("4 units is 40000 transport mean free paths: light hardly spreads on it"), "{odd}");
    assert!(!all.contains("hardly spreads"));
}

#[test]
fn looks_and_colours_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let put = |medium: &str| {
        let own = "sigma_s_prime = 1.998\nsigma_a = 0.002\neta = 1.3\n";
        let text = scene(&ball("body", 0.0, 2.0, "wax", "")).replacen(own, medium, 1);
        assert!(text.contains(medium));
        fs::write(folder.path().join("scene.toml"), text).unwrap();
        said(folder.path(), "check scene.toml")
    };
    let jade = put("preset = \"jade\"\n");
    assert!(jade.contains("jade (a look, not measured)") && jade.contains("colour [0.3, 0.55, 0.36]"), "{jade}");
    let own = put("colour = [0.2, 0.4, 0.8]\nmean_free_path = 0.1\neta = 1.4\n");
    assert!(own.contains("from its colour") && own.contains("colour [0.2, 0.4, 0.8]: what a thick body"), "{own}");
    assert!(put("preset = \"marble\"\n").contains("marble [JMLH01]"));
    assert!(!said(folder.path(), "check scene.toml").contains("camera:"));
    let lens =
        said(folder.path(), "check scene.toml -D camera.aperture=0.5 -D camera.blades=6 -D render.filter=gaussian");
    assert!(
        lens.contains("camera: a lens of 6 blades 0.5 units wide, sharp 12 units along the view; a gaussian filter"),
        "{lens}"
    );
    assert!(put("colour = 0.5\nmean_free_path = 0.1\neta = 1.4\ng = 0.7\n").contains("(as if g were 0)"));
}
