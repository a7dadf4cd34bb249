//! The watertight test of rays against triangles [WBW13], eight at once.
//!
//! The ray is sheared onto an axis; then the signs of three edge functions say whether it passes inside. Two triangles
//! compute the edge they share from the same rounded numbers, and the sign of a difference of two rounded products is right
//! or zero: so no ray slips between them. Where the sign is zero, or f32 cannot hold the values, f64 decides: it holds the
//! products exactly. Nothing here depends on the scale of the scene.

use super::super::Ray;
use crate::math::{F8, Simd, Vec3, splat3};

/// Triangles in one pack.
pub const LANES: usize = 8;

/// Eight triangles: coordinates by corner, then axis, then triangle [unit]. Places left over repeat the first triangle.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct Pack {
    corners: [[[f32; LANES]; 3]; 3],
}

/// A hit of one lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneHit {
    pub t: f32,
    pub lane: usize,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

/// The axes and the shear of one ray.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// The two axes across the ray and the one along it, where the direction is longest.
    pub axes: [usize; 3],
    /// direction\[axes\[0\]\], direction\[axes\[1\]\] and 1, all over direction\[axes\[2\]\].
    pub by: [f32; 3],
}

/// The axis along which a direction is longest.
#[inline(always)]
pub fn longest_axis(direction: Vec3) -> usize {
    let [x, y, z] = direction.abs().to_array();
    if x > y && x > z {
        0
    } else if y > z {
        1
    } else {
        2
    }
}

impl Shear {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let along = longest_axis(ray.direction);
        let axes = [(along + 1) % 3, (along + 2) % 3, along];
        Self { axes, by: [d[axes[0]] / d[along], d[axes[1]] / d[along], 1.0 / d[along]] }
    }
}

/// Eight pairs of a ray and a triangle: one ray with eight triangles, or eight rays with one. All rays have the same axes.
#[derive(Clone, Copy)]
pub struct Sheared<S: Simd> {
    /// Start, in the order of the axes [unit].
    pub origin: [F8<S>; 3],
    /// [`Shear::by`].
    pub by: [F8<S>; 3],
}

/// Sizes of the determinant [unit²] between which f32 computes weights and distance without overflow, and without losing
/// bits to numbers below the normal ones.
const F32_RANGE: std::ops::Range<f32> = 1e-30..1e30;

/// One number for each corner of each triangle.
type ByCorner<S> = [F8<S>; 3];

/// Triangles that the rays pass inside, or may.
pub struct Inside<S: Simd> {
    x: ByCorner<S>,
    y: ByCorner<S>,
    z: ByCorner<S>,
    edges: ByCorner<S>,
    /// Bits of the lanes.
    pub lanes: u32,
}

/// Distances of the lanes that are left, and the weights of the second and third corner.
pub struct Met {
    pub lanes: u32,
    pub t: [f32; LANES],
    pub u: [f32; LANES],
    pub v: [f32; LANES],
}

impl<S: Simd> Sheared<S> {
    /// The lanes whose signs do not rule the triangle out. Coordinates by corner, then axis, in the order of the axes.
    #[inline(always)]
    pub fn inside(&self, corners: [[F8<S>; 3]; 3]) -> Inside<S> {
        let (p, [ox, oy, oz], [bx, by, _]) = (corners, self.origin, self.by);
        let z = [p[0][2] - oz, p[1][2] - oz, p[2][2] - oz];
        let x = [p[0][0] - ox - bx * z[0], p[1][0] - ox - bx * z[1], p[2][0] - ox - bx * z[2]];
        let y = [p[0][1] - oy - by * z[0], p[1][1] - oy - by * z[1], p[2][1] - oy - by * z[2]];
        // Barycentric weights times the determinant.
        let edges = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]];
        // Outside if two edges have different signs; zeros are looked at again, and so is what is not a number.
        let [a, b, c] = edges;
        let zero = F8::splat(a.simd(), 0.0);
        let below = a.min(b.min(c.min(zero))).lt(zero);
        let above = zero.lt(a.max(b.max(c.max(zero))));
        Inside { x, y, z, edges, lanes: !(below & above) & 0xff }
    }

    /// Distances and weights of the lanes that `inside` has left and the interval allows: beyond `t_min`, before `t_end`.
    /// No triangle is nearer than `enters`, where the ray enters its box: so what is found does not depend on the order
    /// in which boxes are visited.
    #[inline(always)]
    pub fn meet(&self, inside: &Inside<S>, enters: F8<S>, t_min: F8<S>, t_end: F8<S>) -> Met {
        let simd = enters.simd();
        let [a, b, c] = inside.edges;
        let det = a + b + c;
        let size = det.abs();
        let least_edge = a.abs().min(b.abs().min(c.abs()));
        let sure = F8::splat(simd, 0.0).lt(least_edge)
            & F8::splat(simd, F32_RANGE.start).le(size)
            & size.lt(F8::splat(simd, F32_RANGE.end));
        let inverse = F8::splat(simd, 1.0) / det;
        let (w, u, v) = (a * inverse, b * inverse, c * inverse);
        let t = (w * inside.z[0] + u * inside.z[1] + v * inside.z[2]) * self.by[2];
        let t = t.max(enters);
        let met = Met {
            lanes: inside.lanes & (t_min.lt(t) & t.lt(t_end) | !sure),
            t: t.to_array(),
            u: u.to_array(),
            v: v.to_array(),
        };
        let unsure = inside.lanes & !sure;
        if unsure == 0 {
            return met;
        }
        let (x, y, z) = (inside.x, inside.y, inside.z);
        let open = Open {
            unsure,
            x: [x[0].to_array(), x[1].to_array(), x[2].to_array()],
            y: [y[0].to_array(), y[1].to_array(), y[2].to_array()],
            z: [z[0].to_array(), z[1].to_array(), z[2].to_array()],
            per_z: self.by[2].to_array(),
            enters: enters.to_array(),
            t_min: t_min.to_array(),
            t_end: t_end.to_array(),
        };
        open.decide(met)
    }
}

/// Lanes that f32 cannot decide, as plain numbers.
struct Open {
    unsure: u32,
    x: [[f32; LANES]; 3],
    y: [[f32; LANES]; 3],
    z: [[f32; LANES]; 3],
    per_z: [f32; LANES],
    enters: [f32; LANES],
    t_min: [f32; LANES],
    t_end: [f32; LANES],
}

impl Open {
    /// The same in f64, signs and all.
    #[cold]
    #[inline(never)]
    fn decide(&self, mut met: Met) -> Met {
        for lane in (0..LANES).filter(|lane| self.unsure & 1 << lane != 0) {
            let of = |by_corner: &[[f32; LANES]; 3]| by_corner.map(|at| f64::from(at[lane]));
            let found = exactly(of(&self.x), of(&self.y), of(&self.z), f64::from(self.per_z[lane]));
            let (t, u, v) = found.unwrap_or((f32::NAN, 0.0, 0.0));
            let t = if t < self.enters[lane] { self.enters[lane] } else { t };
            (met.t[lane], met.u[lane], met.v[lane]) = (t, u, v);
            if !(t > self.t_min[lane] && t < self.t_end[lane]) {
                met.lanes &= !(1 << lane);
            }
        }
        met
    }
}

/// Distance and weights of one triangle; `None` beside it, or in its plane: such a ray meets its edge only.
fn exactly(x: [f64; 3], y: [f64; 3], z: [f64; 3], per_z: f64) -> Option<(f32, f32, f32)> {
    let e: [f64; 3] = std::array::from_fn(|c| {
        let (from, to) = ((c + 1) % 3, (c + 2) % 3);
        x[to] * y[from] - y[to] * x[from]
    });
    let outside = e.iter().any(|&e| e < 0.0) && e.iter().any(|&e| e > 0.0);
    let det = e[0] + e[1] + e[2];
    if outside || det == 0.0 {
        return None;
    }
    let w = e.map(|e| e / det);
    let depth: f64 = (0..3).map(|c| w[c] * z[c]).sum();
    Some(((depth * per_z) as f32, w[1] as f32, w[2] as f32))
}

impl Met {
    /// The nearest of the lanes; of several at one distance the first.
    #[inline(always)]
    pub fn nearest(&self) -> Option<LaneHit> {
        let mut lanes = self.lanes;
        let mut best = None;
        let mut t_best = f32::INFINITY;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            if self.t[lane] < t_best {
                t_best = self.t[lane];
                best = Some(LaneHit { t: t_best, lane, u: self.u[lane], v: self.v[lane] });
            }
        }
        best
    }
}

/// One ray as the test of a pack wants it.
pub struct TriangleRay<S: Simd> {
    sheared: Sheared<S>,
    axes: [usize; 3],
    t_min: F8<S>,
    simd: S,
}

impl<S: Simd> TriangleRay<S> {
    #[inline(always)]
    pub fn new(simd: S, ray: &Ray) -> Self {
        let Shear { axes, by } = Shear::new(ray);
        let origin = ray.origin.as_vec3().to_array();
        Self {
            sheared: Sheared {
                origin: splat3(simd, [origin[axes[0]], origin[axes[1]], origin[axes[2]]]),
                by: splat3(simd, by),
            },
            axes,
            t_min: F8::splat(simd, ray.t_min),
            simd,
        }
    }
}

impl Pack {
    /// A pack of one to eight triangles.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let of = |lane: usize| triangles.get(lane).unwrap_or(&triangles[0]);
        Self {
            corners: std::array::from_fn(|c| std::array::from_fn(|axis| std::array::from_fn(|lane| of(lane)[c][axis]))),
        }
    }

    /// The hits with `t_min` < t < `t_end`, on either face, by a ray that enters the pack's box at `enters`.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, ray: &TriangleRay<S>, enters: f32, t_end: f32) -> Option<Met> {
        let [kx, ky, kz] = ray.axes;
        let corner = |c: usize| [self.load(ray.simd, c, kx), self.load(ray.simd, c, ky), self.load(ray.simd, c, kz)];
        let inside = ray.sheared.inside([corner(0), corner(1), corner(2)]);
        if inside.lanes == 0 {
            return None;
        }
        let (enters, t_end) = (F8::splat(ray.simd, enters), F8::splat(ray.simd, t_end));
        let met = ray.sheared.meet(&inside, enters, ray.t_min, t_end);
        (met.lanes != 0).then_some(met)
    }

    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, c: usize, k: usize) -> F8<S> {
        F8::load(simd, &self.corners[c][k % 3])
    }

    /// The corners of triangle `lane` in every lane, by corner, then axis, in the order of `axes`.
    #[inline(always)]
    pub fn corners_of<S: Simd>(&self, simd: S, lane: usize, [kx, ky, kz]: [usize; 3]) -> [[F8<S>; 3]; 3] {
        let lane = lane % LANES;
        let [a, b, c] = &self.corners;
        [
            splat3(simd, [a[kx % 3][lane], a[ky % 3][lane], a[kz % 3][lane]]),
            splat3(simd, [b[kx % 3][lane], b[ky % 3][lane], b[kz % 3][lane]]),
            splat3(simd, [c[kx % 3][lane], c[ky % 3][lane], c[kz % 3][lane]]),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, LaneKernel, Lanes, Level};

    const RIGHT: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    struct Meet<'a>(&'a Pack, Ray, f32);

    impl LaneKernel for Meet<'_> {
        type Out = Option<LaneHit>;
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Out {
            let Self(pack, ray, enters) = self;
            pack.meet(&TriangleRay::new(simd, &ray), enters, ray.t_max).and_then(|met| met.nearest())
        }
    }

    fn nearest(pack: &Pack, ray: Ray) -> Option<LaneHit> {
        nearest_beyond(pack, ray, ray.t_min)
    }

    fn nearest_beyond(pack: &Pack, ray: Ray, enters: f32) -> Option<LaneHit> {
        let hits: Vec<_> = Level::available().into_iter().map(|l| Lanes::at(l).run(Meet(pack, ray, enters))).collect();
        assert!(hits.iter().all(|&h| h == hits[0]), "{hits:?}");
        hits[0]
    }

    fn hit(corners: [Vec3; 3], ray: &Ray) -> Option<LaneHit> {
        nearest(&Pack::new(&[corners]), *ray)
    }

    #[test]
    fn weights_belong_to_the_second_and_third_corner_on_both_faces_along_all_axes() {
        for turn in 0..3 {
            let turned = |v: Vec3| Vec3::from_array(std::array::from_fn(|i| v[(i + turn) % 3]));
            for sign in [1.0, -1.0] {
                let ray = Ray::new(turned(Vec3::new(0.25, 0.5, -2.0 * sign)).as_dvec3(), turned(Vec3::Z) * sign * 0.5);
                let h = hit(RIGHT.map(turned), &ray).unwrap();
                assert_eq!((h.t, h.u, h.v, h.lane), (4.0, 0.25, 0.5, 0));
            }
        }
    }

    #[test]
    fn the_nearest_of_a_pack_wins_and_the_interval_is_open() {
        let at = |z: f32| RIGHT.map(|p| p + Vec3::Z * z);
        let pack = Pack::new(&[at(3.0), at(1.0), at(2.0)]);
        let ray = Ray::new(DVec3::new(0.25, 0.25, 0.0), Vec3::Z);
        let t = |t_min, t_max| nearest(&pack, Ray { t_min, t_max, ..ray }).map(|h| (h.t, h.lane));
        assert_eq!(t(0.0, f32::INFINITY), Some((1.0, 1)));
        assert_eq!(t(1.0, f32::INFINITY), Some((2.0, 2)));
        assert_eq!(t(2.0, 3.0), None);
    }

    #[test]
    fn no_triangle_is_nearer_than_its_box() {
        let pack = Pack::new(&[RIGHT]);
        // Inside, and on an edge, where f64 decides.
        for x in [0.25, 0.0] {
            let ray = Ray { t_max: 3.0, ..Ray::new(DVec3::new(x, 0.25, -1.0), Vec3::Z) };
            let t = |enters| nearest_beyond(&pack, ray, enters).map(|h| h.t);
            assert_eq!([t(0.5), t(1.25), t(3.0)], [Some(1.0), Some(1.25), None]);
        }
    }

    #[test]
    fn a_ray_through_an_edge_or_a_corner_hits() {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)] {
            assert!(hit(RIGHT, &Ray::new(DVec3::new(x, y, 7.0), -Vec3::Z)).is_some(), "{x}, {y}");
        }
    }

    #[test]
    fn a_ray_in_the_plane_hits_nothing() {
        assert!(hit(RIGHT, &Ray::new(DVec3::new(-1.0, 0.25, 0.0), Vec3::X)).is_none());
    }

    /// Products of 1e-50 are no f32 numbers.
    #[test]
    fn tiny_triangles_are_left_to_f64() {
        let s = 1e-25;
        let h = hit(RIGHT.map(|p| p * s), &Ray::new(DVec3::new(0.25, 0.5, -2.0) * f64::from(s), Vec3::Z)).unwrap();
        assert!((h.t / s - 2.0).abs() < 1e-6 && (h.u - 0.25).abs() < 1e-6 && (h.v - 0.5).abs() < 1e-6);
    }
}
