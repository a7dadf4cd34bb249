//! Which model to trust on a whole body, and why: errors expected over its surface, in numbers and in a sentence.

use super::View;
use super::local::LocalShape;
use crate::bssrdf::{ExpectedError, ModelName, Place, expected_error};
use crate::geometry::AreaTable;
use serde::Serialize;

/// Points on the surface.
const POINTS: u32 = 2048;

/// Wrong by more than this counts as not to be trusted: what `beam`, the best model of a plane, is wrong by on one in the
/// media of the first two rows of the chart in docs/models.md, and no more.
pub const TOLERANCE: f64 = 0.1;

/// A model on a body.
#[derive(Clone, Debug, Serialize)]
pub struct ModelOnBody {
    /// Its name.
    pub model: String,
    /// Whether it is the material's own.
    pub chosen: bool,
    /// Expected error of the total, mean over the area; above 0 it is too bright.
    pub total: f64,
    /// Expected error of the distribution, mean over the area.
    pub distribution: f64,
    /// Of the light that leaves far from its entry, signed, mean over the area: what counts where a body is lit from behind.
    pub far: Option<f64>,
    /// Share of the area where the error of the distribution is beyond the tolerance.
    pub beyond: f64,
}

/// A body and the models on it.
#[derive(Clone, Debug, Serialize)]
pub struct Trustworthiness {
    /// The object's name.
    pub object: String,
    /// The material's name.
    pub material: String,
    /// Smallest and largest reduced albedo of the channels.
    pub alpha_prime: [f64; 2],
    /// Thickness that 5, 50 and 95 % of the area stay below [transport mean free paths of the channel in which light goes
    /// farthest]; none where there is no other side.
    pub thickness: [Option<f64>; 3],
    /// Likewise mean curvature [1 / transport mean free path].
    pub curvature: [f64; 3],
    /// What counts as wrong.
    pub tolerance: f64,
    /// Models, the best first.
    pub models: Vec<ModelOnBody>,
    /// Thickness of a flat sheet from which the best model is within the tolerance [transport mean free paths]; none where it
    /// never is.
    pub trusted_from: Option<f64>,
}

/// Wrong on more than this share of the area, and no model is to be trusted.
const MOSTLY: f64 = 0.5;

/// Candidates beside the material's own model.
const CANDIDATES: [(ModelName, bool); 4] = [
    (ModelName::Beam, false),
    (ModelName::Better, false),
    (ModelName::Standard, false),
    (ModelName::Directional, true),
];

impl Trustworthiness {
    /// Of the object of `shape`, where wrong is what is wrong by more than `tolerance`; `None` without area.
    pub fn new(view: View<'_>, shape: &LocalShape, tolerance: f64) -> Option<Self> {
        let object = &view.scene.objects[shape.object as usize];
        let table = AreaTable::new(&object.mesh)?;
        let points: Vec<_> = (0..POINTS)
            .map(|i| {
                // Points of a two-dimensional golden ratio: even, and the same in each run.
                let [u, v] = [0.754_877_666, 0.569_840_291].map(|k: f64| (f64::from(i) * k).fract() as f32);
                let at = table.sample((f64::from(i) + 0.5) / f64::from(POINTS), [u, v]);
                shape.at(view, at.triangle, at.u, at.v)
            })
            .collect();
        let path =
            shape.optics().iter().map(|k| k.transport_mean_free_path).filter(|l| l.is_finite()).fold(0.0, f64::max);
        let own = shape.model();
        let mut models: Vec<ModelOnBody> = CANDIDATES
            .into_iter()
            .filter(|m| *m != own)
            .chain([own])
            .map(|model| {
                let errors: Vec<ExpectedError> =
                    points.iter().filter_map(|p| shape.expected(model.0, model.1, *p)).map(|(e, _)| e).collect();
                let n = errors.len().max(1) as f64;
                ModelOnBody {
                    model: name(model),
                    chosen: model == own,
                    total: errors.iter().map(|e| e.total).sum::<f64>() / n,
                    distribution: errors.iter().map(|e| e.distribution).sum::<f64>() / n,
                    far: mean(errors.iter().filter_map(|e| e.far)),
                    beyond: errors.iter().filter(|e| e.distribution > tolerance).count() as f64 / n,
                }
            })
            .collect();
        models.sort_by(|a, b| a.distribution.total_cmp(&b.distribution));
        let best = CANDIDATES.into_iter().chain([own]).find(|m| name(*m) == models[0].model).unwrap_or(own);
        let quantiles = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            [0.05, 0.5, 0.95].map(|q| values[(q * (values.len() - 1) as f64) as usize])
        };
        let some = || shape.optics().iter().filter(|k| k.transport_mean_free_path.is_finite());
        let albedos = some().map(|k| k.alpha_prime);
        Some(Self {
            object: object.name.clone(),
            material: view.scene.materials[object.material].name.clone(),
            alpha_prime: [albedos.clone().fold(1.0, f64::min), albedos.fold(0.0, f64::max)],
            thickness: quantiles(points.iter().map(|p| f64::from(p.thickness) / path).collect())
                .map(|t| Some(t).filter(|t| t.is_finite())),
            curvature: quantiles(points.iter().map(|p| f64::from(p.curvature) * path).collect()),
            tolerance,
            trusted_from: trusted_from(shape, best, tolerance, path),
            models,
        })
    }

    /// What to trust, and why.
    pub fn sentence(&self) -> String {
        let percent = |v: f64| format!("{:.0} %", 100.0 * v);
        let [low, high] = self.alpha_prime;
        let albedo = if high - low < 5e-4 { format!("{high:.3}") } else { format!("{low:.3} to {high:.3}") };
        let paths = |t: Option<f64>| t.map_or("endlessly many".into(), |t| format!("{t:.1}"));
        let [thin, middle, thick] = self.thickness.map(paths);
        let listed: Vec<String> = self
            .models
            .iter()
            .map(|m| format!("`{}` {}{}", m.model, percent(m.distribution), if m.chosen { " (chosen)" } else { "" }))
            .collect();
        let best = &self.models[0];
        let behind = best.far.map_or(String::new(), |far| {
            let side = if far > 0.0 { "bright" } else { "dark" };
            format!(" (light that comes through from behind: `{}` {} too {side})", best.model, percent(far.abs()))
        });
        let wrong = |what: &str| {
            let share = if best.beyond > 0.995 {
                "everywhere".into()
            } else {
                format!("on {} of the area", percent(best.beyond))
            };
            format!("{what} errs by more than {} {share}", percent(self.tolerance))
        };
        let verdict = match self.trusted_from {
            _ if best.beyond < 0.005 => format!("trust `{}`", best.model),
            Some(from) if best.beyond < MOSTLY => format!(
                "trust `{}` where the body is thick; {} (sheets thinner than {from:.0} transport mean free paths, and what bends \
                 as sharply): there take --method volume_path",
                best.model,
                wrong("it")
            ),
            Some(_) => format!(
                "trust none, the body is too thin: even {}; take --method volume_path",
                wrong(&format!("`{}`", best.model))
            ),
            None => format!(
                "trust none, whatever the thickness: even {}; take --method volume_path",
                wrong(&format!("`{}`", best.model))
            ),
        };
        format!(
            "{} ({}): reduced albedo {albedo}, {thin} to {thick} transport mean free paths thick (median {middle}). \
             Expected error of how the light of a point spreads, mean over the area (smooth light evens some of it out): {}{behind}. So {verdict}",
            self.object,
            self.material,
            listed.join(", ")
        )
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

fn name((model, calibrated): (ModelName, bool)) -> String {
    if calibrated { format!("{} (calibrated)", model.name()) } else { model.name().into() }
}

/// Thickness [transport mean free paths of `path`] above which a flat sheet is within the tolerance.
fn trusted_from(shape: &LocalShape, model: (ModelName, bool), tolerance: f64, path: f64) -> Option<f64> {
    let wrong = |paths: f64| {
        let some = shape.optics().iter().filter(|k| k.transport_mean_free_path.is_finite());
        some.map(|k| expected_error(model.0, model.1, &Place::new(k, shape.eta(), paths * path, 0.0)).distribution)
            .fold(0.0, f64::max)
            > tolerance
    };
    // From 1000 down in steps of 2 %: the error has one flank.
    let steps = || (0..350).map(|i| 1000.0 * 0.98f64.powi(i));
    if wrong(f64::INFINITY) { None } else { Some(steps().find(|&h| wrong(h)).unwrap_or(0.0)) }
}
