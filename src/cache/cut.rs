//! The sum over a tree of samples, in which one random member stands for each far node.

use super::{Columns, Envelope, Node, Tree};
use crate::bssrdf::{Bssrdf, Exit, Layout, Partition};
use crate::math::{Aabb32, Vec3, Vec4, hash};
use crate::tally::GatherTally;

/// A node whose members spread over less than this share of its distance counts as a point when the sum is guessed.
const GUESS: f32 = 0.3;

/// Exits of one group at most.
const GROUP: usize = 32;
/// The same for coarse sums.
const GROUP_IF_COARSE: usize = 4;
/// A group whose cut is longer than this is halved: its exits are too far apart to have one cut.
const LONG: usize = 4096;
/// A channel below this share of the brightest is held to the accuracy of one of this size.
const DARK_CHANNEL: f32 = 0.02;
/// Exits at which the sum of a group is guessed, at most.
const GUESSES: usize = 4;

/// How fine sums are, and of what part.
#[derive(Clone, Copy, Debug)]
pub struct Tuning {
    /// The largest share of the sum that one node of a cut may be wrong by.
    pub error: f32,
    /// Means over the samples below this are held to the accuracy of one of this size [S_d flux]; the fourth is 0.
    pub floor: Vec4,
    /// The part of S_d that is summed; `notes` and `thinned` sum it whole.
    pub partition: Partition,
}

impl Tuning {
    /// Everything, to a share of `error` of itself.
    pub fn relative(error: f32) -> Self {
        Self { error, floor: Vec4::ZERO, partition: Partition::NONE }
    }
}

/// Working space of one task.
pub struct Scratch {
    /// Samples of one group.
    columns: Columns,
    clusters: Columns,
    /// Samples to evaluate, and factors on their weights.
    picked: Vec<(u32, f32)>,
    /// Nodes for which one member stands.
    far: Vec<u32>,
    /// Exits of one group, and their sums.
    exits: Vec<Exit>,
    sums: Vec<[f64; 3]>,
}

impl Default for Scratch {
    fn default() -> Self {
        let [columns, clusters] = [0; 2].map(|_| Columns::new(Layout::POINTS));
        Self { columns, clusters, picked: Vec::new(), far: Vec::new(), exits: Vec::new(), sums: Vec::new() }
    }
}

/// A tree over the samples, and what stands for its nodes where no random member does.
pub struct Cut {
    tree: Tree,
    /// Where given, the mean of its members stands for a far node in place of a random one [JB02]: biased.
    clusters: Option<Columns>,
}

/// Exits that share one cut: a ball around them.
struct Ball {
    centre: Vec3,
    radius: f32,
}

impl Cut {
    /// Over `samples`; `clusters` stand for far nodes if so.
    pub fn new(samples: &Columns, clusters: bool) -> Self {
        let tree = Tree::new(samples);
        let clusters = clusters.then(|| tree.clusters());
        Self { tree, clusters }
    }

    /// Nodes of the tree.
    pub fn nodes(&self) -> usize {
        self.tree.nodes.len()
    }

    /// Bytes of the tree.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// Σ S_d · weight per channel over all samples of the tree, to each of `exits`, unbiased: leaves near an exit are
    /// summed, one member drawn with probability proportional to its weight stands for every other node of the cut.
    /// Neighbouring exits share a cut and its draws, which makes the walk through the tree cheap and the noise of
    /// the draws alike in a group. `keys`, one for each exit, seed the draws.
    ///
    /// A node's standard deviation is taken as |dS_d/dr| × spread × weight at its near side, and what its members'
    /// colours add. The sum itself is guessed from centres. Both decide only which nodes are opened and do not depend
    /// on the draws, so that the mean is exact.
    pub fn sums(
        &self,
        (model, envelope): (&dyn Bssrdf, &Envelope),
        tuning: Tuning,
        (exits, keys): (&[Exit], &[u64]),
        (scratch, tally): (&mut Scratch, &mut GatherTally),
        out: &mut [[f64; 3]],
    ) {
        let mut order: Vec<u32> = (0..exits.len() as u32).collect();
        Sums { cut: self, model, envelope, tuning, exits, keys, scratch, tally, out }.split(&mut order);
    }
}

/// Sums under way.
struct Sums<'a> {
    cut: &'a Cut,
    model: &'a dyn Bssrdf,
    envelope: &'a Envelope,
    tuning: Tuning,
    exits: &'a [Exit],
    keys: &'a [u64],
    scratch: &'a mut Scratch,
    tally: &'a mut GatherTally,
    out: &'a mut [[f64; 3]],
}

impl Sums<'_> {
    /// Halves `order` at medians until the exits are few and near enough to share a cut, then sums.
    fn split(&mut self, order: &mut [u32]) {
        let Some(&first) = order.first() else { return };
        let exits = self.exits;
        let at = |i: &u32| exits[*i as usize].x;
        let bounds = Aabb32::around(order.iter().map(at));
        // Sums coarser than a scene can ask for have few exits, far between.
        let group = if self.tuning.error > 1.0 { GROUP_IF_COARSE } else { GROUP };
        if order.len() <= group {
            let centre = bounds.centre();
            let radius = order.iter().map(|i| at(i).distance(centre)).fold(0.0, f32::max);
            self.collect(order, &Ball { centre, radius });
            if order.len() == 1 || self.scratch.picked.len() + self.scratch.far.len() <= LONG {
                self.sum(self.keys[first as usize], order);
                return;
            }
        }
        let axis = bounds.longest_axis();
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |a, b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(b)));
        let (left, right) = order.split_at_mut(middle);
        self.split(left);
        self.split(right);
    }

    /// The cut of a group: samples near it and nodes far from it.
    fn collect(&mut self, order: &[u32], ball: &Ball) {
        // The darkest of some exits decides how fine the cut is.
        let guesses = if self.tuning.error > 1.0 { 1 } else { GUESSES };
        let step = order.len().div_ceil(guesses);
        let mut least = Vec4::splat(f32::INFINITY);
        for &i in order.iter().step_by(step) {
            least = least.min(self.guess(self.exits[i as usize].x));
        }
        let Tuning { error, floor, .. } = self.tuning;
        // A channel that is dark beside the others, or where the whole surface is brighter, need not be finer than they are.
        least = least.max(Vec4::splat(DARK_CHANNEL * least.max_element())).max(floor);
        // Channels without light must not open anything.
        let limit = Vec4::from_array(least.to_array().map(|g| if g > 0.0 { 1.0 / (error * g) } else { 0.0 }));
        let Scratch { picked, far, .. } = &mut *self.scratch;
        picked.clear();
        far.clear();
        let mut at = 0;
        while let Some(node) = self.cut.tree.nodes.get(at) {
            self.tally.nodes += 1;
            let open = opens(self.envelope, node, ball, limit);
            if open && node.is_leaf() {
                picked.extend((node.first..node.first + node.count).map(|i| (i, 1.0)));
                at += 1;
            } else if open {
                at += 1;
            } else {
                far.push(at as u32);
                at = node.skip as usize;
            }
        }
    }

    /// Draws a member of each far node, and sums for each exit of the group.
    fn sum(&mut self, key: u64, order: &[u32]) {
        let Cut { tree, clusters } = self.cut;
        let Scratch { columns, clusters: means, picked, far, exits, sums } = &mut *self.scratch;
        let evaluated = (picked.len() + far.len()) as u64 * order.len() as u64;
        self.tally.pairs += evaluated;
        self.tally.evaluated += evaluated;
        exits.clear();
        exits.extend(order.iter().map(|&i| self.exits[i as usize]));
        sums.clear();
        sums.resize(order.len(), [0.0; 3]);
        if clusters.is_none() {
            // One after the other, so that their visits to memory overlap.
            for &at in &*far {
                picked.extend(tree.draw(&tree.nodes[at as usize], uniform(key, at as usize)));
            }
        }
        columns.pick(&tree.columns, picked);
        let partition = self.tuning.partition;
        self.tally.clamped += columns.sum(self.model, exits, partition, sums);
        for (&i, sum) in order.iter().zip(&*sums) {
            self.out[i as usize] = *sum;
        }
        if let Some(clusters) = clusters {
            let far: Vec<(u32, f32)> = far.iter().map(|&at| (at, 1.0)).collect();
            means.pick(clusters, &far);
            self.tally.clamped += means.sum(self.model, exits, partition, sums);
            for (&i, sum) in order.iter().zip(&*sums) {
                self.out[i as usize].iter_mut().zip(sum).for_each(|(all, far)| *all += far);
            }
        }
    }

    /// The sum from centres of nodes, good to some ten percent.
    fn guess(&mut self, x: Vec3) -> Vec4 {
        let mut sum = Vec4::ZERO;
        let mut at = 0;
        while let Some(node) = self.cut.tree.nodes.get(at) {
            self.tally.nodes += 1;
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

/// True if one member may not stand for the node.
#[inline]
fn opens(envelope: &Envelope, node: &Node, ball: &Ball, limit: Vec4) -> bool {
    let near = node.centre.distance(ball.centre) - ball.radius - node.reach;
    if near <= 0.0 {
        return true;
    }
    let fall = envelope.at(near * near);
    let relative = fall.slope * node.spread + fall.value * envelope.other;
    let deviation = relative * node.weight + fall.value * node.uneven;
    (deviation * limit).cmpgt(Vec4::ONE).any()
}

/// Uniform in [0, 1), a pure function of the exit's key and the node.
#[inline]
fn uniform(key: u64, node: usize) -> f64 {
    let bits = hash(key.wrapping_add((node as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}
