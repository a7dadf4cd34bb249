//! The estimators by name: what each prepares once a pass, and the sum at an exit.

use super::{Buffer, Cache, Columns, Cut, Envelope, GatherTally, Tree, notes};
use crate::bssrdf::{Bssrdf, Exit, Model, ModelVisitor};
use crate::math::Rgb;
use crate::scene::Estimator;

/// Below this many samples `cut` is the plain vectorised sum, which is then faster than any tree.
pub const PLAIN_SUM: usize = 1024;

/// A cache made ready for one estimator.
pub struct Gatherer {
    attempted: u32,
    prepared: Prepared,
    error: f32,
}

enum Prepared {
    Notes(Cache),
    All(Columns),
    Cut(Tree),
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
    /// Builds what `estimator` needs. `error` is the largest share of the sum that one node of a `cut` may be wrong by.
    pub fn new(estimator: Estimator, cache: Cache, model: &Model, error: f32) -> Self {
        let attempted = cache.attempted.max(1);
        let prepared = match estimator {
            Estimator::Notes => Prepared::Notes(cache),
            Estimator::Cut if cache.lit.len() > PLAIN_SUM => Prepared::Cut(Tree::new(&Columns::of(model, &cache.lit))),
            Estimator::All | Estimator::Cut => Prepared::All(Columns::of(model, &cache.lit)),
        };
        Self { attempted, prepared, error }
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
        let mean = |sum: [f64; 3]| Rgb::from_fn(|c| (sum[c] / f64::from(self.attempted)) as f32);
        match &self.prepared {
            Prepared::Notes(cache) => {
                out.extend(exits.iter().zip(keys).map(|(exit, &key)| model.visit(Notes { cache, exit, key, tally })));
            }
            Prepared::All(columns) => {
                let count = columns.len() as u64 * exits.len() as u64;
                tally.pairs += count;
                tally.evaluated += count;
                out.extend(exits.iter().map(|exit| mean(columns.sum(model, exit, &mut tally.clamped))));
            }
            Prepared::Cut(tree) => {
                let mut sums = vec![[0.0; 3]; exits.len()];
                let cut = Cut { tree, model, envelope, error: self.error };
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
