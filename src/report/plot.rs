//! Scientific plots as SVG, written by hand: panels in a grid, linear or logarithmic axes, lines and measured points.
//! The files open in a browser and need nothing else.

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
    /// Small print at the bottom.
    pub footnotes: Vec<String>,
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

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// With unit; empty for none.
    pub label: String,
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
    /// Spacing of the values.
    pub scale: Scale,
}

/// Spacing of the values along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps.
    Linear,
    /// Equal ratios; both ends are positive.
    Log,
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
const INK: &str = "#222222";

impl Axis {
    /// Position of `value` in 0 .. 1; `None` where it cannot be drawn.
    fn at(&self, value: f64) -> Option<f64> {
        let t = match self.scale {
            Scale::Linear => (value - self.min) / (self.max - self.min),
            Scale::Log if value > 0.0 => (value / self.min).ln() / (self.max / self.min).ln(),
            Scale::Log => return None,
        };
        t.is_finite().then_some(t)
    }

    /// (value, label) of labelled ticks and values of unlabelled ones.
    fn ticks(&self) -> (Vec<(f64, String)>, Vec<f64>) {
        match self.scale {
            Scale::Linear => {
                let step = nice_step((self.max - self.min) / 4.0);
                let first = (self.min / step).ceil() as i64;
                let last = (self.max / step).floor() as i64;
                let digits = (-step.log10().floor()).max(0.0) as usize;
                let major = (first..=last).map(|i| i as f64 * step).map(|v| (v, format!("{v:.digits$}"))).collect();
                (major, Vec::new())
            }
            Scale::Log => {
                let (first, last) = (self.min.log10().ceil() as i32, self.max.log10().floor() as i32);
                let every = ((last - first) / 8 + 1).max(1);
                let plain = (-2..=3).contains(&first) && (-2..=3).contains(&last);
                let (mut major, mut minor) = (Vec::new(), Vec::new());
                for decade in first - 1..=last {
                    let value = 10f64.powi(decade);
                    if decade >= first {
                        if (decade - first) % every == 0 {
                            major.push((value, power_of_ten(decade, plain)));
                        } else {
                            minor.push(value);
                        }
                    }
                    if every == 1 {
                        minor.extend(
                            (2..10).map(|k| f64::from(k) * value).filter(|v| (self.min..=self.max).contains(v)),
                        );
                    }
                }
                // Few decades: the numbers between them are needed to read anything off.
                if major.len() < 3 {
                    for decade in first - 1..=last {
                        for k in [2, 5] {
                            let value = f64::from(k) * 10f64.powi(decade);
                            if (self.min..=self.max).contains(&value) {
                                let label = if plain {
                                    plain_number(value)
                                } else {
                                    format!("{k}·{}", power_of_ten(decade, false))
                                };
                                major.push((value, label));
                            }
                        }
                    }
                    minor.retain(|v| major.iter().all(|(m, _)| (v / m - 1.0).abs() > 1e-9));
                }
                (major, minor)
            }
        }
    }
}

/// 1, 2 or 5 times a power of ten, at least `rough`.
fn nice_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|k| k * power).find(|&step| step >= rough * 0.999).unwrap_or(10.0 * power)
}

/// Without the digits that rounding adds.
fn plain_number(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The number itself, or 10 with a raised exponent.
fn power_of_ten(decade: i32, plain: bool) -> String {
    match decade {
        _ if plain => format!("{}", 10f64.powi(decade)),
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        _ => {
            let raised = |c: char| match c {
                '-' => '⁻',
                '1' => '¹',
                '2' => '²',
                '3' => '³',
                digit => char::from_u32(0x2070 + digit as u32 - '0' as u32).unwrap_or(digit),
            };
            format!("10{}", decade.to_string().chars().map(raised).collect::<String>())
        }
    }
}

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
            let width = (full - MARGIN_LEFT - MARGIN_RIGHT - GAP_X * (n - 1.0)) / n;
            for (k, panel) in row.panels.iter().enumerate() {
                let frame = Frame { x: MARGIN_LEFT + k as f64 * (width + GAP_X), y, width, height: row.height };
                let same_y = k > 0 && row.panels[k - 1].y.label == panel.y.label;
                panel.draw(&mut body, &frame, &format!("clip-{i}-{k}"), same_y);
            }
            let labelled = row.panels.iter().any(|p| !p.x.label.is_empty());
            y += row.height + if labelled { 44.0 } else { 0.0 };
        }
        y = self.draw_legend(&mut body, y);
        for line in &self.footnotes {
            y += 17.0;
            text(&mut body, (MARGIN_LEFT, y), 11.5, "start", "fill-opacity=\"0.75\"", line);
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

    /// Entries from left to right, as many to a line as fit.
    fn draw_legend(&self, body: &mut String, top: f64) -> f64 {
        let (mut x, mut y) = (MARGIN_LEFT, top);
        if !self.legend.is_empty() {
            y += 22.0;
        }
        for (stroke, label) in &self.legend {
            let width = 58.0 + 7.2 * label.chars().count() as f64;
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
            Stroke::Line { colour, dash } => {
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
                    "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\" stroke-linejoin=\"round\"/>"
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

fn text(body: &mut String, (x, y): (f64, f64), size: f64, anchor: &str, more: &str, content: &str) {
    let _ = writeln!(
        body,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{INK}\" {more}>{}</text>",
        escape(content)
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_where_readers_expect_them() {
        let log = Axis { label: String::new(), min: 0.02, max: 3e4, scale: Scale::Log };
        let labels: Vec<String> = log.ticks().0.into_iter().map(|t| t.1).collect();
        assert_eq!(labels, ["10⁻¹", "1", "10", "10²", "10³", "10⁴"]);
        let linear = Axis { label: String::new(), min: 0.0, max: 2.0, scale: Scale::Linear };
        let labels: Vec<String> = linear.ticks().0.into_iter().map(|t| t.1).collect();
        assert_eq!(labels, ["0.0", "0.5", "1.0", "1.5", "2.0"]);
        assert_eq!(power_of_ten(-12, false), "10⁻¹²");
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
