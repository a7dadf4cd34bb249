//! Solids with sharp edges, made of quadrilaterals: turned on a lathe, cut from a slab, swept along a curve.
//! Lengths in millimetres, y up; every solid is closed and faces outward.

use std::f64::consts::TAU;

use marmor::math::{DVec2, DVec3};

use crate::mesh::Mesh;

/// A point at a radius from the axis, an azimuth [radians] and a height.
pub fn polar(radius: f64, azimuth: f64, y: f64) -> DVec3 {
    DVec3::new(radius * azimuth.cos(), y, -radius * azimuth.sin())
}

/// A box around the origin's column: half edges in x and z, from `low` to `high`.
pub fn cuboid(half: DVec2, low: f64, high: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for c in 0..8 {
        let side = |bit: usize, half: f64| if c >> bit & 1 == 0 { -half } else { half };
        mesh.vertex(DVec3::new(side(0, half.x), if c & 2 == 0 { low } else { high }, side(2, half.y)));
    }
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        mesh.quad(face);
    }
    mesh
}

/// A solid of revolution. The profile of (radius, height) runs upwards along the outside; its first and last point are
/// joined to the axis by flat discs. `shape` multiplies the radius at (azimuth, height): flutes.
pub fn turned(profile: &[[f64; 2]], segments: usize, shape: impl Fn(f64, f64) -> f64) -> Mesh {
    let mut mesh = Mesh::default();
    let n = segments as u32;
    for [r, y] in profile {
        for s in 0..segments {
            let azimuth = s as f64 / segments as f64 * TAU;
            mesh.vertex(polar(r * shape(azimuth, *y), azimuth, *y));
        }
    }
    for row in 0..profile.len() as u32 - 1 {
        for s in 0..n {
            let (a, b) = (row * n + s, row * n + (s + 1) % n);
            mesh.quad([a, b, b + n, a + n]);
        }
    }
    let [low, high] = [profile[0], profile[profile.len() - 1]].map(|[_, y]| mesh.vertex(DVec3::Y * y));
    let last = (profile.len() as u32 - 1) * n;
    for s in 0..n {
        let next = (s + 1) % n;
        mesh.triangles.extend([[low, next, s], [high, last + s, last + next]]);
    }
    mesh
}

/// A solid ring of revolution. The closed profile of (radius, height) runs anticlockwise with the radius to the right;
/// `shape` moves its point `k` at an azimuth: teeth, ribs.
pub fn ring(profile: &[[f64; 2]], segments: usize, shape: impl Fn(usize, f64) -> DVec2) -> Mesh {
    let mut mesh = Mesh::default();
    for s in 0..segments {
        let azimuth = s as f64 / segments as f64 * TAU;
        for (k, p) in profile.iter().enumerate() {
            let [r, y] = (DVec2::from_array(*p) + shape(k, azimuth)).to_array();
            mesh.vertex(polar(r, azimuth, y));
        }
    }
    let (n, m) = (segments as u32, profile.len() as u32);
    for s in 0..n {
        for k in 0..m {
            let at = |s: u32, k: u32| s % n * m + k % m;
            mesh.quad([at(s, k), at(s + 1, k), at(s + 1, k + 1), at(s, k + 1)]);
        }
    }
    mesh
}

/// A round tube along a closed curve given for 0..1, its cross-section carried along without needless twist.
pub fn tube(curve: impl Fn(f64) -> DVec3, radius: f64, along: usize, around: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for s in 0..along {
        let t = s as f64 / along as f64;
        let tangent = (curve(t + 1e-4) - curve(t - 1e-4)).normalize();
        // The centre of the knot lies to one side all along: a frame from it never degenerates and closes by itself.
        let side = (curve(t) - tangent * tangent.dot(curve(t))).normalize();
        let other = tangent.cross(side);
        for k in 0..around {
            let angle = k as f64 / around as f64 * TAU;
            mesh.vertex(curve(t) + radius * (side * angle.cos() + other * angle.sin()));
        }
    }
    let (n, m) = (along as u32, around as u32);
    for s in 0..n {
        for k in 0..m {
            let at = |s: u32, k: u32| s % n * m + k % m;
            mesh.quad([at(s, k), at(s, k + 1), at(s + 1, k + 1), at(s + 1, k)]);
        }
    }
    mesh
}
