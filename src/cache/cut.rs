//! The sum over a tree of samples, in which one random member stands for each far node.

use super::{Columns, Envelope, Node, Tree};
use crate::bssrdf::{Exit, Model};
use crate::math::hash;

/// A node whose members spread over less than this share of its distance counts as a point when the sum is guessed.
const GUESS: f32 = 0.35;

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
/// A node's standard deviation is taken as |dS_d/dr| × spread × weight, at its near side. The sum itself is guessed from
/// centres. Both decide only which nodes are opened and do not depend on the draws, so that the mean is exact.
pub fn cut(
    tree: &Tree,
    model: &Model,
    envelope: &Envelope,
    exit: &Exit,
    error: f32,
    key: u64,
    buffer: &mut Columns,
) -> ([f64; 3], CutWork) {
    let mut work = CutWork::default();
    let guess = guess(tree, envelope, exit, &mut work);
    // Channels without light must not open anything.
    let limit = guess.map(|g| if g > 0.0 { 1.0 / (error * g) } else { 0.0 });
    buffer.clear();
    let mut at = 0;
    while let Some(node) = tree.nodes.get(at) {
        work.nodes += 1;
        let open = opens(node, envelope, exit, &limit);
        if open && node.is_leaf() {
            buffer.extend(&tree.columns, node.first as usize..(node.first + node.count) as usize);
            at += 1;
        } else if open {
            at += 1;
        } else {
            if let Some((member, factor)) = tree.draw(node, uniform(key, at)) {
                buffer.push(&tree.columns, member, factor);
            }
            at = node.skip as usize;
        }
    }
    work.evaluated = buffer.len() as u64;
    (buffer.sum(model, exit), work)
}

/// True if one member may not stand for the node.
#[inline]
fn opens(node: &Node, envelope: &Envelope, exit: &Exit, limit: &[f32; 4]) -> bool {
    let d2 = node.centre.distance_squared(exit.x);
    let near = d2.sqrt() - node.reach;
    if near <= 0.0 {
        return true;
    }
    let fall = envelope.at(near * near);
    let mut worst = 0.0_f32;
    for c in 0..4 {
        let deviation = (fall.slope[c] * node.spread + fall.value[c] * envelope.other) * node.weight[c];
        worst = worst.max(deviation * limit[c]);
    }
    worst > 1.0
}

/// The sum from centres of nodes, good to some ten percent.
fn guess(tree: &Tree, envelope: &Envelope, exit: &Exit, work: &mut CutWork) -> [f32; 4] {
    let mut sum = [0.0_f32; 4];
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
        for c in 0..4 {
            sum[c] += fall.value[c] * node.weight[c];
        }
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
