//! The generator checks its solids on every run; here that the check sees what is wrong, that a known body comes out
//! right, and that the repository holds what the generator makes.

use std::f64::consts::PI;
use std::path::Path;

use marmor::math::{DVec2, DVec3};

use crate::mesh::Mesh;
use crate::polygonise::{Field, polygonise};
use crate::shapes::cuboid;
use crate::{CELL, LEAF, LEAST_TRIANGLES, describe, leaf, parts};

/// A torus around the y axis: radii 10 and 4 mm.
struct Torus;

impl Field for Torus {
    fn bounds(&self) -> (DVec3, DVec3) {
        (DVec3::new(-15.0, -5.0, -15.0), DVec3::new(15.0, 5.0, 15.0))
    }

    fn at(&self, p: DVec3) -> f64 {
        DVec2::new(p.x.hypot(p.z) - 10.0, p.y).length() - 4.0
    }
}

#[test]
fn a_torus_is_closed_on_its_surface_and_has_its_volume() {
    let mesh = polygonise(&Torus, 0.6);
    let summary = mesh.check_solid().unwrap();
    let farthest = mesh.positions.iter().map(|p| Torus.at(*p).abs()).fold(0.0, f64::max);
    assert!(farthest < 1e-3, "a vertex lies {farthest} mm off the surface");
    // Chords of length e cut about e²/8r off a circle of radius r: below 1 % here.
    let exact = 2.0 * PI * PI * 10.0 * 16.0;
    assert!((0.985..1.0).contains(&(summary.volume / exact)), "{} mm³ of {exact}", summary.volume);
    assert!(summary.smallest_angle > 15.0, "{} degrees", summary.smallest_angle);
    // Euler's count of a torus: vertices - edges + faces = 0, with three half edges a face.
    assert_eq!(2 * mesh.positions.len(), mesh.triangles.len());
}

#[test]
fn the_check_sees_each_fault() {
    let good = || cuboid(DVec2::ONE, 0.0, 2.0);
    assert!((good().check_solid().unwrap().volume - 8.0).abs() < 1e-9);
    let fault = |change: fn(&mut Mesh)| {
        let mut mesh = good();
        change(&mut mesh);
        mesh.check_solid().err().unwrap_or_default()
    };
    assert!(fault(|m| m.triangles.truncate(11)).contains("open edge"));
    assert!(fault(|m| m.triangles[0].swap(0, 1)).contains("the same way"));
    assert!(fault(|m| m.triangles.iter_mut().for_each(|t| t.swap(0, 1))).contains("inward"));
    assert!(fault(|m| m.positions[1] = m.positions[0]).contains("no area"));
    assert!(fault(|m| m.positions.push(DVec3::ONE)).contains("not one fan"));
    // Two boxes that share one corner.
    let pinched = fault(|m| {
        let other = m.clone();
        m.add(&other, |p| p + DVec3::splat(2.0));
        let (shared, doubled) = (7, 8);
        m.triangles.iter_mut().flatten().filter(|i| **i == doubled).for_each(|i| *i = shared);
        m.drop_unused_vertices();
    });
    assert!(pinched.contains("not one fan"), "{pinched}");
    let turned_normals = fault(|m| {
        m.normals.push(DVec3::Y);
        m.normal_triangles = vec![[0; 3]; 12];
    });
    assert!(turned_normals.contains("other side"));
}

/// Numbers may differ by a few units in the third decimal, where another system's sine rounds otherwise.
#[test]
fn the_repository_holds_what_the_generator_makes() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for part in parts(CELL) {
        describe(&part).unwrap();
        let stored = std::fs::read_to_string(scenes.join(part.path)).unwrap();
        let made = part.mesh.to_obj(part.title);
        assert_eq!(stored.lines().count(), made.lines().count(), "{}", part.path);
        for (a, b) in stored.lines().zip(made.lines()) {
            let close = |(x, y): (&str, &str)| match (x.parse::<f64>(), y.parse::<f64>()) {
                (Ok(x), Ok(y)) => (x - y).abs() < 0.004,
                _ => x == y,
            };
            let alike = a == b || a.split(' ').zip(b.split(' ')).all(close);
            assert!(alike, "{}: `{a}` is stored, `{b}` is made: run `cargo run --example make_scenes`", part.path);
        }
        if part.path == "lotus/lotus.obj" {
            assert!(part.mesh.triangles.len() >= LEAST_TRIANGLES);
        }
    }
    let file = std::io::BufReader::new(std::fs::File::open(scenes.join(LEAF)).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut stored = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut stored).unwrap();
    let far = stored.iter().zip(&leaf::picture().1).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    assert_eq!(far, 0, "{LEAF}: run `cargo run --example make_scenes`");
}
