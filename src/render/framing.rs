//! What the camera gets to see: the share of the picture that each object has, and whether there is anything in it at all.

use crate::film::Window;
use crate::geometry::{Side, reaches_into};
use crate::integrator::View;
use crate::math::{DVec3, Vec3};
use crate::query::Ray;
use crate::scene::{Camera, Object, Scene, Surface};
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
        view.rays.closest(&view.scene.camera.grid_ray([x, y], [dx, dy], i)).map(|hit| hit.mesh as usize)
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
    let sights = sights(scene, window);
    let reaches = |object: &Object| {
        let mesh = &object.mesh;
        let seen = |t| sights.iter().any(|sides| reaches_into(mesh.corners(t), sides));
        (0..mesh.triangles.len() as u32).into_par_iter().any(|t| mesh.area(t) > 0.0 && seen(t))
    };
    if scene.objects.iter().any(reaches) {
        return None;
    }
    aim(view)
}

/// The sides of what is seen through `window` from each place of the eye: the lens's middle and places along its rim, between which
/// nothing much is seen that none of them sees.
fn sights(scene: &Scene, window: Window) -> Vec<[Side; 5]> {
    let camera = &scene.camera;
    camera.eyes().into_iter().map(|eye| sides(camera, window, eye)).collect()
}

/// The four sides of the view from one place of the lens, and the plane through the camera.
fn sides(camera: &Camera, window: Window, eye: [f32; 2]) -> [Side; 5] {
    let corner = |x: u32, y: u32| {
        let ray = camera.ray_from([x, y], [0.0; 2], eye);
        (ray.origin, ray.direction.as_dvec3())
    };
    let corners = [
        corner(window.x0, window.y0),
        corner(window.x0, window.y1),
        corner(window.x1, window.y1),
        corner(window.x1, window.y0),
    ];
    let middle = corners.iter().map(|(from, towards)| from + towards).sum::<DVec3>() / 4.0;
    let side = |k: usize| {
        let [(at, towards), (beside, there)] = [corners[k], corners[(k + 1) % 4]];
        let normal = towards.cross(beside - at + there);
        Side { at, normal: if normal.dot(middle - at) < 0.0 { -normal } else { normal } }
    };
    [side(0), side(1), side(2), side(3), Side { at: camera.origin, normal: camera.forward().as_dvec3() }]
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
    const SIDES: [Side; 5] = [
        Side { at: DVec3::ZERO, normal: DVec3::new(1.0, 0.0, 1.0) },
        Side { at: DVec3::ZERO, normal: DVec3::new(-1.0, 0.0, 1.0) },
        Side { at: DVec3::ZERO, normal: DVec3::new(0.0, 1.0, 1.0) },
        Side { at: DVec3::ZERO, normal: DVec3::new(0.0, -1.0, 1.0) },
        Side { at: DVec3::ZERO, normal: DVec3::new(0.0, 0.0, 1.0) },
    ];

    #[test]
    fn a_triangle_is_in_view_if_any_part_of_it_is() {
        let at = |x: f64, y: f64, z: f64, size: f64| {
            let corner = DVec3::new(x, y, z);
            reaches_into([corner, corner + DVec3::X * size, corner + DVec3::Y * size], &SIDES)
        };
        assert!(at(0.0, 0.0, 5.0, 1e-9), "however small");
        assert!(at(-1000.0, -1000.0, 1.0, 1e4), "its corners are all outside, its middle is not");
        assert!(!at(0.0, 0.0, -5.0, 1.0), "behind");
        // In the box around the view's corner, but beyond both of its sides.
        assert!(!reaches_into(
            [DVec3::new(2.0, 0.5, 1.0), DVec3::new(0.5, 2.0, 1.0), DVec3::new(2.0, 2.0, 1.0)],
            &SIDES
        ));
        assert!(at(-5.5, 0.0, 5.0, 1.0) && !at(-6.5, 0.0, 5.0, 1.0), "the left side");
    }
}
