//! Opaque surfaces in scenes: white ones lose no light, and lamps on them are worth what their formulas say, by every method.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

mod parts;
mod rendering;

use marmor::geometry::SurfacePoint;
use marmor::math::{DVec3, Rgb, Vec3};
use marmor::render::Options;
use marmor::scene::SceneFile;
use marmor::surface::{Bsdf, Conductor, METALS, OrenNayar, Plastic, Reflectance};
use parts::{camera, emissive, rectangle, sky, sphere, translucent};
use rendering::{channels, mean_of};
use std::path::Path;

fn file(text: &str) -> SceneFile {
    SceneFile::parse(text, Path::new("scene.toml")).unwrap()
}

/// Mean over the picture, channel by channel over six seeds, with its standard error.
fn means(text: &str, set: &[&str], spp: u32) -> [(f64, f64); 3] {
    let scene = file(text).with(set).unwrap();
    let run = |seed| {
        let options = Options { spp: Some(spp), seed: Some(seed), ..Options::default() };
        channels(&marmor::render(&scene, &options).unwrap().image)
    };
    let runs: Vec<[f64; 3]> = (1..=6).map(run).collect();
    std::array::from_fn(|c| mean_of(runs.iter().map(|run| run[c])))
}

fn material(keys: &str) -> String {
    format!("[material.own]\n{keys}\n")
}

const WHITE: [&str; 7] = [
    "type = \"diffuse\"\nalbedo = 1\nroughness = 0.8",
    "type = \"plastic\"\nalbedo = 1",
    "type = \"plastic\"\nalbedo = 1\nroughness = 0.4",
    "type = \"conductor\"\nreflectance = 1",
    "type = \"conductor\"\nreflectance = 1\nroughness = 0.2",
    "type = \"conductor\"\nreflectance = 1\nroughness = 0.6",
    "type = \"conductor\"\nreflectance = 1\nroughness = 1",
];

/// A ball and what it stands on, both white, under a sky of 1: all that is seen is 1, but where rounded normals lean behind triangles.
#[test]
fn white_surfaces_cannot_be_seen_under_a_white_sky() {
    for keys in WHITE {
        let scene = camera([0.0, 2.0, 6.0], [0.0; 3], 20.0, [8, 8])
            + &sphere("ball", [0.0; 3], 1.0, 48, "own")
            + "normals = \"geometric\"\n"
            + &rectangle("floor", [0.0, -1.0, 0.0], [0.0, 0.0, 3.0], [3.0, 0.0, 0.0], "own")
            + &material(keys)
            + &sky(1.0);
        for (c, (value, error)) in means(&scene, &["method.name=path"], 64).into_iter().enumerate() {
            assert!(
                error < 6e-3 && (value - 1.0).abs() < 3e-3 + 4.0 * error,
                "{keys} in channel {c}: {value} ±{error}"
            );
        }
    }
}

/// In a medium too: a metal ball in a cube that only scatters.
#[test]
fn white_surfaces_in_media_cannot_be_seen() {
    for keys in [WHITE[2], WHITE[3], WHITE[5]] {
        for eta in ["1.3", "1"] {
            let scene = camera([0.0, 1.0, 6.0], [0.0; 3], 14.0, [6, 6])
                + &sphere("ball", [0.0; 3], 0.6, 24, "own")
                + &sphere("milk", [0.0; 3], 1.0, 24, "milk")
                + &translucent("milk", &format!("sigma_s = 1.5\nsigma_a = 0\ng = 0\neta = {eta}"))
                + &material(keys)
                + &sky(1.0);
            let [(value, error), ..] = means(&scene, &["method.name=volume_path"], 64);
            assert!(error < 6e-3 && (value - 1.0).abs() < 3e-3 + 4.0 * error, "{keys}, eta {eta}: {value} ±{error}");
        }
    }
}

/// A floor under a lamp, seen from aside: ∫ f cosθ L dω over points of the lamp by the surface's own formula.
#[test]
fn lamps_on_surfaces_are_worth_what_the_formula_says() {
    let albedo = Rgb([0.2, 0.5, 0.8]);
    let kinds: [(&str, Box<dyn Bsdf>); 5] = [
        ("type = \"diffuse\"\nalbedo = [0.2, 0.5, 0.8]\nroughness = 0.7", Box::new(OrenNayar::new(albedo, 0.7))),
        ("type = \"plastic\"\nalbedo = [0.2, 0.5, 0.8]\nroughness = 0.4", Box::new(Plastic::new(albedo, 1.5, 0.4))),
        ("type = \"conductor\"\nmetal = \"gold\"\nroughness = 0.5", Box::new(Conductor::new(METALS[2].1, 0.5))),
        ("type = \"conductor\"\nmetal = \"gold\"\nroughness = 0.25", Box::new(Conductor::new(METALS[2].1, 0.25))),
        (
            "type = \"conductor\"\nreflectance = [0.2, 0.5, 0.8]\nroughness = 0.9",
            Box::new(Conductor::new(Reflectance::Normal(albedo), 0.9)),
        ),
    ];
    let (eye, lamp) = ([4.0, 3.0, 0.0], [-3.0, 4.0, 0.5]);
    for (keys, bsdf) in kinds {
        let scene = camera(eye, [0.0; 3], 0.02, [4, 4])
            + &rectangle("floor", [0.0; 3], [0.0, 0.0, 5.0], [5.0, 0.0, 0.0], "own")
            + &rectangle("lamp", lamp, [0.0, 0.0, 0.8], [-0.8, 0.0, 0.0], "lamp")
            + &material(keys)
            + &emissive("lamp", 3.0);
        let at = SurfacePoint { x: DVec3::ZERO, n_geometric: Vec3::Y, n: Vec3::Y, error: 0.0, uv: [0.0; 2] };
        let wo = Vec3::from_array(eye.map(|v| v as f32)).normalize();
        let (mut sum, steps) = ([0.0; 3], 200);
        for i in 0..steps * steps {
            let [u, v] = [i % steps, i / steps].map(|k| (f64::from(k) + 0.5) / f64::from(steps) * 1.6 - 0.8);
            let to = DVec3::new(lamp[0] + v, lamp[1], lamp[2] + u);
            let (w, square) = (to.normalize(), to.length_squared());
            let part = w.y * w.y / square * 3.0 * (1.6 / f64::from(steps)).powi(2);
            let f = bsdf.eval(&at, wo, w.as_vec3());
            (0..3).for_each(|c| sum[c] += f64::from(f[c]) * part);
        }
        // In a haze that is hardly there, with light straight through its boundary, the surface is asked in a medium.
        let haze = sphere("haze", [0.0; 3], 40.0, 8, "haze")
            + &translucent("haze", "sigma_s = 1e-7\nsigma_a = 0\ng = 0\neta = 1");
        for (method, around) in [
            ("name=direct", ""),
            ("name=direct,light_samples=8", ""),
            ("name=path", ""),
            ("name=path,bounces=0", ""),
            ("name=volume_path", ""),
            ("name=volume_path", &haze),
        ] {
            let scene = scene.clone() + around;
            let set: Vec<String> = method.split(',').map(|set| format!("method.{set}")).collect();
            let set: Vec<&str> = set.iter().map(String::as_str).collect();
            let found = means(&scene, &set, 1024);
            for c in 0..3 {
                let (value, error) = found[c];
                assert!(error < 0.01 * sum[c], "{keys} by {method}: {value} ±{error}");
                assert!(
                    (value - sum[c]).abs() < 5.0 * error + 1e-3 * sum[c],
                    "{keys} by {method}: {value} ±{error}, {}",
                    sum[c]
                );
            }
        }
    }
}

/// A mirror shows what is around it: a lamp by `direct`, and all else by paths; `subsurface` the same as `path`.
#[test]
fn mirrors_show_what_is_around() {
    let scene = |rest: &str| {
        camera([0.0, 4.0, 3.0], [0.0; 3], 0.5, [4, 4])
            + &rectangle("mirror", [0.0; 3], [0.0, 0.0, 5.0], [5.0, 0.0, 0.0], "own")
            + &rectangle("seen", [0.0, 4.0, -3.0], [1.0, 0.0, 0.0], [0.0, 0.6, 0.8], "seen")
            + &material("type = \"conductor\"\nmetal = \"silver\"")
            + rest
    };
    let silver = METALS.iter().find(|(name, _)| *name == "silver").unwrap().1.at(0.8);
    for method in ["direct", "path", "volume_path"] {
        let found = means(&scene(&emissive("seen", 2.0)), &[&format!("method.name={method}")], 4);
        (0..3).for_each(|c| assert!((found[c].0 - 2.0 * f64::from(silver[c])).abs() < 1e-4, "{method}: {found:?}"));
    }
    let wax = translucent("wax", parts::WAX) + &sphere("wax", [9.0, 0.0, 0.0], 0.5, 8, "wax");
    let rest = wax + &parts::diffuse("seen", 0.6) + &sky(1.0);
    let by = |method: &str, spp| means(&scene(&rest), &[method, "method.cache_samples=1024"], spp);
    let (by_paths, by_models) = (by("method.name=path", 128), by("method.name=subsurface", 128));
    for c in 0..3 {
        let (a, b) = (by_paths[c], by_models[c]);
        assert!((a.0 - b.0).abs() < 4.0 * a.1.hypot(b.1) && a.1.hypot(b.1) < 0.03 * a.0, "{by_paths:?} {by_models:?}");
    }
}

#[test]
fn what_makes_no_surface_is_refused() {
    for (keys, word) in [
        ("type = \"conductor\"", "metal"),
        ("type = \"conductor\"\nmetal = \"golden\"", "did you mean"),
        ("type = \"conductor\"\nmetal = \"gold\"\nreflectance = 1", "remove the others"),
        ("type = \"conductor\"\nn = 1", "one of `metal`"),
        ("type = \"conductor\"\nreflectance = 1.2", "from 0 to 1"),
        ("type = \"plastic\"\nalbedo = 0.5\nroughness = 2", "roughness"),
        ("type = \"plastic\"\nalbedo = 0.5\neta = 0.9", "eta"),
        ("type = \"mirror\"", "conductor"),
    ] {
        let scene = camera([0.0, 0.0, 6.0], [0.0; 3], 20.0, [4, 4])
            + &sphere("ball", [0.0; 3], 1.0, 8, "own")
            + &material(keys);
        let said = SceneFile::parse(&scene, Path::new("scene.toml")).unwrap_err().to_string();
        assert!(said.contains(word), "{keys}: {said}");
    }
}
