//! A binary tree over the samples of one pass, split at medians, in the order in which it is walked.

use super::Columns;
use crate::math::{Aabb, Aabb32, Vec3, Vec4};

/// Samples of a leaf, but for the last.
pub const LEAF: usize = 8;
/// Subtrees of fewer samples are built by one task.
const TASK: usize = 4096;

/// Samples `first..first + count` of the tree's columns. 80 bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Node {
    /// Mean position, weighted as members are drawn [unit].
    pub centre: Vec3,
    /// No member is farther from the centre [unit].
    pub reach: f32,
    /// Root mean square distance from the centre, weighted as members are drawn [unit].
    pub spread: f32,
    /// Sum of the members' weights per channel; the fourth is 0.
    pub weight: Vec4,
    /// Standard deviation of what a drawn member's weight makes of that sum: 0 where all members have one colour.
    pub uneven: Vec4,
    /// First member.
    pub first: u32,
    /// Number of members.
    pub count: u32,
    /// The node that follows when this one is not opened; an opened one is followed by its children.
    pub skip: u32,
}

impl Node {
    /// True without children.
    #[inline]
    pub fn is_leaf(&self) -> bool {
        self.count as usize <= LEAF
    }
}

/// The tree, and members drawn from its nodes with probability proportional to their weights.
pub struct Tree {
    /// Samples in the order of the leaves.
    pub columns: Columns,
    /// Each node before its children.
    pub nodes: Vec<Node>,
    /// Sum over all samples before each, and over all, of what a member is drawn with: the weights of the channels, each
    /// in units of its own mean.
    cumulative: Vec<f64>,
}

impl Tree {
    /// A tree over `samples`, built in parallel; the same for any number of threads.
    pub fn new(samples: &Columns) -> Self {
        Self::ordered(samples).0
    }

    /// The tree, and which sample each of its own is.
    pub fn ordered(samples: &Columns) -> (Self, Vec<u32>) {
        let count = samples.len();
        let mut total = [0.0_f64; 3];
        for i in 0..count {
            let weight = samples.weight(i);
            for c in 0..3 {
                total[c] += f64::from(weight[c]);
            }
        }
        let scale = total.map(|t| if t > 0.0 { count as f64 / t } else { 0.0 });
        let importance = |weight: [f32; 3]| -> f64 { (0..3).map(|c| f64::from(weight[c]) * scale[c]).sum() };
        let mut points: Vec<(Vec3, u32)> = (0..count).map(|i| (samples.point(i), i as u32)).collect();
        let mut nodes = vec![Node::default(); nodes_of(count)];
        if count > 0 {
            split(&mut points, &mut nodes, 0, 0);
        }
        let order: Vec<u32> = points.iter().map(|p| p.1).collect();
        let columns = samples.permuted(&order);
        let mut cumulative = Vec::with_capacity(count + 1);
        cumulative.push(0.0);
        let mut sum = 0.0;
        for i in 0..count {
            sum += importance(columns.weight(i));
            cumulative.push(sum);
        }
        let mut tree = Self { columns, nodes, cumulative };
        tree.measure();
        (tree, order)
    }

    /// One sample for each node, in their order: the mean of its members, as they are drawn, with their whole weight.
    pub fn clusters(&self) -> Columns {
        let mass = |i: usize| self.cumulative[i + 1] - self.cumulative[i];
        let ranges = self.nodes.iter().map(|n| n.first as usize..(n.first + n.count) as usize);
        self.columns.means(ranges, mass)
    }

    /// Bytes of nodes, tables and columns.
    pub fn bytes(&self) -> usize {
        self.columns.bytes() + self.nodes.len() * size_of::<Node>() + self.cumulative.len() * size_of::<f64>()
    }

    /// Centres, sizes and sums of all nodes, from the leaves up.
    fn measure(&mut self) {
        let mut moments = vec![Moments::default(); self.nodes.len()];
        for at in (0..self.nodes.len()).rev() {
            let mut node = self.nodes[at];
            let (first, end) = (node.first as usize, (node.first + node.count) as usize);
            let mut own = Moments::default();
            if node.is_leaf() {
                for i in first..end {
                    own.take(
                        self.columns.point(i),
                        self.columns.weight(i),
                        self.cumulative[i + 1] - self.cumulative[i],
                    );
                }
            } else {
                let (left, right) = (at + 1, self.nodes[at + 1].skip as usize);
                own.join(&moments[left]);
                own.join(&moments[right]);
            }
            moments[at] = own;
            let centre = if own.mass > 0.0 { own.first.map(|v| v / own.mass) } else { own.bounds.centre().to_array() };
            node.centre = Vec3::from_array(centre.map(|v| v as f32));
            let variance: f64 = (0..3).map(|k| own.second[k] - own.mass * centre[k] * centre[k]).sum();
            node.spread = if own.mass > 0.0 { (variance / own.mass).max(0.0).sqrt() as f32 } else { 0.0 };
            // Of the box: cheap, and at most √3 too far.
            let corner = |k: usize| (own.bounds.upper[k] - centre[k]).max(centre[k] - own.bounds.lower[k]);
            node.reach = (0..3).map(|k| corner(k).powi(2)).sum::<f64>().sqrt() as f32;
            let [r, g, b] = own.weight.map(|w| w as f32);
            node.weight = Vec4::new(r, g, b, 0.0);
            let [r, g, b] = [0, 1, 2].map(|c| own.uneven(c) as f32);
            node.uneven = Vec4::new(r, g, b, 0.0);
            self.nodes[at] = node;
        }
    }

    /// The member of `node` at `u` in [0, 1), drawn with probability proportional to its weight, and the inverse of the
    /// probability. `None` where no member weighs anything.
    #[inline]
    pub fn draw(&self, node: &Node, u: f64) -> Option<(u32, f32)> {
        let (first, end) = (node.first as usize, (node.first + node.count) as usize);
        let (begin, mass) = (self.cumulative[first], self.cumulative[end] - self.cumulative[first]);
        if mass <= 0.0 {
            return None;
        }
        let goal = begin + u * mass;
        // The last member that begins at or before `goal`, by bisection without branches to be mispredicted.
        let (mut i, mut size) = (first, end - first);
        while size > 1 {
            let half = size / 2;
            i = if self.cumulative[i + half] <= goal { i + half } else { i };
            size -= half;
        }
        let own = self.cumulative[i + 1] - self.cumulative[i];
        (own > 0.0).then_some((i as u32, (mass / own) as f32))
    }
}

/// Nodes of a tree of `count` samples.
fn nodes_of(count: usize) -> usize {
    (2 * count.div_ceil(LEAF)).saturating_sub(1)
}

/// Sorts `points` into the leaves under nodes[0], which is node number `at` of the tree; they begin at sample `first`.
fn split(points: &mut [(Vec3, u32)], nodes: &mut [Node], at: u32, first: u32) {
    let (node, below) = nodes.split_at_mut(1);
    node[0].first = first;
    node[0].count = points.len() as u32;
    node[0].skip = at + 1 + below.len() as u32;
    if points.len() <= LEAF {
        return;
    }
    let axis = Aabb32::around(points.iter().map(|p| p.0)).longest_axis();
    // Leaves are full, but for the last.
    let middle = points.len().div_ceil(LEAF).div_ceil(2) * LEAF;
    points.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let large = points.len() > TASK;
    let (left, right) = points.split_at_mut(middle);
    let (left_nodes, right_nodes) = below.split_at_mut(nodes_of(middle));
    let right_at = at + 1 + left_nodes.len() as u32;
    let mut halves =
        (|| split(left, left_nodes, at + 1, first), || split(right, right_nodes, right_at, first + middle as u32));
    if large {
        rayon::join(halves.0, halves.1);
    } else {
        (halves.0)();
        (halves.1)();
    }
}

/// Sums over the members of a node, in f64.
#[derive(Clone, Copy)]
struct Moments {
    mass: f64,
    first: [f64; 3],
    second: [f64; 3],
    bounds: Aabb,
    weight: [f64; 3],
    /// Σ weight² / mass.
    squares: [f64; 3],
}

impl Default for Moments {
    fn default() -> Self {
        let zero = [0.0; 3];
        Self { mass: 0.0, first: zero, second: zero, bounds: Aabb::EMPTY, weight: zero, squares: zero }
    }
}

impl Moments {
    fn take(&mut self, point: Vec3, weight: [f32; 3], mass: f64) {
        self.mass += mass;
        self.bounds.grow(point.as_dvec3());
        for k in 0..3 {
            let x = f64::from(point[k]);
            self.first[k] += mass * x;
            self.second[k] += mass * x * x;
            self.weight[k] += f64::from(weight[k]);
            if mass > 0.0 {
                self.squares[k] += f64::from(weight[k]).powi(2) / mass;
            }
        }
    }

    fn join(&mut self, other: &Self) {
        self.mass += other.mass;
        self.bounds = self.bounds.join(other.bounds);
        for k in 0..3 {
            self.first[k] += other.first[k];
            self.second[k] += other.second[k];
            self.weight[k] += other.weight[k];
            self.squares[k] += other.squares[k];
        }
    }

    /// Members are drawn with probability mass / Σ mass and stand for weight · Σ mass / mass.
    fn uneven(&self, c: usize) -> f64 {
        (self.mass * self.squares[c] - self.weight[c] * self.weight[c]).max(0.0).sqrt()
    }
}
