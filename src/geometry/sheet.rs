//! The closed body of an open surface: a sheet of some thickness, of which the surface is the middle.

use super::doctor::welded;
use super::{RawMesh, RawNormals};
use crate::math::{DMat3, DVec3};

/// A sheet with both faces and the rim between them.
#[derive(Clone, Debug)]
pub struct Thick {
    /// Front, back and rim, closed.
    pub mesh: RawMesh,
    /// Where the thickness could not be kept; `None` where it was.
    pub blunted: Option<Blunted>,
}

/// Corners at creases so sharp that the faces' planes meet too far off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blunted {
    /// How many.
    pub corners: usize,
    /// The one where the sheet is thinnest [unit].
    pub at: DVec3,
    /// Its thickness there over the one asked for.
    pub share: f64,
}

/// Why a surface makes no sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoSheet {
    /// No triangle has an area.
    Empty,
    /// So many of its parts, of so many, have no rim.
    Closed(usize, usize),
    /// Edges of three triangles or more, and a point of one [unit].
    ThreeFaces(usize, DVec3),
    /// It has one side only, as a Möbius band; a point of the edge where that shows [unit].
    OneSided(DVec3),
    /// It bends, near this point [unit], with a radius below half the thickness.
    Bends(DVec3),
}

/// The planes of the faces at a corner meet at most this far from it, in half thicknesses: at a crease that turns by 120 degrees.
pub const MITER_LIMIT: f64 = 2.0;
/// Weight of the mean normal where the faces' planes leave a direction open.
const TIE: f64 = 1e-6;

/// Triangles without two corners in one place, and how they hang together.
struct Surface {
    /// Numbers in the mesh; turned so that neighbours agree.
    triangles: Vec<(usize, bool)>,
    /// First vertex at each one's place.
    place: Vec<u32>,
}

/// Lower corner, higher corner, whether it is run along downwards, triangle.
type Edge = (u32, u32, bool, usize);

impl Surface {
    fn new(mesh: &RawMesh) -> Result<(Self, Vec<Edge>), NoSheet> {
        let place = welded(mesh.positions.len(), |i| mesh.positions[i as usize], |_| 0);
        let corners = |t: usize| mesh.triangles[t].map(|i| place[i as usize]);
        let whole = |t: &usize| {
            let [a, b, c] = corners(*t);
            a != b && b != c && c != a
        };
        let kept: Vec<usize> = (0..mesh.triangles.len()).filter(whole).collect();
        if kept.iter().all(|&t| scaled_normal(mesh, mesh.triangles[t]) == DVec3::ZERO) {
            return Err(NoSheet::Empty);
        }
        let mut edges: Vec<Edge> = Vec::with_capacity(3 * kept.len());
        for (number, &t) in kept.iter().enumerate() {
            let c = corners(t);
            edges.extend([[0, 1], [1, 2], [2, 0]].map(|[i, j]| {
                let (from, to) = (c[i], c[j]);
                (from.min(to), from.max(to), from > to, number)
            }));
        }
        edges.sort_unstable();
        let many: Vec<&[Edge]> = uses(&edges).filter(|uses| uses.len() > 2).collect();
        if let Some(first) = many.first() {
            return Err(NoSheet::ThreeFaces(many.len(), middle(mesh, &first[0])));
        }
        let turned = turned(mesh, kept.len(), &edges)?;
        Ok((Self { triangles: kept.into_iter().zip(turned).collect(), place }, edges))
    }
}

/// Edges with the same corners.
fn uses(edges: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
}

fn middle(mesh: &RawMesh, edge: &Edge) -> DVec3 {
    0.5 * (mesh.positions[edge.0 as usize] + mesh.positions[edge.1 as usize])
}

fn scaled_normal(mesh: &RawMesh, triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
    (b - a).cross(c - a)
}

/// Which triangles to turn for neighbours to run along their edge in opposite directions; the first of each part stays.
fn turned(mesh: &RawMesh, count: usize, edges: &[Edge]) -> Result<Vec<bool>, NoSheet> {
    let mut beside: Vec<Vec<(usize, bool, usize)>> = vec![Vec::new(); count];
    let mut open = vec![false; count];
    for (number, uses) in uses(edges).enumerate() {
        match uses {
            [a, b] => {
                let alike = a.2 == b.2;
                beside[a.3].push((b.3, alike, number));
                beside[b.3].push((a.3, alike, number));
            }
            _ => open[uses[0].3] = true,
        }
    }
    let mut turn: Vec<Option<bool>> = vec![None; count];
    let (mut closed, mut parts) = (0, 0);
    for first in 0..count {
        if turn[first].is_some() {
            continue;
        }
        turn[first] = Some(false);
        let (mut next, mut has_rim) = (vec![first], false);
        while let Some(t) = next.pop() {
            has_rim |= open[t];
            let own = turn[t] == Some(true);
            for &(other, alike, number) in &beside[t] {
                match turn[other] {
                    None => {
                        turn[other] = Some(own != alike);
                        next.push(other);
                    }
                    Some(there) if there != (own != alike) => {
                        let edge = uses(edges).nth(number).map_or(DVec3::ZERO, |uses| middle(mesh, &uses[0]));
                        return Err(NoSheet::OneSided(edge));
                    }
                    Some(_) => {}
                }
            }
        }
        (closed, parts) = (closed + usize::from(!has_rim), parts + 1);
    }
    if closed > 0 {
        return Err(NoSheet::Closed(closed, parts));
    }
    Ok(turn.into_iter().map(|turn| turn == Some(true)).collect())
}

/// The faces around a corner: sums over them, weighted by their angles there.
#[derive(Clone, Copy)]
struct Around {
    weight: f64,
    normal: DVec3,
    /// Of n nᵀ.
    square: DMat3,
}

impl Around {
    const NONE: Self = Self { weight: 0.0, normal: DVec3::ZERO, square: DMat3::ZERO };

    fn add(&mut self, n: DVec3, angle: f64) {
        self.weight += angle;
        self.normal += n * angle;
        self.square += DMat3::from_cols(n * n.x, n * n.y, n * n.z) * angle;
    }

    /// Where the planes of all faces meet that are moved by 1 along their normals, as nearly as they do; `None` where the faces
    /// look apart.
    fn miter(&self) -> Option<DVec3> {
        let mean = (self.normal / self.weight).try_normalize()?;
        let along = mean.dot(self.normal);
        let square = mean.dot(self.square * mean);
        if along <= 1e-6 * self.weight {
            return None;
        }
        // The best place along the mean normal; then the best of all, which the planes of a flat corner leave open.
        let start = mean * (along / square);
        let sides = self.square * (1.0 / self.weight) + DMat3::IDENTITY * TIE;
        Some(sides.inverse() * (self.normal / self.weight + start * TIE))
    }
}

/// `mesh`, an open surface, as the middle of a sheet of `thickness` \[unit\], above 0: its vertices moved by half of it to both
/// sides, along the mean of the normals around them weighted by angle, as far as it takes for the faces to be that far apart;
/// and quads along every rim. Vertices at exactly the same place count as one.
///
/// # Errors
/// A surface that is closed, has no area, hangs together at edges of three faces, has one side only, or bends too sharply.
pub fn thickened(mesh: &RawMesh, thickness: f64) -> Result<Thick, NoSheet> {
    let (surface, edges) = Surface::new(mesh)?;
    let front: Vec<[u32; 3]> = surface.triangles.iter().map(|&(t, turn)| pick(turn, mesh.triangles[t])).collect();
    let mut around = vec![Around::NONE; mesh.positions.len()];
    for &triangle in &front {
        let Some(n) = scaled_normal(mesh, triangle).try_normalize() else { continue };
        let p = triangle.map(|i| mesh.positions[i as usize]);
        for corner in 0..3 {
            let (u, v) = (p[(corner + 1) % 3] - p[corner], p[(corner + 2) % 3] - p[corner]);
            let angle = u.cross(v).length().atan2(u.dot(v));
            around[surface.place[triangle[corner] as usize] as usize].add(n, angle);
        }
    }
    let mut moved = vec![DVec3::ZERO; mesh.positions.len()];
    let mut blunted: Option<Blunted> = None;
    for ((&p, around), moved) in mesh.positions.iter().zip(&around).zip(&mut moved) {
        if around.weight == 0.0 {
            continue;
        }
        let miter = around.miter().ok_or(NoSheet::Bends(p))?;
        let length = miter.length();
        *moved = miter * (MITER_LIMIT / length).min(1.0);
        if length > MITER_LIMIT {
            let (share, corners) = (MITER_LIMIT / length, blunted.map_or(0, |b| b.corners) + 1);
            let thinnest = blunted.filter(|b| b.share <= share);
            blunted = Some(Blunted { corners, ..thinnest.unwrap_or(Blunted { corners, at: p, share }) });
        }
    }
    let half = |i: usize| moved[surface.place[i] as usize] * (0.5 * thickness);
    let sides = [1.0, -1.0].map(|side| (0..moved.len()).map(move |i| (i, side)));
    let positions: Vec<DVec3> =
        sides.into_iter().flatten().map(|(i, side)| mesh.positions[i] + half(i) * side).collect();
    let count = mesh.positions.len() as u32;
    let back = |i: u32| count + i;
    let body = RawMesh { positions, ..RawMesh::default() };
    for &triangle in &front {
        let n = scaled_normal(mesh, triangle);
        let kept = |moved: [u32; 3]| n == DVec3::ZERO || scaled_normal(&body, moved).dot(n) > 0.0;
        if !kept(triangle) || !kept(triangle.map(back)) {
            return Err(NoSheet::Bends(triangle.map(|i| mesh.positions[i as usize]).into_iter().sum::<DVec3>() / 3.0));
        }
    }
    let mut triangles = front.clone();
    triangles.extend(front.iter().map(|&[a, b, c]| [a, c, b].map(back)));
    let mut uv = mesh.uv.as_ref().map(|uv| {
        let own: Vec<_> = surface.triangles.iter().map(|&(t, turn)| uv[t].map(|uv| pick(turn, uv))).collect();
        let behind = own.iter().map(|uv| uv.map(|[a, b, c]| [a, c, b]));
        own.iter().copied().chain(behind).collect::<Vec<_>>()
    });
    for uses in uses(&edges).filter(|uses| uses.len() == 1) {
        let (low, high, _, number) = uses[0];
        let Some([a, b]) = run_along(front[number], &surface.place, [low, high]) else { continue };
        triangles.extend([[b, a, back(a)], [b, back(a), back(b)]]);
        if let Some(uv) = &mut uv {
            let own = uv[number];
            let at = |i: u32| front[number].iter().position(|k| *k == i).zip(own).map_or([0.0; 2], |(k, own)| own[k]);
            let (a, b) = (at(a), at(b));
            uv.extend([own.map(|_| [b, a, a]), own.map(|_| [b, a, b])]);
        }
    }
    let normals = mesh.normals.as_ref().map(|normals| {
        let count = normals.vectors.len() as u32;
        let own: Vec<Option<[u32; 3]>> =
            surface.triangles.iter().map(|&(t, turn)| normals.triangles[t].map(|n| pick(turn, n))).collect();
        let behind = own.iter().map(|n| n.map(|[a, b, c]| [a, c, b].map(|i| count + i)));
        let mut all: Vec<Option<[u32; 3]>> = own.iter().copied().chain(behind).collect();
        all.resize(triangles.len(), None);
        let vectors = normals.vectors.iter().copied().chain(normals.vectors.iter().map(|n| -*n)).collect();
        RawNormals { vectors, triangles: all }
    });
    Ok(Thick { mesh: RawMesh { triangles, normals, uv, remarks: mesh.remarks.clone(), ..body }, blunted })
}

/// What belongs to the corners of a triangle, of one that is turned round in the other order.
fn pick<T>(turn: bool, [a, b, c]: [T; 3]) -> [T; 3] {
    if turn { [a, c, b] } else { [a, b, c] }
}

/// The edge of a triangle whose corners are at two places, in its own direction.
fn run_along(triangle: [u32; 3], place: &[u32], ends: [u32; 2]) -> Option<[u32; 2]> {
    let [a, b, c] = triangle;
    let there = |i: u32| ends.contains(&place[i as usize]);
    [[a, b], [b, c], [c, a]].into_iter().find(|[i, j]| there(*i) && there(*j))
}
