//! Corners that should be one: rims that lie along each other, as in a soup of triangles whose corners were rounded apart.

use crate::math::DVec3;
use serde::Serialize;
use std::collections::HashMap;

/// Distances tried, as shares of the diagonal of the box around the mesh. Larger ones would close what is open on purpose.
const SHARES: [f64; 4] = [1e-7, 1e-6, 1e-5, 1e-4];

/// Welding is worth a word where it closes this share of the edges that belong to one triangle alone, at least.
const WORTH: f64 = 0.1;

/// Rims that lie along each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seam {
    /// Corners on rims within this distance of each other are one [unit].
    pub within: f64,
    /// The same as a share of the diagonal of the box around the mesh.
    pub share: f64,
    /// Corners that fall together with another.
    pub corners: usize,
    /// Edges of one triangle alone that find their other triangle.
    pub closed: usize,
}

/// The least distance at which welding corners on rims closes as much as any does, with the corner that stands for each
/// corner then. None where that would close next to nothing; distances that take an edge of a triangle away are not tried.
/// `open` are the edges of one triangle alone; `size` is the diagonal of the box around the mesh [unit].
pub(super) fn seam(
    open: &[[u32; 2]],
    collapses: impl Fn(&HashMap<u32, u32>) -> bool,
    point: impl Fn(u32) -> DVec3,
    size: f64,
) -> Option<(Seam, HashMap<u32, u32>)> {
    let mut rim: Vec<u32> = open.iter().flatten().copied().collect();
    rim.sort_unstable();
    rim.dedup();
    let mut best: Option<(Seam, HashMap<u32, u32>)> = None;
    for share in SHARES {
        let within = share * size;
        let moved = clusters(&rim, &point, within);
        if moved.is_empty() {
            continue;
        }
        if collapses(&moved) {
            break;
        }
        let closed = open.len() - left_open(open, &moved);
        if closed > best.as_ref().map_or(0, |(seam, _)| seam.closed) {
            best = Some((Seam { within, share, corners: moved.len(), closed }, moved));
        }
    }
    best.filter(|(seam, _)| seam.closed as f64 >= WORTH * open.len() as f64)
}

/// The corner that `corner` becomes.
pub(super) fn moved_to(moved: &HashMap<u32, u32>, corner: u32) -> u32 {
    moved.get(&corner).copied().unwrap_or(corner)
}

/// Edges that still belong to one triangle alone.
fn left_open(open: &[[u32; 2]], moved: &HashMap<u32, u32>) -> usize {
    let mut edges: Vec<[u32; 2]> = open
        .iter()
        .map(|edge| {
            let [a, b] = edge.map(|corner| moved_to(moved, corner));
            [a.min(b), a.max(b)]
        })
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|uses| uses.len() == 1).count()
}

/// For each corner that lies within a distance of an earlier one that stands for itself, the nearest of those.
fn clusters(corners: &[u32], point: &impl Fn(u32) -> DVec3, within: f64) -> HashMap<u32, u32> {
    // Cells so large that most corners look into few of them.
    let cell = |p: DVec3| (p / (4.0 * within)).floor().to_array().map(|x| x as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut moved = HashMap::new();
    for &corner in corners {
        let p = point(corner);
        let (lo, hi) = (cell(p - DVec3::splat(within)), cell(p + DVec3::splat(within)));
        let mut nearest: Option<(f64, u32)> = None;
        for x in lo[0]..=hi[0] {
            for y in lo[1]..=hi[1] {
                for z in lo[2]..=hi[2] {
                    for &other in cells.get(&[x, y, z]).into_iter().flatten() {
                        let distance = point(other).distance(p);
                        if distance <= within && nearest.is_none_or(|(least, _)| distance < least) {
                            nearest = Some((distance, other));
                        }
                    }
                }
            }
        }
        match nearest {
            Some((_, other)) => drop(moved.insert(corner, other)),
            None => cells.entry(cell(p)).or_default().push(corner),
        }
    }
    moved
}
