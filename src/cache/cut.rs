//! The sum over a tree of samples, in which one random member stands for each far node.

use super::{Columns, Envelope, Node, Tree};
use crate::bssrdf::{Exit, Model, Partition};
use crate::math::{Vec3, Vec4, hash};

/// A node whose members spread over less than this share of its distance counts as a point when the sum is guessed.
const GUESS: f32 = 0.3;

/// Exits of one group at most.
const GROUP: usize = 32;
/// A group whose cut is longer than this is halved: its exits are too far apart to have one cut.
const LONG: usize = 4096;
/// A channel below this share of the brightest is held to the accuracy of one of this size.
const DARK_CHANNEL: f32 = 0.02;
/// Exits at which the sum of a group is guessed, at most.
const GUESSES: usize = 4;

/// Working space of [`cut`], for one model.
pub struct Buffer {
    columns: Columns,
    clusters: Columns,
    /// Samples to evaluate, and factors on their weights.
    picked: Vec<(u32, f32)>,
    /// Nodes for which one member stands.
    far: Vec<u32>,
    /// Exits in the order of their groups.
    order: Vec<u32>,
}

impl Buffer {
    /// Empty.
    pub fn new(model: &Model) -> Self {
        Self {
            columns: Columns::new(model),
            clusters: Columns::new(model),
            picked: Vec::new(),
            far: Vec::new(),
            order: Vec::new(),
        }
    }
}

/// What the sums over a tree cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct CutWork {
    /// Nodes visited.
    pub nodes: u64,
    /// Pairs at which S_d was evaluated.
    pub evaluated: u64,
    /// Values of S_d below zero that counted as 0.
    pub clamped: u64,
}

/// A cut's tree, model and how coarse it may be.
#[derive(Clone, Copy)]
pub struct Cut<'a> {
    /// The samples.
    pub tree: &'a Tree,
    /// Where given, the mean of its members stands for a far node in place of a random one [JB02]: biased.
    pub clusters: Option<&'a Columns>,
    /// Their S_d.
    pub model: &'a Model,
    /// How fast it falls.
    pub envelope: &'a Envelope,
    /// The largest share of the whole sum that the standard deviation of one node may have.
    pub error: f32,
    /// Sums below this are held to the accuracy of one of this size; the fourth is 0.
    pub floor: Vec4,
    /// The part of S_d that is summed.
    pub partition: Partition,
}

/// Exits that share one cut: a ball around them.
struct Ball {
    centre: Vec3,
    radius: f32,
}

impl Cut<'_> {
    /// Σ S_d · weight per channel over all samples of the tree, to each of `exits`, unbiased: leaves near an exit are
    /// summed, one member drawn with probability proportional to its weight stands for every other node of the cut.
    /// Neighbouring exits share a cut and its draws, which makes the walk through the tree cheap and the noise of
    /// the draws alike in a group. `keys`, one for each exit, seed the draws; `buffer` is working space.
    ///
    /// A node's standard deviation is taken as |dS_d/dr| × spread × weight at its near side, and what its members'
    /// colours add. The sum itself is guessed from centres. Both decide only which nodes are opened and do not depend
    /// on the draws, so that the mean is exact.
    pub fn sums(&self, exits: &[Exit], keys: &[u64], buffer: &mut Buffer, out: &mut [[f64; 3]]) -> CutWork {
        let mut order = std::mem::take(&mut buffer.order);
        order.clear();
        order.extend(0..exits.len() as u32);
        let mut work = CutWork::default();
        self.split(exits, keys, &mut order, buffer, out, &mut work);
        buffer.order = order;
        work
    }

    /// Halves `order` at medians until the exits are few and near enough to share a cut, then sums.
    fn split(
        &self,
        exits: &[Exit],
        keys: &[u64],
        order: &mut [u32],
        buffer: &mut Buffer,
        out: &mut [[f64; 3]],
        work: &mut CutWork,
    ) {
        let Some(&first) = order.first() else { return };
        let at = |i: &u32| exits[*i as usize].x;
        let (lower, upper) = order.iter().fold((at(&first), at(&first)), |(l, u), i| (l.min(at(i)), u.max(at(i))));
        if order.len() <= GROUP {
            let centre = 0.5 * (lower + upper);
            let radius = order.iter().map(|i| at(i).distance(centre)).fold(0.0, f32::max);
            self.collect(exits, order, &Ball { centre, radius }, buffer, work);
            if order.len() == 1 || buffer.picked.len() + buffer.far.len() <= LONG {
                self.sum(exits, keys[first as usize], order, buffer, out, work);
                return;
            }
        }
        let size = upper - lower;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { usize::from(size.y < size.z) + 1 };
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |a, b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(b)));
        let (left, right) = order.split_at_mut(middle);
        self.split(exits, keys, left, buffer, out, work);
        self.split(exits, keys, right, buffer, out, work);
    }

    /// The cut of a group: samples near it and nodes far from it.
    fn collect(&self, exits: &[Exit], order: &[u32], ball: &Ball, buffer: &mut Buffer, work: &mut CutWork) {
        // The darkest of some exits decides how fine the cut is.
        let step = order.len().div_ceil(GUESSES);
        let mut least = Vec4::splat(f32::INFINITY);
        for &i in order.iter().step_by(step) {
            least = least.min(self.guess(exits[i as usize].x, work));
        }
        // A channel that is dark beside the others, or where the whole surface is brighter, need not be finer than they are.
        least = least.max(Vec4::splat(DARK_CHANNEL * least.max_element())).max(self.floor);
        // Channels without light must not open anything.
        let limit = Vec4::from_array(least.to_array().map(|g| if g > 0.0 { 1.0 / (self.error * g) } else { 0.0 }));
        buffer.picked.clear();
        buffer.far.clear();
        let mut at = 0;
        while let Some(node) = self.tree.nodes.get(at) {
            work.nodes += 1;
            let open = self.opens(node, ball, limit);
            if open && node.is_leaf() {
                buffer.picked.extend((node.first..node.first + node.count).map(|i| (i, 1.0)));
                at += 1;
            } else if open {
                at += 1;
            } else {
                buffer.far.push(at as u32);
                at = node.skip as usize;
            }
        }
    }

    /// Draws a member of each far node, and sums for each exit of the group.
    fn sum(
        &self,
        exits: &[Exit],
        key: u64,
        order: &[u32],
        buffer: &mut Buffer,
        out: &mut [[f64; 3]],
        work: &mut CutWork,
    ) {
        work.evaluated += (buffer.picked.len() + buffer.far.len()) as u64 * order.len() as u64;
        if let Some(clusters) = self.clusters {
            let far: Vec<(u32, f32)> = buffer.far.iter().map(|&at| (at, 1.0)).collect();
            buffer.clusters.pick(clusters, &far);
        } else {
            // One after the other, so that their visits to memory overlap.
            for &at in &buffer.far {
                buffer.picked.extend(self.tree.draw(&self.tree.nodes[at as usize], uniform(key, at as usize)));
            }
        }
        buffer.columns.pick(&self.tree.columns, &buffer.picked);
        for &i in order {
            let exit = &exits[i as usize];
            let mut sum = buffer.columns.sum(self.model, exit, self.partition, &mut work.clamped);
            if self.clusters.is_some() {
                let far = buffer.clusters.sum(self.model, exit, self.partition, &mut work.clamped);
                sum.iter_mut().zip(far).for_each(|(sum, far)| *sum += far);
            }
            out[i as usize] = sum;
        }
    }

    /// True if one member may not stand for the node.
    #[inline]
    fn opens(&self, node: &Node, ball: &Ball, limit: Vec4) -> bool {
        let near = node.centre.distance(ball.centre) - ball.radius - node.reach;
        if near <= 0.0 {
            return true;
        }
        let fall = self.envelope.at(near * near);
        let relative = fall.slope * node.spread + fall.value * self.envelope.other;
        let deviation = relative * node.weight + fall.value * node.uneven;
        (deviation * limit).cmpgt(Vec4::ONE).any()
    }

    /// The sum from centres of nodes, good to some ten percent.
    fn guess(&self, x: Vec3, work: &mut CutWork) -> Vec4 {
        let mut sum = Vec4::ZERO;
        let mut at = 0;
        while let Some(node) = self.tree.nodes.get(at) {
            work.nodes += 1;
            let d2 = node.centre.distance_squared(x);
            let s2 = node.spread * node.spread;
            if s2 > GUESS * GUESS * d2 && !node.is_leaf() {
                at += 1;
                continue;
            }
            let fall = self.envelope.at(d2 + s2);
            sum += fall.value * node.weight;
            at = node.skip as usize;
        }
        sum
    }
}

/// Uniform in [0, 1), a pure function of the exit's key and the node.
#[inline]
fn uniform(key: u64, node: usize) -> f64 {
    let bits = hash(key.wrapping_add((node as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}
