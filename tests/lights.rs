//! Lights that are no surface: sun, distant, point and spot are worth what they should be, by every method.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

mod parts;
mod rendering;

use marmor::render::Options;
use marmor::scene::{Scene, SceneFile};
use parts::{WAX, camera, diffuse, emissive, rectangle, sky, sphere, translucent};
use rendering::{Within, agree, channels, mean_of};
use std::f64::consts::PI;
use std::path::Path;

fn file(text: &str) -> SceneFile {
    SceneFile::parse(text, Path::new("scene.toml")).unwrap()
}

/// Mean over the picture and its channels over six seeds, with its standard error.
fn mean(text: &str, set: &[&str], spp: u32) -> (f64, f64) {
    let scene = file(text).with(set).unwrap();
    let run = |seed| {
        let picture = marmor::render(&scene, &Options { spp: Some(spp), seed: Some(seed), ..Options::default() });
        channels(&picture.unwrap().image).iter().sum::<f64>() / 3.0
    };
    mean_of((1..=6).map(run))
}

fn light(kind: &str, keys: &str) -> String {
    format!("[[light]]\nname = \"{kind}\"\ntype = \"{kind}\"\n{keys}\n")
}

/// A matt floor of albedo 0.5, of which the camera sees a small square about the origin from above.
fn floor(lights: &str) -> String {
    camera([0.0, 10.0, 0.0], [0.0; 3], 0.02, [4, 4])
        + "up = [0, 0, 1]\n"
        + &rectangle("floor", [0.0; 3], [0.0, 0.0, 50.0], [50.0, 0.0, 0.0], "matt")
        + &diffuse("matt", 0.5)
        + lights
}

/// A matt floor under each light, straight: albedo/π times intensity cosθ/d², or irradiance cosθ.
#[test]
fn a_matt_floor_under_each_light_has_its_closed_form() {
    let (cosine, albedo) = (0.8, 0.5);
    let at_4_mm = albedo / PI * 3.0 * cosine / 16.0;
    let to_floor = "position = [0, 3.2, 2.4]\nlook_at = [0, 0, 0]";
    // Half way through the rim in cosine; the smooth step is 1/2 there.
    let (inner, outer) = ((0.5_f64 * 40.0).to_radians().cos(), (0.5_f64 * 80.0).to_radians().cos());
    let half_way = (0.5 * (inner + outer)).acos();
    let (s, c) = (half_way.sin(), half_way.cos());
    let aside = format!("position = [0, 4, 0]\ndirection = [{s}, {}, 0]\nintensity = 3\ncone = 80\npenumbra = 0.5", -c);
    let beyond = "position = [0, 4, 0]\ndirection = [1, -1, 0]\nintensity = 3\ncone = 80\npenumbra = 0.5";
    let spot_power = 2.0 * PI * (1.0 - 0.5 * (1.0 + (0.5_f64 * 40.0).to_radians().cos())) * 3.0;
    for (kind, keys, wanted) in [
        ("point", "position = [0, 3.2, 2.4]\nintensity = 3".to_string(), at_4_mm),
        ("point", format!("position = [0, 3.2, 2.4]\npower = {}", 12.0 * PI), at_4_mm),
        ("point", "position = [0, 3.2, 2.4]\nintensity = 3e-6\nper = \"m\"".into(), at_4_mm),
        ("spot", format!("{to_floor}\nintensity = 3"), at_4_mm),
        ("spot", format!("{to_floor}\npenumbra = 1\npower = {spot_power}"), at_4_mm),
        ("spot", aside, 0.5 * albedo / PI * 3.0 / 16.0),
        ("spot", beyond.into(), 0.0),
        ("distant", "direction = [0, -0.8, 0.6]\nirradiance = 3".into(), albedo / PI * 3.0 * cosine),
        ("sun", "direction = [0, -0.8, 0.6]\nirradiance = 3".into(), albedo / PI * 3.0 * cosine),
        ("sun", "direction = [0, -4, 3]\nirradiance = 3\nangle = 60".into(), albedo / PI * 3.0 * cosine),
        ("sun", "direction = [0, -1, 0]\nirradiance = 3\nangle = 0.01".into(), albedo / PI * 3.0),
    ] {
        let scene = floor(&light(kind, &keys));
        for method in ["direct", "path"] {
            let (value, error) = mean(&scene, &[&format!("method.name={method}")], 256);
            println!("{kind} {keys:?} by {method}: {value} ±{error}, wanted {wanted}");
            assert!(error <= 5e-3 * wanted, "{kind} {keys:?} by {method}: {value} ±{error}");
            assert!(
                (value - wanted).abs() <= 5.0 * error + 2e-5 * wanted,
                "{kind} {keys:?} by {method}: {value} ±{error}, {wanted}"
            );
        }
    }
}

/// The disk of a sun seen by the camera has E / (π sin²) of radiance, and nothing is beside it.
#[test]
fn a_sun_is_seen_as_a_disk() {
    let sun = light("sun", "direction = [0, 0, 1]\nirradiance = [3, 2, 1]\nangle = 20");
    let scene = camera([0.0; 3], [0.0, 0.0, -1.0], 10.0, [8, 8])
        + &rectangle("behind", [0.0, 0.0, 9.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], "matt")
        + &diffuse("matt", 0.5)
        + &sun;
    let options = Options { spp: Some(1), ..Options::default() };
    let picture = marmor::render(&file(&scene), &options).unwrap();
    let radiance = 3.0 / (PI * 10.0_f64.to_radians().sin().powi(2));
    for (value, share) in channels(&picture.image).into_iter().zip([1.0, 2.0 / 3.0, 1.0 / 3.0]) {
        assert!((value / radiance / share - 1.0).abs() < 1e-5, "{value} {radiance}");
    }
    let beside = file(&scene).with(&["camera.look_at=[0,1,-1]"]).unwrap();
    assert_eq!(channels(&marmor::render(&beside, &options).unwrap().image), [0.0; 3]);
}

/// A ball of wax over a matt floor, seen from the side: half of what is seen is lit.
fn ball(rest: &str) -> String {
    camera([6.0, 2.0, 0.0], [0.0; 3], 25.0, [8, 8])
        + &sphere("ball", [0.0; 3], 1.0, 12, "wax")
        + &rectangle("floor", [0.0, -1.2, 0.0], [0.0, 0.0, 3.0], [3.0, 0.0, 0.0], "matt")
        + &translucent("wax", WAX)
        + &diffuse("matt", 0.5)
        + rest
}

const METHODS: [(&str, u32); 4] = [
    ("specular=false,name=subsurface,cache_samples=8192", 8),
    ("specular=false,name=subsurface,shape=walked,cache_samples=8192", 6),
    ("specular=false,name=subsurface,bounces=0,cache_samples=8192", 8),
    ("specular=false,name=volume_path", 24),
];

fn by(method: &str) -> Vec<String> {
    method.split(',').map(|set| format!("method.{set}")).collect()
}

/// Places and directions are the limits of small lamps: of a small ball, and of a rectangle far away; a sun is the same as a
/// rectangle that it would cover, but for mirror images, which only lights with a size have. By models, walks and paths, to 4 standard errors.
#[test]
fn lights_without_surface_are_limits_of_lamps() {
    let lamp = |text: String, radiance: f64| text + &emissive("lamp", radiance);
    // I = L π r², of a polyhedron nearly so; E = L A / d².
    let small = lamp(sphere("small", [1.0, 3.0, 2.0], 0.05, 64, "lamp"), 40.0 / (PI * 0.0025));
    let far = |side: f64| {
        let d = [0.0, 0.6 * 5000.0, 0.8 * 5000.0];
        let u = [0.0, -0.8 * side, 0.6 * side];
        lamp(rectangle("far", d, u, [-side, 0.0, 0.0], "lamp"), 3.0 * (5000.0 / (2.0 * side)).powi(2))
    };
    for (one, others) in [
        (small, vec![light("point", "position = [1, 3, 2]\nintensity = 40")]),
        (
            far(20.0),
            vec![
                light("distant", "direction = [0, -0.6, -0.8]\nirradiance = 3"),
                light("sun", "direction = [0, -0.6, -0.8]\nirradiance = 3"),
            ],
        ),
    ] {
        for (method, spp) in METHODS {
            let set = by(method);
            let set: Vec<&str> = set.iter().map(String::as_str).collect();
            let lamp = mean(&ball(&one), &set, spp);
            for other in &others {
                let within = Within { errors: 4.0, noise: 0.06 };
                agree(
                    lamp,
                    mean(&ball(other), &set, spp),
                    within,
                    &format!("{} by {method}", other.lines().nth(1).unwrap()),
                );
            }
        }
    }
}

/// Light adds up: of wide suns that cover each other in part, before a bright sky, and of a spot.
#[test]
fn lights_add_up() {
    let suns = light("sun", "direction = [0, -0.6, -0.8]\nirradiance = 1\nangle = 110")
        + "[[light]]\nname = \"other\"\ntype = \"sun\"\ndirection = [0, -0.6, -0.4]\nirradiance = 1\nangle = 80\n";
    let spot = light("spot", "position = [1, 3, 2]\nlook_at = [0, 0, 0]\nintensity = 30");
    let lit = [sky(2.0), suns, spot];
    for (method, spp) in METHODS {
        let set = by(method);
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let alone = lit.iter().map(|light| mean(&ball(light), &set, spp));
        let sum = alone.fold((0.0, 0.0_f64), |(sum, error), (value, own)| (sum + value, error.hypot(own)));
        let together = mean(&ball(&lit.concat()), &set, spp);
        agree(sum, together, Within { errors: 4.0, noise: 0.02 }, method);
    }
}

/// Light scattered once beside a model: of a wide sun part is met by chance, whether or not there is a sky that paths go on for.
#[test]
fn a_wide_sun_in_a_black_sky_is_met_by_chance_too() {
    let sun = light("sun", "direction = [-0.6, -0.4, -0.7]\nirradiance = 2\nangle = 150");
    let text = |sky: &str| ball(&(sun.clone() + sky)).replace("model = \"standard\"", "model = \"better\"");
    let set = ["method.specular=false", "method.bounces=0", "method.cache_samples=8192"];
    let [black, faint] = [String::new(), sky(1e-6)].map(|sky| mean(&text(&sky), &set, 32));
    agree(black, faint, Within { errors: 4.0, noise: 0.01 }, "with a black sky and a faint one");
}

fn refused(text: &str) -> String {
    let scene = SceneFile::parse(text, Path::new("scene.toml"));
    let loaded =
        scene.and_then(|file| marmor::render(&file, &Options { spp: Some(1), ..Options::default() }).map(drop));
    loaded.unwrap_err().to_string()
}

#[test]
fn what_cannot_be_right_is_refused() {
    for (lights, words) in [
        (light("point", "position = [0.1, 0.2, 0]\nintensity = 1"), vec!["inside object \"ball\"", "emissive sphere"]),
        (light("sun", "direction = [0, 0, 0]\nirradiance = 1"), vec!["direction", "not all 0"]),
        (light("sun", "direction = [0, -1, 0]\nirradiance = 1\nangle = 0"), vec!["angle", "type = \"distant\""]),
        (light("spot", "position = [0, 5, 0]\nlook_at = [0, 5, 0]\nintensity = 1"), vec!["look_at", "same point"]),
        (
            light("spot", "position = [0, 5, 0]\ndirection = [0, -1, 0]\nintensity = 1\npower = 1"),
            vec!["power", "remove one"],
        ),
        (light("torch", ""), vec!["torch", "sun, distant, point, spot"]),
        (light("point", "position = [0, 5, 0]\nintensity = -1"), vec!["intensity", "negative"]),
        (
            light("distant", "direction = [0, -1, 0]\nirradiance = 1") + "[method]\nentry = \"cosine\"\n",
            vec!["cosine", "distant"],
        ),
    ] {
        let said = refused(&ball(&lights));
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    }
    let twice = light("sun", "direction = [0, -1, 0]\nirradiance = 1").repeat(2);
    assert!(refused(&ball(&twice)).contains("is taken"));
}

/// Behind glass a light without size is met by no path: that is said before the render.
#[test]
fn lights_without_size_behind_clear_bodies_are_told() {
    let glass =
        sphere("glass", [0.0, 3.0, 0.0], 0.5, 12, "glass") + "[material.glass]\ntype = \"dielectric\"\neta = 1.5\n";
    let warned = |lights: &str| {
        let scene = file(&ball(&(glass.clone() + lights))).with(&["method.name=volume_path"]).unwrap();
        let picture = marmor::render(&scene, &Options { spp: Some(1), ..Options::default() }).unwrap();
        picture.remarks.iter().any(|remark| remark.contains("no size") && remark.contains("glass"))
    };
    assert!(warned(&light("distant", "direction = [0, -1, 0]\nirradiance = 1")));
    assert!(warned(&light("point", "position = [0, 6, 0]\nintensity = 1")));
    assert!(!warned(&light("sun", "direction = [0, -1, 0]\nirradiance = 1")));
    assert!(Scene::load(&file(&ball(&glass))).unwrap().is_dark());
}

/// A room without a lamp in it is black inside, and that is said; with a point of light it is neither.
#[test]
fn a_point_lights_a_closed_room() {
    let room = camera([0.0, 0.0, 0.5], [0.0; 3], 40.0, [4, 4])
        + &sphere("room", [0.0; 3], 2.0, 16, "matt")
        + &diffuse("matt", 0.5);
    let seen = |lights: &str| {
        let options = Options { spp: Some(16), ..Options::default() };
        let picture =
            marmor::render(&file(&(room.clone() + lights)).with(&["method.name=path"]).unwrap(), &options).unwrap();
        let black = picture.remarks.iter().any(|remark| remark.contains("no lamp is in it"));
        (channels(&picture.image)[0], black)
    };
    let sun = light("sun", "direction = [0, -1, 0]\nirradiance = 1");
    let (dark, said) = seen(&sun);
    assert!(dark == 0.0 && said);
    // All walls see the light at their distance: albedo/π I/d² / (1 - albedo), but for facets that lie a little nearer.
    let (lit, said) = seen(&light("point", "position = [0, 0, 0]\nintensity = 8"));
    let wanted = 0.5 / PI * 8.0 / 4.0 / 0.5;
    assert!((lit / wanted - 1.0).abs() < 0.1 && !said, "{lit} {wanted}");
}
