//! What the camera sees on a body: the first surface of a path, of which both parts are followed.

use super::camera::CameraPath;
use super::interior::Interior;
use super::nesting::Entry;
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use crate::optics::{reflect, reflectance, refract, transmittance};
use crate::query::{Hit, Ray};

/// Both parts of what the camera sees on a body: the mirror image of what is around it, and the light from inside.
pub fn both_parts(path: &mut CameraPath<'_>, hit: &Hit, direction: Vec3) {
    let Some(entry) = path.entry(hit, direction) else { return };
    let body = entry.body;
    if body.rough.is_some() {
        let at = path.view.point(hit, direction);
        let mirrors = path.method.options.specular;
        if let Some(ray) = path.meet_rough(entry, (&at, -direction), mirrors) {
            path.trace(ray);
        }
        return;
    }
    let (spectrum, draws) = (path.spectrum, path.draws.clone());
    if path.method.options.specular && !body.matched {
        let at = path.view.point(hit, direction);
        let n = shading_normal(body, &at, direction);
        path.spectrum.scale(Rgb::splat(reflectance(body.eta, -n.dot(direction))));
        let w = reflect(-direction, n);
        path.draws = draws.fork(1);
        path.trace(Ray::new(at.leave(w), w));
    }
    (path.spectrum, path.draws) = (spectrum, draws);
    (path.direct, path.other, path.order) = (1.0, 1.0, 0);
    path.turn(None);
    if let Some(ray) = enter(path, entry, hit, direction) {
        path.trace(ray);
    }
}

/// From the camera into bodies and through them; the ray on which the path leaves.
pub fn enter<'a>(path: &mut CameraPath<'a>, entry: Entry<'a>, hit: &Hit, direction: Vec3) -> Option<Ray> {
    let body = entry.body;
    let at = path.view.point(hit, direction);
    if body.rough.is_some() {
        return path.meet_rough(entry, (&at, -direction), false);
    }
    if body.matched {
        return path.let_in(entry, &at, direction);
    }
    let n = shading_normal(body, &at, direction);
    let passed = transmittance(body.eta, -n.dot(direction));
    if passed <= 0.0 {
        return None;
    }
    path.spectrum.scale(Rgb::splat(passed));
    path.let_in(entry, &at, refract(-direction, n, body.eta)?)
}

/// The normal of both parts. As in `subsurface` what leaves towards the viewer is shaded with the interpolated one, but not
/// where light refracted by that, at η below 1, would not go through the triangle.
fn shading_normal(body: &Interior, at: &SurfacePoint, direction: Vec3) -> Vec3 {
    let n = at.normal_seen_from(-direction);
    let through = |w: Vec3| w.dot(at.n_geometric) < 0.0;
    if refract(-direction, n, body.eta).is_none_or(through) { n } else { at.n_geometric }
}
