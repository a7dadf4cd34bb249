//! An openwork ball: a shell of a ball, cut out of a gyroid, as carvers make them of jade. Its middle is the origin.

use marmor::math::DVec3;

use crate::mesh::Mesh;
use crate::polygonise::Field;
use crate::shapes::ring;

/// Outer and inner radius of the shell [mm].
const SHELL: [f64; 2] = [30.0, 23.0];
/// Period of the gyroid [mm].
const PERIOD: f64 = 22.0;
/// Thickness of its walls [mm].
const WALL: f64 = 3.4;
/// Edges are rounded by about this [mm].
const ROUND: f64 = 1.4;

/// The field of the ball.
pub struct Openwork;

/// The larger of two values, rounded where they are near.
fn larger(a: f64, b: f64) -> f64 {
    let h = (ROUND - (a - b).abs()).max(0.0) / ROUND;
    a.max(b) + 0.25 * h * h * ROUND
}

impl Field for Openwork {
    fn bounds(&self) -> (DVec3, DVec3) {
        let far = DVec3::splat(SHELL[0] + 4.0);
        (-far, far)
    }

    fn at(&self, p: DVec3) -> f64 {
        let q = p * (std::f64::consts::TAU / PERIOD);
        let g = q.x.sin() * q.y.cos() + q.y.sin() * q.z.cos() + q.z.sin() * q.x.cos();
        // Its gradient is 1.2 to 1.7 on the surface, in units of the wave number.
        let wall = g.abs() * PERIOD / std::f64::consts::TAU / 1.45 - 0.5 * WALL;
        let r = p.length();
        larger(larger(wall, r - SHELL[0]), SHELL[1] - r)
    }
}

/// A turned ring on y = 0 that the ball stands in.
pub fn stand() -> Mesh {
    let section: Vec<[f64; 2]> = (0..24)
        .map(|k| {
            let a = f64::from(k) / 24.0 * std::f64::consts::TAU;
            [15.5 + 3.4 * a.cos().powi(3).mul_add(0.25, 0.75 * a.cos()), 3.0 + 3.0 * a.sin()]
        })
        .collect();
    ring(&section, 128, |_, _| marmor::math::DVec2::ZERO).creased(60.0)
}
