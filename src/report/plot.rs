//! Scientific plots as SVG, written by hand: panels in a grid, linear or logarithmic axes, lines and measured points.
//! The files open in a browser and need nothing else.

use super::axis::Axis;
use super::page::escape;
use std::fmt::Write as _;

/// A whole picture.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Width of the whole in pixels; 1180 if absent.
    pub width: Option<f64>,
    /// First line.
    pub title: String,
    /// Smaller second line.
    pub subtitle: String,
    /// Rows of panels; panels of one row share its height.
    pub rows: Vec<Row>,
    /// Entries of the legend below the panels.
    pub legend: Vec<(Stroke, String)>,
    /// Names at the right ends of the curves of the first row's last panel.
    pub ends: Vec<End>,
    /// Small print at the bottom.
    pub footnotes: Vec<String>,
}

/// A name beside the end of a curve.
#[derive(Clone, Debug)]
pub struct End {
    /// Where the curve ends on the vertical axis.
    pub y: f64,
    /// The name.
    pub text: String,
    /// CSS colour of the curve.
    pub colour: &'static str,
}

/// Panels side by side.
#[derive(Clone, Debug)]
pub struct Row {
    /// Height of the axes box in pixels.
    pub height: f64,
    /// From left to right.
    pub panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Line above the axes; may be empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, first below.
    pub series: Vec<Series>,
    /// Lines of text in the lower left corner of the axes.
    pub notes: Vec<String>,
}

/// How a series is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Stroke {
    /// A line with an SVG dash pattern (empty: solid).
    Line {
        /// CSS colour.
        colour: &'static str,
        /// SVG `stroke-dasharray`.
        dash: &'static str,
    },
    /// A thin pale line, for what stands beside the judgement.
    Thin {
        /// CSS colour.
        colour: &'static str,
    },
    /// The area between two curves, half transparent.
    Band {
        /// CSS colour.
        colour: &'static str,
    },
    /// Circles with error bars.
    Points {
        /// CSS colour.
        colour: &'static str,
    },
}

/// One curve or set of points.
#[derive(Clone, Debug)]
pub struct Series {
    /// Look.
    pub stroke: Stroke,
    /// (x, y, standard error of y), for a band (x, lower y, upper y); points that are not finite, or not positive on a logarithmic axis, break the line.
    pub points: Vec<(f64, f64, f64)>,
}

/// Colours that stay apart for colour-blind readers (Okabe and Ito), strongest contrast first.
pub const COLOURS: [&str; 7] = ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a5c00"];
/// Dash patterns, so that lines also differ in print without colour.
pub const DASHES: [&str; 7] = ["", "8 4", "2 3", "10 3 2 3", "5 2 1 2 1 2", "14 4", "4 4"];

const FONT: &str = "font-family=\"Helvetica, Arial, 'Liberation Sans', sans-serif\"";
const WIDTH: f64 = 1180.0;
const MARGIN_LEFT: f64 = 82.0;
const MARGIN_RIGHT: f64 = 20.0;
const GAP_X: f64 = 26.0;
const GAP_Y: f64 = 16.0;
/// Width of a letter of a legend or a curve's name [pixels].
const LETTER: f64 = 7.2;
/// Letters that a name beside a curve may have.
const LONGEST_END: usize = 20;
/// Least distance of two names beside curves [pixels].
const END_STEP: f64 = 15.0;
/// Left edge and width of a letter of the small print [pixels].
const SMALL_LEFT: f64 = 20.0;
const SMALL_LETTER: f64 = 5.9;
const INK: &str = "#222222";

impl Figure {
    /// The picture as an SVG document.
    pub fn to_svg(&self) -> String {
        let mut out = String::new();
        let full = self.width.unwrap_or(WIDTH);
        let mut y = 34.0;
        let mut body = String::new();
        text(&mut body, (MARGIN_LEFT, y), 18.0, "start", "font-weight=\"bold\"", &self.title);
        if !self.subtitle.is_empty() {
            y += 21.0;
            text(&mut body, (MARGIN_LEFT, y), 13.0, "start", "", &self.subtitle);
        }
        for (i, row) in self.rows.iter().enumerate() {
            let titled = row.panels.iter().any(|p| !p.title.is_empty());
            y += if titled { 34.0 } else { GAP_Y };
            let n = row.panels.len().max(1) as f64;
            let right = if i == 0 { self.ends_width() } else { 0.0 };
            let width = (full - MARGIN_LEFT - MARGIN_RIGHT - right - GAP_X * (n - 1.0)) / n;
            for (k, panel) in row.panels.iter().enumerate() {
                let frame = Frame { x: MARGIN_LEFT + k as f64 * (width + GAP_X), y, width, height: row.height };
                let same_y = k > 0 && row.panels[k - 1].y.label == panel.y.label;
                panel.draw(&mut body, &frame, &format!("clip-{i}-{k}"), same_y);
                if i == 0 && k + 1 == row.panels.len() && right > 0.0 {
                    self.draw_ends(&mut body, &panel.y, &frame);
                }
            }
            let labelled = row.panels.iter().any(|p| !p.x.label.is_empty());
            y += row.height + if labelled { 44.0 } else { 0.0 };
        }
        y = self.draw_legend(&mut body, y);
        // Small print begins at the left edge and is broken where it would leave the picture.
        let most = ((full - MARGIN_RIGHT - SMALL_LEFT) / SMALL_LETTER) as usize;
        for line in self.footnotes.iter().flat_map(|line| broken(line, most)) {
            y += 17.0;
            text(&mut body, (SMALL_LEFT, y), 11.5, "start", "fill-opacity=\"0.75\"", &line);
        }
        let height = y + 18.0;
        let _ = write!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{full}\" height=\"{height:.0}\" viewBox=\"0 0 {full} {height:.0}\" {FONT}>\n\
             <title>{}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{body}</svg>\n",
            escape(&self.title)
        );
        out
    }

    /// Room for the names at the ends; none if there are none, or if one is too long to stand there.
    fn ends_width(&self) -> f64 {
        let longest = self.ends.iter().map(|e| e.text.chars().count()).max().unwrap_or(0);
        if longest > LONGEST_END { 0.0 } else { LETTER * longest as f64 }
    }

    /// The names at the heights of their ends, moved apart where they would overlap.
    fn draw_ends(&self, body: &mut String, axis: &Axis, f: &Frame) {
        let mut ends: Vec<(f64, &End)> = self
            .ends
            .iter()
            .filter_map(|e| Some((f.y + (1.0 - axis.at(e.y)?.clamp(0.0, 1.0)) * f.height, e)))
            .collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let highest = |k: usize| f.y + END_STEP * k as f64;
        let lowest = |k: usize, n: usize| f.y + f.height - END_STEP * (n - 1 - k) as f64;
        let (mut above, n) = (f64::NEG_INFINITY, ends.len());
        for (k, (y, _)) in ends.iter_mut().enumerate() {
            *y = y.max(above + END_STEP).min(lowest(k, n)).max(highest(k));
            above = *y;
        }
        for (y, end) in ends {
            let style = format!("style=\"fill:{}\" font-weight=\"bold\"", end.colour);
            text(body, (f.x + f.width + 6.0, y + 4.5), 12.5, "start", &style, &end.text);
        }
    }

    /// Entries from left to right, as many to a line as fit.
    fn draw_legend(&self, body: &mut String, top: f64) -> f64 {
        let (mut x, mut y) = (MARGIN_LEFT, top);
        if !self.legend.is_empty() {
            y += 22.0;
        }
        for (stroke, label) in &self.legend {
            let width = 58.0 + LETTER * label.chars().count() as f64;
            if x + width > self.width.unwrap_or(WIDTH) - MARGIN_RIGHT && x > MARGIN_LEFT {
                x = MARGIN_LEFT;
                y += 21.0;
            }
            match stroke {
                Stroke::Line { colour, dash } => {
                    let _ = writeln!(
                        body,
                        "<path d=\"M{x:.1} {:.1}h34\" stroke=\"{colour}\" stroke-width=\"2.2\" stroke-dasharray=\"{dash}\"/>",
                        y - 4.5
                    );
                }
                Stroke::Thin { colour } => {
                    let _ = writeln!(body, "<path d=\"M{x:.1} {:.1}h34\" stroke=\"{colour}\"/>", y - 4.5);
                }
                Stroke::Band { colour } => {
                    let _ = writeln!(
                        body,
                        "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"34\" height=\"9\" fill=\"{colour}\" fill-opacity=\"0.18\"/>",
                        y - 9.0
                    );
                }
                Stroke::Points { colour } => {
                    let _ = writeln!(
                        body,
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.6\" fill=\"{colour}\"/>",
                        x + 24.0,
                        y - 4.5
                    );
                }
            }
            text(body, (x + 42.0, y), 13.0, "start", "", label);
            x += width;
        }
        if self.legend.is_empty() { y } else { y + 8.0 }
    }
}

/// The axes box in pixels.
struct Frame {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

impl Panel {
    fn draw(&self, body: &mut String, f: &Frame, clip: &str, same_y: bool) {
        let px = |v: f64| self.x.at(v).map(|t| f.x + t * f.width);
        let py = |v: f64| self.y.at(v).map(|t| f.y + (1.0 - t) * f.height);
        let (bottom, right) = (f.y + f.height, f.x + f.width);
        if !self.title.is_empty() {
            text(body, (f.x, f.y - 9.0), 14.0, "start", "", &self.title);
        }
        // Grid, ticks and their labels.
        let (mut grid, mut ticks) = (String::new(), String::new());
        let (major, minor) = self.x.ticks();
        for &(v, ref label) in &major {
            let Some(x) = px(v) else { continue };
            let _ = write!(grid, "M{x:.1} {:.1}V{bottom:.1}", f.y);
            let _ = write!(ticks, "M{x:.1} {bottom:.1}v-6M{x:.1} {:.1}v6", f.y);
            if !self.x.label.is_empty() {
                text(body, (x, bottom + 16.0), 12.0, "middle", "", label);
            }
        }
        for x in minor.iter().filter_map(|&v| px(v)) {
            let _ = write!(ticks, "M{x:.1} {bottom:.1}v-3M{x:.1} {:.1}v3", f.y);
        }
        let (major, minor) = self.y.ticks();
        for &(v, ref label) in &major {
            let Some(y) = py(v) else { continue };
            let _ = write!(grid, "M{:.1} {y:.1}H{right:.1}", f.x);
            let _ = write!(ticks, "M{:.1} {y:.1}h6M{right:.1} {y:.1}h-6", f.x);
            if !same_y {
                text(body, (f.x - 7.0, y + 4.0), 12.0, "end", "", label);
            }
        }
        for y in minor.iter().filter_map(|&v| py(v)) {
            let _ = write!(ticks, "M{:.1} {y:.1}h3M{right:.1} {y:.1}h-3", f.x);
        }
        let _ = writeln!(body, "<path d=\"{grid}\" stroke=\"#dddddd\" stroke-width=\"0.8\"/>");
        if !self.x.label.is_empty() {
            text(body, (f.x + 0.5 * f.width, bottom + 36.0), 13.5, "middle", "", &self.x.label);
        }
        if !same_y {
            let (x, y) = (f.x - 58.0, f.y + 0.5 * f.height);
            text(body, (x, y), 13.5, "middle", &format!("transform=\"rotate(-90 {x:.1} {y:.1})\""), &self.y.label);
        }
        let _ = writeln!(
            body,
            "<clipPath id=\"{clip}\"><rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/></clipPath>\n<g clip-path=\"url(#{clip})\">",
            f.x, f.y, f.width, f.height
        );
        for series in &self.series {
            series.draw(body, &px, &py);
        }
        body.push_str("</g>\n");
        let _ = writeln!(body, "<path d=\"{ticks}\" stroke=\"{INK}\" stroke-width=\"0.9\"/>");
        let _ = writeln!(
            body,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1\"/>",
            f.x, f.y, f.width, f.height
        );
        for (i, note) in self.notes.iter().rev().enumerate() {
            text(body, (f.x + 12.0, bottom - 12.0 - 16.0 * i as f64), 12.0, "start", "", note);
        }
    }
}

impl Series {
    fn draw(&self, body: &mut String, px: &dyn Fn(f64) -> Option<f64>, py: &dyn Fn(f64) -> Option<f64>) {
        match self.stroke {
            Stroke::Line { .. } | Stroke::Thin { .. } => {
                let (colour, look) = match self.stroke {
                    Stroke::Line { colour, dash } => {
                        (colour, format!("stroke-width=\"2\" stroke-dasharray=\"{dash}\""))
                    }
                    Stroke::Thin { colour } | Stroke::Band { colour } | Stroke::Points { colour } => {
                        (colour, "stroke-width=\"1\" stroke-opacity=\"0.6\"".into())
                    }
                };
                let (mut path, mut pen_down) = (String::new(), false);
                for &(x, y, _) in &self.points {
                    let Some((x, y)) = px(x).zip(py(y)) else {
                        pen_down = false;
                        continue;
                    };
                    // Far outside the box a number only costs bytes.
                    let y = y.clamp(-1e4, 1e4);
                    let _ = write!(path, "{}{x:.1} {y:.1}", if pen_down { 'L' } else { 'M' });
                    pen_down = true;
                }
                let _ = writeln!(
                    body,
                    "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" {look} stroke-linejoin=\"round\"/>"
                );
            }
            Stroke::Band { colour } => {
                let ends = self.points.iter().filter_map(|&(x, low, high)| Some((px(x)?, py(low)?, py(high)?)));
                let ends: Vec<(f64, f64, f64)> = ends.collect();
                let upper = ends.iter().map(|&(x, _, high)| (x, high));
                let lower = ends.iter().rev().map(|&(x, low, _)| (x, low));
                let path: Vec<String> =
                    upper.chain(lower).map(|(x, y)| format!("{x:.1},{:.1}", y.clamp(-1e4, 1e4))).collect();
                let _ =
                    writeln!(body, "<polygon points=\"{}\" fill=\"{colour}\" fill-opacity=\"0.18\"/>", path.join(" "));
            }
            Stroke::Points { colour } => {
                let mut bars = String::new();
                for &(x, y, error) in &self.points {
                    let Some((cx, cy)) = px(x).zip(py(y)) else { continue };
                    let _ = writeln!(body, "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"2.2\" fill=\"{colour}\"/>");
                    if let Some((low, high)) = py(y - error).zip(py(y + error)) {
                        let _ = write!(bars, "M{cx:.1} {low:.1}V{high:.1}");
                    }
                }
                let _ = writeln!(body, "<path d=\"{bars}\" stroke=\"{colour}\" stroke-width=\"1\"/>");
            }
        }
    }
}

/// `line` in pieces of at most `most` letters, broken at spaces where there are any.
fn broken(line: &str, most: usize) -> Vec<String> {
    let mut out = vec![String::new()];
    for word in line.split(' ') {
        let long = |a: &str, b: &str| a.chars().count() + 1 + b.chars().count() > most.max(1);
        match out.last_mut() {
            Some(last) if last.is_empty() => last.push_str(word),
            Some(last) if !long(last, word) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => out.push(word.to_owned()),
        }
    }
    out
}

fn text(body: &mut String, (x, y): (f64, f64), size: f64, anchor: &str, more: &str, content: &str) {
    let _ = writeln!(
        body,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{INK}\" {more}>{}</text>",
        escape(content)
    );
}

#[cfg(test)]
mod tests {
    use super::super::axis::Scale;
    use super::*;

    #[test]
    fn names_at_the_ends_of_curves_keep_apart() {
        let axis = Axis { label: "y".into(), min: 1.0, max: 100.0, scale: Scale::Log };
        let panel = Panel { title: String::new(), x: axis.clone(), y: axis, series: Vec::new(), notes: Vec::new() };
        let end = |y: f64, text: &str| End { y, text: text.into(), colour: COLOURS[0] };
        let figure = Figure {
            width: Some(400.0),
            rows: vec![Row { height: 200.0, panels: vec![panel] }],
            ends: vec![end(1.01, "a"), end(1.0, "b"), end(1.02, "c"), end(90.0, "d")],
            ..Figure::default()
        };
        let svg = figure.to_svg();
        let height = |name: &str| -> f64 {
            let line = svg.lines().find(|l| l.ends_with(&format!(">{name}</text>"))).unwrap();
            line.split("y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        let [a, b, c, d] = ["a", "b", "c", "d"].map(height);
        assert!(a - c >= END_STEP - 0.2 && b - a >= END_STEP - 0.2 && d < c - 100.0, "{a} {b} {c} {d}");
    }

    #[test]
    fn small_print_is_broken_at_spaces() {
        assert_eq!(broken("one two three", 8), ["one two", "three"]);
        assert_eq!(broken("averylongword x", 5), ["averylongword", "x"]);
    }

    #[test]
    fn text_is_escaped_and_every_tag_closed() {
        let axis = |scale| Axis { label: "r < 1 & more".into(), min: 1.0, max: 100.0, scale };
        let stroke = Stroke::Line { colour: COLOURS[0], dash: "" };
        let points = vec![(1.0, 2.0, 0.0), (2.0, f64::NAN, 0.0), (3.0, 0.0, 0.0), (4.0, 50.0, 1.0)];
        let series = vec![
            Series { stroke: stroke.clone(), points: points.clone() },
            Series { stroke: Stroke::Points { colour: INK }, points },
        ];
        let panel =
            Panel { title: "a<b".into(), x: axis(Scale::Log), y: axis(Scale::Log), series, notes: vec!["n".into()] };
        let figure = Figure {
            title: "T & t".into(),
            rows: vec![Row { height: 100.0, panels: vec![panel] }],
            legend: vec![(stroke, "line".into())],
            ..Figure::default()
        };
        let svg = figure.to_svg();
        assert!(svg.contains("r &lt; 1 &amp; more") && svg.contains("a&lt;b") && svg.contains("T &amp; t"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert_eq!(svg.matches("<g ").count(), svg.matches("</g>").count());
        assert_eq!(svg.matches("<text ").count(), svg.matches("</text>").count());
    }
}
