//! The shape of a body around a place, and how far models can be trusted there.

use super::View;
use crate::bssrdf::{Conditions, ExpectedError, ModelName, ModelOption, ModelOptions, Unmeasured, expected_error};
use crate::geometry::SurfacePoint;
use crate::math::{Vec3, frame};
use crate::optics::{ChannelOptics, Medium};
use crate::query::Ray;
use crate::scene::{Scene, Translucent};

/// A translucent object: what decides how far models can be trusted on it.
pub struct LocalShape {
    /// Index of the object.
    pub object: u32,
    medium: Medium,
    optics: [ChannelOptics; 3],
    own: Candidate,
}

/// A model that could render a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Its name; never `auto`.
    pub model: ModelName,
    /// `directional` scaled to the true albedo.
    pub calibrated: bool,
    /// Of the slab [unit].
    pub thickness: Option<f32>,
}

impl Candidate {
    /// A model without variants.
    pub fn plain(model: ModelName) -> Self {
        Self { model, calibrated: false, thickness: None }
    }

    /// The model that `material` asks for; of `auto` what it chooses.
    pub fn of(material: &Translucent) -> Self {
        let model = material.build().map_or(material.model, |model| model.name());
        Self {
            model,
            calibrated: material.calibrated && model.takes(ModelOption::Calibrated),
            thickness: material.thickness.filter(|_| model.takes(ModelOption::Thickness)),
        }
    }

    /// As it is made.
    pub fn options(self) -> ModelOptions {
        ModelOptions { calibrated: self.calibrated, thickness: self.thickness, ..ModelOptions::DEFAULT }
    }

    /// Whether the two are the same but for the thickness.
    pub fn is_kind_of(self, other: Self) -> bool {
        (self.model, self.calibrated) == (other.model, other.calibrated)
    }
}

/// A place of a body: thickness and curvature [unit, 1/unit].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Way along the inward normal to the next surface [unit]; NaN where there is no other side: a sheet, a hole, faces that
    /// look inwards.
    pub thickness: f32,
    /// Mean curvature [1/unit].
    pub curvature: f32,
}

/// A slab whose thickness is not that of the place, by more than this share, is another model there.
const SAME_THICKNESS: f32 = 0.1;

/// Surfaces of other objects, inside or behind, that the way to the other side may cross.
const MOST_CROSSED: u32 = 16;

/// Heights of the surface are taken at so many places around.
const AROUND: u32 = 6;

impl LocalShape {
    /// Of object number `object`; `None` where it is not translucent or nothing in it scatters or absorbs.
    pub fn new(scene: &Scene, object: u32) -> Option<Self> {
        let Some(t) = &scene.surface(object).inside else { return None };
        let shape = Self { object, medium: t.medium, optics: ChannelOptics::of(&t.medium), own: Candidate::of(t) };
        (shape.longest_path() > 0.0).then_some(shape)
    }

    /// Transport mean free path of the channel in which light goes farthest [unit].
    pub fn longest_path(&self) -> f64 {
        self.optics.iter().map(|k| k.transport_mean_free_path).filter(|l| l.is_finite()).fold(0.0, f64::max)
    }

    /// Way along the inward normal of `at`, a point of this object, to the next surface; NaN without another side.
    pub fn thickness(&self, view: View<'_>, at: &SurfacePoint) -> f32 {
        // The interpolated normal: along rims the facets look anywhere.
        let inwards: Vec3 = -at.n;
        let mut ray = Ray::new(at.leave(inwards), inwards);
        let (mut first, mut last, mut deep) = (None, f32::NAN, 1);
        for _ in 0..MOST_CROSSED {
            let Some(hit) = view.rays.closest(&ray) else { break };
            let mesh = &view.scene.objects[hit.mesh as usize].mesh;
            if hit.mesh == self.object {
                // Faces that look at where the ray comes from lead into another part of the mesh.
                let leaves = mesh.geometric_normal(hit.triangle).dot(inwards) > 0.0;
                deep += if leaves { -1 } else { 1 };
            } else {
                // Another object lies inside this one if the other side still follows.
                first = first.or(Some(hit.t));
            }
            if deep == 0 {
                return first.unwrap_or(hit.t);
            }
            ray.t_min = hit.t.next_up();
            last = hit.t;
        }
        // A closed mesh has another side, if only one that touches another object.
        if view.scene.body(self.object).is_some_and(|body| body.closed) { first.unwrap_or(last) } else { f32::NAN }
    }

    /// Mean curvature around `at` [1/unit]: that of the ball that leaves the tangent plane as far as the surface does on
    /// a circle as wide as the longest transport mean free path, or a quarter of `thickness`.
    pub fn curvature(&self, view: View<'_>, at: &SurfacePoint, thickness: f32) -> f32 {
        let radius = (self.longest_path() as f32).min(0.25 * thickness);
        let frame = frame(at.n);
        let height = |k: u32| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / AROUND as f32).sin_cos();
            let from = at.x + (frame * Vec3::new(cos, sin, 1.0) * radius).as_dvec3();
            let mut ray = Ray { t_max: 2.0 * radius, ..Ray::new(from, -at.n) };
            for _ in 0..MOST_CROSSED {
                let Some(hit) = view.rays.closest(&ray) else { break };
                let normal = view.scene.objects[hit.mesh as usize].mesh.geometric_normal(hit.triangle);
                // Not a floor that the body stands on, nor the inside of another part of it.
                if hit.mesh == self.object && normal.dot(at.n) > 0.0 {
                    return radius - hit.t;
                }
                ray.t_min = hit.t.next_up();
            }
            -radius
        };
        let mean = (0..AROUND).map(height).sum::<f32>() / AROUND as f32;
        -2.0 * mean / (radius * radius + mean * mean)
    }

    /// The places of `local` in the channels that have a medium.
    fn places(&self, local: Local) -> impl Iterator<Item = Conditions> + '_ {
        let some = self.optics.iter().filter(|k| k.transport_mean_free_path.is_finite());
        some.map(move |k| Conditions::new(k, self.medium.eta.into(), local.thickness.into(), local.curvature.into()))
    }

    /// The largest error of the three channels that `candidate` is expected to make at `local`, and where.
    ///
    /// # Errors
    /// One of the channels has not been measured.
    pub fn expected(&self, candidate: Candidate, local: Local) -> Result<(ExpectedError, Conditions), Unmeasured> {
        let apart = |t: f32| (local.thickness - t).abs() > SAME_THICKNESS * t;
        if candidate.thickness.is_some_and(apart) {
            return Err(Unmeasured::Model);
        }
        let mut worst: Option<(ExpectedError, Conditions)> = None;
        for place in self.places(local) {
            let error = expected_error(candidate.model, &candidate.options(), &place)?;
            if worst.is_none_or(|(e, _)| error.distribution > e.distribution) {
                worst = Some((error, place));
            }
        }
        worst.ok_or(Unmeasured::Albedo)
    }

    /// The model that the material asks for; never `auto`.
    pub fn own(&self) -> Candidate {
        self.own
    }

    /// Its medium's channels.
    pub fn optics(&self) -> &[ChannelOptics; 3] {
        &self.optics
    }

    /// n_inside / n_outside.
    pub fn eta(&self) -> f64 {
        self.medium.eta.into()
    }

    /// Mean cosine of the phase function.
    pub fn g(&self) -> f64 {
        self.medium.g
    }
}
