//! Which translucent objects lie in one another: two media at one place have no meaning here.

use crate::geometry::Mesh;
use crate::math::DVec3;
use crate::scene::{Scene, Surface};

/// Vertices of each object that are looked for inside another.
const PROBES: usize = 128;

/// Names of two translucent objects of which one has a vertex inside the other.
pub fn nested(scene: &Scene) -> Option<[&str; 2]> {
    let bodies: Vec<_> = scene
        .objects
        .iter()
        .filter(|o| matches!(scene.materials[o.material].surface, Surface::Translucent(_)))
        .collect();
    for a in &bodies {
        for b in &bodies {
            if !std::ptr::eq(*a, *b) && has_vertex_in(&a.mesh, &b.mesh) {
                return Some([&a.name, &b.name]);
            }
        }
    }
    None
}

fn has_vertex_in(a: &Mesh, b: &Mesh) -> bool {
    let Some((lo, hi)) = b.bounds() else { return false };
    let inside_box = |p: &&DVec3| p.cmpgt(lo).all() && p.cmplt(hi).all();
    let candidates: Vec<&DVec3> = a.positions.iter().filter(inside_box).collect();
    let step = candidates.len().div_ceil(PROBES).max(1);
    candidates.into_iter().step_by(step).any(|p| winds_around(b, *p))
}

/// Whether the mesh winds around `p`: its solid angle over 4π [VOS83] is above one half.
fn winds_around(mesh: &Mesh, p: DVec3) -> bool {
    let angle: f64 = (0..mesh.triangles.len() as u32)
        .map(|t| {
            let [a, b, c] = mesh.corners(t).map(|q| q - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let above: f64 = a.dot(DVec3::cross(b, c));
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * above.atan2(below)
        })
        .sum();
    angle.abs() > 2.0 * std::f64::consts::PI * (1.0 + 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere;

    fn ball(x: f64, radius: f64) -> Mesh {
        sphere(DVec3::new(x, 0.0, 0.0), radius, 16, 32).recentred(DVec3::ZERO)
    }

    #[test]
    fn apart_is_apart_and_inside_is_inside() {
        let (one, other, small) = (ball(0.0, 1.0), ball(2.1, 1.0), ball(0.2, 0.3));
        assert!(!has_vertex_in(&one, &other) && !has_vertex_in(&other, &one));
        assert!(has_vertex_in(&small, &one) && !has_vertex_in(&one, &small));
        assert!(has_vertex_in(&ball(1.5, 1.0), &one), "overlap");
    }
}
