//! Meshes of tests, those in `tests/` too, which include this file with their own `DVec3` and `RawMesh`.

use super::{DVec3, RawMesh};

/// A box, each face cut into `n` by `n` squares, the diagonals one way or the other.
pub fn cuboid(centre: DVec3, half: DVec3, n: u32, other: bool) -> RawMesh {
    let mut mesh = RawMesh::default();
    for axis in 0..3 {
        let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
        for (w, u) in [(DVec3::AXES[axis], u), (-DVec3::AXES[axis], -u)] {
            for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                let base = mesh.positions.len() as u32;
                for (a, b) in [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)] {
                    let at = |k: u32| (2.0 * f64::from(k) - f64::from(n)) / f64::from(n);
                    mesh.positions.push(centre + half * (w + u * at(a) + v * at(b)));
                }
                let quads = if other { [[0, 1, 3], [1, 2, 3]] } else { [[0, 1, 2], [0, 2, 3]] };
                mesh.triangles.extend(quads.map(|t| t.map(|k| base + k)));
            }
        }
    }
    mesh
}

/// Both in one mesh, without normals.
pub fn joined(mut a: RawMesh, b: &RawMesh) -> RawMesh {
    let base = a.positions.len() as u32;
    a.positions.extend(&b.positions);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|i| base + i)));
    a.normals = None;
    a
}
