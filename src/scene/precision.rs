//! Whether f32 can hold a scene, or rays have to be traced in f64. A ray that leaves a surface in f32 starts some millionths of the
//! surface's farthest coordinate away from it: too far where a body is thin, or its medium dense, for the place where it
//! stands. Decided from the meshes and media alone, before anything is built over them.

use super::doctor::COARSE;
use super::{Body, Material, Object, Surface, Translucent};
use crate::geometry::{Mesh, Precision};
use crate::math::{Aabb, DVec3};
use crate::words::{percent, short};
use rayon::prelude::*;
use std::sync::Arc;

/// The start of a ray may be off by this share of a body's thickness. On the slab of van de Hulst its reflectance falls by 1.5
/// times that: see docs/rays.md.
const THIN: f64 = 5e-4;
/// And by this share of the shortest transport mean free path, where paths are followed in a medium; by the share above of the
/// length over which light falls by 1/e, on which half spaces' reflectance depends.
const DENSE: f64 = 0.05;
/// From another surface it may be off by this share of a body's thickness: that is seen where they touch, if at all.
const CONTACT: f64 = 0.05;
/// Share of a body's area that may be thinner.
const SHARE: f64 = 0.005;
/// The first two shares, in f64: beyond this a body is warned of.
const BEYOND: f64 = 1e-3;
/// Where a ray in f64 starts, over where it starts in f32.
const DOUBLE: f64 = f64::EPSILON / f32::EPSILON as f64;
/// Points of a body's surface that are looked at.
const POINTS: u32 = 1024;

/// What rays are to be traced in.
pub(super) struct Choice {
    /// Why in f64, object by name and with its numbers; `None` for f32.
    pub why_double: Option<String>,
    /// Number of an object that f64 cannot hold either, and what is wrong with it.
    pub beyond: Vec<(usize, String)>,
}

/// For surfaces of these materials and their bodies; `walks` says in which media paths are followed from collision to collision.
pub(super) fn choose(
    objects: &[Object],
    bodies: &[Option<Arc<Body>>],
    materials: &[Material],
    walks: impl Fn(&Translucent) -> bool,
) -> Choice {
    let mut choice = Choice { why_double: None, beyond: Vec::new() };
    // What starts rays of its own; lamps do not.
    let offsets: Vec<f64> = objects
        .iter()
        .map(|o| match materials[o.material].surface {
            Surface { emission: Some(_), .. } => 0.0,
            _ => o.mesh.bounds().map_or(0.0, |bounds| Precision::Single.error(bounds.farthest())),
        })
        .collect();
    // The two largest: one of them is another object's.
    let mut worst: Vec<(usize, f64)> = offsets.iter().copied().enumerate().collect();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    worst.truncate(2);
    for object in objects {
        let Some(bounds) = object.mesh.bounds() else { continue };
        let (size, farthest) = (bounds.extent().length(), bounds.farthest());
        let step = farthest * f64::from(f32::EPSILON);
        if size > 0.0 && step > COARSE * size {
            choice.why_double = choice.why_double.or(Some(format!(
                "object {:?} is {} units large, and single precision would put its vertices on steps of {step:.1e} units",
                object.name,
                short(size)
            )));
        }
    }
    for (number, object) in objects.iter().enumerate() {
        let surface = &materials[object.material].surface;
        let (Some(medium), Some(body)) = (surface.medium(), &bodies[number]) else { continue };
        let (other, farthest) = worst.iter().find(|w| w.0 != number).copied().unwrap_or((number, 0.0));
        let probes = probes(object, body, farthest / CONTACT);
        let name = &object.name;
        let (absorbed, sigma) = (medium.sigma_a, medium.sigma_t_prime());
        let path = 1.0 / f64::from(sigma.max());
        let decay = (0..3).map(|c| (3.0 * f64::from(absorbed[c]) * f64::from(sigma[c])).sqrt()).fold(0.0, f64::max);
        let limit =
            if surface.inside.as_ref().is_some_and(&walks) { (DENSE * path).min(THIN / decay) } else { f64::INFINITY };
        let medium = || format!("{} units, and light falls by 1/e over {}", short(path), short(1.0 / decay));
        let why = if let Some((share, thickness)) = thinner(&probes, |p| p.offset / THIN) {
            Some(format!(
                "object {name:?} is {thickness} units thick on {share} of its surface, from which rays in single \
                 precision start {:.1e} units away",
                offsets[number]
            ))
        } else if let Some((share, thickness)) = thinner(&probes, |_| farthest / CONTACT) {
            Some(format!(
                "object {name:?} is {thickness} units thick on {share} of its surface; rays in single precision \
                 start {farthest:.1e} units away from object {:?}",
                objects[other].name
            ))
        } else if offsets[number] > limit {
            Some(format!(
                "the transport mean free path in object {name:?} is {}; rays in single precision start {:.1e} units away from its \
                 surface",
                medium(),
                offsets[number]
            ))
        } else {
            None
        };
        if let Some((share, thickness)) = thinner(&probes, |p| p.offset * DOUBLE / BEYOND) {
            let offset = offsets[number] * DOUBLE;
            choice.beyond.push((
                number,
                format!(
                    "it is {thickness} units thick on {share} of its surface, too thin for where it stands even in \
                     double precision: rays start {offset:.1e} units away from it, and light goes astray; make it thicker or smaller"
                ),
            ));
        } else if offsets[number] * DOUBLE > limit * BEYOND / THIN {
            let offset = offsets[number] * DOUBLE;
            choice.beyond.push((
                number,
                format!(
                    "the transport mean free path is {}: too short for its size even in double precision, in which rays start \
                     {offset:.1e} units away from it; paths inside it are wrong",
                    medium()
                ),
            ));
        }
        choice.why_double = choice.why_double.or(why);
    }
    choice
}

/// In words, of all probes the share that is thinner than `limit` of each, and the median thickness of those; `None` where
/// they are few.
fn thinner(probes: &[Probe], limit: impl Fn(&Probe) -> f64) -> Option<(String, String)> {
    let mut thin: Vec<f64> = probes.iter().filter(|p| p.thickness < limit(p)).map(|p| p.thickness.max(0.0)).collect();
    let share = thin.len() as f64 / probes.len() as f64;
    if share <= SHARE {
        return None;
    }
    thin.sort_unstable_by(f64::total_cmp);
    Some((percent(share), short(thin[thin.len() / 2])))
}

/// A point of a surface and the way inwards from it.
struct Probe {
    x: DVec3,
    inwards: DVec3,
    triangle: u32,
    /// How far from the surface a ray in f32 would start \[unit\].
    offset: f64,
    /// How far the other side is looked for \[unit\].
    reach: f64,
    /// Way to the other side; infinite beyond the reach.
    thickness: f64,
}

/// Points all over an object, with its thickness there as far as that matters, but at least up to `reach`.
fn probes(object: &Object, body: &Body, reach: f64) -> Vec<Probe> {
    let mesh = &object.mesh;
    let facing = if object.findings.inside_out() { -1.0 } else { 1.0 };
    let mut probes: Vec<Probe> = (0..POINTS)
        .map(|i| {
            // Points of a two-dimensional golden ratio: even, and the same in each run.
            let u = [0.754_877_666, 0.569_840_291].map(|k: f64| (f64::from(i) * k).fract() as f32);
            let at = body.table.sample((f64::from(i) + 0.5) / f64::from(POINTS), u);
            let largest = mesh.corners(at.triangle).map(|p| p.abs().max_element()).into_iter().fold(0.0, f64::max);
            let offset = Precision::Single.error(largest);
            Probe {
                x: mesh.point(at.triangle, at.u, at.v).x,
                inwards: -facing * mesh.scaled_normal(at.triangle).normalize_or_zero(),
                triangle: at.triangle,
                offset,
                reach: (offset / THIN).max(reach),
                thickness: f64::INFINITY,
            }
        })
        .collect();
    let axis = body.bounds.longest_axis();
    probes.sort_unstable_by(|a, b| a.x[axis].total_cmp(&b.x[axis]).then(a.triangle.cmp(&b.triangle)));
    let facing = if object.findings.mixed_edges == 0 { Some(facing) } else { None };
    let found = thicknesses(mesh, &probes, axis, facing);
    probes.iter_mut().zip(found).for_each(|(probe, thickness)| probe.thickness = thickness);
    probes
}

/// The thickness at each of `probes`, which are in order of `axis`. Only faces that look away count, where it is known which
/// do: `facing` is 1, or -1 for a mesh that is inside out.
fn thicknesses(mesh: &Mesh, probes: &[Probe], axis: usize, facing: Option<f64>) -> Vec<f64> {
    let longest = probes.iter().map(|p| p.reach).fold(0.0, f64::max);
    let none = || vec![f64::INFINITY; probes.len()];
    let add = |mut found: Vec<f64>, triangle: u32| {
        let corners = mesh.corners(triangle);
        let bounds = Aabb::around(corners);
        let first = probes.partition_point(|p| p.x[axis] < bounds.lower[axis] - longest);
        let last = probes.partition_point(|p| p.x[axis] <= bounds.upper[axis] + longest);
        for (probe, found) in probes[first..last].iter().zip(&mut found[first..last]) {
            let end = probe.x + probe.inwards * probe.reach;
            if Aabb::around([probe.x, end]).is_near(&bounds, 0.0) && triangle != probe.triangle {
                *found = found.min(probe.other_side(corners, facing).unwrap_or(f64::INFINITY));
            }
        }
        found
    };
    let nearer = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| a.min(*b)).collect();
    (0..mesh.triangles.len() as u32).into_par_iter().fold(none, add).reduce(none, nearer)
}

impl Probe {
    /// Way to a triangle, if that is within reach [MT97].
    fn other_side(&self, [a, b, c]: [DVec3; 3], facing: Option<f64>) -> Option<f64> {
        let (ab, ac, from) = (b - a, c - a, self.x - a);
        // What looks the same way is no other side; it may be the same triangle, given twice.
        let away = ab.cross(ac).dot(self.inwards);
        if away == 0.0 || facing.is_some_and(|facing| away * facing < 0.0) {
            return None;
        }
        let across = self.inwards.cross(ac);
        let inverse = 1.0 / ab.dot(across);
        let u = from.dot(across) * inverse;
        let across = from.cross(ab);
        let v = self.inwards.dot(across) * inverse;
        let t = ac.dot(across) * inverse;
        let rounding = DOUBLE * self.offset;
        let ahead = if facing.is_some() { t >= -rounding } else { t > rounding };
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && ahead && t <= self.reach).then_some(t)
    }
}
