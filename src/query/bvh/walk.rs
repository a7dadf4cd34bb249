//! One ray through the tree: the nearest hit, or any.

use super::build::Tree;
use super::node::{Child, NodeRay, WIDTH};
use super::stack::{STACK, Stack};
use super::triangle::TriangleRay;
use crate::math::{LaneKernel, Simd};
use crate::query::Ray;

/// The best hit so far, by its place in the tree.
#[derive(Clone, Copy)]
pub struct Found {
    /// Ray parameter, or the ray's end.
    pub t: f32,
    /// Pack and lane; [`Self::NOWHERE`] as long as there is no hit.
    pub place: (u32, u32),
    pub u: f32,
    pub v: f32,
}

impl Found {
    /// Behind every place.
    pub const NOWHERE: (u32, u32) = (u32::MAX, u32::MAX);

    /// Nothing yet before `t_max`.
    #[inline(always)]
    pub fn nothing(t_max: f32) -> Self {
        Self { t: t_max, place: Self::NOWHERE, u: 0.0, v: 0.0 }
    }

    #[inline(always)]
    pub fn is_hit(&self) -> bool {
        self.place.0 != u32::MAX
    }

    /// The first distance that is no longer of use: beyond a hit only by a tie.
    #[inline(always)]
    pub fn t_end(&self) -> f32 {
        if self.is_hit() { self.t.next_up() } else { self.t }
    }
}

/// A ray as both tests want it.
pub struct OneRay<S: Simd> {
    node: NodeRay<S>,
    triangle: TriangleRay<S>,
}

impl<S: Simd> OneRay<S> {
    #[inline(always)]
    pub fn new(simd: S, ray: &Ray) -> Self {
        Self { node: NodeRay::new(simd, ray), triangle: TriangleRay::new(simd, ray) }
    }

    /// The better of `best` and what the ray meets below `child`, whose box it enters at `enters`.
    #[inline(always)]
    pub fn closest(&self, tree: &Tree, child: Child, enters: f32, mut best: Found) -> Found {
        let mut t_end = best.t_end();
        let mut stack = Stack::<u32, STACK>::new();
        let (mut child, mut enters) = (child.to_bits(), enters);
        loop {
            match Child::from_bits(child) {
                Child::Inner(index) => {
                    let node = &tree.nodes[index as usize];
                    let (mut inside, near) = node.enter(&self.node, best.t);
                    if inside != 0 {
                        let near = near.to_array();
                        let mut next = || {
                            let i = inside.trailing_zeros() as usize % WIDTH;
                            inside &= inside - 1;
                            ((node.child_bits(i), near[i]), inside != 0)
                        };
                        let (first, more) = next();
                        (child, enters) = first;
                        if !more {
                            continue;
                        }
                        let (second, more) = next();
                        if !more {
                            let (nearer, farther) = if second.1 < first.1 { (second, first) } else { (first, second) };
                            stack.push(farther.0, farther.1);
                            (child, enters) = nearer;
                            continue;
                        }
                        let from = stack.len();
                        stack.push(first.0, first.1);
                        stack.insert(from, second.0, second.1);
                        loop {
                            let (other, more) = next();
                            stack.insert(from, other.0, other.1);
                            if !more {
                                break;
                            }
                        }
                    }
                }
                Child::Leaf(pack) => {
                    let met = tree.packs[pack as usize].meet(&self.triangle, enters, t_end);
                    if let Some(hit) = met.and_then(|m| m.nearest())
                        && (hit.t < best.t || pack < best.place.0)
                    {
                        best = Found { t: hit.t, place: (pack, hit.lane as u32), u: hit.u, v: hit.v };
                        t_end = best.t_end();
                    }
                }
            }
            loop {
                let Some(next) = stack.pop() else { return best };
                (child, enters) = next;
                if enters <= best.t {
                    break;
                }
            }
        }
    }

    /// Whether the ray meets anything below `child` before `t_max`.
    #[inline(always)]
    fn occluded(&self, tree: &Tree, child: Child, enters: f32, t_max: f32) -> bool {
        let mut stack = Stack::<u32, STACK>::new();
        let (mut child, mut enters) = (child.to_bits(), enters);
        loop {
            match Child::from_bits(child) {
                Child::Inner(index) => {
                    let node = &tree.nodes[index as usize];
                    let (mut inside, near) = node.enter(&self.node, t_max);
                    if inside != 0 {
                        let near = near.to_array();
                        // The last first: leaves come behind the inner nodes of a node.
                        loop {
                            let i = inside.trailing_zeros() as usize % WIDTH;
                            (child, enters) = (node.child_bits(i), near[i]);
                            inside &= inside - 1;
                            if inside == 0 {
                                break;
                            }
                            stack.push(child, enters);
                        }
                        continue;
                    }
                }
                Child::Leaf(pack) => {
                    if tree.packs[pack as usize].meet(&self.triangle, enters, t_max).is_some() {
                        return true;
                    }
                }
            }
            let Some(next) = stack.pop() else { return false };
            (child, enters) = next;
        }
    }
}

/// The first triangle along a ray.
pub struct Closest<'a> {
    pub tree: &'a Tree,
    pub ray: &'a Ray,
}

impl LaneKernel for Closest<'_> {
    type Out = Found;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Found {
        let Self { tree, ray } = self;
        let nothing = Found::nothing(ray.t_max);
        match tree.root {
            Some(root) => OneRay::new(simd, ray).closest(tree, root, ray.t_min, nothing),
            None => nothing,
        }
    }
}

/// Whether there is a triangle along each of several rays.
pub struct Occluded<'a> {
    pub tree: &'a Tree,
    pub rays: &'a [Ray],
    pub out: &'a mut [bool],
}

impl LaneKernel for Occluded<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { tree, rays, out } = self;
        for (ray, out) in rays.iter().zip(out) {
            *out = match tree.root {
                Some(root) => OneRay::new(simd, ray).occluded(tree, root, ray.t_min, ray.t_max),
                None => false,
            };
        }
    }
}
