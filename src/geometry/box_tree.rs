//! Boxes around faces, in a tree: which faces of two meshes, or of one, may meet.

use crate::math::{Aabb, Aabb32, DVec3, Vec3};

/// Faces in one leaf.
const LEAF: usize = 2;
/// Pairs of nodes that are looked at as tasks of their own.
const TASKS: usize = 256;

/// A balanced tree over a list of boxes in the order of a space-filling curve: node k has the children 2k and 2k + 1, and
/// node 1 holds all. 24 bytes a node, as many nodes as faces.
pub(super) struct BoxTree {
    boxes: Vec<Aabb32>,
    /// The first leaf: a power of two.
    leaves: usize,
    items: usize,
}

/// A pair of nodes, or a node with itself.
pub(super) type NodePair = (u32, u32);

impl BoxTree {
    /// Around `count` boxes.
    pub(super) fn new(count: usize, bounds: impl Fn(usize) -> Aabb) -> Self {
        let leaves = count.div_ceil(LEAF).next_power_of_two();
        let mut boxes = vec![Aabb32::EMPTY; 2 * leaves];
        for item in 0..count {
            let Aabb { lower, upper } = bounds(item);
            let around = &mut boxes[leaves + item / LEAF];
            // Outwards to the next numbers of single precision.
            *around = around.join(Aabb32 {
                lower: Vec3::from_array(lower.to_array().map(|x| (x as f32).next_down())),
                upper: Vec3::from_array(upper.to_array().map(|x| (x as f32).next_up())),
            });
        }
        for k in (1..leaves).rev() {
            boxes[k] = boxes[2 * k].join(boxes[2 * k + 1]);
        }
        Self { boxes, leaves, items: count }
    }

    /// The faces of a leaf; `None` for a node with children.
    fn faces(&self, node: u32) -> Option<std::ops::Range<u32>> {
        let leaf = (node as usize).checked_sub(self.leaves)?;
        Some((leaf * LEAF).min(self.items) as u32..((leaf + 1) * LEAF).min(self.items) as u32)
    }

    fn near(&self, node: u32, other: &Self, other_node: u32, gap: f32) -> bool {
        self.boxes[node as usize].is_near(&other.boxes[other_node as usize], gap)
    }

    /// The pairs of children of a pair of nodes of which one has some, whose boxes are within `gap` [unit] of each other.
    fn split(&self, other: &Self, (a, b): NodePair, gap: f32, out: &mut Vec<NodePair>) {
        let same = std::ptr::eq(self, other);
        if same && a == b {
            out.extend([(2 * a, 2 * a), (2 * a + 1, 2 * a + 1)]);
            if self.near(2 * a, self, 2 * a + 1, gap) {
                out.push((2 * a, 2 * a + 1));
            }
            return;
        }
        let size = |tree: &Self, node: u32| {
            let edges = tree.boxes[node as usize].extent();
            if (node as usize) < tree.leaves { edges.max_element() } else { f32::NEG_INFINITY }
        };
        let pairs =
            if size(self, a) >= size(other, b) { [(2 * a, b), (2 * a + 1, b)] } else { [(a, 2 * b), (a, 2 * b + 1)] };
        out.extend(pairs.into_iter().filter(|&(a, b)| self.near(a, other, b, gap)));
    }

    /// The work of looking at all pairs of faces, cut into tasks; always the same ones.
    pub(super) fn tasks(&self, other: &Self, gap: f32) -> Vec<NodePair> {
        let mut tasks = vec![(1, 1)];
        if self.items == 0 || other.items == 0 || !self.near(1, other, 1, gap) {
            return Vec::new();
        }
        while tasks.len() < TASKS {
            let mut next = Vec::with_capacity(3 * tasks.len());
            for &(a, b) in &tasks {
                if self.faces(a).is_some() && other.faces(b).is_some() {
                    next.push((a, b));
                } else {
                    self.split(other, (a, b), gap, &mut next);
                }
            }
            if next.len() <= tasks.len() {
                return next;
            }
            tasks = next;
        }
        tasks
    }

    /// Calls `each` for the pairs of faces of a task whose boxes are within `gap` [unit] until it says `true`; of one tree with
    /// itself each pair once, and no face with itself.
    pub(super) fn pairs(&self, other: &Self, task: NodePair, gap: f32, mut each: impl FnMut(u32, u32) -> bool) {
        let same = std::ptr::eq(self, other);
        let mut stack = vec![task];
        while let Some((a, b)) = stack.pop() {
            let (Some(first), Some(second)) = (self.faces(a), other.faces(b)) else {
                self.split(other, (a, b), gap, &mut stack);
                continue;
            };
            for i in first {
                for j in second.clone() {
                    if !(same && a == b && j <= i) && each(i, j) {
                        return;
                    }
                }
            }
        }
    }

    /// Calls `each` for the faces whose leaf's box holds a point of the segment between `from` and `to`.
    pub(super) fn along(&self, from: DVec3, to: DVec3, mut each: impl FnMut(u32)) {
        let mut stack = vec![1_u32];
        while let Some(node) = stack.pop() {
            let around = &self.boxes[node as usize];
            if self.items == 0 || around.is_empty() || !meets(from, to, around) {
                continue;
            }
            match self.faces(node) {
                Some(faces) => faces.for_each(&mut each),
                None => stack.extend([2 * node, 2 * node + 1]),
            }
        }
    }
}

/// Whether a segment may meet a box: by the projections on the axes of the box and across the segment.
fn meets(from: DVec3, to: DVec3, around: &Aabb32) -> bool {
    let around = Aabb { lower: around.lower.as_dvec3(), upper: around.upper.as_dvec3() };
    let (centre, half) = (around.centre(), 0.5 * around.extent());
    let (middle, reach) = (0.5 * (from + to) - centre, 0.5 * (to - from));
    let slack = 1e-12 * (middle.abs() + half).max_element();
    if (middle.abs() - half - reach.abs()).max_element() > slack {
        return false;
    }
    let across = middle.cross(reach).abs();
    let (h, r) = (half, reach.abs());
    let most = DVec3::new(h.y * r.z + h.z * r.y, h.x * r.z + h.z * r.x, h.x * r.y + h.y * r.x);
    (across - most).max_element() <= slack * r.max_element()
}
