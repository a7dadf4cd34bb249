//! Triangles inside a polygon of the plane, by a constrained Delaunay triangulation and its winding number.

use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::HashMap;

/// A share of the area that is rounding: a corner that touches an edge of its own polygon lies a little beyond it.
const NOTHING: f64 = 1e-9;

/// The triangles inside the polygon, and whether it crosses or covers itself. None where its numbers are too large.
pub(super) fn fill(polygon: &[Point2<f64>], out: &mut Vec<[u32; 3]>) -> Option<bool> {
    // A place that comes up twice, as at the bridge to a hole, is one vertex.
    let mut vertices: Vec<Point2<f64>> = Vec::with_capacity(polygon.len());
    let mut corner_of: Vec<u32> = Vec::with_capacity(polygon.len());
    let mut at = HashMap::with_capacity(polygon.len());
    let ids: Vec<usize> = (0_u32..)
        .zip(polygon)
        .map(|(corner, p)| {
            // + 0.0 makes -0 and 0 one place.
            *at.entry([p.x + 0.0, p.y + 0.0].map(f64::to_bits)).or_insert_with(|| {
                corner_of.push(corner);
                vertices.push(*p);
                vertices.len() - 1
            })
        })
        .collect();
    type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;
    let mut cdt = Cdt::bulk_load_cdt(vertices, Vec::new()).ok()?;
    let vertex = spade::handles::FixedVertexHandle::from_index;
    // How often the polygon runs along an edge, less how often against it.
    let mut runs: HashMap<(usize, usize), i32> = HashMap::with_capacity(2 * polygon.len());
    let mut conflict = false;
    for (i, &from) in ids.iter().enumerate() {
        let to = ids[(i + 1) % ids.len()];
        if from == to {
            continue;
        }
        let mut end = from;
        for edge in cdt.try_add_constraint(vertex(from), vertex(to)) {
            let [a, b] = cdt.directed_edge(edge).vertices().map(|v| v.fix().index());
            *runs.entry((a, b)).or_default() += 1;
            *runs.entry((b, a)).or_default() -= 1;
            end = b;
        }
        conflict |= end != to;
    }
    let winding = if conflict {
        let rows = Rows::new(polygon);
        cdt.inner_faces().map(|face| rows.winding(centroid(face.positions()))).collect()
    } else {
        windings(&cdt, &runs)
    };
    let (mut filled, mut covered) = (0.0, 0.0);
    for (face, winding) in cdt.inner_faces().zip(winding) {
        let [a, b, c] = face.positions();
        let area = 0.5 * cross(a, b, c);
        filled += if winding != 0 { area } else { 0.0 };
        covered += if (0..=1).contains(&winding) { 0.0 } else { area };
        let [a, b, c] = face.vertices().map(|v| corner_of[v.fix().index()]);
        match winding {
            0 => {}
            1.. => out.push([a, b, c]),
            _ => out.push([a, c, b]),
        }
    }
    let (first, rest) = (polygon[0], polygon[1..].windows(2));
    let enclosed = 0.5 * rest.map(|p| cross(first, p[0], p[1])).sum::<f64>();
    let crossed = if conflict { (filled - enclosed).abs() } else { 0.0 };
    Some(covered.max(crossed) > NOTHING * filled)
}

/// The winding number of each inner face, in their order: from one to the next it changes by the runs along the edge between.
fn windings(cdt: &ConstrainedDelaunayTriangulation<Point2<f64>>, runs: &HashMap<(usize, usize), i32>) -> Vec<i32> {
    let mut winding: Vec<Option<i32>> = vec![None; cdt.num_all_faces()];
    let mut next = vec![cdt.outer_face().fix()];
    winding[cdt.outer_face().fix().index()] = Some(0);
    // From the outside inwards over the hull, then from face to face.
    let hull: Vec<_> = cdt.convex_hull().map(|edge| edge.fix()).collect();
    let step = |edge: spade::handles::FixedDirectedEdgeHandle, winding: &mut Vec<Option<i32>>, next: &mut Vec<_>| {
        let edge = cdt.directed_edge(edge);
        let [a, b] = edge.vertices().map(|v| v.fix().index());
        let (here, there) = (edge.face().fix(), edge.rev().face().fix());
        if winding[there.index()].is_none() {
            let change = runs.get(&(a, b)).copied().unwrap_or(0);
            winding[there.index()] = winding[here.index()].map(|w| w - change);
            next.push(there);
        }
    };
    next.clear();
    hull.into_iter().for_each(|edge| step(edge, &mut winding, &mut next));
    while let Some(face) = next.pop() {
        let Some(face) = cdt.face(face).as_inner() else { continue };
        for edge in face.adjacent_edges() {
            step(edge.fix(), &mut winding, &mut next);
        }
    }
    cdt.inner_faces().map(|face| winding[face.fix().index()].unwrap_or(0)).collect()
}

fn centroid(p: [Point2<f64>; 3]) -> Point2<f64> {
    Point2::new((p[0].x + p[1].x + p[2].x) / 3.0, (p[0].y + p[1].y + p[2].y) / 3.0)
}

fn cross(a: Point2<f64>, b: Point2<f64>, c: Point2<f64>) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

/// The edges of a polygon by the heights that they reach over: what a horizontal ray may meet.
struct Rows {
    low: f64,
    per_height: f64,
    rows: Vec<Vec<[Point2<f64>; 2]>>,
}

impl Rows {
    const COUNT: usize = 64;

    fn new(polygon: &[Point2<f64>]) -> Self {
        let (low, high) =
            polygon.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.y), high.max(p.y)));
        let per_height = Self::COUNT as f64 / (high - low);
        let mut rows = Self { low, per_height, rows: vec![Vec::new(); Self::COUNT] };
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let (from, to) = (rows.row(a.y.min(b.y)), rows.row(a.y.max(b.y)));
            rows.rows[from..=to].iter_mut().for_each(|row| row.push([a, b]));
        }
        rows
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low) * self.per_height) as usize).min(Self::COUNT - 1)
    }

    /// How often the polygon goes round `p`, counter-clockwise.
    fn winding(&self, p: Point2<f64>) -> i32 {
        let row = &self.rows[self.row(p.y)];
        row.iter()
            .map(|&[a, b]| match (a.y <= p.y, b.y <= p.y) {
                (true, false) if cross(a, b, p) > 0.0 => 1,
                (false, true) if cross(a, b, p) < 0.0 => -1,
                _ => 0,
            })
            .sum()
    }
}
