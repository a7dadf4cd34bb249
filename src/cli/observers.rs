//! What is told while a render runs: a bar or plain lines, and records.

use indicatif::{ProgressBar, ProgressStyle};
use marmor::film::metrics::{self, Estimate};
use marmor::film::{FEWEST_PASSES as FEWEST_INTERVAL, NoInterval, SelfError, SelfErrors, WorstPixel};
use marmor::film::{Film, Image, Window};
use marmor::integrator::KnownLights;
use marmor::render::{Observer, Progress, Seconds};
use marmor::report::{ErrorFigures, Record, RecordFile, SelfFigures};
use marmor::tally::Tally;
use marmor::words::counted;
use marmor::{Error, Result};
use std::cell::{Cell, RefCell};
use std::io::IsTerminal;
use std::path::Path;
use std::rc::Rc;
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

/// The newest error that the render told of itself, and the lights that it has not found yet: for the bar, the records and
/// the end.
#[derive(Clone, Default)]
pub struct OwnError(Rc<Cell<Option<SelfErrors>>>, Rc<RefCell<Vec<String>>>);

impl OwnError {
    /// The whole estimate.
    pub fn get(&self) -> Option<SelfErrors> {
        self.0.get()
    }

    /// The names of the lights that have come too seldom: the error is then that of a picture without them.
    pub fn not_met(&self) -> Vec<String> {
        self.1.borrow().clone()
    }

    /// The same in words; empty where all were met.
    pub fn not_met_text(&self) -> String {
        let names: Vec<String> = self.1.borrow().iter().map(|name| format!("\"{name}\"")).collect();
        if names.is_empty() { String::new() } else { format!("not met yet: {}", names.join(", ")) }
    }

    /// Its relMSE.
    pub fn relmse(&self) -> Option<Estimate> {
        self.0.get().and_then(|e| e.relmse)
    }

    /// What a render of `passes` says of its error at its end.
    pub fn text(&self, passes: u32) -> String {
        let not_met = self.not_met_text();
        if !not_met.is_empty() {
            return format!(
                "estimated relMSE: {not_met}; too few paths found it for an error to be told: ask for more samples"
            );
        }
        let Some(told) = self.get() else {
            return if passes < 2 {
                format!("no relMSE is estimated: {passes} of the 2 passes that it needs")
            } else {
                format!("no relMSE is estimated: all {passes} passes were there before, and this run made none")
            };
        };
        let Some(relmse) = told.relmse else { return "no relMSE is estimated: the picture is black".into() };
        let out = format!("estimated relMSE {:.2e}", relmse.value);
        match (relmse.interval, told.no_interval) {
            (Some([low, high]), _) => format!("{out} (95 %: {low:.2e} to {high:.2e})"),
            (None, Some(why)) => format!("{out} ({})", no_interval_text(why, told.worst)),
            (None, None) => "estimated relMSE: nothing to measure, all passes are the same picture".into(),
        }
    }
}

/// Why there is no interval, and what is known instead.
fn no_interval_text(why: NoInterval, worst: Option<WorstPixel>) -> String {
    match (why, worst) {
        (NoInterval::FewPasses, _) => format!("no interval before {FEWEST_INTERVAL} passes"),
        (NoInterval::NotFollowed, _) => "no interval: the earlier passes were not followed".into(),
        (NoInterval::NoisyPixels, _) | (_, None) => {
            "no interval yet: many pixels have met light too seldom to tell how bright they are".into()
        }
        (NoInterval::FewPixels, Some(WorstPixel { pixel: [x, y], share, relmse, .. })) => {
            let carry = if share > HANGS { "one pixel carries" } else { "few pixels carry the noise, the worst" };
            format!(
                "no interval: {carry} {:.0} % of it (pixel {x},{y}); with bright specks taken for noise, relMSE {relmse:.1e}",
                100.0 * share
            )
        }
    }
}

/// A pixel with more of the noise than this is named alone.
const HANGS: f64 = 0.5;

/// Measures the error from the halves of the film and stops the render when it is small enough. Goes before the
/// observers that show it.
pub struct Measure {
    /// Each pass has its record, so each is measured.
    pub each_pass: bool,
    /// Stop at this relMSE.
    pub target: Option<f64>,
    told: OwnError,
    lights: KnownLights,
    error: SelfError,
    next: u32,
}

/// Passes before an error is trusted to end a render.
const FEWEST_PASSES: u32 = 8;

impl Measure {
    /// Tells `told` of a picture to which `lights` are added.
    pub fn new(told: OwnError, lights: KnownLights, each_pass: bool, target: Option<f64>) -> Self {
        Self { each_pass, target, told, lights, error: SelfError::new(), next: 2 }
    }
}

impl Observer for Measure {
    fn after_pass(&mut self, progress: &Progress<'_>) -> Result<()> {
        let passes = progress.film.passes();
        if self.each_pass || passes >= self.next {
            self.told.0.set(self.error.measure(progress.film));
            *self.told.1.borrow_mut() = self.lights.not_met(progress.tally, progress.film.counts().samples);
            // Measuring costs some milliseconds; steps of 2 % do for a bar and a target.
            self.next = passes + 1 + passes / 50;
        }
        Ok(())
    }

    fn satisfied(&self) -> bool {
        let Some((target, told)) = self.target.zip(self.told.get()) else { return false };
        if !self.told.1.borrow().is_empty() {
            return false;
        }
        match told.relmse_careful {
            Some(relmse) => self.next > FEWEST_PASSES && relmse <= target,
            // A black picture: nothing else will come.
            None => self.next > 8 * FEWEST_PASSES,
        }
    }
}

/// A bar with elapsed and remaining time and the error on a terminal; a line at each tenth elsewhere.
pub struct ProgressDisplay {
    shown: Shown,
    own: OwnError,
    target: Option<f64>,
    trend: Trend,
}

/// How fast the error falls: one over the passes in the long run, faster while a sequence spreads out.
#[derive(Clone, Copy, Debug, Default)]
struct Trend {
    /// Passes and error at about a quarter to a half of the passes, then at a half to all.
    seen: [Option<(u32, f64)>; 2],
}

impl Trend {
    /// Takes an error and gives the share of the work to `target` that is done, in time.
    fn share(&mut self, passes: u32, error: f64, target: f64) -> f64 {
        if self.seen[1].is_none_or(|last| passes >= 2 * last.0) {
            self.seen = [self.seen[1], Some((passes, error))];
        }
        let slope = match self.seen.iter().flatten().find(|then| then.0 < passes) {
            Some(then) => (then.1 / error).ln() / (f64::from(passes) / f64::from(then.0)).ln(),
            None => 1.0,
        };
        (target / error).min(1.0).powf(1.0 / slope.clamp(1.0, 2.0))
    }
}

enum Shown {
    /// `-q`.
    Silent,
    /// A terminal.
    Bar(ProgressBar),
    /// A pipe or a file: the last tenth that was told.
    Lines(u32),
}

impl ProgressDisplay {
    /// Whatever standard error can show; `target` is the relMSE to reach.
    pub fn new(verbosity: Verbosity, own: OwnError, target: Option<f64>) -> Self {
        let shown = if verbosity == Verbosity::Quiet {
            Shown::Silent
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(1000);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
                bar.set_style(style);
            }
            Shown::Bar(bar)
        } else {
            Shown::Lines(0)
        };
        Self { shown, own, target, trend: Trend::default() }
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
    }

    /// The share of the job that is done and the seconds left, by whichever limit comes first.
    fn done(&mut self, progress: &Progress<'_>) -> (f64, Option<f64>) {
        let passes = progress.film.passes();
        let all = progress.seconds.total();
        let by_passes = progress.job.passes.map(|n| f64::from(passes) / f64::from(n));
        let own = self.own.get().and_then(|own| own.relmse_careful);
        let by_error = self.target.zip(own).map(|(target, own)| self.trend.share(passes, own, target));
        let whole = [by_passes, by_error].into_iter().flatten().map(|share| (share, all * (1.0 / share - 1.0)));
        // `--time` is this run's alone.
        let run = all - progress.earlier;
        let by_time = progress.job.time.map(|t| t.as_secs_f64()).map(|limit| (run / limit, limit - run));
        let limits = whole.chain(by_time).filter(|(share, _)| *share > 0.0);
        let first = limits.min_by(|a, b| a.1.total_cmp(&b.1));
        first.map_or((0.0, None), |(share, left)| (share.min(1.0), Some(left.max(0.0))))
    }
}

impl Observer for ProgressDisplay {
    fn after_pass(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (done, left) = self.done(progress);
        let passes = progress.film.passes();
        let elapsed = progress.seconds.total();
        let not_met = self.own.not_met_text();
        let error = self.own.relmse().filter(|e| e.value > 0.0).map_or(String::new(), |e| {
            if !not_met.is_empty() {
                return format!(", {not_met}");
            }
            let wanted = self.target.map_or(String::new(), |t| format!(" of {t:.1e}"));
            let factor = e.interval.map_or("?".into(), |[low, high]| format!("{:.1}", (high / low).sqrt()));
            format!(", relMSE {:.1e} ×/÷ {factor}{wanted}", e.value)
        });
        // Before anything is known of an error to reach there is no time left to tell.
        let left = left.map_or("? left".into(), |left| format!("about {} left", clock(left)));
        let line = format!("pass {passes}, {} elapsed, {left}{error}", clock(elapsed));
        match &mut self.shown {
            Shown::Silent => {}
            Shown::Bar(bar) => {
                bar.set_position((done * 1000.0) as u64);
                bar.set_message(line);
            }
            Shown::Lines(told) => {
                let tenth = (done * 10.0) as u32;
                if tenth > *told {
                    *told = tenth;
                    eprintln!("{:3} % {line}", tenth * 10);
                }
            }
        }
        Ok(())
    }
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

/// Writes one record a pass. A record that cannot be written costs neither the picture nor the records after it.
pub struct Records {
    /// The file.
    pub file: RecordFile,
    /// Reading the scene and building everything, in all runs [s].
    pub seconds_setup: f64,
    /// What to measure against.
    pub reference: Option<Image>,
    /// What the render tells of itself.
    pub own: OwnError,
    /// The first failure, and the number of lines that are missing.
    pub failed: Option<(Error, u32)>,
}

impl Records {
    /// The record of a film, without errors.
    pub fn record(seconds_setup: f64, seconds: Seconds, tally: &Tally, film: &Film) -> Record {
        let passes = film.passes();
        let record = Record {
            pass: passes,
            samples: passes,
            seconds_setup,
            seconds_cache: seconds.cache,
            seconds_gather: seconds.gather,
            seconds_total: seconds_setup + seconds.total(),
            clock: tally.clock,
            rays: tally.rays,
            gather: tally.gather,
            walk: tally.walk,
            error: None,
            own: None,
            not_met: Vec::new(),
            non_finite: 0,
            clamped: tally.gather.clamped,
            negative: 0,
        };
        record.with_counts(&film.counts())
    }
}

impl Observer for Records {
    fn after_pass(&mut self, progress: &Progress<'_>) -> Result<()> {
        let error = match &self.reference {
            Some(reference) => Some(error_figures(&progress.film.image(), reference)?),
            None => None,
        };
        let not_met = self.own.not_met();
        let own = own_figures(self.own.get(), &not_met);
        let record = Self::record(self.seconds_setup, progress.seconds, progress.tally, progress.film);
        if let Err(error) = self.file.append(&Record { error, own, not_met, ..record }) {
            if self.failed.is_none() {
                eprintln!("warning: {error}; the render goes on");
            }
            self.failed.get_or_insert((error, 0)).1 += 1;
        }
        Ok(())
    }
}

impl Records {
    /// What was not written.
    pub fn failure(self) -> Option<Error> {
        self.failed.map(|(error, lines)| {
            error.within(format_args!(
                "{} missing",
                counted(lines, "line of the records is", "lines of the records are")
            ))
        })
    }
}

/// Refuses a reference that a picture of `resolution` and `window` cannot be compared with.
pub fn check_reference(path: &Path, image: &Image, resolution: [u32; 2], window: Window) -> Result<()> {
    if (image.resolution, image.window) == (resolution, window) {
        return Ok(());
    }
    let size = |[w, h]: [u32; 2], window: Window| format!("{w}x{h} with pixels {window}");
    Err(Error::usage(format!(
        "--reference {}: it is {}, the picture will be {} (x0,y0,x1,y1); give one of the same size",
        path.display(),
        size(image.resolution, image.window),
        size(resolution, window)
    )))
}

/// What a record says of a render's own error: without an interval where lights are not met.
pub fn own_figures(told: Option<SelfErrors>, not_met: &[String]) -> Option<SelfFigures> {
    let mut own: Option<SelfFigures> = told.as_ref().map(Into::into);
    if let Some(own) = own.as_mut().filter(|_| !not_met.is_empty()) {
        own.self_interval = None;
    }
    own
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_to_an_error_follows_its_slope() {
        for slope in [1.0_f64, 1.5] {
            let mut trend = Trend::default();
            let share = |trend: &mut Trend, n: u32| trend.share(n, f64::from(n).powf(-slope), 100_f64.powf(-slope));
            // The first error has no slope yet and is taken to fall as one over the passes.
            assert!((share(&mut trend, 2) - 0.02_f64.powf(slope)).abs() < 1e-9);
            for n in 3..100 {
                assert!((share(&mut trend, n) - f64::from(n) / 100.0).abs() < 1e-9, "{slope} {n}");
            }
            assert_eq!(share(&mut trend, 120), 1.0);
        }
    }

    #[test]
    fn the_end_says_what_is_not_known() {
        let text = |passes: u32, sample: &dyn Fn(u32, usize) -> f32| {
            let window = marmor::film::Window::full([16, 16]);
            let (mut film, mut error, told) =
                (Film::new([16, 16], window).unwrap(), SelfError::new(), OwnError::default());
            for pass in 0..passes {
                let samples: Vec<_> = (0..256).map(|i| marmor::math::Rgb::splat(sample(pass, i))).collect();
                film.add(window, &samples);
                film.end_pass();
                told.0.set(error.measure(&film));
            }
            told.text(passes)
        };
        let noise =
            |pass: u32, i: usize| 1.0 + (marmor::math::hash(u64::from(pass) << 20 | i as u64) % 100) as f32 / 100.0;
        assert!(text(1, &noise).contains("1 of the 2 passes"));
        assert!(text(11, &noise).contains("no interval before 12 passes"));
        assert!(text(12, &noise).contains("(95 %: ") && !text(12, &noise).contains("no interval"));
        assert!(text(8, &|_, _| 0.0).contains("black"));
        let speck = |pass: u32, i: usize| if (pass, i) == (3, 35) { 1e4 } else { noise(pass, i) };
        let said = text(12, &speck);
        assert!(
            said.contains("(no interval: one pixel carries 100 % of it (pixel 3,2)") && !said.contains("95 %"),
            "{said}"
        );
        let three = |pass: u32, i: usize| if pass == 3 && [35, 60, 90].contains(&i) { 1e4 } else { noise(pass, i) };
        let said = text(12, &three);
        assert!(said.contains("(no interval: few pixels carry the noise, the worst "), "{said}");
        // Each pixel has a bright sample in 20: at 16 passes half of them have met none.
        let rare = |pass: u32, i: usize| {
            if marmor::math::hash(u64::from(pass) << 20 | i as u64).is_multiple_of(20) { 20.0 } else { 0.1 }
        };
        assert!(text(16, &rare).contains("(no interval yet: many pixels"), "{}", text(16, &rare));
        assert!(text(512, &rare).contains("(95 %: "), "{}", text(512, &rare));
    }

    #[test]
    fn an_error_that_rises_or_falls_by_chance_does_not_run_away() {
        let mut trend = Trend::default();
        trend.share(2, 1e-2, 1e-3);
        assert_eq!(trend.share(3, 2e-2, 1e-3), 0.05);
        assert!((trend.share(4, 1e-6, 1e-7) - 0.1_f64.sqrt()).abs() < 1e-12);
    }
}
