//! One JSON line per pass.

use crate::error::{Error, Result};
use crate::film::{Counts, NoInterval, SelfErrors, check_replaceable, write_atomically};
use crate::input;
use crate::tally::{Clock, GatherTally, RayTally, WalkTally};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The state of a render after a pass; keys are stable, later versions only add some. All counts and times are
/// totals since the start.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// Passes done.
    pub pass: u32,
    /// Samples of each pixel.
    pub samples: u32,
    /// Reading the scene and building trees and tables \[s\].
    pub seconds_setup: f64,
    /// Filling caches \[s\].
    pub seconds_cache: f64,
    /// Tracing, shading and gathering \[s\].
    pub seconds_gather: f64,
    /// Setup, cache and gathering; writing and measuring are not in it \[s\].
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
    /// Lights that have come too seldom for an interval: what the halves tell is the error of a picture without them.
    pub not_met: Vec<String>,
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
    /// 95 % interval of `self_relmse`; `null` where it is not known, and while a light is not met.
    pub self_interval: Option<[f64; 2]>,
    /// Why the error has no interval, but for lights; `null` where it has one.
    pub self_no_interval: Option<NoInterval>,
}

impl From<&SelfErrors> for SelfFigures {
    fn from(errors: &SelfErrors) -> Self {
        Self {
            self_rmse: errors.rmse.value,
            self_relmse: errors.relmse.map(|e| e.value),
            self_interval: errors.relmse.and_then(|e| e.interval),
            self_no_interval: errors.no_interval,
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

/// A file of records. Each line is appended by itself and stands in the file as a whole or not at all: what a full disk
/// cuts short is taken away again.
pub struct RecordFile {
    path: PathBuf,
    file: File,
    /// Length up to the end of the last whole line [bytes].
    whole: u64,
}

/// How every line of a file of records begins.
const BEGIN: &[u8] = b"{\"pass\":";
/// Longer than any line of ours.
const LONGEST: u64 = 1 << 16;

impl RecordFile {
    /// Whether records can be written to `path`: a new file, or one of records. Leaves it as it is.
    ///
    /// # Errors
    /// A file error with the path: a folder that is not there, a pipe, a file of something else.
    pub fn check(path: &Path) -> Result<()> {
        check_replaceable(path)?;
        if !path.exists() {
            return Ok(());
        }
        let mut start = Vec::new();
        let (file, _) = input::open(path)?;
        file.take(BEGIN.len() as u64).read_to_end(&mut start).map_err(|e| Error::file(path, "read", e))?;
        if !BEGIN.starts_with(&start) {
            return Err(Error::file(path, "write records", "there is a file of something else; give another name"));
        }
        Ok(())
    }

    /// Starts a new file at `path`, over older records.
    ///
    /// # Errors
    /// A file error with the path.
    pub fn create(path: &Path) -> Result<Self> {
        Self::check(path)?;
        let file = File::create(path).map_err(|e| Error::file(path, "write records", e))?;
        Ok(Self { path: path.to_owned(), file, whole: 0 })
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
        Self::check(path)?;
        let mut old = BufReader::new(input::open(path)?.0);
        let mut line = Vec::new();
        write_atomically(path, |out| {
            loop {
                line.clear();
                if old.by_ref().take(LONGEST).read_until(b'\n', &mut line)? == 0 {
                    return Ok(());
                }
                let record: Option<serde_json::Value> = serde_json::from_slice(&line).ok();
                let pass = record.and_then(|r| r.get("pass")?.as_u64());
                if line.ends_with(b"\n") && pass.is_some_and(|pass| pass <= next.into()) {
                    out.write_all(&line)?;
                }
            }
        })?;
        let failed = |e| Error::file(path, "write records", e);
        let mut file = File::options().write(true).open(path).map_err(failed)?;
        let whole = file.seek(SeekFrom::End(0)).map_err(failed)?;
        Ok(Self { path: path.to_owned(), file, whole })
    }

    /// Appends a line.
    ///
    /// # Errors
    /// A file error with the path; the line is not in the file then, and the next one may be.
    pub fn append(&mut self, record: &Record) -> Result<()> {
        let failed = |e: io::Error| Error::file(&self.path, "write records", e);
        let mut line = serde_json::to_vec(record).map_err(|e| failed(e.into()))?;
        line.push(b'\n');
        if let Err(error) = self.file.write_all(&line) {
            // Nothing can be done about a file that cannot even be cut back.
            let _ = self.file.set_len(self.whole).and_then(|()| self.file.seek(SeekFrom::Start(self.whole)));
            return Err(failed(error));
        }
        self.whole += line.len() as u64;
        Ok(())
    }
}
