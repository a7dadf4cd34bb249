//! Light from a lamp straight to a collision, through the boundary: directions that are likely to leave towards it.

use super::body::{Body, Flight};
use super::draws::Draws;
use super::spectrum::Spectrum;
use crate::geometry::{AreaTable, SurfacePoint};
use crate::integrator::{View, WalkTally};
use crate::light::emitted;
use crate::math::{Frame, Rgb, Vec3};
use crate::optics::{refract, transmittance};
use crate::query::Ray;
use crate::scene::{Scene, Surface};
use std::f32::consts::{PI, TAU};

/// A lamp that is small as seen from a body: worth aiming at.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// The emissive object.
    pub object: u32,
    /// A ball around it [unit].
    centre: Vec3,
    radius: f32,
    /// Chance of being picked, in proportion to its power.
    chance: f32,
}

/// A lamp is aimed at if it is at least this many of its own radii away from the body.
const LEAST_DISTANCE: f32 = 1.2;
/// Chance to aim; else a direction of the phase function is taken.
const AIMED: f32 = 0.5;

/// The lamps to aim at from the object number `body`.
pub fn aims(scene: &Scene, body: u32) -> Vec<Aim> {
    let ball = |object: u32| {
        let (lo, hi) = scene.objects[object as usize].mesh.bounds()?;
        Some((0.5 * lo + 0.5 * hi, 0.5 * (hi - lo).length()))
    };
    let Some((here, size)) = ball(body) else { return Vec::new() };
    let mut aims = Vec::new();
    for object in 0..scene.objects.len() as u32 {
        let Surface::Emissive { radiance, two_sided } = scene.surface(object) else { continue };
        let (Some((centre, radius)), Some(table)) =
            (ball(object), AreaTable::new(&scene.objects[object as usize].mesh))
        else {
            continue;
        };
        let power = table.area() as f32 * radiance.mean() * if *two_sided { 2.0 } else { 1.0 };
        if power > 0.0 && centre.distance(here) - size > LEAST_DISTANCE * radius {
            aims.push(Aim { object, centre, radius, chance: power });
        }
    }
    let sum: f32 = aims.iter().map(|a| a.chance).sum();
    for aim in &mut aims {
        aim.chance /= sum;
    }
    aims
}

/// The directions inside that leave into a cone around a lamp, as if the whole boundary were one plane.
struct Window {
    /// Outward normal of the plane.
    n: Vec3,
    axis: Vec3,
    /// Cosine of half the cone's angle.
    cosine: f32,
    eta: f32,
}

impl Window {
    /// The plane where light from the middle of the lamp would pass on its way to `x`: after the straight line's plane
    /// comes that of the line refracted there.
    fn new(view: View<'_>, body: &Body, aim: &Aim, x: Vec3, tally: &mut WalkTally) -> Option<Self> {
        let straight = (aim.centre - x).try_normalize()?;
        let first = boundary(view, body, x, straight, tally)?;
        let refracted = refract((aim.centre - first.0.x).try_normalize()?, first.0.n_geometric, body.eta);
        let second = refracted.and_then(|inwards| boundary(view, body, x, -inwards, tally));
        let at = second.unwrap_or(first).0;
        let to_lamp = aim.centre - at.x;
        let distance = to_lamp.length();
        let sine = aim.radius / distance;
        (sine < 1.0).then(|| Self {
            n: at.n_geometric,
            axis: to_lamp / distance,
            cosine: ((1.0 - sine) * (1.0 + sine)).sqrt(),
            eta: body.eta,
        })
    }

    /// 1 - cos of half the cone's angle, without cancellation.
    fn opening(&self) -> f32 {
        (1.0 - self.cosine * self.cosine) / (1.0 + self.cosine)
    }

    fn sample(&self, [u, v]: [f32; 2]) -> Option<Vec3> {
        let fall = u * self.opening();
        let (sin, cos) = (TAU * v).sin_cos();
        let sine = (fall * (2.0 - fall)).max(0.0).sqrt();
        let outside = Frame::about(self.axis).to_world(Vec3::new(sine * cos, sine * sin, 1.0 - fall)).normalize();
        if outside.dot(self.n) <= 0.0 {
            return None;
        }
        refract(outside, self.n, self.eta).map(|inwards| -inwards)
    }

    /// Density of [`Self::sample`] [1/sr]: that of the cone times η² cosθ_inside / cosθ_outside.
    fn pdf(&self, w: Vec3) -> f32 {
        let inside = w.dot(self.n);
        if inside <= 0.0 {
            return 0.0;
        }
        let Some(outside) = refract(-w, -self.n, 1.0 / self.eta) else { return 0.0 };
        let cosine = outside.dot(self.n);
        if cosine <= 0.0 || outside.dot(self.axis) < self.cosine {
            return 0.0;
        }
        self.eta * self.eta * inside / (cosine * 2.0 * PI * self.opening())
    }
}

fn boundary(view: View<'_>, body: &Body, x: Vec3, w: Vec3, tally: &mut WalkTally) -> Option<(SurfacePoint, f32)> {
    match body.flight(view, x, w, f32::INFINITY, tally) {
        Flight::Boundary(at, t) => Some((at, t)),
        _ => None,
    }
}

/// Radiance that lamps send straight to the collision at `x`, through the boundary, scattered there against `w`, in which
/// the path from the camera came: an estimate with the path's weight in it.
///
/// The direction comes from the phase function or from the window of a lamp, with the weight of both together. What lies
/// deep inside is asked seldom. Light reflected inside before it leaves is not in it.
pub fn aimed_light(
    view: View<'_>,
    body: &Body,
    x: Vec3,
    w: Vec3,
    spectrum: &Spectrum,
    draws: &mut Draws,
    tally: &mut WalkTally,
) -> Rgb {
    let deep = (-body.least_extinction * body.clearance.at(x).max(0.0)).exp();
    let chance = deep.max(LEAST_CHANCE);
    if chance < 1.0 && draws.number() >= chance {
        return Rgb::BLACK;
    }
    let mut pick = draws.number();
    let Some(aim) = body.aims.iter().find(|a| {
        pick -= a.chance;
        pick < 0.0
    }) else {
        return Rgb::BLACK;
    };
    let window = Window::new(view, body, aim, x, tally);
    let aimed = draws.number() < AIMED;
    let u = draws.pair();
    let direction = match &window {
        Some(window) if aimed => match window.sample(u) {
            Some(direction) => direction,
            None => return Rgb::BLACK,
        },
        _ => body.scatter(w, draws),
    };
    let phase = body.phase(w, direction);
    let pdf = window.map_or(phase, |window| AIMED * window.pdf(direction) + (1.0 - AIMED) * phase);
    let Some((at, length)) = boundary(view, body, x, direction, tally) else { return Rgb::BLACK };
    let inwards = -at.n_geometric;
    let Some(out) = refract(-direction, inwards, 1.0 / body.eta) else { return Rgb::BLACK };
    tally.rays += 1;
    let Some(hit) = view.rays.closest(&Ray::new(at.leave(out), out)) else { return Rgb::BLACK };
    if hit.mesh != aim.object || pdf <= 0.0 {
        return Rgb::BLACK;
    }
    let leaving = transmittance(1.0 / body.eta, direction.dot(at.n_geometric));
    let passed = body.medium.sigma_t.map(|s| (-s * length).exp());
    let light = emitted(view.scene, &hit, out) * passed * (leaving * phase / (pdf * aim.chance * chance));
    spectrum.value(&body.medium) * light
}

/// The smallest chance of asking.
const LEAST_CHANCE: f32 = 0.01;
