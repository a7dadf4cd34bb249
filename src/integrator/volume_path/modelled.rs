//! Paths over bodies whose light a model has: there it is asked for, and only what the model lacks is walked.

use super::camera::CameraPath;
use super::connect::Scratch;
use super::draws::PathSampler;
use super::glass;
use super::interior::{Edge, Interior, MOST_SURFACES, WalkObserver, russian_roulette};
use super::jumps::{Balls, Jumps};
use super::nesting::{Entry, Stack};
use super::seen::enter;
use super::spectrum::Spectrum;
use super::{Asked, CLEARANCE_CELLS, VolumePath, VolumePathOptions, endless, throughs};
use crate::bssrdf::Exit;
use crate::cache::{Plan, Step};
use crate::geometry::SurfacePoint;
use crate::integrator::{CameraRay, View};
use crate::light::Reference;
use crate::math::{DVec3, Rgb, Vec3, hash_combine};
use crate::optics::{Medium, reflect};
use crate::query::{Hit, Ray};
use crate::sampling::{PixelStream, cosine_hemisphere};
use crate::scene::{Orders, Scene};
use crate::surface::{Bsdf, Interface, RoughReflection};
use crate::tally::Tally;
use std::f32::consts::PI;
use std::sync::Arc;

/// How paths meet a body whose light a model has.
#[derive(Clone)]
pub struct Modelled {
    /// Its boundary.
    pub boundary: Interface,
    /// Whether light comes through unscattered, which is no part of any model.
    pub clear: bool,
    /// Whether light scattered once is no part of the model.
    pub once: bool,
    /// Whether paths walk through it themselves.
    pub walked: bool,
    /// Where light that comes over other surfaces and enters close to an exit is no part of the cache: paths step there.
    pub near: Option<Arc<Plan>>,
}

/// Gives those of `bodies` that `wanted` names balls of their media; bodies of one medium share them.
fn give_jumps(bodies: &mut [Option<Interior>], scene: &Scene, wanted: impl Fn(usize) -> bool) {
    let of = |(i, body): (usize, &Option<Interior>)| {
        let body = body.as_ref().filter(|_| wanted(i))?;
        Some((scene.surface(body.object).medium()?, body.clearance.largest()))
    };
    let media: Vec<Option<(Medium, f32)>> = bodies.iter().enumerate().map(of).collect();
    let mut made: Vec<(Medium, Option<Arc<Balls>>)> = Vec::new();
    for (body, own) in bodies.iter_mut().zip(&media) {
        let (Some(body), Some((medium, _))) = (body, own) else { continue };
        let known = made.iter().position(|(m, _)| m == medium).unwrap_or_else(|| {
            let room = media.iter().flatten().filter(|(m, _)| m == medium).map(|(_, room)| *room);
            made.push((*medium, Balls::new(medium, room.fold(0.0, f32::max)).map(Arc::new)));
            made.len() - 1
        });
        body.jumps = made[known].1.clone().map(|balls| Jumps::new(balls, &body.clearance));
    }
}

/// Ends a walk at its next collision but for so many.
struct AtMost(u32);

impl WalkObserver for AtMost {
    fn collision(&mut self, _: DVec3, _: Vec3, _: Option<Edge>, _: &mut Spectrum, _: &mut PathSampler) -> bool {
        let goes_on = self.0 > 0;
        self.0 = self.0.saturating_sub(1);
        goes_on
    }
}

/// A mirror image of at least this weight is followed beside the rest.
const BRANCHING: f32 = 1e-3;
/// Mirror images of mirror images that are followed so; those in them by chance.
const MOST_BRANCHES: u32 = 4;
/// Light that comes through a body with less than this share goes on by chance.
const FAINT: f32 = 0.1;
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
        let cells = if modelled.iter().flatten().any(|m| m.walked) { CLEARANCE_CELLS } else { 1 };
        let walked = endless(scene, cells, |i| modelled[i].as_ref().is_some_and(|m| m.clear || m.once || m.walked));
        let clear = glass::clear_bodies(scene);
        // A path of many collisions that has come out by a hole would never end.
        let ends = |(i, body): (usize, Option<Interior>)| {
            let walked = modelled[i].as_ref().is_some_and(|m| m.walked);
            body.map(|body| Interior { endless: body.endless && !walked, ..body })
        };
        let walked = walked.into_iter().enumerate().map(ends);
        let mut bodies: Vec<Option<Interior>> = walked.zip(clear).map(|(body, clear)| clear.or(body)).collect();
        give_jumps(&mut bodies, scene, |i| modelled[i].as_ref().is_some_and(|m| m.walked));
        let throughs = throughs(scene, &surfaces.light.lights, &bodies);
        Self { throughs, bodies, modelled, bounces, camera_in: glass::camera_in(scene), ..surfaces }
    }

    /// Paths over opaque surfaces and through clear bodies; `stand_ins` are the surfaces of bodies that scatter, without them paths end there.
    pub(in super::super) fn over_surfaces(
        scene: &Scene,
        stand_ins: Vec<Option<Arc<dyn Bsdf>>>,
        bounces: u32,
        seed: u64,
    ) -> Self {
        let options = VolumePathOptions { photons: 0, specular: true, seed, ..VolumePathOptions::default() };
        let (bodies, camera_in) = (glass::clear_bodies(scene), glass::camera_in(scene));
        Self { stand_ins, bounces, bodies, camera_in, ..Self::surfaces(scene, options) }
    }

    /// Radiance that the opaque surface at `hit` reflects towards the camera, but for light straight from lights, and for what is asked of
    /// models, which is added to `scratch`.
    pub(in super::super) fn reflected(
        &self,
        view: View<'_>,
        ray: &CameraRay,
        hit: &Hit,
        scratch: &mut Scratch,
        tally: &mut Tally,
    ) -> Rgb {
        let direction = ray.ray.direction;
        let mut path = self.path(view, &[], ray.stream, scratch, tally);
        let at = view.point(hit, direction);
        let [u, v] = path.draws.pair();
        let next = view.scene.surface(hit.mesh).bsdf.sample(&at, -direction, [u, v, 0.0]);
        // No roulette yet: a path of little weight is a grain in the picture of a dark surface.
        if let Some(next) = next.filter(|next| !next.weight.is_black() && at.n_geometric.dot(next.wi) > 0.0) {
            path.spectrum.scale(next.weight);
            path.stepped = true;
            path.trace(Ray::new(at.leave(next.wi), next.wi));
        }
        path.radiance
    }

    /// Radiance that a path finds which comes along `direction` to the opaque surface or clear body at `hit`, but for what shines there.
    pub(in super::super) fn arriving(
        &self,
        view: View<'_>,
        hit: &Hit,
        direction: Vec3,
        draws: PathSampler,
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
        draws: &mut PathSampler,
        tally: &mut Tally,
    ) -> Option<(Ray, Rgb)> {
        let body = self.body(object)?;
        let most = u32::from(self.modelled[object as usize].as_ref()?.once);
        let mut spectrum = Spectrum::new(flux, draws.number());
        let exit = body.walk(view, from, &mut spectrum, draws, &mut AtMost(most), &mut tally.walk)?;
        Some((Ray::new(exit.at.leave(exit.w), exit.w), spectrum.value_outside() * body.tint(&exit.at)))
    }

    /// The body of object number `object`, where paths walk in it.
    pub(super) fn body(&self, object: u32) -> Option<&Interior> {
        self.bodies[object as usize].as_ref()
    }
}

impl CameraPath<'_> {
    /// What the camera sees on a body: the mirror image of what is around it, what its model has, and the rest of the light from inside.
    pub fn seen(&mut self, hit: &Hit, direction: Vec3) {
        let Some(model) = &self.method.modelled[hit.mesh as usize] else { return };
        let at = self.view.point(hit, direction);
        let n = at.normal_seen_from(-direction);
        let passed = model.boundary.tint(&at) * model.boundary.passed(-n.dot(direction));
        let (object, w, stream) = (hit.mesh, -direction, self.stream);
        self.scratch.asked.push(Asked { object, at, w, weight: passed, stream, later: false });
        let (spectrum, draws) = (self.spectrum, self.draws.clone());
        if self.method.options.specular {
            self.draws = draws.fork(1);
            let share = model.boundary.reflected(n.dot(w));
            if let Some(ray) = self.mirrored(&model.boundary, &SurfacePoint { n, ..at }, w, share) {
                self.trace(ray);
            }
        }
        if passed.is_black() {
            return;
        }
        if let Some(plan) = &model.near {
            (self.spectrum, self.draws, self.sight) = (spectrum, draws.fork(2), None);
            self.spectrum.scale(passed);
            if let Some(ray) = self.step(plan, &at, w) {
                self.trace(ray);
            }
            self.stepped = false;
        }
        let Some(body) = self.method.body(hit.mesh) else { return };
        if model.clear {
            (self.spectrum, self.draws, self.sight) = (spectrum, draws.fork(3), None);
            self.spectrum.scale(passed);
            let inside = self.enters(&model.boundary, n, w);
            if let Some(ray) = inside.and_then(|inside| self.straight(body, &at, inside)) {
                self.trace(ray);
            }
        }
        if model.once {
            (self.spectrum, self.draws, self.sight) = (spectrum, draws, None);
            self.order = 0;
            if let Some(ray) = enter(self, Entry::alone(body), hit, direction).filter(|_| self.order > 0) {
                self.trace(ray);
            }
        }
    }

    /// A body on the way: its model is asked, and what that lacks goes on, by chance one of its kinds. What the boundary mirrors is
    /// followed by itself while the path has weight, else by the chance of it.
    pub fn meet_modelled(&mut self, hit: &Hit, at: &SurfacePoint, direction: Vec3) -> Option<Ray> {
        let model = self.method.modelled[hit.mesh as usize].as_ref()?;
        self.sight = None;
        let (n, w) = (at.n_geometric, -direction);
        // No light enters by the back of a face, and paths end there.
        if self.view.outwards(hit).n_geometric.dot(w) <= 0.0 {
            self.ask(hit, at, w);
            return None;
        }
        let mirrored = model.boundary.reflected(n.dot(w));
        let flat = SurfacePoint { n, ..*at };
        let weight = self.spectrum.value_outside().max();
        if weight * mirrored >= BRANCHING && self.branches < MOST_BRANCHES {
            let (spectrum, draws) = (self.spectrum, self.draws.clone());
            self.branches += 1;
            self.draws = draws.fork(1);
            if let Some(ray) = self.mirrored(&model.boundary, &flat, w, mirrored) {
                self.trace(ray);
            }
            (self.spectrum, self.draws, self.sight, self.left) = (spectrum, draws.fork(2), None, None);
            self.stepped = false;
            self.branches -= 1;
            self.spectrum.scale(Rgb::splat(1.0 - mirrored));
        } else if self.draws.number() < mirrored {
            return self.mirrored(&model.boundary, &flat, w, 1.0);
        }
        if !self.tinted(model.boundary.tint.as_ref(), at) {
            return None;
        }
        self.ask(hit, at, w);
        let body = self.method.body(hit.mesh);
        let step = model.near.as_ref();
        let there = [step.is_some(), body.is_some() && model.clear, body.is_some() && model.once];
        let count = there.into_iter().filter(|there| *there).count() as f32;
        let picked = (self.draws.number() * count) as usize;
        let (kind, _) = there.into_iter().enumerate().filter(|(_, there)| *there).nth(picked)?;
        self.spectrum.scale(Rgb::splat(count));
        let inside = if kind > 0 { self.enters(&model.boundary, n, w) } else { None };
        match (kind, body, inside) {
            (0, ..) => self.step(step?, at, w),
            (1, Some(body), Some(inside)) => self.straight(body, at, inside),
            (_, Some(body), Some(inside)) => {
                self.order = 0;
                self.inside(Entry::alone(body), at, inside).filter(|_| self.order > 0)
            }
            _ => None,
        }
    }

    /// The ray along which light comes that the boundary reflects to `w`, weighted by `share` in the mean; at a rough one lights are asked for.
    fn mirrored(&mut self, boundary: &Interface, at: &SurfacePoint, w: Vec3, share: f32) -> Option<Ray> {
        let Some(rough) = &boundary.rough else {
            self.spectrum.scale(Rgb::splat(share));
            let away = reflect(w, at.n);
            return Some(Ray::new(at.leave(away), away));
        };
        let bsdf = RoughReflection(rough);
        self.spectrum.scale(Rgb::splat(share / boundary.reflected(at.n.dot(w))));
        let weight = self.spectrum.value_outside();
        self.ask_on((at, w, &bsdf), &Stack::default(), weight, |path| &mut path.draws);
        let [u, v] = self.draws.pair();
        let next = bsdf.sample(at, w, [u, v, self.draws.number()])?;
        self.spectrum.scale(next.weight);
        self.turn(Some((next.pdf, Reference::surface(at))));
        (at.n_geometric.dot(next.wi) > 0.0).then(|| Ray::new(at.leave(next.wi), next.wi))
    }

    /// A direction inside of light that gets in from `w`, weighted by a mean of 1.
    fn enters(&mut self, boundary: &Interface, n: Vec3, w: Vec3) -> Option<Vec3> {
        let (inside, weight) = boundary.enter(n, w, || self.draws.number())?;
        self.spectrum.scale(Rgb::splat(weight));
        Some(inside)
    }

    /// Asks the model of the body at `hit`. A sum over a cache costs as much as many rays: of paths of little weight some ask, with more.
    fn ask(&mut self, hit: &Hit, at: &SurfacePoint, w: Vec3) {
        let stream = self.stream.aside(hash_combine(LATER, self.asked.into()));
        self.asked += 1;
        let weight = self.spectrum.value_outside();
        let chance = (weight.max() / ASKING).min(1.0);
        if self.draws.number() < chance {
            let weight = weight * (1.0 / chance);
            self.scratch.asked.push(Asked { object: hit.mesh, at: *at, w, weight, stream, later: true });
        }
    }

    /// Through a body from `at` along `w` without being scattered; the ray on which the path leaves.
    fn straight(&mut self, body: &Interior, at: &SurfacePoint, mut w: Vec3) -> Option<Ray> {
        let mut from = at.leave(w);
        for _ in 0..MOST_SURFACES {
            self.tally.rays.bounce += 1;
            let (hit, at) = body.closest(self.view, Ray::new(from, w)).filter(|(hit, _)| hit.mesh == body.object)?;
            if at.n_geometric.dot(w) <= 0.0 {
                return None;
            }
            let before = self.spectrum.value_outside().max();
            self.spectrum.scale(body.medium.sigma_t.map(|s| (-s * hit.t).exp()));
            let left = self.spectrum.value_outside().max();
            if left <= 0.0 || !russian_roulette(left / before / FAINT, &mut self.spectrum, &mut self.draws) {
                return None;
            }
            let at = body.flat(at);
            if let Some(rough) = &body.rough {
                let weight = self.spectrum.value_outside();
                let weight = weight * body.tint(&at);
                self.ask_on((&at, -w, &**rough), &Stack::default(), weight, |path| &mut path.draws);
            }
            let next = body.cross(&at, -w, &mut self.draws)?;
            self.spectrum.scale(next.weight);
            from = at.leave(next.wi);
            if next.wi.dot(at.n_geometric) > 0.0 {
                if !self.tinted(body.tint.as_ref(), &at) {
                    return None;
                }
                if body.rough.is_some() {
                    self.turn(Some((next.pdf, Reference::surface(&at))));
                }
                return Some(Ray::new(from, next.wi));
            }
            w = next.wi;
        }
        None
    }

    /// From where light leaves along `w` to a place near it where it entered, and out by the cosine: light of lights that the path
    /// meets at once is part of the near field.
    fn step(&mut self, plan: &Plan, at: &SurfacePoint, w: Vec3) -> Option<Ray> {
        let near = plan.near.as_ref()?;
        let stream = self.stream.aside(hash_combine(STEP, self.asked.into()));
        self.asked += 1;
        let exit = Exit { x: Vec3::ZERO, n: at.normal_seen_from(w), w };
        let Step { place, at: entry, weight } = near.step(self.view, &plan.body, (at.x, exit.n), stream, self.tally)?;
        let entry = SurfacePoint { n: entry.n_geometric, ..entry };
        let w = cosine_hemisphere(entry.n, self.draws.pair());
        let sample = plan.body.enters(&entry, w, (Rgb::splat(PI), weight), self.draws.number())?;
        let passed =
            plan.near_part(near, &exit, &sample, (place - at.x).as_vec3(), self.tally) * plan.balance_at(at.x, exit.n);
        let before = self.spectrum.value_outside().max();
        self.spectrum.scale(passed);
        let left = self.spectrum.value_outside().max();
        if left <= 0.0 || !russian_roulette(left / before, &mut self.spectrum, &mut self.draws) {
            return None;
        }
        self.left = None;
        self.sight = None;
        self.stepped = true;
        Some(Ray::new(entry.leave(w), w))
    }

    /// Whether light that was scattered as often as the path's is part of the model of `body`.
    pub fn in_model(&self, body: &Interior) -> bool {
        self.method.modelled[body.object as usize].is_some() && self.order > 1
    }
}
