//! Where the faces of two solids, or of one, pass through each other or lie in each other.
//!
//! Everything is decided up to a length, the gap that rays need between two surfaces. f64 is exact far below it.

use super::box_tree::NodePair;
use super::solid::{Face, Solid};
use crate::math::{DVec2, DVec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Where two faces meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// A point of both [unit].
    pub at: DVec3,
    /// The parts of the one and the other solid.
    pub parts: [u32; 2],
}

/// What was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Meeting {
    /// The insides have points in common next to a line that both surfaces share.
    pub crossing: Option<Contact>,
    /// Faces lie in each other over an area.
    pub touching: Option<Contact>,
    /// A crossing or a touching of what is not looked for: small parts, a part with itself.
    pub minor: Option<Contact>,
    /// Area over which such faces lie in each other \[unit²\].
    pub minor_area: f64,
    /// There were too many pairs of faces to look at.
    pub unfinished: bool,
}

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seek {
    /// Both, until the first crossing.
    Crossing,
    /// Faces that lie in each other alone, until the first.
    Touching,
}

enum Kind {
    Crossing,
    /// Over this area [unit²].
    Touching(f64),
}

/// Pairs of faces that a task looks at, at most: bounds the time for a million needles in one box.
const MOST_PAIRS: usize = 1 << 22;
/// Angles below this are not told from 0, whatever the lengths [rad].
const ANGLE: f64 = 1e-4;

/// How `a` and `b` meet, which may be the same: then how it meets itself, but for edges and corners that its faces share. Less than `gap`
/// [unit] apart is as good as in one place; what has only lines or points in common does not meet. Pairs of parts that `major` does not
/// pick are counted, but end nothing.
pub fn meeting(a: &Solid, b: &Solid, gap: f64, seek: Seek, major: impl Fn([u32; 2]) -> bool + Sync) -> Meeting {
    let tasks = a.tree.tasks(&b.tree, gap as f32);
    let done = AtomicUsize::new(usize::MAX);
    let work = |(index, task): (usize, &NodePair)| {
        let (mut found, mut seen) = (Meeting::default(), 0);
        if done.load(Ordering::Relaxed) < index {
            return found;
        }
        a.tree.pairs(&b.tree, *task, gap as f32, |i, j| {
            seen += 1;
            found.unfinished = seen > MOST_PAIRS;
            let Some((kind, at)) = meet((a, i), (b, j), gap, seek) else { return found.unfinished };
            let contact = Contact { at, parts: [a.faces[i as usize].part, b.faces[j as usize].part] };
            let crossing = matches!(kind, Kind::Crossing);
            if !major(contact.parts) {
                found.minor = found.minor.or(Some(contact));
                if let Kind::Touching(area) = kind {
                    found.minor_area += area;
                }
                return found.unfinished;
            }
            if crossing {
                found.crossing = Some(contact);
            } else {
                found.touching = found.touching.or(Some(contact));
            }
            let ended = crossing || seek == Seek::Touching;
            if ended {
                done.fetch_min(index, Ordering::Relaxed);
            }
            ended || found.unfinished
        });
        found
    };
    // The first task that found something decides, so that threads change nothing.
    let all: Vec<Meeting> = tasks.par_iter().enumerate().map(work).collect();
    let crossing = all.iter().find_map(|m| m.crossing);
    Meeting {
        crossing,
        touching: all.iter().find_map(|m| m.touching),
        minor: all.iter().find_map(|m| m.minor),
        minor_area: all.iter().map(|m| m.minor_area).sum(),
        unfinished: crossing.is_none() && all.iter().any(|m| m.unfinished),
    }
}

/// Two triangles that lie in each other over an area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lying {
    /// The triangles of the one and the other mesh.
    pub triangles: [u32; 2],
    /// The parts that they belong to.
    pub parts: [u32; 2],
}

/// All faces of `a` and `b` that lie in each other; of a solid with itself, those of different parts. `None` where there are too many in
/// one place to look at.
pub fn lying(a: &Solid, b: &Solid, gap: f64) -> Option<Vec<Lying>> {
    let work = |task: &NodePair| {
        let (mut found, mut seen) = (Vec::new(), 0);
        a.tree.pairs(&b.tree, *task, gap as f32, |i, j| {
            seen += 1;
            let (one, two) = (&a.faces[i as usize], &b.faces[j as usize]);
            let apart = !std::ptr::eq(a, b) || one.part != two.part;
            if apart && meet((a, i), (b, j), gap, Seek::Touching).is_some() {
                found.push(Lying { triangles: [one.triangle, two.triangle], parts: [one.part, two.part] });
            }
            seen > MOST_PAIRS
        });
        (seen <= MOST_PAIRS).then_some(found)
    };
    let all: Option<Vec<Vec<Lying>>> = a.tree.tasks(&b.tree, gap as f32).par_iter().map(work).collect();
    all.map(|found| found.concat())
}

impl Solid {
    /// Whether two faces may lie in each other or pass through each other: of two parts if they come near each other, of one part if they do.
    pub(super) fn may_meet(&self, i: u32, j: u32, gap: f64) -> bool {
        let (one, two) = (&self.faces[i as usize], &self.faces[j as usize]);
        if one.part == two.part {
            return meet((self, i), (self, j), gap, Seek::Crossing).is_some();
        }
        one.bounds().is_near(&two.bounds(), gap)
    }
}

/// How two faces meet.
fn meet((a, i): (&Solid, u32), (b, j): (&Solid, u32), gap: f64, seek: Seek) -> Option<(Kind, DVec3)> {
    let (one, two) = (&a.faces[i as usize], &b.faces[j as usize]);
    if !one.bounds().is_near(&two.bounds(), gap) {
        return None;
    }
    let (n, m) = (one.scaled_normal(), two.scaled_normal());
    let (size, other_size) = (n.length(), m.length());
    if size == 0.0 || other_size == 0.0 {
        return None;
    }
    let (n, m) = (n / size, m / other_size);
    let same = std::ptr::eq(a, b);
    let shared = if same { one.places.iter().filter(|p| two.places.contains(p)).count() } else { 0 };
    if shared == 2 && one.part == two.part {
        // Neighbours meet only where they are folded onto each other.
        let folded = n.dot(m) < ANGLE * ANGLE - 1.0;
        return overlap(one, two, n, gap).filter(|_| folded);
    }
    let above = |face: &Face, n: DVec3, from: DVec3| face.corners.map(|c| n.dot(c - from));
    let (heights, other_heights) = (above(two, n, one.corners[0]), above(one, m, two.corners[0]));
    let one_sided = |h: &[f64; 3]| h.iter().all(|h| *h > gap) || h.iter().all(|h| *h < -gap);
    if one_sided(&heights) || one_sided(&other_heights) {
        return None;
    }
    let flat = |h: &[f64; 3]| h.iter().all(|h| h.abs() <= gap);
    if flat(&heights) || flat(&other_heights) {
        // The two sides of a thin wall are no contact: it is the solid that lies between them.
        let wall = same && n.dot(m) < 0.0 && heights.iter().sum::<f64>() < -0.01 * gap;
        return if wall { None } else { overlap(one, two, n, gap) };
    }
    if seek == Seek::Touching {
        return None;
    }
    // Along the line in which the planes meet.
    let along = n.cross(m).try_normalize()?;
    let (first, second) = (cut(one, &other_heights, gap, along)?, cut(two, &heights, gap, along)?);
    let origin = one.corners[0];
    let at = |cut: &Cut, k: usize| along.dot(cut.ends[k] - origin);
    let (from, to) = (at(&first, 0).max(at(&second, 0)), at(&first, 1).min(at(&second, 1)));
    if to - from <= 4.0 * gap {
        return None;
    }
    let middle = |cut: &Cut| {
        let share = (0.5 * (from + to) - at(cut, 0)) / (at(cut, 1) - at(cut, 0));
        cut.ends[0].lerp(cut.ends[1], share)
    };
    let point = middle(&first);
    // Neighbours on a surface that hardly bends are in each other's planes, but for less than the gap, along edges that lie apart.
    if point.distance(middle(&second)) > 8.0 * gap {
        return None;
    }
    let height = |face: &Face, size: f64| {
        let [a, b, c] = face.corners;
        size / (b - a).length().max((c - b).length()).max((a - c).length())
    };
    let slack = ANGLE + 8.0 * gap / height(one, size).min(height(two, other_size));
    let arcs = [arc((a, i), n, &first, along)?, arc((b, j), m, &second, along)?];
    common(arcs, along, slack).then_some((Kind::Crossing, point))
}

/// What a face has in common with the plane of another.
struct Cut {
    /// From, to, in the direction of the line.
    ends: [DVec3; 2],
    /// Numbers of the two corners, if it is an edge.
    edge: Option<[usize; 2]>,
}

/// `heights` of the corners above the plane; less than `gap` is none.
fn cut(face: &Face, heights: &[f64; 3], gap: f64, along: DVec3) -> Option<Cut> {
    let on = |k: usize| heights[k].abs() <= gap;
    let corners = face.corners;
    let mut ends: Vec<DVec3> = (0..3).filter(|&k| on(k)).map(|k| corners[k]).collect();
    let edge = [[0, 1], [1, 2], [2, 0]].into_iter().find(|[p, q]| on(*p) && on(*q));
    for [p, q] in [[0, 1], [1, 2], [2, 0]] {
        if !on(p) && !on(q) && heights[p] * heights[q] < 0.0 {
            ends.push(corners[p].lerp(corners[q], heights[p] / (heights[p] - heights[q])));
        }
    }
    let [mut p, mut q] = ends[..] else { return None };
    if along.dot(q - p) < 0.0 {
        (p, q) = (q, p);
    }
    Some(Cut { ends: [p, q], edge })
}

/// The directions across a line of the surface that lead into the solid: from `first`, over -`normal`, by `angle` [rad].
struct Arc {
    first: DVec3,
    inwards: DVec3,
    angle: f64,
}

/// The solid next to the cut of a face: half of all directions within the face, those up to the next face at an edge. `None` at a rim.
fn arc((solid, index): (&Solid, u32), normal: DVec3, cut: &Cut, along: DVec3) -> Option<Arc> {
    let face = &solid.faces[index as usize];
    let inwards = -normal;
    let Some([p, q]) = cut.edge else {
        return Some(Arc { first: normal.cross(along), inwards, angle: std::f64::consts::PI });
    };
    let edge = (face.corners[q] - face.corners[p]).normalize_or_zero();
    let across = |f: &Face, third: DVec3| {
        let v = third - face.corners[p];
        (f.scaled_normal() != DVec3::ZERO).then(|| (v - edge * v.dot(edge)).normalize_or_zero())
    };
    let first = across(face, face.corners[3 - p - q])?;
    let ends = [face.places[p], face.places[q]];
    let mut angle = f64::INFINITY;
    for mate in solid.mates(index, ends) {
        let third = (0..3).find(|&k| !ends.contains(&mate.places[k]))?;
        let Some(to) = across(mate, mate.corners[third]) else { continue };
        let turn = to.dot(inwards).atan2(to.dot(first));
        let turn = if turn < 1e-9 { turn + std::f64::consts::TAU } else { turn };
        angle = angle.min(turn);
    }
    angle.is_finite().then_some(Arc { first, inwards, angle })
}

/// Whether two arcs have more than `slack` [rad] in common.
fn common(arcs: [Arc; 2], along: DVec3, slack: f64) -> bool {
    use std::f64::consts::TAU;
    let right = along.any_orthonormal_vector();
    let up = along.cross(right);
    // Start and length of each, counter-clockwise.
    let [a, b] = arcs.map(|arc| {
        let start = arc.first.dot(up).atan2(arc.first.dot(right));
        if arc.first.cross(arc.inwards).dot(along) > 0.0 { (start, arc.angle) } else { (start - arc.angle, arc.angle) }
    });
    let offset = (b.0 - a.0).rem_euclid(TAU);
    let part = |from: f64, to: f64| (to.min(a.1) - from.max(0.0)).max(0.0);
    part(offset, offset + b.1) + part(offset - TAU, offset - TAU + b.1) > slack
}

/// The area that two faces have in common, seen along `n`, the normal of the first, and a point of it; `None` where it is no wider
/// than rounding makes the edges of faces side by side.
fn overlap(one: &Face, two: &Face, n: DVec3, gap: f64) -> Option<(Kind, DVec3)> {
    let (right, up) = n.any_orthonormal_pair();
    let origin = one.corners[0];
    let flat = |p: DVec3| DVec2::new((p - origin).dot(right), (p - origin).dot(up));
    let clip = one.corners.map(flat);
    let mut polygon: Vec<DVec2> = two.corners.map(flat).to_vec();
    for k in 0..3 {
        let (from, edge) = (clip[k], clip[(k + 1) % 3] - clip[k]);
        let side = |p: DVec2| edge.perp_dot(p - from);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &p) in polygon.iter().enumerate() {
            let q = polygon[(i + 1) % polygon.len()];
            let (here, there) = (side(p), side(q));
            if here >= 0.0 {
                kept.push(p);
            }
            if here * there < 0.0 {
                kept.push(p.lerp(q, here / (here - there)));
            }
        }
        polygon = kept;
    }
    let first = *polygon.first()?;
    let (mut twice, mut around, mut middle) = (0.0, 0.0, DVec2::ZERO);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        twice += (p - first).perp_dot(q - first);
        around += p.distance(q);
        middle += p / polygon.len() as f64;
    }
    let wide = twice.abs() > 4.0 * gap * around;
    wide.then(|| (Kind::Touching(0.5 * twice.abs()), origin + right * middle.x + up * middle.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::test_shapes::{self, joined};
    use crate::geometry::{Mesh, RawMesh, Seams, sphere};

    const GAP: f64 = 1e-6;

    fn cuboid(centre: DVec3, half: DVec3, n: u32) -> RawMesh {
        test_shapes::cuboid(centre, half, n, false)
    }

    fn cube(x: f64, y: f64, z: f64, n: u32) -> RawMesh {
        cuboid(DVec3::new(x, y, z), DVec3::splat(1.0), n)
    }

    fn solid(mesh: &RawMesh) -> Solid {
        let mesh: Mesh = mesh.recentred(DVec3::ZERO);
        Solid::new(&mesh)
    }

    fn kind(a: &RawMesh, b: &RawMesh) -> &'static str {
        let (one, two) = (solid(a), solid(b));
        let found = meeting(&one, &two, GAP, Seek::Crossing, |_| true);
        let reversed = meeting(&two, &one, GAP, Seek::Crossing, |_| true);
        assert_eq!(
            (found.crossing.is_some(), found.touching.is_some()),
            (reversed.crossing.is_some(), reversed.touching.is_some())
        );
        // As parts of one mesh the two are to each other what they are as two meshes.
        let both = solid(&joined(a.clone(), b));
        if both.parts.len() == 2 && both.seams.repeated == 0 {
            let itself = meeting(&both, &both, GAP, Seek::Crossing, |[a, b]| a != b);
            assert_eq!(itself.crossing.is_some(), found.crossing.is_some());
        }
        let inside = |a: &Solid, b: &Solid| b.winding(a.point_of(0), |_| true) == Some(1);
        match (found.crossing, found.touching) {
            (Some(_), _) => "crossing",
            (None, Some(_)) => "touching",
            _ if inside(&one, &two) || inside(&two, &one) => "nested",
            _ => "apart",
        }
    }

    #[test]
    fn kinds_are_told_apart() {
        let one = cube(0.0, 0.0, 0.0, 1);
        let bar = |half| cuboid(DVec3::ZERO, half, 1);
        for (other, expected) in [
            (cube(2.5, 0.0, 0.0, 1), "apart"),
            (cube(2.00001, 0.0, 0.0, 1), "apart"),
            (cube(1.5, 0.3, 0.2, 1), "crossing"),
            (cube(1.0, 0.0, 0.0, 3), "crossing"),
            (cube(0.0, 0.0, 0.0, 1), "crossing"),
            (cube(0.0, 0.0, 0.0, 3), "crossing"),
            // A whole face, part of one, less than rounding away, other triangles.
            (cube(2.0, 0.0, 0.0, 1), "touching"),
            (cube(2.0, 0.0, 0.0, 3), "touching"),
            (cube(2.0, 0.7, -1.1, 2), "touching"),
            (cube(2.0 + 1e-7, 0.0, 0.0, 2), "touching"),
            (cube(2.0 - 1e-7, 0.0, 0.0, 2), "touching"),
            // Along an edge, at a corner.
            (cube(2.0, 2.0, 0.0, 1), "apart"),
            (cube(2.0, 2.0, 0.7, 3), "apart"),
            (cube(2.0, 2.0, 2.0, 1), "apart"),
            // Inside, with no contact, with one face, one edge in common.
            (cuboid(DVec3::ZERO, DVec3::splat(0.5), 1), "nested"),
            (cuboid(DVec3::new(0.5, 0.0, 0.0), DVec3::splat(0.5), 1), "crossing"),
            (cuboid(DVec3::new(0.5, 0.5, 0.0), DVec3::splat(0.5), 2), "crossing"),
            // Bars through it: no corner of the one is inside the other, and faces in one plane.
            (bar(DVec3::new(3.0, 0.5, 0.5)), "crossing"),
            (bar(DVec3::new(3.0, 1.0, 0.5)), "crossing"),
            (bar(DVec3::new(3.0, 1.0, 1.0)), "crossing"),
            // Cut in its middle, where a face of the bar's ring of edges lies in the face of the cube.
            (
                joined(cuboid(DVec3::new(1.5, 0.0, 0.0), DVec3::new(0.5, 0.4, 0.4), 1), &cube(9.0, 0.0, 0.0, 1)),
                "touching",
            ),
            (sphere(DVec3::new(1.5, 0.0, 0.0), 0.8, 12, 24), "crossing"),
            (sphere(DVec3::new(2.0, 0.0, 0.0), 1.0, 12, 24), "apart"),
            (sphere(DVec3::new(0.2, 0.1, 0.0), 0.3, 12, 24), "nested"),
        ] {
            assert_eq!(kind(&one, &other), expected, "{:?}", solid(&other).bounds());
        }
    }

    /// A tube whose rings of corners lie in the faces that it passes through: no face of it crosses a plane.
    #[test]
    fn what_changes_sides_at_its_edges_crosses() {
        let one = cube(0.0, 0.0, 0.0, 1);
        for n in [2, 4] {
            let through = cuboid(DVec3::new(1.0, 0.1, 0.0), DVec3::new(1.0, 0.4, 0.4), n);
            assert_eq!(kind(&one, &through), "crossing");
            assert_eq!(kind(&one, &cuboid(DVec3::new(2.0, 0.1, 0.0), DVec3::new(1.0, 0.4, 0.4), n)), "touching");
        }
    }

    /// Turned and moved, faces lie in each other up to rounding alone.
    #[test]
    fn rounding_hides_no_contact() {
        let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
        let turn = glam::DAffine3::from_mat3_translation(turn, DVec3::new(0.3, 0.2, -0.1));
        for (other, expected) in [
            (cube(2.0, 0.3, 0.4, 2), "touching"),
            (cube(2.00001, 0.3, 0.4, 2), "apart"),
            (cube(2.0, 2.0, 0.0, 1), "apart"),
            (cube(0.0, 0.0, 0.0, 2), "crossing"),
            (cube(1.99, 0.0, 0.0, 2), "crossing"),
        ] {
            let placed = |mesh: &RawMesh| mesh.clone().placed(turn);
            assert_eq!(kind(&placed(&cube(0.0, 0.0, 0.0, 1)), &placed(&other)), expected);
        }
    }

    #[test]
    fn cavities_and_bodies_in_them_wind_once_at_most() {
        let (outer, hole) = (cube(0.0, 0.0, 0.0, 1), cuboid(DVec3::ZERO, DVec3::splat(0.6), 2).flipped());
        let hollow = solid(&joined(outer, &hole));
        assert!(hollow.is_closed() && hollow.parts.len() == 2 && !hollow.is_convex(GAP));
        let at = |x: f64| hollow.winding(DVec3::new(x, 0.0, 0.0), |_| true);
        assert_eq!([at(0.0), at(0.8), at(1.2)], [Some(0), Some(1), Some(0)]);
        assert_eq!(at(1.0), None, "on the surface");
        assert_eq!(
            (hollow.hidden_share(), meeting(&hollow, &hollow, GAP, Seek::Crossing, |_| true)),
            (0.0, Meeting::default())
        );
        let twice = solid(&joined(cube(0.0, 0.0, 0.0, 1), &cuboid(DVec3::ZERO, DVec3::splat(0.5), 1)));
        assert!((twice.hidden_share() - 0.2).abs() < 0.01, "{}", twice.hidden_share());
        assert!(solid(&cube(0.0, 0.0, 0.0, 3)).is_convex(GAP));
    }

    #[test]
    fn edges_tell_sheets_walls_and_holes() {
        let mut open = cube(0.0, 0.0, 0.0, 2);
        open.triangles.pop();
        let seams = solid(&open).seams;
        assert_eq!((seams.open, seams.mixed, seams.walls), (3, 0, 0));
        assert!((seams.hole_share - 0.5 / 24.0).abs() < 1e-9, "{seams:?}");
        // Two cubes that share the corners of one face, which is there once.
        let mut wall = joined(cube(0.0, 0.0, 0.0, 1), &cube(2.0, 0.0, 0.0, 1));
        let shared = |t: &[u32; 3]| t.iter().all(|i| wall.positions[*i as usize].x == 1.0);
        let last = wall.triangles.iter().rposition(shared).unwrap();
        let pair: Vec<usize> = (0..=last).filter(|&i| i >= 12 && shared(&wall.triangles[i])).collect();
        for &i in pair.iter().rev() {
            wall.triangles.remove(i);
        }
        assert_eq!((solid(&wall).seams.walls, solid(&wall).is_closed()), (4, false));
        // An edge of four is no fault: two closed parts.
        let edge = solid(&joined(cube(0.0, 0.0, 0.0, 1), &cube(2.0, 2.0, 0.0, 1)));
        assert_eq!((edge.seams, edge.parts.len(), edge.is_closed()), (Seams::default(), 2, true));
    }
}
