//! Models against a reference, on one page.

use super::false_colour::colour_bar;
use super::page::{Page, Picture};
use crate::film::metrics::Estimate;
use std::fmt::Write as _;

/// One model against the reference.
#[derive(Clone, Debug)]
pub struct Compared {
    /// As asked.
    pub name: String,
    /// Time of rendering [s].
    pub seconds: f64,
    /// Samples of each pixel.
    pub samples: u32,
    /// Mean of the picture over that of the reference, per channel; none where the reference is black.
    pub mean_ratio: [Option<Estimate>; 3],
    /// relMSE against the reference as it is.
    pub measured: f64,
    /// The square of its bias, from independent halves of picture and reference: see
    /// [`crate::film::metrics::squared_bias`]; with a reference without halves its noise is still in.
    pub squared_bias: Option<f64>,
    /// The picture's own noise, told by its halves.
    pub noise: f64,
    /// Half of the 95 % interval of log(noise).
    pub width: Option<f64>,
}

/// All models.
#[derive(Clone, Debug)]
pub struct ModelComparison {
    /// Name of the scene.
    pub scene: String,
    /// What the models are held against.
    pub reference: String,
    /// relMSE of its noise.
    pub reference_noise: f64,
    /// Whether its halves are known, so that its noise is not in `squared_bias`.
    pub reference_halves: bool,
    /// In the order asked.
    pub models: Vec<Compared>,
    /// Where the colours of the relative difference end.
    pub range: f32,
    /// Machine, command.
    pub footnotes: Vec<String>,
}

impl ModelComparison {
    /// relMSE without the noise of picture and reference, and half of its 95 % interval: the square of the bias.
    pub fn bias(&self, model: &Compared) -> (f64, f64) {
        let value = match model.squared_bias {
            Some(value) if self.reference_halves => value,
            Some(value) => value - self.reference_noise,
            None => model.measured - model.noise - self.reference_noise,
        };
        let width = model.width.unwrap_or(1.0).max(0.3); // as in `Convergence::floor`
        let cross = value.max(0.0) * (model.noise + self.reference_noise);
        let parts = [width * model.noise, 0.3 * self.reference_noise, 0.3 * cross.sqrt()];
        (value, parts.iter().map(|p| p * p).sum::<f64>().sqrt())
    }

    fn bias_text(&self, model: &Compared) -> String {
        let (value, half) = self.bias(model);
        if value > half { format!("{value:.2e} ± {half:.0e}") } else { format!("below {half:.0e}") }
    }

    /// What came out, in sentences.
    pub fn sentences(&self) -> Vec<String> {
        let mut order: Vec<&Compared> = self.models.iter().collect();
        order.sort_by(|a, b| self.bias(a).0.total_cmp(&self.bias(b).0));
        let mut out = Vec::new();
        if let Some(best) = order.first() {
            let rms = self.bias(best).0.max(0.0).sqrt() * 100.0;
            let (value, half) = self.bias(best);
            out.push(if value > half {
                format!(
                    "{} comes nearest to the reference: wrong by {rms:.1} % (root of the relMSE without noise), {}.",
                    best.name,
                    brightness(best)
                )
            } else {
                format!(
                    "{} comes nearest to the reference: no difference is told from noise (relMSE below {half:.0e}).",
                    best.name
                )
            });
        }
        for model in order.iter().skip(1) {
            let rms = self.bias(model).0.max(0.0).sqrt() * 100.0;
            out.push(format!("{}: wrong by {rms:.1} %, {}.", model.name, brightness(model)));
        }
        out
    }

    fn rows(&self) -> Vec<Vec<String>> {
        let ratio = |e: Option<Estimate>| e.map_or("undefined".into(), |e| format!("{:.4}", e.value));
        self.models
            .iter()
            .map(|m| {
                let [r, g, b] = m.mean_ratio.map(ratio);
                vec![
                    m.name.clone(),
                    r,
                    g,
                    b,
                    format!("{:.2e}", m.measured),
                    self.bias_text(m),
                    format!("{:.2e}", m.noise),
                    m.samples.to_string(),
                    format!("{:.1} s", m.seconds),
                ]
            })
            .collect()
    }

    /// The same numbers.
    pub fn to_csv(&self) -> String {
        let mut out = format!(
            "# {}; reference: {}; its noise: relMSE {:.3e}\n\
             model,mean_ratio_r,mean_ratio_g,mean_ratio_b,relmse,bias,bias_half_width,noise,samples,seconds\n",
            self.scene, self.reference, self.reference_noise
        );
        for m in &self.models {
            let ratio = |c: usize| m.mean_ratio[c].map_or(String::new(), |e| format!("{:.6}", e.value));
            let (bias, half) = self.bias(m);
            let _ = writeln!(
                out,
                "{},{},{},{},{:.6e},{bias:.6e},{half:.3e},{:.6e},{},{:.4}",
                m.name,
                ratio(0),
                ratio(1),
                ratio(2),
                m.measured,
                m.noise,
                m.samples,
                m.seconds
            );
        }
        out
    }

    /// The page; `pictures` has the reference first, `differences` one for each model.
    pub fn page(&self, pictures: &[Picture], differences: &[Picture]) -> Page {
        let mut page = Page::new(&format!("Models against {}: {}", self.reference, self.scene));
        page.lead(&self.sentences());
        page.heading("Pictures").pictures(pictures);
        page.heading("Where they differ");
        page.text(
            "Relative difference (x − r) / sqrt(r² + 0.01 mean(r)²), mean of the channels: red is brighter than the \
             reference, blue darker.",
        );
        page.strip(&colour_bar(self.range)).pictures(differences);
        page.heading("Numbers");
        page.table(
            &["model", "mean R", "mean G", "mean B", "relMSE", "of it bias", "of it noise", "samples", "time"],
            &self.rows(),
        );
        page.text(
            "Mean: of the picture over that of the reference. Noise is told by the two independent halves of each render; \
             the bias is the mean product of what the two halves are wrong by, to which noise adds nothing.",
        );
        page.heading("How it was made");
        page.small(&[format!("Reference: {}; its noise is relMSE {:.1e}.", self.reference, self.reference_noise)]);
        page.small(&self.footnotes);
        page
    }
}

/// Brighter or darker, and by how much, over the channels that the reference has.
fn brightness(model: &Compared) -> String {
    let known: Vec<f64> = model.mean_ratio.iter().flatten().map(|e| e.value).collect();
    let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let side = if mean > 1.0 { "brighter" } else { "darker" };
    format!("{:.1} % {side} in the mean", 100.0 * (mean - 1.0).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bias_is_what_noise_does_not_explain() {
        let ratio = |value| [Some(Estimate { value, interval: None }); 3];
        let model = |name: &str, measured, mean| Compared {
            name: name.into(),
            seconds: 1.0,
            samples: 16,
            mean_ratio: ratio(mean),
            measured,
            squared_bias: None,
            noise: 1e-3,
            width: Some(0.1),
        };
        let c = ModelComparison {
            scene: "s".into(),
            reference: "r".into(),
            reference_noise: 1e-4,
            reference_halves: false,
            models: vec![model("wrong", 1.01e-1, 1.2), model("right", 1.1e-3, 1.0)],
            range: 0.2,
            footnotes: Vec::new(),
        };
        assert!((c.bias(&c.models[0]).0 - 0.0999).abs() < 1e-9);
        let said = c.sentences().join(" ");
        assert!(
            said.starts_with("right comes nearest") && said.contains("wrong: wrong by 31.6 %, 20.0 % brighter"),
            "{said}"
        );
        assert!(c.to_csv().lines().count() == 4);
    }
}
