//! The estimators by name: what each prepares once a pass, and the sum at an exit.

use super::{Cache, Columns, Cut, Envelope, Scratch, Thinning, Tuning, notes, thinned};
use crate::bssrdf::{Bssrdf, Exit};
use crate::math::Rgb;
use crate::scene::Estimator;
use crate::tally::GatherTally;

/// Below this many samples `cut` is the plain vectorised sum, which is then faster than any tree.
pub const PLAIN_SUM: usize = 1024;

/// How fine a cut is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// As the noise of the cache asks for: what a picture shows.
    Fine,
    /// What is scaled by something that is noisier by far.
    Middle,
    /// What is one of many that are added up.
    Coarse,
}

/// The largest share of a middling sum that one node may be wrong by, at least. Under walks it adds 1e-5 of relMSE to 16 passes of the lotus, which
/// have 1e-2.
const MIDDLE: f32 = 0.5;
/// Of a coarse one.
const COARSE: f32 = 2.0;

/// A cache made ready for one estimator.
pub struct Gatherer {
    attempted: u32,
    estimate: Estimate,
    tuning: Tuning,
}

enum Estimate {
    Notes(Cache),
    Thinned(Box<Thinning>),
    All(Box<Columns>),
    Cut(Box<Cut>),
}

impl Gatherer {
    /// Builds what `estimator` needs.
    pub fn new(estimator: Estimator, cache: Cache, model: &dyn Bssrdf, tuning: Tuning) -> Self {
        let attempted = cache.attempted.max(1);
        let plain = cache.lit.len() <= PLAIN_SUM;
        let estimate = match estimator {
            Estimator::Notes => Estimate::Notes(cache),
            Estimator::Thinned => Estimate::Thinned(Box::new(Thinning::new(cache))),
            Estimator::Cut | Estimator::Cluster if !plain => {
                let samples = Columns::of(model, &cache.lit);
                Estimate::Cut(Box::new(Cut::new(&samples, estimator == Estimator::Cluster)))
            }
            Estimator::All | Estimator::Cut | Estimator::Cluster => {
                Estimate::All(Box::new(Columns::of(model, &cache.lit)))
            }
        };
        Self { attempted, estimate, tuning }
    }

    /// (1/M) Σ S_d L_t to each of `exits`, into `out`. `keys`, one for each exit, seed what is random; the same arguments
    /// give the same bits.
    pub fn gather(
        &self,
        (model, envelope): (&dyn Bssrdf, &Envelope),
        (exits, detail): (&[Exit], Detail),
        keys: &[u64],
        scratch: &mut Scratch,
        tally: &mut GatherTally,
        out: &mut Vec<Rgb>,
    ) {
        out.clear();
        tally.exits += exits.len() as u64;
        let mut sums = vec![[0.0; 3]; exits.len()];
        let mut tuning = self.tuning;
        tuning.error = match detail {
            Detail::Fine => tuning.error,
            Detail::Middle => tuning.error.max(MIDDLE),
            Detail::Coarse => tuning.error.max(COARSE),
        };
        let each = exits.iter().zip(keys);
        match &self.estimate {
            Estimate::Notes(cache) => out.extend(each.map(|(exit, &key)| notes(cache, model, exit, key, tally))),
            Estimate::Thinned(samples) => {
                out.extend(each.map(|(exit, &key)| thinned(samples, model, exit, key, tally)));
            }
            Estimate::All(columns) => {
                let count = columns.len() as u64 * exits.len() as u64;
                tally.pairs += count;
                tally.evaluated += count;
                tally.clamped += columns.sum(model, exits, tuning.partition, &mut sums);
            }
            Estimate::Cut(cut) => {
                tuning.floor *= self.attempted as f32;
                cut.sums((model, envelope), tuning, (exits, keys), (scratch, tally), &mut sums);
            }
        }
        if out.is_empty() {
            let attempted = f64::from(self.attempted);
            out.extend(sums.iter().map(|sum| Rgb::from_fn(|c| (sum[c] / attempted) as f32)));
        }
    }
}
