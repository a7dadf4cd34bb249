//! All facets of a body through which light from one point outside, or from one direction, is refracted to one point inside.

use crate::geometry::Mesh;
use crate::math::{Aabb32, DVec3, Vec3};

/// The triangles of a mesh in a binary tree of balls around places and cones around normals, after [WZHB09], whose tree is
/// of boxes. 44 bytes a node, 4 a triangle.
pub struct Facets {
    nodes: Vec<Node>,
    /// Triangles, those of a leaf together.
    order: Vec<u32>,
    eta: f64,
    /// What places in the nodes are relative to [unit].
    origin: DVec3,
    /// Cosine and sine of the largest angle by which the boundary turns light: cos = min(η, 1/η).
    turn: [f32; 2],
}

/// A ball around the triangles, and a cone around their normals.
#[derive(Clone, Copy)]
struct Node {
    centre: Vec3,
    radius: f32,
    axis: Vec3,
    /// Cosine and sine of half the cone's angle; a cosine of 0 or less stands for all directions.
    cosine: f32,
    sine: f32,
    /// Leaves: the first of `count` triangles. Others: the second child, the first being the next node.
    first: u32,
    count: u32,
}

/// Where a facet refracts light from the point outside to the point inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    pub triangle: u32,
    /// Barycentric coordinates of the place, as `Mesh::point` takes them.
    pub u: f64,
    pub v: f64,
    pub bend: Bend,
    /// Unit direction inside, outwards.
    pub inside: Vec3,
    /// Unit direction outside, outwards.
    pub outside: Vec3,
}

/// Where the light comes from.
#[derive(Clone, Copy, Debug)]
pub enum Towards {
    /// A point outside.
    Point(DVec3),
    /// Endlessly far away, in the direction of this unit vector.
    Direction(Vec3),
}

/// The lengths and cosines of a line that is bent at a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Lengths inside and outside [unit]; the latter may be infinite.
    pub lengths: [f64; 2],
    /// Cosines of the angles to the normal inside and outside.
    pub cosines: [f64; 2],
}

impl Bend {
    /// Solid angle inside per area across the line at its outer end [sr/unit²]: with lengths l, L and cosines c, C,
    ///
    ///   1 / ((l + ηL) (l C/c + ηL c/C))
    ///
    /// The first factor is the spread across the plane of incidence, the second that in it. 1/(l + L)² for η = 1.
    pub fn focus(&self, eta: f64) -> f64 {
        let ([l, far], [c, cos]) = (self.lengths, self.cosines);
        1.0 / ((l + eta * far) * (l * cos / c + eta * far * c / cos))
    }

    /// Solid angle inside per solid angle outside, for parallel light: the limit of L² times [`Self::focus`].
    pub fn focus_of_directions(&self, eta: f64) -> f64 {
        let [c, cos] = self.cosines;
        cos / (eta * eta * c)
    }
}

/// Triangles of a leaf at most.
const LEAF: usize = 2;
/// Slack of angles in the tests of nodes [rad], above what rounding of cosines in f32 can do.
const SLACK: f32 = 1.5e-3;

struct Item {
    triangle: u32,
    middle: Vec3,
    normal: Vec3,
}

impl Facets {
    /// The tree of `mesh`; triangles without area are left out. `eta` = n_inside / n_outside. `None` without triangles.
    pub fn new(mesh: &Mesh, eta: f32) -> Option<Self> {
        let origin = mesh.bounds()?.centre();
        let mut items: Vec<Item> = (0..mesh.triangles.len() as u32)
            .filter_map(|triangle| {
                let normal = mesh.geometric_normal(triangle);
                let [a, b, c] = mesh.corners(triangle);
                (normal != Vec3::ZERO).then_some(Item {
                    triangle,
                    middle: ((a + b + c) / 3.0 - origin).as_vec3(),
                    normal,
                })
            })
            .collect();
        if items.is_empty() {
            return None;
        }
        let cosine = eta.min(1.0 / eta);
        let turn = [cosine, (1.0 - cosine * cosine).max(0.0).sqrt()];
        let order = Vec::with_capacity(items.len());
        let mut facets = Self { nodes: Vec::new(), order, eta: eta.into(), origin, turn };
        facets.build(mesh, &mut items);
        Some(facets)
    }

    /// Appends the node of `items` and all below it.
    fn build(&mut self, mesh: &Mesh, items: &mut [Item]) {
        let index = self.nodes.len();
        self.nodes.push(Node::around(mesh, self.origin, items));
        if items.len() <= LEAF {
            self.nodes[index].first = self.order.len() as u32;
            self.nodes[index].count = items.len() as u32;
            self.order.extend(items.iter().map(|item| item.triangle));
            return;
        }
        let axis = Aabb32::around(items.iter().map(|i| i.middle)).longest_axis();
        let middle = items.len() / 2;
        items.select_nth_unstable_by(middle, |a, b| {
            a.middle[axis].total_cmp(&b.middle[axis]).then(a.triangle.cmp(&b.triangle))
        });
        let (left, right) = items.split_at_mut(middle);
        self.build(mesh, left);
        self.nodes[index].first = self.nodes.len() as u32;
        self.build(mesh, right);
    }

    /// Puts into `found` every crossing between `x`, inside, and `p`, outside, that is at most `horizon` from `x`;
    /// whether anything stands in the way is not asked. Returns how many nodes were looked at.
    pub fn crossings(&self, mesh: &Mesh, x: DVec3, p: Towards, horizon: f32, found: &mut Vec<Crossing>) -> u32 {
        found.clear();
        // Halving leaves one node for each level below the first: 32 for 2^32 triangles.
        let (mut stack, mut waiting, mut seen) = ([0_u32; 40], 0, 0);
        let mut index = 0_u32;
        let local = (x - self.origin).as_vec3();
        let lamp = match p {
            Towards::Point(p) => Towards::Point(p - self.origin),
            Towards::Direction(w) => Towards::Direction(w),
        };
        loop {
            let node = &self.nodes[index as usize];
            seen += 1;
            if self.may_hold(node, local, lamp, horizon) {
                if node.count == 0 {
                    stack[waiting] = node.first;
                    waiting += 1;
                    index += 1;
                    continue;
                }
                for &triangle in &self.order[node.first as usize..(node.first + node.count) as usize] {
                    let crossing = self.at(mesh, triangle, x, p);
                    found.extend(crossing.filter(|c| c.bend.lengths[0] <= horizon.into()));
                }
            }
            if waiting == 0 {
                return seen;
            }
            waiting -= 1;
            index = stack[waiting];
        }
    }

    /// False only if no facet of `node` refracts light from `p` to `x`, both relative to [`Self::origin`].
    ///
    /// With unit directions u from x to the facet and v from there to p, Snell's law is that η u - v is along the normal:
    /// outwards for η > 1, inwards below. Over the ball, u and v are known up to angles, so that vector up to a
    /// distance, which must let it be in the cone of the normals. And u and v differ by no more than the boundary can turn.
    #[inline]
    fn may_hold(&self, node: &Node, x: Vec3, p: Towards, horizon: f32) -> bool {
        let to = node.centre - x;
        let near2 = to.length_squared();
        let reach = horizon + node.radius;
        if near2 > reach * reach {
            return false;
        }
        // What rounding does to places is in the radius, to angles in the slack.
        let near = 1.0 / near2.sqrt();
        let (v, sine_v) = match p {
            Towards::Point(p) => {
                let from = p.as_vec3() - node.centre;
                let far = 1.0 / from.length();
                (from * far, node.radius * far + SLACK)
            }
            Towards::Direction(w) => (w, SLACK),
        };
        let sine_u = node.radius * near + SLACK;
        if !(sine_u < 1.0 && sine_v < 1.0) {
            return true;
        }
        let u = to * near;
        // Cosines from below.
        let below = |sine: f32| 1.0 - 0.5 * sine * sine * (1.0 + sine * sine);
        let (cos_u, cos_v) = (below(sine_u), below(sine_v));
        let (cos, sine) = (cos_u * cos_v - sine_u * sine_v, sine_u + sine_v);
        if cos > 0.0 && u.dot(v) < self.turn[0] * cos - self.turn[1] * sine {
            return false;
        }
        if node.cosine <= 0.0 {
            return true;
        }
        let eta = self.eta as f32;
        let half = if eta > 1.0 { u * eta - v } else { v - u * eta };
        let length2 = half.length_squared();
        // The chord of an angle is its sine over the cosine of its half.
        let chord = |sine: f32| sine + 0.4143 * sine * sine * sine;
        let spread = eta * chord(sine_u) + chord(sine_v);
        let spread2 = spread * spread;
        if spread2 >= length2 {
            return true;
        }
        half.dot(node.axis) >= node.cosine * (length2 - spread2).sqrt() - node.sine * spread
    }

    /// The crossing at one facet.
    fn at(&self, mesh: &Mesh, triangle: u32, x: DVec3, p: Towards) -> Option<Crossing> {
        match p {
            Towards::Point(p) => self.crossing_of_point(mesh, triangle, x, p),
            Towards::Direction(w) => self.crossing_of_direction(mesh, triangle, x, w),
        }
    }

    fn crossing_of_point(&self, mesh: &Mesh, triangle: u32, x: DVec3, p: DVec3) -> Option<Crossing> {
        let corners = mesh.corners(triangle).map(|q| q - x);
        let [a, b, c] = corners;
        let scaled = (b - a).cross(c - a);
        let (lamp, size) = (p - x, scaled.length());
        let n = scaled / size;
        let depth = a.dot(n);
        let height = lamp.dot(n) - depth;
        if !(depth > 0.0 && height > 0.0) {
            return None;
        }
        // The crossing is on the line between the feet of `x` and `p` on the plane, over x + n * depth.
        let across = lamp - n * (depth + height);
        let distance = across.length();
        let along = if distance > 0.0 { across / distance } else { n.any_orthonormal_vector() };
        let side = n.cross(along);
        let [a, b, c] = corners.map(|q| [q.dot(along), q.dot(side)]);
        // Where the line enters and leaves the triangle.
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for [q, r] in [[a, b], [b, c], [c, a]] {
            if (q[1] < 0.0) != (r[1] < 0.0) {
                let at = q[0] + (r[0] - q[0]) * (q[1] / (q[1] - r[1]));
                (from, to) = (from.min(at), to.max(at));
            }
        }
        let (from, to) = (from.max(0.0), to.min(distance));
        let plane = Plane { eta: self.eta, depth, height, distance };
        if !(from <= to && plane.excess(from).0 <= 0.0 && plane.excess(to).0 >= 0.0) {
            return None;
        }
        let s = plane.bend(from, to);
        let y = n * depth + along * s;
        // Barycentric coordinates in the plane.
        let [a, b, c] = corners;
        let u = (y - a).cross(c - a).dot(n) / size;
        let v = (b - a).cross(y - a).dot(n) / size;
        let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
        let (inner, outer) = (length(depth, s), length(height, distance - s));
        Some(Crossing {
            triangle,
            u,
            v,
            bend: Bend { lengths: [inner, outer], cosines: [depth / inner, height / outer] },
            inside: (y / inner).as_vec3(),
            outside: ((lamp - y) / outer).as_vec3(),
        })
    }
}

impl Facets {
    /// Parallel light: Snell's law gives the direction inside at once.
    fn crossing_of_direction(&self, mesh: &Mesh, triangle: u32, x: DVec3, w: Vec3) -> Option<Crossing> {
        let [a, b, c] = mesh.corners(triangle).map(|q| q - x);
        let scaled = (b - a).cross(c - a);
        let size = scaled.length();
        let (n, outside) = (scaled / size, w.as_dvec3());
        let (depth, cosine) = (a.dot(n), outside.dot(n));
        if !(depth > 0.0 && cosine > 0.0) {
            return None;
        }
        let along = (outside - n * cosine) / self.eta;
        let cosine_inside = (1.0 - along.length_squared()).max(0.0).sqrt();
        if cosine_inside <= 0.0 {
            return None;
        }
        let inside = along + n * cosine_inside;
        let length = depth / cosine_inside;
        let y = inside * length;
        let u = (y - a).cross(c - a).dot(n) / size;
        let v = (b - a).cross(y - a).dot(n) / size;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| Crossing {
            triangle,
            u,
            v,
            bend: Bend { lengths: [length, f64::INFINITY], cosines: [cosine_inside, cosine] },
            inside: inside.as_vec3(),
            outside: w,
        })
    }
}

impl Node {
    fn around(mesh: &Mesh, origin: DVec3, items: &[Item]) -> Self {
        let corners = || items.iter().flat_map(|i| mesh.corners(i.triangle)).map(|q| (q - origin).as_vec3());
        let normals = || items.iter().map(|i| i.normal);
        let centre = Aabb32::around(corners()).centre();
        let radius = corners().map(|q| q.distance(centre)).fold(0.0, f32::max);
        let rounding = 8.0 * f32::EPSILON * (radius + centre.abs().max_element());
        let axis = normals().sum::<Vec3>().normalize_or_zero();
        let sine = normals().map(|n| n.cross(axis).length()).fold(0.0, f32::max);
        let least = normals().map(|n| n.dot(axis)).fold(1.0, f32::min);
        let cosine = if least > 0.0 && sine < 1.0 { (1.0 - sine * sine).sqrt() } else { 0.0 };
        Self { centre, radius: radius + rounding, axis, cosine, sine, first: 0, count: 0 }
    }
}

/// A plane between two points, seen from the side.
struct Plane {
    eta: f64,
    /// Distances of the points from the plane, inside and outside [unit].
    depth: f64,
    height: f64,
    /// Between the feet of their perpendiculars [unit].
    distance: f64,
}

impl Plane {
    /// How far from its foot light from the inner point crosses the plane, if that is between `lo` and `hi`: the one
    /// root of [`Self::excess`], by Newton's steps within a bracket.
    fn bend(&self, mut lo: f64, mut hi: f64) -> f64 {
        let first = self.distance * self.depth / (self.depth + self.eta * self.height);
        let mut s = first.clamp(lo, hi);
        for _ in 0..60 {
            let (excess, slope) = self.excess(s);
            if excess > 0.0 {
                hi = s;
            } else {
                lo = s;
            }
            let next = s - excess / slope;
            let next = if next > lo && next < hi { next } else { 0.5 * (lo + hi) };
            if (next - s).abs() <= 1e-9 * next.min(self.distance - next) + 1e-16 * self.distance {
                return next;
            }
            s = next;
        }
        s
    }

    /// By how much Snell's law fails for light that crosses at `s`,
    ///
    ///   η s / √(s² + depth²) - (distance - s) / √((distance - s)² + height²),
    ///
    /// which rises with s, and its derivative.
    #[inline]
    fn excess(&self, s: f64) -> (f64, f64) {
        let rest = self.distance - s;
        let (inner, outer) = (1.0 / length(self.depth, s), 1.0 / length(self.height, rest));
        let (cos, cos_outer) = (self.depth * inner, self.height * outer);
        (self.eta * s * inner - rest * outer, self.eta * cos * cos * inner + cos_outer * cos_outer * outer)
    }
}

#[inline]
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere;
    use crate::math::{hash, unit_f64};
    use crate::optics::refract;

    fn number(i: u64) -> f64 {
        unit_f64((hash(i + 1) >> 32) as u32)
    }

    fn point(i: u64) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|d| 2.0 * number(3 * i + d) - 1.0))
    }

    /// A closed, creased, not convex body: a ball whose radius waves.
    fn wavy() -> Mesh {
        let mut mesh = sphere(DVec3::ZERO, 1.0, 24, 48).recentred(DVec3::ZERO);
        mesh.normals = None;
        for p in &mut mesh.positions {
            *p *= 1.0 + 0.15 * (7.0 * p.x).sin() * (6.0 * p.y).cos();
        }
        mesh
    }

    #[test]
    fn a_bent_line_obeys_snell() {
        for i in 0..2000 {
            let draw = |d: u64| 10.0_f64.powf(8.0 * number(5 * i + d) - 6.0);
            let (depth, height, distance) = (draw(0), draw(1), draw(2));
            let eta = [0.6, 0.99, 1.0, 1.3, 2.4][(i % 5) as usize];
            let s = Plane { eta, depth, height, distance }.bend(0.0, distance);
            let (inner, outer) = (s / depth.hypot(s), (distance - s) / height.hypot(distance - s));
            assert!((0.0..=distance).contains(&s), "{s} of {distance}");
            assert!((eta * inner - outer).abs() < 1e-6, "eta {eta}, {depth} {height} {distance}: {s}");
        }
    }

    /// Pruning loses nothing: the tree finds what a look at every facet finds, and each is a refraction.
    #[test]
    fn the_tree_finds_every_crossing() {
        let mesh = wavy();
        let (mut found, mut total, mut nodes, mut queries) = (Vec::new(), 0, 0, 0);
        for eta in [0.75, 1.0, 1.001, 1.3, 1.5, 2.5] {
            let facets = Facets::new(&mesh, eta).unwrap();
            for i in 0..300 {
                let x = point(i) * 0.7;
                // From a direction, from far away, from near, and from another side of the same body.
                let p = match [f64::INFINITY, 60.0, 4.0, 1.6][(i % 4) as usize] {
                    f64::INFINITY => Towards::Direction(point(i + 1000).normalize().as_vec3()),
                    far => Towards::Point(point(i + 1000) * far),
                };
                let horizon = [f32::INFINITY, 0.8][(i / 4 % 2) as usize];
                nodes += facets.crossings(&mesh, x, p, horizon, &mut found);
                queries += 1;
                let mut all: Vec<Crossing> = (0..mesh.triangles.len() as u32)
                    .filter(|&t| mesh.area(t) > 0.0)
                    .filter_map(|t| facets.at(&mesh, t, x, p))
                    .filter(|c| c.bend.lengths[0] <= f64::from(horizon))
                    .collect();
                found.sort_by_key(|c| c.triangle);
                all.sort_by_key(|c| c.triangle);
                assert_eq!(found, all, "eta {eta}, {x} to {p:?}");
                total += all.len();
                for c in &all {
                    let at = mesh.point(c.triangle, c.u, c.v);
                    let inwards = refract(c.outside, at.n_geometric, eta).unwrap();
                    assert!((inwards + c.inside).length() < 1e-3, "{inwards} {c:?}");
                    assert!(at.x.distance(x + c.inside.as_dvec3() * c.bend.lengths[0]) < 1e-5);
                }
            }
        }
        assert!(total > 1000, "{total}");
        assert!(nodes / queries < 500, "{} nodes a query of {}", nodes / queries, mesh.triangles.len());
    }

    /// The area that a small cone of directions lights at the outer end, by differences.
    #[test]
    fn the_focus_is_the_cone_s_solid_angle_per_area() {
        for (eta, tangent, depth, height) in
            [(1.3_f64, 0.4, 1.0, 5.0), (1.5, 0.8, 0.3, 0.2), (0.7, 2.0, 1.0, 3.0), (1.0, 1.0, 2.0, 1.0)]
        {
            // A direction with tangents (t, q) inside, and where it meets the plane at `height`.
            let end = |t: f64, q: f64| {
                let inside = DVec3::new(t, q, 1.0).normalize();
                let (x, y) = (eta * inside.x, eta * inside.y);
                let z = (1.0 - x * x - y * y).sqrt();
                [depth * t + height * x / z, depth * q + height * y / z]
            };
            let h = 1e-5;
            let d = |a: [f64; 2], b: [f64; 2]| [(a[0] - b[0]) / (2.0 * h), (a[1] - b[1]) / (2.0 * h)];
            let along = d(end(tangent + h, 0.0), end(tangent - h, 0.0));
            let side = d(end(tangent, h), end(tangent, -h));
            let area = (along[0] * side[1] - along[1] * side[0]).abs();
            let cos = 1.0 / (1.0 + tangent * tangent).sqrt();
            let out = (1.0 - eta * eta * (1.0 - cos * cos)).sqrt();
            // Tangents to solid angle: cos³. Area of the plane to area across: times its cosine.
            let expected = cos.powi(3) / (area * out);
            let bend = Bend { lengths: [depth / cos, height / out], cosines: [cos, out] };
            assert!((bend.focus(eta) / expected - 1.0).abs() < 1e-6, "eta {eta}: {} {expected}", bend.focus(eta));
            // Parallel light is that of a point endlessly far away.
            let far = 1e9;
            let limit = far * far * Bend { lengths: [bend.lengths[0], far], ..bend }.focus(eta);
            assert!((bend.focus_of_directions(eta) / limit - 1.0).abs() < 1e-6, "eta {eta}: {limit}");
        }
    }
}
