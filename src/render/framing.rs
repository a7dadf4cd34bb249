//! What the camera gets to see: the share of the picture that each object has, and whether there is anything in it at all.

use crate::film::Window;
use crate::integrator::View;
use crate::math::{DVec3, Vec3};
use crate::query::Ray;
use crate::scene::{Object, Scene, Surface};
use rayon::prelude::*;

/// Rays to each side of the picture, at most.
const SIDE: u32 = 48;

/// For each object the share of the pixels of `window` in which it is seen first, told by a grid of rays: what is smaller
/// than a step of the grid may be missed.
pub fn shares(view: View<'_>, window: Window) -> Vec<f64> {
    let (width, height) = (window.x1 - window.x0, window.y1 - window.y0);
    let [across, down] = [width.min(SIDE), height.min(SIDE)];
    let place = |i: u32, of: u32, from: u32, length: u32| {
        let at = (f64::from(i) + 0.5) / f64::from(of) * f64::from(length);
        (from + at as u32, at.fract() as f32)
    };
    let seen = |i: u32| {
        let (x, dx) = place(i % across, across, window.x0, width);
        let (y, dy) = place(i / across, down, window.y0, height);
        view.rays.closest(&view.scene.camera.ray([x, y], [dx, dy])).map(|hit| hit.mesh as usize)
    };
    let seen: Vec<Option<usize>> = (0..across * down).into_par_iter().map(seen).collect();
    let mut counts = vec![0_u32; view.scene.objects.len()];
    seen.iter().flatten().for_each(|&object| counts[object] += 1);
    counts.into_iter().map(|n| f64::from(n) / f64::from(across * down)).collect()
}

/// Where to look instead of into the void.
#[derive(Clone, Debug, PartialEq)]
pub struct Aim {
    /// The object to look at: a translucent one if there is any, else one that is no lamp, else any.
    pub object: String,
    /// A place of it, or its middle, in the coordinates of the scene file \[unit\].
    pub at: DVec3,
    /// The angle between the direction of view and the direction there \[degrees\].
    pub degrees: f64,
}

/// `None` if any triangle reaches into the view through `window`, however small; `shares` are those of [`shares`].
pub fn nothing_in_view(view: View<'_>, window: Window, shares: &[f64]) -> Option<Aim> {
    let scene = view.scene;
    if shares.iter().any(|s| *s > 0.0) {
        return None;
    }
    let planes = planes(scene, window);
    let reaches = |object: &Object| {
        let mesh = &object.mesh;
        (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .any(|t| mesh.area(t) > 0.0 && is_cut(mesh.corners(t).map(|p| p - scene.camera.origin), &planes))
    };
    if scene.objects.iter().any(reaches) {
        return None;
    }
    aim(view)
}

/// Inward normals of the four sides of the view, and of the plane through the camera.
fn planes(scene: &Scene, window: Window) -> [DVec3; 5] {
    let direction = |x: u32, y: u32| scene.camera.ray([x, y], [0.0; 2]).direction.as_dvec3();
    let corners = [
        direction(window.x0, window.y0),
        direction(window.x0, window.y1),
        direction(window.x1, window.y1),
        direction(window.x1, window.y0),
    ];
    let middle: DVec3 = corners.into_iter().sum();
    let side = |k: usize| {
        let normal: DVec3 = corners[k].cross(corners[(k + 1) % 4]);
        if normal.dot(middle) < 0.0 { -normal } else { normal }
    };
    [side(0), side(1), side(2), side(3), scene.camera.forward().as_dvec3()]
}

/// Whether anything of a triangle is left when what lies outside of the planes through the origin is cut off.
fn is_cut(triangle: [DVec3; 3], planes: &[DVec3; 5]) -> bool {
    let mut polygon = triangle.to_vec();
    for plane in planes {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &p) in polygon.iter().enumerate() {
            let next = polygon[(i + 1) % polygon.len()];
            let [a, b] = [p, next].map(|q| q.dot(*plane));
            if a > 0.0 {
                kept.push(p);
            }
            if (a > 0.0) != (b > 0.0) {
                kept.push(p + (next - p) * (a / (a - b)));
            }
        }
        polygon = kept;
    }
    !polygon.is_empty()
}

/// What to look at.
fn aim(view: View<'_>) -> Option<Aim> {
    let scene = view.scene;
    let rank = |object: &&Object| match scene.materials[object.material].surface {
        Surface { inside: Some(_), .. } => 0,
        Surface { emission: None, .. } => 1,
        _ => 2,
    };
    let object = scene.objects.iter().filter(|o| o.mesh.bounds().is_some()).min_by_key(rank)?;
    let middle = object.mesh.bounds()?.centre();
    let origin = scene.camera.origin;
    // The middle of a ring is empty: then the corner nearest to it.
    let meets = view.rays.closest(&Ray::new(origin, (middle - origin).as_vec3().normalize_or(Vec3::Z))).is_some();
    let nearest = |a: &&DVec3, b: &&DVec3| a.distance_squared(middle).total_cmp(&b.distance_squared(middle));
    let at = if meets { middle } else { *object.mesh.positions.iter().min_by(nearest)? };
    let degrees = (at - origin).angle_between(scene.camera.forward().as_dvec3()).to_degrees();
    Some(Aim { object: object.name.clone(), at: at + scene.centre, degrees })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The view down the z axis, 90 degrees wide and high.
    const PLANES: [DVec3; 5] = [
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::new(-1.0, 0.0, 1.0),
        DVec3::new(0.0, 1.0, 1.0),
        DVec3::new(0.0, -1.0, 1.0),
        DVec3::new(0.0, 0.0, 1.0),
    ];

    #[test]
    fn a_triangle_is_in_view_if_any_part_of_it_is() {
        let at = |x: f64, y: f64, z: f64, size: f64| {
            let corner = DVec3::new(x, y, z);
            is_cut([corner, corner + DVec3::X * size, corner + DVec3::Y * size], &PLANES)
        };
        assert!(at(0.0, 0.0, 5.0, 1e-9), "however small");
        assert!(at(-1000.0, -1000.0, 1.0, 1e4), "its corners are all outside, its middle is not");
        assert!(!at(0.0, 0.0, -5.0, 1.0), "behind");
        // In the box around the view's corner, but beyond both of its sides.
        assert!(!is_cut([DVec3::new(2.0, 0.5, 1.0), DVec3::new(0.5, 2.0, 1.0), DVec3::new(2.0, 2.0, 1.0)], &PLANES));
        assert!(at(-5.5, 0.0, 5.0, 1.0) && !at(-6.5, 0.0, 5.0, 1.0), "the left side");
    }
}
