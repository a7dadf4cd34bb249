//! A node with the boxes of four children, and the test of a ray against the four at once.

use glam::Vec4;

use super::super::Ray;
use crate::math::Vec3;

/// Boxes and children of an inner node: arrays by coordinate, then by child, so that one instruction serves four boxes.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// `bounds[0]` are the lower ends, `bounds[1]` the upper ones; by axis, then by child [unit].
    bounds: [[Vec4; 3]; 2],
    /// [`Child`] of each box; those of empty boxes are never read.
    children: [u32; 4],
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

    fn to_bits(self) -> u32 {
        match self {
            Self::Inner(index) => index,
            Self::Leaf(index) => index | Self::LEAF,
        }
    }

    #[inline]
    pub fn from_bits(bits: u32) -> Self {
        if bits & Self::LEAF == 0 { Self::Inner(bits) } else { Self::Leaf(bits & !Self::LEAF) }
    }
}

/// A ray as the box test wants it.
pub struct NodeRay {
    origin: [f32; 3],
    /// One over the direction; infinite with the sign of the zero where that is zero.
    inverse: [f32; 3],
    /// Which end of a slab comes first, by axis: 1 where the direction is negative.
    first: [usize; 3],
    t_min: f32,
}

impl NodeRay {
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        let inverse = ray.direction.to_array().map(|d| 1.0 / d);
        let first = inverse.map(|i| usize::from(i.is_sign_negative()));
        Self { origin: ray.origin.to_array(), inverse, first, t_min: ray.t_min }
    }
}

/// The children that a ray enters, and where.
pub struct Entered {
    /// (child, distance) of the first `count`.
    boxes: [(u32, f32); 4],
    count: usize,
}

/// `t` moved up by 2 gamma_3 of itself [Ize 2013]: with it no box is missed for the rounding of
/// the three operations behind a distance to a slab.
#[inline]
pub fn widen(t: f32) -> f32 {
    t + t.abs() * TWO_GAMMA_3
}

const HALF_ULP: f32 = 0.5 * f32::EPSILON;
const TWO_GAMMA_3: f32 = 2.0 * (3.0 * HALF_ULP) / (1.0 - 3.0 * HALF_ULP);

/// `Vec4::max` and `Vec4::min` give the second of two numbers if one is not a number: true of SSE, not of other machines.
const SECOND_IF_NAN: bool = cfg!(any(target_arch = "x86_64", target_arch = "x86"));

/// The larger; `b` if `a` is not a number: the plane of a slab in which the ray lies bounds nothing.
#[inline]
fn larger(a: Vec4, b: Vec4) -> Vec4 {
    if SECOND_IF_NAN { a.max(b) } else { Vec4::select(a.cmpgt(b), a, b) }
}

/// The smaller; `b` if `a` is not a number.
#[inline]
fn smaller(a: Vec4, b: Vec4) -> Vec4 {
    if SECOND_IF_NAN { a.min(b) } else { Vec4::select(a.cmplt(b), a, b) }
}

impl Node {
    /// A node of up to four children with their boxes (lower and upper corner).
    pub fn new(children: &[(Child, (Vec3, Vec3))]) -> Self {
        // An empty box has its ends exchanged at infinity: every ray leaves it before it enters.
        let mut node = Self { bounds: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]], children: [0; 4], count: 0 };
        for (i, (child, (lower, upper))) in children.iter().enumerate() {
            for axis in 0..3 {
                node.bounds[0][axis][i] = lower[axis];
                node.bounds[1][axis][i] = upper[axis];
            }
            node.children[i] = child.to_bits();
            node.count += 1;
        }
        node
    }

    /// The boxes that the ray enters before `t_max`; none that it touches is left out.
    #[inline]
    pub fn enter(&self, ray: &NodeRay, t_max: f32) -> Entered {
        let mut near = Vec4::splat(ray.t_min);
        let mut far = Vec4::splat(t_max);
        for axis in 0..3 {
            let (origin, inverse) = (Vec4::splat(ray.origin[axis]), Vec4::splat(ray.inverse[axis]));
            let first = ray.first[axis] & 1; // tells the compiler that it is no other
            near = larger((self.bounds[first][axis] - origin) * inverse, near);
            far = smaller((self.bounds[first ^ 1][axis] - origin) * inverse, far);
        }
        let far = far + far.abs() * TWO_GAMMA_3; // `widen`
        let mut inside = near.cmple(far).bitmask();
        let near = near.to_array();
        let mut entered = Entered { boxes: [(0, 0.0); 4], count: 0 };
        while inside != 0 {
            let i = inside.trailing_zeros() as usize & 3;
            inside &= inside - 1;
            entered.boxes[entered.count & 3] = (self.children[i], near[i]);
            entered.count += 1;
        }
        entered
    }

    /// Children of this node.
    pub fn children(&self) -> impl Iterator<Item = Child> + '_ {
        self.children[..self.count as usize].iter().map(|&c| Child::from_bits(c))
    }
}

impl Entered {
    /// The farthest first.
    #[inline]
    pub fn sorted(mut self) -> Self {
        let boxes = &mut self.boxes[..self.count];
        for i in 1..boxes.len() {
            let mut j = i;
            while j > 0 && boxes[j - 1].1 < boxes[j].1 {
                boxes.swap(j - 1, j);
                j -= 1;
            }
        }
        self
    }

    /// Puts the children on the stack, the last on top.
    #[inline]
    pub fn push(&self, stack: &mut [(u32, f32)], waiting: &mut usize) {
        for &entry in &self.boxes[..self.count] {
            stack[*waiting] = entry;
            *waiting += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entered(node: &Node, ray: &Ray) -> usize {
        node.enter(&NodeRay::new(ray), ray.t_max).count
    }

    #[test]
    fn rays_in_the_planes_of_a_box_enter_it_and_rays_beside_do_not() {
        let node = Node::new(&[(Child::Leaf(0), (Vec3::ZERO, Vec3::ONE))]);
        for sign in [1.0, -1.0] {
            for x in [0.0, 0.5, 1.0] {
                // Along z, with zeros of both signs across it.
                let ray = Ray::new(Vec3::new(x, 1.0, -3.0 * sign), Vec3::new(0.0, -0.0, sign));
                assert_eq!(entered(&node, &ray), 1, "{ray:?}");
            }
            for x in [-1e-6, 1.000_001] {
                let ray = Ray::new(Vec3::new(x, 1.0, -3.0 * sign), Vec3::new(-0.0, 0.0, sign));
                assert_eq!(entered(&node, &ray), 0, "{ray:?}");
            }
        }
    }

    #[test]
    fn a_flat_box_is_entered() {
        let node = Node::new(&[(Child::Leaf(0), (Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)))]);
        assert_eq!(entered(&node, &Ray::new(Vec3::new(0.3, 0.2, 1.7), Vec3::new(0.1, 0.2, -1.0))), 1);
        // In its plane, too: what lies in it decides.
        assert_eq!(entered(&node, &Ray::new(Vec3::new(-1.0, 0.2, 0.0), Vec3::X)), 1);
    }

    #[test]
    fn only_boxes_of_the_interval_are_entered_nearest_on_top() {
        let at = |z: f32| (Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 1.0, z + 1.0));
        let boxes = [5.0, 1.0, 9.0].map(|z| (Child::Leaf(z as u32), at(z)));
        let node = Node::new(&boxes);
        assert_eq!(node.children().collect::<Vec<_>>(), [5, 1, 9].map(Child::Leaf));
        let ray = Ray { t_max: 8.0, ..Ray::new(Vec3::new(0.5, 0.5, 0.0), Vec3::Z) };
        let (mut stack, mut waiting) = ([(0, 0.0); 4], 0);
        node.enter(&NodeRay::new(&ray), ray.t_max).sorted().push(&mut stack, &mut waiting);
        let order: Vec<Child> = stack[..waiting].iter().map(|s| Child::from_bits(s.0)).collect();
        assert_eq!(order, [Child::Leaf(5), Child::Leaf(1)]);
    }
}
