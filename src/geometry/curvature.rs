//! Mean curvature of a mesh.

use super::Mesh;
use crate::math::DVec3;
use std::collections::HashMap;

/// Rounds of averaging at most.
const MOST_ROUNDS: f64 = 200.0;

/// Mean curvature at each vertex of a mesh [1/unit]: 1/radius on a ball, positive where the surface bulges outwards.
pub struct Curvature {
    vertices: Vec<f32>,
}

impl Curvature {
    /// By the cotangent formula [MDSB03], averaged over a distance of about `scale` [unit]: what is finer than that, such
    /// as the noise of a scan, is of no account to whoever asks. Vertices at one place count as one. 0 where it is not
    /// defined: at rims of holes, at edges of more than two triangles, without area.
    pub fn new(mesh: &Mesh, scale: f32) -> Self {
        let (ids, positions) = welded(&mesh.positions);
        let n = positions.len();
        let (mut areas, mut normals, mut pulls) = (vec![0.0; n], vec![DVec3::ZERO; n], vec![DVec3::ZERO; n]);
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        for corners in &mesh.triangles {
            let t = corners.map(|i| ids[i as usize]);
            let p = t.map(|i| positions[i as usize]);
            let scaled = (p[1] - p[0]).cross(p[2] - p[0]);
            let double = scaled.length();
            if double <= 0.0 {
                continue;
            }
            for k in 0..3 {
                let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
                *edges.entry((t[b].min(t[c]), t[b].max(t[c]))).or_default() += 1;
                // The angle at a stands opposite to the edge from b to c.
                let cotangent = (p[b] - p[a]).dot(p[c] - p[a]) / double;
                let pull = (p[b] - p[c]) * cotangent;
                pulls[t[b] as usize] += pull;
                pulls[t[c] as usize] -= pull;
                areas[t[a] as usize] += double / 6.0;
                normals[t[a] as usize] += scaled;
            }
        }
        // Σ (cot + cot) (x_i - x_j) = 4 H A n, with A a third of the triangles around.
        let mut values: Vec<f64> = (0..n)
            .map(|i| if areas[i] > 0.0 { pulls[i].dot(normals[i].normalize_or_zero()) / (4.0 * areas[i]) } else { 0.0 })
            .collect();
        for ((a, b), uses) in &edges {
            if *uses != 2 {
                (values[*a as usize], values[*b as usize]) = (0.0, 0.0);
            }
        }
        // In an order that no hash decides.
        let mut edges: Vec<(u32, u32)> = edges.into_keys().collect();
        edges.sort_unstable();
        average(&mut values, &areas, &edges, &positions, f64::from(scale));
        Self { vertices: ids.iter().map(|&i| values[i as usize] as f32).collect() }
    }

    /// At a point of a triangle of `mesh`, the one it was made from; see [`Mesh::point`] for `u` and `v`.
    #[inline]
    pub fn at(&self, mesh: &Mesh, triangle: u32, u: f64, v: f64) -> f32 {
        let (u, v) = (u as f32, v as f32);
        let [a, b, c] = mesh.triangles[triangle as usize].map(|i| self.vertices[i as usize]);
        a * (1.0 - u - v) + b * u + c * v
    }
}

/// Each round replaces a value by the mean over its neighbours and itself, by area: a step of about an edge. The distance
/// grows with the root of their number.
fn average(values: &mut Vec<f64>, areas: &[f64], edges: &[(u32, u32)], positions: &[DVec3], scale: f64) {
    let length = |&(a, b): &(u32, u32)| positions[a as usize].distance(positions[b as usize]);
    let mean = edges.iter().map(length).sum::<f64>() / edges.len().max(1) as f64;
    let rounds = if mean > 0.0 { (scale / mean).powi(2).min(MOST_ROUNDS) } else { 0.0 };
    for _ in 0..rounds as u32 {
        let mut sums: Vec<(f64, f64)> = values.iter().zip(areas).map(|(v, a)| (v * a, *a)).collect();
        for &(a, b) in edges {
            for (to, from) in [(a as usize, b as usize), (b as usize, a as usize)] {
                sums[to].0 += values[from] * areas[from];
                sums[to].1 += areas[from];
            }
        }
        *values = sums.into_iter().map(|(sum, area)| if area > 0.0 { sum / area } else { 0.0 }).collect();
    }
}

/// For each vertex the number of its place, and the places.
fn welded(positions: &[DVec3]) -> (Vec<u32>, Vec<DVec3>) {
    let (mut seen, mut places) = (HashMap::new(), Vec::new());
    let id = |p: &DVec3| {
        *seen.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(|| {
            places.push(*p);
            places.len() as u32 - 1
        })
    };
    (positions.iter().map(id).collect(), places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{rectangle, sphere};

    fn mesh(made: &crate::geometry::RawMesh) -> Mesh {
        Mesh { positions: made.positions.clone(), triangles: made.triangles.clone(), ..Mesh::default() }
    }

    #[test]
    fn a_ball_has_one_over_its_radius_and_a_hollow_less() {
        for (radius, scale) in [(0.5, 0.0), (20.0, 5.0)] {
            let ball = mesh(&sphere(DVec3::new(1.0, 2.0, 3.0), radius, 48, 96));
            let inside_out =
                Mesh { triangles: ball.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..ball.clone() };
            let (out, inwards) = (Curvature::new(&ball, scale), Curvature::new(&inside_out, scale));
            for t in (0..ball.triangles.len() as u32).step_by(7) {
                let found = f64::from(out.at(&ball, t, 0.2, 0.3)) * radius;
                // A third of the triangles around is not quite the cell of a vertex: 2 %; the poles' needles are worse.
                let pole = ball.corners(t).iter().any(|p| (p.y - 2.0).abs() > 0.99 * radius);
                assert!((found - 1.0).abs() < if pole { 0.3 } else { 0.03 }, "triangle {t}: {found}");
                assert!(
                    (inwards.at(&inside_out, t, 0.2, 0.3) + out.at(&ball, t, 0.3, 0.2)).abs() < 0.05 / radius as f32
                );
            }
        }
    }

    #[test]
    fn a_plane_has_none_and_vertices_at_one_place_are_one() {
        let sheet = mesh(&rectangle(DVec3::ZERO, DVec3::X, DVec3::Y));
        let flat = Curvature::new(&sheet, 1.0);
        assert_eq!(flat.at(&sheet, 0, 0.3, 0.3), 0.0);
        // The same ball with three vertices of its own for each triangle.
        let ball = mesh(&sphere(DVec3::ZERO, 1.0, 16, 32));
        let positions = ball.triangles.iter().flatten().map(|&i| ball.positions[i as usize]).collect();
        let loose = Mesh {
            positions,
            triangles: (0..ball.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..Mesh::default()
        };
        let (one, other) = (Curvature::new(&ball, 0.1), Curvature::new(&loose, 0.1));
        for t in 0..ball.triangles.len() as u32 {
            assert!((one.at(&ball, t, 0.3, 0.3) - other.at(&loose, t, 0.3, 0.3)).abs() < 1e-4);
        }
    }
}
