//! Error against time and against samples, of several ways to render one picture.

use super::axis::{Axis, Scale};
use super::curve::{Curve, Fit, Floor, Point, Reached};
use super::page::{Page, Picture};
use super::plot::{COLOURS, DASHES, End, Figure, Panel, Row, Series, Stroke};
use std::fmt::Write as _;

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

/// Errors within this factor of each other are as good as equal: times on a machine with other work vary as much.
const AS_GOOD: f64 = 1.15;

impl Convergence {
    /// Fit of error against samples.
    pub fn fit_samples(&self, curve: &Curve) -> Option<Fit> {
        curve.fit(self.reference.noise, |p| f64::from(p.samples))
    }

    /// Fit of error against seconds.
    pub fn fit_seconds(&self, curve: &Curve) -> Option<Fit> {
        curve.fit(self.reference.noise, |p| p.seconds)
    }

    /// What is left of a curve's last error when its own noise and the reference's are taken off.
    pub fn floor(&self, curve: &Curve) -> Option<Floor> {
        curve.floor(self.reference.noise)
    }

    /// The time that all curves have reached [s].
    fn equal_seconds(&self) -> f64 {
        self.curves.iter().filter_map(|c| c.points.last()).map(|p| p.seconds).fold(f64::INFINITY, f64::min)
    }

    /// What came out, in sentences.
    pub fn sentences(&self) -> Vec<String> {
        let (seconds, noise) = (self.equal_seconds(), self.reference.noise);
        // An error that is not told from the reference's noise counts as what it is below.
        let error_at = |c: &Curve| {
            let hidden = c.points.last().is_some_and(|p| p.error(noise).is_none());
            c.error_at(seconds, noise).or(hidden.then_some(0.3 * noise))
        };
        let mut ranking: Vec<(&Curve, f64)> = self.curves.iter().filter_map(|c| Some((c, error_at(c)?))).collect();
        ranking.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut out = Vec::new();
        if let Some(&(best, error)) = ranking.first() {
            let (winners, rest) = ranking.split_at(ranking.iter().take_while(|r| r.1 <= AS_GOOD * error).count());
            out.push(winners_text(winners, seconds, noise));
            let others: Vec<String> =
                rest.iter().map(|&(c, e)| behind_text(c, e, (best, error), seconds, noise)).collect();
            if !others.is_empty() {
                out.push(format!("{}.", others.join("; ")));
            }
        }
        for curve in &self.curves {
            match curve.points.first() {
                Some(first) if first.seconds > seconds => out.push(format!(
                    "{} needs {:.1} s for one sample of each pixel and is not compared.",
                    curve.name, first.seconds
                )),
                _ => {}
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
                let own = p.own.map_or(String::new(), |e| format!("{e:.6e}"));
                let width = p.width.map_or(String::new(), |w| format!("{w:.4}"));
                let _ = writeln!(
                    out,
                    "{},{},{:.4},{:.4},{:.6e},{error},{own},{width}",
                    curve.name, p.samples, curve.seconds_setup, p.seconds, p.measured
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
        let (mut series, mut fits, mut legend, mut ends) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut xs, mut ys) = ((f64::INFINITY, 0.0_f64), (f64::INFINITY, 0.0_f64));
        for (i, curve) in self.curves.iter().enumerate() {
            let (colour, dash) = (COLOURS[i % COLOURS.len()], DASHES[i % DASHES.len()]);
            let (mut line, mut band) = (Vec::new(), Vec::new());
            for (p, width) in curve.points.iter().zip(curve.steady_widths()) {
                let Some(error) = p.error(self.reference.noise) else { continue };
                let (low, high) = width.map_or((error, error), |w| (error * (-w).exp(), error * w.exp()));
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
            if let Some(last) = line.last() {
                ends.push(End { y: last.1, text: curve.name.clone(), colour });
            }
            if line.len() <= MARKED {
                series.push(Series { stroke: Stroke::Points { colour }, points: line.clone() });
            }
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
            width: Some(580.0),
            rows: vec![Row { height: 360.0, panels: vec![panel] }],
            legend,
            ends,
            footnotes: self.footnotes.clone(),
        }
    }

    /// The page; `crops` are parts of the pictures at equal time, `thumbnails` the whole ones, if the parts are not that.
    pub fn page(&self, crops: &[Picture], thumbnails: &[Picture]) -> Page {
        let mut page = Page::new(&format!("Error against run time: {}", self.scene));
        page.lead(&self.sentences());
        // The small print of the figures stands at the end of the page.
        page.figures(&self.figures().map(|f| Figure { footnotes: Vec::new(), ..f }.to_svg()));
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
        if !thumbnails.is_empty() {
            page.heading("Whole pictures");
            page.pictures(thumbnails);
        }
        page.heading("How it was made");
        page.small(&[format!("Reference: {}.", self.reference.text)]);
        page.small(&self.footnotes);
        page
    }

    fn row(&self, curve: &Curve) -> Vec<String> {
        let Some(last) = curve.points.last() else { return vec![curve.name.clone()] };
        let below = format!("below {:.1e}", 0.3 * self.reference.noise);
        let noise = match (last.own, last.width) {
            (Some(own), Some(w)) => format!("{own:.2e} (×/÷ {:.2})", w.exp()),
            (Some(own), None) => format!("{own:.2e}"),
            _ => "not told".into(),
        };
        let bias = self.floor(curve).map_or("not told".into(), |f| {
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
            slope.map_or("too short".into(), |f| format!("{:.2} ± {:.2}", f.slope, f.half_width).replace('-', "−")),
        ]
    }
}

/// Curves of no more points than this have them marked.
const MARKED: usize = 16;

fn winners_text(winners: &[(&Curve, f64)], seconds: f64, noise: f64) -> String {
    let error = |e: f64| if e > 0.3 * noise { format!("relMSE {e:.2e}") } else { format!("relMSE below {e:.0e}") };
    let unclear = if winners.iter().any(|w| w.1 <= 0.3 * noise) { ", as far as the reference tells" } else { "" };
    match winners {
        [(one, e)] => {
            format!("At equal time ({seconds:.1} s) {} has the smallest error{unclear}: {}.", one.name, error(*e))
        }
        _ => {
            let names: Vec<&str> = winners.iter().map(|w| w.0.name.as_str()).collect();
            let errors: Vec<String> = winners.iter().map(|w| error(w.1)).collect();
            format!(
                "At equal time ({seconds:.1} s) {} share the smallest error{unclear}: {}.",
                listed(&names),
                errors.join(", ")
            )
        }
    }
}

fn behind_text(curve: &Curve, e: f64, (best, error): (&Curve, f64), seconds: f64, noise: f64) -> String {
    let times = format!("{} has {:.1} times that error", curve.name, e / error);
    match best.reached(e, noise) {
        Reached::At(s) if s < seconds => format!("{times}, which {} had {:.1} times sooner", best.name, seconds / s),
        Reached::Before(s) if s < seconds => {
            format!("{times}, which {} had more than {:.0} times sooner", best.name, (seconds / s).floor())
        }
        _ => times,
    }
}

/// `a, b and c`.
fn listed(names: &[&str]) -> String {
    match names {
        [front @ .., last] if !front.is_empty() => format!("{} and {last}", front.join(", ")),
        _ => names.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of `level` / seconds plus `floor`, a pass each `pass` seconds up to 20.
    fn curve(name: &str, level: f64, floor: f64, pass: f64) -> Curve {
        let point = |samples: u32| {
            let seconds = pass * f64::from(samples);
            let own = level / seconds;
            let measured = own + floor + 1e-6;
            Point { samples, seconds, measured, own: (samples > 1).then_some(own), width: Some(0.1) }
        };
        let passes = (20.0 / pass).ceil() as u32;
        Curve { name: name.into(), seconds_setup: 0.1, points: (1..=passes).map(point).collect() }
    }

    fn report(curves: Vec<Curve>) -> Convergence {
        let reference = Reference { text: "r".into(), noise: 1e-6 };
        Convergence { scene: "s".into(), curves, reference, footnotes: Vec::new() }
    }

    #[test]
    fn sentences_say_which_to_use_and_which_are_biased() {
        let curves = vec![
            curve("fair", 1e-2, 0.0, 0.1),
            curve("biased", 1e-2, 5e-3, 0.1),
            curve("slow", 0.5, 0.0, 2.0),
            curve("late", 0.5, 0.0, 30.0),
        ];
        let said = report(curves).sentences().join(" ");
        assert!(said.contains("At equal time (20.0 s) fair has the smallest error: relMSE 5.00e-4."), "{said}");
        assert!(said.contains("slow has 50.0 times that error, which fair had 50.0 times sooner"), "{said}");
        assert!(said.contains("biased flattens") && !said.contains("fair flattens"), "{said}");
        assert!(said.contains("late needs 30.0 s for one sample"), "{said}");
    }

    #[test]
    fn methods_that_are_as_good_are_named_together() {
        let curves = vec![curve("a", 1e-2, 0.0, 0.1), curve("b", 1.05e-2, 0.0, 0.1), curve("c", 10.0, 0.0, 0.1)];
        let said = report(curves).sentences().join(" ");
        assert!(said.contains("a and b share the smallest error: relMSE 5.00e-4, relMSE 5.25e-4."), "{said}");
        assert!(said.contains("c has 1000.0 times that error, which a had more than 200 times sooner"), "{said}");
    }

    #[test]
    fn a_method_with_one_pass_is_a_mark_in_the_plot_and_a_row() {
        let report = report(vec![curve("a", 1e-2, 0.0, 0.1), curve("late", 0.5, 0.0, 30.0)]);
        let [seconds, _] = report.figures().map(|f| f.to_svg());
        assert!(seconds.contains("<circle") && seconds.contains(">late</text>"), "{seconds}");
        assert!(report.to_csv().lines().any(|l| l.starts_with("late,1,")));
        assert_eq!(report.row(&report.curves[1])[5], "not told");
    }
}
