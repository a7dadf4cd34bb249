//! What of even light a body lets through unscattered.

use super::Plan;
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use crate::optics::reflect;
use crate::query::Ray;
use crate::sampling::cosine_hemisphere;
use crate::scene::View;

/// Directions at a point; means over neighbours even out the rest.
const DIRECTIONS: u8 = 8;
/// Times that light is mirrored inside. In the slab that would be a share of less than 1e-9 at η = 1.5.
const MOST_MIRRORED: u32 = 8;

/// The share of even light that enters the body of `plan` at `at`, flat as the triangle it lies on, and leaves it without being scattered; by
/// reciprocity, that of the light that leaves there. `u` picks the directions.
pub fn straight(plan: &Plan, view: View<'_>, at: &SurfacePoint, u: [f32; 2]) -> Rgb {
    let (mut sum, mut entered) = (Rgb::BLACK, 0.0);
    for k in 0..DIRECTIONS {
        let shifted = [f32::from(k) / f32::from(DIRECTIONS), f32::from(k) * 0.618_034];
        let w = cosine_hemisphere(at.n, [0, 1].map(|i| (u[i] + shifted[i]).fract()));
        let mut more = [shifted[1].fract(), shifted[0], u[0]].into_iter();
        let passed = plan.body.boundary.passed(w.dot(at.n));
        if let Some((inside, weight)) = plan.body.boundary.enter(at.n, w, || more.next().unwrap_or(0.5)) {
            sum += through(plan, view, at, inside) * (passed * weight);
        }
        entered += passed;
    }
    if entered > 0.0 { sum * (1.0 / entered) } else { Rgb::BLACK }
}

/// What leaves of light inside at `at` that goes along `w`. None where it comes to another body: paths beside the models end there too.
fn through(plan: &Plan, view: View<'_>, at: &SurfacePoint, mut w: Vec3) -> Rgb {
    let sigma_t = plan.medium().sigma_t();
    let (mut left, mut out, mut from) = (Rgb::WHITE, Rgb::BLACK, at.leave(w));
    for _ in 0..MOST_MIRRORED {
        let mut ray = Ray::new(from, w);
        let (there, t) = loop {
            let Some(hit) = view.rays.closest(&ray).filter(|hit| hit.mesh == plan.body.object()) else { return out };
            let there = view.outwards(&hit);
            if plan.body.union.as_ref().is_none_or(|union| !union.hides(hit.triangle, there.x)) {
                break (there, hit.t);
            }
            ray.t_min = hit.t;
        };
        let cosine = there.n_geometric.dot(w);
        if cosine <= 0.0 {
            return out;
        }
        left = left * sigma_t.map(|s| (-s * t).exp());
        let mirrored = plan.body.boundary.reflected_inside(cosine);
        out += left * (1.0 - mirrored);
        left *= mirrored;
        w = reflect(-w, -there.n_geometric);
        from = there.leave(w);
    }
    out
}
