//! Points on a mesh with equal chance per area: random triangle by area, random point in it, pdf 1/A.

use super::{Mesh, morton_code};
use crate::math::DVec3;

/// Cumulative areas of a mesh's triangles in Morton order, so that a low-discrepancy number picks points
/// that are spread over the surface, not only over the file's order. 12 bytes a triangle.
pub struct AreaTable {
    /// Triangle of each entry.
    triangles: Vec<u32>,
    /// Area of all entries up to and with this one [unit²].
    cumulative: Vec<f64>,
    centre: DVec3,
}

/// A triangle and barycentric coordinates, as [`Mesh::point`] takes them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSample {
    /// Index into the mesh's triangles.
    pub triangle: u32,
    /// Weight of the second corner.
    pub u: f64,
    /// Weight of the third corner.
    pub v: f64,
}

impl AreaTable {
    /// The table of a whole mesh; triangles without area are never picked. `None` if none has area.
    pub fn new(mesh: &Mesh) -> Option<Self> {
        let bounds = mesh.bounds()?;
        let mut order: Vec<(u64, u32)> = (0..mesh.triangles.len() as u32)
            .filter(|&t| mesh.area(t) > 0.0)
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                (morton_code((a + b + c) / 3.0, &bounds), t)
            })
            .collect();
        if order.is_empty() {
            return None;
        }
        order.sort_unstable();
        let triangles: Vec<u32> = order.into_iter().map(|(_, t)| t).collect();
        let mut total = 0.0;
        let cumulative = triangles
            .iter()
            .map(|&t| {
                total += mesh.area(t);
                total
            })
            .collect();
        Some(Self { triangles, cumulative, centre: bounds.centre() })
    }

    /// Area of the mesh [unit²].
    pub fn area(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// Middle of the mesh's box [unit]: what is kept in f32 of its surface is relative to this.
    pub fn centre(&self) -> DVec3 {
        self.centre
    }

    /// Triangles with area.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Never true of a table that [`Self::new`] made.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// A point from `pick` in [0, 1) along the cumulative area and a point `u` of the unit square.
    #[inline]
    pub fn sample(&self, pick: f64, u: [f32; 2]) -> AreaSample {
        let target = pick * self.area();
        let entry = self.cumulative.partition_point(|&c| c <= target).min(self.triangles.len() - 1);
        let [u, v] = square_to_triangle(u);
        AreaSample { triangle: self.triangles[entry], u, v }
    }
}

/// Folds the unit square onto the barycentrics of a triangle with constant density and little distortion
/// [Heitz 2019], so that well-spread points stay well spread.
#[inline]
fn square_to_triangle(u: [f32; 2]) -> [f64; 2] {
    let [s, t] = u.map(f64::from);
    if t > s { [0.5 * s, t - 0.5 * s] } else { [s - 0.5 * t, 0.5 * t] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{hash, unit_f32, unit_f64};

    fn numbers(i: u64) -> (f64, [f32; 2]) {
        let draw = |d: u64| (hash(i * 3 + d + 1) >> 32) as u32;
        (unit_f64(draw(0)), [unit_f32(draw(1)), unit_f32(draw(2))])
    }

    /// Chi-square statistic of counts against expected counts, over its degrees of freedom.
    fn reduced_chi_square(counts: &[u64], expected: &[f64]) -> f64 {
        let sum: f64 = counts.iter().zip(expected).map(|(&c, &e)| (c as f64 - e).powi(2) / e).sum();
        sum / (counts.len() - 1) as f64
    }

    /// Triangles with areas in the proportion 1 : 2 : ... : n, far apart, plus one without area.
    fn fan(n: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..n {
            let x = f64::from(i) * 10.0;
            let base = mesh.positions.len() as u32;
            mesh.positions.extend([
                DVec3::new(x, 0.0, 0.0),
                DVec3::new(x + 1.0, 0.0, 0.0),
                DVec3::new(x, 2.0 * f64::from(i + 1), 0.0),
            ]);
            mesh.triangles.push([base, base + 1, base + 2]);
        }
        mesh.triangles.push([0, 1, 1]);
        mesh
    }

    #[test]
    fn total_area_is_the_sum_and_zero_area_is_left_out() {
        let table = AreaTable::new(&fan(20)).unwrap();
        assert!((table.area() - 210.0).abs() < 1e-9);
        assert_eq!(table.triangles.len(), 20);
        assert!(
            AreaTable::new(&Mesh { triangles: vec![[0, 0, 0]], positions: vec![DVec3::ZERO], ..Mesh::default() })
                .is_none()
        );
    }

    #[test]
    fn triangles_are_picked_by_area_and_points_uniformly() {
        let (n, draws) = (20, 200_000);
        let table = AreaTable::new(&fan(n)).unwrap();
        let mut picked = vec![0; n as usize];
        // Four sub-triangles of equal area: the three corners' and the middle one.
        let mut quarter = [0_u64; 4];
        for i in 0..draws {
            let (pick, u) = numbers(i);
            let s = table.sample(pick, u);
            assert!(s.u >= 0.0 && s.v >= 0.0 && s.u + s.v <= 1.0);
            picked[s.triangle as usize] += 1;
            quarter[if s.u > 0.5 {
                0
            } else if s.v > 0.5 {
                1
            } else if s.u + s.v < 0.5 {
                2
            } else {
                3
            }] += 1;
        }
        let by_area: Vec<f64> = (1..=n).map(|a| draws as f64 * f64::from(a) / 210.0).collect();
        // 19 degrees of freedom: 2.9 is the 1e-5 tail; 3 degrees: 8.6 is.
        assert!(reduced_chi_square(&picked, &by_area) < 2.9, "{picked:?}");
        assert!(reduced_chi_square(&quarter, &[draws as f64 / 4.0; 4]) < 8.6, "{quarter:?}");
        // The same statistic must refuse a table that ignores area.
        assert!(reduced_chi_square(&picked, &vec![draws as f64 / f64::from(n); n as usize]) > 100.0);
    }

    #[test]
    fn the_ends_of_the_unit_interval_pick_real_triangles() {
        let table = AreaTable::new(&fan(3)).unwrap();
        for pick in [0.0, 1.0 - f64::EPSILON, 1.0] {
            assert!(table.sample(pick, [0.0, 0.0]).triangle < 3);
        }
    }
}
