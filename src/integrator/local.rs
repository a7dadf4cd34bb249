//! The shape of a body around a place, and how far models can be trusted there.

use super::View;
use crate::bssrdf::{ExpectedError, ModelName, Place, expected_error};
use crate::geometry::Curvature;
use crate::math::Vec3;
use crate::optics::{ChannelOptics, Medium};
use crate::query::Ray;
use crate::scene::{Scene, Surface};

/// A translucent object and what is known of its shape.
pub struct LocalShape {
    /// Index of the object.
    pub object: u32,
    medium: Medium,
    optics: [ChannelOptics; 3],
    curvature: Curvature,
    model: ModelName,
    calibrated: bool,
}

/// A place of a body: thickness and curvature [unit, 1/unit].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Way along the inward normal to the next surface [unit]; infinite where there is none.
    pub thickness: f32,
    /// Mean curvature [1/unit].
    pub curvature: f32,
}

impl LocalShape {
    /// Of object number `object`; `None` where it is not translucent or nothing in it scatters or absorbs. Curvature is
    /// averaged over the longest transport mean free path of the three channels.
    pub fn new(scene: &Scene, object: u32) -> Option<Self> {
        let Surface::Translucent(t) = scene.surface(object) else { return None };
        let optics = ChannelOptics::of(&t.medium);
        let longest = optics.iter().map(|k| k.transport_mean_free_path).filter(|l| l.is_finite()).fold(0.0, f64::max);
        let mesh = &scene.objects[object as usize].mesh;
        let model = t.build().map_or(t.model, |model| model.name());
        let curvature = Curvature::new(mesh, longest as f32);
        (longest > 0.0).then_some(Self { object, medium: t.medium, optics, curvature, model, calibrated: t.calibrated })
    }

    /// The shape at a point of a triangle.
    pub fn at(&self, view: View<'_>, triangle: u32, u: f64, v: f64) -> Local {
        let mesh = &view.scene.objects[self.object as usize].mesh;
        let at = mesh.point(triangle, u, v);
        // The interpolated normal: along rims the facets look anywhere.
        let inwards: Vec3 = -at.n;
        let thickness = view.rays.closest(&Ray::new(at.leave(inwards), inwards)).map_or(f32::INFINITY, |hit| hit.t);
        Local { thickness, curvature: self.curvature.at(mesh, triangle, u, v) }
    }

    /// The places of `local` in the channels that have a medium, with their numbers.
    fn places(&self, local: Local) -> impl Iterator<Item = (usize, Place)> + '_ {
        let some = self.optics.iter().enumerate().filter(|(_, k)| k.transport_mean_free_path.is_finite());
        some.map(move |(c, k)| {
            (c, Place::new(k, self.medium.eta.into(), local.thickness.into(), local.curvature.into()))
        })
    }

    /// The largest error of the three channels that `model` is expected to make at `local`, and where.
    pub fn expected(&self, model: ModelName, calibrated: bool, local: Local) -> Option<(ExpectedError, Place)> {
        self.places(local)
            .map(|(_, place)| (expected_error(model, calibrated, &place), place))
            .max_by(|a, b| a.0.distribution.total_cmp(&b.0.distribution))
    }

    /// [`Self::expected`] of the model that the material asks for.
    pub fn expected_of_its_model(&self, local: Local) -> Option<(ExpectedError, Place)> {
        self.expected(self.model, self.calibrated, local)
    }

    /// The model that the material asks for, and whether it is calibrated; never `auto`.
    pub fn model(&self) -> (ModelName, bool) {
        (self.model, self.calibrated && self.model == ModelName::Directional)
    }

    /// Its medium's channels.
    pub fn optics(&self) -> &[ChannelOptics; 3] {
        &self.optics
    }

    /// n_inside / n_outside.
    pub fn eta(&self) -> f64 {
        self.medium.eta.into()
    }
}
