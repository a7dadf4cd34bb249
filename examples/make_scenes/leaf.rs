//! A leaf as an open mesh with texture coordinates, the picture of its colours and veins, and a twig. In millimetres, the leaf's base at the
//! origin, its tip towards +y; the picture shows x and y as they are.

use std::f64::consts::{PI, TAU};

use marmor::math::DVec3;

use crate::mesh::Mesh;
use crate::shapes::turned;

/// What the picture shows: the least and the largest x and y [mm].
const FRAME: [[f64; 2]; 2] = [[-30.0, 30.0], [-32.0, 92.0]];
/// Pixels a millimetre.
const SCALE: f64 = 7.0;
const LENGTH: f64 = 90.0;
const STALK: f64 = 30.0;

/// Half of the width at a height.
fn half_width(y: f64) -> f64 {
    let t = (y / LENGTH).clamp(0.0, 1.0);
    let blade = 27.0 * (PI * t.powf(0.8)).sin().max(0.0) * (1.0 - 0.2 * t);
    // Teeth lean to the tip.
    let tooth = (t * 21.0).fract();
    let teeth = 1.0 - 0.045 * (1.0 - tooth).powi(2) * (PI * t).sin();
    let stalk = 0.7;
    (blade * teeth).hypot(stalk * (1.0 - t)) + 0.45
}

/// The middle of the leaf: folded along the midrib, bent over, wavy at its rim.
pub fn leaf() -> Mesh {
    let (rows, columns) = (220_u32, 28_u32);
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        let y = -STALK + (STALK + LENGTH) * f64::from(row) / f64::from(rows);
        let w = half_width(y);
        for column in 0..=columns {
            let s = 2.0 * f64::from(column) / f64::from(columns) - 1.0;
            let x = s * w;
            let t = y / LENGTH;
            let fold = 0.28 * ((x * x + 12.0).sqrt() - 12.0_f64.sqrt());
            let bend = -9.0 * t * t + 1.5 * (3.0 * t).sin();
            let wave = 1.1 * (x / 26.0).powi(2) * (TAU * 3.3 * t + if s > 0.0 { 1.0 } else { 0.0 }).sin();
            mesh.vertex(DVec3::new(x, y, fold + bend + wave));
            mesh.uv.push(
                [x, y]
                    .iter()
                    .zip(FRAME)
                    .map(|(v, [a, b])| (v - a) / (b - a))
                    .collect::<Vec<_>>()
                    .try_into()
                    .unwrap_or_default(),
            );
        }
    }
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let a = row * (columns + 1) + column;
        mesh.quad([a, a + 1, a + columns + 2, a + columns + 1]);
    }
    mesh
}

/// A twig along the y axis.
pub fn twig() -> Mesh {
    let profile: Vec<[f64; 2]> = (0..=60)
        .map(|k| (f64::from(k) * 4.0, f64::from(k)))
        .map(|(y, k)| [2.3 - 0.004 * y + 0.25 * (k * 0.7).sin().powi(6), y])
        .collect();
    let mut mesh = Mesh::default();
    mesh.add(&turned(&profile, 32, |_, _| 1.0), |p| {
        let bend = 5.0 * (p.y / 110.0).sin();
        DVec3::new(p.x + bend, p.y, p.z + 2.0 * (p.y / 37.0).cos())
    });
    mesh.creased(50.0)
}

/// A number in [0, 1) of a place on a grid.
fn grain(x: i64, y: i64, salt: u64) -> f64 {
    let mut h = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ salt.wrapping_mul(0x1656_67b1_9e37_79f9);
    for _ in 0..2 {
        h = (h ^ (h >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    ((h ^ (h >> 29)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Smooth noise of wavelength 1, in [0, 1].
fn noise(x: f64, y: f64, salt: u64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (u, v) = (smooth(x - i), smooth(y - j));
    let at = |di: i64, dj: i64| grain(i as i64 + di, j as i64 + dj, salt);
    (at(0, 0) * (1.0 - u) + at(1, 0) * u) * (1.0 - v) + (at(0, 1) * (1.0 - u) + at(1, 1) * u) * v
}

/// How much farther the second nearest of scattered points is than the nearest, in cells of edge 1.
fn cracks(x: f64, y: f64, salt: u64) -> f64 {
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let (mut first, mut second) = (f64::INFINITY, f64::INFINITY);
    for (di, dj) in (-2..=2).flat_map(|di| (-2..=2).map(move |dj| (di, dj))) {
        let (a, b) = (i + di, j + dj);
        let p = [a as f64 + 0.1 + 0.8 * grain(a, b, salt), b as f64 + 0.1 + 0.8 * grain(a, b, salt + 1)];
        let d = (p[0] - x).hypot(p[1] - y);
        if d < first {
            (first, second) = (d, first);
        } else {
            second = second.min(d);
        }
    }
    second - first
}

/// 1 in the middle of a line of half width `half`, 0 beyond it.
fn line(distance: f64, half: f64) -> f64 {
    let t = (1.0 - distance.abs() / half).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// Colour of a place, linear.
fn colour(x: f64, y: f64) -> [f64; 3] {
    let t = (y / LENGTH).clamp(0.0, 1.0);
    let rim = (x.abs() / half_width(y)).min(1.2);
    // Autumn comes from the rim.
    let age = 0.75 * rim.powi(2)
        + 0.55 * t.powi(3)
        + 0.9 * (noise(x / 13.0, y / 13.0, 3) - 0.5)
        + 0.35 * (noise(x / 3.1, y / 3.1, 5) - 0.5);
    let (green, yellow, red) = ([0.24, 0.46, 0.03], [0.82, 0.6, 0.05], [0.72, 0.16, 0.03]);
    let mut c = if age < 0.55 {
        mix(green, yellow, (age / 0.55).clamp(0.0, 1.0))
    } else {
        mix(yellow, red, ((age - 0.55) / 0.6).clamp(0.0, 1.0))
    };
    // Freckles.
    let freckle = noise(x / 1.3, y / 1.3, 11);
    c = mix(c, [0.3, 0.12, 0.03], ((freckle - 0.86) * 9.0).clamp(0.0, 0.8) * rim.min(1.0));
    let warp = 0.8 * (noise(x / 4.0, y / 4.0, 21) - 0.5);
    let net = line(cracks((x + warp) / 4.2, (y - 0.7 * x.abs() + warp) / 2.6, 31), 0.2)
        .max(0.6 * line(cracks(x / 1.25, y / 1.25, 41), 0.22));
    let vein = [0.9, 0.8, 0.3];
    c = mix(c, vein, 0.42 * net);
    // Side veins, those of the left between those of the right.
    let mut strong: f64 = 0.0;
    for i in 0..11 {
        let start =
            2.0 + 7.6 * f64::from(i) + if x < 0.0 { 3.4 } else { 0.0 } + 1.6 * grain(i.into(), i64::from(x < 0.0), 51);
        let (a, b) = (0.95 - 0.035 * f64::from(i), 0.013);
        let along = x.abs();
        let path = start + a * along + b * along * along;
        let slope = a + 2.0 * b * along;
        let reach = (1.0 - along / (half_width(path) + 0.5)).clamp(0.0, 1.0);
        let wobble = 0.25 * (noise(along / 3.0, f64::from(i) * 7.0, 61) - 0.5);
        strong = strong.max(line((y - path) / slope.hypot(1.0) + wobble, 0.12 + 0.5 * reach) * reach.sqrt().min(1.0));
    }
    c = mix(c, vein, 0.85 * strong);
    let midrib = line(x + 0.15 * (y / 9.0).sin(), 0.25 + 1.0 * (1.0 - t));
    c = mix(c, [0.88, 0.66, 0.28], 0.9 * midrib);
    if y < 0.0 { mix(c, [0.55, 0.3, 0.12], (-y / 6.0).clamp(0.0, 1.0)) } else { c }
}

/// A picture: [width, height], and RGB of 8 bits in sRGB from the top down.
pub type Picture = ([u32; 2], Vec<u8>);

/// The leaf's colours.
pub fn picture() -> Picture {
    let [width, height] = FRAME.map(|[a, b]| ((b - a) * SCALE) as u32);
    let mut codes = Vec::with_capacity(3 * (width * height) as usize);
    for row in 0..height {
        for column in 0..width {
            let x = FRAME[0][0] + (f64::from(column) + 0.5) / SCALE;
            let y = FRAME[1][1] - (f64::from(row) + 0.5) / SCALE;
            let code = |v: f64| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
            codes.extend(colour(x, y).map(|v| (255.0 * code(v.clamp(0.0, 1.0))).round() as u8));
        }
    }
    ([width, height], codes)
}
