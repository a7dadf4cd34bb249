//! Error of one way to render while it runs: points, slopes, what it flattens at.

/// One way to render, measured while it ran.
#[derive(Clone, Debug)]
pub struct Curve {
    /// As asked.
    pub name: String,
    /// Building its trees and tables [s]; not in the times of the points.
    pub seconds_setup: f64,
    /// In order of time.
    pub points: Vec<Point>,
}

/// A measurement.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Samples of each pixel.
    pub samples: u32,
    /// Time of rendering [s].
    pub seconds: f64,
    /// relMSE against the reference as it is, the reference's own noise in it.
    pub measured: f64,
    /// relMSE against its own limit, told by its halves; none before each half has a pass.
    pub own: Option<f64>,
    /// Half of the 95 % interval of log(error / told error).
    pub width: Option<f64>,
}

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

/// What a curve tends to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// relMSE that does not go away with samples.
    pub value: f64,
    /// Half of its 95 % interval.
    pub half_width: f64,
}

impl Floor {
    /// Whether it is told from none.
    pub fn is_seen(&self) -> bool {
        self.value > self.half_width
    }
}

impl Point {
    /// relMSE against what the reference stands for: the reference's noise is independent, so its square is taken off.
    /// None where it is not told from that noise.
    pub fn error(&self, noise: f64) -> Option<f64> {
        let error = self.measured - noise;
        (error > 0.3 * noise && error > 0.0).then_some(error)
    }
}

impl Fit {
    /// Over (x, error) in ascending order of x. Errors of a growing mean go together, so the residuals count as one for
    /// each doubling of x. None with fewer than two and a half doublings.
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
        let doublings = (logs.last()?.0 - logs.first()?.0) / std::f64::consts::LN_2;
        if doublings < 2.5 || logs.len() < 4 {
            return None;
        }
        // Equal weight to equal ratios of x, however close the measurements are.
        let weight = |i: usize| (logs[(i + 1).min(logs.len() - 1)].0 - logs[i.saturating_sub(1)].0) / 2.0;
        let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            logs.iter().enumerate().map(|(i, &(x, y))| weight(i) * f(x, y)).sum()
        };
        let all = sum(&|_, _| 1.0);
        let (mx, my) = (sum(&|x, _| x) / all, sum(&|_, y| y) / all);
        let spread = sum(&|x, _| (x - mx).powi(2));
        let slope = sum(&|x, y| (x - mx) * (y - my)) / spread;
        let residual = sum(&|x, y| (y - my - slope * (x - mx)).powi(2)) / all;
        let freedom = doublings + 1.0 - 2.0;
        let error = (residual / freedom / (spread / all)).sqrt();
        let student = crate::film::metrics::student_975(freedom.max(1.0) as usize);
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

/// Told noise is not believed to better than this share.
const LEAST_WIDTH: f64 = 0.3;

/// Passes before these are left out of fits: sequences begin before they spread.
const SETTLED: u32 = 2;

/// Widths are steadied over points with up to this times the samples, and as many fewer.
const STEADY: f64 = 1.3;

/// A curve is continued by 1 / time as far as this times its length.
const CONTINUED: f64 = 1.5;

impl Curve {
    /// (x, error) of the points that are told from the reference's `noise`.
    pub(super) fn line(&self, noise: f64, x: impl Fn(&Point) -> f64) -> Vec<(f64, f64)> {
        self.points.iter().filter_map(|p| Some((x(p), p.error(noise)?))).collect()
    }

    /// Fit of the error against `x` from the second sample on.
    pub(super) fn fit(&self, noise: f64, x: impl Fn(&Point) -> f64) -> Option<Fit> {
        let points = self.points.iter().filter(|p| p.samples >= SETTLED);
        Fit::of(&points.filter_map(|p| Some((x(p), p.error(noise)?))).collect::<Vec<_>>())
    }

    /// The width of each point as it is drawn: the median over the points around. A width is itself an estimate, of one
    /// picture, and now and then far off.
    pub(super) fn steady_widths(&self) -> Vec<Option<f64>> {
        let at = |p: &Point| {
            let near = |q: &&Point| {
                let ratio = f64::from(q.samples) / f64::from(p.samples);
                (1.0 / STEADY..=STEADY).contains(&ratio)
            };
            let mut widths: Vec<f64> = self.points.iter().filter(near).filter_map(|q| q.width).collect();
            widths.sort_by(f64::total_cmp);
            p.width.map(|_| widths[widths.len() / 2])
        };
        self.points.iter().map(at).collect()
    }

    /// The error after `seconds`: on straight lines between the logarithms, beyond the last point by 1 / time. None
    /// before the first, or far beyond the last.
    pub fn error_at(&self, seconds: f64, noise: f64) -> Option<f64> {
        let line = self.line(noise, |p| p.seconds);
        let (first, last) = (line.first()?, line.last()?);
        if seconds < first.0 || seconds > CONTINUED * last.0 {
            return None;
        }
        let next = line.iter().position(|p| p.0 >= seconds);
        Some(match next {
            None => last.1 * last.0 / seconds,
            Some(0) => first.1,
            Some(i) => {
                let (a, b) = (line[i - 1], line[i]);
                let share = (seconds / a.0).ln() / (b.0 / a.0).ln();
                (a.1.ln() + share * (b.1 / a.1).ln()).exp()
            }
        })
    }

    /// When the curve first was down to `error`.
    pub fn reached(&self, error: f64, noise: f64) -> Reached {
        let line = self.line(noise, |p| p.seconds);
        match line.iter().position(|p| p.1 <= error) {
            None => Reached::Never,
            Some(0) => Reached::Before(line[0].0),
            Some(i) => {
                let (a, b) = (line[i - 1], line[i]);
                let share = (error / a.1).ln() / (b.1 / a.1).ln();
                Reached::At((a.0.ln() + share * (b.0 / a.0).ln()).exp())
            }
        }
    }

    /// What is left of the last error when its own noise and the reference's are taken off.
    pub fn floor(&self, noise: f64) -> Option<Floor> {
        let last = self.points.last()?;
        let own = last.own?;
        let value = last.measured - noise - own;
        // Told noise, the reference's noise, and the product of bias and noise, each known to some share; told noise has an
        // error of its own while it is large, so that less than 0.3 of it is never called bias.
        let width = last.width.unwrap_or(1.0).max(LEAST_WIDTH);
        let parts = [width * own, 0.3 * noise, width * (value.max(0.0) * own).sqrt()];
        Some(Floor { value, half_width: parts.iter().map(|p| p * p).sum::<f64>().sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(floor: f64, slope: f64) -> Curve {
        let point = |samples: u32| {
            let own = 0.1 * f64::from(samples).powf(slope);
            let measured = own + floor + 1e-6;
            Point { samples, seconds: 0.1 * f64::from(samples), measured, own: Some(own), width: Some(0.1) }
        };
        Curve { name: "c".into(), seconds_setup: 0.1, points: (1..200).map(point).collect() }
    }

    #[test]
    fn slopes_are_those_put_in() {
        let samples = |p: &Point| f64::from(p.samples);
        let fit = curve(0.0, -1.0).fit(1e-6, samples).unwrap();
        assert!((fit.slope + 1.0).abs() < 1e-6 && fit.half_width < 1e-6, "{fit:?}");
        assert!((fit.at(10.0) / 0.01 - 1.0).abs() < 1e-6);
        let biased = curve(5e-3, -1.0).fit(1e-6, samples).unwrap();
        assert!(biased.slope > -0.8, "{biased:?}");
        assert!(Fit::of(&[(1.0, 1.0), (2.0, 0.5)]).is_none(), "too few doublings");
    }

    #[test]
    fn bias_is_told_from_noise() {
        let [fair, biased] = [0.0, 5e-3].map(|floor| curve(floor, -1.0).floor(1e-6).unwrap());
        assert!(!fair.is_seen() && fair.value.abs() < 1e-9, "{fair:?}");
        assert!(biased.is_seen() && (biased.value / 5e-3 - 1.0).abs() < 1e-6, "{biased:?}");
    }

    #[test]
    fn a_width_that_is_far_off_is_not_drawn() {
        let mut curve = curve(0.0, -1.0);
        curve.points[100].width = Some(3.0);
        curve.points[0].width = None;
        let drawn = curve.steady_widths();
        assert_eq!((drawn[0], drawn[1], drawn[100]), (None, Some(0.1), Some(0.1)));
    }

    #[test]
    fn a_curve_is_read_between_its_points() {
        let curve = curve(0.0, -1.0);
        // The error is 0.01 / seconds; the points are 0.1 s apart from 0.1 s to 19.9 s.
        assert!((curve.error_at(1.234, 1e-6).unwrap() * 123.4 - 1.0).abs() < 1e-6);
        assert!((curve.error_at(25.0, 1e-6).unwrap() * 2500.0 - 1.0).abs() < 1e-6, "by 1 / time");
        assert_eq!((curve.error_at(0.05, 1e-6), curve.error_at(50.0, 1e-6)), (None, None));
        let Reached::At(seconds) = curve.reached(3.21e-3, 1e-6) else { panic!("within the curve") };
        assert!((seconds * 0.321 - 1.0).abs() < 1e-6);
        assert_eq!(curve.reached(0.2, 1e-6), Reached::Before(0.1));
        assert_eq!(curve.reached(1e-5, 1e-6), Reached::Never);
    }

    #[test]
    fn a_point_below_the_noise_of_the_reference_has_no_error() {
        let point = Point { samples: 1, seconds: 1.0, measured: 1.1e-3, own: None, width: None };
        assert_eq!(point.error(1e-3), None);
        assert!(point.error(1e-4).is_some());
        let one = Curve { name: "c".into(), seconds_setup: 0.0, points: vec![point] };
        assert_eq!(one.floor(1e-4), None, "one pass tells no noise");
    }
}
