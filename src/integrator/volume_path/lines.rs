//! Straight lines to lights, through boundaries that do not refract: of bodies whose index is that of air.
//!
//! What is asked for over such a line must not be counted again by the path that goes on and meets the light: `sight.rs`.

use super::interior::Interior;
use super::nesting::{Stack, faces};
use crate::geometry::SurfacePoint;
use crate::integrator::View;
use crate::math::{Rgb, Vec3};
use crate::query::{Hit, Ray};
use std::borrow::Cow;

/// The scene for lines that ask for light.
#[derive(Clone, Copy)]
pub struct Lines<'a> {
    pub view: View<'a>,
    /// One for each object.
    pub bodies: &'a [Option<Interior>],
    /// Whether any of them is matched; else nothing lets a line through.
    pub matched: bool,
}

/// Boundaries on a line after which it is given up.
const MOST_CROSSED: u32 = 10_000;

/// What a line comes to.
enum Step {
    /// What ends it.
    Blocked,
    /// Something that it goes on behind, with this around it, and this share of the light.
    On(SurfacePoint, Option<Stack>, Rgb),
}

impl Lines<'_> {
    /// The share of the light along `ray` that arrives, from its end to its start, which these bodies are `around`: 0 behind what is opaque or
    /// refracts, exp(-σ_t d) for what it goes through.
    pub fn passed(&self, ray: &Ray, around: &Stack, rays: &mut u64) -> Rgb {
        if !self.matched {
            *rays += 1;
            return if self.view.rays.occluded(ray) { Rgb::BLACK } else { Rgb::WHITE };
        }
        let end = ray.t_max.is_finite().then(|| ray.origin + ray.direction.as_dvec3() * f64::from(ray.t_max));
        let w = ray.direction.normalize();
        let (mut ray, mut stack, mut last, mut depth) = (*ray, Cow::Borrowed(around), None, Rgb::BLACK);
        let mut tint = Rgb::WHITE;
        for _ in 0..MOST_CROSSED {
            *rays += 1;
            let hit = self.view.rays.closest(&ray);
            let length = hit.map_or(ray.t_max, |hit| hit.t) * ray.direction.length();
            if let Some(body) = self.top(&stack) {
                if !length.is_finite() {
                    return Rgb::BLACK;
                }
                depth += body.extinction().map(|s| s * length);
            }
            let arrived = |tint: Rgb| depth.map(|d| (-d).exp()) * tint;
            let Some(hit) = hit else { return arrived(tint) };
            let on_it = last.replace((hit.mesh, hit.triangle)) == Some((hit.mesh, hit.triangle));
            let Step::On(at, after, passed) = self.step(&hit, &stack, w, on_it) else { return Rgb::BLACK };
            tint = tint * passed;
            if let Some(after) = after {
                stack = Cow::Owned(after);
            }
            let from = at.leave(w);
            ray = match end {
                Some(end) if (end - from).dot(w.as_dvec3()) <= 0.0 => return arrived(tint),
                Some(end) => Ray::between(from, end),
                None => Ray::new(from, w),
            };
        }
        Rgb::BLACK
    }

    fn top(&self, stack: &Stack) -> Option<&Interior> {
        self.bodies[stack.top()? as usize].as_ref()
    }

    /// As `nesting::walk` takes it.
    fn step(&self, hit: &Hit, stack: &Stack, w: Vec3, on_it: bool) -> Step {
        let Some(body) = &self.bodies[hit.mesh as usize] else { return Step::Blocked };
        let at = self.view.outwards(hit);
        if on_it {
            return Step::On(SurfacePoint { error: 2.0 * at.error, ..at }, None, Rgb::WHITE);
        }
        let faces = faces(self.view, stack, body, hit, &at, w);
        let Some(after) = stack.crossed(&faces.turns, self.view.scene.nests()) else { return Step::Blocked };
        let straight = |stack: &Stack| self.top(stack).is_none_or(|body| body.matched);
        if after.top() != stack.top() && !(straight(stack) && straight(&after)) {
            return Step::Blocked;
        }
        // Only a body that stands alone has any.
        let tint = body.tint(&at);
        Step::On(SurfacePoint { error: at.error.max(faces.margin), ..at }, Some(after), tint)
    }
}
