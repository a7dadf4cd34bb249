//! Error of one way to render while it runs: points, slopes, when it had an error.

use crate::film::metrics::{Estimate, student_975};
use crate::film::{Judged, Judgement, SelfErrors};

/// One way to render, measured while it ran.
#[derive(Clone, Debug)]
pub struct Curve {
    /// As asked.
    pub name: String,
    /// Building its trees and tables \[s\]; not in the times of the points.
    pub seconds_setup: f64,
    /// In order of time.
    pub points: Vec<Point>,
    /// Lights that its paths have met too seldom to the end: there is no verdict on a picture that may lack them.
    pub not_met: Vec<String>,
}

/// A measurement.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Samples of each pixel.
    pub samples: u32,
    /// Time of rendering \[s\].
    pub seconds: f64,
    /// Over all pixels, and without the worst 0.1 %, by which methods are judged.
    pub judgement: Judgement,
    /// What the render tells of itself, as in its records.
    pub told: Option<SelfErrors>,
}

/// Which pixels of a point.
pub(super) type Set = fn(&Point) -> &Judged;

/// All of them.
pub(super) const ALL: Set = |p| &p.judgement.all;

/// Those that are judged by.
pub(super) const TRIMMED: Set = |p| &p.judgement.trimmed;

/// log(error) = intercept + slope log(x), by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Natural logarithm of the error at x = 1.
    pub intercept: f64,
    /// -1 where each further sample is worth as much as the one before.
    pub slope: f64,
    /// Half of the 95 % interval of the slope.
    pub half_width: f64,
}

impl Fit {
    /// Over (x, error, half of the 95 % interval of its logarithm) in ascending order of x. Errors of a growing mean go
    /// together, so the residuals count as one for each doubling of x, and they are not believed to be smaller than the
    /// intervals say. None with fewer than two and a half doublings.
    pub fn of(points: &[(f64, f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64, f64)> = points.iter().map(|&(x, y, w)| (x.ln(), y.ln(), w)).collect();
        let doublings = (logs.last()?.0 - logs.first()?.0) / std::f64::consts::LN_2;
        if doublings < 2.5 || logs.len() < 4 {
            return None;
        }
        // Equal weight to equal ratios of x, however close the measurements are.
        let weight = |i: usize| (logs[(i + 1).min(logs.len() - 1)].0 - logs[i.saturating_sub(1)].0) / 2.0;
        let sum = |f: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
            logs.iter().enumerate().map(|(i, &(x, y, w))| weight(i) * f(x, y, w)).sum()
        };
        let all = sum(&|_, _, _| 1.0);
        let (mx, my) = (sum(&|x, _, _| x) / all, sum(&|_, y, _| y) / all);
        let spread = sum(&|x, _, _| (x - mx).powi(2));
        let slope = sum(&|x, y, _| (x - mx) * (y - my)) / spread;
        let residual = sum(&|x, y, _| (y - my - slope * (x - mx)).powi(2)) / all;
        // The intervals are for the ratio of two errors that are alike uncertain.
        let told = sum(&|_, _, w| (w / 2.0 / std::f64::consts::SQRT_2).powi(2)) / all;
        let freedom = doublings + 1.0 - 2.0;
        let error = (residual.max(told) / freedom / (spread / all)).sqrt();
        let student = student_975(freedom.max(1.0) as usize);
        Some(Self { intercept: my - slope * mx, slope, half_width: student * error })
    }

    /// The error at `x`.
    pub fn at(&self, x: f64) -> f64 {
        (self.intercept + self.slope * x.ln()).exp()
    }
}

/// When a curve had an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reached {
    /// After so many seconds, between two measurements.
    At(f64),
    /// Before the first measurement, which came after so many seconds.
    Before(f64),
    /// Not yet.
    Never,
}

/// Passes before these are left out of fits: sequences begin before they spread.
const SETTLED: u32 = 2;

/// Widths are steadied over points with up to this times the samples, and as many fewer.
const STEADY: f64 = 1.3;

/// A curve is continued by 1 / time as far as this times its length.
const CONTINUED: f64 = 1.5;

impl Curve {
    /// (x, error, half of the interval of its logarithm) of the points that are told from the noise of the reference.
    fn line(&self, x: impl Fn(&Point) -> f64) -> Vec<(f64, f64, f64)> {
        let told = |p: &&Point| p.judgement.trimmed.is_told();
        let one = |p: &Point| (x(p), p.judgement.trimmed.error().value, p.judgement.trimmed.width.unwrap_or(0.0));
        self.points.iter().filter(told).map(one).collect()
    }

    /// Fit of the error against `x` from the second sample on.
    pub(super) fn fit(&self, x: impl Fn(&Point) -> f64) -> Option<Fit> {
        let first = self.points.iter().find(|p| p.samples >= SETTLED).map(&x)?;
        let line = self.line(x);
        Fit::of(&line.into_iter().filter(|p| p.0 >= first).collect::<Vec<_>>())
    }

    /// The width of each point as it is drawn: the median over the points around. A width is itself an estimate, of one
    /// picture, and now and then far off.
    pub(super) fn steady_widths(&self, set: Set) -> Vec<Option<f64>> {
        let at = |p: &Point| {
            let near = |q: &&Point| {
                let ratio = f64::from(q.samples) / f64::from(p.samples);
                (1.0 / STEADY..=STEADY).contains(&ratio)
            };
            let mut widths: Vec<f64> = self.points.iter().filter(near).filter_map(|q| set(q).width).collect();
            widths.sort_by(f64::total_cmp);
            set(p).width.map(|_| widths[widths.len() / 2])
        };
        self.points.iter().map(at).collect()
    }

    /// Seconds and error of each point; its width is its own or that of the points around, whichever is larger.
    pub(super) fn errors(&self, set: Set) -> Vec<(f64, Estimate)> {
        let one = |(p, steady): (&Point, Option<f64>)| {
            let own = set(p);
            let width = own.width.zip(steady).map(|(w, steady)| w.max(steady));
            (p.seconds, Judged { width, ..*own }.error())
        };
        self.points.iter().zip(self.steady_widths(set)).map(one).collect()
    }

    /// The error after `seconds`: on straight lines between the logarithms, beyond the last point by 1 / time. None
    /// before the first, or far beyond the last.
    pub(super) fn error_at(&self, seconds: f64, set: Set) -> Option<Estimate> {
        let errors = self.errors(set);
        let (first, last) = (errors.first()?, errors.last()?);
        if seconds < first.0 || seconds > CONTINUED * last.0 {
            return None;
        }
        let read = |of: &dyn Fn(&Estimate) -> Option<f64>| -> Option<f64> {
            match errors.iter().position(|p| p.0 >= seconds) {
                None => Some(of(&last.1)? * last.0 / seconds),
                Some(0) => of(&first.1),
                Some(i) => {
                    let (a, b) = (&errors[i - 1], &errors[i]);
                    Some(between((a.0, of(&a.1)?), (b.0, of(&b.1)?), seconds))
                }
            }
        };
        let end = |k: usize| read(&|e: &Estimate| e.interval.map(|ends| ends[k]));
        Some(Estimate { value: read(&|e| Some(e.value))?, interval: end(0).zip(end(1)).map(|(low, high)| [low, high]) })
    }

    /// When the curve first was down to `error`, by the lower (0) or upper (1) end of its interval.
    pub(super) fn reached(&self, error: f64, end: usize) -> Reached {
        let ends: Vec<(f64, f64)> =
            self.errors(TRIMMED).iter().filter_map(|(s, e)| Some((*s, e.interval?[end]))).collect();
        match ends.iter().position(|p| p.1 <= error) {
            None => Reached::Never,
            Some(0) => Reached::Before(ends[0].0),
            Some(i) => Reached::At(between((ends[i - 1].1, ends[i - 1].0), (ends[i].1, ends[i].0), error)),
        }
    }
}

/// The value at x of the straight line between the logarithms of two points (x, y), or of x alone where there are zeros.
fn between(a: (f64, f64), b: (f64, f64), x: f64) -> f64 {
    let (xs, ys) = (a.0 > 0.0 && b.0 > 0.0, a.1 > 0.0 && b.1 > 0.0);
    let share = if xs { (x / a.0).ln() / (b.0 / a.0).ln() } else { (x - a.0) / (b.0 - a.0) };
    if ys { (a.1.ln() + share * (b.1 / a.1).ln()).exp() } else { a.1 + share * (b.1 - a.1) }
}

/// Why a judgement leaves no verdict by `part` of it, which is over all pixels or trimmed.
pub(super) fn why_not(judgement: &Judgement, part: &Judged) -> Option<String> {
    let [x, y] = part.worst_pixel;
    if judgement.shares_numbers() {
        let all = &judgement.all;
        return Some(format!(
            "it is nearer to the reference (relMSE {:.1e}) than its noise ({:.1e}) lets an independent picture be; do they share \
             a seed",
            all.measured,
            all.noise.unwrap_or(0.0) + all.reference_noise
        ));
    }
    let share = 100.0 * part.worst_share;
    part.hangs_on_one_pixel().then(|| format!("one pixel carries {share:.0} % of its error (pixel {x},{y})"))
}

/// A relMSE with its interval.
pub(super) fn error_text(error: &Estimate) -> String {
    match error.interval {
        Some([low, high]) if low > 0.0 => format!("relMSE {:.2e} (95 %: {low:.2e} to {high:.2e})", error.value),
        Some([_, high]) if high > 0.0 => format!("relMSE below {high:.1e}, not told from the reference's noise"),
        Some(_) => "no difference at all".into(),
        None => format!("relMSE {:.1e} (interval unknown)", error.value),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::film::Bias;

    /// Noise `own`, bias `bias`, reference noise 1e-6, all known to `width`.
    pub fn judged(own: Option<f64>, bias: f64, width: f64) -> Judged {
        let half_width = own.unwrap_or(0.0) * (f64::exp(width.max(0.3)) - 1.0);
        Judged {
            pixels: 10_000,
            measured: own.unwrap_or(0.1) + bias + 1e-6,
            reference_noise: 1e-6,
            reference_width: 0.3,
            noise: own,
            width: own.map(|_| width),
            bias: own.map(|_| Bias { value: bias, half_width }),
            worst_share: 0.01,
            worst_pixel: [3, 4],
        }
    }

    fn curve(floor: f64, slope: f64) -> Curve {
        let point = |samples: u32| {
            let own = 0.1 * f64::from(samples).powf(slope);
            let judged = judged(Some(own), floor, 0.1);
            Point {
                samples,
                seconds: 0.1 * f64::from(samples),
                judgement: Judgement { all: judged, trimmed: judged },
                told: None,
            }
        };
        Curve { name: "c".into(), seconds_setup: 0.1, points: (1..200).map(point).collect(), not_met: Vec::new() }
    }

    #[test]
    fn slopes_are_those_put_in() {
        let samples = |p: &Point| f64::from(p.samples);
        let fit = curve(0.0, -1.0).fit(samples).unwrap();
        assert!((fit.slope + 1.0).abs() < 1e-6, "{fit:?}");
        assert!((fit.at(10.0) / 0.01 - 1.0).abs() < 1e-6);
        let biased = curve(5e-3, -1.0).fit(samples).unwrap();
        assert!(biased.slope > -0.8, "{biased:?}");
        assert!(Fit::of(&[(1.0, 1.0, 0.1), (2.0, 0.5, 0.1)]).is_none(), "too few doublings");
    }

    /// Points on a line fit it without a residual; that does not make the slope exact.
    #[test]
    fn a_slope_is_not_surer_than_its_points() {
        let fit = |w: f64| Fit::of(&(1..=64).map(|n| (f64::from(n), 1.0 / f64::from(n), w)).collect::<Vec<_>>());
        let (sure, unsure) = (fit(0.0).unwrap(), fit(1.0).unwrap());
        assert!(sure.half_width < 1e-6, "{sure:?}");
        // Errors of sigma = 1 / (2 sqrt 2) at 6 doublings with 5 degrees of freedom, spread of ln x about 1: some 0.4.
        assert!((0.2..0.8).contains(&unsure.half_width), "{unsure:?}");
    }

    #[test]
    fn a_width_that_is_far_off_is_not_drawn_but_said() {
        let mut curve = curve(0.0, -1.0);
        curve.points[100].judgement.trimmed.width = Some(3.0);
        curve.points[0].judgement.trimmed.width = None;
        let drawn = curve.steady_widths(TRIMMED);
        assert_eq!((drawn[0], drawn[1], drawn[100]), (None, Some(0.1), Some(0.1)));
        let errors = curve.errors(TRIMMED);
        let factor = |e: Estimate| e.interval.map(|[_, high]| high / e.value);
        assert!(factor(errors[100].1).unwrap() > 20.0 && factor(errors[101].1).unwrap() < 1.2);
    }

    #[test]
    fn a_curve_is_read_between_its_points() {
        let curve = curve(0.0, -1.0);
        // The error is 0.01 / seconds; the points are 0.1 s apart from 0.1 s to 19.9 s.
        let at = |s: f64| curve.error_at(s, TRIMMED);
        let one = at(1.234).unwrap();
        assert!((one.value * 123.4 - 1.0).abs() < 1e-6);
        let [low, high] = one.interval.unwrap();
        // Of 8.1e-3 / 10 +- 10 %, and what the noise of the reference adds: sqrt(8.1e-3 1e-6) 0.1.
        assert!((low / one.value - 0.905).abs() < 0.005 && (high / one.value - 1.105).abs() < 0.005, "{one:?}");
        assert!((at(25.0).unwrap().value * 2500.0 - 1.0).abs() < 1e-6, "by 1 / time");
        assert_eq!((at(0.05), at(50.0)), (None, None));
        let Reached::At(seconds) = curve.reached(3.21e-3 * 0.1_f64.exp(), 1) else { panic!("within the curve") };
        assert!((seconds * 0.321 - 1.0).abs() < 0.01, "{seconds}");
        assert_eq!(curve.reached(0.2, 1), Reached::Before(0.1));
        assert_eq!(curve.reached(1e-5, 0), Reached::Never);
    }
}
