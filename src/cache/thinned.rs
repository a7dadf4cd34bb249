//! The lecture's estimator without looking at every sample.

use super::{Cache, CachedSample, Columns, Tree};
use crate::bssrdf::{Bssrdf, Exit};
use crate::math::{Rgb, hash};
use crate::tally::GatherTally;

/// Nodes are opened where that spares more trials than this.
const SPARED: f32 = 8.0;

/// Samples in the order of a tree over their entry points.
pub struct Thinning {
    samples: Vec<CachedSample>,
    attempted: u32,
    tree: Tree,
}

impl Thinning {
    /// Builds the tree.
    pub fn new(cache: Cache) -> Self {
        let (tree, order) = Tree::ordered(&Columns::points(&cache.lit));
        let samples = order.iter().map(|&i| cache.lit[i as usize]).collect();
        Self { samples, attempted: cache.attempted, tree }
    }
}

/// (1/M) Σ S_d L_t, each sample kept with probability exp(-σ_tr d) independently of the others and weighted by its inverse:
/// exactly the law of `notes.rs`. All members of a node are kept with at most the probability of its nearest point;
/// the next one that passes this bound is found by one geometric jump, and then kept with what is left of its own.
pub fn thinned(thinning: &Thinning, model: &dyn Bssrdf, exit: &Exit, key: u64, tally: &mut GatherTally) -> Rgb {
    let decay = model.decay();
    let clamps = model.clamps();
    let (mut sum, mut numbers) = ([0.0_f64; 3], Numbers { key, next: 0 });
    let mut at = 0;
    while let Some(node) = thinning.tree.nodes.get(at) {
        tally.nodes += 1;
        let distance = node.centre.distance(exit.x);
        let bound = (-decay * (distance - node.reach).max(0.0)).exp();
        let least = (-decay * (distance + node.reach)).exp();
        if !node.is_leaf() && (bound - least) * node.count as f32 > SPARED {
            at += 1;
            continue;
        }
        at = node.skip as usize;
        let end = (node.first + node.count) as usize;
        let mut i = node.first as usize + numbers.jump(bound);
        while i < end {
            tally.pairs += 1;
            let sample = &thinning.samples[i];
            let chance = (-decay * sample.entry.x.distance(exit.x)).exp();
            if numbers.uniform() * f64::from(bound) < f64::from(chance) {
                tally.evaluated += 1;
                let s = model.eval_cached(&sample.entry, sample.depth, exit, decay);
                for c in 0..3 {
                    tally.clamped += u64::from(clamps && s[c] == 0.0 && sample.flux[c] > 0.0);
                    sum[c] += f64::from(s[c] * sample.flux[c]);
                }
            }
            i = (i + 1).saturating_add(numbers.jump(bound));
        }
    }
    Rgb::from_fn(|c| (sum[c] / f64::from(thinning.attempted.max(1))) as f32)
}

/// Numbers for one exit.
struct Numbers {
    key: u64,
    next: u64,
}

impl Numbers {
    /// Uniform in [0, 1) with 53 bits.
    fn uniform(&mut self) -> f64 {
        self.next += 1;
        let bits = hash(self.key.wrapping_add(self.next.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// How many trials of probability `bound` fail before one succeeds.
    fn jump(&mut self, bound: f32) -> usize {
        if bound >= 1.0 {
            return 0;
        }
        let failures = (-self.uniform()).ln_1p() / (-f64::from(bound)).ln_1p();
        // Also where the bound is 0.
        if failures < 1e15 { failures as usize } else { usize::MAX / 2 }
    }
}
