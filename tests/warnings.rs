//! What is said of a scene before it is rendered: one cause, one warning, in numbers that can be read.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed

use marmor::scene::{Scene, SceneFile};
use std::path::Path;

const CUBE: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, 1.0, 1.0],
    [1.0, -1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, 1.0, 1.0],
];

/// Outwards.
const QUADS: [[usize; 4]; 6] = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];

fn triangles() -> Vec<[usize; 3]> {
    QUADS.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// A box of half the height `h`, of these triangles of its corners and of `more` after them.
fn cube(h: f64, triangles: &[[usize; 3]], more: &str) -> String {
    let corners: String = CUBE.iter().map(|[x, y, z]| format!("v {x} {y} {}\n", z * h)).collect();
    let faces: String = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).collect();
    corners + more + &faces
}

/// Triangles of their own corners, each off by some 1e-5.
fn soup(triangles: &[[usize; 3]]) -> String {
    let corner = |(i, k): (usize, usize)| {
        let off = |axis: usize| CUBE[k][axis] + 1e-5 * ((i * 7 + axis * 3) as f64).sin();
        format!("v {} {} {}\n", off(0), off(1), off(2))
    };
    let all: String = triangles.iter().flatten().copied().enumerate().map(corner).collect();
    all + &(0..triangles.len()).map(|t| format!("f {} {} {}\n", 3 * t + 1, 3 * t + 2, 3 * t + 3)).collect::<String>()
}

fn load(obj: &str, keys: &str, medium: &str, method: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), obj).unwrap();
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 12]\nlook_at = [0, 0, 0]\nfov = 40\nresolution = [8, 4]\n[[object]]\n\
         name = \"body\"\nmesh = \"m.obj\"\nmaterial = \"wax\"\n{keys}\n[material.wax]\ntype = \"translucent\"\neta = 1.3\n\
         {medium}\n[environment]\nradiance = 1\n[method]\nname = \"{method}\"\n"
    );
    Scene::load(&SceneFile::parse(&text, &folder.path().join("scene.toml")).unwrap()).unwrap()
}

const DENSE: &str = "sigma_s_prime = 60\nsigma_a = 0.02";

/// Each with its one warning under `subsurface`, and whether `volume_path` has a reason to refuse it.
#[test]
fn one_cause_has_one_warning() {
    let all = triangles();
    let mut one_turned = all.clone();
    one_turned[0].swap(1, 2);
    let turned: Vec<[usize; 3]> = all.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let twice = [&all[..], &all[..1]].concat();
    let cases: [(&str, String, &str, &str, bool); 10] = [
        ("a soup", soup(&all), "", "corners that should be one with others are not", true),
        ("a soup, smooth", soup(&all), "normals = \"smooth\"", "--repair welds them", true),
        ("a sheet", cube(1.0, &all[..2], ""), "", "an open sheet has no inside", true),
        ("an open box", cube(1.0, &all[2..], ""), "", "an open sheet has no inside", true),
        ("one face turned", cube(1.0, &one_turned, ""), "", "disagree about the outside along 3 edges", true),
        ("all turned", cube(1.0, &turned, ""), "", "its faces look inwards", true),
        ("a face twice", cube(1.0, &twice, ""), "", "1 of 13 triangles repeats another", true),
        ("no area", cube(1.0, &all, "") + "f 1 1 2\n", "", "1 of 13 triangles has no area", false),
        ("thinner than rounding", cube(1e-14, &all, ""), "", "encloses nothing", true),
        ("half a normal", cube(1.0, &all[1..], "vn 0 0 1\n") + "f 1//1 2//1 4\n", "", "1 face has normals at", false),
    ];
    for (name, obj, keys, words, refused) in &cases {
        let scene = load(obj, keys, DENSE, "subsurface");
        assert!(scene.warnings.len() == 1 && scene.warnings[0].contains(words), "{name}: {:#?}", scene.warnings);
        let refusals: Vec<String> = scene.obstacles().iter().filter_map(|o| o.refusal()).collect();
        assert_eq!(!refusals.is_empty(), *refused, "{name}: {refusals:?}");
        // Where the mesh can be welded, that is what both methods say.
        if name.starts_with("a soup") {
            assert!(refusals.len() == 1 && refusals[0].ends_with("--repair welds them"), "{refusals:?}");
        }
    }
}

/// Two causes have two: a sheet whose corners do not meet.
#[test]
fn a_sheet_in_pieces_is_unwelded_and_open() {
    let said = load(&soup(&triangles()[..2]), "", DENSE, "subsurface").warnings;
    assert!(said.len() == 2 && said[0].contains("--repair welds") && said[1].contains("an open sheet"), "{said:#?}");
    assert!(said[1].contains("4 edges belong to one triangle alone"), "{said:#?}");
}

/// Models are not spoken of where none is used, nor where light hardly meets the body.
#[test]
fn what_no_one_can_act_on_is_not_said() {
    let dark = "sigma_s_prime = 1\nsigma_a = 30\nmodel = \"standard\"";
    let whole = cube(1.0, &triangles(), "");
    assert!(load(&whole, "", dark, "subsurface").warnings.join("").contains("every BSSRDF model errs"));
    assert_eq!(load(&whole, "", dark, "volume_path").warnings, Vec::<String>::new());
    assert_eq!(load(&whole, "", dark, "direct").warnings, Vec::<String>::new());
    let clear = load(&whole, "", "sigma_s_prime = 0.01\nsigma_a = 1e-4", "subsurface").warnings;
    assert!(clear.len() == 1 && clear[0].contains("it will look almost empty"), "{clear:#?}");
    let glass = "sigma_s_prime = 0\nsigma_a = 0";
    let said = load(&whole, "", glass, "subsurface").warnings;
    assert!(said.len() == 1 && said[0].contains("no light comes back there"), "{said:#?}");
    // Light goes through it.
    assert_eq!(load(&whole, "", glass, "volume_path").warnings, Vec::<String>::new());
}

#[test]
fn thin_bodies_have_their_thickness_said() {
    for (h, words) in [(1e-3, "0.002 units thick, 0.004"), (1e-5, "2e-5 units thick, 4.04e-5 transport")] {
        let medium = "sigma_s_prime = 2\nsigma_a = 0.02\nmodel = \"standard\"";
        let said = load(&cube(h, &triangles(), ""), "", medium, "subsurface").warnings;
        assert!(said.len() == 1 && said[0].contains(words), "{said:#?}");
    }
}

/// A `1` before a plural, in all that is said of meshes with one fault of each kind.
#[test]
fn one_of_a_kind_is_singular() {
    let all = triangles();
    let odd = "v 5 5 5 1 0\nv 6 5 5 2\nvertex 1 2 3\np 1\ncurv 0 1 1 2\n";
    let bad = odd.to_string() + "f 1 1 2\nf 5 6 8\nf 3 4 8 2\nf 2//1 4//1 8\n";
    let fin = "v 3 0 0\n".to_string();
    let mut said = load(&(cube(1.0, &all, "vn 0 0 1\n") + &bad), "", DENSE, "subsurface").warnings;
    let finned = load(&(cube(1.0, &all, &fin) + "f 7 8 9\n"), "", DENSE, "subsurface");
    said.extend(finned.obstacles().iter().filter_map(|o| o.refusal()));
    said.extend(finned.warnings.iter().cloned());
    let text = said.join("\n");
    for part in [
        "1 vertex has further",
        "1 vertex has a fourth",
        "1 line begins",
        "1 free-form curve or surface is",
        "1 edge belongs",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    for pair in words.windows(2).filter(|pair| pair[0] == "1") {
        assert!(!pair[1].ends_with('s') && pair[1] != "vertices", "{pair:?} in {text}");
    }
}

/// Our own scenes say nothing but what a user may act on: of the lotus, that its petals are thin for a model that is all there is.
#[test]
fn the_scenes_of_the_project_load_without_a_word_too_many() {
    for (name, expected, shape) in
        [("box", 0, "walked"), ("tholos", 0, "walked"), ("lotus", 0, "walked"), ("lotus", 1, "half-space")]
    {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml");
        let said = {
            let file = SceneFile::read(&path).unwrap().with(&[format!("method.shape={shape}")]).unwrap();
            Scene::load(&file).unwrap().warnings
        };
        assert!(said.len() == expected && said.iter().all(|w| w.contains("model of a half space")), "{said:#?}");
    }
}
