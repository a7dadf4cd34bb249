//! The estimators by name: what each prepares once a pass, and the sum at an exit.

use super::{Buffer, Cache, Columns, Cut, Envelope, GatherTally, Thinning, Tree, notes, thinned};
use crate::bssrdf::{Bssrdf, Exit, Model, ModelVisitor, Partition};
use crate::math::{Rgb, Vec4};
use crate::scene::Estimator;

/// Below this many samples `cut` is the plain vectorised sum, which is then faster than any tree.
pub const PLAIN_SUM: usize = 1024;

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

/// A cache made ready for one estimator.
pub struct Gatherer {
    attempted: u32,
    prepared: Prepared,
    tuning: Tuning,
}

enum Prepared {
    Notes(Cache),
    Thinned(Box<Thinning>),
    All(Box<Columns>),
    Cut(Box<Cutting>),
}

/// A tree, and what stands for its nodes where no random member does.
struct Cutting {
    tree: Tree,
    clusters: Option<Columns>,
}

/// Working space of one task, for one model after the other.
#[derive(Default)]
pub struct Scratch {
    buffers: Vec<(std::mem::Discriminant<Model>, Buffer)>,
}

impl Scratch {
    fn buffer(&mut self, model: &Model) -> &mut Buffer {
        let kind = std::mem::discriminant(model);
        let found = self.buffers.iter().position(|(k, _)| *k == kind);
        let at = found.unwrap_or_else(|| {
            self.buffers.push((kind, Buffer::new(model)));
            self.buffers.len() - 1
        });
        &mut self.buffers[at].1
    }
}

impl Gatherer {
    /// Builds what `estimator` needs.
    pub fn new(estimator: Estimator, cache: Cache, model: &Model, tuning: Tuning) -> Self {
        let attempted = cache.attempted.max(1);
        let plain = cache.lit.len() <= PLAIN_SUM;
        let prepared = match estimator {
            Estimator::Notes => Prepared::Notes(cache),
            Estimator::Thinned => Prepared::Thinned(Box::new(Thinning::new(model, cache))),
            Estimator::Cut | Estimator::Cluster if !plain => {
                let tree = Tree::new(&Columns::of(model, &cache.lit));
                let clusters = (estimator == Estimator::Cluster).then(|| tree.clusters(model));
                Prepared::Cut(Box::new(Cutting { tree, clusters }))
            }
            Estimator::All | Estimator::Cut | Estimator::Cluster => {
                Prepared::All(Box::new(Columns::of(model, &cache.lit)))
            }
        };
        Self { attempted, prepared, tuning }
    }

    /// (1/M) Σ S_d L_t to each of `exits`, into `out`. `keys`, one for each exit, seed what is random; the same arguments
    /// give the same bits.
    pub fn gather(
        &self,
        (model, envelope): (&Model, &Envelope),
        exits: &[Exit],
        keys: &[u64],
        scratch: &mut Scratch,
        tally: &mut GatherTally,
        out: &mut Vec<Rgb>,
    ) {
        out.clear();
        tally.exits += exits.len() as u64;
        let Tuning { error, floor, partition } = self.tuning;
        let attempted = f64::from(self.attempted);
        let mean = |sum: [f64; 3]| Rgb::from_fn(|c| (sum[c] / attempted) as f32);
        let each = exits.iter().zip(keys);
        match &self.prepared {
            Prepared::Notes(cache) => {
                out.extend(each.map(|(exit, &key)| model.visit(Notes { cache, exit, key, tally })));
            }
            Prepared::Thinned(thinning) => {
                out.extend(each.map(|(exit, &key)| model.visit(Thinned { thinning, exit, key, tally })));
            }
            Prepared::All(columns) => {
                let count = columns.len() as u64 * exits.len() as u64;
                tally.pairs += count;
                tally.evaluated += count;
                let mut sum = |exit| columns.sum(model, exit, partition, &mut tally.clamped);
                out.extend(exits.iter().map(|exit| mean(sum(exit))));
            }
            Prepared::Cut(cutting) => {
                let Cutting { tree, clusters } = &**cutting;
                let mut sums = vec![[0.0; 3]; exits.len()];
                let floor = floor * attempted as f32;
                let cut = Cut { tree, clusters: clusters.as_ref(), model, envelope, error, floor, partition };
                let work = cut.sums(exits, keys, scratch.buffer(model), &mut sums);
                tally.nodes += work.nodes;
                tally.pairs += work.evaluated;
                tally.evaluated += work.evaluated;
                tally.clamped += work.clamped;
                out.extend(sums.into_iter().map(mean));
            }
        }
    }
}

struct Notes<'a> {
    cache: &'a Cache,
    exit: &'a Exit,
    key: u64,
    tally: &'a mut GatherTally,
}

impl ModelVisitor for Notes<'_> {
    type Out = Rgb;
    fn visit<B: Bssrdf>(self, model: &B) -> Rgb {
        notes(self.cache, model, self.exit, self.key, self.tally)
    }
}

struct Thinned<'a> {
    thinning: &'a Thinning,
    exit: &'a Exit,
    key: u64,
    tally: &'a mut GatherTally,
}

impl ModelVisitor for Thinned<'_> {
    type Out = Rgb;
    fn visit<B: Bssrdf>(self, model: &B) -> Rgb {
        thinned(self.thinning, model, self.exit, self.key, self.tally)
    }
}
