//! Error against time and against samples, of several ways to render one picture.

use super::page::{Page, Picture};
use super::plot::{Axis, COLOURS, DASHES, Figure, Panel, Row, Scale, Series, Stroke};
use std::fmt::Write as _;

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
    /// relMSE against its own limit, told by its halves.
    pub own: f64,
    /// Half of the 95 % interval of log(error / told error).
    pub width: Option<f64>,
}

/// What the curves are measured against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// What it is, for people.
    pub text: String,
    /// Its own relMSE, 0 if not known.
    pub noise: f64,
}

/// The whole measurement.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// Name of the scene.
    pub scene: String,
    /// One for each method.
    pub curves: Vec<Curve>,
    /// Against what.
    pub reference: Reference,
    /// Program, machine, threads, command: printed below.
    pub footnotes: Vec<String>,
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

/// What a method's curve tends to.
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

    /// Where the error is `y`.
    pub fn solve(&self, y: f64) -> f64 {
        ((y.ln() - self.intercept) / self.slope).exp()
    }
}

/// Told noise is not believed to better than this share.
const LEAST_WIDTH: f64 = 0.3;

/// Passes before the first is left out of fits: sequences begin before they spread.
const SETTLED: u32 = 2;

impl Convergence {
    /// (x, error) of a curve's points that are told from the reference's noise.
    fn line(&self, curve: &Curve, x: impl Fn(&Point) -> f64) -> Vec<(f64, f64)> {
        curve.points.iter().filter_map(|p| Some((x(p), p.error(self.reference.noise)?))).collect()
    }

    /// Fit of error against samples.
    pub fn fit_samples(&self, curve: &Curve) -> Option<Fit> {
        let settled = Curve { points: settled(curve), ..curve.clone() };
        Fit::of(&self.line(&settled, |p| f64::from(p.samples)))
    }

    /// Fit of noise alone, told by the halves, against seconds.
    fn fit_seconds(&self, curve: &Curve) -> Option<Fit> {
        let settled = Curve { points: settled(curve), ..curve.clone() };
        Fit::of(&self.line(&settled, |p| p.seconds))
    }

    /// What is left of a curve's last error when its own noise and the reference's are taken off.
    pub fn floor(&self, curve: &Curve) -> Option<Floor> {
        let last = curve.points.last()?;
        let value = last.measured - self.reference.noise - last.own;
        // Told noise, the reference's noise, and the product of bias and noise, each known to some share; told noise has an
        // error of its own while it is large, so that less than 0.3 of it is never called bias.
        let width = last.width.unwrap_or(1.0).max(LEAST_WIDTH);
        let parts = [width * last.own, 0.3 * self.reference.noise, width * (value.max(0.0) * last.own).sqrt()];
        Some(Floor { value, half_width: parts.iter().map(|p| p * p).sum::<f64>().sqrt() })
    }

    /// Names of the curves by their last error, best first.
    fn ranking(&self) -> Vec<(&Curve, f64)> {
        let mut all: Vec<(&Curve, f64)> = self
            .curves
            .iter()
            .filter_map(|c| Some((c, (c.points.last()?.measured - self.reference.noise).max(0.0))))
            .collect();
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        all
    }

    /// What came out, in sentences.
    pub fn sentences(&self) -> Vec<String> {
        let ranking = self.ranking();
        let mut out = Vec::new();
        if let [(best, error), rest @ ..] = &ranking[..] {
            let seconds = best.points.last().map_or(0.0, |p| p.seconds);
            let unclear = if *error < 0.3 * self.reference.noise { ", as far as the reference tells" } else { "" };
            out.push(format!(
                "At equal time ({seconds:.1} s) {} has the smallest error{unclear}: relMSE {error:.2e}.",
                best.name
            ));
            let others: Vec<String> = rest
                .iter()
                .map(|(c, e)| match self.fit_seconds(best).map(|f| seconds / f.solve(*e)) {
                    Some(times) if times.is_finite() && times > 1.0 => format!(
                        "{} has {:.1} times that error, which {} had {times:.1} times sooner",
                        c.name,
                        e / error.max(1e-300),
                        best.name
                    ),
                    _ => format!("{} has {:.1} times that error", c.name, e / error.max(1e-300)),
                })
                .collect();
            if !others.is_empty() {
                out.push(format!("{}.", others.join("; ")));
            }
        }
        for curve in &self.curves {
            let Some(floor) = self.floor(curve).filter(Floor::is_seen) else { continue };
            out.push(format!(
                "{} flattens: relMSE {:.2e} ± {:.1e} of it is bias against this reference and will not go away with samples.",
                curve.name, floor.value, floor.half_width
            ));
        }
        out
    }

    /// One row for each measurement.
    pub fn to_csv(&self) -> String {
        let mut out = format!(
            "# {}; reference: {}; its own relMSE {:.3e} is in `relmse` and taken off in `error`\n\
             method,samples,seconds_setup,seconds,relmse,error,self_relmse,self_log_half_width\n",
            self.scene, self.reference.text, self.reference.noise
        );
        for curve in &self.curves {
            for p in &curve.points {
                let error = p.error(self.reference.noise).map_or(String::new(), |e| format!("{e:.6e}"));
                let width = p.width.map_or(String::new(), |w| format!("{w:.4}"));
                let _ = writeln!(
                    out,
                    "{},{},{:.4},{:.4},{:.6e},{error},{:.6e},{width}",
                    curve.name, p.samples, curve.seconds_setup, p.seconds, p.measured, p.own
                );
            }
        }
        out
    }

    /// Error against seconds and error against samples.
    pub fn figures(&self) -> [Figure; 2] {
        let seconds = self.figure("Error against time", "time of rendering [s]", |p| p.seconds, Self::fit_seconds);
        let samples = self.figure(
            "Error against samples",
            "samples of each pixel",
            |p| f64::from(p.samples),
            |s, c| s.fit_samples(c),
        );
        [seconds, samples]
    }

    fn figure(
        &self,
        title: &str,
        label: &str,
        x: impl Fn(&Point) -> f64 + Copy,
        fit: impl Fn(&Self, &Curve) -> Option<Fit>,
    ) -> Figure {
        let (mut series, mut fits, mut legend) = (Vec::new(), Vec::new(), Vec::new());
        let (mut xs, mut ys) = ((f64::INFINITY, 0.0_f64), (f64::INFINITY, 0.0_f64));
        for (i, curve) in self.curves.iter().enumerate() {
            let (colour, dash) = (COLOURS[i % COLOURS.len()], DASHES[i % DASHES.len()]);
            let (mut line, mut band) = (Vec::new(), Vec::new());
            for p in &curve.points {
                let Some(error) = p.error(self.reference.noise) else { continue };
                let (low, high) = p.width.map_or((error, error), |w| (error * (-w).exp(), error * w.exp()));
                line.push((x(p), error, 0.0));
                band.push((x(p), low, high));
                xs = (xs.0.min(x(p)), xs.1.max(x(p)));
                ys = (ys.0.min(low), ys.1.max(error));
            }
            let slope = fit(self, curve);
            if let (Some(fit), Some(last)) = (slope, line.last()) {
                let first = line.iter().find(|p| p.0 >= last.0 / 1e3).map_or(last.0, |p| p.0);
                let ends = [first, last.0].map(|x| (x, fit.at(x), 0.0));
                fits.push(Series { stroke: Stroke::Line { colour, dash: "1 3" }, points: ends.to_vec() });
            }
            let text = slope.map_or(curve.name.clone(), |f| {
                format!("{}: slope {:.2} ± {:.2}", curve.name, f.slope, f.half_width).replace("slope -", "slope −")
            });
            series.insert(0, Series { stroke: Stroke::Band { colour }, points: band });
            series.push(Series { stroke: Stroke::Line { colour, dash }, points: line });
            legend.push((Stroke::Line { colour, dash }, text));
        }
        series.extend(fits);
        if self.reference.noise > 0.0 && self.reference.noise > ys.0 {
            let line = [xs.0, xs.1].map(|x| (x, self.reference.noise, 0.0)).to_vec();
            let stroke = Stroke::Line { colour: "#888888", dash: "2 2" };
            series.push(Series { stroke: stroke.clone(), points: line });
            legend.push((stroke, "noise of the reference, taken off".into()));
        }
        if !(xs.1 > 0.0 && ys.1 > 0.0) {
            (xs, ys) = ((1.0, 10.0), (1e-4, 1.0));
        }
        let axis = |label: &str, (low, high): (f64, f64)| Axis {
            label: label.into(),
            min: low / 1.15,
            max: (high * 1.15).max(low * 1.5),
            scale: Scale::Log,
        };
        let panel =
            Panel { title: String::new(), x: axis(label, xs), y: axis("relMSE", ys), series, notes: Vec::new() };
        Figure {
            title: title.into(),
            subtitle: format!("{}; bands: 95 %; dotted: fits", self.scene),
            width: Some(640.0),
            rows: vec![Row { height: 380.0, panels: vec![panel] }],
            legend,
            footnotes: Vec::new(),
        }
    }

    /// The page; `pictures` are crops at equal time, `thumbnails` the whole pictures.
    pub fn page(&self, crops: &[Picture], thumbnails: &[Picture]) -> Page {
        let mut page = Page::new(&format!("Error against run time: {}", self.scene));
        page.lead(&self.sentences());
        page.figures(&self.figures().map(|f| f.to_svg()));
        page.heading("Numbers");
        page.text(
            "relMSE is the mean of (x − r)² / (r² + 0.01 mean(r)²) over pixels and channels. Noise is told by the two \
             independent halves of each render; bias is what is left of the error without it.",
        );
        let rows: Vec<Vec<String>> = self.curves.iter().map(|c| self.row(c)).collect();
        page.table(
            &["method", "setup", "time", "samples", "relMSE", "of it noise", "of it bias", "slope in samples"],
            &rows,
        );
        page.heading("At equal time");
        page.text("The same part of each picture, pixel by pixel, when all had used the same time.");
        page.pictures(crops);
        page.heading("Whole pictures");
        page.pictures(thumbnails);
        page.heading("How it was made");
        page.small(&[format!("Reference: {}.", self.reference.text)]);
        page.small(&self.footnotes);
        page
    }

    fn row(&self, curve: &Curve) -> Vec<String> {
        let Some(last) = curve.points.last() else { return vec![curve.name.clone()] };
        let below = format!("below {:.1e}", 0.3 * self.reference.noise);
        let noise = match last.width {
            Some(w) => format!("{:.2e} (×/÷ {:.2})", last.own, w.exp()),
            None => format!("{:.2e}", last.own),
        };
        let bias = self.floor(curve).map_or(String::new(), |f| {
            if f.is_seen() {
                format!("{:.2e} ± {:.0e}", f.value, f.half_width)
            } else {
                format!("below {:.0e}", f.half_width)
            }
        });
        let slope = self.fit_samples(curve);
        vec![
            curve.name.clone(),
            format!("{:.2} s", curve.seconds_setup),
            format!("{:.2} s", last.seconds),
            last.samples.to_string(),
            last.error(self.reference.noise).map_or(below, |e| format!("{e:.2e}")),
            noise,
            bias,
            slope.map_or("".into(), |f| format!("{:.2} ± {:.2}", f.slope, f.half_width).replace('-', "−")),
        ]
    }
}

fn settled(curve: &Curve) -> Vec<Point> {
    curve.points.iter().filter(|p| p.samples >= SETTLED).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, floor: f64, slope: f64) -> Curve {
        let point = |samples: u32| {
            let own = 0.1 * f64::from(samples).powf(slope);
            Point { samples, seconds: 0.1 * f64::from(samples), measured: own + floor + 1e-6, own, width: Some(0.1) }
        };
        Curve { name: name.into(), seconds_setup: 0.1, points: (1..200).map(point).collect() }
    }

    fn both() -> Convergence {
        Convergence {
            scene: "s".into(),
            curves: vec![curve("fair", 0.0, -1.0), curve("biased", 5e-3, -1.0)],
            reference: Reference { text: "r".into(), noise: 1e-6 },
            footnotes: Vec::new(),
        }
    }

    #[test]
    fn slopes_are_those_put_in() {
        let c = both();
        let fit = c.fit_samples(&c.curves[0]).unwrap();
        assert!((fit.slope + 1.0).abs() < 1e-6 && fit.half_width < 1e-6, "{fit:?}");
        assert!((fit.at(10.0) / 0.01 - 1.0).abs() < 1e-6 && (fit.solve(0.01) / 10.0 - 1.0).abs() < 1e-6);
        let biased = c.fit_samples(&c.curves[1]).unwrap();
        assert!(biased.slope > -0.8, "{biased:?}");
    }

    #[test]
    fn bias_is_told_from_noise() {
        let c = both();
        let [fair, biased] = [0, 1].map(|i| c.floor(&c.curves[i]).unwrap());
        assert!(!fair.is_seen() && fair.value.abs() < 1e-9, "{fair:?}");
        assert!(biased.is_seen() && (biased.value / 5e-3 - 1.0).abs() < 1e-6, "{biased:?}");
        let said = c.sentences().join(" ");
        assert!(said.contains("fair has the smallest error") && said.contains("biased flattens"), "{said}");
        assert!(!said.contains("fair flattens"), "{said}");
    }

    #[test]
    fn a_curve_below_the_noise_of_the_reference_is_not_drawn() {
        let point = Point { samples: 1, seconds: 1.0, measured: 1.1e-3, own: 1e-4, width: None };
        assert_eq!(point.error(1e-3), None);
        assert!(point.error(1e-4).is_some());
        assert!(Fit::of(&[(1.0, 1.0), (2.0, 0.5)]).is_none(), "too few doublings");
    }
}
