//! Which model to trust on a whole body, and why: errors expected over its surface, in numbers. Words are the program's.

use super::View;
use super::local::{Candidate, Local, LocalShape};
use crate::bssrdf::{Conditions, ExpectedError, ModelName, ModelOption, Unmeasured, expected_error};
use crate::geometry::Mesh;
use crate::optics::FresnelMoments;
use crate::scene::{ObstacleKind, Translucent};
use rayon::prelude::*;
use serde::Serialize;

/// Points on the surface.
const POINTS: u32 = 256;

/// Wrong by more than this counts as not to be trusted: what `beam`, the best model of a plane, is wrong by on one in the
/// media of the first two rows of the chart in docs/models.md, and no more.
pub const TOLERANCE: f64 = 0.1;

/// A model on a body. Figures are means over the part of the area where the model has been measured, if that is most of it.
#[derive(Clone, Debug, Serialize)]
pub struct ModelOnBody {
    /// Its name, as in scene files.
    pub model: &'static str,
    /// `directional` scaled to the true albedo.
    pub calibrated: bool,
    /// Of a slab [unit].
    pub thickness: Option<f32>,
    /// Whether it is the material's own.
    pub chosen: bool,
    /// Share of the area where it has been measured.
    pub measured: f64,
    /// Why not elsewhere.
    pub unmeasured: Option<Unmeasured>,
    /// Expected error of the total; above 0 it is too bright.
    pub total: Option<f64>,
    /// Expected error of the distribution.
    pub distribution: Option<f64>,
    /// Of the light that leaves far from its entry, signed: what counts where a body is lit from behind.
    pub far: Option<f64>,
    /// Share of the area where the error of the distribution is beyond the tolerance.
    pub beyond: Option<f64>,
}

/// What follows for a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The best model is within the tolerance all over the body.
    Trust,
    /// On most of it, where it is thick.
    WhereThick,
    /// The body is too thin for any model.
    TooThin,
    /// No model is within the tolerance, whatever the thickness.
    Nowhere,
    /// Triangles that do not share their corners, which lie close together: no model has an inside before they are welded.
    Unwelded,
    /// A sheet without thickness, or one whose holes are most of it: no model has an inside to work on.
    Open,
    /// Its faces look inwards: nothing can be said before they are turned.
    InsideOut,
    /// No model has been measured there.
    NotMeasured,
}

/// A body and the models on it.
#[derive(Clone, Debug, Serialize)]
pub struct Trustworthiness {
    /// The object's name.
    pub object: String,
    /// Its number in the scene.
    pub index: u32,
    /// The material's name.
    pub material: String,
    /// Smallest and largest reduced albedo of the channels.
    pub alpha_prime: [f64; 2],
    /// n_inside / n_outside.
    pub eta: f64,
    /// Mean cosine of the phase function.
    pub g: f64,
    /// Share of the area without another side: the inward normal meets nothing of the body.
    pub open: f64,
    /// Thickness that 5, 50 and 95 % of the area with another side stay below [transport mean free paths of the channel in
    /// which light goes farthest]; none on an open sheet.
    pub thickness: [Option<f64>; 3],
    /// Likewise mean curvature [1 / transport mean free path].
    pub curvature: [Option<f64>; 3],
    /// What counts as wrong.
    pub tolerance: f64,
    /// What follows.
    pub verdict: Verdict,
    /// Models, the best first, those without figures last.
    pub models: Vec<ModelOnBody>,
    /// Thickness of a flat sheet from which one of the models is within the tolerance [transport mean free paths]; none where
    /// it never is.
    pub trusted_from: Option<f64>,
    /// Without exit normalisation the material's own model is darker than its figures by this share.
    pub darker: Option<f64>,
    /// Why `volume_path` cannot trace it; none where it can.
    pub untraceable: Option<String>,
}

/// Half of the area: on less than that a figure stands for nothing.
const MOSTLY: f64 = 0.5;

/// Candidates beside the material's own model, and a slab where the body is one.
const CANDIDATES: [Candidate; 4] = [
    Candidate { model: ModelName::BEAM, calibrated: false, thickness: None },
    Candidate { model: ModelName::BETTER, calibrated: false, thickness: None },
    Candidate { model: ModelName::STANDARD, calibrated: false, thickness: None },
    Candidate { model: ModelName::DIRECTIONAL, calibrated: true, thickness: None },
];

impl Trustworthiness {
    /// Of the object of `shape`, where wrong is what is wrong by more than `tolerance`; `None` without area.
    pub fn new(view: View<'_>, shape: &LocalShape, tolerance: f64) -> Option<Self> {
        let object = &view.scene.objects[shape.object as usize];
        let Some(material) = &view.scene.surface(shape.object).inside else { return None };
        let mut places = spread(&object.mesh, POINTS);
        if let Some(union) = view.scene.union(shape.object) {
            places.retain(|&(triangle, u, v)| union.bears(triangle, object.mesh.point(triangle, u, v).x));
        }
        if places.is_empty() {
            return None;
        }
        let locals: Vec<Local> = places
            .par_iter()
            .map(|&(triangle, u, v)| {
                let at = object.mesh.point(triangle, u, v);
                let thickness = shape.thickness(view, &at);
                let curvature = if thickness.is_nan() { 0.0 } else { shape.curvature(view, &at, thickness) };
                Local { thickness, curvature }
            })
            .collect();
        let closed: Vec<Local> = locals.iter().copied().filter(|l| !l.thickness.is_nan()).collect();
        let open = 1.0 - closed.len() as f64 / locals.len() as f64;
        let own = shape.own();
        // A sheet is a slab by what it was made as, whatever its facets are.
        let slab = object.sheet.map(|thickness| slab(thickness as f32)).or_else(|| as_slab(&closed, locals.len()));
        let mut candidates: Vec<Candidate> = CANDIDATES.into_iter().chain(slab).collect();
        candidates.retain(|c| !c.is_kind_of(own) && exists(material, *c));
        candidates.push(own);
        let mut models: Vec<(Candidate, ModelOnBody)> = candidates
            .into_par_iter()
            .map(|candidate| (candidate, on_body(shape, candidate, candidate == own, &locals, tolerance)))
            .collect();
        let order = |m: &ModelOnBody| m.distribution.unwrap_or(f64::INFINITY);
        models.sort_by(|a, b| order(&a.1).total_cmp(&order(&b.1)));
        let path = shape.longest_path();
        let from = |(candidate, _): &(Candidate, ModelOnBody)| trusted_from(shape, *candidate, tolerance, path);
        let trusted_from = models.iter().filter_map(from).reduce(f64::min);
        let albedos =
            || shape.optics().iter().filter(|k| k.transport_mean_free_path.is_finite()).map(|k| k.alpha_prime);
        let moments = FresnelMoments::new(shape.eta());
        let normalised = own.model.normalises_exit(material.exit_normalisation);
        let verdict = match models[0].1.beyond {
            _ if object.findings.inside_out() => Verdict::InsideOut,
            _ if view.scene.has(object, ObstacleKind::Unwelded) => Verdict::Unwelded,
            _ if open > MOSTLY || view.scene.has(object, ObstacleKind::Sheet) => Verdict::Open,
            None => Verdict::NotMeasured,
            Some(beyond) if beyond < 0.005 => Verdict::Trust,
            Some(beyond) if beyond < MOSTLY => Verdict::WhereThick,
            _ if trusted_from.is_some() => Verdict::TooThin,
            _ => Verdict::Nowhere,
        };
        let quantiles = |of: fn(&Local) -> f32, scale: f64| {
            let mut values: Vec<f64> = closed.iter().map(|l| f64::from(of(l)) * scale).collect();
            values.sort_by(f64::total_cmp);
            [0.05, 0.5, 0.95].map(|q| values.get((q * values.len().saturating_sub(1) as f64) as usize).copied())
        };
        Some(Self {
            object: object.name.clone(),
            index: shape.object,
            material: view.scene.materials[object.material].name.clone(),
            alpha_prime: [albedos().fold(1.0, f64::min), albedos().fold(0.0, f64::max)],
            eta: shape.eta(),
            g: shape.g(),
            open,
            thickness: quantiles(|l| l.thickness, 1.0 / path),
            curvature: quantiles(|l| l.curvature, path),
            tolerance,
            verdict,
            trusted_from,
            darker: (!normalised).then_some(1.0 - moments.four_c_phi_outside),
            untraceable: view.scene.untraceable(shape.object),
            models: models.into_iter().map(|(_, model)| model).collect(),
        })
    }

    /// The material's own model.
    pub fn own(&self) -> Option<&ModelOnBody> {
        self.models.iter().find(|m| m.chosen)
    }
}

/// `count` places on a mesh, evenly by area in the order of its triangles: the same in each run.
fn spread(mesh: &Mesh, count: u32) -> Vec<(u32, f64, f64)> {
    let triangles = || 0..mesh.triangles.len() as u32;
    let step = triangles().map(|t| mesh.area(t)).sum::<f64>() / f64::from(count);
    let (mut places, mut sum) = (Vec::new(), 0.0);
    for t in triangles() {
        sum += mesh.area(t);
        while step > 0.0 && places.len() < count as usize && sum > (places.len() as f64 + 0.5) * step {
            // A two-dimensional golden ratio, folded into the triangle.
            let k = places.len() as f64;
            let [u, v] = [0.754_877_666, 0.569_840_291].map(|ratio: f64| (k * ratio).fract());
            places.push(if u + v > 1.0 { (t, 1.0 - u, 1.0 - v) } else { (t, u, v) });
        }
    }
    places
}

/// A slab, where nearly all of the body is one: of one thickness, its faces flat beside it.
fn as_slab(closed: &[Local], all: usize) -> Option<Candidate> {
    const NEARLY_ALL: f64 = 0.9;
    let mut sorted: Vec<f32> = closed.iter().map(|l| l.thickness).collect();
    sorted.sort_by(f32::total_cmp);
    let middle = *sorted.get(sorted.len() / 2)?;
    let flat = |l: &&Local| (l.thickness - middle).abs() < 0.05 * middle && l.curvature.abs() * middle < 0.2;
    let share = closed.iter().filter(flat).count() as f64 / all as f64;
    (share > NEARLY_ALL).then_some(slab(middle))
}

fn slab(thickness: f32) -> Candidate {
    Candidate { model: ModelName::SLAB, calibrated: false, thickness: Some(thickness) }
}

/// Whether the program makes this model of the material.
fn exists(material: &Translucent, candidate: Candidate) -> bool {
    let Candidate { model, calibrated, thickness } = candidate;
    Translucent { model, calibrated, thickness, ..material.clone() }.build().is_ok()
}

fn on_body(shape: &LocalShape, candidate: Candidate, chosen: bool, locals: &[Local], tolerance: f64) -> ModelOnBody {
    let (mut errors, mut unmeasured): (Vec<ExpectedError>, Option<Unmeasured>) = (Vec::new(), None);
    for local in locals {
        match shape.expected(candidate, *local) {
            Ok((error, _)) => errors.push(error),
            // What bars all places, such as the medium, before what bars some.
            Err(why) => {
                let of_place = matches!(why, Unmeasured::Open | Unmeasured::Thin);
                unmeasured = unmeasured.filter(|_| of_place).or(Some(why));
            }
        }
    }
    let measured = errors.len() as f64 / locals.len() as f64;
    if measured < MOSTLY {
        errors.clear();
    }
    ModelOnBody {
        model: candidate.model.name(),
        calibrated: candidate.calibrated,
        thickness: candidate.thickness,
        chosen,
        measured,
        unmeasured,
        total: mean(errors.iter().map(|e| e.total)),
        distribution: mean(errors.iter().map(|e| e.distribution)),
        far: mean(errors.iter().filter_map(|e| e.far)),
        beyond: mean(errors.iter().map(|e| f64::from(u8::from(e.distribution > tolerance)))),
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Thickness [transport mean free paths of `path`] above which a flat sheet is within the tolerance of a model that knows no
/// thickness.
fn trusted_from(shape: &LocalShape, candidate: Candidate, tolerance: f64, path: f64) -> Option<f64> {
    if candidate.model.takes(ModelOption::Thickness) {
        return None;
    }
    let wrong = |paths: f64| {
        let some = shape.optics().iter().filter(|k| k.transport_mean_free_path.is_finite());
        some.map(|k| {
            let place = Conditions::new(k, shape.eta(), paths * path, 0.0);
            expected_error(candidate.model, &candidate.options(), &place).map_or(f64::INFINITY, |e| e.distribution)
        })
        .fold(0.0, f64::max)
            > tolerance
    };
    // From 1000 down in steps of 2 %: the error has one flank.
    let steps = || (0..350).map(|i| 1000.0 * 0.98f64.powi(i));
    if wrong(f64::INFINITY) { None } else { Some(steps().find(|&h| wrong(h)).unwrap_or(0.0)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{rectangle, sphere};
    use crate::math::DVec3;

    #[test]
    fn places_follow_the_area() {
        // Two triangles, one nine times the other, and one without area between them.
        let (mut mesh, big) = (Mesh::default(), 3.0);
        for (x, size) in [(0.0, 1.0), (5.0, 0.0), (10.0, big)] {
            let at = mesh.positions.len() as u32;
            let corner = DVec3::new(x, 0.0, 0.0);
            mesh.positions.extend([corner, corner + DVec3::X * size, corner + DVec3::Y * size]);
            mesh.triangles.push([at, at + 1, at + 2]);
        }
        let places = spread(&mesh, 1000);
        let in_triangle = |t: u32| places.iter().filter(|p| p.0 == t).count();
        assert_eq!([in_triangle(0), in_triangle(1), in_triangle(2)], [100, 0, 900]);
        assert!(places.iter().all(|p| p.1 >= 0.0 && p.2 >= 0.0 && p.1 + p.2 <= 1.0));
        assert!(spread(&Mesh::default(), 10).is_empty());
        // The middle of gravity of a sheet and of a ball.
        for made in [rectangle(DVec3::ZERO, DVec3::X, DVec3::Y), sphere(DVec3::ZERO, 1.0, 24, 48)] {
            let mesh = made.recentred(DVec3::ZERO);
            let places = spread(&mesh, POINTS);
            let middle = places.iter().map(|&(t, u, v)| mesh.point(t, u, v).x).sum::<DVec3>();
            assert!(middle.length() < 0.05 * places.len() as f64, "{middle}");
        }
    }
}
