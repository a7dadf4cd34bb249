//! What is inside a solid: how often its closed parts wind around a point.

use super::solid::{Face, Solid};
use crate::math::DVec3;
use rayon::prelude::*;

/// Directions tried before a point counts as one of the surface.
const TRIES: u32 = 16;
/// Points that tell how much of a surface is hidden.
const PROBES: usize = 8192;
/// A volume below this share of what its lengths could span is not told from 0.
const FLAT: f64 = 1e-12;

impl Solid {
    /// How often the parts that `counts` picks wind around `p`: 1 inside, 0 outside of what is sound. `None` on the surface.
    ///
    /// Faces that a segment to a far point crosses are counted by their sides. A segment that comes too near to an edge for f64
    /// to tell its sides is given up for another one, so that no answer depends on rounding. Open parts have no sides: for
    /// them it is the whole number nearest to the solid angle over 4π [VOS83].
    pub fn winding(&self, p: DVec3, counts: impl Fn(u32) -> bool) -> Option<i32> {
        let bounds = self.bounds()?;
        if !bounds.contains(p) {
            return Some(0);
        }
        let wanted = |face: &Face| counts(face.part);
        if (0_u32..).zip(&self.parts).any(|(i, part)| !part.closed && counts(i)) {
            let angle: f64 = self.faces.iter().filter(|f| wanted(f)).map(|f| solid_angle(f, p)).sum();
            return Some((angle / (4.0 * std::f64::consts::PI)).round() as i32);
        }
        let far = 4.0 * bounds.extent().length();
        (0..TRIES).find_map(|i| self.crossings(p, p + direction(i) * far, |_, face| wanted(face)))
    }

    /// Sides of the faces that a segment crosses, added up; `None` where one cannot be told.
    fn crossings(&self, p: DVec3, q: DVec3, wanted: impl Fn(u32, &Face) -> bool) -> Option<i32> {
        let (mut sum, mut clear) = (0, true);
        self.tree.along(p, q, |i| {
            let face = &self.faces[i as usize];
            if clear && wanted(i, face) {
                match crossing(face, p, q) {
                    Some(side) => sum += side,
                    None => clear = false,
                }
            }
        });
        clear.then_some(sum)
    }

    /// The share of the surface that does not have the outside before it: it lies inside another part of the solid, in another face of it,
    /// or looks the wrong way. From some points, evenly spread over the area. Most of several directions decide, for holes let
    /// some of them out.
    pub fn hidden_share(&self) -> f64 {
        let area: f64 = self.parts.iter().map(|p| p.area).sum();
        let Some(bounds) = self.bounds().filter(|_| area > 0.0) else { return 0.0 };
        let far = 4.0 * bounds.extent().length();
        let (mut below, mut next, mut probes) = (0.0, 0, Vec::with_capacity(PROBES));
        for (i, face) in (0_u32..).zip(&self.faces) {
            below += 0.5 * face.scaled_normal().length();
            while next < PROBES && (next as f64 + 0.5) * area < below * PROBES as f64 {
                probes.push((i, next));
                next += 1;
            }
        }
        let needed = if self.is_closed() { 1 } else { 5 };
        let hidden = |&(face, number): &(u32, usize)| {
            let at = &self.faces[face as usize];
            // Points of a two-dimensional golden ratio.
            let [u, v] = [0.754_877_666, 0.569_840_291].map(|k: f64| (number as f64 * k).fract());
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let [a, b, c] = at.corners;
            let (p, n) = (a + (b - a) * u + (c - a) * v, at.scaled_normal());
            let above = |i: u32| {
                let d = direction(i + number as u32 % 64);
                p + (if d.dot(n) < 0.0 { -d } else { d }) * far
            };
            let told: Vec<i32> =
                (0..TRIES).filter_map(|i| self.crossings(p, above(i), |j, _| j != face)).take(needed).collect();
            2 * told.iter().filter(|&&sum| sum != 0).count() >= told.len().max(1)
        };
        let count = probes.par_iter().filter(|probe| hidden(probe)).count();
        count as f64 / probes.len().max(1) as f64
    }

    /// Whether all of `inner` is inside, where their surfaces do not cross.
    pub fn holds_all(&self, inner: &Self) -> bool {
        (0..inner.parts.len()).all(|i| self.winding(inner.point_of(i), |_| true).is_some_and(|w| w != 0))
    }

    /// Whether a part of `inner` is inside, where their surfaces do not cross.
    pub fn holds(&self, inner: &Self) -> bool {
        let Some(bounds) = self.bounds() else { return false };
        inner.parts.iter().enumerate().any(|(i, part)| {
            part.bounds.is_near(&bounds, 0.0) && self.winding(inner.point_of(i), |_| true).is_some_and(|w| w != 0)
        })
    }

    /// A point of a part that lies in its largest face.
    pub fn point_of(&self, part: usize) -> DVec3 {
        let [a, b, c] = self.faces[self.parts[part].largest as usize].corners;
        a * 0.37 + b * 0.29 + c * 0.34
    }

    /// Whether a face is within `gap` [unit] of `p`.
    pub fn is_near(&self, p: DVec3, gap: f64) -> bool {
        let (mut near, reach) = (false, DVec3::splat(gap));
        self.tree.along(p - reach, p + reach, |i| near |= distance(&self.faces[i as usize], p) <= gap);
        // The box of a leaf that the diagonal misses may still be near.
        [DVec3::X, DVec3::Y, DVec3::Z].into_iter().for_each(|axis| {
            self.tree.along(p - axis * gap, p + axis * gap, |i| near |= distance(&self.faces[i as usize], p) <= gap);
        });
        near
    }
}

/// 1 where the segment leaves through the face, -1 where it comes in, 0 where it misses it; `None` where that is too near to
/// an edge to tell, or `p` is on the face.
fn crossing(face: &Face, p: DVec3, q: DVec3) -> Option<i32> {
    let [a, b, c] = face.corners.map(|x| x - p);
    let d = q - p;
    // Sides of the three edges, seen along the segment.
    let side = |a: DVec3, b: DVec3| sign(d, a, b);
    let sides = [side(a, b), side(b, c), side(c, a)];
    if sides.contains(&1) && sides.contains(&-1) {
        return Some(0);
    }
    let (e, f) = (b - a, c - a);
    // Which side of the plane each end is on.
    let (near, far) = (sign(-a, e, f), sign(d - a, e, f));
    if near != 0 && near == far {
        return Some(0);
    }
    (near != 0 && far != 0 && !sides.contains(&0)).then_some(if far > 0 { 1 } else { -1 })
}

/// Sign of a · (b x c); 0 where rounding may have made it.
fn sign(a: DVec3, b: DVec3, c: DVec3) -> i32 {
    let volume = a.dot(b.cross(c));
    if volume.abs() <= FLAT * a.length() * b.length() * c.length() { 0 } else { volume.signum() as i32 }
}

fn solid_angle(face: &Face, p: DVec3) -> f64 {
    let [a, b, c] = face.corners.map(|x| x - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(below)
}

pub(super) fn distance(face: &Face, p: DVec3) -> f64 {
    to_triangle(face.corners.map(|x| x - p), face.scaled_normal().normalize_or_zero())
}

/// Distance of the origin to the triangle with these corners and the unit normal `n`, zero if it has none.
pub(super) fn to_triangle([a, b, c]: [DVec3; 3], n: DVec3) -> f64 {
    let foot = n * a.dot(n);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*a - foot).cross(*b - foot).dot(n) >= 0.0);
    if n != DVec3::ZERO && inside {
        return foot.length();
    }
    let to_edge = |a: DVec3, b: DVec3| {
        let e = b - a;
        let t = if e == DVec3::ZERO { 0.0 } else { (-a.dot(e) / e.length_squared()).clamp(0.0, 1.0) };
        (a + e * t).length()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

/// Directions that no grid and no symmetry has.
fn direction(i: u32) -> DVec3 {
    let i = f64::from(i);
    DVec3::new((0.3711 + 1.3247 * i).sin(), (1.1273 + 2.2361 * i).sin(), (2.7813 + 3.1573 * i).cos())
        .normalize_or(DVec3::X)
}
