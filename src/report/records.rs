//! One JSON line per pass.

use crate::cache::{Clock, GatherTally};
use crate::error::{Error, Result};
use crate::film::{Counts, SelfErrors};
use crate::integrator::WalkTally;
use crate::query::RayTally;
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The state of a render after a pass; keys are stable, later versions only add some. All counts and times are
/// totals since the start.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// Passes done.
    pub pass: u32,
    /// Samples of each pixel.
    pub samples: u32,
    /// Reading the scene and building trees and tables [s].
    pub seconds_setup: f64,
    /// Filling caches [s].
    pub seconds_cache: f64,
    /// Tracing, shading and gathering [s].
    pub seconds_gather: f64,
    /// Setup, cache and gathering; writing and measuring are not in it [s].
    pub seconds_total: f64,
    /// The same in parts.
    pub clock: Clock,
    /// Rays by kind.
    pub rays: RayTally,
    /// Cached samples and pairs of points.
    pub gather: GatherTally,
    /// Paths inside media.
    pub walk: WalkTally,
    /// Distance to the reference; absent without one.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorFigures>,
    /// Distance to what the picture converges to, told by its halves; absent before two passes.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub own: Option<SelfFigures>,
    /// Samples left out because they are not numbers.
    pub non_finite: u64,
    /// Values of S_d below zero that were taken as 0; samples are never clamped.
    pub clamped: u64,
    /// Samples below zero, kept.
    pub negative: u64,
}

/// Figures against a reference picture (docs/output.md has the formulas).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ErrorFigures {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean squared difference relative to the reference; `null` if the reference is black.
    pub relmse: Option<f64>,
    /// 95 % interval of `relmse`; `null` where the picture is too small to tell.
    pub interval: Option<[f64; 2]>,
}

/// The same figures without a reference.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SelfFigures {
    /// Root of the mean squared distance to the limit.
    pub self_rmse: f64,
    /// relMSE; `null` if the picture is black.
    pub self_relmse: Option<f64>,
    /// 95 % interval of `self_relmse`; `null` before four passes.
    pub self_interval: Option<[f64; 2]>,
}

impl From<&SelfErrors> for SelfFigures {
    fn from(errors: &SelfErrors) -> Self {
        Self {
            self_rmse: errors.rmse.value,
            self_relmse: errors.relmse.map(|e| e.value),
            self_interval: errors.relmse.and_then(|e| e.interval),
        }
    }
}

impl Record {
    /// Takes over the film's counts.
    #[must_use]
    pub fn with_counts(mut self, counts: &Counts) -> Self {
        self.non_finite = counts.non_finite;
        self.negative = counts.negative;
        self
    }
}

/// A file of records, flushed after each line so that an interrupted render keeps them all.
pub struct RecordFile {
    path: PathBuf,
    out: BufWriter<File>,
}

impl RecordFile {
    /// Starts a new file at `path`, over whatever is there.
    ///
    /// # Errors
    /// A file error with the path.
    pub fn create(path: &Path) -> Result<Self> {
        let file = File::create(path).map_err(|e| Error::file(path, "write records", e))?;
        Ok(Self { path: path.to_owned(), out: BufWriter::new(file) })
    }

    /// Goes on with the file at `path` for a render whose next pass is number `next`: lines of later passes, which are
    /// lost and come again, are removed, and so is a last line that is cut short. Starts a new file where `next` is 0 or
    /// there is none.
    ///
    /// # Errors
    /// A file error with the path.
    pub fn go_on(path: &Path, next: u32) -> Result<Self> {
        if next == 0 || !path.exists() {
            return Self::create(path);
        }
        let old = std::fs::read(path).map_err(|e| Error::file(path, "read records", e))?;
        let kept = old.split_inclusive(|&b| b == b'\n').filter(|line| {
            let record: Option<serde_json::Value> = serde_json::from_slice(line).ok();
            let pass = record.and_then(|r| r.get("pass")?.as_u64());
            pass.is_some_and(|pass| pass <= next.into()) && line.ends_with(b"\n")
        });
        let kept: Vec<u8> = kept.flatten().copied().collect();
        crate::film::write_atomically(path, |out| out.write_all(&kept))?;
        let file = File::options().append(true).open(path).map_err(|e| Error::file(path, "write records", e))?;
        Ok(Self { path: path.to_owned(), out: BufWriter::new(file) })
    }

    /// Appends a line.
    ///
    /// # Errors
    /// A file error with the path.
    pub fn append(&mut self, record: &Record) -> Result<()> {
        let line = serde_json::to_string(record).map_err(|e| Error::file(&self.path, "write records", e))?;
        writeln!(self.out, "{line}")
            .and_then(|()| self.out.flush())
            .map_err(|e| Error::file(&self.path, "write records", e))
    }
}
