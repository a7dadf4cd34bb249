//! What is told while a render runs: a bar or plain lines, and records.

use indicatif::{ProgressBar, ProgressStyle};
use marmor::Result;
use marmor::film::Image;
use marmor::film::metrics;
use marmor::render::{Observer, Progress};
use marmor::report::{ErrorFigures, Record, RecordFile};
use std::io::IsTerminal;
use std::time::Duration;

/// How much is said on standard error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// Scene, progress, result.
    Normal,
    /// Also what was built and what was left out.
    Verbose,
}

/// A bar with elapsed and remaining time on a terminal; a line at each tenth elsewhere.
pub enum ProgressDisplay {
    /// `-q`.
    Silent,
    /// A terminal.
    Bar(ProgressBar),
    /// A pipe or a file: the last tenth that was told.
    Lines(u32),
}

impl ProgressDisplay {
    /// Whatever standard error can show.
    pub fn new(verbosity: Verbosity) -> Self {
        if verbosity == Verbosity::Quiet {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines(0);
        }
        let bar = ProgressBar::new(1000);
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
            bar.set_style(style);
        }
        Self::Bar(bar)
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Observer for ProgressDisplay {
    fn after_pass(&mut self, progress: &Progress<'_>) -> Result<()> {
        let done = fraction_done(progress);
        let passes = progress.film.passes();
        let elapsed = progress.seconds.total();
        let left = elapsed * (1.0 / done.max(1e-9) - 1.0);
        match self {
            Self::Silent => {}
            Self::Bar(bar) => {
                bar.set_position((done * 1000.0) as u64);
                bar.set_message(format!("pass {passes}, {} elapsed, {} left", clock(elapsed), clock(left)));
            }
            Self::Lines(told) => {
                let tenth = (done * 10.0) as u32;
                if tenth > *told {
                    *told = tenth;
                    eprintln!("{:3} % pass {passes}, {} elapsed, {} left", tenth * 10, clock(elapsed), clock(left));
                }
            }
        }
        Ok(())
    }
}

/// The share of the job that is done, by whichever limit comes first.
fn fraction_done(progress: &Progress<'_>) -> f64 {
    let film = progress.film;
    let by_passes = progress
        .job
        .passes
        .map_or(0.0, |n| f64::from(film.passes()) / f64::from(n.saturating_sub(film.ranges()[0].start).max(1)));
    let by_time = progress.job.time.map_or(0.0, |t| progress.seconds.total() / t.as_secs_f64());
    by_passes.max(by_time).min(1.0)
}

/// Seconds as a person reads them.
fn clock(seconds: f64) -> String {
    let whole = Duration::from_secs_f64(seconds.clamp(0.0, 1e9)).as_secs();
    match whole {
        0..60 => format!("{seconds:.1} s"),
        60..3600 => format!("{}:{:02} min", whole / 60, whole % 60),
        _ => format!("{}:{:02} h", whole / 3600, whole / 60 % 60),
    }
}

/// Writes one record a pass.
pub struct Records {
    /// The file.
    pub file: RecordFile,
    /// Reading the scene and building everything [s].
    pub seconds_setup: f64,
    /// What to measure against.
    pub reference: Option<Image>,
}

impl Observer for Records {
    fn after_pass(&mut self, progress: &Progress<'_>) -> Result<()> {
        let error = match &self.reference {
            Some(reference) => Some(error_figures(&progress.film.image(), reference)?),
            None => None,
        };
        let passes = progress.film.passes();
        let record = Record {
            pass: passes,
            samples: passes,
            seconds_setup: self.seconds_setup,
            seconds_cache: progress.seconds.cache,
            seconds_gather: progress.seconds.gather,
            seconds_total: self.seconds_setup + progress.seconds.total(),
            rays: progress.tally.rays,
            gather: progress.tally.gather,
            error,
            non_finite: 0,
            clamped: progress.tally.gather.clamped,
            negative: 0,
        };
        self.file.append(&record.with_counts(&progress.film.counts()))
    }
}

/// The figures of a record.
pub fn error_figures(image: &Image, reference: &Image) -> Result<ErrorFigures> {
    let errors = metrics::compare(image, reference, None)?.whole;
    Ok(ErrorFigures {
        rmse: errors.rmse.value,
        relmse: errors.relmse.map(|e| e.value),
        interval: errors.relmse.and_then(|e| e.interval),
    })
}
