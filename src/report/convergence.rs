//! Error against time and against samples, of several ways to render one picture: table, plots and page. The sentences are
//! in `verdict.rs`.

use super::axis::{Axis, Scale};
use super::curve::{ALL, Curve, Fit, Point, TRIMMED, error_text, why_not};
use super::page::{Page, Picture};
use super::plot::{COLOURS, DASHES, End, Figure, Panel, Row, Series, Stroke};
use crate::film::metrics::Estimate;
use std::fmt::Write as _;

/// The whole measurement.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// Name of the scene.
    pub scene: String,
    /// One for each method.
    pub curves: Vec<Curve>,
    /// What the curves are measured against, for people.
    pub reference: String,
    /// Whether its noise is known.
    pub reference_tells_noise: bool,
    /// What must be known before the figures: they stand first.
    pub remarks: Vec<String>,
    /// Program, machine, threads, command: printed below.
    pub footnotes: Vec<String>,
}

impl Convergence {
    /// Fit of error against samples.
    pub fn fit_samples(&self, curve: &Curve) -> Option<Fit> {
        curve.fit(|p| f64::from(p.samples))
    }

    /// Fit of error against seconds.
    pub fn fit_seconds(&self, curve: &Curve) -> Option<Fit> {
        curve.fit(|p| p.seconds)
    }

    /// One row for each measurement.
    pub fn to_csv(&self) -> String {
        let mut out = format!(
            "# {}; reference: {}; its noise is in `relmse` and taken off in `error`; `trimmed` is without the worst 0.1 % of \
             the pixels\nmethod,samples,seconds_setup,seconds,relmse,error,self_relmse,self_log_half_width,",
            self.scene, self.reference
        );
        out.push_str("error_low,error_high,relmse_trimmed,error_trimmed,error_trimmed_low,error_trimmed_high,");
        out.push_str("reference_noise,noise_trimmed,bias_trimmed,bias_trimmed_half_width,");
        out.push_str("worst_share,worst_share_trimmed,worst_x,worst_y\n");
        let some = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6e}"));
        for curve in &self.curves {
            for p in &curve.points {
                let told = p.told.and_then(|told| told.relmse);
                let log = told.and_then(|t| t.interval).map(|[low, high]| (high / low).ln() / 2.0);
                let error = |e: Estimate, told: bool| told.then_some(e.value);
                let (all, trimmed) = (p.judgement.all.error(), p.judgement.trimmed.error());
                let (x, y) = (p.judgement.all.worst_pixel[0], p.judgement.all.worst_pixel[1]);
                let end = |e: Estimate, k: usize| some(e.interval.map(|ends| ends[k]));
                let cells = [
                    curve.name.clone(),
                    p.samples.to_string(),
                    format!("{:.4}", curve.seconds_setup),
                    format!("{:.4}", p.seconds),
                    some(Some(p.judgement.all.measured)),
                    some(error(all, p.judgement.all.is_told())),
                    some(told.map(|t| t.value)),
                    log.map_or(String::new(), |w| format!("{w:.4}")),
                    end(all, 0),
                    end(all, 1),
                    some(Some(p.judgement.trimmed.measured)),
                    some(error(trimmed, p.judgement.trimmed.is_told())),
                    end(trimmed, 0),
                    end(trimmed, 1),
                    some(Some(p.judgement.all.reference_noise)),
                    some(p.judgement.trimmed.noise),
                    some(p.judgement.trimmed.bias.map(|b| b.value)),
                    some(p.judgement.trimmed.bias.map(|b| b.half_width)),
                    format!("{:.4}", p.judgement.all.worst_share),
                    format!("{:.4}", p.judgement.trimmed.worst_share),
                    x.to_string(),
                    y.to_string(),
                ];
                let _ = writeln!(out, "{}", cells.join(","));
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
            for (p, width) in curve.points.iter().zip(curve.steady_widths(TRIMMED)) {
                if !p.judgement.trimmed.is_told() {
                    continue;
                }
                let error = crate::film::Judged { width, ..p.judgement.trimmed }.error();
                // A band without a lower end ends below the picture.
                let (low, high) = error.interval.map_or((error.value, error.value), |[a, b]| (a.max(b / 1e3), b));
                line.push((x(p), error.value, 0.0));
                band.push((x(p), low, high));
                xs = (xs.0.min(x(p)), xs.1.max(x(p)));
                ys = (ys.0.min(low.max(error.value / 10.0)), ys.1.max(error.value));
            }
            let all: Vec<_> = curve
                .points
                .iter()
                .filter(|p| p.judgement.all.is_told())
                .map(|p| (x(p), p.judgement.all.error().value, 0.0))
                .collect();
            ys.1 = all.iter().fold(ys.1, |top, p| top.max(p.1));
            series.push(Series { stroke: Stroke::Thin { colour }, points: all });
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
        let noise = self.curves.iter().filter_map(|c| c.points.last()).map(|p| p.judgement.trimmed.reference_noise);
        let noise = noise.fold(0.0, f64::max);
        if noise > 0.0 && noise > ys.0 {
            let line = [xs.0, xs.1].map(|x| (x, noise, 0.0)).to_vec();
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
        let panel = Panel {
            title: String::new(),
            x: axis(label, xs),
            y: axis("relMSE, trimmed", ys),
            series,
            notes: Vec::new(),
        };
        Figure {
            title: title.into(),
            subtitle: format!("{}; bands: 95 %; thin: all pixels; dotted: fits", self.scene),
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
        page.remarks(&self.remarks);
        page.lead(&self.sentences());
        // The small print of the figures stands at the end of the page.
        page.figures(&self.figures().map(|f| Figure { footnotes: Vec::new(), ..f }.to_svg()));
        page.heading("Numbers");
        page.text(
            "relMSE is the mean of (x − r)² / (r² + 0.01 mean(r)²) over pixels and channels, the noise of the reference taken \
             off; trimmed, without the worst 0.1 % of each picture's pixels, by which methods are judged. Noise is told by the \
             two independent halves of each render; bias is the mean product of what the two halves are wrong by. All in \
             brackets are 95 % intervals.",
        );
        let rows: Vec<Vec<String>> = self.curves.iter().map(|c| self.row(c)).collect();
        let head = ["method", "setup", "time", "samples", "relMSE, trimmed", "noise", "bias"];
        page.table(&[&head[..], &["relMSE, all pixels", "worst pixel's share", "slope in samples"]].concat(), &rows);
        page.heading("At equal time");
        page.text("The same part of each picture, pixel by pixel, when each had used its time.");
        page.pictures(crops);
        if !thumbnails.is_empty() {
            page.heading("Whole pictures");
            page.pictures(thumbnails);
        }
        page.heading("How it was made");
        page.small(&[format!("Reference: {}.", self.reference)]);
        page.small(&self.footnotes);
        page
    }

    fn row(&self, curve: &Curve) -> Vec<String> {
        let Some(last) = curve.points.last() else { return vec![curve.name.clone()] };
        let errors = |set| curve.errors(set).last().map_or(String::new(), |(_, error)| cell(error));
        let noise = match (last.judgement.trimmed.noise, last.judgement.trimmed.width) {
            (Some(own), Some(w)) => format!("{own:.2e} (×/÷ {:.2})", w.exp()),
            (Some(own), None) => format!("{own:.2e} (unknown)"),
            _ => "not told".into(),
        };
        let bias = match last.judgement.trimmed.bias {
            Some(_) if why_not(&last.judgement, &last.judgement.trimmed).is_some() => "no verdict".into(),
            Some(b) if b.is_seen() => cell(&Estimate { value: b.value, interval: Some(b.interval()) }),
            Some(b) => b.at_most(),
            None => "not told".into(),
        };
        let slope = self.fit_samples(curve);
        vec![
            curve.name.clone(),
            format!("{:.2} s", curve.seconds_setup),
            format!("{:.2} s", last.seconds),
            last.samples.to_string(),
            errors(TRIMMED),
            noise,
            bias,
            errors(ALL),
            format!(
                "{:.1} % at {},{}",
                100.0 * last.judgement.all.worst_share,
                last.judgement.all.worst_pixel[0],
                last.judgement.all.worst_pixel[1]
            ),
            slope.map_or("too short".into(), |f| format!("{:.2} ± {:.2}", f.slope, f.half_width).replace('-', "−")),
        ]
    }
}

/// A figure and its interval in a table.
fn cell(error: &Estimate) -> String {
    match error.interval {
        Some([low, high]) if low > 0.0 => format!("{:.2e} ({low:.1e} to {high:.1e})", error.value),
        _ => error_text(error).replace("relMSE ", "").replace(", not told from the reference's noise", ""),
    }
}

/// Curves of no more points than this have them marked.
const MARKED: usize = 16;

#[cfg(test)]
mod tests {
    use super::super::curve::tests::judged;
    use super::*;
    use crate::film::Judgement;

    fn report(points: &[(u32, f64)]) -> Convergence {
        let point = |&(samples, seconds): &(u32, f64)| {
            let judged = judged((samples > 1).then_some(0.5 / seconds), 0.0, 0.2);
            Point { samples, seconds, judgement: Judgement { all: judged, trimmed: judged }, told: None }
        };
        let curve = Curve {
            name: "late".into(),
            seconds_setup: 0.1,
            points: points.iter().map(point).collect(),
            not_met: Vec::new(),
        };
        Convergence {
            scene: "s".into(),
            curves: vec![curve],
            reference: "r".into(),
            reference_tells_noise: true,
            remarks: vec!["the lamp is not met yet".into()],
            footnotes: Vec::new(),
        }
    }

    #[test]
    fn a_method_with_one_pass_is_a_mark_in_the_plot_and_a_row() {
        let report = report(&[(1, 30.0)]);
        let [seconds, _] = report.figures().map(|f| f.to_svg());
        assert!(seconds.contains("<circle") && seconds.contains(">late</text>"), "{seconds}");
        assert!(report.to_csv().lines().any(|l| l.starts_with("late,1,")));
        assert_eq!(report.row(&report.curves[0])[5], "not told");
        assert!(report.row(&report.curves[0])[4].ends_with("(interval unknown)"));
    }

    #[test]
    fn remarks_stand_before_what_came_out() {
        let page = report(&[(1, 1.0), (8, 8.0), (9, 9.0)]).page(&[], &[]).to_html();
        let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text} is on the page"));
        assert!(at("the lamp is not met yet") < at("class=\"lead\""));
    }

    #[test]
    fn every_row_has_every_column() {
        let csv = report(&[(1, 1.0), (8, 8.0), (9, 9.0)]).to_csv();
        let columns = csv.lines().nth(1).map(|l| l.split(',').count());
        assert!(csv.lines().skip(2).all(|l| Some(l.split(',').count()) == columns), "{csv}");
    }
}
