//! From a binary tree to one of eight children a node, at the least expected cost [YKL17].
//!
//! The cost of a tree is the sum over its nodes and packs of their box's area, the chance that a ray meets it, times what
//! the test costs. From the leaves up, each binary node learns what it costs as a pack, as a node, or spread over up to
//! seven places in the node above it.

use super::node::WIDTH;
use super::split::{Range, split};
use super::triangle::LANES;

/// What a node costs in tests of a pack.
const NODE_COST: f32 = 1.0;
/// Ranges of no more triangles than this are not cut for the sake of smaller packs.
const SMALLEST: usize = 2;

/// From this depth on ranges are halved by number, so that recursion ends.
const STEEP_DEPTH: u32 = 64;

/// A node of the binary tree.
struct Binary {
    start: u32,
    count: u32,
    half_area: f32,
    /// The two children follow at this place and the next; 0 for none.
    children: u32,
    /// Least cost in up to 1, 2, .. 7 places.
    cost: [f32; WIDTH - 1],
    /// How that cost is reached: places for the left child, or one of the two below.
    how: [u8; WIDTH - 1],
}

/// As one pack.
const LEAF: u8 = 100;
/// As one node.
const NODE: u8 = 101;
/// As with one place less.
const LESS: u8 = 102;

/// The binary tree of a range, and the cheapest way to fold it.
pub struct Fold {
    nodes: Vec<Binary>,
}

/// What takes one place in a node.
#[derive(Clone, Copy, Debug)]
pub enum Slot {
    /// The triangles from `start` on, `count` of them.
    Leaf { start: usize, count: usize },
    /// A node; [`Fold::places`] has its children.
    Node(u32),
}

impl Fold {
    /// Orders the triangles of `range` into a tree; `halve` cuts by number alone.
    pub fn new(range: Range<'_>, halve: bool) -> Self {
        let mut fold = Self { nodes: Vec::with_capacity(range.len()) };
        fold.nodes.push(Binary::of(&range, 0));
        fold.grow(range, 0, 0, if halve { STEEP_DEPTH } else { 0 });
        for at in (0..fold.nodes.len()).rev() {
            fold.weigh(at);
        }
        fold
    }

    fn grow(&mut self, range: Range<'_>, at: usize, start: usize, depth: u32) {
        if range.len() <= SMALLEST {
            return;
        }
        let (left, right) = split(range, depth >= STEEP_DEPTH);
        let middle = start + left.len();
        let children = self.nodes.len();
        self.nodes[at].children = children as u32;
        self.nodes.push(Binary::of(&left, start));
        self.nodes.push(Binary::of(&right, middle));
        self.grow(left, children, start, depth + 1);
        self.grow(right, children + 1, middle, depth + 1);
    }

    /// Costs of a node whose children know theirs.
    fn weigh(&mut self, at: usize) {
        let Binary { count, half_area, children, .. } = self.nodes[at];
        let mut cost = [f32::INFINITY; WIDTH - 1];
        let mut how = [LEAF; WIDTH - 1];
        if count as usize <= LANES {
            cost[0] = half_area;
        }
        if children != 0 {
            let [left, right] = [0, 1].map(|side| self.nodes[children as usize + side].cost);
            // Cheapest in `places` places, and how many of them are the left child's.
            let shared = |places: usize| {
                let mut best = (f32::INFINITY, 1);
                for of_left in 1..places {
                    let (l, r) = (of_left.min(WIDTH - 1), (places - of_left).min(WIDTH - 1));
                    let sum = left[l - 1] + right[r - 1];
                    if sum < best.0 {
                        best = (sum, of_left as u8);
                    }
                }
                best
            };
            let as_node = shared(WIDTH).0 + half_area * NODE_COST;
            if as_node < cost[0] {
                (cost[0], how[0]) = (as_node, NODE);
            }
            for places in 2..WIDTH {
                (cost[places - 1], how[places - 1]) = shared(places);
                if cost[places - 2] <= cost[places - 1] {
                    (cost[places - 1], how[places - 1]) = (cost[places - 2], LESS);
                }
            }
        } else {
            cost = [cost[0]; WIDTH - 1];
            how[1..].fill(LESS);
        }
        (self.nodes[at].cost, self.nodes[at].how) = (cost, how);
    }

    /// What the whole range became.
    pub fn root(&self) -> Slot {
        self.single(0)
    }

    fn single(&self, at: u32) -> Slot {
        let node = &self.nodes[at as usize];
        if node.how[0] == NODE {
            Slot::Node(at)
        } else {
            Slot::Leaf { start: node.start as usize, count: node.count as usize }
        }
    }

    /// The children of a node.
    pub fn places(&self, node: u32) -> Vec<Slot> {
        let mut places = Vec::with_capacity(WIDTH);
        let children = self.nodes[node as usize].children;
        let [left, right] = [0, 1].map(|side| self.nodes[children as usize + side].cost);
        let of_left = (1..WIDTH)
            .min_by(|&a, &b| (left[a - 1] + right[WIDTH - a - 1]).total_cmp(&(left[b - 1] + right[WIDTH - b - 1])))
            .unwrap_or(1);
        self.spread(children, of_left, &mut places);
        self.spread(children + 1, WIDTH - of_left, &mut places);
        places.sort_by(|a, b| self.half_area(*b).total_cmp(&self.half_area(*a)));
        places
    }

    fn half_area(&self, place: Slot) -> f32 {
        match place {
            Slot::Node(at) => self.nodes[at as usize].half_area,
            Slot::Leaf { .. } => 0.0,
        }
    }

    fn spread(&self, at: u32, places: usize, into: &mut Vec<Slot>) {
        let node = &self.nodes[at as usize];
        match node.how[places - 1] {
            LEAF | NODE => into.push(self.single(at)),
            LESS => self.spread(at, places - 1, into),
            of_left => {
                self.spread(node.children, of_left as usize, into);
                self.spread(node.children + 1, places - of_left as usize, into);
            }
        }
    }
}

impl Binary {
    fn of(range: &Range<'_>, start: usize) -> Self {
        Self {
            start: start as u32,
            count: range.len() as u32,
            half_area: range.half_area(),
            children: 0,
            cost: [f32::INFINITY; WIDTH - 1],
            how: [LEAF; WIDTH - 1],
        }
    }
}
