//! What a method built for a scene, and what it left out.

use crate::cache::{CachedSample, PLAIN_SUM, Plan};
use crate::scene::{Estimator, Scene};
use crate::words::{counted, short};

/// A part of a method that a scene may or may not need.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Part {
    /// What it is.
    pub name: String,
    /// Whether it is there.
    pub built: bool,
    /// Why, or how large.
    pub why: String,
}

impl Part {
    /// A part that is there.
    pub fn built(name: impl Into<String>, why: impl Into<String>) -> Self {
        Self { name: name.into(), built: true, why: why.into() }
    }

    /// Rays in f64, which take the place of the backend where f32 cannot hold a scene.
    pub fn double_precision(scene: &Scene) -> Self {
        let name = "rays in double precision";
        match &scene.why_double {
            Some(why) => Self::built(name, format!("in place of the backend: {why}")),
            None => Self::left_out(name, "single precision holds the scene"),
        }
    }

    /// That `method`, one of surfaces alone, has no cache, and what it shows of bodies.
    pub(super) fn no_cache(scene: &Scene, method: &str) -> Self {
        let translucent = scene.objects.iter().any(|o| scene.materials[o.material].surface.is_translucent());
        let why = match translucent {
            true => format!("`{method}` shows translucent surfaces as Lambertian ones of the same reflectance"),
            false => "no translucent material".into(),
        };
        Self::left_out("area tables and sample cache", why)
    }

    /// A part that is left out.
    pub fn left_out(name: impl Into<String>, why: impl Into<String>) -> Self {
        Self { name: name.into(), built: false, why: why.into() }
    }
}

/// Of the cache of the object called `name`.
pub(super) fn of_cache(plan: &Plan, name: &str, estimator: Estimator) -> Vec<Part> {
    let megabytes = plan.samples as usize as f64 * size_of::<CachedSample>() as f64 / 1e6;
    let samples = counted(plan.samples, "sample", "samples");
    let triangles = counted(plan.body.table().len(), "triangle", "triangles");
    let cache = format!("{samples} a pass ({megabytes:.1} MB), {triangles}");
    let colour = format!("colour of `{name}`");
    vec![
        Part::built(format!("sample cache of `{name}`"), cache),
        tree(plan, name, estimator),
        near_field(plan, name, estimator),
        if plan.medium().is_grey() {
            Part::left_out(colour, "a grey medium: S_d is evaluated in one channel")
        } else {
            Part::built(colour, "S_d is evaluated in three channels")
        },
    ]
}

fn tree(plan: &Plan, name: &str, estimator: Estimator) -> Part {
    let part = format!("sample tree of `{name}`");
    match estimator {
        Estimator::Cut if plan.samples as usize > PLAIN_SUM => {
            Part::built(part, format!("each pass, where more than {PLAIN_SUM} samples carry light"))
        }
        Estimator::Cut => Part::left_out(part, format!("up to {PLAIN_SUM} samples the plain sum is faster")),
        other => Part::left_out(part, format!("the estimator `{}` sums over the samples", other.name())),
    }
}

fn near_field(plan: &Plan, name: &str, estimator: Estimator) -> Part {
    let part = format!("near field of `{name}`");
    match (&plan.near, estimator) {
        (Some(near), _) => {
            let radius = short(near.radius().into());
            let samples = counted(plan.samples, "sample serves", "samples serve");
            let why = format!("light within {radius} units is sampled for each exit, {samples} for the rest");
            Part::built(part, why)
        }
        (None, Estimator::Notes | Estimator::Thinned) => {
            Part::left_out(part, "the lecture's law takes the cache alone")
        }
        (None, _) => Part::left_out(part, "light comes farther than from one cached sample to the next"),
    }
}

/// Clear bodies, where there are any, of methods whose paths go through them.
pub fn clear_bodies(scene: &Scene) -> Option<Part> {
    let what = "paths are mirrored at them and refracted through them; lights behind them are met by chance";
    scene.has_clear_bodies().then(|| Part::built("clear bodies", what))
}
