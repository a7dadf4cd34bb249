//! The box: three white walls, a red and a green one, blocks, a knot, and two luminous meshes: a star under the ceiling
//! and a ring on the back wall. The box is 100 mm wide, stands on y = 0 and is open towards +z.

use std::f64::consts::TAU;

use marmor::math::{DVec2, DVec3};

use crate::mesh::Mesh;
use crate::shapes::{cuboid, polar, tube};

const HALF: f64 = 50.0;

/// Floor, ceiling and back wall, facing inward.
pub fn room() -> Mesh {
    let mut mesh = corners();
    mesh.quad([0, 4, 5, 1]);
    mesh.quad([2, 3, 7, 6]);
    mesh.quad([0, 1, 3, 2]);
    mesh
}

/// The left wall, at negative x, facing inward.
pub fn left() -> Mesh {
    one_wall([0, 2, 6, 4])
}

/// The right wall, facing inward.
pub fn right() -> Mesh {
    one_wall([1, 5, 7, 3])
}

fn corners() -> Mesh {
    let mut mesh = cuboid(DVec2::splat(HALF), 0.0, 2.0 * HALF);
    mesh.triangles.clear();
    mesh
}

fn one_wall(face: [u32; 4]) -> Mesh {
    let mut mesh = corners();
    mesh.quad(face);
    mesh.drop_unused_vertices();
    mesh
}

/// A tall and a low block, both turned a little.
pub fn blocks() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add(&cuboid(DVec2::splat(14.0), 0.0, 54.0), |p| p.rotate_y(0.30) + DVec3::new(-17.0, 0.0, -15.0));
    mesh.add(&cuboid(DVec2::splat(15.0), 0.0, 22.0), |p| p.rotate_y(-0.28) + DVec3::new(19.0, 0.0, 8.0));
    mesh
}

/// A trefoil knot that stands on the low block.
pub fn knot() -> Mesh {
    let curve = |t: f64| {
        let a = TAU * t;
        let r = 7.0 + 3.4 * (3.0 * a).cos();
        DVec3::new(r * (2.0 * a).sin(), r * (2.0 * a).cos(), 4.2 * (3.0 * a).sin())
    };
    let mut mesh = Mesh::default();
    let knot = tube(curve, 2.1, 240, 28);
    let lowest = knot.positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    mesh.add(&knot, |p| (p - DVec3::Y * lowest).rotate_y(-0.28) + DVec3::new(19.0, 22.0, 8.0));
    mesh.creased(60.0)
}

/// A flat star of eight points just under the ceiling, facing down.
pub fn star() -> Mesh {
    const POINTS: usize = 8;
    const Y: f64 = 2.0 * HALF - 1.5;
    const FORWARD: f64 = 16.0;
    let mut mesh = Mesh::default();
    let centre = mesh.vertex(DVec3::new(0.0, Y, FORWARD));
    for k in 0..2 * POINTS {
        let radius = if k % 2 == 0 { 26.0 } else { 13.0 };
        mesh.vertex(polar(radius, (k as f64 + 1.0) / (2 * POINTS) as f64 * TAU, Y) + DVec3::Z * FORWARD);
    }
    let n = 2 * POINTS as u32;
    mesh.triangles.extend((0..n).map(|k| [centre, 1 + (k + 1) % n, 1 + k]));
    mesh
}

/// A flat ring on the back wall, facing the open side.
pub fn ring() -> Mesh {
    const SEGMENTS: u32 = 96;
    let centre = DVec3::new(16.0, 66.0, -HALF + 1.0);
    let mut mesh = Mesh::default();
    for s in 0..SEGMENTS {
        let direction = DVec2::from_angle(f64::from(s) / f64::from(SEGMENTS) * TAU).extend(0.0);
        mesh.vertex(centre + 13.0 * direction);
        mesh.vertex(centre + 16.0 * direction);
    }
    for s in 0..SEGMENTS {
        let (a, b) = (2 * s, 2 * ((s + 1) % SEGMENTS));
        mesh.quad([a, a + 1, b + 1, b]);
    }
    mesh
}
