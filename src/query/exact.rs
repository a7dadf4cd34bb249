//! Rays in f64, for scenes that f32 cannot hold: thin bodies in wide scenes. A plain tree over copies of the triangles, many
//! times slower than the backends; `scene/precision.rs` says when it takes their place. Independent of them, and so also what
//! tests hold them against.

use super::{Hit, Ray, RayQuery};
use crate::geometry::Mesh;
use crate::math::{Aabb, DVec3};

/// Meshes, copied into a tree in f64.
pub struct Exact {
    nodes: Vec<Node>,
    triangles: Vec<Triangle>,
}

struct Triangle {
    corners: [DVec3; 3],
    mesh: u32,
    triangle: u32,
}

/// A box. Leaves: `count` triangles from `first` on. Others, of `count` 0: the second child, the first being the next node.
struct Node {
    bounds: Aabb,
    first: u32,
    count: u32,
}

/// Triangles of a leaf at most.
const LEAF: usize = 4;
/// Bins in which cuts are looked for.
const BINS: usize = 16;
/// From this depth on ranges are halved by number, so that no stack needs more than [`STACK`] places.
const STEEP_DEPTH: usize = 48;
const STACK: usize = STEEP_DEPTH + 33;
/// Boxes are entered earlier and left later by this share: far more than the roundings of either end [Ize 2013], and more than
/// telling distances in f32 takes off.
const SLACK: f64 = 1e-7;

impl Exact {
    /// Copies the triangles with area into a tree.
    pub fn new(meshes: &[&Mesh]) -> Self {
        let mut triangles = Vec::with_capacity(meshes.iter().map(|m| m.triangles.len()).sum());
        for (mesh, number) in meshes.iter().zip(0..) {
            let with_area = (0..mesh.triangles.len() as u32).filter(|&t| mesh.area(t) > 0.0);
            triangles.extend(with_area.map(|t| Triangle { corners: mesh.corners(t), mesh: number, triangle: t }));
        }
        let mut nodes = Vec::with_capacity(triangles.len());
        if !triangles.is_empty() {
            build(&mut nodes, &mut triangles, 0, 0);
        }
        Self { nodes, triangles }
    }

    /// Visits the triangles that the ray meets before what `visit` returns, boxes from near to far.
    fn walk(&self, ray: &ShearedRay, mut t_end: f64, mut visit: impl FnMut(&Triangle, Met) -> f64) {
        let Some(root) = self.nodes.first() else { return };
        let (mut stack, mut waiting, mut index) = ([(0_u32, 0.0_f64); STACK], 0, 0_u32);
        if ray.enter(root, t_end).is_none() {
            return;
        }
        loop {
            let node = &self.nodes[index as usize];
            let mut next = None;
            if node.count == 0 {
                let [left, right] = [index + 1, node.first].map(|i| (i, ray.enter(&self.nodes[i as usize], t_end)));
                next = match (left, right) {
                    ((l, Some(a)), (r, Some(b))) => {
                        let (near, far) = if b < a { (r, (l, a)) } else { (l, (r, b)) };
                        stack[waiting] = far;
                        waiting += 1;
                        Some(near)
                    }
                    ((l, Some(_)), _) => Some(l),
                    (_, (r, Some(_))) => Some(r),
                    _ => None,
                };
            } else {
                for triangle in &self.triangles[node.first as usize..(node.first + node.count) as usize] {
                    if let Some(met) = ray.meet(&triangle.corners).filter(|met| ray.holds(met.t) && met.t <= t_end) {
                        t_end = visit(triangle, met);
                    }
                }
            }
            index = loop {
                if let Some(next) = next {
                    break next;
                }
                if waiting == 0 {
                    return;
                }
                waiting -= 1;
                next = Some(stack[waiting]).filter(|s| s.1 <= t_end).map(|s| s.0);
            };
        }
    }
}

impl RayQuery for Exact {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<(f64, Hit)> = None;
        self.walk(&ShearedRay::new(ray), f64::INFINITY, |triangle, Met { t, u, v }| {
            let Triangle { mesh, triangle, .. } = *triangle;
            let hit = Hit { t: t as f32, mesh, triangle, u, v };
            // Of several at one distance the first by number: no order of visits decides.
            let before =
                |(so_far, old): &(f64, Hit)| t < *so_far || t == *so_far && (mesh, triangle) < (old.mesh, old.triangle);
            if best.as_ref().is_none_or(before) {
                best = Some((t, hit));
            }
            best.map_or(t, |b| b.0)
        });
        best.map(|b| b.1)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut found = false;
        self.walk(&ShearedRay::new(ray), f64::INFINITY, |_, _| {
            found = true;
            f64::NEG_INFINITY
        });
        found
    }

    fn description(&self) -> String {
        "bvh in double precision (binary, watertight)".to_string()
    }

    fn bytes(&self) -> Option<usize> {
        Some(size_of_val(&*self.nodes) + size_of_val(&*self.triangles))
    }
}

/// Appends the node of `triangles`, which begin at number `offset`, and all below it.
fn build(nodes: &mut Vec<Node>, triangles: &mut [Triangle], offset: u32, depth: usize) {
    let bounds = triangles.iter().map(Triangle::bounds).fold(Aabb::EMPTY, Aabb::join);
    let index = nodes.len();
    nodes.push(Node { bounds, first: offset, count: triangles.len() as u32 });
    if triangles.len() <= LEAF {
        return;
    }
    let middle = cut(triangles, depth);
    nodes[index].count = 0;
    let (left, right) = triangles.split_at_mut(middle);
    build(nodes, left, offset, depth + 1);
    nodes[index].first = nodes.len() as u32;
    build(nodes, right, offset + middle as u32, depth + 1);
}

/// Parts the triangles where the surface area heuristic finds it cheapest along the longest side of the box of their middles;
/// how many come first.
fn cut(triangles: &mut [Triangle], depth: usize) -> usize {
    let middles = Aabb::around(triangles.iter().map(Triangle::middle));
    let axis = middles.longest_axis();
    let (start, width) = (middles.lower[axis], middles.extent()[axis]);
    if depth < STEEP_DEPTH && width > 0.0 {
        let bin = |t: &Triangle| (((t.middle()[axis] - start) / width * BINS as f64) as usize).min(BINS - 1);
        let mut bins = [(0_usize, Aabb::EMPTY); BINS];
        for triangle in &*triangles {
            let (count, bounds) = &mut bins[bin(triangle)];
            *count += 1;
            *bounds = bounds.join(triangle.bounds());
        }
        let cost = |part: &[(usize, Aabb)]| {
            let count: usize = part.iter().map(|b| b.0).sum();
            if count == 0 {
                return 0.0;
            }
            let side = part.iter().map(|b| b.1).fold(Aabb::EMPTY, Aabb::join).extent();
            count as f64 * (side.x * side.y + side.y * side.z + side.z * side.x)
        };
        let total = |k: &usize| cost(&bins[..*k]) + cost(&bins[*k..]);
        let best = (1..BINS).min_by(|a, b| total(a).total_cmp(&total(b))).unwrap_or(BINS / 2);
        let count: usize = bins[..best].iter().map(|b| b.0).sum();
        if count > 0 && count < triangles.len() {
            triangles.sort_by_key(|t| bin(t) >= best);
            return count;
        }
    }
    let middle = triangles.len() / 2;
    let key = |t: &Triangle| t.middle()[axis];
    triangles.select_nth_unstable_by(middle, |a, b| {
        key(a).total_cmp(&key(b)).then((a.mesh, a.triangle).cmp(&(b.mesh, b.triangle)))
    });
    middle
}

impl Triangle {
    fn bounds(&self) -> Aabb {
        Aabb::around(self.corners)
    }

    /// Middle of the box.
    fn middle(&self) -> DVec3 {
        self.bounds().centre()
    }
}

/// Distance and the weights of the second and third corner.
struct Met {
    t: f64,
    u: f64,
    v: f64,
}

/// A ray, sheared onto the axis along which it is longest [WBW13].
struct ShearedRay {
    origin: DVec3,
    inverse: DVec3,
    /// The two axes across the ray and the one along it.
    axes: [usize; 3],
    /// direction\[axes\[0\]\], direction\[axes\[1\]\] and 1, all over direction\[axes\[2\]\].
    by: [f64; 3],
    t_min: f32,
    t_max: f32,
}

impl ShearedRay {
    fn new(ray: &Ray) -> Self {
        let d = ray.direction.as_dvec3();
        let along = d.abs().max_position();
        let axes = [(along + 1) % 3, (along + 2) % 3, along];
        Self {
            origin: ray.origin,
            inverse: d.recip(),
            axes,
            by: [d[axes[0]] / d[along], d[axes[1]] / d[along], 1.0 / d[along]],
            t_min: ray.t_min,
            t_max: ray.t_max,
        }
    }

    /// Whether the open interval has this distance, in the numbers in which it is told.
    #[inline]
    fn holds(&self, t: f64) -> bool {
        let t = t as f32;
        t > self.t_min && t < self.t_max
    }

    /// Where the ray enters the box, if it does so before the interval's end and `t_end`. A plane in which it lies bounds
    /// nothing: what is not a number is passed over.
    #[inline]
    fn enter(&self, node: &Node, t_end: f64) -> Option<f64> {
        let (mut near, mut far) = (f64::from(self.t_min), f64::from(self.t_max).min(t_end));
        for axis in 0..3 {
            let (mut first, mut last) = (node.bounds.lower[axis], node.bounds.upper[axis]);
            if self.inverse[axis].is_sign_negative() {
                std::mem::swap(&mut first, &mut last);
            }
            near = near.max((first - self.origin[axis]) * self.inverse[axis]);
            far = far.min((last - self.origin[axis]) * self.inverse[axis]);
        }
        near *= 1.0 - SLACK;
        (near <= far * (1.0 + SLACK)).then_some(near)
    }

    /// The triangle's plane along the ray, if that passes inside.
    #[inline]
    fn meet(&self, corners: &[DVec3; 3]) -> Option<Met> {
        let ([kx, ky, kz], [bx, by, per_z]) = (self.axes, self.by);
        let p = corners.map(|p| p - self.origin);
        let z = p.map(|p| p[kz]);
        let (x, y) = (p.map(|p| p[kx] - bx * p[kz]), p.map(|p| p[ky] - by * p[kz]));
        // Barycentric weights times the determinant.
        let e = [0, 1, 2].map(|c: usize| {
            let (from, to) = ((c + 1) % 3, (c + 2) % 3);
            difference(x[to], y[from], y[to], x[from])
        });
        let det = e[0] + e[1] + e[2];
        if e.iter().any(|&e| e < 0.0) && e.iter().any(|&e| e > 0.0) || det == 0.0 {
            return None;
        }
        let w = e.map(|e| e / det);
        Some(Met { t: (w[0] * z[0] + w[1] * z[1] + w[2] * z[2]) * per_z, u: w[1], v: w[2] })
    }
}

/// a b - c d. Of rounded products its sign is right or zero; then what rounding took off them decides.
#[inline]
fn difference(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (ab, cd) = (a * b, c * d);
    if ab == cd { a.mul_add(b, -ab) - c.mul_add(d, -cd) } else { ab - cd }
}
