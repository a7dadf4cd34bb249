//! What is wrong with a mesh, and a mended one: faces without area or there twice, holes, edges of three faces, faces
//! that look the wrong way. Read first: [`examine`]; docs/robustness.md says what marmor does about each finding.

use super::weld::{Seam, moved_to, seam};
use super::{Mesh, RawMesh};
use crate::math::{Aabb, DVec3};
use crate::words::counted;
use rayon::slice::ParallelSliceMut as _;
use serde::Serialize;
use std::collections::HashMap;

/// What [`examine`] found. Vertices at exactly the same place count as one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Findings {
    /// All triangles.
    pub triangles: usize,
    /// Triangles without area, repeated corners among them.
    pub zero_area: usize,
    /// Triangles with the same three corners as an earlier one.
    pub duplicates: usize,
    /// Edges of a single triangle: the rims of holes.
    pub open_edges: usize,
    /// Rims that lie along each other and want welding, if there are any.
    pub seam: Option<Seam>,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles run along them the same way: one of the two faces the wrong way.
    pub mixed_edges: usize,
    /// Enclosed volume \[unit³\], below zero if the faces look inwards; `None` where the surface has a rim, or faces of
    /// mixed directions.
    pub volume: Option<f64>,
    /// Integral of the mean curvature over the surface [unit], above 0 on a convex body: half the sum over edges of length
    /// times angle \[Steiner\]. With [`Self::volume`].
    pub bend: Option<f64>,
}

impl Findings {
    /// Whether a closed surface looks inwards.
    pub fn inside_out(&self) -> bool {
        self.volume.is_some_and(|v| v < 0.0)
    }

    /// Whether [`mended`] would change anything but holes and edges of three faces, which it leaves.
    pub fn can_be_mended(&self) -> bool {
        self.zero_area > 0 || self.duplicates > 0 || self.mixed_edges > 0 || self.seam.is_some() || self.inside_out()
    }
}

/// Looks at the mesh as it is rendered.
pub fn examine(mesh: &Mesh) -> Findings {
    let point = |i: u32| mesh.positions[i as usize];
    let welded = mesh.places();
    let faces = Faces::new(&mesh.triangles, &welded, &point);
    let mut found = Findings {
        triangles: mesh.triangles.len(),
        zero_area: faces.zero_area,
        duplicates: mesh.triangles.len() - faces.zero_area - faces.kept.len(),
        ..Findings::default()
    };
    let mut open = Vec::new();
    let edges = faces.edges();
    for uses in edges.chunk_by(|a, b| a.0 >> 1 == b.0 >> 1) {
        match uses {
            [edge] => open.push(ends(edge)),
            [a, b] => found.mixed_edges += usize::from(a.0 == b.0),
            _ => found.non_manifold_edges += 1,
        }
    }
    found.open_edges = open.len();
    found.seam = faces.seam(&open, &point).map(|(seam, _)| seam);
    if found.open_edges == 0 && found.mixed_edges == 0 && !faces.kept.is_empty() {
        let all: Vec<[u32; 3]> = faces.kept.iter().map(|&t| faces.corners[t as usize]).collect();
        found.volume = Some(volume(&all, &point));
        found.bend = Some(bend(&faces, &edges, &point));
    }
    found
}

/// See [`Findings::bend`]; edges of more than two triangles are left out.
fn bend(faces: &Faces, edges: &[Edge], point: &impl Fn(u32) -> DVec3) -> f64 {
    let corners = |t: u32| faces.corners[t as usize].map(point);
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    let edge = |uses: &[Edge]| {
        let [(key, a), (_, b)] = *uses else { return 0.0 };
        let (this, that) = (corners(a), corners(b));
        let [from, to] = [key >> 32, (key & u64::from(u32::MAX)) >> 1].map(|i| point(i as u32));
        let (n, m) = (normal(this), normal(that));
        // Convex where the other triangle lies below this one's plane.
        let middle = (that[0] + that[1] + that[2]) / 3.0;
        let side = -(middle - from).dot(n);
        (to - from).length() * n.cross(m).length().atan2(n.dot(m)).copysign(side)
    };
    0.5 * edges.chunk_by(|a, b| a.0 >> 1 == b.0 >> 1).map(edge).sum::<f64>()
}

/// What [`mended`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Mended {
    /// The corners that were welded to others.
    pub welded: Option<Seam>,
    /// Triangles without area that were removed.
    pub zero_area: usize,
    /// Repeated triangles that were removed.
    pub duplicates: usize,
    /// Triangles whose face was turned.
    pub turned: usize,
}

impl std::fmt::Display for Mended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(seam) = self.welded {
            let Seam { within, share, corners, .. } = seam;
            let corners = counted(corners, "corner", "corners");
            write!(f, "{corners} welded to others within {within:.1e} units ({share:.0e} of its size), ")?;
        }
        let Self { zero_area, duplicates, turned, .. } = self;
        let (flat, twice) =
            (counted(*zero_area, "triangle", "triangles"), counted(*duplicates, "repeated one", "repeated ones"));
        write!(f, "{flat} without area and {twice} removed, {turned} turned")
    }
}

/// The mesh with rims that lie along each other welded (see [`Seam`]), without faces that have no area or repeat an earlier one, and with faces turned so that neighbours agree and
/// closed parts look outwards. Parts are joined at edges of two faces. A closed part inside the box of another one is a
/// cavity and keeps the direction that most of its faces have, as do parts with a rim. Holes stay open.
pub fn mended(mesh: RawMesh) -> (RawMesh, Mended) {
    let point = |i: u32| mesh.positions[i as usize];
    let mut first_at = welded(mesh.positions.len(), point, |_| 0);
    let mut faces = Faces::new(&mesh.triangles, &first_at, &point);
    let open: Vec<[u32; 2]> = faces
        .edges()
        .chunk_by(|a, b| a.0 >> 1 == b.0 >> 1)
        .filter(|uses| uses.len() == 1)
        .map(|uses| ends(&uses[0]))
        .collect();
    let seam = faces.seam(&open, &point);
    let mut moves = HashMap::new();
    if let Some((_, moved)) = &seam {
        for (i, first) in (0_u32..).zip(&mut first_at) {
            *first = moved_to(moved, *first);
            // Corners at one place keep their own numbers; those that move take the other's.
            if point(i) != point(*first) {
                moves.insert(i, *first);
            }
        }
        faces = Faces::new(&mesh.triangles, &first_at, &point);
    }
    let mut done = Mended {
        welded: seam.map(|(seam, _)| seam),
        zero_area: faces.zero_area,
        duplicates: mesh.triangles.len() - faces.zero_area - faces.kept.len(),
        turned: 0,
    };
    let turn = faces.turned(&point);
    done.turned = turn.iter().filter(|&&t| t).count();
    let pick = |t: u32, triple: [u32; 3]| if turn[t as usize] { [triple[0], triple[2], triple[1]] } else { triple };
    let triangles =
        faces.kept.iter().map(|&t| pick(t, mesh.triangles[t as usize].map(|i| moved_to(&moves, i)))).collect();
    let normals = mesh.normals.map(|mut normals| {
        normals.triangles =
            faces.kept.iter().map(|&t| normals.triangles[t as usize].map(|triple| pick(t, triple))).collect();
        normals
    });
    let uv = mesh.uv.map(|uv| {
        let of = |&t: &u32| uv[t as usize].map(|[a, b, c]| if turn[t as usize] { [a, c, b] } else { [a, b, c] });
        faces.kept.iter().map(of).collect()
    });
    // Triangles have other numbers now.
    let parts = super::Parts::default();
    (RawMesh { triangles, normals, uv, parts, ..mesh }, done)
}

/// For each vertex the first one of its group at the same place.
pub(super) fn welded(count: usize, point: impl Fn(u32) -> DVec3, group: impl Fn(u32) -> u32) -> Vec<u32> {
    // + 0.0 makes -0 and 0 one place.
    let mut order: Vec<(([u64; 3], u32), u32)> =
        (0..count as u32).map(|i| ((point(i).to_array().map(|x| (x + 0.0).to_bits()), group(i)), i)).collect();
    order.par_sort_unstable();
    let mut first_at = vec![0; count];
    for group in order.chunk_by(|a, b| a.0 == b.0) {
        group.iter().for_each(|&(_, i)| first_at[i as usize] = group[0].1);
    }
    first_at
}

impl Mesh {
    /// For each vertex the first one at the same place, of those that share places with it.
    pub(super) fn places(&self) -> Vec<u32> {
        let group = |i: u32| self.groups.get(i as usize).copied().unwrap_or(0);
        welded(self.positions.len(), |i| self.positions[i as usize], group)
    }
}

/// Six times the signed volume over 6, about the first corner so that places far off lose no digits.
fn volume(triangles: &[[u32; 3]], point: &impl Fn(u32) -> DVec3) -> f64 {
    let Some(origin) = triangles.first().map(|t| point(t[0])) else { return 0.0 };
    let corner = |i: u32| point(i) - origin;
    triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

/// The triangles that count, with welded corners.
struct Faces {
    corners: Vec<[u32; 3]>,
    /// Triangles with area, each set of corners once, in order.
    kept: Vec<u32>,
    zero_area: usize,
}

/// Lower corner, higher corner and direction in one number, and the triangle: edges with the same corners sort together.
type Edge = (u64, u32);

/// The two corners of an edge.
fn ends(edge: &Edge) -> [u32; 2] {
    [(edge.0 >> 32) as u32, (edge.0 as u32) >> 1]
}

impl Faces {
    fn new(triangles: &[[u32; 3]], welded: &[u32], point: &impl Fn(u32) -> DVec3) -> Self {
        let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|i| welded[i as usize])).collect();
        let has_area = |[a, b, c]: [u32; 3]| {
            let (a, b, c) = (point(a), point(b), point(c));
            (b - a).cross(c - a).length() > 0.0
        };
        let mut sorted: Vec<([u32; 3], u32)> = (0_u32..)
            .zip(&corners)
            .filter(|(_, t)| has_area(**t))
            .map(|(i, t)| {
                let mut key = *t;
                key.sort_unstable();
                (key, i)
            })
            .collect();
        let zero_area = triangles.len() - sorted.len();
        sorted.par_sort_unstable();
        sorted.dedup_by_key(|entry| entry.0);
        let mut kept: Vec<u32> = sorted.into_iter().map(|(_, i)| i).collect();
        kept.sort_unstable();
        Self { corners, kept, zero_area }
    }

    /// All edges of the kept triangles, sorted.
    fn edges(&self) -> Vec<Edge> {
        let mut edges: Vec<Edge> = Vec::with_capacity(3 * self.kept.len());
        for &t in &self.kept {
            let c = self.corners[t as usize];
            edges.extend((0..3).map(|k| {
                let (from, to) = (c[k], c[(k + 1) % 3]);
                // Indices stay below 2^31: the reader of OBJ files sees to it.
                (u64::from(from.min(to)) << 32 | u64::from(from.max(to)) << 1 | u64::from(from > to), t)
            }));
        }
        edges.par_sort_unstable();
        edges
    }

    /// What welding the `open` edges would close.
    fn seam(&self, open: &[[u32; 2]], point: &impl Fn(u32) -> DVec3) -> Option<(Seam, HashMap<u32, u32>)> {
        let kept = || self.kept.iter().map(|&t| self.corners[t as usize]);
        open.first()?;
        let corners = kept().flatten().map(point);
        let collapses = |moved: &HashMap<u32, u32>| {
            kept().any(|t| {
                let [a, b, c] = t.map(|corner| moved_to(moved, corner));
                a == b || b == c || c == a
            })
        };
        seam(open, collapses, point, Aabb::around(corners).extent().length())
    }

    /// For each triangle whether its face has to be turned.
    fn turned(&self, point: &impl Fn(u32) -> DVec3) -> Vec<bool> {
        const NONE: u32 = u32::MAX;
        let edges = self.edges();
        // Neighbours across edges of two triangles, and whether the two disagree.
        let mut neighbours = vec![[(NONE, false); 3]; self.corners.len()];
        let mut rim = vec![false; self.corners.len()];
        for uses in edges.chunk_by(|a, b| a.0 >> 1 == b.0 >> 1) {
            if let [a, b] = uses {
                for (t, other) in [(a.1, b.1), (b.1, a.1)] {
                    if let Some(free) = neighbours[t as usize].iter_mut().find(|n| n.0 == NONE) {
                        *free = (other, a.0 == b.0);
                    }
                }
            } else {
                uses.iter().for_each(|edge| rim[edge.1 as usize] = true);
            }
        }
        let mut turn = vec![false; self.corners.len()];
        let mut seen = vec![false; self.corners.len()];
        let mut parts: Vec<Part> = Vec::new();
        for &start in &self.kept {
            if std::mem::replace(&mut seen[start as usize], true) {
                continue;
            }
            let mut part = Part { triangles: vec![start], closed: true, bounds: Aabb::EMPTY };
            let mut next = 0;
            while let Some(&t) = part.triangles.get(next) {
                next += 1;
                part.closed &= !rim[t as usize];
                part.bounds = part.bounds.join(Aabb::around(self.corners[t as usize].map(point)));
                for (other, disagrees) in neighbours[t as usize] {
                    if other != NONE && !std::mem::replace(&mut seen[other as usize], true) {
                        turn[other as usize] = turn[t as usize] ^ disagrees;
                        part.triangles.push(other);
                    }
                }
            }
            parts.push(part);
        }
        let inside = |part: &Part| {
            let Aabb { lower, upper } = part.bounds;
            let around = |b: Aabb| b.lower.cmplt(lower).all() && b.upper.cmpgt(upper).all();
            parts.iter().any(|other| other.closed && around(other.bounds))
        };
        for part in &parts {
            let turned = part.triangles.iter().filter(|&&t| turn[t as usize]).count();
            let flip = if part.closed && !inside(part) {
                let faced = |&t: &u32| {
                    let [a, b, c] = self.corners[t as usize];
                    if turn[t as usize] { [a, c, b] } else { [a, b, c] }
                };
                let all: Vec<[u32; 3]> = part.triangles.iter().map(faced).collect();
                volume(&all, point) < 0.0
            } else {
                2 * turned > part.triangles.len()
            };
            if flip {
                part.triangles.iter().for_each(|&t| turn[t as usize] ^= true);
            }
        }
        turn
    }
}

/// Triangles joined at edges of two.
struct Part {
    triangles: Vec<u32>,
    closed: bool,
    bounds: Aabb,
}

#[cfg(test)]
mod tests {
    use super::super::sphere;
    use super::*;

    fn ball(radius: f64) -> RawMesh {
        sphere(DVec3::new(1.0, 2.0, 3.0), radius, 8, 12)
    }

    fn seen(mesh: &RawMesh) -> Findings {
        examine(&mesh.recentred(DVec3::ZERO))
    }

    fn joined(mut a: RawMesh, b: &RawMesh) -> RawMesh {
        let base = a.positions.len() as u32;
        a.positions.extend(&b.positions);
        a.triangles.extend(b.triangles.iter().map(|t| t.map(|i| base + i)));
        a.normals = None;
        a
    }

    #[test]
    fn a_sound_mesh_has_no_findings_and_stays_as_it_is() {
        let mesh = ball(2.0);
        let found = seen(&mesh);
        assert_eq!(found, Findings { triangles: 168, volume: found.volume, bend: found.bend, ..Findings::default() });
        assert!((found.volume.unwrap() / (4.0 / 3.0 * std::f64::consts::PI * 8.0) - 1.0).abs() < 0.2);
        assert!(!found.can_be_mended() && !found.inside_out());
        let (same, done) = mended(mesh.clone());
        assert_eq!((same.triangles, done), (mesh.triangles, Mended::default()));
    }

    #[test]
    fn every_fault_is_counted_and_mended() {
        let mut mesh = ball(2.0);
        let all = mesh.triangles.clone();
        let extra = [[0, 1, 1], all[5], [all[9][1], all[9][2], all[9][0]], [all[7][0], all[7][2], all[7][1]]];
        mesh.triangles.extend(extra);
        for t in [3, 40, 41] {
            mesh.triangles[t].swap(1, 2);
        }
        mesh.normals = None;
        let found = seen(&mesh);
        assert_eq!((found.zero_area, found.duplicates), (1, 3));
        assert!(found.mixed_edges >= 3 && found.volume.is_none() && found.open_edges == 0);
        let (mended, done) = mended(mesh);
        assert_eq!((done, mended.triangles), (Mended { zero_area: 1, duplicates: 3, turned: 3, welded: None }, all));
    }

    #[test]
    fn vertices_at_one_place_are_one_however_they_are_shared() {
        let mesh = ball(1.0);
        let soup = RawMesh {
            positions: mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]).collect(),
            triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..RawMesh::default()
        };
        let (soup, mesh) = (seen(&soup), seen(&mesh));
        // Edges are added up in another order.
        assert!((soup.bend.unwrap() / mesh.bend.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(Findings { bend: mesh.bend, ..soup }, mesh);
    }

    #[test]
    fn holes_and_edges_of_three_faces_are_counted_and_left() {
        let mut mesh = ball(2.0);
        mesh.normals = None;
        mesh.triangles.remove(20);
        let found = seen(&mesh);
        assert_eq!((found.open_edges, found.volume, found.inside_out()), (3, None, false));
        let tip = mesh.positions.len() as u32;
        mesh.positions.push(DVec3::splat(9.0));
        mesh.triangles.push([mesh.triangles[50][0], mesh.triangles[50][1], tip]);
        let found = seen(&mesh);
        assert_eq!((found.open_edges, found.non_manifold_edges), (5, 1));
        assert_eq!(mended(mesh.clone()).0.triangles, mesh.triangles);
    }

    #[test]
    fn an_inside_out_body_is_turned_and_its_cavity_is_not() {
        let body = ball(2.0).flipped();
        assert!(seen(&body).inside_out());
        assert_eq!(mended(body).0.triangles, ball(2.0).triangles);
        let hollow = joined(ball(2.0), &ball(1.0).flipped());
        assert!(!seen(&hollow).inside_out());
        assert_eq!(mended(hollow).1, Mended::default());
        let both_out = joined(ball(2.0).flipped(), &ball(1.0).flipped());
        assert_eq!(mended(both_out).1.turned, 168, "the outer one alone");
    }

    /// A soup whose corners were rounded apart: recognised, welded on request, and then the body it was.
    #[test]
    fn a_soup_of_nearly_equal_corners_is_welded() {
        let mesh = ball(2.0);
        for (apart, share) in [(1e-6, 1e-6), (1e-5, 1e-5), (1e-4, 1e-4)] {
            let corner = |(k, &i): (usize, &u32)| {
                let turn = (k % 7) as f64 - 3.0;
                mesh.positions[i as usize] + DVec3::new(turn, -turn, 0.5 * turn) * (0.2 * apart)
            };
            let mut soup = RawMesh {
                positions: mesh.triangles.iter().flatten().enumerate().map(corner).collect(),
                triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
                ..RawMesh::default()
            };
            let found = seen(&soup);
            let seam = found.seam.unwrap_or_else(|| panic!("{apart}: {found:?}"));
            assert_eq!((seam.share, seam.closed), (share, found.open_edges), "{apart}");
            assert!(found.open_edges > 400 && found.can_be_mended());
            let (whole, done) = mended(soup.clone());
            assert_eq!(done, Mended { welded: done.welded, ..Mended::default() });
            assert!(done.to_string().contains("corners welded to others within"), "{done}");
            let left = seen(&whole);
            assert_eq!((left.open_edges, left.triangles, left.seam), (0, 168, None), "{apart}");
            assert!((left.volume.unwrap() / seen(&mesh).volume.unwrap() - 1.0).abs() < 1e-3);
            // A hole stays one.
            soup.triangles.truncate(150);
            let (open, _) = mended(soup);
            assert!(seen(&open).open_edges > 0 && seen(&open).seam.is_none());
        }
    }

    #[test]
    fn rims_that_lie_apart_or_belong_to_small_triangles_are_no_seam() {
        let mut mesh = ball(2.0);
        mesh.normals = None;
        mesh.triangles.remove(20);
        assert_eq!(seen(&mesh).seam, None);
        // Two sheets 1 % of their size apart.
        let sheet = |z: f64| super::super::rectangle(DVec3::new(0.0, 0.0, z), DVec3::X, DVec3::Y);
        assert_eq!(seen(&joined(sheet(0.0), &sheet(0.02))).seam, None);
        // A rim of edges shorter than the distances tried.
        let n = 1000_u32;
        let mut fan = RawMesh { positions: vec![DVec3::ZERO], ..RawMesh::default() };
        let at = |i: u32| (f64::from(i) * 1e-5).sin_cos();
        fan.positions.extend((0..=n).map(|i| DVec3::new(at(i).1, at(i).0, 0.0)));
        fan.triangles = (1..=n).map(|i| [0, i, i + 1]).collect();
        assert_eq!(seen(&fan).seam, None);
    }

    #[test]
    fn nothing_at_all_is_no_fault() {
        assert_eq!(seen(&RawMesh::default()), Findings::default());
        assert_eq!(mended(RawMesh::default()).1, Mended::default());
    }
}
