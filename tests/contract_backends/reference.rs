//! What a ray may and must find, by trying every triangle in f64.
//!
//! Both backends move a triangle's corners to the ray's origin and go on in f32. So their errors are a few roundings of
//! R, the corners' largest distance to the origin by coordinate: whether a ray passes inside is certain if it passes the edges
//! at more than `ROUNDINGS` epsilon R, and anything may be said nearer than that.

use marmor::geometry::Mesh;
use marmor::math::{DVec2, DVec3};
use marmor::query::{Hit, Ray};

/// Error bound of f32 arithmetic in the backends, in units of epsilon: a chain of about 16 operations, each off by half of
/// it, with a factor of two to spare.
pub const ROUNDINGS: f64 = 16.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meets {
    Surely,
    /// Within rounding of an edge, or a triangle seen edge-on.
    Perhaps,
    Never,
}

/// A ray against one triangle.
#[derive(Clone, Copy, Debug)]
pub struct Exam {
    pub meets: Meets,
    pub mesh: u32,
    pub triangle: u32,
    /// Distance and weights at the triangle's plane, and how far f32 may be off.
    pub t: f64,
    pub u: f64,
    pub v: f64,
    pub t_error: f64,
    /// How far off the distance may be if it is computed as volume over area and not from the corners' distances: without
    /// bound for needles and triangles seen edge-on.
    pub t_error_by_plane: f64,
    pub weight_error: f64,
}

pub fn examine(meshes: &[&Mesh], ray: &Ray) -> Vec<Exam> {
    let mut exams = Vec::new();
    for (mesh_number, mesh) in meshes.iter().enumerate() {
        for triangle in 0..mesh.triangles.len() as u32 {
            if mesh.area(triangle) > 0.0 {
                exams.push(examine_one(mesh, mesh_number as u32, triangle, ray));
            }
        }
    }
    exams
}

fn distance_to_segment(a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let s = if along == DVec2::ZERO { 0.0 } else { (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0) };
    (a + along * s).length()
}

fn examine_one(mesh: &Mesh, mesh_number: u32, triangle: u32, ray: &Ray) -> Exam {
    let d = ray.direction.as_dvec3();
    let kz = d.abs().max_position();
    let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
    let p: [DVec3; 3] = mesh.corners(triangle).map(|c| c - ray.origin);
    // The corners as seen along the ray, which passes through (0, 0).
    let seen = p.map(|p| DVec2::new(p[kx] - d[kx] / d[kz] * p[kz], p[ky] - d[ky] / d[kz] * p[kz]));
    let edge = |c: usize| seen[(c + 2) % 3].perp_dot(seen[(c + 1) % 3]);
    let e = [edge(0), edge(1), edge(2)];
    let det = e[0] + e[1] + e[2];
    let inside = det != 0.0 && (e.iter().all(|&e| e >= 0.0) || e.iter().all(|&e| e <= 0.0));
    let to_edge = (0..3).map(|c| distance_to_segment(seen[c], seen[(c + 1) % 3])).fold(f64::INFINITY, f64::min);

    let r = p.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let rounding = ROUNDINGS * f64::from(f32::EPSILON) * r;
    let meets = match (inside, to_edge > rounding) {
        (true, true) => Meets::Surely,
        (false, true) => Meets::Never,
        (_, false) => Meets::Perhaps,
    };

    let longest = (0..3).map(|c| (p[c] - p[(c + 1) % 3]).length()).fold(0.0, f64::max);
    let weight_error = rounding * longest / det.abs();
    let depths = p.map(|p| p[kz]);
    let (near, far) = (
        depths.iter().copied().fold(f64::INFINITY, f64::min),
        depths.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    let w = e.map(|e| e / det);
    // A triangle that is met lies between its nearest and its farthest corner, however badly its weights are known.
    let (depth, depth_error) = if meets == Meets::Surely {
        (
            w[0] * depths[0] + w[1] * depths[1] + w[2] * depths[2],
            rounding + (weight_error * (far - near)).min(far - near),
        )
    } else {
        (0.5 * (near + far), rounding + 0.5 * (far - near))
    };
    Exam {
        meets,
        mesh: mesh_number,
        triangle,
        t: depth / d[kz],
        u: w[1],
        v: w[2],
        t_error: depth_error / d[kz].abs(),
        t_error_by_plane: (depth_error + weight_error * longest) / d[kz].abs(),
        weight_error,
    }
}

/// The nearest hit by [MT97] in f64: distance and triangle.
pub fn nearest_in_f64(mesh: &Mesh, ray: &Ray) -> Option<(f64, u32)> {
    let (origin, direction) = (ray.origin, ray.direction.as_dvec3());
    let mut nearest: Option<(f64, u32)> = None;
    for triangle in 0..mesh.triangles.len() as u32 {
        let [a, b, c] = mesh.corners(triangle);
        let (ab, ac, from) = (b - a, c - a, origin - a);
        let across = direction.cross(ac);
        let inverse = 1.0 / ab.dot(across);
        let u = from.dot(across) * inverse;
        let across = from.cross(ab);
        let v = direction.dot(across) * inverse;
        let t = ac.dot(across) * inverse;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        if inside && t > f64::from(ray.t_min) && t < f64::from(ray.t_max) && nearest.is_none_or(|n| t < n.0) {
            nearest = Some((t, triangle));
        }
    }
    nearest
}

/// What is wrong with a backend's answer, if anything is; `by_plane` says how it computes distances.
pub fn verdict(exams: &[Exam], ray: &Ray, found: Option<&Hit>, by_plane: bool) -> Result<(), String> {
    let error = |e: &Exam| if by_plane { e.t_error_by_plane } else { e.t_error };
    let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
    let sure = exams
        .iter()
        .filter(|e| e.meets == Meets::Surely && e.t - error(e) > t_min && e.t + error(e) < t_max)
        .min_by(|a, b| (a.t + error(a)).total_cmp(&(b.t + error(b))));
    let Some(hit) = found else {
        return sure.map_or(Ok(()), |e| Err(format!("misses {e:?}")));
    };
    let Some(e) = exams.iter().find(|e| (e.mesh, e.triangle) == (hit.mesh, hit.triangle)) else {
        return Err("hits a triangle without area, or none of the scene".to_string());
    };
    // Where all weights are rounding, their signs say nothing, and Embree takes signs near zero for a hit.
    let edge_on = by_plane && e.weight_error > 0.5;
    let off = (f64::from(hit.t) - e.t).abs();
    if !(hit.t > ray.t_min && hit.t < ray.t_max) {
        Err("outside its open interval".to_string())
    } else if e.meets == Meets::Never && !edge_on {
        Err(format!("hits what it cannot: {e:?}"))
    } else if off > error(e) {
        Err(format!("at a wrong distance: {e:?}"))
    } else if e.meets == Meets::Surely && ((hit.u - e.u).abs() > e.weight_error || (hit.v - e.v).abs() > e.weight_error)
    {
        Err(format!("with wrong weights: {e:?}"))
    } else if let Some(nearer) = sure.filter(|s| f64::from(hit.t) - error(e) > s.t + error(s)) {
        Err(format!("beyond the nearer {nearer:?}"))
    } else {
        Ok(())
    }
}

/// Whether the scene leaves the backend a choice on this ray.
pub fn is_open(exams: &[Exam]) -> bool {
    exams.iter().any(|e| e.meets == Meets::Perhaps)
}
