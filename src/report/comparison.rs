//! Models against a reference, on one page. What is judged are the pixels of translucent objects: the others are the same
//! in every model, and would only dilute the difference.

use super::curve::why_not;
use super::false_colour::colour_bar;
use super::page::{Page, Picture};
use super::verdict::listed;
use crate::film::metrics::Estimate;
use crate::film::{Bias, Brightness, Judgement};
use crate::words::counted;
use serde::Serialize;
use std::fmt::Write as _;

/// One model against the reference.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// As asked.
    pub name: String,
    /// Time of rendering \[s\].
    pub seconds: f64,
    /// Samples of each pixel.
    pub samples: u32,
    /// By what the camera sees first; the parts that have pixels, in the order of [`Part`].
    pub parts: Vec<Figures>,
}

/// Parts of a picture by what the camera sees first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Pixels that are translucent objects alone.
    Translucent,
    /// Pixels at silhouettes: translucent objects and something else.
    Mixed,
    /// Pixels without a translucent object.
    Background,
    /// All pixels.
    All,
}

impl Part {
    /// In the order of reports.
    pub const ORDER: [Self; 4] = [Self::Translucent, Self::Mixed, Self::Background, Self::All];

    /// As tables print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Translucent => "translucent",
            Self::Mixed => "mixed",
            Self::Background => "background",
            Self::All => "all",
        }
    }

    /// Whether a pixel belongs to it, of which `share` is translucent.
    pub fn has(self, share: f32) -> bool {
        match self {
            Self::Translucent => share >= 1.0,
            Self::Mixed => share > 0.0 && share < 1.0,
            Self::Background => share <= 0.0,
            Self::All => true,
        }
    }
}

/// A model over one part of the picture.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Figures {
    /// Which part.
    pub part: Part,
    /// How many pixels.
    pub pixels: usize,
    /// Mean of the picture over that of the reference.
    pub brightness: Brightness,
    /// Errors; none where the reference is black.
    pub judgement: Option<Judgement>,
}

/// All models.
#[derive(Clone, Debug, Serialize)]
pub struct ModelComparison {
    /// Name of the scene.
    pub scene: String,
    /// What the models are held against.
    pub reference: String,
    /// relMSE of its noise over all pixels; none where it does not tell its noise.
    pub reference_noise: Option<Estimate>,
    /// In the order asked.
    pub models: Vec<Compared>,
    /// Where the colours of the relative difference end.
    pub range: f32,
    /// What must be known before the figures: they stand first.
    pub remarks: Vec<String>,
    /// Machine, command.
    pub footnotes: Vec<String>,
}

impl Compared {
    fn figures(&self, part: Part) -> Option<&Figures> {
        self.parts.iter().find(|f| f.part == part)
    }
}

impl Figures {
    /// The square of the relative bias without the worst 0.1 % of the pixels, or why there is no verdict.
    fn verdict(&self) -> Result<Bias, String> {
        let Some(judgement) = &self.judgement else { return Err("the reference is black there".into()) };
        match why_not(judgement, &judgement.trimmed) {
            Some(why) => Err(why),
            None => {
                judgement.trimmed.bias.ok_or_else(|| "too few samples of each pixel to tell noise (4 at least)".into())
            }
        }
    }
}

impl ModelComparison {
    /// What the headline is about: translucent pixels; mixed ones where no pixel is translucent alone; else all.
    fn judged_part(&self) -> Part {
        let has = |part: &&Part| self.models.iter().all(|m| m.figures(**part).is_some());
        Part::ORDER.iter().filter(|p| **p != Part::Background).find(has).copied().unwrap_or(Part::All)
    }

    /// What came out, in sentences.
    pub fn sentences(&self) -> Vec<String> {
        let part = self.judged_part();
        let mut out = vec![self.part_text(part)];
        let verdict = |m: &Compared| m.figures(part).map_or(Err("no pixels".into()), Figures::verdict);
        let mut told: Vec<(&Compared, Bias)> = self.models.iter().filter_map(|m| Some((m, verdict(m).ok()?))).collect();
        told.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        if let Some(&(best, bias)) = told.first() {
            let level = |b: &Bias| b.interval()[0] <= bias.interval()[1];
            let of_those = if told.len() < self.models.len() { " of those with a verdict" } else { "" };
            let (near, far): (Vec<_>, Vec<_>) = told.iter().partition(|(_, b)| level(b));
            match &near[..] {
                [_] if self.models.len() == 1 => out.push(format!("{}.", self.model_text(best, &bias, part))),
                [_] => out.push(format!("{} comes nearest to the reference{of_those}.", best.name)),
                _ => {
                    let names: Vec<&str> = near.iter().map(|(m, _)| m.name.as_str()).collect();
                    out.push(format!(
                        "No verdict between {}, which come nearest to the reference{of_those}: their intervals meet.",
                        listed(&names)
                    ));
                }
            }
            if self.models.len() > 1 {
                out.extend(near.iter().chain(&far).map(|(m, b)| format!("{}.", self.model_text(m, b, part))));
            }
        }
        for model in &self.models {
            if let Err(why) = verdict(model) {
                out.push(format!("{}: no verdict: {why}.", model.name));
            }
        }
        if self.reference_noise.is_none() {
            out.push(
                "The reference does not tell its noise, which is in every difference; a film file (-o NAME.film) does."
                    .into(),
            );
        }
        out
    }

    fn part_text(&self, part: Part) -> String {
        let pixels = |part| self.models.first().and_then(|m| m.figures(part)).map_or(0, |f| f.pixels);
        let [translucent, mixed, background] = [Part::Translucent, Part::Mixed, Part::Background].map(pixels);
        match part {
            Part::Translucent => {
                let judged = match translucent {
                    1 => "the one pixel that is a translucent object alone".into(),
                    n => format!("the {n} pixels that are translucent objects alone"),
                };
                format!(
                    "Judged by {judged}; apart from them {} at silhouettes and {background} of background.",
                    counted(mixed, "mixed pixel", "mixed pixels")
                )
            }
            Part::Mixed => {
                let pixels = counted(mixed, "pixel that is", "pixels that are");
                let background = counted(background, "is", "are");
                format!(
                    "Judged by the {pixels} in part translucent objects; none is that alone, and {background} background."
                )
            }
            _ => format!("Judged by all {} pixels: no translucent object is in view.", pixels(Part::All)),
        }
    }

    fn model_text(&self, model: &Compared, bias: &Bias, part: Part) -> String {
        let percent = |square: f64| 100.0 * square.max(0.0).sqrt();
        let [low, high] = bias.interval().map(percent);
        let wrong = if bias.is_seen() {
            format!(
                "wrong by {:.1} % (95 %: {low:.1} to {high:.1} %), root of the relMSE without noise",
                percent(bias.value)
            )
        } else {
            format!("pixel by pixel no difference is told from noise (below {high:.1} %)")
        };
        match model.figures(part).and_then(|f| brightness_text(&f.brightness)) {
            Some(brightness) => format!("{}: {wrong}; {brightness}", model.name),
            None => format!("{}: {wrong}", model.name),
        }
    }

    fn rows(&self) -> Vec<Vec<String>> {
        let mut rows = Vec::new();
        for m in &self.models {
            for f in &m.parts {
                let [r, g, b] = f.brightness.channels.map(|v| v.map_or("undefined".into(), |v| format!("{v:.4}")));
                let mean = f.brightness.mean.map_or("undefined".into(), |e| interval_cell(&e, 4));
                let bias = match f.verdict() {
                    Ok(b) if b.is_seen() => {
                        let [low, high] = b.interval();
                        format!("{:.2e} ({low:.1e} to {high:.1e})", b.value)
                    }
                    Ok(b) => b.at_most(),
                    Err(_) => "no verdict".into(),
                };
                let judged = f.judgement.map(|j| (j.trimmed, j.all));
                let figure = |v: Option<f64>| v.map_or("not told".into(), |v| format!("{v:.2e}"));
                rows.push(vec![
                    m.name.clone(),
                    f.part.name().into(),
                    f.pixels.to_string(),
                    mean,
                    format!("{r} {g} {b}"),
                    bias,
                    figure(judged.and_then(|(t, _)| t.noise)),
                    figure(judged.map(|(t, _)| t.measured)),
                    figure(judged.map(|(_, a)| a.measured)),
                    judged.map_or(String::new(), |(_, a)| format!("{:.1} %", 100.0 * a.worst_share)),
                    m.samples.to_string(),
                    format!("{:.1} s", m.seconds),
                ]);
            }
        }
        rows
    }

    /// The same numbers, a row for each model and part of the picture.
    pub fn to_csv(&self) -> String {
        let noise = self.reference_noise.map_or("not known".into(), |e| format!("relMSE {:.3e}", e.value));
        let mut out = format!("# {}; reference: {}; its noise: {noise}\n", self.scene, self.reference);
        out.push_str(
            "model,part,pixels,mean_ratio_r,mean_ratio_g,mean_ratio_b,mean_ratio,mean_ratio_low,mean_ratio_high,",
        );
        out.push_str("relmse,relmse_trimmed,bias,bias_half_width,noise,worst_share,samples,seconds\n");
        let some = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6e}"));
        for m in &self.models {
            for f in &m.parts {
                let channels = f.brightness.channels.map(|v| v.map_or(String::new(), |v| format!("{v:.6}")));
                let mean = f.brightness.mean;
                let end = |k: usize| some(mean.and_then(|m| m.interval).map(|ends| ends[k]));
                let (all, trimmed) = (f.judgement.map(|j| j.all), f.judgement.map(|j| j.trimmed));
                let bias = trimmed.and_then(|t| t.bias);
                let cells = [
                    m.name.clone(),
                    f.part.name().into(),
                    f.pixels.to_string(),
                    channels.join(","),
                    some(mean.map(|m| m.value)),
                    end(0),
                    end(1),
                    some(all.map(|a| a.measured)),
                    some(trimmed.map(|t| t.measured)),
                    some(bias.map(|b| b.value)),
                    some(bias.map(|b| b.half_width)),
                    some(trimmed.and_then(|t| t.noise)),
                    some(all.map(|a| a.worst_share)),
                    m.samples.to_string(),
                    format!("{:.4}", m.seconds),
                ];
                let _ = writeln!(out, "{}", cells.join(","));
            }
        }
        out
    }

    /// The page; `pictures` has the reference first, `differences` one for each model.
    pub fn page(&self, pictures: &[Picture], differences: &[Picture]) -> Page {
        let mut page = Page::new(&format!("Models against {}: {}", self.reference, self.scene));
        page.remarks(&self.remarks);
        page.lead(&self.sentences());
        page.heading("Pictures").pictures(pictures);
        page.heading("Where they differ");
        page.text(
            "Relative difference (x − r) / sqrt(r² + 0.01 mean(r)²), mean of the channels: red is brighter than the \
             reference, blue darker.",
        );
        page.strip(&colour_bar(self.range)).pictures(differences);
        page.heading("Numbers");
        let head = ["model", "pixels of", "number", "brightness", "of R, G, B", "bias", "noise"];
        let more = ["relMSE, trimmed", "relMSE", "worst pixel", "samples", "time"];
        page.table(&[&head[..], &more].concat(), &self.rows());
        page.text(
            "Pixels are told apart by what the camera sees first at 16 places of each: translucent objects alone, mixed at \
             silhouettes, background. Brightness is the mean of the picture over that of the reference, in brackets the 95 % \
             interval that noise makes. Bias is the mean product of what the two independent halves of a render are wrong by, \
             to which noise adds nothing; it, the noise and the trimmed relMSE are without the worst 0.1 % of the pixels.",
        );
        page.heading("How it was made");
        let noise = match self.reference_noise {
            Some(Estimate { value, interval: Some([low, high]) }) => {
                format!("its noise is relMSE {value:.1e} (95 %: {low:.1e} to {high:.1e})")
            }
            Some(e) => format!("its noise is relMSE {:.1e}", e.value),
            None => "it does not tell its noise".into(),
        };
        page.small(&[format!("Reference: {}; {noise}.", self.reference)]);
        page.small(&self.footnotes);
        page
    }
}

fn interval_cell(e: &Estimate, digits: usize) -> String {
    match e.interval {
        Some([low, high]) => format!("{:.digits$} ({low:.digits$} to {high:.digits$})", e.value),
        None => format!("{:.digits$} (interval unknown)", e.value),
    }
}

/// Brighter or darker, and by how much, over the channels that the reference has.
fn brightness_text(brightness: &Brightness) -> Option<String> {
    let mean = brightness.mean?;
    let percent = |ratio: f64| 100.0 * (ratio - 1.0);
    Some(match mean.interval.map(|ends| ends.map(percent)) {
        Some([low, high]) if low > 0.0 => {
            format!("{:.1} % brighter in the mean (95 %: {low:.1} to {high:.1} %)", percent(mean.value))
        }
        Some([low, high]) if high < 0.0 => {
            format!("{:.1} % darker in the mean (95 %: {:.1} to {:.1} %)", -percent(mean.value), -high, -low)
        }
        Some([low, high]) => format!("as bright in the mean, to {low:+.1} .. {high:+.1} % (95 %)"),
        None => format!("{:+.1} % in the mean (interval unknown)", percent(mean.value)),
    })
}

#[cfg(test)]
mod tests {
    use super::super::curve::tests::judged;
    use super::*;

    fn model(name: &str, parts: &[(Part, f64, f64)]) -> Compared {
        let figures = |&(part, bias, mean): &(Part, f64, f64)| {
            let judged = judged(Some(1e-3), bias, 0.3);
            Figures {
                part,
                pixels: 100,
                brightness: Brightness {
                    channels: [Some(mean); 3],
                    mean: Some(Estimate { value: mean, interval: Some([mean - 0.01, mean + 0.01]) }),
                },
                judgement: Some(Judgement { all: judged, trimmed: judged }),
            }
        };
        Compared { name: name.into(), seconds: 1.0, samples: 16, parts: parts.iter().map(figures).collect() }
    }

    fn comparison(models: Vec<Compared>) -> ModelComparison {
        ModelComparison {
            scene: "s".into(),
            reference: "r".into(),
            reference_noise: Some(Estimate { value: 1e-6, interval: None }),
            models,
            range: 0.2,
            remarks: vec!["a lamp is not met yet".into()],
            footnotes: Vec::new(),
        }
    }

    /// 45 % darker on the object, 9 % over the picture: the object counts.
    #[test]
    fn background_does_not_dilute_the_headline() {
        let parts = |bias, mean: f64| {
            [(Part::Translucent, bias, mean), (Part::Background, 0.0, 1.0), (Part::All, bias / 25.0, 0.8 + 0.2 * mean)]
        };
        let c = comparison(vec![model("wrong", &parts(0.2, 0.55)), model("right", &parts(0.0, 1.0))]);
        let said = c.sentences().join("\n");
        assert!(
            said.starts_with("Judged by the 100 pixels that are translucent objects alone; apart from them 0 mixed"),
            "{said}"
        );
        assert!(said.contains("right comes nearest to the reference."), "{said}");
        assert!(
            said.contains(
                "right: pixel by pixel no difference is told from noise (below 1.9 %); as bright in the mean, to -1.0 .. +1.0 %"
            ),
            "{said}"
        );
        assert!(
            said.contains("wrong: wrong by 44.7 % (95 %: 44.7 to 44.8 %)")
                || said.contains("wrong: wrong by 44.7 % (95 %"),
            "{said}"
        );
        assert!(
            said.contains("45.0 % darker in the mean (95 %: 44.0 to 46.0 %)") && !said.contains(" 9.0 %"),
            "{said}"
        );
        let csv = c.to_csv();
        assert_eq!(csv.lines().count(), 2 + 2 * 3, "{csv}");
        assert!(csv.lines().any(|l| l.starts_with("wrong,background,100,")), "{csv}");
    }

    #[test]
    fn models_that_are_not_told_apart_are_not_ranked() {
        let parts = |bias: f64| [(Part::Translucent, bias, 1.1)];
        let c = comparison(vec![model("a", &parts(0.01)), model("b", &parts(0.0102)), model("c", &parts(0.1))]);
        let said = c.sentences().join("\n");
        assert!(
            said.contains("No verdict between a and b, which come nearest") && said.contains("c: wrong by 31.6 %"),
            "{said}"
        );
    }

    #[test]
    fn a_view_without_translucent_pixels_is_judged_whole_and_says_so() {
        let c = comparison(vec![model("a", &[(Part::Background, 0.0, 1.0), (Part::All, 0.0, 1.0)])]);
        assert!(c.sentences()[0].contains("no translucent object is in view"));
        let thin = comparison(vec![model("a", &[(Part::Mixed, 0.1, 1.2), (Part::All, 0.0, 1.0)])]);
        let said = thin.sentences().join("\n");
        assert!(said.contains("in part translucent") && said.contains("20.0 % brighter"), "{said}");
    }

    #[test]
    fn a_reference_without_noise_is_said_and_remarks_come_first() {
        let mut c = comparison(vec![model("a", &[(Part::All, 0.1, 1.2)])]);
        c.reference_noise = None;
        assert!(c.sentences().join(" ").contains("does not tell its noise"));
        let page = c.page(&[], &[]).to_html();
        assert!(
            page.find("a lamp is not met yet") < page.find("class=\"lead\"") && page.contains("a lamp is not met yet")
        );
    }
}
