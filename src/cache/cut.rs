//! The sum over a tree of samples, in which one random member stands for each far node.

use super::{Columns, Envelope, Node, Tree};
use crate::bssrdf::{Exit, Model};
use crate::math::{Vec4, hash};

/// A node whose members spread over less than this share of its distance counts as a point when the sum is guessed.
const GUESS: f32 = 0.3;

/// Working space of [`cut`], for one model.
pub struct Buffer {
    columns: Columns,
    /// Samples to evaluate, and factors on their weights.
    picked: Vec<(u32, f32)>,
    /// Nodes for which one member stands.
    far: Vec<u32>,
}

impl Buffer {
    /// Empty.
    pub fn new(model: &Model) -> Self {
        Self { columns: Columns::new(model), picked: Vec::new(), far: Vec::new() }
    }
}

/// What the sum over a tree cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct CutWork {
    /// Nodes visited.
    pub nodes: u64,
    /// Samples at which S_d was evaluated.
    pub evaluated: u64,
}

/// Σ S_d · weight per channel over all samples of `tree`, unbiased: leaves near the exit are summed, one member drawn
/// with probability proportional to its weight stands for every other node of the cut. `error` is the largest share of
/// the whole sum that the standard deviation of one node may have. `key` seeds the draws; `buffer` is working space.
///
/// A node's standard deviation is taken as |dS_d/dr| × spread × weight at its near side, and what its members' colours add. The sum itself is guessed from
/// centres. Both decide only which nodes are opened and do not depend on the draws, so that the mean is exact.
pub fn cut(
    tree: &Tree,
    model: &Model,
    envelope: &Envelope,
    exit: &Exit,
    error: f32,
    key: u64,
    buffer: &mut Buffer,
) -> ([f64; 3], CutWork) {
    let mut work = CutWork::default();
    let guess = guess(tree, envelope, exit, &mut work);
    // Channels without light must not open anything.
    let limit = Vec4::from_array(guess.to_array().map(|g| if g > 0.0 { 1.0 / (error * g) } else { 0.0 }));
    buffer.picked.clear();
    buffer.far.clear();
    let mut at = 0;
    while let Some(node) = tree.nodes.get(at) {
        work.nodes += 1;
        let open = opens(node, envelope, exit, limit);
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
    // One after the other, so that their visits to memory overlap.
    for &at in &buffer.far {
        buffer.picked.extend(tree.draw(&tree.nodes[at as usize], uniform(key, at as usize)));
    }
    work.evaluated = buffer.picked.len() as u64;
    buffer.columns.pick(&tree.columns, &buffer.picked);
    (buffer.columns.sum(model, exit), work)
}

/// True if one member may not stand for the node.
#[inline]
fn opens(node: &Node, envelope: &Envelope, exit: &Exit, limit: Vec4) -> bool {
    let d2 = node.centre.distance_squared(exit.x);
    let near = d2.sqrt() - node.reach;
    if near <= 0.0 {
        return true;
    }
    let fall = envelope.at(near * near);
    let relative = fall.slope * node.spread + fall.value * envelope.other;
    let deviation = relative * node.weight + fall.value * node.uneven;
    (deviation * limit).cmpgt(Vec4::ONE).any()
}

/// The sum from centres of nodes, good to some ten percent.
fn guess(tree: &Tree, envelope: &Envelope, exit: &Exit, work: &mut CutWork) -> Vec4 {
    let mut sum = Vec4::ZERO;
    let mut at = 0;
    while let Some(node) = tree.nodes.get(at) {
        work.nodes += 1;
        let d2 = node.centre.distance_squared(exit.x);
        let s2 = node.spread * node.spread;
        if s2 > GUESS * GUESS * d2 && !node.is_leaf() {
            at += 1;
            continue;
        }
        let fall = envelope.at(d2 + s2);
        sum += fall.value * node.weight;
        at = node.skip as usize;
    }
    sum
}

/// Uniform in [0, 1), a pure function of the exit's key and the node.
#[inline]
fn uniform(key: u64, node: usize) -> f64 {
    let bits = hash(key.wrapping_add((node as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}
