//! A node with the boxes of eight children, and the test of a ray against the eight at once.

use super::super::Ray;
use crate::math::{Aabb32, F8, Simd, splat3};

/// Children of a node, one a lane.
pub const WIDTH: usize = 8;

/// Boxes and children of an inner node: arrays by coordinate, then by child, so that one instruction serves all boxes.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// `bounds[0]` are the lower ends, `bounds[1]` the upper ones; by axis, then by child [unit].
    bounds: [[[f32; WIDTH]; 3]; 2],
    /// [`Child`] of each box; those of empty boxes are never read.
    children: [u32; WIDTH],
    /// How many children there are.
    count: u32,
}

/// What a box encloses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Index of a node.
    Inner(u32),
    /// Index of a pack of triangles.
    Leaf(u32),
}

impl Child {
    const LEAF: u32 = 1 << 31;

    pub fn to_bits(self) -> u32 {
        match self {
            Self::Inner(index) => index,
            Self::Leaf(index) => index | Self::LEAF,
        }
    }

    /// The same where `nodes` and `packs` have come before its own.
    pub fn moved_by(self, nodes: u32, packs: u32) -> Self {
        match self {
            Self::Inner(index) => Self::Inner(index + nodes),
            Self::Leaf(index) => Self::Leaf(index + packs),
        }
    }

    #[inline(always)]
    pub fn from_bits(bits: u32) -> Self {
        if bits & Self::LEAF == 0 { Self::Inner(bits) } else { Self::Leaf(bits & !Self::LEAF) }
    }
}

/// One over the direction is made larger by this for the far end of a box: so it lies beyond, whatever three roundings did
/// to the near end and four to this one: 1 + gamma_7 and a bit [Ize 2013].
pub const WIDENED: f32 = 1.0 + 4.0 * f32::EPSILON;

/// Rays or boxes, eight of them, as the test of slabs wants them: one ray and eight boxes, or eight rays and one box.
#[derive(Clone, Copy)]
pub struct Slabs<S: Simd> {
    /// Start [unit].
    pub origin: [F8<S>; 3],
    /// One over the direction; infinite with the sign of the zero where that is zero.
    pub inverse: [F8<S>; 3],
    /// The same, [`WIDENED`].
    pub inverse_far: [F8<S>; 3],
    /// Lower end of the interval.
    pub t_min: F8<S>,
}

impl<S: Simd> Slabs<S> {
    /// Which lanes meet their box before `t_max`, and where they enter. `first` are the planes that are met first, by
    /// axis, `last` the others. No box that a ray touches is left out; a plane in which a ray lies bounds nothing.
    #[inline(always)]
    pub fn enter(&self, first: [F8<S>; 3], last: [F8<S>; 3], t_max: F8<S>) -> (u32, F8<S>) {
        let [x, y, z] = self.distances(first, self.inverse);
        let near = x.max(y.max(z.max(self.t_min)));
        let [x, y, z] = self.distances(last, self.inverse_far);
        let far = x.min(y.min(z.min(t_max)));
        (near.le(far), near)
    }

    #[inline(always)]
    fn distances(&self, p: [F8<S>; 3], inverse: [F8<S>; 3]) -> [F8<S>; 3] {
        let o = self.origin;
        [(p[0] - o[0]) * inverse[0], (p[1] - o[1]) * inverse[1], (p[2] - o[2]) * inverse[2]]
    }
}

/// One ray as the box test wants it.
pub struct NodeRay<S: Simd> {
    slabs: Slabs<S>,
    /// Which end of a slab comes first, by axis: 1 where the direction is negative.
    first: [usize; 3],
    simd: S,
}

impl<S: Simd> NodeRay<S> {
    #[inline(always)]
    pub fn new(simd: S, ray: &Ray) -> Self {
        let inverse = ray.direction.to_array().map(|d| 1.0 / d);
        let slabs = Slabs {
            origin: splat3(simd, ray.origin.as_vec3().to_array()),
            inverse: splat3(simd, inverse),
            inverse_far: splat3(simd, inverse.map(|i| i * WIDENED)),
            t_min: F8::splat(simd, ray.t_min),
        };
        let first = inverse.map(|i| usize::from(i.is_sign_negative()));
        Self { slabs, first, simd }
    }
}

impl<S: Simd> NodeRay<S> {
    /// Which end of a slab comes first, by axis.
    #[inline(always)]
    pub fn first(&self) -> [usize; 3] {
        self.first
    }
}

impl Node {
    /// A node of up to eight children with their boxes.
    pub fn new(children: &[(Child, Aabb32)]) -> Self {
        // An empty box has its ends exchanged at infinity: every ray leaves it before it enters.
        let mut node = Self {
            bounds: [[[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]],
            children: [0; WIDTH],
            count: 0,
        };
        for (i, (child, Aabb32 { lower, upper })) in children.iter().enumerate() {
            for axis in 0..3 {
                node.bounds[0][axis][i] = lower[axis];
                node.bounds[1][axis][i] = upper[axis];
            }
            node.children[i] = child.to_bits();
            node.count += 1;
        }
        node
    }

    /// [`Child::moved_by`] of all children.
    pub fn moved_by(mut self, nodes: u32, packs: u32) -> Self {
        for child in &mut self.children[..self.count as usize] {
            *child = Child::from_bits(*child).moved_by(nodes, packs).to_bits();
        }
        self
    }

    /// The boxes that the ray enters at `t_max` or before, as bits, and where; none that it touches is left out.
    #[inline(always)]
    pub fn enter<S: Simd>(&self, ray: &NodeRay<S>, t_max: f32) -> (u32, F8<S>) {
        let (first, last) = self.all_planes(ray.simd, ray.first);
        ray.slabs.enter(first, last, F8::splat(ray.simd, t_max))
    }

    /// Of each box the planes that a ray meets first, by axis, and the others.
    #[inline(always)]
    pub fn all_planes<S: Simd>(&self, simd: S, [x, y, z]: [usize; 3]) -> ([F8<S>; 3], [F8<S>; 3]) {
        (
            [self.planes(simd, x, 0), self.planes(simd, y, 1), self.planes(simd, z, 2)],
            [self.planes(simd, x ^ 1, 0), self.planes(simd, y ^ 1, 1), self.planes(simd, z ^ 1, 2)],
        )
    }

    /// The same of one box, in every lane.
    #[inline(always)]
    pub fn box_planes<S: Simd>(&self, simd: S, i: usize, [x, y, z]: [usize; 3]) -> ([F8<S>; 3], [F8<S>; 3]) {
        let (x, y, z, i) = (x & 1, y & 1, z & 1, i % WIDTH);
        let b = &self.bounds;
        (
            splat3(simd, [b[x][0][i], b[y][1][i], b[z][2][i]]),
            splat3(simd, [b[x ^ 1][0][i], b[y ^ 1][1][i], b[z ^ 1][2][i]]),
        )
    }

    #[inline(always)]
    fn planes<S: Simd>(&self, simd: S, end: usize, axis: usize) -> F8<S> {
        F8::load(simd, &self.bounds[end & 1][axis])
    }

    /// Child number `i`.
    #[inline(always)]
    pub fn child_bits(&self, i: usize) -> u32 {
        self.children[i % WIDTH]
    }

    /// Children of this node.
    pub fn children(&self) -> impl Iterator<Item = Child> + '_ {
        self.children[..self.count as usize].iter().map(|&c| Child::from_bits(c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, LaneKernel, Lanes, Level, Vec3, hash, unit_f32};

    struct Enter<'a>(&'a Node, Ray);

    impl LaneKernel for Enter<'_> {
        type Out = (u32, [f32; WIDTH]);
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Out {
            let (lanes, near) = self.0.enter(&NodeRay::new(simd, &self.1), self.1.t_max);
            (lanes, near.to_array())
        }
    }

    fn entered(node: &Node, ray: &Ray) -> usize {
        let counts =
            Level::available().into_iter().map(|l| Lanes::at(l).run(Enter(node, *ray)).0.count_ones() as usize);
        let counts: Vec<usize> = counts.collect();
        assert!(counts.iter().all(|&n| n == counts[0]), "{counts:?}");
        counts[0]
    }

    #[test]
    fn rays_in_the_planes_of_a_box_enter_it_and_rays_beside_do_not() {
        let node = Node::new(&[(Child::Leaf(0), Aabb32::around([Vec3::ZERO, Vec3::ONE]))]);
        for sign in [1.0, -1.0] {
            for x in [0.0, 0.5, 1.0] {
                // Along z, with zeros of both signs across it.
                let ray = Ray::new(Vec3::new(x, 1.0, -3.0 * sign).as_dvec3(), Vec3::new(0.0, -0.0, sign));
                assert_eq!(entered(&node, &ray), 1, "{ray:?}");
            }
            for x in [-1e-6, 1.000_001] {
                let ray = Ray::new(Vec3::new(x, 1.0, -3.0 * sign).as_dvec3(), Vec3::new(-0.0, 0.0, sign));
                assert_eq!(entered(&node, &ray), 0, "{ray:?}");
            }
        }
    }

    #[test]
    fn a_flat_box_is_entered() {
        let node = Node::new(&[(Child::Leaf(0), Aabb32::around([Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)]))]);
        assert_eq!(entered(&node, &Ray::new(DVec3::new(0.3, 0.2, 1.7), Vec3::new(0.1, 0.2, -1.0))), 1);
        // In its plane, too: what lies in it decides.
        assert_eq!(entered(&node, &Ray::new(DVec3::new(-1.0, 0.2, 0.0), Vec3::X)), 1);
    }

    #[test]
    fn only_boxes_of_the_interval_are_entered() {
        let at = |z: f32| Aabb32::around([Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 1.0, z + 1.0)]);
        let boxes = [5.0, 1.0, 9.0].map(|z| (Child::Leaf(z as u32), at(z)));
        let node = Node::new(&boxes);
        assert_eq!(node.children().collect::<Vec<_>>(), [5, 1, 9].map(Child::Leaf));
        for level in Level::available() {
            let ray = Ray { t_max: 8.0, ..Ray::new(DVec3::new(0.5, 0.5, 0.0), Vec3::Z) };
            let (lanes, near) = Lanes::at(level).run(Enter(&node, ray));
            assert_eq!((lanes, near[0], near[1]), (0b11, 5.0, 1.0), "{level:?}");
        }
    }

    /// What the order of visits rests on: a box within another is not entered before it.
    #[test]
    fn a_box_is_entered_no_later_than_what_is_in_it() {
        let draw = |i: u64| unit_f32((hash(i + 1) >> 32) as u32);
        let point = |i: u64| Vec3::new(draw(3 * i), draw(3 * i + 1), draw(3 * i + 2));
        let mut both = 0;
        for i in 0..20_000 {
            let (a, b, c) = (point(5 * i), point(5 * i + 1), point(5 * i + 2));
            let (inner, outer) = (Aabb32::around([a, b]), Aabb32::around([a, b, c]));
            let node = Node::new(&[(Child::Leaf(0), inner), (Child::Leaf(1), outer)]);
            let from = point(5 * i + 3) * 3.0 - Vec3::ONE;
            let ray = Ray::new(from.as_dvec3(), point(5 * i + 4) - from);
            let (lanes, near) = Lanes::at(Level::best()).run(Enter(&node, ray));
            assert!(lanes != 0b01, "{ray:?} enters {inner:?} but not {outer:?}");
            if lanes == 0b11 {
                both += 1;
                assert!(near[1] <= near[0], "{near:?}");
            }
        }
        assert!(both > 500, "{both}");
    }
}
