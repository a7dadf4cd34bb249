//! A body of the world from the inside: flights, collisions, the boundary, until light leaves.

use super::draws::PathSampler;
use super::facets::Bend;
use super::jumps::Jumps;
use super::spectrum::{Coefficients, Spectrum};
use crate::geometry::{Clearance, SurfacePoint, Union};
use crate::integrator::View;
use crate::math::{DVec3, Rgb, Vec3};
use crate::optics::{HenyeyGreenstein, Medium};
use crate::query::{Hit, Ray};
use crate::scene::{Contacts, Surface};
use crate::surface::{Boundary, Bsdf, BsdfSample, Colour, RoughBoundary};
use crate::tally::{Cause, WalkTally};
use std::sync::Arc;

/// What paths need of a body of the world ([`crate::scene::Body`]): its medium as they take it, how far it is to its surface, what is around it. Its
/// boundary is the triangles themselves.
pub struct Interior {
    /// Index of the body's surface.
    pub object: u32,
    /// n_inside / n_outside.
    pub eta: f32,
    /// Its boundary, if that is not smooth.
    pub rough: Option<Arc<RoughBoundary>>,
    /// Pigment on it. Whoever follows light in or out takes it into account: walks do not.
    pub tint: Option<Colour>,
    /// The medium.
    pub medium: Coefficients,
    /// Where collisions send light.
    pub phase: HenyeyGreenstein,
    /// Lower bounds of the distance to any surface, within the object's box.
    pub clearance: Clearance,
    /// Smallest extinction of the channels with any [1/unit]; 0 without a medium.
    pub least_extinction: f32,
    /// Whether the medium goes on beyond the object's box: sheets and meshes with holes.
    pub endless: bool,
    /// What a path on the wrong side of its surface is lost by.
    pub leak: Cause,
    /// Collisions between two looks at the weight.
    pub patience: u32,
    /// Whether paths keep what is around them, by `nesting.rs`: it is clear, or meets other bodies or itself.
    pub nested: bool,
    /// Whether its index is that of air and light asked for over lines that go straight through its boundary: see `lines.rs`.
    pub matched: bool,
    /// Absorption [1/unit] of a clear body, which has no collisions: its `medium` is void.
    pub absorbs: Option<Rgb>,
    /// Its triangles that lie in those of other bodies.
    pub contacts: Contacts,
    /// What bounds it, where its parts meet; paths of a body that is not [`Self::nested`] pass what lies inside.
    pub union: Option<Arc<Union>>,
    /// Balls that paths jump through whose collisions are nobody's business.
    pub jumps: Option<Jumps>,
}

/// The straight flight between two collisions.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Length [unit].
    pub length: f32,
    /// Phase function at its start [1/sr].
    pub phase: f32,
}

/// Who watches a path inside a body.
pub trait WalkObserver {
    /// Light that travelled along `w` is scattered at `x`, by the path's weight `spectrum` (the collision's albedo is in
    /// it). `edge` is the straight flight from the collision before, if no surface lay between. False ends the path.
    fn collision(
        &mut self,
        x: DVec3,
        w: Vec3,
        edge: Option<Edge>,
        spectrum: &mut Spectrum,
        draws: &mut PathSampler,
    ) -> bool;

    /// Whether it decides itself which paths of little weight go on.
    fn plays_roulette(&self) -> bool {
        false
    }

    /// Whether paths may jump from collision to collision, past others.
    fn jumps(&self) -> bool {
        false
    }

    /// A jump has passed one or more collisions.
    fn passed(&mut self) {}

    /// A lamp inside the body ends the path, which came to it along `w`.
    fn lamp(&mut self, _hit: &Hit, _w: Vec3, _spectrum: &Spectrum) {}

    /// The path has come to an opaque surface inside the body, which faces it, and goes back along `_wo`.
    fn surface(&mut self, _at: &SurfacePoint, _wo: Vec3, _bsdf: &dyn Bsdf, _spectrum: &Spectrum) {}

    /// The path has come to the body's own rough boundary at `_at`, its normals outwards, and goes back along `_wo`.
    fn boundary(&mut self, _at: &SurfacePoint, _wo: Vec3, _rough: &RoughBoundary, _spectrum: &Spectrum) {}

    /// How the path goes on.
    fn turned(&mut self, _turn: Turn<'_>) {}
}

/// What became of a path's direction.
#[derive(Clone, Copy, Debug)]
pub enum Turn<'a> {
    /// Kept through a boundary that does not refract, or none; so far [unit] behind it.
    None(f32),
    /// Scattered at this place, into a direction of this density [1/sr].
    Scattered(DVec3, f32),
    /// Reflected by an opaque surface, which faces it, into a direction of this density [1/sr]; 0 by a mirror.
    Reflected(&'a SurfacePoint, f32),
    /// Come out of a rough boundary here, whose normals are outwards, in a direction of this density [1/sr].
    Out(&'a SurfacePoint, f32),
    /// Refracted or mirrored.
    Bent,
}

/// Where and how a path left a body.
pub struct WalkExit {
    /// The point, its normals outwards.
    pub at: SurfacePoint,
    /// Refracted direction outside.
    pub w: Vec3,
    /// How it came there, if straight from a collision.
    pub straight: Option<Straight>,
}

/// The straight flight from a collision out of a body.
#[derive(Clone, Copy, Debug)]
pub struct Straight {
    /// The collision.
    pub from: DVec3,
    /// Phase function at the collision [1/sr].
    pub phase: f32,
    /// Length inside [unit].
    pub length: f32,
    /// Cosines to the normal, inside and outside.
    pub cosines: [f32; 2],
}

impl Straight {
    /// The whole line, `far` [unit] of it outside.
    pub fn bend(&self, far: f32) -> Bend {
        Bend { lengths: [self.length, far].map(f64::from), cosines: self.cosines.map(f64::from) }
    }
}

/// Surfaces in a row after which a path is given up, and counted as lost: light that nothing absorbs can be caught for ever, by
/// total reflection in a box or between white walls. Not by chance any sooner: a path that has kept its weight would have to
/// carry more than it, without a bound on its variance.
pub const MOST_SURFACES: u32 = 100_000;
/// A path that has lost more than this part of its weight goes on by chance.
pub const ROULETTE_BELOW: f32 = 0.25;

/// What ends a flight, and after which length.
pub enum Flight {
    /// Its own length.
    Collision(DVec3),
    /// The body's own boundary from inside, normals outwards.
    Boundary(SurfacePoint, f32),
    /// An opaque surface inside, of this object.
    Opaque(SurfacePoint, f32, u32),
    /// A lamp inside.
    Lamp(Hit),
    /// Where no light can be.
    Lost(Cause),
}

impl Interior {
    /// The object number `object`, with a table of the surfaces in its box.
    pub fn new(object: u32, medium: &Medium, clearance: Clearance) -> Self {
        let coefficients = Coefficients::new(medium);
        let absorbed = 1.0 - coefficients.albedo.max();
        let extinctions = coefficients.sigma_t.0.into_iter().filter(|s| *s > 0.0);
        let least = extinctions.fold(f32::INFINITY, f32::min);
        Self {
            object,
            eta: medium.eta,
            rough: None,
            tint: None,
            patience: (0.1 / absorbed.max(1e-3)).clamp(1.0, 64.0) as u32,
            least_extinction: if least.is_finite() { least } else { 0.0 },
            medium: coefficients,
            phase: HenyeyGreenstein { g: medium.g },
            clearance,
            endless: false,
            leak: Cause::Rounding,
            nested: false,
            matched: false,
            absorbs: None,
            contacts: Contacts::new(),
            union: None,
            jumps: None,
        }
    }

    /// The first surface along `ray`, its normals outwards, but for those of its own that lie inside it.
    #[inline]
    pub fn closest(&self, view: View<'_>, mut ray: Ray) -> Option<(Hit, SurfacePoint)> {
        loop {
            let hit = view.rays.closest(&ray)?;
            let at = view.outwards(&hit);
            if hit.mesh != self.object || !self.hides(&hit, &at) {
                return Some((hit, at));
            }
            ray.t_min = hit.t;
        }
    }

    /// A point of the boundary as light from inside meets it: by the triangle alone where it is rough.
    #[inline]
    pub fn flat(&self, at: SurfacePoint) -> SurfacePoint {
        if self.rough.is_some() { SurfacePoint { n: at.n_geometric, ..at } } else { at }
    }

    /// Share of light that is let through at a point which passes the pigment there.
    #[inline]
    pub fn tint(&self, at: &SurfacePoint) -> Rgb {
        self.tint.as_ref().map_or(Rgb::WHITE, |tint| tint.at(at))
    }

    /// Which way light goes on that goes to `wo` from a point of the boundary, from either side.
    #[inline]
    pub fn cross(&self, at: &SurfacePoint, wo: Vec3, draws: &mut PathSampler) -> Option<BsdfSample> {
        let Some(rough) = &self.rough else {
            return Boundary { eta: self.eta }.sample(at, wo, [draws.number(), 0.0, 0.0]);
        };
        let [u, v] = draws.pair();
        rough.sample(at, wo, [u, v, draws.number()])
    }

    /// Extinction [1/unit].
    pub fn extinction(&self) -> Rgb {
        self.medium.sigma_t + self.absorbs.unwrap_or(Rgb::BLACK)
    }

    /// Whether nothing stands on `ray` but what lies inside the body.
    pub fn lets_through(&self, view: View<'_>, ray: Ray) -> bool {
        if self.union.is_some() { self.closest(view, ray).is_none() } else { !view.rays.occluded(&ray) }
    }

    fn hides(&self, hit: &Hit, at: &SurfacePoint) -> bool {
        self.union.as_ref().is_some_and(|union| union.hides(hit.triangle, at.x))
    }

    /// p(cos θ) [1/sr] between two directions of propagation.
    #[inline]
    pub fn phase(&self, from: Vec3, to: Vec3) -> f32 {
        if self.phase.g == 0.0 {
            return 0.25 * std::f32::consts::FRAC_1_PI;
        }
        self.phase.value(f64::from(from.dot(to)).clamp(-1.0, 1.0)) as f32
    }

    #[inline]
    pub fn scatter(&self, w: Vec3, draws: &mut PathSampler) -> Vec3 {
        if self.phase.g == 0.0 {
            return draws.direction();
        }
        let u = draws.pair();
        self.phase.sample(w, u).normalize()
    }

    /// From a collision at `x`, `free` of surfaces so far around, at once to the surface of a ball, and the direction there.
    #[inline]
    fn jump(
        &self,
        (x, free): (DVec3, f32),
        spectrum: &mut Spectrum,
        draws: &mut PathSampler,
        watch: &mut impl WalkObserver,
        tally: &mut WalkTally,
    ) -> Option<(DVec3, Vec3)> {
        let jumps = self.jumps.as_ref().filter(|_| watch.jumps())?;
        let landing = jumps.jump(x, self.clearance.level(free), spectrum, draws)?;
        tally.jumps += 1;
        if !landing.straight {
            watch.passed();
        }
        Some((landing.x, landing.w))
    }

    /// Where and how light goes on that came to a collision.
    pub fn scattered(
        &self,
        (x, w): (DVec3, Vec3),
        spectrum: &mut Spectrum,
        draws: &mut PathSampler,
        watch: &mut impl WalkObserver,
        tally: &mut WalkTally,
    ) -> (DVec3, Vec3) {
        self.jump((x, self.clearance.at(x)), spectrum, draws, watch, tally)
            .unwrap_or_else(|| (x, self.scatter(w, draws)))
    }

    /// From `from` along `w`, a collision at `distance` unless a surface comes first. No ray up to `free`, where no surface is.
    #[inline]
    pub fn flight(
        &self,
        view: View<'_>,
        (from, free): (DVec3, f32),
        w: Vec3,
        distance: f32,
        tally: &mut WalkTally,
    ) -> Flight {
        if distance < free {
            tally.clear += 1;
            return Flight::Collision(from + w.as_dvec3() * f64::from(distance));
        }
        tally.rays += 1;
        let Some((hit, at)) = self.closest(view, Ray { t_max: distance, ..Ray::new(from, w) }) else {
            let x = from + w.as_dvec3() * f64::from(distance);
            return if self.endless || self.clearance.at(x) >= 0.0 {
                Flight::Collision(x)
            } else {
                Flight::Lost(self.leak)
            };
        };
        if hit.mesh == self.object {
            return if at.n_geometric.dot(w) > 0.0 { Flight::Boundary(at, hit.t) } else { Flight::Lost(self.leak) };
        }
        match view.scene.surface(hit.mesh) {
            Surface { emission: Some(_), .. } => Flight::Lamp(hit),
            surface if surface.is_body() => Flight::Lost(Cause::OtherMedium),
            _ => Flight::Opaque(at.facing(-w), hit.t, hit.mesh),
        }
    }

    /// Follows light from `from`, inside, along `w` until it leaves, but for the pigment on its way out; `None` where it is absorbed, ended by `watch`, or
    /// lost, which is counted with its cause.
    ///
    /// A path whose weight has fallen goes on with a chance in proportion to what is left, and is weighted by its
    /// inverse. There is no limit of collisions, and one of [`MOST_SURFACES`] between two.
    pub fn walk(
        &self,
        view: View<'_>,
        (mut from, mut w): (DVec3, Vec3),
        spectrum: &mut Spectrum,
        draws: &mut PathSampler,
        watch: &mut impl WalkObserver,
        tally: &mut WalkTally,
    ) -> Option<WalkExit> {
        tally.walks += 1;
        let whole = spectrum.value(&self.medium).max();
        let (mut collisions, mut bounces, mut edge) = (0_u32, 0_u32, None);
        let mut free = self.clearance.at(from);
        loop {
            let distance = spectrum.distance(&self.medium, draws.number());
            match self.flight(view, (from, free), w, distance, tally) {
                Flight::Collision(x) => {
                    tally.collisions += 1;
                    (collisions, bounces) = (collisions + 1, 0);
                    spectrum.collide(distance);
                    let edge_here = edge.map(|phase| Edge { length: distance, phase });
                    if !watch.collision(x, w, edge_here, spectrum, draws) {
                        return None;
                    }
                    if collisions % self.patience == 0 && !watch.plays_roulette() {
                        let left = spectrum.value(&self.medium).max() / whole;
                        if !russian_roulette(left / ROULETTE_BELOW, spectrum, draws) {
                            return None;
                        }
                    }
                    free = self.clearance.at(x);
                    if let Some((to, next)) = self.jump((x, free), spectrum, draws, watch, tally) {
                        (from, w, edge, free) = (to, next, None, self.clearance.at(to));
                        continue;
                    }
                    let next = self.scatter(w, draws);
                    let phase = self.phase(w, next);
                    watch.turned(Turn::Scattered(x, phase));
                    edge = Some(phase);
                    (from, w) = (x, next);
                }
                Flight::Boundary(at, t) => {
                    spectrum.fly(t);
                    if self.matched {
                        watch.turned(Turn::None(t));
                        spectrum.leave(&self.medium);
                        return Some(WalkExit { at, w, straight: None });
                    }
                    let at = self.flat(at);
                    if let Some(rough) = &self.rough {
                        watch.boundary(&at, -w, rough, spectrum);
                    }
                    let BsdfSample { wi: next, weight, pdf } = self.cross(&at, -w, draws)?;
                    spectrum.scale(weight);
                    let cosines = [w.dot(at.n_geometric), next.dot(at.n_geometric)];
                    if cosines[1] > 0.0 {
                        spectrum.leave(&self.medium);
                        if self.rough.is_some() {
                            watch.turned(Turn::Out(&at, pdf));
                            return Some(WalkExit { at, w: next, straight: None });
                        }
                        let straight = edge.map(|phase| Straight { from, phase, length: t, cosines });
                        return Some(WalkExit { at, w: next, straight });
                    }
                    w = next;
                    (from, edge, bounces, free) = (at.leave(w), None, bounces + 1, 0.0);
                }
                Flight::Opaque(at, t, object) => {
                    spectrum.fly(t);
                    let bsdf = &*view.scene.surface(object).bsdf;
                    w = reflected((&at, w), bsdf, (&self.medium, spectrum), draws, watch)?;
                    (from, edge, bounces, free) = (at.leave(w), None, bounces + 1, 0.0);
                }
                Flight::Lamp(hit) => {
                    spectrum.fly(hit.t);
                    watch.lamp(&hit, w, spectrum);
                    return None;
                }
                Flight::Lost(cause) => {
                    tally.losses.add(self.object, cause);
                    return None;
                }
            }
            if bounces >= MOST_SURFACES {
                tally.losses.add(self.object, Cause::Endless);
                return None;
            }
        }
    }
}

/// How a path in a medium goes on that came along `w` to an opaque surface, which faces it; `None` where it ends.
pub fn reflected(
    (at, w): (&SurfacePoint, Vec3),
    bsdf: &dyn Bsdf,
    (medium, spectrum): (&Coefficients, &mut Spectrum),
    draws: &mut PathSampler,
    watch: &mut impl WalkObserver,
) -> Option<Vec3> {
    let at = SurfacePoint { n: at.n_geometric, ..*at };
    watch.surface(&at, -w, bsdf, spectrum);
    let (before, albedo) = (spectrum.value(medium).max(), bsdf.albedo_at(&at));
    spectrum.scale(albedo);
    let left = spectrum.value(medium).max();
    if left <= 0.0 || !russian_roulette(left / before, spectrum, draws) {
        return None;
    }
    let [u, v] = draws.pair();
    let which = if bsdf.is_lambertian() { 0.0 } else { draws.number() };
    let next = bsdf.sample(&at, -w, [u, v, which])?;
    // The albedo is in already.
    spectrum.scale(Rgb::from_fn(|c| if albedo[c] > 0.0 { next.weight[c] / albedo[c] } else { 0.0 }));
    watch.turned(Turn::Reflected(&at, next.pdf));
    (at.n_geometric.dot(next.wi) > 0.0).then_some(next.wi)
}

/// Roulette: true with probability `chance`, and then the path is worth 1/`chance` more.
#[inline]
pub fn russian_roulette(chance: f32, spectrum: &mut Spectrum, draws: &mut PathSampler) -> bool {
    if chance >= 1.0 {
        return true;
    }
    if draws.number() >= chance {
        return false;
    }
    spectrum.scale(Rgb::splat(1.0 / chance));
    true
}
