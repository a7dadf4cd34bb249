//! How far away the nearest surface is at least, from a table: a step shorter than that needs no ray.

use super::Mesh;
use super::winding::to_triangle;
use crate::math::{Aabb, Aabb32, DVec3, Vec3};
use rayon::prelude::*;

/// Lower bounds of the distance to a set of triangles, for the points of a box cut into cubes. One byte a cube: the distance of its centre.
pub struct Clearance {
    /// Smallest corner of the box [unit].
    lo: DVec3,
    /// From there to the largest one.
    extent: Vec3,
    /// Edge of a cube [unit].
    edge: f32,
    size: [usize; 3],
    /// Quarters of an edge, rounded down.
    quarters: Vec<u8>,
}

/// Farther cubes count as this far [edges].
const FARTHEST: f32 = 63.0;
/// Up to here distances of centres are exact, to rounding [edges]; beyond by the distance to the next cube that has a surface.
const EXACT: f32 = 3.0;
/// What rounding may make of a distance in edges.
const ROUNDING: f32 = 1e-3;
/// Half the diagonal of a cube, and a little for rounding [edges].
const HALF: f32 = 0.867;
/// Layers of cubes that one task looks at.
const LAYERS: usize = 16;

/// Some layers of cubes.
struct Layers<'a> {
    first: usize,
    /// Distances of centres to a surface, where they are exact [edges].
    near: &'a mut [f32],
    /// 0 where a surface may come through.
    squares: &'a mut [f32],
}

impl Clearance {
    /// For the box `bounds` [unit], its longest side cut into `cells`, and all triangles of `meshes`.
    pub fn new<'a>(meshes: impl IntoIterator<Item = &'a Mesh>, bounds: Aabb, cells: u32) -> Self {
        let side = bounds.extent().max_element();
        // A little larger than the box, so that rounding puts no point of it outside.
        let margin = DVec3::splat(1e-4 * side + f64::from(f32::MIN_POSITIVE));
        let (lo, hi) = (bounds.lower - margin, bounds.upper + margin);
        let extent = (hi - lo).as_vec3();
        let edge = extent.max_element() / cells as f32;
        let size = (extent / edge).to_array().map(|n| (n.ceil() as usize).clamp(1, cells as usize));
        let mut table = Self { lo, extent, edge, size, quarters: Vec::new() };
        let meshes: Vec<&Mesh> = meshes.into_iter().collect();
        let mut near = vec![f32::INFINITY; size.iter().product()];
        // Squared distances to the next cube that has a surface: none yet.
        let mut squares = near.clone();
        let layers = LAYERS * size[0] * size[1];
        near.par_chunks_mut(layers).zip(squares.par_chunks_mut(layers)).enumerate().for_each(|(task, layers)| {
            let mut layers = Layers { first: task * LAYERS, near: layers.0, squares: layers.1 };
            for mesh in &meshes {
                for triangle in 0..mesh.triangles.len() as u32 {
                    table.measure(mesh.corners(triangle), &mut layers);
                }
            }
        });
        for axis in 0..3 {
            table.spread(axis, &mut squares);
        }
        let distance = |(near, square): (&f32, &f32)| {
            let distance = if *near <= EXACT { near - ROUNDING } else { (square.sqrt() - HALF).max(EXACT - ROUNDING) };
            (4.0 * distance.clamp(0.0, FARTHEST)) as u8
        };
        table.quarters = near.iter().zip(&squares).map(distance).collect();
        table
    }

    /// Distance that every point within it of `x` is certain to be reached without meeting a triangle [unit]; negative
    /// outside the box.
    #[inline]
    pub fn at(&self, x: DVec3) -> f32 {
        let x = (x - self.lo).as_vec3();
        if x.cmplt(Vec3::ZERO).any() || x.cmpgt(self.extent).any() {
            return -1.0;
        }
        let x = x / self.edge;
        let [i, j, k] = [0, 1, 2].map(|a| (x[a] as usize).min(self.size[a] - 1));
        let centre = Vec3::new(i as f32, j as f32, k as f32) + 0.5;
        let centre_is = 0.25 * f32::from(self.quarters[(k * self.size[1] + j) * self.size[0] + i]);
        (centre_is - x.distance(centre)).max(0.0) * self.edge
    }

    /// The distance that a level stands for [unit].
    pub fn distance(&self, level: u8) -> f32 {
        f32::from(level) * (0.25 * self.edge)
    }

    /// The largest distance there is [unit].
    pub fn largest(&self) -> f32 {
        self.distance(self.quarters.iter().copied().max().unwrap_or(0))
    }

    /// The largest level whose [`Self::distance`] is no more than this one [unit].
    #[inline]
    pub fn level(&self, distance: f32) -> u8 {
        (4.0 * distance / self.edge) as u8
    }

    /// Lowers the distances of centres near a triangle to that to it, and marks cubes that it may come through.
    fn measure(&self, corners: [DVec3; 3], layers: &mut Layers<'_>) {
        let [a, b, c] = corners.map(|p| (p - self.lo).as_vec3() / self.edge);
        let Aabb32 { lower: least, upper: most } = Aabb32::around([a, b, c]);
        let range = |axis: usize, from: usize, to: usize| {
            let (least, most) = (least[axis] - EXACT - 0.5, most[axis] + EXACT - 0.5);
            if most < from as f32 || least >= to as f32 {
                return from..from;
            }
            (least.ceil().max(from as f32) as usize)..(most.min(to as f32 - 1.0) as usize + 1)
        };
        let layer = self.size[0] * self.size[1];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let through = 0.5 * normal.abs().element_sum() + ROUNDING;
        for k in range(2, layers.first, layers.first + layers.near.len() / layer) {
            for j in range(1, 0, self.size[1]) {
                for i in range(0, 0, self.size[0]) {
                    let centre = Vec3::new(i as f32, j as f32, k as f32) + 0.5;
                    let at = (k - layers.first) * layer + j * self.size[0] + i;
                    let above = normal.dot(centre - a).abs();
                    if above < layers.near[at].min(EXACT) || above <= through {
                        let corners = [a, b, c].map(|p| (p - centre).as_dvec3());
                        let distance = to_triangle(corners, normal.as_dvec3()) as f32;
                        layers.near[at] = layers.near[at].min(distance);
                        if distance <= HALF && above <= through {
                            layers.squares[at] = 0.0;
                        }
                    }
                }
            }
        }
    }

    /// One pass of the separable distance transform [FH12]: squares become the least of squares plus squared steps
    /// along `axis`.
    fn spread(&self, axis: usize, squares: &mut [f32]) {
        let stride = [1, self.size[0], self.size[0] * self.size[1]];
        let n = self.size[axis];
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (mut line, mut hull, mut from) = (vec![0.0; n], Vec::with_capacity(n), Vec::with_capacity(n + 1));
        for a in 0..self.size[u] {
            for b in 0..self.size[v] {
                let start = a * stride[u] + b * stride[v];
                for (i, value) in line.iter_mut().enumerate() {
                    *value = squares[start + i * stride[axis]];
                }
                lower_envelope(&line, &mut hull, &mut from);
                let mut parabola = 0;
                for i in 0..n {
                    while parabola + 1 < hull.len() && from[parabola + 1] <= i as f32 {
                        parabola += 1;
                    }
                    let Some(&q) = hull.get(parabola) else { continue };
                    let step = i as f32 - q as f32;
                    squares[start + i * stride[axis]] = step * step + line[q];
                }
            }
        }
    }
}

/// The parabolas (x - q)² + `line[q]` that are lowest somewhere, in order, and where each begins to be.
fn lower_envelope(line: &[f32], hull: &mut Vec<usize>, from: &mut Vec<f32>) {
    hull.clear();
    from.clear();
    for (q, &height) in line.iter().enumerate() {
        if height.is_infinite() {
            continue;
        }
        let mut begin = f32::NEG_INFINITY;
        while let (Some(&p), Some(&since)) = (hull.last(), from.last()) {
            let (x, y) = (q as f32, p as f32);
            begin = ((height + x * x) - (line[p] + y * y)) / (2.0 * (x - y));
            if begin > since {
                break;
            }
            hull.pop();
            from.pop();
            begin = f32::NEG_INFINITY;
        }
        hull.push(q);
        from.push(begin);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere;
    use crate::math::{hash, unit_f32};

    fn distance_to_sphere(x: Vec3, radius: f32) -> f32 {
        (x.length() - radius).abs()
    }

    #[test]
    fn bounds_are_below_the_distance_and_not_far_below() {
        let radius = 3.0;
        let mesh = sphere(DVec3::ZERO, f64::from(radius), 64, 128).recentred(DVec3::ZERO);
        let table = Clearance::new([&mesh], mesh.bounds().unwrap(), 64);
        let (mut sum, mut ideal, mut loss, mut close) = (0.0, 0.0, 0.0, 0);
        for i in 0..20_000_u64 {
            let u = |d: u64| 2.0 * unit_f32((hash(3 * i + d + 1) >> 32) as u32) - 1.0;
            let x = Vec3::new(u(0), u(1), u(2)) * radius;
            let (bound, truth) = (table.at(x.as_dvec3()), distance_to_sphere(x, radius));
            // The mesh lies up to 2e-3 radii inside the sphere.
            assert!(bound >= 0.0 && bound <= truth + 1e-6, "{x}: {bound} > {truth}");
            (sum, ideal) = (sum + bound, ideal + truth);
            if truth < 2.0 * table.edge {
                (loss, close) = (loss + f64::from(truth - bound), close + 1);
            }
        }
        assert!(sum > 0.75 * ideal, "{sum} of {ideal}");
        // Half a cube from its centre, a quarter of its edge by rounding.
        assert!(loss < 0.75 * f64::from(table.edge) * f64::from(close), "{loss} at {close} points");
    }

    #[test]
    fn large_slanted_triangles_block_their_own_cubes_only_and_outside_is_negative() {
        let corner = [DVec3::new(-10.0, 0.0, 0.0), DVec3::new(10.0, 0.0, 20.0), DVec3::new(-10.0, 20.0, 20.0)];
        let mesh = Mesh { positions: corner.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let table = Clearance::new([&mesh], Aabb { lower: DVec3::splat(-10.0), upper: DVec3::splat(20.0) }, 60);
        assert_eq!(table.at(DVec3::new(-3.0, 6.0, 13.0)), 0.0);
        assert!(table.at(DVec3::new(15.0, 15.0, -5.0)) > 5.0);
        assert!(table.at(DVec3::splat(21.0)) < 0.0);
        let empty = Clearance::new([], Aabb { lower: DVec3::ZERO, upper: DVec3::ONE }, 10);
        assert!(empty.at(DVec3::splat(0.5)) > 5.0);
    }
}
