//! The watertight test of a ray against triangles [Woop, Benthin, Wald 2013], four at once.
//!
//! The ray is sheared onto an axis; then the signs of three edge functions say whether it passes inside. Two triangles
//! compute the edge they share from the same rounded numbers, and the sign of a difference of two rounded products is right
//! or zero: so no ray slips between them. Where the sign is zero, or f32 cannot hold the values, f64 decides: it holds the
//! products exactly. Nothing here depends on the scale of the scene.

use glam::Vec4;

use super::super::Ray;
use crate::math::Vec3;

/// Triangles in one pack.
pub const LANES: usize = 4;

/// Four triangles: coordinates by corner, then axis, then triangle [unit]. Places left over repeat the first triangle.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
pub struct Pack {
    corners: [[Vec4; 3]; 3],
}

/// A hit in a pack.
pub struct PackHit {
    pub t: f32,
    pub lane: usize,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

/// A ray as the triangle test wants it.
pub struct TriangleRay {
    origin: [f32; 3],
    /// The two axes across the ray and the one along it, where the direction is longest.
    axes: [usize; 3],
    /// direction\[axes\[0\]\], direction\[axes\[1\]\] and 1, all over direction\[axes\[2\]\].
    shear: [f32; 3],
}

impl TriangleRay {
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let size = d.map(f32::abs);
        let along = if size[0] > size[1] && size[0] > size[2] {
            0
        } else if size[1] > size[2] {
            1
        } else {
            2
        };
        let axes = [(along + 1) % 3, (along + 2) % 3, along];
        let shear = [d[axes[0]] / d[along], d[axes[1]] / d[along], 1.0 / d[along]];
        Self { origin: ray.origin.to_array(), axes, shear }
    }
}

/// Sizes of the determinant [unit²] between which f32 computes weights and distance without overflow, and without losing
/// bits to numbers below the normal ones.
const F32_RANGE: std::ops::Range<f32> = 1e-30..1e30;

/// The corners across the ray, by triangle.
struct Sheared {
    x: [Vec4; 3],
    y: [Vec4; 3],
}

/// One number for each corner of each triangle.
type ByCorner = [Vec4; 3];

impl Pack {
    /// A pack of one to four triangles.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let of = |lane: usize| triangles.get(lane).unwrap_or(&triangles[0]);
        Self {
            corners: std::array::from_fn(|c| {
                std::array::from_fn(|axis| Vec4::from_array(std::array::from_fn(|lane| of(lane)[c][axis])))
            }),
        }
    }

    /// The nearest hit with `t_min` < t < `t_max`, on either face.
    #[inline]
    pub fn closest(&self, ray: &TriangleRay, t_min: f32, t_max: f32) -> Option<PackHit> {
        let [kx, ky, kz] = ray.axes;
        let from_origin = |c: usize, k: usize| self.corners[c][k] - Vec4::splat(ray.origin[k]);
        let z: ByCorner = std::array::from_fn(|c| from_origin(c, kz));
        let across = |k: usize, shear: f32| -> ByCorner {
            std::array::from_fn(|c| from_origin(c, k) - Vec4::splat(shear) * z[c])
        };
        let sheared = Sheared { x: across(kx, ray.shear[0]), y: across(ky, ray.shear[1]) };
        // Barycentric weights times the determinant.
        let edges: ByCorner = std::array::from_fn(|c| {
            let (from, to) = ((c + 1) % 3, (c + 2) % 3);
            sheared.x[to] * sheared.y[from] - sheared.y[to] * sheared.x[from]
        });
        // Outside if two edges have different signs; zeros and what is not a number are looked at again.
        let [a, b, c] = edges;
        let below = a.cmplt(Vec4::ZERO) | b.cmplt(Vec4::ZERO) | c.cmplt(Vec4::ZERO);
        let above = a.cmpgt(Vec4::ZERO) | b.cmpgt(Vec4::ZERO) | c.cmpgt(Vec4::ZERO);
        let mut candidates = !(below & above).bitmask() & 0b1111;
        let mut best = None;
        let mut t_max = t_max;
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            let Some((t, u, v)) = finish(&sheared, &edges, &z, ray.shear[2], lane) else { continue };
            if t > t_min && t < t_max {
                t_max = t;
                best = Some(PackHit { t, lane, u, v });
            }
        }
        best
    }
}

/// Distance and weights of a triangle that the signs have not ruled out.
#[inline]
fn finish(sheared: &Sheared, edges: &ByCorner, z: &ByCorner, per_z: f32, lane: usize) -> Option<(f32, f32, f32)> {
    let e = edges.map(|edge| edge[lane]);
    let det = e[0] + e[1] + e[2];
    if e[0] == 0.0 || e[1] == 0.0 || e[2] == 0.0 || !F32_RANGE.contains(&det.abs()) {
        return finish_exactly(sheared, z, per_z, lane);
    }
    let inverse = 1.0 / det;
    let w = e.map(|e| e * inverse);
    let t = (w[0] * z[0][lane] + w[1] * z[1][lane] + w[2] * z[2][lane]) * per_z;
    Some((t, w[1], w[2]))
}

/// The same in f64, signs and all.
#[cold]
fn finish_exactly(sheared: &Sheared, z: &ByCorner, per_z: f32, lane: usize) -> Option<(f32, f32, f32)> {
    let x = sheared.x.map(|x| f64::from(x[lane]));
    let y = sheared.y.map(|y| f64::from(y[lane]));
    let e: [f64; 3] = std::array::from_fn(|c| {
        let (from, to) = ((c + 1) % 3, (c + 2) % 3);
        x[to] * y[from] - y[to] * x[from]
    });
    let outside = e.iter().any(|&e| e < 0.0) && e.iter().any(|&e| e > 0.0);
    let det = e[0] + e[1] + e[2];
    if outside || det == 0.0 {
        return None; // a ray in the plane of the triangle meets its edge only
    }
    let w = e.map(|e| e / det);
    let depth: f64 = (0..3).map(|c| w[c] * f64::from(z[c][lane])).sum();
    Some(((depth * f64::from(per_z)) as f32, w[1] as f32, w[2] as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    fn hit(corners: [Vec3; 3], ray: &Ray) -> Option<PackHit> {
        Pack::new(&[corners]).closest(&TriangleRay::new(ray), ray.t_min, ray.t_max)
    }

    #[test]
    fn weights_belong_to_the_second_and_third_corner_on_both_faces_along_all_axes() {
        for turn in 0..3 {
            let turned = |v: Vec3| Vec3::from_array(std::array::from_fn(|i| v[(i + turn) % 3]));
            for sign in [1.0, -1.0] {
                let ray = Ray::new(turned(Vec3::new(0.25, 0.5, -2.0 * sign)), turned(Vec3::Z) * sign * 0.5);
                let h = hit(RIGHT.map(turned), &ray).unwrap();
                assert_eq!((h.t, h.u, h.v, h.lane), (4.0, 0.25, 0.5, 0));
            }
        }
    }

    #[test]
    fn the_nearest_of_a_pack_wins_and_the_interval_is_open() {
        let at = |z: f32| RIGHT.map(|p| p + Vec3::Z * z);
        let pack = Pack::new(&[at(3.0), at(1.0), at(2.0)]);
        let ray = TriangleRay::new(&Ray::new(Vec3::new(0.25, 0.25, 0.0), Vec3::Z));
        let t = |lo, hi| pack.closest(&ray, lo, hi).map(|h| (h.t, h.lane));
        assert_eq!(t(0.0, f32::INFINITY), Some((1.0, 1)));
        assert_eq!(t(1.0, f32::INFINITY), Some((2.0, 2)));
        assert_eq!(t(2.0, 3.0), None);
    }

    #[test]
    fn a_ray_through_an_edge_or_a_corner_hits() {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)] {
            assert!(hit(RIGHT, &Ray::new(Vec3::new(x, y, 7.0), -Vec3::Z)).is_some(), "{x}, {y}");
        }
    }

    #[test]
    fn a_ray_in_the_plane_hits_nothing() {
        assert!(hit(RIGHT, &Ray::new(Vec3::new(-1.0, 0.25, 0.0), Vec3::X)).is_none());
    }

    /// Products of 1e-50 are no f32 numbers.
    #[test]
    fn tiny_triangles_are_left_to_f64() {
        let s = 1e-25;
        let h = hit(RIGHT.map(|p| p * s), &Ray::new(Vec3::new(0.25, 0.5, -2.0) * s, Vec3::Z)).unwrap();
        assert!((h.t / s - 2.0).abs() < 1e-6 && (h.u - 0.25).abs() < 1e-6 && (h.v - 0.5).abs() < 1e-6);
    }
}
