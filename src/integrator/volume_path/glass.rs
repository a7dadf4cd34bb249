//! Clear bodies for methods that have models, or surfaces alone: paths go through them as in `volume_path`, and stop at what scatters.
//!
//! No shadow ray of these methods passes a boundary. So lights behind clear bodies are met by paths alone, with all of their light, and lights that
//! shadow rays meet are met by none of these.

use super::connect::Scratch;
use super::draws::PathSampler;
use super::interior::{Edge, Interior, WalkObserver};
use super::nesting::{self, Entry, Guide, Meets, Stack};
use super::spectrum::Spectrum;
use super::{VolumePath, interior};
use crate::geometry::SurfacePoint;
use crate::integrator::{CameraRay, View};
use crate::math::{DVec3, Rgb, Vec3};
use crate::query::{Hit, Ray};
use crate::scene::Scene;
use crate::tally::Tally;

/// The clear bodies of `scene`, one entry for each object.
pub fn clear_bodies(scene: &Scene) -> Vec<Option<Interior>> {
    let of = |i: usize| if scene.surface(i as u32).clear.is_some() { interior(scene, i, 1) } else { None };
    (0..scene.objects.len()).map(of).collect()
}

/// The clear bodies that the camera stands in.
pub fn camera_in(scene: &Scene) -> Stack {
    let clear = |object: u32| scene.surface(object).clear.is_some();
    if !scene.has_clear_bodies() {
        return Stack::default();
    }
    let around: Vec<(u32, u32)> = scene.camera_in().iter().copied().filter(|(object, _)| clear(*object)).collect();
    Stack::of(&around, scene.nests())
}

/// Light from bodies and lights on its way through clear bodies, which nothing watches.
struct Passing<'a>(&'a VolumePath);

impl Guide for Passing<'_> {
    fn watch<'a>(&'a mut self, _: &'a Interior, _: &'a Stack, _: bool) -> impl WalkObserver + 'a {
        Ends
    }

    fn meets(&self, object: u32) -> Meets {
        self.0.meets(object)
    }
}

/// A walk that no collision is expected in.
struct Ends;

impl WalkObserver for Ends {
    fn collision(&mut self, _: DVec3, _: Vec3, _: Option<Edge>, _: &mut Spectrum, _: &mut PathSampler) -> bool {
        false
    }
}

impl VolumePath {
    /// How paths in bodies meet the body number `object`.
    pub(super) fn meets(&self, object: u32) -> Meets {
        let object = object as usize;
        match (&self.stand_ins[object], &self.modelled[object]) {
            (Some(matt), _) => Meets::Opaque(Some(matt.clone())),
            (None, Some(_)) => Meets::Ends,
            (None, None) => Meets::Enters,
        }
    }

    /// Whether the camera is in a clear body: then all that it sees is [`Self::seen_from_inside`].
    pub(in super::super) fn camera_is_inside(&self) -> bool {
        self.camera_in.top().is_some()
    }

    /// Radiance along the ray of a camera in a clear body, over the square of its index, but for what is asked of models, which is
    /// added to `scratch`.
    pub(in super::super) fn seen_from_inside(
        &self,
        view: View<'_>,
        ray: &CameraRay,
        scratch: &mut Scratch,
        tally: &mut Tally,
    ) -> Rgb {
        let body = self.camera_in.top().and_then(|object| self.bodies[object as usize].as_ref());
        body.map_or(Rgb::BLACK, |body| self.shade_inside(view, &[], ray, scratch, tally, body))
    }

    /// Light of flux `flux` that comes along `direction` to a clear body at `hit`: the ray on which it goes on, mirrored or through it, by
    /// chance, and what is left of it.
    pub(in super::super) fn past_clear(
        &self,
        view: View<'_>,
        (hit, direction): (&Hit, Vec3),
        flux: Rgb,
        draws: &mut PathSampler,
        tally: &mut Tally,
    ) -> Option<(Ray, Rgb)> {
        let body = self.bodies[hit.mesh as usize].as_ref()?;
        let at = view.point(hit, direction);
        let outside = view.outwards(hit).n_geometric.dot(direction) < 0.0;
        let way = outside.then(|| Entry::at(view, &self.bodies, body, hit, direction)).flatten();
        let Some(Entry { body, stack, margin, through }) = way else {
            tally.walk.walks += 1;
            tally.walk.losses.add(body.object, body.leak);
            return None;
        };
        let boundary = &view.scene.surface(body.object).bsdf;
        let w = boundary.sample(&at, -direction, [draws.number(), 0.0, 0.0])?.wi;
        if w.dot(at.n_geometric) > 0.0 {
            return Some((Ray::new(at.leave(w), w), flux));
        }
        let mut spectrum = Spectrum::new(flux, draws.number());
        let from = SurfacePoint { error: at.error.max(margin), ..at }.leave(w);
        let start = ((stack, through), from, w);
        let walk = &mut tally.walk;
        let (_, exit) = nesting::walk(view, &self.bodies, start, &mut spectrum, draws, &mut Passing(self), walk)?;
        Some((Ray::new(exit.at.leave(exit.w), exit.w), spectrum.value_outside()))
    }
}
