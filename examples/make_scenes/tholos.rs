//! The occlusion study: a small round temple. Steps and mouldings give long creases, flutes and dentils fine crevices,
//! the hall between columns and urn a dark inside under an open roof. 100 mm high, standing on y = 0.

use std::f64::consts::{PI, TAU};

use marmor::math::{DVec2, DVec3};

use crate::mesh::Mesh;
use crate::shapes::{cuboid, ring, turned};

const COLUMNS: usize = 8;
/// Radius of the circle of columns [mm].
const CIRCLE: f64 = 40.0;
/// Parts that stand on each other overlap by this much [mm], so that no two faces coincide.
const OVERLAP: f64 = 0.2;

/// The whole temple, and a drum of a fallen column before it.
pub fn tholos() -> Mesh {
    let plain = |_: f64, _: f64| 1.0;
    let mut mesh = Mesh::default();
    let stay = |p: DVec3| p;
    let steps = [[62.0, 0.0], [62.0, 4.5], [56.0, 4.5], [56.0, 9.0], [50.0, 9.0], [50.0, 13.5]];
    mesh.add(&turned(&steps, 128, plain), stay);
    let column = column();
    for k in 0..COLUMNS {
        // A gap between two columns faces +z.
        let azimuth = (k as f64 + 0.5) / COLUMNS as f64 * TAU + 0.5 * PI;
        mesh.add(&column, |p| (p + DVec3::X * CIRCLE).rotate_y(azimuth));
    }
    entablature(&mut mesh);
    mesh.add(&urn(), |p| p + DVec3::Y * (13.5 - OVERLAP));
    let drum = turned(&[[3.9, -9.0], [3.9, 9.0]], 96, fluted);
    mesh.add(&drum, |p| DVec3::new(p.y, p.x + 3.5, -p.z).rotate_y(0.55) + DVec3::new(47.0, 0.0, 58.0));
    mesh.creased(38.0)
}

/// Sixteen flutes with narrow ridges between them.
fn fluted(azimuth: f64, _y: f64) -> f64 {
    1.0 - 0.13 * (8.0 * azimuth).sin().abs().sqrt()
}

/// A column on the top step, its axis on the y axis.
fn column() -> Mesh {
    const FOOT: f64 = 13.5 - OVERLAP;
    let plain = |_: f64, _: f64| 1.0;
    let mut mesh = Mesh::default();
    mesh.add(&cuboid(DVec2::splat(6.3), FOOT, 15.5), |p| p);
    // Two rolls with a hollow between.
    let bulge = |y: f64, r: f64, height: f64| {
        (0..=6).map(move |k| {
            let a = f64::from(k) / 6.0 * PI;
            [r + 0.5 * height * a.sin(), y + 0.5 * height * (1.0 - a.cos())]
        })
    };
    let base: Vec<[f64; 2]> = bulge(15.3, 4.9, 2.2).chain(bulge(17.7, 4.3, 1.6)).collect();
    mesh.add(&turned(&base, 48, plain), |p| p);
    let shaft: Vec<[f64; 2]> = (0..=8)
        .map(|k| {
            let t = f64::from(k) / 8.0;
            [4.25 - 0.75 * t * t, 19.1 + 46.4 * t]
        })
        .collect();
    mesh.add(&turned(&shaft, 96, fluted), |p| p);
    let capital =
        [[3.3, 65.2], [3.9, 65.2], [3.9, 66.0], [3.5, 66.2], [3.6, 67.0], [4.3, 68.2], [5.4, 69.2], [6.0, 69.6]];
    mesh.add(&turned(&capital, 48, plain), |p| p);
    mesh.add(&cuboid(DVec2::splat(6.3), 69.4, 72.0), |p| p);
    mesh
}

/// The beam over the columns, a row of dentils, the cornice and the tiled roof with its round opening.
fn entablature(mesh: &mut Mesh) {
    let still = |_: usize, _: f64| DVec2::ZERO;
    let beam = [[34.8, 71.8], [45.0, 71.8], [45.0, 74.2], [45.5, 74.2], [45.5, 77.0], [34.8, 77.0]];
    mesh.add(&ring(&beam, 128, still), |p| p);
    // A tooth is three segments of five wide; steep flanks from the two others.
    const TEETH: usize = 60;
    let tooth = |k: usize, azimuth: f64| {
        let place = (azimuth / TAU * (TEETH * 6) as f64).round() as usize % 6;
        DVec2::new(if (k == 1 || k == 2) && place < 3 { 2.2 } else { 0.0 }, 0.0)
    };
    let dentils = [[36.0, 76.8], [45.2, 76.8], [45.2, 79.8], [36.0, 79.8]];
    mesh.add(&ring(&dentils, TEETH * 6, tooth), |p| p);
    let cornice = [[34.0, 79.6], [48.6, 79.6], [49.0, 80.6], [50.6, 81.4], [50.6, 83.0], [34.0, 83.0]];
    mesh.add(&ring(&cornice, 128, still), |p| p);
    // Tiles: rounded ribs that run up to the opening.
    const RIBS: f64 = 36.0;
    let rib = |k: usize, azimuth: f64| {
        let height = 1.3 * (0.5 * RIBS * azimuth).cos().abs().powi(3);
        DVec2::new(0.0, if k == 2 || k == 3 { height } else { 0.0 })
    };
    let roof = [[21.0, 93.0], [48.0, 82.8], [49.0, 84.2], [19.6, 95.8]];
    mesh.add(&ring(&roof, 36 * 10, rib), |p| p);
    let collar: Vec<[f64; 2]> = (0..16)
        .map(|k| {
            let a = f64::from(k) / 16.0 * TAU;
            [20.2 + 2.1 * a.cos(), 95.2 + 2.1 * a.sin()]
        })
        .collect();
    mesh.add(&ring(&collar, 128, still), |p| p);
}

/// An urn with a rolled lip.
fn urn() -> Mesh {
    let profile = [
        [7.5, 0.0],
        [7.5, 1.8],
        [6.0, 2.2],
        [4.2, 3.6],
        [3.4, 5.4],
        [3.4, 6.4],
        [4.4, 6.8],
        [4.4, 7.6],
        [6.6, 9.2],
        [9.6, 12.6],
        [11.6, 17.0],
        [12.0, 21.0],
        [11.0, 25.0],
        [8.6, 28.4],
        [6.6, 30.4],
        [6.0, 32.2],
        [6.6, 33.8],
        [8.4, 34.8],
        [8.6, 35.6],
        [7.8, 36.0],
        [5.2, 33.4],
        [4.6, 31.0],
    ];
    turned(&profile, 72, |_, _| 1.0)
}
