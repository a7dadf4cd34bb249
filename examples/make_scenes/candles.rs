//! Candles that burn: the walls around the melted wax are thin, and let the flame through. Standing on y = 0.

use std::f64::consts::{PI, TAU};

use crate::mesh::Mesh;
use crate::shapes::turned;

/// Three candles: radius, height, depth of the hollow, all in mm, and how far the rim has sunk on one side as a share of the depth.
pub const CANDLES: [[f64; 4]; 3] = [[19.0, 62.0, 13.0, 0.35], [16.0, 38.0, 11.0, 0.6], [23.0, 24.0, 9.0, 0.25]];

/// The candle number `which` of [`CANDLES`], its axis on the y axis.
pub fn candle(which: usize) -> Mesh {
    let [radius, height, depth, sunk] = CANDLES[which];
    let (wall, bend) = (3.2, 1.4);
    let arc = |centre: [f64; 2], r: f64, from: f64, to: f64| {
        (0..=8).map(move |k| {
            let a = from + (to - from) * f64::from(k) / 8.0;
            [centre[0] + r * a.cos(), centre[1] + r * a.sin()]
        })
    };
    let inner = radius - wall;
    let mut profile: Vec<[f64; 2]> = arc([radius - bend, bend], bend, -0.5 * PI, 0.0).collect();
    profile.extend((1..=9).map(|k| [radius, bend + (height - 2.0 * bend) * f64::from(k) / 10.0]));
    profile.extend(arc([radius - 0.5 * wall, height - 0.5 * wall], 0.5 * wall, 0.0, PI));
    profile.extend((1..=4).map(|k| [inner, height - 0.5 * wall - (depth - 6.0) * f64::from(k) / 5.0]));
    profile.extend(arc([inner - 4.0, height - depth + 4.0], 4.0, 0.0, -0.5 * PI));
    let mut mesh = Mesh::default();
    let phase = which as f64 * 2.1;
    mesh.add(&turned(&profile, 144, |_, _| 1.0), |p| {
        let azimuth = p.z.atan2(p.x);
        // The rim has burnt down more on one side, and the wax has run.
        let up = ((p.y - (height - depth)) / depth).clamp(0.0, 1.0);
        let dip = sunk * depth * up * up * (0.5 + 0.5 * (azimuth - phase).cos()).powi(2);
        let runs = 0.45 * (7.0 * azimuth + phase).sin() * (3.0 * azimuth + 2.0 * phase).cos();
        let out = p.x.hypot(p.z);
        let swell = if out > radius - 0.5 * wall { runs * (TAU * 0.5 * p.y / height).sin() } else { 0.0 };
        let scale = if out > 0.0 { (out + swell) / out } else { 1.0 };
        marmor::math::DVec3::new(p.x * scale, p.y - dip, p.z * scale)
    });
    mesh.creased(50.0)
}
