//! Paths over bodies whose light a model has: there it is asked for, and only what the model lacks is walked.

use super::body::{Body, Edge, Watch, survives};
use super::camera::{CameraPath, enter};
use super::connect::Scratch;
use super::draws::Draws;
use super::nesting::Entry;
use super::spectrum::Spectrum;
use super::{Asked, VolumePath, VolumePathOptions, endless_bodies, throughs};
use crate::bssrdf::Exit;
use crate::cache::{Plan, Step};
use crate::geometry::SurfacePoint;
use crate::integrator::{CameraRay, View};
use crate::math::{DVec3, Rgb, Vec3, hash_combine};
use crate::optics::{reflect, reflectance, refract, transmittance};
use crate::query::{Hit, Ray};
use crate::sampling::{PixelStream, cosine_hemisphere};
use crate::scene::{Orders, Scene};
use crate::surface::Lambertian;
use crate::tally::Tally;
use std::f32::consts::PI;
use std::sync::Arc;

/// How paths meet a body whose light a model has.
#[derive(Clone)]
pub struct Modelled {
    /// n_inside / n_outside.
    pub eta: f32,
    /// Paths that were scattered so often inside, or less, are no part of the model and go on; `None` where none do.
    pub walked: Option<u32>,
    /// Where light that comes over other surfaces and enters close to an exit is no part of the cache: paths step there.
    pub near: Option<Arc<Plan>>,
}

/// Ends a walk at its next collision but for so many.
struct AtMost(u32);

impl Watch for AtMost {
    fn collision(&mut self, _: DVec3, _: Vec3, _: Option<Edge>, _: &mut Spectrum, _: &mut Draws) -> bool {
        let goes_on = self.0 > 0;
        self.0 = self.0.saturating_sub(1);
        goes_on
    }
}

/// A path of at least this weight asks every model on its way.
const ASKING: f32 = 0.25;
/// Purpose of the numbers of a path's later questions.
const LATER: u64 = 0x006c_6174_6572;
/// And of steps.
const STEP: u64 = 0x7374_6570;

impl VolumePath {
    /// Paths over all surfaces that ask models for the light of bodies.
    pub(in super::super) fn over_models(
        scene: &Scene,
        modelled: Vec<Option<Modelled>>,
        bounces: u32,
        options: VolumePathOptions,
    ) -> Self {
        let options = VolumePathOptions { orders: Orders::All, photons: 0, ..options };
        let surfaces = Self::surfaces(scene, options);
        let bodies = endless_bodies(scene, |i| modelled[i].as_ref().is_some_and(|m| m.walked.is_some()));
        let throughs = throughs(scene, &surfaces.light.lights, &bodies);
        Self { throughs, bodies, modelled, bounces, ..surfaces }
    }

    /// Paths over opaque surfaces, for which `stand_ins` are those of bodies; without them paths end there.
    pub(in super::super) fn over_surfaces(
        scene: &Scene,
        stand_ins: Vec<Option<Lambertian>>,
        bounces: u32,
        seed: u64,
    ) -> Self {
        let options = VolumePathOptions { photons: 0, specular: false, seed, ..VolumePathOptions::default() };
        Self { stand_ins, bounces, ..Self::surfaces(scene, options) }
    }

    /// Radiance along the ray of the camera but for what is asked of models, which is added to `scratch`.
    pub(in super::super) fn seen(
        &self,
        view: View<'_>,
        ray: &CameraRay,
        hit: &Hit,
        scratch: &mut Scratch,
        tally: &mut Tally,
    ) -> Rgb {
        self.shade(view, &[], ray, scratch, tally, hit)
    }

    /// Radiance that a path finds which comes along `direction` to the opaque surface at `hit`, but for what shines there.
    pub(in super::super) fn arriving(
        &self,
        view: View<'_>,
        hit: &Hit,
        direction: Vec3,
        draws: Draws,
        tally: &mut Tally,
    ) -> Rgb {
        let mut scratch = Scratch::default();
        let coins = draws.fork(0);
        let mut path = self.path_by((draws, coins, PixelStream::new(0, 0, 0)), (view, &[]), &mut scratch, tally);
        path.resume(hit, direction);
        path.radiance
    }

    /// Whether paths walk in object number `object`.
    pub(in super::super) fn walks(&self, object: u32) -> bool {
        self.body(object).is_some()
    }

    /// Light of flux `flux` that has come through the boundary of a body, until it leaves it; what was scattered as often as the model's
    /// ends. The ray on which it goes on, and what is left.
    pub(in super::super) fn unmodelled(
        &self,
        view: View<'_>,
        object: u32,
        from: (DVec3, Vec3),
        flux: Rgb,
        draws: &mut Draws,
        tally: &mut Tally,
    ) -> Option<(Ray, Rgb)> {
        let body = self.body(object)?;
        let most = self.modelled[object as usize].as_ref()?.walked?;
        let mut spectrum = Spectrum::new(flux, draws.number());
        let exit = body.walk(view, from, &mut spectrum, draws, &mut AtMost(most), &mut tally.walk)?;
        Some((Ray::new(exit.at.leave(exit.w), exit.w), spectrum.value_outside()))
    }

    /// The body of object number `object`, where paths walk in it.
    fn body(&self, object: u32) -> Option<&Body> {
        self.bodies[object as usize].as_ref()
    }
}

impl CameraPath<'_> {
    /// What the camera sees on a body: the mirror image of what is around it, what its model has, and the rest of the light from inside.
    pub fn seen(&mut self, hit: &Hit, direction: Vec3) {
        let Some(model) = &self.method.modelled[hit.mesh as usize] else { return };
        let at = self.view.point(hit, direction);
        let n = at.normal_seen_from(-direction);
        let passed = transmittance(model.eta, -n.dot(direction));
        let (object, w, stream) = (hit.mesh, -direction, self.stream);
        self.scratch.asked.push(Asked { object, at, w, weight: Rgb::splat(passed), stream });
        let (spectrum, draws) = (self.spectrum, self.draws.clone());
        if self.method.options.specular {
            self.spectrum.scale(Rgb::splat(reflectance(model.eta, -n.dot(direction))));
            let w = reflect(-direction, n);
            self.draws = draws.fork(1);
            self.trace(Ray::new(at.leave(w), w));
        }
        if let Some(plan) = &model.near {
            (self.spectrum, self.draws, self.by_bsdf) = (spectrum, draws.fork(2), None);
            self.spectrum.scale(Rgb::splat(passed));
            if let Some(ray) = self.step(plan, &at, w) {
                self.trace(ray);
            }
            self.stepped = false;
        }
        (self.spectrum, self.draws, self.by_bsdf) = (spectrum, draws, None);
        if let (Some(body), true) = (self.method.body(hit.mesh), model.walked.is_some()) {
            self.order = 0;
            if let Some(ray) = enter(self, Entry::alone(body), hit, direction) {
                self.trace(ray);
            }
        }
    }

    /// A body on the way: mirrored by the chance of it, else its model is asked, and what that lacks goes on.
    pub fn meet_modelled(&mut self, hit: &Hit, at: &SurfacePoint, direction: Vec3) -> Option<Ray> {
        let model = self.method.modelled[hit.mesh as usize].as_ref()?;
        self.by_bsdf = None;
        let (n, w) = (at.n_geometric, -direction);
        if self.draws.number() < reflectance(model.eta, n.dot(w)) {
            let next = reflect(w, n);
            return Some(Ray::new(at.leave(next), next));
        }
        let stream = self.stream.aside(hash_combine(LATER, self.asked.into()));
        self.asked += 1;
        let weight = self.spectrum.value_outside();
        // A sum over a cache costs as much as many rays: of paths of little weight some ask, with more.
        let chance = (weight.max() / ASKING).min(1.0);
        if self.draws.number() < chance {
            self.scratch.asked.push(Asked { object: hit.mesh, at: *at, w, weight: weight * (1.0 / chance), stream });
        }
        let outside = self.view.outwards(hit).n_geometric.dot(w) > 0.0;
        let body = self.method.body(hit.mesh).filter(|_| model.walked.is_some() && outside);
        let step = match (&model.near, body) {
            (Some(plan), None) => Some(plan),
            // One of both, at even chances.
            (Some(plan), Some(_)) => {
                self.spectrum.scale(Rgb::splat(2.0));
                (self.draws.number() < 0.5).then_some(plan)
            }
            (None, _) => None,
        };
        if let Some(plan) = step {
            return self.step(plan, at, w);
        }
        self.order = 0;
        self.inside(Entry::alone(body?), at, refract(w, n, model.eta)?)
    }

    /// From where light leaves along `w` to a place near it where it entered, and out by the cosine: light of lights that the path
    /// meets at once is part of the near field.
    fn step(&mut self, plan: &Plan, at: &SurfacePoint, w: Vec3) -> Option<Ray> {
        let near = plan.near.as_ref()?;
        let stream = self.stream.aside(hash_combine(STEP, self.asked.into()));
        self.asked += 1;
        let exit = Exit { x: Vec3::ZERO, n: at.normal_seen_from(w), w };
        let Step { place, at: entry, weight } =
            near.step(self.view, plan.body.object, (at.x, exit.n), stream, self.tally)?;
        let entry = SurfacePoint { n: entry.n_geometric, ..entry };
        let w = cosine_hemisphere(entry.n, self.draws.pair());
        let sample = plan.body.enters(&entry, w, (Rgb::splat(PI), weight), self.draws.number())?;
        let passed = plan.near_part(near, &exit, &sample, (place - at.x).as_vec3(), self.tally);
        let before = self.spectrum.value_outside().max();
        self.spectrum.scale(passed);
        let left = self.spectrum.value_outside().max();
        if left <= 0.0 || !survives(left / before, &mut self.spectrum, &mut self.draws) {
            return None;
        }
        self.left = None;
        self.by_bsdf = None;
        self.stepped = true;
        Some(Ray::new(entry.leave(w), w))
    }

    /// Whether light that was scattered as often as the path's is part of the model of `body`.
    pub fn in_model(&self, body: &Body) -> bool {
        let walked = self.method.modelled[body.object as usize].as_ref().map(|m| m.walked);
        walked.is_some_and(|most| most.is_none_or(|most| self.order > most))
    }
}
